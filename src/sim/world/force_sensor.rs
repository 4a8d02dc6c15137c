//! What the force sensor reports of the tip's force.

use super::effect::Effect;
use super::foreign::Foreign;
use super::happened::Happened;
use super::plan::World;
use super::rig::Rig;
use crate::geometry::Vec3;
use crate::observation::Wrench;
use crate::sim::instruments::{FORCE_DIGITS, TORQUE_DIGITS, Wanderer, normal, rounded, row_times};
use crate::sim::seed::{Use, stream};
use rand_chacha::ChaCha12Rng;
use std::f64::consts::TAU;

/// Rows of the sensor.
pub(super) fn wrench(world: &World, course: &Happened, end_s: f64) -> Wrench {
    let rate_hz = world.instruments.sensor_rate_hz;
    let mut sensor = ForceSensor::new(world, rate_hz);
    let mut wrench = Wrench { time_s: row_times(rate_hz, end_s), ..Wrench::default() };
    for &t in &wrench.time_s {
        let (force, torque) = sensor.read(world, course.force_at(t), t);
        wrench.force_n.push(force.map(|f| rounded(f, FORCE_DIGITS)).into());
        wrench.torque_nm.push(torque.map(|m| rounded(m, TORQUE_DIGITS)).into());
    }
    wrench
}

/// The sensor with its noise. A pad's traction is uniform, so its moment about the tip's centre is nothing but noise.
pub(super) struct ForceSensor {
    rng: ChaCha12Rng,
    wanderer: Option<(f64, Wanderer)>,
}

impl ForceSensor {
    /// At rest; it is read `rate_hz` times a second.
    pub(super) fn new(world: &World, rate_hz: f64) -> Self {
        let mut rng = stream(world.seed, Use::Wrench);
        let wander = world.instruments.wander;
        let wanderer = wander.map(|w| (w.force_n, Wanderer::new(&w, 1.0 / rate_hz, &mut rng)));
        Self { rng, wanderer }
    }

    /// What it reads of a force of the tip (N) at a time: force (N) and moment about the tip's centre (N·m).
    pub(super) fn read(&mut self, world: &World, force: Vec3, time_s: f64) -> (Vec3, Vec3) {
        let (noise, rng) = (&world.instruments.noise, &mut self.rng);
        let offset = self.wanderer.as_mut().map_or([0.0; 3], |(sd, w)| w.step(rng).map(|x| x * *sd));
        let error: [f64; 3] = std::array::from_fn(|c| offset[c] + noise.force_n[c] * normal(rng));
        let reading = sensed(world, force, time_s) + Vec3::from(error);
        let torque: [f64; 3] = std::array::from_fn(|c| noise.torque_nm[c] * normal(rng));
        (clipped(world, reading), torque.into())
    }
}

/// The sensor's answer to a force (N) at a time, without noise.
fn sensed(world: &World, mut force: Vec3, time_s: f64) -> Vec3 {
    for effect in &world.effects {
        match *effect {
            Effect::Rig(Rig::ForceGain { gain }) => force.component_mul_assign(&Vec3::from(gain)),
            Effect::Rig(Rig::ForceDrift { rate_n_per_s }) => force += Vec3::from(rate_n_per_s) * time_s,
            Effect::Foreign(Foreign::ForceCurvature { scale_n }) => {
                force.apply(|f| *f *= 1.0 - (*f / scale_n).powi(2));
            }
            Effect::Foreign(Foreign::ForceHum { amplitude_n, frequency_hz }) => {
                force.add_scalar_mut(amplitude_n * (TAU * frequency_hz * time_s).sin());
            }
            _ => {}
        }
    }
    force
}

/// What the sensor can show of a reading (N).
fn clipped(world: &World, mut reading: Vec3) -> Vec3 {
    for effect in &world.effects {
        if let Effect::Foreign(Foreign::ForceSaturation { limit_n }) = *effect {
            reading.apply(|f| *f = f.clamp(-limit_n, limit_n));
        }
    }
    reading
}
