//! How much of each pixel a dot covers, and how much of a dot is seen.
//!
//! A dot is a disc of the resting material. Within a pixel the way from picture to material is linear to a hundred-thousandth of a pixel
//! on each triangle; the pixel is cut into squares, and in each the dot's edge is taken for straight, which makes the covered area a closed
//! form. With 4 × 4 squares the centroid of a dot of 4 px radius is exact to some 1e-4 px (see the tests of the room).

use super::local::{Local, Sight};
use super::outline::staggered;
use super::raster::{OUTLINE, PLATE, Picture, SOLID, View};
use super::scene::Dot;
use super::spread::{PIECES, Spread};
use super::surface::{NONE, Surface};
use crate::geometry::{Triangle, Vec3, basis_from_axis};

/// Squares along each side of a pixel where an outline passes besides a dot's edge; a multiple of [`PIECES`].
const PIECES_OUTLINE: usize = 2 * PIECES;

/// A dot with what does not change from frame to frame.
#[derive(Debug, Clone)]
pub(super) struct Painted {
    pub(super) dot: Dot,
    /// Centre on the resting surface (m) and two unit vectors in it.
    centre: Vec3,
    along: [Vec3; 2],
    /// Sines and cosines of the phases of the waves in its edge.
    phases: [(f64, f64); 4],
}

/// How much of a dot was seen.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Seen {
    /// Area in the picture (px²) with nothing in front, as far as the picture shows it.
    pub(super) whole: f64,
    /// Area that is seen.
    pub(super) visible: f64,
    /// Area of the same dot if its surroundings were as flat as its middle.
    pub(super) flat: f64,
}

impl Painted {
    pub(super) fn new(dot: Dot, surface: &Surface) -> Self {
        let centre = surface.at(&dot.place, surface.rest());
        let normal = Triangle(surface.corners(dot.place.triangle, surface.rest())).area_vector();
        let basis = basis_from_axis(&normal);
        let along = [basis.column(0).into_owned(), basis.column(1).into_owned()];
        // Any angles do that differ from dot to dot.
        let phases = [2.399, 4.117, 1.731, 5.303].map(|turn| f64::sin_cos(turn * f64::from(dot.number)));
        Self { dot, centre, along, phases }
    }

    /// A place of the resting surface, from the dot's centre, in the plane of the dot (m).
    pub(super) fn flat(&self, place: &Vec3) -> [f64; 2] {
        let off = place - self.centre;
        [off.dot(&self.along[0]), off.dot(&self.along[1])]
    }

    /// Its radius in a direction of that plane (m; a unit vector).
    pub(super) fn radius(&self, [cos, sin]: [f64; 2]) -> f64 {
        if self.dot.raggedness == 0.0 {
            return self.dot.radius_m;
        }
        // cos(kθ + φ) for k = 3 … 6 by the addition theorem.
        let turned = |(c, s): (f64, f64)| (c * cos - s * sin, s * cos + c * sin);
        let (mut multiple, mut waves) = (turned(turned((1.0, 0.0))), 0.0);
        for (sin_phase, cos_phase) in self.phases {
            multiple = turned(multiple);
            waves += multiple.0 * cos_phase - multiple.1 * sin_phase;
        }
        self.dot.radius_m * (1.0 + 0.5 * self.dot.raggedness * waves)
    }
}

/// What one dot is painted with.
struct Brush<'a> {
    painted: &'a Painted,
    spread: &'a Spread,
    /// How far from the dot's edge (radii) a pixel may be that the edge crosses.
    band: f64,
    /// Where the camera is (m, phantom frame).
    eye: Vec3,
}

impl View<'_> {
    /// Paints a dot and tells how much of it is seen.
    pub(super) fn paint(&self, painted: &Painted, spread: &Spread, picture: &mut Picture) -> Seen {
        let home = painted.dot.place.triangle;
        let mut seen = Seen::default();
        let centre = self.surface.at(&painted.dot.place, &self.placed.positions);
        let (true, Some(pixel)) = (self.placed.faces(home), self.camera.project(&centre)) else {
            return seen;
        };
        let centre = self.camera.seen(&centre);
        let ray = [centre.x / centre.z, centre.y / centre.z];
        let Some(sight) = Sight::new(self.camera, ray) else { return seen };
        let (reach, band) = self.reach(painted, home, &sight, &mut seen);
        let size = [picture.width, picture.height];
        let [columns, rows] = [0, 1].map(|a| {
            let end = size[a] as f64;
            (
                (pixel[a] - reach[a]).clamp(0.0, end) as usize,
                (pixel[a] + reach[a] + 1.0).clamp(0.0, end) as usize,
            )
        });
        let brush = Brush { painted, spread, band, eye: self.camera.eye() };
        for row in rows.0..rows.1 {
            for column in columns.0..columns.1 {
                self.paint_pixel(&brush, [column, row], picture, &mut seen);
            }
        }
        seen
    }

    /// Half the size (px) of the part of the picture that holds the dot, and how far from its edge (radii) a pixel may be that the edge
    /// crosses.
    fn reach(&self, painted: &Painted, home: u32, sight: &Sight, seen: &mut Seen) -> ([f64; 2], f64) {
        let local = Local::new(self, painted, home, sight);
        // Metres per pixel; the inverse are pixels per metre.
        let [[a, c], [b, d]] = local.moves;
        let area = (a * d - b * c).abs();
        let radius = painted.dot.radius_m;
        seen.flat = std::f64::consts::PI * radius * radius / area;
        // Around the middle the surface may be stretched more than there.
        let most = 1.3 * radius * (1.0 + 2.0 * painted.dot.raggedness);
        let reach = [most * d.hypot(b) / area + 2.0, most * c.hypot(a) / area + 2.0].map(|r| r.min(1e5));
        // Half a pixel's longer diagonal; a quarter more, since the surface around is not the same.
        let diagonal = (a + b).hypot(c + d).max((a - b).hypot(c - d));
        let band = 1.25 * 0.5 * diagonal / radius + 2.5 * painted.dot.raggedness;
        (reach, band)
    }

    fn paint_pixel(&self, brush: &Brush, [column, row]: [usize; 2], picture: &mut Picture, seen: &mut Seen) {
        let (pixel, painted) = (row * picture.width + column, brush.painted);
        let Some(triangle) = triangle_near(picture, column, row) else { return };
        let rough = [f64::from(self.rays.x[pixel]), f64::from(self.rays.y[pixel])];
        let (about, mut weights) = self.radii_outside(painted, triangle, rough);
        if about > brush.band {
            return;
        }
        let outline = picture.marks[pixel] & OUTLINE != 0;
        let hidden = picture.class[pixel] >= SOLID && !outline;
        let even = !outline && about < -brush.band;
        let mut pieces = [[0.0; PIECES]; PIECES];
        let (whole, visible) = if even {
            (1.0, 1.0)
        } else {
            let exact = self.camera.lens.ray_from([column as f64, row as f64], rough);
            let Some(sight) = exact.and_then(|ray| Sight::new(self.camera, ray)) else { return };
            let mut local = Local::new(self, painted, triangle, &sight);
            weights = local.weights;
            let (along, eye) = if outline { (PIECES_OUTLINE, Some(&brush.eye)) } else { (PIECES, None) };
            self.covered(painted, &mut local, &sight, along, eye, &mut pieces)
        };
        let visible = if hidden { 0.0 } else { visible };
        seen.whole += whole;
        seen.visible += visible;
        if visible > 0.0 && (picture.class[pixel] != PLATE || outline) {
            let sum: f64 = weights.iter().sum();
            let barycentric = weights.map(|w| w / sum);
            let light = self.lit(triangle, barycentric).irradiance;
            let gain = self.shading.finish().dot_reflectance as f32 - self.gel(triangle, barycentric);
            picture.radiance[pixel] += visible as f32 * light * gain;
            if visible < 1.0 {
                brush.spread.correct(
                    &pieces.map(|row| row.map(|share| share * light * gain)),
                    [column, row],
                    picture,
                );
            }
        }
    }

    /// How far outside the dot a place on a triangle is, in radii of the dot, and the weights of the corners there.
    fn radii_outside(&self, painted: &Painted, triangle: u32, ray: [f64; 2]) -> (f64, [f64; 3]) {
        let weights = self.placed.weights(triangle, ray);
        let corners = self.surface.corners(triangle, self.surface.rest());
        let sum: f64 = weights.iter().sum();
        let place = (corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]) / sum;
        ((place - painted.centre).norm() / painted.dot.radius_m - 1.0, weights)
    }

    /// Share of a pixel that the dot covers, and that it is seen to cover by who tells where the camera's eye is; `pieces` gets the
    /// latter for each piece of the pixel.
    fn covered(
        &self,
        painted: &Painted,
        local: &mut Local,
        sight: &Sight,
        along: usize,
        eye: Option<&Vec3>,
        pieces: &mut [[f32; PIECES]; PIECES],
    ) -> (f64, f64) {
        let side = 1.0 / along as f64;
        let (mut whole, mut visible) = (0.0, 0.0);
        let (middle, lead, _) = local.outside(painted, [0.0; 2]);
        // Half a square's diagonal, and what the edge's curve, its waves and a neighbouring triangle's stretch may add.
        let sure = 0.71 * side + 0.1 + 4.0 * painted.dot.raggedness;
        if middle > 0.71 + sure {
            return (0.0, 0.0);
        }
        let mut left = None;
        for j in 0..along {
            for i in 0..along {
                let off = [(i as f64 + 0.5) * side - 0.5, (j as f64 + 0.5) * side - 0.5];
                let about = middle + lead[0] * off[0] + lead[1] * off[1];
                if about > sure {
                    continue;
                }
                let area = if about < -sure {
                    side * side
                } else {
                    if !local.holds(off) && !self.walk(painted, local, &mut left, off, sight) {
                        continue;
                    }
                    let (outside, outward, radius) = local.outside(painted, off);
                    // A tangent lies outside its arc, over a length h by h²/24r on average.
                    let outside = outside * along as f64 + side / (24.0 * radius);
                    square_below(-outside, outward) * side * side
                };
                whole += area;
                let mut shown = area;
                if let (Some(eye), true) = (eye, area > 0.0) {
                    let off = staggered([i, j], along);
                    let place = sight.at(off);
                    let near: f64 = local.weights_at(off).iter().sum();
                    if self.solid_at(place, eye, u16::MAX).is_some_and(|(solid, _)| solid >= near) {
                        shown = 0.0;
                    }
                }
                visible += shown;
                pieces[j * PIECES / along][i * PIECES / along] += (shown * (PIECES * PIECES) as f64) as f32;
            }
        }
        (whole, visible)
    }
}

/// The triangle that a pixel's centre sees, or else one that a neighbour sees.
fn triangle_near(picture: &Picture, column: usize, row: usize) -> Option<u32> {
    let own = picture.triangle[row * picture.width + column];
    if own != NONE {
        return Some(own);
    }
    let rows = row.saturating_sub(1)..(row + 2).min(picture.height);
    let columns = column.saturating_sub(1)..(column + 2).min(picture.width);
    let mut around = rows.flat_map(|r| columns.clone().map(move |c| r * picture.width + c));
    around.find_map(|at| Some(picture.triangle[at]).filter(|&t| t != NONE))
}

/// Area of the unit square around the origin where n·x < t, for a unit vector n.
///
/// With a ≥ b the absolute components of n: a triangle of area s²/2ab cut off at a corner for s = t + (a+b)/2 < b, a strip beyond that.
/// Verified by `the_square_is_cut_right`.
fn square_below(t: f64, n: [f64; 2]) -> f64 {
    let (a, b) = (n[0].abs().max(n[1].abs()), n[0].abs().min(n[1].abs()));
    let half = 0.5 * (a + b);
    if t >= half {
        return 1.0;
    }
    if t <= -half {
        return 0.0;
    }
    let s = half - t.abs();
    let corner = if s < b { 0.5 * s * s / (a * b) } else { (s - 0.5 * b) / a };
    if t < 0.0 { corner } else { 1.0 - corner }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against 1000 × 1000 places.
    #[test]
    fn the_square_is_cut_right() {
        for (angle, t) in
            [(0.0, 0.2), (0.3, -0.4), (0.78, 0.1), (2.2, 0.55), (4.0, -0.69), (1.0, 0.66), (5.5, 0.0)]
        {
            let n: [f64; 2] = [f64::cos(angle), f64::sin(angle)];
            let place = |k: i32| (f64::from(k) + 0.5) / 1000.0 - 0.5;
            let inside: usize =
                (0..1000).map(|j| (0..1000).filter(|&i| n[0] * place(i) + n[1] * place(j) < t).count()).sum();
            assert!((square_below(t, n) - inside as f64 * 1e-6).abs() < 1e-3, "{angle} {t}");
        }
    }
}
