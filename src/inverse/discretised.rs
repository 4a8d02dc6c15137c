//! The discretisations that a fit stands on: the first, the two finer ones, and those that diagnoses ask for.

use super::blocks::Bench;
use super::error::InverseError;
use super::evidence::{Driven, Evidence, Site};
use super::fit::Settings;
use super::lift::entered;
use super::limit::{Finer, Level};
use super::outcome::Settled;
use super::problem::Linearised;
use crate::fem::{
    Discretisation, FemError, Model, Order, Resolution, Space, Spot, Tip, TipFace, discretise,
    needs_small_edges,
};
use crate::geometry::Vec3;
use crate::mesh::{SurfaceIndex, TetMesh, refine};
use crate::observation::{self, Contact, Recording, TipShape};

/// Names of the surfaces, as the bundle format has them.
pub(super) const FIXED: &str = "fixed";
const SEARCH: &str = "search";
const OBSERVED: &str = "observed";

/// The mesh of the first discretisation: for a quick fit the given one.
pub(super) fn first_mesh(
    recording: &Recording,
    tips: &[Spot],
    settings: &Settings,
) -> Result<TetMesh, InverseError> {
    let resolution = if settings.quick {
        Resolution::AS_GIVEN
    } else {
        Resolution::of(&recording.mesh, 0).map_err(FemError::from)?
    };
    let discs: Vec<&Spot> = tips.iter().collect();
    Ok(discretise(&recording.mesh, FIXED, &discs, &resolution).map_err(FemError::from)?)
}

/// Two finer discretisations that resolve the sides of the body close to `discs` (on the given mesh).
pub(super) fn finer(
    recording: &Recording,
    evidence: &Evidence,
    discs: &[Spot],
    settings: &Settings,
) -> Result<Finer, InverseError> {
    let discs: Vec<&Spot> = discs.iter().collect();
    let meshes = Discretisation::pair(&recording.mesh, FIXED, &discs, 1).map_err(FemError::from)?;
    let (coarse, fine) = rayon::join(
        || level(recording, evidence, &meshes.coarse, settings),
        || level(recording, evidence, &meshes.fine, settings),
    );
    Ok(Finer { coarse: coarse?, fine: fine? })
}

/// What a quick fit would have stood on with the end of the glue resolved as by the coarser of a full fit's finer
/// discretisations.
///
/// # Errors
/// What the mesh or its elements refuse.
pub fn finer_level(settled: &Settled<'_>) -> Result<Level, InverseError> {
    let Settled { recording, settings, evidence, .. } = settled;
    let tips = tips(recording, evidence)?;
    let discs: Vec<&Spot> = tips.iter().collect();
    let resolution = Resolution::of(&recording.mesh, 1).map_err(FemError::from)?;
    let mesh = discretise(&recording.mesh, FIXED, &discs, &resolution).map_err(FemError::from)?;
    level(recording, evidence, &mesh, settings)
}

/// The first discretisation of a fit, with edges of at most `size_m` (m) by place.
///
/// # Errors
/// What the mesh or its elements refuse.
pub fn cut_finer(settled: &Settled<'_>, size_m: impl Fn(&Vec3) -> f64) -> Result<Level, InverseError> {
    let Settled { recording, settings, evidence, .. } = settled;
    let tips = tips(recording, evidence)?;
    level(recording, evidence, &refine(&first_mesh(recording, &tips, settings)?, size_m), settings)
}

/// Those discs of the patches found, on the given mesh, for which it must be cut finer.
pub(super) fn close_to_sides(recording: &Recording, found: &Linearised) -> Result<Vec<Spot>, InverseError> {
    let space = Space::new(&recording.mesh, Order::P1).map_err(FemError::from)?;
    let all: Vec<usize> = (0..space.faces().len()).collect();
    let mut close = Vec::new();
    for (disc, _) in found.mounted.discs.iter().filter_map(|disc| disc.spot.as_disc()) {
        let spot = Spot::disc(&space, &all, &disc.centre, disc.radius)?;
        if needs_small_edges(&recording.mesh, &spot).map_err(FemError::from)? {
            close.push(spot);
        }
    }
    Ok(close)
}

/// The tips' discs on the given mesh.
pub(super) fn tips(recording: &Recording, evidence: &Evidence) -> Result<Vec<Spot>, InverseError> {
    let space = Space::new(&recording.mesh, Order::P1).map_err(FemError::from)?;
    let disc =
        |site: &Site| Spot::disc(&space, &entered(&space, &site.direction), &site.centre, site.radius_m);
    Ok(evidence.sites.iter().map(disc).collect::<Result<_, _>>()?)
}

/// The tips on the model's surface. Where the wrench is known it is spread by the six modes of
/// [`wrench_loads`](crate::fem::wrench_loads), whatever the tip's face: away from it only the wrench matters.
fn placed(space: &Space, evidence: &Evidence, recording: &Recording) -> Result<Vec<Tip>, InverseError> {
    let weight_acts = recording.phantom.gravity.is_some_and(|g| !g.at_rest);
    let (face, bonded) = face(recording.tip, evidence.driven, weight_acts)?;
    let nu = recording.phantom.poisson_ratio;
    let mut tips: Vec<Tip> = Vec::with_capacity(evidence.sites.len());
    for site in &evidence.sites {
        let on = entered(space, &site.direction);
        tips.push(match tips.first() {
            Some(first) => first.elsewhere(space, &on, &site.centre, site.radius_m)?,
            None => Tip::new(space, &on, &site.centre, site.radius_m, face, bonded, nu)?,
        });
    }
    Ok(tips)
}

/// The face of the tip, and whether the phantom sticks to it.
fn face(tip: observation::Tip, driven: Driven, weight_acts: bool) -> Result<(TipFace, bool), InverseError> {
    let observation::Tip { contact, shape } = tip;
    let bonded = contact == Contact::Bonded;
    match (driven, shape) {
        (Driven::ByWrench, _) => Ok((TipFace::Pad, true)),
        (Driven::ByStage, _) if weight_acts && (!bonded || matches!(shape, TipShape::Sphere { .. })) => {
            Err(InverseError::MetUnderWeight { contact, shape })
        }
        (Driven::ByStage, TipShape::Pad) => Ok((TipFace::Pad, bonded)),
        (Driven::ByStage, TipShape::Flat) => Ok((TipFace::Flat, bonded)),
        (Driven::ByStage, TipShape::Sphere { radius_m }) => Ok((TipFace::Sphere { radius_m }, bonded)),
    }
}

/// The model on one discretisation.
pub(super) fn level(
    recording: &Recording,
    evidence: &Evidence,
    mesh: &TetMesh,
    settings: &Settings,
) -> Result<Level, InverseError> {
    let model = Model::new(mesh, settings.element, recording.phantom.poisson_ratio, FIXED)?;
    let tips = placed(model.space(), evidence, recording)?;
    let index = SurfaceIndex::new(mesh, mesh.surface(OBSERVED));
    let markers = evidence
        .rest
        .iter()
        .map(|(rest, _)| Ok(Spot::marker_in(model.space(), &index, OBSERVED, rest)?.0))
        .collect::<Result<Vec<_>, InverseError>>()?;
    let weight = recording
        .phantom
        .gravity
        .filter(|g| !g.at_rest)
        .map(|g| g.acceleration_m_s2 * recording.phantom.density_kg_m3);
    let sites: Vec<_> = evidence.sites.iter().map(|s| (s.centre, s.lift)).collect();
    let search = model.space().surface(SEARCH).to_vec();
    let bench = Bench::new(model, tips, markers, &sites, evidence.driven, weight)?;
    Ok(Level { bench, search })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_that_is_not_modelled_is_refused_unless_the_wrench_drives() {
        let sphere = TipShape::Sphere { radius_m: 0.005 };
        let tip = |shape, contact| observation::Tip { shape, contact };
        for (tip, words) in [
            (tip(sphere, Contact::Bonded), "(Sphere { radius_m: 0.005 }, Bonded)"),
            (tip(sphere, Contact::Unilateral), "(Sphere { radius_m: 0.005 }, Unilateral)"),
            (tip(TipShape::Flat, Contact::Unilateral), "(Flat, Unilateral)"),
            (tip(TipShape::Pad, Contact::Unilateral), "(Pad, Unilateral)"),
        ] {
            let refused = face(tip, Driven::ByStage, true).expect_err("not modelled");
            assert!(refused.to_string().contains(words), "{refused}");
            assert_eq!(face(tip, Driven::ByWrench, true).expect("any tip"), (TipFace::Pad, true));
            face(tip, Driven::ByStage, false).expect("modelled");
        }
        let flat = tip(TipShape::Flat, Contact::Bonded);
        assert_eq!(face(flat, Driven::ByStage, true).expect("modelled"), (TipFace::Flat, true));
    }
}
