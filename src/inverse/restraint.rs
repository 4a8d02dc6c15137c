//! Restraint patches as the fit moves them about: places on the search surface, each made of discs.

use super::blocks::{Bench, Blocks};
use super::error::InverseError;
use super::forward::Group;
use super::placed::Placed;
use crate::fem::Spot;
use crate::geometry::{Vec3, basis_from_axis};
use std::sync::Arc;

/// One restraint patch in the making.
#[derive(Debug, Clone, PartialEq)]
pub struct Restraint {
    /// Centre on the search surface (m).
    pub centre: Vec3,
    /// Radius (m).
    pub radius_m: f64,
    /// `E / k` (1/m) of the whole patch; 0 is glue.
    pub softness: f64,
    /// Whether it holds every point of its area (glue) or only the mean (springs through a patch).
    pub glued: bool,
}

/// Discs of a glued spot: one in the middle, six around it. Radius of a disc, and distance of the outer ones from the
/// centre, in units of the spot's radius: such that uniform tractions on discs that hold their own mean displacement are
/// as stiff as a rigid disc of the spot's radius against being pushed and tilted (see the test).
const DISC: f64 = 0.36;
const ARM: f64 = 0.8;

/// A face belongs to the side of the body on which a spot sits when its normal has this component along the spot's.
const FACING: f64 = 0.7;

/// Alike is what differs by no more than this share.
const ALIKE: f64 = 0.1;

/// Restraint patches put on a model: discs, their responses, and the groups that share a stiffness.
#[derive(Clone)]
pub struct Mounted {
    /// All discs.
    pub discs: Vec<Arc<Placed>>,
    /// One group a patch.
    pub groups: Vec<Group>,
    /// Compliance with everything.
    pub blocks: Blocks,
}

impl Restraint {
    /// Whether another patch is this one, to a tenth of radius and softness.
    pub fn alike(&self, other: &Self) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.max(b);
        self.glued == other.glued
            && (self.centre - other.centre).norm() <= ALIKE * self.radius_m
            && close(self.softness, other.softness)
            && close(self.radius_m, other.radius_m)
    }

    /// Whether every patch of one restraint stands for one of the other that is the `same`, in any order.
    pub fn paired(own: &[Self], others: &[Self], same: impl Fn(&Self, &Self) -> bool) -> bool {
        let mut left: Vec<&Self> = others.iter().collect();
        let mut takes = |own: &Self| {
            let known = left.iter().position(|other| same(own, other));
            known.map(|known| left.swap_remove(known)).is_some()
        };
        own.len() == others.len() && own.iter().all(&mut takes)
    }

    /// The patch's discs on the model's search surface.
    pub fn discs(&self, bench: &Bench, search: &[usize]) -> Result<Vec<Spot>, InverseError> {
        let space = bench.model.space();
        if !self.glued {
            return Ok(vec![Spot::disc(space, search, &self.centre, self.radius_m)?]);
        }
        let middle = Spot::disc(space, search, &self.centre, self.radius_m * DISC)?;
        let Some((disc, _)) = middle.as_disc() else { return Ok(vec![middle]) };
        // A spot that reaches over an edge does not bend round it.
        let facing: Vec<usize> = (0..space.faces().len())
            .filter(|&face| space.face_triangle(face).normal().dot(&disc.normal) > FACING)
            .collect();
        let mut discs = vec![middle];
        for arm in self.arms(&disc.normal) {
            discs.push(Spot::disc(space, &facing, &(self.centre + arm), self.radius_m * DISC)?);
        }
        Ok(discs)
    }
}

impl Restraint {
    /// From a glued spot's centre to the centres of its outer discs (m); `normal` is that of the surface.
    fn arms(&self, normal: &Vec3) -> [Vec3; 6] {
        let basis = basis_from_axis(normal);
        let length = ARM * self.radius_m;
        std::array::from_fn(|i| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_3 * i as f64).sin_cos();
            basis * Vec3::new(length * cos, length * sin, 0.0)
        })
    }

    /// How its discs, the first of them on a surface with this normal, move as its radius grows, by the logarithm (m).
    pub fn growth(&self, normal: &Vec3) -> Vec<Vec3> {
        if self.glued {
            std::iter::once(Vec3::zeros()).chain(self.arms(normal)).collect()
        } else {
            Vec::new()
        }
    }
}

impl Mounted {
    /// Puts `patches` on the model of `bench`, whose search surface are the faces `search`.
    pub fn new(bench: &Bench, search: &[usize], patches: &[Restraint]) -> Result<Self, InverseError> {
        let discs = patches.iter().map(|patch| patch.discs(bench, search));
        let discs = discs.collect::<Result<Vec<_>, InverseError>>()?;
        let mut groups: Vec<Group> = Vec::new();
        for (patch, own) in patches.iter().zip(&discs) {
            let first = groups.last().map_or(0, |group| group.discs.end);
            // A group's discs share the patch's stiffness.
            groups
                .push(Group { softness: patch.softness * own.len() as f64, discs: first..first + own.len() });
        }
        let discs = bench.place(&discs)?;
        let blocks = bench.blocks(&discs);
        Ok(Self { discs, groups, blocks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{LoadedDisc, Profile};
    use nalgebra::{DMatrix, DVector, Matrix3};

    #[test]
    fn patches_are_alike_to_a_tenth_in_everything() {
        let patch = |x: f64, radius_m: f64, softness: f64, glued: bool| Restraint {
            centre: Vec3::new(x, 0.0, 0.0),
            radius_m,
            softness,
            glued,
        };
        let one = patch(0.0, 0.005, 10.0, false);
        assert!(one.alike(&patch(0.000_49, 0.0054, 10.9, false)));
        for other in [
            patch(0.000_51, 0.005, 10.0, false),
            patch(0.0, 0.0056, 10.0, false),
            patch(0.0, 0.005, 11.2, false),
            patch(0.0, 0.005, 8.9, false),
            patch(0.0, 0.005, 10.0, true),
        ] {
            assert!(!one.alike(&other) && !other.alike(&one), "{other:?}");
        }
    }

    #[test]
    fn patches_pair_in_any_order_one_to_one() {
        let at = |x: f64| Restraint {
            centre: Vec3::new(x, 0.0, 0.0),
            radius_m: 0.005,
            softness: 10.0,
            glued: false,
        };
        let paired = |own: &[Restraint], others: &[Restraint]| {
            Restraint::paired(own, others, |a, b| (a.centre - b.centre).norm() < 1.5e-3)
        };
        assert!(paired(&[], &[]) && paired(&[at(0.0), at(0.02)], &[at(0.021), at(0.001)]));
        assert!(!paired(&[at(0.0)], &[at(0.0), at(0.0)]) && !paired(&[at(0.0), at(0.0)], &[at(0.0)]));
        // Both are near the first, and none is near the second.
        assert!(!paired(&[at(0.0), at(0.001)], &[at(0.0), at(0.02)]));
    }

    /// Stiffness of the seven discs on a half-space of unit modulus, each held still in the mean, over that of a rigid
    /// disc of the spot's radius: pushed along the normal, pushed sideways, tilted.
    fn over_rigid_disc(nu: f64) -> [f64; 3] {
        let spot = Restraint { centre: Vec3::zeros(), radius_m: 1.0, softness: 0.0, glued: true };
        let centres: Vec<Vec3> = std::iter::once(Vec3::zeros()).chain(spot.arms(&Vec3::z())).collect();
        let disc = LoadedDisc::new(DISC, Profile::Uniform, nu);
        let mut compliance = DMatrix::<f64>::zeros(21, 21);
        for (i, seen) in centres.iter().enumerate() {
            for (j, loaded) in centres.iter().enumerate() {
                let mut mean = Matrix3::zeros();
                if i == j {
                    let [t, n] = disc.self_compliance(Profile::Uniform);
                    mean = Matrix3::from_diagonal(&Vec3::new(t, t, n));
                } else {
                    for k in 0..12 * 24 {
                        let r = DISC * ((f64::from(k / 24) + 0.5) / 12.0).sqrt();
                        let (sin, cos) = (std::f64::consts::TAU * (f64::from(k % 24) + 0.5) / 24.0).sin_cos();
                        mean +=
                            disc.displacement(&(seen - loaded + Vec3::new(r * cos, r * sin, 0.0))) / 288.0;
                    }
                }
                compliance.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&mean);
            }
        }
        let inverse = compliance.cholesky().expect("positive definite").inverse();
        let stiffness = |motion: &dyn Fn(usize, usize) -> f64| {
            let u = DVector::from_fn(21, |k, _| motion(k / 3, k % 3));
            u.dot(&(&inverse * &u))
        };
        let shear = 0.5 / (1.0 + nu);
        [
            stiffness(&|_, axis| f64::from(u8::from(axis == 2))) / (4.0 * shear / (1.0 - nu)),
            stiffness(&|_, axis| f64::from(u8::from(axis == 0))) / (8.0 * shear / (2.0 - nu)),
            stiffness(&|d, axis| if axis == 2 { centres[d].x } else { 0.0 }) * 3.0 * (1.0 - nu)
                / (8.0 * shear),
        ]
    }

    /// Johnson 1985, equations 3.36 and 3.91b, and section 3.3 for a moment: exact without friction, and close to a bonded disc
    /// near ν = ½.
    #[test]
    fn a_glued_spot_holds_like_a_rigid_disc() {
        for nu in [0.45, 0.47, 0.4999] {
            let [normal, sideways, tilt] = over_rigid_disc(nu);
            assert!((normal - 1.0).abs() < 0.02, "{normal}");
            assert!((sideways - 1.0).abs() < 0.02, "{sideways}");
            assert!((tilt - 1.0).abs() < 0.05, "{tilt}");
        }
    }
}
