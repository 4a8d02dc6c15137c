//! A diagnosis in sentences: what was left out, and by what it shows.

use super::detail::{clause, looseness, noun, parameter_noun};
use super::names::{channel_words, listed, phase_words};
use crate::diagnose::{Diagnosis, Physics, Reading};
use crate::units::{counted, pascals};

/// From this confidence on a verdict is called sure; below it a diagnosis ends as degraded.
const SURE: f64 = 0.9;

/// Whether the verdict stands alone: something or nothing was named, with nothing beside it and with confidence.
pub fn is_sure(diagnosis: &Diagnosis) -> bool {
    let verdict = &diagnosis.verdict;
    !verdict.unexplained && verdict.ambiguous_with.is_empty() && verdict.confidence >= SURE
}

/// What was left out and what that changes, without a full stop: the page's headline.
pub fn conclusion(diagnosis: &Diagnosis) -> String {
    let verdict = &diagnosis.verdict;
    let modulus = pascals(diagnosis.baseline.young_modulus_pa.value);
    if verdict.unexplained && !verdict.ambiguous_with.is_empty() {
        let all: Vec<&str> =
            verdict.explained_by.iter().chain(&verdict.ambiguous_with).map(|p| noun(*p)).collect();
        return format!(
            "The recording differs from the model and cannot tell why: {} may have been left out; the modulus of {modulus} is not to be trusted",
            listed(&all, "or")
        );
    }
    if verdict.unexplained && verdict.explained_by.is_empty() {
        return format!(
            "Something was left out that no entry of the catalogue explains; the modulus of {modulus} is not to be trusted"
        );
    }
    let blamed = verdict.blamed();
    if blamed.is_empty() {
        return if diagnosis.mismatch.detected {
            format!(
                "The recording differs from the model, and nothing is blamed; the modulus of {modulus} is not to be trusted"
            )
        } else {
            format!("Nothing was left out that this recording shows: the modulus is {modulus}")
        };
    }
    let names: Vec<&str> = blamed.iter().map(|p| noun(*p)).collect();
    let mut text = if verdict.ambiguous_with.is_empty() {
        let were = if names.len() == 1 { "was" } else { "were" };
        let which = match blamed.iter().filter(|p| !p.catalogued()).count() {
            0 => "",
            all if all == names.len() => ", which is no entry of the catalogue",
            _ => "; not all of that are entries of the catalogue",
        };
        format!("{} {were} left out{which}", capitalised(&listed(&names, "and")))
    } else {
        let together = listed(&names, "with");
        let others: Vec<&str> = verdict.ambiguous_with.iter().map(|p| noun(*p)).collect();
        let all: Vec<&str> = std::iter::once(together.as_str()).chain(others).collect();
        format!("{} was left out; this recording cannot tell which", capitalised(&listed(&all, "or")))
    };
    let told: Vec<String> = blamed.iter().filter_map(|p| told(diagnosis, *p)).collect();
    if !told.is_empty() {
        let lead = if verdict.ambiguous_with.is_empty() {
            ": ".to_owned()
        } else {
            format!(". If {}: ", listed(&names, "and"))
        };
        text.push_str(&format!("{lead}{}", told.join("; ")));
    }
    if let Some(misfit) = fall(&diagnosis.baseline, &diagnosis.extended) {
        text.push_str(&format!("; {misfit}"));
    }
    text.push_str(&format!("; {}", moved(&diagnosis.baseline, &diagnosis.extended)));
    if let Some(least) = least_sure(diagnosis) {
        text.push_str(&format!("; least sure: {least}"));
    }
    text
}

/// By what it shows, and how surely: whole sentences.
pub fn evidence(diagnosis: &Diagnosis) -> String {
    let (mismatch, verdict) = (&diagnosis.mismatch, &diagnosis.verdict);
    let mut sentences = Vec::new();
    if mismatch.detected {
        let channels: Vec<&str> = mismatch.channels.iter().take(2).map(|c| channel_words(*c)).collect();
        let phases: Vec<&str> = mismatch.phases.iter().take(2).map(|p| phase_words(*p)).collect();
        let pokes: Vec<String> = mismatch.pokes.iter().take(4).map(u32::to_string).collect();
        let mut shows = String::new();
        if !channels.is_empty() {
            shows.push_str(&format!(" in {}", listed(&channels, "and")));
        }
        if !phases.is_empty() {
            shows.push_str(&format!(", {}", listed(&phases, "and")));
        }
        if !pokes.is_empty() {
            let which = if pokes.len() == 1 { "poke" } else { "pokes" };
            shows.push_str(&format!(", most in {which} {}", listed(&pokes, "and")));
        }
        if let Some(region) = mismatch.region {
            let [x, y, z] = <[f64; 3]>::from(region.centroid_m).map(|c| 1e3 * c);
            shows.push_str(&format!(
                ", within {:.0} mm of ({x:.0}, {y:.0}, {z:.0}) mm",
                1e3 * region.radius_m
            ));
        }
        if !shows.is_empty() {
            sentences.push(format!("The misfit shows{shows}."));
        }
        if mismatch.p_value.is_finite() {
            let often = chance(mismatch.p_value);
            sentences.push(if mismatch.p_value < PLAIN {
                format!("By chance it would be as large {often}.")
            } else {
                // An entry's own test looks only where the entry would show, and sees what drowns in the sum of everything.
                format!("Taken as a whole it is no larger than noise and elements leave it {often}; it shows where this reading expects it.")
            });
        }
    } else if mismatch.p_value.is_finite() {
        let often = chance(mismatch.p_value);
        sentences.push(format!("Noise and elements leave a misfit as large {often}."));
    }
    if verdict.unexplained {
        let tried = diagnosis.candidates.iter().filter(|c| !c.physics.is_empty()).count();
        sentences.push(format!("{} tried.", capitalised(&counted(tried, "reading was", "readings were"))));
    }
    if verdict.confidence.is_finite() {
        let named = !verdict.explained_by.is_empty() && verdict.confidence >= SURE;
        let limit = if named || is_sure(diagnosis) { "" } else { ": not sure" };
        sentences.push(format!("Confidence {:.0} %{limit}.", 100.0 * verdict.confidence));
    } else {
        sentences.push("How sure this is is not known.".to_owned());
    }
    sentences.join(" ")
}

/// What is said of one entry: its parameters.
fn told(diagnosis: &Diagnosis, physics: Physics) -> Option<String> {
    clause(diagnosis.parameters.iter().find(|f| f.physics == physics)?)
}

fn fall(before: &Reading, after: &Reading) -> Option<String> {
    let (a, b) = (before.held_out_chi2_per_dof, after.held_out_chi2_per_dof);
    if !(a.is_finite() && b.is_finite()) {
        return None;
    }
    let verb = if b < a { "falls" } else { "rises" };
    // As many digits as it takes to see the difference, within reason.
    let told = [3, 4, 5].map(|count| [a, b].map(|value| digits(value, count)));
    Some(match told.into_iter().find(|[a, b]| a != b) {
        Some([a, b]) => format!("held-out misfit {verb} from {a} to {b}"),
        None => format!("held-out misfit stays at {}", digits(b, 3)),
    })
}

fn moved(before: &Reading, after: &Reading) -> String {
    let (a, b) = (before.young_modulus_pa.value, after.young_modulus_pa.value);
    if (a / b - 1.0).abs() < 2e-3 {
        format!("the modulus stays at {}", pascals(b))
    } else {
        format!("the modulus moves from {} to {}", pascals(a), pascals(b))
    }
}

/// The loosest parameter of what is blamed.
fn least_sure(diagnosis: &Diagnosis) -> Option<String> {
    let named = |physics: &Physics| diagnosis.verdict.blamed().contains(physics);
    let parameters = diagnosis.parameters.iter().filter(|f| named(&f.physics)).flat_map(|f| &f.parameters);
    let (id, share) =
        parameters.filter_map(|p| Some((p.id, looseness(p)?))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let share = match share {
        s if s >= 1.0 => "not determined".to_owned(),
        s if s >= 0.095 => format!("± {:.0} %", 100.0 * s),
        s => format!("± {:.1} %", 100.0 * s),
    };
    Some(format!("{} ({share})", parameter_noun(id)))
}

/// `14.2`, `1.02`, `163`.
/// So many significant digits of a number that is 1 or more, and as many decimals of a smaller one.
fn digits(value: f64, count: usize) -> String {
    let whole = if value >= 100.0 {
        3
    } else if value >= 10.0 {
        2
    } else {
        1
    };
    format!("{value:.decimals$}", decimals = count.saturating_sub(whole))
}

/// A misfit as large as this by chance (share of recordings) is plain as a whole.
const PLAIN: f64 = 0.05;

fn chance(p: f64) -> String {
    if p < 1e-4 {
        "less than once in 10,000 recordings".to_owned()
    } else if p < 0.1 {
        format!("once in {:.0} recordings", 1.0 / p)
    } else {
        format!("in {:.0} % of recordings", 100.0 * p)
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
