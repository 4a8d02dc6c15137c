//! What does a host have to remember to talk to the stage? Session, sequence, the one request that waits for
//! its answer, and the counter of what is streamed. No port, no clock, no thread: the driver brings those.
//!
//! One request waits at a time. Why: the device's line is the bottleneck anyway, and whether a motion was
//! accepted must be known before the next is asked. STOP and the emergency pattern wait for nobody.

use crate::frame::{Decoder, Dropped, Encoded, Stamp};
use crate::message::{Identity, Reason, Request, Response, SCHEMA_HASH};

/// From here on a gap in the counter of streamed frames is a step back.
const BACKWARDS: u32 = 1 << 31;

/// When a request is sent again, and how often before it is given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Silence before a request is sent again, µs.
    pub resend_after_us: u32,
    /// Times a request is sent, the first included.
    pub tries: u8,
}

impl Default for Patience {
    /// Four tries 20 ms apart: longest request and answer take 17 ms at 115 200 baud, and all four tries fit
    /// into the default lease.
    fn default() -> Self {
        Self { resend_after_us: 20_000, tries: 4 }
    }
}

/// A request that was sent and not yet answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Waiting {
    request: Request,
    stamp: Stamp,
    sent_us: u32,
    tries: u8,
}

/// A request still waits for its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StillWaiting {
    /// The request.
    pub request: Request,
    /// How often it was sent.
    pub tries: u8,
}

impl core::fmt::Display for StillWaiting {
    fn fmt(&self, to: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(to, "{:?} was sent {} times and still waits for its answer", self.request, self.tries)
    }
}

impl core::error::Error for StillWaiting {}

/// What is to be done about the request that waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// Nothing yet, or nothing waits.
    Nothing,
    /// Send these bytes again.
    Resend(Encoded),
    /// Every try was in vain; the host waits no longer. Whether the device carried it out is not known.
    GaveUp(Request),
}

/// What a byte completed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// The answer to the request that waited.
    Answer {
        /// The request.
        request: Request,
        /// Its answer.
        response: Response,
        /// Device tick when the answer left, µs.
        tick_us: u32,
    },
    /// A streamed frame.
    Streamed {
        /// The frame.
        response: Response,
        /// Device tick when it left, µs.
        tick_us: u32,
        /// Streamed frames lost since the one before.
        lost: u32,
    },
    /// A streamed frame that came after a later one, such as a second copy. It tells of what was before.
    Late {
        /// Kind byte.
        kind: u8,
    },
    /// A whole frame that nothing waited for: an answer that came twice or too late, or of another session.
    Unasked {
        /// Kind byte.
        kind: u8,
    },
    /// The device answered or streamed in another session than this one, or in none: it has booted, or
    /// another host has taken it. This host is done: a new one, with a session of its own, greets again.
    SessionLost {
        /// The device's session, 0 for none.
        session: u32,
    },
}

/// One end of a conversation with a stage controller.
#[derive(Debug)]
pub struct Host {
    session: u32,
    sequence: u8,
    motion: u32,
    patience: Patience,
    identity: Option<Identity>,
    waiting: Option<Waiting>,
    decoder: Decoder,
    counter: Option<u32>,
    sent_us: Option<u32>,
}

impl Host {
    /// A host that has not yet spoken. The session must differ from every earlier one (draw it at random) and
    /// may not be 0.
    #[must_use]
    pub const fn new(session: u32, patience: Patience) -> Self {
        Self {
            session,
            sequence: 0,
            motion: 0,
            patience,
            identity: None,
            waiting: None,
            decoder: Decoder::new(),
            counter: None,
            sent_us: None,
        }
    }

    /// The greeting. Send it, hear its answer, and repeat until [`is_open`](Self::is_open): the first answer
    /// tells what the second greeting must name.
    pub fn hello(&mut self, now_us: u32) -> Encoded {
        let (replaces, boot_count) =
            self.identity.map_or((0, 0), |identity| (identity.session, identity.boot_count));
        self.waiting = None;
        self.post(Request::Hello { replaces, boot_count, schema_hash: SCHEMA_HASH }, now_us)
    }

    /// The stop request, in place of whatever waits.
    pub fn stop(&mut self, now_us: u32) -> Encoded {
        self.waiting = None;
        self.post(Request::Stop {}, now_us)
    }

    /// A request's bytes.
    ///
    /// # Errors
    /// While another request waits for its answer.
    pub fn send(&mut self, request: Request, now_us: u32) -> Result<Encoded, StillWaiting> {
        match self.waiting {
            Some(Waiting { request, tries, .. }) => Err(StillWaiting { request, tries }),
            None => Ok(self.post(request, now_us)),
        }
    }

    /// A number for the next motion.
    pub fn next_motion(&mut self) -> u32 {
        self.motion = self.motion.saturating_add(1);
        self.motion
    }

    /// What is to be done by now about the request that waits.
    pub fn due(&mut self, now_us: u32) -> Due {
        let Some(waiting) = &mut self.waiting else { return Due::Nothing };
        if now_us.wrapping_sub(waiting.sent_us) < self.patience.resend_after_us {
            return Due::Nothing;
        }
        if waiting.tries >= self.patience.tries {
            let request = waiting.request;
            self.waiting = None;
            return Due::GaveUp(request);
        }
        waiting.tries += 1;
        waiting.sent_us = now_us;
        self.sent_us = Some(now_us);
        // The tick stays that of the first try: the same bytes, so that a second copy changes nothing.
        Due::Resend(waiting.request.encode(waiting.stamp))
    }

    /// Takes a byte from the device.
    pub fn hear(&mut self, byte: u8) -> Option<Heard> {
        let frame = self.decoder.feed(byte)?;
        let (kind, stamp) = (frame.kind, frame.stamp);
        let Ok(response) = Response::decode(&frame) else { return Some(Heard::Unasked { kind }) };
        if let Response::Telemetry { counter, .. }
        | Response::FaultEvent { counter, .. }
        | Response::EmergencyStop { counter, .. } = response
        {
            if self.is_open() && stamp.session != self.session {
                return Some(self.lose(stamp.session));
            }
            let lost = self.counter.map_or(0, |last| counter.wrapping_sub(last).wrapping_sub(1));
            if lost >= BACKWARDS {
                return Some(Heard::Late { kind });
            }
            self.counter = Some(counter);
            return Some(Heard::Streamed { response, tick_us: stamp.tick_us, lost });
        }
        let Some(waiting) = self.waiting.filter(|waiting| answers(waiting, stamp, &response)) else {
            return Some(Heard::Unasked { kind });
        };
        self.waiting = None;
        match response {
            Response::Identity { identity } => {
                // A device that has booted counts anew.
                if self.identity.is_none_or(|known| known.boot_count != identity.boot_count) {
                    self.counter = None;
                }
                self.identity = Some(identity);
            }
            Response::Pong { session, .. } if self.is_open() && session != self.session => {
                return Some(self.lose(session));
            }
            Response::Refused { refusal, .. } if refusal.reason == Reason::NoSession && self.is_open() => {
                return Some(self.lose(refusal.limit as u32));
            }
            // The device is ahead: start above what it has seen.
            Response::Refused { refusal, .. } if refusal.reason == Reason::StaleSequence => {
                self.sequence = refusal.limit as u8;
            }
            _ => {}
        }
        Some(Heard::Answer { request: waiting.request, response, tick_us: stamp.tick_us })
    }

    /// Who the device is, once it has answered a greeting.
    #[must_use]
    pub const fn identity(&self) -> Option<Identity> {
        self.identity
    }

    /// Whether the device has taken this session.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.session != 0 && self.identity.is_some_and(|identity| identity.session == self.session)
    }

    /// Whether motion can be asked: the session is open and both ends were compiled from the same table.
    #[must_use]
    pub fn may_move(&self) -> bool {
        self.is_open() && self.identity.is_some_and(|identity| identity.schema_hash == SCHEMA_HASH)
    }

    /// Whether a request waits for its answer.
    #[must_use]
    pub const fn is_waiting(&self) -> bool {
        self.waiting.is_some()
    }

    /// How long ago anything was sent, µs; `None` before the first request. A motion needs a request within
    /// every lease: a PING will do.
    #[must_use]
    pub fn silent_us(&self, now_us: u32) -> Option<u32> {
        self.sent_us.map(|sent| now_us.wrapping_sub(sent))
    }

    /// Frames that were dropped, by cause.
    #[must_use]
    pub const fn dropped(&self) -> Dropped {
        self.decoder.dropped()
    }

    fn post(&mut self, request: Request, now_us: u32) -> Encoded {
        self.sequence = self.sequence.wrapping_add(1);
        let stamp = Stamp { sequence: self.sequence, session: self.session, tick_us: now_us };
        self.waiting = Some(Waiting { request, stamp, sent_us: now_us, tries: 1 });
        self.sent_us = Some(now_us);
        request.encode(stamp)
    }

    fn lose(&mut self, session: u32) -> Heard {
        // Why not the same session again: late requests of the lost one would be valid in it.
        self.session = 0;
        self.identity = None;
        self.waiting = None;
        Heard::SessionLost { session }
    }
}

fn answers(waiting: &Waiting, stamp: Stamp, response: &Response) -> bool {
    let fits = match (waiting.request, response) {
        (Request::Hello { .. }, Response::Identity { .. })
        | (Request::Query {}, Response::State { .. })
        | (Request::Ping { .. }, Response::Pong { .. })
        | (Request::Describe { .. }, Response::Axis { .. }) => true,
        (asked, Response::Accepted { request, .. } | Response::Refused { request, .. }) => {
            asked.kind() == *request
        }
        _ => false,
    };
    fits && waiting.stamp.sequence == stamp.sequence && waiting.stamp.session == stamp.session
}
