//! From a converged state to what is reported: deviations, bounds, what is left, and what cannot be told.

use super::candidates::Candidate;
use super::elements::{Elements, centroid_sd, discretisation_covariance};
use super::error::InverseError;
use super::evidence::Evidence;
use super::fit::Settings;
use super::forward::Forward;
use super::limit::Finer;
use super::problem::{Linearised, Parameter, Problem};
use super::restraint::Restraint;
use super::result::{Discretisation, Estimate, Fit, FitMethod, Patch, PatchKind};
use super::rows::{Left, leftovers};
use super::search::MOST_PATCHES;
use super::sway::swaying;
use super::view::poke_views;
use super::wander::zero_sd_n;
use crate::fem::{Order, disc_self_compliance};
use crate::observation::Recording;
use crate::units::{newtons_per_metre, pascals};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::sync::Arc;

/// A converged fit, before it is put into words.
pub struct Settled<'a> {
    /// What was fitted.
    pub recording: &'a Recording,
    /// How.
    pub settings: &'a Settings,
    /// What was observed.
    pub evidence: &'a Evidence,
    /// What the elements may get wrong.
    pub(super) elements: &'a Elements,
    /// The problem on the first discretisation.
    pub problem: &'a Problem<'a>,
    /// The state there, corrected to the limit of fine elements, with its Jacobian.
    pub at: &'a Linearised,
    /// The finer discretisations that it was corrected by; `None` for a quick fit.
    pub finer: Option<&'a Arc<Finer>>,
    /// Where patches were looked for.
    pub(super) places: &'a [Candidate],
}

/// A softness closer to zero than this many deviations cannot be told from glue (95 %, one-sided).
const ONE_SIDED_95: f64 = 1.645;

/// Puts a converged fit into a [`Fit`].
pub fn outcome(found: &Settled<'_>) -> Result<Fit, InverseError> {
    let (recording, settings) = (found.recording, found.settings);
    let at = found.at;
    let (prediction, residual) = (&at.prediction, &at.residual);
    let modulus = at.state.modulus;
    let freedom = residual.len().saturating_sub(at.parameters.len());
    if freedom == 0 {
        return Err(InverseError::Undetermined { why: "it holds fewer readings than there are parameters" });
    }
    let excess = (residual.norm_squared() / freedom as f64).max(1.0);
    // A step that promises P, or gained it, moves no parameter by more than √P deviations.
    let noise = at.covariance().ok_or(FLAT)? * (excess + unrest(at));
    let discretisation = discretisation_covariance(found)?;
    let modulus_error = discretisation[(0, 0)].sqrt();
    let driving = driving_covariance(found)?;
    let covariance = noise + discretisation + driving;
    let modulus_sd = modulus * covariance[(0, 0)].sqrt();
    // With no more left than noise the noise is known; otherwise it is itself estimated from what is left.
    let half = if excess > 1.0 {
        StudentsT::new(0.0, 1.0, freedom as f64).map_or(ONE_SIDED_95, |t| t.inverse_cdf(0.95))
    } else {
        ONE_SIDED_95
    };

    // Every patch with the gradient of its stiffness k = E / s in the parameters; none for glue.
    let mut patches: Vec<(Patch, Option<DVector<f64>>)> = Vec::new();
    let bound = bound(at)?;
    for (p, patch) in at.state.patches.iter().enumerate() {
        let softness_at = at.parameters.iter().position(|q| *q == Parameter::LogSoftness(p));
        let springs = softness_at.filter(|&i| !like_glue(found, patch, covariance[(i, i)].sqrt()));
        let stiffness = modulus / patch.softness;
        let gradient = springs.map(|i| {
            let mut gradient = DVector::zeros(at.parameters.len());
            gradient[0] = stiffness;
            gradient[i] = -stiffness;
            gradient
        });
        let kind = match &gradient {
            Some(gradient) => PatchKind::Springs {
                stiffness_n_per_m: Estimate {
                    value: stiffness,
                    sd: gradient.dot(&(&covariance * gradient)).sqrt(),
                },
            },
            None => PatchKind::Glued {
                stiffness_lower_bound_n_per_m: stiffness_lower_bound(found, p, residual, excess)?,
            },
        };
        let found_patch = Patch {
            kind,
            centroid_m: patch.centre,
            centroid_sd_m: centroid_sd(&at.parameters, &covariance, p),
            radius_m: patch.radius_m,
            radius_estimated: patch.glued,
            stiffness_bound_n_per_m: springs.and_then(|i| {
                let at_bound = bound.columns.iter().position(|&c| c == i)?;
                let b = &bound.covariance;
                Some(stiffness * (b[(0, 0)] + b[(at_bound, at_bound)] - 2.0 * b[(0, at_bound)]).sqrt())
            }),
        };
        patches.push((found_patch, gradient));
    }
    patches.sort_by(|a, b| stiffness(&b.0).total_cmp(&stiffness(&a.0)));
    let mut modulus_gradient = DVector::zeros(at.parameters.len());
    modulus_gradient[0] = modulus;
    let (patches, gradients): (Vec<Patch>, Vec<_>) = patches.into_iter().unzip();
    let mut gradients: Vec<DVector<f64>> = gradients.into_iter().flatten().collect();
    let total = restraint_total(&patches, &gradients, &covariance);
    gradients.insert(0, modulus_gradient);
    let correlation = correlation(&gradients, &covariance);

    let Left { residual: left, per_poke } =
        leftovers(recording, found.evidence, prediction, at.parameters.len());
    let forward = Forward::new(&at.mounted.blocks, &at.mounted.groups, modulus, found.evidence.driven)
        .ok_or(InverseError::Undetermined { why: "the compliance is not positive definite" })?;
    let pokes =
        poke_views(recording, found.evidence, found.problem, &at.mounted, &forward, prediction, &per_poke);
    let used = Discretisation {
        element: match settings.element {
            Order::P1 => "P1".to_owned(),
            Order::P2 => "P2".to_owned(),
        },
        given_nodes: recording.mesh.nodes.len(),
        given_tets: recording.mesh.tets.len(),
        degrees_of_freedom: found
            .finer
            .map_or(&*found.problem.bench, |finer| &finer.fine.bench)
            .model
            .unknowns(),
        modulus_error,
    };
    let mut fit = Fit {
        recording: recording.name.clone(),
        method: FitMethod::Default,
        young_modulus_pa: Estimate { value: modulus, sd: modulus_sd },
        young_modulus_interval90_pa: [modulus - half * modulus_sd, modulus + half * modulus_sd],
        young_modulus_bound_pa: modulus * bound.covariance[(0, 0)].sqrt(),
        young_modulus_expected_pa: recording.phantom.modulus_range_pa,
        settled: at.unsettled.is_none(),
        restraint_total_n_per_m: total,
        patches,
        correlation,
        residual: left,
        discretisation: used,
        remarks: Vec::new(),
        pokes,
    };
    fit.remarks = remarks(recording, settings, found, &fit, excess);
    Ok(fit)
}

/// What a further step promises, or the last round gained, where the fit has not come to rest.
fn unrest(at: &Linearised) -> f64 {
    at.unrest.max(at.unsettled.unwrap_or(0.0))
}

/// Whether a patch of this softness, its logarithm known to `sd`, may as well be glue.
fn like_glue(found: &Settled<'_>, patch: &Restraint, sd: f64) -> bool {
    let [_, local] = disc_self_compliance(patch.radius_m, found.problem.bench.model.poisson_ratio());
    patch.softness < local && sd * ONE_SIDED_95 >= 1.0
}

/// Covariance of the parameters from the noise of the wrench, where that drives the model.
fn driving_covariance(found: &Settled<'_>) -> Result<DMatrix<f64>, InverseError> {
    let (at, problem) = (found.at, found.problem);
    let normal = (at.jacobian.transpose() * &at.jacobian).cholesky().ok_or(FLAT)?;
    let mut covariance = DMatrix::zeros(at.parameters.len(), at.parameters.len());
    for error in problem.whitening.drive_errors(&at.prediction) {
        let moved = normal.solve(&(at.jacobian.transpose() * error));
        covariance += &moved * moved.transpose();
    }
    Ok(covariance)
}

pub(super) const FLAT: InverseError =
    InverseError::Undetermined { why: "a direction of the parameters changes no reading" };

/// The Cramér–Rao bound with the support known: places held, modulus and softness free, noise as stated.
struct Bound {
    covariance: DMatrix<f64>,
    /// Columns of the Jacobian that it covers.
    columns: Vec<usize>,
}

fn bound(at: &Linearised) -> Result<Bound, InverseError> {
    let columns: Vec<usize> = (0..at.parameters.len())
        .filter(|&i| !matches!(at.parameters[i], Parameter::Shift(..) | Parameter::LogRadius(_)))
        .collect();
    let jacobian = at.jacobian.select_columns(&columns);
    let covariance = (jacobian.transpose() * &jacobian).cholesky().ok_or(FLAT)?.inverse();
    Ok(Bound { covariance, columns })
}

/// `E` over the largest softness that the readings allow at 95 %, everything else adjusted.
fn stiffness_lower_bound(
    found: &Settled<'_>,
    patch: usize,
    residual: &DVector<f64>,
    excess: f64,
) -> Result<f64, InverseError> {
    let at = found.at;
    let own = found.problem.softness_sensitivity(at, patch)?;
    let others: Vec<usize> =
        (0..at.parameters.len()).filter(|&i| at.parameters[i] != Parameter::LogSoftness(patch)).collect();
    let absorbed = at.jacobian.select_columns(&others).qr().q();
    let alone = &own - &absorbed * (absorbed.transpose() * &own);
    let information = alone.norm_squared();
    let best = at.state.patches[patch].softness + alone.dot(residual) / information;
    let largest = best.max(0.0) + ONE_SIDED_95 * (excess / information).sqrt();
    // A group's discs share the stiffness: the group's softness is per disc.
    let discs = found.at.mounted.groups[patch].discs.len() as f64;
    Ok(at.state.modulus * discs / largest)
}

fn stiffness(patch: &Patch) -> f64 {
    match patch.kind {
        PatchKind::Springs { stiffness_n_per_m } => stiffness_n_per_m.value,
        PatchKind::Glued { stiffness_lower_bound_n_per_m } => stiffness_lower_bound_n_per_m + 1e300,
    }
}

fn restraint_total(patches: &[Patch], gradients: &[DVector<f64>], covariance: &DMatrix<f64>) -> Estimate {
    let value = patches
        .iter()
        .map(|p| match p.kind {
            PatchKind::Springs { stiffness_n_per_m } => stiffness_n_per_m.value,
            PatchKind::Glued { .. } => 0.0,
        })
        .sum::<f64>()
        .max(0.0);
    let gradient = gradients.iter().fold(DVector::zeros(covariance.nrows()), |sum, g| sum + g);
    let sd = gradient.dot(&(covariance * &gradient)).max(0.0).sqrt();
    Estimate { value, sd }
}

fn correlation(gradients: &[DVector<f64>], covariance: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let c = |a: &DVector<f64>, b: &DVector<f64>| a.dot(&(covariance * b));
    gradients
        .iter()
        .map(|a| gradients.iter().map(|b| c(a, b) / (c(a, a) * c(b, b)).sqrt()).collect())
        .collect()
}

/// What the recording cannot tell, and what a reader should know.
fn remarks(
    recording: &Recording,
    settings: &Settings,
    found: &Settled<'_>,
    fit: &Fit,
    excess: f64,
) -> Vec<String> {
    let mut remarks = Vec::new();
    let left = &fit.residual;
    if left.chi2_per_dof > left.chi2_per_dof_limit {
        let coarse = if settings.quick {
            " It may be the coarse elements: without --quick they are finer."
        } else {
            ""
        };
        remarks.push(format!(
            "χ² per degree of freedom is {:.3}, noise alone leaves at most {:.3}: the model leaves something out. \
             Modulus and restraint absorb part of it, and their deviations, widened by a factor of {:.2}, cannot \
             make up for a wrong model.{coarse}",
            left.chi2_per_dof,
            left.chi2_per_dof_limit,
            excess.sqrt()
        ));
    }
    let widened = (1.0 + unrest(found.at) / excess).sqrt();
    if found.at.unrest > 0.0 {
        let finer = if settings.quick { " Without --quick it is smoother." } else { "" };
        remarks.push(format!(
            "A further step promises to lower the misfit by {:.1}, and none does: on these elements the misfit is not \
             smooth. The deviations are widened by a factor of {:.1}.{finer}",
            found.at.unrest,
            widened
        ));
    }
    if let Some(gained) = found.at.unsettled {
        remarks.push(format!(
            "The fit has not come to rest after all its rounds, the last of which lowered the misfit by {gained:.1}: a model that \
             leaves so much out may go on for ever. The deviations are widened by a factor of {widened:.1}."
        ));
    }
    let (used, stated) = (&found.evidence.noise, &recording.noise);
    let replaced = [used.force_n != stated.force_n, used.marker_m != stated.marker_m];
    for ((channel, ratio), replaced) in
        ["force", "marker"].iter().zip(left.rest_noise_over_stated).zip(replaced)
    {
        if replaced {
            remarks.push(format!(
                "At rest the {channel} readings scatter {ratio:.2} times as much as stated; the measured noise was used."
            ));
        }
    }
    let sway = swaying(found.evidence).map(|(_, sd)| sd).fold(0.0, f64::max);
    if sway > 0.0 {
        remarks.push(format!(
            "Between pokes all markers move together, by {:.1} µm: what a poke moves them together counts for less.",
            1e6 * sway
        ));
    }
    if let Some(sd) = zero_sd_n(found.evidence) {
        remarks.push(format!(
            "Between pokes the zero of the force wanders, by {:.1} mN: the mean of a poke's force counts for less.",
            1e3 * sd.into_iter().fold(0.0, f64::max)
        ));
    }
    if fit.patches.len() >= MOST_PATCHES {
        remarks
            .push(format!("The search stopped at {MOST_PATCHES} patches: the restraint may be spread out."));
    }
    let [low, high] = recording.phantom.modulus_range_pa;
    let modulus = fit.young_modulus_pa.value;
    if !(low..=high).contains(&modulus) {
        remarks.push(format!(
            "Young's modulus, {}, lies outside the range the operator expects ({} to {}).",
            pascals(modulus),
            pascals(low),
            pascals(high)
        ));
    }
    for patch in &fit.patches {
        if let PatchKind::Glued { stiffness_lower_bound_n_per_m } = patch.kind {
            remarks.push(format!(
                "The patch at ({:.1}, {:.1}, {:.1}) mm is so stiff that the recording cannot tell it from glue: at least \
                 {} at 95 %. It is left out of the total.",
                patch.centroid_m.x * 1e3,
                patch.centroid_m.y * 1e3,
                patch.centroid_m.z * 1e3,
                newtons_per_metre(stiffness_lower_bound_n_per_m)
            ));
        }
    }
    if fit.patches.iter().any(|p| !p.radius_estimated) {
        remarks.push(format!(
            "Springs are taken to pull through patches of {:.1} mm radius: a smaller patch with stiffer springs looks \
             the same from where the markers are.",
            settings.patch_radius_m * 1e3
        ));
    }
    if fit.patches.is_empty() {
        remarks.push("No restraint on the search surface is significant.".to_owned());
    }
    if recording.stage.is_none() {
        remarks.push(
            "Without stage.csv the recorded wrench drives the model as a dead load; the modulus follows from the \
             markers alone."
                .to_owned(),
        );
    }
    remarks
}
