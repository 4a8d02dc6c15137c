//! The diagnosis of a recording, step by step.
//!
//! 1. A hum of the force sensor is taken off. The baseline: the default fit, then all rows in time under the same model.
//! 2. Every entry of the catalogue at first order; the best refitted in full; one by one, as long as they earn it
//!    ([`select`](super::select)). Where they leave something, restraint is looked for anew under the best of them, and entries once more
//!    ([`anew`](super::anew)); where they leave nothing, under what was chosen.
//!    A ball of another modulus is then refitted on elements that resolve it.
//! 3. Is there a mismatch at all, where, and does what was chosen leave only noise?
//! 4. How surely ([`verdict`](super::verdict)).

use super::anew::{Anew, evidence, explains_unseen, restraint, unseen_sd, worth_it};
use super::beyond::Beyond;
use super::bulk::Lab;
use super::curves::curves;
use super::diagnosis::{Candidate, Diagnosis, Mismatch, NextPoke, Progress, Reading, Settings, Verdict};
use super::error::DiagnoseError;
use super::gains::with_its_gains;
use super::hum::{hums, tell, without};
use super::law::with_its_law;
use super::left::Left;
use super::limits::limits;
use super::model::Model;
use super::nearest::{asked_about, nearest};
use super::next_poke::{Standing, next_poke};
use super::parameters::{parameters, springs, stiffness};
use super::place::{parts, region};
use super::refit::{Effort, Fitted, IN_FULL, descend, descend_from};
use super::restrained::restrained;
use super::rivals::others;
use super::select::{Ended, LARGE, MOST, Selection, Tried, extended, finished, least, select};
use super::undecided::undecided;
use super::verdict::{EXPLAINS, Judged, ball_centre, beyond_chance, judge};
use crate::inverse::{self, Mounted, Settled, cut_finer, settled};
use crate::observation::Recording;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeSet;

/// Diagnoses `recording`.
///
/// # Errors
/// [`DiagnoseError::Baseline`] where the recording cannot be fitted, and what this room cannot diagnose.
pub fn diagnose(
    recording: &Recording,
    settings: &Settings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Diagnosis, DiagnoseError> {
    // A model that is wrong may keep the fit from coming to rest.
    let fit = inverse::Settings { unrested: true, ..settings.fit };
    // Both the fit and what follows it report.
    let shared = std::cell::RefCell::new(progress);
    let hums = hums(recording);
    let recording = &*without(recording, &hums);
    let mut said =
        settled(
            recording,
            &fit,
            &mut |p| shared.borrow_mut()(Progress::Fitting(p)),
            |found| match diagnosed(recording, found, settings, &mut |p| shared.borrow_mut()(p)) {
                Err(why) if why.leaves_undecided() => undecided(found, &why, settings),
                other => other,
            },
        )?;
    tell(&mut said, &hums);
    Ok(said)
}

fn diagnosed(
    recording: &Recording,
    found: &Settled<'_>,
    settings: &Settings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Diagnosis, DiagnoseError> {
    let mut model = Model::new(found, None)?;
    if model.tracks.len() < 2 {
        return Err(DiagnoseError::TooFewPokes { pokes: model.tracks.len() });
    }
    progress(Progress::Screening);
    let selection = Selection::new(&model).ok_or(DiagnoseError::Singular)?;
    Run { recording, settings, progress }.explained(
        &mut model,
        selection,
        None,
        Search { look: 0, effects: 0 },
    )
}

/// Most effects after every look for more of them; after each but the last restraint is looked for anew.
const LOOKS: [usize; 3] = [1, MOST, MOST];

/// Where the search for restraint stands.
#[derive(Clone, Copy)]
struct Search {
    /// Index in [`LOOKS`].
    look: usize,
    /// Number of effects of the readings under which it was looked for in vain on this model; 0: of none.
    effects: usize,
}

/// A reading with the model that it is one of.
#[derive(Clone, Copy)]
struct Explained<'p> {
    model: &'p Model<'p>,
    fitted: &'p Fitted,
}

/// A diagnosis under way.
struct Run<'r> {
    recording: &'r Recording,
    settings: &'r Settings,
    progress: &'r mut dyn FnMut(Progress),
}

impl Run<'_> {
    /// Goes on from a selection; `plain` is the baseline of the default fit where another restraint was found since.
    fn explained(
        &mut self,
        model: &mut Model<'_>,
        mut selection: Selection,
        plain: Option<Explained<'_>>,
        Search { look, effects }: Search,
    ) -> Result<Diagnosis, DiagnoseError> {
        let most = LOOKS[look];
        let of_plain = plain.map(|plain| left(plain.model, plain.fitted)).transpose()?;
        let of_plain = of_plain.as_ref().map(Beyond::noise);
        self.select(model, &mut selection, of_plain.as_ref(), most)?;
        // A memory's creep between pokes was taken for errors of the camera, which hid what else acts.
        if selection.chosen.is_some() && model.measure_rest(&selection.best().clone()) {
            selection = Selection::new(model).ok_or(DiagnoseError::Singular)?;
            self.select(model, &mut selection, of_plain.as_ref(), most)?;
        }
        // What explains all was chosen beside a restraint that was found without it.
        let quiet = selection.leaves_nothing(model).ok_or(DiagnoseError::Singular)?;
        let readings = match selection.chosen.filter(|_| quiet) {
            Some(chosen) => vec![selection.tried[chosen].clone()],
            None => worth_it(model, &selection),
        };
        let before = match of_plain {
            Some(before) => before,
            None => Beyond::noise(&left(model, &selection.base)?),
        };
        let acting = readings.first().map_or(0, |tried| tried.physics.len());
        // What is plain, and yet not chosen, may want another restraint than what was found without it.
        let asked_of = |physics| least(model, &selection.base, physics);
        let nearest = nearest(&selection, selection.base.cost, model.base(), asked_of);
        let wants_another = selection.chosen.is_none() && nearest.is_some_and(|n| beyond_chance(&[n.share]));
        // What as many effects as may act do not come close to restraint is not expected to bring close.
        let asked =
            if acting == MOST || selection.ended == Some(Ended::Hopeless) { EXPLAINS } else { WORTH_IT };
        let nothing_left = quiet && selection.chosen.is_none() && !wants_another;
        let done = look + 1 == LOOKS.len() || acting == effects || nothing_left;
        let ends = match readings.first().filter(|_| !done) {
            Some(best) => {
                let plain = plain.unwrap_or(Explained { model, fitted: &selection.base });
                let unseen = [unseen_sd(plain.model, plain.fitted), unseen_sd(model, &best.fitted)];
                let of_means = before.explained(&Beyond::noise(&left(model, &best.fitted)?));
                of_means < asked && !explains_unseen(unseen, asked) && !wants_another
            }
            None => true,
        };
        if ends {
            self.select(model, &mut selection, Some(&before), MOST)?;
            return self.said(model, selection, plain);
        }
        (self.progress)(Progress::Restraint { readings: readings.len() });
        let settled = model.settled;
        let evidence = evidence(model, &readings)?;
        let restraint = restraint(model, &readings, &evidence)?;
        let held: Vec<_> = restraint.iter().map(|anew| Some(settled.with(anew.as_ref()?))).collect();
        let mut best: Option<Anew<'_>> = None;
        for (tried, held) in readings.iter().zip(&held) {
            let Some(held) = held else { continue };
            let Some(anew) = Anew::new(model, &tried.fitted, held)? else { continue };
            let lowest = best.as_ref().map_or(f64::INFINITY, Anew::criterion);
            if anew.takes_the_place_of(model, selection.best()) && anew.criterion() < lowest {
                best = Some(anew);
            }
        }
        match best {
            Some(best) => {
                let mut other = best.into_model();
                let plain = plain.unwrap_or(Explained { model, fitted: &selection.base });
                let anew = Selection::new(&other).ok_or(DiagnoseError::Singular)?;
                self.explained(&mut other, anew, Some(plain), Search { look: look + 1, effects: 0 })
            }
            None => self.explained(model, selection, plain, Search { look: look + 1, effects: acting }),
        }
    }

    /// Adds effects, up to `most`; `before` is what the baseline leaves, where that is known already.
    fn select(
        &mut self,
        model: &Model<'_>,
        selection: &mut Selection,
        before: Option<&Beyond>,
        most: usize,
    ) -> Result<(), DiagnoseError> {
        let mut tell = |acting, entries| (self.progress)(Progress::Refitting { acting, entries });
        select(model, selection, before, most, &mut tell).ok_or(DiagnoseError::Singular)
    }

    /// The verdict on what is chosen, after a last look at its law, its gains and its ball. `before` is what the baseline leaves, `plain` its
    /// sum of squares.
    fn judged(
        &mut self,
        model: &mut Model<'_>,
        selection: &mut Selection,
        before: &Left,
        plain: f64,
    ) -> Result<Judged, DiagnoseError> {
        let (mut of_law, mut of_gains) = (None, None);
        if let Some(tried) = selection.chosen.map(|i| &mut selection.tried[i]) {
            (tried.fitted, of_law) = with_its_law(model, tried.fitted.clone());
            (tried.fitted, of_gains) = with_its_gains(model, tried.fitted.clone());
            let so_far = Beyond::noise(&left(model, &tried.fitted)?);
            if Beyond::noise(before).explained(&so_far) > WORTH_RESOLVING {
                let at_rest = CLOSE_ENOUGH.max(LEFT_ANYWAY * so_far.all());
                tried.fitted = resolved(model, tried.fitted.clone(), at_rest, self.progress)?;
                // What may be named after all is brought to rest.
                let now = Beyond::noise(&left(model, &tried.fitted)?);
                if at_rest > CLOSE_ENOUGH && Beyond::noise(before).explained(&now) >= EXPLAINS {
                    let effort = Effort { at_rest: CLOSE_ENOUGH, ..IN_FULL };
                    tried.fitted = descend_from(model, tried.fitted.clone(), effort);
                }
            }
        }
        let after = left(model, selection.best())?;
        let judge = |model: &Model<'_>, selection: &Selection| {
            judge(model, selection, plain, before, &after, self.settings.false_alarm)
        };
        let mut judged = judge(model, selection);
        // What a doubt rests on must have come to rest.
        while let Some(rival) = judged.given_up {
            // Its own changes of the body are as its sums have them.
            let correction = model.exchange_correction(None);
            let fitted = selection.tried[rival].fitted.clone();
            selection.tried[rival].fitted = finished(model, fitted);
            model.exchange_correction(correction);
            judged = judge(model, selection);
        }
        let chosen = selection.best();
        judged.doubt_stiffening(model, chosen);
        judged.doubt_ball(&ball_centre(model, chosen));
        if !judged.verdict.blamed().is_empty() {
            judged.remarks.extend(of_law.into_iter().chain(of_gains));
        }
        Ok(judged)
    }

    /// The plainest of several effects that are doubted together, if it stands alone: where a weak one has close rivals it takes the name
    /// of the other along. Not so where what is in no catalogue is among them: an entry might then stand in for that.
    fn alone(
        &mut self,
        model: &mut Model<'_>,
        selection: &Selection,
        before: &Left,
        plain: f64,
    ) -> Result<Option<(Selection, Judged)>, DiagnoseError> {
        let several = |t: &Tried| t.physics.len() > 1 && t.physics.iter().all(|p| p.catalogued());
        let whole = selection.chosen.filter(|&i| several(&selection.tried[i]));
        let found = whole.and_then(|whole| Some((whole, selection.part(&selection.tried[whole], 1)?)));
        let Some((whole, plainest)) = found else { return Ok(None) };
        let of_whole = model.exchange_correction(None);
        let mut fewer = Selection { chosen: Some(plainest), ..selection.clone() };
        fewer.tried[plainest].fitted = finished(model, fewer.tried[plainest].fitted.clone());
        match self.judged(model, &mut fewer, before, plain) {
            Ok(mut judged) if !judged.doubted() => {
                judged.part_of(&fewer, whole, model.base());
                Ok(Some((fewer, judged)))
            }
            Err(why) if !why.leaves_undecided() => Err(why),
            _ => {
                model.exchange_correction(of_whole);
                Ok(None)
            }
        }
    }

    /// The diagnosis that a selection amounts to.
    fn said(
        &mut self,
        model: &mut Model<'_>,
        mut selection: Selection,
        plain: Option<Explained<'_>>,
    ) -> Result<Diagnosis, DiagnoseError> {
        let Explained { model: of, fitted } = plain.unwrap_or(Explained { model, fitted: &selection.base });
        let (before, cost) = (left(of, fitted)?, fitted.cost);
        let mut judged = self.judged(model, &mut selection, &before, cost)?;
        if judged.doubted()
            && let Some(alone) = self.alone(model, &selection, &before, cost)?
        {
            (selection, judged) = alone;
        }
        let model = &*model;
        let plain = plain.unwrap_or(Explained { model, fitted: &selection.base });
        let chosen = selection.best();
        judged.remarks.extend(limits(plain.model, plain.fitted));
        // What is not blamed does not extend the baseline either.
        let extended = match judged.verdict.blamed().is_empty() {
            true => plain,
            false => Explained { model, fitted: chosen },
        };
        let (channels, pokes, phases) =
            if judged.detected { parts(model, &before) } else { Default::default() };
        let of_extended = covariance(extended)?;
        let extension = reading(extended, &of_extended)?;
        judged.doubt_modulus(extension.young_modulus_pa, self.recording.phantom.modulus_range_pa);
        Ok(Diagnosis {
            recording: self.recording.name.clone(),
            mismatch: Mismatch {
                detected: judged.detected,
                p_value: judged.p_value,
                channels,
                pokes,
                phases,
                region: judged.detected.then(|| region(model, &before)).flatten(),
                properties: judged.properties.clone(),
            },
            parameters: parameters(model, extended.fitted, &of_extended, &extension, judged.verdict.blamed()),
            candidates: candidates(model, &selection, &judged),
            baseline: reading(plain, &covariance(plain)?)?,
            extended: extension,
            next_poke: next(model, &selection, &judged, self.settings),
            curves: curves((plain.model, plain.fitted), (extended.model, extended.fitted)),
            remarks: judged.remarks.clone(),
            verdict: judged.verdict,
        })
    }
}

/// Share of what is beyond noise, in the means or in pokes unseen, that a reading must explain for restraint to be looked for anew; one with as
/// many effects as may act, or that no other can help to enough, must explain what a verdict asks for.
const WORTH_IT: f64 = 0.3;

/// What explains less no finer elements bring close.
const WORTH_RESOLVING: f64 = 0.5;

/// A reading with a ball of another modulus, refitted with elements that resolve it: what they add to the change is taken
/// up where the refit ends, a few times over; it ends where a step gains less than `at_rest`. Other readings stay as they are.
fn resolved(
    model: &mut Model<'_>,
    mut fitted: Fitted,
    at_rest: f64,
    progress: &mut dyn FnMut(Progress),
) -> Result<Fitted, DiagnoseError> {
    let found = model.settled;
    let knobs = |model: &Model<'_>, fitted: &Fitted| model.bulk_knobs(&fitted.acting, &fitted.at);
    let Some(size_m) = model.lab().and_then(|lab| lab.resolving(&knobs(model, &fitted))) else {
        return Ok(fitted);
    };
    let level = cut_finer(found, size_m)?;
    let mounted = Mounted::new(&level.bench, &level.search, &found.at.state.patches)?;
    let lab = Lab::on(found, &level.bench, &mounted, Vec::new())?;
    progress(Progress::LookingCloser { unknowns: level.bench.model.unknowns() });
    for _ in 0..CLOSER_LOOKS {
        let before = knobs(model, &fitted);
        model.correct(&before, &lab)?;
        let effort = Effort { at_rest, ..IN_FULL };
        fitted = descend(model, &fitted.acting, fitted.at.clone(), effort).ok_or(DiagnoseError::Singular)?;
        let after = knobs(model, &fitted);
        let moved = before.iter().zip(&after).map(|((knob, a), (_, b))| (b - a).abs() / lab.range(*knob).1);
        if moved.fold(0.0, f64::max) < HARDLY {
            break;
        }
    }
    Ok(fitted)
}

/// Rounds of correcting and refitting at most, and the share of a knob's longest step that ends them.
const CLOSER_LOOKS: usize = 2;
const HARDLY: f64 = 0.3;

/// Gain of a step that ends a refit here, far less than the elements leave open; or this share of what the reading leaves beyond noise anyway.
const CLOSE_ENOUGH: f64 = 0.3;
const LEFT_ANYWAY: f64 = 1e-3;

/// The poke that tells the reading chosen, or what comes closest to one, from those that come closest to it, while that is
/// not settled.
fn next(model: &Model<'_>, selection: &Selection, judged: &Judged, settings: &Settings) -> Option<NextPoke> {
    let Verdict { ambiguous_with, unexplained, explained_by, confidence, .. } = &judged.verdict;
    let named = !unexplained || !explained_by.is_empty();
    if ambiguous_with.is_empty() && named && *confidence >= settings.enough {
        return None;
    }
    let promising;
    let best = match asked_about(selection, judged.near) {
        Some(best) => best,
        None => {
            promising = most_promising(model, selection)?;
            &promising
        }
    };
    let mut rivals: Vec<Standing<'_>> = Vec::new();
    for rival in others(selection, best).into_iter().map(|i| &selection.tried[i]) {
        if rivals.len() < RIVALS && rivals.iter().all(|(physics, _)| *physics != rival.physics) {
            rivals.push((&rival.physics, &rival.fitted));
        }
    }
    // Whether what is doubted besides acts, and what is left of the reading without one of its effects.
    if let Some(whole) = judged.whole.map(|i| &selection.tried[i]) {
        rivals.push((&whole.physics, &whole.fitted));
    }
    match selection.part(best, best.physics.len() - 1).map(|i| &selection.tried[i]) {
        Some(part) => rivals.push((&part.physics, &part.fitted)),
        None => rivals.push((&[], &selection.base)),
    }
    next_poke(model, (&best.physics, &best.fitted), &rivals, settings)
}

/// What promised most at first order, refitted, where none promised enough for that: a poke can tell whether it acts. Laws that are not linear
/// are too dear to ask about unless they are refitted anyway.
fn most_promising(model: &Model<'_>, selection: &Selection) -> Option<Tried> {
    let linear = selection.screened.iter().map(|s| &s.start).find(|start| !LARGE.contains(&start.physics))?;
    let (acting, at) = extended(model, selection.base.place(), &linear.knobs);
    let fitted = descend(model, &acting, at, Effort { at_rest: CLOSE_ENOUGH, ..IN_FULL })?;
    Some(Tried { physics: vec![linear.physics], fitted })
}

/// So many of the readings that come closest are to be told from the best.
const RIVALS: usize = 2;

fn left(model: &Model<'_>, fitted: &Fitted) -> Result<Left, DiagnoseError> {
    Left::of(model, fitted).ok_or(DiagnoseError::Singular)
}

fn covariance(Explained { model, fitted }: Explained<'_>) -> Result<DMatrix<f64>, DiagnoseError> {
    fitted.stated_covariance(model).ok_or(DiagnoseError::Singular)
}

/// How well a fit explains the recording; `covariance` is that of its parameters.
fn reading(
    Explained { model, fitted }: Explained<'_>,
    covariance: &DMatrix<f64>,
) -> Result<Reading, DiagnoseError> {
    let parameters = fitted.at.len() - 2 * model.body.sites;
    let held_out = fitted.held_out(model).ok_or(DiagnoseError::Singular)?;
    let modulus = fitted.at[0].exp();
    let mut by_modulus = DVector::zeros(fitted.at.len());
    by_modulus[0] = modulus;
    let elements = model.settled.element_errors()?;
    Ok(Reading {
        young_modulus_pa: stiffness(model, fitted, covariance, modulus, &by_modulus, elements.modulus),
        restraint_total_n_per_m: springs(model, fitted, covariance, elements.springs),
        restraint: restrained(model, fitted, covariance, &elements.patches),
        chi2_per_dof: fitted.chi2() / fitted.values().saturating_sub(parameters).max(1) as f64,
        held_out_chi2_per_dof: held_out.iter().sum::<f64>() / fitted.values().max(1) as f64,
    })
}

/// Everything tried, the best first: what was refitted, then what a look at first order ruled out.
fn candidates(model: &Model<'_>, selection: &Selection, judged: &Judged) -> Vec<Candidate> {
    let base = selection.base.cost;
    let mut refitted: Vec<Candidate> = Vec::new();
    for (i, tried) in selection.tried.iter().enumerate() {
        let gain = base - tried.fitted.cost;
        let held_out = tried.fitted.held_out(model);
        let selected = Some(i) == selection.chosen && !judged.verdict.blamed().is_empty();
        refitted.push(Candidate {
            physics: tried.physics.clone(),
            score: gain,
            held_out_chi2_per_dof: held_out
                .map(|h| h.iter().sum::<f64>() / tried.fitted.values().max(1) as f64),
            selected,
            why: judged.why(selection, i),
        });
    }
    refitted.sort_by(|a, b| b.selected.cmp(&a.selected).then(b.score.total_cmp(&a.score)));
    // The best of those with the same effects.
    let mut known = BTreeSet::new();
    refitted.retain(|c| {
        let mut physics = c.physics.clone();
        physics.sort_unstable();
        known.insert(physics)
    });
    for screened in &selection.screened {
        let physics = vec![screened.start.physics];
        if refitted.iter().all(|c| c.physics != physics) {
            refitted.push(Candidate {
                physics,
                score: screened.gain,
                held_out_chi2_per_dof: None,
                selected: false,
                why: "at first order it explains too little to be refitted".to_owned(),
            });
        }
    }
    refitted
}
