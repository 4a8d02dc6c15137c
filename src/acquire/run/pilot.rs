//! The stage, led along one leg after another: told where to go, watched until it is there, every report recorded.
//!
//! Whatever the stage does that it was not asked to trips the latch; whoever tripped it, the pilot learns of it within one look.

use super::event::clock_probe;
use crate::acquire::latch::{Cause, Latch};
use crate::acquire::live::LiveForce;
use crate::acquire::operator::Operator;
use crate::acquire::plan::Trapezoid;
use crate::acquire::status::{Doing, Watched};
use crate::clock::HostTime;
use crate::device::{AXES, DeviceError, ForceFormat, Motion, SensorMounting, Stage, StageReport, StageState};
use crate::geometry::Vec3;
use crate::session::{Event, Health, Recorder, Topic};
use std::collections::VecDeque;
use std::time::Duration;

/// How long one look at the stage may take.
const LOOK: Duration = Duration::from_millis(20);
/// … while a force is waited for.
pub(in crate::acquire) const QUICK_LOOK: Duration = Duration::from_millis(5);
/// Reports that are kept to know where the stage was: half a second and more of them.
const RECENT: usize = 128;
/// A stage that was told to move may stand for so long before it does.
const REACTION: Duration = Duration::from_millis(500);
/// A motion may take so much longer than it should.
const PATIENCE: f64 = 1.5;
/// … and this besides.
const GRACE: Duration = Duration::from_secs(2);
/// Homing takes no longer than this.
const HOMING: Duration = Duration::from_secs(90);
/// A stage that stands this close to where it was sent to is there, if its steps are no coarser (m).
const THERE_M: f64 = 5e-6;
/// Clocks are compared so often.
const COMPARE: Duration = Duration::from_secs(1);
/// A status is told so often.
const TELL: Duration = Duration::from_millis(40);

/// The latch was tripped: what is to be done next is not done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Halted;

/// A force along a direction at which a press ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UntilForce {
    pub(super) force_n: f64,
    /// Unit vector in the phantom frame.
    pub(super) direction: Vec3,
}

/// What the pilot shares with others.
#[derive(Clone, Copy)]
pub(super) struct Shared<'a> {
    pub(super) latch: &'a Latch,
    pub(super) live: &'a LiveForce,
    pub(super) watched: &'a Watched,
    pub(super) operator: &'a Operator,
    pub(super) health: &'a Health,
    pub(super) sensor: SensorMounting,
    pub(super) format: ForceFormat,
    pub(super) started: HostTime,
}

/// Leads the stage.
pub(super) struct Pilot<'a> {
    stage: &'a mut dyn Stage,
    recorder: &'a mut Recorder,
    shared: Shared<'a>,
    last: Option<StageReport>,
    /// Reports of late, the newest last.
    recent: VecDeque<StageReport>,
    /// Whether the last motion ended where nobody had planned.
    cut_short: bool,
    /// What the stage said when it failed.
    failure: Option<DeviceError>,
    told: HostTime,
    /// Where the poke in progress begins (m, stage coordinates) and its direction there (unit vector); depths count along it.
    line: Option<([f64; AXES], [f64; AXES])>,
    /// What is left of the plan after the leg in progress ends, and when it should.
    after: (HostTime, Duration),
    /// When the controller is asked for its clock next.
    compare: HostTime,
}

impl<'a> Pilot<'a> {
    pub(super) fn new(stage: &'a mut dyn Stage, recorder: &'a mut Recorder, shared: Shared<'a>) -> Self {
        let now = HostTime::now();
        Self {
            stage,
            recorder,
            shared,
            last: None,
            recent: VecDeque::with_capacity(RECENT),
            cut_short: false,
            failure: None,
            told: now,
            line: None,
            after: (now, Duration::ZERO),
            compare: now,
        }
    }

    /// The latest report.
    pub(super) fn last(&self) -> Option<StageReport> {
        self.last
    }

    /// The latest report of those that had arrived at a time; the earliest known where all came later.
    pub(super) fn last_before(&self, time: HostTime) -> Option<StageReport> {
        self.recent.iter().rfind(|report| report.host <= time).or(self.recent.front()).copied()
    }

    /// What the whole plan takes.
    pub(super) fn has_planned(&mut self, duration: Duration) {
        self.after = (HostTime::now(), duration);
    }

    /// Sees that the stage stands where the plan has it before a motion; after a press that a force has ended, nobody knew where.
    pub(super) fn stands_at(&mut self, planned_m: [f64; AXES]) -> Result<(), Halted> {
        let at = self.position()?;
        if self.cut_short || self.agree(at, planned_m) {
            return Ok(());
        }
        self.trip(Cause::StageAstray)
    }

    /// Whether two positions are the same to a stage of such steps.
    fn agree(&self, one_m: [f64; AXES], other_m: [f64; AXES]) -> bool {
        let step = self.stage.limits().step_m.into_iter().fold(0.0, f64::max);
        (0..AXES).all(|axis| (one_m[axis] - other_m[axis]).abs() <= THERE_M.max(2.0 * step))
    }

    /// What the stage said when it failed.
    pub(super) fn into_failure(self) -> Option<DeviceError> {
        self.failure
    }

    /// Puts down an event.
    pub(super) fn note(&mut self, event: Event) {
        self.recorder.event(event);
    }

    /// What is done now, and what the plan says of how long it takes and what is left after it.
    pub(super) fn begin(&mut self, doing: Doing, takes_s: f64, left_after_s: f64) {
        let seconds = |s: f64| Duration::from_secs_f64(s.max(0.0));
        self.after = (HostTime::now() + seconds(takes_s), seconds(left_after_s));
        self.shared.watched.tell(|status| {
            status.doing = doing;
            status.message.clear();
        });
        self.tell();
    }

    /// Where depths count from, and along which direction of the stage.
    pub(super) fn on_line(&mut self, line: Option<([f64; AXES], [f64; AXES])>) {
        self.line = line;
    }

    /// Direction of the poke in progress (unit vector, stage coordinates).
    pub(super) fn along(&self) -> Option<[f64; AXES]> {
        self.line.map(|(_, along)| along)
    }

    /// Moves the stage, until it is there or until the force is reached; that force (N) then.
    pub(super) fn go(&mut self, motion: Motion, until: Option<UntilForce>) -> Result<Option<f64>, Halted> {
        let from = self.position()?;
        let length = (0..AXES).map(|a| (motion.target_m[a] - from[a]).powi(2)).sum::<f64>().sqrt();
        let takes = Trapezoid::new(length, motion.speed_m_s, motion.acceleration_m_s2).duration_s();
        self.compare_clocks()?;
        let asked = HostTime::now();
        let moved = self.stage.move_to(motion);
        self.accepted(moved)?;
        let overdue = asked + overdue_after(takes);
        let look = if until.is_some() { QUICK_LOOK } else { LOOK };
        loop {
            if let Some(report) = self.look(HostTime::now() + look)? {
                let stands = report.state == StageState::Idle;
                if stands && self.agree(report.position_m, motion.target_m) {
                    self.cut_short = false;
                    return Ok(None);
                }
                if stands && report.host.since(asked) > REACTION {
                    return self.trip(Cause::StageAstray);
                }
            }
            let reached = until.map(|until| (until.force_n, self.force_along(until.direction)));
            if let Some((_, force_n)) = reached.filter(|(wanted, is)| is >= wanted) {
                self.halt()?;
                self.cut_short = true;
                return Ok(Some(force_n));
            }
            if HostTime::now() > overdue {
                return self.trip(Cause::StageAstray);
            }
        }
    }

    /// Brings the stage to rest, not as a fault.
    fn halt(&mut self) -> Result<(), Halted> {
        let stopped = self.stage.stop();
        self.accepted(stopped)?;
        let overdue = HostTime::now() + GRACE;
        loop {
            let report = self.look(HostTime::now() + LOOK)?;
            if report.is_some_and(|r| r.state == StageState::Idle) {
                return Ok(());
            }
            if HostTime::now() > overdue {
                return self.trip(Cause::StageAstray);
            }
        }
    }

    /// Stands until a time, and sees that it does.
    pub(super) fn stay(&mut self, until: HostTime) -> Result<(), Halted> {
        let stands = self.position()?;
        while HostTime::now() < until {
            self.compare_clocks()?;
            let look = until.min(HostTime::now() + LOOK);
            self.stands_still(stands, look)?;
        }
        Ok(())
    }

    /// One look at a stage that has come to rest and that nobody has asked to move.
    fn stands_still(&mut self, at_m: [f64; AXES], until: HostTime) -> Result<(), Halted> {
        match self.look(until)? {
            Some(report) if !self.agree(report.position_m, at_m) => self.trip(Cause::StageAstray),
            _ => Ok(()),
        }
    }

    /// Has the controller say its time, once in a while and only while the stage stands: an answer takes the line for some milliseconds.
    fn compare_clocks(&mut self) -> Result<(), Halted> {
        if HostTime::now() < self.compare {
            return Ok(());
        }
        let compared = self.stage.compare_clocks();
        if let Some(compared) = self.accepted(compared)? {
            self.recorder.clock_probe(clock_probe("stage", compared));
        }
        self.compare = HostTime::now() + COMPARE;
        Ok(())
    }

    /// Homes the stage.
    pub(super) fn home(&mut self) -> Result<(), Halted> {
        let homed = self.stage.home();
        self.accepted(homed)?;
        let overdue = HostTime::now() + HOMING;
        loop {
            let report = self.look(HostTime::now() + LOOK)?;
            if report.is_some_and(|r| r.homed && r.state == StageState::Idle) {
                return Ok(());
            }
            if HostTime::now() > overdue {
                return self.trip(Cause::StageAstray);
            }
        }
    }

    /// Waits until the person agrees.
    pub(super) fn ask(&mut self, text: &str) -> Result<(), Halted> {
        self.shared.operator.ask();
        self.shared.watched.tell(|status| text.clone_into(&mut status.message));
        let stands = self.position()?;
        while !self.shared.operator.has_agreed() {
            self.stands_still(stands, HostTime::now() + LOOK)?;
        }
        self.shared.watched.tell(|status| status.message.clear());
        Ok(())
    }

    /// Where the stage is.
    fn position(&mut self) -> Result<[f64; AXES], Halted> {
        let overdue = HostTime::now() + GRACE;
        loop {
            if let Some(report) = self.last {
                return Ok(report.position_m);
            }
            self.look(HostTime::now() + LOOK)?;
            if HostTime::now() > overdue {
                return self.trip(Cause::StageSilent);
            }
        }
    }

    /// One look at the stage; finds out whether anybody has tripped the latch.
    fn look(&mut self, until: HostTime) -> Result<Option<StageReport>, Halted> {
        let report = self.stage.report(until);
        let report = self.accepted(report)?;
        if let Some(report) = report {
            self.take(report);
            if let StageState::Fault { code } = report.state {
                return self.trip(Cause::StageFault { code });
            }
        }
        if self.shared.health.failure().is_some() {
            return self.trip(Cause::Recorder);
        }
        if self.shared.latch.tripped().is_some() {
            return Err(Halted);
        }
        if HostTime::now().since(self.told) > TELL {
            self.tell();
        }
        Ok(report)
    }

    /// After the latch was tripped: watches until the stage stands, at most so long. Its last two reports agree then.
    pub(super) fn watch_standing(&mut self, at_most: Duration) -> bool {
        let end = HostTime::now() + at_most;
        let mut before: Option<StageReport> = None;
        while HostTime::now() < end {
            match self.stage.report(HostTime::now() + LOOK) {
                Ok(Some(report)) => {
                    self.take(report);
                    let same = before.is_some_and(|b| b.position_m == report.position_m);
                    if same && matches!(report.state, StageState::Fault { .. } | StageState::Idle) {
                        return true;
                    }
                    before = Some(report);
                }
                Ok(None) => {}
                Err(error) => {
                    self.failure.get_or_insert(error);
                    return false;
                }
            }
        }
        false
    }

    /// Takes the tip out, after the latch was tripped and armed again; whether it is out. Whatever trips the latch in between ends it.
    pub(super) fn retract(&mut self, motion: Motion) -> Result<bool, DeviceError> {
        let Some(from) = self.last else { return Ok(false) };
        // Who stops it here has stopped it: what is asked of the stage next is not done.
        let go_on = |latch: &Latch| !latch.tripped_again();
        if !go_on(self.shared.latch) {
            return Ok(false);
        }
        self.stage.clear()?;
        if !go_on(self.shared.latch) {
            return Ok(false);
        }
        self.stage.move_to(motion)?;
        let length = (0..AXES).map(|a| (motion.target_m[a] - from.position_m[a]).powi(2)).sum::<f64>().sqrt();
        let takes = Trapezoid::new(length, motion.speed_m_s, motion.acceleration_m_s2).duration_s();
        let end = HostTime::now() + overdue_after(takes);
        while HostTime::now() < end && go_on(self.shared.latch) {
            let Some(report) = self.stage.report(HostTime::now() + LOOK)? else { continue };
            self.take(report);
            match report.state {
                StageState::Idle if self.agree(report.position_m, motion.target_m) => return Ok(true),
                StageState::Fault { .. } => return Ok(false),
                _ => {}
            }
        }
        Ok(false)
    }

    fn take(&mut self, report: StageReport) {
        self.last = Some(report);
        if self.recent.len() == RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back(report);
        self.recorder.stage(report);
    }

    fn accepted<T>(&mut self, answer: Result<T, DeviceError>) -> Result<T, Halted> {
        match answer {
            Ok(value) => Ok(value),
            Err(error) => {
                let cause = match error {
                    DeviceError::Reset { .. } => Cause::StageReset,
                    DeviceError::Fault { code, .. } => Cause::StageFault { code },
                    DeviceError::Lost { .. } | DeviceError::Silent { .. } | DeviceError::Nonsense { .. } => {
                        Cause::StageSilent
                    }
                    _ => Cause::StageRefuses,
                };
                self.failure.get_or_insert(error);
                self.trip(cause)
            }
        }
    }

    fn trip<T>(&self, cause: Cause) -> Result<T, Halted> {
        self.shared.latch.trip(cause, HostTime::now());
        Err(Halted)
    }

    /// Force of the tip on the phantom along a direction of the phantom frame (N), in the mean of the last 10 ms.
    fn force_along(&self, direction: Vec3) -> f64 {
        let counts = self.shared.live.mean().map(|c| c.round() as i32);
        self.shared.sensor.on_phantom(self.shared.format.wrench(counts)).0.dot(&direction)
    }

    fn tell(&mut self) {
        let now = HostTime::now();
        self.told = now;
        let (format, live) = (&self.shared.format, self.shared.live);
        let wrench = format.wrench(live.mean().map(|c| c.round() as i32));
        let force = wrench[..3].iter().map(|f| f * f).sum::<f64>().sqrt();
        let depth_m = self.line.zip(self.last).map(|((site, along), report)| {
            (0..AXES).map(|a| (report.position_m[a] - site[a]) * along[a]).sum::<f64>()
        });
        let (ends, left) = self.after;
        let dropped = [Topic::Force, Topic::Stage, Topic::Markers, Topic::Event];
        self.shared.watched.tell(|status| {
            status.elapsed = now.since(self.shared.started);
            status.left = ends.since(now) + left;
            status.wrench = wrench;
            status.point(force);
            status.losses = live.losses();
            status.depth_m = depth_m;
            status.dropped = dropped.into_iter().map(|t| self.shared.health.dropped(t)).sum();
            status.tripped = self.shared.latch.tripped();
        });
    }
}

/// When a motion that should take so long (s) is taken for one that does not come to its end.
fn overdue_after(takes_s: f64) -> Duration {
    Duration::from_secs_f64(takes_s * PATIENCE) + GRACE
}
