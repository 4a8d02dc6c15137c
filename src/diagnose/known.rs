//! Which changes of the body are known: each is worked out once, kept, and led on by its derivatives to what lies close.

use super::bulk::{BodyChange, BulkKnob, Lab};
use std::sync::{Arc, Mutex, PoisonError};

/// So many changes are kept.
const KEPT: usize = 64;

/// Knobs this close to known ones, over their longest step, are answered by the derivative there.
const CLOSE: f64 = 0.02;

/// A change of the body that was worked out.
pub(super) struct Changed {
    knobs: Vec<(BulkKnob, f64)>,
    change: BodyChange,
}

impl Changed {
    /// What these knobs do.
    pub(super) fn new(knobs: &[(BulkKnob, f64)], change: BodyChange) -> Self {
        Self { knobs: knobs.to_vec(), change }
    }

    /// What the same knobs do at these values, to first order; `None` of other knobs.
    pub(super) fn moved(&self, knobs: &[(BulkKnob, f64)]) -> Option<BodyChange> {
        Some(self.change.moved(&self.steps_to(knobs)?))
    }

    /// Steps of the same knobs from here to these values.
    fn steps_to(&self, knobs: &[(BulkKnob, f64)]) -> Option<Vec<f64>> {
        let same = self.knobs.len() == knobs.len() && self.knobs.iter().zip(knobs).all(|(a, b)| a.0 == b.0);
        same.then(|| self.knobs.iter().zip(knobs).map(|(a, b)| b.1 - a.1).collect())
    }
}

/// The last changes that were worked out.
#[derive(Default)]
pub(super) struct Known(Mutex<Vec<Arc<Changed>>>);

impl Known {
    /// A change so close to this one that its derivatives lead here, worked out where none is known; `None` where the laboratory has no
    /// answer.
    pub(super) fn nearest(&self, lab: &Lab<'_>, knobs: &[(BulkKnob, f64)]) -> Option<Arc<Changed>> {
        let close = |known: &&Arc<Changed>| {
            known.steps_to(knobs).is_some_and(|steps| {
                steps.iter().zip(knobs).all(|(step, (knob, _))| step.abs() <= CLOSE * lab.range(*knob).1)
            })
        };
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = kept().iter().rev().find(close) {
            return Some(Arc::clone(known));
        }
        let made = Arc::new(Changed::new(knobs, lab.changed(knobs).ok()?));
        let mut kept = kept();
        if kept.len() == KEPT {
            kept.remove(0);
        }
        kept.push(Arc::clone(&made));
        Some(made)
    }
}
