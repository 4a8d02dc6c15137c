//! How far long work has come: bars on standard error, for people who watch a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// Makes bars, or silent stand-ins.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    visible: bool,
}

/// One bar; it disappears when dropped.
#[derive(Debug)]
pub struct Bar(ProgressBar);

impl Progress {
    /// Bars when standard error is a terminal and `quiet` is false.
    pub fn new(quiet: bool) -> Self {
        Self { visible: !quiet && std::io::stderr().is_terminal() }
    }

    /// Nothing to be seen.
    pub fn silent() -> Self {
        Self { visible: false }
    }

    /// A bar of `steps` steps.
    pub fn bar(&self, label: &str, steps: u64) -> Bar {
        let bar = ProgressBar::with_draw_target(Some(steps), self.target());
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
            bar.set_style(style);
        }
        bar.set_message(label.to_owned());
        Bar(bar)
    }

    /// A sign of life for work of unknown length.
    pub fn spinner(&self, label: &str) -> Bar {
        let bar =
            ProgressBar::with_draw_target(None, self.target()).with_style(ProgressStyle::default_spinner());
        bar.set_message(label.to_owned());
        if self.visible {
            bar.enable_steady_tick(std::time::Duration::from_millis(100));
        }
        Bar(bar)
    }

    fn target(&self) -> ProgressDrawTarget {
        if self.visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() }
    }
}

impl Bar {
    /// One step more.
    pub fn advance(&self) {
        self.0.inc(1);
    }

    /// Another label.
    pub fn label(&self, label: &str) {
        self.0.set_message(label.to_owned());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
