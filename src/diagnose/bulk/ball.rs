//! Which part of which cell belongs to a ball: centre and radius → barycentric points with shares and their derivatives.
//!
//! A cell across the rim is integrated on its pieces of a regular subdivision, small enough to follow the rim; the
//! displacement stays that of the whole cell, so that the jump of strain at the rim is smeared over one cell.

use super::rim::Rim;
use crate::fem::{Space, tet_quadrature};
use crate::geometry::Vec3;
use std::sync::LazyLock;

/// A ball with a soft rim.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub centre: Vec3,
    pub rim: Rim,
}

/// One point of a cell.
pub(super) struct BallPoint {
    /// Barycentric place.
    pub at: [f64; 4],
    /// Share of the cell's volume that it stands for.
    pub weight: f64,
    /// Share that belongs to the ball.
    pub share: f64,
    /// Derivatives of the share by the centre's coordinates and by the radius (1/m).
    pub by: [f64; 4],
}

/// Finest subdivision: each level halves the edges.
const LEVELS: usize = 4;

/// Levels of a quick look.
const QUICK: usize = 2;

impl Ball {
    pub(super) fn new(centre: Vec3, radius_m: f64) -> Self {
        Self { centre, rim: Rim::of_ball(radius_m) }
    }

    /// Distance (m) of a place from the ball, 0 inside.
    pub(super) fn beyond(&self, p: &Vec3) -> f64 {
        ((p - self.centre).norm() - self.rim.reach()).max(0.0)
    }

    /// Cells that the ball reaches, with points; `quick` with fewer, for scans.
    pub(super) fn cells(&self, space: &Space, quick: bool) -> Vec<(u32, Vec<BallPoint>)> {
        (0..space.cells().len() as u32)
            .filter_map(|cell| self.of_cell(&space.corners(cell), quick).map(|points| (cell, points)))
            .collect()
    }

    /// `None` when the ball does not reach the cell.
    fn of_cell(&self, corners: &[Vec3; 4], quick: bool) -> Option<Vec<BallPoint>> {
        let arms = corners.map(|p| p - self.centre);
        let edge = (0..4)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| (corners[i] - corners[j]).norm())
            .fold(0.0, f64::max);
        if arms.iter().all(|a| a.norm() > self.rim.reach() + edge) {
            return None;
        }
        let inside = arms.iter().all(|a| a.norm() <= self.rim.core());
        // Pieces no longer than half the width of the rim.
        let level = (edge / self.rim.width()).log2().ceil().max(0.0) as usize;
        let level = if inside { 0 } else { level.min(if quick { QUICK } else { LEVELS } - 1) };
        let mut reached = inside;
        let points = POINTS[level]
            .iter()
            .map(|&(at, weight)| {
                let arm: Vec3 = (0..4).map(|i| arms[i] * at[i]).sum();
                let distance = arm.norm();
                let found = self.rim.at(distance);
                reached |= found.share > 0.0;
                // The share grows as the centre comes nearer.
                let toward =
                    if distance > 0.0 { arm * (-found.by_distance / distance) } else { Vec3::zeros() };
                BallPoint {
                    at,
                    weight,
                    share: found.share,
                    by: [toward.x, toward.y, toward.z, found.by_radius],
                }
            })
            .collect();
        reached.then_some(points)
    }
}

/// Barycentric points and weights (sum 1).
type Points = Vec<([f64; 4], f64)>;

/// Four points in every piece of each level's subdivision.
static POINTS: LazyLock<[Points; LEVELS]> = LazyLock::new(|| {
    let unit: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    let mut pieces = vec![unit];
    std::array::from_fn(|level| {
        if level > 0 {
            pieces = pieces.iter().flat_map(halved).collect();
        }
        let share = 1.0 / pieces.len() as f64;
        let rule = tet_quadrature(2);
        let mut points = Vec::with_capacity(4 * pieces.len());
        for piece in &pieces {
            for (l, w) in &rule {
                let at = std::array::from_fn(|k| (0..4).map(|i| l[i] * piece[i][k]).sum());
                points.push((at, w * share));
            }
        }
        points
    })
});

/// The eight pieces of a tetrahedron with half its edges, of equal volume (Bey 1995).
fn halved(t: &[[f64; 4]; 4]) -> Vec<[[f64; 4]; 4]> {
    let m = |i: usize, j: usize| -> [f64; 4] { std::array::from_fn(|k| 0.5 * (t[i][k] + t[j][k])) };
    let (m01, m02, m03, m12, m13, m23) = (m(0, 1), m(0, 2), m(0, 3), m(1, 2), m(1, 3), m(2, 3));
    vec![
        [t[0], m01, m02, m03],
        [m01, t[1], m12, m13],
        [m02, m12, t[2], m23],
        [m03, m13, m23, t[3]],
        [m01, m02, m03, m13],
        [m01, m02, m12, m13],
        [m02, m03, m13, m23],
        [m02, m12, m13, m23],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Order;
    use crate::mesh::{Block, block};

    fn space() -> Space {
        let mesh = block(&Block { size_m: [0.06, 0.05, 0.04], cells: [6, 5, 4] }).expect("a block");
        Space::new(&mesh, Order::P1).expect("a space")
    }

    /// Volume and first moments of a ball inside the body are those of a sharp ball.
    #[test]
    fn a_ball_has_its_volume_where_it_is() {
        let space = space();
        let centre = Vec3::new(0.0312, 0.0241, 0.0187);
        for radius in [0.004, 0.009, 0.014] {
            let (mut volume, mut moment) = (0.0, Vec3::zeros());
            for (cell, points) in Ball::new(centre, radius).cells(&space, false) {
                let corners = space.corners(cell);
                let own = (corners[1] - corners[0])
                    .cross(&(corners[2] - corners[0]))
                    .dot(&(corners[3] - corners[0]))
                    / 6.0;
                for p in points {
                    let place: Vec3 = (0..4).map(|i| corners[i] * p.at[i]).sum();
                    volume += own * p.weight * p.share;
                    moment += place * (own * p.weight * p.share);
                }
            }
            let expected = 4.0 / 3.0 * std::f64::consts::PI * f64::powi(radius, 3);
            assert!((volume / expected - 1.0).abs() < 2e-3, "{radius}: {}", volume / expected);
            assert!((moment / volume - centre).norm() < 2e-3 * radius, "{radius}");
        }
    }
}
