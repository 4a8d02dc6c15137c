//! The phantom reduced to what acts in one session: tips, spring patches, weight and markers; glued spots eliminated.

use super::phantom::{Phantom, PhantomPlan};
use super::plan::{Hold, World};
use crate::sim::SimError;
use crate::sim::linear::{Compliance, seen};
use crate::sim::quadratic::{NODES, gauss_points};
use crate::sim::supports::{Patch, Shape};
use crate::sim::unknowns::{Row, Unknowns};
use crate::sparse::Factor;
use nalgebra::DMatrix;

/// What a load that no support carries does at E = 1 Pa: one column for each of its directions.
#[derive(Debug, Clone)]
pub(super) struct Loads {
    /// At the supports: 3 supports × columns.
    pub(super) supports: DMatrix<f64>,
    /// At the watched points: 3 points × columns.
    pub(super) watched: DMatrix<f64>,
}

/// A session's body at E = 1 Pa. Columns: tips (three a site that is poked), springs (three a hold), then weight along
/// x, y and z for a unit force per volume (N/m³).
#[derive(Debug, Clone)]
pub(super) struct SessionBody {
    /// Displacement of tips and springs.
    pub(super) supports: DMatrix<f64>,
    /// Displacement of the markers.
    pub(super) watched: DMatrix<f64>,
    /// Number of tips.
    pub(super) tips: usize,
    /// Number of spring patches.
    pub(super) springs: usize,
}

impl Loads {
    /// Displacement under a unit force per volume along each axis; `factor` is that of the stiffness at E = 1 Pa.
    ///
    /// Why on elements alone: the load is smooth, and so is its field but at the end of the glue.
    pub(super) fn weight(
        plan: &PhantomPlan,
        unknowns: &Unknowns,
        factor: &Factor,
        watched: &[[f64; 3]],
    ) -> Result<Self, SimError> {
        let n = unknowns.dimension();
        let mut fields = vec![0.0; 3 * n];
        for element in &unknowns.elements {
            let size = unknowns.mesh.size(element.cell);
            let share = shares(size);
            for &(node, slot, weight) in &element.follow {
                for c in 0..3 {
                    let unknown = element.unknowns[3 * slot as usize + c] as usize;
                    fields[c * n + unknown] += weight * share[node as usize];
                }
            }
        }
        factor.solve_in_place(&mut fields, 3)?;
        let rows = support_rows(&plan.discs()?, unknowns);
        let points: Vec<Row> = watched.iter().map(|&p| unknowns.row_at(p)).collect();
        let (rows, points): (Vec<&Row>, Vec<&Row>) = (rows.iter().collect(), points.iter().collect());
        Ok(Self { supports: seen(&rows, &fields, n), watched: seen(&points, &fields, n) })
    }
}

/// ∫ N over a box for each node (m³).
fn shares(size: [f64; 3]) -> [f64; NODES] {
    let mut share = [0.0; NODES];
    for point in gauss_points(size) {
        for (sum, value) in share.iter_mut().zip(point.shape) {
            *sum += point.weight * value;
        }
    }
    share
}

/// Rows of all support functions of `discs`.
pub(super) fn support_rows(discs: &[(Patch, Shape)], unknowns: &Unknowns) -> Vec<Row> {
    discs.iter().flat_map(|(patch, shape)| patch.rows(*shape, unknowns)).collect()
}

impl SessionBody {
    /// Picks what `world` uses from a phantom's compliance; `change` is added to it first.
    ///
    /// A glued spot does not move: with its functions g and the others k, C ← C_kk − C_kg C_gg⁻¹ C_gk, and likewise for
    /// markers and weight.
    pub(super) fn new(
        world: &World,
        phantom: &Phantom,
        change: Option<&Compliance>,
    ) -> Result<Self, SimError> {
        let sites = world.touched();
        let mut kept: Vec<usize> = sites.iter().flat_map(|&s| phantom.site_columns(s)).collect();
        let mut glued = Vec::new();
        let mut springs = 0;
        for hold in &world.holds {
            match *hold {
                Hold::Springs { patch, .. } => {
                    exists("patch", patch, phantom.plan.patches.len())?;
                    kept.extend(phantom.patch_columns(patch));
                    springs += 1;
                }
                Hold::Glued { spot } => {
                    exists("spot", spot, phantom.plan.spots.len())?;
                    glued.extend(phantom.spot_columns(spot));
                }
            }
        }
        let all: Vec<usize> = kept.iter().chain(&glued).copied().collect();
        let mut among =
            DMatrix::from_fn(all.len(), all.len(), |i, j| phantom.compliance.supports[(all[i], all[j])]);
        let mut watched = DMatrix::from_fn(phantom.compliance.watched.nrows(), all.len(), |i, j| {
            phantom.compliance.watched[(i, all[j])]
        });
        if let Some(change) = change {
            among += &change.supports;
            watched += &change.watched;
        }
        let weight = DMatrix::from_fn(all.len(), 3, |i, j| phantom.weight.supports[(all[i], j)]);
        let (k, g) = (kept.len(), glued.len());
        let mut loaded = DMatrix::zeros(k + g, k + 3);
        loaded.columns_mut(0, k).copy_from(&among.columns(0, k));
        loaded.columns_mut(k, 3).copy_from(&weight);
        let mut seen = DMatrix::zeros(watched.nrows(), k + 3);
        seen.columns_mut(0, k).copy_from(&watched.columns(0, k));
        seen.columns_mut(k, 3).copy_from(&phantom.weight.watched);
        if g > 0 {
            let own = among.view((k, k), (g, g)).into_owned();
            let factor = own.cholesky().ok_or(SimError::SingularSupports { supports: g / 3 })?;
            let pull = factor.solve(&loaded.rows(k, g).into_owned());
            seen -= watched.columns(k, g) * &pull;
            loaded = loaded.rows(0, k) - among.view((0, k), (k, g)) * pull;
        }
        Ok(Self { supports: loaded, watched: seen, tips: sites.len(), springs })
    }
}

/// Refuses an index beyond what the phantom has.
fn exists(what: &'static str, index: usize, count: usize) -> Result<(), SimError> {
    if index < count { Ok(()) } else { Err(SimError::NoSuchPlace { what, index, count }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hex_mesh::{Grading, HexMesh, Slab};
    use crate::sim::linear::factored;

    /// A block of height H that is glued all over its underside, ν = 0: under a force per volume b it settles by
    /// b (H z − z²/2)/E, at the top by b H²/2E.
    #[test]
    fn a_column_settles_under_its_weight() -> Result<(), SimError> {
        let slab = Slab { size_m: [0.03, 0.02, 0.012], glue_end_m: 0.03 };
        let plan = PhantomPlan {
            seed: 1,
            slab,
            poisson_ratio: 0.0,
            sites: Vec::new(),
            patches: Vec::new(),
            spots: Vec::new(),
            marker_spacing_m: 0.006,
        };
        let grading = Grading { cell_m: 0.005, halvings: 0, finer_glue: None };
        let unknowns = Unknowns::new(HexMesh::new(slab, &[], &grading)?);
        let points = plan.markers();
        let factor = factored(&unknowns, plan.poisson_ratio)?;
        let moved = Loads::weight(&plan, &unknowns, &factor, &points)?.watched;
        for point in 0..points.len() {
            let settled = moved[(3 * point + 2, 2)];
            assert!((settled / (0.5 * 0.012_f64.powi(2)) - 1.0).abs() < 1e-9, "{settled}");
            assert!(moved[(3 * point, 2)].abs() < 1e-9 * settled);
        }
        Ok(())
    }
}
