//! The unchanged body with everything that loads or sees it, ready to be changed.

use super::changes::BodyChange;
use super::finer;
use super::glue::Glue;
use super::own::Own;
use crate::diagnose::DiagnoseError;
use crate::diagnose::body::Shape;
use crate::fem::{Functional, Loose, Model, Stiffness, cell_stiffness, nodal_loads, readings};
use crate::inverse::Settled;
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
    pub(super) fields: DMatrix<f64>,
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
}

impl<'a> Lab<'a> {
    /// On the first discretisation of a settled fit.
    ///
    /// # Errors
    /// [`DiagnoseError::TipNotLinear`]; what the elements refuse.
    pub fn new(settled: &'a Settled<'a>) -> Result<Self, DiagnoseError> {
        let (bench, mounted) = (&settled.problem.bench, &settled.at.mounted);
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
        let adjoint = settled.problem.adjoint.iter().flat_map(|r| r.elements().iter().map(Vec::as_slice));
        Self::of(&bench.model, bench.tips.len(), loads, markers, adjoint.collect(), &own, Some(settled))
    }

    /// Of a model with `sites` tips and some discs, three `loads` each, and markers, three functionals each; `adjoint`
    /// are the markers' fields, where they are known, `own` what the loads of one tip or disc do under themselves.
    pub(super) fn of(
        model: &'a Model,
        sites: usize,
        loads: Vec<Functional>,
        markers: Vec<Functional>,
        adjoint: Vec<&[f64]>,
        own: &[DMatrix<f64>],
        settled: Option<&'a Settled<'a>>,
    ) -> Result<Self, DiagnoseError> {
        let space = model.space();
        let count = loads.len();
        let forces = nodal_loads(space, &loads);
        let solved = model.respond_to(&loads)?;
        let markers_solved = if adjoint.is_empty() { model.respond_to(&markers)? } else { Vec::new() };
        let mut seen = loads;
        seen.extend(markers);
        let mut fields = DMatrix::zeros(seen.len(), space.components());
        let rows = solved.iter().chain(&markers_solved).map(Vec::as_slice).chain(adjoint);
        for (mut row, nodal) in fields.row_iter_mut().zip(rows) {
            row.iter_mut().zip(nodal).for_each(|(x, u)| *x = *u);
        }
        let loaded = fields.rows(0, count).into_owned();
        let before = readings(&seen, &loaded);
        let own = Own::new(&before, own);
        Ok(Self {
            model,
            sites,
            loads: count,
            fields,
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
            seen,
        })
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
        let made = self.glue.tractions(self.model, &self.seen, &self.fields)?;
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
