//! `experiment block`: the published simulation experiment, every method on the same data → tables, CSV,
//! figures.

use super::{Context, Exit, Kind, Outcome, StagedFolder, UsageError};
use crate::inverse::experiment::{Study, StudySettings, Summary, bars, shapes, study, summarise};
use crate::report::{experiment_text, write_experiment};
use anyhow::Context as _;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Repeats the published simulation of a block of 4 m × 2 m × 8 m.
///
/// The block (E = 10 kPa, ν = 0.45) is loaded with 1000 N at a top corner and held at ten unknown nodes, first
/// fixed, then on springs of 500 N/m. The published two-step method in all its variants and the default
/// estimate see the same displacements of 171 nodes.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig experiment block
  phantom-rig experiment block --seeds 200 --snr-db 40 --out results/block
  phantom-rig experiment block --unequal --first-seed 1000
  phantom-rig experiment block --data finer")]
pub(super) struct BlockExperimentArguments {
    /// Noise draws at each level
    #[arg(long, default_value_t = 50, value_name = "N")]
    seeds: u64,
    /// First of the draws: others than the default's 0 to N − 1
    #[arg(long, default_value_t = 0, value_name = "SEED")]
    first_seed: u64,
    /// Also springs that differ from node to node, a fifth to nine fifths of 500 N/m
    #[arg(long)]
    unequal: bool,
    /// Signal-to-noise ratios in decibels; `inf` is no noise
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "20,30,40,50,60,inf",
        value_name = "DB",
        allow_hyphen_values = true
    )]
    snr_db: Vec<f64>,
    /// Mesh that the data come from
    #[arg(long, value_enum, default_value_t = DataMesh::Same)]
    data: DataMesh,
    /// Folder for tables and figures; those of an earlier experiment there are replaced
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Replace whatever is at FOLDER; without it only an earlier experiment
    #[arg(long)]
    force: bool,
}

/// Which mesh the data come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DataMesh {
    /// The model's own: data and fit share the discretisation
    Same,
    /// A finer one of second order
    Finer,
}

pub(super) fn run(arguments: &BlockExperimentArguments, context: &Context) -> anyhow::Result<Outcome> {
    if arguments.seeds == 0 {
        return Err(UsageError("--seeds 0: at least one is needed".to_owned()).into());
    }
    if let Some(level) = arguments.snr_db.iter().find(|s| s.is_nan() || **s <= 0.0) {
        return Err(UsageError(format!("--snr-db {level}: expected more than 0 dB")).into());
    }
    let staged = arguments
        .out
        .as_ref()
        .map(|out| StagedFolder::new(out, Kind::Experiment, arguments.force))
        .transpose()?;
    let settings = StudySettings {
        seeds: arguments.seeds,
        first_seed: arguments.first_seed,
        unequal: arguments.unequal,
        snr_db: arguments.snr_db.clone(),
        finer_data: arguments.data == DataMesh::Finer,
    };
    let of_level = |s: &f64| if s.is_infinite() { 1 } else { arguments.seeds };
    let sets = settings.restraints().len() as u64 * arguments.snr_db.iter().map(of_level).sum::<u64>();
    let bar = context.progress.bar("data sets", sets);
    let study = study(&settings, &|| bar.advance()).context("the experiment could not be run")?;
    drop(bar);
    let summaries = summarise(&study);
    if let Some(staged) = staged {
        let shapes = shapes(&study).context("the deformed body could not be computed")?;
        write_experiment(staged.path(), &study, &summaries, &shapes)?;
        staged.finish()?;
    }
    Ok(outcome(arguments, &study, &summaries))
}

fn outcome(arguments: &BlockExperimentArguments, study: &Study, summaries: &[Summary]) -> Outcome {
    let mut text = experiment_text(study, summaries);
    for (restraint, level, seed, why) in &study.failures {
        text.push_str(&format!("failed: {restraint:?}, {level} dB, seed {seed}: {why}\n"));
    }
    if let Some(out) = &arguments.out {
        text.push_str(&format!("\nTables and figures are in {}\n", out.display()));
    }
    // The unregularised variant is expected not to converge; what gave nothing at all is a degraded result.
    let exit = if study.failures.is_empty() { Exit::Good } else { Exit::Degraded };
    let rows: Vec<_> = summaries
        .iter()
        .map(|s| {
            json!({
                "restraint": format!("{:?}", s.restraint),
                "snr_db": s.snr_db,
                "method": s.method.name(),
                "trials": s.trials,
                "converged": s.converged,
                "young_modulus_pa": s.young_modulus_pa.quartiles,
                "psi_half_m": s.psi_half_m.quartiles,
                "phi_half_m": s.phi_half_m.quartiles,
                "gamma_n_per_m": s.gamma_n_per_m.quartiles,
                "upsilon_n_per_m": s.upsilon_n_per_m.quartiles,
                "median_error": { "young_modulus_pa": s.median_error[0], "gamma_n_per_m": s.median_error[1] },
                "rms_error": { "young_modulus_pa": s.rms_error[0], "upsilon_n_per_m": s.rms_error[1] },
                "bound": { "young_modulus_pa": s.bound[0], "total_n_per_m": s.bound[1] },
            })
        })
        .collect();
    let bars: Vec<_> = bars(study, summaries)
        .iter()
        .map(|b| {
            let pair = |[e, k]: [Option<f64>; 2], k_name: &str| json!({ "young_modulus": e, k_name: k });
            json!({
                "restraint": format!("{:?}", b.restraint),
                "snr_db": b.snr_db,
                "trials": b.trials,
                "rms_over_bound": pair(b.rms_over_bound, "total"),
                "published_rms_over_bound": pair(b.published_over_bound, "total"),
                "median_over_published": pair(b.median_over_published, "gamma"),
                "median_over_bound": pair(b.median_over_bound, "gamma"),
                "efficient": b.efficient,
                "better_than_published": b.better,
            })
        })
        .collect();
    let json = json!({
        "format": "phantom-experiment/1",
        "same_mesh": arguments.data == DataMesh::Same,
        "seeds": arguments.seeds,
        "failures": study.failures.len(),
        "rows": rows,
        "bars": bars,
    });
    Outcome { exit, text, json }
}
