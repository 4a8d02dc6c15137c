//! What was recorded, safely; and a recording as devices again.
//!
//! One session is one folder:
//!
//! | file | what it holds |
//! | --- | --- |
//! | `manifest.json` | the start document: rig, protocol, versions, seeds, devices, mounting, tip, phantom |
//! | `session.mcap` | every raw sample, with the host's monotonic time and the device's own counter |
//! | `session-2.mcap`, … | the same, for every time that the session went on after an interruption |
//!
//! The start document is also the first message of every file, the stop document the last. A session without a stop document was
//! interrupted, and says so.
//!
//! # Format `phantom-session/1`
//! MCAP with uncompressed chunks, each with its checksum, closed after 50 ms or 128 KiB. Topics, schemas and encodings: [`Topic`];
//! channel n is the n-th of [`Topic::ALL`]. A message's time is that of its (first) record on the host's monotonic clock; its number
//! counts from 1 in each topic and file. Nothing is corrected in place: counts stay counts, and clock probes are recorded, never applied.
//!
//! # Promises
//! - Handing over never blocks, and for force it never allocates: [`Recorder`]. What does not fit is counted and put down.
//! - A killed process loses what was handed over in the last 0.2 s at most; a power cut, where the disk keeps its word, about 1 s.
//! - A disk that fails is known at once: [`Health`].
//! - A finished session is never modified: files and folder are read-only.
//! - Nothing is read that no checksum vouches for, and nothing is invented: [`recover`].
//!
//! Paths: [`SessionWriter`] → [`Recorder`] on the one side; [`Session`] → [`Replay`] on the other.

mod cdr;
mod container;
mod document;
mod error;
mod export;
mod frame;
mod inspect;
mod message;
mod picture;
mod read;
mod recorder;
mod recover;
mod replay;
mod scribe;
mod space;
mod tally;
#[cfg(test)]
pub(crate) mod tests;
mod topic;
mod wall;
mod writer;

pub use document::{
    CalibrationDocument, CameraDocument, Event, FORMAT, ForceDocument, HashedText, LensDocument,
    MarkersDocument, MountingDocument, Outcome, PhantomDocument, SensorLosses, StageDocument, StartDocument,
    StopDocument, TipDocument,
};
pub use error::SessionError;
pub use frame::{FrameAsked, FrameStamp, OnePicture, Stream};
pub use inspect::{Extent, Finding, Info};
pub use message::{BATCH, ClockProbe, ForceBatch, Gap, GapCause, Message};
pub use picture::{CameraFrame, Frames, Picture, Pixels, RecordedFrame};
pub use read::{Messages, Recorded, Session};
pub use recorder::{CAPACITY, Health, Recorder};
pub use recover::{Loss, Recovery, recover};
pub use replay::{Replay, ReplayForce, ReplayMarkers, ReplayStage, Speed};
pub use space::{Rates, bytes_per_second};
pub use topic::Topic;
pub use wall::{boot, utc_seconds, utc_text};
pub use writer::SessionWriter;
