//! A camera's scale that differs over the picture: what a lens or a slant leaves that calibration missed.
//!
//! No entry of the catalogue says so, but several can stand in for it, a turned camera first of all. So it is looked for with
//! them, and what is explained best with it is called unexplained.
//!
//! Across the picture a displacement is shown `1 + s + a x/L + b y/L + c (r/L)²` times as large as it is, from the middle of all markers
//! with `L` = [`HALF_PICTURE_M`]. A slant and a lens also scale one direction more than the other, by up to three times what is here called
//! uneven (Brown 1966); a scale alike in both is as much as is needed to tell that something of their kind acts.

use super::dual::{Dual, gradient};
use super::effects::Effects;
use super::knob::Knob;
use super::model::Model;
use super::parameters::position;
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
    let [_, x, y, radially] = KNOBS.map(|(knob, _)| Some(100.0 * fitted.at[position(model, fitted, knob)?]));
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

    /// A marker 50 mm to the right of the middle and 25 mm up, by 1 % a half picture along x, 4 % along y and 2 % radially: 5.5 % more across,
    /// its depth as it is.
    #[test]
    fn the_scale_grows_over_the_picture() {
        let rest = [Vec3::new(0.1, 0.05, 0.02), Vec3::new(0.0, 0.0, 0.02)];
        let picture = Picture::of(rest.iter().copied());
        let mut effects = Effects::neutral(0);
        let set = [(Unevenness::AlongX, 0.01), (Unevenness::AlongY, 0.04), (Unevenness::Radially, 0.02)];
        for (i, (of, value)) in set.into_iter().enumerate() {
            effects.uneven[of as usize] = variable(value, i);
        }
        let frame = Frame { time_s: 0.0, seen: vec![(0, Vec3::zeros())] };
        // Columns: by the three, the value, and one to spare. The value along x has a derivative of its own.
        let seen = [[1.0, 0.0, 0.0, 2.0, 0.0], [0.0, 0.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 4.0, 0.0]];
        let mut shown = DMatrix::from_fn(3, 5, |i, j| seen[i][j]);
        picture.scale(&frame, &effects, 3, &mut shown);
        let more = 1.0 + 0.01 + 0.02 + 0.025;
        let expected = [
            [more + 2.0, 1.0, 2.5, 2.0 * more, 0.0],
            [-1.0, -0.5, -1.25, -more, 0.0],
            [0.0, 0.0, 0.0, 4.0, 0.0],
        ];
        assert!((shown - DMatrix::from_fn(3, 5, |i, j| expected[i][j])).amax() < 1e-12);
    }
}
