//! What Ctrl-C and a polite kill do: usually the program ends; while a stage moves, it is stopped first.

use super::staged::remove_staged;
use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What Ctrl-C exits with: 128 + SIGINT.
const INTERRUPTED: i32 = 130;

type Hook = Box<dyn Fn() + Send>;

/// What is to be done instead of ending the program.
static HOOK: Mutex<Option<Hook>> = Mutex::new(None);

/// A folder that is filled piece by piece, and stays.
static KEPT: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Makes Ctrl-C and a polite kill remove what is staged and exit with 130, unless somebody holds [`Interrupts`].
pub(super) fn listen() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(|| {
        if let Some(hook) = HOOK.lock().unwrap_or_else(PoisonError::into_inner).as_ref() {
            return hook();
        }
        let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner).clone();
        end(&kept.map_or_else(String::new, |folder| format!("; {}", so_far(&folder))))
    })
}

/// While it lives, an interruption says that a folder stays, as far as it is filled.
pub(super) struct Kept(());

impl Kept {
    /// This folder.
    pub(super) fn so_far(folder: &Path) -> Self {
        *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = Some(folder.to_owned());
        Self(())
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// What is said of a folder that is not filled to its end.
pub(super) fn so_far(folder: &Path) -> String {
    format!(
        "what there is so far is in {}: look at it or remove it, nothing goes on with it",
        folder.display()
    )
}

/// Ends the program as an interruption does, saying this `besides`.
pub(super) fn end(besides: &str) -> ! {
    remove_staged();
    // On a terminal the line has a bar and the ^C on it. Nobody is left to be told when standard error is closed.
    let mut to = std::io::stderr().lock();
    let line = if to.is_terminal() { "\n" } else { "" };
    let _ = writeln!(to, "{line}interrupted: what was not finished is not kept{besides}");
    std::process::exit(INTERRUPTED);
}

/// While it lives, an interruption calls what it was made with, and the program goes on to the end that this leads to.
pub(super) struct Interrupts(());

impl Interrupts {
    /// Sends interruptions there.
    pub(super) fn to(hook: impl Fn() + Send + 'static) -> Self {
        *HOOK.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(hook));
        Self(())
    }
}

impl Drop for Interrupts {
    fn drop(&mut self) {
        *HOOK.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}
