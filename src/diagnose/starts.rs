//! Where the fit of each entry of the catalogue begins; several places where the misfit may have several valleys.

use super::bulk::{BulkKnob, Lab};
use super::dual::Dual;
use super::effects::Effects;
use super::extra::Large;
use super::knob::Knob;
use super::large::StiffeningLaw;
use super::model::Model;
use super::physics::Physics;
use super::refit::Fitted;
use super::scan::Scan;
use super::sticky::SMALLEST_SLIP_M;
use super::uneven;
use crate::geometry::Vec3;
use rayon::prelude::*;

/// Where a fit begins.
#[derive(Debug, Clone)]
pub(super) struct Start {
    /// The entry.
    pub physics: Physics,
    /// Its knobs with their values.
    pub knobs: Vec<(Knob, f64)>,
    /// By how much it would lower the sum of squares, where a scan has said so already.
    pub gain: Option<f64>,
}

/// Time constants to begin with (s).
const TIMES_S: [f64; 3] = [0.3, 2.0, 12.0];

/// Gaps of slack bands to begin with (m).
const GAPS_M: [f64; 2] = [1e-4, 5e-4];

/// Where friction beside the restraint begins: stiffness over the springs', and slip over what stretches them at most.
const RATIO: f64 = 0.5;
const SLIPS: [f64; 2] = [0.15, 0.5];
/// Beside these, and alone, friction is looked for.
const INSTRUMENTS: [Physics; 5] = [
    Physics::CameraLag,
    Physics::CameraMisalignment,
    Physics::CameraScale,
    Physics::ForceDrift,
    Physics::ForceGain,
];

/// All starts from a fitted reading.
pub(super) fn starts(model: &Model<'_>, current: &Fitted) -> Vec<Start> {
    let mut all = Vec::new();
    let mut add = |physics: Physics, knobs: Vec<(Knob, f64)>| all.push(Start { physics, knobs, gain: None });
    for time in TIMES_S {
        let term = |fraction: f64| vec![(Knob::Relaxed(0), fraction), (Knob::Time(0), time.ln())];
        add(Physics::ViscoelasticRelaxation, term(0.1));
    }
    add(Physics::Drying, vec![(Knob::Drying, 0.0)]);
    if model.patches() > 0 {
        // What drags is not slack here as well.
        let drags = current.acting.knobs.iter().any(|knob| knob.physics() == Physics::StickyRestraint);
        for direction in if drags { Vec::new() } else { pulled(model, current) } {
            for gap in GAPS_M {
                add(Physics::SlackBand, vec![(Knob::Gap(direction), gap)]);
            }
        }
        // Beside another effect it would take up what that one's model gets wrong; those of the instruments have none.
        if current.acting.knobs.iter().all(|knob| INSTRUMENTS.contains(&knob.physics())) {
            let stretched = model.stretched_m(current).unwrap_or(0.0);
            for slip in
                SLIPS.map(|share| share * stretched).into_iter().filter(|slip| *slip > SMALLEST_SLIP_M)
            {
                let knobs = [(Knob::StickyRatio, RATIO), (Knob::StickySlip, slip)];
                add(Physics::StickyRestraint, knobs.map(|(knob, value)| (knob, value.ln())).to_vec());
            }
        }
        for time in TIMES_S {
            add(Physics::BandViscosity, vec![(Knob::BandRelaxed(0), 0.1), (Knob::BandTime(0), time.ln())]);
        }
    }
    for friction in frictions(model, current) {
        add(Physics::TipSlip, vec![(Knob::Friction, friction.ln())]);
    }
    add(Physics::LateContact, vec![(Knob::Late, 3e-5)]);
    add(Physics::StageBacklash, vec![(Knob::Backlash, 3e-5)]);
    add(Physics::StageCompliance, vec![(Knob::StageGive, 0.0)]);
    if model.correlation.drifts {
        add(Physics::ForceDrift, (0..3).map(|axis| (Knob::Drift(axis), 0.0)).collect());
    }
    add(Physics::ForceGain, (0..2).map(|axis| (Knob::Gain(axis), 0.0)).collect());
    let stands = (0..3).map(Knob::Rotation).chain((0..3).map(Knob::Translation));
    add(Physics::CameraMisalignment, stands.map(|knob| (knob, 0.0)).collect());
    // Beside an uneven scale it would say the same twice.
    if !current.acting.knobs.iter().any(|knob| knob.physics() == Physics::UnevenScale) {
        add(Physics::CameraScale, vec![(Knob::Scale, 1.0), (Knob::DepthGain, 1.0)]);
    }
    // Beside another effect it would take up what that one's model gets wrong.
    if current.acting.knobs.is_empty() {
        add(Physics::UnevenScale, uneven::KNOBS.to_vec());
    }
    add(Physics::CameraLag, vec![(Knob::Lag, 0.0)]);
    all.extend(large(model, current));
    all.extend(bulk(model, current));
    all
}

/// Laws that are not linear. What a start needs of them is worked out here, before many threads ask for it.
fn large(model: &Model<'_>, current: &Fitted) -> Vec<Start> {
    // Two such laws at once are not modelled.
    if current.acting.fine {
        return Vec::new();
    }
    let Some(shelf) = model.shelf(false) else { return Vec::new() };
    let modulus = current.at[0].exp();
    // The second is the first one's limit: its curves are solved with those of the first, for less than alone.
    let mut starts = vec![
        (Physics::StrainStiffening, vec![(Knob::Stiffening(StiffeningLaw::Fung), 2.0)]),
        (Physics::FiniteStrain, vec![(Knob::FiniteStrain, 1.0)]),
    ];
    if let Ok(scale) = shelf.typical_scale(modulus, &model.tracks) {
        for share in [0.3, 3.0] {
            let scale = (Knob::SofteningScale, (share * scale).ln());
            starts.push((Physics::StressSoftening, vec![(Knob::Softening, 0.1), scale]));
        }
    }
    if model.settled.recording.phantom.gravity.is_none() {
        for weight in [Knob::Gravity, Knob::GravityUnderTip] {
            starts.push((Physics::SelfWeight, (0..3).map(|axis| (weight(axis), 0.0)).collect()));
        }
    }
    starts.retain(|(_, knobs)| ready(model, knobs, false));
    starts.into_iter().map(|(physics, knobs)| Start { physics, knobs, gain: None }).collect()
}

/// Whether the law of these knobs, if there is one, has an answer. Works it out, so that many threads may ask for it after.
pub(super) fn ready(model: &Model<'_>, knobs: &[(Knob, f64)], fine: bool) -> bool {
    let mut effects = Effects::neutral(0);
    knobs.iter().for_each(|(knob, value)| knob.set(&mut effects, Dual::from(*value)));
    let answers = |large: &Large| model.shelf(fine).is_some_and(|shelf| shelf.extra(large).is_ok());
    effects.large.as_ref().is_none_or(answers)
}

/// Changes of the body, by a scan of their places and typical amounts. The best places that are not neighbours are moved to
/// where the scan likes them most.
fn bulk(model: &Model<'_>, current: &Fitted) -> Vec<Start> {
    let (Some(lab), Some(scan)) = (model.lab(), Scan::new(model, current)) else { return Vec::new() };
    let mut starts = Vec::new();
    for (physics, looks) in lab.looks() {
        let mut scanned: Vec<(f64, &Vec<(BulkKnob, f64)>)> =
            looks.par_iter().filter_map(|(knobs, change)| Some((scan.gain(change)?, knobs))).collect();
        scanned.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<(f64, Vec<(BulkKnob, f64)>)> = Vec::new();
        for (gain, knobs) in scanned {
            if kept.iter().all(|(_, other)| lab.apart(knobs, other)) {
                kept.push((gain, knobs.clone()));
            }
            if kept.len() == BEST_PLACES {
                break;
            }
        }
        starts.extend(kept.into_iter().map(|(gain, knobs)| {
            let (gain, knobs) =
                if gain < WORTH_MOVING { (gain, knobs) } else { moved(lab, &scan, gain, knobs) };
            let knobs = knobs.into_iter().map(|(knob, value)| (Knob::Bulk(knob), value)).collect();
            Start { physics: *physics, knobs, gain: Some(gain) }
        }));
    }
    starts
}

/// Moves a place and its size, one knob after the other, to where the scan likes them most.
fn moved(lab: &Lab<'_>, scan: &Scan, gain: f64, knobs: Vec<(BulkKnob, f64)>) -> (f64, Vec<(BulkKnob, f64)>) {
    let mut best = (gain, knobs);
    let mut share = 1.0;
    for _ in 0..HALVINGS {
        for i in 0..best.1.len() {
            if !best.1[i].0.is_place() {
                continue;
            }
            let (bounds, longest) = lab.range(best.1[i].0);
            for sign in [-1.0, 1.0] {
                let mut knobs = best.1.clone();
                knobs[i].1 = (knobs[i].1 + sign * share * longest).clamp(bounds[0], bounds[1]);
                let found = lab.first_order(&knobs).ok().and_then(|change| scan.gain(&change));
                if let Some(gain) = found.filter(|gain| *gain > best.0) {
                    best = (gain, knobs);
                }
            }
        }
        share *= 0.5;
    }
    best
}

/// A gain below which a place is left where it is.
const WORTH_MOVING: f64 = 30.0;

/// Rounds of moving, each by half as much.
const HALVINGS: usize = 3;

/// So many places of each are kept.
const BEST_PLACES: usize = 2;

/// Directions along the axes in which the pokes move the restraint by a good part of what they move it at most: a band that
/// only pulls would feel them.
fn pulled(model: &Model<'_>, current: &Fitted) -> Vec<[f64; 3]> {
    let Some(marched) = model.march(&current.acting, &current.at) else { return Vec::new() };
    let first_disc = 3 * model.body.sites;
    let directions = (0..6).map(|i| {
        let mut direction = [0.0; 3];
        direction[i / 2] = if i % 2 == 0 { 1.0 } else { -1.0 };
        direction
    });
    let moved = |direction: &[f64; 3]| -> f64 {
        let loads = marched.rows.loads.iter().filter(|load| !load.is_empty());
        loads
            .map(|load| {
                let along = |i: usize| -load[(i, 0)] * direction[(i - first_disc) % 3];
                (first_disc..load.nrows()).map(along).sum::<f64>().max(0.0)
            })
            .sum()
    };
    let all: Vec<([f64; 3], f64)> = directions.map(|d| (d, moved(&d))).collect();
    let most = all.iter().map(|d| d.1).fold(0.0, f64::max);
    all.into_iter().filter(|(_, moved)| *moved > GOOD_PART * most).map(|(direction, _)| direction).collect()
}

/// A good part.
const GOOD_PART: f64 = 0.3;

/// Coefficients of friction to begin with: by which the tip would slide during a good part, or a small one, of the rows with the
/// largest ratio of tangential to normal force; and the largest ratio that was measured, at which a tip that slides stays. None so
/// small that noise might have made it.
fn frictions(model: &Model<'_>, current: &Fitted) -> Vec<f64> {
    let Some(marched) = model.march(&current.acting, &current.at) else { return Vec::new() };
    let force = |row: usize| marched.rows.force[row].map(|f| f.re).into();
    let (of_model, measured): (Vec<_>, Vec<_>) = model
        .tracks
        .iter()
        .flat_map(|track| (0..track.time_s.len()).map(move |row| (track, row)))
        .filter(|(track, row)| track.counts[*row])
        .map(|(track, row)| {
            [force(track.first_row + row), track.force_n[row]].map(|f| along_normal(f, track.inward)).into()
        })
        .unzip();
    let [of_model, measured] = [of_model, measured].map(|forces| largest_ratio(&forces).unwrap_or(0.0));
    [0.9 * of_model, 0.6 * of_model, measured]
        .into_iter()
        .filter(|friction| *friction > SMALLEST_FRICTION)
        .collect()
}

/// A friction hardly larger than what noise makes of a force along the poke.
const SMALLEST_FRICTION: f64 = 0.02;

/// A force normal to a surface, and its size along it.
fn along_normal(force: Vec3, inward: Vec3) -> [f64; 2] {
    let normal = force.dot(&inward);
    [normal, (force - inward * normal).norm()]
}

/// The largest ratio of tangential to normal force but for a twentieth of the rows, where the latter is a good part of what it is at
/// most: noise makes ratios of small ones.
fn largest_ratio(forces: &[[f64; 2]]) -> Option<f64> {
    let least = GOOD_PART * forces.iter().map(|f| f[0]).fold(0.0, f64::max);
    let pressed = forces.iter().filter(|f| f[0] > least);
    let mut ratios: Vec<f64> = pressed.map(|[normal, along]| along / normal).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() * 95 / 100).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tip that slides as soon as it is pressed along more than 0.34 of what it is pressed in; what little there is before says nothing.
    #[test]
    fn a_tip_that_slides_shows_its_friction() {
        let pressed = (1..=40).map(|i| 0.05 * f64::from(i));
        let rows = pressed.map(|normal| {
            let along = (0.2 + 0.1 * normal).min(0.34) * normal;
            let noise = if normal < 0.3 { 0.2 } else { 0.0 };
            along_normal(Vec3::new(along + noise, 0.0, -normal), -Vec3::z())
        });
        assert!((largest_ratio(&rows.collect::<Vec<_>>()).expect("pressed") - 0.34).abs() < 1e-12);
        assert_eq!(largest_ratio(&[]), None);
    }
}
