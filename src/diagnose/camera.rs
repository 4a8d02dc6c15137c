//! What the camera makes of a displacement, and when: depth gain, scale, rotation and lag.

use super::dual::{Dual, gradient};
use super::effects::Effects;
use nalgebra::DMatrix;

/// Depth gain, then scale, then rotation (Rodrigues 1840), as one matrix.
pub(super) fn camera(effects: &Effects) -> [[Dual; 3]; 3] {
    let [x, y, z] = effects.rotation_rad;
    let angle2 = x * x + y * y + z * z;
    // Series of sin φ / φ and (1 − cos φ) / φ²: exact to 10⁻⁷ for half a radian, and smooth at none.
    let a = angle2 * (angle2 * (angle2 * (-1.0 / 5040.0) + 1.0 / 120.0) - 1.0 / 6.0) + 1.0;
    let b = angle2 * (angle2 * (angle2 * (-1.0 / 40320.0) + 1.0 / 720.0) - 1.0 / 24.0) + 0.5;
    let cross = [[Dual::from(0.0), -z, y], [z, Dual::from(0.0), -x], [-y, x, Dual::from(0.0)]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let square: Dual = (0..3).map(|k| cross[i][k] * cross[k][j]).sum();
            let turned = cross[i][j] * a + square * b + f64::from(u8::from(i == j));
            turned * effects.scale * if j == 2 { effects.depth_gain } else { Dual::from(1.0) }
        })
    })
}

/// The rows between which the time lies that a frame shows, and how far it is from the first to the second; beyond the
/// first and last row it is at them.
pub(super) fn shown(time_s: &[f64], lag_s: Dual, stamp_s: f64) -> Option<([usize; 2], Dual)> {
    let shown = -lag_s + stamp_s;
    let (first, last) = (*time_s.first()?, *time_s.last()?);
    if shown.re <= first || time_s.len() < 2 {
        return Some(([0, 0], Dual::from(0.0)));
    }
    let right = time_s.partition_point(|t| *t < shown.re.min(last)).clamp(1, time_s.len() - 1);
    let width = time_s[right] - time_s[right - 1];
    let s = (shown - time_s[right - 1]) / width;
    Some(([right - 1, right], if s.re > 1.0 { Dual::from(1.0) } else { s }))
}

/// Linear between two values.
pub(super) fn between(a: Dual, b: Dual, share: Dual) -> Dual {
    a * (-share + 1.0) + b * share
}

/// As [`between`], of columns (value, then derivatives) with those of the share.
pub(super) fn columns_between(a: &DMatrix<f64>, b: &DMatrix<f64>, share: &Dual) -> DMatrix<f64> {
    let (mut columns, apart) = (a * (1.0 - share.re) + b * share.re, b.column(0) - a.column(0));
    for (p, by) in gradient(share, columns.ncols() - 1).iter().enumerate() {
        columns.column_mut(1 + p).axpy(*by, &apart, 1.0);
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::super::dual::{columns, variable, with_gradient};
    use super::*;
    use crate::geometry::Vec3;
    use nalgebra::{DVector, Rotation3};

    #[test]
    fn the_rotation_is_that_of_its_vector() {
        let mut effects = Effects::neutral(0);
        let vector = Vec3::new(0.2, -0.1, 0.15);
        effects.rotation_rad = [0, 1, 2].map(|i| Dual::from(vector[i]));
        effects.scale = Dual::from(1.1);
        effects.depth_gain = Dual::from(0.9);
        let expected = Rotation3::new(vector).matrix() * 1.1;
        let turn = camera(&effects);
        for i in 0..3 {
            for j in 0..3 {
                let gain = if j == 2 { 0.9 } else { 1.0 };
                assert!((turn[i][j].re - expected[(i, j)] * gain).abs() < 1e-9, "{i} {j}");
            }
        }
    }

    #[test]
    fn columns_lie_where_their_numbers_do() {
        let number = |value, slopes: [f64; 2]| with_gradient(value, &[(0, slopes[0]), (1, slopes[1])]);
        let a = DVector::from_vec(vec![number(1.0, [0.5, -1.0]), number(-2.0, [0.0, 3.0])]);
        let b = DVector::from_vec(vec![number(4.0, [0.25, 2.0]), number(7.0, [-1.5, 0.0])]);
        let share = number(0.3, [0.0, -2.0]);
        let by_number = a.zip_map(&b, |a, b| between(a, b, share));
        let found = columns_between(&columns(&a, 2), &columns(&b, 2), &share);
        assert!((&found - columns(&by_number, 2)).amax() < 1e-12, "{found}");
        assert!((found[(0, 2)] - (0.3 * 2.0 - 0.7 - 2.0 * 3.0)).abs() < 1e-12);
    }

    /// A lag shows an earlier state; its derivative is minus the speed.
    #[test]
    fn a_lag_shows_what_was() {
        let (time, depth) = ([0.0, 1.0, 2.0], [0.0, 3.0, 4.0].map(Dual::from));
        let lag = variable(0.25, 0);
        let at = |stamp: f64| {
            let ([a, b], share) = shown(&time, lag, stamp).expect("rows");
            between(depth[a], depth[b], share)
        };
        assert!((at(1.5).re - 3.25).abs() < 1e-12);
        assert!((gradient(&at(1.5), 1)[0] + 1.0).abs() < 1e-12);
        assert_eq!((at(0.1).re, at(9.0).re), (0.0, 4.0));
    }
}
