//! How surely parameters are known, where sites contradict each other by more than noise.
//!
//! What a model or its elements get wrong is not the same at every site. Noise then says too little of how sure a parameter is; how
//! differently the sites pull at it says more: the sandwich estimate `H⁻¹ (Σ gₛ gₛᵀ) H⁻¹` with the sites' gradients `gₛ` as independent
//! units (Liang and Zeger 1986, eq. 4), times `n / (n − 1)` for `n` sites. A site that alone determines a parameter pulls at nothing, so that
//! this is no more than a lower bound; and a handful of sites differ by chance. A deviation is widened to it where it exceeds what noise makes
//! of it in 95 % of recordings.

use super::model::Model;
use super::refit::Fitted;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

impl Fitted {
    /// Covariance of all parameters, each deviation as wide as noise makes it, or what differs between sites beyond chance. `None` when a direction is
    /// not determined.
    pub(super) fn stated_covariance(&self, model: &Model<'_>) -> Option<DMatrix<f64>> {
        let own = self.covariance(model)?;
        let mut pulls = vec![DVector::zeros(self.at.len()); model.body.sites];
        for (pull, track) in self.pulls(model).iter().zip(&model.tracks) {
            pulls[track.site] += pull;
        }
        Some(widened(own, &pulls))
    }
}

/// Share of recordings in which chance makes less.
const BY_CHANCE: f64 = 0.95;

/// `own` with each deviation widened to what the units' pulls (gradients) make it, where chance does not, correlations as they are.
fn widened(own: DMatrix<f64>, pulls: &[DVector<f64>]) -> DMatrix<f64> {
    let units = pulls.len() as f64;
    if pulls.len() < 2 {
        return own;
    }
    let mut between = DVector::<f64>::zeros(own.nrows());
    for pull in pulls {
        between += (&own * pull).map(|moved| moved * moved * units / (units - 1.0));
    }
    let freedom = units - 1.0;
    let by_chance =
        ChiSquared::new(freedom).map_or(f64::INFINITY, |chi2| chi2.inverse_cdf(BY_CHANCE) / freedom);
    let factor = DVector::from_fn(own.nrows(), |i, _| match between[i] / own[(i, i)] {
        ratio if ratio > by_chance => ratio.sqrt(),
        _ => 1.0,
    });
    own.map_with_location(|i, j, c| c * factor[i] * factor[j])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two parameters known to 1 and 2: sites that pull at the first by ±3 make it √(2 · 18) wide, the second stays.
    #[test]
    fn sites_that_contradict_each_other_widen_what_they_pull_at() {
        let own = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 4.0]);
        let pulls = [DVector::from_vec(vec![3.0, 0.1]), DVector::from_vec(vec![-3.0, -0.1])];
        let found = widened(own.clone(), &pulls);
        assert!((found[(0, 0)] - 36.0).abs() < 1e-12 && (found[(1, 1)] - 4.0).abs() < 1e-12, "{found}");
        assert_eq!(widened(own.clone(), &pulls[..1]), own);
        // χ² of one degree of freedom is below 3.84 in 95 % of cases.
        let little = pulls.map(|pull| pull * 0.3);
        assert_eq!(widened(own.clone(), &little), own);
    }
}
