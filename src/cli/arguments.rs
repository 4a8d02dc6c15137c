//! What may be typed.

use super::bench::BenchArguments;
use super::block_mesh::BlockArguments;
use super::calibrate::Calibration;
use super::check::CheckArguments;
use super::completions::CompletionArguments;
use super::conceal::ConcealArguments;
use super::demo::DemoArguments;
use super::diagnose::DiagnoseArguments;
use super::doctor::DoctorArguments;
use super::dots::DotsArguments;
use super::draw::DrawArguments;
use super::experiment::BlockExperimentArguments;
use super::fit::FitArguments;
use super::plan::PlanArguments;
use super::poke::PokeArguments;
use super::predict::PredictArguments;
use super::prove::ProveArguments;
use super::replay::ReplayArguments;
use super::run_protocol::RunArguments;
use super::session::SessionAction;
use super::track::TrackArguments;
use clap::{Parser, Subcommand};

/// Pokes a soft phantom, and finds its Young's modulus and hidden elastic restraint.
#[derive(Debug, Parser)]
#[command(
    name = "phantom-rig",
    version,
    arg_required_else_help = true,
    after_help = "Exit codes: 0 good; 1 failed, nothing written (a run keeps its session); 2 usage; 3 finished, but degraded; 130 interrupted.

Examples:
  phantom-rig fit rigs/demo --out demo-fit
  phantom-rig diagnose rigs/demo --out demo-diagnosis
  phantom-rig check rigs/demo
  phantom-rig mesh block --size-mm 150x100x25 --cells 30x20x5 \\
      --fixed 'z-,x<60mm' --search 'z-,x>60mm' --observed z+ slab.msh"
)]
pub(super) struct Cli {
    /// Print the result as JSON on standard output
    #[arg(long, global = true)]
    pub(super) json: bool,
    /// Print nothing but errors (and JSON, with --json)
    #[arg(long, global = true)]
    pub(super) quiet: bool,
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    Fit(FitArguments),
    Diagnose(DiagnoseArguments),
    Predict(PredictArguments),
    Check(CheckArguments),
    Mesh(MeshArguments),
    Experiment(ExperimentArguments),
    Draw(DrawArguments),
    Conceal(ConcealArguments),
    Prove(ProveArguments),
    Bench(BenchArguments),
    Demo(DemoArguments),
    Plan(PlanArguments),
    Run(RunArguments),
    Poke(PokeArguments),
    Session(SessionArguments),
    Replay(ReplayArguments),
    Track(TrackArguments),
    Dots(DotsArguments),
    Calibrate(CalibrateArguments),
    Doctor(DoctorArguments),
    Completions(CompletionArguments),
}

/// Looks at sessions, rescues them, and turns them into something else.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  phantom-rig session info sessions/monday
  phantom-rig session verify sessions/monday
  phantom-rig session recover sessions/monday --out sessions/monday-recovered
  phantom-rig session export sessions/monday --bundle sessions/monday-bundle
  phantom-rig session export sessions/monday --csv sessions/monday-tables")]
pub(super) struct SessionArguments {
    #[command(subcommand)]
    pub(super) action: SessionAction,
}

/// Finds out what instruments are worth, and where they stand.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate import exports/monday --out calibration/monday
  phantom-rig calibrate tensile calibration/raw/batch-7 --strain 0,0.3 --specimen 'gel, batch 7' --out calibration/gel-7
  phantom-rig calibrate set --name 'bench 2' --force calibration/force/force.toml --until 2027-10-01 --out calibration/bench-2.toml
  phantom-rig calibrate stage --help")]
pub(super) struct CalibrateArguments {
    #[command(subcommand)]
    pub(super) what: Calibration,
}

/// Makes meshes.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  phantom-rig mesh block --size-mm 150x100x25 --cells 30x20x5 \\
      --fixed 'z-,x<60mm' --search 'z-,x>60mm' --observed z+ slab.msh
  phantom-rig mesh block --help")]
pub(super) struct MeshArguments {
    #[command(subcommand)]
    pub(super) shape: Shape,
}

/// Repeats published experiments.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  phantom-rig experiment block
  phantom-rig experiment block --seeds 200 --snr-db 40 --out results/block")]
pub(super) struct ExperimentArguments {
    #[command(subcommand)]
    pub(super) experiment: Experiment,
}

#[derive(Debug, Subcommand)]
pub(super) enum Experiment {
    Block(BlockExperimentArguments),
}

#[derive(Debug, Subcommand)]
pub(super) enum Shape {
    Block(BlockArguments),
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_do_not_contradict_each_other() {
        Cli::command().debug_assert();
    }

    /// Every command and every part of one says how it is typed, but for `calibrate`, whose parts do.
    #[test]
    fn every_command_has_examples() {
        fn without(command: &clap::Command, path: &str, found: &mut Vec<String>) {
            let path = format!("{path} {}", command.get_name());
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            if !help.contains("Examples:") && command.get_name() != "calibrate" {
                found.push(path.trim().to_owned());
            }
            command.get_subcommands().for_each(|part| without(part, &path, found));
        }
        let mut found = Vec::new();
        without(&Cli::command(), "", &mut found);
        assert_eq!(found, [""; 0]);
    }
}
