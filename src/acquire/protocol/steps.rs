//! What is a protocol, once read: steps in the order in which they are made. SI units; places and directions in the phantom frame.

use super::refusal::Problem;

/// Pokes and cycles that one protocol may ask for: some days of work, and little memory for a plan of them.
pub const MOST_STROKES: u64 = 10_000;

/// A protocol that has passed every check that needs no bench. Values are plain data; that there are not too many is kept by whoever
/// makes one.
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
    pub(super) name: String,
    pub(super) notes: Option<String>,
    pub(super) variables: Vec<Variable>,
    pub(super) steps: Vec<Step>,
}

impl Protocol {
    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What its author wants to be known.
    pub fn notes(&self) -> Option<&str> {
        self.notes.as_deref()
    }

    /// Its variables with the values in use, by name.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Its steps in order.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }
}

/// A variable of a protocol.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name, which ends in its unit.
    pub name: String,
    /// Its value, in that unit.
    pub value: f64,
    /// Whether the value came from outside the file.
    pub overridden: bool,
}

/// One step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Line where it begins.
    pub line: usize,
    /// Its kind, as the file says it.
    pub kind: Kind,
    /// What is to be done.
    pub task: Task,
}

/// Kinds of steps, as a file says them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Into the phantom and back.
    Poke,
    /// A poke at each of many places.
    Grid,
    /// To and fro inside the phantom.
    Cycles,
    /// Standing clear of the phantom.
    Wait,
    /// The motion of a poke that touches nothing.
    Air,
    /// A remark in the recording.
    Mark,
    /// A question to the operator.
    Ask,
}

impl Kind {
    /// All kinds.
    pub(super) const ALL: [Self; 7] =
        [Self::Poke, Self::Grid, Self::Cycles, Self::Wait, Self::Air, Self::Mark, Self::Ask];

    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Poke => "poke",
            Self::Grid => "grid",
            Self::Cycles => "cycles",
            Self::Wait => "wait",
            Self::Air => "air",
            Self::Mark => "mark",
            Self::Ask => "ask",
        }
    }
}

/// What a step asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Task {
    /// One motion at each place in order, so many times before the next place.
    Strokes {
        /// The motion.
        stroke: Stroke,
        /// Where.
        places: Vec<Place>,
        /// How often at each place.
        repeats: u32,
    },
    /// Standing clear of the phantom.
    Wait {
        /// How long (s).
        duration_s: f64,
    },
    /// A remark in the recording.
    Mark {
        /// The remark.
        text: String,
    },
    /// The operator confirms before anything goes on.
    Ask {
        /// What is to be confirmed.
        text: String,
    },
}

impl Task {
    /// How many pokes and cycles these are.
    pub(super) fn strokes(&self) -> u64 {
        match self {
            Self::Strokes { stroke, places, repeats } => {
                strokes(places.len() as u64, *repeats, stroke.profile.cycles())
            }
            _ => 0,
        }
    }
}

/// Pokes and cycles at so many places.
pub(super) fn strokes(places: u64, repeats: u32, cycles: u32) -> u64 {
    places.saturating_mul(u64::from(repeats)).saturating_mul(u64::from(cycles))
}

/// Refuses more strokes than [`MOST_STROKES`].
pub(super) fn check_count(asked: u64) -> Result<(), Problem> {
    if asked <= MOST_STROKES { Ok(()) } else { Err(Problem::TooMany { asked, most: MOST_STROKES }) }
}

/// A place and its number, which does not depend on the order in which places are visited.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Number within the step, from 1.
    pub number: u32,
    /// Where the tip's centre meets the surface, or would (m).
    pub site_m: [f64; 3],
}

/// A motion along a line and back. Depths count from the place along the direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Unit vector; none goes straight in, along the stage's second axis.
    pub direction: Option<[f64; 3]>,
    /// What happens along it.
    pub profile: Profile,
    /// Speed inwards, and of cycles both ways (m/s).
    pub speed_m_s: f64,
    /// Speed outwards (m/s).
    pub retreat_speed_m_s: f64,
    /// Rest above the place, clear of the phantom, before the motion (s).
    pub pause_s: f64,
    /// Whether it touches nothing.
    pub air: bool,
    /// Radius of the tip that it is meant for, where that is said (m).
    pub radius_m: Option<f64>,
}

impl Stroke {
    /// The largest depth that it may reach (m).
    pub fn deepest_m(&self) -> f64 {
        match self.profile {
            Profile::Press { target: Target::Depth { depth_m }, .. } => depth_m,
            Profile::Press { target: Target::Force { depth_limit_m, .. }, .. } => depth_limit_m,
            Profile::Cycles { offset_m, amplitude_m, .. } => offset_m + amplitude_m,
        }
    }
}

/// What happens along the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Profile {
    /// In, hold, out.
    Press {
        /// How far in.
        target: Target,
        /// How long the tip stays there (s).
        hold_s: f64,
    },
    /// In to `offset − amplitude`, then so many times to `offset + amplitude` and back, out.
    Cycles {
        /// Mean depth (m).
        offset_m: f64,
        /// Half of the way between the two ends (m); at most the offset.
        amplitude_m: f64,
        /// How often.
        count: u32,
    },
}

impl Profile {
    fn cycles(&self) -> u32 {
        match self {
            Self::Press { .. } => 1,
            Self::Cycles { count, .. } => *count,
        }
    }
}

/// How far in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// To a depth.
    Depth {
        /// The depth (m).
        depth_m: f64,
    },
    /// Until the force along the direction is reached, or the depth.
    Force {
        /// The force (N).
        force_n: f64,
        /// The depth that is not exceeded (m).
        depth_limit_m: f64,
    },
}
