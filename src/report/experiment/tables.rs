//! The experiment's tables: as text with spreads and the requirements beside them, all trials and all summaries as
//! CSV.

use super::verdicts::bars_text;
use crate::inverse::experiment::{Restraint, Spread, Study, Summary, Trial, bars};
use std::fmt::Write as _;

/// What was run: the model, then the data.
pub(super) fn heading(study: &Study) -> [String; 2] {
    let (experiment, settings) = (&study.experiment, &study.settings);
    let source = match settings.finer_data {
        false => "SAME MESH: the data come from the mesh and elements of the model",
        true => "OTHER MESH: the data come from a finer mesh of second-order elements",
    };
    let model = format!(
        "{} nodes, {} tetrahedra (first order), {} observed, {} search nodes; seeds {} to {}",
        experiment.mesh.nodes.len(),
        experiment.mesh.tets.len(),
        experiment.observed.len(),
        experiment.search.len(),
        settings.first_seed,
        settings.first_seed + settings.seeds.saturating_sub(1)
    );
    [source.to_owned(), model]
}

/// The tables as text: one block a restraint, one line a level and method; then the default estimate beside the bound
/// and the published method.
pub fn experiment_text(study: &Study, summaries: &[Summary]) -> String {
    let mut text = heading(study).join("\n") + "\n";
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
    text + &bars_text(study, &bars(study, summaries))
}

pub(super) fn restraint_name(restraint: Restraint) -> String {
    match restraint {
        Restraint::Fixed => "ten nodes held".to_owned(),
        Restraint::Springs(k) => format!("ten nodes on springs of {k} N/m"),
        Restraint::Unequal(k) => format!("ten nodes on unequal springs, mean {k} N/m"),
    }
}

pub(super) fn level(snr_db: f64) -> String {
    if snr_db.is_infinite() { "none".to_owned() } else { format!("{snr_db}") }
}

pub(super) fn number(value: f64) -> String {
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

pub(super) fn trials_csv(trials: &[Trial]) -> String {
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

pub(super) fn summary_csv(summaries: &[Summary]) -> String {
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
