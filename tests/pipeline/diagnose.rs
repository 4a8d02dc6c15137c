//! The virtual bench with an effect switched on, recorded, and diagnosed: the effect is named, with its parameters; and
//! nothing is named where nothing acts.

use phantom_rig::diagnose::{Diagnosis, Physics, Reading, Settings, diagnose};
use phantom_rig::inverse;
use phantom_rig::sim::{Effect, Hold, Memory, Phantom, PronyTerm, Rig, World, stock};
use std::sync::OnceLock;

/// One phantom for all tests: making it ready takes longer than everything after it.
fn phantom() -> &'static Phantom {
    static PHANTOM: OnceLock<Phantom> = OnceLock::new();
    PHANTOM.get_or_init(|| Phantom::prepare(&stock(7, 0)).expect("a phantom of the stock"))
}

/// A session with these effects: seven pokes, one spring, white noise.
fn diagnosed(seed: u64, effects: Vec<Effect>) -> (World, Diagnosis) {
    let mut world = World::draw(seed, 7, 1);
    world.stated_poisson_ratio = world.phantom.poisson_ratio;
    world.holds = vec![Hold::Springs { patch: 0, stiffness_n_per_m: 120.0 }];
    world.instruments.wander = None;
    for poke in &mut world.pokes {
        poke.direction = world.phantom.sites[poke.site].inward;
    }
    world.effects = effects;
    let recording = world.record(phantom()).expect("a recording");
    let fit = inverse::Settings { quick: true, ..inverse::Settings::default() };
    let settings = Settings { fit, ..Settings::default() };
    let diagnosis = diagnose(&recording, &settings, &mut |_| {}).expect("a diagnosis");
    (world, diagnosis)
}

fn parameter(diagnosis: &Diagnosis, physics: Physics, id: &str) -> f64 {
    let found = diagnosis.parameters.iter().find(|f| f.physics == physics).expect("named");
    found.parameters.iter().find(|p| p.id == id).expect("a parameter").values[0].value
}

#[track_caller]
fn assert_close(value: f64, truth: f64, relative: f64) {
    assert!((value / truth - 1.0).abs() < relative, "{value} for {truth}");
}

#[test]
fn nothing_is_named_where_nothing_acts() {
    let (_, diagnosis) = diagnosed(11, Vec::new());
    assert!(!diagnosis.mismatch.detected, "{:?}", diagnosis.mismatch);
    assert!(diagnosis.verdict.physics.is_empty() && !diagnosis.verdict.unexplained);
    assert_eq!(diagnosis.extended, diagnosis.baseline);
}

#[test]
fn relaxation_is_named_and_the_modulus_becomes_the_one_at_equilibrium() {
    let term = PronyTerm { relaxed_fraction: 0.2, time_constant_s: 3.0 };
    let (world, diagnosis) = diagnosed(12, vec![Effect::Memory(Memory::Relaxation { terms: vec![term] })]);
    assert_eq!(diagnosis.verdict.physics, [Physics::ViscoelasticRelaxation]);
    assert_close(parameter(&diagnosis, Physics::ViscoelasticRelaxation, "relaxed_fraction"), 0.2, 0.05);
    assert_close(parameter(&diagnosis, Physics::ViscoelasticRelaxation, "time_constant_s"), 3.0, 0.05);
    assert_close(diagnosis.extended.young_modulus_pa.value, world.young_modulus_pa, 0.02);
    let beyond_noise = |reading: Reading| reading.held_out_chi2_per_dof - 1.0;
    let (before, after) = (beyond_noise(diagnosis.baseline), beyond_noise(diagnosis.extended));
    assert!(before > 0.05 && after < 0.2 * before, "{before} {after}");
}

#[test]
fn a_late_camera_is_named() {
    let (world, diagnosis) = diagnosed(13, vec![Effect::Rig(Rig::CameraLag { lag_s: 0.08 })]);
    assert_eq!(diagnosis.verdict.physics, [Physics::CameraLag]);
    assert_close(parameter(&diagnosis, Physics::CameraLag, "lag_s"), 0.08, 0.05);
    assert_close(diagnosis.extended.young_modulus_pa.value, world.young_modulus_pa, 0.02);
}
