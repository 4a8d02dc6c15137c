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
use wide::f32x8;

/// Numbers that describe a dot.
pub(super) const PARAMETERS: usize = 10;

/// Those, and how the light on the dot changes across it: h (1 + g·(p − c)), where g is always 0.
pub(super) const TERMS: usize = PARAMETERS + 2;

/// Beyond this many blurs from the rim a pixel is inside or outside.
const REACH: f32 = 3.6;

/// White: what is brighter reads as this.
pub(super) const WHITE: f64 = 255.0;

/// A dot as numbers: centre (0, 1), A (2: a₁₁, 3: a₁₂, 4: a₂₂), height (5), blur (6), base (7) and its slopes (8, 9).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BlurredDisc(pub(super) SVector<f64, PARAMETERS>);

/// What the model says of eight pixels, white not yet considered. Single precision resolves a ten-thousandth of a grey level, and takes
/// eight at a time.
pub(super) struct Seen {
    pub(super) value: f32x8,
    /// By the parameters, and by g.
    pub(super) gradient: [f32x8; TERMS],
    /// All of them are inside or outside: where the rim is does not matter to them.
    pub(super) flat: bool,
}

/// What a disc is to its pixels, in single precision and from an origin close by.
#[derive(Clone, Copy)]
pub(super) struct Near {
    centre: [f32; 2],
    a: [f32; 3],
    height: f32,
    per_blur: f32,
    background: [f32; 3],
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

    /// For pixels whose places are told from `origin`, which is also that of the background's plane.
    pub(super) fn near(&self, origin: Vector2<f64>) -> Near {
        let p = &self.0;
        let centre = self.centre() - origin;
        Near {
            centre: [centre.x as f32, centre.y as f32],
            a: [p[2] as f32, p[3] as f32, p[4] as f32],
            height: p[5] as f32,
            per_blur: (1.0 / p[6]) as f32,
            background: [p[7] as f32, p[8] as f32, p[9] as f32],
        }
    }
}

/// Where eight pixels are to the rim.
struct ToRim {
    /// d = p − c.
    from_centre: [f32x8; 2],
    /// u = A d, ρ = |u| and w = A u.
    u: [f32x8; 2],
    rho: f32x8,
    w: [f32x8; 2],
    per_w: f32x8,
    /// δ (px, positive inside).
    distance: f32x8,
}

impl Near {
    /// Distances of eight pixels from the rim (px, positive inside; at the very centre merely large).
    pub(super) fn distance(&self, x: f32x8, y: f32x8) -> f32x8 {
        self.rim_seen(x, y).distance
    }

    #[inline(always)]
    fn rim_seen(&self, x: f32x8, y: f32x8) -> ToRim {
        let one = f32x8::ONE;
        let [a11, a12, a22] = self.a.map(f32x8::splat);
        let (dx, dy) = (x - f32x8::splat(self.centre[0]), y - f32x8::splat(self.centre[1]));
        let (u1, u2) = (a11 * dx + a12 * dy, a12 * dx + a22 * dy);
        // At the very centre ρ has no direction; the rim is far from there.
        let rho = (u1 * u1 + u2 * u2).fast_max(f32x8::splat(1e-6)).sqrt();
        let (w1, w2) = (a11 * u1 + a12 * u2, a12 * u1 + a22 * u2);
        let per_w = one / (w1 * w1 + w2 * w2).fast_max(f32x8::splat(1e-12)).sqrt();
        let distance = (one - rho) * rho * per_w;
        ToRim { from_centre: [dx, dy], u: [u1, u2], rho, w: [w1, w2], per_w, distance }
    }

    /// Values and gradients at eight pixels.
    // Called for every eight pixels of every dot: a call would pass their gradients through memory.
    #[inline(always)]
    pub(super) fn see(&self, x: f32x8, y: f32x8) -> Seen {
        let one = f32x8::ONE;
        let [a11, a12, a22] = self.a.map(f32x8::splat);
        let (height, per_blur) = (f32x8::splat(self.height), f32x8::splat(self.per_blur));
        let [base, slope_x, slope_y] = self.background.map(f32x8::splat);
        let background = base + slope_x * x + slope_y * y;
        let ToRim { from_centre: [dx, dy], u: [u1, u2], rho, w: [w1, w2], per_w, distance } =
            self.rim_seen(x, y);
        let t = distance * per_blur;
        let far = t.abs().simd_ge(f32x8::splat(REACH));
        if far.all() {
            let inside = t.simd_ge(f32x8::ZERO).select(one, f32x8::ZERO);
            let (light, zero) = (height * inside, f32x8::ZERO);
            let gradient = [zero, zero, zero, zero, zero, inside, zero, one, x, y, light * dx, light * dy];
            return Seen { value: background + light, gradient, flat: true };
        }
        let (cumulative, density) = normal(t, far);
        // v = A w.
        let (v1, v2) = (a11 * w1 + a12 * w2, a12 * w1 + a22 * w2);
        // ∂δ = (1 − 2ρ)/|w| ∂ρ − (1 − ρ)ρ/|w|³ (w·∂w), with ρ∂ρ = u·∂u and ∂w = ∂A u + A ∂u.
        let gain = height * density * per_blur;
        let along_rho = gain * (one - rho - rho) * per_w / rho;
        let along_w = -gain * distance * per_w * per_w;
        let change = |u_du: f32x8, w_dw: f32x8| along_rho * u_du + along_w * w_dw;
        let light = height * cumulative;
        let gradient = [
            change(-w1, -(a11 * v1 + a12 * v2)),
            change(-w2, -(a12 * v1 + a22 * v2)),
            change(u1 * dx, w1 * u1 + v1 * dx),
            change(u1 * dy + u2 * dx, w1 * u2 + w2 * u1 + v1 * dy + v2 * dx),
            change(u2 * dy, w2 * u2 + v2 * dy),
            cumulative,
            -gain * t,
            one,
            x,
            y,
            light * dx,
            light * dy,
        ];
        Seen { value: background + light, gradient, flat: false }
    }
}

/// Φ and φ of the standard normal distribution (Abramowitz & Stegun 1964, 26.2.17: |error| < 7.5e-8); where `far`, 0 or 1 and 0.
#[inline(always)]
fn normal(t: f32x8, far: f32x8) -> (f32x8, f32x8) {
    let one = f32x8::ONE;
    let density =
        far.select(f32x8::ZERO, f32x8::splat(0.398_942_3) * exponential(t * t * f32x8::splat(-0.5)));
    let k = one / (one + f32x8::splat(0.231_641_9) * t.abs());
    let terms = [1.330_274_4, -1.821_255_9, 1.781_477_9, -0.356_563_78, 0.319_381_53];
    let series = terms.into_iter().fold(f32x8::ZERO, |sum, term| (sum + f32x8::splat(term)) * k);
    let upper = density * series;
    (t.simd_ge(f32x8::ZERO).select(one - upper, upper), density)
}

/// eˣ for −½ REACH² ≤ x ≤ 0, to 2e-6 of itself: Taylor's series of a sixteenth, squared four times.
#[inline(always)]
fn exponential(x: f32x8) -> f32x8 {
    let part = x * f32x8::splat(1.0 / 16.0);
    let per_factorial = [1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    let series = per_factorial.into_iter().fold(f32x8::ZERO, |sum, term| sum * part + f32x8::splat(term));
    (0..4).fold(series, |power, _| power * power)
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

    /// The model once more, in double precision and one pixel at a time.
    fn value(dot: &BlurredDisc, [gx, gy]: [f64; 2], p: Vector2<f64>) -> f64 {
        let light = 1.0 + gx * (p.x - dot.0[0]) + gy * (p.y - dot.0[1]);
        let t = dot.distance(p) / dot.blur();
        let share = 0.5 * statrs::function::erf::erfc(-t / 2.0_f64.sqrt());
        dot.base() + dot.0[8] * p.x + dot.0[9] * p.y + dot.height() * light * share
    }

    /// Values, and gradients against central differences, in every direction round the rim.
    #[test]
    fn the_gradient_is_that_of_central_differences() {
        let dot = tilted();
        let near = dot.near(Vector2::zeros());
        let (mut edges, mut inside, mut least) = (0, 0, [f64::INFINITY, f64::NEG_INFINITY]);
        for y in -12..=12_i16 {
            for x in -12..=12_i16 {
                let p = Vector2::new(f64::from(x), f64::from(y));
                let seen = near.see(f32x8::splat(f32::from(x)), f32x8::splat(f32::from(y)));
                let t = dot.distance(p) / dot.blur();
                let seen_value = f64::from(seen.value.to_array()[3]);
                least = [least[0].min(seen_value), least[1].max(seen_value)];
                // Beyond the reach of the blur: Φ(3.6) = 1 − 1.6e-4.
                let cut = if t.abs() < 3.6 { 0.0 } else { 1.6e-4 * dot.height() };
                let off = seen_value - value(&dot, [0.0; 2], p);
                assert!(off.abs() < 3e-4 + cut, "{x} {y}: {off}");
                // Between these the model forgets the blur, which still tells a little.
                if (3.5..5.0).contains(&t.abs()) {
                    continue;
                }
                edges += usize::from(t.abs() < 3.5);
                inside += usize::from(t > 5.0);
                for (k, derivative) in seen.gradient.into_iter().enumerate() {
                    // Far from the rim its place tells next to nothing, but not nothing.
                    if t.abs() > 3.5 && (k < 5 || k == 6) {
                        continue;
                    }
                    let derivative = f64::from(derivative.to_array()[3]);
                    let (mut up, mut down, mut g) = (dot, dot, [0.0; 2]);
                    let h = if k < PARAMETERS { 1e-5 * (1.0 + dot.0[k].abs()) } else { 1e-5 };
                    if k < PARAMETERS {
                        up.0[k] += h;
                        down.0[k] -= h;
                    } else {
                        g[k - PARAMETERS] = h;
                    }
                    let difference = (value(&up, g, p) - value(&down, g.map(|g| -g), p)) / (2.0 * h);
                    let tolerance = 1e-4 * derivative.abs() + 2e-3;
                    assert!((derivative - difference).abs() < tolerance, "{k}: {derivative} {difference}");
                }
            }
        }
        assert!(
            edges > 150 && inside > 1 && least[0] < 30.0 && least[1] > 175.0,
            "{edges} {inside} {least:?}"
        );
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
}
