//! What the phantom does under a load.
//!
//! Symbols: `u` displacement (m), `E` Young's modulus (Pa), `ν` Poisson's ratio, `λ`, `μ` Lamé's constants,
//! `K₁` stiffness for `E = 1`, `C` compliance for `E = 1` (m·Pa/N = 1/m).

mod cells;
mod complementarity;
mod discretise;
mod elasticity;
mod element;
mod elliptic;
mod error;
mod even;
pub mod finite;
mod half_space;
pub mod material;
mod model;
mod near;
mod ports;
mod punch;
mod rigid_face;
mod size_field;
mod skeleton;
mod space;
mod sphere;
mod spot;
mod tip;
mod variation;
mod wrench;

pub use discretise::{Discretisation, Resolution, coarseness, discretise, needs_small_edges};
pub use elasticity::{cell_stiffness, lame, stress};
pub use element::{
    Order, TET_EDGES, TRIANGLE_EDGES, barycentric_gradients, gauss_legendre, tet_quadrature,
    triangle_quadrature,
};
pub use error::FemError;
pub use half_space::{LoadedDisc, Profile, disc_self_compliance, point_displacement, point_gradient};
pub use model::{Model, Response};
pub use near::Near;
pub use punch::turning_compliance;
pub use space::{Face, Space};
pub use spot::{Functional, Spot, SpotKind};
pub use tip::{Pressed, Tip, TipFace};
pub use variation::{Constants, Loose, Moments, NodalForces, Part, Stiffness, Varied, nodal_loads, readings};
pub use wrench::wrench_loads;
