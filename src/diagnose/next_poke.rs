//! The poke that tells two readings apart best, for its time on the bench.
//!
//! Both readings predict the force and the markers of pokes that were not made, as the march in time would record them: at
//! every place poked so far, in its direction, shallow and deep, slow and fast, with and without a long hold. What a
//! change of the modulus would make alike is taken off; what is left, over the noise and per second, decides.

use super::diagnosis::NextPoke;
use super::march::March;
use super::model::Model;
use super::physics::Physics;
use super::refit::Fitted;
use super::track::{Row, Timeline, Touch};
use rayon::prelude::*;

/// Depths over the deepest so far, rates (m/s) and holds (s) that are tried.
const DEPTHS: [f64; 2] = [0.5, 1.0];
const RATES_M_S: [f64; 2] = [1e-3, 6e-3];
const HOLDS_S: [f64; 2] = [0.5, 10.0];

/// Rest before the poke, which costs time as well (s).
const REST_S: f64 = 2.0;

/// Rows of the force sensor and frames of the camera per second, as predicted.
const ROW_S: f64 = 0.02;
const FRAME_ROWS: usize = 5;

/// Which poke to make.
#[derive(Debug, Clone, Copy)]
struct Plan {
    /// Index of a track at the same place, in the same direction.
    track: usize,
    depth_m: f64,
    rate_m_s: f64,
    hold_s: f64,
}

impl Plan {
    fn contact_s(&self) -> f64 {
        2.0 * self.depth_m / self.rate_m_s + self.hold_s
    }

    /// Depth at a time since contact (m).
    fn depth_at(&self, t: f64) -> f64 {
        (t * self.rate_m_s).min(self.depth_m).min((self.contact_s() - t) * self.rate_m_s).max(0.0)
    }
}

/// The best poke to tell `one` from `other`, which are the readings of these entries. `None` where no poke separates them.
pub(super) fn next_poke(
    model: &Model<'_>,
    one: (&[Physics], &Fitted),
    other: (&[Physics], &Fitted),
) -> Option<NextPoke> {
    let deepest = model.tracks.iter().flat_map(|t| &t.depth_m).copied().fold(0.0, f64::max);
    let mut plans = Vec::new();
    for track in first_of_each_place(model) {
        for depth in DEPTHS {
            for rate_m_s in RATES_M_S {
                for hold_s in HOLDS_S {
                    plans.push(Plan { track, depth_m: depth * deepest, rate_m_s, hold_s });
                }
            }
        }
    }
    let judged: Vec<(f64, Plan)> = plans
        .into_par_iter()
        .filter_map(|plan| {
            Some((separation(model, &plan, one.1, other.1)? / (plan.contact_s() + REST_S), plan))
        })
        .collect();
    let (per_second, plan) = judged.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    if per_second <= 0.0 {
        return None;
    }
    let track = &model.tracks[plan.track];
    let named = |physics: &[Physics]| match physics {
        [] => "the baseline".to_owned(),
        all => all.iter().map(|p| p.id()).collect::<Vec<_>>().join(" with "),
    };
    let separates: Vec<Physics> = one.0.iter().chain(other.0).copied().collect();
    Some(NextPoke {
        why: format!(
            "of the pokes at the places so far it tells {} from {} best for its time: a squared distance of {:.0} standard deviations in {:.0} s",
            named(one.0),
            named(other.0),
            per_second * (plan.contact_s() + REST_S),
            plan.contact_s() + REST_S
        ),
        separates,
        site_m: model.settled.evidence.sites[track.site].centre,
        direction: track.direction,
        depth_m: plan.depth_m,
        rate_m_s: plan.rate_m_s,
        hold_s: plan.hold_s,
    })
}

/// One track for every place and direction.
fn first_of_each_place(model: &Model<'_>) -> Vec<usize> {
    let mut firsts: Vec<usize> = Vec::new();
    for track in &model.tracks {
        let same = |&i: &usize| {
            let first = &model.tracks[i];
            first.site == track.site && (first.direction - track.direction).norm() < 1e-6
        };
        if !firsts.iter().any(same) {
            firsts.push(track.index);
        }
    }
    firsts
}

/// Squared distance of the two predictions over the noise, less what a common factor explains.
fn separation(model: &Model<'_>, plan: &Plan, one: &Fitted, other: &Fitted) -> Option<f64> {
    let a = predicted(model, plan, one)?;
    let b = predicted(model, plan, other)?;
    let product = |x: &[f64], y: &[f64]| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    let distance: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let size = product(&b, &b).max(f64::MIN_POSITIVE);
    Some(product(&distance, &distance) - product(&distance, &b).powi(2) / size)
}

/// Readings of a poke, each over its noise: force, then markers.
fn predicted(model: &Model<'_>, plan: &Plan, fitted: &Fitted) -> Option<Vec<f64>> {
    let track = &model.tracks[plan.track];
    let start = model.end_s() + REST_S;
    let count = (plan.contact_s() / ROW_S).ceil() as usize;
    let rows = (0..=count).map(|i| {
        let t = ROW_S * i as f64;
        let reported_m = track.direction * plan.depth_at(t);
        let (site, direction, inward) = (track.site, track.direction, track.inward);
        Row { time_s: start + t, contact: Some(Touch { site, direction, inward, reported_m }), first: i == 0 }
    });
    let timeline = Timeline { rows: rows.collect() };
    let marched = model.march_along(&timeline, &fitted.acting, &fitted.at)?;
    let March { force, loads, .. } = &marched.rows;
    let mut readings = Vec::new();
    for (row, force) in force.iter().enumerate() {
        let more = model.added(&marched, plan.track, row).0;
        for axis in 0..3 {
            let model_n = (force[axis].re + more[axis].re) * marched.effects.gain[axis].re;
            readings.push(model_n / model.force_sd[axis]);
        }
    }
    for (row, load) in loads.iter().enumerate().step_by(FRAME_ROWS) {
        let plain = nalgebra::DVector::from_iterator(load.len(), load.iter().map(|l| l.re));
        let mut u = &marched.body.markers.value * plain;
        if let Some(more) = model.added(&marched, plan.track, row).1 {
            u += more;
        }
        for (marker, sd) in model.marker_sd.iter().enumerate() {
            for (turn, sd) in marched.turn.iter().zip(sd) {
                let seen: f64 = turn.iter().enumerate().map(|(k, t)| t.re * u[3 * marker + k]).sum();
                readings.push(seen / sd);
            }
        }
    }
    Some(readings)
}
