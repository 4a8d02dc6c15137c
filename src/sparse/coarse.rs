//! How a graph is made smaller without losing its shape: neighbours merge in pairs.
//!
//! Heavy-edge matching (Karypis & Kumar 1998): each node merges with the free neighbour it is tied to most
//! strongly, nodes of few neighbours first, so that few edges remain.

use super::graph::{Graph, grouped};

/// A smaller graph that stands for a larger one.
#[derive(Debug)]
pub(super) struct Coarse {
    pub(super) graph: Graph,
    /// Mean position of the merged nodes (m).
    pub(super) points: Vec<[f64; 3]>,
    /// For each node of the larger graph the node of the smaller one.
    pub(super) coarse_of: Vec<u32>,
}

/// Merges pairs of neighbours, none much heavier than a `goal`-th of the whole; `None` when hardly any merge.
pub(super) fn coarsened(graph: &Graph, points: &[[f64; 3]], goal: usize) -> Option<Coarse> {
    let n = graph.len();
    let heaviest = 1.5 * graph.weight.iter().map(|&w| f64::from(w)).sum::<f64>() / goal as f64;
    let degrees: Vec<u32> = (0..n).map(|node| graph.neighbours(node).len() as u32).collect();
    let (_, order) = grouped(&degrees, n);
    let mut coarse_of = vec![u32::MAX; n];
    let mut count = 0;
    for node in order.into_iter().map(|node| node as usize) {
        if coarse_of[node] != u32::MAX {
            continue;
        }
        let mate = graph
            .edges(node)
            .filter(|&(m, _)| coarse_of[m as usize] == u32::MAX)
            .map(|(m, strength)| (strength, std::cmp::Reverse((graph.weight[m as usize], m))))
            .filter(|(_, mate)| f64::from(graph.weight[node] + mate.0.0) <= heaviest)
            .max();
        coarse_of[node] = count;
        if let Some((_, mate)) = mate {
            coarse_of[mate.0.1 as usize] = count;
        }
        count += 1;
    }
    if count as usize > n * 9 / 10 {
        return None;
    }
    let coarse = graph.contracted(&coarse_of, count as usize);
    let mut middles = vec![[0.0; 3]; count as usize];
    for (node, point) in points.iter().enumerate() {
        let share = f64::from(graph.weight[node]) / f64::from(coarse.weight[coarse_of[node] as usize]);
        for (sum, x) in middles[coarse_of[node] as usize].iter_mut().zip(point) {
            *sum += share * x;
        }
    }
    Some(Coarse { graph: coarse, points: middles, coarse_of })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_halves_and_keeps_weight_and_centre() {
        let edges: Vec<[u32; 2]> = (1..64).map(|i| [i - 1, i]).collect();
        let graph = Graph::from_edges(vec![2; 64], &edges);
        let points: Vec<[f64; 3]> = (0..64).map(|i| [f64::from(i), 0.0, 1.0]).collect();
        let coarse = coarsened(&graph, &points, 4).expect("a path can be halved");
        assert_eq!(coarse.graph.weight, [4; 32]);
        for pair in 0..32 {
            // Ends of the path have one neighbour, all others two.
            let [first, second] = [2 * pair, 2 * pair + 1].map(|i| coarse.coarse_of[i] as usize);
            assert_eq!(first, second);
            assert_eq!(coarse.points[first], [2.0 * pair as f64 + 0.5, 0.0, 1.0]);
            assert_eq!(coarse.graph.neighbours(first).len(), if pair % 31 == 0 { 1 } else { 2 });
        }
        let last = (0..5).try_fold(coarse, |c, _| coarsened(&c.graph, &c.points, 4)).map(|c| c.graph.len());
        assert_eq!(last, None, "no node heavier than 1.5 quarters");
    }

    #[test]
    fn merged_edges_add_their_strengths() {
        // A square 0 1 2 3 with 0–1 and 2–3 merged: two edges between the pairs.
        let graph = Graph::from_edges(vec![1; 4], &[[0, 1], [1, 2], [2, 3], [3, 0]]);
        let merged = graph.contracted(&[0, 0, 1, 1], 2);
        assert_eq!(merged.edges(0).collect::<Vec<_>>(), [(1, 2)]);
        assert_eq!(merged.weight, [2, 2]);
    }
}
