//! What is seen around the phantom: the plate on which it lies, and the solids in front of it.

use super::raster::{Picture, SHADOWED, SOLID, View, nearest};
use super::surface::NONE;
use crate::geometry::Vec3;

/// Pixels between two places where the plate's light is computed.
const PLATE_STEP: usize = 16;

impl View<'_> {
    /// Fills what no triangle covers with the plate.
    pub(super) fn draw_plate(&self, picture: &mut Picture) {
        let up = self.camera.pose.rotation * Vec3::z();
        let distance = up.dot(&self.camera.seen(&Vec3::new(0.0, 0.0, self.plate_m)));
        let plane = up / distance;
        let (width, height) = (picture.width, picture.height);
        let columns = width / PLATE_STEP + 2;
        let reflectance = self.shading.finish().plate_reflectance;
        let knots = |row: usize| -> Vec<(f32, f32)> {
            let knot = |column: usize| {
                let at = row.min(height - 1) * width + (column * PLATE_STEP).min(width - 1);
                let ray = [f64::from(self.rays.x[at]), f64::from(self.rays.y[at])];
                let nearness = plane.x * ray[0] + plane.y * ray[1] + plane.z;
                if nearness <= 0.0 {
                    return (0.0, 1.0);
                }
                let place = self.place(ray, 1.0 / nearness);
                let free = match self.projector {
                    Some(lens) => nearest(&self.placed.solids, &place, &lens),
                    None => 1.0,
                };
                ((reflectance * self.shading.irradiance(&place, &Vec3::z(), true)) as f32, free as f32)
            };
            (0..columns).map(knot).collect()
        };
        let plane = plane.map(|x| x as f32);
        let (mut above, mut below, mut line) = (Vec::new(), knots(0), Vec::new());
        for row in 0..height {
            if row % PLATE_STEP == 0 {
                above = below;
                below = knots(row + PLATE_STEP);
            }
            let down = (row % PLATE_STEP) as f32 / PLATE_STEP as f32;
            let mix = |(a, b): (f32, f32), (c, d): (f32, f32), share: f32| {
                (a + share * (c - a), b + share * (d - b))
            };
            line.clear();
            line.extend(above.iter().zip(&below).map(|(above, below)| mix(*above, *below, down)));
            let start = row * width;
            for (cell, ends) in line.windows(2).enumerate() {
                let from = (cell * PLATE_STEP).min(width);
                for column in from..(from + PLATE_STEP).min(width) {
                    let pixel = start + column;
                    if picture.triangle[pixel] != NONE {
                        continue;
                    }
                    let right = (column - from) as f32 / PLATE_STEP as f32;
                    let (radiance, free) = mix(ends[0], ends[1], right);
                    let nearness = plane.x * self.rays.x[pixel] + plane.y * self.rays.y[pixel] + plane.z;
                    picture.nearness[pixel] = nearness.max(0.0);
                    picture.radiance[pixel] = radiance;
                    picture.marks[pixel] = if free < 0.0 { SHADOWED } else { 0 };
                }
            }
        }
    }

    /// Draws the solids over what they hide.
    pub(super) fn draw_solids(&self, picture: &mut Picture) {
        let eye = self.camera.eye();
        for (solid, class) in self.placed.solids.iter().zip(SOLID..) {
            for (row, columns) in solid.extent(self.camera).into_iter().enumerate() {
                for column in columns {
                    let pixel = row * picture.width + column;
                    let ray = [f64::from(self.rays.x[pixel]), f64::from(self.rays.y[pixel])];
                    // The third component of the ray is 1 in the camera frame: the distance along it is z.
                    let along = self.camera.pose.rotation.inverse() * Vec3::new(ray[0], ray[1], 1.0);
                    let Some((z, normal)) = solid.hit(&eye, &along) else { continue };
                    let nearness = (1.0 / z) as f32;
                    if nearness > picture.nearness[pixel] {
                        let place = eye + along * z;
                        let light = self.shading.irradiance(&place, &normal, false);
                        picture.radiance[pixel] = (solid.reflectance * light) as f32;
                        picture.nearness[pixel] = nearness;
                        picture.class[pixel] = class;
                        picture.marks[pixel] = 0;
                    }
                }
            }
        }
    }
}
