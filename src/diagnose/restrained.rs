//! Where a reading has restraint, and how stiff it is.

use super::diagnosis::Restrained;
use super::model::Model;
use super::parameters::{spread, stiffness};
use super::refit::Fitted;
use crate::geometry::Vec3;
use crate::inverse::{Parameter, PatchErrors};
use nalgebra::{DMatrix, DVector};

/// The patches that act in a reading; `covariance` is that of all that is fitted, `elements` what these get wrong of every patch.
pub(super) fn restrained(
    model: &Model<'_>,
    fitted: &Fitted,
    covariance: &DMatrix<f64>,
    elements: &[PatchErrors],
) -> Vec<Restrained> {
    let found = &model.settled.at.state.patches;
    let acts = |patch: &usize| !fitted.acting.without.contains(patch);
    let patches = (0..found.len()).filter(acts).map(|patch| {
        let PatchErrors { centroid_m, springs: of_springs } = elements[patch];
        let Moved { by_m, larger, gradients } = moved(model.baseline(), patch, &fitted.at);
        let springs = model.patch_n_per_m(patch, &fitted.at);
        Restrained {
            centroid_m: model.settled.problem.on_the_surface(&(found[patch].centre + by_m)),
            centroid_sd_m: gradients.map(|by| {
                Vec3::from_fn(|axis, _| spread(model, fitted, covariance, &by[axis]).hypot(centroid_m[axis]))
            }),
            radius_m: found[patch].radius_m * larger,
            stiffness_n_per_m: springs
                .map(|(value, by)| stiffness(model, fitted, covariance, value, &by, of_springs)),
        }
    });
    patches.collect()
}

/// How a patch differs from the one that was found.
struct Moved {
    by_m: Vec3,
    /// Its radius over that.
    larger: f64,
    /// Derivatives of its centre's coordinates by all parameters; none where it stays.
    gradients: Option<[DVector<f64>; 3]>,
}

/// How the baseline's `parameters`, the first of those `at` these values, have moved and enlarged a patch.
fn moved(parameters: &[Parameter], patch: usize, at: &DVector<f64>) -> Moved {
    let (mut by_m, mut larger, mut gradients) = (Vec3::zeros(), 1.0, None);
    for (i, parameter) in parameters.iter().enumerate() {
        match *parameter {
            Parameter::Shift(of, tangent) if of == patch => {
                by_m += tangent * at[i];
                let none = || [0, 1, 2].map(|_| DVector::zeros(at.len()));
                let gradients: &mut [DVector<f64>; 3] = gradients.get_or_insert_with(none);
                gradients.iter_mut().zip(&tangent).for_each(|(by, along)| by[i] = *along);
            }
            Parameter::LogRadius(of) if of == patch => larger = at[i].exp(),
            _ => {}
        }
    }
    Moved { by_m, larger, gradients }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along slanted tangents a shift comes out along the axes; a patch without a place of its own stays where it is.
    #[test]
    fn patches_are_where_their_shifts_take_them() {
        let (a, b) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.0));
        let parameters =
            [Parameter::LogModulus, Parameter::Shift(1, a), Parameter::Shift(1, b), Parameter::LogRadius(1)];
        let at = DVector::from_row_slice(&[9.0, 1e-3, 2e-3, 0.1, 7.0]);
        let Moved { by_m, larger, gradients } = moved(&parameters, 1, &at);
        assert!((by_m - Vec3::new(-1e-3, 2e-3, 0.0)).norm() < 1e-15, "{by_m}");
        assert!((larger - f64::exp(0.1)).abs() < 1e-15);
        let [x, y, z] = gradients.expect("it moves");
        assert_eq!(x.as_slice(), [0.0, 0.6, -0.8, 0.0, 0.0]);
        assert_eq!(y.as_slice(), [0.0, 0.8, 0.6, 0.0, 0.0]);
        assert_eq!(z.as_slice(), [0.0; 5]);
        let Moved { by_m, larger, gradients } = moved(&parameters, 0, &at);
        assert_eq!((by_m, larger, gradients), (Vec3::zeros(), 1.0, None));
    }
}
