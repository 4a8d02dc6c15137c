//! What stage is emulated: its firmware's configuration, where its switches and ends truly are, its line.

use crate::device::AXES;
use firmware_proto::{AxisLimits, Config, HomingConfig, Name, ResetCause};
use std::time::Duration;

/// The stage to emulate. Places are metres along each axis; homing makes the controller's zero where the low switch trips.
#[derive(Debug, Clone, PartialEq)]
pub struct NativeStageSetup {
    /// What the firmware knows of its stage.
    pub firmware: Config,
    /// Where the low and the high limit switch trip (m).
    pub switches_m: [[f64; 2]; AXES],
    /// Where the axis runs into its ends (m); steps beyond are lost.
    pub ends_m: [[f64; 2]; AXES],
    /// Where the stage stands when power comes (m).
    pub start_m: [f64; AXES],
    /// How long it takes from a reset until the controller listens.
    pub boot: Duration,
    /// The controller's clock after a reset (µs): 0 in life; near 2³² to see it wrap.
    pub first_tick_us: u32,
    /// How much faster than the host's clock the controller's runs (10⁻⁶).
    pub clock_ppm: f64,
    /// Bytes a second that the line carries each way (11 520 at 115 200 baud); as many as come when there is none, as USB does.
    pub line_bytes_s: Option<f64>,
    /// The number of another table of messages that the firmware claims to be made from.
    pub other_schema: Option<u64>,
    /// Seed of the faults' randomness.
    pub seed: u64,
}

impl Default for NativeStageSetup {
    /// 50 mm along each axis, 0.625 µm a step, up to 20 mm/s; standing 5 mm above the low switches, behind a line of 115 200 baud.
    fn default() -> Self {
        let axis = AxisLimits {
            travel_low_um: 500,
            travel_high_um: 50_000,
            max_speed_um_s: 20_000,
            max_acceleration_um_s2: 500_000,
            steps: 1600,
            per_mm: 1,
        };
        Self {
            firmware: Config {
                axes: [axis; AXES],
                emergency_um_s2: 500_000,
                homing: HomingConfig {
                    fast_um_s: 10_000,
                    slow_um_s: 1000,
                    acceleration_um_s2: 200_000,
                    back_off_um: 500,
                },
                unhomed_speed_um_s: 1000,
                unhomed_distance_um: 2000,
                name: Name::new("emulated stage"),
                firmware_hash: 0x0123_4567_89AB_CDEF,
                boot_count: 1,
                reset_cause: ResetCause::PowerOn,
            },
            switches_m: [[0.0, 0.0510]; AXES],
            ends_m: [[-0.001, 0.0515]; AXES],
            start_m: [0.005; AXES],
            boot: Duration::ZERO,
            first_tick_us: 0,
            clock_ppm: 0.0,
            line_bytes_s: Some(11_520.0),
            other_schema: None,
            seed: 0,
        }
    }
}
