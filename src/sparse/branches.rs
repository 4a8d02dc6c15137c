//! Which parts of a factor may be applied side by side: branches of the elimination tree, and the trunk that they grow from.
//!
//! A branch is a subtree of the elimination tree, the trunk the common ancestors of all branches. No supernode of one branch has
//! anything to do with a supernode of another (Liu 1990): what a branch changes outside itself are rows of the trunk, and all of those are
//! among the rows below its topmost supernode. So each part is numbered by itself.

use std::ops::Range;

/// Branches that are made where the tree allows, some more or fewer as it forks. A fixed number, so that results do not depend on that
/// of the threads. The trunk, on which one thread works alone, grows with it.
const BRANCHES: usize = 4;

/// Branches of less than this share of all entries stay with the trunk.
const LIGHT: f64 = 0.02;

/// Columns of a factor that have the same rows below them.
#[derive(Debug, Clone)]
pub(super) struct Supernode<'a> {
    /// Its columns, as steps of the elimination.
    pub(super) columns: Range<usize>,
    /// The rows below, ascending.
    pub(super) below: &'a [u32],
}

/// All supernodes of a factor.
#[derive(Debug)]
pub(super) struct Branches {
    /// Parts that have nothing to do with each other.
    pub(super) branches: Vec<Part>,
    /// What is eliminated after them.
    pub(super) trunk: Part,
}

/// Some supernodes, and the rows that they touch, counted anew: its own, in the order of elimination, then those of the trunk.
#[derive(Debug)]
pub(super) struct Part {
    /// Which supernodes, ascending.
    pub(super) supernodes: Vec<Member>,
    /// The steps of the elimination that are its own rows.
    pub(super) rows: Vec<usize>,
    /// Where in the trunk the rows are that come after its own.
    pub(super) tail: Vec<usize>,
    below: Vec<u32>,
}

/// A supernode in its part.
#[derive(Debug)]
pub(super) struct Member {
    /// Its number in the factor.
    pub(super) supernode: usize,
    /// Its own rows.
    pub(super) own: Range<usize>,
    below: Range<usize>,
}

impl Part {
    /// The rows below a member.
    pub(super) fn below(&self, member: &Member) -> &[u32] {
        &self.below[member.below.clone()]
    }

    fn new(all: &[Supernode<'_>], chosen: &[usize], row_of: &mut [u32], tail: &[u32]) -> Self {
        let mut part = Self { supernodes: Vec::new(), rows: Vec::new(), tail: Vec::new(), below: Vec::new() };
        for &supernode in chosen {
            let first = part.rows.len();
            part.rows.extend(all[supernode].columns.clone());
            part.supernodes.push(Member { supernode, own: first..part.rows.len(), below: 0..0 });
        }
        part.tail = tail.iter().map(|&step| row_of[step as usize] as usize).collect();
        let counted = part.rows.iter().copied().chain(tail.iter().map(|&step| step as usize));
        counted.zip(0..).for_each(|(step, row)| row_of[step] = row);
        for member in &mut part.supernodes {
            let first = part.below.len();
            part.below.extend(all[member.supernode].below.iter().map(|&step| row_of[step as usize]));
            member.below = first..part.below.len();
        }
        part
    }
}

impl Branches {
    /// Parts of a factor with these supernodes, every one before its parent.
    pub(super) fn new(all: &[Supernode<'_>]) -> Self {
        let Cut { branches, trunk } = cut(all);
        let mut row_of = vec![0; all.last().map_or(0, |top| top.columns.end)];
        let trunk = Part::new(all, &trunk, &mut row_of, &[]);
        let part = |branch: &Vec<usize>| {
            let tail = branch.last().map_or(&[][..], |&top| all[top].below);
            // A branch counts the rows of its tail anew; the next wants them as the trunk has them.
            Part::new(all, branch, &mut row_of.clone(), tail)
        };
        Self { branches: branches.iter().map(part).collect(), trunk }
    }
}

/// The supernodes of each part, ascending.
#[derive(Debug, Default, PartialEq)]
struct Cut {
    branches: Vec<Vec<usize>>,
    trunk: Vec<usize>,
}

/// The heaviest branch is taken apart until none has more than its share of all entries.
fn cut(all: &[Supernode<'_>]) -> Cut {
    let mut owner = vec![0; all.last().map_or(0, |top| top.columns.end)];
    all.iter().enumerate().for_each(|(s, node)| owner[node.columns.clone()].fill(s));
    // The first row below a supernode belongs to its parent.
    let parent: Vec<Option<usize>> =
        all.iter().map(|node| node.below.first().map(|&row| owner[row as usize])).collect();
    let mut entries: Vec<f64> =
        all.iter().map(|s| (s.columns.len() * (s.columns.len() + s.below.len())) as f64).collect();
    let total: f64 = entries.iter().sum();
    let mut children = vec![Vec::new(); all.len()];
    let mut open = Vec::new();
    for (s, parent) in parent.iter().enumerate() {
        match parent {
            Some(parent) => {
                entries[*parent] += entries[s];
                children[*parent].push(s);
            }
            None => open.push(s),
        }
    }
    let heaviest =
        |open: &[usize]| (0..open.len()).max_by(|&a, &b| entries[open[a]].total_cmp(&entries[open[b]]));
    while let Some(at) = heaviest(&open).filter(|&at| entries[open[at]] * BRANCHES as f64 > total) {
        let apart = open.swap_remove(at);
        open.append(&mut children[apart]);
    }
    open.retain(|&s| entries[s] > LIGHT * total);
    open.sort_unstable();
    let mut cut = Cut { branches: vec![Vec::new(); open.len()], trunk: Vec::new() };
    let mut branch_of: Vec<Option<usize>> = vec![None; all.len()];
    open.iter().enumerate().for_each(|(branch, &top)| branch_of[top] = Some(branch));
    for s in (0..all.len()).rev() {
        branch_of[s] = branch_of[s].or(parent[s].and_then(|parent| branch_of[parent]));
    }
    for (s, branch) in branch_of.into_iter().enumerate() {
        branch.map_or(&mut cut.trunk, |branch| &mut cut.branches[branch]).push(s);
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns that a third joins, five times, under one top.
    #[test]
    fn branches_have_nothing_to_do_with_each_other() {
        let mut below: Vec<Vec<u32>> = Vec::new();
        for first in [0, 3, 6, 9, 12] {
            below.extend([vec![first + 2, 15], vec![first + 2], vec![15]]);
        }
        below.push(vec![]);
        let all: Vec<Supernode<'_>> =
            below.iter().enumerate().map(|(s, below)| Supernode { columns: s..s + 1, below }).collect();
        let parts = Branches::new(&all);
        assert_eq!(parts.trunk.rows, [15]);
        assert_eq!(parts.branches.len(), 5);
        for (branch, first) in parts.branches.iter().zip([0, 3, 6, 9, 12]) {
            assert_eq!(branch.rows, [first, first + 1, first + 2]);
            assert_eq!(branch.tail, [0]);
            let below: Vec<&[u32]> = branch.supernodes.iter().map(|member| branch.below(member)).collect();
            assert_eq!(below, [&[2, 3][..], &[2], &[3]]);
        }
    }

    /// An order by degree leaves branches in pieces.
    #[test]
    fn a_branch_need_not_be_in_one_piece() {
        let below: [&[u32]; 11] = [&[5], &[6], &[7], &[8], &[9], &[10], &[10], &[10], &[10], &[10], &[]];
        let all: Vec<Supernode<'_>> =
            below.iter().enumerate().map(|(s, below)| Supernode { columns: s..s + 1, below }).collect();
        let branches = [[0, 5], [1, 6], [2, 7], [3, 8], [4, 9]].map(Vec::from).into();
        assert_eq!(cut(&all), Cut { branches, trunk: vec![10] });
    }

    #[test]
    fn a_tree_without_forks_is_trunk_and_trees_apart_are_branches() {
        let dense = Supernode { columns: 0..7, below: &[] };
        let parts = Branches::new(&[dense]);
        assert!(parts.branches.is_empty());
        assert_eq!(parts.trunk.rows, [0, 1, 2, 3, 4, 5, 6]);
        let several: Vec<Supernode<'_>> =
            (0..5).map(|s| Supernode { columns: s..s + 1, below: &[] }).collect();
        let parts = Branches::new(&several);
        assert!(parts.trunk.rows.is_empty() && parts.branches.iter().all(|branch| branch.tail.is_empty()));
        assert_eq!(parts.branches.len(), 5);
        let apart: Vec<Supernode<'_>> =
            (0..300).map(|s| Supernode { columns: s..s + 1, below: &[] }).collect();
        assert_eq!(Branches::new(&apart).trunk.rows.len(), 300);
    }
}
