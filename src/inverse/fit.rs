//! The default method: modulus and sparse, non-negative restraint from all pokes at once.
//!
//! 1. Boil the recording down to readings ([`Evidence`]).
//! 2. On a discretisation of moderate size, find patches and modulus ([`search`](super::search)).
//! 3. Go on from there on the same discretisation corrected to the limit of fine elements ([`limit`](super::limit)).
//! 4. Take springs for glue where they explain the recording as well ([`sprung`](super::sprung)).
//! 5. Say how surely, and what the recording cannot tell ([`outcome`](super::outcome)).

use super::blocks::Bench;
use super::error::InverseError;
use super::evidence::{Driven, Evidence, Site};
use super::lift::entered;
use super::limit::{Finer, Level, settle};
use super::outcome::{Elements, Settled, outcome};
use super::problem::{Linearised, Problem, State};
use super::refit::where_answered;
use super::residual::Whitening;
use super::restraint::Restraint;
use super::result::Fit;
use super::search::{Candidate, candidates, search, with_missed};
use super::sprung::with_springs;
use super::tilt::turns_little;
use crate::fem::{
    Discretisation, FemError, Model, Order, Resolution, Space, Spot, Tip, TipFace, coarseness, discretise,
    needs_small_edges,
};
use crate::geometry::Vec3;
use crate::mesh::{SurfaceIndex, TetMesh, refine};
use crate::observation::{self, Contact, Recording, TipShape};
use std::sync::Arc;

/// How a fit is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Order of the elements.
    pub element: Order,
    /// Stay on the given mesh, refined only where tips need it, and skip the extrapolation.
    pub quick: bool,
    /// What drives the model; `None` takes the stage when there is one.
    pub driven: Option<Driven>,
    /// Radius (m) of a patch through which springs pull; the recording hardly tells it from the stiffness.
    pub patch_radius_m: f64,
    /// Take a fit as it is that has not come to rest after all its steps: for a model that is taken to be wrong.
    pub unrested: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { element: Order::P2, quick: false, driven: None, patch_radius_m: 0.005, unrested: false }
    }
}

/// What the fit is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress {
    /// Cutting, assembling and factoring.
    Building {
        /// Displacement components solved for; 0 before it is known.
        unknowns: usize,
    },
    /// Looking for patches.
    Searching {
        /// Patches so far.
        patches: usize,
        /// Sum of squares per reading.
        misfit: f64,
    },
}

/// Distance (m) between places at which a patch is first looked for, over the patch's radius.
const SPACING: f64 = 1.0;

/// Names of the surfaces, as the bundle format has them.
const FIXED: &str = "fixed";
const SEARCH: &str = "search";
const OBSERVED: &str = "observed";

/// Fits `recording`.
///
/// # Errors
/// What the recording lacks, what the elements cannot do, and a search that does not settle.
pub fn fit(
    recording: &Recording,
    settings: &Settings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Fit, InverseError> {
    settled(recording, settings, progress, outcome)
}

/// Fits `recording` and hands the model, as it settled, to `then`.
///
/// # Errors
/// As [`fit`], and those of `then`.
pub fn settled<T, E: From<InverseError>>(
    recording: &Recording,
    settings: &Settings,
    progress: &mut dyn FnMut(Progress),
    then: impl FnOnce(&Settled<'_>) -> Result<T, E>,
) -> Result<T, E> {
    let evidence = Evidence::new(recording, settings.driven)?;
    if evidence.sites.iter().all(|s| s.force.is_empty() && s.markers.iter().all(Vec::is_empty)) {
        return Err(InverseError::Nothing { pokes: recording.pokes.len() }.into());
    }
    if !evidence.force_is_felt() {
        return Err(InverseError::Undetermined { why: "its force never rises above its noise" }.into());
    }
    progress(Progress::Building { unknowns: 0 });
    let tips = tips(recording, &evidence)?;
    let elements = Elements::of(
        settings,
        coarseness(&recording.mesh, FIXED).map_err(FemError::from).map_err(InverseError::from)?,
    );
    let first = level(recording, &evidence, &first_mesh(recording, &tips, settings)?, settings)?;
    progress(Progress::Building { unknowns: first.bench.model.unknowns() });
    turns_little(&first.bench, &evidence)?;
    let held = first.bench.model.space().surface(FIXED).to_vec();
    let mut problem = Problem::new(&evidence, first.bench, first.search, held, elements.search)?;
    problem.unrested = settings.unrested;
    let places = candidates(&problem, settings.patch_radius_m, SPACING * settings.patch_radius_m)?;
    let [low, high] = recording.phantom.modulus_range_pa;
    let mut tell = |at: &Linearised| {
        progress(Progress::Searching {
            patches: at.state.patches.len(),
            misfit: at.chi2() / at.residual.len() as f64,
        });
    };
    let start = State { modulus: (low * high).sqrt(), patches: Vec::new() };
    let radius = settings.patch_radius_m;
    let mut finest = None;
    let first = rayon::in_place_scope(|scope| {
        if !settings.quick {
            // The search needs one core at most: the finer elements are made meanwhile.
            scope.spawn(|_| finest = Some(finer(recording, &evidence, &tips, settings)));
        }
        search(&mut problem, None, &start, radius, &places, &mut tell)
    })?;
    let finest = finest.transpose()?.map(Arc::new);
    let ground = Ground { recording, settings, elements: &elements, evidence: &evidence, places: &places };
    let found = ground.to_the_limit(problem, finest, true, first, &mut tell)?;
    then(&ground.settled(&found))
}

/// What a fit stands on.
#[derive(Clone, Copy)]
struct Ground<'a> {
    recording: &'a Recording,
    settings: &'a Settings,
    elements: &'a Elements,
    evidence: &'a Evidence,
    places: &'a [Candidate],
}

/// Modulus and restraint that were found, with the model by which they were.
pub struct Found<'a> {
    problem: Problem<'a>,
    finer: Option<Arc<Finer>>,
    at: Linearised,
}

impl Found<'_> {
    /// Whether the restraint is, to a tenth of its size, that of another fit.
    pub fn alike(&self, other: &Settled<'_>) -> bool {
        let (own, others) = (&self.at.state.patches, &other.at.state.patches);
        let alike = |(a, b): (&Restraint, &Restraint)| {
            let close = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.max(b);
            a.glued == b.glued
                && (a.centre - b.centre).norm() <= ALIKE * a.radius_m
                && close(a.softness, b.softness)
                && close(a.radius_m, b.radius_m)
        };
        own.len() == others.len() && own.iter().zip(others).all(alike)
    }
}

/// That share.
const ALIKE: f64 = 0.1;

impl<'a> Ground<'a> {
    /// On from what was found on the first discretisation; on finer ones that resolve the sides of the body that patches are close to, if asked.
    fn to_the_limit<'e>(
        self,
        mut problem: Problem<'e>,
        mut finer: Option<Arc<Finer>>,
        resolve_sides: bool,
        first: Linearised,
        tell: &mut impl FnMut(&Linearised),
    ) -> Result<Found<'e>, InverseError> {
        let (site, radius) = (self.elements.site, self.settings.patch_radius_m);
        let mut at = first;
        if let Some(made) = &mut finer {
            // A patch close to a side of the body needs that side resolved, as a tip does.
            let close = if resolve_sides { close_to_sides(self.recording, &at)? } else { Vec::new() };
            if !close.is_empty() {
                let tips = tips(self.recording, self.evidence)?;
                let discs: Vec<Spot> = tips.into_iter().chain(close).collect();
                *made = Arc::new(self::finer(self.recording, self.evidence, &discs, self.settings)?);
            }
            at = search(&mut problem, Some(made), &at.state, radius, self.places, tell)?;
        }
        problem.whitening = Whitening::new(problem.evidence, site);
        at = settle(&mut problem, finer.as_deref(), at)?;
        if let Some(finer) = &finer
            && let Some(more) = completed(&mut problem, finer, &at, site, radius, self.places)?
        {
            at = more;
        }
        at = with_springs(&mut problem, finer.as_deref(), at, radius)?;
        Ok(Found { problem, finer, at })
    }

    fn settled(self, found: &'a Found<'a>) -> Settled<'a> {
        let Self { recording, settings, elements, evidence, places } = self;
        let Found { problem, finer, at } = found;
        Settled { recording, settings, elements, evidence, problem, at, finer: finer.as_ref(), places }
    }
}

impl<'a> Settled<'a> {
    fn ground(&self) -> Ground<'a> {
        let &Self { recording, settings, elements, evidence, places, .. } = self;
        Ground { recording, settings, elements, evidence, places }
    }

    /// Looks anew for modulus and restraint, in other `evidence` of the same pokes, on the discretisations that are there.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn found_in<'e>(&self, evidence: &'e Evidence) -> Result<Found<'e>, InverseError> {
        let mut problem = self.problem.with(evidence, self.elements.search);
        let start = State { modulus: self.at.state.modulus, patches: Vec::new() };
        let radius = self.settings.patch_radius_m;
        let first = search(&mut problem, None, &start, radius, self.places, &mut |_| {})?;
        self.ground().to_the_limit(problem, self.finer.map(Arc::clone), false, first, &mut |_| {})
    }

    /// The same recording with another restraint and modulus.
    pub fn with<'b>(&'b self, found: &'b Found<'b>) -> Settled<'b> {
        self.ground().settled(found)
    }
}

/// A settled fit with the patch that its search missed, settled anew; `None`, and the problem as it was, where none was missed or the
/// fit does not settle with it. `site` is what elements get wrong in a reading of force, at least.
fn completed<'a>(
    problem: &mut Problem<'a>,
    finest: &Finer,
    found: &Linearised,
    site: f64,
    radius_m: f64,
    places: &[Candidate],
) -> Result<Option<Linearised>, InverseError> {
    let weights = problem.whitening.clone();
    problem.whitening = Whitening::new(problem.evidence, site).near(&found.prediction);
    let at = problem.linearise(&found.state)?;
    if let Some(more) = with_missed(problem, finest, &at, radius_m, places)? {
        match settle(problem, Some(finest), more) {
            Err(InverseError::NotSettled { .. }) => {
                where_answered(problem.correct(finest, &found.state.patches))?;
            }
            settled => return settled.map(Some),
        }
    }
    problem.whitening = weights;
    Ok(None)
}

/// The mesh of the first discretisation: for a quick fit the given one.
fn first_mesh(recording: &Recording, tips: &[Spot], settings: &Settings) -> Result<TetMesh, InverseError> {
    let resolution = if settings.quick {
        Resolution::AS_GIVEN
    } else {
        Resolution::of(&recording.mesh, 0).map_err(FemError::from)?
    };
    let discs: Vec<&Spot> = tips.iter().collect();
    Ok(discretise(&recording.mesh, FIXED, &discs, &resolution).map_err(FemError::from)?)
}

/// Two finer discretisations that resolve the sides of the body close to `discs` (on the given mesh).
fn finer(
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
fn close_to_sides(recording: &Recording, found: &Linearised) -> Result<Vec<Spot>, InverseError> {
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
fn tips(recording: &Recording, evidence: &Evidence) -> Result<Vec<Spot>, InverseError> {
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
fn level(
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
