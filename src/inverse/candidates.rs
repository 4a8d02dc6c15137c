//! Places where restraint may act, and what weak springs at each would explain.

use super::error::InverseError;
use super::forward::{Change, Forward, NewDisc};
use super::problem::{Linearised, Problem};
use crate::fem::Spot;
use crate::geometry::Vec3;
use nalgebra::DMatrix;
use rayon::prelude::*;

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
            for response in problem.bench.tip_responses() {
                let under = response.at(&spot);
                tip.push(under.columns(0, response.seen()).transpose());
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
    // Candidates are not corrected: their part is judged among compliances that are not either.
    let blocks = problem.bench.blocks(&at.mounted.discs);
    let Some(forward) = Forward::new(&blocks, &at.mounted.groups, at.state.modulus, problem.evidence.driven)
    else {
        return Ok(None);
    };
    let absorbed = at.jacobian.clone().qr().q();
    let left = &at.residual - &absorbed * (absorbed.transpose() * &at.residual);
    let gains: Vec<f64> = candidates
        .par_iter()
        .map(|candidate| {
            let mut discs = DMatrix::zeros(3 * at.mounted.discs.len(), 3);
            for (d, disc) in at.mounted.discs.iter().enumerate() {
                discs.rows_mut(3 * d, 3).copy_from(&disc.response.at(&candidate.spot).transpose());
            }
            let new = NewDisc {
                tip: candidate.tip.clone(),
                under_tip: candidate.under_tip.clone(),
                markers: candidate.markers.clone(),
                discs,
                weight: candidate.weight.clone(),
            };
            let Some(derivative) = forward.derivative(&Change::NewDisc(&new)) else { return 0.0 };
            let sensitivity = problem.whitening.sensitivity(&derivative);
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
