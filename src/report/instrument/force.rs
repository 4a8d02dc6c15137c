//! The page of a force sensor: gains and cross-talk, how its axes lie, what is left, how its zero wanders.

use super::sheet::{Decades, Plot, Sheet, Trace};
use crate::calib::instruments::force::{COMPONENTS, Drift, ForceFound, Weights};
use crate::report::ReportError;

/// The page. `sentence`: what was found, in one; `remarks`: what is doubtful, and what was asked for; `good`: nothing is doubtful.
///
/// # Errors
/// [`ReportError::Json`].
pub fn force_page(
    found: &ForceFound,
    weights: &Weights,
    drift: Option<&Drift>,
    sentence: &str,
    remarks: &[String],
    good: bool,
) -> Result<String, ReportError> {
    let mut sheet = Sheet::default();
    if !remarks.is_empty() {
        sheet.list(if good { "What was asked for" } else { "What is doubtful" }, remarks);
    }
    let told = &COMPONENTS[..found.told];
    let head: Vec<&str> = std::iter::once("Reading, under 1 of").chain(told.iter().copied()).collect();
    let rows: Vec<Vec<String>> = (0..6)
        .map(|i| {
            let cell =
                |j: usize| format!("{:+.5} ± {:.5}", found.sensitivity[i][j], found.sensitivity_sd[i][j]);
            std::iter::once(COMPONENTS[i].to_owned()).chain((0..found.told).map(cell)).collect()
        })
        .collect();
    sheet.table(
        "Gain and cross-talk",
        &head,
        &rows,
        "N or N·m read for each N or N·m of the load; 1 standard deviation. A right sensor has 1 on the diagonal and 0 elsewhere.",
    );
    let rows: Vec<Vec<String>> = (0..6)
        .map(|i| {
            let trend = |pairs: Option<[[f64; 2]; 6]>, per: f64| {
                pairs.map_or("–".to_owned(), |p| format!("{:+.2e} ± {:.1e}", p[i][0] * per, p[i][1] * per))
            };
            vec![
                COMPONENTS[i].to_owned(),
                format!("{:+.5} ± {:.5}", found.bias[i], found.bias_sd[i]),
                trend(found.per_second, 3600.0),
                trend(found.per_kelvin, 1.0),
                format!("{:.2e}", found.noise[i]),
            ]
        })
        .collect();
    let head = ["Reading", "Zero", "Drift an hour", "Drift a kelvin", "Noise of a row"];
    let note = "N and N·m. The drift is that of the zero while the weights hung, from the times and temperatures of their table; – where it has none.";
    sheet.table("Zero and noise", &head, &rows, note);
    let degrees = |k: usize| {
        format!("{:+.3} ± {:.3}", found.turn_rad[k].to_degrees(), found.turn_sd_rad[k].to_degrees())
    };
    let note = if found.reads_pull {
        "Turn from the axes that directions are given in to those of the sensor. The sensor reads what pulls at the tool."
    } else {
        "Turn from the axes that directions are given in to those of the sensor. The sensor reads the opposite of what pulls at the tool."
    };
    let turn = vec![vec!["Turn (°)".to_owned(), degrees(0), degrees(1), degrees(2)]];
    sheet.table("How its axes lie", &["", "about x", "about y", "about z"], &turn, note);
    let lines: Vec<f64> = weights.holds.iter().map(|hold| hold.line as f64).collect();
    let left = |range: std::ops::Range<usize>| -> Vec<Trace> {
        range
            .map(|c| Trace {
                name: COMPONENTS[c].to_owned(),
                x: lines.clone(),
                y: found.residuals.iter().map(|r| 1e3 * r[c]).collect(),
                ..Trace::default()
            })
            .collect()
    };
    let plot = |title, up, traces| Plot {
        title,
        note: "",
        across: "line of the table",
        up,
        decades: Decades::None,
        traces,
    };
    sheet.plot(plot("What is left of the forces", "reading less model (mN)", left(0..3)));
    sheet.plot(plot("What is left of the moments", "reading less model (mN·m)", left(3..6)));
    if let Some(drift) = drift {
        drifted(&mut sheet, drift);
    }
    sheet.page("Force sensor", &weights.file.display().to_string(), sentence, good)
}

fn drifted(sheet: &mut Sheet, drift: &Drift) {
    let rows: Vec<Vec<String>> = drift
        .trends
        .iter()
        .map(|t| {
            vec![
                format!("{} per {}", t.component, t.per),
                format!("{:+.2e} ± {:.1e}", t.slope, t.sd),
                format!("{:.2e}", t.p),
                if t.is_there() { "there" } else { "not seen" }.to_owned(),
            ]
        })
        .collect();
    let note = if drift.not_apart {
        "Temperature went with time: which of them moves the zero cannot be told from this log."
    } else {
        "p: chance of such a slope in any of the rows where there is none."
    };
    sheet.table(
        "Drift of the zero in the log without load",
        &["Slope", "N or N·m", "p", "Verdict"],
        &rows,
        note,
    );
    let traces = |range: std::ops::Range<usize>| -> Vec<Trace> {
        range
            .map(|c| Trace {
                name: COMPONENTS[c].to_owned(),
                x: drift.span_s.clone(),
                y: drift.allan[c].iter().map(|s| 1e3 * s).collect(),
                line: true,
                ..Trace::default()
            })
            .collect()
    };
    let note = "Where a line stops falling, a longer mean of the zero tells no more.";
    let plot =
        |title, up, traces| Plot { title, note, across: "span (s)", up, decades: Decades::Both, traces };
    sheet.plot(plot("Allan deviation of the forces", "mN", traces(0..3)));
    sheet.plot(plot("Allan deviation of the moments", "mN·m", traces(3..6)));
}
