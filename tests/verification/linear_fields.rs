//! Displacement fields with known derivatives, and how far a nodal displacement is from one.

use phantom_rig::fem::{Space, barycentric_gradients, stress, tet_quadrature};
use phantom_rig::geometry::{Mat3, Vec3};

/// A displacement with its first and second derivatives.
pub(crate) trait Field {
    fn value(&self, p: &Vec3) -> Vec3;
    /// `[i, j] = ∂uᵢ/∂xⱼ`.
    fn gradient(&self, p: &Vec3) -> Mat3;
    /// Entry `i`: second derivatives of `uᵢ`.
    fn curvature(&self, p: &Vec3) -> [Mat3; 3];

    /// The body force that keeps the field in equilibrium, `b = −div σ = −(λ + μ) ∇(div u) − μ ∇²u`, for a unit
    /// Young's modulus.
    fn body_force(&self, p: &Vec3, nu: f64) -> Vec3 {
        let (lambda, mu) = phantom_rig::fem::lame(nu);
        let h = self.curvature(p);
        Vec3::from_fn(|i, _| {
            let slope_of_divergence: f64 = (0..3).map(|j| h[j][(j, i)]).sum();
            -(lambda + mu) * slope_of_divergence - mu * h[i].trace()
        })
    }
}

/// `uᵢ = sᵢ + Gᵢ·x + ½ xᵀ Hᵢ x`.
pub(crate) struct Quadratic {
    pub(crate) shift: Vec3,
    pub(crate) slope: Mat3,
    pub(crate) curvature: [Mat3; 3],
}

impl Field for Quadratic {
    fn value(&self, p: &Vec3) -> Vec3 {
        let bent = Vec3::from_fn(|i, _| 0.5 * p.dot(&(self.curvature[i] * p)));
        self.shift + self.slope * p + bent
    }

    fn gradient(&self, p: &Vec3) -> Mat3 {
        let bent = self.curvature.map(|h| (h * p).transpose());
        self.slope + Mat3::from_rows(&bent)
    }

    fn curvature(&self, _: &Vec3) -> [Mat3; 3] {
        self.curvature
    }
}

/// `uᵢ = sin(kᵢ·x + φᵢ)`.
pub(crate) struct Waves {
    pub(crate) wave: [Vec3; 3],
    pub(crate) phase: [f64; 3],
}

impl Waves {
    fn angle(&self, i: usize, p: &Vec3) -> f64 {
        self.wave[i].dot(p) + self.phase[i]
    }
}

impl Field for Waves {
    fn value(&self, p: &Vec3) -> Vec3 {
        Vec3::from_fn(|i, _| self.angle(i, p).sin())
    }

    fn gradient(&self, p: &Vec3) -> Mat3 {
        Mat3::from_fn(|i, j| self.wave[i][j] * self.angle(i, p).cos())
    }

    fn curvature(&self, p: &Vec3) -> [Mat3; 3] {
        std::array::from_fn(|i| self.wave[i] * self.wave[i].transpose() * -self.angle(i, p).sin())
    }
}

/// Values at the nodes, `[3 n + i]`.
pub(crate) fn at_nodes(space: &Space, field: &impl Field) -> Vec<f64> {
    space.nodes().iter().flat_map(|p| <[f64; 3]>::from(field.value(p))).collect()
}

/// Distance of a nodal displacement from a field: in L², and in energy `√∫ σ(e) : ε(e)` for a unit modulus.
pub(crate) fn distance(space: &Space, nodal: &[f64], field: &impl Field, nu: f64) -> [f64; 2] {
    let rule = tet_quadrature(6);
    let (mut square, mut energy) = (0.0, 0.0);
    for (cell, nodes) in space.cells().enumerate() {
        let corners = space.corners(cell as u32);
        let (gradient, volume) = barycentric_gradients(&corners);
        for (l, w) in &rule {
            let p: Vec3 = corners.iter().zip(l).map(|(c, l)| c * *l).sum();
            let (mut u, mut slope) = (Vec3::zeros(), Mat3::zeros());
            let (shape, slopes) = (space.order().cell_shape(*l), space.order().cell_gradient(*l, &gradient));
            for ((&node, n), g) in nodes.iter().zip(shape).zip(slopes) {
                let value = Vec3::from_fn(|i, _| nodal[3 * node as usize + i]);
                u += value * n;
                slope += value * g.transpose();
            }
            let gap = slope - field.gradient(&p);
            square += w * volume * (u - field.value(&p)).norm_squared();
            energy += w * volume * stress(&gap, nu).dot(&gap);
        }
    }
    [square.sqrt(), energy.sqrt()]
}
