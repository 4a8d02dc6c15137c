//! The page's tables: figures with units and uncertainties, as HTML.

use super::html::escape;
use super::scene::patch_label;
use crate::geometry::Vec3;
use crate::inverse::{Fit, PatchKind};
use crate::observation::Recording;
use crate::report::words::{
    modulus, modulus_interval, modulus_sd, stiffness, stiffness_interval, stiffness_sd,
};
use serde_json::{Map, Value};
use std::fmt::Write;

const ABSENT: &str = "–";

/// Modulus and stiffness, one row each.
pub(super) fn results(fit: &Fit) -> String {
    let e = &fit.young_modulus_pa;
    let bound = modulus_sd(fit.young_modulus_bound_pa, e.value);
    let mut rows = vec![[
        "Young’s modulus".to_owned(),
        modulus(e),
        modulus_interval(fit.young_modulus_interval90_pa, e),
        bound,
    ]];
    let springs = fit.patches.iter().any(|p| matches!(p.kind, PatchKind::Springs { .. }));
    if springs {
        let total = &fit.restraint_total_n_per_m;
        let name = "Restraint, springs together".to_owned();
        rows.push([name, stiffness(total), stiffness_interval(total), ABSENT.to_owned()]);
    }
    for (i, patch) in fit.patches.iter().enumerate() {
        let label = patch_label(i);
        rows.push(match patch.kind {
            PatchKind::Springs { stiffness_n_per_m: k } => {
                let bound = patch.stiffness_bound_n_per_m.map_or(ABSENT.to_owned(), stiffness_sd);
                [format!("Patch {label}, springs"), stiffness(&k), stiffness_interval(&k), bound]
            }
            PatchKind::Glued { stiffness_lower_bound_n_per_m: least } => [
                format!("Patch {label}, glued"),
                format!("≥ {least:.0} N/m (95 %)"),
                ABSENT.to_owned(),
                ABSENT.to_owned(),
            ],
        });
    }
    let head = ["Quantity", "Estimate ± 1 sd", "90 % interval", "Cramér–Rao sd"];
    table(&head, rows.iter().map(|r| r.as_slice()))
}

/// Where the patches are; a sentence when there is none.
pub(super) fn patches(fit: &Fit) -> String {
    if fit.patches.is_empty() {
        return "<p class=\"note\">No restraint patch was found on the searched surface.</p>".to_owned();
    }
    let rows: Vec<[String; 5]> = fit
        .patches
        .iter()
        .enumerate()
        .map(|(i, patch)| {
            let at = |axis: usize| {
                let (value, sd) = (patch.centroid_m[axis] * 1e3, patch.centroid_sd_m[axis] * 1e3);
                if sd > 0.0 && sd.is_finite() {
                    format!("{value:.1} ± {sd:.1}")
                } else {
                    format!("{value:.1}")
                }
            };
            let how = if patch.radius_estimated { "" } else { " (assumed)" };
            let radius = format!("{:.1}{how}", patch.radius_m * 1e3);
            [patch_label(i), at(0), at(1), at(2), radius]
        })
        .collect();
    table(&["Patch", "x, mm", "y, mm", "z, mm", "radius, mm"], rows.iter().map(|r| r.as_slice()))
}

/// What is left, beside what the stated noise leaves.
pub(super) fn residuals(fit: &Fit, recording: &Recording) -> String {
    let residual = &fit.residual;
    let rms = |sd: [f64; 3]| Vec3::from(sd).norm() / 3_f64.sqrt();
    let [force_ratio, marker_ratio] = residual.rest_noise_over_stated;
    let row = |name: &str, found: String, noise: String| [name.to_owned(), found, noise];
    let rows = [
        row(
            "Markers, rms of a coordinate",
            number(residual.marker_rms_m * 1e6, 1, "\u{a0}µm"),
            format!("{:.1} µm", rms(recording.noise.marker_m) * 1e6),
        ),
        row(
            "Force, rms of a component",
            number(residual.force_rms_n * 1e3, 2, "\u{a0}mN"),
            format!("{:.2} mN", rms(recording.noise.force_n) * 1e3),
        ),
        row(
            "χ² per degree of freedom",
            number(residual.chi2_per_dof, 3, ""),
            format!("≤ {}", number(residual.chi2_per_dof_limit, 3, " (99.9\u{a0}%)")),
        ),
        row("Force noise at rest over stated", number(force_ratio, 2, ""), "1".to_owned()),
        row("Marker noise at rest over stated", number(marker_ratio, 2, ""), "1".to_owned()),
    ];
    table(&["Residual", "Found", "By noise alone"], rows.iter().map(|r| r.as_slice()))
}

/// Correlation of the estimates, coloured by sign and size.
pub(super) fn correlations(fit: &Fit) -> String {
    let springs = fit.patches.iter().enumerate().filter(|(_, p)| matches!(p.kind, PatchKind::Springs { .. }));
    let names: Vec<String> =
        std::iter::once("E".to_owned()).chain(springs.map(|(i, _)| patch_label(i))).collect();
    let mut html = String::from("<table class=\"correlation\"><thead><tr><td></td>");
    for name in &names {
        let _ = write!(html, "<th scope=\"col\">{name}</th>");
    }
    html.push_str("</tr></thead><tbody>");
    for (name, row) in names.iter().zip(&fit.correlation) {
        let _ = write!(html, "<tr><th scope=\"row\">{name}</th>");
        for &value in row {
            let side = if value < 0.0 { "negative" } else { "positive" };
            if !value.is_finite() {
                let _ = write!(html, "<td>{ABSENT}</td>");
                continue;
            }
            let share = (value.abs().min(1.0) * 70.0).round();
            let text = format!("{value:+.2}").replace('-', "−");
            let _ = write!(html, "<td class=\"{side}\" style=\"--share:{share}%\">{text}</td>");
        }
        html.push_str("</tr>");
    }
    html + "</tbody></table>"
}

/// Remarks as a list.
pub(in crate::report) fn remarks(remarks: &[String]) -> String {
    if remarks.is_empty() {
        return "<p>Nothing to remark.</p>".to_owned();
    }
    let items = remarks.iter().map(|r| format!("<li>{}</li>", escape(r)));
    format!("<ul>{}</ul>", items.collect::<String>())
}

/// Elements, degrees of freedom, and what the operator assumed.
pub(super) fn discretisation(fit: &Fit, recording: &Recording) -> String {
    let d = &fit.discretisation;
    let [low, high] = recording.phantom.modulus_range_pa.map(|e| e * 1e-3);
    let rows = [
        ["Element".to_owned(), d.element.clone()],
        ["Mesh as given".to_owned(), format!("{} nodes, {} tetrahedra", d.given_nodes, d.given_tets)],
        ["Degrees of freedom".to_owned(), d.degrees_of_freedom.to_string()],
        ["Modulus error left by it".to_owned(), number(d.modulus_error * 100.0, 2, "\u{a0}% (1 sd)")],
        ["Poisson’s ratio, assumed".to_owned(), recording.phantom.poisson_ratio.to_string()],
        ["Modulus expected".to_owned(), format!("{low} to {high} kPa")],
    ];
    table(&["Model", "Value"], rows.iter().map(|r| r.as_slice()))
}

/// Settings by name; nested ones by their path.
pub(in crate::report) fn settings_table(settings: &Map<String, Value>) -> String {
    let mut rows = Vec::new();
    for (name, value) in settings {
        flatten(name, value, &mut rows);
    }
    if rows.is_empty() {
        return String::new();
    }
    table(&["Setting", "Value"], rows.iter().map(|r| r.as_slice()))
}

fn flatten(name: &str, value: &Value, rows: &mut Vec<[String; 2]>) {
    match value {
        Value::Object(inner) => inner.iter().for_each(|(k, v)| flatten(&format!("{name}.{k}"), v, rows)),
        Value::String(text) => rows.push([name.to_owned(), text.clone()]),
        other => rows.push([name.to_owned(), other.to_string()]),
    }
}

fn number(value: f64, decimals: usize, unit: &str) -> String {
    if value.is_finite() { format!("{value:.decimals$}{unit}") } else { "not determined".to_owned() }
}

/// A table whose first column heads its rows. Texts are escaped here.
pub(in crate::report) fn table<'a>(head: &[&str], rows: impl Iterator<Item = &'a [String]>) -> String {
    let mut html = String::from("<table><thead><tr>");
    for name in head {
        let _ = write!(html, "<th scope=\"col\">{}</th>", escape(name));
    }
    html.push_str("</tr></thead><tbody>");
    for row in rows {
        html.push_str("<tr>");
        for (i, text) in row.iter().enumerate() {
            let text = escape(text);
            let _ = match i {
                0 => write!(html, "<th scope=\"row\">{text}</th>"),
                _ => write!(html, "<td>{text}</td>"),
            };
        }
        html.push_str("</tr>");
    }
    html + "</tbody></table>"
}
