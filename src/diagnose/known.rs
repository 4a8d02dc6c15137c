//! Which changes of the body are known: each is worked out once, kept, and led on by its derivatives to what lies close.

use super::bulk::{BodyChange, BulkKnob, Lab};
use super::error::DiagnoseError;
use super::kept::Kept;
use std::sync::Arc;

/// So many changes are kept.
const KEPT: usize = 64;

/// Changes are worked out where every knob is a multiple of this share of its longest step, and led on from there: which were asked for before,
/// and by whom, makes no difference.
const APART: f64 = 0.04;

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
pub(super) struct Known(Kept<Changed, KEPT>);

impl Known {
    /// A change so close to this one that its derivatives lead here, worked out where it is not known; `None` beyond the knobs' ranges, and
    /// where the laboratory has no answer.
    pub(super) fn nearest(&self, lab: &Lab<'_>, knobs: &[(BulkKnob, f64)]) -> Option<Arc<Changed>> {
        let knot = |&(knob, value): &(BulkKnob, f64)| {
            let ([low, high], longest) = lab.range(knob);
            let apart = APART * longest;
            // On the edge is within, as far as the edge can be told.
            let within = (low - apart..=high + apart).contains(&value);
            within.then(|| (knob, ((value / apart).round() * apart).clamp(low, high)))
        };
        let knobs: Vec<(BulkKnob, f64)> = knobs.iter().map(knot).collect::<Option<_>>()?;
        let made = || Ok::<_, DiagnoseError>(Changed::new(&knobs, lab.changed(&knobs)?));
        self.0.get(|known| known.knobs == knobs, made).ok()
    }
}
