//! A stage run by Grbl: what it is told, and how its answers become reports.
//!
//! One line is outstanding at a time, and each is waited for: a jog that was acknowledged is under way, so that cancelling it cannot
//! meet one that the controller has not read yet (the race of gnea/grbl). An acknowledgement that does not come leaves nobody knowing
//! whether the motion runs; then the stage is stopped and latched.

use super::codes::{self, NO_CODE};
use super::command;
use super::connect::{Axes, GrblOptions, connect};
use super::knowledge::{Activity, Event, Knowledge, STOP_MARGIN};
use super::line::Dialect;
use super::link::Link;
use super::settings::Machine;
use super::status::Word;
use super::stopper::{GrblStopper, Latch};
use crate::clock::HostTime;
use crate::device::{
    AXES, ClockComparison, DeviceError, Motion, Stage, StageIdentity, StageLimits, StageReport, Stopper,
    Stopping,
};
use crate::driver::DriverError;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How long a stage that should stand is waited for to say so before it is reset.
const LAST_ANSWER: Duration = Duration::from_millis(300);
/// How long to look for a refusal of homing before its reports are left to say it.
const REFUSAL: Duration = Duration::from_millis(200);
/// No slower and no faster is asked for reports, whatever the options say (1/s).
const RATE_HZ: [f64; 2] = [0.5, 200.0];
/// Relative excess over a limit that is rounding.
const ROUNDING: f64 = 1e-9;

/// A two-axis stage run by Grbl 1.1 or grblHAL. Positions are machine coordinates (m).
pub struct GrblStage {
    link: Link,
    dialect: Dialect,
    known: Knowledge,
    identity: StageIdentity,
    letters: [char; AXES],
    machine: Machine,
    options: GrblOptions,
    latch: Arc<Latch>,
    /// Stops that a person has cleared.
    cleared: u32,
    next_ask: HostTime,
    /// When the first question was put that no report has answered.
    unanswered: Option<HostTime>,
}

impl GrblStage {
    /// Opens the port, finds out who answers, and reads its settings. Ends with the controller freshly reset and nothing moving; latched
    /// where it was found stopped by somebody who has not cleared it.
    ///
    /// # Errors
    /// [`DriverError`]: the port cannot be opened, something else answers, or its settings do not serve.
    pub fn connect(options: &GrblOptions) -> Result<Self, DriverError> {
        connect(options)
    }

    pub(super) fn new(
        link: Link,
        dialect: Dialect,
        identity: StageIdentity,
        axes: Axes,
        machine: Machine,
        options: &GrblOptions,
    ) -> Self {
        Self {
            link,
            dialect,
            letters: axes.letters,
            known: Knowledge::new(axes, machine.limits.step_m),
            identity,
            machine,
            options: options.clone(),
            latch: Arc::default(),
            cleared: 0,
            next_ask: HostTime::now(),
            unanswered: None,
        }
    }

    /// The acceleration (m/s²) that a straight motion between two positions (m) will have: Grbl takes the most that no axis objects to.
    pub fn acceleration_along(&self, from_m: [f64; AXES], to_m: [f64; AXES]) -> f64 {
        along(from_m, to_m, self.machine.limits.acceleration_m_s2)
    }

    /// How long it goes on as planned, at most, before it begins to brake when told to stop: motion that it has prepared in pieces of
    /// 10 ms, of which Grbl holds 5 and grblHAL 9 (their step segment buffers, as delivered).
    pub fn braking_delay(&self) -> Duration {
        Duration::from_millis(match self.dialect {
            Dialect::Classic => 50,
            Dialect::Hal => 90,
        })
    }

    /// Lines from the controller that made no sense so far.
    pub fn nonsense(&self) -> u64 {
        self.link.nonsense()
    }

    /// Latches it until it is cleared; in the controller as well, so that whoever connects next finds it so. One in alarm keeps that.
    pub(super) fn latch(&mut self, why: &str) -> Result<(), DeviceError> {
        self.known.latch(NO_CODE, why);
        if self.machine.parks { Ok(()) } else { self.link.send(&[command::SAFETY_DOOR]) }
    }

    fn stopped(&self) -> bool {
        self.latch.stops() != self.cleared
    }

    fn stop_byte(&self) -> u8 {
        if self.machine.parks { command::RESET } else { command::SAFETY_DOOR }
    }

    fn refused(&self, what: &'static str, reason: impl Into<String>) -> DeviceError {
        DeviceError::Refused { device: self.link.device(), what, reason: reason.into() }
    }

    fn refused_with(&self, what: &'static str, code: u8) -> DeviceError {
        self.refused(what, format!("error {code}: {}", codes::error(code)))
    }

    fn fault(&self) -> DeviceError {
        let (code, meaning) = match &self.known.fault {
            Some(fault) => (fault.code, fault.meaning.clone()),
            None => (NO_CODE, "it was told to stop".to_owned()),
        };
        DeviceError::Fault { device: self.link.device(), code, meaning }
    }

    /// Nothing is latched and nothing moves.
    fn ready(&self, what: &'static str) -> Result<(), DeviceError> {
        if self.known.fault.is_some() || self.stopped() {
            return Err(self.fault());
        }
        if self.known.activity != Activity::Standing {
            return Err(self.refused(what, "it is moving"));
        }
        Ok(())
    }

    /// Takes note of a stopper that was used meanwhile.
    fn notice_stop(&mut self) {
        if self.stopped() && self.known.activity != Activity::Standing {
            self.leave_homing();
            self.known.stopping(HostTime::now());
        }
    }

    /// It is told to end homing: what was asked meanwhile was not to be answered, from now on there are reports.
    fn leave_homing(&mut self) {
        if matches!(self.known.activity, Activity::Homing { .. }) {
            self.unanswered = None;
        }
    }

    fn ask(&mut self, now: HostTime) -> Result<(), DeviceError> {
        // What grblHAL tells only now and then matters at the beginning: whether it has homed, and why it is in alarm.
        let full = self.dialect == Dialect::Hal && self.known.word.is_none();
        self.link.send(&[if full { command::FULL_STATUS } else { command::STATUS }])?;
        if now.since(self.next_ask) > self.options.silence {
            // Nobody has listened meanwhile: that there was no answer says nothing.
            self.unanswered = None;
        }
        let moving = matches!(self.known.activity, Activity::Moving { .. } | Activity::Stopping { .. });
        let rate = if moving { self.options.moving_rate_hz } else { self.options.idle_rate_hz };
        self.next_ask = now + Duration::from_secs_f64(1.0 / rate.clamp(RATE_HZ[0], RATE_HZ[1]));
        self.unanswered.get_or_insert(now);
        Ok(())
    }

    /// Asks when it is time to, and takes the next line. `None`: there was none until `until`.
    fn pump(&mut self, until: HostTime) -> Result<Option<Event>, DeviceError> {
        loop {
            self.notice_stop();
            let now = HostTime::now();
            if now >= self.next_ask {
                self.ask(now)?;
            }
            let Some((at, line)) = self.link.next(until.min(self.next_ask))? else {
                self.stop_harder()?;
                self.overdue()?;
                if HostTime::now() >= until {
                    return Ok(None);
                }
                continue;
            };
            let stopped = self.stopped();
            let homing = matches!(self.known.activity, Activity::Homing { .. });
            let event = self.known.take(at, line, stopped);
            if homing && !matches!(self.known.activity, Activity::Homing { .. }) {
                // What was asked meanwhile was not to be answered.
                self.unanswered = None;
            }
            match &event {
                Event::Report(_) => {
                    self.unanswered = None;
                    self.link.made_sense();
                }
                Event::Untrue(said) => self.link.count_nonsense(said.clone()),
                Event::Astray(position_m) => {
                    self.known.stopping(HostTime::now());
                    let [x, z] = position_m.map(|m| m * 1e3);
                    let [a, b] = self.letters;
                    self.known.latch(
                        NO_CODE,
                        format!(
                            "it was told to stop because it is at {a} {x:.3} {b} {z:.3} mm, off its path"
                        ),
                    );
                    self.known.lose_position();
                    self.link.send(&[self.stop_byte()])?;
                }
                Event::Banner { unexplained } => {
                    self.unanswered = None;
                    if *unexplained {
                        return Err(DeviceError::Reset { device: self.link.device(), cause: None });
                    }
                }
                _ => {}
            }
            self.stop_harder()?;
            return Ok(Some(event));
        }
    }

    /// Takes lines until one brings what is waited for. `None`: none had until `until`, whatever else has come without end.
    fn wait_for<T>(
        &mut self,
        until: HostTime,
        mut pick: impl FnMut(&Self, Event) -> Option<T>,
    ) -> Result<Option<T>, DeviceError> {
        while let Some(event) = self.pump(until)? {
            let picked = pick(self, event);
            if picked.is_some() {
                return Ok(picked);
            }
            self.overdue()?;
            if HostTime::now() >= until && self.link.is_drained() {
                break;
            }
        }
        Ok(None)
    }

    /// A stage that is not seen at rest when it should be is reset, whatever it has said or not: it stops dead, says so with an alarm,
    /// and has to home again. Since bytes may get lost, it is reset until it is seen at rest.
    fn stop_harder(&mut self) -> Result<(), DeviceError> {
        let now = HostTime::now();
        let Activity::Stopping { until, asked, .. } = &mut self.known.activity else { return Ok(()) };
        // What was read and not yet taken may say that it stands.
        if now < *until || !self.link.is_drained() {
            return Ok(());
        }
        if !*asked {
            // Whoever told it to stop may not have listened since.
            (*asked, *until, self.next_ask) = (true, now + LAST_ANSWER, now);
            return Ok(());
        }
        self.reset_because("it was reset because it was not seen at rest when told to stop")
    }

    fn reset_because(&mut self, meaning: &str) -> Result<(), DeviceError> {
        self.leave_homing();
        self.known.reset(HostTime::now(), meaning);
        self.link.send(&[command::RESET])
    }

    /// Nothing has come; whether it should have by now.
    fn overdue(&mut self) -> Result<(), DeviceError> {
        let now = HostTime::now();
        if let Activity::Homing { until, elsewhere, .. } = self.known.activity {
            let unacknowledged =
                elsewhere.is_some_and(|[first, last]| last.since(first) > self.options.reply);
            if now < until && !unacknowledged {
                return Ok(());
            }
            // It may be homing all the same.
            self.reset_because("it was reset because it did not say that homing ended")?;
            let waited = if unacknowledged { self.options.reply } else { self.machine.homing };
            return Err(DeviceError::Silent { device: self.link.device(), waited, during: "homing" });
        }
        // After a limit alarm Grbl says nothing until it is reset.
        let mute = self.dialect == Dialect::Classic
            && self.known.fault.as_ref().is_some_and(|fault| matches!(fault.code, 1 | 2));
        match self.unanswered {
            Some(since) if !mute && now.since(since) > self.options.silence => {
                self.unanswered = None;
                Err(self.link.unanswered(now.since(since), "being asked for its status", "a status report"))
            }
            _ => Ok(()),
        }
    }

    /// Waits for the reply to the line that was sent last; the inner error is the controller's code. Reports that come before it tell
    /// of what was before, and are dropped.
    fn reply(&mut self) -> Result<Result<(), u8>, DeviceError> {
        let until = HostTime::now() + self.options.reply;
        let reply = self.wait_for(until, |stage, event| match event {
            Event::Done => Some(Ok(Ok(()))),
            Event::Refused { code, .. } => Some(Ok(Err(code))),
            Event::Alarm(_) => Some(Err(stage.fault())),
            _ => None,
        })?;
        reply.unwrap_or_else(|| {
            Err(self.link.unanswered(self.options.reply, "being told to do something", "ok or error"))
        })
    }

    /// Where it stands (m), asking when it is not known.
    pub(super) fn position(&mut self) -> Result<[f64; AXES], DeviceError> {
        let until = HostTime::now() + self.options.silence;
        if self.known.stale {
            self.next_ask = HostTime::now();
        }
        let known = |stage: &Self| (!stage.known.stale).then_some(());
        if known(self).is_none() && self.wait_for(until, |stage, _| known(stage))?.is_none() {
            return Err(self.link.unanswered(
                self.options.silence,
                "being asked for its position",
                "a report",
            ));
        }
        self.known
            .last
            .map(|last| last.position_m)
            .ok_or(DeviceError::NotHomed { device: self.link.device() })
    }

    fn check(&self, from_m: [f64; AXES], motion: &Motion) -> Result<(), DeviceError> {
        let limits = &self.machine.limits;
        if let Some(axis) = limits.outside(motion.target_m) {
            let (target_m, travel_m) = (motion.target_m[axis], limits.travel_m[axis]);
            return Err(DeviceError::OutsideTravel { axis, target_m, travel_m });
        }
        let direction = direction(from_m, motion.target_m);
        let asked = [
            ("a speed", motion.speed_m_s, limits.speed_m_s, "m/s"),
            ("an acceleration", motion.acceleration_m_s2, limits.acceleration_m_s2, "m/s²"),
        ];
        for (what, asked, most, unit) in asked {
            for axis in 0..AXES {
                let share = asked * direction[axis].abs();
                // Written so that what is no number is refused.
                if !(asked > 0.0 && share <= most[axis] * (1.0 + ROUNDING)) {
                    return Err(DeviceError::TooFast { what, axis, asked: share, most: most[axis], unit });
                }
            }
        }
        let feed = command::feed_mm_min(motion.speed_m_s);
        if feed < command::SLOWEST_MM_MIN {
            let reason =
                format!("it moves no slower than {} mm/min, not at {feed:.3}", command::SLOWEST_MM_MIN);
            return Err(self.refused("move", reason));
        }
        Ok(())
    }

    fn reset(&mut self) -> Result<(), DeviceError> {
        // The banner may get lost, as any line.
        for _ in 0..2 {
            self.link.send(&[command::RESET])?;
            let until = HostTime::now() + self.options.banner;
            let banner = |event| matches!(event, Event::Banner { .. }).then_some(());
            if self.wait_for(until, |_, event| banner(event))?.is_some() {
                return Ok(());
            }
        }
        Err(self.link.unanswered(self.options.banner * 2, "being reset", "its banner"))
    }

    fn unlock(&mut self) -> Result<(), DeviceError> {
        self.reset()?;
        self.next_ask = HostTime::now();
        let until = HostTime::now() + self.options.silence;
        let Some(word) = self.wait_for(until, |stage, _| stage.known.word)? else {
            return Err(self.link.unanswered(self.options.silence, "being asked for its status", "a report"));
        };
        match word {
            Word::Idle => Ok(()),
            Word::Alarm(_) => {
                self.link.send(b"$X\n")?;
                match self.reply()? {
                    Ok(()) => Ok(()),
                    // Locked but for homing, which is all that this driver lets an unhomed stage do.
                    Err(code) if codes::ONLY_HOMING.contains(&code) => {
                        self.known.lose_position();
                        Ok(())
                    }
                    Err(code) => Err(self.refused_with("clear its fault", code)),
                }
            }
            _ => Err(self.refused("clear its fault", "it is held, by its door or feed-hold input")),
        }
    }
}

impl Stage for GrblStage {
    fn identity(&self) -> &StageIdentity {
        &self.identity
    }

    fn limits(&self) -> &StageLimits {
        &self.machine.limits
    }

    fn stopping(&self) -> Option<Stopping> {
        let deceleration_m_s2 =
            self.machine.limits.acceleration_m_s2.into_iter().fold(f64::INFINITY, f64::min);
        Some(Stopping { delay: self.braking_delay(), deceleration_m_s2 })
    }

    fn home(&mut self) -> Result<(), DeviceError> {
        self.ready("home")?;
        self.link.send(b"$H\n")?;
        let now = HostTime::now();
        self.known.homing(now + self.machine.homing);
        self.next_ask = now;
        let began = self.wait_for(now + REFUSAL, |stage, event| match event {
            Event::Refused { code, .. } => Some(Err(stage.refused_with("home", code))),
            Event::Alarm(_) => Some(Err(stage.fault())),
            Event::Done => Some(Ok(())),
            Event::Report(_) if stage.known.word == Some(Word::Home) => Some(Ok(())),
            _ => None,
        })?;
        began.unwrap_or(Ok(()))
    }

    fn move_to(&mut self, motion: Motion) -> Result<(), DeviceError> {
        self.ready("move")?;
        if !self.known.homed {
            return Err(DeviceError::NotHomed { device: self.link.device() });
        }
        let from_m = self.position()?;
        self.check(from_m, &motion)?;
        let line = command::jog(self.letters, motion.target_m, self.machine.decimals, motion.speed_m_s);
        let acceleration = self.acceleration_along(from_m, motion.target_m);
        let braking = Duration::from_secs_f64(1.5 * motion.speed_m_s / acceleration) + STOP_MARGIN;
        // Asking where it stands took time: a stopper may have been used.
        self.ready("move")?;
        // From here on its position may change, acknowledged or not.
        self.known.moving(from_m, motion.target_m, braking);
        self.link.send(line.as_bytes())?;
        match self.reply() {
            Ok(Ok(())) => {
                // Reports from before have said that it stands.
                self.known.moving(from_m, motion.target_m, braking);
                self.next_ask = HostTime::now();
                Ok(())
            }
            Ok(Err(code)) => {
                self.known.activity = Activity::Standing;
                Err(self.refused_with("move", code))
            }
            Err(error @ (DeviceError::Silent { .. } | DeviceError::Nonsense { .. })) => {
                // Reports from before may have said that it stands.
                self.known.moving(from_m, motion.target_m, braking);
                self.known.stopping(HostTime::now());
                self.known.latch(NO_CODE, "it was told to stop because it did not acknowledge a motion");
                self.link.send(&[self.stop_byte()])?;
                Err(error)
            }
            Err(error @ DeviceError::Lost { .. }) => {
                // Nobody knows whether it goes.
                self.known.moving(from_m, motion.target_m, braking);
                Err(error)
            }
            // An alarm or a restart: it stands.
            Err(error) => Err(error),
        }
    }

    fn stop(&mut self) -> Result<(), DeviceError> {
        match self.known.activity {
            // Nothing else ends homing. Unless it has not begun yet, an alarm follows.
            Activity::Homing { .. } => return self.reset_because("it was reset instead of homing"),
            Activity::Stopping { reset: true, .. } => return self.link.send(&[command::RESET]),
            // That it stands is only what was believed. One that does ignores the byte.
            Activity::Standing => {}
            Activity::Moving { .. } | Activity::Stopping { .. } => self.known.stopping(HostTime::now()),
        }
        // A cancellation would take back what a stopper has latched.
        self.link.send(&[if self.stopped() { self.stop_byte() } else { command::JOG_CANCEL }])
    }

    fn clear(&mut self) -> Result<(), DeviceError> {
        // Stops that come while this runs stay latched.
        let stops = self.latch.stops();
        if self.known.fault.is_none() && !self.stopped() {
            return Ok(());
        }
        self.known.awaiting_banner = true;
        let unlocked = self.unlock();
        self.known.awaiting_banner = false;
        unlocked?;
        self.cleared = stops;
        self.known.fault = None;
        self.known.activity = Activity::Standing;
        Ok(())
    }

    fn report(&mut self, until: HostTime) -> Result<Option<StageReport>, DeviceError> {
        let report = self.wait_for(until, |stage, event| match event {
            Event::Report(report) | Event::Alarm(Some(report)) => Some(Ok(report)),
            // Homing is the only thing whose reply is not waited for.
            Event::Refused { code, homing: true } => Some(Err(stage.refused_with("home", code))),
            _ => None,
        })?;
        report.transpose()
    }

    /// Grbl tells no time.
    fn compare_clocks(&mut self) -> Result<Option<ClockComparison>, DeviceError> {
        Ok(None)
    }

    fn meaning(&self, code: u8) -> String {
        match &self.known.fault {
            // What has no number is known only as long as it is latched.
            Some(fault) if fault.code == code => fault.meaning.clone(),
            _ => codes::alarm(code).to_owned(),
        }
    }

    fn line_counts(&self) -> Vec<(&'static str, u64)> {
        vec![("lines_without_sense", self.nonsense())]
    }

    fn stopper(&self) -> Result<Box<dyn Stopper>, DeviceError> {
        let port = Mutex::new(self.link.second()?);
        Ok(Box::new(GrblStopper { port, latch: self.latch.clone(), byte: self.stop_byte() }))
    }
}

fn direction(from_m: [f64; AXES], to_m: [f64; AXES]) -> [f64; AXES] {
    let path: [f64; AXES] = std::array::from_fn(|axis| to_m[axis] - from_m[axis]);
    let length = path.iter().map(|x| x * x).sum::<f64>().sqrt();
    // A motion to where it stands is checked as one along both axes.
    path.map(|x| if length > 0.0 { x / length } else { 1.0 })
}

/// The largest value along a line of which no axis has more than its share.
fn along(from_m: [f64; AXES], to_m: [f64; AXES], most: [f64; AXES]) -> f64 {
    let direction = direction(from_m, to_m);
    (0..AXES).map(|axis| most[axis] / direction[axis].abs()).fold(f64::INFINITY, f64::min)
}
