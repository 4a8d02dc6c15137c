//! What a person should see of the simulation experiment: the published tables with spreads, all trials as
//! CSV, and figures as SVG.

use super::ReportError;
use crate::inverse::experiment::{Method, Restraint, Spread, StepTwo, Study, Summary, Trial};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Writes `experiment.txt`, `trials.csv`, `summary.csv` and one figure of springs and one of displacements a
/// restraint into an existing folder, and says what was written.
///
/// # Errors
/// [`ReportError::Write`] and [`ReportError::Table`].
pub fn write_experiment(
    folder: &Path,
    study: &Study,
    summaries: &[Summary],
) -> Result<Vec<PathBuf>, ReportError> {
    let mut files = vec![
        (folder.join("experiment.txt"), experiment_text(summaries)),
        (folder.join("trials.csv"), trials_csv(&study.trials)),
        (folder.join("summary.csv"), summary_csv(summaries)),
    ];
    for (restraint, truth) in &study.truth {
        let name = match restraint {
            Restraint::Fixed => "fixed",
            Restraint::Springs(_) => "springs",
        };
        let shown = shown_trials(study, *restraint);
        files.push((folder.join(format!("displacements-{name}.svg")), displacements(study, truth, &shown)));
        if let Restraint::Springs(k) = restraint {
            files.push((folder.join("stiffness-springs.svg"), stiffness(study, *k, &shown)));
        }
    }
    let mut written = Vec::new();
    for (path, text) in files {
        fs::write(&path, text).map_err(|source| ReportError::Write { path: path.clone(), source })?;
        written.push(path);
    }
    Ok(written)
}

/// The tables as text: one block a restraint, one line a level and method.
pub fn experiment_text(summaries: &[Summary]) -> String {
    let mut text = String::new();
    let mut last = None;
    for s in summaries {
        if last != Some(s.restraint) {
            last = Some(s.restraint);
            let _ = writeln!(text, "\n{}: median [quartiles] over the seeds", restraint_name(s.restraint));
            let _ = writeln!(
                text,
                "{:>5} {:21} {:>7} {:>22} {:>9} {:>9} {:>24} {:>24} {:>16} {:>16} {:>13}",
                "SNR",
                "method",
                "conv.",
                "E (Pa)",
                "Psi½ (m)",
                "Phi½ (m)",
                "Gamma (N/m)",
                "Upsilon (N/m)",
                "med|dE|,|dGam|",
                "RMSE E, Ups",
                "bound E, sum"
            );
        }
        let _ = writeln!(
            text,
            "{:>5} {:21} {:>3}/{:<3} {:>22} {:>9.5} {:>9.4} {:>24} {:>24} {:>16} {:>16} {:>13}",
            level(s.snr_db),
            s.method.name(),
            s.converged,
            s.trials,
            spread(&s.young_modulus_pa),
            s.psi_half_m.quartiles[1],
            s.phi_half_m.quartiles[1],
            spread(&s.gamma_n_per_m),
            spread(&s.upsilon_n_per_m),
            pair(s.median_error.map(Some)),
            pair(s.rms_error.map(Some)),
            pair(s.bound),
        );
    }
    text
}

fn restraint_name(restraint: Restraint) -> String {
    match restraint {
        Restraint::Fixed => "ten nodes held".to_owned(),
        Restraint::Springs(k) => format!("ten nodes on springs of {k} N/m"),
    }
}

fn level(snr_db: f64) -> String {
    if snr_db.is_infinite() { "none".to_owned() } else { format!("{snr_db}") }
}

fn number(value: f64) -> String {
    match value {
        v if v.is_nan() => "-".to_owned(),
        v if v.is_infinite() => "held".to_owned(),
        v if v.abs() < 100.0 => format!("{v:.1}"),
        v if v.abs() < 1e6 => format!("{v:.0}"),
        v => format!("{v:.1e}"),
    }
}

fn spread(s: &Spread) -> String {
    if s.quartiles[1].is_nan() || s.quartiles[0].is_infinite() {
        return number(s.quartiles[1]);
    }
    format!("{} [{}, {}]", number(s.quartiles[1]), number(s.quartiles[0]), number(s.quartiles[2]))
}

fn pair(values: [Option<f64>; 2]) -> String {
    values.map(|v| v.map_or("-".to_owned(), number)).join(", ")
}

fn trials_csv(trials: &[Trial]) -> String {
    let mut text =
        "restraint,snr_db,seed,method,converged,young_modulus_pa,psi_half_m,phi_half_m,gamma_n_per_m,\
                    upsilon_n_per_m\n"
            .to_owned();
    for t in trials {
        let _ = writeln!(
            text,
            "{},{},{},\"{}\",{},{:e},{:e},{:e},{:e},{:e}",
            restraint_name(t.restraint),
            t.snr_db,
            t.seed,
            t.method.name(),
            t.converged,
            t.young_modulus_pa,
            t.psi_half_m,
            t.phi_half_m,
            t.gamma_n_per_m,
            t.upsilon_n_per_m
        );
    }
    text
}

fn summary_csv(summaries: &[Summary]) -> String {
    let mut text = "restraint,snr_db,method,trials,converged".to_owned();
    for name in ["young_modulus_pa", "psi_half_m", "phi_half_m", "gamma_n_per_m", "upsilon_n_per_m"] {
        let _ = write!(text, ",{name}_q25,{name}_median,{name}_q75");
    }
    text.push_str(
        ",median_error_e_pa,median_error_gamma_n_per_m,rms_error_e_pa,rms_error_upsilon_n_per_m,bound_e_pa,\
         bound_total_n_per_m\n",
    );
    for s in summaries {
        let _ = write!(
            text,
            "{},{},\"{}\",{},{}",
            restraint_name(s.restraint),
            s.snr_db,
            s.method.name(),
            s.trials,
            s.converged
        );
        let columns =
            [&s.young_modulus_pa, &s.psi_half_m, &s.phi_half_m, &s.gamma_n_per_m, &s.upsilon_n_per_m];
        let errors = [s.median_error, s.rms_error].concat();
        for value in columns.iter().flat_map(|c| c.quartiles).chain(errors) {
            let _ = write!(text, ",{value:e}");
        }
        for bound in s.bound {
            let _ = write!(text, ",{}", bound.map_or(String::new(), |b| format!("{b:e}")));
        }
        text.push('\n');
    }
    text
}

/// The first seed's trials at the level nearest to 40 dB, as the published figures show it.
fn shown_trials(study: &Study, restraint: Restraint) -> Vec<&Trial> {
    let of = |t: &&Trial| t.restraint == restraint && t.seed == 0;
    let nearest = study
        .trials
        .iter()
        .filter(of)
        .map(|t| t.snr_db)
        .min_by(|a, b| (a - 40.0).abs().total_cmp(&(b - 40.0).abs()));
    study.trials.iter().filter(of).filter(|t| Some(t.snr_db) == nearest).collect()
}

/// Side of one panel's drawing area and its margin (px).
const PANEL: f64 = 260.0;
const MARGIN: f64 = 40.0;

/// Search nodes in the plane of the back: x to the right, z up, in px of a panel.
fn positions(study: &Study) -> Vec<[f64; 2]> {
    let nodes: Vec<_> =
        study.experiment.search.iter().map(|&n| study.experiment.mesh.nodes[n as usize]).collect();
    let low = |f: &dyn Fn(usize) -> f64| (0..nodes.len()).map(f).fold(f64::INFINITY, f64::min);
    let (x0, z0) = (low(&|i| nodes[i].x), low(&|i| nodes[i].z));
    let span = (0..nodes.len()).map(|i| (nodes[i].x - x0).max(nodes[i].z - z0)).fold(0.0, f64::max);
    let scale = (PANEL - 2.0 * MARGIN) / span;
    nodes.iter().map(|p| [MARGIN + (p.x - x0) * scale + 20.0, PANEL - MARGIN - (p.z - z0) * scale]).collect()
}

fn sheet(panels: &[(String, String)], caption: &str) -> String {
    let columns = panels.len().clamp(1, 3);
    let rows = panels.len().div_ceil(columns);
    let (width, height) = (columns as f64 * PANEL, rows as f64 * (PANEL + 20.0) + 44.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"12\" y=\"20\" font-size=\"13\">{caption}</text>\n"
    );
    for (i, (title, body)) in panels.iter().enumerate() {
        let (x, y) = ((i % columns) as f64 * PANEL, (i / columns) as f64 * (PANEL + 20.0) + 36.0);
        let _ = writeln!(
            svg,
            "<g transform=\"translate({x} {y})\"><text x=\"{}\" y=\"14\" text-anchor=\"middle\">{title}</text>\n{body}</g>",
            PANEL / 2.0
        );
    }
    svg.push_str("</svg>\n");
    svg
}

/// True displacements of the search nodes (black) and found ones (red), in the plane of the back, one panel a
/// step-one variant; the greatest true one is drawn 40 px long, longer ones than three times that are cut.
fn displacements(study: &Study, truth: &[f64], shown: &[&Trial]) -> String {
    let places = positions(study);
    let greatest = truth.iter().fold(f64::MIN_POSITIVE, |a, &b| a.max(b.abs()));
    let arrow = |u: &[f64], j: usize, colour: &str, width: f64| {
        let length = (u[3 * j + 1].powi(2) + u[3 * j + 2].powi(2)).sqrt();
        let scale = 40.0 / greatest * (3.0 * greatest / length.max(f64::MIN_POSITIVE)).min(1.0);
        let [x, y] = places[j];
        // The displacement into the depth (y) is drawn to the right, the one upward (z) upward.
        format!(
            "<line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>\n",
            x + scale * u[3 * j + 1],
            y - scale * u[3 * j + 2]
        )
    };
    let panels: Vec<(String, String)> = shown
        .iter()
        .filter(|t| !matches!(t.method, Method::Published { step_two: StepTwo::Direct, .. }))
        .map(|t| {
            let mut body = String::new();
            for (j, [x, y]) in places.iter().enumerate() {
                let fill = if study.experiment.restrained.contains(&j) { "#d6336c" } else { "#bbb" };
                let _ = writeln!(body, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{fill}\"/>");
                body.push_str(&arrow(truth, j, "black", 2.5));
                body.push_str(&arrow(&t.search_m, j, "#e03131", 1.2));
            }
            let name = t.method.name().replace(" + l1", "");
            let note = if t.converged { "" } else { " (not converged)" };
            (format!("{name}{note}: Φ½ = {:.3} m", t.phi_half_m), body)
        })
        .collect();
    let caption =
        "Search displacements, true (black) and found (red): depth to the right, up upward; pink: restrained";
    sheet(&panels, caption)
}

/// Error of the stiffness on every search node, one panel a method; pink rings mark the restrained nodes.
fn stiffness(study: &Study, true_n_per_m: f64, shown: &[&Trial]) -> String {
    let places = positions(study);
    let panels: Vec<(String, String)> = shown
        .iter()
        .map(|t| {
            let mut body = String::new();
            for (j, [x, y]) in places.iter().enumerate() {
                let restrained = study.experiment.restrained.contains(&j);
                let error = t.stiffness_n_per_m[j] - if restrained { true_n_per_m } else { 0.0 };
                // Blue for too soft, red for too stiff, full colour at twice the true spring.
                let depth = (error.abs() / (2.0 * true_n_per_m)).min(1.0);
                let fade = (255.0 * (1.0 - depth)).round();
                let fill = if error > 0.0 { format!("rgb(255,{fade},{fade})") } else { format!("rgb({fade},{fade},255)") };
                let ring = if restrained { "#d6336c" } else { "#999" };
                let _ = writeln!(
                    body,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"11\" fill=\"{fill}\" stroke=\"{ring}\" stroke-width=\"2\"/>\
                     <text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"7\" text-anchor=\"middle\">{}</text>",
                    y + 2.5,
                    number(error)
                );
            }
            (format!("{}: ϒ = {} N/m", t.method.name(), number(t.upsilon_n_per_m)), body)
        })
        .collect();
    sheet(
        &panels,
        "Stiffness error ΔK (N/m) on the search nodes, seen on the back; pink rings: restrained nodes",
    )
}
