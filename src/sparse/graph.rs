//! Which unknowns are eliminated together, and which of these blocks touch: a pattern → a smaller graph.
//!
//! The unknowns of one mesh node have the same neighbours and stay together in any good elimination order, so
//! the order is sought among blocks.

use super::Pattern;
use std::collections::HashMap;

/// An undirected graph with weighted nodes; no loops, each edge listed at both ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Graph {
    /// Where each node's neighbours start; one more entry than nodes.
    starts: Vec<u32>,
    /// The neighbours of all nodes.
    neighbours: Vec<u32>,
    /// For each neighbour, how many edges of the finest graph this edge stands for.
    strengths: Vec<u32>,
    /// Weight of each node: the number of unknowns it stands for.
    pub(super) weight: Vec<u32>,
}

impl Graph {
    /// The graph with these edges, each given once; neighbours are sorted.
    pub(super) fn from_edges(weight: Vec<u32>, edges: &[[u32; 2]]) -> Self {
        let mut starts = vec![0_u32; weight.len() + 1];
        for &node in edges.as_flattened() {
            starts[node as usize + 1] += 1;
        }
        for i in 0..weight.len() {
            starts[i + 1] += starts[i];
        }
        let mut neighbours = vec![0; edges.len() * 2];
        let mut next = starts.clone();
        for &[a, b] in edges {
            for (from, to) in [(a, b), (b, a)] {
                neighbours[next[from as usize] as usize] = to;
                next[from as usize] += 1;
            }
        }
        for bounds in starts.windows(2) {
            neighbours[bounds[0] as usize..bounds[1] as usize].sort_unstable();
        }
        let strengths = vec![1; neighbours.len()];
        Self { starts, neighbours, strengths, weight }
    }

    /// Number of nodes.
    pub(super) fn len(&self) -> usize {
        self.weight.len()
    }

    pub(super) fn neighbours(&self, node: usize) -> &[u32] {
        &self.neighbours[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// The neighbours of `node` with the strengths of the edges to them.
    pub(super) fn edges(&self, node: usize) -> impl Iterator<Item = (u32, u32)> + '_ {
        let range = self.starts[node] as usize..self.starts[node + 1] as usize;
        self.neighbours[range.clone()].iter().copied().zip(self.strengths[range].iter().copied())
    }

    /// The graph in which all nodes with the same number in `coarse_of` (below `count`) are one: weights and
    /// strengths add up.
    pub(super) fn contracted(&self, coarse_of: &[u32], count: usize) -> Self {
        let (firsts, members) = grouped(coarse_of, count);
        let members_of = |coarse: usize| &members[firsts[coarse] as usize..firsts[coarse + 1] as usize];
        let mut starts = Vec::with_capacity(count + 1);
        starts.push(0);
        let (mut neighbours, mut strengths): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        let mut place_of = vec![usize::MAX; count];
        let mut weight = Vec::with_capacity(count);
        for coarse in 0..count {
            let first = neighbours.len();
            for &node in members_of(coarse) {
                for (m, strength) in self.edges(node as usize) {
                    let other = coarse_of[m as usize];
                    if other as usize == coarse {
                        continue;
                    }
                    let place = place_of[other as usize];
                    if place < neighbours.len() && place >= first {
                        strengths[place] += strength;
                    } else {
                        place_of[other as usize] = neighbours.len();
                        neighbours.push(other);
                        strengths.push(strength);
                    }
                }
            }
            starts.push(neighbours.len() as u32);
            weight.push(members_of(coarse).iter().map(|&node| self.weight[node as usize]).sum());
        }
        Self { starts, neighbours, strengths, weight }
    }

    /// The part spanned by `nodes`, renumbered in their order, which is ascending. `local` is as long as this graph has nodes, holds
    /// `u32::MAX` everywhere, and does so again afterwards.
    pub(super) fn part(&self, nodes: &[u32], local: &mut [u32]) -> Self {
        for (new, &old) in nodes.iter().enumerate() {
            local[old as usize] = new as u32;
        }
        let mut starts = Vec::with_capacity(nodes.len() + 1);
        starts.push(0);
        let (mut neighbours, mut strengths) = (Vec::new(), Vec::new());
        for &old in nodes {
            for (other, strength) in self.edges(old as usize) {
                if local[other as usize] != u32::MAX {
                    neighbours.push(local[other as usize]);
                    strengths.push(strength);
                }
            }
            starts.push(neighbours.len() as u32);
        }
        for &old in nodes {
            local[old as usize] = u32::MAX;
        }
        Self {
            starts,
            neighbours,
            strengths,
            weight: nodes.iter().map(|&n| self.weight[n as usize]).collect(),
        }
    }
}

/// Numbers `0..class_of.len()` sorted by class (below `count`), those of one class ascending, and where each class
/// starts.
pub(super) fn grouped(class_of: &[u32], count: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; count + 1];
    for &class in class_of {
        starts[class as usize + 1] += 1;
    }
    for class in 0..count {
        starts[class + 1] += starts[class];
    }
    let mut members = vec![0_u32; class_of.len()];
    let mut next = starts.clone();
    for (member, &class) in class_of.iter().enumerate() {
        members[next[class as usize] as usize] = member as u32;
        next[class as usize] += 1;
    }
    (starts, members)
}

/// Unknowns grouped to blocks, and the graph of the blocks.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    /// The unknowns of each block, ascending; blocks in the order of their first unknown.
    pub(super) unknowns: Vec<Vec<u32>>,
    /// Where each block is (m).
    pub(super) points: Vec<[f64; 3]>,
    /// Which blocks are coupled.
    pub(super) graph: Graph,
}

impl Blocks {
    /// Groups the unknowns that share a point and have the same neighbours. Unknowns at one point with other
    /// neighbours (a spring on one of them, say) become blocks of their own, so that the graph stays exact.
    pub(super) fn new(pattern: &Pattern, position: &[[f64; 3]]) -> Self {
        let fingerprints = fingerprints(pattern);
        let mut block_of_key: HashMap<([u64; 3], u64), u32> = HashMap::new();
        let mut unknowns: Vec<Vec<u32>> = Vec::new();
        let mut block_of = Vec::with_capacity(position.len());
        for (unknown, (point, &fingerprint)) in position.iter().zip(&fingerprints).enumerate() {
            // Adding 0 makes −0 and 0 the same point.
            let key = (point.map(|x| (x + 0.0).to_bits()), fingerprint);
            let block = *block_of_key.entry(key).or_insert(unknowns.len() as u32);
            if block as usize == unknowns.len() {
                unknowns.push(Vec::new());
            }
            unknowns[block as usize].push(unknown as u32);
            block_of.push(block);
        }
        let is_first = |unknown: u32| unknowns[block_of[unknown as usize] as usize][0] == unknown;
        let mut edges = Vec::new();
        for block in &unknowns {
            let column = block[0];
            for &row in &pattern.rows()[pattern.column(column as usize)][1..] {
                if is_first(row) {
                    edges.push([block_of[column as usize], block_of[row as usize]]);
                }
            }
        }
        let weight = unknowns.iter().map(|b| b.len() as u32).collect();
        let points = unknowns.iter().map(|b| position[b[0] as usize]).collect();
        Self { unknowns, points, graph: Graph::from_edges(weight, &edges) }
    }
}

/// A number for each unknown that is the same for unknowns with the same neighbours (themselves included), and
/// different otherwise but for coincidences of 1 in 2⁶⁴, which would cost fill and nothing else.
fn fingerprints(pattern: &Pattern) -> Vec<u64> {
    let mut sums = vec![0_u64; pattern.dimension()];
    for column in 0..pattern.dimension() {
        for &row in &pattern.rows()[pattern.column(column)] {
            sums[column] = sums[column].wrapping_add(scramble(u64::from(row)));
            if row as usize != column {
                sums[row as usize] = sums[row as usize].wrapping_add(scramble(column as u64));
            }
        }
    }
    sums
}

/// The SplitMix64 output function (Steele, Lea & Flood 2014), which maps neighbouring numbers far apart.
fn scramble(number: u64) -> u64 {
    let z = number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknowns_of_a_node_form_a_block() {
        let elements: [&[u32]; 2] = [&[0, 1, 2, 3], &[2, 3, 4, 5]];
        let pattern = Pattern::from_elements(6, elements.into_iter());
        let position = [0.0, -0.0, 1.0, 1.0, 2.0, 2.0].map(|x| [x, 0.0, 0.0]);
        let blocks = Blocks::new(&pattern, &position);
        assert_eq!(blocks.unknowns, [vec![0, 1], vec![2, 3], vec![4, 5]]);
        assert_eq!(blocks.graph, Graph::from_edges(vec![2, 2, 2], &[[0, 1], [1, 2]]));
        assert_eq!(blocks.graph.neighbours(1), [0, 2]);
    }

    #[test]
    fn unknowns_with_other_neighbours_stay_apart_even_at_one_point() {
        let elements: [&[u32]; 2] = [&[0, 1, 2], &[2, 3]];
        let pattern = Pattern::from_elements(4, elements.into_iter());
        let blocks = Blocks::new(&pattern, &[[0.0; 3]; 4]);
        assert_eq!(blocks.unknowns, [vec![0, 1], vec![2], vec![3]]);
        assert_eq!(blocks.graph.neighbours(1), [0, 2]);
    }

    #[test]
    fn a_part_keeps_the_edges_inside() {
        let graph = Graph::from_edges(vec![1, 2, 3, 4], &[[0, 1], [1, 2], [2, 3], [0, 3]]);
        let mut local = vec![u32::MAX; 4];
        let part = graph.part(&[0, 1, 3], &mut local);
        assert_eq!(part, Graph::from_edges(vec![1, 2, 4], &[[0, 1], [0, 2]]));
        assert_eq!(local, [u32::MAX; 4]);
    }
}
