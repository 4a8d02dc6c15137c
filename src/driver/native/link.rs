//! How requests go to the controller, answers come back, and what is streamed is kept until somebody wants it.
//!
//! Owns the port and one end of the conversation ([`Host`]); knows what has to be said and when, not what it means for the stage.

use super::connect::NativeOptions;
use super::stopper::{Latch, NativeStopper};
use super::words::{self, Task};
use crate::clock::HostTime;
use crate::device::DeviceError;
use crate::driver::port::BytePort;
use firmware_proto::{
    Due, EMERGENCY_STOP, Encoded, Heard, Host, Identity, Patience, Refusal, Request, Response, State,
};
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// One wait for bytes. Short, so that whoever waits sees in between what is due.
const READ_WAIT: Duration = Duration::from_millis(4);
/// Streamed states that are kept for whoever asks too rarely; the oldest goes first.
const KEPT: usize = 256;
/// Bytes of senseless talk that a message quotes.
const QUOTED: usize = 32;

/// What the line did to what was sent over it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NativeLosses {
    /// Requests that were sent again because no answer came.
    pub resent: u64,
    /// Streamed frames that never came.
    pub streamed_lost: u64,
    /// Streamed frames that came after a later one, such as second copies; not reported.
    pub streamed_late: u64,
    /// Reports that nobody fetched in time.
    pub unfetched: u64,
    /// Frames that arrived damaged.
    pub damaged: u64,
    /// Whole frames that nothing had asked for, such as an answer's second copy.
    pub unasked: u64,
}

/// Why an answer does not come.
#[derive(Debug)]
pub(super) enum Trouble {
    /// What the operating system says.
    Lost(io::Error),
    /// Nothing for so long.
    Silent(Duration),
    /// The controller no longer knows the session: it has booted, or somebody else has opened one.
    SessionLost,
    /// It will not.
    Refused(Refusal),
    /// An answer to something else, though it has the request's number.
    Senseless(Response),
}

impl From<io::Error> for Trouble {
    fn from(error: io::Error) -> Self {
        Self::Lost(error)
    }
}

/// An answer and when what happened.
#[derive(Debug, Clone, Copy)]
pub(super) struct Answer {
    pub(super) response: Response,
    /// Before the request's first copy was handed to the operating system.
    pub(super) sent: HostTime,
    /// Controller's time when the answer left (µs).
    pub(super) tick_us: u32,
    /// When its bytes had arrived.
    pub(super) arrived: HostTime,
}

/// A streamed state.
#[derive(Debug, Clone, Copy)]
pub(super) struct Streamed {
    pub(super) state: State,
    pub(super) tick_us: u32,
    pub(super) arrived: HostTime,
}

/// A port with a controller behind it.
pub(super) struct Link {
    port: Box<dyn BytePort>,
    device: String,
    host: Host,
    /// Nonces of this link: the first, drawn at random, and the newest. Those between were this link's too.
    sessions: [u32; 2],
    patience: Patience,
    /// Longest time without a word of ours.
    quiet: Duration,
    sent: HostTime,
    answer: Option<Answer>,
    streamed: VecDeque<Streamed>,
    /// Time of the newest streamed state (µs), and the state.
    newest: Option<(u32, State)>,
    latch: Arc<Latch>,
    /// Stops whose pattern was sent again from here, and those that the controller has acknowledged.
    repeated: u32,
    acknowledged: u32,
    repeated_at: HostTime,
    losses: NativeLosses,
    /// First bytes heard, as long as they make no sense.
    said: Vec<u8>,
    made_sense: bool,
}

impl Link {
    /// `session` must never have been used before.
    pub(super) fn new(port: Box<dyn BytePort>, options: &NativeOptions, session: u32) -> Self {
        let resend_after_us = u32::try_from(options.resend.as_micros()).unwrap_or(u32::MAX).max(1);
        let tries = options.patience.as_micros() / u128::from(resend_after_us);
        let patience = Patience { resend_after_us, tries: u8::try_from(tries).unwrap_or(u8::MAX).max(1) };
        Self {
            port,
            device: format!("the stage on {}", options.port),
            host: Host::new(session, patience),
            sessions: [session; 2],
            patience,
            quiet: options.lease / 3,
            sent: HostTime::now(),
            answer: None,
            streamed: VecDeque::with_capacity(KEPT),
            newest: None,
            latch: Arc::default(),
            repeated: 0,
            acknowledged: 0,
            repeated_at: HostTime::from_nanos(0),
            losses: NativeLosses::default(),
            said: Vec::new(),
            made_sense: false,
        }
    }

    pub(super) fn device(&self) -> &str {
        &self.device
    }

    pub(super) fn host(&mut self) -> &mut Host {
        &mut self.host
    }

    pub(super) fn losses(&self) -> NativeLosses {
        let damaged = self.losses.damaged + u64::from(self.host.dropped().total());
        NativeLosses { damaged, ..self.losses }
    }

    /// Stops so far.
    pub(super) fn stops(&self) -> u32 {
        self.latch.stops()
    }

    /// Waits until the controller has acknowledged every stop.
    pub(super) fn await_stops(&mut self) -> Result<(), Trouble> {
        let began = HostTime::now();
        let most = Duration::from_micros(self.patience.resend_after_us.into()) * self.patience.tries.into();
        while self.stops() != self.acknowledged {
            self.attend(READ_WAIT)?;
            let waited = HostTime::now().since(began);
            if waited > most {
                return Err(Trouble::Silent(waited));
            }
        }
        Ok(())
    }

    pub(super) fn stopper(&self) -> io::Result<NativeStopper> {
        Ok(NativeStopper::new(self.port.second()?, Arc::clone(&self.latch)))
    }

    /// Whether a session was opened by this link.
    pub(super) fn was_ours(&self, session: u32) -> bool {
        let [first, newest] = self.sessions;
        session.wrapping_sub(first) <= newest.wrapping_sub(first)
    }

    /// Ends whatever the line holds from before. An idle line does not mind.
    pub(super) fn clear_line(&mut self) -> Result<(), Trouble> {
        Ok(self.port.write(&[0])?)
    }

    /// Forgets the session and asks who is there, for a session of a new number.
    pub(super) fn greet_anew(&mut self, until: HostTime) -> Result<Identity, Trouble> {
        // The number after the last one is as good as a random one: late requests of the old session are not valid in it.
        let next = self.sessions[1].wrapping_add(1).max(1);
        self.sessions[1] = next;
        self.losses.damaged += u64::from(self.host.dropped().total());
        self.host = Host::new(next, self.patience);
        self.streamed.clear();
        self.newest = None;
        self.greet(until)
    }

    /// Asks who is there until somebody answers: a board that resets when the port is opened takes its time.
    pub(super) fn greet(&mut self, until: HostTime) -> Result<Identity, Trouble> {
        let began = HostTime::now();
        loop {
            let hello = self.host.hello(micros(HostTime::now()));
            match self.exchange(hello) {
                Ok(Answer { response: Response::Identity { identity }, .. }) => return Ok(identity),
                Ok(_) | Err(Trouble::Silent(_)) => {}
                Err(trouble) => return Err(trouble),
            }
            if HostTime::now() >= until {
                return Err(Trouble::Silent(HostTime::now().since(began)));
            }
        }
    }

    /// Opens the session that was greeted for.
    pub(super) fn open_session(&mut self, until: HostTime) -> Result<Identity, Trouble> {
        loop {
            let identity = self.greet(until)?;
            if self.host.is_open() {
                return Ok(identity);
            }
            // Answered, but not with our session: a copy of an older answer, or somebody else was faster.
            if HostTime::now() >= until {
                return Err(Trouble::SessionLost);
            }
        }
    }

    /// A request and its answer; sends it again until one comes or the patience is over.
    pub(super) fn ask(&mut self, request: Request) -> Result<Answer, Trouble> {
        let frame = loop {
            // A word that renews the lease may still wait for its answer.
            match self.host.send(request, micros(HostTime::now())) {
                Ok(frame) => break frame,
                Err(_) => self.attend(READ_WAIT)?,
            }
        };
        self.exchange(frame)
    }

    /// As [`Link::ask`], where a refusal is trouble.
    pub(super) fn set(&mut self, request: Request) -> Result<Response, Trouble> {
        match self.ask(request)?.response {
            Response::Refused { refusal, .. } => Err(Trouble::Refused(refusal)),
            response => Ok(response),
        }
    }

    /// The stop request and its answer. Waits for nothing that was asked before.
    pub(super) fn stop(&mut self) -> Result<Answer, Trouble> {
        let frame = self.host.stop(micros(HostTime::now()));
        self.exchange(frame)
    }

    /// Sends the stop request without waiting: for a motion of which nobody knows whether it runs. Once it has arrived, that motion
    /// does not start any more; until it is answered it is sent again by whoever attends to the line.
    pub(super) fn call_off(&mut self) {
        let frame = self.host.stop(micros(HostTime::now()));
        // A port that takes nothing fails again when it is next used.
        let _ = self.port.write(frame.as_bytes());
    }

    /// Says a word if none was said for a while.
    pub(super) fn keep_alive(&mut self) -> Result<(), Trouble> {
        let now = micros(HostTime::now());
        let quiet = self.host.silent_us(now).is_none_or(|us| u128::from(us) >= self.quiet.as_micros());
        if quiet && let Ok(ping) = self.host.send(Request::Ping { host_tick_us: now }, now) {
            self.sent = HostTime::now();
            self.port.write(ping.as_bytes())?;
        }
        Ok(())
    }

    /// Takes what has arrived, waiting for it a while at most, and does what is due.
    pub(super) fn attend(&mut self, wait: Duration) -> Result<(), Trouble> {
        let mut buffer = [0; 512];
        let count = self.port.read(&mut buffer, wait.min(READ_WAIT))?;
        let arrived = HostTime::now();
        if !self.made_sense {
            let room = QUOTED - self.said.len();
            self.said.extend_from_slice(&buffer[..count.min(room)]);
        }
        for byte in &buffer[..count] {
            if let Some(heard) = self.host.hear(*byte) {
                self.take(heard, arrived)?;
            }
        }
        self.repeat_stop()?;
        match self.host.due(micros(HostTime::now())) {
            Due::Nothing => Ok(()),
            Due::Resend(frame) => {
                self.losses.resent += 1;
                Ok(self.port.write(frame.as_bytes())?)
            }
            Due::GaveUp(_) => Err(Trouble::Silent(HostTime::now().since(self.sent))),
        }
    }

    /// Whether a streamed state has been heard that nobody has fetched.
    pub(super) fn has_streamed(&self) -> bool {
        !self.streamed.is_empty()
    }

    /// The next streamed state that has been heard.
    pub(super) fn next_streamed(&mut self) -> Option<Streamed> {
        self.streamed.pop_front()
    }

    /// Forgets the states that were heard before the controller accepted something: they tell of what was before.
    pub(super) fn forget_streamed(&mut self) {
        self.streamed.clear();
    }

    /// What a person should hear of a trouble.
    pub(super) fn error(&self, trouble: Trouble, task: Task) -> DeviceError {
        let device = self.device.clone();
        match trouble {
            Trouble::Refused(refusal) => words::refused(&device, task, &refusal),
            Trouble::Senseless(response) => DeviceError::Nonsense {
                device,
                said: format!("{response:?}"),
                expected: "an answer to what was asked",
            },
            Trouble::Lost(source) => DeviceError::Lost { device, source },
            Trouble::SessionLost => DeviceError::Reset { device, cause: None },
            Trouble::Silent(_) if !self.made_sense && !self.said.is_empty() => {
                let said = self.said.escape_ascii().to_string();
                DeviceError::Nonsense { device, said, expected: "frames of the rig's own stage firmware" }
            }
            Trouble::Silent(waited) => DeviceError::Silent { device, waited, during: task.during },
        }
    }

    fn exchange(&mut self, frame: Encoded) -> Result<Answer, Trouble> {
        self.answer = None;
        self.sent = HostTime::now();
        self.port.write(frame.as_bytes())?;
        loop {
            self.attend(READ_WAIT)?;
            if let Some(answer) = self.answer.take() {
                return Ok(answer);
            }
        }
    }

    fn take(&mut self, heard: Heard, arrived: HostTime) -> Result<(), Trouble> {
        // A line that echoes gives whole frames too, but none that answers.
        self.made_sense |= !matches!(heard, Heard::Unasked { .. });
        match heard {
            Heard::Answer { response, tick_us, .. } => {
                self.answer = Some(Answer { response, sent: self.sent, tick_us, arrived });
            }
            Heard::Streamed { response, tick_us, lost } => {
                self.losses.streamed_lost += u64::from(lost);
                self.keep(response, tick_us, arrived);
            }
            Heard::Late { .. } => self.losses.streamed_late += 1,
            Heard::Unasked { .. } => self.losses.unasked += 1,
            Heard::SessionLost { .. } => return Err(Trouble::SessionLost),
        }
        Ok(())
    }

    fn keep(&mut self, response: Response, tick_us: u32, arrived: HostTime) {
        let (Response::Telemetry { state, .. }
        | Response::FaultEvent { state, .. }
        | Response::EmergencyStop { state, .. }) = response
        else {
            return;
        };
        if let Response::EmergencyStop { .. } = response {
            self.acknowledged = self.repeated;
        }
        // An emergency stop and its fault tell the same moment twice: who compares positions would see the stage stand.
        if self.newest.replace((tick_us, state)) == Some((tick_us, state)) {
            return;
        }
        if self.streamed.len() == KEPT {
            self.streamed.pop_front();
            self.losses.unfetched += 1;
        }
        self.streamed.push_back(Streamed { state, tick_us, arrived });
    }

    /// Sends the emergency pattern again for stops that the controller has not acknowledged.
    fn repeat_stop(&mut self) -> Result<(), Trouble> {
        let (stops, now) = (self.stops(), HostTime::now());
        if stops == self.acknowledged {
            return Ok(());
        }
        let waited = now.since(self.repeated_at).as_micros() >= u128::from(self.patience.resend_after_us);
        if stops != self.repeated || waited {
            self.repeated = stops;
            self.repeated_at = now;
            self.port.write(&EMERGENCY_STOP)?;
        }
        Ok(())
    }
}

/// The host's time as the wire has it: µs that wrap.
fn micros(time: HostTime) -> u32 {
    (time.nanos() / 1000) as u32
}
