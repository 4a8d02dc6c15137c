//! What does the reference firmware have to know of its stage, and which stages does it refuse to drive?

use crate::message::{AXES, AxisLimits, Name, ResetCause};
use crate::profile::round;

/// Furthest position that nanometres in an i32 can tell, µm.
const FURTHEST_UM: i64 = i32::MAX as i64 / 1000;

/// Nanometres in a millimetre.
const NM_PER_MM: i128 = 1_000_000;

impl AxisLimits {
    /// Position in nm of a position in steps, rounded to nearest; the ends of i32 stand for what lies beyond.
    #[must_use]
    pub fn nm(&self, steps: i32) -> i32 {
        let nm =
            nearest(i128::from(steps) * i128::from(self.per_mm) * NM_PER_MM, i128::from(self.steps.max(1)));
        nm.clamp(i32::MIN.into(), i32::MAX.into()) as i32
    }

    /// Position in steps of a position in nm, rounded to nearest; the ends of i32 stand for what lies beyond.
    #[must_use]
    pub fn steps_at(&self, nm: i64) -> i32 {
        let steps =
            nearest(i128::from(nm) * i128::from(self.steps), i128::from(self.per_mm.max(1)) * NM_PER_MM);
        steps.clamp(i32::MIN.into(), i32::MAX.into()) as i32
    }

    /// Length of one step, nm.
    pub(crate) fn step_nm(&self) -> f64 {
        f64::from(self.per_mm) * NM_PER_MM as f64 / f64::from(self.steps.max(1))
    }

    /// Lowest and highest position, nm.
    pub(crate) fn travel_nm(&self) -> [i64; 2] {
        [i64::from(self.travel_low_um) * 1000, i64::from(self.travel_high_um) * 1000]
    }
}

fn nearest(numerator: i128, denominator: i128) -> i128 {
    let half = if numerator < 0 { -denominator / 2 } else { denominator / 2 };
    (numerator + half) / denominator
}

/// How low switches are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HomingConfig {
    /// Speed of the first approach, µm/s.
    pub fast_um_s: u32,
    /// Speed of the touch that sets zero, µm/s.
    pub slow_um_s: u32,
    /// Acceleration and deceleration, µm/s².
    pub acceleration_um_s2: u32,
    /// Way back from the switch, µm; more than the first approach overruns it.
    pub back_off_um: u32,
}

/// The stage and its controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// Both axes. Positions count from where the low switch trips: travel should begin above its hysteresis.
    pub axes: [AxisLimits; AXES],
    /// Deceleration along the path after the emergency pattern, µm/s², no more than either axis may have: an axis
    /// that brakes harder loses steps, and position with them. A motion that decelerates faster anyway keeps its own.
    pub emergency_um_s2: u32,
    /// Homing.
    pub homing: HomingConfig,
    /// Largest speed of a jog before homing, µm/s.
    pub unhomed_speed_um_s: u32,
    /// How far jogs before homing may lead from where position was lost, µm.
    pub unhomed_distance_um: u32,
    /// Name of device and firmware.
    pub name: Name,
    /// Hash of the firmware's image.
    pub firmware_hash: u64,
    /// Boots so far. Why it must differ from boot to boot (kept in flash, or random): it is what tells a late
    /// HELLO of an earlier boot from one of this boot.
    pub boot_count: u32,
    /// Why the device last booted.
    pub reset_cause: ResetCause,
}

/// A setting outside its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigError {
    /// The setting, named as in [`Config`].
    pub setting: &'static str,
    /// Axis concerned, if it concerns one.
    pub axis: Option<usize>,
    /// Its value, in its unit.
    pub value: i64,
    /// Smallest and largest value allowed, in the same unit.
    pub bounds: [i64; 2],
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, to: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let [low, high] = self.bounds;
        write!(to, "{} is {}, allowed {low} to {high}", self.setting, self.value)?;
        self.axis.map_or(Ok(()), |axis| write!(to, " (axis {axis})"))
    }
}

impl core::error::Error for ConfigError {}

impl Config {
    /// Whether the reference firmware can drive this stage.
    ///
    /// # Errors
    /// Names the first setting outside its bounds.
    pub fn check(&self) -> Result<(), ConfigError> {
        // 10 m/s and 1000 m/s²: beyond any bench stage, and within what the arithmetic of profiles holds.
        const SPEEDS: [i64; 2] = [1, 10_000_000];
        const ACCELERATIONS: [i64; 2] = [1, 1_000_000_000];
        for (axis, limits) in self.axes.iter().enumerate() {
            let of = Some(axis);
            within("travel_low_um", of, limits.travel_low_um, [-FURTHEST_UM, FURTHEST_UM])?;
            let above = [i64::from(limits.travel_low_um) + 1, FURTHEST_UM];
            within("travel_high_um", of, limits.travel_high_um, above)?;
            within("max_speed_um_s", of, limits.max_speed_um_s, SPEEDS)?;
            within("max_acceleration_um_s2", of, limits.max_acceleration_um_s2, ACCELERATIONS)?;
            let acceleration = [1, i64::from(limits.max_acceleration_um_s2)];
            within("emergency_um_s2", of, self.emergency_um_s2, acceleration)?;
            within("per_mm", of, limits.per_mm, [1, 1000])?;
            within("steps", of, limits.steps, [1, 1 << 24])?;
            // A quarter of i32: way and way back between any two places never leave it.
            for end in limits.travel_nm() {
                within("travel in steps", of, limits.steps_at(end), [-(1 << 29), 1 << 29])?;
            }
            let speed = [1, i64::from(limits.max_speed_um_s)];
            within("fast_um_s", of, self.homing.fast_um_s, speed)?;
            within("slow_um_s", of, self.homing.slow_um_s, [1, i64::from(self.homing.fast_um_s)])?;
            within("unhomed_speed_um_s", of, self.unhomed_speed_um_s, speed)?;
            within("unhomed_distance_um", of, self.unhomed_distance_um, [0, FURTHEST_UM])?;
            within("acceleration_um_s2", of, self.homing.acceleration_um_s2, acceleration)?;
            // The way back clears the overrun v²/2a and a step at least.
            let fast = f64::from(self.homing.fast_um_s);
            let overrun = fast * fast / (2.0 * f64::from(self.homing.acceleration_um_s2));
            let least = round(overrun) + round(limits.step_nm() / 1000.0) + 1;
            within("back_off_um", of, self.homing.back_off_um, [least, FURTHEST_UM])?;
        }
        Ok(())
    }
}

fn within(
    setting: &'static str,
    axis: Option<usize>,
    value: impl Into<i64>,
    bounds: [i64; 2],
) -> Result<(), ConfigError> {
    let value = value.into();
    if (bounds[0]..=bounds[1]).contains(&value) {
        Ok(())
    } else {
        Err(ConfigError { setting, axis, value, bounds })
    }
}
