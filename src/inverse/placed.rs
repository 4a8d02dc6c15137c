//! One restraint disc on a bench: what it has to do with tips, markers and weight, whatever else holds the body.
//!
//! A fit mounts the same disc many times: when weights are renewed, when another patch is tried or taken out. Its
//! response costs a sparse solve, so that the last few are kept.

use super::blocks::Bench;
use super::error::InverseError;
use crate::fem::{Functional, Profile, Response, Spot, SpotKind};
use crate::geometry::{Disc, Vec3, basis_from_axis};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Discs that are kept: three glued spots of seven and some patches.
const KEPT: usize = 28;

/// A restraint disc on the model.
#[derive(Debug)]
pub struct Placed {
    /// The disc.
    pub spot: Spot,
    /// Response to a unit force on it.
    pub response: Response,
    /// Markers under it: `3 markers × 3`.
    pub(super) markers: DMatrix<f64>,
    /// It under the load modes of every tip: `3 × modes`.
    pub(super) under_tip: Vec<DMatrix<f64>>,
    /// It under the body's weight.
    pub(super) weight: Vec3,
    slopes: OnceLock<[Slope; 2]>,
}

/// How what a disc sees changes as it is moved along a unit tangent (per m).
#[derive(Debug)]
pub(super) struct Slope {
    pub(super) tangent: Vec3,
    /// Of its displacement in a nodal field.
    pub(super) functional: [Functional; 3],
    /// Of its displacement under the load modes of every tip.
    pub(super) under_tip: Vec<DMatrix<f64>>,
    /// Of the markers' displacement under it.
    pub(super) markers: DMatrix<f64>,
    /// Of its displacement under the body's weight.
    pub(super) weight: Vec3,
}

impl Placed {
    /// Slopes along two tangents. `adjoint` are the responses of the bench's markers, through which the markers' part
    /// follows by reciprocity.
    pub(super) fn slopes(&self, bench: &Bench, adjoint: &[Response]) -> &[Slope; 2] {
        self.slopes.get_or_init(|| {
            let normal = self.spot.as_disc().map_or_else(Vec3::z, |(disc, _)| disc.normal);
            let basis = basis_from_axis(&normal);
            [0, 1].map(|axis| self.slope(bench, adjoint, basis.column(axis).into_owned()))
        })
    }

    fn slope(&self, bench: &Bench, adjoint: &[Response], tangent: Vec3) -> Slope {
        let functional = self.spot.slope(bench.model.space(), &tangent);
        let under_tip =
            bench.tip_responses().iter().map(|tip| tip.slope_at(&functional, &self.spot, &tangent));
        let mut markers = DMatrix::zeros(3 * adjoint.len(), 3);
        for (m, response) in adjoint.iter().enumerate() {
            let block = response.slope_at(&functional, &self.spot, &tangent).transpose();
            markers.fixed_view_mut::<3, 3>(3 * m, 0).copy_from(&block);
        }
        let weight = bench.weight_field().map_or_else(Vec3::zeros, |nodal| dot(&functional, nodal));
        Slope { tangent, under_tip: under_tip.collect(), markers, weight, functional }
    }
}

/// The value of three functionals in a nodal field.
pub(super) fn dot(functional: &[Functional; 3], nodal: &[f64]) -> Vec3 {
    Vec3::from_fn(|i, _| functional[i].iter().map(|&(c, w)| w * nodal[c as usize]).sum())
}

/// The last patches that were placed on a bench, each with all its discs.
#[derive(Debug, Default)]
pub(super) struct Recent(Mutex<VecDeque<Vec<Arc<Placed>>>>);

impl Recent {
    /// Each of `patches`, discs all of them, on the bench: placed before, or solved for now. Discs of a patch are solved for together and
    /// by themselves, so that their last digits do not depend on what else is placed.
    pub(super) fn place(
        &self,
        bench: &Bench,
        patches: &[Vec<Spot>],
    ) -> Result<Vec<Arc<Placed>>, InverseError> {
        // A panic elsewhere leaves whole entries only.
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = |spots: &Vec<Spot>| lock().iter().find(|placed| same(placed, spots)).cloned();
        let known: Vec<Option<Vec<Arc<Placed>>>> = patches.iter().map(known).collect();
        let placed = |(spots, known): (&Vec<Spot>, Option<Vec<Arc<Placed>>>)| match known {
            Some(known) => Ok(known),
            None => bench.solved(spots),
        };
        let placed: Vec<Vec<Arc<Placed>>> =
            patches.par_iter().zip(known).map(placed).collect::<Result<_, InverseError>>()?;
        let mut kept = lock();
        let now = |old: &Vec<Arc<Placed>>| placed.iter().any(|p| Arc::ptr_eq(&p[0], &old[0]));
        kept.retain(|old| !now(old));
        placed.iter().for_each(|p| kept.push_front(p.clone()));
        let all: Vec<Arc<Placed>> = placed.into_iter().flatten().collect();
        let mut discs = 0;
        kept.retain(|patch| {
            discs += patch.len();
            discs <= KEPT.max(all.len())
        });
        Ok(all)
    }
}

impl Bench {
    fn solved(&self, spots: &[Spot]) -> Result<Vec<Arc<Placed>>, InverseError> {
        let responses = self.model.respond(&spots.iter().collect::<Vec<_>>())?;
        Ok(spots
            .par_iter()
            .zip(responses)
            .map(|(spot, response)| Arc::new(self.seen(spot, response)))
            .collect())
    }

    /// What a disc with this response has to do with everything on the bench.
    fn seen(&self, spot: &Spot, response: Response) -> Placed {
        let mut markers = DMatrix::zeros(3 * self.markers.len(), 3);
        for (m, marker) in self.markers.iter().enumerate() {
            markers.fixed_view_mut::<3, 3>(3 * m, 0).copy_from(&response.at(marker));
        }
        Placed {
            markers,
            under_tip: self.tip_responses().iter().map(|tip| tip.at(spot)).collect(),
            weight: self.weight_field().map_or_else(Vec3::zeros, |nodal| spot.of(nodal)),
            spot: spot.clone(),
            response,
            slopes: OnceLock::new(),
        }
    }
}

/// Whether a patch that was placed has these discs, to the last bit.
fn same(placed: &[Arc<Placed>], spots: &[Spot]) -> bool {
    let disc = |spot: &Spot| -> Option<(Disc, Profile)> {
        match spot.kind {
            SpotKind::Disc { disc, profile, .. } => Some((disc, profile)),
            SpotKind::Marker { .. } => None,
        }
    };
    let same = |(placed, spot): (&Arc<Placed>, &Spot)| matches!((disc(&placed.spot), disc(spot)), (Some(a), Some(b)) if a == b);
    placed.len() == spots.len() && placed.iter().zip(spots).all(same)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Model, Order};
    use crate::inverse::Driven;
    use crate::mesh::{Block, block};

    /// Discs of a patch answer to the last bit as they do by themselves, whatever is placed beside them.
    #[test]
    fn a_patch_answers_by_itself() {
        let mesh = block(&Block { size_m: [0.1, 0.1, 0.03], cells: [5, 5, 2] }).expect("a block");
        let bench = || {
            let model = Model::new(&mesh, Order::P2, 0.47, "z-").expect("held");
            Bench::new(model, vec![], vec![], &[], Driven::ByStage, None).expect("a bench")
        };
        let (one, other) = (bench(), bench());
        let space = one.model.space();
        let top = space.surface("z+").to_vec();
        let disc = |x: f64| Spot::disc(space, &top, &Vec3::new(x, 0.05, 0.03), 0.004).expect("on the top");
        let spot: Vec<Spot> = (0..7).map(|i| disc(0.03 + 2e-3 * f64::from(i))).collect();
        let alone = one.place(std::slice::from_ref(&spot)).expect("solved");
        let beside = other.place(&[vec![disc(0.07)], spot.clone(), vec![disc(0.08)]]).expect("solved");
        for (alone, beside) in alone.iter().zip(&beside[1..]) {
            assert_eq!(alone.response.at(&disc(0.055)), beside.response.at(&disc(0.055)));
        }
    }

    /// A disc placed again is not solved for again, a moved one is; and what is kept is bounded.
    #[test]
    fn the_last_discs_are_kept() {
        let mesh = block(&Block { size_m: [0.1, 0.1, 0.03], cells: [5, 5, 2] }).expect("a block");
        let model = Model::new(&mesh, Order::P1, 0.3, "z-").expect("held");
        let top = model.space().surface("z+").to_vec();
        let bench = Bench::new(model, vec![], vec![], &[], Driven::ByStage, None).expect("a bench");
        let disc = |x: f64| {
            Spot::disc(bench.model.space(), &top, &Vec3::new(x, 0.05, 0.03), 0.005).expect("on the top")
        };
        let first = bench.place(&[vec![disc(0.03)], vec![disc(0.06)]]).expect("solved");
        let again = bench.place(&[vec![disc(0.06)], vec![disc(0.031)]]).expect("solved");
        assert!(Arc::ptr_eq(&first[1], &again[0]));
        assert!(!Arc::ptr_eq(&first[0], &again[1]));
        let afresh = &bench.model.respond(&[&disc(0.06)]).expect("solved")[0];
        let kept = again[0].response.at(&disc(0.03));
        assert!((afresh.at(&disc(0.03)) - kept).norm() < 1e-12 * kept.norm());
        for i in 0..KEPT {
            bench.place(&[vec![disc(0.04 + 1e-4 * i as f64)]]).expect("solved");
        }
        assert!(!Arc::ptr_eq(&first[0], &bench.place(&[vec![disc(0.03)]]).expect("solved")[0]));
    }
}
