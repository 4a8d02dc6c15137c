//! Residuals of a linear model whose errors have two sizes: the noise of each row, and causes that rows share.
//!
//! y = X β + e, cov e = V = σ² 1 + φ² K, with K (n × n) the covariance of the shared causes as it is stated and φ, from 0 to 1, how much of that is
//! there. The columns of B (n × (n − p)) are orthonormal, BᵀX = 0 and BᵀKB = diag λ: then the numbers w = Bᵀy are independent and normal,
//! of variance v_k = σ² + φ² λ_k, whatever β is. σ and φ are those of the greatest likelihood of w (Patterson and Thompson 1971, Biometrika 58,
//! 545). With P = Σ_k b_k b_kᵀ / v_k:
//!
//! | a row against | off by | standard deviation |
//! | --- | --- | --- |
//! | all other rows, those that share its causes too | (P y)_i / P_ii | P_ii^−½ |
//! | the model, its own causes not known | (V P y)_i | ((V P V)_ii)^½ |
//!
//! The variances have degrees of freedom ν = 2 v² / var v, var v from the information of w about σ² and φ² (Satterthwaite 1946, Biometrics
//! Bulletin 2, 110).

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Least φ that is told from none, and how many are tried from there to 1, evenly in the logarithm: 17 % apart.
const LEAST_SHARE: f64 = 1e-3;
const SHARES: usize = 44;
/// Least noise that is looked for, over the root mean square of w.
const LEAST_NOISE: f64 = 1e-4;
/// Halvings of the logarithm of the noise's variance.
const HALVINGS: usize = 40;

/// What the rows say when the model is taken out of them.
pub(super) struct Contrasts {
    /// B, a row for each row of the table.
    b: DMatrix<f64>,
    /// K B.
    kb: DMatrix<f64>,
    /// Diagonal of K.
    own: DVector<f64>,
    lambda: DVector<f64>,
    w: DVector<f64>,
}

/// σ² and φ².
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    pub(super) noise2: f64,
    pub(super) share2: f64,
}

/// How far a row is off.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RowOff {
    /// By so much.
    pub(super) value: f64,
    /// Its standard deviation.
    pub(super) sd: f64,
    /// The degrees of freedom of that.
    pub(super) freedom: f64,
}

impl RowOff {
    /// In standard deviations.
    pub(super) fn t(&self) -> f64 {
        self.value / self.sd
    }
}

impl Contrasts {
    /// None where X has not full rank, or y is the model's own up to rounding.
    pub(super) fn new(x: &DMatrix<f64>, y: &DVector<f64>, k: &DMatrix<f64>) -> Option<Self> {
        let (n, p) = x.shape();
        let scaled = DMatrix::from_fn(n, p, |i, j| x[(i, j)] / x.column(j).norm());
        let inverse = (scaled.transpose() * &scaled).cholesky()?.inverse();
        let free = DMatrix::identity(n, n) - &scaled * inverse * scaled.transpose();
        // The shift keeps what K leaves at zero apart from what the model takes out.
        let shift = Some(k.trace() / n as f64).filter(|s| *s > 0.0).unwrap_or(1.0);
        let eigen = (&free * k * &free + &free * shift).symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        order.truncate(n.checked_sub(p)?);
        let b = eigen.eigenvectors.select_columns(&order);
        let lambda = DVector::from_iterator(
            order.len(),
            order.iter().map(|&i| (eigen.eigenvalues[i] - shift).max(0.0)),
        );
        let w = b.transpose() * y;
        let exact = w.norm() <= 1e3 * f64::EPSILON * y.norm();
        (!exact && w.iter().all(|w| w.is_finite())).then(|| Self {
            kb: k * &b,
            own: k.diagonal(),
            b,
            lambda,
            w,
        })
    }

    fn pairs(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        self.w.iter().zip(&self.lambda).map(|(w, l)| (w * w, *l))
    }

    /// The sizes of the greatest likelihood.
    pub(super) fn sizes(&self) -> Sizes {
        let mean = self.w.norm_squared() / self.w.len() as f64;
        let shares = (0..=SHARES).map(|i| match i {
            0 => 0.0,
            _ => LEAST_SHARE.powf(2.0 * (SHARES - i) as f64 / (SHARES - 1) as f64),
        });
        let mut best = (f64::INFINITY, Sizes { noise2: mean, share2: 0.0 });
        for share2 in shares {
            let noise2 = self.noise2(share2, mean);
            let spread = |l: f64| noise2 + share2 * l;
            // Twice the logarithm of the likelihood, negative.
            let loss: f64 = self.pairs().map(|(w2, l)| spread(l).ln() + w2 / spread(l)).sum();
            if loss < best.0 {
                best = (loss, Sizes { noise2, share2 });
            }
        }
        best.1
    }

    /// Where the likelihood does not change with σ², φ² held: Σ (w² − v) / v² = 0.
    fn noise2(&self, share2: f64, mean: f64) -> f64 {
        let (mut low, mut high) = ((LEAST_NOISE.powi(2) * mean).ln(), (self.w.len() as f64 * mean).ln());
        for _ in 0..HALVINGS {
            let noise2 = (0.5 * (low + high)).exp();
            let slope: f64 =
                self.pairs().map(|(w2, l)| (w2 - noise2 - share2 * l) / (noise2 + share2 * l).powi(2)).sum();
            if slope > 0.0 { low = 0.5 * (low + high) } else { high = 0.5 * (low + high) }
        }
        high.exp()
    }

    /// A row against all others. `known`: contrasts that the sizes were found from.
    pub(super) fn against_all(&self, row: usize, sizes: Sizes, known: &Self) -> RowOff {
        let (mut p, mut py, mut by) = (0.0, 0.0, Vector2::zeros());
        for (k, &l) in self.lambda.iter().enumerate() {
            let (b, v) = (self.b[(row, k)], sizes.noise2 + sizes.share2 * l);
            p += b * b / v;
            py += b * self.w[k] / v;
            by += Vector2::new(1.0, l) * (b / v).powi(2);
        }
        RowOff { value: py / p, sd: 1.0 / p.sqrt(), freedom: known.freedom(sizes, 1.0 / p, by / (p * p)) }
    }

    /// A row against the model, what it shares with other rows not known. The degrees of freedom leave out what the model took of the variance.
    pub(super) fn against_model(&self, row: usize, sizes: Sizes, known: &Self) -> RowOff {
        let (mut value, mut variance) = (0.0, 0.0);
        for (k, &l) in self.lambda.iter().enumerate() {
            let v = sizes.noise2 + sizes.share2 * l;
            let vb = sizes.noise2 * self.b[(row, k)] + sizes.share2 * self.kb[(row, k)];
            value += vb * self.w[k] / v;
            variance += vb * vb / v;
        }
        let whole = sizes.noise2 + sizes.share2 * self.own[row];
        let freedom = known.freedom(sizes, whole, Vector2::new(1.0, self.own[row]));
        RowOff { value, sd: variance.sqrt(), freedom }
    }

    /// Degrees of freedom of a variance whose derivatives by σ² and φ² are `by`. A share at its bound is as it is stated, and not uncertain.
    fn freedom(&self, sizes: Sizes, variance: f64, by: Vector2<f64>) -> f64 {
        let mut information = Matrix2::zeros();
        for &l in &self.lambda {
            let of = Vector2::new(1.0, l) / (sizes.noise2 + sizes.share2 * l);
            information += of * of.transpose() * 0.5;
        }
        let alone = by[0].powi(2) / information[(0, 0)];
        let both = information.try_inverse().map(|inverse| by.dot(&(inverse * by)));
        let uncertain = both.filter(|both| sizes.share2 < 1.0 && *both > alone).unwrap_or(alone);
        (2.0 * variance * variance / uncertain).clamp(1.0, self.w.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Eight places of four rows each on a straight line; what the rows of a place share grows with the row, from nothing.
    fn table(noise: f64, share: f64, seed: u64) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let places: Vec<f64> = (0..8).map(|_| share * normal()).collect();
        let x = DMatrix::from_fn(32, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let y = DVector::from_fn(32, |i, _| {
            3.0 + 0.2 * i as f64 + places[i / 4] * (i % 4) as f64 + noise * normal()
        });
        let k =
            DMatrix::from_fn(32, 32, |i, j| if i / 4 == j / 4 { ((i % 4) * (j % 4)) as f64 } else { 0.0 });
        (x, y, k)
    }

    /// With sizes that are known, both are normal numbers of size 1 for any row; the sizes found are the true ones on average.
    #[test]
    fn rows_are_off_by_what_is_stated() {
        let (noise, share) = (0.5, 0.6);
        let truth = Sizes { noise2: noise * noise, share2: share * share };
        let (mut all, mut model, mut found) = ([0.0; 4], [0.0; 4], [0.0; 2]);
        for seed in 0..200 {
            let (x, y, k) = table(noise, share, seed);
            let contrasts = Contrasts::new(&x, &y, &k).expect("full rank");
            for row in 0..4 {
                all[row] += contrasts.against_all(12 + row, truth, &contrasts).t().powi(2) / 200.0;
                model[row] += contrasts.against_model(12 + row, truth, &contrasts).t().powi(2) / 200.0;
            }
            let sizes = contrasts.sizes();
            found[0] += sizes.noise2 / 200.0;
            found[1] += sizes.share2 / 200.0;
        }
        // A mean of 200 squares of normal numbers is 1 ± 0.1.
        assert!(all.iter().chain(&model).all(|mean| (0.6..1.4).contains(mean)), "{all:?} {model:?}");
        assert!((found[0] / truth.noise2 - 1.0).abs() < 0.1, "{found:?}");
        assert!((found[1] / truth.share2 - 1.0).abs() < 0.2, "{found:?}");
    }

    /// Where nothing is shared, the sizes say so, and a row has the degrees of freedom of a plain fit or a few less.
    #[test]
    fn what_is_not_there_is_not_found() {
        let (x, y, k) = table(0.5, 0.0, 3);
        let contrasts = Contrasts::new(&x, &y, &k).expect("full rank");
        let sizes = contrasts.sizes();
        assert!(sizes.share2 < 0.04 && (sizes.noise2.sqrt() / 0.5 - 1.0).abs() < 0.4, "{sizes:?}");
        let row = contrasts.against_all(12, sizes, &contrasts);
        assert!((10.0..=30.0).contains(&row.freedom), "{row:?}");
    }

    /// Rows without errors have no contrasts.
    #[test]
    fn an_exact_table_has_none() {
        let (x, _, k) = table(0.5, 0.0, 3);
        let y = DVector::from_fn(32, |i, _| 3.0 + 0.2 * i as f64);
        assert!(Contrasts::new(&x, &y, &k).is_none());
    }
}
