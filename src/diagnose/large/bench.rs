//! What of a settled fit the nonlinear body is made of: geometry, tip, restraint, markers.

use super::super::error::DiagnoseError;
use crate::fem::{Profile, SpotKind};
use crate::geometry::{Disc, Vec3};
use crate::inverse::Settled;
use crate::mesh::{TetMesh, refine};
use crate::observation::{Contact, TipShape};

/// A body on the bench, its tips and what holds it.
#[derive(Debug, Clone)]
pub struct Bench {
    /// Geometry and discretisation.
    pub mesh: TetMesh,
    /// Name of the surface that is held.
    pub fixed: &'static str,
    /// Name of the surface on which markers ride.
    pub observed: &'static str,
    /// Poisson's ratio (–).
    pub poisson_ratio: f64,
    /// How the tip's traction and its reading are weighed.
    pub profile: Profile,
    /// Where the tip pokes.
    pub pokes: Vec<Poke>,
    /// What holds the body besides.
    pub holds: Vec<Hold>,
    /// Rest positions of the markers (m).
    pub markers: Vec<Vec3>,
}

/// A place that is poked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poke {
    /// Centre of the tip on the surface (m).
    pub centre: Vec3,
    /// Unit vector into the phantom.
    pub direction: Vec3,
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// How deep it goes (m, more than 0).
    pub deepest_m: f64,
}

/// A disc of restraint that holds its mean displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Where.
    pub disc: Disc,
    /// `E/k` (1/m) of this disc; 0 is glue.
    pub softness: f64,
}

/// Edges under a tip are no longer than this share of its radius ...
const UNDER: f64 = 0.75;
/// ... and grow by this share of the distance from its rim.
const GROWTH: f64 = 1.0;

impl Bench {
    /// The bench of a settled fit, with the restraint found. `deepest`: site of the evidence, direction of the poke and
    /// greatest depth (m) of everything that is to be computed. The given mesh is cut finer under tips.
    ///
    /// # Errors
    /// [`DiagnoseError::TipNotLinear`] for a sphere and for tips that may lift off.
    pub fn of(settled: &Settled<'_>, deepest: &[(usize, Vec3, f64)]) -> Result<Self, DiagnoseError> {
        let recording = settled.recording;
        let profile = match (recording.tip.contact, recording.tip.shape) {
            (Contact::Bonded, TipShape::Pad) => Profile::Uniform,
            (Contact::Bonded, TipShape::Flat) => Profile::Rigid,
            _ => return Err(DiagnoseError::TipNotLinear),
        };
        let sites = &settled.evidence.sites;
        let poke = |&(site, direction, deepest_m): &(usize, Vec3, f64)| {
            let site = &sites[site];
            Poke { centre: site.centre, direction, radius_m: site.radius_m, deepest_m }
        };
        let mounted = &settled.at.mounted;
        let mut holds = Vec::new();
        for group in &mounted.groups {
            for placed in &mounted.discs[group.discs.clone()] {
                if let SpotKind::Disc { disc, .. } = placed.spot.kind {
                    holds.push(Hold { disc, softness: group.softness });
                }
            }
        }
        let bench = Self {
            mesh: recording.mesh.clone(),
            fixed: "fixed",
            observed: "observed",
            poisson_ratio: recording.phantom.poisson_ratio,
            profile,
            pokes: deepest.iter().map(poke).collect(),
            holds,
            markers: settled.evidence.rest.iter().map(|(rest, _)| *rest).collect(),
        };
        Ok(bench.resolved(UNDER))
    }

    /// The bench with edges of at most `share` of the radius under tips.
    pub fn resolved(self, share: f64) -> Self {
        let size = |p: &Vec3| {
            let at = |poke: &Poke| {
                share * poke.radius_m + GROWTH * ((p - poke.centre).norm() - poke.radius_m).max(0.0)
            };
            self.pokes.iter().map(at).fold(f64::INFINITY, f64::min)
        };
        let mesh = refine(&self.mesh, size);
        Self { mesh, ..self }
    }
}
