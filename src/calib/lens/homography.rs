//! The map from a plane to its picture, straight lines to straight lines.
//!
//! `(u, v, 1) ∝ H (x, y, 1)` by the direct linear transformation with coordinates of mean 0 and mean distance √2 on both sides (Hartley 1997,
//! IEEE PAMI 19, 580): the right singular vector of the smallest singular value. No distortion is in it.

use crate::geometry::{Mat3, Vec3};
use nalgebra::{DMatrix, Vector2};

/// A second smallest singular value below this share of the largest one leaves more than one map: points on a line.
const SINGULAR: f64 = 1e-9;

/// The map that carries the first of each pair to the second, of length 1 as nine numbers; none for fewer than four pairs, or for points
/// on a line.
pub(super) fn homography(pairs: &[(Vector2<f64>, Vector2<f64>)]) -> Option<Mat3> {
    if pairs.len() < 4 {
        return None;
    }
    let from = normalising(pairs.iter().map(|p| p.0))?;
    let to = normalising(pairs.iter().map(|p| p.1))?;
    // A row of zeros makes the matrix square at least, so that all right singular vectors are there.
    let mut rows = DMatrix::zeros((2 * pairs.len()).max(9), 9);
    for (k, pair) in pairs.iter().enumerate() {
        let (p, q) = (from * pair.0.push(1.0), to * pair.1.push(1.0));
        for i in 0..3 {
            rows[(2 * k, i)] = p[i];
            rows[(2 * k, 6 + i)] = -q.x * p[i];
            rows[(2 * k + 1, 3 + i)] = p[i];
            rows[(2 * k + 1, 6 + i)] = -q.y * p[i];
        }
    }
    let h = least_direction(rows)?;
    let map = to.try_inverse()? * Mat3::from_fn(|i, j| h[3 * i + j]) * from;
    let length = map.norm();
    (length > 0.0 && length.is_finite()).then(|| map / length)
}

/// The unit vector that a matrix shortens most; none where a second one is shortened as much.
pub(super) fn least_direction(rows: DMatrix<f64>) -> Option<Vec<f64>> {
    if rows.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let svd = rows.svd(false, true);
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|&a, &b| svd.singular_values[a].total_cmp(&svd.singular_values[b]));
    let (&least, &second, &largest) = (order.first()?, order.get(1)?, order.last()?);
    let unique = svd.singular_values[second] > SINGULAR * svd.singular_values[largest];
    unique.then(|| svd.v_t.map(|v_t| v_t.row(least).iter().copied().collect())).flatten()
}

/// Shifts points to the mean 0 and scales them to the mean distance √2.
fn normalising(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<Mat3> {
    let count = points.clone().count() as f64;
    let mean: Vector2<f64> = points.clone().sum::<Vector2<f64>>() / count;
    let distance = points.map(|p| (p - mean).norm()).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / distance;
    scale.is_finite().then(|| {
        let shift = -scale * mean;
        Mat3::from_columns(&[
            Vec3::new(scale, 0.0, 0.0),
            Vec3::new(0.0, scale, 0.0),
            Vec3::new(shift.x, shift.y, 1.0),
        ])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_map_is_found_and_a_line_has_none() {
        let map = Mat3::new(900.0, 30.0, 310.0, -12.0, 880.0, 250.0, 0.4, -0.3, 1.0);
        let seen = |p: Vector2<f64>| {
            let q = map * p.push(1.0);
            (p, q.xy() / q.z)
        };
        let pairs: Vec<_> =
            (0..20).map(|k| seen(Vector2::new(f64::from(k % 5) * 0.02, f64::from(k / 5) * 0.03))).collect();
        let found = homography(&pairs).expect("a plane");
        let found = found * (map[(2, 2)] / found[(2, 2)]);
        assert!((found - map).norm() < 1e-9 * map.norm(), "{found}");
        assert_eq!(homography(&pairs[..3]), None);
        let line: Vec<_> = (0..9).map(|k| seen(Vector2::new(0.01 * f64::from(k), 0.02))).collect();
        assert_eq!(homography(&line), None);
    }
}
