//! How long the outline of a restraint is: how many pairs of neighbouring search nodes it parts.
//!
//! What holds a body (a ligament, a patch of glue) touches it over an area. Ten nodes side by side are described
//! by the few places where the area ends, ten scattered ones by all their surroundings; the search charges for the
//! difference. Two nodes are neighbours when the ball that has them at its ends holds no other node (Gabriel and
//! Sokal, Systematic Zoology 18, 1969), which needs no mesh: on a regular grid these are the nearest four.

use crate::geometry::Vec3;

/// Which search nodes are neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    pub(super) pairs: Vec<[usize; 2]>,
}

impl Outline {
    /// Of nodes at `places` (m).
    pub fn new(places: &[Vec3]) -> Self {
        let mut pairs = Vec::new();
        for (i, a) in places.iter().enumerate() {
            for (j, b) in places.iter().enumerate().skip(i + 1) {
                let (middle, radius2) = (0.5 * (a + b), 0.25 * (a - b).norm_squared());
                // Nodes on the ball itself count as inside, up to rounding: a grid's diagonals are no neighbours.
                let inside = |p: &Vec3| (p - middle).norm_squared() <= radius2 * (1.0 + 1e-9);
                if !places.iter().enumerate().any(|(k, p)| k != i && k != j && inside(p)) {
                    pairs.push([i, j]);
                }
            }
        }
        Self { pairs }
    }

    /// Pairs of neighbours of which one is among `nodes`.
    pub fn length(&self, nodes: &[usize]) -> usize {
        self.pairs.iter().filter(|pair| nodes.contains(&pair[0]) != nodes.contains(&pair[1])).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_four_neighbours_a_node_and_a_row_less_outline_than_as_many_scattered_nodes() {
        let places: Vec<Vec3> =
            (0..20).map(|i| Vec3::new(f64::from(i % 5), 0.0, 0.8 * f64::from(i / 5))).collect();
        let outline = Outline::new(&places);
        assert_eq!(outline.pairs.len(), 4 * 4 + 3 * 5);
        assert_eq!(outline.length(&[0, 1, 2, 3, 4]), 5);
        assert_eq!(outline.length(&[6, 8, 12, 16, 18]), 4 + 4 + 4 + 3 + 3);
        assert_eq!(outline.length(&[]), 0);
    }
}
