//! How a machine homes: Z first, then X and Y together; each fast towards its switch, off it, slowly onto it, off it again.
//!
//! Source: gnea/grbl, doc/markdown/settings.md ($22 to $27), and interface.md for the alarms. Speeds are reached at once.

use super::machine::{GrblMachine, Place, State};
use super::setup::CONTROLLER_AXES;

/// Which axes home together, in order.
const CYCLES: [&[usize]; 2] = [&[2], &[0, 1]];
/// How many times the travel a switch is searched for, and how many times the pull-off on the slow approach.
const SEARCH: f64 = 1.5;
const LOCATE: f64 = 5.0;
/// A cycle's legs: towards the switch and off it, twice.
const LEGS: usize = 4;

/// One leg of homing under way: each axis goes its way at the same speed, and stands when it is there.
#[derive(Debug, Clone)]
pub(super) struct Homing {
    cycle: usize,
    leg: usize,
    from: Place,
    way: Place,
    speed_mm_s: f64,
    start: f64,
    settle_s: f64,
    /// An axis does not find its switch on this leg.
    lost: bool,
}

impl Homing {
    /// When the leg is over, and what shook has come to rest.
    pub(super) fn end(&self) -> f64 {
        let longest = self.way.iter().fold(0.0_f64, |longest, way| longest.max(way.abs()));
        self.start + longest / self.speed_mm_s + self.settle_s
    }

    /// Where the axes are (mm).
    pub(super) fn at(&self, now: f64) -> Place {
        let gone = (now - self.start).max(0.0) * self.speed_mm_s;
        std::array::from_fn(|axis| self.from[axis] + self.way[axis].signum() * gone.min(self.way[axis].abs()))
    }
}

impl GrblMachine {
    pub(super) fn start_homing(&mut self) -> Result<(), u8> {
        if self.setting(22) as u32 & 1 == 0 {
            return Err(5);
        }
        self.state = State::Home;
        self.homed = false;
        if self.setup.is_hal() {
            // The last that is heard of it until it has homed.
            self.report(false);
        }
        self.homing = Some(self.leg(0, 0));
        Ok(())
    }

    fn leg(&self, cycle: usize, leg: usize) -> Homing {
        let pull_off = self.setting(27);
        let (mut way, mut lost) = ([0.0; CONTROLLER_AXES], false);
        for &axis in CYCLES[cycle] {
            let travel = self.setting(130 + axis);
            let (sign, switch) = if self.homes_low(axis) { (-1.0, -travel) } else { (1.0, 0.0) };
            way[axis] = if leg % 2 == 1 {
                -sign * pull_off
            } else {
                let distance = ((switch - self.true_mm[axis]) * sign).max(0.0);
                let most = if leg == 0 { SEARCH * travel } else { LOCATE * pull_off };
                lost |= self.switches_broken || distance > most;
                sign * if self.switches_broken { most } else { distance.min(most) }
            };
        }
        let rate = if leg == 2 { self.setting(24) } else { self.setting(25) };
        Homing {
            cycle,
            leg,
            from: self.true_mm,
            way,
            speed_mm_s: rate / 60.0,
            start: self.now,
            settle_s: self.setting(26) * 1e-3,
            lost,
        }
    }

    /// A leg is over.
    pub(super) fn homing_step(&mut self) {
        let Some(done) = self.homing.take() else { return };
        if done.lost {
            return self.abort_homing(9);
        }
        let next = done.cycle * LEGS + done.leg + 1;
        if next < CYCLES.len() * LEGS {
            self.homing = Some(self.leg(next / LEGS, next % LEGS));
            return;
        }
        let pull_off = self.setting(27);
        for axis in 0..CONTROLLER_AXES {
            let machine = if self.homes_low(axis) { pull_off - self.setting(130 + axis) } else { -pull_off };
            self.offset_mm[axis] = self.true_mm[axis] - machine;
        }
        if std::mem::take(&mut self.asked) {
            self.report(false);
        }
        self.homed = true;
        self.tell_homed = true;
        self.state = State::Idle;
        self.reply(Ok(()));
    }

    /// Homing ends with an alarm, and the controller starts anew.
    pub(super) fn abort_homing(&mut self, alarm: u8) {
        self.homing = None;
        self.state = State::Alarm(alarm);
        self.say(&format!("ALARM:{alarm}"));
        self.restart();
    }

    fn homes_low(&self, axis: usize) -> bool {
        self.setting(23) as u32 >> axis & 1 == 1
    }
}
