//! What the phantom does in each poke of a session.

use super::SimError;
use super::draw::{Draw, PokePlan};
use super::equilibrium::Loading;
use super::large_strain::LargeStrain;
use super::linear::{Compliance, condense};
use super::load_path::{Knot, LoadPath, State};
use super::near_field::NearField;
use super::neo_hookean::NeoHookean;
use super::resolution::{RemainderResolution, Resolution};
use super::supports::{Shape, Support};
use super::unknowns::Row;
use rayon::prelude::*;

/// Depth of one step at finite strain, in radii of the tip.
const STEP_SHARE: f64 = 0.15;

/// Force and displacements of the `watched` points (m, on the surface) for each poke, small strain.
///
/// All tips and restraints share the meshes and their factorisations; pokes at one place differ by their depth only.
pub(super) fn linear_paths(
    draw: &Draw,
    watched: &[[f64; 3]],
    resolution: &RemainderResolution,
) -> Result<Vec<LoadPath>, SimError> {
    let sites = distinct_tips(&draw.pokes);
    let (compliance, held) = condensed(draw, &sites, watched, resolution)?;
    let responses = (0..sites.len())
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

/// The block condensed to `sites`, the restraints and the watched points, and the restraints' supports: index among the
/// condensed ones, compliance (m/N).
pub(super) fn condensed(
    draw: &Draw,
    sites: &[PokePlan],
    watched: &[[f64; 3]],
    resolution: &RemainderResolution,
) -> Result<(Compliance, Vec<(usize, f64)>), SimError> {
    let field = |patch, shape| NearField::new(patch, shape, &draw.slab, draw.poisson_ratio);
    let mut fields: Vec<NearField> =
        sites.iter().map(|s| Ok(field(s.patch(draw)?, Shape::Uniform))).collect::<Result<_, SimError>>()?;
    let mut held = Vec::new();
    for restraint in &draw.restraints {
        fields.push(field(restraint.patch(&draw.slab)?, restraint.shape()));
        for _ in 0..restraint.shape().functions() {
            held.push((sites.len() + held.len(), restraint.compliance()));
        }
    }
    let meshes = resolution.meshes(draw.slab, &fields)?;
    let (compliance, _) = condense(&meshes, draw.poisson_ratio, &fields, watched)?;
    Ok((compliance, held))
}

/// Force and displacements of the `watched` points (m, on the surface) for each poke, finite strain.
///
/// Each tip goes down to the deepest of its pokes on a mesh of its own; tips are computed side by side.
pub(super) fn finite_paths(
    draw: &Draw,
    watched: &[[f64; 3]],
    resolution: &Resolution,
) -> Result<Vec<LoadPath>, SimError> {
    let sites = distinct_tips(&draw.pokes);
    let paths: Vec<LoadPath> =
        sites.par_iter().map(|tip| finite_path(draw, tip, watched, resolution)).collect::<Result<_, _>>()?;
    let of_tip =
        |poke: &PokePlan| sites.iter().position(|s| same_tip(s, poke)).expect("every poke has its tip");
    Ok(draw.pokes.iter().map(|poke| paths[of_tip(poke)].clone()).collect())
}

fn finite_path(
    draw: &Draw,
    tip: &PokePlan,
    watched: &[[f64; 3]],
    resolution: &Resolution,
) -> Result<LoadPath, SimError> {
    let unknowns = resolution.mesh(draw, &[*tip])?;
    let tip_rows = tip.patch(draw)?.rows(Shape::Uniform, &unknowns);
    let mut supports: Vec<Support> =
        tip_rows.into_iter().map(|row| Support { row, compliance: 0.0 }).collect();
    for restraint in &draw.restraints {
        supports.extend(restraint.supports(&unknowns)?);
    }
    let watched: Vec<Row> = watched.iter().map(|&p| unknowns.row_at(p)).collect();
    let material = NeoHookean::new(draw.young_modulus_pa, draw.poisson_ratio);
    let block = LargeStrain::new(&unknowns, material)?;
    let loading =
        Loading { block: &block, supports: &supports, watched: &watched, direction: tip.direction.into() };
    let deepest = draw.pokes.iter().filter(|p| same_tip(p, tip)).map(|p| p.depth_m).fold(0.0, f64::max);
    let steps = (deepest / (STEP_SHARE * tip.radius_m)).ceil().max(1.0) as usize;
    Ok(LoadPath::new(loading.path(deepest, steps)?))
}

/// Whether two pokes move the same disc along the same line.
fn same_tip(a: &PokePlan, b: &PokePlan) -> bool {
    a.site_m == b.site_m && a.radius_m == b.radius_m && a.direction == b.direction
}

/// One poke for every distinct tip.
pub(super) fn distinct_tips(pokes: &[PokePlan]) -> Vec<PokePlan> {
    let mut distinct: Vec<PokePlan> = Vec::new();
    for poke in pokes {
        if !distinct.iter().any(|d| same_tip(d, poke)) {
            distinct.push(*poke);
        }
    }
    distinct
}
