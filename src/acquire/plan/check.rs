//! What speaks against a plan, all of it, before anything moves.

use super::bench::Bench;
use super::motions::{Leg, Phase, PlanStep};
use super::violation::{At, Breach, Violation, add};
use crate::acquire::protocol::{Action, Profile, Stroke, Target};
use crate::device::AXES;
use crate::geometry::Vec3;

/// Share by which rounding may carry a figure over its limit.
const ROUNDING: f64 = 1.0 + 1e-9;

/// Tips of different radius (m).
const SAME_RADIUS_M: f64 = 1e-6;

/// How far the tip's axis may lean from the normal of the phantom's face.
const UPRIGHT_DEG: f64 = 5.0;

/// What speaks against a bench whose figures make sense.
pub(super) fn bench(bench: &Bench, violations: &mut Vec<Violation>) {
    let mut add = |breach| add(violations, None, breach);
    let face = bench.face();
    let lean_deg = bench.tip_axis().dot(&face.inward).clamp(-1.0, 1.0).acos().to_degrees();
    if lean_deg > UPRIGHT_DEG {
        let figure = "the angle between the tip's axis and the phantom's face's normal (°)";
        add(Breach::Figure { figure, value: lean_deg, expected: "at most 5" });
    }
    for (channel, (limit, range)) in bench.load.limits().into_iter().zip(bench.load.range).enumerate() {
        if limit > range {
            add(Breach::LimitAboveRange { channel, limit, range });
        }
    }
    // The surface may be met early.
    overshoot(bench, bench.tip_axis(), bench.approach_speed_m_s, add);
}

/// Figures of the bench that make no sense.
pub(super) fn figures(bench: &Bench, start_m: [f64; AXES]) -> Vec<Violation> {
    let positive = "more than 0";
    let [soft, stiff] = bench.stiffness_n_per_m;
    let finite = |value: f64, sound: bool| value.is_finite() && sound;
    let mut wrong = Vec::new();
    let mut check = |figure, value: f64, sound: bool, expected| {
        if !finite(value, sound) {
            add(&mut wrong, None, Breach::Figure { figure, value, expected });
        }
    };
    for (figure, value) in [
        ("the tip's radius (m)", bench.tip_radius_m),
        ("the travel speed (m/s)", bench.travel_speed_m_s),
        ("the approach speed (m/s)", bench.approach_speed_m_s),
        ("the acceleration (m/s²)", bench.acceleration_m_s2),
        ("the deceleration on a stop (m/s²)", bench.stop_deceleration_m_s2),
        ("the least stiffness (N/m)", soft),
        ("the torque limit (N·m)", bench.load.torque_nm),
    ] {
        check(figure, value, value > 0.0, positive);
    }
    for position in start_m {
        check("where the stage stands (m)", position, true, "a number");
    }
    for most in bench.limits.speed_m_s {
        check("a speed limit of the stage (m/s)", most, most > 0.0, positive);
    }
    for most in bench.limits.acceleration_m_s2 {
        check("an acceleration limit of the stage (m/s²)", most, most > 0.0, positive);
    }
    let turns = bench.load.sensor.to_phantom.determinant();
    check("the determinant of the sensor's rotation", turns, bench.load.sensor.is_rotation(), "a rotation");
    check("the sensor's distance from the tip (m)", bench.load.sensor.tip_m.norm(), true, "a number");
    for value in bench.load.force_n {
        check("a force limit (N)", value, value > 0.0, positive);
    }
    for value in bench.load.range {
        check("a range of the sensor (N, N·m)", value, value > 0.0, positive);
    }
    for (figure, value) in [
        ("the surface tolerance (m)", bench.surface_tolerance_m),
        ("the least rest (s)", bench.least_rest_s),
        ("the sensor's latency (s)", bench.latency.sensor_s),
        ("the host's latency (s)", bench.latency.host_s),
        ("the port's latency (s)", bench.latency.serial_s),
    ] {
        check(figure, value, value >= 0.0, "0 or more");
    }
    check("the greatest stiffness (N/m)", stiff, stiff >= soft, "at least the least");
    // A site may lie below the surface by the tolerance, and what comes closer by less counts as touching.
    let run_up_m = bench.run_up_m * ROUNDING;
    let far = run_up_m >= 2.0 * bench.surface_tolerance_m && run_up_m > 0.0;
    check("the run-up (m)", bench.run_up_m, far, "at least twice the surface tolerance, and more than 0");
    check("the clearance (m)", bench.clearance_m, bench.clearance_m > bench.run_up_m, "more than the run-up");
    for axis in 0..3 {
        let (low, high) = (bench.phantom.low_m[axis], bench.phantom.high_m[axis]);
        check("the phantom's extent (m)", high - low, high > low, positive);
    }
    wrong
}

/// What speaks against the steps.
pub(super) fn steps(steps: &[PlanStep], bench: &Bench, violations: &mut Vec<Violation>) {
    let mut left_s: Option<f64> = None;
    for step in steps {
        let mut add = |breach| add(violations, Some(At::from(&step.step)), breach);
        let air = matches!(&step.step.action, Action::Stroke { stroke, .. } if stroke.air);
        for leg in &step.legs {
            motion(leg, bench, &mut add);
            if air || matches!(leg.phase, Phase::Travel | Phase::Approach) {
                clear(leg, bench, &mut add);
            }
        }
        if let Action::Stroke { site_m, stroke } = &step.step.action {
            mounted(stroke, bench, &mut add);
            if !air {
                site(Vec3::from(*site_m), stroke, bench, &mut add);
                load(stroke, bench, &mut add);
            }
        }
        if let Some(contact) = &step.contact {
            if let Some(left_s) = left_s {
                // To the millisecond, so that repeats say the same.
                let rest_s = ((contact.start_s - left_s) * 1e3).round() * 1e-3;
                if rest_s < bench.least_rest_s {
                    add(Breach::TooSoon { rest_s, least_s: bench.least_rest_s });
                }
            }
            left_s = Some(contact.end_s);
        }
    }
}

/// Travel, speed and acceleration.
fn motion(leg: &Leg, bench: &Bench, add: &mut impl FnMut(Breach)) {
    let Some(motion) = leg.motion else { return };
    let (limits, phase) = (&bench.limits, leg.phase.name());
    if let Some(axis) = limits.outside(motion.target_m) {
        let (target_m, travel_m) = (motion.target_m[axis], limits.travel_m[axis]);
        add(Breach::OutsideTravel { phase, axis, target_m, travel_m });
    }
    let way: [f64; AXES] = std::array::from_fn(|i| (motion.target_m[i] - leg.from_m[i]).abs());
    let length = f64::hypot(way[0], way[1]);
    for (axis, way) in way.into_iter().enumerate() {
        let share = way / length;
        let (asked_m_s, most_m_s) = (motion.speed_m_s * share, limits.speed_m_s[axis]);
        if asked_m_s > most_m_s * ROUNDING {
            add(Breach::TooFast { phase, axis, asked_m_s, most_m_s });
        }
        let (asked_m_s2, most_m_s2) = (motion.acceleration_m_s2 * share, limits.acceleration_m_s2[axis]);
        if asked_m_s2 > most_m_s2 * ROUNDING {
            add(Breach::TooMuchAcceleration { phase, axis, asked_m_s2, most_m_s2 });
        }
    }
}

fn clear(leg: &Leg, bench: &Bench, add: &mut impl FnMut(Breach)) {
    let Some(motion) = leg.motion else { return };
    let [from, to] = [leg.from_m, motion.target_m].map(|position| bench.mounting.tip_at(position));
    if bench.ploughs(from, to) {
        let (phase, keep_m) = (leg.phase.name(), bench.surface_tolerance_m);
        add(Breach::Ploughs { phase, from_m: from.into(), to_m: to.into(), keep_m });
    }
}

/// Whether the phantom is where it is poked.
fn site(site: Vec3, stroke: &Stroke, bench: &Bench, add: &mut impl FnMut(Breach)) {
    let (face, site_m) = (bench.face(), site.into());
    let (height_m, tolerance_m) = (bench.height_m(site), bench.surface_tolerance_m);
    if height_m.abs() > tolerance_m {
        add(Breach::OffSurface { site_m, height_m, tolerance_m });
    }
    let beyond = |axis: usize| {
        let (low, high) = (bench.phantom.low_m[axis], bench.phantom.high_m[axis]);
        (low - site[axis]).max(site[axis] - high) + bench.tip_radius_m
    };
    let over_m = (0..3).filter(|axis| *axis != face.axis).map(beyond).fold(0.0, f64::max);
    if over_m > tolerance_m {
        add(Breach::OverEdge { site_m, over_m });
    }
    let direction = direction(stroke, bench);
    let (depth_m, thickness_m) = (stroke.deepest_m(), bench.thickness_m(site, direction));
    if depth_m >= thickness_m {
        add(Breach::TooDeep { depth_m, thickness_m });
    }
}

fn mounted(stroke: &Stroke, bench: &Bench, add: &mut impl FnMut(Breach)) {
    if let Some(asked_m) = stroke.radius_m
        && (asked_m - bench.tip_radius_m).abs() > SAME_RADIUS_M
    {
        add(Breach::OtherTip { asked_m, mounted_m: bench.tip_radius_m });
    }
}

fn load(stroke: &Stroke, bench: &Bench, add: &mut impl FnMut(Breach)) {
    let direction = direction(stroke, bench);
    let shares = bench.load.share(direction);
    let [_, most_n] = forces_n(bench, stroke);
    for (channel, (limit, share)) in bench.load.limits().into_iter().zip(shares).enumerate() {
        let predicted = most_n * share;
        if predicted > limit * ROUNDING {
            add(Breach::ForceAboveLimit { channel, predicted, depth_m: stroke.deepest_m(), limit });
        }
    }
    overshoot(bench, direction, stroke.speed_m_s, add);
}

/// A stop begins at the limit; what the stage still goes must not carry a channel out of its range.
fn overshoot(bench: &Bench, direction: Vec3, speed_m_s: f64, mut add: impl FnMut(Breach)) {
    let overshoot_m = bench.overshoot_m(speed_m_s);
    let shares = bench.load.share(direction);
    for (channel, limit) in bench.load.limits().into_iter().enumerate() {
        let (over, range) =
            (overshoot_m * bench.stiffness_n_per_m[1] * shares[channel], bench.load.range[channel]);
        // A limit above the range is told of the bench.
        if over > 0.0 && limit <= range && limit + over > range * ROUNDING {
            add(Breach::Overshoot { channel, speed_m_s, overshoot_m, over, limit, range });
        }
    }
}

fn direction(stroke: &Stroke, bench: &Bench) -> Vec3 {
    stroke.direction.map_or_else(|| bench.tip_axis(), Vec3::from)
}

/// Least and greatest force that a stroke may reach (N). One that ends at a force goes on for a while.
pub(super) fn forces_n(bench: &Bench, stroke: &Stroke) -> [f64; 2] {
    let at_depth = bench.stiffness_n_per_m.map(|stiffness| stiffness * stroke.deepest_m());
    match stroke.profile {
        Profile::Press { target: Target::Force { force_n, .. }, .. } => {
            let over_n = bench.past_force_m(stroke.speed_m_s) * bench.stiffness_n_per_m[1];
            [at_depth[0].min(force_n), at_depth[1].min(force_n + over_n)]
        }
        _ => at_depth,
    }
}
