//! How a separator becomes smaller: nodes leave it one by one for one of the two parts, and their neighbours in
//! the other part enter it (Fiduccia & Mattheyses 1982, for vertex separators as by Ashcraft & Liu 1998).
//!
//! A round takes the best move even if it loses, moves no node twice, and returns to the best state it met.

use super::graph::Graph;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The part a node belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// The first part.
    First = 0,
    /// The second part.
    Second = 1,
    /// The separator.
    Between = 2,
}

/// The lightest either part may be, as a share of the whole weight.
const SMALLEST_SHARE: f64 = 0.3;
/// How much an uneven cut is charged: one that leaves everything in one part counts as heavier by this share.
const UNEVENNESS_CHARGE: f64 = 0.3;
/// Rounds of refinement, if each one gains.
const ROUNDS: usize = 4;
/// Moves without gain before a round is given up, at least and as a share of the separator.
const PATIENCE: (usize, f64) = (40, 0.3);

/// Weights of the two parts and the separator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weights(pub(super) [i64; 3]);

impl Weights {
    /// What the cut costs: the weight of the separator, more when the parts are uneven.
    pub(super) fn cost(self) -> f64 {
        let [a, b, between] = self.0.map(|w| w as f64);
        (between + 0.5) * (1.0 + UNEVENNESS_CHARGE * (a - b).abs() / (a + b + between))
    }

    /// Whether neither part is too light.
    pub(super) fn allowed(self) -> bool {
        let total: i64 = self.0.iter().sum();
        let lighter = self.0[0].min(self.0[1]);
        // The separator counts half: in small graphs it holds much of the weight.
        lighter as f64 + 0.5 * self.0[2] as f64 >= SMALLEST_SHARE * total as f64
    }
}

/// Makes a separator better while that works; its cost, which is infinite when a part is too light.
pub(super) fn refined(graph: &Graph, sides: Vec<Side>) -> (f64, Vec<Side>) {
    let mut refinement = Refinement::new(graph, sides);
    for _ in 0..ROUNDS {
        if !refinement.round() {
            break;
        }
    }
    let cost = if refinement.weights.allowed() { refinement.weights.cost() } else { f64::INFINITY };
    (cost, refinement.side)
}

/// A separator while nodes are moved.
struct Refinement<'a> {
    graph: &'a Graph,
    side: Vec<Side>,
    weights: Weights,
    /// For separator nodes: weight of their neighbours in the first and in the second part.
    touching: Vec<[i64; 2]>,
    /// Nodes that were moved in this round and stay.
    settled: Vec<bool>,
    /// Candidate moves for each side: (gain, node); outdated ones are dropped when they surface.
    queues: [BinaryHeap<(i64, Reverse<u32>)>; 2],
    /// Changes since the best state: node and the side it had.
    undo: Vec<(u32, Side)>,
}

const SIDES: [Side; 2] = [Side::First, Side::Second];

impl<'a> Refinement<'a> {
    fn new(graph: &'a Graph, side: Vec<Side>) -> Self {
        let mut weights = Weights([0; 3]);
        for (node, &s) in side.iter().enumerate() {
            weights.0[s as usize] += i64::from(graph.weight[node]);
        }
        let n = graph.len();
        Self {
            graph,
            side,
            weights,
            touching: vec![[0; 2]; n],
            settled: vec![false; n],
            queues: [BinaryHeap::new(), BinaryHeap::new()],
            undo: Vec::new(),
        }
    }

    /// Moves nodes until nothing was gained for a while, and returns to the best state. True if it is better
    /// than the state before.
    fn round(&mut self) -> bool {
        self.settled.fill(false);
        self.queues.iter_mut().for_each(BinaryHeap::clear);
        self.undo.clear();
        for node in 0..self.graph.len() {
            if self.side[node] == Side::Between {
                self.enter(node);
            }
        }
        let start = (self.weights.allowed(), self.weights.cost());
        let mut best = (start.0, start.1, self.weights);
        let patience = PATIENCE.0.max((PATIENCE.1 * self.queues[0].len() as f64) as usize);
        let mut since_best = 0;
        while since_best < patience {
            let Some((node, to)) = self.next_move() else { break };
            self.make(node, to);
            since_best += 1;
            let (allowed, cost) = (self.weights.allowed(), self.weights.cost());
            if (!allowed, cost) < (!best.0, best.1 - 1e-9) {
                best = (allowed, cost, self.weights);
                self.undo.clear();
                since_best = 0;
            }
        }
        while let Some((node, side)) = self.undo.pop() {
            self.side[node as usize] = side;
        }
        self.weights = best.2;
        (!best.0, best.1) < (!start.0, start.1)
    }

    /// The weight by which the separator shrinks when `node` leaves it for `to`.
    fn gain(&self, node: usize, to: Side) -> i64 {
        i64::from(self.graph.weight[node]) - self.touching[node][1 - to as usize]
    }

    /// Counts what a node that entered the separator touches, and offers its moves.
    fn enter(&mut self, node: usize) {
        let mut touching = [0; 2];
        for &m in self.graph.neighbours(node) {
            if let side @ (Side::First | Side::Second) = self.side[m as usize] {
                touching[side as usize] += i64::from(self.graph.weight[m as usize]);
            }
        }
        self.touching[node] = touching;
        self.offer(node);
    }

    fn offer(&mut self, node: usize) {
        if !self.settled[node] {
            for to in SIDES {
                self.queues[to as usize].push((self.gain(node, to), Reverse(node as u32)));
            }
        }
    }

    /// The move of greatest gain that keeps the balance; at equal gain the one to the lighter side.
    fn next_move(&mut self) -> Option<(usize, Side)> {
        let mut tops = [None; 2];
        for to in SIDES {
            while let Some(&(gain, Reverse(node))) = self.queues[to as usize].peek() {
                let node = node as usize;
                let current =
                    self.side[node] == Side::Between && !self.settled[node] && self.gain(node, to) == gain;
                let mut after = self.weights;
                after.0[to as usize] += i64::from(self.graph.weight[node]);
                after.0[1 - to as usize] -= self.touching[node][1 - to as usize];
                let grows_lighter = self.weights.0[to as usize] <= self.weights.0[1 - to as usize];
                if current && (grows_lighter || after.allowed()) {
                    tops[to as usize] = Some((gain, node));
                    break;
                }
                self.queues[to as usize].pop();
            }
        }
        let lighter = usize::from(self.weights.0[1] < self.weights.0[0]);
        match tops {
            [Some(a), Some(b)] => {
                let to = if a.0 == b.0 { lighter } else { usize::from(b.0 > a.0) };
                Some(([a, b][to].1, SIDES[to]))
            }
            [Some(a), None] => Some((a.1, Side::First)),
            [None, Some(b)] => Some((b.1, Side::Second)),
            [None, None] => None,
        }
    }

    /// Moves `node` out of the separator; its neighbours on the other side enter it.
    fn make(&mut self, node: usize, to: Side) {
        let graph = self.graph;
        let from = SIDES[1 - to as usize];
        self.put(node, to);
        self.settled[node] = true;
        let weight = i64::from(graph.weight[node]);
        for &m in graph.neighbours(node) {
            let m = m as usize;
            if self.side[m] == Side::Between {
                self.touching[m][to as usize] += weight;
                self.offer(m);
            } else if self.side[m] == from {
                self.put(m, Side::Between);
                let entered = i64::from(graph.weight[m]);
                for &k in graph.neighbours(m) {
                    let k = k as usize;
                    if self.side[k] == Side::Between && k != m {
                        self.touching[k][from as usize] -= entered;
                        self.offer(k);
                    }
                }
                self.enter(m);
            }
        }
    }

    fn put(&mut self, node: usize, to: Side) {
        let (from, weight) = (self.side[node], i64::from(self.graph.weight[node]));
        self.undo.push((node as u32, from));
        self.weights.0[from as usize] -= weight;
        self.weights.0[to as usize] += weight;
        self.side[node] = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(side: u32) -> Graph {
        let right = (0..side * side).filter(|i| (i + 1) % side != 0).map(|i| [i, i + 1]);
        let up = (0..side * (side - 1)).map(|i| [i, i + side]);
        Graph::from_edges(vec![1; (side * side) as usize], &right.chain(up).collect::<Vec<_>>())
    }

    fn weight_of(sides: &[Side], which: Side) -> usize {
        sides.iter().filter(|&&s| s == which).count()
    }

    #[test]
    fn a_thick_crooked_separator_becomes_a_line_of_the_grid() {
        let graph = grid(16);
        let sides: Vec<Side> = (0..256_u32)
            .map(|i| match (i % 16) + (i / 16 * 7) % 3 {
                0..6 => Side::First,
                6..10 => Side::Between,
                _ => Side::Second,
            })
            .collect();
        let (cost, sides) = refined(&graph, sides);
        assert!(weight_of(&sides, Side::Between) <= 16, "{}", weight_of(&sides, Side::Between));
        assert!(cost.is_finite());
        for node in 0..256 {
            for &m in graph.neighbours(node) {
                let pair = (sides[node], sides[m as usize]);
                assert!(pair != (Side::First, Side::Second), "an edge across the separator");
            }
        }
    }

    #[test]
    fn weights_stay_those_of_the_sides() {
        let graph = grid(9);
        let mut start = vec![Side::First; 81];
        start[36..45].fill(Side::Between);
        start[45..].fill(Side::Second);
        let mut refinement = Refinement::new(&graph, start);
        refinement.round();
        let counted = SIDES.map(|s| weight_of(&refinement.side, s) as i64);
        assert_eq!(refinement.weights.0[..2], counted);
        assert_eq!(refinement.weights.0.iter().sum::<i64>(), 81);
        assert!(refinement.weights.0[2] <= 9);
    }
}
