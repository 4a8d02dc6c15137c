//! The shape-changing part of a law as a function of one number, i = Ī₁ − 3.
//!
//! Every finite-strain law here is W = μ/2 · h(i) + κ/2 (J − 1)², with h(0) = 0 and h′(0) = 1, so that μ and κ
//! are the small-strain moduli whatever the stiffening.

/// `h` and its derivatives at one `i` (all –).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Isochoric {
    /// h.
    pub(super) value: f64,
    /// h′ = dh/di.
    pub(super) slope: f64,
    /// h″ = d²h/di².
    pub(super) curvature: f64,
    /// ∂h′/∂(stiffening).
    pub(super) slope_growth: f64,
}
