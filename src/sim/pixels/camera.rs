//! Where the camera stands, how large its picture is, and which ray every pixel sees.

use super::error::{PixelError, within};
use super::lens::Lens;
use crate::geometry::Vec3;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

/// A camera in the phantom frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Its lens.
    pub lens: Lens,
    /// Takes points from the phantom frame to the camera frame (m; see [`Lens`]).
    pub pose: Isometry3<f64>,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Camera {
    /// A camera at `eye` that has `target` on its optical axis; `up` (any direction but that of the axis) points to the top of the
    /// picture. All in the phantom frame (m).
    pub fn looking_at(lens: Lens, [width, height]: [usize; 2], eye: Vec3, target: Vec3, up: Vec3) -> Self {
        let forward = (target - eye).normalize();
        let right = forward.cross(&up).normalize();
        let down = forward.cross(&right);
        let rows = nalgebra::Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let rotation = UnitQuaternion::from_matrix(&rows);
        let pose = Isometry3::from_parts(Translation3::from(-(rotation * eye)), rotation);
        Self { lens, pose, width, height }
    }

    pub(super) fn check(&self) -> Result<(), PixelError> {
        self.lens.check()?;
        within("the picture's width (px)", self.width as f64, 8.0, 16384.0, "8 to 16,384")?;
        within("the picture's height (px)", self.height as f64, 8.0, 16384.0, "8 to 16,384")
    }

    /// Where the camera stands in the phantom frame (m).
    pub fn eye(&self) -> Vec3 {
        self.pose.inverse_transform_point(&Point3::origin()).coords
    }

    /// A point of the phantom frame in the camera frame (m).
    pub fn seen(&self, point: &Vec3) -> Vec3 {
        self.pose.transform_point(&Point3::from(*point)).coords
    }

    /// Pixel coordinates of a point of the phantom frame; none behind the camera.
    pub fn project(&self, point: &Vec3) -> Option<[f64; 2]> {
        self.lens.project(&self.seen(point))
    }
}

/// Ideal coordinates of every pixel's centre, row by row.
#[derive(Debug, Clone)]
pub(super) struct Rays {
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
}

impl Rays {
    pub(super) fn of(camera: &Camera) -> Result<Self, PixelError> {
        let (width, height) = (camera.width, camera.height);
        let mut rays = Self { x: Vec::with_capacity(width * height), y: Vec::with_capacity(width * height) };
        for row in 0..height {
            for column in 0..width {
                let ideal = camera
                    .lens
                    .ray([column as f64, row as f64])
                    .ok_or(PixelError::LensFolds { column, row })?;
                rays.x.push(ideal[0] as f32);
                rays.y.push(ideal[1] as f32);
            }
        }
        Ok(rays)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_it_looks_at_is_in_the_middle_and_up_is_up() -> Result<(), &'static str> {
        let (eye, target) = (Vec3::new(0.3, -0.1, 0.5), Vec3::new(0.05, 0.07, 0.04));
        let camera =
            Camera::looking_at(Lens::undistorted(900.0, 640, 480), [640, 480], eye, target, Vec3::y());
        let middle = camera.project(&target).ok_or("behind")?;
        assert!((middle[0] - 319.5).hypot(middle[1] - 239.5) < 1e-9);
        let above = camera.project(&(target + Vec3::y() * 0.01)).ok_or("behind")?;
        assert!(above[1] < middle[1] && (camera.eye() - eye).norm() < 1e-12);
        Ok(())
    }
}
