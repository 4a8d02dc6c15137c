//! Neo-Hookean solid: W = μ/2 (Ī₁ − 3) + κ/2 (J − 1)².
//!
//! Entropic network of Gaussian chains (Treloar 1943), with the isochoric invariant of Flory (1961) and a
//! penalty on the volume. h(i) = i, so h′ = 1, h″ = 0: the stress in shear is linear in the shear.

use super::isochoric::Isochoric;

/// h(i) = i.
pub(super) fn isochoric(i: f64) -> Isochoric {
    Isochoric { value: i, slope: 1.0, curvature: 0.0, slope_growth: 0.0 }
}
