//! `diagnose --continue`: a bench makes the poke that tells most, until a reading stands alone.
//!
//! The bench is a command in a process of its own: `COMMAND --pokes CSV --out BUNDLE` makes all pokes of the table after those
//! of the recording and writes the whole session. The diagnosis sees nothing but the bundle.

use super::bench_command::BenchCommand;
use super::interrupt::Interrupts;
use super::{Kind, StagedFolder, UsageError};
use crate::dataset::read_bundle;
use crate::diagnose::{Diagnosis, MOST_SURE, Verdict};
use crate::geometry::Vec3;
use crate::observation::{PlannedPoke, Recording};
use crate::report::write_pokes;
use anyhow::{Context as _, bail};
use clap::Args;
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};

/// How a diagnosis goes on.
#[derive(Debug, Args)]
pub(super) struct ContinueArguments {
    /// Have a bench make the next poke, and go on until a reading stands alone; COMMAND is run with --pokes CSV --out BUNDLE
    #[arg(long = "continue", value_name = "COMMAND", conflicts_with = "print_only")]
    command: Option<String>,
    /// Confidence at which a reading that stands alone is enough
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = 0.95,
        requires = "command",
        allow_negative_numbers = true
    )]
    pub(super) confidence: f64,
    /// Bench time that the pokes may take
    #[arg(
        long,
        value_name = "S",
        default_value_t = 300.0,
        requires = "command",
        allow_negative_numbers = true
    )]
    budget_s: f64,
    /// Choose the pokes at random from this seed: to compare with
    #[arg(long, value_name = "SEED", requires = "command")]
    pub(super) random_pokes: Option<u64>,
}

/// What was known after so many pokes.
#[derive(Debug, Serialize)]
pub(super) struct Step {
    /// Pokes added.
    pokes: usize,
    /// Bench time that they took (s).
    bench_s: f64,
    physics: Vec<&'static str>,
    /// What explains it though not all of it are entries of the catalogue.
    explained_by: Vec<&'static str>,
    ambiguous_with: Vec<&'static str>,
    unexplained: bool,
    confidence: f64,
}

/// Why no further poke is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Stopped {
    StandsAlone,
    BudgetSpent,
    NothingTellsMore,
    NothingLearnt,
    Failed,
}

/// How it went, for programs.
#[derive(Debug, Serialize)]
pub(super) struct Continued {
    steps: Vec<Step>,
    stopped: Stopped,
    /// Why, where something failed; what was found before it stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<String>,
}

impl Continued {
    /// Whether something failed on the way.
    pub(super) fn failed(&self) -> bool {
        self.stopped == Stopped::Failed
    }
}

impl ContinueArguments {
    /// Refuses a folder for the session's recordings that holds something, unless it may be replaced.
    pub(super) fn check_folder(&self, destination: &Path, force: bool) -> Result<(), UsageError> {
        let session = session_folder(destination);
        let taken = || session.read_dir().is_ok_and(|mut entries| entries.next().is_some());
        if self.command.is_some() && !force && taken() {
            let what = format!(
                "{} holds recordings already; choose another place for the results or pass --force",
                session.display()
            );
            return Err(UsageError(what));
        }
        Ok(())
    }

    /// Refuses figures that make no sense.
    pub(super) fn check(&self) -> Result<(), UsageError> {
        if !(self.confidence > 0.0 && self.confidence <= MOST_SURE) {
            let what = format!(
                "--confidence must lie between 0 and {MOST_SURE}, the most that a verdict reaches, got {}",
                self.confidence
            );
            return Err(UsageError(what));
        }
        if !(self.budget_s >= 0.0 && self.budget_s.is_finite()) {
            return Err(UsageError(format!("--budget-s must be 0 or more, got {}", self.budget_s)));
        }
        Ok(())
    }

    /// Goes on from a diagnosis, if that was asked for: `diagnose` diagnoses each longer recording. Recordings are kept in
    /// `DIR-session` beside the results at `destination`.
    pub(super) fn go_on(
        &self,
        destination: &Path,
        recording: &mut Recording,
        diagnosis: &mut Diagnosis,
        tell: &dyn Fn(&str),
        diagnose: impl FnMut(&Recording) -> anyhow::Result<Diagnosis>,
    ) -> anyhow::Result<Option<Continued>> {
        let Some(command) = &self.command else { return Ok(None) };
        let session = session_folder(destination);
        let first = recording.clone();
        let bench = BenchCommand::default();
        let (theirs, place) = (bench.clone(), session.clone());
        let _interrupts = Interrupts::to(move || theirs.interrupted(&place));
        let ask = |planned: &[PlannedPoke]| {
            if let [_] = planned {
                StagedFolder::new(&session, Kind::Scratch, true)?.finish()?;
            }
            tell(&format!("asking the bench for poke {}", first.pokes.len() + planned.len()));
            let table = session.join("pokes.csv");
            write_pokes(&table, planned, &first)?;
            let bundle = session.join(format!("{:02}", planned.len()));
            let ran = bench.run(command, &table, &bundle);
            bench.end_if_asked(&session);
            ran?;
            Ok(read_bundle(&bundle)?.0)
        };
        let continued = self.rounds(recording, diagnosis, ask, diagnose);
        diagnosis.remarks.push(continued.to_string());
        Ok(Some(continued))
    }

    /// Asks for one poke after another; `ask` is given all of them and returns the whole session.
    fn rounds(
        &self,
        recording: &mut Recording,
        diagnosis: &mut Diagnosis,
        mut ask: impl FnMut(&[PlannedPoke]) -> anyhow::Result<Recording>,
        mut diagnose: impl FnMut(&Recording) -> anyhow::Result<Diagnosis>,
    ) -> Continued {
        let mut planned: Vec<PlannedPoke> = Vec::new();
        let mut bench_s = 0.0;
        let mut steps = vec![Step::of(&diagnosis.verdict, 0, 0.0)];
        let mut failure = None;
        let pause_s = recording.pause_s();
        let stopped = loop {
            if self.is_enough(&diagnosis.verdict) {
                break Stopped::StandsAlone;
            }
            let Some(next) = &diagnosis.next_poke else { break Stopped::NothingTellsMore };
            if nothing_learnt(&steps) {
                break Stopped::NothingLearnt;
            }
            if bench_s + pause_s + next.poke.contact_s() > self.budget_s {
                break Stopped::BudgetSpent;
            }
            planned.push(next.poke);
            let made = ask(&planned).and_then(|longer| {
                goes_on(recording, &longer, &next.poke).context("what the bench wrote is no continuation")?;
                let diagnosis = diagnose(&longer)?;
                Ok((longer, diagnosis))
            });
            match made {
                Ok((longer, found)) => {
                    // What a bench waits while this program thinks does not count.
                    bench_s += pause_s + longer.pokes.last().map_or(0.0, |p| p.end_s - p.start_s);
                    (*recording, *diagnosis) = (longer, found);
                    steps.push(Step::of(&diagnosis.verdict, planned.len(), bench_s));
                }
                Err(error) => {
                    failure = Some(format!("{error:#}"));
                    break Stopped::Failed;
                }
            }
        };
        Continued { steps, stopped, failure }
    }

    fn is_enough(&self, verdict: &Verdict) -> bool {
        verdict.ambiguous_with.is_empty() && !verdict.unexplained && verdict.confidence >= self.confidence
    }
}

impl fmt::Display for Continued {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (pokes, bench_s) = self.steps.last().map_or((0, 0.0), |last| (last.pokes, last.bench_s));
        let sure: Vec<String> = self.steps.iter().map(|s| format!("{:.0} %", 100.0 * s.confidence)).collect();
        write!(f, "pokes added: {pokes}, in {bench_s:.0} s of bench time; confidence {}", sure.join(", "))?;
        f.write_str(match self.stopped {
            Stopped::StandsAlone => "",
            Stopped::BudgetSpent => "; the budget is spent",
            Stopped::NothingTellsMore => "; no poke is known that would tell more",
            Stopped::NothingLearnt => "; the last ones told nothing new",
            Stopped::Failed => "; then this failed: ",
        })?;
        f.write_str(self.failure.as_deref().unwrap_or_default())
    }
}

/// After so many pokes that told nothing new the bench rests.
const IN_VAIN: usize = 3;

/// What confidence must rise by to be something new.
const SURER: f64 = 0.02;

/// Whether the last pokes left names and confidence where they were, or lowered it.
fn nothing_learnt(steps: &[Step]) -> bool {
    let Some(since) = steps.len().checked_sub(IN_VAIN + 1) else { return false };
    let before = &steps[since];
    steps[since + 1..]
        .iter()
        .all(|step| step.same_names(before) && step.confidence < before.confidence + SURER)
}

impl Step {
    fn same_names(&self, other: &Self) -> bool {
        self.physics == other.physics
            && self.explained_by == other.explained_by
            && self.ambiguous_with == other.ambiguous_with
            && self.unexplained == other.unexplained
    }

    fn of(verdict: &Verdict, pokes: usize, bench_s: f64) -> Self {
        Self {
            pokes,
            bench_s,
            physics: verdict.physics.iter().map(|p| p.id()).collect(),
            explained_by: verdict.explained_by.iter().map(|p| p.id()).collect(),
            ambiguous_with: verdict.ambiguous_with.iter().map(|p| p.id()).collect(),
            unexplained: verdict.unexplained,
            confidence: verdict.confidence,
        }
    }
}

/// `DIR-session`.
fn session_folder(destination: &Path) -> PathBuf {
    let mut name = destination.components().as_path().as_os_str().to_owned();
    name.push("-session");
    PathBuf::from(name)
}

/// Refuses a recording that is not the one before with this poke more.
fn goes_on(before: &Recording, longer: &Recording, asked: &PlannedPoke) -> anyhow::Result<()> {
    let known = before.pokes.len();
    let Some((last, others)) = longer.pokes.split_last().filter(|(_, others)| others.len() == known) else {
        bail!("it has {} pokes; expected the {known} before and one more", longer.pokes.len());
    };
    if others != before.pokes {
        bail!("its first {known} pokes are not those of the recording before");
    }
    let off = |a: Vec3, b: Vec3, within: f64| (a - b).norm() > within;
    if off(last.site, asked.site, SAME_PLACE_M) || off(last.direction, asked.direction, SAME_DIRECTION) {
        bail!("its last poke is at {:?} m along {:?}, not the one asked for", last.site, last.direction);
    }
    if longer.mesh != before.mesh || longer.phantom != before.phantom || longer.tip != before.tip {
        bail!("its phantom or its tip is not that of the recording before");
    }
    Ok(())
}

/// A poke is the one asked for within this (m, and of a unit vector).
const SAME_PLACE_M: f64 = 1e-4;
const SAME_DIRECTION: f64 = 0.02;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::{Estimate, Mismatch, NextPoke, Physics, Reading};
    use crate::mesh::TetMesh;
    use crate::observation::{Contact, Markers, Noise, Phantom, Poke, Tip, TipShape, Wrench};

    /// Pokes of 4 s each with pauses of 1 s, and nothing else.
    fn recording(pokes: u32) -> Recording {
        let poke = |number: u32| Poke {
            number,
            site: Vec3::zeros(),
            direction: Vec3::z(),
            radius_m: 0.008,
            start_s: 5.0 * f64::from(number),
            end_s: 5.0 * f64::from(number) + 4.0,
        };
        Recording {
            name: String::new(),
            rest_until_s: 1.0,
            phantom: Phantom {
                poisson_ratio: 0.47,
                density_kg_m3: 1e3,
                modulus_range_pa: [5e3, 2e4],
                gravity: None,
            },
            tip: Tip { contact: Contact::Bonded, shape: TipShape::Pad },
            noise: Noise { force_n: [1.0; 3], torque_nm: [1.0; 3], marker_m: [1.0; 3], stage_m: [1.0; 3] },
            max_standoff_m: 0.01,
            mesh: TetMesh::default(),
            pokes: (1..=pokes).map(poke).collect(),
            stage: None,
            wrench: Wrench::default(),
            markers: Markers::default(),
        }
    }

    /// Backlash, so surely, with a next poke of 4 s where one is wanted.
    fn diagnosis(confidence: f64, more: bool) -> Diagnosis {
        let reading = Reading {
            young_modulus_pa: Estimate { value: 1e4, sd: 1.0 },
            restraint_total_n_per_m: Estimate { value: 0.0, sd: 0.0 },
            restraint: Vec::new(),
            chi2_per_dof: 1.0,
            held_out_chi2_per_dof: 1.0,
        };
        let poke = PlannedPoke {
            site: Vec3::zeros(),
            direction: Vec3::z(),
            radius_m: 0.008,
            depth_m: 1e-3,
            rate_m_s: 1e-3,
            hold_s: 2.0,
        };
        let why = String::new();
        Diagnosis {
            recording: String::new(),
            mismatch: Mismatch {
                detected: true,
                p_value: 0.0,
                channels: Vec::new(),
                pokes: Vec::new(),
                phases: Vec::new(),
                region: None,
                properties: Vec::new(),
            },
            verdict: Verdict {
                physics: vec![Physics::StageBacklash],
                unexplained: false,
                explained_by: Vec::new(),
                confidence,
                ambiguous_with: Vec::new(),
                evidence: None,
            },
            parameters: Vec::new(),
            candidates: Vec::new(),
            baseline: reading.clone(),
            extended: reading,
            next_poke: more.then_some(NextPoke { why, separates: Vec::new(), poke }),
            curves: Vec::new(),
            remarks: Vec::new(),
        }
    }

    fn until(confidence: f64, budget_s: f64) -> ContinueArguments {
        ContinueArguments { command: Some("a bench".to_owned()), confidence, budget_s, random_pokes: None }
    }

    /// Each poke makes it surer by a tenth, from six tenths with two pokes on; after five no poke tells more.
    fn went(arguments: &ContinueArguments) -> (usize, Continued) {
        let known = |pokes: usize| diagnosis(0.4 + 0.1 * pokes as f64, pokes < 5);
        let (mut at, mut said) = (recording(2), known(2));
        let ask = |planned: &[PlannedPoke]| Ok(recording(2 + planned.len() as u32));
        let went = arguments.rounds(&mut at, &mut said, ask, |r| Ok(known(r.pokes.len())));
        (at.pokes.len(), went)
    }

    #[test]
    fn pokes_are_added_until_one_reading_stands_the_budget_is_spent_or_nothing_tells_more() {
        let (pokes, sure) = went(&until(0.75, 100.0));
        assert_eq!((pokes, sure.stopped, sure.steps.len()), (4, Stopped::StandsAlone, 3));
        assert_eq!((sure.steps[2].pokes, sure.steps[2].bench_s), (2, 10.0));
        let (pokes, spent) = went(&until(0.75, 9.0));
        assert_eq!((pokes, spent.stopped), (3, Stopped::BudgetSpent));
        let (pokes, stuck) = went(&until(0.97, 100.0));
        assert_eq!((pokes, stuck.stopped), (5, Stopped::NothingTellsMore));
        assert!(stuck.to_string().contains("pokes added: 3, in 15 s"), "{stuck}");
    }

    /// Confidence that neither rises nor falls ends it after three pokes; names that change do not.
    #[test]
    fn pokes_that_tell_nothing_new_end() {
        let vain = |said: &dyn Fn(usize) -> Diagnosis| {
            let ask = |planned: &[PlannedPoke]| Ok(recording(2 + planned.len() as u32));
            let (mut at, mut first) = (recording(2), said(2));
            until(0.9, 60.0).rounds(&mut at, &mut first, ask, |r| Ok(said(r.pokes.len())))
        };
        let same = vain(&|_| diagnosis(0.6, true));
        assert_eq!((same.stopped, same.steps.len()), (Stopped::NothingLearnt, 4));
        assert!(same.to_string().ends_with("60 %; the last ones told nothing new"), "{same}");
        let late = vain(&|pokes| diagnosis(if pokes < 4 { 0.6 } else { 0.7 }, true));
        assert_eq!((late.stopped, late.steps.len()), (Stopped::NothingLearnt, 6));
        let changing = vain(&|pokes| {
            let mut said = diagnosis(0.6, true);
            said.verdict.unexplained = pokes % 2 == 0;
            said
        });
        assert_eq!((changing.stopped, changing.steps.len()), (Stopped::BudgetSpent, 13));
    }

    #[test]
    fn a_recording_that_is_no_continuation_is_refused() {
        let mut other = recording(3);
        other.pokes[0].end_s += 0.5;
        let mut elsewhere = recording(3);
        elsewhere.pokes[2].site.x += 0.01;
        for (wrong, words) in [
            (recording(2), "it has 2 pokes"),
            (other, "its first 2 pokes"),
            (elsewhere, "not the one asked for"),
        ] {
            let ask = |_: &[PlannedPoke]| Ok(wrong.clone());
            let refused = until(0.9, 100.0)
                .rounds(&mut recording(2), &mut diagnosis(0.6, true), ask, |_| Ok(diagnosis(0.6, true)));
            assert!(refused.failed() && refused.steps.len() == 1);
            assert!(refused.to_string().contains(words), "{refused}");
        }
    }

    #[test]
    fn the_session_lies_beside_the_results() {
        for out in ["results/01", "results/01/"] {
            assert_eq!(session_folder(Path::new(out)), Path::new("results/01-session"));
        }
    }
}
