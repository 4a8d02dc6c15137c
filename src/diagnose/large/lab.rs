//! The body of a bench with one factor, and its linear answer at every place that is poked.

use super::super::error::DiagnoseError;
use super::bench::{Bench, Poke};
use crate::fem::finite::{AtRest, Change, HeldBody, Tie, TieKind, Tied};
use crate::fem::material::Moduli;
use crate::fem::{FemError, Functional, Order, Space, Spot};
use crate::geometry::Vec3;
use crate::mesh::SurfaceIndex;
use nalgebra::DVector;
use rayon::prelude::*;
use std::sync::Arc;

/// A body of unit modulus, ready to be pressed.
pub struct Lab {
    pub(super) body: HeldBody,
    pub(super) moduli: Moduli,
    pub(super) seats: Vec<Seat>,
    pub(super) markers: Vec<Spot>,
    /// The body that no tip touches.
    pub(super) untouched: Tied,
}

/// A place that is poked: the body tied to tip and restraint there.
pub(super) struct Seat {
    pub(super) poke: Poke,
    pub(super) tied: Tied,
    /// Linear answer to the tip moved along the poke by 1 m.
    pub(super) along: Change,
}

/// A face belongs to the side that a tip enters when its outward normal has less than this component along the poke.
const ENTERED: f64 = -0.2;
/// A face belongs to the side of a restraint disc when its normal has this component along the disc's.
const FACING: f64 = 0.7;

impl Lab {
    /// Puts elements on the bench's mesh, factors them once, and solves for the linear answers.
    ///
    /// # Errors
    /// What elements and solver refuse: [`DiagnoseError::Elements`], [`DiagnoseError::Solid`].
    pub fn new(bench: &Bench, order: Order) -> Result<Self, DiagnoseError> {
        let space = Arc::new(Space::new(&bench.mesh, order).map_err(FemError::from)?);
        let flags: Vec<bool> = space.on_surface(bench.fixed).into_iter().flat_map(|on| [on; 3]).collect();
        let tips = bench.pokes.iter().map(|poke| tip(bench, &space, poke)).collect::<Result<Vec<_>, _>>()?;
        let body = HeldBody::with_pads(Arc::clone(&space), &flags, &tips)?;
        let moduli = Moduli::new(1.0, bench.poisson_ratio)?;
        let at_rest = body.at_rest(moduli)?;
        let restraint = restraint(bench, &space)?;
        let places = bench.pokes.par_iter().zip(&tips);
        let seats = places.map(|(poke, tip)| seat(&body, &at_rest, tip, &restraint, *poke));
        let seats = seats.collect::<Result<Vec<_>, _>>()?;
        let index = SurfaceIndex::new(&bench.mesh, bench.mesh.surface(bench.observed));
        let marker = |rest: &Vec3| Ok(Spot::marker_in(&space, &index, bench.observed, rest)?.0);
        let markers = bench.markers.iter().map(marker).collect::<Result<Vec<_>, FemError>>()?;
        let untouched = at_rest.tied(&body, restraint)?;
        Ok(Self { body, moduli, seats, markers, untouched })
    }

    /// Displacement components solved for.
    pub fn unknowns(&self) -> usize {
        self.body.free().len()
    }

    /// What a state reads: force of the tip on the phantom (three ties), and all markers.
    pub(super) fn readings(&self, state: &Change) -> DVector<f64> {
        let mut all = DVector::zeros(3 + 3 * self.markers.len());
        all.rows_mut(0, 3).copy_from_slice(&state.tie_forces[..3]);
        for (m, marker) in self.markers.iter().enumerate() {
            all.fixed_rows_mut::<3>(3 + 3 * m).copy_from(&marker.of(&state.displacement));
        }
        all
    }
}

impl Seat {
    /// Far ends of the ties with the tip moved by `tip` (m).
    pub(super) fn ends(&self, tip: &Vec3) -> Vec<f64> {
        let mut ends = vec![0.0; self.tied.ties().len()];
        ends[..3].copy_from_slice(tip.as_slice());
        ends
    }
}

/// Σ weight · change.
pub(super) fn mixed(parts: &[(f64, &Change)]) -> Change {
    let sum = |part: fn(&Change) -> &[f64]| -> Vec<f64> {
        let mut all = vec![0.0; parts.first().map_or(0, |p| part(p.1).len())];
        for (weight, change) in parts {
            all.iter_mut().zip(part(change)).for_each(|(a, x)| *a += weight * x);
        }
        all
    };
    Change { displacement: sum(|c| &c.displacement), tie_forces: sum(|c| &c.tie_forces) }
}

fn restraint(bench: &Bench, space: &Space) -> Result<Vec<Tie>, FemError> {
    let mut ties = Vec::new();
    for hold in &bench.holds {
        let facing: Vec<usize> = (0..space.faces().len())
            .filter(|&face| space.face_triangle(face).normal().dot(&hold.disc.normal) > FACING)
            .collect();
        let spot = Spot::disc(space, &facing, &hold.disc.centre, hold.disc.radius)?;
        let kind = match hold.softness {
            0.0 => TieKind::Rigid,
            softness => TieKind::Spring { stiffness: 1.0 / softness },
        };
        ties.extend(spot.weights.map(|functional| Tie { functional, displacement: 0.0, kind }));
    }
    Ok(ties)
}

/// Mean displacement under a tip, by axis.
fn tip(bench: &Bench, space: &Space, poke: &Poke) -> Result<[Functional; 3], FemError> {
    let entered: Vec<usize> = (0..space.faces().len())
        .filter(|&face| space.face_triangle(face).normal().dot(&poke.direction) < ENTERED)
        .collect();
    Ok(Spot::weighed(space, &entered, &poke.centre, poke.radius_m, bench.profile)?.weights)
}

fn seat(
    body: &HeldBody,
    at_rest: &AtRest,
    tip: &[Functional; 3],
    restraint: &[Tie],
    poke: Poke,
) -> Result<Seat, DiagnoseError> {
    let mut ties = Tie::pad(tip, &Vec3::zeros()).to_vec();
    ties.extend_from_slice(restraint);
    let tied = at_rest.tied(body, ties)?;
    let still = vec![0.0; body.space().components()];
    let mut ends = vec![0.0; tied.ties().len()];
    ends[..3].copy_from_slice(poke.direction.as_slice());
    let along = tied.linear(body, &still, &ends)?;
    Ok(Seat { poke, tied, along })
}
