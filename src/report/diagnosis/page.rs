//! The page of a diagnosis: first the sentence, then curves on pokes that the fit did not see, the place on the phantom,
//! the candidates with reasons, what cannot be told, and the next poke. One file that needs nothing but itself.

use super::curves::Curves;
use super::figures::{before_after, candidates, cannot_tell, next_poke, parameters, properties, restraint};
use super::scene::PlaceScene;
use super::sentence::{conclusion, evidence, is_sure};
use crate::diagnose::Diagnosis;
use crate::observation::Recording;
use crate::report::ReportError;
use crate::report::page::{escape, json_block, settings_table, whole};
use serde_json::{Map, Value};

const TEMPLATE: &str = include_str!("diagnosis.html");
const SCRIPTS: [&str; 2] = [include_str!("place.js"), include_str!("curves.js")];

/// The page of a diagnosis. `settings` are those that made it, by name with unit.
///
/// # Errors
/// [`ReportError`]: a mesh without a proper surface.
pub fn diagnosis_page(
    diagnosis: &Diagnosis,
    recording: &Recording,
    settings: &Map<String, Value>,
) -> Result<String, ReportError> {
    let status = if is_sure(diagnosis) { ("good", "✓") } else { ("bad", "?") };
    Ok(whole(
        TEMPLATE,
        &[
            ("recording", &escape(&diagnosis.recording)),
            ("status", status.0),
            ("sign", status.1),
            ("conclusion", &escape(&conclusion(diagnosis))),
            ("evidence", &escape(&evidence(diagnosis))),
            ("before_after", &before_after(diagnosis)),
            ("restraint", &restraint(diagnosis)),
            ("parameters", &parameters(diagnosis)),
            ("properties", &properties(diagnosis)),
            ("cannot_tell", &cannot_tell(diagnosis)),
            ("candidates", &candidates(&diagnosis.candidates)),
            ("next_poke", &next_poke(diagnosis.next_poke.as_ref())),
            ("settings", &settings_table(settings)),
            ("scene", &json_block(&PlaceScene::new(diagnosis, recording)?)?),
            ("series", &json_block(&Curves::new(diagnosis, recording))?),
        ],
        &SCRIPTS,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_gap_of_the_template_has_a_text() {
        let source = include_str!("page.rs");
        for gap in TEMPLATE.split("{{").skip(1) {
            let name = gap.split("}}").next().expect("a name");
            let shared = ["version", "style", "plotting", "scripts"].contains(&name);
            assert!(shared || source.contains(&format!("(\"{name}\", ")), "nothing fills {name}");
        }
    }

    #[test]
    fn the_page_names_no_address() {
        for text in SCRIPTS.iter().chain([&TEMPLATE]) {
            assert!(!text.contains("://") && !text.contains("src=") && !text.contains("@import"), "{text}");
        }
    }
}
