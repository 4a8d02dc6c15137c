//! How is zero found? One axis after the other, the last first: towards the low switch fast, back off, touch it slowly, set
//! zero where it trips, leave it again.
//!
//! ```text
//! low switch |<── approach (fast) ───────── from anywhere, at most 1.5 × travel's high end + back-off
//!            |   overrun v²/2a
//!            |──── back off ────>|         the switch must be open here
//!            |<─ touch (slow) ───|         zero: where it trips
//!            |──── leave ───────>|         homed, at rest clear of the switch
//! ```
//!
//! Why the last axis first: it is the one that leads into what is poked, and after an accident the tip may be in there: it has to come
//! out before anything moves it sideways.
//!
//! Why 1.5 times: the low switch lies below travel and the high switch above it, how far nobody has configured; and
//! a stage that has lost steps may stand on the high one.
//!
//! Why the touch ends without deceleration and the approach with: at the slow speed a motor stops within a
//! step, at the fast one it would lose steps, which would not matter for zero but wears the switch.

use super::Controller;
use super::motion::Purpose;
use crate::message::{AXES, AxisSet, Fault, Outcome, Switches};
use crate::profile::Line;

/// Where homing is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Homing {
    axis: usize,
    phase: Phase,
    /// Axes still to be homed after this one.
    left: AxisSet,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Approach,
    Overrun,
    BackOff,
    Touch,
    Leave,
}

impl Controller {
    /// Homes the axes, the last first.
    pub(super) fn home(&mut self, axes: AxisSet) {
        self.homed = self.homed.without(axes);
        let Some(axis) = axes.last() else {
            self.rest(Outcome::Reached);
            return;
        };
        let left = axes.without(AxisSet::NONE.with(axis));
        // On the switch already, as after an accident: there is nothing to approach.
        let phase = if self.switches.low.contains(axis) { Phase::BackOff } else { Phase::Approach };
        self.enter(Homing { axis, phase, left });
    }

    /// The phase's line has been run to its end, which is not every phase's purpose.
    pub(super) fn next_phase(&mut self, homing: Homing) {
        match homing.phase {
            Phase::Approach | Phase::Touch => self.fail_homing(),
            Phase::Overrun => self.enter(Homing { phase: Phase::BackOff, ..homing }),
            Phase::BackOff if self.switches.low.contains(homing.axis) => self.fail_homing(),
            Phase::BackOff => self.enter(Homing { phase: Phase::Touch, ..homing }),
            Phase::Leave if self.switches.low.contains(homing.axis) => self.fail_homing(),
            Phase::Leave => {
                self.homed = self.homed.with(homing.axis);
                if homing.left == AxisSet::NONE {
                    self.rest(Outcome::Reached)
                } else {
                    self.home(homing.left)
                }
            }
        }
    }

    pub(super) fn heed_homing_switches(&mut self, homing: Homing, ending: bool, before: Switches) {
        let low = self.switches.low.contains(homing.axis);
        let found_there = homing.phase == Phase::Approach && before.high.contains(homing.axis);
        if self.switches.high.contains(homing.axis) && !found_there {
            // The axis runs the wrong way or the switches are exchanged; only an approach may begin on it.
            self.fail_homing();
        } else if low && homing.phase == Phase::Approach && !ending {
            self.overrun(Homing { phase: Phase::Overrun, ..homing });
        } else if low && homing.phase == Phase::Touch && !ending {
            self.zero[homing.axis] = self.counters[homing.axis];
            self.enter(Homing { phase: Phase::Leave, ..homing });
        }
    }

    fn overrun(&mut self, homing: Homing) {
        if let Some(motion) = &mut self.motion {
            motion.purpose = Purpose::Home(homing);
            motion.decelerate(0.0);
        }
    }

    fn enter(&mut self, homing: Homing) {
        let config = self.config.homing;
        let limits = &self.config.axes[homing.axis];
        let back_off = i64::from(config.back_off_um) * 1000;
        let [low, high] = limits.travel_nm();
        let (way_nm, speed) = match homing.phase {
            Phase::Approach | Phase::Overrun => (-3 * high.max(high - low) / 2 - back_off, config.fast_um_s),
            Phase::BackOff | Phase::Leave => (back_off, config.fast_um_s),
            // Twice the way back: the overrun lies between.
            Phase::Touch => (-2 * back_off, config.slow_um_s),
        };
        let mut to = self.counters;
        to[homing.axis] = to[homing.axis].saturating_add(limits.steps_at(way_nm));
        let line = Line::between(&self.config.axes, self.counters, to);
        self.start(line, speed, config.acceleration_um_s2, Purpose::Home(homing));
    }

    fn fail_homing(&mut self) {
        self.latch(Fault::Homing);
        self.rest(Outcome::Faulted);
    }
}

const _: () = assert!(AXES == 2, "sets and arrays here are written for two axes");
