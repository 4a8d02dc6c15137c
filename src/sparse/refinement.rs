//! How a separator becomes smaller: nodes leave it one by one for one of the two parts, and their neighbours in
//! the other part enter it (Fiduccia & Mattheyses 1982, for vertex separators as by Ashcraft & Liu 1998).
//!
//! A round takes the best move even if it loses, moves no node twice, and returns to the best state it met.

use super::graph::Graph;
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
const PATIENCE: (usize, f64) = (15, 0.3);

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
pub(super) fn refined(graph: &Graph, sides: &[Side]) -> (f64, Vec<Side>) {
    let mut refinement = Refinement::new(graph, sides);
    for _ in 0..ROUNDS {
        if !refinement.round() {
            break;
        }
    }
    let cost = if refinement.weights.allowed() { refinement.weights.cost() } else { f64::INFINITY };
    (cost, refinement.sides())
}

/// A separator while nodes are moved.
struct Refinement<'a> {
    graph: &'a Graph,
    nodes: Vec<Node>,
    weights: Weights,
    /// Candidate moves for each side. Gains that have risen since were offered anew; gains that have fallen are
    /// found out when they surface.
    queues: [BinaryHeap<Move>; 2],
    /// Changes since the best state: node and the side it had.
    undo: Vec<(u32, Side)>,
}

/// What is known of a node.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// For separator nodes: weight of their neighbours in the first and in the second part.
    touching: [i32; 2],
    side: Side,
    /// Whether it was moved in this round and stays.
    settled: bool,
}

/// A node that may leave the separator, in the order of the gain; of equal gains the smaller node comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Move(i64);

impl Move {
    fn new(gain: i32, node: u32) -> Self {
        Self(i64::from(gain) << 32 | i64::from(!node))
    }

    fn gain(self) -> i32 {
        (self.0 >> 32) as i32
    }

    fn node(self) -> u32 {
        !(self.0 as u32)
    }
}

const SIDES: [Side; 2] = [Side::First, Side::Second];

impl<'a> Refinement<'a> {
    fn new(graph: &'a Graph, sides: &[Side]) -> Self {
        let mut weights = Weights([0; 3]);
        for (side, &weight) in sides.iter().zip(&graph.weight) {
            weights.0[*side as usize] += i64::from(weight);
        }
        let nodes = sides.iter().map(|&side| Node { touching: [0; 2], side, settled: false }).collect();
        Self { graph, nodes, weights, queues: [BinaryHeap::new(), BinaryHeap::new()], undo: Vec::new() }
    }

    fn sides(&self) -> Vec<Side> {
        self.nodes.iter().map(|node| node.side).collect()
    }

    /// Moves nodes until nothing was gained for a while, and returns to the best state. True if it is better
    /// than the state before.
    fn round(&mut self) -> bool {
        self.queues.iter_mut().for_each(BinaryHeap::clear);
        self.undo.clear();
        for node in 0..self.nodes.len() {
            self.nodes[node].settled = false;
            if self.nodes[node].side == Side::Between {
                let mut touching = [0; 2];
                for &m in self.graph.neighbours(node) {
                    if let side @ (Side::First | Side::Second) = self.nodes[m as usize].side {
                        touching[side as usize] += self.graph.weight[m as usize] as i32;
                    }
                }
                self.nodes[node].touching = touching;
                SIDES.into_iter().for_each(|to| self.offer(node, to));
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
            self.nodes[node as usize].side = side;
        }
        self.weights = best.2;
        (!best.0, best.1) < (!start.0, start.1)
    }

    /// The weight by which the separator shrinks when `node` leaves it for `to`.
    fn gain(&self, node: usize, to: Side) -> i32 {
        self.graph.weight[node] as i32 - self.nodes[node].touching[1 - to as usize]
    }

    fn offer(&mut self, node: usize, to: Side) {
        self.queues[to as usize].push(Move::new(self.gain(node, to), node as u32));
    }

    /// The move of greatest gain; at equal gain the one to the lighter side. A side whose best move would leave
    /// the other too light has to wait.
    fn next_move(&mut self) -> Option<(usize, Side)> {
        let mut best: Option<(i32, usize, Side)> = None;
        let lighter = SIDES[usize::from(self.weights.0[1] < self.weights.0[0])];
        for to in [lighter, SIDES[1 - lighter as usize]] {
            if let Some((gain, node)) = self.top(to)
                && best.is_none_or(|(other, ..)| gain > other)
                && (to == lighter || self.leaves_enough(node, to))
            {
                best = Some((gain, node, to));
            }
        }
        best.map(|(_, node, to)| (node, to))
    }

    /// The node of greatest gain among those that may leave the separator for `to`.
    fn top(&mut self, to: Side) -> Option<(i32, usize)> {
        while let Some(&offered) = self.queues[to as usize].peek() {
            let node = offered.node() as usize;
            let known = self.nodes[node];
            if known.side == Side::Between && !known.settled {
                let gain = self.gain(node, to);
                if gain == offered.gain() {
                    return Some((gain, node));
                }
                if gain < offered.gain() {
                    self.offer_again(node, to);
                    continue;
                }
            }
            self.queues[to as usize].pop();
        }
        None
    }

    /// Puts the first move of a queue where its gain belongs now.
    fn offer_again(&mut self, node: usize, to: Side) {
        let current = Move::new(self.gain(node, to), node as u32);
        if let Some(mut first) = self.queues[to as usize].peek_mut() {
            *first = current;
        }
    }

    /// Whether the parts are allowed after `node` has left the separator for `to`.
    fn leaves_enough(&self, node: usize, to: Side) -> bool {
        let mut after = self.weights;
        let (weight, entering) =
            (i64::from(self.graph.weight[node]), i64::from(self.nodes[node].touching[1 - to as usize]));
        after.0[to as usize] += weight;
        after.0[1 - to as usize] -= entering;
        after.0[2] += entering - weight;
        after.allowed()
    }

    /// Moves `node` out of the separator; its neighbours on the other side enter it.
    fn make(&mut self, node: usize, to: Side) {
        let graph = self.graph;
        let from = SIDES[1 - to as usize];
        self.put(node, to);
        self.nodes[node].settled = true;
        let weight = graph.weight[node] as i32;
        for &m in graph.neighbours(node) {
            let m = m as usize;
            if self.nodes[m].side == Side::Between {
                self.nodes[m].touching[to as usize] += weight;
            } else if self.nodes[m].side == from {
                self.put(m, Side::Between);
                let entered = graph.weight[m] as i32;
                let mut touching = [0; 2];
                for &k in graph.neighbours(m) {
                    let k = k as usize;
                    match self.nodes[k].side {
                        Side::Between => {
                            self.nodes[k].touching[from as usize] -= entered;
                            if !self.nodes[k].settled {
                                self.offer(k, to);
                            }
                        }
                        side => touching[side as usize] += graph.weight[k] as i32,
                    }
                }
                self.nodes[m].touching = touching;
                if !self.nodes[m].settled {
                    SIDES.into_iter().for_each(|to| self.offer(m, to));
                }
            }
        }
    }

    fn put(&mut self, node: usize, to: Side) {
        let (from, weight) = (self.nodes[node].side, i64::from(self.graph.weight[node]));
        self.undo.push((node as u32, from));
        self.weights.0[from as usize] -= weight;
        self.weights.0[to as usize] += weight;
        self.nodes[node].side = to;
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
        let (cost, sides) = refined(&graph, &sides);
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
        let mut refinement = Refinement::new(&graph, &start);
        refinement.round();
        let counted = SIDES.map(|s| weight_of(&refinement.sides(), s) as i64);
        assert_eq!(refinement.weights.0[..2], counted);
        assert_eq!(refinement.weights.0.iter().sum::<i64>(), 81);
        assert!(refinement.weights.0[2] <= 9);
    }
}
