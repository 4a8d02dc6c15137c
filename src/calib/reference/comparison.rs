//! Does a fit agree with a reference value?
//!
//! Both are estimates of one true value, with independent errors: their difference d = a − b has the variance s² = s_a² + s_b², so that
//! z = d / s is standard normal where both are right and both uncertainties are true (JCGM 100:2008, 5.1.2, for two inputs without
//! correlation). p = P(|Z| ≥ |z|) = erfc(|z| / √2). They agree at 95 % where p ≥ 0.05.
//!
//! Why not E_n of ISO 13528: it is the same ratio with expanded uncertainties (k = 2), |E_n| ≤ 1 ⇔ |z| ≤ 2.

use super::{ReferenceQuantity, ReferenceValue};
use crate::units::with_sd;
use serde::Serialize;
use statrs::function::erf::erfc;

/// What agreement is judged by: the chance of a larger difference where both are right.
const LEVEL: f64 = 0.05;

/// What a fit says of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fitted {
    /// The value (SI).
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}

/// A fit beside a reference value. SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Name of the reference value.
    pub name: String,
    /// Of what.
    pub quantity: ReferenceQuantity,
    /// What the fit says.
    pub fitted: Fitted,
    /// What the reference value says.
    pub reference: Fitted,
    /// Fit less reference.
    pub difference: f64,
    /// Standard deviation of that.
    pub sd: f64,
    /// Difference over its standard deviation.
    pub z: f64,
    /// Chance of at least such a difference where both are right.
    pub p: f64,
    /// Whether they agree at 95 %.
    pub agree: bool,
}

impl Comparison {
    /// The smallest difference that would have been significant: what agreement is worth.
    pub fn detectable(&self) -> f64 {
        // 97.5 % quantile of the standard normal distribution.
        1.959_963_984_540_054 * self.sd
    }

    /// In one sentence.
    pub fn words(&self) -> String {
        let (scale, unit) = self.quantity.shown();
        let say = |value: f64, sd: f64| with_sd(value, sd, scale, unit);
        let verdict = if self.agree {
            // With the digits of the deviation, and without it.
            let detectable = say(self.detectable(), self.sd);
            let least = detectable.split(" ±").next().unwrap_or_default();
            format!("they agree at 95 % (from {least} {unit} on they would not)")
        } else {
            "they disagree at 95 %".to_owned()
        };
        format!(
            "{} ({}): fit {}, reference {}, difference {}{}; z = {:.2}, p = {}; {verdict}",
            self.quantity.name(),
            self.name,
            say(self.fitted.value, self.fitted.sd),
            say(self.reference.value, self.reference.sd),
            say(self.difference, self.sd),
            self.share().map_or(String::new(), |share| format!(" ({:+.1} %)", 100.0 * share)),
            self.z,
            if self.p < 1e-3 { format!("{:.1e}", self.p) } else { format!("{:.3}", self.p) },
        )
    }

    /// The difference over the reference value; none where that is zero.
    pub fn share(&self) -> Option<f64> {
        (self.reference.value != 0.0).then(|| self.difference / self.reference.value)
    }
}

/// Compares.
pub fn compare(fitted: Fitted, reference: &ReferenceValue) -> Comparison {
    let known = Fitted { value: reference.figure.value, sd: reference.figure.sd };
    let difference = fitted.value - known.value;
    let sd = fitted.sd.hypot(known.sd);
    let z = difference / sd;
    let p = erfc(z.abs() / std::f64::consts::SQRT_2);
    Comparison {
        name: reference.name.clone(),
        quantity: reference.quantity,
        fitted,
        reference: known,
        difference,
        sd,
        z,
        p,
        agree: p >= LEVEL,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::Day;
    use crate::calib::reference::{Figure, Validity};

    fn reference(value: f64, sd: f64) -> ReferenceValue {
        ReferenceValue {
            name: "gel".to_owned(),
            quantity: ReferenceQuantity::YoungModulus,
            figure: Figure { value, sd, interval_90: None },
            date: Day::parse("2026-11-02").expect("a day"),
            source: "here".to_owned(),
            specimen: String::new(),
            machine: String::new(),
            method: "none".to_owned(),
            validity: Validity::default(),
            raw: Vec::new(),
        }
    }

    /// Tables of the normal distribution: P(|Z| ≥ 1.959964) = 0.05, P(|Z| ≥ 1) = 0.317311, P(|Z| ≥ 3) = 0.0026998.
    #[test]
    fn chances_are_those_of_the_tables() {
        // Deviations 3 and 4 make 5.
        let at = |z: f64| compare(Fitted { value: 100.0 + 5.0 * z, sd: 3.0 }, &reference(100.0, 4.0));
        for (z, p) in [(1.0, 0.317_310_5), (-1.0, 0.317_310_5), (3.0, 0.002_699_8)] {
            let found = at(z);
            assert!((found.z - z).abs() < 1e-12 && (found.p - p).abs() < 1e-7, "{found:?}");
        }
        assert!(at(1.9599).agree && !at(1.9601).agree && at(-1.9599).agree && !at(-1.9601).agree);
        assert!((at(0.0).detectable() - 9.7998).abs() < 1e-4);
    }

    #[test]
    fn a_person_reads_both_uncertainties_and_the_verdict() {
        let good = compare(Fitted { value: 10_300.0, sd: 120.0 }, &reference(10_100.0, 160.0)).words();
        for part in [
            "10.30 ± 0.12 kPa",
            "10.10 ± 0.16 kPa",
            "0.20 ± 0.20 kPa",
            "(+2.0 %)",
            "z = 1.00",
            "agree at 95 %",
        ] {
            assert!(good.contains(part), "{part}: {good}");
        }
        let bad = compare(Fitted { value: 9_000.0, sd: 120.0 }, &reference(10_100.0, 160.0)).words();
        assert!(bad.contains("they disagree at 95 %") && bad.contains("(-10.9 %)"), "{bad}");
    }
}
