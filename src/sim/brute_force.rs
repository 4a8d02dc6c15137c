//! The linear bench without near fields, for verification: the elements hold everything, on meshes graded to the rims.

use super::SimError;
use super::bench::distinct_tips;
use super::draw::Draw;
use super::linear::{Compliance, TipResponse, factored, seen, unit_loads};
use super::resolution::Resolution;
use super::supports::Shape;
use super::unknowns::{Row, Unknowns};

/// Condenses the block to rows.
pub(super) fn condense_rows(
    unknowns: &Unknowns,
    poisson_ratio: f64,
    supports: &[&Row],
    watched: &[&Row],
) -> Result<Compliance, SimError> {
    let factor = factored(unknowns, poisson_ratio)?;
    let dimension = unknowns.dimension();
    let mut fields = unit_loads(supports, dimension);
    factor.solve_in_place(&mut fields, 3 * supports.len())?;
    let within = seen(supports, &fields, dimension);
    Ok(Compliance {
        supports: 0.5 * (&within + within.transpose()),
        watched: seen(watched, &fields, dimension),
    })
}

/// The response to each distinct tip of `draw`, all restraints in place.
pub(super) fn responses(
    draw: &Draw,
    watched: &[[f64; 3]],
    resolution: &Resolution,
) -> Result<Vec<TipResponse>, SimError> {
    let sites = distinct_tips(&draw.pokes);
    let unknowns = resolution.mesh(draw, &sites)?;
    let mut rows = Vec::new();
    for site in &sites {
        rows.extend(site.patch(draw)?.rows(Shape::Uniform, &unknowns));
    }
    let mut held = Vec::new();
    for restraint in &draw.restraints {
        for support in restraint.supports(&unknowns)? {
            held.push((rows.len(), support.compliance));
            rows.push(support.row);
        }
    }
    let points: Vec<Row> = watched.iter().map(|&p| unknowns.row_at(p)).collect();
    let (rows, points): (Vec<&Row>, Vec<&Row>) = (rows.iter().collect(), points.iter().collect());
    let compliance = condense_rows(&unknowns, draw.poisson_ratio, &rows, &points)?;
    (0..sites.len()).map(|tip| compliance.respond(draw.young_modulus_pa, tip, &held)).collect()
}
