//! The simulated bench as a plan sees it: slab of 100 × 150 × 25 mm, first axis along x, second down into it.

use super::{Bench, Latency, LoadLimits, PhantomBox, Plan, Stream, pad_stiffness_n_per_m};
use crate::acquire::protocol::Protocol;
use crate::device::{Mounting, SensorMounting, StageLimits};
use crate::geometry::{Mat3, Vec3};

pub(super) const START_M: [f64; 2] = [0.0, 0.0];

/// The tip at (−20, 75, 45) mm where the stage homes; travel 145 and 35 mm.
pub(super) fn bench() -> Bench {
    let mounting =
        Mounting::new([-0.02, 0.075, 0.045], [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 1e-4).expect("two axes");
    Bench {
        limits: StageLimits {
            travel_m: [[0.0, 0.145], [0.0, 0.035]],
            speed_m_s: [0.05; 2],
            acceleration_m_s2: [0.5; 2],
            step_m: [1.25e-6; 2],
        },
        mounting,
        tip_radius_m: 0.008,
        phantom: PhantomBox { low_m: [0.0; 3], high_m: [0.1, 0.15, 0.025] },
        surface_tolerance_m: 4e-4,
        clearance_m: 5e-3,
        run_up_m: 1e-3,
        travel_speed_m_s: 0.03,
        approach_speed_m_s: 0.008,
        acceleration_m_s2: 0.2,
        stop_deceleration_m_s2: 0.5,
        latency: Latency { sensor_s: 0.028, host_s: 0.005, serial_s: 0.001 },
        load: LoadLimits {
            sensor: SensorMounting {
                to_phantom: Mat3::identity(),
                tip_m: Vec3::new(0.0, 0.0, -0.04),
                reads_reaction: true,
            },
            force_n: [5.0; 3],
            torque_nm: 0.3,
            range: [30.0, 30.0, 60.0, 0.5, 0.5, 0.5],
        },
        stiffness_n_per_m: pad_stiffness_n_per_m([5e3, 2e4], 0.47, 0.008, 0.025).expect("slender"),
        least_rest_s: 1.0,
        streams: vec![
            Stream { name: "force", rate_hz: 1000.0, bytes: 36.0 },
            Stream { name: "stage", rate_hz: 50.0, bytes: 40.0 },
            Stream { name: "markers", rate_hz: 30.0, bytes: 2640.0 },
        ],
    }
}

/// The plan of a protocol with these steps.
pub(super) fn plan(steps: &str, bench: &Bench) -> Plan {
    let text = format!(
        "format = \"phantom-protocol/1\"\nname = \"n\"\n[defaults]\nspeed_mm_s = 2\ndepth_mm = 3\n{steps}"
    );
    let protocol = Protocol::parse("p.toml", &text, &[]).expect("sound");
    Plan::new(protocol.name(), &protocol.expand(), bench, START_M)
}

/// A poke in the middle, with further keys.
pub(super) fn poke(rest: &str) -> String {
    format!("[[step]]\nkind = \"poke\"\nsite_mm = [50, 75, 25]\n{rest}\n")
}
