//! Linear elasticity at small strain, in the same interface as the finite-strain laws.
//!
//! ε = ½(H + Hᵀ), W = μ dev ε : dev ε + κ/2 (tr ε)², P = 2μ dev ε + κ tr ε I, A constant. It is the limit of
//! every other law here, and not objective: a rotation of angle θ causes strains of order θ²/2.

use super::{Moduli, Response, Tangent};
use crate::geometry::Mat3;

/// Energy, stress and tangent at the displacement gradient `h`.
pub(super) fn response(moduli: &Moduli, h: &Mat3) -> Response {
    let (energy, shear, bulk) = parts(moduli, h);
    Response { energy, stress: shear + bulk, tangent: tangent(moduli) }
}

/// Energy (J/m³), and the stresses (Pa) that are in proportion to μ and to κ.
pub(super) fn parts(moduli: &Moduli, h: &Mat3) -> (f64, Mat3, Mat3) {
    let (mu, kappa) = (moduli.shear(), moduli.bulk());
    let strain = 0.5 * (h + h.transpose());
    let trace = strain.trace();
    let deviator = strain - Mat3::from_diagonal_element(trace / 3.0);
    let energy = mu * deviator.norm_squared() + 0.5 * kappa * trace * trace;
    (energy, 2.0 * mu * deviator, Mat3::from_diagonal_element(kappa * trace))
}

/// A_iJkL = μ(δ_ik δ_JL + δ_iL δ_Jk) + (κ − 2μ/3) δ_iJ δ_kL.
fn tangent(moduli: &Moduli) -> Tangent {
    let (mu, kappa) = (moduli.shear(), moduli.bulk());
    let lambda = kappa - 2.0 * mu / 3.0;
    let delta = |a: usize, b: usize| f64::from(u8::from(a == b));
    Tangent::from_fn(|row, column| {
        let (i, j, k, l) = (row / 3, row % 3, column / 3, column % 3);
        mu * (delta(i, k) * delta(j, l) + delta(i, l) * delta(j, k)) + lambda * delta(i, j) * delta(k, l)
    })
}
