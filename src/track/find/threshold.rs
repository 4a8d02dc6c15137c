//! Above which grey level a pixel may belong to a dot: one level for each block of 8 × 8 pixels.
//!
//! The level is the mean of the surroundings plus the larger of a multiple of the noise and a part of the surroundings' own standard
//! deviation (Niblack 1986, with k = 0.25). Surroundings reach three of the largest dot radii each way, so that they hold background and
//! dots, but no far-away glare. A level too low costs time, not dots: what it joins is taken apart again.

use crate::track::GreyView;
use std::ops::Range;

/// Edge of a block (px).
pub(super) const BLOCK: usize = 8;

/// Rows that mean and spread are taken from: each of so many.
const EVERY: usize = 2;

/// Share of the standard deviation of the surroundings.
const SPREAD: f64 = 0.25;

/// Sums over every other row of a block, and the largest level of all of it.
#[derive(Clone, Copy, Default)]
struct Block {
    sum: u32,
    squares: u32,
    largest: u8,
}

/// A level for each block, and the largest grey level in it.
pub(super) struct Levels {
    columns: usize,
    level: Vec<u8>,
    largest: Vec<u8>,
}

impl Levels {
    /// Levels for dots of up to `radius` px on a background with noise of standard deviation `noise`.
    pub(super) fn of(view: &GreyView<'_>, radius: f64, noise: f64, least_contrast: f64) -> Self {
        let [width, height] = view.size();
        let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let blocks = sums(view, columns, rows);
        let reach = (3.0 * radius / BLOCK as f64).ceil() as usize;
        let least = 0.5 * least_contrast * noise;
        let mut level = Vec::with_capacity(columns * rows);
        let mut band = Band::new(columns);
        for (j, line) in blocks.chunks_exact(columns).enumerate() {
            let (top, bottom) = (j.saturating_sub(reach), (j + reach + 1).min(rows));
            let high = ((bottom * BLOCK).min(height) - top * BLOCK).div_ceil(EVERY);
            band.cover(&blocks, top..bottom);
            level.extend(line.iter().enumerate().map(|(i, block)| {
                let (left, right) = (i.saturating_sub(reach), (i + reach + 1).min(columns));
                let count = (((right * BLOCK).min(width) - left * BLOCK) * high) as f64;
                let (sum, squares) = band.over(left, right);
                let mean = sum / count;
                // What is not above the least level need not know the level.
                if f64::from(block.largest) <= mean + least {
                    return (mean + least).min(254.0) as u8;
                }
                let spread = (squares / count - mean * mean).max(0.0).sqrt();
                (mean + least.max(SPREAD * spread)).min(254.0) as u8
            }));
        }
        Self { columns, level, largest: blocks.iter().map(|b| b.largest).collect() }
    }

    /// Columns and levels of the blocks of a row that have a pixel above their level.
    pub(super) fn exceeded(&self, row: usize) -> impl Iterator<Item = (usize, u8)> {
        let blocks = row * self.columns..(row + 1) * self.columns;
        let both = self.largest[blocks.clone()].iter().zip(&self.level[blocks]).enumerate();
        both.filter(|(_, (largest, level))| largest > level).map(|(column, (_, level))| (column, *level))
    }

    /// The level at a pixel.
    pub(super) fn at(&self, x: usize, y: usize) -> u8 {
        self.level[(y / BLOCK) * self.columns + x / BLOCK]
    }
}

fn sums(view: &GreyView<'_>, columns: usize, rows: usize) -> Vec<Block> {
    let [_, height] = view.size();
    let mut blocks = vec![Block::default(); columns * rows];
    // Down the columns first: at most 8 pixels, which overflow neither 16 nor 32 bits. Every other row says enough of mean and spread.
    let wide = columns * BLOCK;
    let (mut sum, mut squares, mut largest) = (vec![0_u16; wide], vec![0_u32; wide], vec![0_u8; wide]);
    for (row, line) in blocks.chunks_exact_mut(columns).enumerate() {
        sum.fill(0);
        squares.fill(0);
        largest.fill(0);
        for y in row * BLOCK..((row + 1) * BLOCK).min(height) {
            let pixels = view.row(y);
            for (largest, &p) in largest.iter_mut().zip(pixels) {
                *largest = (*largest).max(p);
            }
            if y % EVERY == 0 {
                for ((sum, squares), &p) in sum.iter_mut().zip(&mut squares).zip(pixels) {
                    *sum = sum.wrapping_add(u16::from(p));
                    *squares = squares.wrapping_add(u32::from(u16::from(p).wrapping_mul(u16::from(p))));
                }
            }
        }
        let across = sum.as_chunks::<BLOCK>().0.iter().zip(squares.as_chunks::<BLOCK>().0);
        for ((block, (sum, squares)), largest) in
            line.iter_mut().zip(across).zip(largest.as_chunks::<BLOCK>().0)
        {
            *block = Block {
                sum: sum.iter().fold(0, |all, &s| all.wrapping_add(u32::from(s))),
                squares: squares.iter().fold(0, |all, &s| all.wrapping_add(s)),
                largest: largest.iter().fold(0, |most, &p| most.max(p)),
            };
        }
    }
    blocks
}

/// Sums over a band of rows of blocks, which moves down the picture.
struct Band {
    rows: Range<usize>,
    /// Of each column: sum and squares.
    columns: Vec<(f64, f64)>,
    /// Of all columns to the left.
    before: Vec<(f64, f64)>,
}

impl Band {
    fn new(columns: usize) -> Self {
        Self { rows: 0..0, columns: vec![(0.0, 0.0); columns], before: vec![(0.0, 0.0); columns + 1] }
    }

    /// Moves on to these rows, none of which begins or ends above those before. Whole numbers: nothing is lost by taking away.
    fn cover(&mut self, blocks: &[Block], rows: Range<usize>) {
        let wide = self.columns.len();
        let entering = (self.rows.end..rows.end).map(|row| (row, 1.0));
        let leaving = (self.rows.start..rows.start).map(|row| (row, -1.0));
        for (row, sign) in entering.chain(leaving) {
            for (column, block) in self.columns.iter_mut().zip(&blocks[row * wide..(row + 1) * wide]) {
                column.0 += sign * f64::from(block.sum);
                column.1 += sign * f64::from(block.squares);
            }
        }
        self.rows = rows;
        let mut sum = (0.0, 0.0);
        for (before, column) in self.before[1..].iter_mut().zip(&self.columns) {
            sum = (sum.0 + column.0, sum.1 + column.1);
            *before = sum;
        }
    }

    /// Sum and squares over the columns `left..right`.
    fn over(&self, left: usize, right: usize) -> (f64, f64) {
        let (a, b) = (self.before[left], self.before[right]);
        (b.0 - a.0, b.1 - a.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;

    /// Blocks that have something above their level are those that sums over every pixel of the band's rows say, with that level.
    #[test]
    fn levels_are_those_of_sums_pixel_by_pixel() {
        let (width, height, radius) = (141_usize, 93_usize, 5.0);
        let mut random = Noise::seeded(4);
        let pixels: Vec<u8> = (0..width * height)
            .map(|i| {
                let slope = 0.7 * (i % width) as f64;
                let dot = if (i / width) % 23 < 6 && (i % width) % 19 < 6 { 90.0 } else { 0.0 };
                (30.0 + slope + dot + 4.0 * random.normal()).clamp(0.0, 255.0) as u8
            })
            .collect();
        let view = GreyView::new(width, height, width, &pixels).expect("a picture");
        let levels = Levels::of(&view, radius, 2.5, 6.0);
        let reach = (3.0 * radius / BLOCK as f64).ceil() as usize;
        let (mut exceeded, mut by_spread) = (0, 0);
        for j in 0..height.div_ceil(BLOCK) {
            let found: Vec<(usize, u8)> = levels.exceeded(j).collect();
            for i in 0..width.div_ceil(BLOCK) {
                let span = |at: usize, reach: usize, most: usize| {
                    at.saturating_sub(reach) * BLOCK..((at + reach + 1) * BLOCK).min(most)
                };
                let values: Vec<f64> = span(j, reach, height)
                    .filter(|y| y % EVERY == 0)
                    .flat_map(|y| view.row(y)[span(i, reach, width)].iter().map(|&p| f64::from(p)))
                    .collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                let spread = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
                let level = mean + (0.5 * 6.0 * 2.5_f64).max(SPREAD * spread.sqrt());
                let largest = span(j, 0, height)
                    .flat_map(|y| view.row(y)[span(i, 0, width)].iter().copied())
                    .fold(0, u8::max);
                let known = found.iter().find(|(column, _)| *column == i).map(|(_, level)| *level);
                assert_eq!(known, (largest > level as u8).then_some(level as u8), "{i} {j}: {level}");
                exceeded += usize::from(known.is_some());
                by_spread += usize::from(known.is_some() && SPREAD * spread.sqrt() > 0.5 * 6.0 * 2.5);
            }
        }
        assert!(exceeded < 216 && by_spread > 4 && by_spread + 20 < exceeded, "{exceeded} {by_spread}");
    }
}
