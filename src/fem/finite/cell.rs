//! What one cell contributes: displacement of its nodes → energy, nodal forces, tangent.
//!
//! Total Lagrangian: energy ∫ W dV, force on node a fₐ = ∫ P ∇Nₐ dV (N), tangent
//! K_ab,ik = ∫ ∂_J Nₐ A_iJkL ∂_L N_b dV (N/m), over the undeformed cell (Bonet & Wood 2008, sections 9.2 to 9.4,
//! pulled back). Quadrature: one point on P1, where ∇u is constant; four points on P2, exact for the linear
//! stiffness and of the order of the element at finite strain.

use crate::fem::material::{Material, MaterialError, Parameter, Tangent};
use crate::fem::{Order, barycentric_gradients, tet_quadrature};
use crate::geometry::{Mat3, Vec3};

/// Components of the largest cell.
pub(super) const SIDE: usize = 30;

/// What a cell is: its number, its element, its corners (m), its material and the multiple of its modulus (–).
pub(super) struct Cell<'a> {
    pub(super) index: usize,
    pub(super) order: Order,
    pub(super) corners: [Vec3; 4],
    pub(super) material: &'a Material,
    pub(super) relative_modulus: f64,
}

/// Energy (J) and nodal forces (N) of a cell; force `3 a + i` on axis i of local node a.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellForce {
    pub(super) energy: f64,
    pub(super) force: [f64; SIDE],
    /// What the forces would be if all of ∇u were strain (N, the same for every component). In a body that
    /// mostly turns the true forces are far smaller, down to the rounding of this.
    pub(super) unturned: f64,
}

impl CellForce {
    pub(super) const ZERO: Self = Self { energy: 0.0, force: [0.0; SIDE], unturned: 0.0 };
}

impl Cell<'_> {
    /// Energy and forces at the nodal displacements `u` (m, 3 components a node).
    pub(super) fn force(&self, u: &[f64]) -> Result<CellForce, MaterialError> {
        let mut out = CellForce::ZERO;
        let moduli = self.material.moduli();
        let stiffest = moduli.bulk() + 4.0 / 3.0 * moduli.shear();
        self.each_point(|gradients, weight| {
            let h = gradient_of(u, gradients);
            let (energy, stress) = self.material.stress(&h)?;
            let steepest = gradients.iter().map(|g| g.norm_squared()).fold(0.0, f64::max).sqrt();
            out.energy += weight * energy;
            out.unturned += weight * stiffest * h.norm() * steepest;
            add_force(&mut out.force, &stress, gradients, weight);
            Ok(())
        })?;
        Ok(out)
    }

    /// The tangent (N/m) at `u` into `stiffness`: row-major, side 3 × nodes, both triangles.
    pub(super) fn tangent(&self, u: &[f64], stiffness: &mut [f64]) -> Result<(), MaterialError> {
        stiffness.fill(0.0);
        self.each_point(|gradients, weight| {
            let response = self.material.response(&gradient_of(u, gradients))?;
            add_stiffness(stiffness, &response.tangent, gradients, weight);
            Ok(())
        })?;
        let side = 3 * self.order.cell_nodes();
        for row in 0..side {
            for column in 0..row {
                stiffness[column * side + row] = stiffness[row * side + column];
            }
        }
        Ok(())
    }

    /// ∂(forces)/∂(parameter) at fixed displacement (N per unit of the parameter); its energy is not formed.
    pub(super) fn sensitivity(&self, u: &[f64], parameter: Parameter) -> Result<CellForce, MaterialError> {
        let mut out = CellForce::ZERO;
        self.each_point(|gradients, weight| {
            let stress = self.material.stress_sensitivity(&gradient_of(u, gradients), parameter)?;
            add_force(&mut out.force, &stress, gradients, weight);
            Ok(())
        })?;
        Ok(out)
    }

    /// The smallest volume ratio J at the corners, where ∇u of a straight-edged cell is extreme.
    pub(super) fn least_volume_ratio(&self, u: &[f64]) -> f64 {
        let (gradient, _) = barycentric_gradients(&self.corners);
        let at_corner = |i: usize| {
            let l = std::array::from_fn(|j| f64::from(u8::from(i == j)));
            let gradients = self.order.cell_gradient(l, &gradient);
            (Mat3::identity() + gradient_of(u, &gradients[..self.order.cell_nodes()])).determinant()
        };
        (0..4).map(at_corner).fold(f64::INFINITY, f64::min)
    }

    /// Visits the quadrature points: gradients of the shape functions (1/m), weight (m³ × relative modulus).
    fn each_point(
        &self,
        mut visit: impl FnMut(&[Vec3], f64) -> Result<(), MaterialError>,
    ) -> Result<(), MaterialError> {
        let (gradient, volume) = barycentric_gradients(&self.corners);
        for (l, weight) in tet_quadrature(self.order.stiffness_degree()) {
            let gradients = self.order.cell_gradient(l, &gradient);
            visit(&gradients[..self.order.cell_nodes()], weight * volume * self.relative_modulus)?;
        }
        Ok(())
    }
}

/// ∇u = Σ uₐ ⊗ ∇Nₐ.
fn gradient_of(u: &[f64], gradients: &[Vec3]) -> Mat3 {
    let mut h = Mat3::zeros();
    for (a, g) in gradients.iter().enumerate() {
        for i in 0..3 {
            for j in 0..3 {
                h[(i, j)] += u[3 * a + i] * g[j];
            }
        }
    }
    h
}

fn add_force(force: &mut [f64; SIDE], stress: &Mat3, gradients: &[Vec3], weight: f64) {
    for (a, g) in gradients.iter().enumerate() {
        let f = stress * g * weight;
        for i in 0..3 {
            force[3 * a + i] += f[i];
        }
    }
}

/// Adds the blocks K_ab with b ≤ a: first A ∇N_b for each b, then ∇Nₐ against it.
fn add_stiffness(stiffness: &mut [f64], tangent: &Tangent, gradients: &[Vec3], weight: f64) {
    let side = 3 * gradients.len();
    for (b, g) in gradients.iter().enumerate() {
        let mut half = [[0.0; 3]; 9];
        for (k, l) in (0..3).flat_map(|k| (0..3).map(move |l| (k, l))) {
            let factor = weight * g[l];
            for (row, half) in half.iter_mut().enumerate() {
                half[k] += tangent[(row, 3 * k + l)] * factor;
            }
        }
        for (a, g) in gradients.iter().enumerate().skip(b) {
            for i in 0..3 {
                let row = &mut stiffness[(3 * a + i) * side + 3 * b..][..3];
                for (k, entry) in row.iter_mut().enumerate() {
                    *entry += g[0] * half[3 * i][k] + g[1] * half[3 * i + 1][k] + g[2] * half[3 * i + 2][k];
                }
            }
        }
    }
}
