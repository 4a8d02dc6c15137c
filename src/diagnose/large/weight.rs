//! `self-weight`: what the phantom's weight changes in a recording whose model has none.
//!
//! Two cases, which differ in when the weight came to act.
//! - *Always* (the mesh and the rest positions carry the sag already): markers and force at rest show nothing of it. What
//!   is left is the strain that it has put into the body, which makes it stiffer or softer to a poke: in proportion to
//!   the depth, and of the order of ρ g h/E against 1, h the height of the body (more where a part overhangs). One
//!   orientation of the phantom is told from a modulus of its own only by how sites and markers differ; two
//!   orientations tell it by the sign.
//! - *Only while the tip touches* (a tray that is taken away, for one): the markers sag, wherever the restraint lets
//!   them, and the tip bears a part of the weight. Independent of the depth.
//!
//! Both are exact to first order in `g`, which enters as a vector: direction and size are one parameter of three
//! components. The strain `e` under the weight (linear, with the restraint, no tip) changes the spatial tangent of the
//! neo-Hookean solid on the mesh, which is the deformed shape, by (Holzapfel 2000, equations 6.166 to 6.176, to first
//! order in e, θ = tr e, σ = 2μ dev e + κ θ I)
//! δτ(∇u) = ∇u σ + 2κθ tr ε I − 2κθ ε − 2μθ dev ε − 4μ/3 (tr ε dev e + (dev e : ε) I), ε = sym ∇u.
//!
//! Left out: second order in `g`, which counts where a part overhangs so far that the weight turns it; that the rest
//! shape of the restraint's springs was another; weight of tip and tray.

use super::super::error::DiagnoseError;
use super::lab::{Lab, Seat};
use super::points::{forces, gradients};
use crate::geometry::{Mat3, Vec3};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// What the weight adds at one poke, per N/m³ over the modulus (1/m) along each axis (columns). Rows as in
/// [`Curve`](super::Curve).
#[derive(Debug, Clone)]
pub struct Weight {
    /// While the weight acts only under the tip: independent of the depth.
    pub acting: DMatrix<f64>,
    /// When it has always acted: per m of depth.
    pub strained: DMatrix<f64>,
}

impl Lab {
    /// The weight's part at every poke, in the lab's order.
    ///
    /// # Errors
    /// What the linear solver reports.
    pub fn weight(&self) -> Result<Vec<Weight>, DiagnoseError> {
        let loads = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| self.body.body_force(&axis));
        let free = vec![0.0; self.untouched.ties().len()];
        let strained_by = |load: &Vec<f64>| -> Result<Vec<Mat3>, DiagnoseError> {
            let sag = self.untouched.linear(&self.body, load, &free)?.displacement;
            let strain = |(_, h): &(f64, Mat3)| (h + h.transpose()) * 0.5;
            Ok(gradients(self.body.space(), &sag).iter().map(strain).collect())
        };
        let strains = loads.iter().map(strained_by).collect::<Result<Vec<_>, _>>()?;
        self.seats.par_iter().map(|seat| self.of_weight(seat, &loads, &strains)).collect()
    }

    fn of_weight(
        &self,
        seat: &Seat,
        loads: &[Vec<f64>; 3],
        strains: &[Vec<Mat3>],
    ) -> Result<Weight, DiagnoseError> {
        let ends = vec![0.0; seat.tied.ties().len()];
        let held = |force: &[f64]| seat.tied.linear(&self.body, force, &ends);
        let (mut acting, mut strained) = (Vec::new(), Vec::new());
        for (load, strain) in loads.iter().zip(strains) {
            acting.push(self.readings(&held(load)?));
            let change = |point: usize, h: &Mat3| -self.change_of_stress(&strain[point], h);
            let force = forces(self.body.space(), &seat.along.displacement, change);
            strained.push(self.readings(&held(&force)?));
        }
        Ok(Weight { acting: DMatrix::from_columns(&acting), strained: DMatrix::from_columns(&strained) })
    }

    /// δτ for a displacement gradient `h` on top of the strain `e`.
    fn change_of_stress(&self, e: &Mat3, h: &Mat3) -> Mat3 {
        let (mu, kappa) = (self.moduli.shear(), self.moduli.bulk());
        let one = Mat3::identity();
        let theta = e.trace();
        let dev_e = e - one * (theta / 3.0);
        let stress = dev_e * (2.0 * mu) + one * (kappa * theta);
        let strain = (h + h.transpose()) * 0.5;
        let swelling = strain.trace();
        let dev = strain - one * (swelling / 3.0);
        h * stress + one * (2.0 * kappa * theta * swelling)
            - strain * (2.0 * kappa * theta)
            - dev * (2.0 * mu * theta)
            - (dev_e * swelling + one * dev_e.dot(&strain)) * (4.0 / 3.0 * mu)
    }
}
