//! Whether a camera's clock is in step: late by so little that no physics was left out.
//!
//! Clocks of cameras, sensors and stages are put together from what they recorded, and a recording does not say how well: two milliseconds are
//! asked of a rig. A lag below that is told, and not blamed.

use super::knob::Knob;
use super::physics::Physics;
use super::refit::Fitted;
use super::select::Tried;

/// A camera that is late by less than this (s) is not blamed.
const IN_STEP_S: f64 = 2e-3;

/// The camera's lag (s) in a reading, if it is no more than that; `base` of its values come before its knobs'.
pub(super) fn lag_in_step(reading: &Tried, base: usize) -> Option<f64> {
    let Fitted { acting, at, .. } = &reading.fitted;
    let lag = acting.knobs.iter().position(|knob| matches!(knob, Knob::Lag))?;
    Some(at[base + lag]).filter(|lag_s| lag_s.abs() < IN_STEP_S)
}

/// The effects of a reading that may be blamed.
pub(super) fn blamed(reading: &Tried, base: usize) -> Vec<Physics> {
    let in_step = lag_in_step(reading, base).is_some();
    reading.physics.iter().copied().filter(|p| !in_step || *p != Physics::CameraLag).collect()
}

/// What is said of it.
pub(super) fn said(lag_s: f64) -> String {
    format!(
        "a camera that is late by {:.1} ms explains some of it: less than {:.0} ms is not blamed: clocks that were put together may differ by that",
        1e3 * lag_s,
        1e3 * IN_STEP_S
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn a_clock_in_step_is_not_blamed() {
        let (drying, lag) = (Physics::Drying, Physics::CameraLag);
        for (lag_s, expected) in
            [(9e-4, &[drying][..]), (-9e-4, &[drying]), (3e-3, &[drying, lag]), (-3e-3, &[drying, lag])]
        {
            let mut fitted = Fitted::that_costs(1.0);
            fitted.acting.knobs = vec![Knob::Drying, Knob::Lag];
            fitted.at = DVector::from_vec(vec![9.0, 1e-4, lag_s]);
            let reading = Tried { physics: vec![drying, lag], fitted };
            assert_eq!(blamed(&reading, 1), expected);
            assert_eq!(lag_in_step(&reading, 1), (expected.len() == 1).then_some(lag_s));
        }
        let without = Tried { physics: vec![drying], fitted: Fitted::that_costs(1.0) };
        assert_eq!((lag_in_step(&without, 0), blamed(&without, 0)), (None, vec![drying]));
        assert!(said(9e-4).contains("by 0.9 ms") && said(9e-4).contains("less than 2 ms"), "{}", said(9e-4));
    }
}
