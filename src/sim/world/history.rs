//! The condensed phantom carried through a session: forces and loads at every instant of a fine grid of time.
//!
//! With λ the forces on the phantom and memory as in `memory`, λ = E₀ d(t) (y − Σ gᵢ qᵢ) and every displacement is a
//! combination of y: w = C y at tips and springs, W y at markers; d is the drift of the modulus. A step ends at
//! λ = α y − E₀ d h with α = E₀ d s, so that w = w⁰ + G λ, G = C/α, with what is known in w⁰. The forces of the tip in
//! contact and of the springs are then found together by Newton's method on their laws, a dozen equations:
//!
//! - a spring: λ = law(w), see `hold_law`;
//! - a bonded tip: w + c d (d·λ) = target, c the compliance of the stage along its direction d;
//! - a dry tip: λ is the projection of λ + ρ (target − c d (d·λ) − slip − w) on the friction cone's slice, normal part not
//!   negative and tangential part at most μ times it (Alart & Curnier 1991); what the tip has moved past the surface is the
//!   slip.
//!
//! Steps are implicit; the memory's update is exact for loads that are linear in a step.

use super::condensed::SessionBody;
use super::hold_law::HoldLaw;
use super::memory::{Past, PronyTerm, relaxed};
use super::motion::Contact;
use crate::geometry::{Mat3, Vec3};
use crate::sim::SimError;
use nalgebra::{DMatrix, DVector};

/// Newton iterations in one step of time; a dozen are needed when several laws change branch.
const ITERATIONS: usize = 60;
/// After so many iterations steps are halved: piecewise linear laws can make Newton's method go in circles.
const PATIENCE: usize = 12;
/// Largest error of a force (N), relative to the forces and absolute.
const TOLERANCE: f64 = 1e-11;

/// What the session is made of besides its body.
pub(super) struct Setup {
    /// E at equilibrium (Pa).
    pub(super) young_modulus_pa: f64,
    /// Memory of the phantom.
    pub(super) terms: Vec<PronyTerm>,
    /// d(t) = 1 + rate · t (1/s).
    pub(super) drift_per_s: f64,
    /// One law a spring patch, in the body's order.
    pub(super) holds: Vec<HoldLaw>,
    /// Friction coefficient of a dry tip; none for a bonded one.
    pub(super) friction: Option<f64>,
    /// Compliance of the stage (m/N).
    pub(super) stage_compliance: f64,
    /// Force per volume while a tip touches the phantom (N/m³).
    pub(super) weight: Vec3,
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course {
    pub(super) step_s: f64,
    /// Force of the tip on the phantom at every instant (N).
    pub(super) force: Vec<Vec3>,
    /// y at every instant.
    pub(super) loads: Vec<DVector<f64>>,
}

impl Course {
    /// The instants around a time and the share of the second.
    fn around(&self, time_s: f64) -> (usize, f64) {
        let place = (time_s / self.step_s).clamp(0.0, (self.force.len() - 1) as f64);
        // A time on the grid up to rounding is that instant's.
        let nearest = place.round();
        let place = if (place - nearest).abs() < 1e-6 { nearest } else { place };
        let before = (place as usize).min(self.force.len() - 2);
        (before, place - before as f64)
    }

    /// Force at a time (N).
    pub(super) fn force_at(&self, time_s: f64) -> Vec3 {
        let (n, share) = self.around(time_s);
        self.force[n] * (1.0 - share) + self.force[n + 1] * share
    }

    /// y at a time.
    pub(super) fn loads_at(&self, time_s: f64) -> DVector<f64> {
        let (n, share) = self.around(time_s);
        &self.loads[n] * (1.0 - share) + &self.loads[n + 1] * share
    }
}

/// Carries `body` through the instants of `contacts`, which are `step_s` apart.
pub(super) fn carry(
    body: &SessionBody,
    setup: Setup,
    contacts: &[Option<Contact>],
    step_s: f64,
) -> Result<Course, SimError> {
    let mut carrier = Carrier::new(body, setup, step_s);
    let mut course = Course { step_s, force: Vec::new(), loads: Vec::new() };
    for contact in contacts {
        let (force, loads) = carrier.step(body, contact.as_ref())?;
        course.force.push(force);
        course.loads.push(loads);
    }
    Ok(course)
}

/// The phantom at the latest instant, with all that it remembers.
pub(super) struct Carrier {
    setup: Setup,
    step_s: f64,
    /// Modulus at once (Pa).
    instantaneous: f64,
    past: Past,
    slip: Slip,
    /// Forces of the last step (N).
    last: DVector<f64>,
    instants: u64,
}

impl Carrier {
    /// At rest, before the first instant; instants are `step_s` apart.
    pub(super) fn new(body: &SessionBody, setup: Setup, step_s: f64) -> Self {
        let n = 3 * (body.tips + body.springs) + 3;
        Self {
            step_s,
            instantaneous: setup.young_modulus_pa / (1.0 - relaxed(&setup.terms)),
            past: Past::new(&setup.terms, step_s, n),
            slip: Slip { tip: usize::MAX, by: Vec3::zeros() },
            last: DVector::zeros(n),
            instants: 0,
            setup,
        }
    }

    /// The same after so many instants at rest.
    pub(super) fn after(self, instants: u64) -> Self {
        Self { instants, ..self }
    }

    /// Goes on to the next instant: force of the tip on the phantom (N) and y.
    pub(super) fn step(
        &mut self,
        body: &SessionBody,
        contact: Option<&Contact>,
    ) -> Result<(Vec3, DVector<f64>), SimError> {
        let n = 3 * (body.tips + body.springs);
        let time_s = self.instants as f64 * self.step_s;
        let modulus = self.instantaneous * (1.0 + self.setup.drift_per_s * time_s);
        let alpha = modulus * self.past.share();
        let mut known = DVector::from_vec(self.past.held_back()) / self.past.share();
        let carried = contact.map_or(Vec3::zeros(), |_| self.setup.weight);
        for c in 0..3 {
            known[n + c] += carried[c] / alpha;
        }
        let first = if contact.is_some() { 0 } else { 3 };
        let active: Vec<usize> = (first..3 * (1 + body.springs))
            .map(|i| match (i < 3, contact) {
                (true, Some(contact)) => 3 * contact.tip + i,
                // The springs come after all tips.
                _ => 3 * body.tips + i - 3,
            })
            .collect();
        let unloaded = &body.supports * &known;
        let step = Step {
            unloaded: DVector::from_fn(active.len(), |i, _| unloaded[active[i]]),
            compliance: DMatrix::from_fn(active.len(), active.len(), |i, j| {
                body.supports[(active[i], active[j])] / alpha
            }),
            contact: contact.copied(),
            slip: self.slip.of(contact),
            setup: &self.setup,
        };
        let start = DVector::from_fn(active.len(), |i, _| self.last[active[i]]);
        let force = step.solve(start, time_s)?;
        let moved = step.moved(&force);
        self.slip = step.slipped(&moved, &force);
        self.last.fill(0.0);
        let mut y = known;
        for (i, &column) in active.iter().enumerate() {
            self.last[column] = force[i];
            y[column] += force[i] / alpha;
        }
        self.past.advance(y.as_slice());
        let springs = if contact.is_some() { 3 } else { 0 };
        for (hold, w) in self.setup.holds.iter_mut().zip(moved.as_slice()[springs..].chunks_exact(3)) {
            hold.advance(Vec3::from_column_slice(w));
        }
        self.instants += 1;
        Ok((contact.map_or(Vec3::zeros(), |_| Vec3::new(force[0], force[1], force[2])), y))
    }
}

/// How far a tip has slid over the surface since it came into contact (m).
#[derive(Clone, Copy)]
struct Slip {
    tip: usize,
    by: Vec3,
}

impl Slip {
    /// Zero for a tip that was not in contact.
    fn of(&self, contact: Option<&Contact>) -> Vec3 {
        contact.filter(|c| c.tip == self.tip).map_or(Vec3::zeros(), |_| self.by)
    }
}

/// One step of time: w = unloaded + compliance λ, and the laws.
struct Step<'a> {
    unloaded: DVector<f64>,
    compliance: DMatrix<f64>,
    contact: Option<Contact>,
    slip: Vec3,
    setup: &'a Setup,
}

impl Step<'_> {
    fn moved(&self, force: &DVector<f64>) -> DVector<f64> {
        &self.unloaded + &self.compliance * force
    }

    /// The slip at the end of the step.
    fn slipped(&self, moved: &DVector<f64>, force: &DVector<f64>) -> Slip {
        let Some(contact) = self.contact.filter(|_| self.setup.friction.is_some()) else {
            return Slip { tip: usize::MAX, by: Vec3::zeros() };
        };
        let apart = self.reach(&contact, three(force, 0)) - three(moved, 0);
        Slip { tip: contact.tip, by: apart - contact.inward * apart.dot(&contact.inward) }
    }

    /// Where the tip is with this force on it.
    fn reach(&self, contact: &Contact, force: Vec3) -> Vec3 {
        contact.target - contact.direction * (self.setup.stage_compliance * contact.direction.dot(&force))
    }

    /// What the laws leave, as forces, and its derivative with respect to the forces.
    fn imbalance(&self, force: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let n = force.len();
        let moved = self.moved(force);
        let mut rest = DVector::zeros(n);
        let mut slope = DMatrix::zeros(n, n);
        let springs = if let Some(contact) = &self.contact {
            let (r, own, by_motion) = self.tip(contact, three(force, 0), three(&moved, 0));
            rest.rows_mut(0, 3).copy_from(&r);
            slope.rows_mut(0, 3).copy_from(&(by_motion * self.compliance.rows(0, 3)));
            let mut corner = slope.view_mut((0, 0), (3, 3));
            corner += own;
            3
        } else {
            0
        };
        for (h, hold) in self.setup.holds.iter().enumerate() {
            let at = springs + 3 * h;
            let (pull, tangent) = hold.pull(three(&moved, at));
            rest.rows_mut(at, 3).copy_from(&(three(force, at) - pull));
            slope.rows_mut(at, 3).copy_from(&(-tangent * self.compliance.rows(at, 3)));
            for c in at..at + 3 {
                slope[(c, c)] += 1.0;
            }
        }
        (rest, slope)
    }

    /// What the tip's law leaves (N), its derivative with respect to its own force at rest and to its motion.
    fn tip(&self, contact: &Contact, force: Vec3, moved: Vec3) -> (Vec3, Mat3, Mat3) {
        let own = self.compliance.fixed_view::<3, 3>(0, 0).trace() / 3.0 + self.setup.stage_compliance;
        let stiffness = 1.0 / own;
        let d = contact.direction;
        let give = d * d.transpose() * self.setup.stage_compliance;
        let Some(friction) = self.setup.friction else {
            let ahead = moved - self.reach(contact, force);
            return (stiffness * ahead, stiffness * give, stiffness * Mat3::identity());
        };
        let n = contact.inward;
        // a, and its derivatives with respect to force and motion.
        let trial = force + stiffness * (self.reach(contact, force) - self.slip - moved);
        let (by_force, by_motion) = (Mat3::identity() - stiffness * give, -stiffness * Mat3::identity());
        let pressure = trial.dot(&n);
        if pressure <= 0.0 {
            return (force, Mat3::identity(), Mat3::zeros());
        }
        let across = Mat3::identity() - n * n.transpose();
        let tangential = across * trial;
        let (size, limit) = (tangential.norm(), friction * pressure);
        let (kept, projection) = if size <= limit {
            (tangential, across)
        } else {
            let along = tangential / size;
            let turn = across - along * along.transpose();
            (limit * along, limit / size * turn + friction * along * n.transpose())
        };
        let projection = projection + n * n.transpose();
        (force - n * pressure - kept, Mat3::identity() - projection * by_force, -projection * by_motion)
    }

    /// The forces that obey all laws.
    fn solve(&self, mut force: DVector<f64>, time_s: f64) -> Result<DVector<f64>, SimError> {
        if force.is_empty() {
            return Ok(force);
        }
        let (mut rest, mut slope) = self.imbalance(&force);
        for iteration in 0..ITERATIONS {
            let Some(step) = slope.lu().solve(&rest) else {
                return Err(SimError::SingularSupports { supports: force.len() / 3 });
            };
            let share = if iteration < PATIENCE { 1.0 } else { 0.5 };
            force -= share * step;
            (rest, slope) = self.imbalance(&force);
            if rest.amax() <= TOLERANCE * (1.0 + force.amax()) {
                return Ok(force);
            }
        }
        Err(SimError::HoldsDisagree { time_s, residual_n: rest.amax(), iterations: ITERATIONS })
    }
}

/// Three components from `at` on.
fn three(all: &DVector<f64>, at: usize) -> Vec3 {
    Vec3::new(all[at], all[at + 1], all[at + 2])
}

#[cfg(test)]
mod tests;
