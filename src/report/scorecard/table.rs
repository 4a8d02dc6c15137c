//! Every draw in a row: for tables of many proofs, and to ask how sure a verdict may be of what speaks for it.

use super::judge::{Judged, Kind, Outcome};
use super::tally::Scorecard;
use crate::report::ReportError;
use serde::Serialize;

/// A draw. Ids, and their own strengths, are joined by `+`; what is not known is empty.
#[derive(Serialize)]
struct Row<'a> {
    draw: &'a str,
    kind: Kind,
    concealed: String,
    strength: Option<f64>,
    own_strength: String,
    strength_share: Option<f64>,
    named: String,
    ambiguous_with: String,
    outcome: Outcome,
    p_value: Option<f64>,
    confidence: Option<f64>,
    explained_share: Option<f64>,
    gain_over_least: Option<f64>,
    margin_share: Option<f64>,
    left_deviations: Option<f64>,
    effects: Option<usize>,
    modulus_error_before: Option<f64>,
    modulus_error_after: Option<f64>,
    modulus_covered: Option<bool>,
    place_error_m: Option<f64>,
    seconds: f64,
}

/// The draws of a scorecard as CSV.
///
/// # Errors
/// [`ReportError::Table`].
pub fn scorecard_table(card: &Scorecard) -> Result<Vec<u8>, ReportError> {
    let failed = |source| ReportError::Table { path: "scorecard.csv".into(), source };
    let mut writer = csv::Writer::from_writer(Vec::new());
    for judged in &card.judged {
        writer.serialize(row(judged)).map_err(failed)?;
    }
    writer.into_inner().map_err(|error| failed(error.into_error().into()))
}

fn row(judged: &Judged) -> Row<'_> {
    let evidence = judged.evidence.as_ref();
    Row {
        draw: &judged.name,
        kind: judged.kind,
        concealed: judged.concealed.join("+"),
        strength: judged.strength,
        own_strength: judged.own_strength.iter().map(ToString::to_string).collect::<Vec<_>>().join("+"),
        strength_share: judged.strength_share,
        named: judged.named.join("+"),
        ambiguous_with: judged.ambiguous_with.join("+"),
        outcome: judged.outcome,
        p_value: judged.p_value,
        confidence: judged.confidence,
        explained_share: evidence.and_then(|e| e.explained_share),
        gain_over_least: evidence.and_then(|e| e.gain_over_least),
        margin_share: evidence.and_then(|e| e.margin_share),
        left_deviations: evidence.and_then(|e| e.left_deviations),
        effects: evidence.map(|e| e.effects),
        modulus_error_before: judged.modulus_error[0],
        modulus_error_after: judged.modulus_error[1],
        modulus_covered: judged.modulus_covered,
        place_error_m: judged.place_error_m,
        seconds: judged.seconds,
    }
}
