//! Where restraint acts: patches are added where they explain most, refitted without shrinkage, and taken out
//! again when the others can do without them.
//!
//! This is the sliding form of the conditional-gradient method for sparse measures (Denoyelle, Duval, Peyré and
//! Soubies 2019): like l1 it starts from nothing and adds one place at a time, by the same score, but places
//! slide on the surface instead of sitting on its nodes, so that neither the mesh's nodes nor the shrinkage of l1
//! shows in the answer. A place is added only when it is significant after the whole search surface was looked at.

use super::error::InverseError;
use super::forward::{Change, Forward, NewDisc};
use super::problem::{Linearised, Problem, State};
use super::refit::{refit, unit};
use super::residual::Whitening;
use super::restraint::{Mounted, Restraint};
use crate::fem::{Response, Spot, disc_self_compliance};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A patch must lower the sum of squares by this much, in units of what is left per reading: it has three
/// parameters and was picked from the whole surface (a chance of about 1e-4 after some 100 independent places).
const WORTHWHILE: f64 = 30.0;

/// More patches than this mean that something else is wrong with the model.
const MOST_PATCHES: usize = 6;

/// A candidate place for restraint.
pub struct Candidate {
    /// Its disc.
    pub spot: Spot,
    /// Its centre (m).
    pub centre: Vec3,
    /// Compliance with tips and markers: what [`NewDisc`] needs besides the discs already there.
    tip: Vec<DMatrix<f64>>,
    under_tip: Vec<DMatrix<f64>>,
    markers: DMatrix<f64>,
    weight: DMatrix<f64>,
}

/// Candidate discs of `radius_m` about `spacing_m` apart on the search surface, wholly on the body.
pub fn candidates(
    problem: &Problem<'_>,
    radius_m: f64,
    spacing_m: f64,
) -> Result<Vec<Candidate>, InverseError> {
    let space = problem.bench.model.space();
    let mut centres: Vec<Vec3> = Vec::new();
    for &face in &problem.search {
        let triangle = space.face_triangle(face);
        // Corners, edge midpoints and centroid of every face, thinned to the spacing.
        for l in [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.5],
            [0.5, 0.0, 0.5],
        ]
        .into_iter()
        .chain([[1.0 / 3.0; 3]])
        {
            let p = triangle.at(l);
            if centres.iter().all(|c| (c - p).norm() >= spacing_m) {
                centres.push(p);
            }
        }
    }
    let made: Result<Vec<Option<Candidate>>, InverseError> = centres
        .par_iter()
        .map(|centre| {
            let spot = Spot::disc(space, &problem.search, centre, radius_m)?;
            if !spot.wholly_on_body() {
                return Ok(None);
            }
            let mut tip = Vec::new();
            let mut under_tip = Vec::new();
            for site in 0..problem.bench.tips.len() {
                let under = problem.bench.tip_response(site).at(&spot);
                tip.push(under.columns(0, 3).transpose());
                under_tip.push(under);
            }
            let mut markers = DMatrix::zeros(3 * problem.adjoint.len(), 3);
            for (m, response) in problem.adjoint.iter().enumerate() {
                markers.rows_mut(3 * m, 3).copy_from(&response.at(&spot).transpose());
            }
            let mut weight = DMatrix::zeros(3, 1);
            if let Some(nodal) = problem.bench.weight_field() {
                weight.column_mut(0).copy_from(&spot.of(nodal));
            }
            Ok(Some(Candidate { centre: *centre, spot, tip, under_tip, markers, weight }))
        })
        .collect();
    Ok(made?.into_iter().flatten().collect())
}

/// The best candidate after what modulus and patches can absorb: its index and the promised gain.
pub(super) fn best_candidate(
    problem: &Problem<'_>,
    at: &Linearised,
    candidates: &[Candidate],
) -> Result<Option<(usize, f64)>, InverseError> {
    let Some(forward) =
        Forward::new(&at.mounted.blocks, &at.mounted.groups, at.state.modulus, problem.evidence.driven)
    else {
        return Ok(None);
    };
    let whitening = Whitening::new(problem.evidence, &at.prediction);
    let absorbed = at.jacobian.clone().qr().q();
    let left = &at.residual - &absorbed * (absorbed.transpose() * &at.residual);
    let gains: Vec<f64> = candidates
        .par_iter()
        .map(|candidate| {
            let mut discs = DMatrix::zeros(3 * at.mounted.discs.len(), 3);
            for (d, response) in at.mounted.responses.iter().enumerate() {
                discs.rows_mut(3 * d, 3).copy_from(&response.at(&candidate.spot).transpose());
            }
            let new = NewDisc {
                tip: candidate.tip.clone(),
                under_tip: candidate.under_tip.clone(),
                markers: candidate.markers.clone(),
                discs,
                weight: candidate.weight.clone(),
            };
            let Some(derivative) = forward.derivative(&Change::NewDisc(&new)) else { return 0.0 };
            let sensitivity = whitening.sensitivity(&derivative);
            let own = &sensitivity - &absorbed * (absorbed.transpose() * &sensitivity);
            let along = own.dot(&left);
            if along > 0.0 && own.norm_squared() > 1e-12 * sensitivity.norm_squared() {
                along * along / own.norm_squared()
            } else {
                0.0
            }
        })
        .collect();
    Ok(gains
        .iter()
        .enumerate()
        .filter(|(_, g)| **g > 0.0)
        .max_by(|a, b| a.1.total_cmp(b.1))
        .map(|(i, g)| (i, *g)))
}

/// Finds modulus and patches from nothing.
pub fn search(
    problem: &Problem<'_>,
    start_modulus: f64,
    patch_radius_m: f64,
    candidates: &[Candidate],
    mut tell: impl FnMut(&Linearised),
) -> Result<Linearised, InverseError> {
    let mut at = refit(problem, &State { modulus: start_modulus, patches: Vec::new() })?;
    tell(&at);
    while at.state.patches.len() < MOST_PATCHES {
        let Some((best, promised)) = best_candidate(problem, &at, candidates)? else { break };
        if promised < WORTHWHILE * unit(&at) {
            break;
        }
        let grown = with_patch(problem, &at, candidates[best].centre, patch_radius_m)?;
        // A patch that explains nothing wanders: it is given up, not waited for.
        let grown = match refit(problem, &grown) {
            Err(InverseError::NotConverged { .. }) => break,
            other => other?,
        };
        if at.chi2() - grown.chi2() < WORTHWHILE * unit(&grown) {
            break;
        }
        at = pruned(problem, grown)?;
        tell(&at);
    }
    Ok(at)
}

/// Adds a patch at `centre` with the softness that, of a wide range, explains most (the modulus adjusted).
fn with_patch(
    problem: &Problem<'_>,
    at: &Linearised,
    centre: Vec3,
    radius_m: f64,
) -> Result<State, InverseError> {
    let mut state = at.state.clone();
    state.patches.push(Restraint { centre, radius_m, softness: 1.0, glued: false });
    let mut mounted = Mounted::new(&problem.bench, &problem.search, &state.patches)?;
    let last = mounted.groups.len() - 1;
    let own = {
        let disc = mounted.groups[last].discs.start;
        (0..3).map(|i| mounted.blocks.discs_discs[(3 * disc + i, 3 * disc + i)]).sum::<f64>() / 3.0
    };
    let mut best = (f64::INFINITY, own, state.modulus);
    for step in -8..=8 {
        let softness = own * 10.0_f64.powf(0.25 * f64::from(step));
        mounted.groups[last].softness = softness;
        let mut modulus = at.state.modulus;
        for _ in 0..3 {
            let (residual, _) = problem.residual(&mounted, modulus)?;
            let sensitivity: DVector<f64> = problem.modulus_sensitivity(&mounted, modulus)?;
            modulus *= (sensitivity.dot(&residual) / sensitivity.norm_squared()).clamp(-0.5, 0.5).exp();
        }
        let chi2 = problem.residual(&mounted, modulus)?.0.norm_squared();
        if chi2 < best.0 {
            best = (chi2, softness, modulus);
        }
    }
    state.patches[last].softness = best.1;
    state.modulus = best.2;
    Ok(state)
}

/// Takes out, one at a time, patches that the others can do without.
fn pruned(problem: &Problem<'_>, at: Linearised) -> Result<Linearised, InverseError> {
    let mut at = at;
    loop {
        let mut without: Option<Linearised> = None;
        if at.state.patches.len() > 1 {
            for p in 0..at.state.patches.len() {
                let mut state = at.state.clone();
                state.patches.remove(p);
                let less = refit(problem, &state)?;
                if less.chi2() - at.chi2() < WORTHWHILE * unit(&at)
                    && without.as_ref().is_none_or(|w| less.chi2() < w.chi2())
                {
                    without = Some(less);
                }
            }
        }
        match without {
            Some(less) => at = less,
            None => return Ok(at),
        }
    }
}

/// Radii (m) at which a spot that may be glued is tried.
const GLUE_RADII_M: [f64; 7] = [0.003, 0.005, 0.007, 0.009, 0.012, 0.015, 0.02];

/// A patch softer than this share of the phantom's local compliance under it (the half-space's) is no glue.
const NEARLY_GLUE: f64 = 0.4;

/// Replaces stiff patches (with any that sit on the same spot) by glue, where glue explains the recording as well
/// with fewer parameters. The spot's radius is estimated.
pub(super) fn settle_glue(problem: &Problem<'_>, at: Linearised) -> Result<Linearised, InverseError> {
    let mut at = at;
    for p in 0..MOST_PATCHES {
        let Some(patch) = at.state.patches.get(p) else { break };
        let local = disc_self_compliance(patch.radius_m, problem.bench.model.poisson_ratio());
        if patch.glued || patch.softness > NEARLY_GLUE * local[1] {
            continue;
        }
        let centre = patch.centre;
        let mut best: Option<Linearised> = None;
        for radius_m in GLUE_RADII_M {
            let mut state = at.state.clone();
            state.patches.retain(|other| (other.centre - centre).norm() > radius_m + 0.5 * other.radius_m);
            state.patches.push(Restraint { centre, radius_m, softness: 0.0, glued: true });
            let Ok(tried) = refit(problem, &state) else { continue };
            if best.as_ref().is_none_or(|b| tried.chi2() < b.chi2()) {
                best = Some(tried);
            }
        }
        if let Some(glued) = best {
            let spared = at.parameters.len() as f64 - glued.parameters.len() as f64;
            if glued.chi2() - at.chi2() < (2.7 + 2.0 * spared.max(0.0)) * unit(&at) {
                at = glued;
            }
        }
    }
    Ok(at)
}

/// Responses to a force on every marker, by which their compliance with any place on the surface is known.
pub(super) fn adjoint(problem: &Problem<'_>) -> Result<Vec<Response>, InverseError> {
    Ok(problem.bench.model.respond(&problem.bench.markers.iter().collect::<Vec<_>>())?)
}
