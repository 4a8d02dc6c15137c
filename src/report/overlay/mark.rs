//! What is drawn round a dot: a ring that leaves its rim free, in a colour and a shape that say what is known of it.
//!
//! Why shapes too: red and green look the same to one man in twelve.

use image::{Rgb, RgbImage};
use std::f64::consts::TAU;

/// What is known of a dot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A green ring: it is certain.
    Certain,
    /// A yellow ring in dashes: something is there, but not for certain what.
    Uncertain,
    /// A red ring with four ticks: it should be there and is not, or is not fit for use.
    Lost,
    /// A blue square: it is there and is none of those that were known.
    New,
}

/// A dot to be marked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkedDot {
    /// Its number, written beside it where there is one.
    pub number: Option<u32>,
    /// Centre (px), from the centre of the upper left pixel.
    pub centre_px: [f64; 2],
    /// Radius (px).
    pub radius_px: f64,
    /// What is known of it.
    pub mark: Mark,
}

/// The ring leaves the dot's rim free.
const CLEAR: f64 = 1.35;
/// Dashes of a ring, and how much of each is drawn.
const DASHES: (f64, f64) = (6.0, 0.6);
/// Ticks reach so much farther than their ring (shares of its radius).
const TICK: f64 = 0.5;

impl Mark {
    pub(super) fn colour(self) -> Rgb<u8> {
        match self {
            Self::Certain => Rgb([60, 220, 90]),
            Self::Uncertain => Rgb([250, 200, 40]),
            Self::Lost => Rgb([235, 60, 50]),
            Self::New => Rgb([90, 170, 255]),
        }
    }

    /// Whether a point is drawn, seen from the centre of a ring of `radius` with a pen of `width`.
    fn covers(self, [dx, dy]: [f64; 2], radius: f64, width: f64) -> bool {
        let away = dx.hypot(dy);
        let on_ring = (away - radius).abs() <= 0.5 * width;
        match self {
            Self::Certain => on_ring,
            Self::Uncertain => on_ring && (dy.atan2(dx) / TAU * DASHES.0).rem_euclid(1.0) < DASHES.1,
            Self::Lost => {
                let on_diagonal = (dx.abs() - dy.abs()).abs() <= 0.8 * width;
                on_ring || (on_diagonal && away > radius && away <= (1.0 + TICK) * radius)
            }
            Self::New => (dx.abs().max(dy.abs()) - radius).abs() <= 0.5 * width,
        }
    }

    /// Draws itself round a place of the sheet, within a part of it (corner and size).
    pub(super) fn draw(
        self,
        sheet: &mut RgbImage,
        [corner, size]: [[u32; 2]; 2],
        centre: [f64; 2],
        radius: f64,
        width: f64,
    ) {
        let reach = (1.0 + TICK) * radius + width;
        let range = |axis: usize| {
            let end = f64::from(size[axis]);
            let from = (centre[axis] - reach).floor().clamp(0.0, end) as u32;
            from..(centre[axis] + reach + 1.0).ceil().clamp(0.0, end) as u32
        };
        for y in range(1) {
            for x in range(0) {
                if self.covers([f64::from(x) - centre[0], f64::from(y) - centre[1]], radius, width) {
                    sheet.put_pixel(corner[0] + x, corner[1] + y, self.colour());
                }
            }
        }
    }
}

impl MarkedDot {
    /// Centre and radius of its ring in a picture that is drawn `scale` times as large.
    pub(super) fn ring(&self, scale: u32) -> ([f64; 2], f64) {
        let scale = f64::from(scale);
        let centre = self.centre_px.map(|c| (c + 0.5) * scale - 0.5);
        (centre, (self.radius_px * CLEAR + 1.0) * scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_differ_in_shape_leave_their_dot_free_and_stay_in_their_part() {
        let part = [[20, 10], [40, 30]];
        let drawn = |mark: Mark, centre: [f64; 2]| {
            let mut sheet = RgbImage::new(80, 60);
            mark.draw(&mut sheet, part, centre, 8.0, 1.0);
            let pixels: Vec<[u32; 2]> = sheet
                .enumerate_pixels()
                .filter(|(.., p)| **p == mark.colour())
                .map(|(x, y, _)| [x, y])
                .collect();
            pixels
        };
        let marks = [Mark::Certain, Mark::Uncertain, Mark::Lost, Mark::New];
        let counts = marks.map(|mark| {
            let pixels = drawn(mark, [20.0, 15.0]);
            for [x, y] in &pixels {
                let away = (f64::from(*x) - 40.0).hypot(f64::from(*y) - 25.0);
                assert!(away > 7.0, "{mark:?} lies on the dot at {x}, {y}");
            }
            let outside = |[x, y]: &[u32; 2]| !(20..60).contains(x) || !(10..40).contains(y);
            for corner in [[0.0, 0.0], [39.0, 29.0], [-3.0, 15.0], [900.0, -900.0]] {
                assert!(!drawn(mark, corner).iter().any(outside), "{mark:?}");
            }
            pixels.len()
        });
        let [certain, uncertain, lost, new] = counts;
        assert!(f64::from(uncertain as u32) < 0.75 * f64::from(certain as u32), "{counts:?}");
        assert!(lost >= certain + 8 && new == 64, "{counts:?}");
    }
}
