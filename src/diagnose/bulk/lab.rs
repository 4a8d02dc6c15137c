//! The unchanged body with everything that loads or sees it, ready to be changed.

use super::changes::BodyChange;
use super::exact::OfWhole;
use super::finer;
use super::first::Look;
use super::glue::Glue;
use super::own::Own;
use crate::diagnose::body::Shape;
use crate::diagnose::kept::Kept;
use crate::diagnose::{DiagnoseError, Physics};
use crate::fem::{
    Functional, Loose, Model, Space, Stiffness, barycentric_gradients, cell_stiffness, nodal_loads, readings,
};
use crate::inverse::{Bench, Mounted, Settled};
use nalgebra::DMatrix;
use std::sync::OnceLock;

/// Name of the surface that the known glue holds.
const FIXED: &str = "fixed";

/// A body in the laboratory: displacement fields of all loads on the elements alone, for a unit modulus.
///
/// Memory: one field for each component of each tip, disc and marker, 8 bytes a displacement component.
pub struct Lab<'a> {
    pub(super) model: &'a Model,
    pub(super) sites: usize,
    /// Everything loaded, three a tip and three a disc, then what is only seen, three a marker.
    pub(super) seen: Vec<Functional>,
    /// How many of them are loaded.
    pub(super) loads: usize,
    /// Fields of all of them: seen × components.
    fields: OnceLock<DMatrix<f64>>,
    /// Those of what is only seen, where they are known.
    adjoint: Vec<&'a [f64]>,
    /// Fields of the loads alone.
    pub(super) loaded: DMatrix<f64>,
    /// Nodal forces of the loads.
    pub(super) forces: DMatrix<f64>,
    /// Everything seen under everything loaded.
    pub(super) before: DMatrix<f64>,
    pub(super) glue: Glue,
    /// Tractions on the glue: seen × 3 nodes of the glue.
    pub(super) tractions: OnceLock<DMatrix<f64>>,
    pub(super) loose: OnceLock<Loose>,
    /// The unchanged stiffness, of the body as it is held and of one that nothing holds.
    pub(super) stiffness: [OnceLock<Stiffness>; 2],
    /// The loads under themselves as the baseline has them.
    pub(super) own: Own,
    pub(super) settled: Option<&'a Settled<'a>>,
    pub(super) finer: OnceLock<BodyChange>,
    pub(super) looks: OnceLock<Vec<(Physics, Vec<Look>)>>,
    /// Changes of the whole body alone.
    pub(super) whole: Kept<OfWhole, 8>,
    /// Twice the body's volume over its surface (m).
    pub(super) thickness_m: f64,
    /// Smallest and largest coordinate of the body along each axis (m).
    pub(super) extent_m: [[f64; 2]; 3],
}

impl<'a> Lab<'a> {
    /// On the first discretisation of a settled fit.
    ///
    /// # Errors
    /// [`DiagnoseError::TipNotLinear`]; what the elements refuse.
    pub fn new(settled: &'a Settled<'a>) -> Result<Self, DiagnoseError> {
        let adjoint = settled.problem.adjoint.iter().flat_map(|r| r.elements().iter().map(Vec::as_slice));
        Self::on(settled, &settled.problem.bench, &settled.at.mounted, adjoint.collect())
    }

    /// On another discretisation with the same restraint; `adjoint` are the markers' fields, where they are known.
    ///
    /// # Errors
    /// As [`Lab::new`].
    pub fn on(
        settled: &'a Settled<'a>,
        bench: &'a Bench,
        mounted: &Mounted,
        adjoint: Vec<&'a [f64]>,
    ) -> Result<Self, DiagnoseError> {
        let shapes = Shape::all(&mounted.blocks)?;
        let mut loads = Vec::new();
        let mut own = Vec::new();
        for (tip, shape) in bench.tips.iter().zip(&shapes) {
            for axis in 0..3 {
                let mut load = Functional::new();
                for (port, spot) in tip.ports().iter().enumerate() {
                    for (i, weights) in spot.weights.iter().enumerate() {
                        let size = shape.loads[(3 * port + i, axis)];
                        load.extend(weights.iter().map(|&(c, w)| (c, w * size)));
                    }
                }
                loads.push(load);
            }
            own.push(shape.compliance.clone());
        }
        for (d, disc) in mounted.discs.iter().enumerate() {
            loads.extend(disc.spot.weights.iter().cloned());
            own.push(mounted.blocks.discs_discs.view((3 * d, 3 * d), (3, 3)).into_owned());
        }
        let markers: Vec<Functional> =
            bench.markers.iter().flat_map(|marker| marker.weights.iter().cloned()).collect();
        Self::of(&bench.model, bench.tips.len(), loads, markers, adjoint, &own, Some(settled))
    }

    /// Of a model with `sites` tips and some discs, three `loads` each, and markers, three functionals each; `adjoint`
    /// are the markers' fields, where they are known, `own` what the loads of one tip or disc do under themselves.
    pub(super) fn of(
        model: &'a Model,
        sites: usize,
        loads: Vec<Functional>,
        markers: Vec<Functional>,
        adjoint: Vec<&'a [f64]>,
        own: &[DMatrix<f64>],
        settled: Option<&'a Settled<'a>>,
    ) -> Result<Self, DiagnoseError> {
        let space = model.space();
        let count = loads.len();
        let forces = nodal_loads(space, &loads);
        let solved = model.respond_to(&loads)?;
        let loaded = as_rows(solved.iter().map(Vec::as_slice), count, space.components());
        let mut seen = loads;
        seen.extend(markers);
        let before = readings(&seen, &loaded);
        let own = Own::new(&before, own);
        let extent = |axis: usize| {
            let all = space.nodes().iter().map(|p| p[axis]);
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        Ok(Self {
            model,
            sites,
            loads: count,
            fields: OnceLock::new(),
            adjoint,
            loaded,
            forces,
            before,
            glue: Glue::new(model, FIXED)?,
            tractions: OnceLock::new(),
            loose: OnceLock::new(),
            stiffness: Default::default(),
            own,
            settled,
            finer: OnceLock::new(),
            looks: OnceLock::new(),
            whole: Kept::default(),
            thickness_m: thickness_m(space),
            extent_m: [0, 1, 2].map(extent),
            seen,
        })
    }

    /// Fields of everything loaded and seen, worked out when first needed.
    pub(super) fn fields(&self) -> Result<&DMatrix<f64>, DiagnoseError> {
        if let Some(fields) = self.fields.get() {
            return Ok(fields);
        }
        let solved = match self.adjoint.is_empty() {
            true => self.model.respond_to(&self.seen[self.loads..])?,
            false => Vec::new(),
        };
        let seen = solved.iter().map(Vec::as_slice).chain(self.adjoint.iter().copied());
        let mut made = DMatrix::zeros(self.seen.len(), self.loaded.ncols());
        made.rows_mut(0, self.loads).copy_from(&self.loaded);
        made.rows_mut(self.loads, self.seen.len() - self.loads).copy_from(&as_rows(
            seen,
            self.seen.len() - self.loads,
            self.loaded.ncols(),
        ));
        Ok(self.fields.get_or_init(|| made))
    }

    /// The structure of the body without its hold, worked out when first needed.
    pub(super) fn loose(&self) -> Result<&Loose, DiagnoseError> {
        if let Some(loose) = self.loose.get() {
            return Ok(loose);
        }
        let made = self.model.loose()?;
        Ok(self.loose.get_or_init(|| made))
    }

    /// The unchanged stiffness, put together when first needed.
    pub(super) fn stiffness(&self) -> &Stiffness {
        match self.stiffness[0].get() {
            Some(known) => known,
            None => {
                let made = self.model.stiffness(|cell| self.of_cell(cell));
                self.stiffness[0].get_or_init(|| made)
            }
        }
    }

    /// As [`Lab::stiffness`], of the body that nothing holds.
    pub(super) fn loose_stiffness(&self, loose: &Loose) -> &Stiffness {
        match self.stiffness[1].get() {
            Some(known) => known,
            None => {
                let made = self.model.loose_stiffness(loose, |cell| self.of_cell(cell));
                self.stiffness[1].get_or_init(|| made)
            }
        }
    }

    fn of_cell(&self, cell: u32) -> Vec<f64> {
        cell_stiffness(self.model.space(), cell, self.model.poisson_ratio())
    }

    /// Tractions on the glue under all fields, worked out when first needed.
    pub(super) fn tractions(&self) -> Result<&DMatrix<f64>, DiagnoseError> {
        if let Some(tractions) = self.tractions.get() {
            return Ok(tractions);
        }
        let made = self.glue.tractions(self.model, &self.seen, self.fields()?)?;
        Ok(self.tractions.get_or_init(|| made))
    }

    /// What finer elements add, worked out when first needed: `None` without a recording to place things by.
    pub(super) fn finer(&self) -> Result<Option<&BodyChange>, DiagnoseError> {
        if let Some(finer) = self.finer.get() {
            return Ok(Some(finer));
        }
        let Some(settled) = self.settled else { return Ok(None) };
        let made = finer::difference(settled)?;
        Ok(Some(self.finer.get_or_init(|| made)))
    }
}

/// Twice a body's volume over its surface (m).
fn thickness_m(space: &Space) -> f64 {
    let area: f64 = (0..space.faces().len()).map(|f| space.face_triangle(f).area()).sum();
    let cells = 0..space.cells().len() as u32;
    2.0 * cells.map(|c| barycentric_gradients(&space.corners(c)).1).sum::<f64>() / area
}

/// Fields one a row.
fn as_rows<'a>(fields: impl Iterator<Item = &'a [f64]>, count: usize, components: usize) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(count, components);
    for (mut row, nodal) in all.row_iter_mut().zip(fields) {
        row.iter_mut().zip(nodal).for_each(|(x, u)| *x = *u);
    }
    all
}
