//! What a diagnosis says: is there a mismatch, where, which physics explains it, how much it changes, how surely.

use super::large::StiffeningLaw;
use super::physics::Physics;
use crate::geometry::Vec3;
use crate::observation::PlannedPoke;

/// The answer to "why do model and recording differ".
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// Name of the recording.
    pub recording: String,
    /// Whether the baseline leaves more than noise and elements can, and where.
    pub mismatch: Mismatch,
    /// What is to blame.
    pub verdict: Verdict,
    /// Parameters of what is blamed, in the verdict's order.
    pub parameters: Vec<Found>,
    /// Everything that was tried, the most probable first.
    pub candidates: Vec<Candidate>,
    /// The model that leaves nothing out.
    pub baseline: Reading,
    /// The model with what is blamed; the baseline again where nothing is.
    pub extended: Reading,
    /// The poke that would tell more; none where nothing is left to be told.
    pub next_poke: Option<NextPoke>,
    /// Every poke, predicted by fits that did not see it: for the page's curves.
    pub curves: Vec<Curve>,
    /// What the recording cannot tell, one sentence each.
    pub remarks: Vec<String>,
}

/// Whether the baseline leaves more than noise and elements can, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Mismatch {
    /// Whether there is one, at the false-alarm rate of the settings.
    pub detected: bool,
    /// Probability of a misfit as large by chance.
    pub p_value: f64,
    /// Channels that show it, the strongest first.
    pub channels: Vec<Channel>,
    /// Numbers of the pokes that show it, the strongest first.
    pub pokes: Vec<u32>,
    /// Phases of a poke that show it, the strongest first.
    pub phases: Vec<Phase>,
    /// Where on the phantom; `None`: nowhere in particular.
    pub region: Option<Region>,
    /// What the missing thing must be like, one sentence each.
    pub properties: Vec<String>,
}

/// One kind of reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channel {
    /// Force along the poke.
    ForceAlong,
    /// Force across it.
    ForceAcross,
    /// Markers along an axis of the phantom frame (0 to 2).
    Markers(u8),
}

/// Part of a poke.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// The tip goes in.
    Approach,
    /// It stays.
    Hold,
    /// It goes out.
    Retreat,
    /// Between pokes.
    Rest,
}

/// Place on the phantom (phantom frame, m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Middle.
    pub centroid_m: Vec3,
    /// Radius about it that holds most of the misfit.
    pub radius_m: f64,
}

/// What is to blame.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Entries of the catalogue, the one that explains most first. Empty when the baseline explains the recording, or
    /// when it does not and entries alone do not either ([`Verdict::unexplained`]).
    pub physics: Vec<Physics>,
    /// The baseline does not explain the recording, and entries alone do not either.
    pub unexplained: bool,
    /// The effects that explain it together though not all of them are entries ([`Verdict::unexplained`]); empty where nothing is known that does.
    pub explained_by: Vec<Physics>,
    /// Probability that the verdict is right: what speaks for it, weighed by hand. `prove` shows how well.
    pub confidence: f64,
    /// Entries that the recording cannot tell from those named.
    pub ambiguous_with: Vec<Physics>,
    /// What the confidence was made of; none where nothing was believed to lower the misfit.
    pub evidence: Option<Evidence>,
}

impl Verdict {
    /// What is blamed, entries of the catalogue or not.
    pub fn blamed(&self) -> &[Physics] {
        if self.physics.is_empty() { &self.explained_by } else { &self.physics }
    }
}

/// What speaks for the reading that explains most, named or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Share of what was left beyond noise that it removes.
    pub explained: f64,
    /// Fall of the sum of squares, over what an effect must lower it by to be believed: of the effect that earns least.
    pub gain: f64,
    /// What the best other reading lacks of that fall, as a share; or, where that is more, of how much better pokes are predicted that a fit has
    /// not seen.
    pub margin: f64,
    /// What it leaves beyond noise in the plainest channel (standard deviations).
    pub left: f64,
    /// Effects that it is made of.
    pub effects: usize,
}

/// Parameters of one entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The entry.
    pub physics: Physics,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Which law they are of, where the catalogue has several.
    pub law: Option<StiffeningLaw>,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Id of the catalogue.
    pub id: &'static str,
    /// Values with their standard deviations: one, the components of a vector, or the terms of a series.
    pub values: Vec<Estimate>,
    /// Whether the catalogue gives it as a list (vectors, terms of a series) even if it has one member.
    pub list: bool,
}

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Value (SI).
    pub value: f64,
    /// Standard deviation (SI).
    pub sd: f64,
}

/// One reading of the recording that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What it adds to the baseline; one entry, or several together.
    pub physics: Vec<Physics>,
    /// How far it lowers the baseline's sum of squares, at first order: its score (in units of noise variance).
    pub score: f64,
    /// Sum of squares per reading of pokes that the fit did not see; `None` when it was not refitted.
    pub held_out_chi2_per_dof: Option<f64>,
    /// Whether the verdict names it.
    pub selected: bool,
    /// Why it is, or is not, the verdict: one sentence.
    pub why: String,
}

/// How well a model explains the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Equilibrium Young's modulus (Pa).
    pub young_modulus_pa: Estimate,
    /// Total stiffness of the springs found (N/m).
    pub restraint_total_n_per_m: Estimate,
    /// Where restraint acts.
    pub restraint: Vec<Restrained>,
    /// Sum of squares per reading, less the fitted parameters.
    pub chi2_per_dof: f64,
    /// Sum of squares per reading of pokes predicted by a fit to the others.
    pub held_out_chi2_per_dof: f64,
}

/// A patch of restraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Restrained {
    /// Centre (m).
    pub centroid_m: Vec3,
    /// One standard deviation of the centre along x, y, z (m); none where it was not refitted.
    pub centroid_sd_m: Option<Vec3>,
    /// Radius (m): of glue as it was found, of springs as it was assumed.
    pub radius_m: f64,
    /// Stiffness of the springs together (N/m); none of glue.
    pub stiffness_n_per_m: Option<Estimate>,
}

/// A poke to do next.
#[derive(Debug, Clone, PartialEq)]
pub struct NextPoke {
    /// Why this one.
    pub why: String,
    /// What it separates.
    pub separates: Vec<Physics>,
    /// The poke.
    pub poke: PlannedPoke,
}

/// One poke's force and its most telling marker in time, measured and predicted by fits that did not see it.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Number by which the recording names the poke.
    pub poke: u32,
    /// Time (s).
    pub time_s: Vec<f64>,
    /// Depth of the stage along the poke (m).
    pub depth_m: Vec<f64>,
    /// Force along the poke, measured (N).
    pub measured_n: Vec<f64>,
    /// Predicted by the baseline (N).
    pub baseline_n: Vec<f64>,
    /// Predicted with what is blamed (N).
    pub extended_n: Vec<f64>,
    /// Markers' misfit of each frame, as root mean square over noise: time (s), baseline, extended.
    pub markers: Vec<(f64, f64, f64)>,
}

/// How a diagnosis is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Settings of the baseline's fit.
    pub fit: crate::inverse::Settings,
    /// Share of recordings without anything left out in which a mismatch may be called.
    pub false_alarm: f64,
    /// Confidence of a reading that stands alone at which no further poke is looked for.
    pub enough: f64,
    /// How the next poke is chosen.
    pub choice: Choice,
    /// Normal of the plane in which the rig's stage moves the tip (unit vector), where only that can be poked; none for any direction.
    pub plane: Option<Vec3>,
}

/// How the next poke is chosen among those that the rig can make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// By what it is expected to tell.
    Telling,
    /// At random, from a seed: to compare with.
    Random(u64),
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            fit: crate::inverse::Settings::default(),
            false_alarm: 0.02,
            enough: 0.95,
            choice: Choice::Telling,
            plane: None,
        }
    }
}

/// What a diagnosis is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress {
    /// The baseline's fit.
    Fitting(crate::inverse::Progress),
    /// Every entry of the catalogue at first order.
    Screening,
    /// Restraint is looked for anew.
    Restraint {
        /// The readings under which it is.
        readings: usize,
    },
    /// A refit of the ball that was chosen, on elements that resolve it.
    LookingCloser {
        /// Displacement components solved for.
        unknowns: usize,
    },
    /// Refits in full of what looked promising.
    Refitting {
        /// How many effects act already.
        acting: usize,
        /// How many entries are tried in addition.
        entries: usize,
    },
}
