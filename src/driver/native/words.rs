//! What the controller's codes mean, in the words of the protocol's own tables, and which error of a device a refusal is.

use super::units;
use crate::device::{DeviceError, StageLimits};
use firmware_proto::{CodeList, Fault, Identity, Reason, Refusal, ResetCause};

/// What the controller is asked for, in the forms that messages need.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    /// It refuses to …
    pub(super) to: &'static str,
    /// It says nothing while …
    pub(super) during: &'static str,
}

pub(super) const IDENTIFY: Task = Task { to: "say who it is", during: "being asked who it is" };
pub(super) const OPEN: Task = Task { to: "open a session", during: "opening a session" };
pub(super) const HOME: Task = Task { to: "home", during: "being told to home" };
pub(super) const MOVE: Task = Task { to: "move", during: "being told to move" };
pub(super) const STOP: Task = Task { to: "stop", during: "being told to stop" };
pub(super) const CLEAR: Task = Task { to: "clear its fault", during: "being told to clear its fault" };
pub(super) const REPORT: Task = Task { to: "report", during: "reports were expected" };
pub(super) const COMPARE: Task = Task { to: "tell its time", during: "being asked for its time" };

/// What the table says of a code.
pub(super) fn meaning(list: &CodeList, code: u8) -> String {
    let known = list.codes.iter().find(|known| known.code == code);
    known.map_or_else(
        || format!("code {code}, which the table does not have"),
        |known| known.meaning.trim().trim_end_matches('.').to_owned(),
    )
}

pub(super) fn fault(device: &str, fault: Fault) -> DeviceError {
    let code = fault as u8;
    DeviceError::Fault { device: device.to_owned(), code, meaning: meaning(&Fault::CODES, code) }
}

pub(super) fn reset(device: &str, now: &Identity) -> DeviceError {
    let cause = meaning(&ResetCause::CODES, now.reset_cause as u8);
    let cause = format!("{cause}; boot {}", now.boot_count);
    DeviceError::Reset { device: device.to_owned(), cause: Some(cause) }
}

/// The error that a refusal is. Travel and speed are checked before they are asked for; where the controller finds fault all the same,
/// it says so in the same words.
pub(super) fn refusal(device: &str, task: Task, refusal: &Refusal, limits: &StageLimits) -> DeviceError {
    let Refusal { reason, limit, asked, .. } = *refusal;
    let axis = usize::from(refusal.axis);
    let too_fast = |what, unit| {
        let [asked, most] = [asked, limit].map(units::from_um);
        DeviceError::TooFast { what, axis, asked, most, unit }
    };
    match reason {
        Reason::NotHomed => DeviceError::NotHomed { device: device.to_owned() },
        Reason::Speed => too_fast("speed", "m/s"),
        Reason::Acceleration => too_fast("acceleration", "m/s²"),
        Reason::Travel if axis < limits.travel_m.len() => DeviceError::OutsideTravel {
            axis,
            target_m: units::from_nm(asked),
            travel_m: limits.travel_m[axis],
        },
        _ => refused(device, task, refusal),
    }
}

/// A refusal that is no matter of a motion.
pub(super) fn refused(device: &str, task: Task, refusal: &Refusal) -> DeviceError {
    let Refusal { reason, axis, limit, asked } = *refusal;
    let reason = match reason {
        Reason::Busy => format!("motion {limit} is under way"),
        Reason::SwitchPressed => format!("axis {axis} would run onto a limit switch that is pressed"),
        _ => format!("{} (asked: {asked}, limit: {limit})", meaning(&Reason::CODES, reason as u8)),
    };
    DeviceError::Refused { device: device.to_owned(), what: task.to, reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: StageLimits = StageLimits {
        travel_m: [[0.0, 0.05]; 2],
        speed_m_s: [0.02; 2],
        acceleration_m_s2: [0.2; 2],
        step_m: [1e-6; 2],
    };

    fn text(reason: Reason, axis: u8, limit: i64, asked: i64) -> String {
        refusal("the stage", MOVE, &Refusal { reason, axis, limit, asked }, &LIMITS).to_string()
    }

    #[test]
    fn a_refusal_tells_its_figures_in_units_of_people() {
        assert!(text(Reason::Travel, 1, 50_000_000, 51_000_000).contains("51.000 mm"));
        assert!(text(Reason::Speed, 0, 20_000, 20_001).contains("0.020001 m/s along axis 0"));
        assert!(text(Reason::Busy, 255, 12, 0).contains("motion 12 is under way"));
        let other = text(Reason::Lease, 255, 1000, 2000);
        assert!(other.contains("asked: 2000, limit: 1000"), "{other}");
    }

    #[test]
    fn every_code_has_words() {
        for list in [Reason::CODES, Fault::CODES, ResetCause::CODES] {
            for code in list.codes {
                let words = meaning(&list, code.code);
                assert!(!words.is_empty() && !words.ends_with('.'), "{}::{}", list.name, code.name);
            }
        }
        assert!(meaning(&Fault::CODES, 200).contains("200"));
    }
}
