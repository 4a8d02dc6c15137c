//! A camera's scale that differs over the picture: what a lens or a slant leaves that calibration missed.
//!
//! No entry of the catalogue says so, but several can stand in for it, a turned camera first of all. So it is looked for with
//! them, and what is explained best with it is called unexplained.
//!
//! Across the picture a displacement is shown `1 + s + a x/L + b y/L + c (r/L)²` times as large as it is, from the middle of all markers
//! with `L` = [`HALF_PICTURE_M`]: the first terms of a slant (Hartley and Zisserman 2004, §8) and of a lens (Brown 1966).

use super::dual::{Dual, gradient};
use super::effects::Effects;
use super::knob::Knob;
use super::model::Model;
use super::refit::Fitted;
use super::track::Frame;
use crate::geometry::Vec3;
use nalgebra::DMatrix;

/// What the scale changes in proportion to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unevenness {
    Evenly,
    AlongX,
    AlongY,
    Radially,
}

/// Number of these.
pub(super) const KINDS: usize = 4;

/// Distance from the middle (m) at which each is 1.
const HALF_PICTURE_M: f64 = 0.05;

/// All knobs, neutral.
pub(super) const KNOBS: [(Knob, f64); KINDS] = [
    (Knob::Uneven(Unevenness::Evenly), 0.0),
    (Knob::Uneven(Unevenness::AlongX), 0.0),
    (Knob::Uneven(Unevenness::AlongY), 0.0),
    (Knob::Uneven(Unevenness::Radially), 0.0),
];

/// How the scale of a reading differs over the picture.
pub(super) fn said(model: &Model<'_>, fitted: &Fitted) -> Option<String> {
    let of = |knob: Knob| {
        let index = fitted.acting.knobs.iter().position(|k| *k == knob)?;
        Some(100.0 * fitted.at[model.base() + index])
    };
    let [_, x, y, radially] = KNOBS.map(|(knob, _)| of(knob));
    Some(format!(
        "from the middle of the markers to {:.0} mm off it the scale across the picture changes by {:+.1} % along x, {:+.1} % along y \
         and {:+.1} % in all directions: calibrate the camera's lens and frame again",
        1e3 * HALF_PICTURE_M,
        x?,
        y?,
        radially?
    ))
}

/// Where markers are in the picture.
pub(super) struct Picture {
    /// For each marker, what the scale has there for each kind of unevenness.
    shapes: Vec<[f64; KINDS]>,
}

impl Picture {
    /// Of markers that rest here (m).
    pub(super) fn of(rest: impl Iterator<Item = Vec3> + Clone) -> Self {
        let middle = rest.clone().sum::<Vec3>() / rest.clone().count().max(1) as f64;
        let shape = |at: Vec3| {
            let [x, y] = [0, 1].map(|axis| (at[axis] - middle[axis]) / HALF_PICTURE_M);
            [1.0, x, y, x * x + y * y]
        };
        Self { shapes: rest.map(shape).collect() }
    }

    /// Scales what a frame shows (columns `[J | value | …]`, three rows a marker) across the picture.
    pub(super) fn scale(&self, frame: &Frame, effects: &Effects, fitted: usize, out: &mut DMatrix<f64>) {
        if !effects.scale_uneven() {
            return;
        }
        for (n, (marker, _)) in frame.seen.iter().enumerate() {
            let shape = self.shapes[*marker];
            let more: Dual = (0..KINDS).map(|k| effects.uneven[k] * shape[k]).sum();
            let slope = gradient(&more, fitted);
            for row in 3 * n..3 * n + 2 {
                let value = out[(row, fitted)];
                for j in 0..fitted {
                    out[(row, j)] = out[(row, j)] * (1.0 + more.re) + value * slope[j];
                }
                out[(row, fitted)] *= 1.0 + more.re;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::dual::variable;
    use super::*;

    /// A marker 50 mm to the right of the middle, by 1 % a half picture along x and 2 % radially: 3 % more across, its depth as it is.
    #[test]
    fn the_scale_grows_over_the_picture() {
        let rest = [Vec3::new(0.1, 0.0, 0.02), Vec3::new(0.0, 0.0, 0.02)];
        let picture = Picture::of(rest.iter().copied());
        let mut effects = Effects::neutral(0);
        effects.uneven[Unevenness::AlongX as usize] = variable(0.01, 0);
        effects.uneven[Unevenness::Radially as usize] = variable(0.02, 1);
        let frame = Frame { time_s: 0.0, seen: vec![(0, Vec3::zeros())] };
        let mut shown =
            DMatrix::from_row_slice(3, 4, &[0.0, 1.0, 2.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 4.0, 0.0]);
        picture.scale(&frame, &effects, 2, &mut shown);
        let expected = [2.0, 1.03 + 2.0, 2.0 * 1.03, 0.0, -1.0, -1.0, -1.03, 0.0, 0.0, 0.0, 4.0, 0.0];
        for (got, expected) in shown.transpose().iter().zip(expected) {
            assert!((got - expected).abs() < 1e-12, "{shown}");
        }
    }
}
