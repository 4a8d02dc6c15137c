//! `finite-strain` and `strain-stiffening`: the body pressed to a few depths with the law in full.

use super::super::error::DiagnoseError;
use super::curve::{Curve, Curves};
use super::lab::{Lab, Seat, mixed};
use crate::fem::finite::{Change, Controls, Equilibrium, FiniteError, Solid, Sought, Tied};
use crate::fem::material::{Law, Material};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc;

/// Depths at which the body is solved, as shares of the deepest.
const SHARES: [f64; 4] = [0.3, 0.6, 0.85, 1.0];
/// As few as give the shape.
const ROUGH_SHARES: [f64; 2] = [0.45, 0.9];

/// Iterations after which a new tangent pays at the next depth.
const MANY: usize = 12;

/// Equilibrium to 1e-4 of the forces that cancel: the difference that is looked for is then right to some thousandths.
const CONTROLS: Controls =
    Controls { tolerance: 1e-4, iterations: 40, total_iterations: 40, first_step: 1.0, smallest_step: 1.0 };
/// To some hundredths.
const ROUGH_CONTROLS: Controls = Controls { tolerance: 3e-3, iterations: 25, ..CONTROLS };

impl Lab {
    /// What each of `laws` adds to the linear answer at every poke. A depth without equilibrium ends the curve of its poke there
    /// ([`Curve::stopped`]).
    ///
    /// # Errors
    /// [`DiagnoseError::Material`] for a law without meaning; what the linear solver reports.
    pub fn curves(&self, laws: &[Law]) -> Result<Vec<Curves>, DiagnoseError> {
        self.curves_by(laws, &SHARES, &CONTROLS)
    }

    /// As [`Lab::curves`], from two depths and to some per cent: the shape, for less.
    ///
    /// # Errors
    /// As [`Lab::curves`].
    pub fn rough_curves(&self, laws: &[Law]) -> Result<Vec<Curves>, DiagnoseError> {
        self.curves_by(laws, &ROUGH_SHARES, &ROUGH_CONTROLS)
    }

    /// All pokes of all laws go deeper in step.
    fn curves_by(
        &self,
        laws: &[Law],
        shares: &[f64],
        controls: &Controls,
    ) -> Result<Vec<Curves>, DiagnoseError> {
        let solid = |law: &Law| Ok(Solid::homogeneous(Material::new(self.moduli, *law)?));
        let solids = laws.iter().map(solid).collect::<Result<Vec<_>, DiagnoseError>>()?;
        let descents = |solid| self.seats.iter().map(move |seat| Descent::new(seat, solid, shares));
        let mut descents: Vec<Descent<'_>> = solids.iter().flat_map(descents).collect();
        loop {
            let next: Vec<Option<Deeper>> = descents.par_iter_mut().map(Descent::next).collect();
            let sought: Vec<Sought<'_>> = descents
                .iter()
                .zip(&next)
                .filter_map(|(descent, next)| Some(descent.seeks(next.as_ref()?)))
                .collect();
            if sought.is_empty() {
                break;
            }
            let found = self.body.equilibria(&sought, controls)?;
            let going = descents.iter_mut().zip(next).filter_map(|(descent, next)| Some((descent, next?)));
            let going: Vec<_> = going.zip(found).collect();
            going.into_par_iter().for_each(|((descent, next), found)| descent.goes_on(self, next, found));
        }
        let mut curves =
            descents.into_par_iter().map(|descent| descent.curve(self)).collect::<Vec<_>>().into_iter();
        Ok(laws.iter().map(|_| Curves { pokes: curves.by_ref().take(self.seats.len()).collect() }).collect())
    }
}

/// One poke under one law, on its way to the deepest.
struct Descent<'a> {
    seat: &'a Seat,
    solid: &'a Solid,
    /// Depths to come, as shares of the deepest.
    ahead: VecDeque<f64>,
    /// By share, what was found less the linear answer.
    beyond_linear: Vec<(f64, Change)>,
    /// Over a newer tangent.
    refreshed: Option<Tied>,
    stopped: Option<Arc<FiniteError>>,
}

/// A depth that is next.
struct Deeper {
    share: f64,
    ends: Vec<f64>,
    linear: Change,
    /// Where the search begins.
    start: Change,
}

impl<'a> Descent<'a> {
    fn new(seat: &'a Seat, solid: &'a Solid, shares: &[f64]) -> Self {
        let ahead = shares.iter().copied().collect();
        Self { seat, solid, ahead, beyond_linear: Vec::new(), refreshed: None, stopped: None }
    }

    fn next(&mut self) -> Option<Deeper> {
        let share = self.ahead.pop_front()?;
        let depth = share * self.seat.poke.deepest_m;
        let ends = self.seat.ends(&(self.seat.poke.direction * depth));
        let linear = mixed(&[(depth, &self.seat.along)]);
        let guess = extrapolated(&self.beyond_linear, share);
        let mut parts = vec![(1.0, &linear)];
        parts.extend(self.beyond_linear.iter().zip(&guess).map(|((_, change), w)| (*w, change)));
        let start = mixed(&parts);
        Some(Deeper { share, ends, linear, start })
    }

    fn tied(&self) -> &Tied {
        self.refreshed.as_ref().unwrap_or(&self.seat.tied)
    }

    fn seeks<'s>(&'s self, next: &'s Deeper) -> Sought<'s> {
        Sought { tied: self.tied(), solid: self.solid, ends: &next.ends, start: &next.start }
    }

    fn goes_on(&mut self, lab: &Lab, next: Deeper, found: Result<Equilibrium, FiniteError>) {
        match found {
            Ok(found) => {
                let state = Change {
                    displacement: found.displacement().to_vec(),
                    tie_forces: found.tie_forces().to_vec(),
                };
                self.beyond_linear.push((next.share, mixed(&[(1.0, &state), (-1.0, &next.linear)])));
                if found.iterations() > MANY && !self.ahead.is_empty() {
                    // Where the body is about to become unstable, the older tangent has to do.
                    if let Ok(refreshed) = self.tied().refreshed(&lab.body, self.solid, &found) {
                        self.refreshed = Some(refreshed);
                    }
                }
            }
            Err(why) if self.stopped.is_none() => {
                // Half of the way once more, and no farther.
                self.stopped = Some(Arc::new(why));
                self.ahead = VecDeque::from([0.5 * (self.reached() + next.share)]);
            }
            Err(_) => self.ahead.clear(),
        }
        if self.ahead.is_empty() {
            // A factor of its own, which others need not wait with.
            self.refreshed = None;
        }
    }

    /// Share of the deepest.
    fn reached(&self) -> f64 {
        self.beyond_linear.last().map_or(0.0, |(share, _)| *share)
    }

    fn curve(self, lab: &Lab) -> Curve {
        let reached = self.reached();
        let shares: Vec<f64> = self.beyond_linear.iter().map(|(share, _)| share / reached).collect();
        let values: Vec<_> = self.beyond_linear.iter().map(|(_, change)| lab.readings(change)).collect();
        match Curve::through(reached * self.seat.poke.deepest_m, &shares, &values, self.stopped.clone()) {
            Some(curve) => curve,
            None => Curve::nothing(3 + 3 * lab.markers.len(), self.stopped),
        }
    }
}

/// Weights of known differences in the one at `share`: the polynomial t² (c₀ + c₁ t + …) through them.
fn extrapolated(known: &[(f64, Change)], share: f64) -> Vec<f64> {
    let at = |i: usize| known[i].0;
    (0..known.len())
        .map(|i| {
            let others = (0..known.len()).filter(|&j| j != i);
            let lagrange: f64 = others.map(|j| (share - at(j)) / (at(i) - at(j))).product();
            lagrange * (share / at(i)).powi(2)
        })
        .collect()
}
