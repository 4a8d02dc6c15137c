//! What a Grbl controller with three axes does: bytes in, time advanced by hand, bytes out, axes moved.
//!
//! No input or output and no clock: [`GrblMachine::advance`] is the only thing that passes time. Events in between (a line read, the
//! end of a motion, a switch that trips) happen at their exact time.
//!
//! Written from the published interface (gnea/grbl, doc/markdown: interface, commands, jogging, settings; grblHAL's differences from
//! its documentation and from watching it). Of G-code there is jogging only, which is what a stage is moved by; each jog ends at rest.
//!
//! Two positions, in millimetres: where an axis really is, 0 at its upper limit switch and minus its travel at its lower one; and what
//! the controller believes, its machine coordinate. Homing makes them equal; stopping dead makes them differ, since a motor at speed
//! runs on.

use super::homing::Homing;
use super::profile::Profile;
use super::setup::{CONTROLLER_AXES, GrblSetup};
use super::words;
use std::collections::{BTreeMap, VecDeque};
use std::fmt::Write as _;
use std::time::Duration;

/// How long a motor runs on when its pulses end at speed (s): a few milliseconds for a loaded stepper; a guess, and not reported.
const RUN_ON_S: f64 = 2e-3;
/// Alarm of grblHAL.
const HOMING_REQUIRED: u8 = 11;
/// Slower feeds are raised to this (mm/min).
const SLOWEST_MM_MIN: f64 = 1.0;
/// A target may lie outside the travel by rounding (mm).
const ROUNDING_MM: f64 = 1e-6;

pub(super) type Place = [f64; CONTROLLER_AXES];

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum State {
    /// Until its banner.
    Booting {
        until: f64,
    },
    Idle,
    Jog,
    Home,
    /// Feed hold at rest.
    Hold,
    /// Safety door at rest.
    Door,
    /// With its code; 0 when it is only locked.
    Alarm(u8),
}

/// What follows when a motion that was told to stop has come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Afterwards {
    Idle,
    Door,
    /// grblHAL, stopped by its door while jogging: suspended, but it goes on calling itself Jog.
    StuckInJog,
}

/// A planned motion (true coordinates).
#[derive(Debug, Clone, Copy)]
struct Block {
    from: Place,
    unit: Place,
    profile: Profile,
    acceleration: f64,
}

#[derive(Debug, Clone, Copy)]
struct Travel {
    block: Block,
    start: f64,
    /// Braking begins then.
    brake_at: Option<f64>,
    afterwards: Option<Afterwards>,
}

impl Travel {
    fn new(block: Block, start: f64) -> Self {
        Self { block, start, brake_at: None, afterwards: None }
    }

    fn end(&self) -> f64 {
        self.start + self.block.profile.duration()
    }
}

/// The controller and its axes.
#[derive(Debug)]
pub struct GrblMachine {
    pub(super) setup: GrblSetup,
    pub(super) settings: BTreeMap<u16, f64>,
    /// Time since it was made (s).
    pub(super) now: f64,
    pub(super) state: State,
    /// Where the axes really are (mm).
    pub(super) true_mm: Place,
    /// True position minus machine coordinate (mm).
    pub(super) offset_mm: Place,
    pub(super) homed: bool,
    pub(super) homing: Option<Homing>,
    travel: Option<Travel>,
    queue: VecDeque<Block>,
    /// Lines that were received, with the time when they are read.
    lines: VecDeque<(f64, String)>,
    partial: Vec<u8>,
    /// Waits for a reset and takes nothing else.
    needs_reset: bool,
    /// Stuck in a jog that has ended.
    stuck: bool,
    /// A status report was asked for that could not be given yet.
    pub(super) asked: bool,
    pub(super) reports_to_offset: u32,
    pub(super) reports_to_overrides: u32,
    pub(super) tell_homed: bool,
    /// No limit switch ever trips.
    pub(super) switches_broken: bool,
    pub(super) output: String,
}

impl GrblMachine {
    /// As it is just after power came on.
    pub fn new(setup: GrblSetup) -> Self {
        let mut machine = Self {
            settings: setup.settings.clone(),
            now: 0.0,
            state: State::Idle,
            true_mm: setup.start_mm,
            offset_mm: setup.start_mm,
            homed: false,
            homing: None,
            travel: None,
            queue: VecDeque::new(),
            lines: VecDeque::new(),
            partial: Vec::new(),
            needs_reset: false,
            stuck: false,
            asked: false,
            reports_to_offset: 0,
            reports_to_overrides: 0,
            tell_homed: false,
            switches_broken: false,
            output: String::new(),
            setup,
        };
        machine.power_up();
        machine
    }

    /// Power fails for a moment, or DTR resets the board: what it knew is gone, and motors stop dead.
    pub fn power_up(&mut self) {
        self.stop_dead();
        self.offset_mm = self.true_mm;
        self.homed = false;
        self.homing = None;
        self.forget();
        self.output.clear();
        self.state = State::Booting { until: self.now + self.setup.boot.as_secs_f64() };
    }

    /// A limit switch trips, whatever trips it.
    pub fn hit_limit(&mut self) {
        if self.hard_limits() && !matches!(self.state, State::Alarm(_) | State::Booting { .. } | State::Home)
        {
            self.stop_dead();
            self.homed = false;
            self.state = State::Alarm(1);
            self.needs_reset = true;
            self.say("ALARM:1");
            self.say("[MSG:Reset to continue]");
        }
    }

    /// From now on no limit switch trips.
    pub fn break_switches(&mut self) {
        self.switches_broken = true;
    }

    /// Takes bytes as they arrive.
    pub fn receive(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if !matches!(self.state, State::Booting { .. }) && !self.realtime(byte) && byte < 0x80 {
                self.queue_byte(byte);
            }
        }
    }

    /// Lets time pass.
    pub fn advance(&mut self, time: Duration) {
        let end = self.now + time.as_secs_f64();
        while let Some(at) = self.next_event().filter(|at| *at <= end) {
            self.carry(at.max(self.now));
            self.happen();
        }
        self.carry(end);
    }

    /// What it has sent since this was called last: whole lines.
    pub fn take_output(&mut self) -> String {
        std::mem::take(&mut self.output)
    }

    /// Where the stage's two axes really are (m).
    pub fn position_m(&self) -> [f64; 2] {
        self.setup.axes.map(|axis| self.true_mm[axis] * 1e-3)
    }

    /// Speed along the path (mm/s).
    pub fn speed_mm_s(&self) -> f64 {
        self.travel.map_or(0.0, |travel| travel.block.profile.at(self.now - travel.start).1)
    }

    pub(super) fn setting(&self, number: usize) -> f64 {
        u16::try_from(number).ok().and_then(|n| self.settings.get(&n)).copied().unwrap_or(0.0)
    }

    pub(super) fn say(&mut self, line: &str) {
        self.output.push_str(line);
        self.output.push_str("\r\n");
    }

    /// Free places among planned motions.
    pub(super) fn free_blocks(&self) -> usize {
        self.setup.blocks() - self.queue.len() - usize::from(self.travel.is_some())
    }

    /// Free bytes of what it has not read.
    pub(super) fn free_bytes(&self) -> usize {
        let unread: usize = self.lines.iter().map(|(_, line)| line.len() + 1).sum();
        (self.setup.rx_bytes() - 1).saturating_sub(unread + self.partial.len())
    }

    fn hard_limits(&self) -> bool {
        self.setting(21) as u32 & 1 == 1
    }

    /// grblHAL tells its state even when it waits for a reset.
    fn mute(&self) -> bool {
        (self.needs_reset || self.state == State::Home) && !self.setup.is_hal()
    }

    /// Does what a real-time byte says; whether it was one.
    fn realtime(&mut self, byte: u8) -> bool {
        match byte {
            b'?' => self.report_or_remember(false),
            0x87 if self.setup.is_hal() => self.report_or_remember(true),
            0x18 => self.reset(),
            b'!' => match self.state {
                State::Idle => self.state = State::Hold,
                State::Jog => self.brake(Afterwards::Idle),
                _ => {}
            },
            b'~' => {
                if matches!(self.state, State::Hold | State::Door) {
                    self.state = State::Idle;
                }
            }
            0x84 => match self.state {
                State::Idle | State::Hold => {
                    self.say("[MSG:Check Door]");
                    self.state = State::Door;
                }
                State::Jog => {
                    self.say("[MSG:Check Door]");
                    let hal = self.setup.is_hal();
                    self.brake(if hal { Afterwards::StuckInJog } else { Afterwards::Door });
                }
                State::Home => self.abort_homing(7),
                _ => {}
            },
            0x85 => {
                if self.setup.is_hal() {
                    self.lines.clear();
                    self.partial.clear();
                }
                // Grbl ignores it unless it jogs: a jog that it has not read yet will run.
                if self.state == State::Jog {
                    self.brake(Afterwards::Idle);
                }
            }
            _ => return false,
        }
        true
    }

    fn report_or_remember(&mut self, full: bool) {
        if self.mute() || self.state == State::Home {
            self.asked = true;
        } else {
            self.report(full);
        }
    }

    fn queue_byte(&mut self, byte: u8) {
        if byte == b'\n' || byte == b'\r' {
            let line = String::from_utf8_lossy(&self.partial).to_ascii_uppercase();
            let line = line.chars().filter(|c| !c.is_ascii_whitespace()).collect();
            self.partial.clear();
            self.lines.push_back((self.now + self.setup.reading.as_secs_f64(), line));
        } else if self.free_bytes() > 0 {
            self.partial.push(byte);
        }
    }

    /// When something happens next.
    fn next_event(&self) -> Option<f64> {
        let boot = match self.state {
            State::Booting { until } => Some(until),
            _ => None,
        };
        let line = self.lines.front().filter(|_| self.reads()).map(|(at, _)| *at);
        let homing = self.homing.as_ref().map(Homing::end);
        let brake = self.travel.and_then(|travel| travel.brake_at);
        [boot, line, homing, self.trip(), brake, self.travel.map(|travel| travel.end())]
            .into_iter()
            .flatten()
            .min_by(f64::total_cmp)
    }

    /// Whether it reads lines: it is not suspended and has room for another motion.
    fn reads(&self) -> bool {
        matches!(self.state, State::Idle | State::Jog | State::Alarm(_))
            && !self.stuck
            && self.travel.is_none_or(|travel| travel.afterwards.is_none())
            && self.free_blocks() > 0
            && (!self.needs_reset || self.setup.is_hal())
    }

    /// When the motion under way runs into a switch.
    fn trip(&self) -> Option<f64> {
        let travel = self.travel.filter(|_| self.hard_limits() && !self.switches_broken)?;
        let block = &travel.block;
        (0..CONTROLLER_AXES)
            .filter_map(|axis| {
                let unit = block.unit[axis];
                let switch = if unit > 0.0 { 0.0 } else { -self.setting(130 + axis) };
                let path = (switch - block.from[axis]) / unit;
                (unit != 0.0 && path >= 0.0 && path < block.profile.length())
                    .then(|| travel.start + block.profile.when(path + ROUNDING_MM))
            })
            .min_by(f64::total_cmp)
    }

    /// Moves the axes to where they are at a time.
    fn carry(&mut self, at: f64) {
        self.now = at;
        if let Some(homing) = &self.homing {
            self.true_mm = homing.at(at);
        }
        if let Some(Travel { block, start, .. }) = self.travel {
            let path = block.profile.at(at - start).0;
            self.true_mm = std::array::from_fn(|axis| block.from[axis] + block.unit[axis] * path);
        }
    }

    /// Does what is due now.
    fn happen(&mut self) {
        if let State::Booting { until } = self.state {
            if until <= self.now {
                self.booted();
            }
        } else if self.homing.as_ref().is_some_and(|homing| homing.end() <= self.now) {
            self.homing_step();
        } else if self.trip().is_some_and(|at| at <= self.now) {
            self.hit_limit();
        } else if let Some(travel) = self.travel.filter(|travel| travel.end() <= self.now) {
            self.arrived(travel);
        } else if self.travel.and_then(|travel| travel.brake_at).is_some_and(|at| at <= self.now) {
            self.start_braking();
        } else if self.reads()
            && self.lines.front().is_some_and(|(at, _)| *at <= self.now)
            && let Some((_, line)) = self.lines.pop_front()
        {
            self.read(&line);
        }
    }

    fn booted(&mut self) {
        let locked = !self.setup.is_hal() && self.setting(22) as u32 & 1 != 0;
        self.state = if locked { State::Alarm(0) } else { State::Idle };
        self.banner();
    }

    fn banner(&mut self) {
        self.reports_to_offset = 0;
        self.reports_to_overrides = 0;
        let banner = if self.setup.is_hal() {
            "GrblHAL 1.1f ['$' or '$HELP' for help]"
        } else {
            "Grbl 1.1h ['$' for help]"
        };
        self.say("");
        self.say(banner);
        if self.must_home() {
            if self.state != State::Alarm(HOMING_REQUIRED) {
                self.state = State::Alarm(HOMING_REQUIRED);
                self.say("ALARM:11");
            }
            self.say("[MSG:Homing cycle required]");
        } else if matches!(self.state, State::Alarm(_)) {
            self.say("[MSG:'$H'|'$X' to unlock]");
        }
    }

    /// grblHAL can be set up to insist on homing.
    fn must_home(&self) -> bool {
        self.setup.is_hal() && self.setting(22) as u32 & 5 == 5 && !self.homed
    }

    fn forget(&mut self) {
        self.lines.clear();
        self.partial.clear();
        self.asked = false;
        self.needs_reset = false;
        self.stuck = false;
    }

    fn reset(&mut self) {
        if self.state == State::Home {
            return self.abort_homing(6);
        }
        if self.travel.is_some() || self.stuck {
            self.stop_dead();
            self.homed = false;
            self.state = State::Alarm(3);
            self.say("ALARM:3");
        }
        self.restart();
    }

    /// A soft reset: what it has read of the world is gone, its position and an alarm stay.
    pub(super) fn restart(&mut self) {
        self.forget();
        if !matches!(self.state, State::Alarm(_)) {
            self.state = State::Idle;
        }
        self.banner();
    }

    fn stop_dead(&mut self) {
        if let Some(Travel { block, .. }) = self.travel {
            let run_on = self.speed_mm_s() * RUN_ON_S;
            for axis in 0..CONTROLLER_AXES {
                self.true_mm[axis] += block.unit[axis] * run_on;
                self.offset_mm[axis] += block.unit[axis] * run_on;
            }
        }
        self.travel = None;
        self.queue.clear();
    }

    fn brake(&mut self, afterwards: Afterwards) {
        let Some(travel) = self.travel.as_mut().filter(|travel| travel.afterwards.is_none()) else { return };
        travel.afterwards = Some(afterwards);
        travel.brake_at = Some(self.now + self.setup.prepared.as_secs_f64());
        self.queue.clear();
    }

    fn start_braking(&mut self) {
        let Some(travel) = &mut self.travel else { return };
        travel.brake_at = None;
        let (path, speed) = travel.block.profile.at(self.now - travel.start);
        let left = travel.block.profile.length() - path;
        let braking = Profile::braking(speed, travel.block.acceleration);
        // When it is slowing down already, braking changes nothing.
        if braking.length() < left {
            travel.block = Block { from: self.true_mm, profile: braking, ..travel.block };
            travel.start = self.now;
        }
    }

    fn arrived(&mut self, travel: Travel) {
        self.travel = None;
        match travel.afterwards {
            Some(Afterwards::Door) => self.state = State::Door,
            Some(Afterwards::StuckInJog) => self.stuck = true,
            None if !self.queue.is_empty() => {
                let next = self.queue.pop_front();
                self.travel = next.map(|block| Travel::new(block, self.now));
            }
            None | Some(Afterwards::Idle) => self.state = State::Idle,
        }
    }

    fn read(&mut self, line: &str) {
        let longest = if self.setup.is_hal() { 256 } else { 79 };
        let reply = if line.len() > longest {
            Err(11)
        } else if line.is_empty() {
            Ok(())
        } else if let Some(command) = line.strip_prefix('$') {
            match self.command(command) {
                // The reply comes when homing has ended.
                Ok(()) if self.state == State::Home => return,
                reply => reply,
            }
        } else if matches!(self.state, State::Alarm(_) | State::Jog) {
            Err(9)
        } else {
            // G-code programs are not run here.
            Err(20)
        };
        self.reply(reply);
    }

    pub(super) fn reply(&mut self, reply: Result<(), u8>) {
        match reply {
            Ok(()) => self.say("ok"),
            Err(code) => self.say(&format!("error:{code}")),
        }
    }

    fn command(&mut self, command: &str) -> Result<(), u8> {
        let waiting = matches!(self.state, State::Idle | State::Alarm(_));
        match command {
            "$" => self.say_settings(),
            "X" => {
                if matches!(self.state, State::Alarm(_)) {
                    if self.needs_reset {
                        return Err(79);
                    }
                    if self.must_home() {
                        return Err(46);
                    }
                    self.say("[MSG:Caution: Unlocked]");
                    self.state = State::Idle;
                }
            }
            _ if command.starts_with("J=") => return self.jog(&command[2..]),
            _ if !waiting => return Err(8),
            "I" => self.say_build(),
            "H" if self.needs_reset => return Err(79),
            "H" => return self.start_homing(),
            _ => return self.set(command),
        }
        Ok(())
    }

    fn set(&mut self, command: &str) -> Result<(), u8> {
        let (number, value) = command.split_once('=').ok_or(3)?;
        let number: u16 = number.parse().map_err(|_| 2)?;
        let value: f64 = value.parse().map_err(|_| 2)?;
        if number == 20 && value != 0.0 && self.setting(22) == 0.0 {
            return Err(10);
        }
        *self.settings.get_mut(&number).ok_or(3)? = value;
        Ok(())
    }

    fn say_settings(&mut self) {
        let mut text = String::new();
        for (number, value) in &self.settings {
            let decimals = if *number >= 11 && value.fract() != 0.0 || *number >= 100 { 3 } else { 0 };
            // Writing to a String cannot fail.
            let _ = write!(text, "${number}={value:.decimals$}\r\n");
        }
        self.output.push_str(&text);
    }

    fn say_build(&mut self) {
        let lines: &[&str] = if self.setup.is_hal() {
            &[
                "[VER:1.1f.20260817:]",
                "[OPT:VNML+,100,1024,3,0]",
                "[AXS:3:XYZ]",
                "[NEWOPT:ENUMS,RT+,TC,SED]",
                "[FIRMWARE:grblHAL]",
                "[DRIVER:Emulator]",
            ]
        } else {
            &["[VER:1.1h.20190830:]", "[OPT:V,15,128]"]
        };
        for line in lines {
            self.say(line);
        }
    }

    fn jog(&mut self, text: &str) -> Result<(), u8> {
        if !matches!(self.state, State::Idle | State::Jog) {
            return Err(8);
        }
        let jog = words::jog(text)?;
        let from = self.planned_end();
        let mut to = from;
        for axis in 0..CONTROLLER_AXES {
            let Some(value) = jog.axes_mm[axis] else { continue };
            let machine = match (jog.relative, jog.machine) {
                (true, _) => from[axis] - self.offset_mm[axis] + value,
                (false, true) => value,
                (false, false) => value + self.setup.work_offset_mm[axis],
            };
            to[axis] = machine + self.offset_mm[axis];
        }
        // grblHAL does not check axes that have not homed.
        if self.setting(20) != 0.0 && (self.homed || !self.setup.is_hal()) {
            let within = |axis: usize| {
                let machine = to[axis] - self.offset_mm[axis];
                (-self.setting(130 + axis) - ROUNDING_MM..=ROUNDING_MM).contains(&machine)
            };
            if !(0..CONTROLLER_AXES).all(within) {
                return Err(15);
            }
        }
        let length = (0..CONTROLLER_AXES).map(|a| (to[a] - from[a]).powi(2)).sum::<f64>().sqrt();
        if length > 0.0 {
            let unit: Place = std::array::from_fn(|axis| (to[axis] - from[axis]) / length);
            let most = |first: usize| {
                (0..CONTROLLER_AXES)
                    .map(|axis| self.setting(first + axis) / unit[axis].abs())
                    .fold(f64::INFINITY, f64::min)
            };
            let speed = jog.feed_mm_min.max(SLOWEST_MM_MIN).min(most(110)) / 60.0;
            let acceleration = most(120);
            let profile = Profile::trapezoid(length, speed, acceleration);
            self.queue.push_back(Block { from, unit, profile, acceleration });
            if self.travel.is_none() {
                self.state = State::Jog;
                let next = self.queue.pop_front();
                self.travel = next.map(|block| Travel::new(block, self.now));
            }
        }
        Ok(())
    }

    /// Where the last motion planned ends (true coordinates).
    fn planned_end(&self) -> Place {
        let last = self.queue.back().copied().or(self.travel.map(|travel| travel.block));
        last.map_or(self.true_mm, |block| {
            let length = block.profile.length();
            std::array::from_fn(|axis| block.from[axis] + block.unit[axis] * length)
        })
    }
}
