//! Above which grey level a pixel may belong to a dot: one level for each block of 8 × 8 pixels.
//!
//! The level is the mean of the surroundings plus the larger of a multiple of the noise and a part of the surroundings' own standard
//! deviation (Niblack 1986, with k = 0.25). Surroundings reach three of the largest dot radii each way, so that they hold background and
//! dots, but no far-away glare. A level too low costs time, not dots: what it joins is taken apart again.

use crate::track::GreyView;

/// Edge of a block (px).
pub(super) const BLOCK: usize = 8;

/// Share of the standard deviation of the surroundings.
const SPREAD: f64 = 0.25;

/// Sums over one block.
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
            let high = (bottom * BLOCK).min(height) - top * BLOCK;
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

    /// The level of a block, or none when no pixel of it exceeds its level.
    pub(super) fn exceeded(&self, column: usize, row: usize) -> Option<u8> {
        let at = row * self.columns + column;
        (self.largest[at] > self.level[at]).then(|| self.level[at])
    }

    /// The level at a pixel.
    pub(super) fn at(&self, x: usize, y: usize) -> u8 {
        self.level[(y / BLOCK) * self.columns + x / BLOCK]
    }
}

fn sums(view: &GreyView<'_>, columns: usize, rows: usize) -> Vec<Block> {
    let [_, height] = view.size();
    let mut blocks = vec![Block::default(); columns * rows];
    for y in 0..height {
        let line = &mut blocks[(y / BLOCK) * columns..][..columns];
        let (whole, rest) = view.row(y).as_chunks::<BLOCK>();
        for (block, pixels) in line.iter_mut().zip(whole) {
            add::<BLOCK>(block, pixels);
        }
        if let Some(last) = line.last_mut().filter(|_| !rest.is_empty()) {
            for pixel in rest {
                add::<1>(last, &[*pixel]);
            }
        }
    }
    blocks
}

fn add<const N: usize>(block: &mut Block, pixels: &[u8; N]) {
    // At most 8 pixels: the sums cannot overflow 16 and 32 bits.
    let mut sum = 0_u16;
    let mut squares = 0_u32;
    let mut largest = block.largest;
    for &p in pixels {
        sum = sum.wrapping_add(u16::from(p));
        squares = squares.wrapping_add(u32::from(u16::from(p).wrapping_mul(u16::from(p))));
        largest = largest.max(p);
    }
    block.sum += u32::from(sum);
    block.squares += squares;
    block.largest = largest;
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
