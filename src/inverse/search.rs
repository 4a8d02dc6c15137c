//! Where restraint acts: patches are added where they explain most, refitted without shrinkage, and taken out
//! again when the others can do without them.
//!
//! This is the sliding form of the conditional-gradient method for sparse measures (Denoyelle, Duval, Peyré and
//! Soubies 2019): like l1 it starts from nothing and adds one place at a time, by the same score, but places
//! slide on the surface instead of sitting on its nodes, so that neither the mesh's nodes nor the shrinkage of l1
//! shows in the answer. A place is added only when it is significant after the whole search surface was looked at.

use super::candidates::{Candidate, best_candidate};
use super::error::InverseError;
use super::limit::{Finer, UNRESTED_ROUNDS};
use super::problem::{Linearised, Parameter, Problem, State};
use super::refit::{
    Descent, GOOD_ENOUGH, SETTLED, converged, descend, descend_below, refit, settled, unit, where_answered,
};
use super::restraint::{Mounted, Restraint};
use crate::fem::disc_self_compliance;
use crate::geometry::Vec3;
use nalgebra::DVector;
use rayon::prelude::*;

/// A patch must lower the sum of squares by this much, in units of what is left per reading: it has three
/// parameters and was picked from the whole surface (a chance of about 1e-4 after some 100 independent places).
const SIGNIFICANT: f64 = 30.0;

/// It must also explain this share of what all restraint explains. Where restraint is plain to see in thousands of
/// readings, a model of it that is off by two per cent (a spot that is not round, glue that ends a little
/// elsewhere) leaves that much: more patches would only mend the model.
const WORTHWHILE_SHARE: f64 = 4e-4;

/// What the model gets wrong leaves more than this per reading: patches found on fine elements, but not before, would only
/// mend it. On the first elements something may have been missed then.
const WRONG: f64 = 2.0;

/// While patches come and go a descent may end when it promises less than this: far less than a patch must bring.
const ROUGH: f64 = 1.0;

/// More patches than this mean that something else is wrong with the model.
pub(super) const MOST_PATCHES: usize = 6;

/// Patches are added this often at most, also when others are taken out in turn.
const ROUNDS: usize = 2 * MOST_PATCHES;

/// Finds modulus and patches from `start`, in the limit of fine elements when `finer` ones are given.
///
/// Patches are added and taken out until nothing changes; then the weights and the correction are renewed at what was
/// found; and so on until that changes nothing either.
pub fn search(
    problem: &mut Problem<'_>,
    finer: Option<&Finer>,
    start: &State,
    patch_radius_m: f64,
    candidates: &[Candidate],
    tell: &mut impl FnMut(&Linearised),
) -> Result<Linearised, InverseError> {
    let mut looking = Looking::new(problem, finer, patch_radius_m, candidates);
    // Where the corrected model has no answer, the first round ends the search.
    where_answered(looking.correct(&start.patches))?;
    let mut at = refit(looking.problem, start)?;
    let (mut rounds, mut gains) = (0, 0.0);
    let most = if looking.problem.unrested { UNRESTED_ROUNDS } else { ROUNDS };
    while rounds < most {
        rounds += 1;
        tell(&at);
        if where_answered(looking.correct(&at.state.patches))?.is_none() {
            break;
        }
        looking.problem.whitening = looking.problem.whitening.near(&at.prediction);
        let Descent { at: renewed, gained } = descend(looking.problem, &at.state, GOOD_ENOUGH)?;
        let (resettled, as_before) = (settled(&renewed, gained), gained < SETTLED * unit(&renewed));
        let (found, changes) = looking.settled(renewed, as_before)?;
        at = match changes {
            0 => converged(looking.problem, found)?,
            _ => refit(looking.problem, &found.state)?,
        };
        if changes == 0 && resettled {
            return Ok(at);
        }
        gains = gained;
    }
    if looking.problem.takes_unrested(&at) {
        at.unsettled = Some(gains);
        return Ok(at);
    }
    Err(InverseError::NotSettled { rounds, patches: at.state.patches.len() })
}

/// A patch that was missed explains at least this share of what is left beyond noise, or one in the way lets others do so: another
/// cause would leave most.
const MISSED_SHARE: f64 = 0.5;

/// With the patch that the search missed: where a settled fit leaves more than noise, and with one more patch it does
/// not. `None` where nothing is missed, or no single patch would explain it.
///
/// Why: while patches are searched for, what elements may get wrong is taken for large, so that they do not become patches. A weak
/// patch beside strong ones hides behind that.
pub(super) fn with_missed(
    problem: &mut Problem<'_>,
    finer: &Finer,
    at: &Linearised,
    patch_radius_m: f64,
    candidates: &[Candidate],
) -> Result<Option<Linearised>, InverseError> {
    if at.explained() {
        return Ok(None);
    }
    let correction = problem.correction.take();
    // Where patches crowd so that the corrected model has no answer, the fit has settled without.
    if where_answered(problem.correct(finer, &at.state.patches))?.is_none() {
        problem.correction = correction;
        return Ok(None);
    }
    let mut looking = Looking::new(problem, Some(finer), patch_radius_m, candidates);
    let missed = MISSED_SHARE * at.beyond_noise();
    let grown = looking.grown(at, missed)?.filter(Linearised::explained);
    if grown.is_none() {
        problem.correction = correction;
    }
    Ok(grown)
}

/// A search under way.
struct Looking<'s, 'p> {
    problem: &'s mut Problem<'p>,
    finer: Option<&'s Finer>,
    patch_radius_m: f64,
    candidates: &'s [Candidate],
    /// Whether [`missing`](Self::missing) found nothing since patches last changed.
    nothing_missed: bool,
}

impl<'s, 'p> Looking<'s, 'p> {
    fn new(
        problem: &'s mut Problem<'p>,
        finer: Option<&'s Finer>,
        patch_radius_m: f64,
        candidates: &'s [Candidate],
    ) -> Self {
        Self { problem, finer, patch_radius_m, candidates, nothing_missed: false }
    }

    /// Corrects the model for patches where they are, when there are finer elements to correct it by. Elements err
    /// much alike wherever the body is loaded (most of it comes from the end of the glue), and that cancels when all
    /// compliances have it: a patch that is not corrected among others that are would be worse than none corrected.
    fn correct(&mut self, patches: &[Restraint]) -> Result<(), InverseError> {
        if let Some(finer) = self.finer {
            self.problem.correct(finer, patches)?;
        }
        Ok(())
    }

    /// Adds and takes out patches until nothing changes any more; with the number of changes. `as_before`: nothing has moved since
    /// this was last asked, and the weights, which follow the prediction, are much the same.
    fn settled(&mut self, at: Linearised, as_before: bool) -> Result<(Linearised, usize), InverseError> {
        let before = at.state.patches.len();
        let mut at = pruned(self.problem, at)?;
        let mut changes = before - at.state.patches.len();
        self.nothing_missed &= changes == 0;
        if self.nothing_missed && as_before {
            return Ok((at, changes));
        }
        for _ in 0..ROUNDS {
            let wrong = unit(&at) > WRONG;
            let mends_the_model = self.finer.is_some() && wrong;
            if mends_the_model {
                break;
            }
            let enough = worthwhile(self.problem, &at)?;
            let changed = match self.grown(&at, enough)? {
                None if wrong && !self.nothing_missed => self.missing(&at, enough)?,
                grown => grown,
            };
            self.nothing_missed = wrong && changed.is_none();
            let Some(changed) = changed else { break };
            at = pruned(self.problem, changed)?;
            changes += 1;
        }
        Ok((at, changes))
    }

    /// Where much is left that no patch promises to explain at first order: with a first patch of stiff springs, or with one patch less,
    /// where that makes it better by `enough` and explains a good part.
    fn missing(&mut self, at: &Linearised, enough: f64) -> Result<Option<Linearised>, InverseError> {
        let enough = enough.max(MISSED_SHARE * at.beyond_noise());
        match at.state.patches.is_empty() {
            true => self.grown_stiff(at, enough),
            false => self.freed(at, enough),
        }
    }

    /// With one patch less, where the others are then better by `enough`. What was found first stood for several places at
    /// once: it may have become glue since, or gone to an edge, and holds the others where they are.
    fn freed(&mut self, at: &Linearised, enough: f64) -> Result<Option<Linearised>, InverseError> {
        let less = |p: usize| where_answered(descend(self.problem, &without(at, p), ROUGH));
        let less = (0..at.state.patches.len()).into_par_iter().map(less);
        let less =
            less.collect::<Result<Vec<_>, InverseError>>()?.into_iter().flatten().map(|descent| descent.at);
        let better =
            |less: &Linearised| less.chi2() < at.chi2() - enough && apart(self.problem, &less.state.patches);
        let best = less.filter(better).min_by(|a, b| a.chi2().total_cmp(&b.chi2()));
        best.map(|less| self.settle_glue(less)).transpose()
    }

    /// Whether no more patch may be had: one has three parameters, and what is left must still be judged.
    fn full(at: &Linearised) -> bool {
        let spare = at.residual.len().saturating_sub(at.parameters.len());
        at.state.patches.len() >= MOST_PATCHES || spare <= 3
    }

    /// With one more patch, where one promises at first order to lower the sum of squares by `enough`, and does.
    fn grown(&mut self, at: &Linearised, enough: f64) -> Result<Option<Linearised>, InverseError> {
        if Self::full(at) {
            return Ok(None);
        }
        match best_candidate(self.problem, at, self.candidates)? {
            Some((best, promised)) if promised >= enough => self.grown_at(at, best, enough),
            _ => Ok(None),
        }
    }

    /// With a first patch where springs as stiff as the phantom under them lower the sum of squares most. Glue that a tenth of the modulus can
    /// stand for hardly shows at first order: weak springs do not come near what the modulus has taken up.
    fn grown_stiff(&mut self, at: &Linearised, enough: f64) -> Result<Option<Linearised>, InverseError> {
        if Self::full(at) {
            return Ok(None);
        }
        let left = |candidate: &Candidate| {
            let state = self.with(&at.state, candidate);
            let with = self.problem.mount(&state.patches);
            let with = with.and_then(|mounted| with_modulus(self.problem, &mounted, state.modulus));
            Ok(where_answered(with)?.map_or(f64::INFINITY, |(chi2, _)| chi2))
        };
        let left: Result<Vec<f64>, InverseError> = self.candidates.par_iter().map(left).collect();
        let best = left?.into_iter().enumerate().filter(|(_, chi2)| *chi2 < at.chi2());
        let best = best.min_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(Ok(None), |(best, _)| self.grown_at(at, best, enough))
    }

    /// A state with springs at a candidate place, as stiff as the phantom under them.
    fn with(&self, state: &State, candidate: &Candidate) -> State {
        let [_, softness] =
            disc_self_compliance(self.patch_radius_m, self.problem.bench.model.poisson_ratio());
        let springs =
            Restraint { centre: candidate.centre, radius_m: self.patch_radius_m, softness, glued: false };
        State { patches: state.patches.iter().cloned().chain([springs]).collect(), ..*state }
    }

    /// With one more patch, at first at a candidate place.
    fn grown_at(
        &mut self,
        at: &Linearised,
        candidate: usize,
        enough: f64,
    ) -> Result<Option<Linearised>, InverseError> {
        let state = self.with(&at.state, &self.candidates[candidate]);
        let before = self.problem.correction.take();
        if where_answered(self.correct(&state.patches))?.is_none() {
            self.problem.correction = before;
            return Ok(None);
        }
        // Where it converges does not matter yet: the next patch may move this one.
        let grown = best_softness(self.problem, state).and_then(|start| descend(self.problem, &start, ROUGH));
        if let Some(Descent { at: grown, .. }) = where_answered(grown)?
            && at.chi2() - grown.chi2() >= enough
            && apart(self.problem, &grown.state.patches)
        {
            return self.settle_glue(grown).map(Some);
        }
        self.problem.correction = before;
        Ok(None)
    }

    /// Replaces stiff patches (with any that sit on the same spot) by glue, where glue explains the recording as well.
    fn settle_glue(&mut self, at: Linearised) -> Result<Linearised, InverseError> {
        let mut at = at;
        let mut tried: Vec<Vec3> = Vec::new();
        loop {
            let stiff = at.state.patches.iter().find(|patch| {
                !patch.glued && nearly_glue(self.problem, patch) && !tried.contains(&patch.centre)
            });
            let Some(centre) = stiff.map(|patch| patch.centre) else { return Ok(at) };
            tried.push(centre);
            let before = self.problem.correction.take();
            match self.glued_at(&at, centre)? {
                Some(glued)
                    if apart(self.problem, &glued.state.patches)
                        && glued.chi2() < as_good(&at, &glued.state) =>
                {
                    at = glued;
                }
                _ => self.problem.correction = before,
            }
        }
    }

    /// The best glued spot about `centre`: its radius first among a few, on the model without correction, then
    /// together with everything else. `None` when no radius fits on the body.
    fn glued_at(&mut self, at: &Linearised, centre: Vec3) -> Result<Option<Linearised>, InverseError> {
        self.problem.correction = None;
        let glued = |radius_m: &f64| {
            let mut state = at.state.clone();
            state.patches.retain(|other| (other.centre - centre).norm() > radius_m + other.radius_m);
            state.patches.push(Restraint { centre, radius_m: *radius_m, softness: 0.0, glued: true });
            // One that does not fit on the body, or not beside the others, is not among the choices.
            let mounted = self.problem.mount(&state.patches).ok()?;
            let (chi2, modulus) = with_modulus(self.problem, &mounted, state.modulus).ok()?;
            Some((chi2, State { modulus, ..state }))
        };
        let tried: Vec<Option<(f64, State)>> = GLUE_RADII_M.par_iter().map(glued).collect();
        let best = tried.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, state)) = best else { return Ok(None) };
        if where_answered(self.correct(&state.patches))?.is_none() {
            return Ok(None);
        }
        let hopeless = as_good(at, &state);
        Ok(where_answered(descend_below(self.problem, &state, ROUGH, hopeless))?.map(|descent| descent.at))
    }
}

/// What a patch must lower the sum of squares by to be added.
fn worthwhile(problem: &Problem<'_>, at: &Linearised) -> Result<f64, InverseError> {
    let (free, _) = with_modulus(problem, &problem.mount(&[])?, at.state.modulus)?;
    Ok((SIGNIFICANT * unit(at)).max(WORTHWHILE_SHARE * (free - at.chi2())))
}

/// Whether every spring patch keeps clear of every glued spot, and every spot as stiff as glue of the known glue. What
/// touches a spot is its outline, which need not be round; what touches the known glue says that this ends elsewhere, by
/// less than elements or a ruler know.
pub(super) fn apart(problem: &Problem<'_>, patches: &[Restraint]) -> bool {
    let touches = |glue: &Restraint, other: &Restraint| {
        glue.glued && !other.glued && (glue.centre - other.centre).norm() < glue.radius_m + other.radius_m
    };
    !patches.iter().any(|glue| {
        patches.iter().any(|other| touches(glue, other))
            || (nearly_glue(problem, glue) && touches_held(problem, &glue.centre, glue.radius_m))
    })
}

/// Whether a patch is so stiff that it may be glue.
fn nearly_glue(problem: &Problem<'_>, patch: &Restraint) -> bool {
    let [_, local] = disc_self_compliance(patch.radius_m, problem.bench.model.poisson_ratio());
    patch.softness <= NEARLY_GLUE * local
}

/// Whether a disc touches the known glue.
fn touches_held(problem: &Problem<'_>, centre: &Vec3, radius_m: f64) -> bool {
    let space = problem.bench.model.space();
    let near =
        |&face: &usize| (space.face_triangle(face).nearest(centre).position - centre).norm() < radius_m;
    problem.held.iter().any(near)
}

/// What the sum of squares of a simpler state must stay below to take the place of one: it may cost [`ONE_LESS`] once, and once for
/// every parameter that it does without.
fn as_good(at: &Linearised, simpler: &State) -> f64 {
    let parameters = |state: &State| -> usize {
        state.patches.iter().map(|p| 2 + usize::from(p.softness > 0.0) + usize::from(p.glued)).sum()
    };
    let spared = 1 + parameters(&at.state).saturating_sub(parameters(simpler));
    at.chi2() + ONE_LESS * spared as f64 * unit(at)
}

/// Gives the last patch the softness that, of a wide range, explains most (the modulus adjusted).
fn best_softness(problem: &Problem<'_>, mut state: State) -> Result<State, InverseError> {
    let last = state.patches.len() - 1;
    let local = state.patches[last].softness;
    let mounted = problem.mount(&state.patches)?;
    let with = |step: i32| {
        let softness = local * 10.0_f64.powf(0.25 * f64::from(step));
        let mut mounted = mounted.clone();
        mounted.groups[last].softness = softness;
        let (chi2, modulus) = with_modulus(problem, &mounted, state.modulus)?;
        Ok((chi2, softness, modulus))
    };
    let tried = (-6..=10).into_par_iter().map(with).collect::<Result<Vec<_>, InverseError>>()?;
    let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, softness, modulus)) = best {
        state.patches[last].softness = softness;
        state.modulus = modulus;
    }
    Ok(state)
}

/// Sum of squares with the best modulus for restraint that is on the model, and that modulus.
fn with_modulus(problem: &Problem<'_>, mounted: &Mounted, start: f64) -> Result<(f64, f64), InverseError> {
    let mut modulus = start;
    for _ in 0..3 {
        let residual = problem.residual(mounted, modulus)?;
        let sensitivity: DVector<f64> = problem.modulus_sensitivity(mounted, modulus)?;
        if sensitivity.norm_squared() == 0.0 {
            return Err(InverseError::Undetermined {
                why: "no reading depends on it; was any force recorded?",
            });
        }
        modulus *= (sensitivity.dot(&residual) / sensitivity.norm_squared()).clamp(-0.5, 0.5).exp();
    }
    Ok((problem.residual(mounted, modulus)?.norm_squared(), modulus))
}

/// The state with one patch less.
fn without(at: &Linearised, patch: usize) -> State {
    let mut state = at.state.clone();
    state.patches.remove(patch);
    state
}

/// Takes out, one at a time, patches that the others can do without. Where all of them together explain the recording down to its
/// noise a patch need not explain a share of it, as none then mends a wrong model.
pub(super) fn pruned(problem: &Problem<'_>, at: Linearised) -> Result<Linearised, InverseError> {
    let mut at = at;
    loop {
        let enough = if at.explained() { SIGNIFICANT * unit(&at) } else { worthwhile(problem, &at)? };
        // A patch without which the others have no answer stays.
        let less =
            |&p: &usize| where_answered(descend_below(problem, &without(&at, p), ROUGH, at.chi2() + enough));
        let doubted: Vec<usize> = (0..at.state.patches.len()).filter(|&p| !beyond_doubt(&at, p)).collect();
        let less = doubted.par_iter().map(less).collect::<Result<Vec<_>, InverseError>>()?;
        let less = less.into_iter().flatten().map(|descent| descent.at);
        let spared = less.filter(|less| less.chi2() - at.chi2() < enough);
        match spared.min_by(|a, b| a.chi2().total_cmp(&b.chi2())) {
            Some(less) => at = less,
            None => return Ok(at),
        }
    }
}

/// A size known to this share of itself is not that of something that is not there.
const KNOWN_SIZE: f64 = 0.05;

/// Whether a patch's stiffness, or a glued spot's radius, is known so well that taking it out need not be tried.
fn beyond_doubt(at: &Linearised, patch: usize) -> bool {
    let size = at.column(Parameter::LogRadius(patch)).or_else(|| at.column(Parameter::LogSoftness(patch)));
    let Some((size, covariance)) = size.zip(at.covariance()) else { return false };
    (covariance[(size, size)] * unit(at)).sqrt() < KNOWN_SIZE
}

/// Radii (m) at which a spot that may be glued is tried first.
const GLUE_RADII_M: [f64; 4] = [0.003, 0.006, 0.011, 0.02];

/// A patch softer than this share of the phantom's local compliance under it (the half-space's) is no glue.
const NEARLY_GLUE: f64 = 0.4;

/// What a size that is not asked for any more may cost (95 % of χ² with one degree of freedom).
pub(super) const ONE_LESS: f64 = 3.84;
