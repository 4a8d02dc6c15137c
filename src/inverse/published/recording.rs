//! The published method on a recording: bundle's mesh, markers and wrench in, a [`Fit`] out.
//!
//! # How several measurements are read
//! The paper pokes at one place with five forces, runs both steps on each and reports the mean. So here every poke
//! is a measurement of its own, at the instant of its largest load, and goes through both steps alone.
//! - *Modulus*: the mean over the pokes, as in the paper.
//! - *Springs*: a node's stiffness is `−f·u / |u|²` for one measurement, the least-squares spring of `f = −k u`. A
//!   recording has pokes at several places, and under some of them a node hardly moves; the mean of quotients would
//!   be ruled by those. The least-squares spring of all measurements is taken, `−Σ f·u / Σ |u|²`: the same thing for
//!   one measurement, and for several forces at one place the mean weighted by the square of the movement.
//!
//! # What is taken from elsewhere
//! Start and bounds are those of section 3.2 as far as it states them (0.1 mm); the modulus starts at the geometric
//! mean of the operator's range, the bound on displacements is the smallest extent of the body. The observation's
//! error is the noise measured at rest, one standard deviation. The tip's wrench is spread over its disc, for the
//! mesh does not follow the tip; nothing else is refined or corrected.

use super::bench::PhantomBench;
use super::gather::gather;
use super::measure::{Measurement, measurements};
use super::remarks::{PokeResult, remarks};
use super::sprung::sprung;
use super::views::views;
use super::{Start, StepOne, StepOneRules, Variant, equivalent_stiffness, reactions, search_forces};
use crate::fem::Order;
use crate::inverse::evidence::{Driven, Evidence, WEIGHT};
use crate::inverse::rows::leftovers;
use crate::inverse::{
    DRIVE, Discretisation, Estimate, Fit, FitMethod, InverseError, Prediction, SitePrediction, SolveError,
};
use crate::observation::Recording;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Fits `recording` by `variant` on elements of order `element`; `done` is
/// called after every poke.
///
/// # Errors
/// [`InverseError`]: what the model and the solvers report, and [`InverseError::Nothing`] when no poke can be
/// used. A step one that does not meet its stopping rules is no error: the fit says which.
pub fn fit_recording(
    recording: &Recording,
    variant: Variant,
    element: Order,
    done: &(dyn Fn() + Sync),
) -> Result<Fit, InverseError> {
    let evidence = Evidence::new(recording, Some(Driven::ByWrench))?;
    let measured = measurements(recording, &evidence);
    if measured.is_empty() {
        return Err(InverseError::Nothing { pokes: recording.pokes.len() });
    }
    let bench = PhantomBench::new(recording, &evidence, element)?;
    let rules = rules(recording);
    let results: Result<Vec<PokeResult>, SolveError> = measured
        .par_iter()
        .map(|m| {
            let found = both_steps(&bench, m, variant, &rules);
            done();
            found
        })
        .collect();
    let results = results?;
    let modulus = results.iter().map(|r| r.young_modulus_pa).sum::<f64>() / results.len() as f64;
    let stiffness = springs(&results);
    let held = sprung(&bench.loaded, modulus, &stiffness)?;
    let maps = (0..evidence.sites.len()).map(|site| {
        let loads = held.observed.ncols();
        let mut markers = DMatrix::zeros(held.observed.nrows(), DRIVE);
        markers.columns_mut(0, 6).copy_from(&held.observed.columns(6 * site, 6));
        markers.set_column(WEIGHT, &held.observed.column(loads - 1));
        SitePrediction { force: DMatrix::zeros(3, DRIVE), markers }
    });
    let prediction = Prediction { sites: maps.collect() };
    let carrying = stiffness.iter().filter(|k| **k != 0.0).count();
    let left = leftovers(recording, &evidence, &prediction, 1 + carrying);
    let mut residual = left.residual;
    residual.force_rms_n = f64::NAN;
    let patches = gather(&recording.mesh, "search", &bench.nodes, &stiffness);
    let unknown = |value: f64| Estimate { value, sd: f64::NAN };
    let mut fit = Fit {
        recording: recording.name.clone(),
        method: FitMethod::Published(variant),
        young_modulus_pa: unknown(modulus),
        young_modulus_interval90_pa: [f64::NAN; 2],
        young_modulus_bound_pa: f64::NAN,
        young_modulus_expected_pa: recording.phantom.modulus_range_pa,
        settled: true,
        restraint_total_n_per_m: unknown(stiffness.iter().sum()),
        correlation: vec![vec![f64::NAN; 1 + patches.len()]; 1 + patches.len()],
        patches,
        residual,
        discretisation: Discretisation {
            element: format!("{element:?}"),
            given_nodes: recording.mesh.nodes.len(),
            given_tets: recording.mesh.tets.len(),
            degrees_of_freedom: bench.model.unknowns(),
            modulus_error: f64::NAN,
        },
        remarks: Vec::new(),
        pokes: views(recording, &evidence, &bench, &measured, modulus, &held, &left.per_poke)?,
    };
    fit.remarks = remarks(recording, &fit, element, bench.nodes.len(), &results);
    Ok(fit)
}

/// Start, bounds and stopping rules for a recording.
fn rules(recording: &Recording) -> StepOneRules {
    let [low, high] = recording.phantom.modulus_range_pa;
    let nodes = &recording.mesh.nodes;
    let extent = |axis: usize| {
        let along = nodes.iter().map(|p| p[axis]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    StepOneRules {
        start: Start { young_modulus_pa: (low * high).sqrt(), ..StepOneRules::PHANTOM.start },
        bound_m: (0..3).map(extent).fold(f64::INFINITY, f64::min),
        ..StepOneRules::PHANTOM
    }
}

/// Both steps on one measurement.
fn both_steps(
    bench: &PhantomBench,
    measured: &Measurement,
    variant: Variant,
    rules: &StepOneRules,
) -> Result<PokeResult, SolveError> {
    let body = bench.under(measured);
    let one = StepOne::new(&body, variant.regularisation())?;
    let (one, converged) = match one.fit(&measured.displacement, measured.error_m, rules) {
        Ok(found) => (found, true),
        Err(SolveError::StepOne { last, .. }) => (*last, false),
        Err(e) => return Err(e),
    };
    let components = measured.displacement.len() as f64;
    let forces = match variant {
        Variant::Direct => reactions(&body, one.young_modulus_pa, &one.search_m)?,
        _ => {
            let error = measured.error_m / components.sqrt();
            search_forces(&body, one.young_modulus_pa, &measured.displacement, error)?.x
        }
    };
    Ok(PokeResult {
        poke: measured.poke,
        converged,
        steps: one.history_m2.len() - 1,
        young_modulus_pa: one.young_modulus_pa,
        psi_half_m: one.psi_m2.sqrt(),
        error_half_m: measured.error_m / (components / 3.0).sqrt(),
        at_bound: one.at_bound,
        total_n_per_m: equivalent_stiffness(&forces, &one.search_m).iter().sum(),
        forces,
        search_m: one.search_m,
    })
}

/// One stiffness a search node (N/m) from all pokes: see the head of this file.
fn springs(results: &[PokeResult]) -> Vec<f64> {
    let nodes = results.first().map_or(0, |r| r.search_m.len() / 3);
    let at = |v: &DVector<f64>, j: usize| v.fixed_rows::<3>(3 * j).into_owned();
    (0..nodes)
        .map(|j| {
            let (mut work, mut square) = (0.0, 0.0);
            for r in results {
                let (f, u) = (at(&r.forces, j), at(&r.search_m, j));
                work += f.dot(&u);
                square += u.norm_squared();
            }
            if work == 0.0 { 0.0 } else { -work / square }
        })
        .collect()
}
