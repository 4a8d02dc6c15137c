//! What others do to the stream: whatever comes in between, and why nothing comes.

use super::super::DriverError;
use crate::device::with_causes;
use std::fmt;

/// What came in between while this stream ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NetFtInterference {
    /// Datagrams from elsewhere than the sensor; ignored.
    pub foreign: u64,
    /// Datagrams of a stream that had not been asked for, or no longer; ignored.
    pub stale: u64,
    /// Streams that began anew without having been asked to: the answer to a repeated request came much too late, or the sensor's
    /// clock jumped. A stream that somebody else asks for goes to them, and is silence here.
    pub restarted: u64,
    /// Records that repeat an old reading under a new number.
    pub frozen: u64,
}

/// Why no records come.
#[derive(Debug)]
pub enum NetFtSilence {
    /// The sensor answers on its web page: its stream goes to somebody else, or somebody has ended it. It serves one client at a time,
    /// the one that asked last.
    StreamElsewhere {
        /// Its status word, where it tells.
        status: Option<u32>,
    },
    /// The sensor does not answer at all.
    SensorGone(DriverError),
}

impl fmt::Display for NetFtSilence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StreamElsewhere { .. } => f.write_str(
                "the force sensor's web page answers, its stream does not: another client has asked for it or ended it, \
                 or a firewall holds it back",
            ),
            Self::SensorGone(error) => {
                write!(f, "the force sensor does not answer at all: {}", with_causes(error))
            }
        }
    }
}
