//! A sheet: a sentence, then tables and plots in their order.

use crate::report::ReportError;
use crate::report::page::{escape, json_block, table, whole};
use serde::Serialize;
use std::fmt::Write as _;

const TEMPLATE: &str = include_str!("sheet.html");
const SCRIPTS: [&str; 1] = [include_str!("sheet.js")];

/// Points, or a line, of a plot.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Trace {
    pub(super) name: String,
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    /// Standard deviations of y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) sd: Option<Vec<f64>>,
    pub(super) line: bool,
}

/// Which axes of a plot count in decades.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Decades {
    None,
    Across,
    Both,
}

/// One plot with the words along its axes.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Plot {
    #[serde(skip)]
    pub(super) title: &'static str,
    #[serde(skip)]
    pub(super) note: &'static str,
    pub(super) across: &'static str,
    pub(super) up: &'static str,
    pub(super) decades: Decades,
    pub(super) traces: Vec<Trace>,
}

/// A sheet in the making.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    body: String,
    plots: Vec<Plot>,
}

impl Sheet {
    /// Adds a table; the first column heads its rows. A note stands below it.
    pub(super) fn table(&mut self, title: &str, head: &[&str], rows: &[Vec<String>], note: &str) {
        let table = table(head, rows.iter().map(Vec::as_slice));
        let _ = write!(self.body, "<section><h2>{}</h2>{table}{}</section>", escape(title), noted(note));
    }

    /// Adds sentences.
    pub(super) fn list(&mut self, title: &str, words: &[String]) {
        let items: String = words.iter().map(|w| format!("<li>{}</li>", escape(w))).collect();
        let _ = write!(self.body, "<section><h2>{}</h2><ul>{items}</ul></section>", escape(title));
    }

    /// Adds a plot.
    pub(super) fn plot(&mut self, plot: Plot) {
        let _ = write!(
            self.body,
            "<section><h2>{0}</h2>{1}<div id=\"plot-{2}\" class=\"plot\" role=\"figure\" aria-label=\"{0}\"></div></section>",
            escape(plot.title),
            noted(plot.note),
            self.plots.len()
        );
        self.plots.push(plot);
    }

    /// The page. `source`: what it was made from.
    pub(super) fn page(
        &self,
        title: &str,
        source: &str,
        sentence: &str,
        good: bool,
    ) -> Result<String, ReportError> {
        let (status, sign) = if good { ("good", "✓") } else { ("bad", "!") };
        Ok(whole(
            TEMPLATE,
            &[
                ("title", &escape(title)),
                ("source", &escape(source)),
                ("status", status),
                ("sign", sign),
                ("sentence", &escape(sentence)),
                ("sections", &self.body),
                ("series", &json_block(&self.plots)?),
            ],
            &SCRIPTS,
        ))
    }
}

fn noted(note: &str) -> String {
    if note.is_empty() { String::new() } else { format!("<p class=\"note\">{}</p>", escape(note)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_gap_of_the_template_has_a_text_and_no_address() {
        let source = include_str!("sheet.rs");
        for gap in TEMPLATE.split("{{").skip(1) {
            let name = gap.split("}}").next().expect("a name");
            let shared = ["version", "style", "plotting", "scripts"].contains(&name);
            assert!(shared || source.contains(&format!("(\"{name}\", ")), "nothing fills {name}");
        }
        for text in SCRIPTS.iter().chain([&TEMPLATE]) {
            assert!(!text.contains("://") && !text.contains("src=") && !text.contains("@import"), "{text}");
        }
    }

    #[test]
    fn texts_are_shown_and_not_obeyed() {
        let mut sheet = Sheet::default();
        sheet.list("Words", &["<b>".to_owned()]);
        let page = sheet.page("a", "b", "<i>", false).expect("a page");
        assert!(page.contains("&lt;b&gt;") && page.contains("&lt;i&gt;") && page.contains("headline bad"));
    }
}
