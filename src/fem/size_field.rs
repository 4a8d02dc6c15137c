//! How long edges may be at a place, when some places want short ones: needs → edge length (m).
//!
//! The length is the least that any need allows there, `max(least, size + growth · distance)`. Needs are kept in a
//! tree of boxes, in which only those that could make the length shorter are asked: a fine mesh has hundreds of
//! thousands of edges and thousands of needs.

use crate::geometry::Vec3;

/// A place that wants short edges: all of a segment, whose ends may be one point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Need {
    ends: [Vec3; 2],
    /// Edges need not be shorter than this (m).
    least_m: f64,
    /// Length at the place itself (m); it grows with the distance.
    size_m: f64,
}

impl Need {
    /// Edges of `size_m` around a point (m), growing from there on.
    pub(super) fn at(point: Vec3, size_m: f64) -> Self {
        Self { ends: [point; 2], least_m: 0.0, size_m }
    }

    /// Edges that are as long as they are away from the segment between `a` and `b` (m), times the growth, and
    /// `least_m` close to it.
    pub(super) fn along(a: Vec3, b: Vec3, least_m: f64) -> Self {
        Self { ends: [a, b], least_m, size_m: 0.0 }
    }

    fn allows(&self, p: &Vec3, growth: f64) -> f64 {
        let [a, b] = self.ends;
        let along = b - a;
        let length_squared = along.norm_squared();
        let t =
            if length_squared > 0.0 { ((p - a).dot(&along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        self.least_m.max(self.size_m + growth * (p - (a + along * t)).norm())
    }

    fn middle(&self) -> Vec3 {
        0.5 * (self.ends[0] + self.ends[1])
    }
}

/// Lengths of edges everywhere.
pub(super) struct SizeField {
    needs: Vec<Need>,
    longest_m: f64,
    growth: f64,
    /// The tree's nodes, a node before its children.
    boxes: Vec<Node>,
}

/// A node of the tree: a box around the needs of a range.
struct Node {
    low: Vec3,
    high: Vec3,
    needs: std::ops::Range<usize>,
    /// Nodes below it: the first follows it, the second is this one; none at a leaf.
    second: Option<usize>,
}

/// Needs of a leaf.
const LEAF: usize = 8;

impl SizeField {
    /// Edges are at most `longest_m` long, and grow by `growth` times the distance from a need.
    pub(super) fn new(needs: Vec<Need>, longest_m: f64, growth: f64) -> Self {
        let mut field = Self { needs, longest_m, growth, boxes: Vec::new() };
        if !field.needs.is_empty() {
            field.build(0..field.needs.len());
        }
        field
    }

    /// Adds the tree of a range of needs, which it puts in order.
    fn build(&mut self, range: std::ops::Range<usize>) {
        let ends = || self.needs[range.clone()].iter().flat_map(|n| n.ends);
        let low = ends().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let high = ends().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let here = self.boxes.len();
        self.boxes.push(Node { low, high, needs: range.clone(), second: None });
        if range.len() > LEAF {
            let axis = (high - low).imax();
            let half = range.len() / 2;
            self.needs[range.clone()]
                .select_nth_unstable_by(half, |a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
            self.build(range.start..range.start + half);
            self.boxes[here].second = Some(self.boxes.len());
            self.build(range.start + half..range.end);
        }
    }

    /// The longest edge (m) whose middle may lie at `p` (m).
    pub(super) fn at(&self, p: &Vec3) -> f64 {
        let mut size = self.longest_m;
        let mut path = if self.boxes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(node) = path.pop() {
            let node_box = &self.boxes[node];
            let outside = (node_box.low - p).sup(&(p - node_box.high)).sup(&Vec3::zeros());
            if self.growth * outside.norm() >= size {
                continue;
            }
            match node_box.second {
                Some(second) => path.extend([second, node + 1]),
                None => {
                    for need in &self.needs[node_box.needs.clone()] {
                        size = size.min(need.allows(p, self.growth));
                    }
                }
            }
        }
        size
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The tree leaves out nothing that matters: the same number as when every need is asked.
    #[test]
    fn the_tree_finds_the_shortest_length() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut point = || Vec3::from_fn(|_, _| random.random_range(0.0..0.1));
        let needs: Vec<Need> = (0..300)
            .map(|i| {
                let (a, b) = (point(), point());
                let size = 0.001 + 0.01 * b.x;
                if i % 2 == 0 { Need::at(a, size) } else { Need::along(a, a + 0.2 * b, size) }
            })
            .collect();
        let places: Vec<Vec3> = (0..500).map(|_| 1.5 * point()).collect();
        for longest in [0.004, 0.05] {
            let field = SizeField::new(needs.clone(), longest, 0.7);
            for p in &places {
                let all = needs.iter().map(|n| n.allows(p, 0.7)).fold(longest, f64::min);
                assert_eq!(field.at(p), all);
            }
        }
        assert_eq!(SizeField::new(Vec::new(), 0.01, 0.7).at(&places[0]), 0.01);
    }

    /// At a need its own length, away from it more.
    #[test]
    fn edges_grow_with_the_distance() {
        let (a, b) = (Vec3::zeros(), Vec3::new(0.02, 0.0, 0.0));
        let field = SizeField::new(vec![Need::along(a, b, 0.002)], 0.05, 1.0);
        assert_eq!(field.at(&Vec3::new(0.011, 0.001, 0.0)), 0.002);
        assert!((field.at(&Vec3::new(0.011, 0.01, 0.0)) - 0.01).abs() < 1e-15);
        assert!((field.at(&Vec3::new(0.023, 0.004, 0.0)) - 0.005).abs() < 1e-15);
        let field = SizeField::new(vec![Need::at(b, 0.003)], 0.05, 0.5);
        assert!((field.at(&Vec3::new(0.02, 0.0, 0.01)) - 0.008).abs() < 1e-15);
    }
}
