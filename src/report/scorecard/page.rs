//! The scorecard as a page: figures, reliability, power against strength, and every draw. One file that needs nothing
//! but itself.

use super::judge::Judged;
use super::tally::Scorecard;
use super::text::rows;
use crate::report::ReportError;
use crate::report::page::{escape, json_block, table, whole};
use serde_json::json;

const TEMPLATE: &str = include_str!("scorecard.html");
const SCRIPTS: [&str; 1] = [include_str!("scorecard.js")];

/// The page of a scorecard; `title` says which draws.
///
/// # Errors
/// [`ReportError::Json`].
pub fn scorecard_page(card: &Scorecard, title: &str) -> Result<String, ReportError> {
    let figures = rows(card);
    let lines: Vec<[String; 2]> = card.lines.iter().map(|l| [l.concealed.clone(), l.said()]).collect();
    let draws: Vec<[String; 7]> = card
        .judged
        .iter()
        .map(|j| {
            let joined = |ids: &[String], none: &str| {
                if ids.is_empty() { none.to_owned() } else { ids.join(" + ") }
            };
            let number = |value: Option<f64>, decimals: usize| {
                value.map_or("–".to_owned(), |v| format!("{v:.decimals$}"))
            };
            let strength = |j: &Judged| match j.own_strength.len() {
                0 | 1 => number(j.strength, 1),
                _ => {
                    let own: Vec<String> = j.own_strength.iter().map(|&own| number(Some(own), 1)).collect();
                    format!("{} ({})", number(j.strength, 1), own.join(" + "))
                }
            };
            let named = match (&j.error, j.ambiguous_with.is_empty()) {
                (Some(error), _) => error.clone(),
                (None, true) => joined(&j.named, "nothing"),
                (None, false) => {
                    format!("{} or {}", joined(&j.named, "nothing"), j.ambiguous_with.join(", "))
                }
            };
            [
                j.name.clone(),
                joined(&j.concealed, "nothing"),
                strength(j),
                number(j.strength_share.map(|share| 100.0 * share), 2),
                named,
                number(j.confidence, 2),
                j.outcome.words().to_owned(),
            ]
        })
        .collect();
    let series = json!({
        "reliability": card.reliability,
        "detected": card.detected_by_strength,
        "named": card.named_by_strength,
    });
    let plural = if card.draws == 1 { "" } else { "s" };
    let how = if card.quick { ", diagnosed quickly" } else { "" };
    Ok(whole(
        TEMPLATE,
        &[
            ("title", &escape(title)),
            ("count", &format!("{} concealed draw{plural}{how}", card.draws)),
            ("figures", &table(&["What", "Figure"], figures.iter().map(|r| r.as_slice()))),
            ("lines", &table(&["Concealed", "How it came out"], lines.iter().map(|r| r.as_slice()))),
            (
                "draws",
                &table(
                    &["Draw", "Concealed", "Strength", "Share (%)", "Said", "Confidence", "Outcome"],
                    draws.iter().map(|r| r.as_slice()),
                ),
            ),
            ("series", &json_block(&series)?),
        ],
        &SCRIPTS,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_gap_of_the_template_has_a_text_and_no_address() {
        let source = include_str!("page.rs");
        for gap in TEMPLATE.split("{{").skip(1) {
            let name = gap.split("}}").next().expect("a name");
            let shared = ["version", "style", "plotting", "scripts"].contains(&name);
            assert!(
                shared
                    || source.contains(&format!("(\"{name}\", "))
                    || source.contains(&format!("\"{name}\",\n")),
                "nothing fills {name}"
            );
        }
        for text in SCRIPTS.iter().chain([&TEMPLATE]) {
            assert!(!text.contains("://") && !text.contains("src=") && !text.contains("@import"), "{text}");
        }
    }
}
