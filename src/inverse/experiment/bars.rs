//! What the default estimate has to reach on the block, and whether it does: errors over the Cramér–Rao bound, and
//! beside the published method's on the same data.

use super::{BlockExperiment, Method, Restraint, StepTwo, Study, Summary};

/// A root mean square error, or a median one, this many times the bound counts as at the bound.
pub const AT_BOUND: f64 = 1.15;
/// The noise level (dB) at which the root mean square error has to be at the bound.
pub const EFFICIENT_DB: f64 = 40.0;
/// The share of the published method's median error that is enough, wherever the bound is.
pub const OF_PUBLISHED: f64 = 1.0 / 3.0;
/// A median error below this share of what is sought is none: iterations stop before.
const NOTHING: f64 = 1e-6;

/// The default estimate at one noise level: of the modulus, then of the springs.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// What restrained the ten nodes.
    pub restraint: Restraint,
    /// Signal-to-noise ratio (dB).
    pub snr_db: f64,
    /// Data sets.
    pub trials: usize,
    /// Root mean square error of E and ϒ over the bound; none without noise, nor of the total of held nodes.
    pub rms_over_bound: [Option<f64>; 2],
    /// The same of the published method (energy, l1).
    pub published_over_bound: [Option<f64>; 2],
    /// Median error of E and Γ over the published method's; none of the springs of held nodes.
    pub median_over_published: [Option<f64>; 2],
    /// Median error of E and Γ over the bound. Normal errors at the bound have 0.67.
    pub median_over_bound: [Option<f64>; 2],
    /// Whether the root mean square errors are at the bound, where that is asked for.
    pub efficient: Option<bool>,
    /// Whether the median errors are a third of the published method's or at the bound, where that is asked for.
    pub better: Option<bool>,
}

/// One bar a restraint and level that both the default and the published method have been tried at. Nothing is asked
/// for where the data come from another mesh, nor efficiency of springs that differ: the published ones are alike.
pub fn bars(study: &Study, summaries: &[Summary]) -> Vec<Bar> {
    let asked = !study.settings.finer_data;
    summaries
        .iter()
        .filter(|s| s.method == Method::Default)
        .filter_map(|s| bar(s, summaries, asked))
        .collect()
}

fn bar(default: &Summary, summaries: &[Summary], asked: bool) -> Option<Bar> {
    let step_two = match default.restraint {
        Restraint::Fixed => StepTwo::Skipped,
        Restraint::Springs(_) | Restraint::Unequal(_) => StepTwo::L1,
    };
    let method = Method::Published { regularisation: 0, step_two };
    let published = summaries
        .iter()
        .find(|p| (p.restraint, p.snr_db, p.method) == (default.restraint, default.snr_db, method))?;
    let sought = match default.restraint {
        Restraint::Fixed => [BlockExperiment::YOUNG_MODULUS_PA, f64::INFINITY],
        Restraint::Springs(k) | Restraint::Unequal(k) => {
            [BlockExperiment::YOUNG_MODULUS_PA, k * default.restrained_nodes as f64]
        }
    };
    let over = |values: [f64; 2], by: [Option<f64>; 2]| {
        [0, 1].map(|i| by[i].map(|by| values[i] / by).filter(|ratio| !ratio.is_nan()))
    };
    let springs = step_two != StepTwo::Skipped;
    let of_published = [Some(published.median_error[0]), springs.then_some(published.median_error[1])];
    let bar = Bar {
        restraint: default.restraint,
        snr_db: default.snr_db,
        trials: default.trials,
        rms_over_bound: over(default.rms_error, default.bound),
        published_over_bound: over(published.rms_error, default.bound),
        median_over_published: over(default.median_error, of_published),
        median_over_bound: over(default.median_error, default.bound),
        efficient: None,
        better: None,
    };
    let within = |ratio: Option<f64>, limit: f64| ratio.is_some_and(|r| r <= limit);
    let efficient =
        asked && default.snr_db == EFFICIENT_DB && !matches!(default.restraint, Restraint::Unequal(_));
    let better = (0..if springs { 2 } else { 1 }).all(|i| {
        within(bar.median_over_published[i], OF_PUBLISHED)
            || within(bar.median_over_bound[i], AT_BOUND)
            || default.median_error[i] <= NOTHING * sought[i]
    });
    Some(Bar {
        efficient: efficient.then(|| bar.rms_over_bound.iter().flatten().all(|r| *r <= AT_BOUND)),
        better: asked.then_some(better),
        ..bar
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inverse::experiment::Spread;

    fn summary(method: Method, snr_db: f64, median: [f64; 2], rms: [f64; 2], bound: Option<f64>) -> Summary {
        let none = Spread { quartiles: [0.0; 3] };
        Summary {
            restraint: Restraint::Springs(500.0),
            snr_db,
            method,
            trials: 200,
            converged: 200,
            restrained_nodes: 10,
            young_modulus_pa: none,
            psi_half_m: none,
            phi_half_m: none,
            gamma_n_per_m: none,
            upsilon_n_per_m: none,
            median_error: median,
            rms_error: rms,
            bound: [bound; 2],
        }
    }

    fn judged(snr_db: f64, beside: [f64; 2], median: [f64; 2], rms: [f64; 2], bound: Option<f64>) -> Bar {
        let published = Method::Published { regularisation: 0, step_two: StepTwo::L1 };
        let all = [
            summary(published, snr_db, beside, [40.0, 400.0], bound),
            summary(Method::Default, snr_db, median, rms, bound),
        ];
        bar(&all[1], &all, true).expect("both methods")
    }

    #[test]
    fn efficiency_is_asked_for_at_forty_decibels_only_and_needs_both() {
        let efficient = |snr_db, rms| judged(snr_db, [30.0, 300.0], [1.0; 2], rms, Some(10.0)).efficient;
        assert_eq!(efficient(40.0, [10.0, 11.4]), Some(true));
        assert_eq!(efficient(40.0, [10.0, 11.6]), Some(false));
        assert_eq!(efficient(30.0, [99.0; 2]), None);
    }

    #[test]
    fn a_third_of_the_published_error_or_the_bound_is_enough_for_each_of_the_two() {
        let better = |beside, median, bound| judged(30.0, beside, median, [0.0; 2], bound).better;
        assert_eq!(better([30.0, 300.0], [10.0, 100.0], Some(1.0)), Some(true));
        assert_eq!(better([30.0, 300.0], [10.1, 100.0], Some(1.0)), Some(false));
        assert_eq!(better([30.0, 300.0], [20.0, 20.0], Some(18.0)), Some(true));
        assert_eq!(better([30.0, 300.0], [10.0, 101.0], None), Some(false));
        // Without noise both stop short of rounding: a ratio of two such errors says nothing.
        assert_eq!(better([1e-9, 300.0], [1e-4, 1.0], None), Some(true));
        assert_eq!(better([1e-9, 300.0], [1.0, 1.0], None), Some(false));
    }
}
