//! The two-step method of Xu, Lei and others (2021, section 2.2) as it stands: the baseline.
//!
//! Step one ([`StepOne`]) takes the displacements of all search nodes as unknown boundary data and finds them
//! together with Young's modulus from the observed displacements by a regularised Gauss–Newton iteration.
//! Step two ([`search_forces`], [`reactions`], [`equivalent_stiffness`]) asks which forces at the search
//! nodes go with those displacements and divides the one by the other. [`fit_recording`] runs both on the pokes of a
//! recording.
//!
//! # How the printed formulas were read
//! Equation numbers are the paper's. `W = [E; S]`, `O` observed, `hat` modelled; `B = ∂U/∂W`, `A = P_O B`.
//! - **Sensitivities.** The paper takes finite differences. Here `O(E, S) = c / E + G S` exactly, so that the
//!   columns of `S` are constant and the column of `E` is `−c / E²`.
//! - **K_E (4)** is printed as the scalar `UᵀKU`, where (3) adds it to a matrix. As a scalar times the unit
//!   matrix it would cancel: (6) divides by its norm, which leaves the unit-matrix method. Since (5) writes
//!   `U = B W`, the same energy is `Wᵀ(BᵀKB)W`; so `K_E = BᵀKB` is used, the energy's Hessian with respect to
//!   `W`. Displacements that follow prescribed search nodes and those that follow the load are orthogonal in
//!   energy, so it is block-diagonal: `E C_SS⁻¹` (the stiffness condensed on the search nodes) and `w / E³`
//!   with `w = E²` times the energy norm of the load's share.
//! - **α (6)** is read with the minus sign that the source lost: `α = ‖A‖² δₙ / ((‖O‖ − δₙ) ‖K_R‖)`, spectral
//!   norms, `δₙ` the norm of the error in `O`, as ‖O‖ asks for. It follows `A` and `K_R` from step to step.
//! - **First stop.** `‖O − Ô‖ / Nₒ < 2δ` only has a meaning when both sides are per point: root mean squares
//!   here, the discrepancy principle with factor 2. Read literally with the norm of the error it holds at the
//!   start for 40 dB and below.
//! - **Second stop.** The relative change of `Ψ` counts by its modulus; as printed every decrease would stop.
//! - **Both must hold** ([`Joined::Both`]). If either sufficed, the first would end the iteration after one or
//!   two steps with the modulus still on its way: 20 % low at 20 dB and 3 % low at 40 dB on the block of section
//!   3.1, where the paper reports less than 2 % throughout. With both, its figures come out: over 50 seeds the
//!   median modulus within 2 % at every noise level, Φ½ below 0.1 m, and no convergence without regularisation,
//!   with the displacements on their bounds.
//! - **Bounds.** Displacements are cut to ± the bound after each step, the modulus to 1/1000 and 1000 times
//!   the start, so that it stays positive.
//! - **U in (9)** is the measured displacement at the observed nodes; with step one's model in its place the
//!   sums of stiffness change by less than 1 % at 30 dB and above.
//! - **λ (11)** uses the maximum norm, as the solver that the paper cites does.
//! - **One stiffness from a force and a displacement.** `k = −f·u / |u|²`, the least-squares spring for the
//!   force on the body `f = −k u`.

mod basis;
mod bench;
mod gather;
mod measure;
mod recording;
#[cfg(test)]
mod recording_tests;
mod remarks;
mod spectrum;
mod sprung;
mod step_one;
mod step_two;
#[cfg(test)]
mod tests;
mod variant;
mod views;

pub use recording::fit_recording;
pub use step_one::{Joined, Regularisation, Start, StepOne, StepOneFit, StepOneRules};
pub use step_two::{equivalent_stiffness, reactions, search_forces};
pub use variant::Variant;
