//! What is known of a Grbl stage from what it has said: pure bookkeeping, without input or output.
//!
//! Lines with their time of arrival → [`Event`]s: reports, replies, and what does not fit. Positions in metres, machine coordinates.

use super::codes::{self, NO_CODE};
use super::connect::Axes;
use super::line::Line;
use super::status::{Status, Word};
use crate::clock::HostTime;
use crate::device::{AXES, StageReport, StageState};
use std::time::Duration;

/// What a line has brought.
#[derive(Debug, PartialEq)]
pub(super) enum Event {
    /// Nothing to act on.
    Nothing,
    Report(StageReport),
    /// The line that was sent last is taken; homing is done.
    Done,
    /// The line that was sent last is refused, with the controller's code; whether it was the one that begins homing.
    Refused {
        code: u8,
        homing: bool,
    },
    /// An alarm, and what can be reported of it.
    Alarm(Option<StageReport>),
    /// The controller has started anew; whether nothing explains it.
    Banner {
        unexplained: bool,
    },
    /// A report that cannot be true.
    Untrue(String),
    /// The stage is where no motion would have taken it (m): two reports in a row say so.
    Astray([f64; AXES]),
}

/// Why the stage is latched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) code: u8,
    pub(super) meaning: String,
}

/// What the stage was told to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Activity {
    Standing,
    /// On its way; how long it may take to come to rest.
    Moving {
        braking: Duration,
    },
    /// Told to stop. When it was not seen at rest until then, it is asked once more (`asked`), then reset (`reset`).
    Stopping {
        until: HostTime,
        asked: bool,
        reset: bool,
    },
    /// Homing, and until when at most. `seen`: it has said so itself. `elsewhere`: the first and the last of the reports in a row that
    /// say that it is not homing.
    Homing {
        until: HostTime,
        seen: bool,
        elsewhere: Option<[HostTime; 2]>,
    },
}

/// A report may differ from where the stage should be by rounding on either side (m), and by a step.
const ROUNDING_M: f64 = 10e-6;
/// A stage whose reports repeat a position for so long stands, whatever it calls itself.
const STILL: Duration = Duration::from_millis(300);
/// How long a stage may take to come to rest that somebody else has set in motion.
const UNKNOWN_BRAKING: Duration = Duration::from_secs(2);
/// How long coming to rest may take beyond what the acceleration says.
pub(super) const STOP_MARGIN: Duration = Duration::from_millis(500);

#[derive(Debug)]
pub(super) struct Knowledge {
    axes: Axes,
    /// How far a report may be off where the stage should be (m).
    tolerance_m: [f64; AXES],
    /// Last work coordinate offset told (mm).
    offset: Option<Vec<f64>>,
    pub(super) homed: bool,
    pub(super) fault: Option<Fault>,
    pub(super) activity: Activity,
    /// We have asked for a reset.
    pub(super) awaiting_banner: bool,
    /// State in the last report.
    pub(super) word: Option<Word>,
    /// The last report.
    pub(super) last: Option<StageReport>,
    /// Nothing has been reported since the position was set anew.
    pub(super) stale: bool,
    /// Position of the last report and since when it has not changed.
    still: Option<([f64; AXES], HostTime)>,
    /// Where a homed stage can be: on its way or where it stands (m; lowest and highest by axis).
    region: Option<[[f64; 2]; AXES]>,
    astray: bool,
}

impl Knowledge {
    /// `step_m`: the smallest step of each axis (m).
    pub(super) fn new(axes: Axes, step_m: [f64; AXES]) -> Self {
        Self {
            axes,
            tolerance_m: step_m.map(|step| step.max(ROUNDING_M)),
            offset: None,
            homed: false,
            fault: None,
            activity: Activity::Standing,
            awaiting_banner: false,
            word: None,
            last: None,
            stale: true,
            still: None,
            region: None,
            astray: false,
        }
    }

    /// A motion from where it stands was taken.
    pub(super) fn moving(&mut self, from_m: [f64; AXES], target_m: [f64; AXES], braking: Duration) {
        self.activity = Activity::Moving { braking };
        // That it stood until now does not mean that it still does.
        self.still = None;
        self.region = Some(self.around(from_m, target_m));
    }

    /// Where a stage may be reported that is on its way from one place to another (m).
    fn around(&self, a: [f64; AXES], b: [f64; AXES]) -> [[f64; 2]; AXES] {
        std::array::from_fn(|axis| {
            let tolerance = self.tolerance_m[axis];
            [a[axis].min(b[axis]) - tolerance, a[axis].max(b[axis]) + tolerance]
        })
    }

    /// It was told to home.
    pub(super) fn homing(&mut self, until: HostTime) {
        self.activity = Activity::Homing { until, seen: false, elsewhere: None };
        self.lose_position();
    }

    /// It was told to stop. Told once more, it has no longer for it.
    pub(super) fn stopping(&mut self, now: HostTime) {
        let braking = match self.activity {
            Activity::Moving { braking } => braking,
            Activity::Homing { .. } => STOP_MARGIN,
            Activity::Standing => UNKNOWN_BRAKING,
            Activity::Stopping { .. } => return,
        };
        self.activity = Activity::Stopping { until: now + braking, asked: false, reset: false };
    }

    /// It was reset, because of what `meaning` says, and nobody knows whether it stood.
    pub(super) fn reset(&mut self, now: HostTime, meaning: &str) {
        self.latch(NO_CODE, meaning);
        self.lose_position();
        self.activity = Activity::Stopping { until: now + STOP_MARGIN, asked: true, reset: true };
    }

    pub(super) fn latch(&mut self, code: u8, meaning: impl Into<String>) {
        self.fault = Some(Fault { code, meaning: meaning.into() });
    }

    pub(super) fn lose_position(&mut self) {
        self.homed = false;
        self.region = None;
        self.astray = false;
    }

    /// Takes a line. `stopped`: a stopper was used, and nobody has cleared it.
    pub(super) fn take(&mut self, at: HostTime, line: Line, stopped: bool) -> Event {
        match line {
            Line::Ok => match self.activity {
                // Grbl answers the question that it was asked while homing at the end of it. Without that answer the `ok` may be a
                // late one to something else, and a position must not be trusted for that.
                Activity::Homing { seen: false, .. } => Event::Nothing,
                Activity::Homing { .. } => {
                    self.activity = Activity::Standing;
                    self.homed = true;
                    self.stale = true;
                    Event::Done
                }
                _ => Event::Done,
            },
            Line::Error(code) => {
                let homing = matches!(self.activity, Activity::Homing { .. });
                if homing {
                    self.activity = Activity::Standing;
                }
                Event::Refused { code, homing }
            }
            Line::Alarm(code) => self.alarm(at, code),
            Line::Banner { .. } => {
                let unexplained = !self.awaiting_banner && self.fault.is_none() && !stopped;
                if !self.awaiting_banner {
                    self.lose_position();
                }
                self.activity = Activity::Standing;
                self.offset = None;
                self.word = None;
                Event::Banner { unexplained }
            }
            Line::Status(status) => self.status(at, &status, stopped),
            _ => Event::Nothing,
        }
    }

    /// grblHAL says each time it starts what keeps it from anything but homing: no news of a stage that has not homed, or was reset.
    fn only_unhomed(&mut self, code: u8) -> bool {
        let expected = self.fault.is_some() || self.awaiting_banner || !self.homed;
        if matches!(code, codes::HOMING_REQUIRED | codes::LIMIT_CLOSED) && expected {
            self.lose_position();
            return true;
        }
        false
    }

    fn alarm(&mut self, at: HostTime, code: u8) -> Event {
        if self.only_unhomed(code) {
            return Event::Nothing;
        }
        self.latch(code, codes::alarm(code));
        if !codes::keeps_position(code) {
            self.lose_position();
        }
        self.activity = Activity::Standing;
        // After a limit alarm Grbl says nothing more until it is reset: this is where the last word on it is.
        let report = self.last.map(|last| StageReport {
            host: at,
            state: StageState::Fault { code },
            homed: self.homed,
            ..last
        });
        Event::Alarm(report)
    }

    fn status(&mut self, at: HostTime, status: &Status, stopped: bool) -> Event {
        if let Some(offset) = &status.offset {
            self.offset = Some(offset.clone());
        }
        // Work coordinates before any offset was told say nothing; the offset comes with one of the next reports.
        let Some(machine_mm) = status.machine(self.offset.as_deref()) else { return Event::Nothing };
        if machine_mm.len() != self.axes.count {
            return Event::Untrue(format!("a position with {} axes", machine_mm.len()));
        }
        let position_m = self.axes.index.map(|index| machine_mm[index] * 1e-3);
        if let Some(region) = self.region
            && (0..AXES).any(|a| position_m[a] < region[a][0] || position_m[a] > region[a][1])
        {
            if std::mem::replace(&mut self.astray, true) {
                return Event::Astray(position_m);
            }
            return Event::Untrue(format!("a position of {machine_mm:?} mm"));
        }
        self.astray = false;
        if status.homed == Some(false) && !matches!(self.activity, Activity::Homing { .. }) {
            self.lose_position();
        }
        if self.still.is_none_or(|(position, _)| position != position_m) {
            self.still = Some((position_m, at));
        }
        self.word = Some(status.word);
        let state = self.state(at, status.word, stopped);
        let report = StageReport { host: at, tick_us: None, position_m, state, homed: self.homed };
        self.last = Some(report);
        self.stale = false;
        if self.homed && state != StageState::Moving {
            self.region = Some(self.around(position_m, position_m));
        }
        Event::Report(report)
    }

    /// What the controller's word for its state means, after taking note of it.
    fn state(&mut self, at: HostTime, word: Word, stopped: bool) -> StageState {
        if let Activity::Homing { seen, elsewhere, .. } = &mut self.activity {
            *seen |= word == Word::Home;
            // Said before it has read the command, or the command or its acknowledgement got lost: the latter when it goes on saying
            // so. That it says nothing for a while means nothing: so it homes.
            *elsewhere = match word {
                Word::Idle | Word::Alarm(_) => Some([elsewhere.map_or(at, |[first, _]| first), at]),
                _ => None,
            };
            return StageState::Homing;
        }
        let still = self.still.is_some_and(|(_, since)| at.since(since) >= STILL);
        match word {
            Word::Idle => {}
            // grblHAL goes on calling itself so after it was stopped.
            Word::Jog | Word::Run if (stopped || self.fault.is_some()) && still => {}
            Word::Jog | Word::Run | Word::Hold { at_rest: false } | Word::Door { at_rest: false } => {
                if self.activity == Activity::Standing {
                    // Not by us.
                    self.activity = Activity::Moving { braking: UNKNOWN_BRAKING };
                }
                return StageState::Moving;
            }
            Word::Home => return StageState::Homing,
            Word::Hold { .. } | Word::Door { .. } | Word::Other => {
                if self.fault.is_none() && !stopped {
                    self.latch(
                        NO_CODE,
                        "it is held, by its door or feed-hold input or by somebody else's command",
                    );
                }
            }
            Word::Alarm(code) => self.note_alarm(code),
        }
        self.activity = Activity::Standing;
        if self.fault.is_none() && stopped {
            self.latch(NO_CODE, "it was told to stop");
        }
        match &self.fault {
            Some(fault) => StageState::Fault { code: fault.code },
            None => StageState::Idle,
        }
    }

    /// An alarm that no line has announced. Locked since it was switched on, it is only waiting to be homed: no fault.
    fn note_alarm(&mut self, code: Option<u8>) {
        let expected = match code {
            Some(code) => self.only_unhomed(code),
            None => !self.homed,
        };
        if expected {
            return;
        }
        // The line that announced it may have got lost: without a code it has the one of the fault that is known, if that has one.
        if !code.or(self.fault.as_ref().map(|fault| fault.code)).is_some_and(codes::keeps_position) {
            self.lose_position();
        }
        if self.fault.is_some() {
            return;
        }
        match code {
            Some(code) => self.latch(code, codes::alarm(code)),
            None => self.latch(NO_CODE, "it is in alarm and has not said why"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> HostTime {
        HostTime::from_nanos(ms * 1_000_000)
    }

    fn known() -> Knowledge {
        Knowledge::new(Axes { letters: ['X', 'Z'], index: [0, 2], count: 3 }, [2.5e-6; AXES])
    }

    fn say(known: &mut Knowledge, ms: u64, line: &str) -> Event {
        known.take(at(ms), Line::parse(line.as_bytes()).expect("a line of Grbl"), false)
    }

    fn report(event: Event) -> StageReport {
        match event {
            Event::Report(report) | Event::Alarm(Some(report)) => report,
            other => panic!("a report, not {other:?}"),
        }
    }

    /// Homed at (-1, -1) mm.
    fn homed() -> Knowledge {
        let mut known = known();
        known.homing(at(60_000));
        say(&mut known, 1, "<Home|MPos:0.000,0.000,0.000|FS:0,0>");
        assert_eq!(say(&mut known, 1, "ok"), Event::Done);
        let first = report(say(&mut known, 2, "<Idle|MPos:-1.000,0.000,-1.000|FS:0,0>"));
        assert!(first.homed && first.state == StageState::Idle);
        known
    }

    #[test]
    fn a_controller_that_waits_to_be_homed_is_idle_and_not_homed() {
        for line in ["<Alarm|MPos:0.000,0.000,0.000|FS:0,0>", "<Alarm:11|MPos:0.000,0.000,0.000|FS:0,0>"] {
            let first = report(say(&mut known(), 0, line));
            assert_eq!((first.state, first.homed), (StageState::Idle, false), "{line}");
        }
        let hit = report(say(&mut known(), 0, "<Alarm:1|MPos:0.000,0.000,0.000|FS:0,0>"));
        assert_eq!(hit.state, StageState::Fault { code: 1 });
    }

    #[test]
    fn alarms_decide_whether_the_position_holds() {
        for (code, kept) in [(1, false), (2, true), (3, false), (6, false), (9, false), (200, false)] {
            let mut known = homed();
            let last = report(say(&mut known, 3, &format!("ALARM:{code}")));
            assert_eq!(last.state, StageState::Fault { code });
            assert_eq!((last.homed, last.position_m), (kept, [-1e-3, -1e-3]), "alarm {code}");
            let next = report(say(&mut known, 4, "<Alarm|MPos:-1.000,0.000,-1.000|FS:0,0>"));
            assert_eq!((next.state, next.homed), (StageState::Fault { code }, kept));
        }
    }

    #[test]
    fn a_banner_is_a_reset_unless_something_explains_it() {
        let banner = "Grbl 1.1h ['$' for help]";
        let mut surprised = homed();
        assert_eq!(say(&mut surprised, 3, banner), Event::Banner { unexplained: true });
        assert!(!surprised.homed);
        let mut aborted = homed();
        say(&mut aborted, 3, "ALARM:3");
        assert_eq!(say(&mut aborted, 4, banner), Event::Banner { unexplained: false });
        let mut asked = homed();
        asked.awaiting_banner = true;
        assert_eq!(say(&mut asked, 3, banner), Event::Banner { unexplained: false });
        assert!(asked.homed, "a reset that was asked for while standing keeps the position");
    }

    /// grblHAL, seen after homing that failed.
    #[test]
    fn having_to_home_hides_no_fault_and_is_none() {
        let mut known = known();
        report(say(&mut known, 0, "<Alarm:11|MPos:0.000,0.000,0.000|FS:0,0>"));
        known.homing(at(60_000));
        report(say(&mut known, 1, "ALARM:8"));
        assert_eq!(
            say(&mut known, 2, "GrblHAL 1.1f ['$' or '$HELP' for help]"),
            Event::Banner { unexplained: false }
        );
        assert_eq!(say(&mut known, 3, "ALARM:11"), Event::Nothing);
        let next = report(say(&mut known, 4, "<Alarm:11|MPos:0.000,0.000,0.000|FS:0,0|H:0>"));
        assert_eq!((next.state, next.homed), (StageState::Fault { code: 8 }, false));
        let mut surprised = homed();
        let next = report(say(&mut surprised, 3, "ALARM:11"));
        assert_eq!((next.state, next.homed), (StageState::Fault { code: 11 }, false));
    }

    /// Seen on a slow Grbl: an acknowledgement of something before comes after `$H`.
    #[test]
    fn a_late_acknowledgement_does_not_end_homing() {
        let mut known = known();
        known.homing(at(60_000));
        assert_eq!(say(&mut known, 1, "ok"), Event::Nothing);
        say(&mut known, 2, "<Home|MPos:0.000,0.000,0.000|FS:0,0>");
        assert!(!known.homed);
        assert_eq!(say(&mut known, 3, "ok"), Event::Done);
        assert!(known.homed);
    }

    /// A reset of ours in motion: the line that says what it did to the position may get lost.
    #[test]
    fn an_alarm_whose_line_got_lost_takes_the_position_with_it() {
        let alarm = "<Alarm|MPos:-1.000,0.000,-1.000|FS:0,0>";
        let mut stopped = homed();
        stopped.latch(NO_CODE, "it was told to stop");
        assert!(!report(say(&mut stopped, 3, alarm)).homed);
        let mut told = homed();
        told.latch(NO_CODE, "it was told to stop");
        assert!(report(say(&mut told, 3, "<Alarm:2|MPos:-1.000,0.000,-1.000|FS:0,0>")).homed);
        let mut cleared = homed();
        report(say(&mut cleared, 3, "ALARM:2"));
        cleared.awaiting_banner = true;
        say(&mut cleared, 4, "Grbl 1.1h ['$' for help]");
        assert!(report(say(&mut cleared, 5, alarm)).homed, "outside its travel: it has not moved");
    }

    #[test]
    fn a_report_may_be_off_by_a_step() {
        let mut known = homed();
        known.tolerance_m = Knowledge::new(known.axes.clone(), [50e-6, 1e-6]).tolerance_m;
        known.moving([-1e-3, -1e-3], [-5e-3, -1e-3], Duration::ZERO);
        let jog = |x: &str, z: &str| format!("<Jog|MPos:{x},0.000,{z}|FS:60,0>");
        assert!(matches!(say(&mut known, 3, &jog("-5.045", "-1.009")), Event::Report(_)));
        assert!(matches!(say(&mut known, 4, &jog("-5.055", "-1.000")), Event::Untrue(_)));
        assert!(matches!(say(&mut known, 5, &jog("-5.000", "-1.000")), Event::Report(_)));
        assert!(matches!(say(&mut known, 6, &jog("-5.000", "-1.011")), Event::Untrue(_)));
    }

    /// A reset whose banner got lost shows as an alarm that nobody has announced.
    #[test]
    fn an_unannounced_alarm_of_a_homed_stage_is_a_fault() {
        let mut known = homed();
        let next = report(say(&mut known, 3, "<Alarm|MPos:-1.000,0.000,-1.000|FS:0,0>"));
        assert_eq!((next.state, next.homed), (StageState::Fault { code: NO_CODE }, false));
    }

    #[test]
    fn one_report_off_the_path_is_untrue_and_two_are_believed() {
        let mut known = homed();
        known.moving([-1e-3, -1e-3], [-5e-3, -1e-3], Duration::ZERO);
        let jog = |x: &str| format!("<Jog|MPos:{x},0.000,-1.000|FS:60,0>");
        assert_eq!(report(say(&mut known, 3, &jog("-2.000"))).state, StageState::Moving);
        assert!(matches!(say(&mut known, 4, &jog("-92.000")), Event::Untrue(_)));
        assert!(matches!(say(&mut known, 5, &jog("-2.100")), Event::Report(_)));
        assert!(matches!(say(&mut known, 6, &jog("-6.000")), Event::Untrue(_)));
        assert!(
            matches!(say(&mut known, 7, &jog("-6.100")), Event::Astray([x, _]) if (x + 6.1e-3).abs() < 1e-12)
        );
    }

    /// grblHAL comes to rest but goes on saying Jog.
    #[test]
    fn a_stopped_stage_is_at_rest_once_its_position_stays() {
        let mut known = homed();
        known.moving([-1e-3, -1e-3], [-5e-3, -1e-3], Duration::ZERO);
        let mut take = |ms: u64, x: &str| {
            let line = format!("<Jog|MPos:{x},0.000,-1.000|FS:60,0>");
            report(known.take(at(ms), Line::parse(line.as_bytes()).expect("a report"), true)).state
        };
        assert_eq!(take(10, "-2.000"), StageState::Moving);
        assert_eq!(take(60, "-2.100"), StageState::Moving);
        assert_eq!(take(350, "-2.100"), StageState::Moving);
        assert_eq!(take(360, "-2.100"), StageState::Fault { code: NO_CODE });
    }

    /// A stop at the very beginning of a motion: its first reports repeat the position where it has long stood.
    #[test]
    fn a_stage_that_has_just_been_told_to_move_is_not_at_rest() {
        let mut known = homed();
        known.moving([-1e-3, -1e-3], [-5e-3, -1e-3], Duration::ZERO);
        let line = Line::parse(b"<Jog|MPos:-1.000,0.000,-1.000|FS:60,0>").expect("a report");
        assert_eq!(report(known.take(at(5000), line, true)).state, StageState::Moving);
    }

    #[test]
    fn positions_with_other_axes_and_offsets_not_yet_told_are_no_reports() {
        let mut known = known();
        assert!(matches!(say(&mut known, 0, "<Idle|MPos:0.000,0.000|FS:0,0>"), Event::Untrue(_)));
        assert_eq!(say(&mut known, 0, "<Idle|WPos:0.000,0.000,0.000|FS:0,0>"), Event::Nothing);
        let told = say(&mut known, 0, "<Idle|WPos:0.000,0.000,0.000|FS:0,0|WCO:-2.000,0.000,-3.000>");
        assert_eq!(report(told).position_m, [-2e-3, -3e-3]);
    }
}
