//! Which triangle each pixel's centre sees, how far away, and how bright it is there.

use super::camera::{Camera, Rays};
use super::light::{Lit, Shading, Single};
use super::scene::Placed;
use super::solid::Solid;
use super::surface::{NONE, Surface};
use crate::geometry::Vec3;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Classes of what a pixel's centre sees; solids count on from [`SOLID`].
pub(super) const PLATE: u8 = 0;
pub(super) const GEL: u8 = 1;
pub(super) const SOLID: u8 = 2;

/// What is known of a pixel besides.
pub(super) const GLARE: u8 = 1;
pub(super) const OUTLINE: u8 = 2;
pub(super) const SHADOWED: u8 = 4;

/// One picture in the making, row by row.
#[derive(Debug, Clone, Default)]
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) radiance: Vec<f32>,
    /// What is added to the light once it is blurred: see [`super::spread::Spread::correct`].
    pub(super) fringe: Vec<f32>,
    /// 1/z along the optical axis (1/m); 0 where there is nothing.
    pub(super) nearness: Vec<f32>,
    /// The triangle seen, also beneath the solids.
    pub(super) triangle: Vec<u32>,
    pub(super) class: Vec<u8>,
    pub(super) marks: Vec<u8>,
}

impl Picture {
    pub(super) fn clear(&mut self, width: usize, height: usize) {
        let n = width * height;
        (self.width, self.height) = (width, height);
        self.radiance.resize(n, 0.0);
        for (buffer, value) in [(&mut self.class, PLATE), (&mut self.marks, 0)] {
            buffer.clear();
            buffer.resize(n, value);
        }
        for buffer in [&mut self.nearness, &mut self.fringe] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        self.triangle.clear();
        self.triangle.resize(n, NONE);
    }
}

/// Light on the vertices, and which triangles need it pixel by pixel.
pub(super) struct VertexLight<'a> {
    pub(super) irradiance: Vec<f64>,
    /// How much the gel sends back at each vertex.
    pub(super) gel: &'a [f64],
    /// Triangles on which a lamp may be mirrored.
    pub(super) glossy: Vec<bool>,
    /// Triangles on which a shadow may fall.
    pub(super) shaded: Vec<bool>,
    /// Triangles that the projector may not reach.
    pub(super) barred: Vec<bool>,
}

impl<'a> VertexLight<'a> {
    pub(super) fn new(
        surface: &Surface,
        placed: &Placed,
        shading: &Shading,
        gel: &'a [f64],
        projector: Option<Vec3>,
    ) -> Self {
        let vertices = || placed.positions.iter().zip(&placed.normals);
        let irradiance = vertices().map(|(p, n)| shading.irradiance(p, n, false)).collect();
        let longest: Vec<f64> = surface.triangles().iter().map(|t| longest_edge(t, placed)).collect();
        let far = longest.iter().copied().fold(0.0, f64::max);
        let apart = distances(&placed.positions, far, |p| shading.shadow_distance(p));
        let short: Vec<f64> = vertices().map(|(p, n)| shading.short_of_glare(p, n)).collect();
        let behind = match projector {
            Some(lens) => distances(&placed.positions, far, |p| nearest(&placed.solids, p, &lens)),
            None => Vec::new(),
        };
        let (mut glossy, mut shaded, mut barred) = (Vec::new(), Vec::new(), Vec::new());
        for (corners, &longest) in surface.triangles().iter().zip(&longest) {
            let at = corners.map(|v| v as usize);
            let least = |of: &[f64]| at.map(|v| of[v]).into_iter().fold(f64::INFINITY, f64::min);
            let edges = [(0, 1), (1, 2), (2, 0)];
            let spread = edges.map(|(a, b)| placed.normals[at[a]].dot(&placed.normals[at[b]]));
            // An angle is at most π/2 of its chord on the unit circle.
            let spread = FRAC_PI_2 * (2.0 * (1.0 - spread.into_iter().fold(1.0, f64::min))).sqrt();
            // Within one triangle the direction that mirrors turns by about its length over half the lamp's distance.
            glossy.push(least(&short) < spread + 3.0 * longest);
            shaded.push(least(&apart) < longest);
            barred.push(projector.is_some() && least(&behind) < longest);
        }
        Self { irradiance, gel, glossy, shaded, barred }
    }
}

/// Longest edge of a triangle (m).
fn longest_edge(corners: &[u32; 3], placed: &Placed) -> f64 {
    let [a, b, c] = corners.map(|v| &placed.positions[v as usize]);
    [a - b, b - c, c - a].iter().map(Vec3::norm_squared).fold(0.0, f64::max).sqrt()
}

/// Distances of places from something, no more than the exact ones; those that may be less than `near` are exact.
///
/// A place is no nearer than another is, less the way between them: of places in a row few have to be looked at.
fn distances(places: &[Vec3], near: f64, exact: impl Fn(&Vec3) -> f64) -> Vec<f64> {
    let mut known = (Vec3::zeros(), f64::NEG_INFINITY);
    let distance = |place: &Vec3| {
        let least = known.1 - (place - known.0).norm();
        if least >= near {
            return least;
        }
        known = (*place, exact(place));
        known.1
    };
    places.iter().map(distance).collect()
}

pub(super) fn nearest(solids: &[Solid], from: &Vec3, to: &Vec3) -> f64 {
    solids.iter().map(|s| s.clearance(from, to)).fold(f64::INFINITY, f64::min)
}

/// What a frame is made from.
pub(super) struct View<'a> {
    pub(super) camera: &'a Camera,
    pub(super) rays: &'a Rays,
    pub(super) surface: &'a Surface,
    pub(super) placed: &'a Placed,
    pub(super) shading: &'a Shading<'a>,
    pub(super) light: &'a VertexLight<'a>,
    /// Where the projector is (m, phantom frame).
    pub(super) projector: Option<Vec3>,
    /// Height of the plate (m).
    pub(super) plate_m: f64,
    /// Radiance of a mirror image from which on it counts as glare.
    pub(super) glare_from: f32,
}

impl View<'_> {
    /// Light on a place of a triangle.
    pub(super) fn lit(&self, triangle: u32, barycentric: [f64; 3]) -> Lit {
        let corners = self.surface.triangles()[triangle as usize].map(|v| v as usize);
        let mean = |of: &dyn Fn(usize) -> Vec3| {
            of(corners[0]) * barycentric[0]
                + of(corners[1]) * barycentric[1]
                + of(corners[2]) * barycentric[2]
        };
        let (glossy, shaded) = (self.light.glossy[triangle as usize], self.light.shaded[triangle as usize]);
        if glossy || shaded {
            let place = mean(&|v| self.placed.positions[v]).map(|x| x as f32);
            let normal: Single = mean(&|v| self.placed.normals[v]).map(|x| x as f32);
            self.shading.lit(&place, &normal.normalize(), shaded)
        } else {
            let of = corners.map(|v| self.light.irradiance[v]);
            let irradiance = (0..3).map(|i| barycentric[i] * of[i]).sum::<f64>() as f32;
            Lit { irradiance, glare: 0.0 }
        }
    }

    /// How much the gel sends back there.
    pub(super) fn gel(&self, triangle: u32, barycentric: [f64; 3]) -> f32 {
        let corners = self.surface.triangles()[triangle as usize];
        (0..3).map(|i| barycentric[i] * self.light.gel[corners[i] as usize]).sum::<f64>() as f32
    }

    /// Whether the way from a place (m, phantom frame) to the projector is barred.
    fn barred(&self, place: &Vec3) -> bool {
        self.projector.is_some_and(|lens| {
            let way = lens - place;
            self.placed.solids.iter().any(|s| s.hit(place, &way).is_some_and(|(t, _)| t < 1.0))
        })
    }

    /// A place of the camera frame in the phantom frame.
    pub(super) fn place(&self, ray: [f64; 2], z: f64) -> Vec3 {
        self.camera.pose.inverse_transform_point(&(Vec3::new(ray[0], ray[1], 1.0) * z).into()).coords
    }

    /// Draws all triangles that face the camera.
    pub(super) fn draw_surface(&self, picture: &mut Picture) {
        for (index, corners) in (0_u32..).zip(self.surface.triangles()) {
            let seen = corners.map(|v| self.placed.pixels[v as usize]);
            if let ([Some(a), Some(b), Some(c)], true) = (seen, self.placed.faces(index)) {
                self.draw_triangle(index, [a, b, c], picture);
            }
        }
    }

    fn draw_triangle(&self, index: u32, pixels: [[f64; 2]; 3], picture: &mut Picture) {
        let of = index as usize;
        let (fine, barred) = (self.light.glossy[of] || self.light.shaded[of], self.light.barred[of]);
        let corners = self.surface.triangles()[index as usize].map(|v| v as usize);
        let plane = self.placed.rows[index as usize].iter().sum::<Vec3>().map(|x| x as f32);
        let shade = Slope::through(pixels, corners.map(|v| self.light.irradiance[v] * self.light.gel[v]));
        let width = picture.width;
        spans(pixels, [width, picture.height], |row, from, to| {
            let at = row * width + from..row * width + to;
            let (first, step) = shade.along(row, from);
            let rays = self.rays.x[at.clone()].iter().zip(&self.rays.y[at.clone()]);
            let depths = picture.nearness[at.clone()].iter_mut();
            let shown = picture.radiance[at.clone()].iter_mut().zip(&mut picture.triangle[at.clone()]);
            let mut radiance = first;
            for (((x, y), nearness), (shown, triangle)) in rays.zip(depths).zip(shown) {
                let here = plane.x * x + plane.y * y + plane.z;
                // Selected, not branched over: a compiler can do four pixels at once.
                let nearer = here > *nearness;
                *nearness = if nearer { here } else { *nearness };
                *shown = if nearer { radiance } else { *shown };
                *triangle = if nearer { index } else { *triangle };
                radiance += step;
            }
            picture.class[at.clone()].fill(GEL);
            if fine {
                self.draw_fine(index, at.clone(), picture);
            }
            for pixel in if barred { at } else { 0..0 } {
                let ray = [f64::from(self.rays.x[pixel]), f64::from(self.rays.y[pixel])];
                let z = 1.0 / self.placed.weights(index, ray).iter().sum::<f64>();
                if picture.triangle[pixel] == index && self.barred(&self.place(ray, z)) {
                    picture.marks[pixel] |= SHADOWED;
                }
            }
        });
    }

    /// Draws a part of a row of one triangle with glare and shadows. These are computed for every second or fourth pixel: even glare in
    /// ripples is some pixels wide.
    fn draw_fine(&self, index: u32, part: Range<usize>, picture: &mut Picture) {
        let stride = if self.light.glossy[index as usize] { 2 } else { 4 };
        let value = |pixel: usize| {
            let ray = [f64::from(self.rays.x[pixel]), f64::from(self.rays.y[pixel])];
            let [a, b, c] = self.placed.weights(index, ray);
            let z = 1.0 / (a + b + c);
            let barycentric = [a * z, b * z, c * z];
            let lit = self.lit(index, barycentric);
            (lit.irradiance * self.gel(index, barycentric) + lit.glare, lit.glare)
        };
        let last = part.end - 1;
        let (mut from, mut left) = (part.start, value(part.start));
        loop {
            let to = (from + stride).min(last);
            let right = if to == from { left } else { value(to) };
            let length = (to - from).max(1) as f32;
            for pixel in from..=to {
                if picture.triangle[pixel] == index {
                    let share = (pixel - from) as f32 / length;
                    let glare = left.1 + share * (right.1 - left.1);
                    picture.radiance[pixel] = left.0 + share * (right.0 - left.0);
                    picture.marks[pixel] = if glare > self.glare_from { GLARE } else { 0 };
                }
            }
            if to == last {
                break;
            }
            (from, left) = (to, right);
        }
    }
}

/// A quantity that is linear over a triangle of the picture.
struct Slope {
    corner: [f64; 2],
    value: f64,
    slope: [f64; 2],
}

impl Slope {
    fn through(pixels: [[f64; 2]; 3], values: [f64; 3]) -> Self {
        let edge =
            |i: usize| [pixels[i][0] - pixels[0][0], pixels[i][1] - pixels[0][1], values[i] - values[0]];
        let ([ax, ay, a], [bx, by, b]) = (edge(1), edge(2));
        let area = ax * by - ay * bx;
        let slope = if area == 0.0 { [0.0; 2] } else { [(a * by - b * ay) / area, (b * ax - a * bx) / area] };
        Self { corner: pixels[0], value: values[0], slope }
    }

    /// Its value at a pixel, and its step to the next in the row.
    fn along(&self, row: usize, column: usize) -> (f32, f32) {
        let off = [column as f64 - self.corner[0], row as f64 - self.corner[1]];
        ((self.value + self.slope[0] * off[0] + self.slope[1] * off[1]) as f32, self.slope[0] as f32)
    }
}

/// Calls `span` with row, first column and the column behind the last for all pixel centres inside a triangle. Triangles with a common
/// edge share no pixel and leave none out.
///
/// Why straight edges in spite of the distortion: an edge of 15 px bends by some thousandths of a pixel, and both triangles at it
/// agree where they meet. What each pixel sees is computed from its own ray.
fn spans(mut corners: [[f64; 2]; 3], size: [usize; 2], mut span: impl FnMut(usize, usize, usize)) {
    corners.sort_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
    let [a, b, c] = corners;
    let (from, to) = (first_at(a[1], size[1]), first_at(c[1], size[1]));
    for row in from..to {
        let v = row as f64;
        let cross = |p: [f64; 2], q: [f64; 2]| p[0] + (v - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
        let (long, short) = (cross(a, c), if v < b[1] { cross(a, b) } else { cross(b, c) });
        let (left, right) = (first_at(long.min(short), size[0]), first_at(long.max(short), size[0]));
        if left < right {
            span(row, left, right);
        }
    }
}

/// The first pixel at or behind a coordinate, at most `end`.
fn first_at(coordinate: f64, end: usize) -> usize {
    let cut = coordinate.max(0.0) as usize;
    let next = if (cut as f64) < coordinate { cut.saturating_add(1) } else { cut };
    next.min(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_exact_where_they_are_short() {
        let places: Vec<Vec3> = (0..1000).map(|i| Vec3::new(0.001 * f64::from(i), 0.0, 0.0)).collect();
        let exact = |p: &Vec3| (p.x - 0.4).abs();
        let asked = std::cell::Cell::new(0);
        let found = distances(&places, 0.01, |p| {
            asked.set(asked.get() + 1);
            exact(p)
        });
        for (place, found) in places.iter().zip(found) {
            let exact = exact(place);
            assert!(found <= exact + 1e-12 && (found >= 0.01 || found == exact), "{found} for {exact}");
        }
        assert!(asked.get() < 100, "{asked:?}");
    }

    #[test]
    fn triangles_side_by_side_cover_every_pixel_once() {
        let corner = |i: usize, j: usize| {
            let shake = ((i * 7 + j * 13) % 5) as f64 * 0.37;
            [-3.0 + 7.3 * i as f64 + shake, -2.0 + 6.1 * j as f64 - 0.5 * shake]
        };
        let size = [40, 30];
        let mut covered = vec![0; size[0] * size[1]];
        for j in 0..7 {
            for i in 0..7 {
                let (p, q, r, s) = (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
                for triangle in [[p, q, r], [p, r, s]] {
                    spans(triangle, size, |row, from, to| {
                        covered[row * size[0] + from..row * size[0] + to].iter_mut().for_each(|n| *n += 1);
                    });
                }
            }
        }
        assert!(covered.iter().all(|&n| n == 1));
    }
}
