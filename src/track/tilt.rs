//! Where the centre of a round dot is, given where the centre of its image is.
//!
//! The image of a disc's centre is not the centre of the disc's image: perspective enlarges the nearer half of a tilted disc, and
//! distortion bends the rest. The centre of area of the image follows from its outline by Green's theorem,
//!
//! ```text
//! A = ½∮(x dy − y dx),   x̄ = ½∮x² dy / A,   ȳ = −½∮y² dx / A
//! ```
//!
//! over the rim P + R(e₁cos θ + e₂sin θ). The integrands are smooth and periodic, so that the trapezoidal rule converges faster than any
//! power of the number of points (Davis 1959).

use super::Camera;
use crate::geometry::{Vec3, basis_from_axis};
use nalgebra::Vector2;

/// A round dot in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscInSpace {
    /// Centre (m, camera frame).
    pub centre_m: Vec3,
    /// Normal, of any length but zero.
    pub normal: Vec3,
    /// Radius (m).
    pub radius_m: f64,
}

/// Points on the rim.
const POINTS: usize = 24;

impl DiscInSpace {
    /// Centre of area of the disc's image (px); none when the rim reaches behind the camera or is seen edge-on.
    pub fn image_centre(&self, camera: &Camera) -> Option<Vector2<f64>> {
        let basis = basis_from_axis(&self.normal);
        let (e1, e2) = (basis.column(0) * self.radius_m, basis.column(1) * self.radius_m);
        let middle = Vector2::from(camera.project(self.centre_m)?);
        let (mut area, mut first) = (0.0, Vector2::zeros());
        for k in 0..POINTS {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
            let point = self.centre_m + e1 * cos + e2 * sin;
            let along = e2 * cos - e1 * sin;
            if point.z <= 0.0 {
                return None;
            }
            let normalised = Vector2::new(point.x, point.y) / point.z;
            // Coordinates from the image of the centre, so that nothing large cancels.
            let p = Vector2::from(camera.pixel(normalised)) - middle;
            let d_normalised = (Vector2::new(along.x, along.y) - normalised * along.z) / point.z;
            let d = camera.pixel_jacobian(normalised) * d_normalised;
            area += 0.5 * (p.x * d.y - p.y * d.x);
            first += Vector2::new(0.5 * p.x * p.x * d.y, -0.5 * p.y * p.y * d.x);
        }
        (area.abs() > 1e-9 && first.iter().all(|x| x.is_finite())).then(|| middle + first / area)
    }

    /// How far the centre of the disc's image lies from the image of its centre (px).
    pub fn image_offset(&self, camera: &Camera) -> Option<Vector2<f64>> {
        Some(self.image_centre(camera)? - Vector2::from(camera.project(self.centre_m)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Camera = Camera {
        size_px: [1280, 1024],
        focal_px: [1400.0, 1395.0],
        principal_px: [645.0, 508.0],
        radial: [-0.21, 0.11, -0.03],
        tangential: [6e-4, -4e-4],
    };

    /// Mean over all points of a fine grid of the picture whose rays meet the disc: shares only undistortion with the integral.
    fn brute_force(disc: &DiscInSpace, around: Vector2<f64>, half: f64) -> Vector2<f64> {
        let step = half / 700.0;
        let normal = disc.normal.normalize();
        let (mut sum, mut count) = (Vector2::zeros(), 0.0);
        for j in -700..=700 {
            for i in -700..=700 {
                let pixel = around + Vector2::new(f64::from(i), f64::from(j)) * step;
                let ray = LENS.undistort(pixel.into()).expect("a mild lens").push(1.0);
                let hit = ray * (normal.dot(&disc.centre_m) / normal.dot(&ray));
                if (hit - disc.centre_m).norm() <= disc.radius_m {
                    sum += pixel - around;
                    count += 1.0;
                }
            }
        }
        around + sum / count
    }

    #[test]
    fn the_centre_of_the_image_is_that_of_brute_force() {
        for (centre_m, normal, radius_m) in [
            (Vec3::new(0.02, -0.01, 0.25), Vec3::new(0.5, 0.1, -1.0), 2e-3),
            (Vec3::new(-0.09, 0.07, 0.25), Vec3::new(0.8, -0.4, -1.0), 4e-3),
            (Vec3::new(0.0, 0.0, 0.2), Vec3::new(0.0, 1.2, -1.0), 6e-3),
        ] {
            let disc = DiscInSpace { centre_m, normal, radius_m };
            let seen = disc.image_centre(&LENS).expect("in front");
            let half = 1.15 * 1400.0 * radius_m / centre_m.z;
            let expected = brute_force(&disc, seen, half);
            let offset = disc.image_offset(&LENS).expect("in front").norm();
            println!("offset {offset:.4} px, against brute force {:.5} px", (seen - expected).norm());
            assert!((seen - expected).norm() < 1e-3 + 1e-3 * offset);
            assert!(offset > 0.01);
        }
    }

    /// A pinhole sees a tilted disc as the ellipse of its conic; on the axis, with focal length f, distance z, radius R and tilt τ, the
    /// centre moves by f R² sin τ cos τ/(z² − R² sin² τ).
    #[test]
    fn on_the_axis_the_offset_is_the_closed_form() {
        let pinhole = Camera { focal_px: [1000.0; 2], radial: [0.0; 3], tangential: [0.0; 2], ..LENS };
        let (z, r, tilt) = (0.2, 5e-3, 0.7_f64);
        let disc = DiscInSpace {
            centre_m: Vec3::new(0.0, 0.0, z),
            normal: Vec3::new(tilt.sin(), 0.0, -tilt.cos()),
            radius_m: r,
        };
        let offset = disc.image_offset(&pinhole).expect("in front");
        // Extremes along the tilt: x = ±f R cos τ/(z ± R sin τ) with the nearer side farther out.
        let near = 1000.0 * r * tilt.cos() / (z - r * tilt.sin());
        let far = 1000.0 * r * tilt.cos() / (z + r * tilt.sin());
        assert!((offset.x.abs() - 0.5 * (near - far)).abs() < 1e-9, "{offset}");
        let closed = 1000.0 * r * r * tilt.sin() * tilt.cos() / (z * z - (r * tilt.sin()).powi(2));
        assert!((offset.x.abs() - closed).abs() < 1e-9 && offset.y.abs() < 1e-9);
        let behind = DiscInSpace { centre_m: Vec3::new(0.0, 0.0, -0.1), ..disc };
        assert_eq!(behind.image_centre(&pinhole), None);
    }
}
