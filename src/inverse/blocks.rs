//! The compliance between everything that matters in a fit, condensed from the elements.
//!
//! Ports are loaded and seen: the tip at each site, and the discs through which restraint acts. Observers are
//! only seen: the markers. All blocks are for a unit Young's modulus, in the phantom frame.

use super::error::InverseError;
use super::evidence::Driven;
use super::grip::Grip;
use super::lift::Lift;
use super::placed::{Placed, Recent, dot};
use crate::fem::{Functional, Model, Response, Spot, Tip, wrench_loads};
use crate::geometry::{Mat3, Vec3};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;

/// Compliance blocks with all sites and a set of restraint discs.
#[derive(Debug, Clone, Default)]
pub struct Blocks {
    /// One entry a site.
    pub sites: Vec<SiteBlocks>,
    /// Markers under restraint discs: `3 markers × 3 discs`.
    pub markers_discs: DMatrix<f64>,
    /// Discs under discs: `3 discs × 3 discs`, symmetric.
    pub discs_discs: DMatrix<f64>,
    /// Displacement under the body's weight: markers.
    pub markers_weight: DMatrix<f64>,
    /// Displacement under the body's weight: discs.
    pub discs_weight: DMatrix<f64>,
}

/// Compliance blocks of the tip at one site. The tip is loaded by `modes` columns: a force along each axis on each of
/// its ports, or, when the wrench drives the model, the six of a wrench; it is seen through its ports.
#[derive(Debug, Clone)]
pub struct SiteBlocks {
    /// How the tip takes hold; nothing when the wrench drives the model.
    pub grip: Option<Arc<Grip>>,
    /// Tip under tip: `3 ports × modes`, what the tip does not carry itself.
    pub tip_tip: DMatrix<f64>,
    /// Markers under tip: `3 markers × modes`.
    pub markers_tip: DMatrix<f64>,
    /// Discs under tip: `3 discs × modes`.
    pub discs_tip: DMatrix<f64>,
    /// Displacement of the ports under the body's weight: `3 ports × 1`.
    pub tip_weight: DMatrix<f64>,
}

impl Blocks {
    /// Entry by entry `combine(self, other)`.
    pub fn zip(&self, other: &Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        let z = |a: &DMatrix<f64>, b: &DMatrix<f64>| a.zip_map(b, &combine);
        Self {
            sites: self
                .sites
                .iter()
                .zip(&other.sites)
                .map(|(a, b)| SiteBlocks {
                    grip: a.grip.clone(),
                    tip_tip: z(&a.tip_tip, &b.tip_tip),
                    markers_tip: z(&a.markers_tip, &b.markers_tip),
                    discs_tip: z(&a.discs_tip, &b.discs_tip),
                    tip_weight: z(&a.tip_weight, &b.tip_weight),
                })
                .collect(),
            markers_discs: z(&self.markers_discs, &other.markers_discs),
            discs_discs: z(&self.discs_discs, &other.discs_discs),
            markers_weight: z(&self.markers_weight, &other.markers_weight),
            discs_weight: z(&self.discs_weight, &other.discs_weight),
        }
    }
}

/// A model with everything observed on it, ready to be asked about restraint discs.
pub struct Bench {
    /// The elements.
    pub model: Model,
    /// The tip at each site.
    pub tips: Vec<Tip>,
    /// All markers.
    pub markers: Vec<Spot>,
    tip_responses: Vec<TipResponse>,
    /// Nodal displacement under the body's weight, when it acts.
    weight: Option<Vec<f64>>,
    /// Blocks without any restraint.
    free: Blocks,
    recent: Recent,
}

/// Response to the tip's load at one site.
pub enum TipResponse {
    /// To a unit force along each axis on each port: what the stage moves.
    Ports {
        /// How the tip takes hold.
        grip: Arc<Grip>,
        /// One a port.
        responses: Vec<Response>,
    },
    /// To a unit wrench about the site.
    Wrench {
        /// Mode by mode, as nodal displacement.
        modes: Vec<Vec<f64>>,
        /// To forces spread evenly over a disc that is wholly on the body, with the near field that elements miss under its rim and beside
        /// it, and from the site to where they act (m).
        even: Option<Box<(Response, Vec3)>>,
    },
}

impl TipResponse {
    /// Number of load modes.
    pub fn modes(&self) -> usize {
        match self {
            Self::Ports { responses, .. } => 3 * responses.len(),
            Self::Wrench { modes, .. } => modes.len(),
        }
    }

    /// Number of displacement components through which the tip is seen: the first load modes, by reciprocity.
    pub fn seen(&self) -> usize {
        match self {
            Self::Ports { responses, .. } => 3 * responses.len(),
            Self::Wrench { .. } => 3,
        }
    }

    /// How the tip takes hold; nothing when the wrench drives the model.
    pub fn grip(&self) -> Option<Arc<Grip>> {
        match self {
            Self::Ports { grip, .. } => Some(grip.clone()),
            Self::Wrench { .. } => None,
        }
    }

    /// The tip under itself: `3 ports × modes`, what it does not carry itself.
    fn own(&self, tip: &Tip) -> DMatrix<f64> {
        match self {
            Self::Ports { responses, .. } => tip.compliance(responses),
            Self::Wrench { modes, .. } => {
                let columns: Vec<Vec3> = modes.iter().map(|nodal| tip.ports()[0].of(nodal)).collect();
                DMatrix::from_fn(3, columns.len(), |i, k| columns[k][i])
            }
        }
    }

    /// Displacement of a spot: `3 × modes`.
    pub fn at(&self, spot: &Spot) -> DMatrix<f64> {
        let mut block = DMatrix::zeros(3, self.modes());
        match self {
            Self::Ports { responses, .. } => {
                for (k, response) in responses.iter().enumerate() {
                    block.columns_mut(3 * k, 3).copy_from(&response.at(spot));
                }
            }
            Self::Wrench { modes, even } => {
                for (k, nodal) in modes.iter().enumerate() {
                    block.column_mut(k).copy_from(&spot.of(nodal));
                }
                if let Some((response, arm)) = even.as_deref() {
                    forces_from(&mut block, &response.at(spot), arm);
                }
            }
        }
        block
    }

    /// Displacement of a node at `position` under load modes of these sizes, for a unit modulus.
    pub fn at_node(&self, node: usize, position: &Vec3, sizes: &DVector<f64>) -> Vec3 {
        match self {
            Self::Ports { responses, .. } => responses
                .iter()
                .enumerate()
                .map(|(k, response)| response.at_node(node, position) * sizes.fixed_rows::<3>(3 * k))
                .sum(),
            Self::Wrench { modes, even } => {
                let mut block = DMatrix::from_fn(3, modes.len(), |i, k| modes[k][3 * node + i]);
                if let Some((response, arm)) = even.as_deref() {
                    forces_from(&mut block, &response.at_node(node, position), arm);
                }
                (block * sizes).fixed_rows::<3>(0).into_owned()
            }
        }
    }

    /// Slope of a disc's displacement along `tangent`: `3 × modes`.
    pub(super) fn slope_at(&self, slope: &[Functional; 3], spot: &Spot, tangent: &Vec3) -> DMatrix<f64> {
        let mut block = DMatrix::zeros(3, self.modes());
        match self {
            Self::Ports { responses, .. } => {
                for (k, response) in responses.iter().enumerate() {
                    block.columns_mut(3 * k, 3).copy_from(&response.slope_at(slope, spot, tangent));
                }
            }
            Self::Wrench { modes, even } => {
                for (k, nodal) in modes.iter().enumerate() {
                    block.column_mut(k).copy_from(&dot(slope, nodal));
                }
                if let Some((response, arm)) = even.as_deref() {
                    forces_from(&mut block, &response.slope_at(slope, spot, tangent), arm);
                }
            }
        }
        block
    }
}

/// Replaces the columns of a wrench's forces by those of `even` forces that act at the end of `arm` (m): less the moments that these have about
/// its foot.
fn forces_from(block: &mut DMatrix<f64>, even: &Mat3, arm: &Vec3) {
    let moments: Mat3 = block.fixed_view::<3, 3>(0, 3).into_owned();
    block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(even - moments * arm.cross_matrix()));
}

impl Bench {
    /// Solves for the tips, each at its site (m) with its lift, and for the weight (N/m³), when it acts. Under a wrench
    /// the tips are pads.
    pub fn new(
        model: Model,
        tips: Vec<Tip>,
        markers: Vec<Spot>,
        sites: &[(Vec3, Lift)],
        driven: Driven,
        weight_n_m3: Option<Vec3>,
    ) -> Result<Self, InverseError> {
        let tip_responses = match driven {
            Driven::ByStage => {
                let ports: Vec<&Spot> = tips.iter().flat_map(Tip::ports).collect();
                let mut solved = model.respond(&ports)?.into_iter();
                let mut responses = Vec::with_capacity(tips.len());
                for (tip, (_, lift)) in tips.iter().zip(sites) {
                    let own: Vec<Response> = solved.by_ref().take(tip.ports().len()).collect();
                    let grip = Arc::new(Grip::new(tip.clone(), lift, &tip.compliance(&own))?);
                    responses.push(TipResponse::Ports { grip, responses: own });
                }
                responses
            }
            Driven::ByWrench => {
                let ports: Vec<&Spot> = tips.iter().map(|tip| &tip.ports()[0]).collect();
                let even = model.respond(&ports)?;
                let mut responses = Vec::with_capacity(tips.len());
                for ((port, even), (site, _)) in ports.into_iter().zip(even).zip(sites) {
                    let modes = model.respond_to(&wrench_loads(model.space(), port, site)?)?;
                    let disc = port.as_disc().filter(|_| port.wholly_on_body());
                    responses.push(TipResponse::Wrench {
                        modes,
                        even: disc.map(|(disc, _)| Box::new((even, disc.centre - site))),
                    });
                }
                responses
            }
        };
        let weight = match weight_n_m3 {
            Some(w) => model.displace(vec![model.body_force(&w)])?.pop(),
            None => None,
        };
        let (free, recent) = (Blocks::default(), Recent::default());
        let mut bench = Self { model, tips, markers, tip_responses, weight, free, recent };
        bench.free = bench.without_restraint();
        Ok(bench)
    }

    fn without_restraint(&self) -> Blocks {
        let sites = self.tips.par_iter().zip(&self.tip_responses).map(|(tip, response)| SiteBlocks {
            grip: response.grip(),
            tip_tip: response.own(tip),
            markers_tip: under_tip(&self.markers, response),
            discs_tip: DMatrix::zeros(0, response.modes()),
            tip_weight: self.sag(tip.ports()),
        });
        Blocks {
            sites: sites.collect(),
            markers_discs: DMatrix::zeros(3 * self.markers.len(), 0),
            discs_discs: DMatrix::zeros(0, 0),
            markers_weight: self.sag(&self.markers),
            discs_weight: DMatrix::zeros(0, 1),
        }
    }

    /// Displacement of spots under the body's weight; zero when it does not act.
    fn sag(&self, spots: &[Spot]) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(3 * spots.len(), 1);
        if let Some(nodal) = &self.weight {
            for (i, spot) in spots.iter().enumerate() {
                all.fixed_view_mut::<3, 1>(3 * i, 0).copy_from(&spot.of(nodal));
            }
        }
        all
    }

    /// Nodal displacement under the body's weight, when it acts.
    pub fn weight_field(&self) -> Option<&[f64]> {
        self.weight.as_deref()
    }

    /// Responses to the tips at all sites.
    pub fn tip_responses(&self) -> &[TipResponse] {
        &self.tip_responses
    }

    /// Puts restraint patches, each of some discs, on the model: all their discs in turn.
    ///
    /// # Errors
    /// What the sparse solves report.
    pub fn place(&self, patches: &[Vec<Spot>]) -> Result<Vec<Arc<Placed>>, InverseError> {
        self.recent.place(self, patches)
    }

    /// All blocks, with restraint `discs`.
    pub fn blocks(&self, discs: &[Arc<Placed>]) -> Blocks {
        let mut blocks = self.free.clone();
        for (site, (block, response)) in blocks.sites.iter_mut().zip(&self.tip_responses).enumerate() {
            block.discs_tip = DMatrix::zeros(3 * discs.len(), response.modes());
            for (d, disc) in discs.iter().enumerate() {
                block.discs_tip.rows_mut(3 * d, 3).copy_from(&disc.under_tip[site]);
            }
        }
        blocks.markers_discs = DMatrix::zeros(3 * self.markers.len(), 3 * discs.len());
        blocks.discs_discs = DMatrix::zeros(3 * discs.len(), 3 * discs.len());
        blocks.discs_weight = DMatrix::zeros(3 * discs.len(), 1);
        for (j, loaded) in discs.iter().enumerate() {
            blocks.markers_discs.columns_mut(3 * j, 3).copy_from(&loaded.markers);
            blocks.discs_weight.fixed_view_mut::<3, 1>(3 * j, 0).copy_from(&loaded.weight);
            for (i, seen) in discs.iter().enumerate() {
                let block = loaded.response.at(&seen.spot);
                blocks.discs_discs.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&block);
            }
        }
        // Reciprocity holds to the discretisation's accuracy; the mean of both readings is symmetric exactly.
        blocks.discs_discs = (&blocks.discs_discs + blocks.discs_discs.transpose()) * 0.5;
        blocks
    }

    /// How the blocks change as discs are `moved`, each by its own vector in its plane. With `grown` set those discs
    /// belong to one spot that is scaled up, their own size in proportion. `adjoint` are the responses of the
    /// markers.
    pub fn changed(
        &self,
        discs: &[Arc<Placed>],
        adjoint: &[Response],
        moved: &[(usize, Vec3)],
        grown: bool,
    ) -> Blocks {
        let together = |disc: usize| moved.iter().any(|(at, _)| *at == disc);
        let (markers, discs3) = (3 * self.markers.len(), 3 * discs.len());
        let mut change = Blocks {
            sites: self
                .tip_responses
                .iter()
                .map(|tip| SiteBlocks {
                    grip: tip.grip(),
                    tip_tip: DMatrix::zeros(tip.seen(), tip.modes()),
                    markers_tip: DMatrix::zeros(markers, tip.modes()),
                    discs_tip: DMatrix::zeros(discs3, tip.modes()),
                    tip_weight: DMatrix::zeros(tip.seen(), 1),
                })
                .collect(),
            markers_discs: DMatrix::zeros(markers, discs3),
            discs_discs: DMatrix::zeros(discs3, discs3),
            markers_weight: DMatrix::zeros(markers, 1),
            discs_weight: DMatrix::zeros(discs3, 1),
        };
        for &(at, by) in moved {
            let disc = &discs[at];
            for slope in disc.slopes(self, adjoint) {
                let share = slope.tangent.dot(&by);
                for (site, under_tip) in change.sites.iter_mut().zip(&slope.under_tip) {
                    let mut rows = site.discs_tip.rows_mut(3 * at, 3);
                    rows += under_tip * share;
                }
                let mut columns = change.markers_discs.columns_mut(3 * at, 3);
                columns += &slope.markers * share;
                let mut weight = change.discs_weight.fixed_view_mut::<3, 1>(3 * at, 0);
                weight += slope.weight * share;
                for (other, loaded) in discs.iter().enumerate() {
                    let along = if together(other) {
                        loaded.response.slope_of_elements(&slope.functional)
                    } else {
                        loaded.response.slope_at(&slope.functional, &disc.spot, &slope.tangent)
                    };
                    change.add_both(at, other, &(along * share));
                }
            }
            if grown {
                // Discs that move together keep their place in each other's near field, which shrinks in proportion
                // when they grow: a half-space's compliance goes with one over the length.
                for other in (0..discs.len()).filter(|&other| together(other)) {
                    change.add_both(at, other, &(discs[other].response.near_at(&disc.spot) * -0.5));
                }
            }
        }
        change
    }
}

impl Blocks {
    /// Adds a change of what disc `seen` does under disc `loaded`, and, by reciprocity, the other way round.
    fn add_both(&mut self, seen: usize, loaded: usize, change: &Mat3) {
        let mut there = self.discs_discs.fixed_view_mut::<3, 3>(3 * seen, 3 * loaded);
        there += change;
        let mut back = self.discs_discs.fixed_view_mut::<3, 3>(3 * loaded, 3 * seen);
        back += change.transpose();
    }
}

/// Displacement of spots under a tip's load modes.
fn under_tip(spots: &[Spot], tip: &TipResponse) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(3 * spots.len(), tip.modes());
    for (i, spot) in spots.iter().enumerate() {
        all.rows_mut(3 * i, 3).copy_from(&tip.at(spot));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Order, TipFace};
    use crate::mesh::{Block, SurfaceIndex, block};

    const NU: f64 = 0.47;

    /// A known force moves markers beside the tip as the stage does with a pad that feels it, near field and all; about a site above
    /// the surface it has the moment of its arm besides.
    #[test]
    fn a_known_force_acts_as_a_pad_does() {
        let mut mesh = block(&Block { size_m: [0.06, 0.05, 0.02], cells: [9, 8, 4] }).expect("a block");
        let base = mesh.surface("z-").to_vec();
        mesh.surfaces.insert("fixed".to_owned(), base);
        let seen = |driven, height_m: f64| {
            let model = Model::new(&mesh, Order::P2, NU, "fixed").expect("held");
            let top = model.space().surface("z+").to_vec();
            let site = Vec3::new(0.031, 0.024, 0.02 + height_m);
            let tip =
                Tip::new(model.space(), &top, &site, 0.008, TipFace::Pad, true, NU).expect("on the top");
            let index = SurfaceIndex::new(&mesh, mesh.surface("z+"));
            let at = [[0.0395, 0.024], [0.031, 0.0145], [0.02, 0.03], [0.055, 0.045]];
            let marker = |[x, y]: [f64; 2]| {
                Spot::marker_in(model.space(), &index, "z+", &Vec3::new(x, y, 0.02)).expect("attached").0
            };
            let markers = at.map(marker).to_vec();
            let bench = Bench::new(model, vec![tip], markers, &[(site, Lift::Whole)], driven, None);
            bench.expect("solved").free.sites[0].markers_tip.clone()
        };
        let (pad, known, above) =
            (seen(Driven::ByStage, 0.0), seen(Driven::ByWrench, 0.0), seen(Driven::ByWrench, 1e-3));
        assert!((known.columns(0, 3) - &pad).amax() < 1e-12 * pad.amax());
        // The force passes 1 mm below the site: there it has the moment −1 mm × force, which is taken off.
        let moments = known.columns(3, 3) * Vec3::new(0.0, 0.0, -1e-3).cross_matrix();
        assert!((above.columns(0, 3) - (&pad - moments)).amax() < 1e-9 * pad.amax());
    }
}
