//! What other programs read of a fit: the keys of `fit.json`.
//!
//! Units are in the keys (SI). The keys `format`, `recording`, `young_modulus_pa.{value, sd}`,
//! `restraint.total_n_per_m.{value, sd}`, `restraint.patches[]` and `residual.{marker_rms_m, force_rms_n,
//! chi2_per_dof}` are a contract; the others may grow. A number that the fit could not determine (not finite)
//! is `null`.

use super::ReportError;
use crate::geometry::Vec3;
use crate::inverse::{Estimate, Fit, FitMethod, Patch, PatchKind, PokeView};
use serde::Serialize;
use serde_json::{Map, Value};

/// Half-width of the two-sided 90 % interval of a normal distribution, in standard deviations: Φ⁻¹(0.95).
pub(super) const NORMAL_90: f64 = 1.644_853_626_951_472_2;

/// The 90 % interval of a normally distributed estimate that cannot be negative; not a number without a deviation.
pub(super) fn interval90(estimate: &Estimate) -> [f64; 2] {
    let half = NORMAL_90 * estimate.sd;
    if half.is_nan() {
        return [f64::NAN; 2];
    }
    [(estimate.value - half).max(0.0), estimate.value + half]
}

/// `fit.json` as a value. `settings` are those that made the fit, by name with unit.
pub fn to_json(fit: &Fit, settings: &Map<String, Value>) -> Result<Value, ReportError> {
    Ok(serde_json::to_value(FitDocument::new(fit, settings))?)
}

/// The document, in the order in which it is written.
#[derive(Serialize)]
pub(super) struct FitDocument<'a> {
    format: &'static str,
    recording: &'a str,
    method: &'static str,
    young_modulus_pa: ModulusEntry,
    restraint: RestraintEntry,
    residual: ResidualEntry,
    settled: bool,
    correlation: CorrelationEntry<'a>,
    discretisation: DiscretisationEntry<'a>,
    remarks: &'a [String],
    pokes: Vec<PokeEntry>,
    program: ProgramEntry,
    settings: &'a Map<String, Value>,
}

#[derive(Serialize)]
struct ModulusEntry {
    value: Option<f64>,
    sd: Option<f64>,
    interval90: [Option<f64>; 2],
    cramer_rao_sd: Option<f64>,
}

#[derive(Serialize)]
struct RestraintEntry {
    total_n_per_m: TotalEntry,
    patches: Vec<PatchEntry>,
}

#[derive(Serialize)]
struct TotalEntry {
    value: Option<f64>,
    sd: Option<f64>,
    interval90: [Option<f64>; 2],
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum PatchEntry {
    Springs {
        #[serde(flatten)]
        place: Place,
        stiffness_n_per_m: Option<f64>,
        sd: Option<f64>,
        interval90: [Option<f64>; 2],
        cramer_rao_sd: Option<f64>,
    },
    Glued {
        #[serde(flatten)]
        place: Place,
        stiffness_lower_bound_n_per_m: Option<f64>,
    },
}

#[derive(Serialize)]
struct Place {
    centroid_m: [Option<f64>; 3],
    centroid_sd_m: [Option<f64>; 3],
    radius_m: Option<f64>,
    radius_estimated: bool,
}

#[derive(Serialize)]
struct ResidualEntry {
    marker_rms_m: Option<f64>,
    force_rms_n: Option<f64>,
    chi2_per_dof: Option<f64>,
    chi2_per_dof_limit: Option<f64>,
    explained: bool,
    rest_noise_over_stated: RestNoiseEntry,
}

#[derive(Serialize)]
struct RestNoiseEntry {
    force: Option<f64>,
    marker: Option<f64>,
}

#[derive(Serialize)]
struct CorrelationEntry<'a> {
    of: Vec<String>,
    matrix: &'a [Vec<f64>],
}

#[derive(Serialize)]
struct DiscretisationEntry<'a> {
    element: &'a str,
    given_nodes: usize,
    given_tets: usize,
    degrees_of_freedom: usize,
    modulus_relative_error: Option<f64>,
}

#[derive(Serialize)]
struct PokeEntry {
    poke: u32,
    chi2_per_value: Option<f64>,
    deepest_s: Option<f64>,
    markers_at_deepest: usize,
}

#[derive(Serialize)]
struct ProgramEntry {
    name: &'static str,
    version: &'static str,
}

impl<'a> FitDocument<'a> {
    pub(super) fn new(fit: &'a Fit, settings: &'a Map<String, Value>) -> Self {
        let total = &fit.restraint_total_n_per_m;
        let discretisation = &fit.discretisation;
        Self {
            format: "phantom-fit/1",
            recording: &fit.recording,
            method: method_name(fit.method),
            young_modulus_pa: ModulusEntry {
                value: known(fit.young_modulus_pa.value),
                sd: known(fit.young_modulus_pa.sd),
                interval90: fit.young_modulus_interval90_pa.map(known),
                cramer_rao_sd: known(fit.young_modulus_bound_pa),
            },
            restraint: RestraintEntry {
                total_n_per_m: TotalEntry {
                    value: known(total.value),
                    sd: known(total.sd),
                    interval90: interval90(total).map(known),
                },
                patches: fit.patches.iter().map(PatchEntry::new).collect(),
            },
            residual: ResidualEntry {
                marker_rms_m: known(fit.residual.marker_rms_m),
                force_rms_n: known(fit.residual.force_rms_n),
                chi2_per_dof: known(fit.residual.chi2_per_dof),
                chi2_per_dof_limit: known(fit.residual.chi2_per_dof_limit),
                explained: fit.residual.chi2_per_dof <= fit.residual.chi2_per_dof_limit,
                rest_noise_over_stated: RestNoiseEntry {
                    force: known(fit.residual.rest_noise_over_stated[0]),
                    marker: known(fit.residual.rest_noise_over_stated[1]),
                },
            },
            settled: fit.settled,
            correlation: CorrelationEntry { of: correlated_keys(&fit.patches), matrix: &fit.correlation },
            discretisation: DiscretisationEntry {
                element: &discretisation.element,
                given_nodes: discretisation.given_nodes,
                given_tets: discretisation.given_tets,
                degrees_of_freedom: discretisation.degrees_of_freedom,
                modulus_relative_error: known(discretisation.modulus_error),
            },
            remarks: &fit.remarks,
            pokes: fit.pokes.iter().map(PokeEntry::new).collect(),
            program: ProgramEntry { name: env!("CARGO_PKG_NAME"), version: env!("CARGO_PKG_VERSION") },
            settings,
        }
    }
}

impl PatchEntry {
    fn new(patch: &Patch) -> Self {
        let place = Place {
            centroid_m: components(&patch.centroid_m),
            centroid_sd_m: components(&patch.centroid_sd_m),
            radius_m: known(patch.radius_m),
            radius_estimated: patch.radius_estimated,
        };
        match patch.kind {
            PatchKind::Springs { stiffness_n_per_m: stiffness } => Self::Springs {
                place,
                stiffness_n_per_m: known(stiffness.value),
                sd: known(stiffness.sd),
                interval90: interval90(&stiffness).map(known),
                cramer_rao_sd: patch.stiffness_bound_n_per_m.and_then(known),
            },
            PatchKind::Glued { stiffness_lower_bound_n_per_m: bound } => {
                Self::Glued { place, stiffness_lower_bound_n_per_m: known(bound) }
            }
        }
    }
}

impl PokeEntry {
    fn new(poke: &PokeView) -> Self {
        Self {
            poke: poke.number,
            chi2_per_value: known(poke.chi2_per_value),
            deepest_s: known(poke.deepest_s),
            markers_at_deepest: poke.markers.len(),
        }
    }
}

/// The name of a method in files and on the page.
pub(super) fn method_name(method: FitMethod) -> &'static str {
    match method {
        FitMethod::Default => "default",
        FitMethod::Published(variant) => variant.name(),
    }
}

/// Paths of the correlated quantities within this document, in the order of the matrix.
fn correlated_keys(patches: &[Patch]) -> Vec<String> {
    let springs = patches.iter().enumerate().filter(|(_, p)| matches!(p.kind, PatchKind::Springs { .. }));
    std::iter::once("young_modulus_pa".to_owned())
        .chain(springs.map(|(i, _)| format!("restraint.patches[{i}].stiffness_n_per_m")))
        .collect()
}

fn components(v: &Vec3) -> [Option<f64>; 3] {
    [known(v.x), known(v.y), known(v.z)]
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
