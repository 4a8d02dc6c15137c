//! What the pictures of these tests are taken of: a sheet, a camera above it, even light, and the centroid of what it shows.

use super::super::*;
use crate::geometry::Vec3;

/// A square sheet of 40 mm that faces a camera above it at `height_m`.
pub(super) fn sheet(cell_m: f64) -> Surface {
    Surface::block([0.04, 0.04, 0.001], cell_m).expect("a block")
}

pub(super) fn above(focal_px: f64, size: [usize; 2], height_m: f64) -> Camera {
    let middle = Vec3::new(0.02, 0.02, 0.001);
    let lens = Lens::undistorted(focal_px, size[0], size[1]);
    Camera::looking_at(lens, size, middle + Vec3::z() * height_m, middle, Vec3::y())
}

/// Even light, no glare, no noise; grey levels from 0 to 200 for the dots.
pub(super) fn plain(camera: Camera) -> PixelSetup {
    let lighting = Lighting { ambient: 1.0, ambient_slope_per_m: Vec3::zeros(), lamps: Vec::new() };
    let finish = Finish {
        gel_reflectance: 0.0,
        gel_mottle: 0.0,
        dot_reflectance: 1.0,
        plate_reflectance: 0.0,
        wet_reflectance: 0.0,
        ..Finish::default()
    };
    let sensor = Sensor { grey_per_radiance: 200.0, black_grey: 0.0, ..Sensor::default().perfect() };
    let depth = Some(DepthSetup::exact());
    PixelSetup { camera, sensor, shutter: Shutter::default(), lighting, finish, depth, seed: 1 }
}

pub(super) fn dot_at(surface: &Surface, number: u32, point: Vec3, radius_m: f64) -> Dot {
    let place = surface.attach(&point).expect("a surface");
    Dot { number, place, radius_m, raggedness: 0.0 }
}

/// Sum and centroid of the light before rounding around a pixel.
pub(super) fn centroid(renderer: &Renderer, about: [f64; 2], reach: f64) -> (f64, [f64; 2]) {
    let picture = renderer.light();
    let (mut sum, mut moment) = (0.0, [0.0; 2]);
    let width = renderer.setup().camera.width;
    for (at, &light) in picture.iter().enumerate() {
        let (u, v) = ((at % width) as f64, (at / width) as f64);
        if (u - about[0]).abs() <= reach && (v - about[1]).abs() <= reach {
            let light = f64::from(light);
            sum += light;
            moment = [moment[0] + light * u, moment[1] + light * v];
        }
    }
    (sum, moment.map(|m| m / sum))
}
