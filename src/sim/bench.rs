//! What the phantom does in each poke of a session.

use super::SimError;
use super::draw::{Draw, PokePlan};
use super::linear::condense;
use super::load_path::{Knot, LoadPath, State};
use super::resolution::Resolution;
use super::supports::Support;
use super::unknowns::Row;

/// Force and displacements of the `watched` points (m, on the surface) for each poke, small strain.
///
/// All tips and restraints share one mesh and one factorisation; pokes at one place differ by their depth only.
pub(super) fn linear_paths(
    draw: &Draw,
    watched: &[[f64; 3]],
    resolution: &Resolution,
) -> Result<Vec<LoadPath>, SimError> {
    let sites = distinct_tips(&draw.pokes);
    let unknowns = resolution.mesh(draw, &sites)?;
    let tips: Vec<Row> =
        sites.iter().map(|s| Ok(s.patch(draw)?.mean(&unknowns))).collect::<Result<_, SimError>>()?;
    let mut restraints: Vec<Support> = Vec::new();
    for restraint in &draw.restraints {
        restraints.extend(restraint.supports(&unknowns)?);
    }
    let points: Vec<Row> = watched.iter().map(|&p| unknowns.row_at(p)).collect();
    let supports: Vec<&Row> = tips.iter().chain(restraints.iter().map(|s| &s.row)).collect();
    let compliance = condense(&unknowns, draw.poisson_ratio, &supports, &points.iter().collect::<Vec<_>>())?;
    let held: Vec<(usize, &Support)> = (tips.len()..).zip(&restraints).collect();
    let responses = (0..tips.len())
        .map(|tip| compliance.respond(draw.young_modulus_pa, tip, &held))
        .collect::<Result<Vec<_>, _>>()?;
    let paths = draw.pokes.iter().map(|poke| {
        let tip = sites.iter().position(|s| same_tip(s, poke)).expect("every poke has its tip");
        let direction = nalgebra::Vector3::from(poke.direction);
        let moved = &responses[tip].watched * direction;
        let slope = State {
            force: (responses[tip].stiffness * direction).into(),
            watched: moved.as_slice().chunks_exact(3).map(|u| [u[0], u[1], u[2]]).collect(),
        };
        let knot = |depth_m: f64| Knot { depth_m, state: slope.scaled(depth_m), slope: slope.clone() };
        LoadPath::new(vec![knot(0.0), knot(poke.depth_m)])
    });
    Ok(paths.collect())
}

/// Whether two pokes put the same disc at the same place.
fn same_tip(a: &PokePlan, b: &PokePlan) -> bool {
    a.site_m == b.site_m && a.radius_m == b.radius_m
}

/// One poke for every distinct tip.
fn distinct_tips(pokes: &[PokePlan]) -> Vec<PokePlan> {
    let mut distinct: Vec<PokePlan> = Vec::new();
    for poke in pokes {
        if !distinct.iter().any(|d| same_tip(d, poke)) {
            distinct.push(*poke);
        }
    }
    distinct
}
