//! Which readings stand beside the chosen one: those that do without some of what it would blame, and how little they lack.

use super::in_step::blamed;
use super::physics::Physics;
use super::refit::{End, Fitted};
use super::select::{LEAST_GAIN, Selection, Tried};

/// A reading that does without some of what another would blame.
pub(super) struct Rival {
    /// Its index among all readings tried.
    pub reading: usize,
    /// Its effects that may be blamed.
    pub blamed: Vec<Physics>,
    /// By how much less it lowers the sum of squares.
    pub lacks: f64,
    /// What the other explains beyond what both have in common.
    ///
    /// Why: beside an effect that explains nearly everything, all that may come with it lack little of the whole.
    pub own: f64,
    /// The same share of how much better the other predicts pokes that its fit has not seen; none where it hardly does, or the rival
    /// has not come to rest.
    ///
    /// Why: knobs enough follow every poke that they are fitted to. What stands in for something else then fails at the next. Not the other way
    /// round: what shows in one poke only cannot be predicted by the others, be it true or not.
    pub mispredicts: Option<f64>,
}

impl Rival {
    /// Whether nothing but pokes that its fit has not seen tells it from the other.
    pub(super) fn only_mispredicts(&self, hardly_told: f64) -> bool {
        self.lacks < hardly_told * self.own && self.margin() >= hardly_told
    }

    /// The share of the other's own gain that it lacks, of what both were fitted to or of what they were not.
    pub(super) fn margin(&self) -> f64 {
        let lacks = self.lacks / self.own;
        // What explains more is no worse for that.
        if lacks > 0.0 { lacks.max(self.mispredicts.unwrap_or(0.0)) } else { lacks }
    }
}

/// Rivals of the chosen reading, the closest first; `base` of a reading's values come before its knobs'. `held_out` is the sum of squares of pokes
/// predicted by fits to the others.
///
/// Beside a lag that is not blamed all readings may have the other effects in common. What stands in for those is then told from the reading
/// without the lag.
pub(super) fn rivals(
    selection: &Selection,
    plain: f64,
    chosen: &Tried,
    base: usize,
    held_out: impl Fn(&Fitted) -> Option<f64>,
) -> Vec<Rival> {
    let named = blamed(chosen, base);
    let with_these = |t: &&Tried| t.physics.len() == named.len() && contains(&t.physics, &named);
    let without_lag = (named.len() < chosen.physics.len())
        .then(|| {
            let same = selection.tried.iter().filter(with_these);
            same.min_by(|a, b| a.fitted.cost.total_cmp(&b.fitted.cost))
        })
        .flatten();
    let mut rivals = Vec::new();
    for against in std::iter::once(chosen).chain(without_lag) {
        for index in others(selection, against) {
            let reading = &selection.tried[index];
            let blamed = blamed(reading, base);
            if !blamed.is_empty() && !contains(&blamed, &named) {
                let lacks = reading.fitted.cost - against.fitted.cost;
                let own = without(selection, plain, against, |p| reading.physics.contains(p));
                let mispredicts = mispredicts(selection, against, reading, &held_out);
                rivals.push(Rival { reading: index, blamed, lacks, own, mispredicts });
            }
        }
    }
    rivals.sort_by(|a, b| a.margin().total_cmp(&b.margin()));
    rivals
}

/// As [`Rival::mispredicts`].
fn mispredicts(
    selection: &Selection,
    chosen: &Tried,
    rival: &Tried,
    held_out: impl Fn(&Fitted) -> Option<f64>,
) -> Option<f64> {
    if [chosen, rival].iter().any(|reading| reading.fitted.end != End::AtRest) {
        return None;
    }
    let common = with_only(selection, chosen, |p| rival.physics.contains(p));
    let common = common.min_by(|a, b| a.cost.total_cmp(&b.cost)).unwrap_or(&selection.base);
    let [common, chosen, rival] = [common, &chosen.fitted, &rival.fitted].map(held_out);
    let own = common? - chosen?;
    (own >= LEAST_GAIN).then_some((rival? - chosen?) / own)
}

/// Readings of as many effects as the chosen one that are neither part of it nor contain it, the closest first: their indices.
pub(super) fn others(selection: &Selection, chosen: &Tried) -> Vec<usize> {
    let other = |t: &Tried| t.physics.len() == chosen.physics.len() && !contains(&t.physics, &chosen.physics);
    let mut others: Vec<usize> = (0..selection.tried.len()).filter(|&i| other(&selection.tried[i])).collect();
    let cost = |i: usize| selection.tried[i].fitted.cost;
    others.sort_by(|&a, &b| cost(a).total_cmp(&cost(b)));
    others
}

/// Whether some effects contain others: stiffening contains large strain.
fn contains(these: &[Physics], others: &[Physics]) -> bool {
    others.iter().all(|p| {
        these.contains(p) || *p == Physics::FiniteStrain && these.contains(&Physics::StrainStiffening)
    })
}

/// By how much the sum of squares rises where only some effects of the chosen reading act.
pub(super) fn without(
    selection: &Selection,
    plain: f64,
    chosen: &Tried,
    stays: impl Fn(&Physics) -> bool,
) -> f64 {
    let costs = with_only(selection, chosen, stays).map(|fitted| fitted.cost);
    costs.fold(plain.min(selection.base.cost), f64::min) - chosen.fitted.cost
}

/// Readings of some effects of the chosen one and no others.
fn with_only<'s>(
    selection: &'s Selection,
    chosen: &Tried,
    stays: impl Fn(&Physics) -> bool,
) -> impl Iterator<Item = &'s Fitted> {
    let kept: Vec<Physics> = chosen.physics.iter().copied().filter(|p| stays(p)).collect();
    let same = move |t: &&Tried| t.physics.len() == kept.len() && kept.iter().all(|p| t.physics.contains(p));
    selection.tried.iter().filter(same).map(|t| &t.fitted)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::knob::Knob;
    use super::super::refit::Fitted;
    use super::*;
    use nalgebra::DVector;

    fn tried(physics: &[Physics], cost: f64) -> Tried {
        Tried { physics: physics.to_vec(), fitted: Fitted::that_costs(cost) }
    }

    /// Two effects, a rival of one of them, and what each costs alone; the first in the list is chosen.
    pub(in super::super) fn selection() -> Selection {
        use Physics::{CameraLag, Drying, SlackBand};
        let tried = vec![
            tried(&[Drying, CameraLag], 100.0),
            tried(&[Drying], 300.0),
            tried(&[CameraLag], 900.0),
            tried(&[SlackBand], 310.0),
            tried(&[Drying, SlackBand], 110.0),
        ];
        let base = Fitted::that_costs(1000.0);
        Selection { base, screened: Vec::new(), tried, chosen: Some(0), ended: None }
    }

    /// The same with a lag that is not blamed; one of its values comes before its knobs'.
    pub(in super::super) fn with_a_lag_in_step() -> Selection {
        let mut selection = selection();
        let fitted = &mut selection.tried[0].fitted;
        fitted.acting.knobs = vec![Knob::Drying, Knob::Lag];
        fitted.at = DVector::from_vec(vec![9.0, 1e-4, 9e-4]);
        selection
    }

    /// A rival has as many effects; of the two chosen it lacks one, and only what that one explains is between them.
    #[test]
    fn a_rival_is_measured_by_what_it_lacks() {
        let mut selection = selection();
        let found = rivals(&selection, 1000.0, &selection.tried[0], 0, |_| None);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].blamed, [Physics::Drying, Physics::SlackBand]);
        assert_eq!((found[0].lacks, found[0].own, found[0].margin()), (10.0, 200.0, 0.05));
        // Nothing in common: all that it explains, of the better baseline.
        selection.chosen = Some(1);
        let found = rivals(&selection, 950.0, &selection.tried[1], 0, |_| None);
        let measured: Vec<(f64, f64)> = found.iter().map(|r| (r.lacks, r.own)).collect();
        assert_eq!(measured, [(10.0, 650.0), (600.0, 650.0)]);
    }

    /// What fails at pokes that it has not seen is told from what does not, though it follows what it was fitted to; not before it has come to
    /// rest, and not where the chosen one hardly predicts better itself than what both have in common.
    #[test]
    fn a_rival_must_predict_as_well() {
        let mut selection = selection();
        // Drying and a lag; drying alone; drying and slack.
        let found = |selection: &Selection, predicted: [f64; 3]| {
            let held_out = |fitted: &Fitted| {
                let costs = [100.0, 300.0, 110.0];
                costs.iter().position(|cost| *cost == fitted.cost).map(|i| predicted[i])
            };
            let found = rivals(selection, 1000.0, &selection.tried[0], 0, held_out);
            (found[0].reading, found[0].mispredicts, found[0].margin())
        };
        assert_eq!(found(&selection, [5000.0, 5200.0, 5180.0]), (4, Some(0.9), 0.9));
        let rival =
            |lacks, mispredicts| Rival { reading: 4, blamed: Vec::new(), lacks, own: 200.0, mispredicts };
        assert!(rival(10.0, Some(0.9)).only_mispredicts(0.3));
        assert!(
            !rival(80.0, Some(0.9)).only_mispredicts(0.3) && !rival(10.0, Some(0.2)).only_mispredicts(0.3)
        );
        // What it was fitted to tells them apart as well.
        assert_eq!(found(&selection, [5000.0, 5200.0, 5002.0]), (4, Some(0.01), 0.05));
        assert_eq!(found(&selection, [5000.0, 5050.0, 5049.0]), (4, None, 0.05));
        selection.tried[4].fitted.end = End::GivenUp;
        assert_eq!(found(&selection, [5000.0, 5200.0, 5180.0]), (4, None, 0.05));
    }

    /// Beside a lag that is not blamed, what stands in for the lag is no rival; what stands in for the effect that is blamed is one, though no
    /// reading of two effects does without it.
    #[test]
    fn a_lag_that_is_not_blamed_hides_no_rival() {
        let selection = with_a_lag_in_step();
        let found = rivals(&selection, 1000.0, &selection.tried[0], 1, |_| None);
        let names: Vec<&[Physics]> = found.iter().map(|rival| &*rival.blamed).collect();
        assert_eq!(names, [&[Physics::SlackBand][..], &[Physics::CameraLag]]);
        assert_eq!((found[0].lacks, found[0].own), (10.0, 700.0));
    }

    /// A rival whose lag is not blamed is one for its other effects only; with no other it is none.
    #[test]
    fn a_lag_that_is_not_blamed_is_no_rival() {
        let mut selection = selection();
        for (index, knobs) in [(2, vec![Knob::Lag]), (0, vec![Knob::Drying, Knob::Lag])] {
            let fitted = &mut selection.tried[index].fitted;
            fitted.at = DVector::from_vec(vec![9e-4; 2]);
            fitted.acting.knobs = knobs;
        }
        let of_drying = rivals(&selection, 1000.0, &selection.tried[1], 0, |_| None);
        assert_eq!(of_drying.len(), 1);
        assert_eq!(of_drying[0].blamed, [Physics::SlackBand]);
        let of_two = rivals(&selection, 1000.0, &selection.tried[4], 0, |_| None);
        assert_eq!((of_two.len(), &*of_two[0].blamed), (1, &[Physics::Drying][..]));
    }

    /// Stiffening contains large strain, with a lag that is not blamed beside it or without.
    #[test]
    fn stiffening_is_no_rival_of_large_strain() {
        let mut selection = selection();
        selection.tried = vec![
            tried(&[Physics::FiniteStrain], 100.0),
            tried(&[Physics::StrainStiffening], 90.0),
            tried(&[Physics::Drying], 800.0),
        ];
        assert_eq!(rivals(&selection, 1000.0, &selection.tried[0], 0, |_| None).len(), 1);
    }
}
