//! Which single steps does a protocol come to: a flat list, in order, each with a number and a name that stay.

use super::steps::{Kind, Place, Protocol, Step, Stroke, Task};
use crate::acquire::AcquireError;
use std::fmt;

/// What a single step is called. It depends neither on the order of a grid nor on what is added after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StepId {
    /// Number of the step in the protocol, from 1.
    pub step: u32,
    /// Number of the place within it, from 1.
    pub place: u32,
    /// Which time at this place, from 1.
    pub repeat: u32,
}

impl fmt::Display for StepId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.step, self.place, self.repeat)
    }
}

/// One motion, wait, remark or question.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    /// Number in the list, from 1.
    pub number: u32,
    /// Number among the pokes, from 1, where the phantom is touched.
    pub poke: Option<u32>,
    /// What it is called.
    pub id: StepId,
    /// Line of the protocol file that asks for it.
    pub line: usize,
    /// Kind of the step that asks for it.
    pub kind: Kind,
    /// What is done.
    pub action: Action,
}

/// What is done in one step.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// A motion along a line and back.
    Stroke {
        /// Where the tip's centre meets the surface, or would (m).
        site_m: [f64; 3],
        /// The motion.
        stroke: Stroke,
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

impl Protocol {
    /// All single steps in order.
    pub fn expand(&self) -> Vec<PlannedStep> {
        let mut planned = Vec::new();
        let mut pokes = 0;
        for (step, number) in self.steps.iter().zip(1..) {
            match &step.task {
                Task::Strokes { stroke, places, repeats } => {
                    for Place { number: place, site_m } in places {
                        for repeat in 1..=*repeats {
                            let poke = (!stroke.air).then(|| {
                                pokes += 1;
                                pokes
                            });
                            let id = StepId { step: number, place: *place, repeat };
                            let action = Action::Stroke { site_m: *site_m, stroke: *stroke };
                            planned.push(single(step, id, poke, action));
                        }
                    }
                }
                Task::Wait { duration_s } => {
                    planned.push(once(step, number, Action::Wait { duration_s: *duration_s }));
                }
                Task::Mark { text } => planned.push(once(step, number, Action::Mark { text: text.clone() })),
                Task::Ask { text } => planned.push(once(step, number, Action::Ask { text: text.clone() })),
            }
        }
        for (step, number) in planned.iter_mut().zip(1..) {
            step.number = number;
        }
        planned
    }
}

fn once(step: &Step, number: u32, action: Action) -> PlannedStep {
    single(step, StepId { step: number, place: 1, repeat: 1 }, None, action)
}

fn single(step: &Step, id: StepId, poke: Option<u32>, action: Action) -> PlannedStep {
    PlannedStep { number: 0, poke, id, line: step.line, kind: step.kind, action }
}

/// The steps from a poke on: what is left of a session that goes on there. What stands between it and the poke before is done again:
/// questions, waits, motions in air.
///
/// # Errors
/// [`AcquireError::NoSuchPoke`].
pub fn from_poke(steps: &[PlannedStep], poke: u32) -> Result<&[PlannedStep], AcquireError> {
    let found = steps.iter().position(|step| step.poke == Some(poke));
    let pokes = steps.iter().filter_map(|step| step.poke).max().unwrap_or(0);
    let begins =
        |at: usize| steps[..at].iter().rposition(|step| step.poke.is_some()).map_or(0, |before| before + 1);
    found.map(|at| &steps[begins(at)..]).ok_or(AcquireError::NoSuchPoke { poke, pokes })
}
