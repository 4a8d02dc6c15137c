//! What a machine's own settings (`$$`) say about its two axes: limits of travel, speed and acceleration, resolution, how long homing
//! may take.
//!
//! `$100…` steps/mm, `$110…` mm/min, `$120…` mm/s², `$130…` mm, each counting the axes in their order (gnea/grbl,
//! doc/markdown/settings.md) → SI. Stage coordinates are Grbl's machine coordinates: zero where the limit switch trips (or, on a
//! machine that is built so, where homing ends), and travel on the other side of it.

use super::connect::Axes;
use super::line::Dialect;
use crate::device::{AXES, StageLimits};
use std::collections::BTreeMap;
use std::time::Duration;

/// A setting that this driver cannot work with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unfit {
    pub(super) setting: u16,
    /// As it is, when there is one.
    pub(super) value: Option<f64>,
    pub(super) expected: &'static str,
}

/// What a machine says about itself.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Machine {
    pub(super) limits: StageLimits,
    /// Decimals of a millimetre that tell one step from the next, by axis.
    pub(super) decimals: [usize; AXES],
    /// How long homing may take.
    pub(super) homing: Duration,
    /// Whether a stop through the safety door would make it park, that is, move (grblHAL).
    pub(super) parks: bool,
}

/// The delay ($1, ms) that stands for keeping the motors' current for good.
const KEPT_ON: f64 = 255.0;
const POWERED: &str = "255, so that motors keep their current and hold the tip between motions: send $1=255 to the controller \
    (grblHAL: or $37 with the bits of both axes)";
/// Farther than the travel by this factor a limit switch is not searched for (both firmwares).
const SEARCH: f64 = 1.5;
/// Farther than the pull-off by this factor a switch is not approached the second time.
const LOCATE: f64 = 5.0;

impl Machine {
    /// Whether nothing that [`Machine::from_settings`] cannot do without is missing.
    pub(super) fn tells_all(settings: &BTreeMap<u16, f64>, axes: &Axes) -> bool {
        let by_axis = |index: &usize| [100, 110, 120, 130].map(|first| first + *index as u16);
        let single = [1, 13, 21, 22, 23, 27].into_iter();
        single.chain(axes.index.iter().flat_map(by_axis)).all(|setting| settings.contains_key(&setting))
    }

    /// From settings by number. `zero_at_home`: the firmware is built to call the homed position zero.
    pub(super) fn from_settings(
        settings: &BTreeMap<u16, f64>,
        axes: &Axes,
        dialect: Dialect,
        zero_at_home: bool,
    ) -> Result<Self, Unfit> {
        let get = |setting, expected| {
            settings.get(&setting).copied().ok_or(Unfit { setting, value: None, expected })
        };
        let positive = |setting, expected| {
            let value = get(setting, expected)?;
            if value > 0.0 { Ok(value) } else { Err(Unfit { setting, value: Some(value), expected }) }
        };
        let or_zero = |setting| settings.get(&setting).copied().unwrap_or(0.0);
        let inches = get(13, "0: reports in millimetres")?;
        if inches != 0.0 {
            return Err(Unfit { setting: 13, value: Some(inches), expected: "0: reports in millimetres" });
        }
        let bits = |setting| or_zero(setting) as u32;
        // Without current a motor gives way to what is poked, and steps are lost that nobody counts. grblHAL can keep it axis by axis.
        let kept = dialect == Dialect::Hal && axes.index.iter().all(|index| bits(37) >> index & 1 == 1);
        let idle_delay = settings.get(&1).copied();
        if !kept && idle_delay != Some(KEPT_ON) {
            return Err(Unfit { setting: 1, value: idle_delay, expected: POWERED });
        }
        // grblHAL has a bit in $22 for what Grbl has a compile-time option for.
        let zero_at_home = zero_at_home || get(22, "how it homes")? as u32 & 8 != 0;
        let hard_limits = get(21, "whether hard limits are on")? as u32 & 1 != 0;
        let low_ends = get(23, "the directions of homing")? as u32;
        let pull_off = get(27, "the pull-off of homing in mm")?;

        let mut limits = StageLimits {
            travel_m: [[0.0; 2]; AXES],
            speed_m_s: [0.0; AXES],
            acceleration_m_s2: [0.0; AXES],
            step_m: [0.0; AXES],
        };
        let mut decimals = [0; AXES];
        for (axis, &index) in axes.index.iter().enumerate() {
            let number = u16::try_from(index).unwrap_or(u16::MAX);
            let steps_per_mm = positive(100 + number, "steps per millimetre")?;
            let travel = positive(130 + number, "the travel in millimetres")?;
            let at_low_end = low_ends >> index & 1 == 1;
            // Where hard limits are on, going back to the switch would trip it: the homed position, a pull-off away, is the end.
            let clear = if hard_limits && !zero_at_home { pull_off } else { 0.0 };
            let travel_mm = match (zero_at_home, at_low_end) {
                (true, true) => [0.0, travel],
                (false, true) => [-travel + clear, 0.0],
                (true, false) => [-travel, 0.0],
                (false, false) => [-travel, -clear],
            };
            limits.travel_m[axis] = travel_mm.map(|mm| mm * 1e-3);
            limits.speed_m_s[axis] = positive(110 + number, "the highest speed in mm/min")? / 60e3;
            limits.acceleration_m_s2[axis] = positive(120 + number, "the acceleration in mm/s²")? * 1e-3;
            limits.step_m[axis] = 1e-3 / steps_per_mm;
            // One digit more than a step has, within what single precision holds.
            decimals[axis] = (steps_per_mm.log10().ceil().max(0.0) as usize + 1).clamp(3, 5);
        }

        let rate =
            |setting, usual| settings.get(&setting).copied().filter(|r| *r > 0.0).unwrap_or(usual) / 60.0;
        let (locate, seek) = (rate(24, 25.0), rate(25, 500.0));
        // Axes may home one after the other, those that are not ours as well.
        let seconds: f64 = (0..axes.count as u16)
            .map(|axis| {
                SEARCH * or_zero(130 + axis) / seek + LOCATE * pull_off / locate + 3.0 * pull_off / seek
            })
            .sum();
        Ok(Self {
            limits,
            decimals,
            homing: Duration::from_secs_f64((1.5 * seconds + 5.0).clamp(5.0, 1800.0)),
            parks: bits(41) & 1 != 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the documentation, for X and Z.
    fn published() -> (BTreeMap<u16, f64>, Axes) {
        let mut settings =
            BTreeMap::from([(1, 255.0), (13, 0.0), (20, 0.0), (21, 0.0), (22, 1.0), (23, 0.0)]);
        settings.extend([(24, 25.0), (25, 500.0), (26, 250.0), (27, 1.0)]);
        for axis in 0..3 {
            settings.extend([
                (100 + axis, 250.0),
                (110 + axis, 500.0),
                (120 + axis, 10.0),
                (130 + axis, 200.0),
            ]);
        }
        (settings, Axes { letters: ['X', 'Z'], index: [0, 2], count: 3 })
    }

    fn from(settings: &BTreeMap<u16, f64>, axes: &Axes, zero: bool) -> Result<Machine, Unfit> {
        Machine::from_settings(settings, axes, Dialect::Classic, zero)
    }

    #[test]
    fn published_settings_become_si() {
        let (mut settings, axes) = published();
        settings.insert(132, 50.0);
        let machine = from(&settings, &axes, false).expect("complete");
        assert_eq!(machine.limits.travel_m, [[-0.2, 0.0], [-0.05, 0.0]]);
        assert!((machine.limits.speed_m_s[0] - 0.5 / 60.0).abs() < 1e-15);
        assert!((machine.limits.acceleration_m_s2[1] - 0.01).abs() < 1e-15);
        assert!((machine.limits.step_m[0] - 4e-6).abs() < 1e-18);
        assert_eq!(machine.decimals, [4, 4], "0.004 mm a step");
        // Searching 1.5 × 200 mm at 500 mm/min takes 36 s for each of X and Y alone.
        assert!(machine.homing.as_secs_f64() > 72.0);
    }

    /// gnea/grbl, limits.c and system.c: machine space is negative whatever the homing direction, but for the option.
    #[test]
    fn travel_follows_homing_direction_and_origin() {
        let (mut settings, axes) = published();
        let travel = |settings: &BTreeMap<u16, f64>, zero| {
            from(settings, &axes, zero).expect("complete").limits.travel_m[0]
        };
        settings.insert(23, 1.0);
        assert_eq!(travel(&settings, false), [-0.2, 0.0]);
        assert_eq!(travel(&settings, true), [0.0, 0.2]);
        settings.insert(21, 1.0);
        assert_eq!(travel(&settings, false), [-0.199, 0.0]);
        settings.insert(23, 0.0);
        assert_eq!(travel(&settings, false), [-0.2, -0.001]);
        settings.insert(22, 9.0);
        assert_eq!(travel(&settings, false), [-0.2, 0.0]);
    }

    #[test]
    fn settings_that_do_not_serve_are_named() {
        let (mut settings, axes) = published();
        settings.insert(13, 1.0);
        let unfit = from(&settings, &axes, false).expect_err("inches");
        assert_eq!((unfit.setting, unfit.value), (13, Some(1.0)));
        settings.insert(13, 0.0);
        settings.insert(122, 0.0);
        let unfit = from(&settings, &axes, false).expect_err("no acceleration");
        assert_eq!((unfit.setting, unfit.value), (122, Some(0.0)));
        settings.remove(&102);
        let unfit = from(&settings, &axes, false).expect_err("no resolution");
        assert_eq!((unfit.setting, unfit.value), (102, None));
    }

    /// gnea/grbl, doc/markdown/settings.md, $1: 255 keeps motors powered. grblHAL: $37 names the axes that are kept powered whatever $1.
    #[test]
    fn motors_that_lose_their_current_between_motions_are_refused() {
        let (mut settings, axes) = published();
        let with = |settings: &_, dialect| Machine::from_settings(settings, &axes, dialect, false);
        settings.insert(1, 25.0);
        for (mask, holds) in [(0.0, false), (1.0, false), (5.0, true), (7.0, true)] {
            settings.insert(37, mask);
            let unfit = with(&settings, Dialect::Classic).expect_err("motors go limp");
            assert_eq!((unfit.setting, unfit.value), (1, Some(25.0)));
            assert!(unfit.expected.contains("$1=255"));
            assert_eq!(with(&settings, Dialect::Hal).is_ok(), holds, "$37={mask}");
        }
        settings.remove(&1);
        let unfit = with(&settings, Dialect::Classic).expect_err("nobody knows");
        assert_eq!((unfit.setting, unfit.value), (1, None));
        settings.insert(1, 255.0);
        settings.insert(37, 0.0);
        assert!(with(&settings, Dialect::Classic).is_ok() && with(&settings, Dialect::Hal).is_ok());
    }

    /// What cannot be done without, though it has a usual value: taken for zero, it would shift the travel.
    #[test]
    fn settings_that_did_not_come_are_not_taken_for_zero() {
        for setting in [21, 22, 23, 27] {
            let (mut settings, axes) = published();
            settings.insert(27, 1.0);
            settings.remove(&setting);
            let unfit = from(&settings, &axes, false).expect_err("incomplete");
            assert_eq!((unfit.setting, unfit.value), (setting, None));
        }
    }
}
