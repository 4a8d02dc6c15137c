//! What a status report of the emulated controller holds, and how often its occasional fields are in it.
//!
//! Source: gnea/grbl, doc/markdown/interface.md: work coordinate offset in the first report after a reset and then in each 10th
//! standing and each 30th moving, overrides in the second and then in each 10th and 20th; never both. grblHAL begins with the
//! overrides, and adds fields.

use super::machine::{GrblMachine, State};
use super::setup::CONTROLLER_AXES;
use std::fmt::Write;

const STANDING: u32 = 10;
const OFFSET_MOVING: u32 = 30;
const OVERRIDES_MOVING: u32 = 20;

impl GrblMachine {
    /// `full`: with everything in it.
    pub(super) fn report(&mut self, full: bool) {
        let hal = self.setup.is_hal();
        let mask = self.setting(10) as u32;
        let mut line = format!("<{}", self.word(full));
        let (name, minus) = if mask & 1 == 1 { ("MPos", 0.0) } else { ("WPos", 1.0) };
        let shown =
            std::array::from_fn(|axis| self.machine_mm(axis) - minus * self.setup.work_offset_mm[axis]);
        let _ = write!(line, "|{name}:{}", list(shown));
        if mask & 2 != 0 {
            let _ = write!(line, "|Bf:{},{}", self.free_blocks(), self.free_bytes());
        }
        let _ = write!(line, "|FS:{:.0},0", self.speed_mm_s() * 60.0);

        let moving = matches!(self.state, State::Jog | State::Home | State::Hold | State::Door);
        let (mut offset, mut overrides) = (self.reports_to_offset == 0, self.reports_to_overrides == 0);
        if offset && overrides && !full {
            // One waits for the next report.
            (offset, overrides) = (!hal, hal);
        }
        let refresh = |moving_count| if moving { moving_count } else { STANDING };
        self.reports_to_offset = match offset {
            true => refresh(OFFSET_MOVING) - 1,
            false => self.reports_to_offset.saturating_sub(1),
        };
        self.reports_to_overrides = match overrides {
            true => refresh(OVERRIDES_MOVING) - 1,
            false => self.reports_to_overrides.saturating_sub(1),
        };
        if offset || full {
            let _ = write!(line, "|WCO:{}", list(self.setup.work_offset_mm));
        }
        if overrides || full {
            line.push_str("|Ov:100,100,100");
            if hal {
                line.push_str("|A:|TLR:0");
            }
        }
        if hal && (full || std::mem::take(&mut self.tell_homed)) {
            let _ = write!(line, "|H:{}", u8::from(self.homed));
        }
        line.push('>');
        self.say(&line);
    }

    fn word(&self, full: bool) -> String {
        match self.state {
            State::Idle => "Idle".to_owned(),
            State::Jog => "Jog".to_owned(),
            State::Home => "Home".to_owned(),
            State::Hold => "Hold:0".to_owned(),
            State::Door => "Door:0".to_owned(),
            State::Alarm(code) if full && code > 0 => format!("Alarm:{code}"),
            State::Alarm(_) | State::Booting { .. } => "Alarm".to_owned(),
        }
    }

    /// Machine coordinate of an axis, which is a whole number of steps (mm).
    fn machine_mm(&self, axis: usize) -> f64 {
        let steps = self.setting(100 + axis);
        ((self.true_mm[axis] - self.offset_mm[axis]) * steps).round() / steps
    }
}

fn list(values: [f64; CONTROLLER_AXES]) -> String {
    // No minus sign before zero.
    let [x, y, z] = values.map(|value| if value.abs() < 0.0005 { 0.0 } else { value });
    format!("{x:.3},{y:.3},{z:.3}")
}
