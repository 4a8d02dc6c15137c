//! What stands between camera and phantom: the tip and what holds it, as simple solids.

use super::camera::Camera;
use crate::geometry::{Vec3, basis_from_axis};
use std::ops::Range;

/// Pieces along its axis that are looked for in the picture one by one: a slanting rod fills little of the box around it.
const PIECES: usize = 8;

/// A shape in the phantom frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A cylinder with flat ends.
    Cylinder {
        /// Centre of the face towards the phantom (m).
        face_m: Vec3,
        /// Unit vector from that face to the other end.
        axis: Vec3,
        /// Radius (m).
        radius_m: f64,
        /// Length (m).
        length_m: f64,
    },
    /// A ball.
    Ball {
        /// Centre (m).
        centre_m: Vec3,
        /// Radius (m).
        radius_m: f64,
    },
}

/// A solid with a matt surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// Its shape and place.
    pub shape: Shape,
    /// Share of the light that it sends back.
    pub reflectance: f64,
}

impl Solid {
    /// A pad of given radius and thickness with its face at `face_m`, on a thinner rod of given length; `axis`: unit vector from the
    /// face to the holder (m, phantom frame).
    pub fn pad_on_rod(
        face_m: Vec3,
        axis: Vec3,
        [radius_m, thickness_m]: [f64; 2],
        rod_m: [f64; 2],
    ) -> [Self; 2] {
        let pad = Shape::Cylinder { face_m, axis, radius_m, length_m: thickness_m };
        let foot = face_m + axis * thickness_m;
        let rod = Shape::Cylinder { face_m: foot, axis, radius_m: rod_m[0], length_m: rod_m[1] };
        [Self { shape: pad, reflectance: 0.18 }, Self { shape: rod, reflectance: 0.35 }]
    }

    /// The solid elsewhere (m).
    pub(super) fn moved(mut self, by: &Vec3) -> Self {
        match &mut self.shape {
            Shape::Cylinder { face_m, .. } => *face_m += by,
            Shape::Ball { centre_m, .. } => *centre_m += by,
        }
        self
    }

    /// Where it is nearest to the phantom, roughly (m).
    pub(super) fn foot(&self) -> Vec3 {
        match self.shape {
            Shape::Cylinder { face_m, .. } => face_m,
            Shape::Ball { centre_m, .. } => centre_m,
        }
    }

    /// Where a ray first enters it: distance in units of `along`, and the outward normal there. A ray that begins inside misses.
    pub(super) fn hit(&self, from: &Vec3, along: &Vec3) -> Option<(f64, Vec3)> {
        match self.shape {
            Shape::Ball { centre_m, radius_m } => {
                let off = from - centre_m;
                let (a, half_b) = (along.norm_squared(), off.dot(along));
                let discriminant = half_b * half_b - a * (off.norm_squared() - radius_m * radius_m);
                if discriminant < 0.0 {
                    return None;
                }
                let t = (-half_b - discriminant.sqrt()) / a;
                (t > 0.0).then(|| (t, (off + along * t) / radius_m))
            }
            Shape::Cylinder { face_m, axis, radius_m, length_m } => {
                let off = from - face_m;
                let (height, rise) = (off.dot(&axis), along.dot(&axis));
                let (off, flat) = (off - axis * height, along - axis * rise);
                let a = flat.norm_squared();
                let half_b = off.dot(&flat);
                let c = off.norm_squared() - radius_m * radius_m;
                let discriminant = half_b * half_b - a * c;
                if discriminant < 0.0 || (a < 1e-18 && c > 0.0) {
                    return None;
                }
                // Through which of mantle and faces the ray comes in last, it enters the cylinder.
                let side = if a < 1e-18 { f64::NEG_INFINITY } else { (-half_b - discriminant.sqrt()) / a };
                let side_out = if a < 1e-18 { f64::INFINITY } else { (-half_b + discriminant.sqrt()) / a };
                let (low, high) = (-height / rise, (length_m - height) / rise);
                let (end, end_out) = if rise == 0.0 {
                    if !(0.0..=length_m).contains(&height) {
                        return None;
                    }
                    (f64::NEG_INFINITY, f64::INFINITY)
                } else {
                    (low.min(high), low.max(high))
                };
                let (t, out) = (side.max(end), side_out.min(end_out));
                (t > 0.0 && t <= out).then(|| {
                    let normal =
                        if side >= end { (off + flat * t) / radius_m } else { axis * -rise.signum() };
                    (t, normal)
                })
            }
        }
    }

    /// Distance (m) by which the way from a point to a lamp passes it, negative inside; flat ends count as rounded ones.
    ///
    /// Nearest points of two segments: Ericson 2005, Real-Time Collision Detection, section 5.1.9.
    pub(super) fn clearance(&self, from: &Vec3, to: &Vec3) -> f64 {
        let (start, spine, radius) = match self.shape {
            Shape::Cylinder { face_m, axis, radius_m, length_m } => (face_m, axis * length_m, radius_m),
            Shape::Ball { centre_m, radius_m } => (centre_m, Vec3::zeros(), radius_m),
        };
        let way = to - from;
        let off = from - start;
        let (a, b, e) = (way.norm_squared(), way.dot(&spine), spine.norm_squared());
        let (c, f) = (way.dot(&off), spine.dot(&off));
        let steep = a * e - b * b;
        let mut s = if steep > 1e-12 * a * e { ((b * f - c * e) / steep).clamp(0.0, 1.0) } else { 0.0 };
        let mut t = if e > 0.0 { (b * s + f) / e } else { 0.0 };
        if !(0.0..=1.0).contains(&t) || e == 0.0 {
            t = t.clamp(0.0, 1.0);
            s = ((b * t - c) / a).clamp(0.0, 1.0);
        }
        (off + way * s - spine * t).norm() - radius
    }

    /// Columns of each row of the picture that can show it; all of them when it reaches behind the camera.
    pub(super) fn extent(&self, camera: &Camera) -> Vec<Range<usize>> {
        let (width, height) = (camera.width, camera.height);
        let mut rows = vec![0..0; height];
        for piece in 0..PIECES {
            let [from, to] = [piece, piece + 1].map(|i| i as f64 / PIECES as f64);
            let corners = match self.shape {
                Shape::Ball { centre_m, radius_m } => {
                    box_around(centre_m, Vec3::z(), radius_m, [from, to].map(|s| radius_m * (2.0 * s - 1.0)))
                }
                Shape::Cylinder { face_m, axis, radius_m, length_m } => {
                    box_around(face_m, axis, radius_m, [from, to].map(|s| length_m * s))
                }
            };
            let seen: Option<Vec<[f64; 2]>> = corners.iter().map(|c| camera.project(c)).collect();
            let Some(seen) = seen else {
                return vec![0..width; height];
            };
            let [columns, shown] = [(0, width), (1, height)].map(|(a, size)| {
                let least = seen.iter().map(|p| p[a]).fold(f64::INFINITY, f64::min) - 3.0;
                let most = seen.iter().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max) + 4.0;
                least.clamp(0.0, size as f64) as usize..most.clamp(0.0, size as f64) as usize
            });
            for row in &mut rows[shown] {
                let empty = row.start == row.end;
                row.start = if empty { columns.start } else { row.start.min(columns.start) };
                row.end = if empty { columns.end } else { row.end.max(columns.end) };
            }
        }
        rows
    }
}

fn box_around(foot: Vec3, axis: Vec3, radius: f64, ends: [f64; 2]) -> Vec<Vec3> {
    let basis = basis_from_axis(&axis);
    let mut corners = Vec::with_capacity(8);
    for end in ends {
        for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            corners.push(foot + basis * Vec3::new(a * radius, b * radius, end));
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn post() -> Solid {
        let shape = Shape::Cylinder {
            face_m: Vec3::new(0.0, 0.0, 1.0),
            axis: Vec3::z(),
            radius_m: 0.5,
            length_m: 2.0,
        };
        Solid { shape, reflectance: 0.5 }
    }

    #[test]
    fn a_cylinder_is_met_where_it_is() -> Result<(), &'static str> {
        let (t, normal) = post().hit(&Vec3::new(3.0, 0.0, 2.0), &-Vec3::x()).ok_or("missed")?;
        assert!((t - 2.5).abs() < 1e-14 && (normal - Vec3::x()).norm() < 1e-14);
        let (t, normal) = post().hit(&Vec3::new(0.1, 0.2, 5.0), &-Vec3::z()).ok_or("missed")?;
        assert!((t - 2.0).abs() < 1e-14 && (normal - Vec3::z()).norm() < 1e-14);
        let slanting = Vec3::new(-1.0, 0.0, 1.0);
        let (t, normal) = post().hit(&Vec3::new(1.2, 0.0, 0.0), &slanting).ok_or("missed")?;
        assert!((t - 1.0).abs() < 1e-14 && (normal + Vec3::z()).norm() < 1e-14);
        for (from, along) in [
            (Vec3::new(3.0, 0.6, 2.0), -Vec3::x()),
            (Vec3::new(3.0, 0.0, 0.9), -Vec3::x()),
            (Vec3::new(0.6, 0.0, 0.0), Vec3::z()),
            (Vec3::new(3.0, 0.0, 2.0), Vec3::x()),
        ] {
            assert!(post().hit(&from, &along).is_none());
        }
        Ok(())
    }

    #[test]
    fn the_clearance_is_that_of_nearest_points() {
        let lamp = Vec3::new(2.0, 0.0, 3.0);
        // The way from (2, 0, 0) straight up is 2 m from the axis; one through the axis is inside by the radius.
        assert!((post().clearance(&Vec3::new(2.0, 0.0, 0.0), &lamp) - 1.5).abs() < 1e-12);
        assert!((post().clearance(&Vec3::new(-2.0, 0.0, 1.0), &lamp) + 0.5).abs() < 1e-12);
        // Above the end: from (0, 0, 4) on, √(1 + 0) from the end's centre.
        assert!((post().clearance(&Vec3::new(0.0, 0.0, 4.0), &Vec3::new(0.0, 0.0, 9.0)) - 0.5).abs() < 1e-12);
        let ball = Solid { shape: Shape::Ball { centre_m: Vec3::zeros(), radius_m: 1.0 }, reflectance: 0.5 };
        assert!((ball.clearance(&Vec3::new(-5.0, 3.0, 0.0), &Vec3::new(5.0, 3.0, 0.0)) - 2.0).abs() < 1e-12);
    }
}
