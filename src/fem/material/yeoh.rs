//! Yeoh solid of second order: W = μ/2 ((Ī₁ − 3) + c₂ (Ī₁ − 3)²) + κ/2 (J − 1)² (Yeoh 1993, two terms).
//!
//! h(i) = i + c₂ i², h′ = 1 + 2 c₂ i, h″ = 2 c₂, ∂h′/∂c₂ = 2 i. With c₂ = 0 this is neo-Hookean. With c₂ < 0
//! the law softens and loses stability at i = −1/(2 c₂); it is not refused, the solver reports the loss.

use super::isochoric::Isochoric;

/// h(i) for the stiffening c₂ (–).
pub(super) fn isochoric(i: f64, c2: f64) -> Isochoric {
    Isochoric { value: i + c2 * i * i, slope: 1.0 + 2.0 * c2 * i, curvature: 2.0 * c2, slope_growth: 2.0 * i }
}
