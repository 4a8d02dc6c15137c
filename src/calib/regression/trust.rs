//! Which step within a trusted region lowers Σ (r + J s)² most?
//!
//! The step with damping λ solves min |J s + r|² + λ |D s|², as one triangle of J above √λ D by reflections, never through JᵀJ. λ is found so
//! that |D s| is the radius to a tenth, by the rational steps of Moré (1978, The Levenberg–Marquardt algorithm, section 5).

use nalgebra::{DMatrix, DVector};

/// How close |D s| must come to the radius.
const CLOSE: f64 = 0.1;
/// Steps of λ at most.
const TRIES: usize = 30;
/// A diagonal entry of the triangle below this share of the greatest says that the direction is open.
const OPEN: f64 = 1e-15;

/// J reduced to its triangle with Qᵀr beside it; columns in the scale of D.
pub(super) struct Triangle {
    r: DMatrix<f64>,
    right: DVector<f64>,
    scale: DVector<f64>,
}

impl Triangle {
    pub(super) fn new(jacobian: &DMatrix<f64>, residuals: &DVector<f64>, scale: &DVector<f64>) -> Self {
        let p = jacobian.ncols();
        let mut scaled = jacobian.clone();
        for (j, s) in scale.iter().enumerate() {
            scaled.column_mut(j).scale_mut(1.0 / s);
        }
        let qr = scaled.qr();
        let mut right = residuals.clone();
        qr.q_tr_mul(&mut right);
        Self { r: qr.r(), right: right.rows(0, p).into_owned(), scale: scale.clone() }
    }

    /// The step without damping; none where a direction is open.
    pub(super) fn whole(&self) -> Option<DVector<f64>> {
        let greatest = self.r.diagonal().amax();
        if self.r.diagonal().iter().any(|d| d.abs() <= OPEN * greatest) {
            return None;
        }
        Some(-self.r.solve_upper_triangular(&self.right)?)
    }

    /// A scaled step in the parameters' own lengths.
    pub(super) fn in_parameters(&self, scaled: &DVector<f64>) -> DVector<f64> {
        scaled.component_div(&self.scale)
    }

    /// The damped step in scaled lengths, and |R⁻ᵀ D s / |D s||² for the next λ.
    fn damped(&self, damping: f64) -> Option<(DVector<f64>, f64)> {
        let p = self.right.len();
        let mut stacked = DMatrix::zeros(2 * p, p);
        stacked.rows_mut(0, p).copy_from(&self.r);
        for j in 0..p {
            stacked[(p + j, j)] = damping.sqrt();
        }
        let mut right = DVector::zeros(2 * p);
        right.rows_mut(0, p).copy_from(&self.right);
        let qr = stacked.qr();
        qr.q_tr_mul(&mut right);
        let triangle = qr.r();
        let step = -triangle.solve_upper_triangular(&right.rows(0, p).into_owned())?;
        let length = step.norm();
        let bent = triangle.tr_solve_upper_triangular(&(&step / length))?;
        Some((step, bent.norm_squared()))
    }

    /// The best step within the radius, in the parameters' own lengths, with its scaled length and what it should lower Σ r² by.
    pub(super) fn within(&self, radius: f64) -> Option<(DVector<f64>, f64, f64)> {
        let whole = self.whole().filter(|s| s.norm() <= (1.0 + CLOSE) * radius);
        let scaled = match whole {
            Some(step) => step,
            None => {
                let gradient = (self.r.transpose() * &self.right).norm();
                let mut low = 0.0;
                let mut high = gradient / radius;
                let mut damping = (1e-3 * high).max(f64::MIN_POSITIVE);
                let mut best = None;
                for _ in 0..TRIES {
                    let (step, bent) = self.damped(damping)?;
                    let length = step.norm();
                    let excess = length - radius;
                    best = Some(step);
                    if excess.abs() <= CLOSE * radius {
                        break;
                    }
                    if excess > 0.0 {
                        low = damping
                    } else {
                        high = damping
                    }
                    damping += (excess / radius) / bent;
                    if !(damping > low && damping < high) {
                        damping = if low > 0.0 { (low * high).sqrt() } else { 1e-3 * high };
                    }
                }
                best?
            }
        };
        let gain = self.right.norm_squared() - (&self.r * &scaled + &self.right).norm_squared();
        let length = scaled.norm();
        Some((self.in_parameters(&scaled), length, gain))
    }

    /// Inverse of R in the parameters' own lengths; none where a direction is open.
    pub(super) fn inverse(&self) -> Option<DMatrix<f64>> {
        self.whole()?;
        let p = self.right.len();
        let mut inverse = self.r.solve_upper_triangular(&DMatrix::identity(p, p))?;
        for (i, s) in self.scale.iter().enumerate() {
            inverse.row_mut(i).scale_mut(1.0 / s);
        }
        Some(inverse)
    }

    /// |Qᵀr|²: the part of Σ r² that the parameters can reach.
    pub(super) fn reached(&self) -> f64 {
        self.right.norm_squared()
    }
}
