//! The default estimate against what is asked of it: as text, one line a restraint and level, and as CSV.

use super::tables::{level, restraint_name};
use crate::inverse::experiment::{AT_BOUND, Bar, EFFICIENT_DB, Study};
use std::fmt::Write as _;

/// The bars as text, with how surely the ratios are known.
pub(super) fn bars_text(study: &Study, bars: &[Bar]) -> String {
    let asked = match study.settings.finer_data {
        false => format!(
            "(1) at {EFFICIENT_DB} dB the root mean square errors (RMSE) of E and of the total are at most {AT_BOUND} \
             times the bound; (2) at every level the\nmedian errors of E and of Gamma are at most a third of the \
             published method's, or {AT_BOUND} times the bound."
        ),
        true => "the data come from another mesh: nothing is asked for.".to_owned(),
    };
    let spread = 100.0 / (2.0 * study.settings.seeds as f64).sqrt();
    let mut text = format!(
        "\nDefault estimate beside the Cramér–Rao bound (nodes known, springs free) and the published method \
         (energy + l1). Asked: {asked}\nRatios of an RMSE from {} seeds are known to about {spread:.0} %. A normal \
         error at the bound has a median of 0.67 times the bound. The default takes\nshort outlines and equal springs \
         for likelier, which the bound does not know: RMSE far below the bound come from there.\n",
        study.settings.seeds
    );
    let _ = writeln!(
        text,
        "{:>5} {:42} {:>15} {:>15} {:>17} {:>15} {:>5} {:>5}",
        "", "", "RMSE/bound:", "published's:", "median/published:", "median/bound:", "", ""
    );
    let _ = writeln!(
        text,
        "{:>5} {:42} {:>7} {:>7} {:>7} {:>7} {:>9} {:>7} {:>7} {:>7} {:>5} {:>5}",
        "SNR", "", "E", "total", "E", "total", "E", "Gamma", "E", "Gamma", "(1)", "(2)"
    );
    for bar in bars {
        let ratios =
            [bar.rms_over_bound, bar.published_over_bound, bar.median_over_published, bar.median_over_bound];
        let [a, b, c, d, e, f, g, h] = std::array::from_fn(|i| ratio(ratios[i / 2][i % 2]));
        let _ = writeln!(
            text,
            "{:>5} {:42} {a:>7} {b:>7} {c:>7} {d:>7} {e:>9} {f:>7} {g:>7} {h:>7} {:>5} {:>5}",
            level(bar.snr_db),
            restraint_name(bar.restraint),
            verdict(bar.efficient),
            verdict(bar.better),
        );
    }
    text
}

fn ratio(value: Option<f64>) -> String {
    match value {
        Some(v) if !v.is_finite() => "inf".to_owned(),
        Some(v) if v >= 1000.0 => format!("{v:.0e}"),
        Some(v) if v >= 100.0 => format!("{v:.0}"),
        Some(v) => format!("{v:.2}"),
        None => "-".to_owned(),
    }
}

fn verdict(met: Option<bool>) -> &'static str {
    match met {
        Some(true) => "met",
        Some(false) => "MISS",
        None => "-",
    }
}

pub(super) fn bars_csv(bars: &[Bar]) -> String {
    let mut text =
        "restraint,snr_db,trials,rmse_e_over_bound,rmse_total_over_bound,published_rmse_e_over_bound,\
                    published_rmse_total_over_bound,median_e_over_published,median_gamma_over_published,\
                    median_e_over_bound,median_gamma_over_bound,efficient,better_than_published\n"
            .to_owned();
    for bar in bars {
        let _ = write!(text, "{},{},{}", restraint_name(bar.restraint), bar.snr_db, bar.trials);
        let ratios =
            [bar.rms_over_bound, bar.published_over_bound, bar.median_over_published, bar.median_over_bound];
        for value in ratios.as_flattened() {
            let _ = write!(text, ",{}", value.map_or(String::new(), |v| format!("{v:e}")));
        }
        for met in [bar.efficient, bar.better] {
            let _ = write!(text, ",{}", met.map_or(String::new(), |m| m.to_string()));
        }
        text.push('\n');
    }
    text
}
