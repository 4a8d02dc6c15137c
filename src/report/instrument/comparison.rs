//! The page of a fit beside its reference values.

use super::sheet::{Decades, Plot, Sheet, Trace};
use crate::calib::reference::{Comparison, Fitted};
use crate::report::ReportError;
use crate::units::with_sd;

/// The page. `sentence`: the verdict, in one.
///
/// # Errors
/// [`ReportError::Json`].
pub fn comparison_page(
    comparisons: &[Comparison],
    source: &str,
    sentence: &str,
) -> Result<String, ReportError> {
    let mut sheet = Sheet::default();
    let rows: Vec<Vec<String>> = comparisons
        .iter()
        .map(|c| {
            let (scale, unit) = c.quantity.shown();
            let say = |of: Fitted| with_sd(of.value, of.sd, scale, unit);
            vec![
                format!("{} ({})", c.quantity.name(), c.name),
                say(c.fitted),
                say(c.reference),
                with_sd(c.difference, c.sd, scale, unit),
                format!("{:+.2}", c.z),
                format!("{:.2e}", c.p),
                if c.agree { "agree" } else { "DISAGREE" }.to_owned(),
            ]
        })
        .collect();
    let head = ["Quantity", "Fit", "Reference", "Difference", "z", "p", "At 95 %"];
    let note = "z: difference over its standard deviation, both uncertainties in it. p: chance of such a difference where both are right.";
    sheet.table("Fit and reference", &head, &rows, note);
    // Both in deviations of the reference value's own size, so that all quantities stand in one plot.
    let share = |of: &dyn Fn(&Comparison) -> Fitted, name: &str| Trace {
        name: name.to_owned(),
        x: (1..=comparisons.len()).map(|k| k as f64).collect(),
        y: comparisons.iter().map(|c| 100.0 * (of(c).value / c.reference.value - 1.0)).collect(),
        sd: Some(comparisons.iter().map(|c| 196.0 * of(c).sd / c.reference.value.abs()).collect()),
        line: false,
    };
    sheet.plot(Plot {
        title: "Difference from the reference",
        note: "Bars are 95 % intervals of each alone.",
        across: "row of the table",
        up: "%",
        decades: Decades::None,
        traces: vec![share(&|c| c.fitted, "fit"), share(&|c| c.reference, "reference")],
    });
    sheet.page("Fit and reference", source, sentence, comparisons.iter().all(|c| c.agree))
}
