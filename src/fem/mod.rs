//! What the phantom does under a load.
//!
//! Symbols: `u` displacement (m), `E` Young's modulus (Pa), `ν` Poisson's ratio, `λ`, `μ` Lamé's constants,
//! `K₁` stiffness for `E = 1`, `C` compliance for `E = 1` (m·Pa/N = 1/m).

mod elasticity;
mod element;
mod space;

pub use elasticity::{cell_stiffness, lame, stress};
pub use element::{
    Order, TET_EDGES, TRIANGLE_EDGES, barycentric_gradients, gauss_legendre, tet_quadrature,
    triangle_quadrature,
};
pub use space::{Face, Space};
