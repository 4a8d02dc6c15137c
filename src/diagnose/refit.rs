//! One reading of the recording, refitted in full: the knobs of some effects together with everything of the baseline,
//! within bounds; and how well each poke is predicted by the others.

use super::model::{Acting, Model};
use super::sums::{Offsets, PokeSums};
use nalgebra::{DMatrix, DVector};

/// A fitted reading.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    /// What acts.
    pub acting: Acting,
    /// Values of all parameters.
    pub at: DVector<f64>,
    /// Sums of every poke there, and last of the force between pokes.
    pub parts: Vec<PokeSums>,
    /// Sum of squares over the effective noise, the elements' shares at their price.
    pub cost: f64,
    /// How the descent to it ended.
    pub end: End,
}

/// How a descent ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// No step lowers the sum of squares by anything that counts.
    AtRest,
    /// It might have gone on.
    OutOfSteps,
    /// It could not have come close to another reading.
    GivenUp,
}

/// Longest step of the baseline's logarithms, and of a shift (m).
const LONGEST: [f64; 2] = [0.5, 2e-3];

/// Farthest that a patch may go from where the baseline has it (m): beyond, its compliance is no longer known.
const FARTHEST_M: f64 = 5e-3;

/// By how much a patch's radius may differ from the baseline's (logarithm), likewise, and the longest step of it.
const FARTHEST_LOG_RADIUS: f64 = 0.2;
const LONGEST_LOG_RADIUS: f64 = 0.1;

/// Largest share of what finer elements change.
const MOST_FINER: f64 = 3.0;

/// A step that lowers the sum of squares by less than this changes nothing by more than a tenth of its deviation.
const GOOD_ENOUGH: f64 = 1e-2;

impl Fitted {
    pub(super) fn new(model: &Model<'_>, acting: &Acting, at: DVector<f64>) -> Option<Self> {
        Self::of(model, acting, at, None)
    }

    /// As [`Fitted::new`], the body's changes by their derivatives where another fit has ended: for a step from there.
    pub(super) fn near(model: &Model<'_>, acting: &Acting, at: DVector<f64>, known: &Self) -> Option<Self> {
        Self::of(model, acting, at, Some(known))
    }

    fn of(model: &Model<'_>, acting: &Acting, at: DVector<f64>, known: Option<&Self>) -> Option<Self> {
        let parts = model.sums(acting, &at, known)?;
        let price: f64 = model.prior_precision(acting).iter().zip(at.iter()).map(|(w, x)| w * x * x).sum();
        let end = End::OutOfSteps;
        let mut fitted = Self { acting: acting.clone(), at, parts, cost: 0.0, end };
        let (offsets, weight) = fitted.offsets(model, None);
        let parts = fitted.parts.iter().map(|p| p.cost).sum::<f64>();
        fitted.cost = parts + price - offsets.taken_off(&weight).cost;
        fitted.cost.is_finite().then_some(fitted)
    }

    /// The pokes' sums.
    pub(super) fn pokes(&self) -> &[PokeSums] {
        &self.parts[..self.parts.len() - 1]
    }

    /// `JᵀJ` and `Jᵀr` of everything but one poke, with what is known beforehand.
    pub(super) fn equations(
        &self,
        model: &Model<'_>,
        without: Option<usize>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let prior = model.prior_precision(&self.acting);
        let mut normal = DMatrix::from_diagonal(&prior);
        let mut gradient = -prior.component_mul(&self.at);
        for (_, sums) in self.parts.iter().enumerate().filter(|(i, _)| Some(*i) != without) {
            normal += &sums.normal;
            gradient += &sums.gradient;
        }
        let (offsets, weight) = self.offsets(model, without);
        let off = offsets.taken_off(&weight);
        (normal - off.normal, gradient - off.gradient)
    }

    /// Sums over all frames but those of one poke, and what the error of the rest positions, which stays with a marker, takes off: with
    /// `r` frames at rest `(1 + 1 1ᵀ/r)⁻¹ = 1 − 1 1ᵀ/(r + n)`.
    fn offsets(&self, model: &Model<'_>, without: Option<usize>) -> (Offsets, DVector<f64>) {
        let mut parts = self.parts.iter().enumerate().filter(|(i, _)| Some(*i) != without).map(|(_, p)| p);
        let mut all =
            parts.next().map_or_else(|| model.no_sums(self.at.len()).offsets, |p| p.offsets.clone());
        parts.for_each(|part| all.add(&part.offsets));
        let weight =
            DVector::from_fn(all.frames.len(), |i, _| (model.rest_frames(i / 3) + all.frames[i]).recip());
        (all, weight)
    }

    /// What acts, and the parameters.
    pub(super) fn place(&self) -> (&Acting, &DVector<f64>) {
        (&self.acting, &self.at)
    }

    /// Sum of the residuals of each component of each marker over all frames (m), and what share of such sums its rest position's error takes off.
    pub(super) fn staying(&self, model: &Model<'_>) -> (DVector<f64>, DVector<f64>) {
        let (all, weight) = self.offsets(model, None);
        let residuals = all.rows.column(self.at.len());
        (residuals.map_with_location(|i, _, r| r * model.marker_sd[i % 3]), weight)
    }

    /// How each poke pulls at the parameters, all in all the gradient.
    pub(super) fn pulls(&self, model: &Model<'_>) -> Vec<DVector<f64>> {
        let (all, weight) = self.offsets(model, None);
        let off = all.rows.column(self.at.len()).component_mul(&weight);
        let pull = |sums: &PokeSums| {
            let taken = sums.offsets.rows.tr_mul(&off);
            &sums.gradient - taken.rows(0, self.at.len())
        };
        self.pokes().iter().map(pull).collect()
    }

    /// Sum of squares over the stated noise of all rows in pokes.
    pub(super) fn chi2(&self) -> f64 {
        self.pokes().iter().flat_map(|p| p.chi2).sum()
    }

    /// Sum of squares of everything that the model predicts, over the effective noise.
    pub(super) fn signal(&self, model: &Model<'_>) -> f64 {
        let first_share = self.at.len() - 2 * model.body.sites;
        self.pokes().iter().map(|p| p.normal.diagonal().rows(first_share, 2 * model.body.sites).sum()).sum()
    }

    /// By which readings of different size are compared: the sum of squares, and for every free knob the logarithm of the
    /// number of values (Schwarz 1978).
    pub(super) fn criterion(&self, model: &Model<'_>) -> f64 {
        let first = model.base();
        let knobs = first..first + self.acting.knobs.len();
        let free = knobs.filter(|&i| !model.frozen(&self.acting, i));
        self.cost + free.count() as f64 * (self.values().max(1) as f64).ln()
    }

    /// Number of values in pokes.
    pub(super) fn values(&self) -> usize {
        self.pokes().iter().map(|p| p.values).sum()
    }

    /// Covariance of all parameters; `None` when a direction is not determined. Those that stay have no variance.
    pub(super) fn covariance(&self, model: &Model<'_>) -> Option<DMatrix<f64>> {
        self.covariance_but(model, |_| false)
    }

    /// As [`Fitted::covariance`], with some parameters held.
    pub(super) fn covariance_but(
        &self,
        model: &Model<'_>,
        held: impl Fn(usize) -> bool,
    ) -> Option<DMatrix<f64>> {
        let (normal, _) = self.equations(model, None);
        let n = normal.nrows();
        let free: Vec<usize> = (0..n).filter(|&i| !held(i) && !model.frozen(&self.acting, i)).collect();
        let scale: Vec<f64> =
            free.iter().map(|&i| normal[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
        let scaled =
            DMatrix::from_fn(free.len(), free.len(), |a, b| normal[(free[a], free[b])] * scale[a] * scale[b]);
        let inverse = scaled.cholesky()?.inverse();
        let mut covariance = DMatrix::zeros(n, n);
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                covariance[(i, j)] = inverse[(a, b)] * scale[a] * scale[b];
            }
        }
        Some(covariance)
    }

    /// Parameters fitted to all pokes but one (one step from the fit to all of them).
    pub(super) fn without(&self, model: &Model<'_>, poke: usize) -> Option<DVector<f64>> {
        let (normal, gradient) = self.equations(model, Some(poke));
        Some(&self.at + bounded_step(model, self, &normal, &gradient, 1e-9)?.step)
    }

    /// Sum of squares over the stated noise of every poke, predicted by a fit to the others: what it is, and by how much the
    /// step to that fit raises it.
    pub(super) fn held_out(&self, model: &Model<'_>) -> Option<Vec<f64>> {
        self.predicted_by_others(model, |sums| sums.chi2.iter().sum())
    }

    /// As [`Fitted::held_out`], of all pokes together and over the effective noise, as fits weigh them.
    pub(super) fn weighed_held_out(&self, model: &Model<'_>) -> Option<f64> {
        Some(self.predicted_by_others(model, |sums| sums.cost)?.iter().sum())
    }

    fn predicted_by_others(&self, model: &Model<'_>, here: impl Fn(&PokeSums) -> f64) -> Option<Vec<f64>> {
        let predicted = |(poke, sums): (usize, &PokeSums)| {
            let (normal, gradient) = self.equations(model, Some(poke));
            let step = bounded_step(model, self, &normal, &gradient, 1e-9)?.step;
            let raised = (&sums.normal * &step).dot(&step) - 2.0 * sums.gradient.dot(&step);
            Some(here(sums) + raised)
        };
        self.pokes().iter().enumerate().map(predicted).collect()
    }

    /// By how much the sum of squares would fall in one step from here.
    pub(super) fn promised(&self, model: &Model<'_>) -> f64 {
        let (normal, gradient) = self.equations(model, None);
        bounded_step(model, self, &normal, &gradient, 1e-6).map_or(0.0, |s| s.promised)
    }
}

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort<'k> {
    /// Most steps.
    pub steps: usize,
    /// It has come to rest when a step promises less than this.
    pub at_rest: f64,
    /// It is given up where even so many times ...
    pub optimism: f64,
    /// ... what a step promises would leave more than this.
    pub hopeless: f64,
    /// The body's changes are taken by their derivatives where this has ended, and not worked out.
    pub near: Option<&'k Fitted>,
}

/// As far as the noise can tell.
pub(super) const IN_FULL: Effort<'static> =
    Effort { steps: 25, at_rest: GOOD_ENOUGH, optimism: 1.0, hopeless: f64::INFINITY, near: None };

/// Fits from `start`.
pub(super) fn descend(
    model: &Model<'_>,
    acting: &Acting,
    start: DVector<f64>,
    effort: Effort<'_>,
) -> Option<Fitted> {
    Some(descend_from(model, Fitted::of(model, acting, start, effort.near)?, effort))
}

/// Fits on (Levenberg–Marquardt, Nielsen 1999); parameters on a bound that want beyond it stay there.
pub(super) fn descend_from(model: &Model<'_>, mut fitted: Fitted, effort: Effort<'_>) -> Fitted {
    let (mut damping, mut growth) = (1e-4, 2.0);
    fitted.end = End::OutOfSteps;
    for _ in 0..effort.steps {
        let (normal, gradient) = fitted.equations(model, None);
        let Some(Step { step, promised }) = bounded_step(model, &fitted, &normal, &gradient, damping) else {
            break;
        };
        if promised < effort.at_rest {
            fitted.end = End::AtRest;
            break;
        }
        if fitted.cost - effort.optimism * promised > effort.hopeless {
            fitted.end = End::GivenUp;
            break;
        }
        match Fitted::of(model, &fitted.acting, &fitted.at + &step, effort.near) {
            Some(tried) if tried.cost < fitted.cost => {
                let ratio = (fitted.cost - tried.cost) / promised;
                damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-12);
                growth = 2.0;
                fitted = tried;
            }
            _ => {
                damping *= growth;
                growth *= 2.0;
                if damping > 1e6 {
                    // A kink: no step leads down.
                    fitted.end = End::AtRest;
                    break;
                }
            }
        }
    }
    fitted
}

/// A step, and by how much it would lower the sum of squares were everything linear.
struct Step {
    step: DVector<f64>,
    promised: f64,
}

/// A damped step within a box: no parameter goes farther than its longest step, or beyond its bounds. Those that would are
/// put on the edge, and the others answer to that.
fn bounded_step(
    model: &Model<'_>,
    fitted: &Fitted,
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Option<Step> {
    let n = gradient.len();
    let edges = |i: usize| -> [f64; 2] {
        let (bounds, longest) = match i.checked_sub(model.base()).map(|k| fitted.acting.knobs.get(k)) {
            Some(Some(knob)) => model.range(*knob),
            Some(None) => return [f64::NEG_INFINITY, f64::INFINITY],
            None if model.is_finer(i) => ([-MOST_FINER, MOST_FINER], 1.0),
            None if model.is_radius(i) => ([-FARTHEST_LOG_RADIUS, FARTHEST_LOG_RADIUS], LONGEST_LOG_RADIUS),
            None if i < model.logarithms() => ([f64::NEG_INFINITY, f64::INFINITY], LONGEST[0]),
            None => ([-FARTHEST_M, FARTHEST_M], LONGEST[1]),
        };
        [(bounds[0] - fitted.at[i]).max(-longest).min(0.0), (bounds[1] - fitted.at[i]).min(longest).max(0.0)]
    };
    let mut free: Vec<usize> = (0..n).filter(|&i| !model.frozen(&fitted.acting, i)).collect();
    let mut step = DVector::zeros(n);
    loop {
        let pull = gradient - normal * &step;
        let scale: Vec<f64> =
            free.iter().map(|&i| normal[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
        let matrix = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let raise = if a == b { damping } else { 0.0 };
            normal[(free[a], free[b])] * scale[a] * scale[b] + raise
        });
        let right = DVector::from_fn(free.len(), |a, _| pull[free[a]] * scale[a]);
        let solved = matrix.cholesky()?.solve(&right);
        let wanted: Vec<(usize, f64)> =
            free.iter().enumerate().map(|(a, &i)| (i, solved[a] * scale[a])).collect();
        let beyond = |&(i, to): &(usize, f64)| to < edges(i)[0] || to > edges(i)[1];
        if !wanted.iter().any(beyond) {
            wanted.iter().for_each(|&(i, to)| step[i] = to);
            let promised = 2.0 * step.dot(gradient) - (normal * &step).dot(&step);
            return Some(Step { step, promised });
        }
        for &(i, to) in wanted.iter().filter(|w| beyond(w)) {
            let [low, high] = edges(i);
            step[i] = to.clamp(low, high);
            free.retain(|&f| f != i);
        }
    }
}

#[cfg(test)]
impl Fitted {
    /// A fit of which nothing but the sum of squares is known.
    pub(super) fn that_costs(cost: f64) -> Self {
        Self { acting: Acting::default(), at: DVector::zeros(0), parts: Vec::new(), cost, end: End::AtRest }
    }
}
