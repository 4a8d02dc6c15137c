//! The result in plain words: the sentence at the head of the page, and figures with as many digits as they
//! deserve.

use super::document::interval90;
use crate::inverse::{Estimate, Fit, PatchKind};
use crate::units::{counted, with_sd};

/// How the residual compares with the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// What is left is noise.
    Explained,
    /// Less is left than the stated noise should leave: the root mean square is this share of it.
    NoiseOverstated(f64),
    /// What is left looks like noise, but the fit has not come to rest.
    Unsettled,
    /// What is left is noise, but the modulus lies plainly outside the range that the operator expects.
    Unexpected,
    /// More is left than noise leaves: the root mean square is this many times what it should be.
    Unexplained(f64),
    /// No residual to judge by.
    Unjudged,
}

/// Judges a fit by its chi² per degree of freedom against the band that noise alone leaves in 99.9 % of
/// recordings, as far below its mean as the limit is above (the distribution is symmetric for so many values).
pub fn verdict(fit: &Fit) -> Verdict {
    let (chi2, limit) = (fit.residual.chi2_per_dof, fit.residual.chi2_per_dof_limit);
    let expected = fit.residual.chi2_per_dof_expected;
    if !chi2.is_finite() || !limit.is_finite() {
        Verdict::Unjudged
    } else if chi2 > limit {
        Verdict::Unexplained(chi2.sqrt())
    } else if !fit.settled {
        Verdict::Unsettled
    } else if outside(fit.young_modulus_expected_pa, &fit.young_modulus_pa) {
        Verdict::Unexpected
    } else if chi2 < 2.0 * expected - limit {
        Verdict::NoiseOverstated((chi2 / expected).sqrt())
    } else {
        Verdict::Explained
    }
}

/// So many standard deviations outside the expected range are plain.
const PLAINLY_SD: f64 = 3.0;

fn outside([low, high]: [f64; 2], modulus: &Estimate) -> bool {
    // A method that states no deviation is taken at its word.
    let sd = if modulus.sd.is_finite() { modulus.sd } else { 0.0 };
    (low - modulus.value).max(modulus.value - high) > PLAINLY_SD * sd
}

/// What was found: `Young's modulus 10.482 ± 0.051 kPa; 2 restraint patches, together 124.3 ± 3.1 N/m`.
pub fn finding(fit: &Fit) -> String {
    let springs = fit.patches.iter().filter(|p| matches!(p.kind, PatchKind::Springs { .. })).count();
    let glued = fit.patches.len() - springs;
    let total = stiffness(&fit.restraint_total_n_per_m);
    let held = match (springs, glued) {
        (0, 0) => "no restraint found".to_owned(),
        (0, _) => counted(glued, "glued patch", "glued patches"),
        (1, 0) => format!("1 restraint patch of {total}"),
        (1, _) => {
            format!("1 restraint patch of {total} and {}", counted(glued, "glued patch", "glued patches"))
        }
        (_, 0) => format!("{springs} restraint patches, together {total}"),
        (..) => {
            let glued = counted(glued, "glued patch", "glued patches");
            format!("{springs} restraint patches, together {total}, and {glued}")
        }
    };
    format!("Young’s modulus {}; {held}", modulus(&fit.young_modulus_pa))
}

/// How far to trust it.
///
/// A model that misses something leaves errors that do not average out as noise does. The fit has then widened its
/// deviations by what is left over noise (Birge 1932, Phys. Rev. 40, 207), which is the least that can be said.
pub fn trust(fit: &Fit) -> String {
    match verdict(fit) {
        Verdict::Explained => "The model explains the recording down to the noise.".to_owned(),
        Verdict::NoiseOverstated(ratio) => format!(
            "The model explains the recording; the residual is only {ratio:.2} × the stated noise, so the noise \
             is stated too large and the deviations are too wide."
        ),
        Verdict::Unsettled => {
            "The fit has not come to rest: the figures may be off by more than they say.".to_owned()
        }
        Verdict::Unexpected => "The model explains the recording, but its modulus lies outside the range that the operator expects: a force in \
                                another unit, or read too large or too small by a factor, leaves as little."
            .to_owned(),
        Verdict::Unexplained(ratio) => {
            let most = fit.residual.chi2_per_dof_limit.sqrt();
            // As many digits as tell the two apart.
            let digits = (2..6).find(|d| (ratio - most) * 10_f64.powi(*d as i32) >= 1.0).unwrap_or(6);
            format!(
                "The residual is {ratio:.digits$} × the noise, and noise alone leaves at most {most:.digits$} ×: the model is \
                 missing something, and the figures may be off by more than they say. `phantom-rig diagnose` looks for what."
            )
        }
        Verdict::Unjudged => {
            "The residual could not be compared with the noise: the figures are unchecked.".to_owned()
        }
    }
}

/// A modulus with its deviation, in Pa, kPa or MPa by its size.
pub(super) fn modulus(estimate: &Estimate) -> String {
    let (scale, unit) = modulus_unit(estimate.value);
    figure(estimate, scale, unit)
}

/// A stiffness with its deviation in N/m.
pub(super) fn stiffness(estimate: &Estimate) -> String {
    figure(estimate, 1.0, "N/m")
}

/// The 90 % interval of a modulus, in the unit and with the digits of [`modulus`].
pub(super) fn modulus_interval(ends: [f64; 2], estimate: &Estimate) -> String {
    let (scale, unit) = modulus_unit(estimate.value);
    span(ends, estimate.sd, scale, unit)
}

/// The 90 % interval of a stiffness, with the digits of [`stiffness`].
pub(super) fn stiffness_interval(estimate: &Estimate) -> String {
    span(interval90(estimate), estimate.sd, 1.0, "N/m")
}

/// A standard deviation alone, two digits.
pub(super) fn modulus_sd(sd: f64, value: f64) -> String {
    let (scale, unit) = modulus_unit(value);
    deviation(sd, scale, unit)
}

/// A standard deviation of a stiffness alone, two digits.
pub(super) fn stiffness_sd(sd: f64) -> String {
    deviation(sd, 1.0, "N/m")
}

fn modulus_unit(value: f64) -> (f64, &'static str) {
    match value.abs() {
        size if size >= 1e6 => (1e-6, "MPa"),
        size if size >= 1e3 => (1e-3, "kPa"),
        _ => (1.0, "Pa"),
    }
}

fn figure(estimate: &Estimate, scale: f64, unit: &str) -> String {
    if !estimate.value.is_finite() {
        "not determined".to_owned()
    } else if !estimate.sd.is_finite() {
        format!("{:.4} {unit}, deviation not determined", estimate.value * scale)
    } else {
        with_sd(estimate.value, estimate.sd, scale, unit)
    }
}

fn span(ends: [f64; 2], sd: f64, scale: f64, unit: &str) -> String {
    if ends.iter().any(|e| !e.is_finite()) {
        return "not determined".to_owned();
    }
    let decimals = decimals(sd * scale);
    format!("{:.decimals$} to {:.decimals$} {unit}", ends[0] * scale, ends[1] * scale)
}

fn deviation(sd: f64, scale: f64, unit: &str) -> String {
    if !sd.is_finite() {
        return "not determined".to_owned();
    }
    let decimals = decimals(sd * scale);
    format!("{:.decimals$} {unit}", sd * scale)
}

/// Decimals that show two digits of a deviation.
fn decimals(sd: f64) -> usize {
    if sd.is_finite() && sd > 0.0 { (1.0 - sd.log10().floor()).clamp(0.0, 9.0) as usize } else { 4 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_have_the_digits_of_their_deviation() {
        let estimate = Estimate { value: 10_482.0, sd: 51.0 };
        assert_eq!(modulus(&estimate), "10.482 ± 0.051 kPa");
        assert_eq!(modulus_interval([10_398.12, 10_565.88], &estimate), "10.398 to 10.566 kPa");
        assert_eq!(modulus_sd(38.2, estimate.value), "0.038 kPa");
        assert_eq!(stiffness_interval(&Estimate { value: 2.0, sd: 3.0 }), "0.0 to 6.9 N/m");
        assert_eq!(stiffness_sd(230.4), "230 N/m");
    }

    /// Three deviations beyond an end of the range are plain, less are not.
    #[test]
    fn a_modulus_may_be_unexpected() {
        let of = |value: f64, sd: f64| outside([5e3, 2e4], &Estimate { value, sd });
        assert!(of(1.1e7, 1e4) && of(20_400.0, 100.0) && of(4_600.0, 100.0) && of(20_001.0, f64::NAN));
        assert!(!of(20_200.0, 100.0) && !of(4_800.0, 100.0) && !of(1e4, f64::NAN));
    }

    #[test]
    fn what_is_not_determined_is_said_so() {
        assert_eq!(modulus(&Estimate { value: f64::NAN, sd: 1.0 }), "not determined");
        let loose = Estimate { value: 800.0, sd: f64::INFINITY };
        assert_eq!(modulus(&loose), "800.0000 Pa, deviation not determined");
        assert_eq!(modulus_interval([f64::NEG_INFINITY, f64::INFINITY], &loose), "not determined");
    }
}
