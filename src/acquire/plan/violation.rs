//! What speaks against a plan: which step, what, and by how much.

use crate::acquire::protocol::{Kind, PlannedStep, StepId};
use crate::device::UnreachableSite;
use std::fmt;

/// One thing that the bench cannot or must not do.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// The step; none where it is the bench itself.
    pub at: Option<At>,
    /// In how many repeats of the step at this place.
    pub times: usize,
    /// What it is.
    pub breach: Breach,
}

/// A step, as a person finds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct At {
    /// Its name.
    pub id: StepId,
    /// Its kind.
    pub kind: Kind,
    /// Line of the protocol.
    pub line: usize,
    /// Number among the pokes.
    pub poke: Option<u32>,
}

impl From<&PlannedStep> for At {
    fn from(step: &PlannedStep) -> Self {
        Self { id: step.id, kind: step.kind, line: step.line, poke: step.poke }
    }
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, kind, line, poke } = self;
        write!(f, "step {id} ({}, line {line})", kind.name())?;
        poke.map_or(Ok(()), |poke| write!(f, ", poke {poke}"))
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.at {
            None => f.write_str("bench")?,
            Some(at) => at.fmt(f)?,
        }
        write!(f, ": {}", self.breach)?;
        if self.times > 1 { write!(f, " (in {} repeats)", self.times) } else { Ok(()) }
    }
}

/// Channels of the force sensor with their units.
pub(super) const CHANNELS: [(&str, &str); 6] =
    [("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Tx", "N·m"), ("Ty", "N·m"), ("Tz", "N·m")];

/// What the bench cannot or must not do. Channels count Fx, Fy, Fz, Tx, Ty, Tz from 0 in the sensor's frame.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Breach {
    /// A figure of the bench makes no sense.
    #[error("{figure} is {value}; expected {expected}")]
    Figure {
        /// Which, with its unit.
        figure: &'static str,
        /// Its value, in SI.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A limit that the sensor cannot measure.
    #[error(
        "the limit of {} is {limit} {unit}, the sensor measures up to {range} {unit}", CHANNELS[*channel].0, unit = CHANNELS[*channel].1
    )]
    LimitAboveRange {
        /// Channel.
        channel: usize,
        /// Where the stage would be stopped (N, N·m).
        limit: f64,
        /// What the sensor measures (N, N·m).
        range: f64,
    },
    /// A place beside the plane of motion.
    #[error("{0}")]
    Unreachable(UnreachableSite),
    /// A direction that does not lead in.
    #[error(
        "its direction leans {lean_deg:.0}° from straight into the phantom; at most {most_deg:.0}° are made"
    )]
    Leaning {
        /// Angle to the normal of the face (°).
        lean_deg: f64,
        /// What is made (°).
        most_deg: f64,
    },
    /// A motion that leaves the travel.
    #[error(
        "its {phase} takes axis {axis} to {:.3} mm, outside its travel from {:.3} to {:.3} mm",
        target_m * 1e3, travel_m[0] * 1e3, travel_m[1] * 1e3
    )]
    OutsideTravel {
        /// Part of the step.
        phase: &'static str,
        /// Axis, from 0.
        axis: usize,
        /// Where it would go (m).
        target_m: f64,
        /// Where it may go (m).
        travel_m: [f64; 2],
    },
    /// A speed that an axis does not allow.
    #[error("its {phase} moves axis {axis} at {:.3} mm/s; the stage allows {:.3} mm/s", asked_m_s * 1e3, most_m_s * 1e3)]
    TooFast {
        /// Part of the step.
        phase: &'static str,
        /// Axis, from 0.
        axis: usize,
        /// What was asked for (m/s).
        asked_m_s: f64,
        /// What is allowed (m/s).
        most_m_s: f64,
    },
    /// An acceleration that an axis does not allow.
    #[error(
        "its {phase} accelerates axis {axis} at {:.1} mm/s²; the stage allows {:.1} mm/s²",
        asked_m_s2 * 1e3, most_m_s2 * 1e3
    )]
    TooMuchAcceleration {
        /// Part of the step.
        phase: &'static str,
        /// Axis, from 0.
        axis: usize,
        /// What was asked for (m/s²).
        asked_m_s2: f64,
        /// What is allowed (m/s²).
        most_m_s2: f64,
    },
    /// A way through the phantom.
    #[error(
        "its {phase} from ({}) to ({}) mm comes closer to the phantom than {:.2} mm", place(from_m), place(to_m), keep_m * 1e3
    )]
    Ploughs {
        /// Part of the step.
        phase: &'static str,
        /// Where it begins (m, phantom frame).
        from_m: [f64; 3],
        /// Where it ends (m, phantom frame).
        to_m: [f64; 3],
        /// What is to be kept (m).
        keep_m: f64,
    },
    /// A site that is not on the surface.
    #[error(
        "its site ({}) mm lies {:.2} mm {} the phantom's surface; at most {:.2} mm are taken for none",
        place(site_m), height_m.abs() * 1e3, if *height_m > 0.0 { "above" } else { "below" }, tolerance_m * 1e3
    )]
    OffSurface {
        /// The site (m, phantom frame).
        site_m: [f64; 3],
        /// Height above the surface (m).
        height_m: f64,
        /// What is taken for none (m).
        tolerance_m: f64,
    },
    /// A tip that hangs over an edge.
    #[error("the tip at ({}) mm hangs {:.2} mm over an edge of the phantom", place(site_m), over_m * 1e3)]
    OverEdge {
        /// The site (m, phantom frame).
        site_m: [f64; 3],
        /// By how much (m).
        over_m: f64,
    },
    /// A depth that the phantom does not have.
    #[error("it goes {:.2} mm deep; the phantom is {:.2} mm thick there", depth_m * 1e3, thickness_m * 1e3)]
    TooDeep {
        /// The largest depth (m).
        depth_m: f64,
        /// Thickness along the direction (m).
        thickness_m: f64,
    },
    /// Another tip than the one that is mounted.
    #[error("it is meant for a tip of radius {:.2} mm; mounted is one of {:.2} mm", asked_m * 1e3, mounted_m * 1e3)]
    OtherTip {
        /// What it is meant for (m).
        asked_m: f64,
        /// What is mounted (m).
        mounted_m: f64,
    },
    /// A poke that is expected to be stopped for its force.
    #[error(
        "{} may reach {predicted:.3} {unit} at {:.2} mm; the stage is stopped at {limit} {unit}",
        CHANNELS[*channel].0, depth_m * 1e3, unit = CHANNELS[*channel].1
    )]
    ForceAboveLimit {
        /// Channel.
        channel: usize,
        /// What may be reached (N, N·m).
        predicted: f64,
        /// The depth there (m).
        depth_m: f64,
        /// Where the stage is stopped (N, N·m).
        limit: f64,
    },
    /// A speed from which the stage cannot be stopped before the sensor's range ends.
    #[error(
        "stopped at {:.3} mm/s it goes {:.3} mm on, and {} by up to {over:.3} {unit} above the limit of {limit} {unit}; the sensor measures \
         up to {range} {unit}",
        speed_m_s * 1e3, overshoot_m * 1e3, CHANNELS[*channel].0, unit = CHANNELS[*channel].1
    )]
    Overshoot {
        /// Channel.
        channel: usize,
        /// Speed (m/s).
        speed_m_s: f64,
        /// Distance after the limit (m).
        overshoot_m: f64,
        /// Rise on it (N, N·m).
        over: f64,
        /// Where the stop begins (N, N·m).
        limit: f64,
        /// What the sensor measures (N, N·m).
        range: f64,
    },
    /// Too little rest since the contact before.
    #[error("it touches {rest_s:.2} s after the contact before; expected at least {least_s:.2} s")]
    TooSoon {
        /// Time since the end of the contact before (s).
        rest_s: f64,
        /// What is to be kept (s).
        least_s: f64,
    },
}

fn place(m: &[f64; 3]) -> String {
    m.map(|c| format!("{:.2}", c * 1e3)).join(", ")
}

/// Adds a violation; one that a repeat at the same place has already is counted there.
pub(super) fn add(violations: &mut Vec<Violation>, at: Option<At>, breach: Breach) {
    let place = |at: &Option<At>| at.map(|at| (at.id.step, at.id.place));
    let same = violations.iter_mut().rev().take_while(|v| place(&v.at) == place(&at));
    match same.into_iter().find(|v| v.breach == breach) {
        Some(known) => known.times += 1,
        None => violations.push(Violation { at, times: 1, breach }),
    }
}
