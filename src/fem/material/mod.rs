//! What stress a deformation causes: compressible elastic laws as functions of the displacement gradient.
//!
//! # Symbols
//! - `H` = ∇u, `H_iJ = ∂u_i/∂X_J`: displacement gradient (3×3, –), the input of every law.
//! - `F` = I + H: deformation gradient; `J` = det F; `Ī₁` = J^(−2/3) tr(FᵀF).
//! - `W`: stored energy per undeformed volume (J/m³).
//! - `P` = ∂W/∂F: first Piola–Kirchhoff stress (3×3, Pa), force per undeformed area.
//! - `A` = ∂P/∂F: consistent tangent (9×9, Pa), component (i, J) at row or column 3·i + J.
//! - `E`, `ν`: Young's modulus (Pa) and Poisson's ratio (–) at small strain; `μ`, `κ` as in [`Moduli`].
//!
//! Why ∇u and not F: at a strain of 1e-9 the entries of F have seven digits of strain left; ∇u has them all.
//!
//! The path to read: [`Material::response`] → `kinematics` (the invariants and their derivatives) → one file a
//! law (`neo_hookean`, `yeoh`, `fung`: the isochoric part as a function of Ī₁ − 3; `linear`: small strain).

mod error;
mod fung;
mod isochoric;
mod kinematics;
mod linear;
mod moduli;
mod neo_hookean;
mod response;
mod yeoh;

pub use error::MaterialError;
pub use moduli::Moduli;
pub use response::{Law, Material, Parameter, Response, Tangent};
