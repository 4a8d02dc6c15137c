//! Which eliminations depend on which: the elimination tree, and an order that keeps its branches together.

use super::graph::Graph;

/// `order` rearranged to a postorder of its elimination tree: the same fill, with every branch in one piece,
/// so that columns of equal structure follow each other.
pub(super) fn postordered(graph: &Graph, order: &[u32]) -> Vec<u32> {
    let parents = elimination_tree(graph, order);
    let n = order.len();
    // First child and next sibling, children ascending.
    let (mut child, mut sibling, mut root) = (vec![None; n], vec![None; n], None);
    for step in (0..n).rev() {
        let head = parents[step].map_or(&mut root, |p: usize| &mut child[p]);
        sibling[step] = head.replace(step);
    }
    let mut result = Vec::with_capacity(n);
    let mut path: Vec<usize> = root.into_iter().collect();
    while let Some(&step) = path.last() {
        if let Some(inner) = child[step].take() {
            path.push(inner);
        } else {
            path.pop();
            result.push(order[step]);
            path.extend(sibling[step]);
        }
    }
    result
}

/// The parent of every elimination step: the first later step that it fills into (Liu 1990, algorithm 4.2).
fn elimination_tree(graph: &Graph, order: &[u32]) -> Vec<Option<usize>> {
    let n = order.len();
    let mut step_of = vec![0; n];
    for (step, &node) in order.iter().enumerate() {
        step_of[node as usize] = step;
    }
    let mut parents = vec![None; n];
    let mut ancestors: Vec<Option<usize>> = vec![None; n];
    for (step, &node) in order.iter().enumerate() {
        for &m in graph.neighbours(node as usize) {
            let mut below = step_of[m as usize];
            if below > step {
                continue;
            }
            while below != step {
                match ancestors[below].replace(step) {
                    Some(next) => below = next,
                    None => {
                        parents[below] = Some(step);
                        break;
                    }
                }
            }
        }
    }
    parents
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_of_a_path_eliminated_from_both_ends() {
        // 0 – 1 – 2 – 3 – 4, eliminated 0 4 1 3 2.
        let graph = Graph::from_edges(vec![1; 5], &[[0, 1], [1, 2], [2, 3], [3, 4]]);
        let order = [0, 4, 1, 3, 2];
        assert_eq!(elimination_tree(&graph, &order), [Some(2), Some(3), Some(4), Some(4), None]);
        assert_eq!(postordered(&graph, &order), [0, 1, 4, 3, 2]);
    }

    #[test]
    fn a_cycle_fills_into_a_chain() {
        let graph = Graph::from_edges(vec![1; 4], &[[0, 1], [1, 2], [2, 3], [3, 0]]);
        assert_eq!(elimination_tree(&graph, &[0, 2, 1, 3]), [Some(2), Some(2), Some(3), None]);
        assert_eq!(postordered(&graph, &[0, 2, 1, 3]), [0, 2, 1, 3]);
    }
}
