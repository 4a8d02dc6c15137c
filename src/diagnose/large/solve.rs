//! `finite-strain` and `strain-stiffening`: the body pressed to a few depths with the law in full.

use super::super::error::DiagnoseError;
use super::curve::{Curve, Curves};
use super::lab::{Lab, Seat, mixed};
use crate::fem::finite::{Change, Controls, Solid};
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
    /// What `law` adds to the linear answer at every poke. A depth without equilibrium ends the curve of its poke there
    /// ([`Curve::stopped`]).
    ///
    /// # Errors
    /// [`DiagnoseError::Material`] for a law without meaning.
    pub fn curves(&self, law: Law) -> Result<Curves, DiagnoseError> {
        self.curves_by(law, &SHARES, &CONTROLS)
    }

    /// As [`Lab::curves`], from two depths and to some per cent: the shape, for less.
    ///
    /// # Errors
    /// As [`Lab::curves`].
    pub fn rough_curves(&self, law: Law) -> Result<Curves, DiagnoseError> {
        self.curves_by(law, &ROUGH_SHARES, &ROUGH_CONTROLS)
    }

    fn curves_by(&self, law: Law, shares: &[f64], controls: &Controls) -> Result<Curves, DiagnoseError> {
        let solid = Solid::homogeneous(Material::new(self.moduli, law)?);
        let curve = |seat| self.curve(seat, &solid, shares, controls);
        Ok(Curves { pokes: self.seats.par_iter().map(curve).collect() })
    }

    fn curve(&self, seat: &Seat, solid: &Solid, shares: &[f64], controls: &Controls) -> Curve {
        let deepest = seat.poke.deepest_m;
        let mut beyond_linear: Vec<(f64, Change)> = Vec::new();
        let mut stopped = None;
        let mut refreshed = None;
        let mut ahead: VecDeque<f64> = shares.iter().copied().collect();
        while let Some(share) = ahead.pop_front() {
            let tied = refreshed.as_ref().unwrap_or(&seat.tied);
            let ends = seat.ends(&(seat.poke.direction * (share * deepest)));
            let linear = mixed(&[(share * deepest, &seat.along)]);
            let guess = extrapolated(&beyond_linear, share);
            let mut parts = vec![(1.0, &linear)];
            parts.extend(beyond_linear.iter().zip(&guess).map(|((_, change), w)| (*w, change)));
            match tied.equilibrium(&self.body, solid, &ends, &mixed(&parts), controls) {
                Ok(found) => {
                    let state = Change {
                        displacement: found.displacement().to_vec(),
                        tie_forces: found.tie_forces().to_vec(),
                    };
                    beyond_linear.push((share, mixed(&[(1.0, &state), (-1.0, &linear)])));
                    if found.iterations() > MANY && !ahead.is_empty() {
                        // Where the body is about to become unstable, the older tangent has to do.
                        refreshed = tied.refreshed(&self.body, solid, &found).ok().or(refreshed);
                    }
                }
                Err(why) if stopped.is_none() => {
                    // Half of the way once more, and no farther.
                    stopped = Some(Arc::new(why));
                    let reached = beyond_linear.last().map_or(0.0, |(share, _)| *share);
                    ahead = VecDeque::from([0.5 * (reached + share)]);
                }
                Err(_) => break,
            }
        }
        let reached = beyond_linear.last().map_or(0.0, |(share, _)| *share);
        let shares: Vec<f64> = beyond_linear.iter().map(|(share, _)| share / reached).collect();
        let values: Vec<_> = beyond_linear.iter().map(|(_, change)| self.readings(change)).collect();
        match Curve::through(reached * deepest, &shares, &values, stopped.clone()) {
            Some(curve) => curve,
            None => Curve::nothing(3 + 3 * self.markers.len(), stopped),
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
