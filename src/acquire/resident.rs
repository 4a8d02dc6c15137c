//! Does the program's memory stay where it is while a stage moves?

use rustix::mm::{MlockAllFlags, mlockall};
use std::io;

/// Keeps all pages that the program has now in memory, until it ends.
///
/// A system that is short of memory, or that clears away what was not used of late, takes pages of a program's text too. The thread
/// that stops the stage would read its own instructions from a disk, behind whatever else is being written there.
///
/// Only what is there now: a lock on all that is ever asked for would fail requests for memory in the middle of a run.
///
/// # Errors
///
/// The system allows less than the program has (`ulimit -l`). A run is possible then, and as prompt as the system lets it be.
pub fn stay_resident() -> io::Result<()> {
    Ok(mlockall(MlockAllFlags::CURRENT)?)
}
