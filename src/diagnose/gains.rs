//! Which axes of the force sensor read wrong: pokes tell gains as ratios only.
//!
//! One common to all axes looks like another modulus with restraint in proportion. A sensor with one axis off is the simplest account of two
//! ratios, where it explains as much; where it does not, the modulus carries what the gain of z may be off by itself.

use super::knob::Knob;
use super::model::Model;
use super::parameters::position;
use super::refit::{Effort, End, Fitted, IN_FULL, descend};
use super::select::{FROM_CLOSE, extended, reduced};
use rayon::prelude::*;

const AXES: [&str; 3] = ["x", "y", "z"];

/// An account with one gain explains as much as one with two where it leaves no more than this: what chance does to one parameter once in 600
/// times.
const ALIKE: f64 = 10.0;

/// A reading with gains, by that of one axis alone where just one axis explains as much; and what to say of it. Any other reading as it is.
pub(super) fn with_its_gains(model: &Model<'_>, fitted: Fitted) -> (Fitted, Option<String>) {
    let Some([x, y]) = against_z(model, &fitted) else { return (fitted, None) };
    let each = [(0, x), (1, y), (2, -0.5 * (x + y))];
    // What ran out of steps may explain as much still.
    let mut alone: Vec<(usize, Fitted)> = each
        .into_par_iter()
        .filter_map(|(axis, gain)| Some((axis, with_one(model, &fitted, axis, gain)?)))
        .filter(|(_, one)| one.end != End::GivenUp)
        .collect();
    match alone.pop() {
        Some((axis, one)) if alone.is_empty() && one.end == End::AtRest => {
            let said = format!(
                "pokes tell gains of the force sensor as ratios only: {} alone is taken to read wrong, which explains as much as two axes do",
                AXES[axis]
            );
            (one, Some(said))
        }
        _ => {
            let said = format!(
                "pokes tell gains of the force sensor as ratios only: z is taken to read right, and may be off by {:.1} %, which the \
                 deviation of the modulus contains",
                100.0 * common_gain(model, &fitted)
            );
            (fitted, Some(said))
        }
    }
}

/// Logarithms of the gains of x and y against that of z, of a reading that has both.
fn against_z(model: &Model<'_>, fitted: &Fitted) -> Option<[f64; 2]> {
    let of = |axis: usize| Some(fitted.at[position(model, fitted, Knob::Gain(axis))?]);
    Some([of(0)?, of(1)?])
}

/// The reading with the gain of one axis in the place of all.
fn with_one(model: &Model<'_>, fitted: &Fitted, axis: usize, gain: f64) -> Option<Fitted> {
    let (acting, mut at) = reduced(model, fitted, |knob| !matches!(knob, Knob::Gain(_)));
    // What z reads too little the modulus and all restraint seemed to have too little.
    if axis == 2 {
        at.rows_mut(0, model.logarithms()).add_scalar_mut(-gain);
    }
    let (acting, at) = extended(model, (&acting, &at), &[(Knob::Gain(axis), gain)]);
    descend(model, &acting, at, Effort { optimism: FROM_CLOSE, hopeless: fitted.cost + ALIKE, ..IN_FULL })
}

/// What the gain of z, which the others are told against, may be off by itself, and the modulus with it (relative): 0 where not both are.
pub(super) fn common_gain(model: &Model<'_>, fitted: &Fitted) -> f64 {
    against_z(model, fitted).map_or(0.0, off_in_common)
}

/// Root mean square of the logarithm of the third of three gains, of which those of the first two are known against it: all are taken to scatter
/// alike about 1, so that the third is expected at minus the mean of the three differences, with a variance of a third of theirs.
fn off_in_common([x, y]: [f64; 2]) -> f64 {
    let mean = (x + y) / 3.0;
    let variance = [x, y, 0.0].iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / 2.0;
    mean.hypot((variance / 3.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the third of three is off, both others seem to be, by as much: it is expected two thirds of that way, and is likely the whole.
    #[test]
    fn gains_that_seem_off_alike_are_the_third() {
        let off = off_in_common([-0.06, -0.06]);
        assert!((off - 0.04_f64.hypot(0.02)).abs() < 1e-12, "{off}");
        let opposite = off_in_common([0.06, -0.06]);
        assert!((opposite - 0.06 / 3_f64.sqrt()).abs() < 1e-12, "{opposite}");
        assert_eq!(off_in_common([0.0, 0.0]), 0.0);
    }
}
