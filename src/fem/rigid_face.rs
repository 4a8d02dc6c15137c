//! A rigid flat face bonded to the surface and held against turning: six tractions, and how they move the face.
//!
//! The tractions are those of a rigid disc on the half-space (local frame: two tangents and the inward normal): three
//! forces, `1 / (2πa √(a² − ρ²))`, and three moments, `3 (ω × x) / (2πa³ √(a² − ρ²))` for a tilt, half of that for the
//! twist. On the half-space each of them moves the disc as a rigid body, but for Poisson's coupling, `1 − 2ν` in size:
//! it binds a push to a tilt, and stiffens a press by `(1 − ν) ln(3 − 4ν) / (1 − 2ν)` (Mossakovskii 1954), 0.1 % at
//! ν = 0.47. The body's own compliance acts through the ports; the face's rotation is prescribed zero.

use super::ports::{PORTS, Ports};
use super::punch::{self, turning_compliance};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, Matrix6, SMatrix, SVector, Vector6};
use std::f64::consts::TAU;

/// A face of some radius over the ports of a tip.
#[derive(Debug, Clone)]
pub(super) struct RigidFace {
    /// Motion of the face (three displacements, three rotations, local) under the six tractions on the half-space.
    near: Matrix6<f64>,
    /// Forces on the ports (phantom frame) under the six tractions.
    spread: SMatrix<f64, { 3 * PORTS }, 6>,
    /// From the phantom frame: a displacement as a motion of the face that does not turn.
    held: SMatrix<f64, 6, 3>,
}

impl RigidFace {
    /// A face of `radius` (m), at most the tip's, in the middle of the tip.
    pub(super) fn new(ports: &Ports, radius: f64, nu: f64) -> Self {
        let [along, into] = punch::self_compliance(radius, nu);
        let [tilt, twist] = turning_compliance(radius, nu);
        let mut near = Matrix6::from_diagonal(&Vector6::new(
            along,
            along,
            into / bonded_over_smooth(nu),
            tilt,
            tilt,
            twist,
        ));
        // A tilt's traction, 3x / (2πa³ √(a² − ρ²)), pushes the disc along by (1 − 2ν)(1 + ν)/2π · 3/4a².
        let coupling = (1.0 - 2.0 * nu) * (1.0 + nu) / TAU * 0.75 / (radius * radius);
        for (push, turn, sign) in [(0, 4, -1.0), (1, 3, 1.0)] {
            near[(push, turn)] = sign * coupling;
            near[(turn, push)] = sign * coupling;
        }
        let size = radius / ports.radius;
        let even = ports.of_moments(&SVector::from([1.0, 0.0, 0.0, 2.0 / 3.0 * size * size, 0.0, 0.0, 0.0]));
        let mut moments = SVector::<f64, PORTS>::zeros();
        moments[1] = 1.0 / ports.radius;
        let along_x = ports.of_moments(&moments);
        moments.swap_rows(1, 2);
        let along_y = ports.of_moments(&moments);
        let [e1, e2, e3] = [0, 1, 2].map(|i| ports.frame.column(i).into_owned());
        let mut spread = SMatrix::<f64, { 3 * PORTS }, 6>::zeros();
        for k in 0..PORTS {
            let modes = [
                e1 * even[k],
                e2 * even[k],
                e3 * even[k],
                e3 * along_y[k],
                e3 * -along_x[k],
                (e2 * along_x[k] - e1 * along_y[k]) * 0.5,
            ];
            for (m, force) in modes.iter().enumerate() {
                spread.fixed_view_mut::<3, 1>(3 * k, m).copy_from(force);
            }
        }
        let mut held = SMatrix::<f64, 6, 3>::zeros();
        held.fixed_rows_mut::<3>(0).copy_from(&ports.frame.transpose());
        Self { near, spread, held }
    }

    /// Sizes of the six tractions for every motion of the face, with `compliance` between the ports; `None` when
    /// it is not positive definite.
    pub(super) fn stiffness(&self, compliance: &DMatrix<f64>) -> Option<Matrix6<f64>> {
        let body = self.spread.transpose() * compliance * self.spread;
        (self.near + body).cholesky().map(|c| c.inverse())
    }

    /// Change of [`RigidFace::stiffness`] with the compliance.
    pub(super) fn stiffness_change(&self, stiffness: &Matrix6<f64>, change: &DMatrix<f64>) -> Matrix6<f64> {
        let carried = self.spread * stiffness;
        -(carried.transpose() * change * carried)
    }

    /// Motion of the face (local) that a displacement of the tip prescribes.
    pub(super) fn motion(&self, displacement: &Vec3) -> Vector6<f64> {
        self.held * displacement
    }

    /// Forces on the ports under tractions of these sizes.
    pub(super) fn on_ports(&self, sizes: &Vector6<f64>) -> SVector<f64, { 3 * PORTS }> {
        self.spread * sizes
    }

    /// Forces on the ports for each component of the displacement: `3 ports × 3`.
    pub(super) fn by_displacement(&self, stiffness: &Matrix6<f64>) -> DMatrix<f64> {
        let map = self.spread * stiffness * self.held;
        DMatrix::from_column_slice(3 * PORTS, 3, map.as_slice())
    }

    /// Forces on the ports that take a displacement of the ports back: `3 ports × 3 ports`.
    pub(super) fn tangent(&self, stiffness: &Matrix6<f64>) -> DMatrix<f64> {
        let map = self.spread * stiffness * self.spread.transpose();
        DMatrix::from_column_slice(3 * PORTS, 3 * PORTS, map.as_slice())
    }

    /// Normal displacement of the face on the half-space under its normal force (1/m).
    pub(super) fn normal_compliance(&self) -> f64 {
        self.near[(2, 2)]
    }
}

/// Normal stiffness of a bonded rigid disc over that of a smooth one: `(1 − ν) ln(3 − 4ν) / (1 − 2ν)` (Mossakovskii
/// 1954; Spence 1968).
fn bonded_over_smooth(nu: f64) -> f64 {
    let m = 1.0 - 2.0 * nu;
    // ln(1 + 2m) / m → 2 as the body becomes incompressible.
    if m < 1e-9 { 1.0 } else { (1.0 - nu) * (2.0 * m).ln_1p() / m }
}
