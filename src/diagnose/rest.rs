//! What the instruments read while nothing touches the phantom: how far their errors are from white.
//!
//! The force's error may wander in time: the variance of means over half a second is compared with that of white noise.
//! The camera may sway as a whole: the variance of all markers' common motion, likewise.

use crate::geometry::Vec3;
use crate::inverse::Evidence;
use crate::observation::Recording;

/// How far errors are from white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correlation {
    /// Factor by which the wandering of the force raises the variance of a mean.
    pub force: f64,
    /// Variance (m²) of the common motion of all markers, along each axis.
    pub sway_m2: [f64; 3],
}

/// Force rows outside pokes: time (s) and force (N).
pub(super) fn force_at_rest(recording: &Recording) -> Vec<(f64, Vec3)> {
    let wrench = &recording.wrench;
    let touched =
        |t: f64| recording.pokes.iter().any(|p| t >= p.start_s - MARGIN_S && t <= p.end_s + MARGIN_S);
    let rows = wrench.time_s.iter().zip(&wrench.force_n);
    rows.filter(|(t, _)| !touched(**t)).map(|(t, f)| (*t, Vec3::from(*f))).collect()
}

/// Rows so close to a poke (s) do not count as rest.
const MARGIN_S: f64 = 0.05;
/// Length of the means (s).
const BLOCK_S: f64 = 0.5;
/// Fewer means, or frames, than this say nothing.
const FEWEST: usize = 6;
/// Chance raises a variance of so many degrees of freedom by this many standard deviations, once in a thousand times.
const CHANCE: f64 = 3.1;

/// Measures both.
pub(super) fn correlation(recording: &Recording, evidence: &Evidence) -> Correlation {
    Correlation { force: wandering(recording, evidence.noise.force_n), sway_m2: sway(recording, evidence) }
}

/// A drift in proportion to time is not taken for wandering.
fn wandering(recording: &Recording, sd: [f64; 3]) -> f64 {
    let rows = force_at_rest(recording);
    let mut means: Vec<(f64, Vec3, f64)> = Vec::new();
    let mut block: Option<(f64, f64, Vec3, f64)> = None;
    let mut done = |(_, t, f, n): (f64, f64, Vec3, f64)| means.push((t / n, f / n, n));
    for (t, f) in rows {
        match &mut block {
            Some((start, time, force, n)) if t - *start < BLOCK_S => {
                *time += t;
                *force += f;
                *n += 1.0;
            }
            _ => {
                if let Some(full) = block.take() {
                    done(full);
                }
                block = Some((t, t, f, 1.0));
            }
        }
    }
    block.into_iter().for_each(&mut done);
    if means.len() < FEWEST {
        return 1.0;
    }
    let (mut sum, mut freedom) = (0.0, 0.0);
    for (axis, sd) in sd.into_iter().enumerate() {
        let weight: f64 = means.iter().map(|m| m.2).sum();
        let mean_t = means.iter().map(|m| m.2 * m.0).sum::<f64>() / weight;
        let mean_f = means.iter().map(|m| m.2 * m.1[axis]).sum::<f64>() / weight;
        let spread: f64 = means.iter().map(|m| m.2 * (m.0 - mean_t).powi(2)).sum();
        let along: f64 = means.iter().map(|m| m.2 * (m.0 - mean_t) * (m.1[axis] - mean_f)).sum();
        let left =
            |m: &(f64, Vec3, f64)| m.2 * (m.1[axis] - mean_f - along / spread * (m.0 - mean_t)).powi(2);
        sum += means.iter().map(left).sum::<f64>() / sd.powi(2);
        freedom += means.len() as f64 - 2.0;
    }
    beyond_chance(sum / freedom, freedom)
}

/// A ratio of variances, or 1 where chance may have made it.
fn beyond_chance(ratio: f64, freedom: f64) -> f64 {
    if ratio > 1.0 + CHANCE * (2.0 / freedom).sqrt() { ratio } else { 1.0 }
}

/// Variance of the markers' common motion between pokes, beyond what their own noise makes. Creep counts as sway: it
/// only makes the common motion weigh less.
fn sway(recording: &Recording, evidence: &Evidence) -> [f64; 3] {
    let markers = &recording.markers;
    // Sum over all markers of their displacement from rest, frame by frame, and so many markers.
    let mut frames = vec![(Vec3::zeros(), 0.0); markers.frame_time_s.len()];
    for row in &markers.rows {
        let (rest, rows) = evidence.rest[row.marker as usize];
        if rows > 0 {
            let frame = &mut frames[row.frame as usize];
            frame.0 += Vec3::from(row.position_m) - rest;
            frame.1 += 1.0;
        }
    }
    let touched =
        |t: f64| recording.pokes.iter().any(|p| t >= p.start_s - MARGIN_S && t <= p.end_s + MARGIN_S);
    let still = |t: f64| t >= recording.rest_until_s && !touched(t);
    let rest_frames =
        markers.frame_time_s.iter().filter(|t| **t < recording.rest_until_s).count().max(1) as f64;
    let rows =
        || frames.iter().zip(&markers.frame_time_s).filter(|(f, t)| f.1 > 0.0 && still(**t)).map(|(f, _)| f);
    let n = rows().count() as f64;
    if (n as usize) < FEWEST {
        return [0.0; 3];
    }
    let sd = evidence.noise.marker_m;
    std::array::from_fn(|axis| {
        let white = |f: &(Vec3, f64)| sd[axis].powi(2) * (1.0 + 1.0 / rest_frames) / f.1;
        let ratio = rows().map(|f| (f.0[axis] / f.1).powi(2) / white(f)).sum::<f64>() / n;
        let mean_white = rows().map(white).sum::<f64>() / n;
        (beyond_chance(ratio, n) - 1.0) * mean_white
    })
}
