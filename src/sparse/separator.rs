//! Where a graph is cut in two: a few nodes whose removal leaves two parts of similar weight.
//!
//! Sweeps propose, local moves refine. A sweep passes the nodes in the order of a key (a coordinate, a
//! principal axis, the distance in edges from a far node); at every moment the passed nodes that touch an
//! unpassed one form a separator, and the cheapest moment is kept. The best proposals are then refined by
//! moves of single nodes out of the separator (Fiduccia & Mattheyses 1982, for vertex separators as by
//! Ashcraft & Liu 1998), which may climb for a while and return to the best state seen. Nothing here is random.

use super::graph::Graph;
use nalgebra::{Matrix3, Vector3};
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
/// How much an uneven cut is charged: a cut where one part holds everything counts as this many times longer.
const UNEVENNESS_CHARGE: f64 = 0.6;
/// Proposals that are refined.
const REFINED: usize = 3;
/// Rounds of refinement, if each one gains.
const ROUNDS: usize = 8;
/// Moves without gain before a round is given up, at least and as a share of the separator.
const PATIENCE: (usize, f64) = (60, 0.3);

/// Weights of the two parts and the separator.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Weights([i64; 3]);

impl Weights {
    fn cost(self) -> f64 {
        let [a, b, between] = self.0.map(|w| w as f64);
        (between + 0.5) * (1.0 + UNEVENNESS_CHARGE * (a - b).abs() / (a + b + between))
    }

    /// Whether neither part is too light, or at least the lighter one grows.
    fn allowed(self) -> bool {
        let total: i64 = self.0.iter().sum();
        let lighter = self.0[0].min(self.0[1]);
        // Coarse graphs of a few heavy nodes cannot do better than this.
        lighter as f64 + 0.5 * self.0[2] as f64 >= SMALLEST_SHARE * total as f64
    }
}

/// Cuts a connected graph of at least two nodes; `points` (m) guide the cut. Neither part is empty unless the
/// graph is so dense that no separator leaves two parts.
pub(super) fn separate(graph: &Graph, points: &[[f64; 3]]) -> Vec<Side> {
    let mut proposals: Vec<(f64, Vec<Side>)> =
        keys(graph, points).iter().filter_map(|key| sweep(graph, key)).collect();
    proposals.sort_by(|a, b| a.0.total_cmp(&b.0));
    proposals.dedup_by(|a, b| a.1 == b.1);
    proposals.truncate(REFINED);
    let refined = proposals.into_iter().map(|(_, sides)| Refinement::new(graph, sides).run());
    let best = refined.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or_else(|| vec![Side::Between; graph.len()], |(_, sides)| sides)
}

/// The keys along which the graph is swept.
fn keys(graph: &Graph, points: &[[f64; 3]]) -> Vec<Vec<f64>> {
    let mut directions: Vec<Vector3<f64>> = principal_axes(points).to_vec();
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        if directions.iter().all(|d| d.dot(&axis).abs() < 0.999) {
            directions.push(axis);
        }
    }
    let mut keys: Vec<Vec<f64>> = directions
        .iter()
        .map(|d| points.iter().map(|p| p[0] * d.x + p[1] * d.y + p[2] * d.z).collect())
        .collect();
    let far = distances(graph, furthest(&distances(graph, 0)));
    keys.push(far.into_iter().map(f64::from).collect());
    keys
}

/// Eigenvectors of the points' covariance; the coordinate axes where the points say nothing.
fn principal_axes(points: &[[f64; 3]]) -> [Vector3<f64>; 3] {
    let count = points.len() as f64;
    let centre = points.iter().map(|&p| Vector3::from(p)).sum::<Vector3<f64>>() / count;
    let mut covariance = Matrix3::zeros();
    for &point in points {
        let d = Vector3::from(point) - centre;
        covariance += d * d.transpose() / count;
    }
    let usable = covariance.iter().all(|x| x.is_finite()) && covariance.trace() > 0.0;
    let axes = if usable { covariance.symmetric_eigen().eigenvectors } else { Matrix3::identity() };
    [0, 1, 2].map(|i| axes.column(i).into_owned())
}

/// Distance of every node from `start` in edges; `u32::MAX` where there is no path.
pub(super) fn distances(graph: &Graph, start: usize) -> Vec<u32> {
    let mut distance = vec![u32::MAX; graph.len()];
    distance[start] = 0;
    let mut queue = vec![start as u32];
    let mut head = 0;
    while let Some(&node) = queue.get(head) {
        head += 1;
        for &next in graph.neighbours(node as usize) {
            if distance[next as usize] == u32::MAX {
                distance[next as usize] = distance[node as usize] + 1;
                queue.push(next);
            }
        }
    }
    distance
}

fn furthest(distance: &[u32]) -> usize {
    (0..distance.len()).max_by_key(|&i| (distance[i], Reverse(i))).unwrap_or(0)
}

/// The cheapest separator met while the nodes are passed in the order of `key`; `None` when the sweep never
/// leaves a node on both sides.
fn sweep(graph: &Graph, key: &[f64]) -> Option<(f64, Vec<Side>)> {
    let n = graph.len();
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_unstable_by(|&a, &b| key[a as usize].total_cmp(&key[b as usize]).then(a.cmp(&b)));
    let mut rank = vec![0_u32; n];
    for (place, &node) in order.iter().enumerate() {
        rank[node as usize] = place as u32;
    }
    // A node passed at `rank` is in the separator until its last neighbour is passed: `leaves[t]` is the
    // weight of the nodes whose last neighbour is passed in step t.
    let last: Vec<u32> = (0..n)
        .map(|node| graph.neighbours(node).iter().map(|&m| rank[m as usize]).fold(rank[node], u32::max))
        .collect();
    let mut leaves = vec![0_i64; n];
    for node in 0..n {
        leaves[last[node] as usize] += i64::from(graph.weight[node]);
    }
    let total: i64 = graph.weight.iter().map(|&w| i64::from(w)).sum();
    let (mut passed, mut finished) = (0_i64, 0_i64);
    let mut best: Option<(bool, f64, usize)> = None;
    for (step, &node) in order.iter().enumerate() {
        passed += i64::from(graph.weight[node as usize]);
        finished += leaves[step];
        let weights = Weights([finished, total - passed, passed - finished]);
        if finished == 0 || passed == total {
            continue;
        }
        let (refused, cost) = (!weights.allowed(), weights.cost());
        if best.is_none_or(|(r, c, _)| (refused, cost) < (r, c)) {
            best = Some((refused, cost, step));
        }
    }
    let (_, cost, step) = best?;
    let side = |node: usize| match (rank[node] as usize <= step, last[node] as usize <= step) {
        (true, true) => Side::First,
        (true, false) => Side::Between,
        (false, _) => Side::Second,
    };
    Some((cost, (0..n).map(side).collect()))
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

    fn run(mut self) -> (f64, Vec<Side>) {
        for _ in 0..ROUNDS {
            if !self.round() {
                break;
            }
        }
        (self.weights.cost(), self.side)
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
