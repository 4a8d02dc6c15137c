//! A right-handed orthonormal basis with a given third axis.

use super::{Mat3, Vec3};

/// Columns `e₁, e₂, e₃`: orthonormal, right-handed, `e₃` along `axis` (any non-zero length).
///
/// `e₁` is made from the coordinate axis least aligned with `axis`, so the basis never degenerates.
pub fn basis_from_axis(axis: &Vec3) -> Mat3 {
    let e3 = axis.normalize();
    let mut helper = Vec3::zeros();
    helper[e3.abs().imin()] = 1.0;
    let e1 = helper.cross(&e3).normalize();
    Mat3::from_columns(&[e1, e3.cross(&e1), e3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orthonormal_and_right_handed() {
        for axis in [Vec3::z(), -Vec3::x(), Vec3::new(0.3, -0.2, 5.0), Vec3::new(1.0, 1.0, 1.0)] {
            let q = basis_from_axis(&axis);
            assert!((q.transpose() * q - Mat3::identity()).norm() < 1e-14);
            assert!((q.determinant() - 1.0).abs() < 1e-14);
            assert!((q.column(2) - axis.normalize()).norm() < 1e-14);
        }
    }
}
