//! The page's tables and lists of a diagnosis, as HTML.

use super::detail::{parameter_noun, signed};
use crate::diagnose::{Candidate, Diagnosis, Estimate, NextPoke, Reading, Restrained};
use crate::report::page::{escape, remarks, table};
use crate::units::{pascals, with_sd};

const ABSENT: &str = "–";

/// Baseline beside extended model.
pub(super) fn before_after(diagnosis: &Diagnosis) -> String {
    let row = |name: &str, of: &dyn Fn(&Reading) -> String| {
        vec![name.to_owned(), of(&diagnosis.baseline), of(&diagnosis.extended)]
    };
    let rows = [
        row("Young’s modulus, equilibrium", &|r| modulus(&r.young_modulus_pa)),
        row("Restraint, springs together", &|r| springs(&r.restraint_total_n_per_m)),
        row("χ² per value of held-out pokes", &|r| number(r.held_out_chi2_per_dof, 3, "")),
        row("χ² per degree of freedom", &|r| number(r.chi2_per_dof, 3, "")),
    ];
    table(&["", "Nothing left out", "With what is blamed"], rows.iter().map(Vec::as_slice))
}

/// Where restraint acts, and how stiff it is; a sentence where none was found.
pub(super) fn restraint(diagnosis: &Diagnosis) -> String {
    if diagnosis.extended.restraint.is_empty() {
        return "<p class=\"note\">No restraint was found on the searched surface.</p>".to_owned();
    }
    let row = |patch: &Restrained| {
        let at = |axis: usize| {
            let value = 1e3 * patch.centroid_m[axis];
            match patch.centroid_sd_m.map(|sd| 1e3 * sd[axis]).filter(|sd| *sd > 0.0) {
                Some(sd) => format!("{value:.2} ± {sd:.2}"),
                None => format!("{value:.2}"),
            }
        };
        let how = if patch.stiffness_n_per_m.is_some() { " (assumed)" } else { "" };
        [held(patch), at(0), at(1), at(2), format!("{:.1}{how}", 1e3 * patch.radius_m)]
    };
    let rows: Vec<[String; 5]> = diagnosis.extended.restraint.iter().map(row).collect();
    table(&["Restraint", "x, mm", "y, mm", "z, mm", "radius, mm"], rows.iter().map(|r| r.as_slice()))
}

/// How a patch holds: `springs, 62.5 ± 2.5 N/m`.
pub(super) fn held(patch: &Restrained) -> String {
    match &patch.stiffness_n_per_m {
        Some(own) => format!("springs, {}", with_sd(own.value, own.sd, 1.0, "N/m")),
        None => "glued".to_owned(),
    }
}

/// Parameters of what is blamed.
pub(super) fn parameters(diagnosis: &Diagnosis) -> String {
    let mut rows: Vec<[String; 3]> = Vec::new();
    for found in &diagnosis.parameters {
        for parameter in &found.parameters {
            let values: Vec<String> = parameter.values.iter().map(value).collect();
            let name = format!("{} ({})", parameter_noun(parameter.id), parameter.id);
            rows.push([found.physics.to_string(), name, values.join("; ")]);
        }
        if let Some(law) = found.law {
            rows.push([found.physics.to_string(), "law".to_owned(), law.whose().to_owned()]);
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    table(&["What", "Parameter", "Value ± 1 sd, SI"], rows.iter().map(|r| r.as_slice()))
}

/// Candidates in order, with reasons.
pub(super) fn candidates(candidates: &[Candidate]) -> String {
    if candidates.is_empty() {
        return "<p class=\"note\">Nothing else was tried.</p>".to_owned();
    }
    let rows: Vec<[String; 4]> = candidates
        .iter()
        .map(|c| {
            let names: Vec<&str> = c.physics.iter().map(|p| p.id()).collect();
            let name = if names.is_empty() { "nothing left out".to_owned() } else { names.join(" + ") };
            let mark = if c.selected { "✓ " } else { "" };
            [
                format!("{mark}{name}"),
                number(c.score, 0, ""),
                c.held_out_chi2_per_dof.map_or(ABSENT.to_owned(), |v| number(v, 3, "")),
                c.why.clone(),
            ]
        })
        .collect();
    table(
        &["Reading", "Score", "Held-out χ² per value", "For and against"],
        rows.iter().map(|r| r.as_slice()),
    )
}

/// What the missing thing must be like.
pub(super) fn properties(diagnosis: &Diagnosis) -> String {
    match diagnosis.mismatch.properties.as_slice() {
        [] => "<p class=\"note\">No mismatch shows.</p>".to_owned(),
        properties => remarks(properties),
    }
}

/// What the recording cannot tell.
pub(super) fn cannot_tell(diagnosis: &Diagnosis) -> String {
    let mut sentences = Vec::new();
    if !diagnosis.verdict.ambiguous_with.is_empty() {
        let others: Vec<&str> = diagnosis.verdict.ambiguous_with.iter().map(|p| p.id()).collect();
        sentences.push(format!("Explains the recording as well: {}.", others.join(", ")));
    }
    sentences.extend(diagnosis.remarks.iter().cloned());
    remarks(&sentences)
}

/// The next poke in figures and with its reason.
pub(super) fn next_poke(next: Option<&NextPoke>) -> String {
    let Some(NextPoke { why, separates, poke }) = next else {
        return "<p>No further poke is proposed.</p>".to_owned();
    };
    let [x, y, z] = <[f64; 3]>::from(poke.site).map(|c| 1e3 * c);
    let [dx, dy, dz] = <[f64; 3]>::from(poke.direction).map(|c| signed(c, 3));
    let separates: Vec<&str> = separates.iter().map(|p| p.id()).collect();
    let rows = [
        ["Site".to_owned(), format!("({x:.1}, {y:.1}, {z:.1}) mm")],
        ["Direction".to_owned(), format!("({dx}, {dy}, {dz})")],
        ["Depth".to_owned(), format!("{:.2} mm", 1e3 * poke.depth_m)],
        ["Rate".to_owned(), format!("{:.2} mm/s", 1e3 * poke.rate_m_s)],
        ["Held".to_owned(), format!("{:.1} s", poke.hold_s)],
        ["Separates".to_owned(), if separates.is_empty() { ABSENT.to_owned() } else { separates.join(", ") }],
    ];
    let why = escape(why);
    format!(
        "<p>{why}</p>{}<p class=\"note\">As a row of a protocol: <code>next-poke.csv</code> beside this page.</p>",
        table(&["Next poke", "Value"], rows.iter().map(|r| r.as_slice()))
    )
}

fn modulus(estimate: &Estimate) -> String {
    if estimate.value >= 1e3 && estimate.value < 1e6 {
        with_sd(estimate.value, estimate.sd, 1e-3, "kPa")
    } else {
        pascals(estimate.value)
    }
}

fn springs(total: &Estimate) -> String {
    if total.value > 0.0 { with_sd(total.value, total.sd, 1.0, "N/m") } else { "none".to_owned() }
}

fn value(estimate: &Estimate) -> String {
    if !estimate.value.is_finite() {
        return "not determined".to_owned();
    }
    let small = estimate.value != 0.0 && !(1e-3..1e5).contains(&estimate.value.abs());
    match (small, estimate.sd.is_finite() && estimate.sd > 0.0) {
        (true, true) => format!("{:.3e} ± {:.1e}", estimate.value, estimate.sd),
        (true, false) => format!("{:.3e}", estimate.value),
        (false, _) => with_sd(estimate.value, estimate.sd, 1.0, "").trim_end().to_owned(),
    }
}

fn number(value: f64, decimals: usize, unit: &str) -> String {
    if value.is_finite() { format!("{value:.decimals$}{unit}") } else { "not determined".to_owned() }
}
