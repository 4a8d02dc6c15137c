//! How a subcommand ended, and what it has to say.

use super::Progress;

/// The exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// 0: good.
    Good,
    /// 1: failed; nothing was written.
    Failed,
    /// 2: what was typed makes no sense.
    Usage,
    /// 3: finished, but something is suspicious, lost, not converged or ambiguous.
    Degraded,
}

impl Exit {
    /// The number that the shell sees.
    pub fn code(self) -> u8 {
        match self {
            Self::Good => 0,
            Self::Failed => 1,
            Self::Usage => 2,
            Self::Degraded => 3,
        }
    }
}

/// What a finished subcommand has to say.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Good or degraded.
    pub exit: Exit,
    /// For people; printed without `--json`, unless `--quiet`.
    pub text: String,
    /// For programs; printed with `--json`. Keys are stable.
    pub json: serde_json::Value,
}

/// What every subcommand is told besides its own arguments.
#[derive(Debug)]
pub struct Context {
    /// Where long work reports; silent with `--quiet`, with `--json` and without a terminal.
    pub progress: Progress,
    /// Whether anything but results is told at all: neither `--quiet` nor `--json`.
    pub shows: bool,
}

/// An error that only reading the arguments together could show; exits with [`Exit::Usage`].
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct UsageError(pub String);
