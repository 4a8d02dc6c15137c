//! Which pixels hang together: runs along rows, joined by union-find (He, Chao & Suzuki 2008).
//!
//! Pixels touch along edges, not corners: two dots that meet at a corner stay two.

use super::threshold::{BLOCK, Levels};
use crate::track::GreyView;

/// Pixels `from..to` of row `y`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) y: u32,
    pub(super) from: u32,
    pub(super) to: u32,
}

impl Run {
    pub(super) fn pixels<'a>(&self, view: &GreyView<'a>) -> &'a [u8] {
        &view.row(self.y as usize)[self.from as usize..self.to as usize]
    }
}

/// Runs above the levels, by row and then by column.
pub(super) fn runs_above(view: &GreyView<'_>, levels: &Levels) -> Vec<Run> {
    let [width, height] = view.size();
    let mut runs: Vec<Run> = Vec::new();
    let mut blocks: Vec<(usize, u8)> = Vec::new();
    for y in 0..height {
        if y % BLOCK == 0 {
            blocks.clear();
            blocks.extend(levels.exceeded(y / BLOCK));
        }
        let (row, first) = (view.row(y), runs.len());
        for &(column, level) in &blocks {
            let start = column * BLOCK;
            let pixels = &row[start..(start + BLOCK).min(width)];
            // A bit for each pixel above the level, from the left: runs are taken whole.
            let mut above = pixels.iter().rev().fold(0_u32, |bits, &p| (bits << 1) | u32::from(p > level));
            let mut x = start as u32;
            while above != 0 {
                let skip = above.trailing_zeros();
                let length = (above >> skip).trailing_ones();
                let from = x + skip;
                x = from + length;
                above >>= skip + length;
                match runs[first..].last_mut().filter(|last| last.to == from) {
                    Some(last) => last.to = x,
                    None => runs.push(Run { y: y as u32, from, to: x }),
                }
            }
        }
    }
    runs
}

/// The parts of runs above a higher level, in the same order.
pub(super) fn runs_higher(view: &GreyView<'_>, runs: &[Run], level: u8) -> Vec<Run> {
    let mut higher = Vec::new();
    for run in runs {
        let mut from = None;
        for (x, &p) in (run.from..).zip(run.pixels(view)) {
            match from {
                None if p > level => from = Some(x),
                Some(start) if p <= level => {
                    higher.push(Run { y: run.y, from: start, to: x });
                    from = None;
                }
                _ => {}
            }
        }
        if let Some(start) = from {
            higher.push(Run { y: run.y, from: start, to: run.to });
        }
    }
    higher
}

/// Runs grouped by the component that they belong to.
pub(super) struct Components {
    runs: Vec<Run>,
    starts: Vec<usize>,
}

impl Components {
    /// Groups runs that are ordered by row and column.
    pub(super) fn of(runs: &[Run]) -> Self {
        let mut parent: Vec<u32> = (0..runs.len() as u32).collect();
        let mut above = 0;
        for here in 0..runs.len() {
            let run = runs[here];
            while above < here && (runs[above].y + 1 < run.y || before(&runs[above], &run)) {
                above += 1;
            }
            let mut other = above;
            while other < here && runs[other].y + 1 == run.y && runs[other].from < run.to {
                join(&mut parent, other as u32, here as u32);
                other += 1;
            }
        }
        Self::grouped(runs, &mut parent)
    }

    fn grouped(runs: &[Run], parent: &mut [u32]) -> Self {
        let mut component = vec![u32::MAX; runs.len()];
        let mut sizes: Vec<usize> = Vec::new();
        let mut member = Vec::with_capacity(runs.len());
        for i in 0..runs.len() {
            let root = find(parent, i as u32) as usize;
            if component[root] == u32::MAX {
                component[root] = sizes.len() as u32;
                sizes.push(0);
            }
            sizes[component[root] as usize] += 1;
            member.push(component[root] as usize);
        }
        let mut starts = vec![0];
        for size in &sizes {
            starts.push(starts[starts.len() - 1] + size);
        }
        let mut next = starts.clone();
        let mut sorted = runs.to_vec();
        for (&run, &c) in runs.iter().zip(&member) {
            sorted[next[c]] = run;
            next[c] += 1;
        }
        Self { runs: sorted, starts }
    }

    /// The runs of each component, by row and then by column.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[Run]> {
        self.starts.windows(2).map(|w| &self.runs[w[0]..w[1]])
    }
}

/// Whether a run of the row above ends before another begins.
fn before(above: &Run, run: &Run) -> bool {
    above.y + 1 == run.y && above.to <= run.from
}

fn find(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    // The smaller root wins, so that components are numbered in the order of their first runs.
    parent[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;

    /// Runs are what lies above the levels, pixel by pixel, and no two of them touch; in pictures that no block divides.
    #[test]
    fn runs_hold_what_lies_above_the_levels() {
        let (width, height) = (77_usize, 53_usize);
        let mut random = Noise::seeded(5);
        for density in [0.3, 0.6, 0.8] {
            let pixels: Vec<u8> =
                (0..width * height).map(|_| if random.uniform() < density { 180 } else { 20 }).collect();
            let view = GreyView::new(width, height, width, &pixels).expect("a picture");
            let levels = Levels::of(&view, 4.0, 2.0, 6.0);
            let mut above = vec![false; width * height];
            let runs = runs_above(&view, &levels);
            for run in &runs {
                assert!(run.from < run.to);
                (run.from..run.to).for_each(|x| above[run.y as usize * width + x as usize] = true);
            }
            for (i, (&above, &p)) in above.iter().zip(&pixels).enumerate() {
                assert_eq!(above, p > levels.at(i % width, i / width), "{density} {i}");
            }
            for pair in runs.windows(2) {
                assert!(pair[0].y < pair[1].y || (pair[0].y == pair[1].y && pair[0].to < pair[1].from));
            }
            assert!(runs.len() > 400, "{}", runs.len());
        }
    }

    /// A flood fill, which shares nothing with runs, must find the same components.
    #[test]
    fn components_are_those_of_a_flood_fill() {
        let mut random = Noise::seeded(8);
        let (w, h) = (45_usize, 37_usize);
        for density in [0.2, 0.5, 0.6, 0.8] {
            let pixels: Vec<u8> =
                (0..w * h).map(|_| if random.uniform() < density { 200 } else { 0 }).collect();
            let view = GreyView::new(w, h, w, &pixels).expect("a picture");
            let all: Vec<Run> = (0..h as u32).map(|y| Run { y, from: 0, to: w as u32 }).collect();
            let runs = runs_higher(&view, &all, 100);
            let mut label = vec![usize::MAX; w * h];
            let mut count = 0;
            for seed in 0..w * h {
                if pixels[seed] == 0 || label[seed] != usize::MAX {
                    continue;
                }
                let mut stack = vec![seed];
                label[seed] = count;
                while let Some(at) = stack.pop() {
                    let (x, y) = (at % w, at / w);
                    let mut visit = |n: usize| {
                        if pixels[n] > 0 && label[n] == usize::MAX {
                            label[n] = count;
                            stack.push(n);
                        }
                    };
                    if x > 0 {
                        visit(at - 1);
                    }
                    if x + 1 < w {
                        visit(at + 1);
                    }
                    if y > 0 {
                        visit(at - w);
                    }
                    if y + 1 < h {
                        visit(at + w);
                    }
                }
                count += 1;
            }
            let components = Components::of(&runs);
            let mut seen = 0;
            for component in components.iter() {
                let first = label[component[0].y as usize * w + component[0].from as usize];
                for run in component {
                    for x in run.from..run.to {
                        assert_eq!(label[run.y as usize * w + x as usize], first);
                    }
                }
                seen += 1;
            }
            assert_eq!(seen, count);
        }
    }
}
