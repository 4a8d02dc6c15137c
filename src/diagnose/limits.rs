//! What a recording would have shown: for effects that have a size, the smallest one that its readings tell from the
//! baseline.
//!
//! At first order: the effect is added at next to nothing, alone beside everything that the baseline fits; from its variance
//! there follows how large it must be to lower the sum of squares by what its entry must; and from its covariance with the modulus how far
//! off a baseline without it has that.

use super::knob::Knob;
use super::model::Model;
use super::refit::Fitted;
use super::select::{extended, least};

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

impl Probe {
    fn said(&self, size: &str) -> String {
        let [before, after] = self.words;
        format!("{before}{size}{after}")
    }
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
        probe(Knob::DepthGain, 1.0, 100.0, ["a camera's depth off by ", " %"]),
        probe(Knob::Rotation(0), 0.0, 1e3, ["a camera turned about x by ", " mrad"]),
        probe(Knob::Rotation(1), 0.0, 1e3, ["a camera turned about y by ", " mrad"]),
        probe(Knob::Rotation(2), 0.0, 1e3, ["a camera turned about z by ", " mrad"]),
        probe(Knob::Gain(0), 0.0, 100.0, ["a force sensor's x against its z off by ", " %"]),
    ],
];

/// The smallest sizes that would have shown beside a baseline, in words, and which of them the modulus suffers most from. `None` where
/// the model has no answer.
pub(super) fn limits(model: &Model<'_>, base: &Fitted) -> Option<String> {
    let mut said = Vec::new();
    let mut worst = (LEAST_SHIFT, String::new());
    for probes in PROBES {
        let mut knobs: Vec<(Knob, f64)> = probes.iter().map(|p| (p.knob, p.at)).collect();
        // What relaxes needs a time constant, which stays.
        if probes.iter().any(|p| p.knob == Knob::Relaxed(0)) {
            knobs.push((Knob::Time(0), RELAXES_S.ln()));
        }
        let (acting, at) = extended(model, base.place(), &knobs);
        let added = Fitted::new(model, &acting, at)?;
        let first = model.base() + base.acting.knobs.len();
        for (i, probe) in (first..).zip(probes) {
            // Alone beside the baseline.
            let held = |other: usize| other != i && (first..first + knobs.len()).contains(&other);
            let Some(covariance) = added.covariance_but(model, held) else {
                said.push(probe.said("any"));
                continue;
            };
            let (variance, with_modulus) = (covariance[(i, i)], covariance[(0, i)]);
            let size = (least(model, base, probe.knob.physics()) * variance).sqrt();
            said.push(probe.said(&two_digits(size * probe.unit)));
            // Of the logarithm.
            let shift = (with_modulus / variance * size).abs();
            if shift > worst.0 {
                worst = (shift, said.last().cloned().unwrap_or_default());
            }
        }
    }
    let said = format!("weaker effects than these would not have shown: {}", said.join(", "));
    Some(match worst {
        (_, nothing) if nothing.is_empty() => said,
        (shift, effect) => {
            format!("{said}; {effect} would put the modulus off by {} %", two_digits(100.0 * shift))
        }
    })
}

/// A smaller relative error of the modulus is not worth words.
const LEAST_SHIFT: f64 = 2e-3;

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
