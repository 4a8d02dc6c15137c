//! Springs in place of small glued spots, where springs explain the recording as well.
//!
//! Seen from where the markers are, a glued spot smaller than the patch through which springs are taken to pull holds like stiff springs
//! on that patch: a rigid disc of radius `r` gives way by `(1 − ν²)/(2 r E)` (Boussinesq 1885), the patch by its own, larger radius less
//! than that, and its springs by the difference. While patches are searched for glue is preferred, because one spot then stands for several
//! patches of springs; what was found is asked once more.

use super::error::InverseError;
use super::limit::{Finer, settle};
use super::problem::{Linearised, Problem};
use super::refit::{Descent, GOOD_ENOUGH, descend_below, unit, where_answered};
use super::restraint::Restraint;
use super::search::{ONE_LESS, apart};
use crate::fem::disc_self_compliance;

/// A settled fit with springs on patches of `radius_m` for those smaller glued spots that they explain as well.
pub(super) fn with_springs(
    problem: &mut Problem<'_>,
    finer: Option<&Finer>,
    found: Linearised,
    radius_m: f64,
) -> Result<Linearised, InverseError> {
    let (mut at, mut p) = (found, 0);
    while let Some(spot) = at.state.patches.get(p) {
        let Some(springs) = springs_for(spot, radius_m, problem.bench.model.poisson_ratio()) else {
            p += 1;
            continue;
        };
        let (correction, weights) = (problem.correction.take(), problem.whitening.clone());
        match sprung(problem, finer, &at, p, springs) {
            Ok(Some(better)) => {
                // Settling takes patches away that are no longer needed: those behind them are elsewhere then.
                p = if better.state.patches.len() < at.state.patches.len() { 0 } else { p + 1 };
                at = better;
            }
            Ok(None) | Err(InverseError::NotSettled { .. }) => {
                (problem.correction, problem.whitening) = (correction, weights);
                p += 1;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(at)
}

/// Springs on a patch of `radius_m` that hold as a glued spot does; none where the patch alone is too soft for that.
fn springs_for(spot: &Restraint, radius_m: f64, nu: f64) -> Option<Restraint> {
    let [_, local] = disc_self_compliance(radius_m, nu);
    let softness = (1.0 - nu * nu) / (2.0 * spot.radius_m) - local;
    (spot.glued && softness > 0.0).then(|| Restraint { radius_m, softness, glued: false, ..spot.clone() })
}

/// The fit with `springs` for one of its patches, settled anew where that explains as much.
fn sprung(
    problem: &mut Problem<'_>,
    finer: Option<&Finer>,
    at: &Linearised,
    patch: usize,
    springs: Restraint,
) -> Result<Option<Linearised>, InverseError> {
    let mut state = at.state.clone();
    state.patches[patch] = springs;
    if let Some(finer) = finer
        && where_answered(problem.correct(finer, &state.patches))?.is_none()
    {
        return Ok(None);
    }
    let as_good = at.chi2() + ONE_LESS * unit(at);
    let Some(Descent { at: mut tried, .. }) =
        where_answered(descend_below(problem, &state, GOOD_ENOUGH, as_good))?
    else {
        return Ok(None);
    };
    if tried.chi2() > as_good || !apart(problem, &tried.state.patches) {
        return Ok(None);
    }
    tried.unsettled = at.unsettled;
    let settled = settle(problem, finer, tried)?;
    let as_settled = settled.unsettled.is_none() || at.unsettled.is_some() || problem.unrested;
    Ok(as_settled.then_some(settled))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    /// A spot of 3 mm under ν = 1/2 gives way by 1/8 mm⁻¹, a patch of 5 mm by 0.081 mm⁻¹: the rest is the springs'. One of 5 mm holds
    /// more than any springs on such a patch.
    #[test]
    fn springs_hold_as_the_spot_does() {
        let spot =
            |radius_m: f64, glued: bool| Restraint { centre: Vec3::zeros(), radius_m, softness: 0.0, glued };
        let springs = springs_for(&spot(0.003, true), 0.005, 0.5).expect("softer than the patch alone");
        let patch = 16.0 * 0.75 / (3.0 * std::f64::consts::PI.powi(2) * 0.005);
        assert!((springs.softness - (125.0 - patch)).abs() < 1e-9 && !springs.glued, "{springs:?}");
        assert_eq!(springs.radius_m, 0.005);
        assert_eq!(springs_for(&spot(0.005, true), 0.005, 0.5), None);
        assert_eq!(springs_for(&spot(0.003, false), 0.005, 0.5), None);
    }
}
