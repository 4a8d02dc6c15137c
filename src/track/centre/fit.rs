//! Where a dot's centre is: the blurred disc that leaves the least squares, and how well that is known.
//!
//! Gauss–Newton with exact derivatives, damped (Levenberg 1944) only when a step does not help. For independent noise of variance σ² the
//! covariance σ²(JᵀJ)⁻¹ is the Cramér–Rao bound of the model; σ² is the larger of the picture's noise and the fit's own residual.

use super::model::{BlurredDisc, PARAMETERS, Seen, TERMS, WHITE};
use super::window::{Eight, Window};
use nalgebra::{Cholesky, Const, Matrix2, SMatrix, SVector, Vector2};
use wide::f32x8;

type Normal = SMatrix<f64, PARAMETERS, PARAMETERS>;
type Factor = Cholesky<f64, Const<PARAMETERS>>;
type Extended = SMatrix<f64, TERMS, TERMS>;

/// A fit that has come to rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted {
    pub(super) disc: BlurredDisc,
    /// Covariance of the centre for noise of variance one (px²).
    pub(super) unit_covariance: Matrix2<f64>,
    /// How far the centre would move if the light on the dot were allowed to change across it (px), and the covariance of that for noise
    /// of variance one (px²).
    pub(super) light: (Vector2<f64>, Matrix2<f64>),
    /// Mean square of the residuals (grey levels²), by degrees of freedom.
    pub(super) residual: f64,
    /// Share of the window's variance that the model explains.
    pub(super) explained: f64,
    /// Share of the pixels inside that are white.
    pub(super) white: f64,
}

const MOST_STEPS: usize = 25;

/// Steps with a matrix of their own; those after them use the last one, for they only tidy up (the chord method).
const NEWTON_STEPS: usize = 2;
/// Where it takes long, the matrix is made anew after this many steps.
const RENEWED: usize = 4;

/// A step of the centre is small when its square is this part of the centre's variance: 3 % of a standard deviation. What else still
/// moves (the brightness of a dot that is nearly white) does not matter.
const AT_REST: f64 = 1e-3;

/// Least blur (px): a pixel alone has 1/√12 = 0.29, and no lens is perfect.
const LEAST_BLUR: f64 = 0.35;

/// How far a centre may be from where it was looked for (px).
const MOST_MOVE: f64 = 3.0;

/// What pixels away from the rim tell of: height, background, and how the light changes.
const FLAT: [usize; 6] = [5, 7, 8, 9, 10, 11];

/// Normal equations of the disc's parameters and, after them, of the two slopes of light.
struct Equations {
    right: SVector<f64, TERMS>,
    squares: f64,
}

/// The equations at a state; of the matrix, when it is asked for, the first `WANTED` rows up to the diagonal: it is symmetric.
fn assemble<const WANTED: usize>(
    window: &Window,
    disc: &BlurredDisc,
    matrix: Option<&mut Extended>,
) -> Equations {
    let near = disc.near(window.origin);
    let white = f32x8::splat(WHITE as f32);
    let mut normal = [[f32x8::ZERO; TERMS]; TERMS];
    let mut right = [f32x8::ZERO; TERMS];
    let mut squares = 0.0;
    let wanted = matrix.is_some();
    for eight in window.eights() {
        let Seen { value, gradient, flat } = near.see(eight.x, eight.y);
        let residual = (eight.value - value.fast_min(white)) * eight.there;
        squares += f64::from((residual * residual).reduce_add());
        // What is white whatever the disc does tells nothing.
        let weight = value.simd_lt(white).select(eight.there, f32x8::ZERO);
        let told = residual * weight;
        for (sum, slope) in right.iter_mut().zip(gradient) {
            *sum += slope * told;
        }
        if wanted && flat {
            for (k, &i) in FLAT.iter().enumerate().filter(|(_, i)| **i < WANTED) {
                let weighted = gradient[i] * weight;
                for &j in &FLAT[..=k] {
                    normal[i][j] += weighted * gradient[j];
                }
            }
        } else if wanted {
            for (i, row) in normal.iter_mut().enumerate().take(WANTED) {
                let weighted = gradient[i] * weight;
                for (sum, slope) in row[..=i].iter_mut().zip(gradient) {
                    *sum += weighted * slope;
                }
            }
        }
    }
    let sum = |lanes: f32x8| f64::from(lanes.reduce_add());
    if let Some(matrix) = matrix {
        for (i, row) in normal.iter().enumerate().take(WANTED) {
            for (j, lanes) in row[..=i].iter().enumerate() {
                matrix[(i, j)] = sum(*lanes);
            }
        }
    }
    Equations { right: SVector::from_fn(|i, _| sum(right[i])), squares }
}

/// Fits the disc to the pixels; none when it does not come to rest, shrinks away or leaves its pixels.
pub(super) fn fit(window: &Window, start: BlurredDisc) -> Option<Fitted> {
    if window.count() < 2 * PARAMETERS {
        return None;
    }
    let freedom = (window.count() - PARAMETERS) as f64;
    let mut disc = start;
    // Where the inside is white, nothing tells how bright the dot is; its rim says where it is all the same.
    let held = white_share(window, &start) > 0.5;
    let mut normal = Extended::zeros();
    // No fit ends with the first matrix: it need not say how light changes.
    let mut equations = assemble::<PARAMETERS>(window, &disc, Some(&mut normal));
    let mut damping = 0.0;
    let mut taken = 0;
    let mut promised_before = 0.0;
    for _ in 0..MOST_STEPS {
        let right = equations.right.fixed_rows::<PARAMETERS>(0);
        let factor = damped(&normal, damping, held).cholesky()?;
        let step = factor.solve(&right);
        let mut next = BlurredDisc(disc.0 + step);
        next.0[6] = next.0[6].clamp(LEAST_BLUR, 20.0);
        let sound = next.to_circle().determinant() > 1e-6 && next.height() > 0.0;
        let moved = step[0] * step[0] * normal[(0, 0)] + step[1] * step[1] * normal[(1, 1)];
        let promised = step.dot(&right);
        // Undamped steps shrink at least as fast as these two did: what the next would gain.
        let ahead = if damping > 0.0 { f64::INFINITY } else { promised * (promised / promised_before) };
        let enough = AT_REST * equations.squares / freedom;
        if sound && taken > 0 && (moved <= enough || ahead <= enough) {
            let near = (next.centre() - window.origin).norm() <= MOST_MOVE;
            let factor = if damping > 0.0 { damped(&normal, 0.0, held).cholesky()? } else { factor };
            return near.then(|| conclude(window, next, &normal, &factor, &equations)).flatten();
        }
        let fresh = taken + 1 < NEWTON_STEPS || damping > 0.0 || taken % RENEWED == 0;
        let mut own = Extended::zeros();
        let tried = sound.then(|| assemble::<TERMS>(window, &next, fresh.then_some(&mut own)));
        match tried.filter(|t| t.squares < equations.squares * (1.0 + AT_REST / freedom)) {
            Some(better) => {
                (disc, equations, promised_before) = (next, better, promised);
                taken += 1;
                damping *= 0.1;
                if fresh {
                    normal = own;
                }
            }
            None => {
                damping = (damping * 100.0_f64).max(1e-3);
                assemble::<TERMS>(window, &disc, Some(&mut normal));
            }
        }
    }
    None
}

/// The matrix with its diagonal raised; a height that is held does not move.
fn damped(normal: &Extended, damping: f64, held: bool) -> Normal {
    let mut damped = normal.fixed_view::<PARAMETERS, PARAMETERS>(0, 0).into_owned();
    for i in 0..PARAMETERS {
        damped[(i, i)] = damped[(i, i)] * (1.0 + 1e-9 + damping) + 1e-12;
    }
    if held {
        damped[(5, 5)] += 1e12;
    }
    damped
}

/// Share of the pixels inside that are white.
fn white_share(window: &Window, disc: &BlurredDisc) -> f64 {
    let is_white = |eight: Eight| eight.value.simd_ge(f32x8::splat(WHITE as f32));
    if !window.eights().any(|eight| is_white(eight).any()) {
        return 0.0;
    }
    let near = disc.near(window.origin);
    let (mut all, mut white) = (f32x8::ZERO, f32x8::ZERO);
    for eight in window.eights() {
        let inside = near.distance(eight.x, eight.y).simd_gt(f32x8::ZERO).select(eight.there, f32x8::ZERO);
        all += inside;
        white += is_white(eight).select(inside, f32x8::ZERO);
    }
    let [all, white] = [all, white].map(|sum| f64::from(sum.reduce_add()));
    if all > 0.0 { white / all } else { 0.0 }
}

/// What a fit comes to, from the equations at the last state that they were made for, which its end differs from by a small step.
/// `factor`: of the normal matrix of the disc's parameters.
fn conclude(
    window: &Window,
    disc: BlurredDisc,
    normal: &Extended,
    factor: &Factor,
    equations: &Equations,
) -> Option<Fitted> {
    let of_centre = factor.solve(&SMatrix::<f64, PARAMETERS, 2>::identity());
    let count = window.count() as f64;
    let mean =
        window.eights().fold(f32x8::ZERO, |sum, e| sum + e.value * e.there).reduce_add() / count as f32;
    let off = |e: Eight| (e.value - f32x8::splat(mean)) * e.there;
    let total = f64::from(window.eights().fold(f32x8::ZERO, |sum, e| sum + off(e) * off(e)).reduce_add());
    Some(Fitted {
        disc,
        light: light_shift(normal, equations, factor)?,
        unit_covariance: of_centre.fixed_view::<2, 2>(0, 0).into_owned(),
        residual: equations.squares / (count - PARAMETERS as f64),
        explained: if total > 0.0 { (1.0 - equations.squares / total).max(0.0) } else { 0.0 },
        white: white_share(window, &disc),
    })
}

/// One Gauss–Newton step to a disc whose brightness may change across it, h (1 + g·(p − c)): how far that takes the centre beyond where
/// it goes without, and the covariance of it for noise of variance one. `factor`: of the normal matrix without g.
fn light_shift(
    normal: &Extended,
    equations: &Equations,
    factor: &Factor,
) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let cross = normal.fixed_view::<2, PARAMETERS>(PARAMETERS, 0).transpose();
    let mut own = normal.fixed_view::<2, 2>(PARAMETERS, PARAMETERS).into_owned();
    own.fill_upper_triangle_with_lower_triangle();
    let (rest, right) =
        (equations.right.fixed_rows::<PARAMETERS>(0), equations.right.fixed_rows::<2>(PARAMETERS));
    let by_slope = factor.solve(&cross);
    let schur = (own - cross.transpose() * by_slope).try_inverse()?;
    let slope = schur * (right - by_slope.transpose() * rest);
    let moves = by_slope.fixed_view::<2, 2>(0, 0);
    Some((-(moves * slope), moves * schur * moves.transpose()))
}

/// The Cramér–Rao bound of a centre for noise of variance one (px²): the model's own, at a given state.
#[cfg(test)]
pub(super) fn bound(window: &Window, disc: &BlurredDisc) -> Matrix2<f64> {
    let mut normal = Extended::zeros();
    assemble::<TERMS>(window, disc, Some(&mut normal));
    let inverse = damped(&normal, 0.0, false).cholesky().expect("a dot").inverse();
    inverse.fixed_view::<2, 2>(0, 0).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::GreyView;
    use crate::track::tests::random::Noise;
    use crate::track::tests::render::{Brush, Canvas, ellipse};

    /// The matrix is the sum over pixels, and what a centre may have been moved by light has the covariance that a fit which frees the
    /// light has besides: of a tilted ellipse, where both slopes and both axes hang together.
    #[test]
    fn light_costs_the_covariance_of_a_fit_that_frees_it() {
        let mut canvas = Canvas::new(41, 41, |_, _| 30.0);
        canvas.add(&ellipse([20.3, 19.8], [9.0, 3.5], 0.5), &Brush::new(0.8), 150.0);
        let pixels = canvas.expose(2.0, &mut Noise::seeded(2));
        let view = GreyView::new(41, 41, 41, &pixels).expect("a picture");
        let moments = Matrix2::new(16.3, 7.2, 7.2, 7.0);
        let start = BlurredDisc::from_moments(Vector2::new(20.0, 20.0), moments, 150.0, 0.9, 30.0);
        let start = start.expect("a disc");
        let mut window = Window::default();
        window.gather(&view, &start, 5.0);
        let disc = fit(&window, start).expect("a dot").disc;
        let mut normal = Extended::zeros();
        let equations = assemble::<TERMS>(&window, &disc, Some(&mut normal));
        let factor = damped(&normal, 0.0, false).cholesky().expect("a dot");
        let (_, light) = light_shift(&normal, &equations, &factor).expect("slopes");
        normal.fill_upper_triangle_with_lower_triangle();
        let near = disc.near(window.origin);
        let mut by_pixel = Extended::zeros();
        for at in window.samples().map(|sample| sample.at - window.origin) {
            let seen = near.see(f32x8::splat(at.x as f32), f32x8::splat(at.y as f32));
            let slopes = SVector::<f64, TERMS>::from_fn(|i, _| f64::from(seen.gradient[i].to_array()[0]));
            by_pixel += slopes * slopes.transpose();
        }
        for (i, j) in (0..TERMS).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let size = (by_pixel[(i, i)] * by_pixel[(j, j)]).sqrt();
            assert!((normal[(i, j)] - by_pixel[(i, j)]).abs() < 1e-5 * size, "{i} {j}");
        }
        let freed = normal.try_inverse().expect("a dot");
        let more = freed.fixed_view::<2, 2>(0, 0) - bound(&window, &disc);
        assert!((light - more).norm() < 1e-5 * more.norm(), "{light} {more}");
        assert!(more[(0, 1)].abs() > 0.02 * more.norm(), "{more}");
    }

    /// Fitted again from where it ended, a dot stays within a fifth of a standard deviation: whatever it began with, how blurred it is, how
    /// light falls on it. Its variance is that of where it ended to a fifth, as the last matrix may be that of two steps before.
    #[test]
    fn a_fit_ends_at_rest() {
        const SIZE: usize = 41;
        let mut ends = 0;
        for seed in 0..20 {
            let mut random = Noise::seeded(seed);
            for (blur, slope) in [(0.4, 0.0), (0.8, 0.0), (1.6, 0.0), (0.8, 0.03)] {
                let centre = [20.0 + random.uniform(), 20.0 + random.uniform()];
                let mut canvas = Canvas::new(SIZE, SIZE, |_, _| 30.0);
                canvas.add(&ellipse(centre, [6.0, 5.2], 0.4), &Brush::new(blur), 150.0);
                for (i, level) in canvas.light.iter_mut().enumerate() {
                    *level *= 1.0 + slope * ((i % SIZE) as f64 - centre[0]);
                }
                let pixels = canvas.expose(2.0, &mut random);
                let view = GreyView::new(SIZE, SIZE, SIZE, &pixels).expect("a picture");
                for (off, size, height) in [(0.05, 1.0, 150.0), (0.5, 1.15, 120.0), (1.2, 1.5, 80.0)] {
                    let start = Vector2::new(centre[0] + off, centre[1] - off);
                    let moments = Matrix2::new(9.0, 0.4, 0.4, 7.0) * size;
                    let start = BlurredDisc::from_moments(start, moments, height, 0.9, 30.0).expect("a disc");
                    let mut window = Window::default();
                    window.gather(&view, &start, 5.0);
                    let first = fit(&window, start).expect("a dot");
                    let again = fit(&window, first.disc).expect("a dot");
                    let step = again.disc.centre() - first.disc.centre();
                    let inverse = first.unit_covariance.try_inverse().expect("a covariance");
                    let moved = step.dot(&(inverse * step)) / first.residual;
                    assert!(moved < 0.04, "{seed} {blur} {slope} {off}: {moved}");
                    let told = (first.unit_covariance - bound(&window, &first.disc)).norm();
                    assert!(told < 0.2 * first.unit_covariance.norm(), "{seed} {blur} {slope} {off}");
                    ends += 1;
                }
            }
        }
        assert_eq!(ends, 240);
    }
}
