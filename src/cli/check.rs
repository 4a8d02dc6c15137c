//! `check`: a bundle → what is in it, and whether it is sound.

use super::{Context, Exit, Outcome, check_text};
use crate::dataset::{ChannelNoise, read_bundle, rest_noise, survey};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Reads a recording bundle, refuses it or says what is in it.
///
/// A bundle that the format forbids is refused with file, row and column (exit code 1). A bundle that is
/// allowed but looks like a mistake, in a unit, a sign or a noise level, is described with its suspicions
/// (exit code 3).
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig check rigs/demo
  phantom-rig check --json rigs/demo > demo.json")]
pub(super) struct CheckArguments {
    /// The bundle: a folder with recording.toml, mesh.msh, pokes.csv, force.csv, markers.csv
    #[arg(value_name = "BUNDLE")]
    bundle: PathBuf,
}

pub(super) fn run(arguments: &CheckArguments, context: &Context) -> anyhow::Result<Outcome> {
    let spinner = context.progress.spinner("reading");
    let (recording, suspicions) = read_bundle(&arguments.bundle)?;
    drop(spinner);
    let (survey, noise) = (survey(&recording), rest_noise(&recording));
    let noise_json = |n: ChannelNoise| json!({ "stated": n.stated, "measured": n.measured, "degrees_of_freedom": n.degrees_of_freedom });
    let gravity = recording.phantom.gravity;
    let json = json!({
        "format": "phantom-check/1",
        "recording": recording.name,
        "sound": suspicions.is_empty(),
        "suspicions": suspicions.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "phantom": {
            "poisson_ratio": recording.phantom.poisson_ratio,
            "density_kg_m3": recording.phantom.density_kg_m3,
            "modulus_range_pa": recording.phantom.modulus_range_pa,
            "gravity_m_s2": gravity.map(|g| <[f64; 3]>::from(g.acceleration_m_s2)),
            "gravity_at_rest": gravity.map(|g| g.at_rest),
        },
        "rest_until_s": recording.rest_until_s,
        "rest_noise": noise.channels().map(|(n, c)| (n.to_owned(), noise_json(c))).collect::<serde_json::Map<_, _>>(),
        "contents": survey,
    });
    let text = check_text::describe(&recording, &survey, &noise, &suspicions);
    let exit = if suspicions.is_empty() { Exit::Good } else { Exit::Degraded };
    Ok(Outcome { exit, text, json })
}
