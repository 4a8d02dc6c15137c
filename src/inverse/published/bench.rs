//! The recording's phantom on its own mesh, condensed for the published method: search nodes, markers, and as
//! loads the six modes of every site's wrench and the weight.

use super::measure::Measurement;
use crate::fem::{FemError, Functional, Model, Order, Spot, wrench_loads};
use crate::inverse::condensed::node_spot;
use crate::inverse::evidence::{Drive, Evidence, WEIGHT};
use crate::inverse::{Condensed, InverseError, Loaded};
use crate::mesh::SurfaceIndex;
use crate::observation::Recording;
use nalgebra::{DMatrix, DVector};

const FIXED: &str = "fixed";
const SEARCH: &str = "search";
const OBSERVED: &str = "observed";

/// A poke enters a face whose outward normal has less than this component along its direction.
const ENTERED: f64 = -0.2;

/// The condensed phantom.
pub(super) struct PhantomBench {
    /// Its elements.
    pub(super) model: Model,
    /// Search nodes: those of the given mesh on the search surface that the known glue does not hold.
    pub(super) nodes: Vec<u32>,
    /// Compliance.
    pub(super) loaded: Loaded,
    /// Nodal forces (N) of every load: six a site, then the weight.
    loads: Vec<Vec<f64>>,
}

impl PhantomBench {
    /// Puts elements of order `element` on the mesh as it is.
    ///
    /// # Errors
    /// What the model reports; [`InverseError::Undetermined`] without search nodes.
    pub(super) fn new(
        recording: &Recording,
        evidence: &Evidence,
        element: Order,
    ) -> Result<Self, InverseError> {
        let mesh = &recording.mesh;
        let model = Model::new(mesh, element, recording.phantom.poisson_ratio, FIXED)?;
        let space = model.space();
        let held = space.on_surface(FIXED);
        let mut nodes: Vec<u32> = mesh.surface(SEARCH).as_flattened().to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|&n| !held[n as usize]);
        if nodes.is_empty() {
            return Err(InverseError::Undetermined { why: "its search surface has no node that is free" });
        }
        let places: Vec<Spot> = nodes.iter().map(|&n| node_spot(n, mesh.nodes[n as usize])).collect();
        let index = SurfaceIndex::new(mesh, mesh.surface(OBSERVED));
        let markers: Result<Vec<Spot>, FemError> = evidence
            .rest
            .iter()
            .map(|(rest, _)| Ok(Spot::marker_in(space, &index, OBSERVED, rest)?.0))
            .collect();
        let nodal = |load: &Functional| {
            let mut force = vec![0.0; space.components()];
            load.iter().for_each(|&(c, w)| force[c as usize] += w);
            force
        };
        let mut loads = Vec::new();
        for site in &evidence.sites {
            let entered: Vec<usize> = (0..space.faces().len())
                .filter(|&face| space.face_triangle(face).normal().dot(&site.direction) < ENTERED)
                .collect();
            let tip = Spot::disc(space, &entered, &site.centre, site.radius_m)?;
            loads.extend(wrench_loads(space, &tip, &site.centre)?.iter().map(nodal));
        }
        let weight = recording.phantom.gravity.filter(|g| !g.at_rest);
        let acceleration = weight.map(|g| g.acceleration_m_s2).unwrap_or_default();
        loads.push(model.body_force(&(acceleration * recording.phantom.density_kg_m3)));
        let loaded = Loaded::new(&model, &places, &markers?, &loads)?;
        Ok(Self { model, nodes, loaded, loads })
    }

    /// The share of each load in a drive at a site.
    pub(super) fn share(&self, site: usize, drive: &Drive) -> DVector<f64> {
        let mut share = DVector::zeros(self.loads.len());
        share.rows_mut(6 * site, 6).copy_from(&drive.fixed_rows::<6>(0));
        share[self.loads.len() - 1] = drive[WEIGHT];
        share
    }

    /// The body under a measurement's load, seen where it was seen.
    pub(super) fn under(&self, measurement: &Measurement) -> Condensed {
        self.loaded.under(&self.share(measurement.site, &measurement.wrench), &measurement.seen)
    }

    /// E times the displacement of every node under loads (one column of shares each) and forces at the search
    /// nodes (3 Nₛ, one column each).
    ///
    /// # Errors
    /// What the sparse solves report.
    pub(super) fn displace(
        &self,
        shares: &DMatrix<f64>,
        forces: &DMatrix<f64>,
    ) -> Result<Vec<Vec<f64>>, FemError> {
        let columns = (0..shares.ncols()).map(|c| {
            let mut total = vec![0.0; self.model.space().components()];
            for (load, share) in self.loads.iter().zip(&shares.column(c)) {
                total.iter_mut().zip(load).for_each(|(t, f)| *t += share * f);
            }
            for (j, &n) in self.nodes.iter().enumerate() {
                for i in 0..3 {
                    total[3 * n as usize + i] += forces[(3 * j + i, c)];
                }
            }
            total
        });
        self.model.displace(columns.collect())
    }
}
