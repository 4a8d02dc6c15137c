//! What a session consists of: which phantom, what holds it, how it is poked, what watches it and what acts besides.

use super::body::Body;
use super::effect::Effect;
use super::memory::Memory;
use super::phantom::{PhantomPlan, Site};
use crate::geometry::Vec3;
use crate::observation::PlannedPoke;
use crate::sim::SimError;
use crate::sim::draw::{Instruments, PokePlan};
use crate::sim::timeline::Timeline;
use std::f64::consts::FRAC_1_SQRT_2;

/// Places closer than this are one (m).
const SAME_PLACE_M: f64 = 1e-6;

/// Everything that determines a recording; equal worlds make recordings equal to the last bit.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// Name of the recording.
    pub name: String,
    /// Seed of the noise.
    pub seed: u64,
    /// The phantom with its true Poisson's ratio.
    pub phantom: PhantomPlan,
    /// Young's modulus at equilibrium and small strain (Pa); concealed.
    pub young_modulus_pa: f64,
    /// Range stated to the operator (Pa).
    pub modulus_range_pa: [f64; 2],
    /// Poisson's ratio stated to the operator. Another one than the phantom's is the effect `poisson-ratio`.
    pub stated_poisson_ratio: f64,
    /// What holds the underside besides the glue; concealed.
    pub holds: Vec<Hold>,
    /// Pokes in order.
    pub pokes: Vec<Press>,
    /// The instruments. Markers are those of the phantom; `marker_spacing_m` is not looked at.
    pub instruments: Instruments,
    /// Edge of the boxes from which the fit's tetrahedra are cut (m). Equal ones on one phantom give equal meshes; large
    /// ones leave the fit a coarse one.
    pub fit_cell_m: f64,
    /// What else acts; concealed.
    pub effects: Vec<Effect>,
}

/// What holds the underside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold {
    /// Springs that pull as a uniform traction over a patch, in proportion to its mean displacement.
    Springs {
        /// Index of the phantom's patch.
        patch: usize,
        /// Total stiffness (N/m), the same along all axes.
        stiffness_n_per_m: f64,
    },
    /// Glue on a spot.
    Glued {
        /// Index of the phantom's spot.
        spot: usize,
    },
}

/// One poke: approach at a constant rate, hold, retreat at the same rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    /// Index of the phantom's site.
    pub site: usize,
    /// Unit vector along which the stage moves; within 45° of the site's.
    pub direction: [f64; 3],
    /// Largest displacement of the stage (m).
    pub depth_m: f64,
    /// Speed of the stage (m/s).
    pub rate_m_s: f64,
    /// How long the largest displacement is held, at least (s).
    pub hold_s: f64,
}

impl World {
    /// The same world on a clock that begins `later_s` seconds later: what has changed until then is as if it had always been so.
    #[must_use]
    pub fn later(mut self, later_s: f64) -> Self {
        let rates = self.effects.iter().filter_map(|effect| match effect {
            Effect::Memory(Memory::Drying { modulus_rate_per_s }) => Some(modulus_rate_per_s),
            _ => None,
        });
        // Rates add up, and each is a share of the modulus at the beginning.
        let grown = 1.0 + later_s * rates.sum::<f64>();
        self.young_modulus_pa *= grown;
        for effect in &mut self.effects {
            match effect {
                Effect::Memory(Memory::Drying { modulus_rate_per_s }) => *modulus_rate_per_s /= grown,
                // What the gel stands on changes with it.
                Effect::Body(Body::CompliantBase { foundation_pa_per_m }) => *foundation_pa_per_m *= grown,
                _ => {}
            }
        }
        self
    }

    /// Adds a poke after the others. A place that the phantom does not have yet becomes one of its sites: sessions recorded on it
    /// before come out alike but for what the bench's own resolution gains there.
    ///
    /// # Errors
    /// [`SimError::OffSide`] for a place that is on no side of the phantom, and a direction more than 45° off its normal;
    /// [`SimError::TooDeep`].
    pub fn press(&mut self, poke: &PlannedPoke) -> Result<(), SimError> {
        let site = self.site_of(poke)?;
        // From the side that it enters, within 45° of its normal, to the opposite one.
        let axis = poke.direction.iamax();
        let through_m = self.phantom.slab.size_m[axis] / poke.direction[axis].abs();
        if poke.depth_m >= through_m {
            return Err(SimError::TooDeep { site_m: poke.site.into(), depth_m: poke.depth_m, through_m });
        }
        self.pokes.push(Press {
            site,
            direction: poke.direction.into(),
            depth_m: poke.depth_m,
            rate_m_s: poke.rate_m_s,
            hold_s: poke.hold_s,
        });
        Ok(())
    }

    /// Index of the site at a poke's place, a new one where there is none.
    fn site_of(&mut self, poke: &PlannedPoke) -> Result<usize, SimError> {
        let size = self.phantom.slab.size_m;
        let sides = (0..3).flat_map(|axis| [(axis, 0.0, 1.0), (axis, size[axis], -1.0)]);
        let inwards = sides.filter_map(|(axis, at, inward)| {
            let mut normal = Vec3::zeros();
            normal[axis] = inward;
            ((poke.site[axis] - at).abs() < SAME_PLACE_M).then_some(normal)
        });
        let along = |normal: &Vec3| normal.dot(&poke.direction);
        let inward = inwards.max_by(|a, b| along(a).total_cmp(&along(b)));
        let inward = inward.filter(|normal| along(normal) >= FRAC_1_SQRT_2).ok_or(SimError::OffSide {
            site_m: poke.site.into(),
            direction: poke.direction.into(),
            size_m: size,
        })?;
        let sites = &mut self.phantom.sites;
        let there = |site: &Site| {
            (Vec3::from(site.centre_m) - poke.site).norm() < SAME_PLACE_M
                && (site.radius_m - poke.radius_m).abs() < SAME_PLACE_M
        };
        Ok(sites.iter().position(there).unwrap_or_else(|| {
            sites.push(Site { centre_m: poke.site.into(), inward: inward.into(), radius_m: poke.radius_m });
            sites.len() - 1
        }))
    }

    /// When which poke happens; refuses what does not exist on the phantom.
    pub(super) fn timeline(&self) -> Result<Timeline, SimError> {
        let sites = &self.phantom.sites;
        let mut plans = Vec::with_capacity(self.pokes.len());
        for poke in &self.pokes {
            let site = sites.get(poke.site).ok_or(SimError::NoSuchPlace {
                what: "site",
                index: poke.site,
                count: sites.len(),
            })?;
            plans.push(PokePlan {
                site_m: site.centre_m,
                direction: poke.direction,
                radius_m: site.radius_m,
                depth_m: poke.depth_m,
                rate_m_s: poke.rate_m_s,
                hold_s: poke.hold_s,
            });
        }
        Timeline::new(&plans, self.instruments.pause_s)
    }

    /// Sites that are poked, ascending.
    pub(super) fn touched(&self) -> Vec<usize> {
        let mut sites: Vec<usize> = self.pokes.iter().map(|p| p.site).collect();
        sites.sort_unstable();
        sites.dedup();
        sites
    }
}
