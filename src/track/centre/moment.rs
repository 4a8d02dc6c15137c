//! The intensity-weighted centroid, the background's plane removed: what a dot's centre is when no blurred disc fits it.
//!
//! The window is the dot's ellipse and two and a half pixels around it, moved along until it is centred on what it finds. The variance of
//! such a centroid grows with the fourth power of the window (at a radius of 6 px and a blur of 0.9 px its standard deviation is 1.3 to 1.5
//! times the Cramér–Rao bound), which is why it is only the second choice.

use super::model::BlurredDisc;
use super::window::Sample;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Window beyond the rim (px), with one more pixel of soft edge.
const MARGIN: f64 = 2.0;
/// The background's ring begins here (px beyond the rim).
const RING: f64 = 3.0;
const MOST_STEPS: usize = 20;
const AT_REST: f64 = 1e-4;

/// Centre and its covariance for noise of variance one; none without background or light.
pub(super) fn centroid(samples: &[Sample], start: BlurredDisc) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let origin = start.centre();
    let plane = background(samples, &start, origin)?;
    let mut disc = start;
    for _ in 0..MOST_STEPS {
        let (mut sum, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
        for sample in samples {
            let weight = (disc.distance(sample.at) + MARGIN + 1.0).clamp(0.0, 1.0);
            let offset = sample.at - origin;
            let light = weight * (sample.value - plane.dot(&Vector3::new(1.0, offset.x, offset.y)));
            let from = sample.at - disc.centre();
            sum += light;
            first += from * light;
            second += from * from.transpose() * (weight * weight);
        }
        if sum <= 0.0 {
            return None;
        }
        let step = first / sum;
        disc.0[0] += step.x;
        disc.0[1] += step.y;
        if (disc.centre() - origin).norm() > 3.0 {
            return None;
        }
        if step.norm() < AT_REST {
            return Some((disc.centre(), second / (sum * sum)));
        }
    }
    None
}

/// Least-squares plane of the ring around a dot.
fn background(samples: &[Sample], disc: &BlurredDisc, origin: Vector2<f64>) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for sample in samples.iter().filter(|s| disc.distance(s.at) < -RING) {
        let offset = sample.at - origin;
        let row = Vector3::new(1.0, offset.x, offset.y);
        normal += row * row.transpose();
        right += row * sample.value;
    }
    Some(normal.cholesky()?.solve(&right))
}
