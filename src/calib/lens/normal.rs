//! The normal equations of an adjustment: one camera, many boards.
//!
//! A picture's residuals depend on the camera and on the pose of its own board only, so that the matrix is an arrow: A for the camera, Cᵢ for
//! each pose, Bᵢ between them. Poses are eliminated first (Brown 1958; the reduced matrix is a Schur complement),
//!
//! ```text
//! (A − Σ Bᵢ Cᵢ⁻¹ Bᵢᵀ) δ = a − Σ Bᵢ Cᵢ⁻¹ cᵢ,   δᵢ = Cᵢ⁻¹ (cᵢ − Bᵢᵀ δ)
//! ```
//!
//! and the inverse of the reduced matrix is the covariance of the camera, whatever the poses are.

use super::pose::{ByLens, PARAMETERS, Projected};
use nalgebra::{Cholesky, Matrix2, Matrix6, SMatrix, U6, Vector2, Vector6};

/// A square matrix over the parameters of a camera.
pub(super) type LensSquare = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Which parameters of a camera are adjusted.
pub(super) type Free = [bool; PARAMETERS];

/// What one picture adds.
#[derive(Clone)]
pub(super) struct ByPicture {
    across: SMatrix<f64, PARAMETERS, 6>,
    own: Matrix6<f64>,
    right: Vector6<f64>,
}

/// The normal equations.
pub(super) struct Normal {
    lens: LensSquare,
    right: ByLens,
    pictures: Vec<ByPicture>,
}

/// A step of all unknowns.
pub(super) struct Step {
    pub(super) lens: ByLens,
    pub(super) poses: Vec<Vector6<f64>>,
    /// The largest part of it, in standard deviations that the unknown would have if all others were known.
    pub(super) length: f64,
}

/// Equations of the camera alone, and the factored matrices of the poses.
struct Reduced {
    matrix: LensSquare,
    right: ByLens,
    factors: Vec<Cholesky<f64, U6>>,
}

impl Normal {
    pub(super) fn new(pictures: usize) -> Self {
        let empty = ByPicture { across: SMatrix::zeros(), own: Matrix6::zeros(), right: Vector6::zeros() };
        Self { lens: LensSquare::zeros(), right: ByLens::zeros(), pictures: vec![empty; pictures] }
    }

    /// Adds a point with its residual (seen less projected, px) and its weight (1/px²).
    pub(super) fn add(
        &mut self,
        picture: usize,
        at: &Projected,
        residual: Vector2<f64>,
        weight: &Matrix2<f64>,
    ) {
        let (by_lens, by_pose) = (at.by_lens.transpose() * weight, at.by_pose.transpose() * weight);
        self.lens += by_lens * at.by_lens;
        self.right += by_lens * residual;
        let own = &mut self.pictures[picture];
        own.across += by_lens * at.by_pose;
        own.own += by_pose * at.by_pose;
        own.right += by_pose * residual;
    }

    /// The step with Marquardt's damping (1963): diagonals larger by a share. None where the equations are singular.
    pub(super) fn step(&self, damping: f64, free: &Free) -> Option<Step> {
        let Reduced { matrix, right, factors } = self.reduced(damping, free)?;
        let lens = Balanced::of(&matrix)?.solve(&right);
        let mut length = longest(lens.iter().zip(self.lens.diagonal().iter()));
        let mut poses = Vec::with_capacity(self.pictures.len());
        for (picture, factor) in self.pictures.iter().zip(&factors) {
            let step = factor.solve(&(picture.right - picture.across.transpose() * lens));
            length = length.max(longest(step.iter().zip(picture.own.diagonal().iter())));
            poses.push(step);
        }
        Some(Step { lens, poses, length })
    }

    /// Covariance of the camera's parameters, 0 for those that are held; none where a free one is not determined at all.
    pub(super) fn covariance(&self, free: &Free) -> Option<LensSquare> {
        let mut covariance = Balanced::of(&self.reduced(0.0, free)?.matrix)?.inverse();
        for k in (0..PARAMETERS).filter(|&k| !free[k]) {
            covariance[(k, k)] = 0.0;
        }
        covariance.iter().all(|c| c.is_finite()).then_some(covariance)
    }

    /// The reduced equations with held parameters taken out.
    fn reduced(&self, damping: f64, free: &Free) -> Option<Reduced> {
        let damped = |diagonal: f64| diagonal * (1.0 + damping);
        let (mut matrix, mut right) = (self.lens, self.right);
        (0..PARAMETERS).for_each(|k| matrix[(k, k)] = damped(matrix[(k, k)]));
        let mut factors = Vec::with_capacity(self.pictures.len());
        for picture in &self.pictures {
            let mut own = picture.own;
            (0..6).for_each(|k| own[(k, k)] = damped(own[(k, k)]));
            let factor = own.cholesky()?;
            matrix -= picture.across * factor.solve(&picture.across.transpose());
            right -= picture.across * factor.solve(&picture.right);
            factors.push(factor);
        }
        for k in (0..PARAMETERS).filter(|&k| !free[k]) {
            matrix.row_mut(k).fill(0.0);
            matrix.column_mut(k).fill(0.0);
            matrix[(k, k)] = 1.0;
            right[k] = 0.0;
        }
        Some(Reduced { matrix, right, factors })
    }
}

fn longest<'a>(parts: impl Iterator<Item = (&'a f64, &'a f64)>) -> f64 {
    parts.map(|(step, information)| step.abs() * information.max(0.0).sqrt()).fold(0.0, f64::max)
}

/// A factored matrix after its diagonal was scaled to 1: focal lengths are thousands of pixels, distortions are tenths.
struct Balanced {
    factor: Cholesky<f64, nalgebra::Const<PARAMETERS>>,
    scale: ByLens,
}

impl Balanced {
    fn of(matrix: &LensSquare) -> Option<Self> {
        let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
        if scale.iter().any(|s| !s.is_finite()) {
            return None;
        }
        let balanced = LensSquare::from_fn(|i, j| scale[i] * matrix[(i, j)] * scale[j]);
        Some(Self { factor: balanced.cholesky()?, scale })
    }

    fn solve(&self, right: &ByLens) -> ByLens {
        self.factor.solve(&right.component_mul(&self.scale)).component_mul(&self.scale)
    }

    fn inverse(&self) -> LensSquare {
        let inverse = self.factor.inverse();
        LensSquare::from_fn(|i, j| self.scale[i] * inverse[(i, j)] * self.scale[j])
    }
}
