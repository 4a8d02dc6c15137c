//! A disc of loose glue: which share of which place on the glue, and of which node, belongs to it.

use super::rim::Rim;
use crate::fem::Order;
use crate::geometry::Vec3;

/// Sub-triangles along an edge of a face across the rim, and for a quick look.
pub(super) const FINE: usize = 16;
pub(super) const QUICK: usize = 4;

/// A face belongs to the glue that a disc seen along z may loosen when its normal has this component.
pub(super) const FACING: f64 = 0.5;

/// Glue that has let go.
#[derive(Debug, Clone, Copy)]
pub(super) struct Loosened {
    /// Centre, x and y (m).
    pub centre: [f64; 2],
    pub radius_m: f64,
}

impl Loosened {
    /// Distance (m) of a place from the disc's axis.
    pub(super) fn distance(&self, p: &Vec3) -> f64 {
        (p.x - self.centre[0]).hypot(p.y - self.centre[1])
    }

    /// Whether a face seen along z may be under the disc.
    pub(super) fn reaches(&self, corners: &[Vec3; 3]) -> bool {
        let edge = (corners[0] - corners[1]).norm().max((corners[0] - corners[2]).norm());
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
        normal.z.abs() > FACING && self.distance(&corners[0]) <= Rim::of_disc(self.radius_m).reach() + edge
    }

    /// Share at a place, with derivatives by the centre's x and y and by the radius.
    pub(super) fn share(&self, p: &Vec3) -> [f64; 4] {
        let distance = self.distance(p);
        let found = Rim::of_disc(self.radius_m).at(distance);
        let toward = if distance > 0.0 { -found.by_distance / distance } else { 0.0 };
        [found.share, (p.x - self.centre[0]) * toward, (p.y - self.centre[1]) * toward, found.by_radius]
    }
}

/// Centres of the sub-triangles of a face, `fine` along an edge, with weights (sum 1).
pub(super) fn fine_points(fine: usize) -> impl Iterator<Item = ([f64; 3], f64)> {
    let third = 1.0 / 3.0;
    let weight = 1.0 / (fine * fine) as f64;
    (0..fine).flat_map(move |i| {
        (0..fine - i).flat_map(move |j| {
            let up = [(i as f64 + third), (j as f64 + third)];
            let down = [(i as f64 + 2.0 * third), (j as f64 + 2.0 * third)];
            let at = move |[x, y]: [f64; 2]| {
                let (a, b) = (x / fine as f64, y / fine as f64);
                ([1.0 - a - b, a, b], weight)
            };
            let down = (i + j + 1 < fine).then(|| at(down));
            std::iter::once(at(up)).chain(down)
        })
    })
}

/// Shares of a face's nodes in a place: linear hats on the face, or on its quarters when it has nodes on its edges.
/// Positive, sum 1.
pub(super) fn hats(order: Order, l: [f64; 3]) -> [f64; 6] {
    let [a, b, c] = l;
    if order == Order::P1 {
        return [a, b, c, 0.0, 0.0, 0.0];
    }
    // Nodes 3, 4, 5 lie between corners 0 1, 1 2, 0 2.
    if a > 0.5 {
        [2.0 * a - 1.0, 0.0, 0.0, 2.0 * b, 0.0, 2.0 * c]
    } else if b > 0.5 {
        [0.0, 2.0 * b - 1.0, 0.0, 2.0 * a, 2.0 * c, 0.0]
    } else if c > 0.5 {
        [0.0, 0.0, 2.0 * c - 1.0, 0.0, 2.0 * b, 2.0 * a]
    } else {
        [0.0, 0.0, 0.0, 1.0 - 2.0 * c, 1.0 - 2.0 * a, 1.0 - 2.0 * b]
    }
}
