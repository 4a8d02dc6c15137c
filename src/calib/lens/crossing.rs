//! Where exactly two edges cross: the model of four squares that leaves the least squares.
//!
//! With d = p − c, edge normals n₁ and n₂, and blur s,
//!
//! ```text
//! I(p) = b + β·(p − o) + h (1 + γ·(p − o)) S(n₁·d/s, n₂·d/s, n₁·n₂)
//! ```
//!
//! where S(t, u, ρ) is the mean of sign(t + x) sign(u + y) over a Gaussian blur: for edges at right angles erf(t/√2) erf(u/√2). The slopes
//! of the light matter: left out, β moves the crossing by about β R/h in a window of radius R, and γ by about γ s². How a lens bends the
//! edges within a window does not: of a radius of curvature of 6,000 px, R = 8 px see 0.002 px.
//!
//! Levenberg's damped Gauss–Newton steps (1944). For independent noise of variance σ² the covariance σ²(JᵀJ)⁻¹ is the Cramér–Rao bound of
//! the model; σ² is the larger of the picture's noise and the fit's own residual. Crossings from gradients alone (Förstner & Gülch 1987)
//! have three times that standard deviation, for each gradient tells the direction of its edge anew.

use super::profile::{both, edge, edge_slope};
use crate::track::GreyView;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// Numbers that describe a crossing: its place (0, 1), angles of the two normals (2, 3), h (4), s (5), b (6), β (7, 8)
/// and γ (9, 10).
const PARAMETERS: usize = 11;
type Parameters = SVector<f64, PARAMETERS>;
type Normal = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// A corner of squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corner {
    /// Its place (px).
    pub(super) at: Vector2<f64>,
    /// Covariance of that (px²).
    pub(super) covariance_px2: Matrix2<f64>,
    /// All numbers of its model.
    pub(super) crossing: Crossing,
}

/// Two edges that cross.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing(Parameters);

/// Blur that a fit starts from, and its bounds (px): a pixel alone has 0.29.
const BLUR_PX: [f64; 3] = [0.9, 0.29, 4.0];
/// So much stiffer, a number does not move.
const HELD: f64 = 1e12;
/// Steps of a fit; six are usual.
const STEPS: usize = 40;
/// A step of the place that is shorter is the last (px).
const STILL_PX: f64 = 1e-5;
/// Damping from which no step helps any more.
const MOST_DAMPING: f64 = 1e8;
/// A crossing that moves farther than this from where it was suspected is another one (px).
const FARTHEST_PX: f64 = 2.0;
/// Least sine of the angle between the edges.
const LEAST_SINE: f64 = 0.3;
/// Least share of the window's variance that the model explains.
const EXPLAINED: f64 = 0.8;

impl Crossing {
    /// Around a saddle of a picture of that total blur, from the grey level there and its second derivatives (xx, xy, yy); none where they
    /// are none of a saddle. Edges run about where the second derivative along them vanishes.
    pub(super) fn at_saddle(
        at: Vector2<f64>,
        level: f64,
        [xx, xy, yy]: [f64; 3],
        blur_px: f64,
    ) -> Option<Self> {
        let strength = xy * xy - xx * yy;
        let (middle, half) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
        let (up, down) = (middle + half, middle - half);
        if !(strength > 0.0 && up > 0.0 && down < 0.0) {
            return None;
        }
        // Direction of the lighter squares, and how far from it the edges run.
        let lighter = 0.5 * (2.0 * xy).atan2(xx - yy);
        let edge = (up / -down).sqrt().atan();
        let quarter = std::f64::consts::FRAC_PI_2;
        let normals = [lighter + edge - quarter, lighter - edge + quarter];
        let sine = (2.0 * edge).sin();
        let height = 0.5 * std::f64::consts::PI * blur_px * blur_px * strength.sqrt() / sine;
        let numbers = [at.x, at.y, normals[0], normals[1], height, BLUR_PX[0], level, 0.0, 0.0, 0.0, 0.0];
        numbers.iter().all(|x| x.is_finite()).then(|| Self(Parameters::from(numbers)))
    }

    fn at(&self) -> Vector2<f64> {
        Vector2::new(self.0[0], self.0[1])
    }

    /// The grey level at a pixel, and its derivatives. `origin`: where the light is b.
    fn see(&self, pixel: Vector2<f64>, origin: Vector2<f64>) -> (f64, Parameters) {
        let (d, offset) = (pixel - self.at(), pixel - origin);
        let (light, s) = (1.0 + self.0[9] * offset.x + self.0[10] * offset.y, self.0[5]);
        let h = self.0[4] * light;
        // Of each edge: normal, distance across and along it in blurs, profile and its slope.
        let [one, two] = [self.0[2], self.0[3]].map(|angle| {
            let (sin, cos) = angle.sin_cos();
            let normal = Vector2::new(cos, sin);
            let across = normal.dot(&d) / s;
            let along = (cos * d.y - sin * d.x) / s;
            (normal, across, along, edge_slope(across))
        });
        // Correlation of the two distances in the blur.
        let skew = (self.0[2] - self.0[3]).cos();
        let (first, second) = (
            h * one.3 * edge((two.1 - skew * one.1) / (1.0 - skew * skew).sqrt()),
            h * two.3 * edge((one.1 - skew * two.1) / (1.0 - skew * skew).sqrt()),
        );
        let (share, by_skew) = both(one.1, two.1, skew);
        let turn = h * by_skew * (self.0[2] - self.0[3]).sin();
        let by_place = -(one.0 * first + two.0 * second) / s;
        let value = self.0[6] + self.0[7] * offset.x + self.0[8] * offset.y + h * share;
        let gradient = [
            by_place.x,
            by_place.y,
            first * one.2 - turn,
            second * two.2 + turn,
            light * share,
            -(first * one.1 + second * two.1) / s,
            1.0,
            offset.x,
            offset.y,
            self.0[4] * share * offset.x,
            self.0[4] * share * offset.y,
        ];
        (value, Parameters::from(gradient))
    }
}

/// The pixels of a window, and where its light is b.
struct Window {
    origin: Vector2<f64>,
    samples: Vec<(Vector2<f64>, f64)>,
}

impl Window {
    /// The pixels within `reach_px` of a place; none where the window leaves the picture.
    fn around(view: &GreyView<'_>, origin: Vector2<f64>, reach_px: f64) -> Option<Self> {
        let size = view.size();
        let bounds = [0, 1].map(|k| (origin[k] - reach_px, origin[k] + reach_px));
        let inside = |k: usize| bounds[k].0 >= 0.0 && bounds[k].1 <= size[k] as f64 - 1.0;
        if !(inside(0) && inside(1)) {
            return None;
        }
        let along = |k: usize| bounds[k].0.ceil() as usize..=bounds[k].1.floor() as usize;
        let mut samples = Vec::new();
        for y in along(1) {
            let row = view.row(y);
            for x in along(0) {
                let pixel = Vector2::new(x as f64, y as f64);
                if (pixel - origin).norm() <= reach_px {
                    samples.push((pixel, f64::from(row[x])));
                }
            }
        }
        (samples.len() > 2 * PARAMETERS).then_some(Self { origin, samples })
    }

    /// Normal equations of a crossing, and the sum of its squared residuals.
    fn assemble(&self, crossing: &Crossing) -> (Normal, Parameters, f64) {
        let (mut normal, mut right, mut squares) = (Normal::zeros(), Parameters::zeros(), 0.0);
        for (pixel, level) in &self.samples {
            let (value, gradient) = crossing.see(*pixel, self.origin);
            let residual = level - value;
            normal.ger(1.0, &gradient, &gradient, 1.0);
            right += gradient * residual;
            squares += residual * residual;
        }
        (normal, right, squares)
    }

    fn variance(&self) -> f64 {
        let count = self.samples.len() as f64;
        let mean = self.samples.iter().map(|s| s.1).sum::<f64>() / count;
        self.samples.iter().map(|s| (s.1 - mean).powi(2)).sum()
    }
}

/// The corner that fits best within `reach_px` of where one is suspected, in a picture with that noise; none where the window leaves the
/// picture or no two edges cross.
pub(super) fn corner(view: &GreyView<'_>, start: &Crossing, reach_px: f64, noise: f64) -> Option<Corner> {
    let window = Window::around(view, start.at(), reach_px)?;
    let mut crossing = *start;
    // The light is b in the middle of the window.
    let (mut normal, mut right, mut squares) = window.assemble(&crossing);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let mut damped = normal;
        (0..PARAMETERS).for_each(|k| damped[(k, k)] *= 1.0 + damping);
        let mut step = damped.cholesky()?.solve(&right);
        let [_, least, most] = BLUR_PX;
        let blur = (crossing.0[5] + step[5]).clamp(least, most);
        if blur != crossing.0[5] + step[5] {
            // Beyond its bounds: put on the bound, and held there while the others find their place.
            if blur != crossing.0[5] {
                crossing.0[5] = blur;
                (normal, right, squares) = window.assemble(&crossing);
                continue;
            }
            damped[(5, 5)] *= HELD;
            step = damped.cholesky()?.solve(&right);
            step[5] = 0.0;
        }
        let next = Crossing(crossing.0 + step);
        let tried = window.assemble(&next);
        if tried.2.is_nan() || tried.2 > squares * (1.0 + 1e-12) {
            damping *= 10.0;
            if damping > MOST_DAMPING {
                return None;
            }
            continue;
        }
        crossing = next;
        (normal, right, squares) = tried;
        if (next.at() - start.at()).norm() > FARTHEST_PX {
            return None;
        }
        if step.fixed_rows::<2>(0).norm() < STILL_PX {
            return conclude(&window, crossing, &normal, squares, noise);
        }
        damping *= 0.1;
    }
    None
}

fn conclude(
    window: &Window,
    crossing: Crossing,
    normal: &Normal,
    squares: f64,
    noise: f64,
) -> Option<Corner> {
    let sine = (crossing.0[2] - crossing.0[3]).sin().abs();
    let explained = 1.0 - squares / window.variance();
    // Where nothing varies the share is no number, and nothing crosses either.
    if !(crossing.0[4] > 0.0 && sine >= LEAST_SINE && explained >= EXPLAINED) {
        return None;
    }
    let residual = squares / (window.samples.len() - PARAMETERS) as f64;
    let inverse = normal.cholesky()?.inverse();
    let covariance_px2 = inverse.fixed_view::<2, 2>(0, 0) * residual.max(noise * noise);
    Some(Corner { at: crossing.at(), covariance_px2, crossing })
}

#[cfg(test)]
mod tests {
    use super::super::tests::scene::Random;
    use super::*;

    /// Pixels along the edge of the pictures.
    const EDGE: usize = 41;

    /// Points of a Gaussian blur that also stands for the pixel's own size, and its standard deviation (px).
    const POINTS: usize = 400;
    const BLUR: f64 = 0.85;

    /// Two edges that cross at a place under angles: each pixel is the mean over points of the blur, which is no product of two edges
    /// where they are not at right angles, in light that falls off by 0.1 % a pixel.
    fn crossing(at: [f64; 2], angles: [f64; 2], noise: f64, random: &mut Random) -> Vec<u8> {
        // Equal shares of the blur, along a spiral of the golden angle.
        let spiral: Vec<Vector2<f64>> = (0..POINTS)
            .map(|k| {
                let radius = (-2.0 * (1.0 - (k as f64 + 0.5) / POINTS as f64).ln()).sqrt();
                let (sin, cos) = (2.399_963_229_728_653 * k as f64).sin_cos();
                Vector2::new(cos, sin) * (BLUR * radius)
            })
            .collect();
        let side = |d: Vector2<f64>, angle: f64| (d.x * angle.cos() + d.y * angle.sin()).signum();
        (0..EDGE * EDGE)
            .map(|i| {
                let pixel = Vector2::new((i % EDGE) as f64, (i / EDGE) as f64);
                let from = pixel - Vector2::from(at);
                let sum: f64 = spiral
                    .iter()
                    .map(|near| side(from + near, angles[0]) * side(from + near, angles[1]))
                    .sum();
                let light = 1.0 - 1e-3 * (pixel.x - 20.0);
                let level = (120.0 + 70.0 * sum / POINTS as f64) * light;
                (level + noise * random.normal()).round().clamp(0.0, 255.0) as u8
            })
            .collect()
    }

    fn suspected(at: Vector2<f64>, angles: [f64; 2]) -> Crossing {
        Crossing(Parameters::from([at.x, at.y, angles[0], angles[1], 50.0, 0.9, 110.0, 0.0, 0.0, 0.0, 0.0]))
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        let crossing =
            Crossing(Parameters::from([20.2, 19.7, 0.4, 1.7, 60.0, 0.8, 100.0, 0.3, -0.2, 2e-3, -1e-3]));
        let origin = Vector2::new(20.0, 20.0);
        for pixel in [[20.0, 20.0], [21.0, 19.0], [18.0, 20.0], [20.0, 23.0]].map(Vector2::from) {
            let (_, gradient) = crossing.see(pixel, origin);
            for k in 0..PARAMETERS {
                // The series for the error function is wrong by 10⁻⁷, smoothly: steps must not be small.
                let mut step = Parameters::zeros();
                step[k] = 1e-3;
                let value = |sign: f64| Crossing(crossing.0 + sign * step).see(pixel, origin).0;
                let difference = (value(1.0) - value(-1.0)) / 2e-3;
                assert!((difference - gradient[k]).abs() < 2e-2, "{k}: {difference} {}", gradient[k]);
            }
        }
    }

    /// Second derivatives of two blurred edges lead back to them, near enough for a fit to begin.
    #[test]
    fn a_saddle_tells_where_the_edges_run() {
        let truth = [0.4, 1.7];
        let model = suspected(Vector2::new(20.0, 20.0), truth);
        let at = |x: f64, y: f64| model.see(Vector2::new(x, y), Vector2::new(20.0, 20.0)).0;
        let h = 0.05;
        let centre = at(20.0, 20.0);
        let xx = (at(20.0 + h, 20.0) - 2.0 * centre + at(20.0 - h, 20.0)) / (h * h);
        let yy = (at(20.0, 20.0 + h) - 2.0 * centre + at(20.0, 20.0 - h)) / (h * h);
        let xy = (at(20.0 + h, 20.0 + h) - at(20.0 - h, 20.0 + h) - at(20.0 + h, 20.0 - h)
            + at(20.0 - h, 20.0 - h))
            / (4.0 * h * h);
        let start = Crossing::at_saddle(Vector2::new(20.0, 20.0), centre, [xx, xy, yy], 0.9);
        let start = start.expect("a saddle").0;
        assert!((start[4] / 50.0 - 1.0).abs() < 0.05, "{start}");
        for truth in truth {
            let off = |k: usize| (start[k] - truth).sin().abs();
            // Edges that are not at right angles are suspected to be nearer to the diagonals of the lighter squares.
            assert!(off(2).min(off(3)) < 0.15, "{start}");
        }
        assert_eq!(Crossing::at_saddle(Vector2::zeros(), 100.0, [1.0, 0.0, 1.0], 0.9), None);
    }

    /// Over 300 corners under different angles: normalised squared errors have the mean 2, and errors are near the bound.
    #[test]
    fn noise_does_what_the_covariance_says() {
        let mut random = Random::seeded(2);
        let (mut normalised, mut squared) = (0.0, 0.0);
        const DRAWS: usize = 300;
        for draw in 0..DRAWS {
            let at = [20.0 + random.uniform() - 0.5, 20.0 + random.uniform() - 0.5];
            let angles = [0.3 * draw as f64, 0.3 * draw as f64 + 1.1 + 0.9 * random.uniform()];
            let pixels = crossing(at, angles, 2.0, &mut random);
            let view = GreyView::new(EDGE, EDGE, EDGE, &pixels).expect("a picture");
            let start = suspected(Vector2::from(at) + Vector2::new(0.6, -0.5), [angles[0] + 0.1, angles[1]]);
            let found = corner(&view, &start, 6.0, (4.0_f64 + 1.0 / 12.0).sqrt()).expect("a corner");
            let error = found.at - Vector2::from(at);
            let inverse = found.covariance_px2.try_inverse().expect("regular");
            normalised += (error.transpose() * inverse * error)[0] / DRAWS as f64;
            squared += error.norm_squared() / DRAWS as f64;
        }
        println!("corner: rms {:.4} px, mean of squared normalised errors {normalised:.2}", squared.sqrt());
        // The mean of 300 draws of χ² with two degrees of freedom has the standard deviation 2/√300 = 0.115.
        assert!((normalised - 2.0).abs() < 0.4, "{normalised}");
        // An edge of contrast A and blur s is known to σ√(2√π s)/A = 0.024 px from a pixel of its length, and 12 px of each are seen.
        assert!(squared.sqrt() < 0.02, "{}", squared.sqrt());
    }

    #[test]
    fn where_nothing_crosses_there_is_no_corner() {
        let flat = [90_u8; EDGE * EDGE];
        let view = GreyView::new(EDGE, EDGE, EDGE, &flat).expect("a picture");
        let middle = suspected(Vector2::new(20.0, 20.0), [0.2, 1.7]);
        assert_eq!(corner(&view, &middle, 6.0, 2.0), None);
        let mut random = Random::seeded(3);
        // One edge alone, and a window that leaves the picture.
        let edge = crossing([20.0, 20.0], [0.2, 0.2001], 0.0, &mut random);
        let view = GreyView::new(EDGE, EDGE, EDGE, &edge).expect("a picture");
        assert_eq!(corner(&view, &middle, 6.0, 0.3), None);
        let pixels = crossing([5.0, 20.0], [0.2, 1.7], 0.0, &mut random);
        let view = GreyView::new(EDGE, EDGE, EDGE, &pixels).expect("a picture");
        assert_eq!(corner(&view, &suspected(Vector2::new(5.0, 20.0), [0.2, 1.7]), 6.0, 0.3), None);
    }
}
