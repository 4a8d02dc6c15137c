//! Where along a straight line is the stage after a time, and how fast? Closed forms, no integration.
//!
//! Distance s in nm along the path, speed v in nm/s, acceleration a in nm/s², time t in s from the profile's
//! beginning. A trapezoid over length L with top speed V:
//!
//! * V = min(asked, √(a·L)) (with the root, there is no cruise: the triangle)
//! * up to V/a: s = a·t²/2; cruise over L − V²/a; down: s = L − a·(T − t)²/2, T = V/a + L/V
//!
//! A stop from (s₀, v₀) ends at s₀ + v₀²/2a after v₀/a. Verified in `tests/motion.rs`.
//!
//! Why f64 although small controllers compute it in software: about twenty operations a position, and the
//! same bits on every machine, which a simulator needs. Why its own root: `core` has none for f64.

use crate::message::{AXES, AxisLimits};

/// Square root, rounded down at 2⁻²⁰; 0 for what is negative. For arguments below 2⁸⁸.
pub(crate) fn square_root(x: f64) -> f64 {
    const SCALE: f64 = (1_u64 << 20) as f64;
    ((x * SCALE * SCALE) as u128).isqrt() as f64 / SCALE
}

/// Nearest whole number, halves away from zero.
pub(crate) fn round(x: f64) -> i64 {
    (x + if x < 0.0 { -0.5 } else { 0.5 }) as i64
}

/// Speed along the path as a function of time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Profile {
    top: f64,
    acceleration: f64,
    /// When acceleration, cruise and deceleration end, s.
    ends: [f64; 3],
    /// Where the profile begins and ends, nm.
    from: f64,
    to: f64,
}

impl Profile {
    /// From rest to rest over `length`.
    pub(crate) fn trapezoid(length: f64, speed: f64, acceleration: f64) -> Self {
        let top = speed.min(square_root(acceleration * length));
        let ramp = top / acceleration;
        let cruise = (length / top - ramp).max(0.0);
        Self { top, acceleration, ends: [ramp, ramp + cruise, 2.0 * ramp + cruise], from: 0.0, to: length }
    }

    /// From a speed to rest.
    pub(crate) fn stop(from: f64, speed: f64, deceleration: f64) -> Self {
        let to = from + speed * speed / (2.0 * deceleration);
        let end = speed / deceleration;
        Self { top: speed, acceleration: deceleration, ends: [0.0, 0.0, end], from, to }
    }

    pub(crate) fn acceleration(&self) -> f64 {
        self.acceleration
    }

    /// Duration, s.
    pub(crate) fn duration(&self) -> f64 {
        self.ends[2]
    }

    /// Distance and speed at a time.
    pub(crate) fn at(&self, time: f64) -> (f64, f64) {
        let [up, cruise, end] = self.ends;
        let a = self.acceleration;
        if time >= end {
            (self.to, 0.0)
        } else if time >= cruise {
            let left = end - time;
            (self.to - a * left * left / 2.0, a * left)
        } else if time >= up {
            (self.from + a * up * up / 2.0 + self.top * (time - up), self.top)
        } else {
            (self.from + a * time * time / 2.0, a * time)
        }
    }
}

/// A straight line between two positions in steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    from: [i32; AXES],
    steps: [f64; AXES],
    nm: [f64; AXES],
    length: f64,
}

impl Line {
    /// `None` when both ends are the same step.
    pub(crate) fn between(limits: &[AxisLimits; AXES], from: [i32; AXES], to: [i32; AXES]) -> Option<Self> {
        let steps = [0, 1].map(|axis| f64::from(to[axis]) - f64::from(from[axis]));
        let nm = [0, 1].map(|axis| steps[axis] * limits[axis].step_nm());
        // Along one axis the length is exact, so that a speed at that axis's limit is not refused.
        let length = match nm {
            [x, 0.0] => x.abs(),
            [0.0, y] => y.abs(),
            [x, y] => square_root(x * x + y * y),
        };
        (from != to).then_some(Self { from, steps, nm, length })
    }

    /// Length, nm.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// The axis's part of a speed or acceleration along the path, with its direction.
    pub(crate) fn part(&self, axis: usize, along: f64) -> f64 {
        along * self.nm[axis] / self.length
    }

    /// Position in steps after a distance.
    pub(crate) fn at(&self, distance: f64) -> [i32; AXES] {
        [0, 1].map(|axis| {
            let gone = round(self.steps[axis] * (distance / self.length));
            (i64::from(self.from[axis]) + gone) as i32
        })
    }
}
