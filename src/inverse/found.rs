//! From what a search finds on the first discretisation to what a fit settles on; and restraint looked for anew, in other evidence.

use super::candidates::Candidate;
use super::discretised::{self, close_to_sides, tips};
use super::elements::Elements;
use super::error::InverseError;
use super::evidence::Evidence;
use super::fit::Settings;
use super::limit::{Finer, settle};
use super::outcome::Settled;
use super::problem::{Linearised, Problem, State};
use super::refit::where_answered;
use super::residual::Whitening;
use super::restraint::Restraint;
use super::search::{search, with_missed};
use super::sprung::with_springs;
use crate::fem::Spot;
use crate::observation::Recording;
use std::sync::Arc;

/// What a fit stands on.
#[derive(Clone, Copy)]
pub(super) struct Ground<'a> {
    pub recording: &'a Recording,
    pub settings: &'a Settings,
    pub elements: &'a Elements,
    pub evidence: &'a Evidence,
    pub places: &'a [Candidate],
}

/// Modulus and restraint that were found, with the model by which they were.
pub struct Found<'a> {
    problem: Problem<'a>,
    finer: Option<Arc<Finer>>,
    at: Linearised,
}

impl Found<'_> {
    /// Whether the restraint is, patch by patch in any order, [alike](Restraint::alike) to this one.
    pub fn alike(&self, others: &[Restraint]) -> bool {
        Restraint::paired(&self.at.state.patches, others, Restraint::alike)
    }
}

impl<'a> Ground<'a> {
    /// On from what was found on the first discretisation; on finer ones that resolve the sides of the body that patches are close to, if asked.
    pub(super) fn to_the_limit<'e>(
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
                *made = Arc::new(discretised::finer(self.recording, self.evidence, &discs, self.settings)?);
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

    pub(super) fn settled(self, found: &'a Found<'a>) -> Settled<'a> {
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
    /// As [`fit`](super::fit()).
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
            Ok(settled) if settled.unsettled.is_none() || problem.unrested => return Ok(Some(settled)),
            Ok(_) | Err(InverseError::NotSettled { .. }) => {
                where_answered(problem.correct(finest, &found.state.patches))?;
            }
            Err(error) => return Err(error),
        }
    }
    problem.whitening = weights;
    Ok(None)
}
