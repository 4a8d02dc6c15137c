//! Where metres become the wire's nanometres and micrometres and back: each way once, here.

use crate::clock::HostTime;
use crate::device::{AXES, DeviceError, Motion, StageLimits, StageReport, StageState};
use firmware_proto::{Activity, AxisLimits, AxisSet, Fault, Request, State};

/// Relative excess over a limit that is rounding.
const ROUNDING: f64 = 1e-9;

// Divided, not multiplied by a thousandth part: a decimal limit then is the same number as its literal.
const NM_IN_M: f64 = 1e9;
const UM_IN_M: f64 = 1e6;
const MM_IN_M: f64 = 1e3;

pub(super) fn from_nm(nm: i64) -> f64 {
    nm as f64 / NM_IN_M
}

/// Also speeds and accelerations.
pub(super) fn from_um(um: i64) -> f64 {
    um as f64 / UM_IN_M
}

pub(super) fn limits(axes: &[AxisLimits; AXES]) -> StageLimits {
    StageLimits {
        travel_m: axes.map(|axis| [axis.travel_low_um, axis.travel_high_um].map(|um| from_um(um.into()))),
        speed_m_s: axes.map(|axis| from_um(axis.max_speed_um_s.into())),
        acceleration_m_s2: axes.map(|axis| from_um(axis.max_acceleration_um_s2.into())),
        step_m: axes.map(|axis| f64::from(axis.per_mm) / (f64::from(axis.steps.max(1)) * MM_IN_M)),
    }
}

pub(super) fn position_m(state: &State) -> [f64; AXES] {
    state.position_nm.map(|nm| from_nm(nm.into()))
}

pub(super) fn report(state: &State, tick_us: u32, host: HostTime) -> StageReport {
    StageReport {
        host,
        tick_us: Some(tick_us),
        position_m: position_m(state),
        state: match (state.fault, state.activity) {
            (Fault::None, Activity::Idle) => StageState::Idle,
            (Fault::None, Activity::Homing) => StageState::Homing,
            (Fault::None, Activity::Moving | Activity::Jogging | Activity::Stopping) => StageState::Moving,
            (fault, _) => StageState::Fault { code: fault as u8 },
        },
        homed: state.homed == AxisSet::ALL,
    }
}

/// The request for a motion from a position (m), or what is wrong with it.
///
/// # Errors
/// Outside the travel, or too fast for an axis.
pub(super) fn request(
    motion: &Motion,
    number: u32,
    from_m: [f64; AXES],
    limits: &StageLimits,
) -> Result<Request, DeviceError> {
    if let Some(axis) = limits.outside(motion.target_m) {
        let (target_m, travel_m) = (motion.target_m[axis], limits.travel_m[axis]);
        return Err(DeviceError::OutsideTravel { axis, target_m, travel_m });
    }
    let way: [f64; AXES] = std::array::from_fn(|axis| motion.target_m[axis] - from_m[axis]);
    let length = way[0].hypot(way[1]);
    // Rounded down: up may be past the limit, where the controller refuses.
    let whole = |asked: f64| (asked * UM_IN_M * (1.0 + ROUNDING)).floor();
    let along = |what, unit, asked: f64, most: [f64; AXES]| {
        for axis in 0..AXES {
            // Without a way, no axis has a part in it; the speed has to be one all the same.
            let part = if length > 0.0 { asked * (way[axis].abs() / length) } else { 0.0 };
            let sound = asked.is_finite() && whole(asked) >= 1.0;
            if !(sound && part <= most[axis] * (1.0 + ROUNDING)) {
                let asked = if part > 0.0 { part } else { asked };
                return Err(DeviceError::TooFast { what, axis, asked, most: most[axis], unit });
            }
        }
        Ok(whole(asked) as u32)
    };
    Ok(Request::Move {
        motion: number,
        target_nm: motion.target_m.map(|m| (m * NM_IN_M).round() as i32),
        speed_um_s: along("speed", "m/s", motion.speed_m_s, limits.speed_m_s)?,
        acceleration_um_s2: along(
            "acceleration",
            "m/s²",
            motion.acceleration_m_s2,
            limits.acceleration_m_s2,
        )?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXIS: AxisLimits = AxisLimits {
        travel_low_um: 500,
        travel_high_um: 50_000,
        max_speed_um_s: 20_000,
        max_acceleration_um_s2: 200_000,
        steps: 1600,
        per_mm: 1,
    };

    fn motion(target_m: [f64; 2], speed_m_s: f64, acceleration_m_s2: f64) -> Motion {
        Motion { target_m, speed_m_s, acceleration_m_s2 }
    }

    fn ask(motion: Motion) -> Result<Request, DeviceError> {
        request(&motion, 7, [0.01, 0.01], &limits(&[AXIS; 2]))
    }

    #[test]
    fn limits_are_those_numbers_in_metres() {
        let limits = limits(&[AXIS, AxisLimits { steps: 200, per_mm: 3, ..AXIS }]);
        assert_eq!(limits.travel_m, [[0.0005, 0.05]; 2]);
        assert_eq!((limits.speed_m_s, limits.acceleration_m_s2), ([0.02; 2], [0.2; 2]));
        assert_eq!(limits.step_m, [0.625e-6, 15e-6]);
    }

    #[test]
    fn a_motion_at_the_very_limits_is_asked_in_whole_units() {
        let asked = ask(motion([0.05, 0.01], 0.02, 0.2)).expect("within the limits");
        let expected = Request::Move {
            motion: 7,
            target_nm: [50_000_000, 10_000_000],
            speed_um_s: 20_000,
            acceleration_um_s2: 200_000,
        };
        assert_eq!(asked, expected);
    }

    /// Along a diagonal each axis has 1/√2 of the speed, so √2 times its limit is allowed, and no more.
    #[test]
    fn a_limit_is_one_of_an_axis_not_of_the_path() {
        let diagonal = 2.0_f64.sqrt() * 0.02;
        assert!(ask(motion([0.02, 0.02], diagonal, 0.2)).is_ok());
        let error = ask(motion([0.02, 0.02], diagonal * 1.001, 0.2)).expect_err("too fast");
        assert!(matches!(error, DeviceError::TooFast { what: "speed", axis: 0, most: 0.02, .. }), "{error}");
    }

    /// Along (1, 2) an axis has 2/√5 of the acceleration: at its limit that is 223 606.8 µm/s², of which 223 607 would be too many.
    #[test]
    fn a_motion_at_the_limit_of_an_axis_is_not_rounded_past_it() {
        let at_limit = 0.2 * 5.0_f64.sqrt() / 2.0;
        let Ok(Request::Move { acceleration_um_s2, speed_um_s, .. }) =
            ask(motion([0.02, 0.03], at_limit / 10.0, at_limit))
        else {
            panic!("within the limits")
        };
        assert_eq!((speed_um_s, acceleration_um_s2), (22_360, 223_606));
        // What is a whole number but for rounding stays one.
        let asked = ask(motion([0.02, 0.01], 0.0023 - 1e-18, 0.1));
        assert!(matches!(asked, Ok(Request::Move { speed_um_s: 2300, .. })), "{asked:?}");
    }

    #[test]
    fn what_no_axis_can_do_is_refused_here() {
        for bad in [0.0, -0.01, 1e-7, f64::NAN, f64::INFINITY] {
            let error = ask(motion([0.02, 0.01], bad, 0.2)).expect_err("no speed");
            assert!(matches!(error, DeviceError::TooFast { what: "speed", .. }), "{bad}: {error}");
            let error = ask(motion([0.01, 0.01], 0.01, bad)).err();
            assert!(matches!(error, Some(DeviceError::TooFast { what: "acceleration", .. })), "{bad}");
        }
        let error = ask(motion([0.02, 0.0501], 0.01, 0.1)).expect_err("outside");
        assert!(matches!(error, DeviceError::OutsideTravel { axis: 1, .. }), "{error}");
    }
}
