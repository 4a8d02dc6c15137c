//! The outside of the block that a camera above it sees: top and sides cut into triangles, small where tips will bend it.
//!
//! Each of the five sides is cut into rectangles that are halved along both edges until they are as small as wanted at their distance from
//! the rims of the tips. Rectangles of all sides have their corners on one lattice; where a small one meets a larger one, also around an
//! edge of the block, the larger one's outline goes through the small one's corners, so that the surface has no gaps however it moves.
//!
//! Why rims: outside a disc of radius a that is pressed in by w as a uniform traction does (Johnson 1985, section 3.4), the slope of the
//! surface grows as 3w/8a · ln(1/d) towards the rim at d = 0, its second derivative as 3w/8a · 1/d. Triangles of a length h leave h²/8
//! times that: 7 µm of 3 mm, a = 8 mm, at d = 2 mm with h = 0.9 mm, and 13 µm at 1 mm. Within the rim the tip hides all.

use super::SimError;
use super::hex_mesh::{Place, Slab};
use std::collections::{HashMap, HashSet};

/// How finely the outside is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinCut {
    /// Longest edge far from the tips (m).
    pub cell_m: f64,
    /// Longest edge at the rim of a tip (m).
    pub rim_cell_m: f64,
    /// How much longer edges may be per distance from it.
    pub growth: f64,
}

impl Default for SkinCut {
    /// Displacements between the vertices are good to 0.01 mm from 2 mm off the rim of a tip of 8 mm that is pressed in by 3 mm; see
    /// `displacements_between_vertices_are_those_of_markers` in `world`.
    fn default() -> Self {
        Self { cell_m: 0.0035, rim_cell_m: 8.75e-4, growth: 0.33 }
    }
}

/// A disc on the surface at whose rim the skin is finer: centre (m), axis of its normal, radius (m).
pub(super) type Rim = ([f64; 3], usize, f64);

/// Triangles of top and sides at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// Vertices (m, phantom frame). Along the block's edges each side has its own.
    pub points_m: Vec<[f64; 3]>,
    /// Corners, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The sides that are seen: axis of the normal, whether its upper end, and the axes along it, whose cross product points outward.
const SIDES: [(usize, bool, [usize; 2]); 5] =
    [(2, true, [0, 1]), (1, false, [0, 2]), (0, true, [1, 2]), (1, true, [2, 0]), (0, false, [2, 1])];
/// Finest cut.
const MOST_HALVINGS: u32 = 8;

/// Places of the lattice on which all corners lie.
struct Lattice {
    size_m: [f64; 3],
    /// Rectangles of the first cut along each axis.
    first: [u32; 3],
    halvings: u32,
}

/// One rectangle of a side.
#[derive(Clone, Copy)]
struct Rectangle {
    side: usize,
    low: [u32; 2],
    span: u32,
}

impl Skin {
    /// Cuts the outside of `slab`, finer at `rims`.
    ///
    /// # Errors
    /// [`SimError::BadBlock`]: lengths that are not positive.
    pub(super) fn cut(slab: &Slab, rims: &[Rim], cut: &SkinCut) -> Result<Self, SimError> {
        let Slab { size_m, glue_end_m } = *slab;
        let lengths = [cut.cell_m, cut.rim_cell_m];
        let positive = size_m.iter().chain(&lengths).all(|&l| l > 0.0 && l.is_finite());
        let growing = cut.growth >= 0.0 && size_m.iter().all(|l| l / cut.cell_m < 1e4);
        if !positive || !growing {
            return Err(SimError::BadBlock { size_m, glue_end_m, cell_m: cut.cell_m });
        }
        let halvings =
            (cut.cell_m / cut.rim_cell_m).log2().ceil().clamp(0.0, f64::from(MOST_HALVINGS)) as u32;
        let first = size_m.map(|l| (l / cut.cell_m).ceil().max(1.0) as u32);
        let lattice = Lattice { size_m, first, halvings };
        let rectangles = lattice.rectangles(rims, cut);
        let corners: HashSet<[u32; 3]> =
            rectangles.iter().flat_map(|r| r.corners().map(|c| lattice.on(r.side, c))).collect();
        Ok(lattice.triangles(&rectangles, &corners))
    }
}

impl Rectangle {
    /// Anticlockwise seen from outside.
    fn corners(&self) -> [[u32; 2]; 4] {
        let ([u, v], s) = (self.low, self.span);
        [[u, v], [u + s, v], [u + s, v + s], [u, v + s]]
    }
}

impl Lattice {
    /// A place of a side.
    fn on(&self, side: usize, [u, v]: [u32; 2]) -> [u32; 3] {
        let (axis, upper, along) = SIDES[side];
        let mut place = [0; 3];
        place[axis] = if upper { self.first[axis] << self.halvings } else { 0 };
        (place[along[0]], place[along[1]]) = (u, v);
        place
    }

    /// Where a place is (m).
    fn position(&self, place: [u32; 3]) -> [f64; 3] {
        std::array::from_fn(|a| {
            self.size_m[a] * f64::from(place[a]) / f64::from(self.first[a] << self.halvings)
        })
    }

    fn rectangles(&self, rims: &[Rim], cut: &SkinCut) -> Vec<Rectangle> {
        let whole = 1 << self.halvings;
        let mut small_enough = Vec::new();
        for (side, (_, _, along)) in SIDES.into_iter().enumerate() {
            let mut left = Vec::new();
            for v in (0..self.first[along[1]]).rev() {
                for u in (0..self.first[along[0]]).rev() {
                    left.push(Rectangle { side, low: [u * whole, v * whole], span: whole });
                }
            }
            while let Some(rectangle) = left.pop() {
                if rectangle.span == 1 || !self.too_large(&rectangle, rims, cut) {
                    small_enough.push(rectangle);
                    continue;
                }
                let ([u, v], half) = (rectangle.low, rectangle.span / 2);
                for low in [[u + half, v + half], [u, v + half], [u + half, v], [u, v]] {
                    left.push(Rectangle { low, span: half, ..rectangle });
                }
            }
        }
        small_enough
    }

    fn too_large(&self, rectangle: &Rectangle, rims: &[Rim], cut: &SkinCut) -> bool {
        let [low, _, high, _] = rectangle.corners().map(|c| self.position(self.on(rectangle.side, c)));
        let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
        let wanted = |&(centre, axis, radius): &Rim| {
            let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
            let reach = |a: usize| (centre[a] - low[a]).abs().max((high[a] - centre[a]).abs());
            let flush = (low[axis] - centre[axis]).abs().max((high[axis] - centre[axis]).abs()) < 1e-9;
            if flush && reach(p).hypot(reach(q)) < radius {
                return cut.cell_m;
            }
            let apart = Place::Rim { centre, axis, radius }.distance(low, high);
            (cut.growth * apart).clamp(cut.rim_cell_m.min(cut.cell_m), cut.cell_m)
        };
        longest > 1.001 * rims.iter().map(wanted).fold(cut.cell_m, f64::min)
    }

    /// Corners of other rectangles between two on one line, in order, without its end.
    fn between(
        &self,
        side: usize,
        [a, b]: [[u32; 2]; 2],
        corners: &HashSet<[u32; 3]>,
        out: &mut Vec<[u32; 2]>,
    ) {
        let apart = a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1]));
        let middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
        if apart > 1 && corners.contains(&self.on(side, middle)) {
            self.between(side, [a, middle], corners, out);
            self.between(side, [middle, b], corners, out);
        } else {
            out.push(a);
        }
    }

    fn triangles(&self, rectangles: &[Rectangle], corners: &HashSet<[u32; 3]>) -> Skin {
        let mut skin = Skin { points_m: Vec::new(), triangles: Vec::new() };
        let mut numbers: HashMap<(usize, [u32; 2]), u32> = HashMap::new();
        for rectangle in rectangles {
            let Rectangle { side, low: [u, v], span } = *rectangle;
            let mut number = |place: [u32; 2]| {
                *numbers.entry((side, place)).or_insert_with(|| {
                    skin.points_m.push(self.position(self.on(side, place)));
                    skin.points_m.len() as u32 - 1
                })
            };
            let (mut outline, ends) = (Vec::new(), rectangle.corners());
            for i in 0..4 {
                self.between(side, [ends[i], ends[(i + 1) % 4]], corners, &mut outline);
            }
            if let [a, b, c, d] = outline[..] {
                let [a, b, c, d] = [a, b, c, d].map(&mut number);
                // Diagonals alternate, so that the surface has no grain.
                let even = (u / span + v / span).is_multiple_of(2);
                skin.triangles.extend(if even { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
            } else {
                let middle = number([u + span / 2, v + span / 2]);
                let around: Vec<u32> = outline.into_iter().map(&mut number).collect();
                for (i, &a) in around.iter().enumerate() {
                    skin.triangles.push([a, around[(i + 1) % around.len()], middle]);
                }
            }
        }
        skin
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Triangle, Vec3};

    const SLAB: Slab = Slab { size_m: [0.10, 0.15, 0.025], glue_end_m: 0.037 };
    const RIMS: [Rim; 2] = [([0.05, 0.06, 0.025], 2, 0.008), ([0.0, 0.08, 0.0125], 0, 0.008)];

    fn area(skin: &Skin, triangle: &[u32; 3]) -> Vec3 {
        Triangle(triangle.map(|v| Vec3::from(skin.points_m[v as usize]))).area_vector()
    }

    /// Top and sides have their areas, every triangle faces outward, and an edge that only one triangle has lies on an edge of the block.
    #[test]
    fn it_is_the_outside_without_gaps() -> Result<(), SimError> {
        let skin = Skin::cut(&SLAB, &RIMS, &SkinCut::default())?;
        let sum = skin
            .triangles
            .iter()
            .map(|t| area(&skin, t))
            .fold([0.0; 3], |sum, a| std::array::from_fn(|i| sum[i] + a[i].abs()));
        let [x, y, z] = SLAB.size_m;
        for (axis, expected) in [2.0 * y * z, 2.0 * x * z, x * y].into_iter().enumerate() {
            assert!((sum[axis] / expected - 1.0).abs() < 1e-12, "axis {axis}");
        }
        let middle = Vec3::new(0.5 * x, 0.5 * y, 0.5 * z);
        let mut edges = HashSet::new();
        for triangle in &skin.triangles {
            let outward = Vec3::from(skin.points_m[triangle[0] as usize]) - middle;
            assert!(area(&skin, triangle).dot(&outward) > 0.0);
            for i in 0..3 {
                assert!(edges.insert((triangle[i], triangle[(i + 1) % 3])), "an edge twice in one direction");
            }
        }
        let at_end = |p: [f64; 3], a: usize| p[a] < 1e-12 || p[a] > SLAB.size_m[a] - 1e-12;
        // Places of edges, in µm, on whichever side.
        let place = |v: u32| skin.points_m[v as usize].map(|x| (x * 1e6).round() as i64);
        let placed: HashSet<_> = edges.iter().map(|&(a, b)| (place(a), place(b))).collect();
        for &(a, b) in edges.iter().filter(|(a, b)| !edges.contains(&(*b, *a))) {
            let (p, q) = (skin.points_m[a as usize], skin.points_m[b as usize]);
            let ends =
                (0..3).filter(|&axis| at_end(p, axis) && at_end(q, axis) && p[axis] == q[axis]).count();
            assert!(ends >= 2, "{p:?} to {q:?}");
            // The side around the edge has the same edge, but for the underside, which is not there.
            assert!(placed.contains(&(place(b), place(a))) || p[2] == 0.0, "{p:?} to {q:?}");
        }
        Ok(())
    }

    /// At rims triangles are small, elsewhere few.
    #[test]
    fn it_is_fine_at_rims_and_nowhere_else() -> Result<(), SimError> {
        let (cut, mut smallest) = (SkinCut::default(), f64::INFINITY);
        let skin = Skin::cut(&SLAB, &RIMS, &cut)?;
        for triangle in &skin.triangles {
            let corners = triangle.map(|v| Vec3::from(skin.points_m[v as usize]));
            let longest = (0..3).map(|i| (corners[i] - corners[(i + 1) % 3]).norm()).fold(0.0, f64::max);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let top = middle.z > 0.0249;
            let apart = (middle - Vec3::from(RIMS[0].0)).norm() - RIMS[0].2;
            if top && apart > 0.001 {
                let wanted = (cut.growth * (apart + longest)).clamp(cut.rim_cell_m, cut.cell_m);
                assert!(longest < 1.5 * wanted, "{longest} m at {apart} m from the rim");
            }
            smallest = smallest.min(longest);
        }
        assert!(smallest < 1.5 * cut.rim_cell_m);
        let plain = Skin::cut(&SLAB, &[], &cut)?;
        println!("{} vertices for two tips, {} for none", skin.points_m.len(), plain.points_m.len());
        assert!(plain.points_m.len() < 3000 && skin.points_m.len() < plain.points_m.len() + 3000);
        Ok(())
    }

    #[test]
    fn what_means_nothing_is_refused() {
        for cut in [
            SkinCut { cell_m: 0.0, ..SkinCut::default() },
            SkinCut { rim_cell_m: f64::NAN, ..SkinCut::default() },
            SkinCut { growth: -1.0, ..SkinCut::default() },
        ] {
            assert!(matches!(Skin::cut(&SLAB, &[], &cut), Err(SimError::BadBlock { .. })));
        }
    }
}
