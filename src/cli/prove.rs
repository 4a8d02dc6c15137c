//! `prove`: concealed draws → every verdict on disk, then the answers opened, then how well.

use super::proof::{
    Making, ProofError, ProofFolder, close_verdicts, draw_name, make_verdicts, open_answer, open_key,
    read_sums, read_verdict, replace,
};
use super::{Context, Exit, Outcome, UsageError};
use crate::report::scorecard::{
    Answer, Draw, Limit, Scorecard, draw_text, judge, scorecard_page, scorecard_text,
};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Diagnoses concealed draws, opens their answers, and says how well the diagnoses answer them.
///
/// Each recording is diagnosed in a process of its own that is given a copy of the bundle and nothing else.
/// When every verdict is on disk they are closed: their hashes are written to DIR/verdicts.csv. Only then are the
/// answers opened and held against the hashes that `conceal` published. A verdict that is missing or was changed
/// after closing, an answer or a recording that does not fit its hash: each ends with exit code 1. Goes on where it
/// was stopped.
///
/// For a stricter proof take DIR.key away until the verdicts are closed.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig conceal --seed 20261 --count 500 --out proofs/20261
  phantom-rig prove proofs/20261
  phantom-rig prove proofs/20261 --detection-limit 15 --json > 20261.json")]
pub(super) struct ProveArguments {
    /// The folder that `conceal` made
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The key of the answers; by default DIR.key
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Recordings diagnosed at a time; by default one a core
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// By quick diagnoses (see `diagnose --quick`), which are less sure
    #[arg(long)]
    quick: bool,
    /// Strength from which on an effect counts as above the limit of detection
    #[arg(long, value_name = "STRENGTH", default_value_t = 0.0)]
    detection_limit: f64,
    /// Strength over the norm of the readings from which on it does; elements misplace such a share
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    detection_share: f64,
    /// Keep the page of each diagnosis that is made, in DIR/pages; some 5 MB each
    #[arg(long)]
    pages: bool,
}

/// Of so few draws each is told.
const FEW: usize = 5;

pub(super) fn run(arguments: &ProveArguments, context: &Context) -> anyhow::Result<Outcome> {
    let limit = Limit { strength: arguments.detection_limit, share: arguments.detection_share };
    for (name, least) in [("limit", limit.strength), ("share", limit.share)] {
        if !(least >= 0.0 && least.is_finite()) {
            return Err(UsageError(format!("--detection-{name} must be 0 or more, got {least}")).into());
        }
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.unwrap_or(cores);
    if jobs == 0 {
        return Err(UsageError("--jobs 0: at least one is needed".to_owned()).into());
    }
    let folder = ProofFolder::new(&arguments.folder);
    let manifest = folder.made()?;
    let hashes = read_sums(&folder.hashes())?;
    let draws: Vec<String> = (1..=manifest.count).map(draw_name).collect();
    for draw in &draws {
        let incomplete = |what| ProofError::Incomplete { draw: draw.clone(), what };
        if !folder.recording(draw).is_dir() {
            return Err(incomplete("recording").into());
        }
        if !hashes.contains_key(draw) {
            return Err(incomplete("hash in hashes.csv").into());
        }
    }
    if !folder.closed().is_file() {
        folder.make()?;
        let bar = context.progress.bar("diagnosing", draws.len() as u64);
        let making = Making { jobs: jobs.min(draws.len()), pages: arguments.pages, quick: arguments.quick };
        make_verdicts(&folder, &draws, making, &bar)?;
    }
    close_verdicts(&folder, &draws)?;

    let seal = open_key(&folder, arguments.key.as_deref())?;
    let mut judged = Vec::with_capacity(draws.len());
    let (few, mut told) = (draws.len() <= FEW, Vec::new());
    for draw in &draws {
        let answer: Answer = open_answer(&folder, &seal, draw, &hashes)?;
        let (said, seconds) = read_verdict(&folder, draw, arguments.quick)?;
        let opened = Draw { name: draw.clone(), answer, said, seconds };
        judged.push(judge(&opened));
        if few {
            told.push(draw_text(&opened));
        }
    }
    let card = Scorecard { quick: arguments.quick, ..Scorecard::of(judged, limit) };
    let root = folder.root();
    let title = root.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let json = scorecard_json(&card)?;
    let page = root.join("scorecard.html");
    replace(&page, scorecard_page(&card, &title)?.as_bytes())?;
    replace(&root.join("scorecard.json"), (serde_json::to_string_pretty(&json)? + "\n").as_bytes())?;
    if !few {
        told.push(scorecard_text(&card));
    }
    let pages = draws.iter().map(|draw| folder.page(draw)).filter(|place| few && place.is_file());
    told.extend(pages.chain([page]).map(|place| format!("Page: {}", place.display())));
    let text = told.join("\n");
    let exit = if card.failed.of == 0 { Exit::Good } else { Exit::Degraded };
    Ok(Outcome { exit, text, json })
}

fn scorecard_json(card: &Scorecard) -> anyhow::Result<Value> {
    let mut json = serde_json::to_value(card)?;
    if let Some(keys) = json.as_object_mut() {
        keys.insert("format".to_owned(), json!("phantom-scorecard/1"));
    }
    Ok(json)
}
