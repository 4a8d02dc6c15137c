//! Which pixel a ray meets, and which ray a pixel sees.
//!
//! Camera frame: x to the right of the picture, y down, z along the optical axis (m). The centre of the first pixel has the coordinates
//! (0, 0). A ray is given by its ideal coordinates (x/z, y/z).

use super::error::{PixelError, within};
use crate::geometry::Vec3;

/// Steps of Newton's method; a lens that needs more folds over.
const STEPS: usize = 12;
/// Ideal coordinates are that exact: 1e-9 of a pixel for any usual focal length.
const EXACT: f64 = 1e-13;

/// A pinhole with Brown–Conrady distortion (Brown 1971, Close-range camera calibration, eq. 9–11, with r² = x² + y²):
///
/// x' = x (1 + k₁r² + k₂r⁴ + k₃r⁶) + 2 p₁xy + p₂(r² + 2x²), y' = y (1 + …) + p₁(r² + 2y²) + 2 p₂xy;
/// u = f_u x' + c_u, v = f_v y' + c_v. Verified by `the_slope_is_that_of_the_distortion` and `a_pixel_sees_what_meets_it`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal lengths (px).
    pub focal_px: [f64; 2],
    /// Principal point (px).
    pub centre_px: [f64; 2],
    /// k₁, k₂, k₃.
    pub radial: [f64; 3],
    /// p₁, p₂.
    pub tangential: [f64; 2],
}

impl Lens {
    /// A lens without distortion, centred on a picture.
    pub fn undistorted(focal_px: f64, width: usize, height: usize) -> Self {
        let centre_px = [width, height].map(|n| 0.5 * (n as f64 - 1.0));
        Self { focal_px: [focal_px; 2], centre_px, radial: [0.0; 3], tangential: [0.0; 2] }
    }

    pub(super) fn check(&self) -> Result<(), PixelError> {
        for focal in self.focal_px {
            within("a focal length (px)", focal, 1.0, 1e6, "1 to 1,000,000")?;
        }
        let others = self.centre_px.iter().chain(&self.radial).chain(&self.tangential);
        for &figure in others {
            within("a figure of the lens", figure, -1e6, 1e6, "a finite number")?;
        }
        Ok(())
    }

    /// Pixel coordinates that a ray meets.
    pub fn pixel(&self, ideal: [f64; 2]) -> [f64; 2] {
        let bent = self.bent(ideal);
        std::array::from_fn(|a| self.focal_px[a] * bent[a] + self.centre_px[a])
    }

    /// Pixel coordinates of a point in the camera frame; none behind the camera or where the lens folds over.
    pub fn project(&self, point: &Vec3) -> Option<[f64; 2]> {
        if point.z <= 1e-6 {
            return None;
        }
        let ideal = [point.x / point.z, point.y / point.z];
        let slope = self.slope(ideal);
        // Beyond the fold the distortion brings rays back into the picture that no real lens lets in.
        (slope[0][0] * slope[1][1] - slope[0][1] * slope[1][0] > 0.0).then(|| self.pixel(ideal))
    }

    /// The ray of a pixel, by Newton's method from a first guess.
    pub(super) fn ray_from(&self, pixel: [f64; 2], guess: [f64; 2]) -> Option<[f64; 2]> {
        let wanted: [f64; 2] = std::array::from_fn(|a| (pixel[a] - self.centre_px[a]) / self.focal_px[a]);
        let mut at = guess;
        for _ in 0..STEPS {
            let bent = self.bent(at);
            let off = [wanted[0] - bent[0], wanted[1] - bent[1]];
            if off[0].abs().max(off[1].abs()) < EXACT {
                return Some(at);
            }
            let inverse = inverted(self.slope(at))?;
            at = std::array::from_fn(|a| at[a] + inverse[a][0] * off[0] + inverse[a][1] * off[1]);
        }
        let bent = self.bent(at);
        ((wanted[0] - bent[0]).abs().max((wanted[1] - bent[1]).abs()) < 1e3 * EXACT).then_some(at)
    }

    /// The ray of a pixel.
    pub fn ray(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let start = std::array::from_fn(|a| (pixel[a] - self.centre_px[a]) / self.focal_px[a]);
        self.ray_from(pixel, start)
    }

    /// How the ray changes from pixel to pixel there: rows x and y, columns u and v (1/px).
    pub(super) fn ray_slope(&self, ideal: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let inverse = inverted(self.slope(ideal))?;
        Some(inverse.map(|row| [row[0] / self.focal_px[0], row[1] / self.focal_px[1]]))
    }

    fn bent(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let r2 = x * x + y * y;
        let gain = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            x * gain + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * gain + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// ∂(x', y')/∂(x, y).
    fn slope(&self, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let r2 = x * x + y * y;
        let gain = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // dgain/dx = steep · x, likewise along y.
        let steep = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let mixed = steep * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
        [
            [gain + steep * x * x + 2.0 * p1 * y + 6.0 * p2 * x, mixed],
            [mixed, gain + steep * y * y + 6.0 * p1 * y + 2.0 * p2 * x],
        ]
    }
}

fn inverted(m: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    (determinant > 1e-9).then(|| {
        [[m[1][1] / determinant, -m[0][1] / determinant], [-m[1][0] / determinant, m[0][0] / determinant]]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bent_lens() -> Lens {
        Lens {
            radial: [-0.12, 0.05, -0.01],
            tangential: [8e-4, -5e-4],
            ..Lens::undistorted(1500.0, 1280, 1024)
        }
    }

    #[test]
    fn the_slope_is_that_of_the_distortion() {
        let (lens, step) = (bent_lens(), 1e-6);
        for at in [[0.1, -0.2], [-0.4, 0.3], [0.0, 0.0]] {
            for b in 0..2 {
                let (mut more, mut less) = (at, at);
                more[b] += step;
                less[b] -= step;
                let (more, less) = (lens.bent(more), lens.bent(less));
                for a in 0..2 {
                    let central = (more[a] - less[a]) / (2.0 * step);
                    assert!((lens.slope(at)[a][b] - central).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_pixel_sees_what_meets_it() -> Result<(), &'static str> {
        let lens = bent_lens();
        for pixel in [[0.0, 0.0], [1279.0, 1023.0], [640.0, 3.0], [12.5, 900.25]] {
            let met = lens.pixel(lens.ray(pixel).ok_or("no ray")?);
            assert!((met[0] - pixel[0]).hypot(met[1] - pixel[1]) < 1e-8);
        }
        Ok(())
    }

    #[test]
    fn beyond_the_fold_nothing_is_seen() {
        let lens = Lens { radial: [-0.5, 0.0, 0.0], ..Lens::undistorted(500.0, 1000, 1000) };
        // d(x − 0.5x³)/dx = 0 at x = √(2/3), where x' = 0.544.
        assert!(lens.project(&Vec3::new(0.9, 0.0, 1.0)).is_none());
        assert!(lens.ray([499.5 + 500.0 * 0.56, 499.5]).is_none());
        assert!(lens.project(&Vec3::new(0.1, 0.0, -1.0)).is_none());
    }
}
