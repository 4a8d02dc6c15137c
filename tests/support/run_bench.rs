//! The bench on which runs are made here, without a phantom.

use phantom_rig::acquire::{Bench, Latency, LoadLimits, PhantomBox};
use phantom_rig::clock::HostTime;
use phantom_rig::device::{ForceSensor, Mounting, SensorMounting, Stage, StageLimits};
use phantom_rig::driver::{NativeStage, NetFt};
use phantom_rig::geometry::{Mat3, Vec3};
use phantom_rig::session::{
    ForceDocument, HashedText, MountingDocument, PhantomDocument, StageDocument, StartDocument, TipDocument,
    boot, utc_text,
};
use std::collections::BTreeMap;
use std::time::SystemTime;

/// Stage's first axis along x, its second down.
pub(crate) fn mounting() -> Mounting {
    Mounting::new([0.045, 0.075, 0.035], [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 1e-4).expect("two axes")
}

/// Axes as the phantom's.
pub(crate) fn sensor() -> SensorMounting {
    SensorMounting { to_phantom: Mat3::identity(), tip_m: Vec3::new(0.0, 0.0, -0.04), reads_reaction: true }
}

/// A bench with limits of force along each axis.
pub(crate) fn bench(force_limit_n: f64) -> Bench {
    Bench {
        limits: StageLimits {
            travel_m: [[5e-4, 0.03], [5e-4, 0.025]],
            speed_m_s: [0.02; 2],
            acceleration_m_s2: [0.5; 2],
            step_m: [1e-6; 2],
        },
        mounting: mounting(),
        tip_radius_m: 0.008,
        phantom: PhantomBox { low_m: [0.0; 3], high_m: [0.1, 0.15, 0.025] },
        surface_tolerance_m: 4e-4,
        clearance_m: 4e-3,
        run_up_m: 1e-3,
        travel_speed_m_s: 0.02,
        approach_speed_m_s: 0.008,
        acceleration_m_s2: 0.2,
        stop_deceleration_m_s2: 0.5,
        latency: Latency { sensor_s: 0.005, host_s: 0.005, serial_s: 0.002 },
        load: LoadLimits {
            sensor: sensor(),
            force_n: [force_limit_n; 3],
            torque_nm: 0.3,
            range: [30.0, 30.0, 60.0, 0.5, 0.5, 0.5],
        },
        stiffness_n_per_m: [100.0, 300.0],
        least_rest_s: 0.5,
        streams: Vec::new(),
    }
}

/// What a session on that bench begins with.
pub(crate) fn start_document(
    name: &str,
    protocol: &str,
    stage: &NativeStage,
    force: &NetFt,
) -> StartDocument {
    StartDocument {
        format: String::new(),
        name: name.to_owned(),
        segment: 0,
        first_poke: 1,
        started_utc: utc_text(SystemTime::now()),
        started_host_ns: HostTime::now().nanos(),
        boot: boot(),
        variables: BTreeMap::new(),
        program: "test".to_owned(),
        seeds: BTreeMap::new(),
        rig: HashedText::new("rig"),
        protocol: HashedText::new(protocol),
        stage: Some(StageDocument::new(stage.identity(), stage.limits())),
        force: Some(ForceDocument::new(force.identity(), force.format())),
        markers: None,
        camera: None,
        calibration: None,
        mounting: Some(MountingDocument {
            origin_m: [0.045, 0.075, 0.035],
            axes: [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
            tolerance_m: 1e-4,
            sensor_to_phantom: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            sensor_to_tip_m: [0.0, 0.0, -0.04],
            reads_reaction: true,
        }),
        tip: TipDocument {
            contact: "bonded".to_owned(),
            shape: "pad".to_owned(),
            radius_m: 0.008,
            sphere_radius_m: None,
        },
        phantom: PhantomDocument {
            description: "none".to_owned(),
            mesh: None,
            mesh_sha256: None,
            poisson_ratio: 0.47,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
        },
    }
}
