//! Where a dot must be when its neighbours are where they are: a local affine map, by weighted least squares.
//!
//! Values near by count more (weight 1/(d² + s²/4) for a spacing s). The slopes are held back a little, so that three neighbours on one
//! side do not throw the prediction about.

use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};

/// Neighbours without which nothing is predicted.
pub(super) const LEAST_SUPPORT: usize = 3;

/// Part of the mean square distance that is added to the slopes' diagonal.
const RIDGE: f64 = 0.03;

/// Value at the origin of a field known at places around it.
pub(super) fn predict(
    known: impl Iterator<Item = (Vector2<f64>, Vector2<f64>)>,
    spacing: f64,
) -> Option<(Vector2<f64>, usize)> {
    let (mut normal, mut right, mut count) = (Matrix3::zeros(), Matrix3x2::zeros(), 0);
    for (place, value) in known {
        let row = Vector3::new(1.0, place.x / spacing, place.y / spacing);
        let weight = 1.0 / (place.norm_squared() / (spacing * spacing) + 0.25);
        normal += row * row.transpose() * weight;
        right += row * value.transpose() * weight;
        count += 1;
    }
    if count < LEAST_SUPPORT {
        return None;
    }
    let ridge = RIDGE * 0.5 * (normal[(1, 1)] + normal[(2, 2)]) + 1e-9;
    normal[(1, 1)] += ridge;
    normal[(2, 2)] += ridge;
    let solution = normal.cholesky()?.solve(&right);
    Some((solution.row(0).transpose(), count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_affine_field_is_met_from_all_round_and_nearly_from_one_side() {
        let field =
            |p: Vector2<f64>| Vector2::new(3.0 + 0.1 * p.x - 0.05 * p.y, -1.0 + 0.02 * p.x + 0.08 * p.y);
        let ring = (0..8).map(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            Vector2::new(cos, sin) * 40.0
        });
        let (all, count) = predict(ring.clone().map(|p| (p, field(p))), 40.0).expect("eight");
        assert!((all - field(Vector2::zeros())).norm() < 1e-9 && count == 8);
        let side: Vec<_> = ring.filter(|p| p.x > 10.0).collect();
        let (one, _) = predict(side.iter().map(|&p| (p, field(p))), 40.0).expect("three");
        assert!((one - field(Vector2::zeros())).norm() < 2.5, "{one}");
        assert_eq!(predict(side.iter().take(2).map(|&p| (p, p)), 40.0), None);
    }
}
