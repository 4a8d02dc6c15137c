//! How finely the bench cuts the phantom for one session.

use super::SimError;
use super::draw::{Draw, PokePlan};
use super::hex_mesh::{Feature, Grading, HexMesh, Place, Slab};
use super::near_field::NearField;
use super::supports::{Patch, Restraint};
use super::unknowns::Unknowns;
use crate::geometry::Vec3;

/// Sizes of the boxes where the elements have to hold everything.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Boxes far from everything (m).
    pub cell_m: f64,
    /// Boxes at the rim of a tip, in radii of the tip.
    pub tip_share: f64,
    /// Boxes at the rim of a spring patch, in its radii.
    pub spring_share: f64,
    /// Boxes at the rim of a glued spot, in its radii; the traction is singular there.
    pub spot_share: f64,
    /// Boxes at the end of the glue (m).
    pub glue_end_m: f64,
    /// How much longer boxes may be per distance from rims and the end of the glue.
    pub growth: f64,
    /// How often a box may be halved.
    pub halvings: u32,
    /// Halves the boxes around the glue, at its end and along the sides, once more; how much longer they may be per
    /// distance from it.
    pub finer_glue: Option<f64>,
}

/// The glue seems to reach further than it does by this share of the boxes at its end.
///
/// Why: the stress at the end of the glue is singular (r^(−1/2)). Elements that do not know it are too stiff by an
/// energy in proportion to their size and to the energy that would be released if the glue let go a little
/// further, which is just what moving its end does. So the mesh's glue ends earlier by this share, and the error
/// of first order is gone. Measured against refinement down to 0.3 mm for sites at 10 to 40 mm from the end: 0.21 to
/// 0.28, with 1.3 mm and 0.6 mm boxes alike. What it leaves grows with the boxes: per mm of box about 3 % of the little
/// that a restraint changes for a tip over the glue. Linear sessions extrapolate from two meshes instead.
pub(super) const GLUE_OVERREACH: f64 = 0.22;

/// Sizes of the boxes where the near fields of tips and restraints are known and the elements hold the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemainderResolution {
    /// Boxes far from everything (m).
    pub cell_m: f64,
    /// Boxes at the end of the glue in the coarser of two meshes (m).
    pub glue_end_m: f64,
    /// How much longer boxes may be per distance from the end of the glue.
    pub growth: f64,
    /// How long boxes may be per distance from the mirror images of tips and restraints.
    pub image_growth: f64,
    /// How often a box may be halved.
    pub halvings: u32,
}

impl RemainderResolution {
    /// For linear sessions, two meshes that take 5 to 6 s of one core. Measured against 4 mm boxes and 2.2 mm at the end of
    /// the glue, draws 3 and 12 (`image_growth` 0.6 and 0.5; the study in `refinement` is of this kind): tip stiffness
    /// 0.02 % and 0.04 % rms off, 0.11 % at most; what restraints change, 0.05 % and 0.09 % rms; markers, of the largest
    /// displacement, 0.07 % and 0.23 % rms over tips. Both are extrapolated alike, so that this does not see an
    /// error of the extrapolation; elements that hold the whole field agree to 0.2 %.
    pub const SMALL_STRAIN: Self =
        Self { cell_m: 0.006, glue_end_m: 0.0036, growth: 0.5, image_growth: 1.0, halvings: 3 };

    /// Two meshes for the remainders of `fields`; around the glue the boxes of the second are half as long.
    pub(super) fn meshes(&self, slab: Slab, fields: &[NearField]) -> Result<[Unknowns; 2], SimError> {
        let end = Place::GlueEnd { x: slab.glue_end_m };
        let mut features = vec![Feature { place: end, cell_m: self.glue_end_m, growth: self.growth }];
        features.extend(fields.iter().flat_map(|f| f.images(&slab, self.image_growth)));
        let mesh = |finer_glue| -> Result<Unknowns, SimError> {
            let grading = Grading { cell_m: self.cell_m, halvings: self.halvings, finer_glue };
            Ok(Unknowns::new(HexMesh::new(slab, &features, &grading)?))
        };
        Ok([mesh(None)?, mesh(Some(self.growth))?])
    }
}

/// A mesh graded to `features` and to the end of the glue, which lies a little before the true one.
fn cut(
    slab: Slab,
    mut features: Vec<Feature>,
    glue_cell_m: f64,
    growth: f64,
    grading: &Grading,
) -> Result<Unknowns, SimError> {
    let end = |x| Feature { place: Place::GlueEnd { x }, cell_m: glue_cell_m, growth };
    features.insert(0, end(slab.glue_end_m));
    let first = HexMesh::new(slab, &features, grading)?;
    let box_m = first.size_at([slab.glue_end_m, 0.5 * slab.size_m[1], 0.0])[0];
    let glue_end_m = slab.glue_end_m - GLUE_OVERREACH * box_m;
    features[0] = end(glue_end_m);
    Ok(Unknowns::new(HexMesh::new(Slab { glue_end_m, ..slab }, &features, grading)?))
}

impl PokePlan {
    /// The disc of the tip on the undeformed surface.
    pub(super) fn patch(&self, draw: &Draw) -> Result<Patch, SimError> {
        Patch::on(&draw.slab, "tip", self.site_m, -Vec3::from(self.direction), self.radius_m)
    }
}

impl Resolution {
    /// For large strain, where every Newton step costs a factorisation and each tip has a mesh of its own.
    pub const FINITE_STRAIN: Self = Self {
        cell_m: 0.0125,
        tip_share: 0.4,
        spring_share: 0.65,
        spot_share: 0.3,
        glue_end_m: 0.002,
        growth: 0.8,
        halvings: 3,
        finer_glue: None,
    };

    /// The mesh for the tips of `pokes` and all restraints of `draw`.
    pub(super) fn mesh(&self, draw: &Draw, pokes: &[PokePlan]) -> Result<Unknowns, SimError> {
        let mut features = Vec::new();
        for poke in pokes {
            features.push(poke.patch(draw)?.feature(self.tip_share, self.growth));
        }
        for restraint in &draw.restraints {
            let share = match restraint {
                Restraint::Springs { .. } => self.spring_share,
                Restraint::Glued { .. } => self.spot_share,
            };
            features.push(restraint.patch(&draw.slab)?.feature(share, self.growth));
        }
        let grading = Grading { cell_m: self.cell_m, halvings: self.halvings, finer_glue: self.finer_glue };
        cut(draw.slab, features, self.glue_end_m, self.growth, &grading)
    }
}

#[cfg(test)]
mod tests {
    use super::super::supports::Shape;
    use super::*;

    /// Also where something else than the end of the glue asks for small boxes there.
    #[test]
    fn the_second_mesh_is_twice_as_fine_around_the_glue_only() -> Result<(), SimError> {
        let slab = Slab { size_m: [0.1, 0.08, 0.024], glue_end_m: 0.04 };
        let patch = Patch::on(&slab, "spring patch", [0.047, 0.03, 0.0], -Vec3::z(), 0.005)?;
        let field = NearField::new(patch, Shape::Uniform, &slab, 0.47);
        let [coarse, fine] =
            RemainderResolution::SMALL_STRAIN.meshes(slab, &[field])?.map(|unknowns| unknowns.mesh);
        for (x, y) in
            [(0.0401, 0.0301), (0.0401, 0.0701), (0.0001, 0.0301), (0.0201, 0.0001), (0.0201, 0.0799)]
        {
            let [long, short] = [&coarse, &fine].map(|mesh| mesh.size_at([x, y, 0.0]));
            for axis in 0..3 {
                assert!((long[axis] / short[axis] - 2.0).abs() < 1e-9, "{long:?} and {short:?}");
            }
        }
        assert!(coarse.size_at([0.0401, 0.0301, 0.0])[0] < 0.6 * coarse.size_at([0.0401, 0.0701, 0.0])[0]);
        for far in [[0.09, 0.07, 0.02], [0.02, 0.04, 0.02], [0.07, 0.03, 0.0]] {
            assert_eq!(coarse.size_at(far), fine.size_at(far));
        }
        Ok(())
    }
}
