//! A phantom made ready for many sessions: its shape, the places where it may be touched, and its compliance there.

use super::condensed::Loads;
use crate::geometry::Vec3;
use crate::sim::SimError;
use crate::sim::hex_mesh::Slab;
use crate::sim::instruments::scattered_sites;
use crate::sim::linear::{Compliance, condense};
use crate::sim::near_field::NearField;
use crate::sim::resolution::RemainderResolution;
use crate::sim::skin::{Rim, Skin, SkinCut};
use crate::sim::supports::{Patch, Shape};
use std::sync::Arc;

/// A block with its known glue, and everything on it that a session may use.
#[derive(Debug, Clone, PartialEq)]
pub struct PhantomPlan {
    /// Seed of the marker sites and of the fit's mesh.
    pub seed: u64,
    /// The block and its known glue.
    pub slab: Slab,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Where a tip may press.
    pub sites: Vec<Site>,
    /// Where springs may pull on the underside.
    pub patches: Vec<Disc>,
    /// Where the underside may be glued besides.
    pub spots: Vec<Disc>,
    /// Mean distance between markers (m).
    pub marker_spacing_m: f64,
}

/// Where a tip may press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Centre of the tip on the undeformed surface (m).
    pub centre_m: [f64; 3],
    /// Unit vector into the phantom, along an axis.
    pub inward: [f64; 3],
    /// Radius of the tip (m).
    pub radius_m: f64,
}

/// A disc on the underside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Centre (m).
    pub centre_m: [f64; 3],
    /// Radius (m).
    pub radius_m: f64,
}

/// A plan with its compliances. Made once; all sessions on it share it.
#[derive(Debug, Clone)]
pub struct Phantom {
    pub(super) plan: PhantomPlan,
    /// Marker sites (m).
    pub(super) markers: Vec<[f64; 3]>,
    /// What a camera sees of it, if there is one.
    pub(super) skin: Option<Arc<Skin>>,
    /// All points whose displacement is known (m): the markers, then the vertices of the skin.
    pub(super) watched: Vec<[f64; 3]>,
    /// Supports: sites, patches, then 15 functions a spot.
    pub(super) compliance: Compliance,
    /// What the weight does to supports and watched points.
    pub(super) weight: Loads,
}

impl PhantomPlan {
    /// Fields of sites, patches and spots, in this order.
    pub(super) fn fields(&self) -> Result<Vec<NearField>, SimError> {
        self.discs()?
            .into_iter()
            .map(|(patch, shape)| Ok(NearField::new(patch, shape, &self.slab, self.poisson_ratio)))
            .collect()
    }

    /// Discs of sites, patches and spots, in this order, with how their traction is spread.
    pub(super) fn discs(&self) -> Result<Vec<(Patch, Shape)>, SimError> {
        let mut discs = Vec::new();
        for site in &self.sites {
            let outward = -Vec3::from(site.inward);
            let patch = Patch::on(&self.slab, "tip", site.centre_m, outward, site.radius_m)?;
            discs.push((patch, Shape::Uniform));
        }
        for (what, shape, places) in
            [("spring patch", Shape::Uniform, &self.patches), ("glued spot", Shape::Held, &self.spots)]
        {
            for disc in places {
                let patch = Patch::on(&self.slab, what, disc.centre_m, -Vec3::z(), disc.radius_m)?;
                discs.push((patch, shape));
            }
        }
        Ok(discs)
    }

    /// Marker sites (m).
    pub(in crate::sim) fn markers(&self) -> Vec<[f64; 3]> {
        scattered_sites(&self.slab, self.marker_spacing_m, self.seed)
    }
}

impl Phantom {
    /// Condenses the block to all its places and markers.
    ///
    /// # Errors
    /// [`SimError`] when a place is not wholly on its side, or the block cannot be meshed or solved.
    pub fn prepare(plan: &PhantomPlan) -> Result<Self, SimError> {
        Self::condensed(plan, None)
    }

    /// The same with a skin that a camera can look at, cut finer at the rims of the sites.
    ///
    /// # Errors
    /// [`SimError`] as for [`Phantom::prepare`], and a cut that means nothing.
    pub fn prepare_seen(plan: &PhantomPlan, cut: &SkinCut) -> Result<Self, SimError> {
        let axis = |site: &Site| Vec3::from(site.inward).abs().imax();
        let rims: Vec<Rim> = plan.sites.iter().map(|s| (s.centre_m, axis(s), s.radius_m)).collect();
        Self::condensed(plan, Some(Skin::cut(&plan.slab, &rims, cut)?))
    }

    fn condensed(plan: &PhantomPlan, skin: Option<Skin>) -> Result<Self, SimError> {
        let fields = plan.fields()?;
        let markers = plan.markers();
        let mut watched = markers.clone();
        watched.extend(skin.iter().flat_map(|s| &s.points_m));
        let meshes = RemainderResolution::SMALL_STRAIN.meshes(plan.slab, &fields)?;
        let (compliance, factor) = condense(&meshes, plan.poisson_ratio, &fields, &watched)?;
        let weight = Loads::weight(plan, &meshes[1], &factor, &watched)?;
        Ok(Self { plan: plan.clone(), markers, skin: skin.map(Arc::new), watched, compliance, weight })
    }

    /// What it was made from.
    pub fn plan(&self) -> &PhantomPlan {
        &self.plan
    }

    /// What a camera sees of it; none if it was prepared without.
    pub fn skin(&self) -> Option<&Arc<Skin>> {
        self.skin.as_ref()
    }

    /// Where its markers are at rest (m, phantom frame), by index.
    pub fn markers(&self) -> &[[f64; 3]] {
        &self.markers
    }

    /// Support columns of a site.
    pub(super) fn site_columns(&self, site: usize) -> std::ops::Range<usize> {
        3 * site..3 * site + 3
    }

    /// Support columns of a patch.
    pub(super) fn patch_columns(&self, patch: usize) -> std::ops::Range<usize> {
        let first = 3 * (self.plan.sites.len() + patch);
        first..first + 3
    }

    /// Support columns of a spot.
    pub(super) fn spot_columns(&self, spot: usize) -> std::ops::Range<usize> {
        let count = 3 * Shape::Held.functions();
        let first = 3 * (self.plan.sites.len() + self.plan.patches.len()) + count * spot;
        first..first + count
    }
}
