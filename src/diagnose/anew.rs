//! The restraint looked for anew, with what a reading adds to the baseline taken off the recording.
//!
//! While the default fit looks for restraint, what was left out of it acts too, and patches come to lie where they mend that: far from where
//! anything holds, too many, or too few. No reading then explains the recording, and wrong ones explain as much as the right one. Under a
//! reading that is right, the recording less what it adds is one of the baseline, in which restraint is found as if nothing had been left out
//! (defect correction, Stetter 1978).

use super::error::DiagnoseError;
use super::model::{Acting, Marched, Model};
use super::physics::Physics;
use super::refit::{Effort, Fitted, IN_FULL, descend};
use super::select::{Selection, Tried, reduced};
use super::track::Track;
use super::verdict::alike;
use crate::geometry::Vec3;
use crate::inverse::{Evidence, Found, Group, InverseError, Restraint, Settled};
use crate::observation::Recording;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::HashMap;

/// So many readings are looked at with a restraint of their own, if they explain this share of what the best one does.
const BEST: usize = 3;
const PROMISING: f64 = 0.3;

/// The readings for which restraint is looked for anew: of those with most effects the best with each first effect.
pub(super) fn worth_it(model: &Model<'_>, selection: &Selection) -> Vec<Tried> {
    let gain = |tried: &Tried| selection.base.cost - tried.fitted.cost;
    let most = selection.chosen.map_or(1, |i| selection.tried[i].physics.len());
    let mut tried: Vec<&Tried> = selection.tried.iter().filter(|t| t.physics.len() == most).collect();
    tried.sort_by(|a, b| a.fitted.criterion(model).total_cmp(&b.fitted.criterion(model)));
    let best = tried.iter().map(|t| gain(t)).fold(0.0, f64::max);
    let first = |tried: &Tried| tried.physics[0].family();
    let mut worth: Vec<Tried> = Vec::new();
    for tried in tried.into_iter().filter(|t| gain(t) > PROMISING * best) {
        if worth.len() < BEST && worth.iter().all(|other| first(other) != first(tried)) {
            worth.push(tried.clone());
        }
    }
    worth
}

/// What a reading leaves beyond noise in pokes that its fit has not seen, in standard deviations of a sum of squares of noise; NaN where that is
/// not known.
pub(super) fn unseen_sd(model: &Model<'_>, fitted: &Fitted) -> f64 {
    let squares = fitted.held_out(model).map_or(f64::NAN, |pokes| pokes.iter().sum());
    let values = fitted.values() as f64;
    (squares - values) / (2.0 * values).sqrt()
}

/// Whether a reading takes so large a share of what pokes that a fit has not seen leave, where that is plain. Of two effects one may leave what
/// stands out most in the means, and explain most all the same.
pub(super) fn explains_unseen([before, after]: [f64; 2], asked: f64) -> bool {
    before > PLAIN_UNSEEN_SD && before - after >= asked * before
}

/// Plain is more than this, in standard deviations, as errors of neighbouring rows are alike.
const PLAIN_UNSEEN_SD: f64 = 10.0;

/// What the recording says without what each of these readings adds to the baseline; none of one that has no answer.
pub(super) fn evidence(model: &Model<'_>, readings: &[Tried]) -> Result<Vec<Option<Evidence>>, InverseError> {
    let driven = Some(model.settled.evidence.driven);
    let of = |recording| Evidence::new(&recording, driven);
    readings.par_iter().map(|tried| without(model, &tried.fitted).map(of).transpose()).collect()
}

/// The restraint found in the evidence for each reading; none where the reading has it, or where there is none to find.
pub(super) fn restraint<'e>(
    model: &Model<'_>,
    readings: &[Tried],
    evidence: &'e [Option<Evidence>],
) -> Result<Vec<Option<Found<'e>>>, InverseError> {
    let look =
        |tried: &Tried, evidence: &'e Option<Evidence>| match model.settled.found_in(evidence.as_ref()?) {
            // What a wrong reading leaves need not be a recording of anything.
            Err(InverseError::Undetermined { .. }) => None,
            Ok(found) if has(model, &tried.fitted, &found) => None,
            found => Some(found),
        };
    readings.par_iter().zip(evidence).map(|(tried, e)| look(tried, e).transpose()).collect()
}

/// Whether a model made anew with this restraint would be the one that there is. A reading fits the stiffness of springs itself, but a law
/// that is not linear is worked out with the baseline's.
fn has(model: &Model<'_>, reading: &Fitted, found: &Found<'_>) -> bool {
    let baseline = &model.settled.at.state.patches;
    found.alike(baseline) || (!reading.acting.fine && found.alike(&refitted(model, reading)))
}

/// The patches that act, where the baseline has them, as stiff as the reading has them.
fn refitted(model: &Model<'_>, reading: &Fitted) -> Vec<Restraint> {
    let settled = &model.settled.at;
    let stiffness = model.disc_stiffness(&reading.acting, &reading.at);
    let patches = settled.state.patches.iter().zip(&settled.mounted.groups).enumerate();
    let acting = patches.filter(|(p, _)| !reading.acting.without.contains(p));
    let as_stiff = |(_, (patch, group)): (usize, (&Restraint, &Group))| {
        let whole: f64 = stiffness[group.discs.clone()].iter().map(|k| k.re).sum();
        let softness = if patch.softness > 0.0 { reading.at[0].exp() / whole } else { 0.0 };
        Restraint { softness, ..patch.clone() }
    };
    acting.map(as_stiff).collect()
}

/// A reading with a restraint of its own.
pub(super) struct Anew<'a> {
    /// The model that has it.
    model: Model<'a>,
    fitted: Fitted,
}

impl<'a> Anew<'a> {
    /// A reading of one model in another, with another restraint. `None` where that has no answer.
    pub(super) fn new(
        from: &Model<'_>,
        reading: &Fitted,
        held: &'a Settled<'a>,
    ) -> Result<Option<Self>, DiagnoseError> {
        let mut model = match Model::new(held, Some(from)) {
            Err(DiagnoseError::TooManyPatches { .. }) => return Ok(None),
            model => model?,
        };
        if reading.acting.fine {
            model.refine();
        }
        let values = reading.at.iter().skip(from.base()).copied();
        let knobs: Vec<_> = reading.acting.knobs.iter().copied().zip(values).collect();
        let acting = Acting { without: Vec::new(), ..reading.acting.clone() };
        // To be compared, all readings are weighed alike, whatever each takes for an error of the instruments.
        model.correlation = from.correlation;
        let fitted = descend(&model, &acting, model.start(&knobs), CLOSE_ENOUGH);
        Ok(fitted.map(|fitted| Self { model, fitted }))
    }

    /// The model, which takes for an error of the instruments what this reading does.
    pub(super) fn into_model(mut self) -> Model<'a> {
        self.model.measure_rest(&self.fitted);
        self.model
    }

    /// Whether it explains so much more than a reading with the restraint that there is, or has springs for glue that is slack there.
    pub(super) fn takes_the_place_of(&self, model: &Model<'_>, here: &Fitted) -> bool {
        let lacks = may_lack(slack_glue(model, here), slack_glue(&self.model, &self.fitted));
        self.criterion() < here.criterion(model) + lacks
    }

    /// By which it is compared with other readings.
    pub(super) fn criterion(&self) -> f64 {
        self.fitted.criterion(&self.model)
    }
}

/// Number of glued spots of a reading in which restraint is slack; none where it is not. They may stand for bands: what holds firmly once it is
/// taut looks like glue while it is not known to be slack.
fn slack_glue(model: &Model<'_>, reading: &Fitted) -> Option<usize> {
    let slack = reading.acting.knobs.iter().any(|knob| knob.physics() == Physics::SlackBand);
    let patches = model.settled.at.state.patches.iter().enumerate();
    slack.then(|| patches.filter(|(p, patch)| patch.glued && !reading.acting.without.contains(p)).count())
}

/// By so much a restraint found anew must explain more to be taken, while as much glue is slack in it.
const BETTER: f64 = 10.0;

/// By how much less a restraint found anew may explain than the one that there is, by how many glued spots are slack in them; none: nothing is
/// slack. Glue is never slack: springs in its place are taken for the same if they are not told apart, and glue in theirs only if it is.
fn may_lack(here: Option<usize>, anew: Option<usize>) -> f64 {
    match here.zip(anew).map_or(Ordering::Equal, |(here, anew)| anew.cmp(&here)) {
        Ordering::Less => alike(0.0),
        Ordering::Equal => -BETTER,
        Ordering::Greater => -alike(0.0),
    }
}

/// A refit that is to be compared ends where a step gains less than this.
const CLOSE_ENOUGH: Effort<'static> = Effort { at_rest: 0.3, ..IN_FULL };

/// The recording less what a reading adds to the baseline of the same modulus and restraint, in its pokes. `None` where the reading
/// has no answer.
fn without(model: &Model<'_>, reading: &Fitted) -> Option<Recording> {
    let with = model.march(&reading.acting, &reading.at)?;
    let (acting, at) = reduced(model, reading, |_| false);
    let plain = model.march(&acting, &at)?;
    let mut recording = model.settled.recording.clone();
    let mut moved: HashMap<u64, Vec<Vec3>> = HashMap::new();
    for track in &model.tracks {
        let wrench = &mut recording.wrench;
        let mut row = wrench.time_s.partition_point(|t| *t < track.time_s[0]);
        for (i, time_s) in track.time_s.iter().enumerate() {
            row += wrench.time_s[row..].iter().take_while(|t| *t < time_s).count();
            let less = felt(model, track, &with, i) - felt(model, track, &plain, i);
            wrench.force_n[row] = (Vec3::from(wrench.force_n[row]) - less).into();
        }
        for frame in &track.frames {
            let shown = |marched| model.shown_at(track, frame, marched);
            let (Some(with), Some(plain)) = (shown(&with), shown(&plain)) else { continue };
            let mut by = vec![Vec3::zeros(); model.settled.evidence.rest.len()];
            for (n, marker) in frame.markers().enumerate() {
                by[marker] = with.fixed_rows::<3>(3 * n) - plain.fixed_rows::<3>(3 * n);
            }
            moved.insert(frame.time_s.to_bits(), by);
        }
    }
    let markers = &mut recording.markers;
    for row in &mut markers.rows {
        if let Some(by) = moved.get(&markers.frame_time_s[row.frame as usize].to_bits()) {
            row.position_m = (Vec3::from(row.position_m) - by[row.marker as usize]).into();
        }
    }
    Some(recording)
}

/// What the sensor reads (N).
fn felt(model: &Model<'_>, track: &Track, marched: &Marched<'_>, row: usize) -> Vec3 {
    let felt = model.felt_at(track, marched, row);
    Vec3::from(felt.map(|(of_tip, besides)| of_tip.re + besides.re))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where little is beyond noise, or it is not known what is, no share of it says anything.
    #[test]
    fn a_share_of_what_is_plain_counts() {
        assert!(explains_unseen([100.0, 69.0], 0.3) && !explains_unseen([100.0, 71.0], 0.3));
        assert!(!explains_unseen([9.0, 0.0], 0.3) && !explains_unseen([-500.0, -1000.0], 0.3));
        assert!(!explains_unseen([100.0, f64::NAN], 0.3) && !explains_unseen([f64::NAN, 1.0], 0.3));
    }

    /// What is taken at one look is not taken back at the next, and where nothing is slack only what explains more is taken.
    #[test]
    fn springs_take_the_place_of_slack_glue() {
        assert!(may_lack(Some(1), Some(0)) > 0.0);
        assert!(may_lack(Some(0), Some(1)) <= -may_lack(Some(1), Some(0)));
        for (here, anew) in [(Some(1), Some(1)), (Some(1), None), (None, Some(0)), (None, None)] {
            assert_eq!(may_lack(here, anew), -BETTER, "{here:?} {anew:?}");
        }
    }
}
