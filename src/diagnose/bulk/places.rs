//! Where and how much to try: places for what has one, typical amounts for what has none; bounds for a fit.

use super::changes::Changed;
use super::knob::BulkKnob;
use super::lab::Lab;
use crate::diagnose::Physics;
use crate::fem::barycentric_gradients;
use crate::geometry::Vec3;

/// Distance between balls that are tried, and their radius, over the body's thickness.
const BALL_SPACING: f64 = 0.5;
const BALL_RADIUS: f64 = 0.4;

/// Distance between discs of loose glue that are tried, and their radius, over the body's thickness; near the end of the
/// glue the distance is half.
const LOOSE_SPACING: f64 = 0.5;
const LOOSE_RADIUS: f64 = 0.45;

/// Places closer to each other than this, over the body's thickness, are neighbours.
const NEIGHBOURS: f64 = 0.8;

/// Edges where a ball is resolved, over the body's thickness, but no smaller than this share of its radius: a ball that fills the body would
/// take more memory than there is. How far about it; how they grow beyond.
const RESOLVED: f64 = 0.2;
const RESOLVED_BY_RADIUS: f64 = 0.25;
const RESOLVED_ABOUT: f64 = 0.15;
const RESOLVED_GROWTH: f64 = 1.0;

/// Typical amounts: modulus ratio of a ball, of an axis, shift of Poisson's ratio, give over the thickness.
const BALL_RATIO: f64 = 3.0;
const AXIS_RATIO: f64 = 1.3;
const POISSON_SHIFT: f64 = 0.02;
const GIVE: f64 = 0.03;

/// Axes of a cube by its faces, edges and corners: no direction is farther from one of them than 28°.
fn axes() -> impl Iterator<Item = [f64; 3]> {
    let steps = || [-1.0, 0.0, 1.0];
    let all = steps().into_iter().flat_map(move |x| {
        steps().into_iter().flat_map(move |y| steps().into_iter().map(move |z| [x, y, z]))
    });
    // Of two opposite ones that whose first component off zero is positive.
    all.filter(|axis| axis.iter().find(|x| **x != 0.0).is_some_and(|first| *first > 0.0))
}

impl Lab<'_> {
    /// Sets of knobs to look at in a scan of this entry of the catalogue, none for an entry that is no change of the body.
    /// Of what may be more or less only one is here: [`Lab::looks`] has the other as well.
    pub fn places(&self, physics: Physics) -> Vec<Vec<(BulkKnob, f64)>> {
        match physics {
            Physics::Inclusion => {
                let places = self.inside();
                let radius = BALL_RADIUS * self.thickness_m;
                let ball = |p: &Vec3| {
                    let mut knobs: Vec<_> =
                        (0..3).map(|axis| (BulkKnob::BallCentre(axis), p[axis])).collect();
                    knobs.extend([(BulkKnob::BallRadius, radius), (BulkKnob::BallRatio, BALL_RATIO.ln())]);
                    knobs
                };
                places.iter().map(ball).collect()
            }
            Physics::Anisotropy => axes()
                .map(|axis| {
                    let straight = [0, 1].map(|which| (BulkKnob::Turn(which), 0.0));
                    [(BulkKnob::Along(axis), AXIS_RATIO.ln())].into_iter().chain(straight).collect()
                })
                .collect(),
            Physics::PoissonRatio => vec![vec![(BulkKnob::Poisson, -POISSON_SHIFT)]],
            Physics::BaseDebonding => {
                let radius = LOOSE_RADIUS * self.thickness_m;
                self.on_the_glue()
                    .iter()
                    .map(|p| {
                        vec![
                            (BulkKnob::LooseCentre(0), p.x),
                            (BulkKnob::LooseCentre(1), p.y),
                            (BulkKnob::LooseRadius, radius),
                        ]
                    })
                    .collect()
            }
            Physics::CompliantBase => vec![vec![(BulkKnob::BaseGive, GIVE * self.thickness_m)]],
            Physics::CoarseMesh => [1.0, -1.0].map(|share| vec![(BulkKnob::Finer, share)]).to_vec(),
            _ => Vec::new(),
        }
    }

    /// Whether two sets of knobs are not neighbours in a scan: one is stiff and the other soft, or their centres are
    /// farther from each other than places of the scan. Changes without a place are never neighbours.
    pub fn apart(&self, one: &[(BulkKnob, f64)], other: &[(BulkKnob, f64)]) -> bool {
        let mut has_place = false;
        let mut square = 0.0;
        for ((knob, a), (_, b)) in one.iter().zip(other) {
            match knob {
                BulkKnob::BallRatio if a * b < 0.0 => return true,
                BulkKnob::BallCentre(_) | BulkKnob::LooseCentre(_) => {
                    has_place = true;
                    square += (a - b).powi(2);
                }
                _ => {}
            }
        }
        !has_place || square.sqrt() > NEIGHBOURS * self.thickness_m
    }

    /// Lengths of edges (m) by place with which the ball of these knobs is resolved; `None` where there is none. Loose glue
    /// gains nothing from it: what a disc of it looks like is told by its surroundings.
    pub fn resolving(&self, knobs: &[(BulkKnob, f64)]) -> Option<impl Fn(&Vec3) -> f64 + use<>> {
        let ball = Changed::of(knobs, self.model.poisson_ratio()).ok()?.inclusion?.ball;
        let thick = self.thickness_m;
        let inside = (RESOLVED * thick).max(RESOLVED_BY_RADIUS * ball.rim.reach());
        Some(move |p: &Vec3| inside + RESOLVED_GROWTH * (ball.beyond(p) - RESOLVED_ABOUT * thick).max(0.0))
    }

    /// Smallest and largest value of a knob, and the longest step of a fit.
    pub fn range(&self, knob: BulkKnob) -> ([f64; 2], f64) {
        let thick = self.thickness_m;
        let nu = self.model.poisson_ratio();
        match knob {
            BulkKnob::BallCentre(axis) => (self.extent_m[axis], 0.2 * thick),
            BulkKnob::LooseCentre(axis) => (self.extent_m[axis], 0.2 * thick),
            BulkKnob::BallRadius | BulkKnob::LooseRadius => ([0.1 * thick, 2.0 * thick], 0.15 * thick),
            BulkKnob::BallRatio => ([-4.0, 4.0], 0.7),
            BulkKnob::Along(_) => ([-1.5, 2.5], 0.3),
            BulkKnob::Turn(_) => ([-1.5, 1.5], 0.3),
            BulkKnob::Poisson => ([(-nu).min(-0.1), 0.4995 - nu], 0.05_f64.min(0.5 * (0.5 - nu))),
            BulkKnob::BaseGive => ([0.0, 2.0 * thick], 0.1 * thick),
            BulkKnob::Finer => ([-3.0, 3.0], 1.0),
        }
    }

    /// Points of a grid inside the body (m).
    fn inside(&self) -> Vec<Vec3> {
        let spacing = BALL_SPACING * self.thickness_m;
        let lines: [Vec<f64>; 3] = self.extent_m.map(|[low, high]| {
            let count = ((high - low) / spacing).round().max(1.0);
            (0..count as usize).map(|i| low + (high - low) * (i as f64 + 0.5) / count).collect()
        });
        let mut all = Vec::new();
        for &x in &lines[0] {
            for &y in &lines[1] {
                all.extend(lines[2].iter().map(|&z| Vec3::new(x, y, z)).filter(|p| self.holds(p)));
            }
        }
        all
    }

    /// Whether a point lies in the body.
    fn holds(&self, p: &Vec3) -> bool {
        let space = self.model.space();
        (0..space.cells().len() as u32).any(|cell| {
            let corners = space.corners(cell);
            let (low, high) =
                corners.iter().fold((corners[0], corners[0]), |(low, high), c| (low.inf(c), high.sup(c)));
            let near = (0..3).all(|i| p[i] >= low[i] && p[i] <= high[i]);
            near && {
                let (gradient, _) = barycentric_gradients(&corners);
                (0..4).all(|i| gradient[i].dot(&(p - corners[0])) + f64::from(u8::from(i == 0)) >= -1e-9)
            }
        })
    }

    /// Places on the glue (m), closer to each other near its end.
    fn on_the_glue(&self) -> Vec<Vec3> {
        let space = self.model.space();
        let spacing = LOOSE_SPACING * self.thickness_m;
        let ends = self.glue.ends_along_z(space);
        let apart = |p: &Vec3| {
            let near = ends.iter().any(|e| (e - p).norm() < spacing);
            if near { 0.5 * spacing } else { spacing }
        };
        let mut kept: Vec<Vec3> = Vec::new();
        for p in ends.iter().copied().chain(self.glue.faces_along_z(space)) {
            if kept.iter().all(|q| (p - q).norm() >= apart(&p)) {
                kept.push(p);
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every direction has one of them near, and none is there twice.
    #[test]
    fn axes_cover_all_directions() {
        let all: Vec<Vec3> = axes().map(|axis| Vec3::from(axis).normalize()).collect();
        assert_eq!(all.len(), 13);
        let nearest = |d: &Vec3| all.iter().map(|a| a.dot(d).abs()).fold(0.0, f64::max);
        for i in 0..40 {
            for j in 0..80 {
                let (z, turn) = (f64::from(i) / 39.0, f64::from(j) * std::f64::consts::PI / 40.0);
                let across = (1.0 - z * z).sqrt();
                let d = Vec3::new(across * turn.cos(), across * turn.sin(), z);
                assert!(nearest(&d) > 28_f64.to_radians().cos(), "{d}");
            }
        }
        assert!((0..13).all(|i| (0..i).all(|j| all[i].dot(&all[j]).abs() < 0.99)));
    }
}
