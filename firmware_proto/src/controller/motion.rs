//! How does a motion begin, end before its time, and meet a limit switch?

use super::Controller;
use super::homing::Homing;
use crate::message::{AXES, Activity, AxisSet, Fault, Outcome, Switches};
use crate::profile::{Line, Profile};

/// What a motion is for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Purpose {
    Move,
    Jog,
    Home(Homing),
}

/// A motion under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    line: Line,
    profile: Profile,
    elapsed_us: u64,
    pub(super) purpose: Purpose,
    /// Set once it decelerates before its end: how it will have gone.
    ending: Option<Outcome>,
    /// Switches that were pressed when it began.
    pressed: Switches,
}

impl Motion {
    /// Seconds since the profile began. 2⁵³ µs are 285 years: exact.
    fn time(&self) -> f64 {
        self.elapsed_us as f64 / 1e6
    }

    pub(super) fn run(&mut self, step_us: u32) -> [i32; AXES] {
        self.elapsed_us = self.elapsed_us.saturating_add(step_us.into());
        self.line.at(self.profile.at(self.time()).0)
    }

    pub(super) fn is_over(&self) -> bool {
        self.time() >= self.profile.duration()
    }

    pub(super) fn is_ending(&self) -> bool {
        self.ending.is_some()
    }

    /// nm/s of both axes.
    pub(super) fn velocity(&self) -> [f64; AXES] {
        let along = self.profile.at(self.time()).1;
        [0, 1].map(|axis| self.line.part(axis, along))
    }

    pub(super) fn activity(&self) -> Activity {
        match self.purpose {
            _ if self.is_ending() => Activity::Stopping,
            Purpose::Move => Activity::Moving,
            Purpose::Jog => Activity::Jogging,
            Purpose::Home(_) => Activity::Homing,
        }
    }

    /// Decelerates from here, at least as fast as before.
    pub(super) fn decelerate(&mut self, deceleration_nm_s2: f64) {
        let (distance, speed) = self.profile.at(self.time());
        let deceleration = deceleration_nm_s2.max(self.profile.acceleration());
        self.profile = Profile::stop(distance, speed, deceleration);
        self.elapsed_us = 0;
    }

    /// Whether a switch ought to stop it: any that was open when it began. One that was pressed is not ahead,
    /// or the request would have been refused.
    fn meets(&self, now: Switches) -> bool {
        let newly = [now.low.without(self.pressed.low), now.high.without(self.pressed.high)];
        newly != [AxisSet::NONE; 2]
    }
}

impl Controller {
    /// Begins a motion from rest; one without length is at its end.
    pub(super) fn start(&mut self, line: Option<Line>, speed_um_s: u32, um_s2: u32, purpose: Purpose) {
        let Some(line) = line else {
            self.rest(Outcome::Reached);
            return;
        };
        let speed = f64::from(speed_um_s) * 1000.0;
        let profile = Profile::trapezoid(line.length(), speed, f64::from(um_s2) * 1000.0);
        let pressed = self.switches;
        self.outcome = Outcome::Running;
        self.motion = Some(Motion { line, profile, elapsed_us: 0, purpose, ending: None, pressed });
    }

    /// Decelerates the motion under way, if one is, at least as fast as it would itself.
    pub(super) fn end_motion(&mut self, deceleration_nm_s2: f64, outcome: Outcome) {
        let Some(motion) = &mut self.motion else { return };
        // A motion that a fault ends is not made a stopped one by a later request.
        if motion.ending != Some(Outcome::Faulted) {
            motion.ending = Some(outcome);
        }
        motion.decelerate(deceleration_nm_s2);
        if motion.is_over() {
            self.arrive();
        }
    }

    /// A profile has come to its end.
    pub(super) fn arrive(&mut self) {
        match self.motion {
            Some(Motion { ending: Some(outcome), .. }) => self.rest(outcome),
            Some(Motion { purpose: Purpose::Home(homing), .. }) => self.next_phase(homing),
            _ => self.rest(Outcome::Reached),
        }
    }

    /// Nothing moves from here on.
    pub(super) fn rest(&mut self, outcome: Outcome) {
        let homing = matches!(self.motion, Some(Motion { purpose: Purpose::Home(_), .. }));
        self.motion = None;
        // A motion that a new session found under way is not of that session.
        self.outcome = if self.number == 0 { Outcome::None } else { outcome };
        if homing {
            self.lose_unhomed();
        }
        self.outbox.emergency |= core::mem::take(&mut self.emergency_at_rest);
    }

    pub(super) fn heed_switches(&mut self) {
        let Some(motion) = self.motion else { return };
        if let Purpose::Home(homing) = motion.purpose {
            self.heed_homing_switches(homing, motion.is_ending(), motion.pressed);
        } else if motion.meets(self.switches) {
            self.latch(Fault::LimitSwitch);
            self.homed = AxisSet::NONE;
            self.rest(Outcome::Faulted);
            self.lose_unhomed();
        }
    }

    /// What is not homed here starts the bound of jogs here.
    fn lose_unhomed(&mut self) {
        for axis in (0..AXES).filter(|axis| !self.homed.contains(*axis)) {
            self.lost_at[axis] = self.counters[axis];
        }
    }
}
