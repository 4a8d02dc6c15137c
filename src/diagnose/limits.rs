//! What a recording would have shown: for effects that have a size, the smallest one that its readings tell from the
//! baseline.
//!
//! At first order: the effect is added at next to nothing, and its information is what is left of its own after everything
//! that the baseline fits has taken its part. A size shows when it lowers the sum of squares by what its entry must.

use super::knob::Knob;
use super::model::{Acting, Model};
use super::refit::Fitted;
use super::select::least;
use nalgebra::{DMatrix, DVector};

/// One effect that has a size.
struct Probe {
    knob: Knob,
    /// Where its derivative is taken.
    at: f64,
    /// Size in the units of the text, per unit of the knob.
    unit: f64,
    /// Words before and after the size.
    words: [&'static str; 2],
}

const fn probe(knob: Knob, at: f64, unit: f64, words: [&'static str; 2]) -> Probe {
    Probe { knob, at, unit, words }
}

/// Time constant of the relaxation that is asked for (s).
const RELAXES_S: f64 = 2.0;

/// A gap, or lost motion, of next to nothing (m).
const NEXT_TO_NOTHING_M: f64 = 1e-6;

/// Effects that are added together: as many as a march has room for.
const PROBES: [&[Probe]; 2] = [
    &[
        probe(Knob::Relaxed(0), 0.0, 100.0, ["", " % of the stress relaxed with 2 s"]),
        probe(Knob::Drying, 0.0, 6000.0, ["drying by ", " % a minute"]),
        probe(Knob::Late, NEXT_TO_NOTHING_M, 1e6, ["a gap of ", " µm before contact"]),
        probe(Knob::Backlash, NEXT_TO_NOTHING_M, 1e6, ["", " µm of backlash"]),
        probe(Knob::StageGive, 0.0, 1e6, ["a stage that gives ", " µm/N"]),
        probe(Knob::Lag, 0.0, 1e3, ["a camera ", " ms late"]),
    ],
    &[
        probe(Knob::Scale, 1.0, 100.0, ["a camera's scale off by ", " %"]),
        probe(Knob::DepthGain, 1.0, 100.0, ["its depth by ", " %"]),
        probe(Knob::Rotation(0), 0.0, 1e3, ["a camera turned about x by ", " mrad"]),
        probe(Knob::Rotation(1), 0.0, 1e3, ["about y by ", " mrad"]),
        probe(Knob::Rotation(2), 0.0, 1e3, ["about z by ", " mrad"]),
        probe(Knob::Gain(0), 0.0, 100.0, ["a force sensor's x against its z off by ", " %"]),
    ],
];

/// The smallest sizes that would have shown beside a baseline, in words. `None` where the model has no answer.
pub(super) fn limits(model: &Model<'_>, base: &Fitted) -> Option<String> {
    let mut said = Vec::new();
    for probes in PROBES {
        let mut acting = base.acting.clone();
        let mut values: Vec<f64> = base.at.iter().copied().collect();
        let here = model.base();
        acting.knobs.extend(probes.iter().map(|p| p.knob));
        values.splice(here..here, probes.iter().map(|p| p.at));
        // What relaxes needs a time constant, which stays.
        let time = probes.iter().any(|p| p.knob == Knob::Relaxed(0));
        if time {
            acting.knobs.push(Knob::Time(0));
            values.insert(here + probes.len(), RELAXES_S.ln());
        }
        let information = information(model, &acting, DVector::from_vec(values), probes.len())?;
        for (probe, information) in probes.iter().zip(information) {
            let size = (least(model, base, probe.knob.physics()) / information).sqrt() * probe.unit;
            let [before, after] = probe.words;
            said.push(match size.is_finite() {
                true => format!("{before}{}{after}", two_digits(size)),
                false => format!("{before}any{after}"),
            });
        }
    }
    Some(format!("weaker effects than these would not have shown: {}", said.join(", ")))
}

/// Information on each of the first few knobs alone, everything of the baseline free.
fn information(model: &Model<'_>, acting: &Acting, at: DVector<f64>, probes: usize) -> Option<Vec<f64>> {
    let first = model.base();
    let (normal, _) = Fitted::new(model, acting, at)?.equations(model, None);
    let knobs = first..first + acting.knobs.len();
    let free: Vec<usize> =
        (0..normal.nrows()).filter(|i| !knobs.contains(i) && !model.frozen(acting, *i)).collect();
    let scale: Vec<f64> =
        free.iter().map(|&i| normal[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
    let scaled =
        DMatrix::from_fn(free.len(), free.len(), |a, b| normal[(free[a], free[b])] * scale[a] * scale[b]);
    let factor = scaled.cholesky()?;
    let left = |knob: usize| {
        let along = DVector::from_fn(free.len(), |a, _| normal[(free[a], knob)] * scale[a]);
        (normal[(knob, knob)] - along.dot(&factor.solve(&along))).max(0.0)
    };
    Some((first..first + probes).map(left).collect())
}

fn two_digits(size: f64) -> String {
    let decimals = (1.0 - size.abs().max(f64::MIN_POSITIVE).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{size:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_two_digits() {
        assert_eq!([0.0123, 1.26, 34.4, 870.0].map(two_digits), ["0.012", "1.3", "34", "870"]);
    }

    #[test]
    fn what_is_added_together_finds_room() {
        for probes in PROBES {
            assert!(probes.len() < super::super::model::ROOM, "{}", probes.len());
        }
    }
}
