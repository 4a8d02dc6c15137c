//! The bench that goes on in time against the one that knows its session beforehand.

use super::super::effect::Effect;
use super::super::large::{Large, StiffeningLaw};
use super::super::memory::{Memory, PronyTerm};
use super::super::plan::Press;
use super::super::record::tests::{phantom, world};
use super::super::rig::Rig;
use super::*;
use crate::sim::timeline::Scheduled;

/// A tip that goes where the planned session's goes feels the same force and moves the markers alike, up to the steps of time: at
/// 4 mm/s a step is 4 µm, 0.2 % of the depth.
#[test]
fn a_tip_that_keeps_to_the_plan_meets_the_same_phantom() {
    let relaxation =
        Memory::Relaxation { terms: vec![PronyTerm { relaxed_fraction: 0.3, time_constant_s: 1.0 }] };
    let stiffening = Large::StrainStiffening { law: StiffeningLaw::Fung, stiffening: 2.0 };
    for effects in [
        vec![],
        vec![Effect::Memory(relaxation), Effect::Rig(Rig::Backlash { backlash_m: 3e-4 })],
        vec![Effect::Rig(Rig::LateContact { gap_m: 4e-4 }), Effect::Rig(Rig::CameraLag { lag_s: 0.05 })],
        vec![Effect::Rig(Rig::ForceDrift { rate_n_per_s: [1e-3, 0.0, 2e-3] })],
        vec![Effect::Large(stiffening)],
    ] {
        let world = world(effects);
        let recording = world.record(phantom()).expect("a recording");
        let timeline = world.timeline().expect("a timeline");
        let tip = |at_s| match timeline.at(at_s) {
            Some((poke, depth)) => {
                let plan = timeline.pokes[poke].plan;
                (Vec3::from(plan.site_m) + Vec3::from(plan.direction) * depth).into()
            }
            None => [0.0, 0.0, 1.0],
        };
        let mut live = Live::new(world.clone(), phantom(), 0.0).expect("a bench");
        let largest = recording.wrench.force_n.iter().map(|f| Vec3::from(*f).norm()).fold(0.0, f64::max);
        let mut compared = 0;
        let mut frames = recording.markers.frame_time_s.iter().enumerate().skip(1).peekable();
        for (&t, &expected) in recording.wrench.time_s.iter().zip(&recording.wrench.force_n).skip(1) {
            // As a stage would be followed: one position for each step of time.
            while live.time_s() < t - 0.5 * STEP_S {
                live.advance(live.time_s() + 0.5 * STEP_S, tip).expect("a step");
            }
            // Whether the very first and last instant still touch is a matter of rounding.
            let limit = |p: &Scheduled| (t - p.start_s).abs() < STEP_S || (t - p.end_s).abs() < STEP_S;
            if timeline.pokes.iter().any(limit) {
                continue;
            }
            let wrench = live.wrench(t);
            let off = (Vec3::from(expected) - Vec3::new(wrench[0], wrench[1], wrench[2])).norm();
            assert!(off < 0.005 * largest, "{:?} at {t} s: off by {off} of {largest} N", world.effects);
            while frames.next_if(|f| *f.1 < t - 1e-6).is_some() {}
            if let Some((frame, _)) = frames.next_if(|f| (f.1 - t).abs() < 1e-6) {
                compared += 1;
                let rows = recording.markers.rows.iter().filter(|r| r.frame as usize == frame);
                for (number, position) in live.markers() {
                    let Some(row) = rows.clone().find(|r| r.marker + 1 == number) else { continue };
                    let off = (Vec3::from(row.position_m) - Vec3::from(position)).norm();
                    assert!(off < 2e-5, "{:?}: marker {number} off by {off} m at {t} s", world.effects);
                }
            }
        }
        assert!(compared > 50, "{compared} frames");
        assert_eq!(live.touches, 3);
    }
}

/// A gel that has dried for 100 s is another gel, which dries as fast in N/m a second but by another share of what it is.
#[test]
fn a_world_on_a_later_clock_is_the_same_world() {
    let drying = Effect::Memory(Memory::Drying { modulus_rate_per_s: -0.0025 });
    let world = world(vec![drying]);
    let pressed = |world: World, at_rest_s: f64| {
        let mut live = Live::new(world, phantom(), at_rest_s).expect("a bench");
        let forces = (0..=200).map(|n| {
            let tip = [0.0517, 0.0323, 0.0245 - 2e-5 * f64::from(n.min(100))];
            live.advance(live.time_s() + 0.5, |_| tip).expect("steps");
            live.wrench(live.time_s())[2]
        });
        forces.collect::<Vec<_>>()
    };
    let (dried, other) = (pressed(world.clone(), 100.0), pressed(world.clone().later(100.0), 0.0));
    assert!(dried[150] < -0.05 && (dried[150] - dried[200]).abs() > 0.05 * dried[150].abs(), "{dried:?}");
    for (a, b) in dried.iter().zip(other) {
        assert!((a - b).abs() < 1e-9 * dried[150].abs(), "{a} N and {b} N");
    }
    assert_eq!(world.clone().later(0.0), world);
}

/// A bench on which nobody means to poke is one all the same.
#[test]
fn a_bench_without_pokes_goes_on_in_time() {
    let mut live = Live::new(World { pokes: vec![], ..world(vec![]) }, phantom(), 0.0).expect("a bench");
    live.advance(0.01, |_| [0.05, 0.03, 0.03]).expect("steps");
    assert_eq!(live.wrench(0.01), [0.0; 6]);
}

/// In the air nothing is felt, beside the phantom neither.
#[test]
fn a_tip_in_the_air_feels_nothing() {
    let mut live = Live::new(world(vec![]), phantom(), 0.0).expect("a bench");
    for tip in [[0.05, 0.03, 0.0245], [0.2, 0.03, 0.02], [-0.01, 0.03, 0.012]] {
        live.advance(live.time_s() + 0.01, |_| tip).expect("steps");
        assert_eq!(live.wrench(live.time_s()), [0.0; 6], "{tip:?}");
    }
    for height in [0.0235, 0.0225] {
        live.advance(live.time_s() + 0.01, |_| [0.0517, 0.0323, height]).expect("steps");
    }
    assert!(live.wrench(live.time_s())[2] < -0.1);
}

/// Straight and slanted pokes at one place: the tip is on the line that it goes along; passing overhead it is on none.
#[test]
fn of_two_lines_at_one_place_the_one_that_the_tip_goes_along_counts() {
    let mut world = world(vec![]);
    let straight = world.pokes[0];
    let (centre, down) = {
        let site = &world.phantom.sites[straight.site];
        (Vec3::from(site.centre_m), Vec3::from(site.inward))
    };
    let across = if down.x.abs() < 0.5 { Vec3::x() } else { Vec3::y() };
    let slanted = (down * 0.866 + across * 0.5).normalize();
    world.pokes.push(Press { direction: slanted.into(), ..straight });
    let pressed = |direction: Vec3| {
        let mut live = Live::new(world.clone(), phantom(), 0.0).expect("a bench");
        for n in 0..=200 {
            let tip = centre + direction * (1e-5 * f64::from(n) - 1e-3);
            live.advance(live.time_s() + STEP_S, |_| tip.into()).expect("steps");
        }
        let wrench = live.wrench(live.time_s());
        let force = Vec3::new(wrench[0], wrench[1], wrench[2]);
        (force.dot(&down), force.dot(&across))
    };
    let ((down_n, aside_n), (leant_n, pulled_n)) = (pressed(down), pressed(slanted));
    assert!(down_n > 0.05 && leant_n > 0.05, "{down_n} N and {leant_n} N");
    assert!(pulled_n / leant_n > aside_n / down_n + 0.3, "{pulled_n} N aside, {aside_n} N");
    let mut live = Live::new(world.clone(), phantom(), 0.0).expect("a bench");
    for n in 0..=600 {
        let tip = centre - down * 0.006 + across * (1e-4 * f64::from(n) - 0.03);
        live.advance(live.time_s() + STEP_S, |_| tip.into()).expect("steps");
        assert_eq!(live.wrench(live.time_s()), [0.0; 6]);
    }
}
