//! What is a plan: single steps with the stage's motions, when each happens, and what is expected of it.

use super::bench::Stream;
use super::violation::Violation;
use crate::acquire::AcquireError;
use crate::acquire::protocol::PlannedStep;
use crate::device::{AXES, Motion};

/// Part of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Moving clear of the phantom, from place to place.
    Travel,
    /// Standing clear of the phantom.
    Rest,
    /// Down to the run-up.
    Approach,
    /// From the run-up through the surface to the depth.
    Press,
    /// Standing at the depth.
    Hold,
    /// To or fro inside the phantom.
    Cycle,
    /// Back out to the run-up.
    Retreat,
}

impl Phase {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Travel => "travel",
            Self::Rest => "rest",
            Self::Approach => "approach",
            Self::Press => "press",
            Self::Hold => "hold",
            Self::Cycle => "cycle",
            Self::Retreat => "retreat",
        }
    }
}

/// One motion of the stage, or one time that it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// What it belongs to.
    pub phase: Phase,
    /// Where the stage is when it begins (m, stage coordinates).
    pub from_m: [f64; AXES],
    /// The motion; none where the stage stands.
    pub motion: Option<Motion>,
    /// Depth along the poke's direction at its start and at its expected end (m), negative above the site; none in travel.
    pub depth_m: Option<[f64; 2]>,
    /// When it begins, from the start of the plan (s).
    pub start_s: f64,
    /// How long it takes (s); of a press until a force, how long until the force is expected.
    pub duration_s: f64,
}

impl Leg {
    /// When it ends (s).
    pub fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }
}

/// What is expected of a contact with the phantom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// First instant (s).
    pub start_s: f64,
    /// Last instant (s).
    pub end_s: f64,
    /// The largest depth that is allowed (m).
    pub depth_m: f64,
    /// Least and greatest force that may be reached (N).
    pub force_n: [f64; 2],
    /// How far the stage goes on when it is stopped at the poke's speed (m).
    pub overshoot_m: f64,
    /// By how much the force rises on that at most (N).
    pub overshoot_n: f64,
}

/// What homing and the zero of the force take before the first step, recorded like all that follows (s): 7.1 and 7.6 s in two runs of
/// `rigs/sim-camera.toml`. A stage that has homed takes less, a longer one more.
pub(super) const BEFORE_S: f64 = 7.5;

/// One step with its motions.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanStep {
    /// What was asked for.
    pub step: PlannedStep,
    /// When it begins (s).
    pub start_s: f64,
    /// How long it takes (s); a question takes none.
    pub duration_s: f64,
    /// Its motions in order. Empty where nothing moves, and where nothing can be moved.
    pub legs: Vec<Leg>,
    /// What is expected, where the phantom is touched.
    pub contact: Option<Contact>,
}

/// What the stage is to do, when, and everything that speaks against it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Name of the protocol.
    pub name: String,
    /// Steps in order.
    pub steps: Vec<PlanStep>,
    /// What speaks against it.
    pub violations: Vec<Violation>,
    /// How long it takes without the operator's answers (s).
    pub duration_s: f64,
    /// What is recorded all the time.
    pub streams: Vec<Stream>,
}

impl Plan {
    /// What will be stored (bytes), with what is recorded before the first step. An estimate.
    pub fn data_bytes(&self) -> f64 {
        let a_second: f64 = self.streams.iter().map(|stream| stream.rate_hz * stream.bytes).sum();
        a_second * (self.duration_s + BEFORE_S)
    }

    /// How many pokes touch the phantom.
    pub fn pokes(&self) -> usize {
        self.steps.iter().filter(|step| step.step.poke.is_some()).count()
    }

    /// Number of the last poke.
    pub fn last_poke(&self) -> usize {
        self.steps.iter().filter_map(|step| step.step.poke).max().unwrap_or(0) as usize
    }

    /// The plan as one that may be run.
    ///
    /// # Errors
    /// [`AcquireError::Plan`] with all violations.
    pub fn checked(self) -> Result<CheckedPlan, AcquireError> {
        if self.violations.is_empty() {
            Ok(CheckedPlan(self))
        } else {
            Err(AcquireError::Plan { violations: self.violations })
        }
    }
}

/// A plan against which nothing speaks. The only kind that is run.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedPlan(Plan);

impl CheckedPlan {
    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.0
    }
}
