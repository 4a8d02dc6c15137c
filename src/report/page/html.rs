//! The page as text: template, styles, scripts, data.

use super::figures::{correlations, discretisation, patches, remarks, residuals, results, settings_table};
use super::scene::Scene;
use super::series::Series;
use crate::inverse::Fit;
use crate::observation::Recording;
use crate::report::ReportError;
use crate::report::document::method_name;
use crate::report::words::{Verdict, finding, trust, verdict};
use serde::Serialize;
use serde_json::{Map, Value};
use std::borrow::Cow;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// What every page's scripts begin and end with.
const THEME: &str = include_str!("theme.js");
const START: &str = include_str!("start.js");
const SCRIPTS: [&str; 2] = [include_str!("phantom.js"), include_str!("plots.js")];

/// The page of a fit. `settings` are those that made the fit, by name with unit.
pub fn page(fit: &Fit, recording: &Recording, settings: &Map<String, Value>) -> Result<String, ReportError> {
    let status = match verdict(fit) {
        Verdict::Explained | Verdict::NoiseOverstated(_) => ("good", "✓"),
        Verdict::Unsettled | Verdict::Unexpected | Verdict::Unexplained(_) => ("bad", "!"),
        Verdict::Unjudged => ("bad", "?"),
    };
    Ok(whole(
        TEMPLATE,
        &[
            ("across", if recording.stage.is_some() { "depth" } else { "time" }),
            ("recording", &escape(&fit.recording)),
            ("method", method_name(fit.method)),
            ("status", status.0),
            ("sign", status.1),
            ("finding", &escape(&finding(fit))),
            ("trust", &escape(&trust(fit))),
            ("remarks", &remarks(&fit.remarks)),
            ("results", &results(fit)),
            ("patches", &patches(fit)),
            ("residuals", &residuals(fit, recording)),
            ("correlations", &correlations(fit)),
            ("discretisation", &discretisation(fit, recording)),
            ("settings", &settings_table(settings)),
            ("scene", &json_block(&Scene::new(fit, recording)?)?),
            ("series", &json_block(&Series::new(fit, recording))?),
        ],
        &SCRIPTS,
    ))
}

/// A template filled with `values` and with what all pages share: the program's version, styles, the plotting library,
/// and the page's own `scripts` between those that every page begins and ends with.
pub(in crate::report) fn whole(template: &str, values: &[(&str, &str)], scripts: &[&str]) -> String {
    let scripts = format!("(() => {{\n'use strict';\n{THEME}{}{START}}})();\n", scripts.concat());
    let version = format!("{} {}", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"));
    let sources = plotly::Plot::offline_js_sources();
    let shared = [
        ("version", version.as_str()),
        ("style", STYLE),
        ("plotting", plotting_library(&sources)),
        ("scripts", &scripts),
    ];
    fill(template, &[values, &shared].concat())
}

/// Text as HTML shows it literally.
pub(in crate::report) fn escape(text: &str) -> Cow<'_, str> {
    quick_xml::escape::escape(text)
}

/// The plotting library without the formula typesetter that comes with it, whose two megabytes draw nothing here.
fn plotting_library(sources: &str) -> &str {
    let inner = sources.split_once('>').map_or(sources, |(_, rest)| rest);
    inner.split_once("</script>").map_or(inner, |(library, _)| library)
}

/// JSON that no HTML parser takes for markup.
pub(in crate::report) fn json_block(data: &impl Serialize) -> Result<String, ReportError> {
    Ok(serde_json::to_string(data)?.replace('<', "\\u003c"))
}

/// Replaces every `{{name}}` of the template by its text, once: what is put in is not looked at again.
fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        page.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        if let Some((_, value)) = values.iter().find(|(key, _)| *key == name) {
            page.push_str(value);
        }
        rest = after;
    }
    page + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_in_is_not_looked_at_again() {
        assert_eq!(fill("a {{x}} b {{y}}", &[("x", "{{y}}"), ("y", "2")]), "a {{y}} b 2");
    }

    #[test]
    fn every_gap_of_the_template_has_a_text() {
        let source = include_str!("html.rs");
        for gap in TEMPLATE.split("{{").skip(1) {
            let name = gap.split("}}").next().expect("a name");
            assert!(source.contains(&format!("(\"{name}\", ")), "nothing fills {name}");
        }
    }

    #[test]
    fn the_page_names_no_address() {
        for text in SCRIPTS.iter().chain([&THEME, &START, &TEMPLATE, &STYLE]) {
            assert!(!text.contains("://") && !text.contains("src=") && !text.contains("@import"), "{text}");
        }
    }

    #[test]
    fn data_cannot_end_its_block() {
        let block = json_block(&"</script><!--").expect("JSON");
        assert!(!block.contains('<'));
        assert_eq!(serde_json::from_str::<String>(&block).expect("JSON"), "</script><!--");
    }

    #[test]
    fn the_library_comes_without_its_typesetter() {
        let sources = plotly::Plot::offline_js_sources();
        let library = plotting_library(&sources);
        assert!(library.contains("plotly.js v") && !library.contains("<script"));
        assert!(library.trim_end().len() < sources.len() * 3 / 4);
    }
}
