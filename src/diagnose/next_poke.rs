//! The poke that tells the readings still standing apart best, for its time on the bench.
//!
//! The chosen reading is taken to be right, and what it predicts of a poke that was not made is given to its rivals to
//! explain: by a refit of all that they leave open, with what the recording taught them. What a rival cannot explain then is
//! what the poke tells; the poke is the one at which the rival that explains most is told most per second.

use super::diagnosis::{Choice, NextPoke, Settings};
use super::model::{Marched, Model};
use super::physics::Physics;
use super::plans::{Plan, imagined, plans};
use super::refit::Fitted;
use super::sums::PokeSums;
use nalgebra::DMatrix;
use rand::RngExt;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;

/// A reading: what acts besides the baseline, and its fit.
pub(super) type Standing<'a> = (&'a [Physics], &'a Fitted);

/// The best poke to tell `chosen` from its `rivals`, or one at random (`settings` say which, and in which plane). `None` where no poke separates them.
pub(super) fn next_poke(
    model: &Model<'_>,
    chosen: Standing<'_>,
    rivals: &[Standing<'_>],
    settings: &Settings,
) -> Option<NextPoke> {
    let all = plans(model, rivals.iter().map(|r| r.1).chain([chosen.1]), settings.plane);
    let fits: Vec<(&Fitted, f64)> = rivals.iter().map(|(_, fit)| (*fit, fit.promised(model))).collect();
    let per_second = |plan: &Plan| Some(told(model, plan, chosen.1, &fits)? / plan.bench_s());
    let (per_second, plan) = match settings.choice {
        Choice::Telling => {
            let judged: Vec<(f64, Plan)> =
                all.par_iter().filter_map(|plan| Some((per_second(plan)?, *plan))).collect();
            judged.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).filter(|best| best.0 > 0.0)?
        }
        Choice::Random(seed) => {
            let mut rng = ChaCha12Rng::seed_from_u64(seed);
            rng.set_stream(model.tracks.len() as u64);
            let plan = *all.get(rng.random_range(0..all.len().max(1)))?;
            (per_second(&plan).unwrap_or(0.0), plan)
        }
    };
    let names: Vec<String> = rivals.iter().map(|r| named(r.0)).collect();
    let how = match settings.choice {
        Choice::Telling => format!("of {} pokes at the places so far it", all.len()),
        Choice::Random(_) => "chosen at random, it".to_owned(),
    };
    let mut separates: Vec<Physics> = chosen.0.iter().copied().filter(|p| p.catalogued()).collect();
    for physics in rivals.iter().flat_map(|r| r.0) {
        if physics.catalogued() && !separates.contains(physics) {
            separates.push(*physics);
        }
    }
    Some(NextPoke {
        why: format!(
            "{how} tells {} from {}{}: were the first right, the others would miss it by a sum of squares of {:.0} or more, in {:.0} s",
            named(chosen.0),
            names.join(" and "),
            if settings.choice == Choice::Telling { " best for its time" } else { "" },
            per_second * plan.bench_s(),
            plan.bench_s()
        ),
        separates,
        poke: plan.poke,
    })
}

fn named(physics: &[Physics]) -> String {
    match physics {
        [] => "the baseline".to_owned(),
        all => all.iter().map(|p| p.said()).collect::<Vec<_>>().join(" with "),
    }
}

/// What the rival that explains the poke best cannot explain of it, were `right` right; each with what it promises without
/// the poke. `None` where a reading has no answer.
fn told(model: &Model<'_>, plan: &Plan, right: &Fitted, rivals: &[(&Fitted, f64)]) -> Option<f64> {
    let imagined = imagined(model, plan);
    let march = |fit: &Fitted| model.march_along(&imagined.timeline, &fit.acting, &fit.at);
    let truth = march(right)?;
    let told = rivals.iter().map(|(rival, before)| {
        let own = march(rival)?;
        let sums = imagined.missed(model, (&own, rival), (&truth, right))?;
        let cost = sums.cost;
        let mut more = Fitted::clone(rival);
        more.parts.insert(0, sums);
        Some(cost - (more.promised(model) - before).max(0.0))
    });
    told.collect::<Option<Vec<f64>>>()?.into_iter().min_by(f64::total_cmp)
}

impl super::plans::Imagined {
    /// Sums of what a reading misses of the poke where another predicts what is seen.
    fn missed(
        &self,
        model: &Model<'_>,
        (own, rival): (&Marched<'_>, &Fitted),
        (truth, right): (&Marched<'_>, &Fitted),
    ) -> Option<PokeSums> {
        let (track, sites) = (&self.track, model.body.sites);
        let share = |marched: &Marched<'_>, which: usize| marched.fitted + which * sites + track.site;
        let mut sums = model.no_sums(rival.at.len());
        // With nothing seen a residual is less the prediction: their difference is what is missed.
        let less = |mut rows: DMatrix<f64>, truth: &DMatrix<f64>| {
            let (last, theirs) = (rows.ncols() - 1, truth.ncols() - 1);
            let mut residual = rows.column_mut(last);
            residual -= truth.column(theirs);
            rows
        };
        let forces = |marched: &Marched<'_>, fit: &Fitted| {
            model.force_rows(track, marched, fit.at[share(marched, 0)], true)
        };
        let rows = less(forces(own, rival), &forces(truth, right));
        sums.add(&rows, share(own, 0), model.correlation.force / self.rows_each);
        for frame in track.frames.iter().filter(|f| track.counts_at(f.time_s)) {
            let markers = |marched: &Marched<'_>, fit: &Fitted| {
                model.marker_rows(track, frame, marched, fit.at[share(marched, 1)])
            };
            // Before the lag of a camera has passed it shows nothing.
            if let (Some(own_rows), Some(truth_rows)) = (markers(own, rival), markers(truth, right)) {
                let rows = less(own_rows, &truth_rows);
                sums.add_markers(frame.markers(), &rows, share(own, 1), 1.0 / self.frames_each);
            }
        }
        sums.weigh_lasting(model.lasting());
        sums.cost.is_finite().then_some(sums)
    }
}
