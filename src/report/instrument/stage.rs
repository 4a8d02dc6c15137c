//! The page of a stage: the figures of ISO 230-2, deviations from both sides, and the press on the block.

use super::sheet::{Decades, Plot, Sheet, Trace};
use crate::calib::instruments::stage::{BlockPress, Compliance, ISO, Positioning, Uncertain};
use crate::report::ReportError;

/// What the letters stand for.
const MEANINGS: [&str; 5] = [
    "accuracy from both sides",
    "repeatability from both sides",
    "reversal value",
    "systematic deviation from both sides",
    "range of the mean deviations from both sides",
];

/// The page. `sentence`: what was found, in one; `remarks`: what is doubtful.
///
/// # Errors
/// [`ReportError::Json`].
pub fn stage_page(
    axes: &[Positioning],
    block: Option<(&BlockPress, &Compliance)>,
    source: &str,
    sentence: &str,
    remarks: &[String],
) -> Result<String, ReportError> {
    let mut sheet = Sheet::default();
    if !remarks.is_empty() {
        sheet.list("What is doubtful", remarks);
    }
    for axis in axes {
        positioned(&mut sheet, axis);
    }
    if let Some((press, found)) = block {
        pressed(&mut sheet, press, found);
    }
    sheet.page("Stage", source, sentence, remarks.is_empty())
}

fn positioned(sheet: &mut Sheet, axis: &Positioning) {
    let micrometres = |figure: &Uncertain| format!("{:.2} ± {:.2} µm", 1e6 * figure.value, 1e6 * figure.sd);
    let mut rows: Vec<Vec<String>> = (ISO.iter().zip(MEANINGS).zip(&axis.iso))
        .map(|((letter, meaning), figure)| {
            vec![(*letter).to_owned(), meaning.to_owned(), micrometres(figure)]
        })
        .collect();
    rows.push(vec![
        "backlash".to_owned(),
        "mean of what it stays behind".to_owned(),
        micrometres(&axis.backlash),
    ]);
    let scale = format!("{:+.1} ± {:.1} µm/m", 1e6 * axis.scale.value, 1e6 * axis.scale.sd);
    rows.push(vec!["scale".to_owned(), "way made over way asked for, less one".to_owned(), scale]);
    let title = if axis.axis.is_empty() { "Axis".to_owned() } else { format!("Axis {}", axis.axis) };
    let note = format!(
        "By the definitions of ISO 230-2, from {} runs at {} targets; 1 standard deviation.",
        axis.runs,
        axis.at.len()
    );
    sheet.table(&title, &["Figure", "What it is", "Found"], &rows, &note);
    let side = |k: usize, name: &str| Trace {
        name: name.to_owned(),
        x: axis.at.iter().map(|a| 1e3 * a.target_m).collect(),
        y: axis.at.iter().map(|a| 1e6 * a.mean_m[k]).collect(),
        sd: Some(axis.at.iter().map(|a| 2e6 * a.sd_m[k]).collect()),
        line: false,
    };
    sheet.plot(Plot {
        title: "Deviation at each target",
        note: "Means of the runs from both sides; bars are two standard deviations of a run.",
        across: "target (mm)",
        up: "deviation (µm)",
        decades: Decades::None,
        traces: vec![side(0, "from below"), side(1, "from above")],
    });
}

fn pressed(sheet: &mut Sheet, press: &BlockPress, found: &Compliance) {
    let row = |name: &str, value: f64, sd: f64, unit: &str| {
        vec![name.to_owned(), format!("{value:.4} ± {sd:.4} {unit}")]
    };
    let rows = [
        row("Yielding without the tip", 1e6 * found.m_per_n, 1e6 * found.sd_m_per_n, "µm/N"),
        row("Slope in contact", 1e-3 * found.slope_n_per_m, 1e-3 * found.slope_sd_n_per_m, "N/mm"),
        row("Contact begins at", 1e3 * found.contact_m, 1e3 * found.contact_sd_m, "mm"),
    ];
    let note = if found.is_bent() {
        "The line bends: the contact stiffens or slips."
    } else {
        "The line is straight."
    };
    sheet.table("Press on the block", &["What", "Found"], &rows, note);
    let x: Vec<f64> = press.position_m.iter().map(|z| 1e3 * z).collect();
    let model = press.force_n.iter().zip(&found.residuals_n).map(|(f, r)| f - r).collect();
    let trace =
        |name: &str, y: Vec<f64>, line| Trace { name: name.to_owned(), x: x.clone(), y, line, sd: None };
    sheet.plot(Plot {
        title: "Force against position",
        note: "",
        across: "position (mm)",
        up: "force (N)",
        decades: Decades::None,
        traces: vec![trace("measured", press.force_n.clone(), false), trace("model", model, true)],
    });
}
