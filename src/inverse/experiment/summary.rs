//! Medians, spreads and root mean square errors of a study, as the published tables have them.

use super::{BlockExperiment, Method, Restraint, Study};

/// Median and quartiles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Lower quartile, median, upper quartile.
    pub quartiles: [f64; 3],
}

/// One method at one noise level.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// What restrained the ten nodes.
    pub restraint: Restraint,
    /// Signal-to-noise ratio (dB).
    pub snr_db: f64,
    /// Method.
    pub method: Method,
    /// Data sets.
    pub trials: usize,
    /// Of which the iteration converged.
    pub converged: usize,
    /// Restrained nodes.
    pub restrained_nodes: usize,
    /// Young's modulus (Pa).
    pub young_modulus_pa: Spread,
    /// Ψ½ (m).
    pub psi_half_m: Spread,
    /// Φ½ (m).
    pub phi_half_m: Spread,
    /// Γ (N/m).
    pub gamma_n_per_m: Spread,
    /// ϒ (N/m).
    pub upsilon_n_per_m: Spread,
    /// Median modulus of the error of E (Pa) and of Γ (N/m).
    pub median_error: [f64; 2],
    /// Root mean square error of E (Pa) and of ϒ (N/m).
    pub rms_error: [f64; 2],
    /// Cramér–Rao bounds of E (Pa) and of the total (N/m), support known; not for data without noise, nor of
    /// the total of held nodes.
    pub bound: [Option<f64>; 2],
}

/// Summaries in order of restraint, level, method.
pub fn summarise(study: &Study) -> Vec<Summary> {
    let mut keys: Vec<(Restraint, f64, Method)> = Vec::new();
    for t in &study.trials {
        let key = (t.restraint, t.snr_db, t.method);
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    keys.into_iter()
        .map(|(restraint, snr_db, method)| {
            let of: Vec<_> = study
                .trials
                .iter()
                .filter(|t| (t.restraint, t.snr_db, t.method) == (restraint, snr_db, method))
                .collect();
            let column = |f: &dyn Fn(&super::Trial) -> f64| -> Vec<f64> { of.iter().map(|t| f(t)).collect() };
            let total = match restraint {
                Restraint::Fixed => f64::INFINITY,
                Restraint::Springs(k) | Restraint::Unequal(k) => k * study.experiment.restrained.len() as f64,
            };
            let e_error = column(&|t| t.young_modulus_pa - BlockExperiment::YOUNG_MODULUS_PA);
            let gamma_error = column(&|t| t.gamma_n_per_m - total);
            let upsilon_error = column(&|t| t.upsilon_n_per_m - total);
            let median_of = |v: &[f64]| spread(v.iter().map(|x| x.abs()).collect()).quartiles[1];
            let rms = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
            let bound = study.bounds.iter().find(|(r, s, _)| (*r, *s) == (restraint, snr_db)).map(|b| &b.2);
            Summary {
                restraint,
                snr_db,
                method,
                trials: of.len(),
                converged: of.iter().filter(|t| t.converged).count(),
                restrained_nodes: study.experiment.restrained.len(),
                young_modulus_pa: spread(column(&|t| t.young_modulus_pa)),
                psi_half_m: spread(column(&|t| t.psi_half_m)),
                phi_half_m: spread(column(&|t| t.phi_half_m)),
                gamma_n_per_m: spread(column(&|t| t.gamma_n_per_m)),
                upsilon_n_per_m: spread(column(&|t| t.upsilon_n_per_m)),
                median_error: [median_of(&e_error), median_of(&gamma_error)],
                rms_error: [rms(&e_error), rms(&upsilon_error)],
                bound: [bound.map(|b| b.young_modulus_pa), bound.and_then(|b| b.total_n_per_m)],
            }
        })
        .collect()
}

/// Quartiles by linear interpolation between order statistics.
fn spread(mut values: Vec<f64>) -> Spread {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * (values.len() - 1) as f64;
        let (low, high) = (values[place.floor() as usize], values[place.ceil() as usize]);
        if low == high { low } else { low + (high - low) * place.fract() }
    };
    Spread { quartiles: [at(0.25), at(0.5), at(0.75)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_lie_between_order_statistics_and_survive_held_nodes() {
        assert_eq!(spread(vec![4.0, 1.0, 3.0, 2.0, 5.0]).quartiles, [2.0, 3.0, 4.0]);
        assert_eq!(spread(vec![1.0, 2.0]).quartiles, [1.25, 1.5, 1.75]);
        assert_eq!(spread(vec![f64::INFINITY; 3]).quartiles, [f64::INFINITY; 3]);
    }
}
