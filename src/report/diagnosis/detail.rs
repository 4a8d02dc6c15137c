//! Each entry of the catalogue in words: what it is called in a sentence, and what its parameters say.

use crate::diagnose::{Estimate, Found, Parameter, Physics};

/// The entry as the subject of a sentence.
pub(super) fn noun(physics: Physics) -> &'static str {
    match physics {
        Physics::FiniteStrain => "large strain",
        Physics::StrainStiffening => "stiffening with strain",
        Physics::ViscoelasticRelaxation => "relaxation",
        Physics::StressSoftening => "softening by the deepest load",
        Physics::Drying => "a drift of the modulus",
        Physics::Inclusion => "an inclusion",
        Physics::Anisotropy => "anisotropy",
        Physics::PoissonRatio => "another Poisson’s ratio",
        Physics::BaseDebonding => "a debonded part of the base",
        Physics::CompliantBase => "a base that gives",
        Physics::SlackBand => "slack in the restraint",
        Physics::BandViscosity => "relaxation of the restraint",
        Physics::TipSlip => "slip of the tip",
        Physics::LateContact => "late contact of the tip",
        Physics::StageBacklash => "backlash of the stage",
        Physics::StageCompliance => "give of the stage",
        Physics::ForceDrift => "a drift of the force’s zero",
        Physics::ForceGain => "a wrong gain of the force sensor",
        Physics::CameraMisalignment => "a turned camera",
        Physics::CameraScale => "a wrong scale of the camera",
        Physics::CameraLag => "a late camera",
        Physics::SelfWeight => "the phantom’s weight",
        Physics::CoarseMesh => "what coarse elements get wrong",
        Physics::UnevenScale => "a scale of the camera that differs over the picture",
        Physics::StickyRestraint => "dry friction beside the restraint",
    }
}

/// What the parameters say, as a clause; `None` where there is nothing to say.
pub(super) fn clause(found: &Found) -> Option<String> {
    let get = |id: &str| found.parameters.iter().find(|p| p.id == id).map(values);
    let one = |id: &str| get(id).and_then(|v| v.first().copied());
    Some(match found.physics {
        Physics::FiniteStrain | Physics::CoarseMesh | Physics::UnevenScale => return None,
        Physics::StickyRestraint => format!(
            "the restraint pulls {:.0} % harder at first, and slides after {:.2} mm",
            100.0 * one("stiffness_ratio")?,
            1e3 * one("slip_m")?
        ),
        Physics::StrainStiffening => match found.law {
            Some(law) => format!("by {} law, with a stiffening of {:.2}", law.whose(), one("stiffening")?),
            None => format!("with a stiffening of {:.2}", one("stiffening")?),
        },
        Physics::ViscoelasticRelaxation => {
            decay("of the stress decays", &get("relaxed_fraction")?, &get("time_constant_s")?)
        }
        Physics::BandViscosity => {
            decay("of the restraint’s pull decays", &get("relaxed_fraction")?, &get("time_constant_s")?)
        }
        Physics::StressSoftening => {
            format!("up to {:.0} % softer below the largest load", 100.0 * one("softening")?)
        }
        Physics::Drying => {
            format!("the modulus changes by {} % a minute", signed(6000.0 * one("modulus_rate_per_s")?, 2))
        }
        Physics::Inclusion => {
            let place = ["centre_x_m", "centre_y_m", "centre_z_m"].map(one);
            let [Some(x), Some(y), Some(z)] = place else { return None };
            format!(
                "{:.2} times as stiff as the rest, {:.1} mm in radius, at ({:.1}, {:.1}, {:.1}) mm",
                one("modulus_ratio")?,
                1e3 * one("radius_m")?,
                1e3 * x,
                1e3 * y,
                1e3 * z
            )
        }
        Physics::Anisotropy => {
            format!("{:.2} times as stiff along ({})", one("modulus_ratio")?, numbers(&get("axis")?, 1.0, 2))
        }
        Physics::PoissonRatio => format!("{:.3}", one("poisson_ratio")?),
        Physics::BaseDebonding => format!(
            "{:.1} mm in radius, at ({:.1}, {:.1}) mm of the base",
            1e3 * one("radius_m")?,
            1e3 * one("centre_x_m")?,
            1e3 * one("centre_y_m")?
        ),
        Physics::CompliantBase => {
            format!("{:.2} MPa of traction for each metre", 1e-6 * one("foundation_pa_per_m")?)
        }
        Physics::SlackBand => format!("it pulls after {:.2} mm only", 1e3 * one("gap_m")?),
        Physics::TipSlip => format!("friction coefficient {:.2}", one("friction_coefficient")?),
        Physics::LateContact => format!("by {:.3} mm", 1e3 * one("gap_m")?),
        Physics::StageBacklash => format!("{:.3} mm of lost motion", 1e3 * one("backlash_m")?),
        Physics::StageCompliance => format!("{:.3} mm/N", 1e3 * one("compliance_m_per_n")?),
        Physics::ForceDrift => format!("({}) mN a minute", numbers(&get("rate_n_per_s")?, 6e4, 1)),
        Physics::ForceGain => format!("axes read {} times the force", numbers(&get("gain")?, 1.0, 3)),
        Physics::CameraMisalignment => {
            let turn = get("rotation_rad")?.iter().map(|v| v * v).sum::<f64>().sqrt();
            format!("by {:.2}°", turn.to_degrees())
        }
        Physics::CameraScale => {
            let said = [("scale", "displacements"), ("depth_gain", "depth")]
                .into_iter()
                .filter_map(|(id, what)| one(id).map(|v| format!("{what} × {v:.3}")))
                .collect::<Vec<_>>();
            said.join(", ")
        }
        Physics::CameraLag => format!("by {:.1} ms", 1e3 * one("lag_s")?),
        Physics::SelfWeight => {
            format!("g = {:.3} m/s² along ({})", one("g")?, numbers(&get("gravity_direction")?, 1.0, 2))
        }
    })
}

/// A parameter in a sentence: `the time constant`.
pub(super) fn parameter_noun(id: &str) -> String {
    match id {
        "relaxed_fraction" => "the share that relaxes".to_owned(),
        "time_constant_s" => "the time constant".to_owned(),
        "radius_m" => "its radius".to_owned(),
        "modulus_ratio" => "its ratio of stiffness".to_owned(),
        _ => {
            let units =
                ["_m_per_n", "_n_per_m", "_n_per_s", "_pa_per_m", "_per_s", "_per_m", "_rad", "_m", "_s"];
            let bare = units.iter().find_map(|u| id.strip_suffix(u)).unwrap_or(id);
            format!("the {}", bare.replace('_', " "))
        }
    }
}

/// Deviation over value of a parameter; lists and vectors by their lengths. `None` where it means nothing: places are
/// no magnitudes.
pub(super) fn looseness(parameter: &Parameter) -> Option<f64> {
    if parameter.id.starts_with("centre_") || parameter.id.ends_with("direction") {
        return None;
    }
    let length =
        |of: fn(&Estimate) -> f64| parameter.values.iter().map(|e| of(e).powi(2)).sum::<f64>().sqrt();
    let share = length(|e| e.sd) / length(|e| e.value);
    share.is_finite().then_some(share)
}

fn values(parameter: &Parameter) -> Vec<f64> {
    parameter.values.iter().map(|e| e.value).collect()
}

fn decay(what: &str, shares: &[f64], times: &[f64]) -> String {
    let total = 100.0 * shares.iter().sum::<f64>();
    match (shares, times) {
        ([_], [time]) => format!("{total:.0} % {what} with {}", seconds(*time)),
        _ => {
            let terms: Vec<String> = shares
                .iter()
                .zip(times)
                .map(|(share, time)| format!("{:.0} % with {}", 100.0 * share, seconds(*time)))
                .collect();
            format!("{total:.0} % {what}, {}", terms.join(", "))
        }
    }
}

fn seconds(time: f64) -> String {
    if time < 10.0 { format!("{time:.1} s") } else { format!("{time:.0} s") }
}

fn numbers(values: &[f64], scale: f64, decimals: usize) -> String {
    values.iter().map(|v| signed(v * scale, decimals)).collect::<Vec<_>>().join(", ")
}

/// A number with a true minus sign and no negative zero.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::StiffeningLaw;

    fn parameter(id: &'static str, values: &[f64]) -> Parameter {
        let values = values.iter().map(|&value| Estimate { value, sd: 0.1 * value }).collect();
        Parameter { id, values, list: true }
    }

    #[test]
    fn relaxation_is_said_by_its_terms() {
        let found = |shares: &[f64], times: &[f64]| Found {
            physics: Physics::ViscoelasticRelaxation,
            parameters: vec![parameter("relaxed_fraction", shares), parameter("time_constant_s", times)],
            law: None,
        };
        assert_eq!(clause(&found(&[0.22], &[4.0])).as_deref(), Some("22 % of the stress decays with 4.0 s"));
        assert_eq!(
            clause(&found(&[0.1, 0.05], &[1.0, 20.0])).as_deref(),
            Some("15 % of the stress decays, 10 % with 1.0 s, 5 % with 20 s")
        );
        let bare = Found { physics: Physics::ViscoelasticRelaxation, parameters: Vec::new(), law: None };
        assert_eq!(clause(&bare), None);
    }

    #[test]
    fn stiffening_is_said_by_its_law() {
        let parameters = vec![parameter("stiffening", &[1.5])];
        let found = Found { physics: Physics::StrainStiffening, parameters, law: Some(StiffeningLaw::Yeoh) };
        assert_eq!(clause(&found).as_deref(), Some("by Yeoh’s law, with a stiffening of 1.50"));
    }

    #[test]
    fn looseness_is_relative_and_not_for_places() {
        let share = looseness(&parameter("rotation_rad", &[0.0, 3.0, 4.0])).expect("a share");
        assert!((share - 0.1).abs() < 1e-12);
        assert_eq!(looseness(&parameter("centre_x_m", &[0.1])), None);
        assert_eq!(looseness(&parameter("gap_m", &[0.0])), None);
    }

    #[test]
    fn ids_become_words() {
        assert_eq!(parameter_noun("compliance_m_per_n"), "the compliance");
        assert_eq!(parameter_noun("friction_coefficient"), "the friction coefficient");
        assert_eq!(signed(-0.001, 2), "0.00");
        assert_eq!(signed(-1.5, 1), "−1.5");
    }
}
