//! `prove`: concealed draws → every verdict on disk, then the answers opened, then how well.

use super::proof::{
    Making, ProofError, ProofFolder, Sums, close_verdicts, draw_name, make_verdicts, open_answer, open_key,
    read_sums, read_verdict, replace,
};
use super::{Context, Exit, Outcome, UsageError};
use crate::report::scorecard::{
    Answer, Draw, Judged, Limit, Scorecard, draw_text, judge, scorecard_page, scorecard_table, scorecard_text,
};
use anyhow::Context as _;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Diagnoses concealed draws, opens their answers, and says how well the diagnoses answer them.
///
/// Each recording is diagnosed in a process of its own that is given a copy of the bundle and nothing else.
/// When every verdict is on disk they are closed: their hashes are written to DIR/verdicts.csv. Only then are the
/// answers opened and held against the hashes that `conceal` published. A verdict that is missing or was changed
/// after closing, an answer or a recording that does not fit its hash: each ends with exit code 1. Goes on where it
/// was stopped.
///
/// For a stricter proof take DIR.key away until the verdicts are closed.
///
/// Several folders are proved one after the other, each with its own scorecard, and then counted together.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig conceal --seed 20261 --count 500 --out proofs/20261
  phantom-rig prove proofs/20261
  phantom-rig prove proofs/20261 --detection-limit 15 --json > 20261.json
  phantom-rig prove proofs/20261 proofs/20262 --out proofs/both")]
pub(super) struct ProveArguments {
    /// The folder that `conceal` made, or several
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// The key of the answers of a single folder; by default DIR.key
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Where the scorecard of several folders together is written; by default it is printed only
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Recordings diagnosed at a time; by default one a core
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// By quick diagnoses (see `diagnose --quick`), which are less sure
    #[arg(long)]
    quick: bool,
    /// Strength from which on an effect counts as above the limit of detection
    #[arg(long, value_name = "STRENGTH", default_value_t = 0.0, allow_negative_numbers = true)]
    detection_limit: f64,
    /// Strength over the norm of the readings from which on it does; elements misplace such a share
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
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
    distinct(arguments)?;
    let card_of = |judged| Scorecard { quick: arguments.quick, ..Scorecard::of(judged, limit) };
    // No answer is opened before the last verdict is closed.
    let mut closed = Vec::with_capacity(arguments.folders.len());
    for place in &arguments.folders {
        let made = Closed::new(place, arguments, jobs, context);
        closed.push(match arguments.folders.len() {
            1 => made?,
            _ => made.with_context(|| place.display().to_string())?,
        });
    }
    let mut proofs = Vec::with_capacity(closed.len());
    for closed in closed {
        let root = closed.folder.root();
        let draws = closed.open(arguments).with_context(|| root.display().to_string())?;
        let card = card_of(draws.iter().map(judge).collect());
        let page = write_card(root, &card)?;
        proofs.push(Proof { folder: closed.folder, draws, card, page });
    }
    if let [proof] = proofs.as_slice() {
        return outcome(&proof.card, proof.told());
    }
    let own = |proof: &Proof| {
        // As given: folders in different places may have one name.
        let place = proof.folder.root().display();
        let named = |judged: &Judged| Judged { name: format!("{place}/{}", judged.name), ..judged.clone() };
        proof.card.judged.iter().map(named).collect::<Vec<_>>()
    };
    let together = card_of(proofs.iter().flat_map(own).collect());
    let mut told = vec![scorecard_text(&together)];
    told.extend(proofs.iter().map(|proof| format!("Page: {}", proof.page.display())));
    if let Some(out) = &arguments.out {
        std::fs::create_dir_all(out).with_context(|| format!("{}: can't be made", out.display()))?;
        told.push(format!("Page of all: {}", write_card(out, &together)?.display()));
    }
    outcome(&together, told.join("\n"))
}

/// Refuses what several folders cannot be asked, and the same folder twice, whose draws would count twice.
fn distinct(arguments: &ProveArguments) -> Result<(), UsageError> {
    let several = arguments.folders.len() > 1;
    if several && arguments.key.is_some() {
        return Err(UsageError(
            "--key is for one folder: with several each has its own beside it".to_owned(),
        ));
    }
    if !several && arguments.out.is_some() {
        return Err(UsageError(
            "--out is for several folders: the scorecard of one is written into it".to_owned(),
        ));
    }
    let mut seen = Vec::new();
    for folder in &arguments.folders {
        let place = folder.canonicalize().unwrap_or_else(|_| folder.clone());
        if seen.contains(&place) {
            return Err(UsageError(format!("{} is given twice", folder.display())));
        }
        seen.push(place);
    }
    Ok(())
}

/// A folder whose answers are open.
struct Proof {
    folder: ProofFolder,
    draws: Vec<Draw>,
    card: Scorecard,
    page: PathBuf,
}

impl Proof {
    /// The scorecard, or, of few draws, each of them, and where the pages are.
    fn told(&self) -> String {
        let few = self.draws.len() <= FEW;
        let mut told = match few {
            true => self.draws.iter().map(draw_text).collect(),
            false => vec![scorecard_text(&self.card)],
        };
        let pages = self.draws.iter().map(|draw| self.folder.page(&draw.name));
        let pages = pages.filter(|place| few && place.is_file()).chain([self.page.clone()]);
        told.extend(pages.map(|place| format!("Page: {}", place.display())));
        told.join("\n")
    }
}

/// A folder whose verdicts are made and closed.
struct Closed {
    folder: ProofFolder,
    draws: Vec<String>,
    hashes: Sums,
}

impl Closed {
    /// Has every draw diagnosed that has no verdict yet.
    fn new(place: &Path, arguments: &ProveArguments, jobs: usize, context: &Context) -> anyhow::Result<Self> {
        let folder = ProofFolder::new(place);
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
            let jobs = jobs.min(draws.len());
            let making = Making { jobs, pages: arguments.pages, quick: arguments.quick };
            make_verdicts(&folder, &draws, making, &bar)?;
        }
        close_verdicts(&folder, &draws)?;
        Ok(Self { folder, draws, hashes })
    }

    /// Opens the answers.
    fn open(&self, arguments: &ProveArguments) -> anyhow::Result<Vec<Draw>> {
        let seal = open_key(&self.folder, arguments.key.as_deref())?;
        let open = |draw: &String| -> anyhow::Result<Draw> {
            let answer: Answer = open_answer(&self.folder, &seal, draw, &self.hashes)?;
            let (said, seconds) = read_verdict(&self.folder, draw, arguments.quick)?;
            Ok(Draw { name: draw.clone(), answer, said, seconds })
        };
        self.draws.iter().map(open).collect()
    }
}

fn title_of(folder: &Path) -> String {
    folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Writes a scorecard as page and JSON; where the page is.
fn write_card(folder: &Path, card: &Scorecard) -> anyhow::Result<PathBuf> {
    let page = folder.join("scorecard.html");
    replace(&page, scorecard_page(card, &title_of(folder))?.as_bytes())?;
    let json = serde_json::to_string_pretty(&scorecard_json(card)?)? + "\n";
    replace(&folder.join("scorecard.json"), json.as_bytes())?;
    replace(&folder.join("scorecard.csv"), &scorecard_table(card)?)?;
    Ok(page)
}

fn outcome(card: &Scorecard, text: String) -> anyhow::Result<Outcome> {
    let exit = if card.failed.of == 0 { Exit::Good } else { Exit::Degraded };
    Ok(Outcome { exit, text, json: scorecard_json(card)? })
}

fn scorecard_json(card: &Scorecard) -> anyhow::Result<Value> {
    let mut json = serde_json::to_value(card)?;
    if let Some(keys) = json.as_object_mut() {
        keys.insert("format".to_owned(), json!("phantom-scorecard/1"));
    }
    Ok(json)
}
