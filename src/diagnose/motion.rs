//! A stage's motion without the noise of its report: the piecewise linear path that the rows allow.
//!
//! Play and friction answer to the extremes of a motion, so that noise would work them like a ratchet. Stages move
//! in ramps; rows are merged into straight pieces from the bottom up (Keogh and others 2004) as long as a piece
//! leaves no more than the noise, and the pieces are joined at knots by least squares. A motion that bends is followed
//! by short pieces.

use crate::geometry::Vec3;
use nalgebra::DMatrix;

/// Merging two pieces may raise the sum of squares over noise by this much: three components of two parameters each
/// raise it by 6 in the mean, by more than this once in 10⁵ merges.
const MERGE: f64 = 36.0;

/// Rows of the pieces that merging begins with.
const FIRST: usize = 3;

/// Sums of one piece, from which its straight line follows.
#[derive(Clone, Copy)]
struct Piece {
    start: usize,
    end: usize,
    n: f64,
    t: f64,
    tt: f64,
    y: Vec3,
    ty: Vec3,
    yy: f64,
}

impl Piece {
    fn new(start: usize, end: usize, time: &[f64], scaled: &[Vec3]) -> Self {
        let mut piece =
            Self { start, end, n: 0.0, t: 0.0, tt: 0.0, y: Vec3::zeros(), ty: Vec3::zeros(), yy: 0.0 };
        for i in start..end {
            piece.n += 1.0;
            piece.t += time[i];
            piece.tt += time[i] * time[i];
            piece.y += scaled[i];
            piece.ty += scaled[i] * time[i];
            piece.yy += scaled[i].norm_squared();
        }
        piece
    }

    fn with(&self, next: &Self) -> Self {
        Self {
            start: self.start,
            end: next.end,
            n: self.n + next.n,
            t: self.t + next.t,
            tt: self.tt + next.tt,
            y: self.y + next.y,
            ty: self.ty + next.ty,
            yy: self.yy + next.yy,
        }
    }

    /// Sum of squares that a straight line leaves.
    fn left(&self) -> f64 {
        let mean = self.y / self.n;
        let spread = self.tt - self.t * self.t / self.n;
        let along = self.ty - self.y * (self.t / self.n);
        let explained = if spread > 0.0 { along.norm_squared() / spread } else { 0.0 };
        (self.yy - self.n * mean.norm_squared() - explained).max(0.0)
    }

    /// The line: value at time 0 and slope.
    fn line(&self) -> (Vec3, Vec3) {
        let spread = self.tt - self.t * self.t / self.n;
        let along = self.ty - self.y * (self.t / self.n);
        let slope = if spread > 0.0 { along / spread } else { Vec3::zeros() };
        (self.y / self.n - slope * (self.t / self.n), slope)
    }
}

/// The path at every row. `noise` is one standard deviation along each axis (m).
pub(super) fn without_noise(time_s: &[f64], noisy: &[Vec3], noise: [f64; 3]) -> Vec<Vec3> {
    if noisy.len() < 2 * FIRST || noise.contains(&0.0) {
        return noisy.to_vec();
    }
    let start = time_s[0];
    let time: Vec<f64> = time_s.iter().map(|t| t - start).collect();
    let sd = Vec3::from(noise);
    let scaled: Vec<Vec3> = noisy.iter().map(|d| d.component_div(&sd)).collect();
    let mut pieces: Vec<Piece> = (0..noisy.len())
        .step_by(FIRST)
        .map(|i| Piece::new(i, (i + FIRST).min(noisy.len()), &time, &scaled))
        .collect();
    loop {
        let cost = |pair: &[Piece]| pair[0].with(&pair[1]).left() - pair[0].left() - pair[1].left();
        let best = pieces.windows(2).map(cost).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((at, raised)) = best else { break };
        if raised > MERGE {
            break;
        }
        pieces[at] = pieces[at].with(&pieces[at + 1]);
        pieces.remove(at + 1);
    }
    joined(&knots(&pieces, &time), &time, &scaled).into_iter().map(|d| d.component_mul(&sd)).collect()
}

/// Times at which pieces meet: where their lines come closest, if that is near the boundary.
fn knots(pieces: &[Piece], time: &[f64]) -> Vec<f64> {
    let mut knots = vec![time[0]];
    for pair in pieces.windows(2) {
        let boundary = 0.5 * (time[pair[1].start - 1] + time[pair[1].start]);
        let ((a, slope_a), (b, slope_b)) = (pair[0].line(), pair[1].line());
        let bend = slope_b - slope_a;
        let meets = bend.dot(&(a - b)) / bend.norm_squared();
        let reach = (FIRST as f64) * (time[pair[1].start] - time[pair[1].start - 1]);
        let knot = if (meets - boundary).abs() <= reach { meets } else { boundary };
        if knot > knots[knots.len() - 1] {
            knots.push(knot);
        }
    }
    let last = time[time.len() - 1];
    if last > knots[knots.len() - 1] {
        knots.push(last);
    }
    knots
}

/// The continuous path with these knots that is closest to the rows.
fn joined(knots: &[f64], time: &[f64], rows: &[Vec3]) -> Vec<Vec3> {
    let share = |t: f64| {
        let right = knots.partition_point(|k| *k < t).clamp(1, knots.len() - 1);
        let s = ((t - knots[right - 1]) / (knots[right] - knots[right - 1])).clamp(0.0, 1.0);
        (right - 1, s)
    };
    let n = knots.len();
    let mut normal = DMatrix::zeros(n, n);
    let mut right = DMatrix::zeros(n, 3);
    for (t, row) in time.iter().zip(rows) {
        let (left, s) = share(*t);
        for (i, a) in [(left, 1.0 - s), (left + 1, s)] {
            for (j, b) in [(left, 1.0 - s), (left + 1, s)] {
                normal[(i, j)] += a * b;
            }
            for axis in 0..3 {
                right[(i, axis)] += a * row[axis];
            }
        }
    }
    // A knot that no row is near stays where its neighbours put it.
    for i in 0..n {
        normal[(i, i)] += 1e-9;
    }
    let Some(solved) = normal.cholesky().map(|c| c.solve(&right)) else { return rows.to_vec() };
    let at = |i: usize| Vec3::new(solved[(i, 0)], solved[(i, 1)], solved[(i, 2)]);
    let path = |t: &f64| {
        let (left, s) = share(*t);
        at(left) * (1.0 - s) + at(left + 1) * s
    };
    time.iter().map(path).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// Ramp, hold, ramp back: the noise falls to less than a third, and the corners stay where they are.
    #[test]
    fn a_ramp_and_hold_comes_back() {
        let depth = |t: f64| (2e-3 * t.min(1.0)).min(2e-3 * (4.2 - t)).max(0.0);
        let time: Vec<f64> = (0..230).map(|i| 0.02 * f64::from(i)).collect();
        let sd = 1e-5;
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let normal = Normal::new(0.0, sd).expect("a width");
        let noisy: Vec<Vec3> = time
            .iter()
            .map(|t| Vec3::new(0.0, 0.0, -depth(*t)) + Vec3::from_fn(|_, _| normal.sample(&mut random)))
            .collect();
        let path = without_noise(&time, &noisy, [sd; 3]);
        let squares: f64 = path.iter().zip(&time).map(|(p, t)| (p.z + depth(*t)).powi(2)).sum();
        let left = (squares / time.len() as f64).sqrt();
        assert!(left < sd / 3.0, "{left}");
        let worst = path.iter().zip(&time).map(|(p, t)| (p.z + depth(*t)).abs()).fold(0.0, f64::max);
        assert!(worst < 2.0 * sd, "{worst}");
    }

    /// A motion that bends is followed.
    #[test]
    fn a_wave_is_followed() {
        let time: Vec<f64> = (0..300).map(|i| 0.02 * f64::from(i)).collect();
        let wave: Vec<Vec3> = time.iter().map(|t| Vec3::new(0.0, 0.0, 1e-3 * (2.0 * t).sin())).collect();
        let path = without_noise(&time, &wave, [1e-5; 3]);
        let worst = path.iter().zip(&wave).map(|(p, w)| (p - w).norm()).fold(0.0, f64::max);
        assert!(worst < 3e-5, "{worst}");
    }
}
