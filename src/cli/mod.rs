//! What was typed, and the exit code.
//!
//! `main` calls [`run`], which parses the arguments, runs one subcommand and prints its [`Outcome`]: text, or
//! JSON with `--json`, on standard output; errors, as one chain of causes, and progress on standard error.
//!
//! | exit code | meaning |
//! | --- | --- |
//! | 0 | good |
//! | 1 | failed: nothing was written |
//! | 2 | usage: what was typed makes no sense |
//! | 3 | finished, but degraded: something is suspicious, lost, not converged or ambiguous |
//! | 130 | interrupted (Ctrl-C): nothing was written but what a bench had recorded until then |
//!
//! # A new subcommand
//! One file: its `clap::Args` with help and examples, and `run(&arguments, &Context) -> anyhow::Result<Outcome>`.
//! One line each in `arguments` (what may be typed) and in `run` (what is called). Results are written through
//! [`StagedFolder`], [`StagedSession`] or [`StagedFile`], so that neither an error nor Ctrl-C leaves anything half-written; long
//! work reports to [`Progress`].

mod arguments;
mod bench;
mod bench_command;
mod block_mesh;
mod calibrate;
mod check;
mod check_text;
mod completions;
mod conceal;
mod continued;
mod demo;
mod diagnose;
mod doctor;
mod dots;
mod draw;
mod experiment;
mod fit;
mod interrupt;
mod look;
mod outcome;
mod picture_files;
mod plan;
mod planned;
mod poke;
mod predict;
mod progress;
mod proof;
mod prove;
mod recorded_run;
mod replay;
mod run;
mod run_picture;
mod run_protocol;
mod run_view;
mod run_watch;
mod seen_dots;
mod session;
mod session_export;
mod session_frame;
mod side;
mod staged;
mod today;
mod track;

pub use outcome::{Context, Exit, Outcome, UsageError};
pub use progress::{Bar, Progress};
pub use run::run;
pub use side::{Bound, Region, RegionError, Side};
pub use staged::{Kind, StagedError, StagedFile, StagedFolder, StagedSession};
