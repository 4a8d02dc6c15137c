//! Above which grey level a pixel may belong to a dot: one level for each block of 8 × 8 pixels.
//!
//! The level is the mean of the surroundings plus the larger of a multiple of the noise and a part of the surroundings' own standard
//! deviation (Niblack 1986, with k = 0.25). Surroundings reach three of the largest dot radii each way, so that they hold background and
//! dots, but no far-away glare. A level too low costs time, not dots: what it joins is taken apart again.

use crate::track::GreyView;

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
        let integral = Integral::of(&blocks, columns, rows);
        let reach = (3.0 * radius / BLOCK as f64).ceil() as usize;
        let mut level = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            let (top, bottom) = (j.saturating_sub(reach), (j + reach + 1).min(rows));
            let high = ((bottom * BLOCK).min(height) - top * BLOCK).div_ceil(EVERY);
            for i in 0..columns {
                let (left, right) = (i.saturating_sub(reach), (i + reach + 1).min(columns));
                let wide = (right * BLOCK).min(width) - left * BLOCK;
                let (sum, squares) = integral.over([left, right], [top, bottom]);
                let mean = sum / (wide * high) as f64;
                let spread = (squares / (wide * high) as f64 - mean * mean).max(0.0).sqrt();
                let margin = (0.5 * least_contrast * noise).max(SPREAD * spread);
                level.push((mean + margin).min(254.0) as u8);
            }
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
    let [width, height] = view.size();
    let mut blocks = vec![Block::default(); columns * rows];
    // Down the columns first: at most 8 pixels, which overflow neither 16 nor 32 bits. Every other row says enough of mean and spread.
    let (mut sum, mut squares, mut largest) = (vec![0_u16; width], vec![0_u32; width], vec![0_u8; width]);
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
        let across = sum.chunks(BLOCK).zip(squares.chunks(BLOCK)).zip(largest.chunks(BLOCK));
        for (block, ((sum, squares), largest)) in line.iter_mut().zip(across) {
            *block = Block {
                sum: sum.iter().map(|&s| u32::from(s)).sum(),
                squares: squares.iter().sum(),
                largest: largest.iter().fold(0, |most, &p| most.max(p)),
            };
        }
    }
    blocks
}

/// Sums over all blocks above and to the left.
struct Integral {
    stride: usize,
    sums: Vec<(f64, f64)>,
}

impl Integral {
    fn of(blocks: &[Block], columns: usize, rows: usize) -> Self {
        let stride = columns + 1;
        let mut sums = vec![(0.0, 0.0); stride * (rows + 1)];
        for j in 0..rows {
            let mut line = (0.0, 0.0);
            for i in 0..columns {
                let block = blocks[j * columns + i];
                line.0 += f64::from(block.sum);
                line.1 += f64::from(block.squares);
                let above = sums[j * stride + i + 1];
                sums[(j + 1) * stride + i + 1] = (above.0 + line.0, above.1 + line.1);
            }
        }
        Self { stride, sums }
    }

    fn over(&self, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) -> (f64, f64) {
        let at = |i: usize, j: usize| self.sums[j * self.stride + i];
        let (a, b, c, d) = (at(left, top), at(right, top), at(left, bottom), at(right, bottom));
        (d.0 - b.0 - c.0 + a.0, d.1 - b.1 - c.1 + a.1)
    }
}
