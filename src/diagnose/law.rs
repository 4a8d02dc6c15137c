//! Which law stiffens: Fung's, by which stiffening is looked for, or Yeoh's.
//!
//! To first order in Ī₁ − 3 both are one law, with c₂ = b/2: only what is pressed deep tells them apart.

use super::knob::Knob;
use super::large::StiffeningLaw;
use super::model::Model;
use super::refit::{Effort, Fitted, IN_FULL, descend};
use super::starts::ready;

/// The law of a reading that stiffens.
pub(super) fn law_of(fitted: &Fitted) -> Option<StiffeningLaw> {
    fitted.acting.knobs.iter().find_map(|knob| match knob {
        Knob::Stiffening(law) => Some(*law),
        _ => None,
    })
}

/// A reading that stiffens by Fung's law, by Yeoh's where that explains more; and what to say of the other where that explains as much.
/// Any other reading as it is.
pub(super) fn with_its_law(model: &Model<'_>, fitted: Fitted) -> (Fitted, Option<String>) {
    let fung = Knob::Stiffening(StiffeningLaw::Fung);
    let Some(knob) = fitted.acting.knobs.iter().position(|k| *k == fung) else { return (fitted, None) };
    let index = model.base() + knob;
    let yeoh = Knob::Stiffening(StiffeningLaw::Yeoh);
    let (mut acting, mut at) = (fitted.acting.clone(), fitted.at.clone());
    acting.knobs[knob] = yeoh;
    at[index] *= 0.5;
    if !ready(model, &[(yeoh, at[index])], acting.fine) {
        return (fitted, None);
    }
    let effort = Effort { optimism: FROM_CLOSE, hopeless: fitted.cost + ALIKE, ..IN_FULL };
    let Some(other) = descend(model, &acting, at, effort) else { return (fitted, None) };
    let (better, worse) = if other.cost < fitted.cost { (other, fitted) } else { (fitted, other) };
    let alike = worse.cost - better.cost < ALIKE;
    let remark = alike.then(|| law_of(&worse)).flatten().map(|law| {
        format!(
            "{} law of stiffening, with {:.2}, would explain the recording as well",
            law.whose(),
            worse.at[index]
        )
    });
    (better, remark)
}

/// Laws whose sums of squares differ by less than this are not told apart.
const ALIKE: f64 = 10.0;

/// Both laws are close to one another.
const FROM_CLOSE: f64 = 1.5;
