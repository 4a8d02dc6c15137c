//! The bench's command that `diagnose --continue` runs, and what an interruption does to it.

use super::interrupt::end;
use anyhow::{Context as _, bail};
use rustix::process::{Pid, Signal, kill_process_group};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The bench's command while it runs. It has a process group of its own, which an interruption is passed on to: a stage that moves must
/// be stopped by the program that moves it, before this one ends.
#[derive(Debug, Clone, Default)]
pub(super) struct BenchCommand(Arc<Mutex<Running>>);

#[derive(Debug, Default)]
struct Running {
    group: Option<Pid>,
    /// Whether this program is to end.
    asked: bool,
}

impl BenchCommand {
    fn running(&self) -> MutexGuard<'_, Running> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has the bench make the pokes of a table.
    ///
    /// # Errors
    /// What it said where it fails.
    pub(super) fn run(&self, command: &str, pokes: &Path, bundle: &Path) -> anyhow::Result<()> {
        let mut bench = Command::new("sh");
        bench.args(["-c", &format!("{command} \"$@\""), "sh", "--pokes"]).arg(pokes).arg("--out").arg(bundle);
        bench.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).process_group(0);
        let child = {
            let mut running = self.running();
            if running.asked {
                bail!("interrupted");
            }
            let child = bench.spawn().context("can't start the bench's command")?;
            running.group = Some(Pid::from_child(&child));
            child
        };
        let output = child.wait_with_output();
        self.running().group = None;
        let output = output.context("can't wait for the bench's command")?;
        if !output.status.success() {
            let told = String::from_utf8_lossy(&output.stderr);
            bail!("the bench's command ended with {}: {}", output.status, told.trim());
        }
        Ok(())
    }

    /// Passes an interruption on to the command; ends the program where no command runs, and at the second.
    pub(super) fn interrupted(&self, session: &Path) {
        let mut running = self.running();
        let again = std::mem::replace(&mut running.asked, true);
        match running.group {
            // Not SIGINT, which a shell's jobs in the background ignore. One that has ended just now needs none.
            Some(group) if !again => drop(kill_process_group(group, Signal::TERM)),
            // Still locked: nothing is started any more.
            _ => end_with(session),
        }
    }

    /// Ends the program where that was asked for.
    pub(super) fn end_if_asked(&self, session: &Path) {
        if self.running().asked {
            end_with(session);
        }
    }
}

/// Ends the program and says where recordings are.
fn end_with(session: &Path) -> ! {
    let recording = |entry: std::io::Result<std::fs::DirEntry>| entry.is_ok_and(|e| e.path().is_dir());
    let kept = session.read_dir().is_ok_and(|mut entries| entries.any(recording));
    match kept {
        true => end(&format!("; what the bench recorded is in {}", session.display())),
        false => end(""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    #[test]
    fn what_the_bench_says_when_it_fails_is_told() {
        let run = |command: &str| BenchCommand::default().run(command, Path::new("p"), Path::new("b"));
        let error = run("echo jammed >&2; exit 4;").expect_err("it fails");
        assert!(error.to_string().contains("jammed"), "{error}");
        run(r#"sh -c 'test "$0 $1 $2 $3" = "--pokes p --out b"'"#).expect("four words");
    }

    /// The command and what it has started are told to stop, and this program is to end when they have.
    #[test]
    fn an_interruption_is_passed_on() {
        let bench = BenchCommand::default();
        let theirs = bench.clone();
        let interrupts = std::thread::spawn(move || {
            while theirs.running().group.is_none() {
                std::thread::yield_now();
            }
            theirs.interrupted(Path::new("session"));
        });
        let began = Instant::now();
        let error = bench.run("sleep 600; :", Path::new("p"), Path::new("b")).expect_err("it is stopped");
        interrupts.join().expect("sent");
        assert!(error.to_string().contains("signal"), "{error}");
        assert!(bench.running().asked && began.elapsed() < Duration::from_secs(300));
        let error = bench.run(":", Path::new("p"), Path::new("b")).expect_err("nothing is started any more");
        assert_eq!(error.to_string(), "interrupted");
    }
}
