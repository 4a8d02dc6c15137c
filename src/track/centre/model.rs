//! What a dot looks like: an ellipse of constant brightness on a plane of background, blurred by the optics.
//!
//! With d = p − c, u = A d and ρ = |u|, the rim is ρ = 1. To first order the distance of a pixel from the rim, positive inside, is
//! δ = (1 − ρ)/|∇ρ| with |∇ρ| = |A u|/ρ (Sampson 1982); it is exact for a circle. A straight edge blurred by a Gaussian of standard
//! deviation s is the normal distribution function Φ (the pixel's own size is part of s), so that
//!
//! ```text
//! I(p) = b₀ + bₓ(p − o)ₓ + b_y(p − o)_y + h Φ(δ/s),   clipped at white
//! ```
//!
//! For a rim of radius r the neglected curvature moves the edge by about s²/2r, evenly all round: it changes the radius, not the centre.

use nalgebra::{Matrix2, SVector, Vector2};

/// Numbers that describe a dot.
pub(super) const PARAMETERS: usize = 10;

/// Beyond this many blurs from the rim a pixel is inside or outside.
const REACH: f64 = 3.6;

/// White: what is brighter reads as this.
pub(super) const WHITE: f64 = 255.0;

/// A dot as numbers: centre (0, 1), A (2: a₁₁, 3: a₁₂, 4: a₂₂), height (5), blur (6), base (7) and its slopes (8, 9).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BlurredDisc(pub(super) SVector<f64, PARAMETERS>);

/// What the model says of a pixel, white not yet considered.
pub(super) enum Seen {
    /// Inside (Φ = 1) or outside (Φ = 0) by more than the reach of the blur: only height and base matter.
    Flat { value: f64, inside: bool },
    /// Near the rim.
    Edge { value: f64, gradient: [f64; PARAMETERS] },
}

impl BlurredDisc {
    /// From centre, second moments of the area inside the rim, height, blur and base.
    pub(super) fn from_moments(
        centre: Vector2<f64>,
        moments: Matrix2<f64>,
        height: f64,
        blur: f64,
        base: f64,
    ) -> Option<Self> {
        let a = inverse_root(4.0 * moments)?;
        let mut p = SVector::zeros();
        p[0] = centre.x;
        p[1] = centre.y;
        (p[2], p[3], p[4]) = (a[(0, 0)], a[(0, 1)], a[(1, 1)]);
        (p[5], p[6], p[7]) = (height, blur, base);
        Some(Self(p))
    }

    pub(super) fn centre(&self) -> Vector2<f64> {
        Vector2::new(self.0[0], self.0[1])
    }

    pub(super) fn height(&self) -> f64 {
        self.0[5]
    }

    pub(super) fn blur(&self) -> f64 {
        self.0[6]
    }

    pub(super) fn base(&self) -> f64 {
        self.0[7]
    }

    /// A: maps the rim to the unit circle.
    pub(super) fn to_circle(self) -> Matrix2<f64> {
        Matrix2::new(self.0[2], self.0[3], self.0[3], self.0[4])
    }

    /// Distance of a pixel from the rim (px, positive inside), for choosing pixels.
    pub(super) fn distance(&self, pixel: Vector2<f64>) -> f64 {
        let a = self.to_circle();
        let u = a * (pixel - self.centre());
        let rho = u.norm();
        if rho < 1e-9 {
            return 1.0 / a.trace().max(1e-9);
        }
        (1.0 - rho) * rho / (a * u).norm()
    }

    /// Squared radii ρ² between which a pixel may be near the rim: |∇ρ| is never more than the largest eigenvalue of A.
    pub(super) fn near(&self) -> [f64; 2] {
        let (half, apart) = (0.5 * (self.0[2] + self.0[4]), 0.5 * (self.0[2] - self.0[4]));
        let reach = REACH * self.blur() * (half + apart.hypot(self.0[3]));
        [(1.0 - reach).max(0.0).powi(2), (1.0 + reach).powi(2)]
    }

    /// Value and gradient at a pixel; `near` is that of this disc, `offset` is its place from the origin of the background plane.
    // Called for every pixel of every dot: a call would pass eleven numbers through memory.
    #[inline(always)]
    pub(super) fn see(&self, pixel: Vector2<f64>, offset: Vector2<f64>, near: [f64; 2]) -> Seen {
        let p = &self.0;
        let (a11, a12, a22, height, blur) = (p[2], p[3], p[4], p[5], p[6]);
        let (dx, dy) = (pixel.x - p[0], pixel.y - p[1]);
        let background = p[7] + p[8] * offset.x + p[9] * offset.y;
        let (u1, u2) = (a11 * dx + a12 * dy, a12 * dx + a22 * dy);
        let rho2 = u1 * u1 + u2 * u2;
        if rho2 <= near[0].max(1e-6) {
            return Seen::Flat { value: background + height, inside: true };
        }
        if rho2 >= near[1] {
            return Seen::Flat { value: background, inside: false };
        }
        // w = A u, v = A w.
        let (w1, w2) = (a11 * u1 + a12 * u2, a12 * u1 + a22 * u2);
        let w_square = w1 * w1 + w2 * w2;
        let rho = rho2.sqrt();
        let per_rho = 1.0 / rho;
        let per_w = 1.0 / w_square.sqrt();
        let distance = (1.0 - rho) * rho * per_w;
        let per_blur = 1.0 / blur;
        let t = distance * per_blur;
        if t >= REACH {
            return Seen::Flat { value: background + height, inside: true };
        }
        if t <= -REACH {
            return Seen::Flat { value: background, inside: false };
        }
        let (cumulative, density) = normal(t);
        let (v1, v2) = (a11 * w1 + a12 * w2, a12 * w1 + a22 * w2);
        // ∂δ = (1 − 2ρ)/|w| ∂ρ − (1 − ρ)ρ/|w|³ (w·∂w), with ρ∂ρ = u·∂u and ∂w = ∂A u + A ∂u.
        let along_rho = (1.0 - 2.0 * rho) * per_w * per_rho;
        let along_w = -distance * per_w * per_w;
        let change = |u_du: f64, w_dw: f64| along_rho * u_du + along_w * w_dw;
        let gain = height * density * per_blur;
        let gradient = [
            gain * change(-w1, -(a11 * v1 + a12 * v2)),
            gain * change(-w2, -(a12 * v1 + a22 * v2)),
            gain * change(u1 * dx, w1 * u1 + v1 * dx),
            gain * change(u1 * dy + u2 * dx, w1 * u2 + w2 * u1 + v1 * dy + v2 * dx),
            gain * change(u2 * dy, w2 * u2 + v2 * dy),
            cumulative,
            -gain * t,
            1.0,
            offset.x,
            offset.y,
        ];
        Seen::Edge { value: background + height * cumulative, gradient }
    }
}

/// Φ and φ of the standard normal distribution (Abramowitz & Stegun 1964, 26.2.17: |error| < 7.5e-8).
fn normal(t: f64) -> (f64, f64) {
    let density = 0.398_942_280_401_432_7 * (-0.5 * t * t).exp();
    let k = 1.0 / (1.0 + 0.231_641_9 * t.abs());
    let series = k
        * (0.319_381_530
            + k * (-0.356_563_782 + k * (1.781_477_937 + k * (-1.821_255_978 + k * 1.330_274_429))));
    let upper = density * series;
    (if t >= 0.0 { 1.0 - upper } else { upper }, density)
}

/// M^(−1/2) of a symmetric positive matrix; none of any other.
fn inverse_root(m: Matrix2<f64>) -> Option<Matrix2<f64>> {
    let determinant = m.determinant();
    if determinant.is_nan() || determinant <= 1e-12 || m.trace() <= 0.0 {
        return None;
    }
    // Cayley–Hamilton: √M = (M + √det M · 1)/√(tr M + 2√det M).
    let root_determinant = determinant.sqrt();
    let root = (m + Matrix2::identity() * root_determinant) / (m.trace() + 2.0 * root_determinant).sqrt();
    root.try_inverse()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilted() -> BlurredDisc {
        let moments = Matrix2::new(9.0, 1.5, 1.5, 5.0);
        let mut dot = BlurredDisc::from_moments(Vector2::new(3.2, -1.4), moments, 150.0, 0.9, 30.0)
            .expect("an ellipse");
        (dot.0[8], dot.0[9]) = (0.4, -0.7);
        dot
    }

    fn value(dot: &BlurredDisc, p: Vector2<f64>) -> f64 {
        match dot.see(p, p, dot.near()) {
            Seen::Flat { value, .. } | Seen::Edge { value, .. } => value,
        }
    }

    /// Against central differences, in every direction round the rim.
    #[test]
    fn the_gradient_is_that_of_central_differences() {
        let dot = tilted();
        let mut edges = 0;
        for y in -12..=12 {
            for x in -12..=12 {
                let p = Vector2::new(f64::from(x), f64::from(y));
                let Seen::Edge { gradient, .. } = dot.see(p, p, dot.near()) else { continue };
                edges += 1;
                for (k, derivative) in gradient.into_iter().enumerate() {
                    let h =
                        1e-4 * (1.0 + dot.0[k].abs()).min(2.0) * if (2..5).contains(&k) { 0.1 } else { 1.0 };
                    let (mut up, mut down) = (dot, dot);
                    up.0[k] += h;
                    down.0[k] -= h;
                    let difference = (value(&up, p) - value(&down, p)) / (2.0 * h);
                    // Φ is approximate to 7.5e-8, and the difference divides that by h.
                    let tolerance = 150.0 * 7.5e-8 / h + 2e-4 * derivative.abs() + 1e-3;
                    assert!((derivative - difference).abs() < tolerance, "{k}: {derivative} {difference}");
                }
            }
        }
        assert!(edges > 150, "{edges}");
    }

    #[test]
    fn the_distance_from_a_circle_is_exact() {
        let disc =
            BlurredDisc::from_moments(Vector2::new(1.0, 2.0), Matrix2::identity() * 9.0, 1.0, 1.0, 0.0)
                .expect("a disc");
        for (p, expected) in [([1.0, 9.0], -1.0), ([4.0, 6.0], 1.0), ([7.0, 2.0], 0.0)] {
            assert!((disc.distance(Vector2::from(p)) - expected).abs() < 1e-12);
        }
    }

    /// Table 26.1 of the same handbook.
    #[test]
    fn the_normal_distribution_is_that_of_the_tables() {
        for (t, phi) in [(0.0, 0.5), (1.0, 0.841_344_746), (-2.0, 0.022_750_132), (3.5, 0.999_767_371)] {
            assert!((normal(t).0 - phi).abs() < 1e-7);
        }
    }
}
