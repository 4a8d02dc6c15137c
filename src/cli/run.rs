//! Arguments → one subcommand → its outcome printed, or its error → exit code.

use super::arguments::{Cli, Command, Experiment, Shape};
use super::{
    Context, Exit, Outcome, Progress, UsageError, bench, block_mesh, calibrate, check, completions, conceal,
    demo, diagnose, doctor, dots, draw, experiment, fit, interrupt, plan, poke, predict, prove, replay,
    run_protocol, session, track,
};
use anyhow::Context as _;
use clap::Parser;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

/// Runs what was typed. The program's whole main function.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(message) => {
            let code = if message.use_stderr() { Exit::Usage } else { Exit::Good };
            // Nobody is left to be told when standard error is closed.
            let _ = message.print();
            return ExitCode::from(code.code());
        }
    };
    let exit = match dispatch(&cli).and_then(|outcome| print(&cli, &outcome)) {
        Ok(exit) => exit,
        Err(error) => {
            let exit = if error.is::<UsageError>() { Exit::Usage } else { Exit::Failed };
            print_error(&cli, &error, exit);
            exit
        }
    };
    ExitCode::from(exit.code())
}

fn dispatch(cli: &Cli) -> anyhow::Result<Outcome> {
    interrupt::listen().context("can't listen for Ctrl-C")?;
    let progress = Progress::new(cli.quiet || cli.json);
    let context = Context { progress, shows: !(cli.quiet || cli.json) };
    match &cli.command {
        Command::Fit(arguments) => fit::run(arguments, &context),
        Command::Diagnose(arguments) => diagnose::run(arguments, &context),
        Command::Predict(arguments) => predict::run(arguments, &context),
        Command::Check(arguments) => check::run(arguments, &context),
        Command::Mesh(arguments) => match &arguments.shape {
            Shape::Block(arguments) => block_mesh::run(arguments, &context),
        },
        Command::Experiment(arguments) => match &arguments.experiment {
            Experiment::Block(arguments) => experiment::run(arguments, &context),
        },
        Command::Draw(arguments) => draw::run(arguments, &context),
        Command::Conceal(arguments) => conceal::run(arguments, &context),
        Command::Prove(arguments) => prove::run(arguments, &context),
        Command::Demo(arguments) => demo::run(arguments, &context),
        Command::Plan(arguments) => plan::run(arguments, &context),
        Command::Run(arguments) => run_protocol::run(arguments, &context),
        Command::Bench(arguments) => bench::run(arguments, &context),
        Command::Poke(arguments) => poke::run(arguments, &context),
        Command::Session(arguments) => session::run(&arguments.action, &context),
        Command::Replay(arguments) => replay::run(arguments),
        Command::Track(arguments) => track::run(arguments, &context),
        Command::Dots(arguments) => dots::run(arguments, &context),
        Command::Calibrate(arguments) => calibrate::run(&arguments.what, &context),
        Command::Doctor(arguments) => doctor::run(arguments, &context),
        Command::Completions(arguments) => Ok(completions::run(arguments)),
    }
}

/// Prints what a command has to say. A script of completions is no talk about a result, but the result.
fn print(cli: &Cli, outcome: &Outcome) -> anyhow::Result<Exit> {
    let text = if cli.json {
        serde_json::to_string_pretty(&outcome.json)?
    } else if cli.quiet && !matches!(cli.command, Command::Completions(_)) {
        // What failed is told all the same. Nobody is left to be told when standard error is closed.
        if outcome.exit == Exit::Failed {
            let _ = writeln!(io::stderr().lock(), "{}", outcome.text);
        }
        return Ok(outcome.exit);
    } else {
        outcome.text.clone()
    };
    match writeln!(io::stdout().lock(), "{text}") {
        // Whoever reads, `head` say, has seen enough.
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(outcome.exit),
        other => other.map(|()| outcome.exit).context("can't write to standard output"),
    }
}

/// The chain of causes on one line of standard error; with `--json` also as JSON on standard output.
fn print_error(cli: &Cli, error: &anyhow::Error, exit: Exit) {
    // Nobody is left to be told when these are closed.
    let _ = writeln!(io::stderr().lock(), "error: {error:#}");
    if cli.json {
        let json = serde_json::json!({
            "format": "phantom-error/1",
            "error": format!("{error:#}"),
            "exit": exit.code(),
        });
        let _ = writeln!(io::stdout().lock(), "{json:#}");
    }
}
