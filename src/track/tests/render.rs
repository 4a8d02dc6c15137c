//! Pictures of dots whose answers are known, by a way of its own: outlines as polygons, integrated over pixels and blurred by a Gaussian,
//! row by row in closed form across and by Gauss–Legendre quadrature down.

use super::random::Noise;

/// A picture in floating point: grey levels before noise and rounding.
pub(crate) struct Canvas {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) light: Vec<f64>,
}

/// Error function: power series, and continued fraction for the tail (Abramowitz & Stegun 1964, 7.1.6 and 7.1.14).
fn erf(x: f64) -> f64 {
    let a = x.abs();
    let value = if a < 3.0 {
        let (mut term, mut sum, mut n) = (a, a, 0.0);
        while term > 1e-17 * sum && sum > 0.0 {
            n += 1.0;
            term *= 2.0 * a * a / (2.0 * n + 1.0);
            sum += term;
        }
        std::f64::consts::FRAC_2_SQRT_PI * (-a * a).exp() * sum
    } else {
        let mut fraction = a;
        for k in (1..60).rev() {
            fraction = a + 0.5 * f64::from(k) / fraction;
        }
        1.0 - (-a * a).exp() / (fraction * std::f64::consts::PI.sqrt())
    };
    value.copysign(x)
}

/// A pixel's response to light at a distance along one axis: a box of one pixel blurred by a Gaussian; tabulated.
struct Response {
    reach: f64,
    density: Vec<f64>,
    cumulative: Vec<f64>,
}

const STEPS: f64 = 2000.0;

impl Response {
    fn of(sigma: f64) -> Self {
        let reach = 6.5 * sigma + 0.5;
        let gauss = |t: f64| 0.5 * (1.0 + erf(t / std::f64::consts::SQRT_2));
        let primitive = |t: f64| t * gauss(t) + (-0.5 * t * t).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let count = (2.0 * reach * STEPS) as usize + 2;
        let at = |i: usize| i as f64 / STEPS - reach;
        let density =
            (0..count).map(|i| gauss((at(i) + 0.5) / sigma) - gauss((at(i) - 0.5) / sigma)).collect();
        let cumulative = (0..count)
            .map(|i| sigma * (primitive((at(i) + 0.5) / sigma) - primitive((at(i) - 0.5) / sigma)))
            .collect();
        Self { reach, density, cumulative }
    }

    fn look(&self, table: &[f64], d: f64) -> f64 {
        let s = (d + self.reach) * STEPS;
        let i = s as usize;
        table[i] + (s - i as f64) * (table[i + 1] - table[i])
    }

    fn density(&self, d: f64) -> f64 {
        if d.abs() >= self.reach { 0.0 } else { self.look(&self.density, d) }
    }

    fn cumulative(&self, d: f64) -> f64 {
        if d <= -self.reach {
            0.0
        } else if d >= self.reach {
            1.0
        } else {
            self.look(&self.cumulative, d)
        }
    }
}

/// Six-point Gauss–Legendre rule on [0, 1].
const RULE: [(f64, f64); 6] = [
    (0.033_765_242_898_424, 0.085_662_246_189_585),
    (0.169_395_306_766_868, 0.180_380_786_524_069),
    (0.380_690_406_958_402, 0.233_956_967_286_346),
    (0.619_309_593_041_598, 0.233_956_967_286_346),
    (0.830_604_693_233_132, 0.180_380_786_524_069),
    (0.966_234_757_101_576, 0.085_662_246_189_585),
];

/// A brush of one blur.
pub(crate) struct Brush(Response);

impl Brush {
    pub(crate) fn new(sigma: f64) -> Self {
        Self(Response::of(sigma))
    }
}

/// Outline of an ellipse: half-axes and the direction of the first.
pub(crate) fn ellipse(centre: [f64; 2], axes: [f64; 2], angle: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = angle.sin_cos();
    (0..360)
        .map(|k| {
            let (b, a) = f64::from(k).to_radians().sin_cos();
            let (a, b) = (axes[0] * a, axes[1] * b);
            [centre[0] + cos * a - sin * b, centre[1] + sin * a + cos * b]
        })
        .collect()
}

impl Canvas {
    pub(crate) fn new(width: usize, height: usize, background: impl Fn(f64, f64) -> f64) -> Self {
        let light = (0..width * height).map(|i| background((i % width) as f64, (i / width) as f64)).collect();
        Self { width, height, light }
    }

    /// Share of each pixel's response that a convex outline covers: calls `paint(index, share)`.
    pub(crate) fn cover(&mut self, outline: &[[f64; 2]], brush: &Brush, paint: impl Fn(f64, f64) -> f64) {
        let bounds =
            |k: usize| outline.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p[k]), b.max(p[k])));
        let ((left, right), (top, bottom)) = (bounds(0), bounds(1));
        let reach = brush.0.reach;
        let whole = |v: f64, most: usize| v.clamp(0.0, most as f64) as usize;
        let (x0, x1) =
            (whole((left - reach).floor(), self.width), whole((right + reach).ceil() + 1.0, self.width));
        let (y0, y1) =
            (whole((top - reach).floor(), self.height), whole((bottom + reach).ceil() + 1.0, self.height));
        let wide = x1.saturating_sub(x0);
        if wide == 0 || y1 <= y0 {
            return;
        }
        let mut share = vec![0.0; wide * (y1 - y0)];
        let pieces = ((bottom - top) / 0.5).ceil();
        let step = (bottom - top) / pieces;
        let mut across = vec![0.0; wide];
        for piece in 0..pieces as usize {
            for (t, w) in RULE {
                let y = top + (piece as f64 + t) * step;
                let Some((from, to)) = chord(outline, y) else { continue };
                for (k, a) in across.iter_mut().enumerate() {
                    let x = (x0 + k) as f64;
                    *a = brush.0.cumulative(to - x) - brush.0.cumulative(from - x);
                }
                for row in y0..y1 {
                    let down = w * step * brush.0.density(y - row as f64);
                    if down > 0.0 {
                        for (s, a) in share[(row - y0) * wide..][..wide].iter_mut().zip(&across) {
                            *s += down * a;
                        }
                    }
                }
            }
        }
        for row in y0..y1 {
            for k in 0..wide {
                let light = &mut self.light[row * self.width + x0 + k];
                *light = paint(*light, share[(row - y0) * wide + k]);
            }
        }
    }

    /// A dot that adds its own light.
    pub(crate) fn add(&mut self, outline: &[[f64; 2]], brush: &Brush, height: f64) {
        self.cover(outline, brush, |light, share| light + height * share);
    }

    /// Something opaque.
    pub(crate) fn hide(&mut self, outline: &[[f64; 2]], brush: &Brush, level: f64) {
        self.cover(outline, brush, |light, share| light + (level - light) * share);
    }

    /// A glow.
    pub(crate) fn glow(&mut self, centre: [f64; 2], radius: f64, height: f64) {
        for y in 0..self.height {
            for x in 0..self.width {
                let d = (x as f64 - centre[0]).hypot(y as f64 - centre[1]) / radius;
                if d < 5.0 {
                    self.light[y * self.width + x] += height * (-0.5 * d * d).exp();
                }
            }
        }
    }

    /// Noise and rounding.
    pub(crate) fn expose(&self, noise: f64, random: &mut Noise) -> Vec<u8> {
        self.light
            .iter()
            .map(|&l| {
                let n = if noise > 0.0 { noise * random.normal() } else { 0.0 };
                (l + n).round().clamp(0.0, 255.0) as u8
            })
            .collect()
    }
}

/// Where a row crosses a convex outline.
fn chord(outline: &[[f64; 2]], y: f64) -> Option<(f64, f64)> {
    let (mut from, mut to) = (f64::MAX, f64::MIN);
    for (k, a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        if (a[1] <= y) != (b[1] <= y) {
            let x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            (from, to) = (from.min(x), to.max(x));
        }
    }
    (to > from).then_some((from, to))
}

#[test]
fn the_renderer_keeps_area_and_centre() {
    let mut canvas = Canvas::new(40, 40, |_, _| 0.0);
    canvas.add(&ellipse([19.3, 20.8], [6.0, 4.0], 0.4), &Brush::new(0.9), 1.0);
    let sum: f64 = canvas.light.iter().sum();
    let moment =
        |f: &dyn Fn(usize) -> f64| canvas.light.iter().enumerate().map(|(i, l)| l * f(i)).sum::<f64>() / sum;
    let polygon = 360.0 / std::f64::consts::TAU * (std::f64::consts::TAU / 360.0).sin();
    assert!((sum / (std::f64::consts::PI * 24.0 * polygon) - 1.0).abs() < 1e-4, "{sum}");
    assert!((moment(&|i| (i % 40) as f64) - 19.3).abs() < 1e-5);
    assert!((moment(&|i| (i / 40) as f64) - 20.8).abs() < 1e-5);
}
