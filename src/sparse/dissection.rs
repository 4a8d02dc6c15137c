//! In which order the nodes of a mesh graph are eliminated: nested dissection (George 1973).
//!
//! A separator is eliminated after the two parts it leaves, which are ordered in the same way until they are
//! small. The parts share nothing, so they are ordered in parallel; the result does not depend on it.

use super::graph::Graph;
use super::leaf::minimum_degree;
use super::refinement::Side;
use super::separator::{distances, separate};

/// Nodes of a part that is not cut any further.
const LEAF: usize = 100;
/// Nodes of a part that is worth a task of its own.
pub(super) const TASK: usize = 2_000;

/// An elimination order of the graph's nodes; `points` (m) guide the cuts.
pub(super) fn nested_dissection(graph: &Graph, points: &[[f64; 3]]) -> Vec<u32> {
    let nodes: Vec<u32> = (0..graph.len() as u32).collect();
    dissect(graph, points, graph, nodes)
}

/// Orders `nodes`, the part of the `whole` graph that is `part`.
fn dissect(whole: &Graph, points: &[[f64; 3]], part: &Graph, nodes: Vec<u32>) -> Vec<u32> {
    if nodes.len() <= LEAF {
        return minimum_degree(whole, &nodes, &mut vec![u32::MAX; whole.len()]);
    }
    let here: Vec<[f64; 3]> = nodes.iter().map(|&n| points[n as usize]).collect();
    let groups = groups(part, &here);
    let [first, second, between] = groups;
    let order_of = |members: &[u32]| {
        let names: Vec<u32> = members.iter().map(|&i| nodes[i as usize]).collect();
        if members.len() == nodes.len() {
            return names;
        }
        let inner = part.part(members, &mut vec![u32::MAX; part.len()]);
        dissect(whole, points, &inner, names)
    };
    let (mut order, rest) = if nodes.len() > TASK {
        rayon::join(|| order_of(&first), || order_of(&second))
    } else {
        (order_of(&first), order_of(&second))
    };
    order.extend(rest);
    order.extend(between.iter().map(|&i| nodes[i as usize]));
    order
}

/// Two parts without an edge between them, and the separator.
fn groups(graph: &Graph, points: &[[f64; 3]]) -> [Vec<u32>; 3] {
    let reached = distances(graph, 0);
    let side_of: Vec<Side> = if reached.contains(&u32::MAX) {
        reached.iter().map(|&d| if d == u32::MAX { Side::Second } else { Side::First }).collect()
    } else {
        separate(graph, points)
    };
    [Side::First, Side::Second, Side::Between]
        .map(|side| (0..graph.len() as u32).filter(|&n| side_of[n as usize] == side).collect())
}
