//! What a body does under a tip, besides what the half-space would: seen through seven small discs.
//!
//! A tip's traction may have a rim without bound and a contact area that is not known beforehand. The half-space
//! carries all of that in closed form or in fine cells; what the rest of the body adds is smooth under the tip. It is
//! sampled by seven discs of a third of the radius, one in the middle and six around it: a traction acts on the body
//! as those forces on the seven that have its moments `∫ t φ` with `φ` = 1, x, y, x² + y², x² − y², 2xy and
//! x³ − 3xy²; and by reciprocity the displacement under the tip is the combination of these whose means over the
//! seven are the seven's.

use super::error::FemError;
use super::model::Response;
use super::space::Space;
use super::spot::{Spot, SpotKind};
use crate::geometry::{Mat3, Vec3, basis_from_axis};
use nalgebra::{DMatrix, SMatrix, SVector};

/// Number of ports.
pub(super) const PORTS: usize = 7;

/// Radius of a port over that of the tip.
const SHARE: f64 = 1.0 / 3.0;

/// Seven discs under a tip.
#[derive(Debug, Clone)]
pub(super) struct Ports {
    /// The discs.
    pub spots: Vec<Spot>,
    /// Columns: two tangents and the inward normal.
    pub frame: Mat3,
    /// Radius of the tip (m).
    pub radius: f64,
    /// Column `k`: coefficients of the function whose mean is 1 over port `k` and 0 over the others, lengths in
    /// tip radii.
    shape: SMatrix<f64, PORTS, PORTS>,
}

/// The seven functions at a place, lengths in tip radii.
fn functions(x: f64, y: f64) -> SVector<f64, PORTS> {
    SVector::from([1.0, x, y, x * x + y * y, x * x - y * y, 2.0 * x * y, x * x * x - 3.0 * x * y * y])
}

impl Ports {
    /// Puts them under the tip of `radius` (m) at the point of the faces `on` nearest to `centre`.
    ///
    /// # Errors
    /// [`FemError::TipNotFlat`] where the surface under the tip is not flat or ends.
    pub(super) fn new(space: &Space, on: &[usize], centre: &Vec3, radius: f64) -> Result<Self, FemError> {
        let whole = Spot::disc(space, on, centre, radius)?;
        let SpotKind::Disc { disc, flat: true, .. } = whole.kind else {
            return Err(FemError::TipNotFlat { centre_m: (*centre).into(), radius_m: radius });
        };
        let frame = basis_from_axis(&-disc.normal);
        let mut means = SMatrix::<f64, PORTS, PORTS>::zeros();
        let mut spots = Vec::with_capacity(PORTS);
        for k in 0..PORTS {
            let (sin, cos) = (std::f64::consts::FRAC_PI_3 * k as f64).sin_cos();
            let arm = if k == 0 { 0.0 } else { 2.0 * SHARE };
            let (x, y) = (arm * cos, arm * sin);
            let place = disc.centre + frame * Vec3::new(x, y, 0.0) * radius;
            spots.push(Spot::disc(space, on, &place, SHARE * radius)?);
            // All but x² + y² are harmonic: their mean over a disc is their value in the middle.
            let mut mean = functions(x, y);
            mean[3] += 0.5 * SHARE * SHARE;
            means.set_row(k, &mean.transpose());
        }
        // Unisolvent: the six around the middle tell apart waves of up to three periods.
        let shape = means.try_inverse().unwrap_or_default();
        Ok(Self { spots, frame, radius, shape })
    }

    /// Share of every port in a point force at a place of the tip's plane (m, from the tip's centre).
    pub(super) fn shares(&self, x: f64, y: f64) -> SVector<f64, PORTS> {
        self.of_moments(&functions(x / self.radius, y / self.radius))
    }

    /// Share of every port in a traction with these moments over the seven functions.
    pub(super) fn of_moments(&self, moments: &SVector<f64, PORTS>) -> SVector<f64, PORTS> {
        self.shape.transpose() * moments
    }

    /// What the body adds to the half-space between the ports, `3 ports × 3 ports` in the phantom frame, for a
    /// unit modulus; symmetric. `responses` are those to the ports.
    pub(super) fn remainder(&self, responses: &[Response]) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(3 * PORTS, 3 * PORTS);
        for (j, response) in responses.iter().enumerate() {
            for (i, spot) in self.spots.iter().enumerate() {
                all.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&response.of_elements(spot));
            }
        }
        (&all + all.transpose()) * 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::Order;
    use crate::mesh::{Block, block};

    /// Forces on the ports have the force, the moments and the second moments of the point force that they stand
    /// for, those of the ports' own discs included.
    #[test]
    fn the_ports_carry_the_moments() {
        let mesh = block(&Block { size_m: [0.06, 0.05, 0.02], cells: [4, 4, 2] }).expect("a block");
        let space = Space::new(&mesh, Order::P1).expect("a space");
        let centre = Vec3::new(0.03, 0.025, 0.02);
        let ports = Ports::new(&space, space.surface("z+"), &centre, 0.006).expect("flat");
        let (x, y) = (0.0013, -0.0021);
        let shares = ports.shares(x, y);
        let place = |k: usize| {
            let (disc, flat) = ports.spots[k].as_disc().expect("a disc");
            assert!(flat);
            (ports.frame.transpose() * (disc.centre - centre), disc.radius)
        };
        let sum = |f: &dyn Fn(Vec3, f64) -> f64| {
            (0..PORTS).map(|k| shares[k] * f(place(k).0, place(k).1)).sum::<f64>()
        };
        assert!((sum(&|_, _| 1.0) - 1.0).abs() < 1e-12);
        assert!((sum(&|p, _| p.x) - x).abs() < 1e-14 && (sum(&|p, _| p.y) - y).abs() < 1e-14);
        assert!((sum(&|p, r| p.x * p.x + 0.25 * r * r) - x * x).abs() < 1e-16);
        assert!((sum(&|p, _| p.x * p.y) - x * y).abs() < 1e-16);
        let edge = Vec3::new(0.058, 0.025, 0.02);
        let refused = Ports::new(&space, space.surface("z+"), &edge, 0.006).expect_err("hangs over");
        assert!(matches!(refused, FemError::TipNotFlat { .. }), "{refused}");
    }
}
