//! Where a reading has restraint, and how stiff it is.

use super::diagnosis::Restrained;
use super::error::DiagnoseError;
use super::model::Model;
use super::parameters::stiffness;
use super::refit::Fitted;
use crate::geometry::Vec3;
use crate::inverse::Parameter;
use nalgebra::{DMatrix, DVector};

/// The patches that act in a reading; `covariance` is that of all that is fitted.
pub(super) fn restrained(
    model: &Model<'_>,
    fitted: &Fitted,
    covariance: &DMatrix<f64>,
) -> Result<Vec<Restrained>, DiagnoseError> {
    let elements = model.settled.springs_error()?;
    let found = &model.settled.at.state.patches;
    let acts = |patch: &usize| !fitted.acting.without.contains(patch);
    let patches = (0..found.len()).filter(acts).map(|patch| {
        let moved = moved(model.baseline(), patch, &fitted.at, covariance);
        let springs = model
            .patch_n_per_m(patch, &fitted.at)
            .map(|(value, gradient)| stiffness(model, fitted, covariance, value, &gradient, elements));
        Restrained {
            centroid_m: found[patch].centre + moved.by_m,
            centroid_sd_m: moved.sd_m,
            radius_m: found[patch].radius_m * moved.larger,
            stiffness_n_per_m: springs,
        }
    });
    Ok(patches.collect())
}

/// How a patch differs from the one that was found.
struct Moved {
    by_m: Vec3,
    sd_m: Vec3,
    /// Its radius over that.
    larger: f64,
}

/// How the baseline's `parameters` at these values have moved and enlarged a patch.
fn moved(parameters: &[Parameter], patch: usize, at: &DVector<f64>, covariance: &DMatrix<f64>) -> Moved {
    let shifts: Vec<(usize, Vec3)> = parameters
        .iter()
        .enumerate()
        .filter_map(|(i, parameter)| match *parameter {
            Parameter::Shift(of, tangent) if of == patch => Some((i, tangent)),
            _ => None,
        })
        .collect();
    let by_m = shifts.iter().map(|(i, tangent)| tangent * at[*i]).sum();
    let variance = |axis: usize| -> f64 {
        let with = |(i, a): &(usize, Vec3)| -> f64 {
            shifts.iter().map(|(j, b)| a[axis] * b[axis] * covariance[(*i, *j)]).sum()
        };
        shifts.iter().map(with).sum()
    };
    let radius = parameters.iter().position(|parameter| *parameter == Parameter::LogRadius(patch));
    Moved {
        by_m,
        sd_m: Vec3::from_fn(|axis, _| variance(axis).max(0.0).sqrt()),
        larger: radius.map_or(1.0, |i| at[i].exp()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along slanted tangents a shift and its variance come out along the axes; another patch's, and a patch without a place of its own,
    /// stay where they are.
    #[test]
    fn patches_are_where_their_shifts_take_them() {
        let (a, b) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.0));
        let parameters =
            [Parameter::LogModulus, Parameter::Shift(1, a), Parameter::Shift(1, b), Parameter::LogRadius(1)];
        let at = DVector::from_row_slice(&[9.0, 1e-3, 2e-3, 0.1]);
        let mut covariance = DMatrix::from_diagonal(&DVector::from_row_slice(&[1.0, 4e-8, 1e-8, 1e-2]));
        covariance[(1, 2)] = 1e-8;
        covariance[(2, 1)] = 1e-8;
        let of = |patch| moved(&parameters, patch, &at, &covariance);
        let Moved { by_m, sd_m, larger } = of(1);
        assert!((by_m - Vec3::new(-1e-3, 2e-3, 0.0)).norm() < 1e-15, "{by_m}");
        let variance = 0.36 * 4e-8 + 0.64 * 1e-8 - 2.0 * 0.48 * 1e-8;
        assert!((sd_m.x - f64::sqrt(variance)).abs() < 1e-15 && sd_m.z == 0.0, "{sd_m}");
        assert!((larger - f64::exp(0.1)).abs() < 1e-15);
        let Moved { by_m, sd_m, larger } = of(0);
        assert_eq!((by_m, sd_m, larger), (Vec3::zeros(), Vec3::zeros(), 1.0));
    }
}
