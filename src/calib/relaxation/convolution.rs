//! Force of one relaxing branch after any history: h(t) = ∫ exp(−(t − s)/τ) dφ(s), φ the elastic force.
//!
//! Where φ is a straight line between samples, exactly (Taylor, Pister and Goudreau 1970, Int. J. Numer. Meth. Eng. 2, 45–59):
//! h⁺ = e^{−x} h + (1 − e^{−x})/x · Δφ, x = Δt/τ. So a ramp of any length is what it was, not a step.

use num_dual::{Dual64, DualNum};

/// h at every sample, from rest.
pub(super) fn branch(time_s: &[f64], elastic: &[Dual64], time_constant: Dual64) -> Vec<Dual64> {
    let mut value = elastic.first().copied().unwrap_or(Dual64::from(0.0));
    let mut list = Vec::with_capacity(elastic.len());
    list.extend(elastic.first());
    for k in 1..elastic.len() {
        let x = time_constant.recip() * (time_s[k] - time_s[k - 1]);
        let change = elastic[k] - elastic[k - 1];
        let decay = (-x).exp();
        // (1 − e^{−x})/x keeps its digits at small x by its series.
        let share = if x.re < 1e-5 { -x * 0.5 + 1.0 } else { (-decay + 1.0) / x };
        value = value * decay + share * change;
        list.push(value);
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ramp φ = t for 0 ≤ t ≤ 1, held: h(t) = τ (e^{1/τ} − 1) e^{−t/τ} behind it, however coarse the samples are.
    #[test]
    fn a_ramp_is_exact_at_any_step() {
        let tau = 0.3_f64;
        let times = [0.0, 0.7, 1.0, 1.1, 4.0];
        let elastic: Vec<Dual64> = times.iter().map(|t: &f64| Dual64::from(t.min(1.0))).collect();
        let found = branch(&times, &elastic, Dual64::from(tau));
        for (t, h) in times.iter().zip(&found).skip(2) {
            let expected = tau * ((1.0 / tau).exp() - 1.0) * (-t / tau).exp();
            assert!((h.re - expected).abs() < 1e-14, "{t}: {} {expected}", h.re);
        }
    }
}
