//! The default method: modulus and sparse, non-negative restraint from all pokes at once.
//!
//! 1. Boil the recording down to readings ([`Evidence`]).
//! 2. On a discretisation of moderate size, find patches and modulus ([`search`](super::search)).
//! 3. Go on from there on the same discretisation corrected to the limit of fine elements ([`limit`](super::limit)).
//! 4. Take springs for glue where they explain the recording as well ([`sprung`](super::sprung)).
//! 5. Say how surely, and what the recording cannot tell ([`outcome`](super::outcome)).

use super::candidates::candidates;
use super::discretised::{FIXED, finer, first_mesh, level, tips};
use super::elements::Elements;
use super::error::InverseError;
use super::evidence::{Driven, Evidence};
use super::found::Ground;
use super::outcome::{Settled, outcome};
use super::problem::{Linearised, Problem, State};
use super::result::Fit;
use super::search::search;
use super::tilt::turns_little;
use crate::fem::{FemError, Order, coarseness};
use crate::observation::Recording;
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
            // The search leaves cores idle: the finer elements are made meanwhile.
            scope.spawn(|_| finest = Some(finer(recording, &evidence, &tips, settings)));
        }
        search(&mut problem, None, &start, radius, &places, &mut tell)
    })?;
    let finest = finest.transpose()?.map(Arc::new);
    let ground = Ground { recording, settings, elements: &elements, evidence: &evidence, places: &places };
    let found = ground.to_the_limit(problem, finest, true, first, &mut tell)?;
    then(&ground.settled(&found))
}
