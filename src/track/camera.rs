//! Which pixel a point is seen at, and which ray a pixel sees.
//!
//! Camera frame: origin at the centre of projection, x right, y down, z forward (m). A pinhole with the lens distortion of Brown (1966)
//! and Conrady (1919) as OpenCV orders it: with x = X/Z, y = Y/Z and r² = x² + y²,
//!
//! ```text
//! x' = x (1 + k₁r² + k₂r⁴ + k₃r⁶) + 2p₁xy + p₂(r² + 2x²)
//! y' = y (1 + k₁r² + k₂r⁴ + k₃r⁶) + p₁(r² + 2y²) + 2p₂xy
//! u = fₓx' + cₓ,  v = f_y y' + c_y
//! ```

use super::TrackError;
use crate::geometry::Vec3;
use nalgebra::{Matrix2, Vector2};

/// A pinhole camera with Brown–Conrady distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Width and height of its pictures (px).
    pub size_px: [usize; 2],
    /// Focal lengths fₓ and f_y (px).
    pub focal_px: [f64; 2],
    /// Principal point (px).
    pub principal_px: [f64; 2],
    /// Radial distortion k₁, k₂, k₃.
    pub radial: [f64; 3],
    /// Tangential distortion p₁, p₂.
    pub tangential: [f64; 2],
}

impl Camera {
    /// Newton steps that undistortion may take; lenses in use need four.
    const STEPS: usize = 30;
    /// Remaining error in normalised coordinates at which undistortion is done.
    const EXACT: f64 = 1e-13;

    /// Refuses what cannot be a camera.
    ///
    /// # Errors
    /// [`TrackError::Setting`].
    pub fn check(&self) -> Result<(), TrackError> {
        let wrong = |name, value, expected| Err(TrackError::Setting { name, value, expected });
        for focal in self.focal_px {
            if !(focal.is_finite() && focal > 0.0) {
                return wrong("focal_px", focal, "a positive number");
            }
        }
        for number in self.principal_px.into_iter().chain(self.radial).chain(self.tangential) {
            if !number.is_finite() {
                return wrong("a camera parameter", number, "a finite number");
            }
        }
        for size in self.size_px {
            if size == 0 {
                return wrong("size_px", 0.0, "at least one pixel");
            }
        }
        Ok(())
    }

    /// The pixel of a point in the camera frame; none for a point that is not in front of the camera.
    pub fn project(&self, point_m: Vec3) -> Option<[f64; 2]> {
        (point_m.z > 0.0).then(|| self.pixel(Vector2::new(point_m.x, point_m.y) / point_m.z))
    }

    /// The pixel of normalised coordinates (x, y) = (X/Z, Y/Z).
    pub fn pixel(&self, normalised: Vector2<f64>) -> [f64; 2] {
        let (bent, _) = self.distort(normalised);
        [self.focal_px[0] * bent.x + self.principal_px[0], self.focal_px[1] * bent.y + self.principal_px[1]]
    }

    /// How a pixel moves with normalised coordinates: ∂(u, v)/∂(x, y).
    pub fn pixel_jacobian(&self, normalised: Vector2<f64>) -> Matrix2<f64> {
        Matrix2::new(self.focal_px[0], 0.0, 0.0, self.focal_px[1]) * self.distort(normalised).1
    }

    /// Distorted coordinates and their derivative.
    fn distort(&self, n: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let (x, y) = (n.x, n.y);
        let r2 = x * x + y * y;
        let gain = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // dgain/dx = 2x · dgain/dr².
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let bent = Vector2::new(
            x * gain + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * gain + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let cross = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let jacobian = Matrix2::new(
            gain + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            cross,
            cross,
            gain + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        (bent, jacobian)
    }

    /// Normalised coordinates (x, y) of the ray that a pixel sees, by Newton's method; none where the distortion folds over, so that no
    /// ray or more than one would belong to the pixel.
    pub fn undistort(&self, pixel: [f64; 2]) -> Option<Vector2<f64>> {
        let target = Vector2::new(
            (pixel[0] - self.principal_px[0]) / self.focal_px[0],
            (pixel[1] - self.principal_px[1]) / self.focal_px[1],
        );
        let mut n = target;
        for _ in 0..Self::STEPS {
            let (bent, jacobian) = self.distort(n);
            let error = bent - target;
            if jacobian.determinant() <= 0.0 || jacobian.trace() <= 0.0 {
                return None;
            }
            let step = jacobian.try_inverse()? * error;
            n -= step;
            if error.amax() <= Self::EXACT * (1.0 + target.amax()) {
                return Some(n);
            }
        }
        None
    }

    /// The point at depth `z_m` that a pixel sees.
    pub fn back_project(&self, pixel: [f64; 2], z_m: f64) -> Option<Vec3> {
        let n = self.undistort(pixel)?;
        Some(Vec3::new(n.x * z_m, n.y * z_m, z_m))
    }

    /// Whether a pixel lies in the picture, at least `margin` from its border.
    pub fn sees(&self, pixel: [f64; 2], margin: f64) -> bool {
        (0..2).all(|i| pixel[i] >= margin && pixel[i] <= self.size_px[i] as f64 - 1.0 - margin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) const LENS: Camera = Camera {
        size_px: [1280, 1024],
        focal_px: [1400.0, 1395.0],
        principal_px: [645.0, 508.0],
        radial: [-0.21, 0.11, -0.03],
        tangential: [6e-4, -4e-4],
    };

    #[test]
    fn undistortion_is_the_inverse_everywhere_in_the_picture() {
        for v in (0..=1023).step_by(31) {
            for u in (0..=1279).step_by(31) {
                let pixel = [f64::from(u), f64::from(v)];
                let ray = LENS.undistort(pixel).expect("a mild lens");
                let back = LENS.pixel(ray);
                assert!((back[0] - pixel[0]).abs() < 1e-10 && (back[1] - pixel[1]).abs() < 1e-10);
                let again = LENS.undistort(back).expect("a mild lens");
                assert!((again - ray).amax() < 1e-12);
            }
        }
    }

    #[test]
    fn the_jacobian_is_that_of_central_differences() {
        let n = Vector2::new(0.31, -0.27);
        let h = 1e-6;
        for k in 0..2 {
            let mut step = Vector2::zeros();
            step[k] = h;
            let (a, b) = (LENS.pixel(n + step), LENS.pixel(n - step));
            let column = LENS.pixel_jacobian(n).column(k).into_owned();
            let difference = Vector2::new(a[0] - b[0], a[1] - b[1]) / (2.0 * h);
            assert!((column - difference).amax() < 1e-5, "{column} {difference}");
        }
    }

    #[test]
    fn a_lens_that_folds_has_no_ray_beyond_the_fold() {
        let folding = Camera { radial: [-1.0, 0.0, 0.0], ..LENS };
        // x − x³ is largest at x = 1/√3.
        assert_eq!(folding.undistort([645.0 + 1400.0 * 0.40, 508.0]), None);
        assert!(folding.undistort([645.0 + 1400.0 * 0.30, 508.0]).is_some());
    }

    #[test]
    fn points_behind_the_camera_have_no_pixel() {
        assert_eq!(LENS.project(Vec3::new(0.0, 0.0, -0.3)), None);
        let seen = LENS.project(Vec3::new(0.02, 0.01, 0.3)).expect("in front");
        let back = LENS.back_project(seen, 0.3).expect("a ray");
        assert!((back - Vec3::new(0.02, 0.01, 0.3)).norm() < 1e-13);
        assert!(Camera { focal_px: [0.0, 1.0], ..LENS }.check().is_err());
    }
}
