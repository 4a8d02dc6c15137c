//! Where a graph is cut in two: a few nodes whose removal leaves two parts of similar weight.
//!
//! Two ways compete. Multilevel (Hendrickson & Leland 1995; Karypis & Kumar 1998): the graph is coarsened until it
//! is small, cut there, and the cut is carried back level by level and refined on each; this finds its way through
//! locally refined meshes. Direct: the graph itself is cut; this finds the planes of regular ones. Measured flops
//! of the factor against METIS: 1.16 and 1.06 on a P2 mesh graded to a rim and on a slab with the first alone,
//! 1.99 and 1.04 with the second alone, 1.07 and 1.00 with both.
//!
//! In both, sweeps propose the cut: nodes are passed in the order of a key (a coordinate, a principal axis, the
//! distance in edges from some node); at every moment the passed nodes that touch an unpassed one form a
//! separator, and the cheapest moment is kept. Nothing here is random.

use super::coarse::coarsened;
use super::dissection::TASK;
use super::graph::{Graph, grouped};
use super::refinement::{Side, Weights, refined};
use nalgebra::{Matrix3, Vector3};
use std::cmp::Reverse;

/// Nodes of a graph that is not coarsened any further.
const COARSE: usize = 120;

/// How a graph is cut by sweeps: nodes from which distances are swept, and proposals that are refined.
#[derive(Debug, Clone, Copy)]
struct Effort {
    starts: usize,
    refined: usize,
}

/// Classes of equal keys in a sweep, for every node.
const CLASSES: usize = 4;

/// For the coarsest graph, which is small and decides most.
const THOROUGH: Effort = Effort { starts: 4, refined: 5 };
/// For the graph itself.
const QUICK: Effort = Effort { starts: 1, refined: 2 };

/// Cuts a connected graph of at least two nodes; `points` (m) guide the cut. Everything is in the separator when
/// the graph is so dense that nothing leaves two parts.
pub(super) fn separate(graph: &Graph, points: &[[f64; 3]]) -> Vec<Side> {
    let (multilevel, direct) =
        both(graph.len(), || multilevel_cut(graph, points), || best_sweep(graph, points, QUICK));
    if direct.0 < multilevel.0 { direct.1 } else { multilevel.1 }
}

/// Results of two searches through a graph of `nodes`, at the same time where that pays.
fn both<T: Send>(nodes: usize, a: impl FnOnce() -> T + Send, b: impl FnOnce() -> T + Send) -> (T, T) {
    if nodes > TASK { rayon::join(a, b) } else { (a(), b()) }
}

/// The cut through all levels, and its cost.
fn multilevel_cut(graph: &Graph, points: &[[f64; 3]]) -> (f64, Vec<Side>) {
    let coarse = if graph.len() > COARSE { coarsened(graph, points, COARSE) } else { None };
    let Some(coarse) = coarse else { return best_sweep(graph, points, THOROUGH) };
    let (_, sides) = multilevel_cut(&coarse.graph, &coarse.points);
    let carried: Vec<Side> = coarse.coarse_of.iter().map(|&c| sides[c as usize]).collect();
    refined(graph, &carried)
}

/// The cheapest of the best sweeps after refinement, and its cost.
fn best_sweep(graph: &Graph, points: &[[f64; 3]], effort: Effort) -> (f64, Vec<Side>) {
    let keys = keys(graph, points, effort.starts);
    let mut proposals: Vec<(f64, Vec<Side>)> = keys.iter().filter_map(|key| sweep(graph, key)).collect();
    proposals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let refined = proposals.into_iter().take(effort.refined).map(|(_, sides)| refined(graph, &sides));
    let best = refined.min_by(|a, b| a.0.total_cmp(&b.0));
    best.unwrap_or_else(|| (f64::INFINITY, vec![Side::Between; graph.len()]))
}

/// The keys along which the graph is swept.
fn keys(graph: &Graph, points: &[[f64; 3]], starts: usize) -> Vec<Vec<f64>> {
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
    // Starts far from each other: each is the node furthest from all before.
    let mut nearest = distances(graph, furthest(&distances(graph, 0)));
    keys.push(nearest.iter().copied().map(f64::from).collect());
    for _ in 1..starts {
        let distance = distances(graph, furthest(&nearest));
        nearest.iter_mut().zip(&distance).for_each(|(n, &d)| *n = (*n).min(d));
        keys.push(distance.into_iter().map(f64::from).collect());
    }
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

/// The nodes in the order of `key`, to a fraction of the keys' range that is smaller than the share of one node;
/// equal ones ascending.
fn sorted(key: &[f64]) -> Vec<u32> {
    let (low, high) = key.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &k| (l.min(k), h.max(k)));
    let classes = CLASSES * key.len();
    let scale = if high > low { (classes - 1) as f64 / (high - low) } else { 0.0 };
    let class_of: Vec<u32> = key.iter().map(|k| ((k - low) * scale) as u32).collect();
    grouped(&class_of, classes).1
}

/// The cheapest separator met while the nodes are passed in the order of `key`; `None` when the sweep never
/// leaves a node on both sides.
fn sweep(graph: &Graph, key: &[f64]) -> Option<(f64, Vec<Side>)> {
    let n = graph.len();
    let order = sorted(key);
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
