//! What a reading can do without: effects and patches that the others make superfluous, effects that a plainer one stands for.

use super::knob::Knob;
use super::model::Model;
use super::physics::Physics;
use super::refit::{Effort, Fitted, IN_FULL, descend};
use super::select::{FROM_CLOSE, LEAST_GAIN, LEAST_SHARE, Selection, Tried, extended, least, reduced};
use super::starts::ready;
use rayon::prelude::*;

/// A patch whose absence costs less than this was never there. Where it costs so many times that with the changes of the body by their
/// derivatives, they need not be worked out to see it.
const PATCH: f64 = 30.0;
const PLAINLY: f64 = 4.0;

/// Takes effects away that the others make superfluous, and puts plainer ones in the place of those that need not be more. A camera's
/// scale that stood in for what was found after it must go on earning all that is asked of it.
pub(super) fn thin(model: &Model<'_>, selection: &mut Selection) {
    loop {
        let Some(chosen) = selection.chosen.map(|i| selection.tried[i].clone()) else { return };
        let share = LEAST_SHARE * (selection.base.cost - chosen.fitted.cost);
        let needed = |gone: Physics| {
            let stands_in = matches!(gone, Physics::CameraScale | Physics::UnevenScale);
            if stands_in { least(model, &selection.base, gone).max(share) } else { LEAST_GAIN.max(share) }
        };
        // Whether one alone acts at all was asked when it was added.
        let superfluous = if chosen.physics.len() > 1 { &chosen.physics[..] } else { &[] };
        let fewer: Vec<(Tried, f64)> = superfluous
            .par_iter()
            .filter_map(|&gone| {
                let (acting, at) = reduced(model, &chosen.fitted, |knob| knob.physics() != gone);
                let needed = needed(gone);
                let hopeless = chosen.fitted.cost + needed;
                let effort = Effort { optimism: FROM_CLOSE, hopeless, ..IN_FULL };
                let fitted = descend(model, &acting, at, effort)?;
                let physics = chosen.physics.iter().copied().filter(|p| *p != gone).collect();
                Some((Tried { physics, fitted }, needed))
            })
            .chain(plainer(model, &chosen, LEAST_GAIN.max(share)))
            .filter(|(tried, needed)| tried.fitted.cost - chosen.fitted.cost < *needed)
            .collect();
        // What is needed least beside what is asked of it goes first.
        let share_needed = |(tried, needed): &(Tried, f64)| (tried.fitted.cost - chosen.fitted.cost) / needed;
        match fewer.into_iter().min_by(|a, b| share_needed(a).total_cmp(&share_needed(b))) {
            Some((best, _)) => {
                selection.tried.push(best);
                selection.chosen = Some(selection.tried.len() - 1);
            }
            _ => return,
        }
    }
}

/// Readings with less in the place of an effect that contains it, and what that may cost: large strain for stiffening, an even scale for an
/// uneven one.
fn plainer(model: &Model<'_>, chosen: &Tried, least: f64) -> Vec<(Tried, f64)> {
    let scale = vec![(Knob::Scale, 1.0), (Knob::DepthGain, 1.0)];
    let all = [
        (Physics::StrainStiffening, Physics::FiniteStrain, vec![(Knob::FiniteStrain, 1.0)]),
        (Physics::UnevenScale, Physics::CameraScale, scale),
    ];
    let instead = |(gone, plain, knobs): (Physics, Physics, Vec<(Knob, f64)>)| {
        chosen.physics.contains(&gone).then_some(())?;
        let (acting, at) = reduced(model, &chosen.fitted, |knob| knob.physics() != gone);
        let (mut acting, at) = extended(model, (&acting, &at), &knobs);
        acting.fine = chosen.fitted.acting.fine;
        ready(model, &knobs, true);
        let effort = Effort { optimism: FROM_CLOSE, hopeless: chosen.fitted.cost + least, ..IN_FULL };
        let fitted = descend(model, &acting, at, effort)?;
        let physics = chosen.physics.iter().map(|p| if *p == gone { plain } else { *p }).collect();
        Some((Tried { physics, fitted }, least))
    };
    all.into_iter().filter_map(instead).collect()
}

/// The fit without the patches that it no longer needs.
pub(super) fn pruned(model: &Model<'_>, fitted: Fitted) -> Fitted {
    let mut best = fitted;
    for patch in 0..model.patches() {
        let mut acting = best.acting.clone();
        if acting.without.contains(&patch) {
            continue;
        }
        acting.without.push(patch);
        let less_than =
            |times: f64| Effort { optimism: FROM_CLOSE, hopeless: best.cost + times * PATCH, ..IN_FULL };
        let near = Effort { near: Some(&best), ..less_than(PLAINLY) };
        let plainly =
            || descend(model, &acting, best.at.clone(), near).is_some_and(|t| t.cost > near.hopeless);
        if !model.bulk_knobs(&best.acting, &best.at).is_empty() && plainly() {
            continue;
        }
        let effort = less_than(1.0);
        if let Some(tried) = descend(model, &acting, best.at.clone(), effort)
            && tried.cost - best.cost < PATCH
        {
            best = tried;
        }
    }
    best
}
