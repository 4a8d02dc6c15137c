//! Where a dot's centre is: the blurred disc that leaves the least squares, and how well that is known.
//!
//! Gauss–Newton with exact derivatives, damped (Levenberg 1944) only when a step does not help. For independent noise of variance σ² the
//! covariance σ²(JᵀJ)⁻¹ is the Cramér–Rao bound of the model; σ² is the larger of the picture's noise and the fit's own residual.

use super::model::{BlurredDisc, PARAMETERS, Seen, WHITE};
use super::window::Sample;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

type Normal = SMatrix<f64, PARAMETERS, PARAMETERS>;
type Parameters = SVector<f64, PARAMETERS>;

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

struct Sums {
    right: Parameters,
    squares: f64,
}

/// Normal equations at a state; the matrix only when asked for.
fn assemble(
    samples: &[Sample],
    disc: &BlurredDisc,
    origin: Vector2<f64>,
    matrix: Option<&mut Normal>,
) -> Sums {
    let wanted = matrix.is_some();
    let mut normal = [[0.0; PARAMETERS]; PARAMETERS];
    let mut right = [0.0; PARAMETERS];
    let mut squares = 0.0;
    // Pixels away from the rim know only height and background: sums of (1, x, y) and of its products, outside and inside.
    let mut flat = [[0.0; 6]; 2];
    let near = disc.near();
    for sample in samples {
        let offset = sample.at - origin;
        match disc.see(sample.at, offset, near) {
            Seen::Flat { value, inside } => {
                let residual = sample.value - value.min(WHITE);
                squares += residual * residual;
                if value < WHITE {
                    right[7] += residual;
                    right[8] += residual * offset.x;
                    right[9] += residual * offset.y;
                    right[5] += if inside { residual } else { 0.0 };
                    let products = [
                        1.0,
                        offset.x,
                        offset.y,
                        offset.x * offset.x,
                        offset.x * offset.y,
                        offset.y * offset.y,
                    ];
                    for (sum, product) in flat[usize::from(inside)].iter_mut().zip(products) {
                        *sum += product;
                    }
                }
            }
            Seen::Edge { value, gradient } => {
                let residual = sample.value - value.min(WHITE);
                squares += residual * residual;
                if value < WHITE {
                    for (r, g) in right.iter_mut().zip(gradient) {
                        *r += g * residual;
                    }
                    if wanted {
                        // The lower triangle alone, in pairs, which is what fits into registers.
                        for (i, row) in normal.iter_mut().enumerate() {
                            for pair in 0..=i / 2 {
                                row[2 * pair] += gradient[i] * gradient[2 * pair];
                                row[2 * pair + 1] += gradient[i] * gradient[2 * pair + 1];
                            }
                        }
                    }
                }
            }
        }
    }
    if let Some(matrix) = matrix {
        *matrix = Normal::from_fn(|i, j| normal[i.max(j)][i.min(j)]);
        for (k, (i, j)) in [(7, 7), (7, 8), (7, 9), (8, 8), (8, 9), (9, 9)].into_iter().enumerate() {
            let sum = flat[0][k] + flat[1][k];
            matrix[(i, j)] += sum;
            if i != j {
                matrix[(j, i)] += sum;
            }
        }
        matrix[(5, 5)] += flat[1][0];
        for k in 0..3 {
            matrix[(5, 7 + k)] += flat[1][k];
            matrix[(7 + k, 5)] += flat[1][k];
        }
    }
    Sums { right: Parameters::from(right), squares }
}

/// Fits the disc to the samples; none when it does not come to rest, shrinks away or leaves its pixels.
pub(super) fn fit(samples: &[Sample], start: BlurredDisc) -> Option<Fitted> {
    if samples.len() < 2 * PARAMETERS {
        return None;
    }
    let origin = start.centre();
    let freedom = (samples.len() - PARAMETERS) as f64;
    let mut disc = start;
    // Where the inside is white, nothing tells how bright the dot is; its rim says where it is all the same.
    let held = white_share(samples, &start) > 0.5;
    let mut normal = Normal::zeros();
    let mut sums = assemble(samples, &disc, origin, Some(&mut normal));
    let mut damping = 0.0;
    let mut taken = 0;
    for _ in 0..MOST_STEPS {
        let step = damped(&normal, damping, held).cholesky()?.solve(&sums.right);
        let mut next = BlurredDisc(disc.0 + step);
        next.0[6] = next.0[6].clamp(LEAST_BLUR, 20.0);
        let sound = next.to_circle().determinant() > 1e-6 && next.height() > 0.0;
        let moved = step[0] * step[0] * normal[(0, 0)] + step[1] * step[1] * normal[(1, 1)];
        if sound && taken > 0 && moved <= AT_REST * sums.squares / freedom {
            let near = (next.centre() - origin).norm() <= MOST_MOVE;
            return near
                .then(|| conclude(samples, next, origin, &damped(&normal, 0.0, held), sums.squares))
                .flatten();
        }
        let fresh = taken + 1 < NEWTON_STEPS || damping > 0.0 || taken % RENEWED == 0;
        let mut own = Normal::zeros();
        let tried = sound.then(|| assemble(samples, &next, origin, fresh.then_some(&mut own)));
        match tried.filter(|t| t.squares < sums.squares * (1.0 + AT_REST / freedom)) {
            Some(better) => {
                (disc, sums) = (next, better);
                taken += 1;
                damping *= 0.1;
                if fresh {
                    normal = own;
                }
            }
            None => {
                damping = (damping * 100.0_f64).max(1e-3);
                assemble(samples, &disc, origin, Some(&mut normal));
            }
        }
    }
    None
}

/// The matrix with its diagonal raised; a height that is held does not move.
fn damped(normal: &Normal, damping: f64, held: bool) -> Normal {
    let mut damped = *normal;
    for i in 0..PARAMETERS {
        damped[(i, i)] = damped[(i, i)] * (1.0 + 1e-9 + damping) + 1e-12;
    }
    if held {
        damped[(5, 5)] += 1e12;
    }
    damped
}

/// Share of the pixels inside that are white.
fn white_share(samples: &[Sample], disc: &BlurredDisc) -> f64 {
    if samples.iter().all(|s| s.value < WHITE) {
        return 0.0;
    }
    let (mut all, mut white) = (0.0, 0.0);
    for sample in samples.iter().filter(|s| disc.distance(s.at) > 0.0) {
        all += 1.0;
        white += if sample.value >= WHITE { 1.0 } else { 0.0 };
    }
    if all > 0.0 { white / all } else { 0.0 }
}

fn conclude(
    samples: &[Sample],
    disc: BlurredDisc,
    origin: Vector2<f64>,
    normal: &Normal,
    squares: f64,
) -> Option<Fitted> {
    let inverse = normal.cholesky()?.inverse();
    let count = samples.len() as f64;
    let mean = samples.iter().map(|s| s.value).sum::<f64>() / count;
    let total: f64 = samples.iter().map(|s| (s.value - mean).powi(2)).sum();
    Some(Fitted {
        disc,
        light: light_shift(samples, &disc, origin, &inverse)?,
        unit_covariance: inverse.fixed_view::<2, 2>(0, 0).into_owned(),
        residual: squares / (count - PARAMETERS as f64),
        explained: if total > 0.0 { (1.0 - squares / total).max(0.0) } else { 0.0 },
        white: white_share(samples, &disc),
    })
}

/// One Gauss–Newton step to a disc whose brightness may change across it, h (1 + g·(p − c)): how far that takes the centre, and the
/// covariance of it for noise of variance one. `inverse`: of the normal matrix without g.
fn light_shift(
    samples: &[Sample],
    disc: &BlurredDisc,
    origin: Vector2<f64>,
    inverse: &Normal,
) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let near = disc.near();
    let mut cross = SMatrix::<f64, PARAMETERS, 2>::zeros();
    let (mut own, mut right, mut rest) = (Matrix2::zeros(), Vector2::zeros(), Parameters::zeros());
    for sample in samples {
        let offset = sample.at - origin;
        let arm = (sample.at - disc.centre()) * disc.height();
        let (value, share, gradient) = match disc.see(sample.at, offset, near) {
            Seen::Flat { value, inside } => {
                let one = if inside { 1.0 } else { 0.0 };
                (value, one, [0.0, 0.0, 0.0, 0.0, 0.0, one, 0.0, 1.0, offset.x, offset.y])
            }
            Seen::Edge { value, gradient } => (value, gradient[5], gradient),
        };
        if value >= WHITE {
            continue;
        }
        let (slope, gradient) = (arm * share, Parameters::from(gradient));
        let residual = sample.value - value;
        rest += gradient * residual;
        if share > 0.0 {
            cross += gradient * slope.transpose();
            own += slope * slope.transpose();
            right += slope * residual;
        }
    }
    let by_slope = inverse * cross;
    let schur = (own - cross.transpose() * by_slope).try_inverse()?;
    let slope = schur * (right - by_slope.transpose() * rest);
    let moves = by_slope.fixed_view::<2, 2>(0, 0);
    Some((-(moves * slope), moves * schur * moves.transpose()))
}

/// The Cramér–Rao bound of a centre for noise of variance one (px²): the model's own, at a given state.
#[cfg(test)]
pub(super) fn bound(samples: &[Sample], disc: &BlurredDisc) -> Matrix2<f64> {
    let mut normal = Normal::zeros();
    assemble(samples, disc, disc.centre(), Some(&mut normal));
    let inverse = normal.cholesky().expect("a dot").inverse();
    inverse.fixed_view::<2, 2>(0, 0).into_owned()
}
