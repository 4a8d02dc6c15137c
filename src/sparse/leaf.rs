//! In which order the nodes of a small part are eliminated: the one with the fewest neighbours first.
//!
//! Exact minimum degree (Tinney & Walker 1967) on bit sets. The nodes around the part, which are eliminated
//! later, count as neighbours: a node next to the rim fills more than it seems from inside.

use super::graph::Graph;

/// An order of `nodes`, a part of `graph` whose outside neighbours are all eliminated later. `local` is as long
/// as the graph has nodes, holds `u32::MAX` everywhere, and does so again afterwards.
pub(super) fn minimum_degree(graph: &Graph, nodes: &[u32], local: &mut [u32]) -> Vec<u32> {
    let mut names = nodes.to_vec();
    for (i, &node) in nodes.iter().enumerate() {
        local[node as usize] = i as u32;
    }
    for &node in nodes {
        for &m in graph.neighbours(node as usize) {
            if local[m as usize] == u32::MAX {
                local[m as usize] = names.len() as u32;
                names.push(m);
            }
        }
    }
    let words = names.len().div_ceil(64);
    let mut sets = vec![0_u64; nodes.len() * words];
    for (i, &node) in nodes.iter().enumerate() {
        for &m in graph.neighbours(node as usize) {
            let bit = local[m as usize] as usize;
            sets[i * words + bit / 64] |= 1 << (bit % 64);
        }
    }
    for &node in &names {
        local[node as usize] = u32::MAX;
    }
    eliminate(&mut sets, nodes.len(), words).into_iter().map(|i| nodes[i]).collect()
}

/// Eliminates all `count` nodes; `sets` holds the neighbours of each in `words` words.
fn eliminate(sets: &mut [u64], count: usize, words: usize) -> Vec<usize> {
    let degree_of = |set: &[u64]| set.iter().map(|w| w.count_ones()).sum::<u32>();
    let mut degrees: Vec<Option<u32>> = sets.chunks_exact(words.max(1)).map(|s| Some(degree_of(s))).collect();
    degrees.resize(count, Some(0));
    let mut order = Vec::with_capacity(count);
    while let Some((_, node)) = degrees.iter().enumerate().filter_map(|(i, d)| d.map(|d| (d, i))).min() {
        order.push(node);
        degrees[node] = None;
        let set = sets[node * words..(node + 1) * words].to_vec();
        for other in (0..count).filter(|i| set.get(i / 64).is_some_and(|w| w >> (i % 64) & 1 == 1)) {
            let target = &mut sets[other * words..(other + 1) * words];
            for (t, s) in target.iter_mut().zip(&set) {
                *t |= s;
            }
            for gone in [node, other] {
                target[gone / 64] &= !(1 << (gone % 64));
            }
            degrees[other] = Some(degree_of(target));
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_loses_its_rays_first() {
        let edges: Vec<[u32; 2]> = (1..6).map(|i| [0, i]).collect();
        let graph = Graph::from_edges(vec![1; 6], &edges);
        let order = minimum_degree(&graph, &[0, 1, 2, 3, 4, 5], &mut [u32::MAX; 6]);
        assert_eq!(order[..4], [1, 2, 3, 4]);
    }

    #[test]
    fn neighbours_outside_the_part_count() {
        // 0 – 1 – 2 inside; 0 also touches 3, 4 and 5 outside: from inside 0 and 2 look alike.
        let graph = Graph::from_edges(vec![1; 6], &[[0, 1], [1, 2], [0, 3], [0, 4], [0, 5]]);
        let mut local = [u32::MAX; 6];
        assert_eq!(minimum_degree(&graph, &[0, 1, 2], &mut local), [2, 1, 0]);
        assert_eq!(local, [u32::MAX; 6]);
    }

    #[test]
    fn nodes_without_neighbours_are_kept() {
        let graph = Graph::from_edges(vec![1; 2], &[]);
        assert_eq!(minimum_degree(&graph, &[1, 0], &mut [u32::MAX; 2]), [1, 0]);
    }
}
