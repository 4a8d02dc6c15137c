//! How many terms a memory has: it is looked for with one, and keeps a second where that explains more.
//!
//! Why at once, and not when all else is named: what one term leaves of two looks like drying, like a creeping tip, like the memory of the
//! other part.

use super::knob::Knob;
use super::model::Model;
use super::refit::{Effort, Fitted, IN_FULL, descend};
use super::select::extended;

/// The knobs of a term: share and time constant.
type Of = [fn(usize) -> Knob; 2];

/// Memory of the phantom, and of the restraint.
const MEMORIES: [Of; 2] = [[Knob::Relaxed, Knob::Time], [Knob::BandRelaxed, Knob::BandTime]];

/// A second term begins with this share, and so many times slower or faster than the first.
const SHARE: f64 = 0.03;
const APART: f64 = 6.0;

/// A term must lower the sum of squares by this much: what chance does to two parameters once in 10⁹ times.
const LEAST_GAIN: f64 = 40.0;

/// What a descent may gain over the promise of its next step: the second term's time constant is still to be found.
const FROM_FAR: f64 = 4.0;

/// A reading with a memory of one term, with two where they explain more. Any other reading as it is.
pub(super) fn with_its_terms(model: &Model<'_>, fitted: Fitted) -> Fitted {
    MEMORIES.iter().fold(fitted, |fitted, of| with_a_second(model, fitted, *of))
}

fn with_a_second(model: &Model<'_>, fitted: Fitted, [share, time]: Of) -> Fitted {
    let has = |knob: Knob| fitted.acting.knobs.iter().position(|k| *k == knob);
    let Some(first) = has(time(0)).filter(|_| has(time(1)).is_none()) else { return fitted };
    let log_time = fitted.at[model.base() + first];
    let hopeless = fitted.cost - LEAST_GAIN;
    let effort = Effort { optimism: FROM_FAR, hopeless, ..IN_FULL };
    let with = |by: f64| {
        let term = [(share(1), SHARE), (time(1), log_time + by)];
        let (acting, at) = extended(model, fitted.place(), &term);
        descend(model, &acting, at, effort)
    };
    let (slower, faster) = rayon::join(|| with(APART.ln()), || with(-APART.ln()));
    let better = [slower, faster].into_iter().flatten().filter(|two| two.cost < hopeless);
    better.min_by(|a, b| a.cost.total_cmp(&b.cost)).unwrap_or(fitted)
}
