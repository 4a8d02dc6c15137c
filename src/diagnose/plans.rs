//! Pokes that the rig could make next, and what would be recorded of them.
//!
//! At every place poked so far, no deeper than there: straight as before, shallow and deep, slow and fast, with and without a
//! long hold; and slanted, where all readings are linear in the displacement.

use super::model::Model;
use super::refit::Fitted;
use super::select::LARGE;
use super::track::{Frame, LEAST_DEPTH, Row, Timeline, Touch, Track};
use crate::geometry::{Vec3, basis_from_axis};
use crate::observation::PlannedPoke;

/// Depths over the deepest so far at a place, rates (m/s) and holds (s) that are tried.
const DEPTHS: [f64; 2] = [0.5, 1.0];
const RATES_M_S: [f64; 2] = [1e-3, 6e-3];
const HOLDS_S: [f64; 2] = [0.5, 10.0];

/// Directions are the same within this.
const SAME_DIRECTION: f64 = 1e-6;

/// How far a slanted poke leans from the surface's normal.
const SLANT: f64 = std::f64::consts::FRAC_PI_6;

/// Rest before the poke, which costs time as well (s).
const REST_S: f64 = 2.0;

/// Rows of the force sensor and frames of the camera that are predicted: each stands for some that are recorded.
const ROWS: usize = 120;
const FRAMES: usize = 24;

/// A poke that could be made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// Index of a track at the same place.
    track: usize,
    /// As it is asked for.
    pub poke: PlannedPoke,
}

impl Plan {
    /// What it takes of the bench's time (s).
    pub(super) fn bench_s(&self) -> f64 {
        self.poke.contact_s() + REST_S
    }

    /// Depth at a time since contact (m).
    fn depth_at(&self, t: f64) -> f64 {
        let PlannedPoke { rate_m_s, depth_m, .. } = self.poke;
        (t * rate_m_s).min(depth_m).min((self.poke.contact_s() - t) * rate_m_s).max(0.0)
    }
}

/// All of them; slanted ones in the plane with the normal `plane` only, if there is one.
pub(super) fn plans<'a>(
    model: &Model<'_>,
    readings: impl Iterator<Item = &'a Fitted>,
    plane: Option<Vec3>,
) -> Vec<Plan> {
    let mut knobs = readings.flat_map(|fit| &fit.acting.knobs);
    // Curves of a law that is not linear are known along the pokes so far.
    let linear = !knobs.any(|knob| LARGE.contains(&knob.physics()));
    let mut plans = Vec::new();
    let mut slanted: Vec<usize> = Vec::new();
    for track in first_of_each_place(model) {
        let Track { site, direction, inward, .. } = model.tracks[track];
        // The curves of a law that is not linear reach as deep as their own direction went.
        let known =
            |t: &&Track| t.site == site && (linear || (t.direction - direction).norm() < SAME_DIRECTION);
        let here = model.tracks.iter().filter(known);
        let deepest = here.flat_map(|t| &t.depth_m).copied().fold(0.0, f64::max);
        let tip = &model.settled.evidence.sites[site];
        let mut add = |direction, depth_m, rate_m_s, hold_s| {
            let poke = PlannedPoke {
                site: tip.centre,
                direction,
                radius_m: tip.radius_m,
                depth_m,
                rate_m_s,
                hold_s,
            };
            plans.push(Plan { track, poke });
        };
        for depth in DEPTHS {
            for rate_m_s in RATES_M_S {
                for hold_s in HOLDS_S {
                    add(direction, depth * deepest, rate_m_s, hold_s);
                }
            }
        }
        if !linear || slanted.contains(&site) {
            continue;
        }
        slanted.push(site);
        for aside in sideways(&inward, plane).into_iter().flat_map(|t| [t, -t]) {
            let direction = inward * SLANT.cos() + aside * SLANT.sin();
            for rate_m_s in RATES_M_S {
                add(direction, deepest, rate_m_s, HOLDS_S[0]);
            }
        }
    }
    plans
}

/// Unit vectors along a surface in which a poke may lean.
fn sideways(inward: &Vec3, plane: Option<Vec3>) -> Vec<Vec3> {
    match plane {
        Some(normal) => inward.cross(&normal).try_normalize(0.1).into_iter().collect(),
        None => {
            let basis = basis_from_axis(inward);
            [0, 1].map(|axis| basis.column(axis).into_owned()).to_vec()
        }
    }
}

/// One track for every place and direction.
fn first_of_each_place(model: &Model<'_>) -> Vec<usize> {
    let mut firsts: Vec<usize> = Vec::new();
    for track in &model.tracks {
        let same = |&i: &usize| {
            let first = &model.tracks[i];
            first.site == track.site && (first.direction - track.direction).norm() < SAME_DIRECTION
        };
        if !firsts.iter().any(same) {
            firsts.push(track.index);
        }
    }
    firsts
}

/// A poke as it would be recorded, with nothing seen.
pub(super) struct Imagined {
    /// The motion.
    pub timeline: Timeline,
    /// Its rows.
    pub track: Track,
    /// Rows of the sensor, and frames, that each of these stands for.
    pub rows_each: f64,
    pub frames_each: f64,
}

/// The recording of a plan, after everything that was recorded.
pub(super) fn imagined(model: &Model<'_>, plan: &Plan) -> Imagined {
    let like = &model.tracks[plan.track];
    let start = model.end_s() + REST_S;
    let times: Vec<f64> = (0..=ROWS).map(|i| plan.poke.contact_s() * i as f64 / ROWS as f64).collect();
    let reported_m: Vec<Vec3> = times.iter().map(|&t| plan.poke.direction * plan.depth_at(t)).collect();
    let rows = times.iter().zip(&reported_m).enumerate().map(|(i, (t, &reported_m))| {
        let touch =
            Touch { site: like.site, direction: plan.poke.direction, inward: like.inward, reported_m };
        Row { time_s: start + t, contact: Some(touch), first: i == 0 }
    });
    let deepest = |site: usize| {
        let there = model.tracks.iter().filter(|t| t.site == site).flat_map(|t| &t.depth_m);
        there.copied().fold(0.0, f64::max)
    };
    let timeline = Timeline { rows: rows.collect(), deepest_m: (0..model.body.sites).map(deepest).collect() };
    let evidence = model.settled.evidence;
    let tip = &evidence.sites[like.site];
    let in_view = |m: &usize| (evidence.rest[*m].0 - tip.centre).norm() > tip.radius_m;
    let seen: Vec<(usize, Vec3)> =
        (0..evidence.rest.len()).filter(in_view).map(|m| (m, Vec3::zeros())).collect();
    let frame = |i: usize| Frame { time_s: start + times[i], seen: seen.clone() };
    let frames: Vec<Frame> = (0..ROWS).step_by(ROWS / FRAMES).map(frame).collect();
    let contact_s =
        |track: &Track| track.time_s.last().unwrap_or(&0.0) - track.time_s.first().unwrap_or(&0.0);
    let recorded_s: f64 = model.tracks.iter().map(contact_s).sum();
    let rate = |count: usize| count as f64 / recorded_s.max(f64::MIN_POSITIVE);
    let rows_hz = rate(model.tracks.iter().map(|t| t.time_s.len()).sum());
    let frames_hz = rate(model.tracks.iter().map(|t| t.frames.len()).sum());
    let track = Track {
        time_s: times.iter().map(|t| start + t).collect(),
        force_n: vec![Vec3::zeros(); times.len()],
        depth_m: times.iter().map(|&t| plan.depth_at(t)).collect(),
        counts: times.iter().map(|&t| plan.depth_at(t) >= LEAST_DEPTH * plan.poke.depth_m).collect(),
        direction: plan.poke.direction,
        reported_m,
        frames,
        first_row: 0,
        ..like.clone()
    };
    let each = |hz: f64, count: usize| plan.poke.contact_s() * hz / count as f64;
    Imagined {
        rows_each: each(rows_hz, track.time_s.len()),
        frames_each: each(frames_hz, track.frames.len()),
        timeline,
        track,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pokes_lean_within_the_plane_of_the_stage() {
        let down = -Vec3::z();
        assert_eq!(sideways(&down, None).len(), 2);
        let only = sideways(&down, Some(Vec3::y()));
        assert!(only.len() == 1 && (only[0].x.abs() - 1.0).abs() < 1e-12, "{only:?}");
        // A face that the stage only moves along cannot be leant upon.
        assert!(sideways(&Vec3::y(), Some(Vec3::y())).is_empty());
    }
}
