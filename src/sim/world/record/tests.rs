//! Whole sessions: what each effect of the instruments does to a recording, against the same session without it.

use super::super::phantom::{Disc, PhantomPlan, Site};
use super::super::plan::Press;
use super::*;
use crate::observation::Noise;
use crate::sim::draw::{Draw, Instruments, Kinematics, PokePlan};
use crate::sim::hex_mesh::Slab;
use crate::sim::supports::Restraint;
use std::sync::OnceLock;

/// A small phantom, made once for all tests here.
pub(in super::super) fn phantom() -> &'static Phantom {
    static PHANTOM: OnceLock<Phantom> = OnceLock::new();
    PHANTOM.get_or_init(|| {
        let plan = PhantomPlan {
            seed: 3,
            slab: Slab { size_m: [0.075, 0.06, 0.024], glue_end_m: 0.031 },
            poisson_ratio: 0.47,
            sites: vec![
                Site { centre_m: [0.0517, 0.0323, 0.024], inward: [0.0, 0.0, -1.0], radius_m: 0.008 },
                Site { centre_m: [0.0, 0.0291, 0.0127], inward: [1.0, 0.0, 0.0], radius_m: 0.008 },
            ],
            patches: vec![Disc { centre_m: [0.053, 0.037, 0.0], radius_m: 0.005 }],
            spots: vec![Disc { centre_m: [0.045, 0.015, 0.0], radius_m: 0.009 }],
            marker_spacing_m: 0.012,
        };
        Phantom::prepare(&plan).expect("a sound plan")
    })
}

/// A session without noise on it.
pub(in super::super) fn world(effects: Vec<Effect>) -> World {
    let quiet = Noise { force_n: [0.0; 3], torque_nm: [0.0; 3], marker_m: [0.0; 3], stage_m: [0.0; 3] };
    let press = |site: usize, depth_m, rate_m_s| Press {
        site,
        direction: phantom().plan.sites[site].inward,
        depth_m,
        rate_m_s,
        hold_s: 1.0,
    };
    World {
        name: "session".to_owned(),
        seed: 5,
        phantom: phantom().plan.clone(),
        young_modulus_pa: 1e4,
        modulus_range_pa: [5e3, 2e4],
        stated_poisson_ratio: 0.47,
        holds: vec![Hold::Springs { patch: 0, stiffness_n_per_m: 150.0 }, Hold::Glued { spot: 0 }],
        pokes: vec![press(0, 0.002, 0.004), press(1, 0.0015, 0.003), press(0, 0.003, 0.004)],
        instruments: Instruments { noise: quiet, lost_share: 0.0, ..Instruments::default() },
        fit_cell_m: 0.0065,
        effects,
    }
}

fn recorded(effects: Vec<Effect>) -> Recording {
    world(effects).record(phantom()).expect("a recording")
}

/// Displacement of one marker in a frame.
fn moved(recording: &Recording, frame: u32, marker: u32) -> Vec3 {
    let row = recording.markers.rows.iter().find(|r| (r.frame, r.marker) == (frame, marker)).expect("seen");
    Vec3::from(row.position_m) - recording.rest_positions()[marker as usize].0
}

/// The session of the linear bench on the same slab is the same session.
#[test]
fn a_world_without_effects_is_a_draw() {
    let world = world(Vec::new());
    let plan = &world.phantom;
    let draw = Draw {
        name: world.name.clone(),
        seed: world.seed,
        slab: plan.slab,
        poisson_ratio: plan.poisson_ratio,
        young_modulus_pa: world.young_modulus_pa,
        modulus_range_pa: world.modulus_range_pa,
        restraints: vec![
            Restraint::Springs {
                centre_m: plan.patches[0].centre_m,
                radius_m: plan.patches[0].radius_m,
                stiffness_n_per_m: 150.0,
            },
            Restraint::Glued { centre_m: plan.spots[0].centre_m, radius_m: plan.spots[0].radius_m },
        ],
        pokes: (world.timeline().expect("sound").pokes.iter().map(|p| p.plan)).collect::<Vec<PokePlan>>(),
        kinematics: Kinematics::SmallStrain,
        instruments: Instruments { marker_spacing_m: 0.012, ..world.instruments },
        fit_cell_m: 0.0065,
    };
    let (here, there) = (world.record(phantom()).expect("here"), crate::sim::record(&draw).expect("there"));
    assert_eq!(here, world.record(phantom()).expect("again"), "equal worlds, equal bits");
    assert_eq!(here.wrench.time_s, there.wrench.time_s);
    assert_eq!(here.pokes, there.pokes);
    let largest = there.wrench.force_n.iter().flatten().fold(0.0_f64, |m, f| m.max(f.abs()));
    for (a, b) in here.wrench.force_n.iter().zip(&there.wrench.force_n) {
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() < 3e-5 + 1e-6 * largest, "{a:?} and {b:?}");
        }
    }
    assert!(largest > 0.3);
}

#[test]
fn the_sensor_reads_gain_and_drift() {
    let (plain, faulty) = (
        recorded(Vec::new()),
        recorded(vec![
            Effect::Rig(Rig::ForceGain { gain: [1.1, 1.0, 0.9] }),
            Effect::Rig(Rig::ForceDrift { rate_n_per_s: [0.001, 0.0, -0.002] }),
        ]),
    );
    for (i, &t) in plain.wrench.time_s.iter().enumerate() {
        let (f, g) = (plain.wrench.force_n[i], faulty.wrench.force_n[i]);
        let expected = [1.1 * f[0] + 0.001 * t, f[1], 0.9 * f[2] - 0.002 * t];
        for c in 0..3 {
            assert!((g[c] - expected[c]).abs() < 2.1e-5, "at {t} s: {g:?}, {expected:?}");
        }
    }
    assert_eq!(plain.markers, faulty.markers);
}

#[test]
fn foreign_faults_of_the_sensor_do_what_they_say() {
    let plain = recorded(Vec::new());
    let faulty = recorded(vec![
        Effect::Foreign(Foreign::ForceCurvature { scale_n: 3.0 }),
        Effect::Foreign(Foreign::ForceSaturation { limit_n: 0.4 }),
    ]);
    let mut clipped = 0;
    for (f, g) in plain.wrench.force_n.iter().zip(&faulty.wrench.force_n) {
        for c in 0..3 {
            let expected = (f[c] * (1.0 - (f[c] / 3.0).powi(2))).clamp(-0.4, 0.4);
            assert!((g[c] - expected).abs() < 3e-5);
            clipped += usize::from(g[c].abs() == 0.4);
        }
    }
    assert!(clipped > 20);
    let hum = recorded(vec![Effect::Foreign(Foreign::ForceHum { amplitude_n: 0.02, frequency_hz: 12.5 })]);
    // A quarter of a period between rows: zero, up, zero, down.
    let rest: Vec<f64> = hum.wrench.force_n[..5].iter().map(|f| f[1]).collect();
    for (found, expected) in rest.iter().zip([0.0, 0.02, 0.0, -0.02, 0.0]) {
        assert!((found - expected).abs() < 1e-5, "{rest:?}");
    }
}

#[test]
fn the_camera_turns_scales_and_distorts_displacements() {
    let plain = recorded(Vec::new());
    let rotation = [0.02, -0.01, 0.03];
    let turned = recorded(vec![Effect::Rig(Rig::CameraMisalignment {
        rotation_rad: rotation,
        translation_m: [1e-3, 0.0, 2e-3],
    })]);
    let scaled = recorded(vec![Effect::Rig(Rig::CameraScale { scale: 1.05, depth_gain: 0.9 })]);
    let lens = recorded(vec![Effect::Foreign(Foreign::LensDistortion { per_m: 2.0 })]);
    let middle = (10.0 * (plain.pokes[2].start_s + 1.2)) as u32;
    for marker in [4, 17] {
        let u = moved(&plain, middle, marker);
        assert!(u.norm() > 1e-4);
        let site = Vec3::from(phantom().markers[marker as usize]);
        let apart = |other: &Recording, expected: Vec3| (moved(other, middle, marker) - expected).amax();
        assert!(apart(&turned, nalgebra::Rotation3::new(Vec3::from(rotation)) * u) < 3e-7);
        assert!(apart(&scaled, Vec3::new(1.05 * u.x, 1.05 * u.y, 0.945 * u.z)) < 3e-7);
        let gain = 2.0 * (site - Vec3::from(phantom().plan.slab.size_m) * 0.5);
        assert!(apart(&lens, Vec3::new((1.0 + gain.x) * u.x, (1.0 + gain.y) * u.y, u.z)) < 3e-7);
    }
    let shift = turned.rest_positions()[4].0 - plain.rest_positions()[4].0;
    assert!((shift - Vec3::new(1e-3, 0.0, 2e-3)).amax() < 1e-9);
}

/// On a ramp the displacement grows evenly, so a late camera shows it smaller by rate × lag.
#[test]
fn a_late_camera_shows_the_past() {
    let (plain, late) = (recorded(Vec::new()), recorded(vec![Effect::Rig(Rig::CameraLag { lag_s: 0.12 })]));
    let start = (10.0 * plain.pokes[0].start_s).round() as u32;
    let (ahead, behind) = (moved(&plain, start + 4, 9), moved(&late, start + 4, 9));
    assert!((behind - ahead * (0.28 / 0.4)).amax() < 3e-7, "{ahead} and {behind}");
    assert_eq!(plain.wrench, late.wrench);
}

/// Force over depth with lost motion, a gap and a soft stage, from the session without.
#[test]
fn the_tip_is_where_the_stage_leaves_it() {
    let plain = recorded(Vec::new());
    let pressing = |r: &Recording, after_s: f64| {
        let row = (50.0 * (r.pokes[0].start_s + after_s)).round() as usize;
        -r.wrench.force_n[row][2]
    };
    // 2 mm at 4 mm/s, held for 1 s: down at 0.5 s, up again from 1.5 s to 2.0 s.
    let stiffness = pressing(&plain, 1.0) / 0.002;
    let check = |effect: Effect, expected: &[(f64, f64)]| {
        let faulty = recorded(vec![effect.clone()]);
        for &(after_s, depth_m) in expected {
            let force = pressing(&faulty, after_s);
            assert!((force - stiffness * depth_m).abs() < 4e-5, "{effect:?} at {after_s} s: {force} N");
        }
        assert_eq!(faulty.stage, plain.stage, "the stage does not know");
    };
    let lost = 2e-4;
    check(
        Effect::Rig(Rig::Backlash { backlash_m: lost }),
        &[(0.04, 0.0), (0.3, 1.2e-3 - lost), (1.0, 2e-3 - lost), (1.54, 2e-3 - lost), (1.8, 8e-4)],
    );
    check(
        Effect::Rig(Rig::LateContact { gap_m: lost }),
        &[(0.04, 0.0), (0.3, 1.2e-3 - lost), (1.0, 2e-3 - lost), (1.8, 8e-4 - lost), (1.96, 0.0)],
    );
    let compliance = 5e-4;
    let share = 1.0 / (1.0 + compliance * stiffness);
    let soft = recorded(vec![Effect::Rig(Rig::StageCompliance { compliance_m_per_n: compliance })]);
    assert!((pressing(&soft, 1.0) - stiffness * 2e-3 * share).abs() < 3e-5);
    let frame = (10.0 * (plain.pokes[0].start_s + 1.0)) as u32;
    let (u, v) = (moved(&plain, frame, 9), moved(&soft, frame, 9));
    // Markers as a function of force are as without.
    assert!((v - u * share).amax() < 2e-6 * u.norm() / 1e-3 + 3e-7);
    let grows = recorded(vec![Effect::Foreign(Foreign::StageExpansion { rate_m_per_s: 1e-5 })]);
    let at = plain.pokes[0].start_s + 1.0;
    assert!((pressing(&grows, 1.0) - stiffness * (2e-3 + 1e-5 * at)).abs() < 3e-5);
}

/// The markers of a soft stage move along with the force although the tip's own axes are coupled.
#[test]
fn a_crooked_stage_pushes_sideways() {
    let askew = recorded(vec![Effect::Foreign(Foreign::StageMisalignment { rotation_rad: [0.0, 0.1, 0.0] })]);
    let plain = recorded(Vec::new());
    let row = (50.0 * (plain.pokes[0].start_s + 1.0)).round() as usize;
    let (f, g) = (plain.wrench.force_n[row], askew.wrench.force_n[row]);
    // −z turned by 0.1 about y points to −x by a tenth.
    assert!(g[0] < f[0] - 0.01 && (g[2] / f[2] - 1.0).abs() < 0.05, "{f:?} and {g:?}");
}

#[test]
fn what_means_nothing_is_refused() {
    let refused = |effects| world(effects).record(phantom()).expect_err("refused");
    let fractions = [0.6, 0.5].map(|g| PronyTerm { relaxed_fraction: g, time_constant_s: 1.0 });
    let memory = Effect::Memory(Memory::Relaxation { terms: fractions.to_vec() });
    assert!(matches!(refused(vec![memory]), SimError::BadEffect { what: "sum of relaxed_fraction", .. }));
    let slack = Touch::SlackBand { hold: None, direction: [0.0, 0.0, -2.0], gap_m: 0.0 };
    assert!(matches!(refused(vec![Effect::Touch(slack)]), SimError::BadEffect { value: 2.0, .. }));
    let mut elsewhere = world(Vec::new());
    elsewhere.holds = vec![Hold::Springs { patch: 7, stiffness_n_per_m: 10.0 }];
    let error = elsewhere.record(phantom()).expect_err("no such patch");
    assert_eq!(error, SimError::NoSuchPlace { what: "patch", index: 7, count: 1 });
    elsewhere.phantom.seed += 1;
    assert!(matches!(elsewhere.record(phantom()), Err(SimError::OtherPhantom { .. })));
}

/// A gain common to all axes is a mere change of the modulus and a shift of the camera's frame shows in nothing; what
/// changes twice as much is twice as strong. Readings are rounded as they are written: to 2 % of a deviation in all.
#[test]
fn strength_is_what_a_recording_shows() {
    let strength = |effects: Vec<Effect>| {
        let mut world = world(effects);
        world.instruments.noise = Instruments::default().noise;
        let recording = world.record(phantom()).expect("a recording");
        world.strength(phantom(), &recording).expect("a strength").map(|s| s.net)
    };
    assert_eq!(strength(Vec::new()), None);
    let gain = strength(vec![Effect::Rig(Rig::ForceGain { gain: [1.1; 3] })]).expect("a number");
    assert!(gain < 0.05, "{gain}");
    let shift = Rig::CameraMisalignment { rotation_rad: [0.0; 3], translation_m: [5e-4, 0.0, 0.0] };
    let shift = strength(vec![Effect::Rig(shift)]).expect("a number");
    assert!(shift < 0.05, "{shift}");
    let scale = |scale| strength(vec![Effect::Rig(Rig::CameraScale { scale, depth_gain: 1.0 })]);
    let [one, two] = [1.02, 1.04].map(|s| scale(s).expect("a number"));
    assert!(one > 1.0 && (two - 2.0 * one).abs() < 0.15, "{one}, {two}");
}

/// One acts on the force alone, the other on the camera alone, and springs couple the two: beside another an effect is weaker than by itself.
#[test]
fn each_of_two_effects_has_a_strength_of_its_own() {
    let strength = |effects: Vec<Effect>| {
        let mut world = world(effects);
        world.instruments.noise = Instruments::default().noise;
        let recording = world.record(phantom()).expect("a recording");
        world.strength(phantom(), &recording).expect("a strength").expect("effects")
    };
    let gain = Effect::Rig(Rig::ForceGain { gain: [1.0, 1.0, 1.02] });
    let scale = Effect::Rig(Rig::CameraScale { scale: 1.3, depth_gain: 1.0 });
    let [weak, strong, both] = [vec![gain.clone()], vec![scale.clone()], vec![gain, scale]].map(strength);
    assert_eq!(weak.own, [("force-gain", weak.net)].into());
    assert!(strong.net > 5.0 * weak.net, "{weak:?} {strong:?}");
    for (id, alone) in [("force-gain", &weak), ("camera-scale", &strong)] {
        let share = both.own[id] / alone.net;
        assert!(share > 0.5 && share < 1.02, "{id}: {alone:?} {both:?}");
    }
    assert!(both.net > both.own["camera-scale"], "{both:?}");
}

/// What the operator states shows as what a phantom as stated would have done.
#[test]
fn a_wrong_statement_has_a_strength() {
    let mut world = world(Vec::new());
    world.instruments.noise = Instruments::default().noise;
    let recording = world.record(phantom()).expect("a recording");
    let mut strength = |stated| {
        world.stated_poisson_ratio = stated;
        world.strength(phantom(), &recording).expect("a strength").map_or(0.0, |s| s.net)
    };
    assert_eq!(strength(0.47), 0.0);
    let [near, far] = [0.46, 0.45].map(&mut strength);
    assert!(near > 1.0 && far > 1.7 * near, "{near}, {far}");
    // Beside an effect each has a strength of its own.
    world.stated_poisson_ratio = 0.45;
    world.effects = vec![Effect::Rig(Rig::CameraScale { scale: 1.02, depth_gain: 1.0 })];
    let recording = world.record(phantom()).expect("a recording");
    let both = world.strength(phantom(), &recording).expect("a strength").expect("two effects");
    let ids: Vec<&str> = both.own.keys().copied().collect();
    assert_eq!(ids, ["camera-scale", "poisson-ratio"]);
    let share = both.own["poisson-ratio"] / far;
    assert!(share > 0.2 && share < 1.02 && both.own["camera-scale"] < both.net, "{far} {both:?}");
}

/// What another modulus and other springs would have shown does not count.
#[test]
fn what_the_baseline_explains_is_no_strength() {
    let strength = |change: &dyn Fn(&mut World)| {
        // A gain of one changes nothing.
        let mut world = world(vec![Effect::Rig(Rig::ForceGain { gain: [1.0; 3] })]);
        world.instruments.noise = Instruments::default().noise;
        let mut changed = world.clone();
        change(&mut changed);
        let recording = changed.record(phantom()).expect("a recording");
        world.strength(phantom(), &recording).expect("a strength").map_or(0.0, |s| s.net)
    };
    let stiffness = |n_per_m| {
        move |world: &mut World| world.holds[0] = Hold::Springs { patch: 0, stiffness_n_per_m: n_per_m }
    };
    let softer = strength(&stiffness(147.0));
    let stiffer_phantom = strength(&|world| world.young_modulus_pa *= 1.02);
    let missing = strength(&stiffness(1e-3));
    assert!(softer < 0.1 && stiffer_phantom < 0.1, "{softer} {stiffer_phantom}");
    assert!(missing > 1.0, "{missing}");
}
