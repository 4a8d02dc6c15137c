//! How far found figures lie from the concealed ones, and whether their 90 % intervals hold these.

use super::answer::{Answer, Figure};
use super::said::{Number, Verdict};
use crate::report::document::NORMAL_90;
use serde::Serialize;

/// The error of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterError {
    /// Physics id.
    pub physics: String,
    /// Parameter id.
    pub id: String,
    /// Length of the difference over the length of the truth.
    pub relative: f64,
    /// Whether the 90 % interval holds the truth; none for vectors, series, and without a deviation.
    pub covered: Option<bool>,
}

/// The error of one number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NumberError {
    /// Found over true, less one.
    pub(super) relative: Option<f64>,
    /// Whether the 90 % interval holds the truth.
    pub(super) covered: Option<bool>,
}

pub(super) fn modulus_error(answer: &Answer, found: &Number) -> NumberError {
    let truth = answer.young_modulus_pa;
    NumberError { relative: found.value.map(|v| v / truth - 1.0), covered: covered(truth, found) }
}

fn covered(truth: f64, found: &Number) -> Option<bool> {
    let (value, sd) = (found.value?, found.sd?);
    (sd > 0.0).then_some((value - truth).abs() <= NORMAL_90 * sd)
}

/// Distance between places (m): in all coordinates that the concealed entry has.
pub(super) fn place_error_m(physics: &str, answer: &Answer, said: &Verdict) -> Option<f64> {
    let truth = answer.parameters.get(physics)?;
    let mut square = 0.0;
    for id in ["centre_x_m", "centre_y_m", "centre_z_m"] {
        let Some(true_value) = truth.get(id).and_then(|f| f.numbers().first()) else {
            if id == "centre_z_m" {
                continue;
            }
            return None;
        };
        let found = said.numbers(physics, id).first()?.value?;
        square += (found - true_value).powi(2);
    }
    Some(square.sqrt())
}

/// What one recording tells of a parameter, from which errors are counted.
enum Told {
    /// Nothing of its own: a place is judged as one, a direction without magnitude not at all.
    Nothing,
    /// The value.
    Value,
    /// The departure from one.
    FromOne,
    /// Ratios only: the geometric mean is divided out, then the departure from one.
    Ratios,
    /// The axis, with either sign.
    Axis,
}

fn told(id: &str) -> Told {
    match id {
        "centre_x_m" | "centre_y_m" | "centre_z_m" | "translation_m" => Told::Nothing,
        "scale" | "depth_gain" => Told::FromOne,
        "gain" => Told::Ratios,
        "axis" => Told::Axis,
        _ => Told::Value,
    }
}

/// Errors of the parameters that both have, those of one law being no other's. Series of unequal length compare their sums, where shares add up.
pub(super) fn parameter_errors(physics: &str, answer: &Answer, said: &Verdict) -> Vec<ParameterError> {
    let Some(truth) = answer.parameters.get(physics) else { return Vec::new() };
    let laws = [truth.get("law").and_then(Figure::name), said.name(physics, "law")];
    if let [Some(true_law), Some(found_law)] = laws
        && true_law != found_law
    {
        return Vec::new();
    }
    let mut errors = Vec::new();
    for (id, figure) in truth {
        let numbers = said.numbers(physics, id);
        let found: Option<Vec<f64>> = numbers.iter().map(|n| n.value).collect();
        let (Some(mut found), mut truth) = (found, figure.numbers().to_vec()) else { continue };
        if found.is_empty() || truth.is_empty() {
            continue;
        }
        if found.len() != truth.len() {
            if id != "relaxed_fraction" {
                continue;
            }
            (found, truth) = (vec![found.iter().sum()], vec![truth.iter().sum()]);
        }
        match told(id) {
            Told::Nothing => continue,
            Told::Value => {}
            Told::FromOne => [&mut found, &mut truth].into_iter().flatten().for_each(|v| *v -= 1.0),
            Told::Ratios => [&mut found, &mut truth].into_iter().for_each(|v| ratios(v)),
            Told::Axis => {
                if found.iter().zip(&truth).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
                    found.iter_mut().for_each(|v| *v = -*v);
                }
            }
        }
        let length = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
        let size = length(&mut truth.iter().copied());
        if size == 0.0 {
            continue;
        }
        let covered = match (numbers, figure.numbers()) {
            ([number], [truth]) => covered(*truth, number),
            _ => None,
        };
        errors.push(ParameterError {
            physics: physics.to_owned(),
            id: id.clone(),
            relative: length(&mut found.iter().zip(&truth).map(|(a, b)| a - b)) / size,
            covered,
        });
    }
    errors
}

fn ratios(gains: &mut [f64]) {
    let mean = (gains.iter().map(|g| g.abs().ln()).sum::<f64>() / gains.len() as f64).exp();
    gains.iter_mut().for_each(|g| *g = *g / mean - 1.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn errors(physics: &str, truth: Value, found: Value) -> Vec<ParameterError> {
        let answer = serde_json::from_value(
            json!({"physics": [physics], "young_modulus_pa": 1e4, "parameters": {physics: truth}}),
        )
        .expect("an answer");
        let reading = json!({"young_modulus_pa": {"value": 1e4, "sd": 1.0}, "held_out_chi2_per_dof": null});
        let said = serde_json::from_value(json!({
            "mismatch": {"detected": true},
            "verdict": {"physics": [physics], "confidence": null},
            "parameters": {physics: found},
            "baseline": reading,
            "extended": reading,
        }))
        .expect("a verdict");
        parameter_errors(physics, &answer, &said)
    }

    fn number(value: f64, sd: f64) -> Value {
        json!({"value": value, "sd": sd})
    }

    /// A gain common to all axes cannot be told; an axis has no sign; a scale is judged by its departure from one.
    #[test]
    fn errors_count_what_a_recording_tells() {
        let found = json!({"gain": [number(2.2, 0.1), number(2.0, 0.1), number(2.0, 0.1)]});
        let gains = errors("force-gain", json!({"gain": [1.1, 1.0, 1.0]}), found);
        assert!(gains[0].relative < 1e-12, "{gains:?}");
        let found = json!({"axis": [number(0.0, 0.1), number(-0.6, 0.1), number(-0.8, 0.1)]});
        let axis = errors("anisotropy", json!({"axis": [0.0, 0.6, 0.8]}), found);
        assert!(axis[0].relative < 1e-12, "{axis:?}");
        let scale = errors("camera-scale", json!({"scale": 1.10}), json!({"scale": number(1.08, 0.02)}));
        assert!((scale[0].relative - 0.2).abs() < 1e-9, "{scale:?}");
        assert_eq!(scale[0].covered, Some(true));
        assert!(errors("camera-scale", json!({"scale": 1.0}), json!({"scale": number(1.0, 0.0)})).is_empty());
    }

    /// Fung's parameter is no error of Yeoh's.
    #[test]
    fn laws_compare_with_themselves() {
        let found = json!({"law": "yeoh", "stiffening": number(0.5, 0.02)});
        let of =
            |law: &str| errors("strain-stiffening", json!({"law": law, "stiffening": 0.6}), found.clone());
        assert!((of("yeoh")[0].relative - 1.0 / 6.0).abs() < 1e-9);
        assert!(of("fung").is_empty());
    }

    #[test]
    fn series_of_unequal_length_compare_their_sums() {
        let truth = json!({"relaxed_fraction": [0.12, 0.08], "time_constant_s": [1.0, 6.0]});
        let found = json!({"relaxed_fraction": [number(0.18, 0.01)], "time_constant_s": [number(2.0, 0.1)]});
        let errors = errors("viscoelastic-relaxation", truth, found);
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert!((errors[0].relative - 0.1).abs() < 1e-9);
        assert_eq!(errors[0].covered, None);
    }
}
