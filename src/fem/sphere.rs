//! A rigid sphere on the half-space, in closed form (Sneddon 1965): contact radius → depth.
//!
//! `δ(a) = a/2 · ln((R + a)/(R − a))`, of which Hertz's `a²/R` is the beginning. The force follows by pressing with
//! the growing contact: `dP/dδ` is that of a rigid flat disc of radius `a`.

/// How much farther a sphere of `sphere` (m) reaches at `rho` from its lowest point (m), than there.
pub(super) fn recess(sphere: f64, rho: f64) -> f64 {
    let rho = rho.min(sphere);
    rho * rho / (sphere + (sphere * sphere - rho * rho).sqrt())
}

/// Depth (m) at which the contact has radius `a`.
pub(super) fn depth(sphere: f64, a: f64) -> f64 {
    a * (a / sphere).atanh()
}

/// Growth of [`depth`] with `a`.
pub(super) fn depth_rate(sphere: f64, a: f64) -> f64 {
    (a / sphere).atanh() + a * sphere / (sphere * sphere - a * a)
}

/// Force (N/Pa) on a half-space of unit modulus, by the contact radius:
/// `((a² + R²) atanh(a/R) − a R) / (1 − ν²)`.
pub(super) fn force(sphere: f64, a: f64, nu: f64) -> f64 {
    let t = a / sphere;
    // The difference of two nearly equal terms: 4/3 t³ + 8/15 t⁵ + … for a small contact.
    let sum = if t < 0.05 {
        let s = t * t;
        t * s * (4.0 / 3.0 + s * (8.0 / 15.0 + s * 12.0 / 35.0))
    } else {
        (1.0 + t * t) * t.atanh() - t
    };
    sphere * sphere * sum / (1.0 - nu * nu)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `dP = 2a/(1 − ν²) dδ`, and Hertz's `4/3 √R δ^1.5 / (1 − ν²)` for a small depth.
    #[test]
    fn the_force_grows_as_that_of_a_flat_disc() {
        let (r, nu, h) = (0.005, 0.3, 1e-8);
        for a in [0.0002, 0.0015, 0.004] {
            let d_force = (force(r, a + h, nu) - force(r, a - h, nu)) / (2.0 * h);
            let d_depth = (depth(r, a + h) - depth(r, a - h)) / (2.0 * h);
            assert!((d_depth / depth_rate(r, a) - 1.0).abs() < 1e-6);
            assert!((d_force / d_depth * (1.0 - nu * nu) / (2.0 * a) - 1.0).abs() < 1e-5, "{a}");
        }
        let a = 1e-2 * r;
        let hertz = 4.0 / 3.0 * r.sqrt() * depth(r, a).powf(1.5) / (1.0 - nu * nu);
        assert!((force(r, a, nu) / hertz - 1.0).abs() < 1e-4);
        assert!((recess(r, 0.1 * r) - (r - (r * r - 0.01 * r * r).sqrt())).abs() < 1e-15);
    }
}
