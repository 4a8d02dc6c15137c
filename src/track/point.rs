//! Where a dot is in space: from its centre in the picture and the plane around it.
//!
//! The dot's ray meets the plane: z = 1/(α + βx + γy), P = z (x, y, 1). The covariance has two independent sources, the centre in the
//! picture (which slides along the plane) and the depth of the plane (which slides along the ray):
//!
//! ```text
//! C = J Cₚ Jᵀ + r rᵀ σ_z²  with  J = ∂P/∂(u, v),  r = ∂P/∂z = (x, y, 1)
//! ```

use super::tilt::DiscInSpace;
use super::{Camera, Dot, SurfaceAtDot};
use crate::geometry::{Mat3, Vec3};
use nalgebra::{Matrix2, Matrix3x2, Vector2};

/// A dot in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DotInSpace {
    /// Centre (m).
    pub position_m: Vec3,
    /// Covariance of the centre (m²).
    pub covariance_m2: Mat3,
    /// The plane around it.
    pub surface: SurfaceAtDot,
    /// How far the image of the centre lies from the centre of the image (px): what the correction for tilt and lens took away.
    pub corrected_px: [f64; 2],
}

/// The correction is a few hundredths of a pixel and changes with the position by less than a thousandth of itself.
const STEPS: usize = 2;

/// The dot's centre in space; none when its ray does not meet the plane.
pub(super) fn locate(camera: &Camera, dot: &Dot, surface: &SurfaceAtDot) -> Option<DotInSpace> {
    let measured = Vector2::from(dot.centre_px);
    let mut offset = Vector2::zeros();
    let mut met = meet(camera, measured, surface)?;
    for _ in 0..STEPS {
        let radius_m = dot.longest_px() * met.0.z / camera.focal_px[0].max(camera.focal_px[1]);
        let disc = DiscInSpace { centre_m: met.0, normal: surface.normal, radius_m };
        offset = disc.image_offset(camera)?;
        met = meet(camera, measured - offset, surface)?;
    }
    let (position_m, slide) = met;
    let along_ray = position_m / position_m.z;
    let covariance_m2 = slide * dot.covariance_px2 * slide.transpose()
        + along_ray * along_ray.transpose() * surface.depth_std_m.powi(2);
    Some(DotInSpace { position_m, covariance_m2, surface: *surface, corrected_px: offset.into() })
}

/// Where the ray of a pixel meets the plane, and how that moves with the pixel.
fn meet(camera: &Camera, pixel: Vector2<f64>, surface: &SurfaceAtDot) -> Option<(Vec3, Matrix3x2<f64>)> {
    let n = camera.undistort(pixel.into())?;
    let (alpha, slopes) = (surface.plane[0], Vector2::new(surface.plane[1], surface.plane[2]));
    let inverse = alpha + slopes.dot(&n);
    if inverse <= 0.0 {
        return None;
    }
    let z = 1.0 / inverse;
    // ∂z/∂n = −z² (β, γ).
    let dz = -slopes.transpose() * (z * z);
    let upper = Matrix2::identity() * z + n * dz;
    let by_ray = Matrix3x2::from_rows(&[upper.row(0).into_owned(), upper.row(1).into_owned(), dz]);
    let to_ray = camera.pixel_jacobian(n).try_inverse()?;
    Some((Vec3::new(n.x * z, n.y * z, z), by_ray * to_ray))
}
