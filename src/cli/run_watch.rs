//! A run shown while it goes on: a screen on a terminal, lines otherwise, or nothing.

use super::Context;
use super::run_picture::LivePicture;
use super::run_view::{Title, clock, draw};
use crate::acquire::{Cause, Doing, Latch, Operator, RunStatus, Watched};
use crate::clock::HostTime;
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::crossterm::{cursor, execute};
use std::io::{IsTerminal, Stderr, Write, stderr};
use std::time::Duration;

/// How a run is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Watch {
    /// A screen with a force trace, and keys.
    Screen,
    /// A line whenever something else is done.
    Lines,
    /// Nothing.
    Silent,
}

/// A picture so often.
const PICTURE: Duration = Duration::from_millis(50);

impl Watch {
    /// A screen where there is a terminal with a keyboard.
    pub(super) fn choose(context: &Context, lines: bool) -> Self {
        if !context.shows {
            Self::Silent
        } else if !lines && stderr().is_terminal() && std::io::stdin().is_terminal() {
            Self::Screen
        } else {
            Self::Lines
        }
    }
}

/// Whom the keys of somebody who watches reach.
pub(super) struct Reach<'a> {
    pub(super) operator: &'a Operator,
    pub(super) latch: &'a Latch,
    pub(super) watched: &'a Watched,
}

/// Shows a run until it is `over`. `agree`: every question was agreed to beforehand.
pub(super) fn watch(
    by: Watch,
    mut title: Title,
    mut picture: LivePicture,
    reach: &Reach<'_>,
    agree: bool,
    over: &dyn Fn() -> bool,
) {
    let Reach { operator, watched, .. } = reach;
    let screen = if by == Watch::Screen { Screen::open().ok() } else { None };
    let mut lines = Lines { last: None };
    let answer = |status: &RunStatus| {
        let asked = agree && status.doing == Doing::Asking;
        if asked {
            operator.agree();
        }
        asked
    };
    match screen {
        Some(mut screen) => {
            while !over() {
                let status = watched.now();
                answer(&status);
                picture.look(watched);
                picture.note().clone_into(&mut title.note);
                screen.show(&title, &status);
                screen.keys(reach);
            }
        }
        None => {
            while !over() {
                let status = watched.now();
                picture.look(watched);
                // What is answered at once waits for nobody.
                if !answer(&status) && by != Watch::Silent {
                    lines.show(&status);
                }
                std::thread::sleep(PICTURE);
            }
        }
    }
}

/// The terminal while a picture is on it. Dropped, also by a panic, it is a terminal again.
struct Screen(Terminal<CrosstermBackend<Stderr>>);

impl Screen {
    fn open() -> std::io::Result<Self> {
        let terminal = Terminal::new(CrosstermBackend::new(stderr()))?;
        enable_raw_mode()?;
        // From here on whatever fails drops it.
        let screen = Self(terminal);
        execute!(stderr(), EnterAlternateScreen, cursor::Hide)?;
        Ok(screen)
    }

    fn show(&mut self, title: &Title, status: &RunStatus) {
        // A terminal that is gone is no reason to give up a run.
        let _ = self.0.draw(|frame| draw(frame, title, status));
    }

    /// Waits for a key for a while, and does what it says.
    fn keys(&self, Reach { operator, latch, watched }: &Reach<'_>) {
        match event::poll(PICTURE) {
            Ok(true) => {}
            Ok(false) => return,
            Err(_) => return std::thread::sleep(PICTURE),
        }
        let Ok(Event::Key(key)) = event::read() else { return };
        if key.kind != KeyEventKind::Press {
            return;
        }
        let control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char(' ' | 'q' | 's') | KeyCode::Esc => latch.trip(Cause::Asked, HostTime::now()),
            KeyCode::Char('c') if control_c => latch.trip(Cause::Asked, HostTime::now()),
            KeyCode::Enter => operator.agree(),
            KeyCode::Char('p') => watched.ask_picture(),
            _ => {}
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = disable_raw_mode();
        let _ = execute!(stderr(), LeaveAlternateScreen, cursor::Show);
    }
}

/// What was printed last.
struct Lines {
    last: Option<(usize, Doing, bool)>,
}

impl Lines {
    fn show(&mut self, status: &RunStatus) {
        let now = (status.poke, status.doing, status.tripped.is_some());
        if self.last == Some(now) {
            return;
        }
        self.last = Some(now);
        let stopped = status.tripped.map(|t| format!("  STOPPED: {}", t.cause)).unwrap_or_default();
        let poke = if status.poke > 0 {
            format!("poke {} of {}: ", status.poke, status.pokes)
        } else {
            String::new()
        };
        let force = status.wrench[..3].iter().map(|f| f * f).sum::<f64>().sqrt();
        // Nobody is left to be told when standard error is closed.
        let _ = writeln!(
            stderr(),
            "{:>6}  {poke}{}  {force:.2} N  {} left{stopped}",
            clock(status.elapsed),
            status.doing.word(),
            clock(status.left)
        );
    }
}
