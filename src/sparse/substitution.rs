//! Forward and back substitution: a factor and right-hand sides → solutions.
//!
//! The factor is read once each way for all columns; what is read is what it costs, where columns are few. So branches of the
//! elimination tree are taken side by side, not columns, and unknowns lie row by row, which spares the dense kernels to pack the factor.

use super::branches::{Branches, Part};
use super::zeros::zeros;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::ops::Range;

/// A factor `L`, and the unknown that each step of its elimination stands for.
pub(super) struct Substitution<'a> {
    pub(super) factor: SupernodalLltRef<'a, u32, f64>,
    pub(super) order: &'a [u32],
    pub(super) parts: &'a Branches,
}

/// Columns that are written in one pass: the numbers of a line of the cache.
const LINE: usize = 8;

/// Unknowns of all parts, row-major: of each branch with its tail, and of the trunk.
struct Solved {
    of_branches: Vec<Vec<f64>>,
    of_trunk: Vec<f64>,
}

impl Substitution<'_> {
    /// Solves `L Lᵀ X = B` in place for `columns` right-hand sides, one after the other (column-major).
    pub(super) fn solve(&self, rhs: &mut [f64], columns: usize) {
        let n = self.order.len();
        let solved = self.solved(columns, &|unknown, row| {
            row.iter_mut().zip(rhs.chunks_exact(n)).for_each(|(value, column)| *value = column[unknown]);
        });
        rhs.par_chunks_mut(n * LINE).enumerate().for_each(|(chunk, some)| {
            self.for_each_row(&solved, columns, &mut |unknown, row| {
                let columns = some.chunks_exact_mut(n).zip(&row[chunk * LINE..]);
                columns.for_each(|(column, value)| column[unknown] = *value);
            });
        });
    }

    /// As [`Substitution::solve`], right-hand sides given as numbers on some unknowns; unknown `u` of a column goes to `place[u]` of its
    /// solution.
    pub(super) fn solve_loads(&self, loads: &[&[(u32, f64)]], place: &[u32], solutions: &mut [Vec<f64>]) {
        let columns = loads.len();
        let mut first = vec![0_usize; self.order.len() + 1];
        loads.iter().copied().flatten().for_each(|&(unknown, _)| first[unknown as usize + 1] += 1);
        (1..first.len()).for_each(|i| first[i] += first[i - 1]);
        let mut by_unknown = vec![(0_u32, 0.0); first[self.order.len()]];
        let mut next = first.clone();
        for (load, column) in loads.iter().zip(0..) {
            for &(unknown, value) in *load {
                let at = &mut next[unknown as usize];
                by_unknown[*at] = (column, value);
                *at += 1;
            }
        }
        let solved = self.solved(columns, &|unknown, row| {
            let own = &by_unknown[first[unknown]..first[unknown + 1]];
            own.iter().for_each(|&(column, value)| row[column as usize] += value);
        });
        solutions.par_chunks_mut(LINE).enumerate().for_each(|(chunk, some)| {
            self.for_each_row(&solved, columns, &mut |unknown, row| {
                let at = place[unknown] as usize;
                some.iter_mut().zip(&row[chunk * LINE..]).for_each(|(x, value)| x[at] = *value);
            });
        });
    }

    /// As [`Substitution::solve`], right-hand sides side by side (row-major): those in blocks of columns.
    pub(super) fn solve_rows(&self, rhs: &mut [f64], columns: usize, blocks: &[Range<usize>]) {
        let part = |row: usize, block: &Range<usize>| row * columns + block.start..row * columns + block.end;
        // Two at a time: one works on its branches while the other is on its trunk.
        for blocks in blocks.chunks(2) {
            let known = &*rhs;
            let solved = |block: &Range<usize>| {
                self.solved(block.len(), &|unknown, row| row.copy_from_slice(&known[part(unknown, block)]))
            };
            let solved: Vec<Solved> = blocks.par_iter().map(solved).collect();
            for (block, solved) in blocks.iter().zip(&solved) {
                self.for_each_row(solved, block.len(), &mut |unknown, row| {
                    rhs[part(unknown, block)].copy_from_slice(row);
                });
            }
        }
    }

    /// Solves for right-hand sides of which `fill` writes the row of an unknown, all zeros before.
    fn solved(&self, columns: usize, fill: &(impl Fn(usize, &mut [f64]) + Sync)) -> Solved {
        let Branches { branches, trunk } = self.parts;
        let gathered = |part: &Part| {
            let mut x = zeros((part.rows.len() + part.tail.len()) * columns);
            let rows = part.rows.iter().zip(x.chunks_exact_mut(columns));
            rows.for_each(|(&step, row)| fill(self.order[step] as usize, row));
            x
        };
        let forward = |branch: &Part| {
            let mut x = gathered(branch);
            self.forward(branch, &mut x, columns);
            x
        };
        let mut of_branches: Vec<Vec<f64>> = branches.par_iter().map(forward).collect();
        let mut of_trunk = gathered(trunk);
        for (branch, x) in branches.iter().zip(&of_branches) {
            let tail = x[branch.rows.len() * columns..].chunks_exact(columns);
            for (&row, change) in branch.tail.iter().zip(tail) {
                let row = &mut of_trunk[row * columns..][..columns];
                row.iter_mut().zip(change).for_each(|(value, change)| *value += change);
            }
        }
        self.forward(trunk, &mut of_trunk, columns);
        self.backward(trunk, &mut of_trunk, columns);
        branches.par_iter().zip(&mut of_branches).for_each(|(branch, x)| {
            let tail = x[branch.rows.len() * columns..].chunks_exact_mut(columns);
            for (&row, values) in branch.tail.iter().zip(tail) {
                values.copy_from_slice(&of_trunk[row * columns..][..columns]);
            }
            self.backward(branch, x, columns);
        });
        Solved { of_branches, of_trunk }
    }

    /// Gives every unknown's row.
    fn for_each_row(&self, solved: &Solved, columns: usize, give: &mut impl FnMut(usize, &[f64])) {
        let Branches { branches, trunk } = self.parts;
        for (part, x) in branches.iter().zip(&solved.of_branches).chain([(trunk, &solved.of_trunk)]) {
            let rows = part.rows.iter().zip(x.chunks_exact(columns));
            rows.for_each(|(&step, row)| give(self.order[step] as usize, row));
        }
    }

    /// `L X = B` on a part; what it takes off the rows after its own is left there.
    fn forward(&self, part: &Part, x: &mut [f64], columns: usize) {
        let mut change = Vec::new();
        for member in &part.supernodes {
            let size = member.own.len();
            let (square, rest) = self.factor.supernode(member.supernode).val().split_at_row(size);
            let below = part.below(member);
            let own = &mut x[member.own.start * columns..][..size * columns];
            // A load on some nodes leaves most of the tree at rest.
            if own.iter().all(|&value| value == 0.0) {
                continue;
            }
            let mut own = MatMut::from_row_major_slice_mut(own, size, columns);
            solve_lower_triangular_in_place(square, own.as_mut(), Par::Seq);
            change.resize(below.len() * columns, 0.0);
            let product = MatMut::from_row_major_slice_mut(&mut change, below.len(), columns);
            matmul(product, Accum::Replace, rest, own.as_ref(), 1.0, Par::Seq);
            for (&row, change) in below.iter().zip(change.chunks_exact(columns)) {
                let row = &mut x[row as usize * columns..][..columns];
                row.iter_mut().zip(change).for_each(|(value, change)| *value -= change);
            }
        }
    }

    /// `Lᵀ X = B` on a part whose later rows are solved.
    fn backward(&self, part: &Part, x: &mut [f64], columns: usize) {
        let mut later = Vec::new();
        for member in part.supernodes.iter().rev() {
            let size = member.own.len();
            let (square, rest) = self.factor.supernode(member.supernode).val().split_at_row(size);
            let below = part.below(member);
            later.clear();
            below.iter().for_each(|&row| later.extend_from_slice(&x[row as usize * columns..][..columns]));
            let own = &mut x[member.own.start * columns..][..size * columns];
            let mut own = MatMut::from_row_major_slice_mut(own, size, columns);
            let later = MatRef::from_row_major_slice(&later, below.len(), columns);
            matmul(own.as_mut(), Accum::Add, rest.transpose(), later, -1.0, Par::Seq);
            solve_upper_triangular_in_place(square.transpose(), own, Par::Seq);
        }
    }
}
