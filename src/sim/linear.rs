//! The phantom under small loads: isotropic linear elasticity, condensed to what touches and what is watched.
//!
//! For a homogeneous block the stiffness is E K₁. One factorisation of K₁ gives the compliance between all
//! supports and from them to all watched points; what then varies (modulus, spring stiffness, which tip is in
//! contact) is dense algebra on a few dozen numbers, and exact, because tips and patches pull with a fixed
//! distribution of traction.

use super::SimError;
use super::hex_mesh::{Cell, HexMesh};
use super::legendre::gauss_legendre;
use super::near_field::NearField;
use super::quadratic::{NODES, gauss_points, shape};
use super::unknowns::{Element, Row, Unknowns};
use crate::geometry::Mat3;
use crate::sparse::{Analysis, Factor, Ordering, Pattern, SymmetricMatrix};
use nalgebra::{DMatrix, Matrix3};
use std::collections::HashMap;
use std::sync::Arc;

/// Compliance of the block at E = 1 Pa; block (i, j) of three rows and columns holds the displacement along
/// each axis at i from unit forces along each axis at j.
#[derive(Debug, Clone)]
pub(super) struct Compliance {
    /// Among the supports (m/N · Pa), 3 supports × 3 supports.
    pub(super) supports: DMatrix<f64>,
    /// From the supports to the watched points, 3 points × 3 supports.
    pub(super) watched: DMatrix<f64>,
}

/// How one tip acts while it is in contact, all restraints in place.
#[derive(Debug, Clone)]
pub(super) struct TipResponse {
    /// Force of the tip on the phantom for a displacement of the tip (N/m).
    pub(super) stiffness: Matrix3<f64>,
    /// Displacement of the watched points for a displacement of the tip, 3 points × 3.
    pub(super) watched: DMatrix<f64>,
}

/// Stiffness of one box at E = 1 Pa: 60 × 60, row by row.
///
/// K[a i, b j] = ∫ λ ∂ᵢNₐ ∂ⱼN_b + μ ∂ⱼNₐ ∂ᵢN_b + μ δᵢⱼ ∇Nₐ·∇N_b, the weak form of λ tr ε 1 + 2 μ ε.
pub(super) fn element_stiffness(size: [f64; 3], poisson_ratio: f64) -> Vec<f64> {
    let lambda = poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
    let mu = 0.5 / (1.0 + poisson_ratio);
    let n = 3 * NODES;
    let mut stiffness = vec![0.0; n * n];
    for point in gauss_points(size) {
        for (a, ga) in point.gradient.iter().enumerate() {
            for (b, gb) in point.gradient.iter().enumerate() {
                let dot = ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2];
                for i in 0..3 {
                    let row = &mut stiffness[(3 * a + i) * n + 3 * b..][..3];
                    for (j, entry) in row.iter_mut().enumerate() {
                        let shear = if i == j { dot } else { 0.0 };
                        *entry += point.weight * (lambda * ga[i] * gb[j] + mu * (ga[j] * gb[i] + shear));
                    }
                }
            }
        }
    }
    stiffness
}

/// The stiffness of the block at E = 1 Pa, held by its glue.
pub(super) fn assemble(unknowns: &Unknowns, poisson_ratio: f64) -> Result<SymmetricMatrix, SimError> {
    if !(poisson_ratio > -1.0 && poisson_ratio < 0.5) {
        return Err(SimError::PoissonRatio { value: poisson_ratio });
    }
    let mut stiffness = SymmetricMatrix::zeros(pattern(unknowns));
    let mut full_of = ShapeStiffness::new(poisson_ratio);
    for element in &unknowns.elements {
        let full = full_of.of(unknowns.mesh.size(element.cell));
        stiffness.add_element(&element.unknowns, &element.reduce(full));
    }
    Ok(stiffness)
}

/// Boxes of one shape share their stiffness; equal sizes differ by rounding, so they are compared in nm.
struct ShapeStiffness {
    poisson_ratio: f64,
    shapes: HashMap<[i64; 3], Vec<f64>>,
}

impl ShapeStiffness {
    fn new(poisson_ratio: f64) -> Self {
        Self { poisson_ratio, shapes: HashMap::new() }
    }

    /// Of a box with edge lengths `size` (m).
    fn of(&mut self, size: [f64; 3]) -> &[f64] {
        let key = size.map(|l| (l * 1e9).round() as i64);
        self.shapes.entry(key).or_insert_with(|| element_stiffness(size, self.poisson_ratio))
    }
}

/// Which unknowns meet in an element.
pub(super) fn pattern(unknowns: &Unknowns) -> Arc<Pattern> {
    let elements = unknowns.elements.iter().map(|e| e.unknowns.as_slice());
    Arc::new(Pattern::from_elements(unknowns.dimension(), elements))
}

/// A good order of elimination.
pub(super) fn analyse(unknowns: &Unknowns, pattern: &Arc<Pattern>) -> Result<Analysis, SimError> {
    let position: Vec<[f64; 3]> = unknowns.position.iter().flat_map(|&p| [p; 3]).collect();
    Ok(Analysis::new(pattern, Ordering::NestedDissection { position: &position })?)
}

/// Unit forces on every row along every axis, one column each: column 3 r + c.
pub(super) fn unit_loads(rows: &[&Row], dimension: usize) -> Vec<f64> {
    let mut loads = vec![0.0; 3 * rows.len() * dimension];
    for (column, values) in loads.chunks_exact_mut(dimension).enumerate() {
        for &(node, weight) in rows[column / 3] {
            values[3 * node as usize + column % 3] = weight;
        }
    }
    loads
}

/// What rows see of displacement fields given one a column: 3 rows × columns.
pub(super) fn seen(rows: &[&Row], fields: &[f64], dimension: usize) -> DMatrix<f64> {
    let columns = fields.len() / dimension;
    DMatrix::from_fn(3 * rows.len(), columns, |i, j| {
        let field = &fields[j * dimension..][..dimension];
        rows[i / 3].iter().map(|&(node, weight)| weight * field[3 * node as usize + i % 3]).sum()
    })
}

/// The stiffness of a mesh at E = 1 Pa, factored.
pub(super) fn factored(unknowns: &Unknowns, poisson_ratio: f64) -> Result<Factor, SimError> {
    let stiffness = assemble(unknowns, poisson_ratio)?;
    Ok(analyse(unknowns, stiffness.pattern())?.factor(&stiffness)?)
}

/// Condenses the block to its supports and the watched points (m, on the surface), from two meshes that differ only
/// around the glue, where the second's boxes are half as long. Beside it the second's stiffness, factored, for other loads.
///
/// Why: the stress at the end of the glue is singular (r^(−1/2)), so what elements that do not know it get wrong is
/// of first order in the boxes there, and 2 C_fine − C_coarse is free of it (Richardson 1911). Where the glue reaches a
/// side the stress is singular too, a little less (r^(−0.4) at ν = 1/2; Williams 1952), and most of the error goes.
/// The rest of the block, the same in both, keeps its error once.
pub(super) fn condense(
    [coarse, fine]: &[Unknowns; 2],
    poisson_ratio: f64,
    supports: &[NearField],
    watched: &[[f64; 3]],
) -> Result<(Compliance, Factor), SimError> {
    let meetings = meetings(supports);
    let on = |unknowns: &Unknowns| {
        let factor = factored(unknowns, poisson_ratio)?;
        let compliance = condense_on(unknowns, &factor, poisson_ratio, supports, &meetings, watched)?;
        Ok::<_, SimError>((compliance, factor))
    };
    let (coarse, _) = on(coarse)?;
    let (fine, factor) = on(fine)?;
    let compliance = Compliance {
        supports: 2.0 * fine.supports - coarse.supports,
        watched: 2.0 * fine.watched - coarse.watched,
    };
    Ok((compliance, factor))
}

/// Condenses the block on one mesh; `meetings` are the works of all supports on all half-space fields.
///
/// The displacement under support j is U_j + v_j: U_j the half-space's (see `near_field`), v_j what the other sides S_j
/// and the glue G add, which pull with −t(U_j) and move by −U_j. With w_j the elements' field that has −U_j at the
/// nodes on the glue and zero at the others, and v_j = w_j + Σ N x_j,
///
///   K x_j = b_j, b_j = −∫_S t(U_j)·N − a(w_j, N).
///
/// The compliance is the work of support i on U_j + v_j. Betti's theorem for U_i and v_j turns the latter into work on
/// the other sides and the glue, where both are smooth:
///
///   C_ij = ∫ φᵢ U_j − ∫_{S_j} U_i·t(U_j) + ∫_G t(U_i)·U_j + bᵢᵀ x_j − ∫_{S_j} t(U_j)·w_i − ∫_{S_i} t(U_i)·w_j − a(w_i, w_j),
///
/// symmetric, and its error is the product of those of v_i and v_j.
fn condense_on(
    unknowns: &Unknowns,
    factor: &Factor,
    poisson_ratio: f64,
    supports: &[NearField],
    meetings: &DMatrix<f64>,
    watched: &[[f64; 3]],
) -> Result<Compliance, SimError> {
    let columns = meetings.ncols();
    let dimension = unknowns.dimension();
    let on_glue: Vec<DMatrix<f64>> = unknowns.held.iter().map(|&p| -displacements(supports, p)).collect();
    let lift = |element: &Element| {
        let mut nodal = DMatrix::zeros(3 * NODES, columns);
        for &(n, held, weight) in &element.held {
            nodal.rows_mut(3 * n as usize, 3).zip_apply(&on_glue[held as usize], |x, y| *x += weight * y);
        }
        nodal
    };

    let mut within = meetings.clone();
    let gauss = gauss_legendre(ON_FACE);
    // One row an unknown: what is written together lies together.
    let mut loads = DMatrix::<f64>::zeros(columns, dimension);
    let mut full_of = ShapeStiffness::new(poisson_ratio);
    for element in &unknowns.elements {
        let points = boundary_points(&unknowns.mesh, element.cell, &gauss);
        if points.is_empty() && element.held.is_empty() {
            continue;
        }
        let lifted = lift(element);
        // Forces on the 20 nodes.
        let mut force = DMatrix::<f64>::zeros(3 * NODES, columns);
        // What moves and what pulls at the quadrature points, one below the other.
        let mut moved = DMatrix::<f64>::zeros(3 * points.len(), columns);
        let mut pull = moved.clone();
        for (k, point) in points.iter().enumerate() {
            moved.rows_mut(3 * k, 3).copy_from(&displacements(supports, point.position));
            let traction = tractions(supports, point) * point.weight;
            if unknowns.mesh.slab.holds(point.position) {
                pull.rows_mut(3 * k, 3).copy_from(&traction);
                continue;
            }
            for (n, value) in point.shape.iter().enumerate() {
                force.rows_mut(3 * n, 3).zip_apply(&traction, |x, t| *x -= value * t);
            }
            pull.rows_mut(3 * k, 3).copy_from(&-traction);
        }
        // The transposed of what the formula has, as good as that once the sum is made symmetric.
        within.gemm(1.0, &pull.transpose(), &moved, 1.0);
        if !element.held.is_empty() {
            let across = lifted.transpose();
            let work = &across * &force;
            within += &work + work.transpose();
            let full = full_of.of(unknowns.mesh.size(element.cell));
            let pulled = DMatrix::from_row_slice(3 * NODES, 3 * NODES, full) * &lifted;
            within.gemm(-1.0, &across, &pulled, 1.0);
            force -= pulled;
        }
        for &(n, slot, weight) in &element.follow {
            for c in 0..3 {
                let unknown = element.unknowns[3 * slot as usize + c] as usize;
                let row = force.row(3 * n as usize + c);
                loads.column_mut(unknown).zip_apply(&row.transpose(), |x, f| *x += weight * f);
            }
        }
    }
    let mut fields = loads.transpose();
    factor.solve_in_place(fields.as_mut_slice(), columns)?;
    within.gemm(1.0, &loads, &fields, 1.0);

    let mut seen = DMatrix::zeros(3 * watched.len(), columns);
    for (w, &point) in watched.iter().enumerate() {
        let mut sum = displacements(supports, point);
        let (element, local) = unknowns.mesh.locate(point);
        let element = &unknowns.elements[element];
        let values = shape(local);
        for &(n, held, weight) in &element.held {
            sum += &on_glue[held as usize] * (weight * values[n as usize]);
        }
        for &(n, slot, weight) in &element.follow {
            let unknown = element.unknowns[3 * slot as usize] as usize;
            sum += fields.rows(unknown, 3) * (weight * values[n as usize]);
        }
        seen.rows_mut(3 * w, 3).copy_from(&sum);
    }
    Ok(Compliance { supports: 0.5 * (&within + within.transpose()), watched: seen })
}

/// Fields of all supports side by side: 3 × columns.
fn side_by_side(fields: impl Iterator<Item = Vec<Mat3>>) -> DMatrix<f64> {
    let blocks: Vec<Mat3> = fields.flatten().collect();
    DMatrix::from_fn(3, 3 * blocks.len(), |i, j| blocks[j / 3][(i, j % 3)])
}

/// U of all supports at a place: 3 × columns.
fn displacements(supports: &[NearField], point: [f64; 3]) -> DMatrix<f64> {
    side_by_side(supports.iter().map(|s| s.displacement(point)))
}

/// t(U) of all supports at a place on a side: 3 × columns. On its own side a support leaves none beside its disc, and
/// in the disc the remainder has none.
fn tractions(supports: &[NearField], point: &BoundaryPoint) -> DMatrix<f64> {
    side_by_side(supports.iter().map(|s| {
        if s.is_on(point.axis, point.outward) {
            vec![Mat3::zeros(); s.functions()]
        } else {
            s.traction(point.position, point.axis, point.outward)
        }
    }))
}

/// ∫ φᵢ U_j for all supports: columns × columns.
fn meetings(supports: &[NearField]) -> DMatrix<f64> {
    let columns = 3 * supports.iter().map(NearField::functions).sum::<usize>();
    let mut work = DMatrix::zeros(columns, columns);
    let mut first = 0;
    for support in supports {
        for (place, values) in support.places() {
            let moved = displacements(supports, place);
            for (f, value) in values.iter().enumerate() {
                work.rows_mut(first + 3 * f, 3).zip_apply(&moved, |x, u| *x += value * u);
            }
        }
        first += 3 * support.functions();
    }
    work
}

/// A quadrature point on a side of the block.
struct BoundaryPoint {
    position: [f64; 3],
    /// The side's normal: along this axis, +1 or −1.
    axis: usize,
    outward: f64,
    /// Area that it stands for (m²).
    weight: f64,
    /// Shape functions of the 20 nodes.
    shape: [f64; NODES],
}

/// Points along each edge of a box's face.
const ON_FACE: usize = 3;

/// Quadrature points on those faces of a box that are on a side of the block.
fn boundary_points(mesh: &HexMesh, cell: Cell, gauss: &[(f64, f64)]) -> Vec<BoundaryPoint> {
    let (low, high) = mesh.corners(cell);
    let mut points = Vec::new();
    for axis in 0..3 {
        let sides = [(-1.0, low[axis] <= 0.0), (1.0, high[axis] >= mesh.slab.size_m[axis])];
        for (outward, _) in sides.into_iter().filter(|s| s.1) {
            let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
            for &(s, ws) in gauss {
                for &(t, wt) in gauss {
                    let mut position = if outward < 0.0 { low } else { high };
                    let mut local = [outward; 3];
                    for (a, x) in [(p, s), (q, t)] {
                        position[a] = low[a] + x * (high[a] - low[a]);
                        local[a] = 2.0 * x - 1.0;
                    }
                    let weight = ws * wt * (high[p] - low[p]) * (high[q] - low[q]);
                    points.push(BoundaryPoint { position, axis, outward, weight, shape: shape(local) });
                }
            }
        }
    }
    points
}

impl Compliance {
    /// The response to support `tip` being moved, with every support of `held` (index among the
    /// condensed ones and compliance D, m/N) in place: (C / E + D) f = g, f the force of the supports on the phantom.
    pub(super) fn respond(
        &self,
        young_modulus_pa: f64,
        tip: usize,
        held: &[(usize, f64)],
    ) -> Result<TipResponse, SimError> {
        let active: Vec<usize> = std::iter::once(tip).chain(held.iter().map(|h| h.0)).collect();
        let column = |i: usize| 3 * active[i / 3] + i % 3;
        let n = 3 * active.len();
        let mut system =
            DMatrix::from_fn(n, n, |i, j| self.supports[(column(i), column(j))] / young_modulus_pa);
        for (h, (_, compliance)) in held.iter().enumerate() {
            for c in 3 * (h + 1)..3 * (h + 2) {
                system[(c, c)] += compliance;
            }
        }
        let mut force = DMatrix::zeros(n, 3);
        force.fill_diagonal(1.0);
        let factor = system.cholesky().ok_or(SimError::SingularSupports { supports: active.len() })?;
        factor.solve_mut(&mut force);
        let watched = DMatrix::from_fn(self.watched.nrows(), n, |i, j| self.watched[(i, column(j))]);
        Ok(TipResponse {
            stiffness: force.fixed_view::<3, 3>(0, 0).into_owned(),
            watched: watched * &force / young_modulus_pa,
        })
    }
}
