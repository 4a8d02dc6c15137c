//! What another linear body changes in the compliance: elements that hold everything, with and without the change.
//!
//! The near field of an altered body is not known, so elements have to hold it. What they get wrong in both bodies alike
//! drops out of the difference, which is added to the accurate compliance of the baseline. Meshes are graded to the tips
//! and holds of the session, the end of the glue, and to balls and rims of the alteration.
//!
//! Where the base is altered the glue is a foundation: traction = −k u on the underside, k so large that it gives by less
//! than 10⁻⁴ of a box's own deformation, or the k of a compliant base, or none where it has let go. Sound glue holds whole
//! faces of boxes, and seems to reach further than it does by a share of them ([`GLUE_OVERREACH`]), at its end and at the
//! rim of what has let go alike; so it ends, and is let go, earlier by that share.

use super::condensed::support_rows;
use super::phantom::PhantomPlan;
use super::plan::{Hold, World};
use crate::geometry::Vec3;
use crate::sim::SimError;
use crate::sim::hex_mesh::{Feature, Grading, HexMesh, Place, Slab};
use crate::sim::legendre::gauss_legendre;
use crate::sim::linear::{Compliance, analyse, pattern, seen, unit_loads};
use crate::sim::quadratic::{NODES, gradient, shape};
use crate::sim::resolution::GLUE_OVERREACH;
use crate::sim::supports::Shape;
use crate::sim::unknowns::{Row, Unknowns};
use crate::sparse::{Analysis, SymmetricMatrix};
use std::collections::HashMap;

/// Boxes far from everything (m), at the end of the glue, and at the rim of what has let go.
const CELL_M: f64 = 0.0084;
const GLUE_END_M: f64 = 0.0045;
const LOOSE_RIM_M: f64 = 0.0011;
/// Boxes at the rims of tips, patches and spots and on a ball, in their radii.
const TIP_SHARE: f64 = 0.55;
const PATCH_SHARE: f64 = 0.9;
const SPOT_SHARE: f64 = 0.5;
const BALL_SHARE: f64 = 0.5;
/// How much longer boxes may be per distance from these.
const GROWTH: f64 = 0.8;
const HALVINGS: u32 = 3;
/// Foundation of sound glue at E = 1 Pa (1/m): a box of 2 mm deforms 2·10⁴ times as much under the same traction.
const SOUND: f64 = 1e7;
/// Points along each edge of a box: within a smooth body, where a ball's surface cuts through, on the base.
const SMOOTH: usize = 3;
const CUT: usize = 4;
const BASE: usize = 4;

/// How a body differs from a uniform, isotropic one on sound glue.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Alteration {
    /// Axes (unit) with c.
    pub(super) axes: Vec<(Vec3, f64)>,
    /// Balls: centre, radius (m), modulus ratio.
    pub(super) balls: Vec<(Vec3, f64, f64)>,
    /// Relative slope of the modulus along z, about half the height (1/m).
    pub(super) gradient_per_m: f64,
    /// Foundation of the glue at E = 1 Pa (1/m).
    pub(super) foundation: Option<f64>,
    /// Discs of the glue that have let go: centre, radius (m).
    pub(super) loose: Vec<([f64; 2], f64)>,
}

/// One body at E = 1 Pa on one mesh.
struct Solid<'a> {
    slab: &'a Slab,
    poisson_ratio: f64,
    alteration: &'a Alteration,
}

/// Compliance of the altered body less that of the uniform one, for the tips, springs and spots of `world` and the points of its phantom
/// that are watched (m).
pub(super) fn difference(
    world: &World,
    alteration: &Alteration,
    watched: &[[f64; 3]],
) -> Result<Compliance, SimError> {
    difference_at(world, alteration, watched, 1.0)
}

/// The same with all boxes `scale` times as long.
fn difference_at(
    world: &World,
    alteration: &Alteration,
    watched: &[[f64; 3]],
    scale: f64,
) -> Result<Compliance, SimError> {
    let plan = session_plan(world);
    let unknowns = mesh(&plan, alteration, scale)?;
    let rows = support_rows(&plan.discs()?, &unknowns);
    let watched: Vec<Row> = watched.iter().map(|&p| unknowns.row_at(p)).collect();
    let analysis = analyse(&unknowns, &pattern(&unknowns))?;
    let solve = |alteration: &Alteration| {
        let solid = Solid { slab: &plan.slab, poisson_ratio: plan.poisson_ratio, alteration };
        solid.condense(&unknowns, &analysis, &rows, &watched)
    };
    let (with, without) = (solve(alteration)?, solve(&Alteration::default())?);
    Ok(Compliance { supports: with.supports - without.supports, watched: with.watched - without.watched })
}

/// The phantom with only those places that the session uses, in the order of `condensed`.
fn session_plan(world: &World) -> PhantomPlan {
    let phantom = &world.phantom;
    let (mut patches, mut spots) = (Vec::new(), Vec::new());
    for hold in &world.holds {
        match *hold {
            Hold::Springs { patch, .. } => patches.extend(phantom.patches.get(patch)),
            Hold::Glued { spot } => spots.extend(phantom.spots.get(spot)),
        }
    }
    let sites = world.touched().into_iter().filter_map(|s| phantom.sites.get(s).copied()).collect();
    PhantomPlan { sites, patches, spots, ..phantom.clone() }
}

/// The mesh for both bodies, its boxes `scale` times as long as usual.
fn mesh(plan: &PhantomPlan, alteration: &Alteration, scale: f64) -> Result<Unknowns, SimError> {
    let end = |x| Feature { place: Place::GlueEnd { x }, cell_m: GLUE_END_M, growth: GROWTH };
    let mut features = vec![end(plan.slab.glue_end_m)];
    for (index, (patch, shape)) in plan.discs()?.into_iter().enumerate() {
        let share = match shape {
            Shape::Held => SPOT_SHARE,
            Shape::Uniform if index < plan.sites.len() => TIP_SHARE,
            Shape::Uniform => PATCH_SHARE,
        };
        features.push(patch.feature(share, GROWTH));
    }
    for &(centre, radius, _) in &alteration.balls {
        let place = Place::Ball { centre: centre.into(), radius };
        features.push(Feature { place, cell_m: BALL_SHARE * radius, growth: GROWTH });
    }
    for &([x, y], radius) in &alteration.loose {
        let place = Place::Rim { centre: [x, y, 0.0], axis: 2, radius };
        features.push(Feature { place, cell_m: LOOSE_RIM_M, growth: GROWTH });
    }
    for feature in &mut features {
        feature.cell_m *= scale;
    }
    let halvings = HALVINGS + if scale < 1.0 { 1 } else { 0 };
    let grading = Grading { cell_m: CELL_M * scale, halvings, finer_glue: None };
    let mesh = HexMesh::new(plan.slab, &features, &grading)?;
    if alteration.foundation.is_none() && alteration.loose.is_empty() {
        return Ok(Unknowns::new(mesh));
    }
    let box_m = mesh.size_at([plan.slab.glue_end_m, 0.5 * plan.slab.size_m[1], 0.0])[0];
    let glue_end_m = plan.slab.glue_end_m - GLUE_OVERREACH * box_m;
    features[0] = Feature { cell_m: scale * GLUE_END_M, ..end(glue_end_m) };
    Ok(Unknowns::unglued(HexMesh::new(Slab { glue_end_m, ..plan.slab }, &features, &grading)?))
}

/// Faces of boxes on the underside (index of the element) that have let go with a disc: those nearest to its centre, as
/// many as have its area, its radius made larger by what glue seems to reach further.
fn let_go(unknowns: &Unknowns, centre: [f64; 2], radius: f64) -> Vec<usize> {
    let mesh = &unknowns.mesh;
    let mut faces: Vec<(f64, f64, usize)> = Vec::new();
    for (index, element) in unknowns.elements.iter().enumerate() {
        let (low, high) = mesh.corners(element.cell);
        if low[2] <= 0.0 {
            let apart = (0.5 * (low[0] + high[0]) - centre[0]).hypot(0.5 * (low[1] + high[1]) - centre[1]);
            faces.push((apart, (high[0] - low[0]) * (high[1] - low[1]), index));
        }
    }
    faces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at_rim = faces.iter().min_by(|a, b| (a.0 - radius).abs().total_cmp(&(b.0 - radius).abs()));
    let reach = radius + at_rim.map_or(0.0, |face| GLUE_OVERREACH * face.1.sqrt());
    let size = mesh.slab.size_m;
    let whole = (0..2).all(|a| centre[a] >= radius && centre[a] + radius <= size[a]);
    let mut room = if whole { std::f64::consts::PI * reach * reach } else { f64::INFINITY };
    let mut loose = Vec::new();
    for (apart, area, index) in faces {
        // Where part of the disc lies outside the underside distance alone decides.
        if if whole { 0.5 * area > room } else { apart > reach } {
            break;
        }
        room -= area;
        loose.push(index);
    }
    loose
}

impl Solid<'_> {
    fn condense(
        &self,
        unknowns: &Unknowns,
        analysis: &Analysis,
        rows: &[Row],
        watched: &[Row],
    ) -> Result<Compliance, SimError> {
        let stiffness = self.assemble(unknowns)?;
        let factor = analysis.factor(&stiffness)?;
        let n = unknowns.dimension();
        let rows: Vec<&Row> = rows.iter().collect();
        let mut fields = unit_loads(&rows, n);
        factor.solve_in_place(&mut fields, 3 * rows.len())?;
        let within = seen(&rows, &fields, n);
        let watched: Vec<&Row> = watched.iter().collect();
        Ok(Compliance { supports: 0.5 * (&within + within.transpose()), watched: seen(&watched, &fields, n) })
    }

    /// The stiffness of the whole body.
    fn assemble(&self, unknowns: &Unknowns) -> Result<SymmetricMatrix, SimError> {
        let mut stiffness = SymmetricMatrix::zeros(pattern(unknowns));
        // Boxes of one shape share their stiffness; equal sizes differ by rounding, so they are compared in nm.
        let mut shapes: HashMap<[i64; 3], Vec<f64>> = HashMap::new();
        let on_foundation = unknowns.held.is_empty();
        let mut loose: Vec<usize> =
            self.alteration.loose.iter().flat_map(|&(centre, r)| let_go(unknowns, centre, r)).collect();
        loose.sort_unstable();
        for (index, element) in unknowns.elements.iter().enumerate() {
            let (low, high) = unknowns.mesh.corners(element.cell);
            let size: [f64; 3] = std::array::from_fn(|a| high[a] - low[a]);
            let mut full = match self.uniform(low, high) {
                Some(factor) => {
                    let key = size.map(|l| (l * 1e9).round() as i64);
                    let unit =
                        shapes.entry(key).or_insert_with(|| self.box_stiffness(size, SMOOTH, &|_| 1.0));
                    unit.iter().map(|k| k * factor).collect()
                }
                None => self.box_stiffness(size, CUT, &|local| {
                    self.factor(Vec3::from_fn(|a, _| low[a] + local[a] * size[a]))
                }),
            };
            if on_foundation && low[2] <= 0.0 && loose.binary_search(&index).is_err() {
                let sound = 0.5 * (low[0] + high[0]) < unknowns.mesh.slab.glue_end_m;
                self.add_foundation(low, size, sound, &mut full);
            }
            stiffness.add_element(&element.unknowns, &element.reduce(&full));
        }
        Ok(stiffness)
    }

    /// Modulus at a place, relative.
    fn factor(&self, place: Vec3) -> f64 {
        let inside = self.alteration.balls.iter().filter(|b| (place - b.0).norm() <= b.1);
        let middle = 0.5 * self.slab.size_m[2];
        inside.map(|b| b.2).product::<f64>() * (1.0 + self.alteration.gradient_per_m * (place.z - middle))
    }

    /// The modulus of a box, if it is the same everywhere in it.
    fn uniform(&self, low: [f64; 3], high: [f64; 3]) -> Option<f64> {
        let cut = self.alteration.balls.iter().any(|&(centre, radius, _)| {
            let nearest = Vec3::from_fn(|a, _| centre[a].clamp(low[a], high[a]));
            let farthest =
                Vec3::from_fn(|a, _| if centre[a] - low[a] > high[a] - centre[a] { low[a] } else { high[a] });
            (nearest - centre).norm() < radius && (farthest - centre).norm() > radius
        });
        let even = self.alteration.gradient_per_m == 0.0 && !cut;
        even.then(|| self.factor((Vec3::from(low) + Vec3::from(high)) * 0.5))
    }

    /// Stiffness of a box, 60 × 60 row by row: ∫ m(x) B ᵀ D B with m given at places in [0, 1]³ and
    /// D_ijkl = λ δᵢⱼδₖₗ + μ (δᵢₖδⱼₗ + δᵢₗδⱼₖ) + Σ c aᵢaⱼaₖaₗ.
    fn box_stiffness(&self, size: [f64; 3], points: usize, modulus: &dyn Fn([f64; 3]) -> f64) -> Vec<f64> {
        let nu = self.poisson_ratio;
        let (lambda, mu) = (nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 / (1.0 + nu));
        let gauss = gauss_legendre(points);
        let n = 3 * NODES;
        let mut stiffness = vec![0.0; n * n];
        for &(x, wx) in &gauss {
            for &(y, wy) in &gauss {
                for &(z, wz) in &gauss {
                    let slopes = gradient([x, y, z].map(|s| 2.0 * s - 1.0), size);
                    let weight = wx * wy * wz * size[0] * size[1] * size[2] * modulus([x, y, z]);
                    for (a, ga) in slopes.iter().enumerate() {
                        for (b, gb) in slopes.iter().enumerate() {
                            let dot = mu * (ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2]);
                            for i in 0..3 {
                                let row = &mut stiffness[(3 * a + i) * n + 3 * b..][..3];
                                for (j, entry) in row.iter_mut().enumerate() {
                                    let shear = if i == j { dot } else { 0.0 };
                                    *entry += weight * (lambda * ga[i] * gb[j] + mu * ga[j] * gb[i] + shear);
                                }
                            }
                        }
                    }
                    for (axis, c) in &self.alteration.axes {
                        let along = slopes.map(|g| axis.dot(&Vec3::from(g)));
                        for (a, ga) in along.iter().enumerate() {
                            for (b, gb) in along.iter().enumerate() {
                                for i in 0..3 {
                                    for j in 0..3 {
                                        stiffness[(3 * a + i) * n + 3 * b + j] +=
                                            weight * c * ga * gb * axis[i] * axis[j];
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
        stiffness
    }

    /// Adds ∫ k N Nᵀ over the glued part of a box's underside: all of it or nothing for `sound` glue, up to the true end
    /// of the glue for a base that gives.
    fn add_foundation(&self, low: [f64; 3], size: [f64; 3], sound: bool, full: &mut [f64]) {
        let gauss = gauss_legendre(BASE);
        for &(s, ws) in &gauss {
            for &(t, wt) in &gauss {
                let k = match self.alteration.foundation {
                    Some(k) if low[0] + s * size[0] <= self.slab.glue_end_m => k,
                    None if sound => SOUND,
                    _ => continue,
                };
                let values = shape([2.0 * s - 1.0, 2.0 * t - 1.0, -1.0]);
                let weight = ws * wt * size[0] * size[1] * k;
                for (a, na) in values.iter().enumerate() {
                    for (b, nb) in values.iter().enumerate() {
                        for c in 0..3 {
                            full[(3 * a + c) * 3 * NODES + 3 * b + c] += weight * na * nb;
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
