//! One device's recorded messages, handed out when it is time.

use super::clock::{Line, ReplayClock, Seat};
use crate::clock::HostTime;
use crate::device::DeviceError;
use crate::session::message::Message;
use crate::session::{Messages, Session, Topic};
use std::io;
use std::sync::Arc;

/// The messages of one topic.
pub(super) struct Source {
    name: String,
    messages: Messages,
    clock: Arc<ReplayClock>,
    line: Arc<Line>,
    seat: Seat,
    /// What comes next, with its time into the replay (ns).
    next: Option<(u64, Message)>,
    is_over: bool,
}

impl Source {
    pub(super) fn new(
        session: &Session,
        topic: Topic,
        seat: Seat,
        clock: &Arc<ReplayClock>,
        line: &Arc<Line>,
    ) -> Self {
        Self {
            name: format!("replay of {} from {}", topic, session.folder().display()),
            messages: session.messages(&[topic]),
            clock: Arc::clone(clock),
            line: Arc::clone(line),
            seat,
            next: None,
            is_over: false,
        }
    }

    /// Takes part from now on: the others wait for what this one hands out.
    pub(super) fn join(&mut self) -> Result<(), DeviceError> {
        let next = self.peek()?;
        self.clock.announce(self.seat, next);
        Ok(())
    }

    /// Does not take part for now.
    pub(super) fn leave(&self) {
        self.clock.announce(self.seat, None);
    }

    /// The next message if it is time for it, or will be until `until`.
    pub(super) fn take(&mut self, until: HostTime) -> Result<Option<Message>, DeviceError> {
        let Some(due) = self.peek()? else {
            self.clock.idle(until);
            return Ok(None);
        };
        if !self.clock.is_time(self.seat, due, until) {
            return Ok(None);
        }
        let message = self.next.take().map(|(_, message)| message);
        self.join()?;
        Ok(message)
    }

    /// Whether everything has been handed out.
    pub(super) fn is_over(&self) -> bool {
        self.is_over && self.next.is_none()
    }

    fn peek(&mut self) -> Result<Option<u64>, DeviceError> {
        if self.next.is_none() && !self.is_over {
            match self.messages.next() {
                Some(Ok(recorded)) => {
                    let due = self.line.due(recorded.segment, &recorded.message);
                    self.next = Some((due, recorded.message));
                }
                Some(Err(error)) => {
                    self.leave();
                    let (device, source) = (self.name.clone(), io::Error::other(error));
                    return Err(DeviceError::Lost { device, source });
                }
                None => self.is_over = true,
            }
        }
        Ok(self.next.as_ref().map(|(due, _)| *due))
    }
}

impl Drop for Source {
    fn drop(&mut self) {
        self.leave();
    }
}
