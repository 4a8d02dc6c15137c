//! The extended model of a whole recording: parameters → misfit of every poke, with its normal equations.
//!
//! Parameters, in this order: the logarithm of the modulus; for every patch the logarithm of its stiffness, then its
//! shifts (m) and, of glue, the logarithm of its radius; the share of what finer elements would change; the knobs of the effects; and, for what the elements get wrong, a share of the force and a share of the
//! markers' motion at every site, each with a known small standard deviation.

use super::body::{Body, body};
use super::bulk::{self, BodyChange, BulkKnob};
use super::camera::camera;
use super::creep::Creep;
use super::dual::{Dual, MOST, variable};
use super::effects::Effects;
use super::error::DiagnoseError;
use super::extra::{Extra, Shelf};
use super::knob::Knob;
use super::known::{Changed, Known};
use super::march::{Group, March, Marching};
use super::refit::Fitted;
use super::registration::by_place;
use super::rest::{Correlation, correlation, pauses};
use super::sums::PokeSums;
use super::track::{Frame, Timeline, Track, timeline, tracks};
use super::uneven::Picture;
use crate::geometry::Vec3;
use crate::inverse::{Parameter, Settled, force_at_rest};
use nalgebra::{DMatrix, DVector};
use num_dual::DualNum;
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// Relative standard deviations of what the elements get wrong at one site: force, and markers' motion.
const ELEMENTS: [f64; 2] = [2e-3, 3e-3];

/// Standard deviation of the share of what finer elements change that is missing: on the given mesh all of it may be, on one
/// brought to its limit a part.
const FINER_SD: [f64; 2] = [1.0, 0.3];

/// A softness of glue, over the smallest compliance of a disc under itself: as good as zero.
const GLUE: f64 = 1e-4;

/// Parameters that effects may need besides the baseline's: a camera that stands elsewhere has six, a ball of another modulus five, a memory of
/// two terms and an uneven scale four, no other entry more than three, and three act at most.
pub(super) const ROOM: usize = 6 + 5 + 4;

/// What is taken to act: the baseline, less some of its patches, with the knobs of some effects.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Acting {
    /// What is added.
    pub knobs: Vec<Knob>,
    /// Patches of the baseline that are left out.
    pub without: Vec<usize>,
    /// Whether a law that is not linear is worked out as well as it can be: for a refit. A look does with less.
    pub fine: bool,
}

/// A patch of the baseline.
#[derive(Debug, Clone)]
struct Patch {
    discs: std::ops::Range<usize>,
    /// Parameter of the logarithm of its stiffness; none for glue.
    log_stiffness: Option<usize>,
    /// Stiffness of one disc at the start (N/m).
    stiffness: f64,
}

/// A recording and the body under it, ready to be explained.
pub(super) struct Model<'a> {
    /// The baseline.
    pub settled: &'a Settled<'a>,
    /// Every poke.
    pub tracks: Vec<Track>,
    /// The recording in time.
    pub timeline: Timeline,
    /// The baseline's body.
    pub body: Body,
    patches: Vec<Patch>,
    /// The baseline's parameters but the share of what finer elements change, in order; of springs the stiffness in the place of the softness.
    baseline: Vec<Parameter>,
    /// Parameter of the share of what finer elements change.
    finer: Option<usize>,
    /// Standard deviations of a row's force (N) and of a marker in one frame (m), along each axis.
    pub force_sd: [f64; 3],
    /// As above.
    pub marker_sd: [f64; 3],
    /// Where markers are in the picture.
    pub(super) picture: Picture,
    /// Derivative of the body's markers by where along each axis they are.
    by_place: [DMatrix<f64>; 3],
    /// How far errors are from white.
    pub correlation: Correlation,
    /// Times (s) and forces (N) between pokes.
    pub(super) rest: Vec<(f64, Vec3)>,
    /// Frames between pokes, from the first poke on.
    pub(super) pauses: Vec<Vec<Frame>>,
    modulus: f64,
    /// Changes of the body, where the elements have an answer.
    lab: Result<bulk::Lab<'a>, DiagnoseError>,
    known: Known,
    /// What elements that resolve a change of the body add to it.
    correction: Option<Changed>,
    /// Laws that are not linear: for a look, and in full once one of them is promising.
    rough: Result<Arc<Shelf>, DiagnoseError>,
    fine: OnceLock<Arc<Shelf>>,
}

/// What knobs do to the body.
type ChangeOf<'c> = &'c dyn Fn(&[(BulkKnob, f64)]) -> Option<BodyChange>;

/// A march with what it was made for.
pub(super) struct Marched<'a> {
    /// Forces and loads.
    pub rows: March,
    /// The body.
    pub body: Body,
    /// What acts.
    pub effects: Effects,
    /// The camera's matrix.
    pub turn: [[Dual; 3]; 3],
    /// Number of parameters that it has derivatives by.
    pub fitted: usize,
    /// What a law that is not linear adds, with where it comes from and the modulus.
    pub extra: Option<(Extra<'a>, &'a Shelf, Dual)>,
}

impl<'a> Model<'a> {
    /// From a settled baseline. Where `beside` has much the same restraint, what it knows of laws that are not linear serves here too.
    ///
    /// # Errors
    /// [`DiagnoseError::NoStage`], [`DiagnoseError::TipNotLinear`], [`DiagnoseError::TooManyPatches`].
    pub(super) fn new(settled: &'a Settled<'a>, beside: Option<&Model<'_>>) -> Result<Self, DiagnoseError> {
        let at = settled.at;
        let softs: Vec<usize> =
            (0..at.state.patches.len()).filter(|&p| at.state.patches[p].softness > 0.0).collect();
        let first_shift = 1 + softs.len();
        if first_shift + ROOM + 1 > MOST {
            return Err(DiagnoseError::TooManyPatches { patches: at.state.patches.len() });
        }
        let mut baseline = vec![Parameter::LogModulus];
        baseline.extend(softs.iter().map(|&p| Parameter::LogSoftness(p)));
        // Where there are more places than a march can be differentiated by, the patches last found stay where they are.
        for patch in 0..at.state.patches.len() {
            let of_it = |p: &Parameter| match *p {
                Parameter::Shift(of, _) | Parameter::LogRadius(of) => of == patch,
                Parameter::LogModulus | Parameter::LogSoftness(_) => false,
            };
            let place: Vec<Parameter> = at.parameters.iter().copied().filter(of_it).collect();
            if baseline.len() + place.len() + ROOM + 1 > MOST {
                break;
            }
            baseline.extend(place);
        }
        let index_of = |parameter: Parameter| baseline.iter().position(|p| *p == parameter);
        let mut body = body(settled, &index_of)?;
        let lab = bulk::Lab::new(settled);
        let finer = lab.as_ref().ok().and_then(|lab| lab.first_order(&[(BulkKnob::Finer, 1.0)]).ok());
        let finer = finer.map(|change| {
            body.open(&change, baseline.len());
            baseline.len()
        });
        let modulus = at.state.modulus;
        let patches = at.mounted.groups.iter().enumerate().map(|(p, group)| {
            let own = &body.discs_discs.value;
            let local = (3 * group.discs.start..3 * group.discs.end).map(|i| own[(i, i)]);
            let softness = group.softness.max(GLUE * local.fold(f64::INFINITY, f64::min));
            let log_stiffness = softs.iter().position(|&s| s == p).map(|i| 1 + i);
            Patch { discs: group.discs.clone(), log_stiffness, stiffness: modulus / softness }
        });
        let patches = patches.collect();
        let inward: Vec<Vec3> = settled.problem.bench.tips.iter().map(|tip| tip.inward()).collect();
        let mut tracks = tracks(settled.recording, settled.evidence, &inward);
        let timeline = timeline(settled.recording, &mut tracks);
        let noise = &settled.evidence.noise;
        let known = beside.and_then(|other| Some((other.rough.as_ref().ok()?, &other.fine)));
        let (rough, fine) = match known.filter(|(shelf, _)| shelf.serves(&at.state.patches)) {
            Some((rough, fine)) => (Ok(Arc::clone(rough)), fine.clone()),
            None => (Shelf::rough(settled, &tracks).map(Arc::new), OnceLock::new()),
        };
        Ok(Self {
            settled,
            patches,
            baseline,
            tracks,
            timeline,
            force_sd: noise.force_n,
            marker_sd: noise.marker_m,
            picture: Picture::of(settled.evidence.rest.iter().map(|(at, _)| *at)),
            by_place: by_place(settled)?,
            correlation: correlation(settled.recording, settled.evidence, &Creep::None),
            rest: force_at_rest(settled.recording),
            pauses: pauses(settled.recording, settled.evidence),
            body,
            modulus,
            lab,
            finer,
            known: Known::default(),
            correction: None,
            rough,
            fine,
        })
    }

    /// Number of the baseline's own parameters, which come first.
    pub(super) fn base(&self) -> usize {
        self.baseline.len() + usize::from(self.finer.is_some())
    }

    /// Number of the baseline's parameters that are logarithms, which come first; of the others shifts are in m.
    pub(super) fn logarithms(&self) -> usize {
        1 + self.patches.iter().filter(|patch| patch.log_stiffness.is_some()).count()
    }

    /// Whether a parameter is the logarithm of a patch's radius.
    pub(super) fn is_radius(&self, parameter: usize) -> bool {
        matches!(self.baseline.get(parameter), Some(Parameter::LogRadius(_)))
    }

    /// The baseline's own parameters but the share of what finer elements change, in order; of springs the stiffness in the place of the softness.
    pub(super) fn baseline(&self) -> &[Parameter] {
        &self.baseline
    }

    /// Number of patches of the baseline.
    pub(super) fn patches(&self) -> usize {
        self.patches.len()
    }

    /// Stiffness of a patch of springs (N/m), and its gradient by the parameters; none of glue.
    pub(super) fn patch_n_per_m(&self, patch: usize, at: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let Patch { discs, log_stiffness, .. } = &self.patches[patch];
        let i = (*log_stiffness)?;
        let own = at[i].exp() * discs.len() as f64;
        Some((own, DVector::from_fn(at.len(), |j, _| if i == j { own } else { 0.0 })))
    }

    /// Number of parameters: the baseline's, the knobs', and two shares for every site.
    pub(super) fn count(&self, acting: &Acting) -> usize {
        self.base() + acting.knobs.len() + 2 * self.body.sites
    }

    /// Whether a parameter stays where it is.
    pub(super) fn frozen(&self, acting: &Acting, parameter: usize) -> bool {
        let left_out = match self.baseline.get(parameter) {
            Some(
                Parameter::LogSoftness(patch) | Parameter::Shift(patch, _) | Parameter::LogRadius(patch),
            ) => Some(*patch),
            Some(Parameter::LogModulus) | None => None,
        };
        let knob = parameter.checked_sub(self.base()).and_then(|k| acting.knobs.get(k));
        left_out.is_some_and(|patch| acting.without.contains(&patch))
            || knob.is_some_and(|knob| {
                let ([low, high], _) = self.range(*knob);
                low >= high
            })
    }

    /// The baseline as it settled, with knobs at these values.
    pub(super) fn start(&self, knobs: &[(Knob, f64)]) -> DVector<f64> {
        let acting = Acting { knobs: knobs.iter().map(|k| k.0).collect(), ..Acting::default() };
        let mut start = DVector::zeros(self.count(&acting));
        start[0] = self.modulus.ln();
        for patch in &self.patches {
            if let Some(i) = patch.log_stiffness {
                start[i] = patch.stiffness.ln();
            }
        }
        knobs.iter().enumerate().for_each(|(i, (_, value))| start[self.base() + i] = *value);
        start
    }

    /// Inverse variance that each parameter is known to have beforehand about 0.
    pub(super) fn prior_precision(&self, acting: &Acting) -> DVector<f64> {
        let (base, first_share) = (self.base(), self.base() + acting.knobs.len());
        DVector::from_fn(self.count(acting), |i, _| {
            let sd = if i >= first_share {
                ELEMENTS[usize::from(i - first_share >= self.body.sites)]
            } else if i >= base {
                acting.knobs[i - base].prior_sd()
            } else if self.is_finer(i) {
                FINER_SD[usize::from(!self.settled.settings.quick)]
            } else {
                f64::INFINITY
            };
            sd.powi(-2)
        })
    }

    /// Whether a parameter is the share of what finer elements change.
    pub(super) fn is_finer(&self, parameter: usize) -> bool {
        Some(parameter) == self.finer
    }

    /// Sums of every poke, and last of the force between them. `None` where the model has no answer. `near`: the body's changes by their
    /// derivatives there.
    pub(super) fn sums(
        &self,
        acting: &Acting,
        at: &DVector<f64>,
        near: Option<&Fitted>,
    ) -> Option<Vec<PokeSums>> {
        let marched = match near {
            Some(known) => self.march_near(known, acting, at),
            None => self.march(acting, at),
        }?;
        let mut sums: Vec<PokeSums> =
            self.tracks.par_iter().map(|track| self.track_sums(&marched, at, track)).collect();
        sums.push(self.rest_sums(&marched, at.len()));
        Some(sums)
    }

    fn effects(&self, acting: &Acting, at: &DVector<f64>) -> Effects {
        let mut effects = Effects::neutral(self.patches.len());
        for (i, knob) in acting.knobs.iter().enumerate() {
            knob.set(&mut effects, variable(at[self.base() + i], self.base() + i));
        }
        effects
    }

    /// When the last poke ends (s).
    pub(super) fn end_s(&self) -> f64 {
        self.timeline.rows.last().map_or(0.0, |row| row.time_s)
    }

    /// The recording in time.
    pub(super) fn march(&self, acting: &Acting, at: &DVector<f64>) -> Option<Marched<'_>> {
        self.march_along(&self.timeline, acting, at)
    }

    /// The recording in time, the changes of the body by their derivatives where a fit has ended: for parameters a step away. Changes that are
    /// not those of that fit are worked out.
    pub(super) fn march_near(
        &self,
        known: &Fitted,
        acting: &Acting,
        at: &DVector<f64>,
    ) -> Option<Marched<'_>> {
        let ended = self.bulk_knobs(&known.acting, &known.at);
        let changed = |knobs: &[(BulkKnob, f64)]| {
            let same = ended.len() == knobs.len() && ended.iter().zip(knobs).all(|(a, b)| a.0 == b.0);
            if same { self.moved(&*self.nearest(&ended)?, knobs) } else { self.changed(knobs) }
        };
        self.march_with(&self.timeline, acting, at, &changed)
    }

    /// Any motion in time, from rest.
    pub(super) fn march_along(
        &self,
        timeline: &Timeline,
        acting: &Acting,
        at: &DVector<f64>,
    ) -> Option<Marched<'_>> {
        self.march_with(timeline, acting, at, &|knobs| self.changed(knobs))
    }

    fn march_with(
        &self,
        timeline: &Timeline,
        acting: &Acting,
        at: &DVector<f64>,
        changed: ChangeOf<'_>,
    ) -> Option<Marched<'_>> {
        let modulus = variable(at[0], 0).exp();
        let effects = self.effects(acting, at);
        let groups = self.groups(acting, at);
        let fitted = self.base() + acting.knobs.len();
        let body = self.body_at(acting, at, changed)?;
        let marching =
            Marching { timeline, body: &body, modulus, groups: &groups, effects: &effects, fitted };
        let rows = marching.march()?;
        let turn = camera(&effects);
        let extra = match &effects.large {
            Some(large) => {
                let shelf = self.shelf(acting.fine)?;
                Some((shelf.extra(large).ok()?, shelf, modulus))
            }
            None => None,
        };
        Some(Marched { rows, body, effects, turn, fitted, extra })
    }

    /// The body with its patches where they are and all changes that act, its markers where they are.
    fn body_at(&self, acting: &Acting, at: &DVector<f64>, changed: ChangeOf<'_>) -> Option<Body> {
        let fitted = self.base() + acting.knobs.len();
        let mut body = self.body.at(&at.as_slice()[..fitted]);
        let bulk = acting.knobs.iter().enumerate().filter_map(|(i, knob)| match knob {
            Knob::Bulk(bulk) => Some((self.base() + i, (*bulk, at[self.base() + i]))),
            _ => None,
        });
        let (parameters, knobs): (Vec<usize>, Vec<(BulkKnob, f64)>) = bulk.unzip();
        if !knobs.is_empty() {
            body.add(&changed(&knobs)?, |knob| parameters[knob]);
        }
        for (i, knob) in acting.knobs.iter().enumerate() {
            if let Knob::Translation(axis) = knob {
                body.see_beside(&self.by_place[*axis], at[self.base() + i], self.base() + i);
            }
        }
        Some(body)
    }

    /// What these knobs do to the body.
    fn changed(&self, knobs: &[(BulkKnob, f64)]) -> Option<BodyChange> {
        self.moved(&*self.nearest(knobs)?, knobs)
    }

    /// A change so close to this one that its derivatives lead here.
    fn nearest(&self, knobs: &[(BulkKnob, f64)]) -> Option<Arc<Changed>> {
        self.known.nearest(self.lab()?, knobs)
    }

    /// What these knobs do to the body, by the derivatives of what is known of the same knobs, and the correction where one holds.
    fn moved(&self, known: &Changed, knobs: &[(BulkKnob, f64)]) -> Option<BodyChange> {
        let change = known.moved(knobs)?;
        let correction = self.correction.as_ref().and_then(|correction| correction.moved(knobs));
        Some(correction.map_or_else(|| change.clone(), |correction| change.plus(&correction)))
    }

    /// Smallest and largest value of a knob, and the longest step of a fit.
    pub(super) fn range(&self, knob: Knob) -> ([f64; 2], f64) {
        match (knob, &self.lab) {
            (Knob::Bulk(bulk), Ok(lab)) => lab.range(bulk),
            _ => knob.range(),
        }
    }

    /// Laws that are not linear, for a look or for a refit, which [`Model::refine`] must have prepared; none where the
    /// elements have no answer.
    pub(super) fn shelf(&self, fine: bool) -> Option<&Shelf> {
        if fine { self.fine.get() } else { self.rough.as_ref().ok() }.map(Arc::as_ref)
    }

    /// Prepares laws that are not linear for refits.
    pub(super) fn refine(&self) {
        if let Ok(rough) = &self.rough {
            self.fine.get_or_init(|| Arc::new(rough.in_full()));
        }
    }

    /// What could not be looked at, and why.
    pub(super) fn remarks(&self) -> Vec<String> {
        let body = self.lab.as_ref().err().map(|why| format!("no change of the body was looked at: {why}"));
        let laws = self.rough.as_ref().err();
        let laws = laws.map(|why| format!("no law that is not linear was looked at: {why}"));
        body.into_iter().chain(laws).collect()
    }

    /// Changes of the body.
    pub(super) fn lab(&self) -> Option<&bulk::Lab<'a>> {
        self.lab.as_ref().ok()
    }

    /// Corrects what these knobs do to the body, at these values and by its derivatives near them, to what they do in
    /// another laboratory.
    ///
    /// # Errors
    /// As [`bulk::Lab::changed`].
    pub(super) fn correct(
        &mut self,
        knobs: &[(BulkKnob, f64)],
        lab: &bulk::Lab<'_>,
    ) -> Result<(), DiagnoseError> {
        if let Some(own) = self.lab() {
            let change = lab.changed(knobs)?.less(&own.changed(knobs)?);
            self.correction = Some(Changed::new(knobs, change));
        }
        Ok(())
    }

    /// Puts another correction in the place of the one that holds, which comes back; none: the body is as its own laboratory says.
    pub(super) fn exchange_correction(&mut self, other: Option<Changed>) -> Option<Changed> {
        std::mem::replace(&mut self.correction, other)
    }

    /// Changes of the body that act.
    pub(super) fn bulk_knobs(&self, acting: &Acting, at: &DVector<f64>) -> Vec<(BulkKnob, f64)> {
        let knobs = acting.knobs.iter().enumerate().filter_map(|(i, knob)| match knob {
            Knob::Bulk(bulk) => Some((*bulk, at[self.base() + i])),
            _ => None,
        });
        knobs.collect()
    }

    /// Stiffness of every disc of the restraint (N/m).
    pub(super) fn disc_stiffness(&self, acting: &Acting, at: &DVector<f64>) -> Vec<Dual> {
        let mut all = vec![Dual::from(0.0); self.body.discs_discs.value.nrows() / 3];
        for group in self.groups(acting, at) {
            all[group.discs].fill(group.stiffness);
        }
        all
    }

    fn groups(&self, acting: &Acting, at: &DVector<f64>) -> Vec<Group> {
        let stiffness = |(p, patch): (usize, &Patch)| match patch.log_stiffness {
            _ if acting.without.contains(&p) => Dual::from(0.0),
            Some(i) => variable(at[i], i).exp(),
            None => Dual::from(patch.stiffness),
        };
        let group = |(p, patch)| Group { discs: Patch::clone(patch).discs, stiffness: stiffness((p, patch)) };
        self.patches.iter().enumerate().map(group).collect()
    }
}
