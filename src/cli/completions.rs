//! `completions`: a shell → the script that completes this program's arguments in it.

use super::arguments::Cli;
use super::{Exit, Outcome};
use clap::{Args, CommandFactory};
use clap_complete::Shell;

/// Prints the completion script of a shell.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig completions bash > ~/.local/share/bash-completion/completions/phantom-rig
  phantom-rig completions fish > ~/.config/fish/completions/phantom-rig.fish")]
pub(super) struct CompletionArguments {
    /// The shell
    shell: Shell,
}

pub(super) fn run(arguments: &CompletionArguments) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "phantom-rig", &mut script);
    let text = String::from_utf8_lossy(&script).trim_end().to_owned();
    let json = serde_json::json!({ "shell": arguments.shell.to_string(), "script": text });
    Outcome { exit: Exit::Good, text, json }
}
