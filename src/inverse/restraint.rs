//! Restraint patches as the fit moves them about: places on the search surface, each made of discs.

use super::blocks::{Bench, Blocks};
use super::error::InverseError;
use super::forward::Group;
use crate::fem::{Response, Spot};
use crate::geometry::{Vec3, basis_from_axis};

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

/// Discs of a glued spot: one in the middle, six around it, touching, in units of the spot's radius. Uniform
/// tractions on seven discs that hold their own mean displacement follow a rigid spot's tilt and the crowding of
/// its traction toward the rim.
const SEVEN: f64 = 1.0 / 3.0;

/// Restraint patches put on a model: discs, their responses, and the groups that share a stiffness.
pub struct Mounted {
    /// All discs.
    pub discs: Vec<Spot>,
    /// Response to a unit force on each.
    pub responses: Vec<Response>,
    /// One group a patch.
    pub groups: Vec<Group>,
    /// Compliance with everything.
    pub blocks: Blocks,
}

impl Restraint {
    /// The patch's discs on the model's search surface.
    pub fn discs(&self, bench: &Bench, search: &[usize]) -> Result<Vec<Spot>, InverseError> {
        let space = bench.model.space();
        if !self.glued {
            return Ok(vec![Spot::disc(space, search, &self.centre, self.radius_m)?]);
        }
        let middle = Spot::disc(space, search, &self.centre, self.radius_m * SEVEN)?;
        let basis = match middle.as_disc() {
            Some((disc, _)) => basis_from_axis(&disc.normal),
            None => basis_from_axis(&Vec3::z()),
        };
        let mut discs = vec![middle];
        for i in 0..6 {
            let (sin, cos) = (std::f64::consts::FRAC_PI_3 * f64::from(i)).sin_cos();
            let arm = 2.0 * SEVEN * self.radius_m;
            let centre = self.centre + basis * Vec3::new(arm * cos, arm * sin, 0.0);
            let all: Vec<usize> = (0..space.faces().len()).collect();
            discs.push(Spot::disc(space, &all, &centre, self.radius_m * SEVEN)?);
        }
        Ok(discs)
    }
}

impl Mounted {
    /// Puts `patches` on the model of `bench`, whose search surface are the faces `search`.
    pub fn new(bench: &Bench, search: &[usize], patches: &[Restraint]) -> Result<Self, InverseError> {
        let mut discs = Vec::new();
        let mut groups = Vec::new();
        for patch in patches {
            let own = patch.discs(bench, search)?;
            let range = discs.len()..discs.len() + own.len();
            // A group's discs share the patch's stiffness.
            groups.push(Group { softness: patch.softness * own.len() as f64, discs: range });
            discs.extend(own);
        }
        let responses = bench.model.respond(&discs.iter().collect::<Vec<_>>())?;
        let blocks = bench.blocks(&discs, &responses);
        Ok(Self { discs, responses, groups, blocks })
    }
}
