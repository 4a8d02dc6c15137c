//! The recording in time: what the stage reports → force of the tip and everything that the markers' motion follows from.
//!
//! The condensed body in units of a modulus: forces `q` of the tip and `f` of the restraint discs make
//! `v = C (q, f)`, and `v = 𝓔[u]` with the hereditary modulus `𝓔`, the same everywhere because Poisson's ratio does
//! not relax. At each row `𝓔[u] = e u + h`, `h` known from the past ([`Memory`]), and discs pull with
//! `f = −K u + p`, likewise. What is left is one linear system for `q` and the discs' displacements; which bands
//! pull, which drag or slide ([`Sliders`]) and whether the tip slides is found by turns.

use super::body::Body;
use super::dual::{Dual, DualSolver};
use super::effects::{Band, Effects};
use super::extra::Depth;
use super::memory::Memory;
use super::sticky::Sliders;
use super::tip_path::Play;
use super::track::Timeline;
use crate::geometry::{Vec3, basis_from_axis};
use nalgebra::{DMatrix, DVector};

/// Restraint discs that share a law.
#[derive(Debug, Clone)]
pub(super) struct Group {
    /// Its discs: a range of the body's discs.
    pub discs: std::ops::Range<usize>,
    /// Stiffness of one disc (N/m).
    pub stiffness: Dual,
}

/// The march; one entry a row of the force sensor.
#[derive(Debug, Clone)]
pub(super) struct March {
    /// Force of the tip on the phantom (N).
    pub force: Vec<[Dual; 3]>,
    /// `𝓔⁻¹` of the forces of the tip at every site and of the discs, three components each: times the markers' compliance it
    /// is their displacement.
    pub loads: Vec<DVector<Dual>>,
    /// How deep the tip is.
    pub depth: Vec<Depth>,
}

/// Rounds of finding which bands pull and whether the tip slides, at one row.
const ROUNDS: usize = 8;

/// Steps are multiples of a nanosecond.
const STEPS_PER_S: f64 = 1e9;

/// Time (s) before the first row at which everything was at rest.
const FIRST_STEP_S: f64 = 0.02;

/// Marches through all rows of the recording from rest; between pokes nothing holds the surface. `None` when a row's
/// system is singular.
pub(super) fn march(
    timeline: &Timeline,
    body: &Body,
    modulus: Dual,
    groups: &[Group],
    effects: &Effects,
) -> Option<March> {
    let (tips, discs) = (3 * body.sites, body.discs_discs.value.nrows());
    let compliance =
        Compliance { a: body.tips_tips.dual(), b: body.discs_tips.dual(), d: body.discs_discs.dual() };
    let mut surface = Memory::new(modulus, &effects.relaxation, tips + discs);
    let mut loaded = Memory::new(modulus, &effects.relaxation, tips + discs);
    let mut bands: Vec<Memory> = groups
        .iter()
        .zip(&effects.bands)
        .map(|(group, band)| Memory::new(group.stiffness, &band.memory, 3 * group.discs.len()))
        .collect();
    let mut sliders: Vec<Sliders> = groups
        .iter()
        .zip(&effects.bands)
        .map(|(group, band)| {
            Sliders::new(band.sticky.filter(|_| band.slack.is_none()), group.stiffness, group.discs.len())
        })
        .collect();
    let mut kept: Option<(Key, DualSolver)> = None;
    let mut under_tip: Vec<UnderTip> = Vec::new();
    let mut state = Contact { at: None, pulling: vec![true; groups.len()], sliding: None };
    let mut slid = [Dual::from(0.0); 3];
    let mut play = Play::default();
    let mut out = March { force: Vec::new(), loads: Vec::new(), depth: Vec::new() };
    let none = Depth { now: Dual::from(0.0), deepest: Dual::from(0.0) };
    let before_m = |site: usize| timeline.deepest_m.get(site).copied().unwrap_or(0.0);
    let mut deepest: Vec<Dual> = (0..body.sites).map(|site| Dual::from(before_m(site))).collect();
    let mut before_s = timeline.rows.first().map_or(0.0, |row| row.time_s) - FIRST_STEP_S;
    // Without a clock in any law a row's answer is in proportion to the path of the tip.
    let ages = effects.drying_per_s.re != 0.0 || effects.drying_per_s.eps.0.is_some();
    let remembers = effects.remember();
    for row in &timeline.rows {
        if row.contact.is_none() && !remembers {
            // Nothing moves and nothing is remembered.
            out.force.push([Dual::from(0.0); 3]);
            out.loads.push(DVector::from_element(0, Dual::from(0.0)));
            out.depth.push(none);
            continue;
        }
        // Equal steps differ in their last place, and what a row's matrix depends on would with them.
        let dt = ((row.time_s - before_s) * STEPS_PER_S).round().max(1.0) / STEPS_PER_S;
        before_s = row.time_s;
        let age = effects.drying_per_s * row.time_s + 1.0;
        let (e, past) = surface.step(dt, age);
        let own: Vec<(Dual, DVector<Dual>)> =
            bands.iter_mut().map(|band| band.step(dt, Dual::from(1.0))).collect();
        let at = row.contact.as_ref().map(|contact| contact.site);
        if state.at != at || row.first {
            slid = [Dual::from(0.0); 3];
            play = Play::default();
        }
        state = Contact { at, sliding: None, ..state };
        let tip = row.contact.as_ref().map(|contact| {
            let path = play.follow(contact, effects);
            (Tip { site: contact.site, direction: contact.direction, inward: contact.inward, effects }, path)
        });
        let mut solved: Option<Solved> = None;
        for _ in 0..ROUNDS {
            let law = Law::new(discs, groups, &effects.bands, &own, &state.pulling, &sliders);
            let path = tip.as_ref().map(|(tip, path)| {
                (tip, DVector::from_fn(3, |i, _| e * (path[i] + slid[i]) + past[3 * tip.site + i]))
            });
            let x = match &path {
                Some((tip, path)) if !remembers && !ages => {
                    let alike = |known: &&UnderTip| known.site == tip.site && known.pulling == state.pulling;
                    let known = match under_tip.iter().position(|known| alike(&known)) {
                        Some(known) => known,
                        None => {
                            under_tip.push(UnderTip::new(&compliance, &law, e, tip, &state.pulling)?);
                            under_tip.len() - 1
                        }
                    };
                    under_tip[known].answer(tip, path, state.sliding)?
                }
                _ => {
                    let key = Key {
                        e: e.re,
                        own: own.iter().map(|(k, _)| k.re).collect(),
                        state: state.clone(),
                        sliders: sliders.iter().flat_map(Sliders::state).collect(),
                    };
                    if kept.as_ref().is_none_or(|(known, _)| *known != key) {
                        let matrix =
                            compliance.matrix(&law, e, tip.as_ref().map(|(tip, _)| tip), state.sliding);
                        kept = Some((key, DualSolver::new(&matrix)?));
                    }
                    let past = past.rows(tips, discs).into_owned();
                    let (_, solver) = kept.as_ref()?;
                    solver.solve(&compliance.right(&law, &past, path.as_ref(), state.sliding))?
                }
            };
            let u = x.rows(x.len() - discs, discs).into_owned();
            let next = Contact {
                at: state.at,
                pulling: still_pulling(groups, effects, &u),
                sliding: tip.as_ref().and_then(|(tip, _)| tip.sliding(&x, state.sliding)),
            };
            let q = tip.as_ref().map_or([Dual::from(0.0); 3], |_| [x[0], x[1], x[2]]);
            solved = Some(Solved { f: law.forces(&u), q, u });
            let of = |group: &Group| 3 * group.discs.start..3 * group.discs.end;
            let u = &solved.as_ref()?.u;
            let mut news = next != state;
            for (group, sliders) in groups.iter().zip(&mut sliders) {
                news |= sliders.turn(&u.as_slice()[of(group)]);
            }
            if !news {
                break;
            }
            state = next;
        }
        let Solved { q, f, u } = solved?;
        // How the surface moved under the tips follows from the forces: under all of them where it is remembered.
        let mut moved = DVector::from_element(tips + discs, Dual::from(0.0));
        let under = match (at, state.sliding) {
            _ if remembers => 0..tips,
            (Some(site), Some(_)) => 3 * site..3 * site + 3,
            _ => 0..0,
        };
        for i in under {
            let by_discs: Dual = (0..discs).map(|j| compliance.b[(j, i)] * f[j]).sum();
            let by_tip: Dual = at
                .map_or(Dual::from(0.0), |site| (0..3).map(|j| compliance.a[(i, 3 * site + j)] * q[j]).sum());
            moved[i] = (by_tip + by_discs - past[i]) / e;
        }
        moved.rows_mut(tips, discs).copy_from(&u);
        if let (Some((tip, path)), Some(_)) = (&tip, state.sliding) {
            let give = tip.stage_give(&q);
            slid = std::array::from_fn(|i| moved[3 * tip.site + i] + give[i] - path[i]);
        }
        let (loads_e, loads_h) = loaded.step(dt, age);
        let per_modulus = Dual::from(1.0) / loads_e;
        let load = DVector::from_fn(tips + discs, |i, _| {
            let applied = match (i.checked_sub(tips), at) {
                (Some(disc), _) => f[disc],
                (None, Some(site)) if i / 3 == site => q[i % 3],
                _ if !remembers => return Dual::from(0.0),
                _ => Dual::from(0.0),
            };
            (applied - loads_h[i]) * per_modulus
        });
        surface.advance(moved);
        loaded.advance(load.clone());
        for ((group, band), sliders) in groups.iter().zip(&mut bands).zip(&mut sliders) {
            sliders.advance(&u.as_slice()[3 * group.discs.start..3 * group.discs.end]);
            band.advance(u.rows(3 * group.discs.start, 3 * group.discs.len()).into_owned());
        }
        out.depth.push(match &tip {
            Some((tip, path)) => {
                let give = tip.stage_give(&q);
                let now = (0..3).map(|i| (path[i] - give[i]) * tip.direction[i]).sum();
                let most = &mut deepest[tip.site];
                if now > *most {
                    *most = now;
                }
                Depth { now, deepest: *most }
            }
            None => none,
        });
        out.force.push(q);
        out.loads.push(load);
    }
    Some(out)
}

/// One row, solved.
struct Solved {
    q: [Dual; 3],
    f: DVector<Dual>,
    u: DVector<Dual>,
}

/// Where the tip touches, which bands pull, and where the tip slides to: the direction of its force in the surface.
#[derive(Debug, Clone, PartialEq)]
struct Contact {
    at: Option<usize>,
    pulling: Vec<bool>,
    sliding: Option<[f64; 2]>,
}

/// What a row's matrix depends on.
#[derive(Debug, Clone, PartialEq)]
struct Key {
    e: f64,
    own: Vec<f64>,
    state: Contact,
    sliders: Vec<Option<[f64; 4]>>,
}

/// The body with its restraint as a tip feels it where nothing is remembered: discs follow from the tip's force.
struct UnderTip {
    site: usize,
    pulling: Vec<bool>,
    /// The tip's path (in units of the modulus) by its force, solved where the tip does not slide; and what bands' gaps alone add to it.
    path: DMatrix<Dual>,
    held: DualSolver,
    less: DVector<Dual>,
    /// Displacements of the discs by the tip's force, and without.
    discs: DMatrix<Dual>,
    alone: DVector<Dual>,
}

impl UnderTip {
    /// `None` where the restraint alone has no answer.
    fn new(compliance: &Compliance, law: &Law, e: Dual, tip: &Tip<'_>, pulling: &[bool]) -> Option<Self> {
        let n = compliance.d.nrows();
        let still = DVector::from_element(n, Dual::from(0.0));
        let matrix = compliance.matrix(law, e, Some(tip), None);
        let right =
            compliance.right(law, &still, Some(&(tip, DVector::from_element(3, Dual::from(0.0)))), None);
        let solver = DualSolver::new(&matrix.view((3, 3), (n, n)).into_owned())?;
        let mut discs = DMatrix::from_element(n, 3, Dual::from(0.0));
        for i in 0..3 {
            discs.set_column(i, &-solver.solve(&matrix.view((3, i), (n, 1)).column(0).into_owned())?);
        }
        let alone = solver.solve(&right.rows(3, n).into_owned())?;
        let pulled = matrix.view((0, 3), (3, n));
        let path = matrix.view((0, 0), (3, 3)) + pulled * &discs;
        let less = right.rows(0, 3) - pulled * &alone;
        let held = DualSolver::new(&path)?;
        Some(Self { site: tip.site, pulling: pulling.to_vec(), path, held, less, discs, alone })
    }

    /// Force of the tip on a `path`, and displacements of the discs.
    fn answer(
        &self,
        tip: &Tip<'_>,
        path: &DVector<Dual>,
        sliding: Option<[f64; 2]>,
    ) -> Option<DVector<Dual>> {
        let mut right = path + &self.less;
        let q = match (sliding, tip.effects.friction) {
            (Some(to), Some(friction)) => {
                let mut matrix = self.path.clone();
                tip.slide(&mut matrix, to, friction);
                tip.slide_right(&mut right);
                DualSolver::new(&matrix)?.solve(&right)?
            }
            _ => self.held.solve(&right)?,
        };
        let u = &self.alone + &self.discs * &q;
        Some(DVector::from_iterator(3 + u.len(), q.iter().chain(u.iter()).copied()))
    }
}

/// `f = −K u + p` on the discs at one row; `K` has one block a disc.
struct Law {
    k: Vec<[[Dual; 3]; 3]>,
    p: DVector<Dual>,
}

impl Law {
    fn new(
        discs: usize,
        groups: &[Group],
        bands: &[Band],
        own: &[(Dual, DVector<Dual>)],
        pulling: &[bool],
        sliders: &[Sliders],
    ) -> Self {
        let mut k = vec![[[Dual::from(0.0); 3]; 3]; discs / 3];
        let mut p = DVector::from_element(discs, Dual::from(0.0));
        let laws = groups.iter().zip(bands).zip(own).zip(pulling).zip(sliders);
        for ((((group, band), (stiffness, past)), pulling), sliders) in laws {
            for (n, disc) in group.discs.clone().enumerate() {
                match &band.slack {
                    None => {
                        let (drags, dragged) = sliders.pull(n);
                        k[disc] = drags;
                        for i in 0..3 {
                            k[disc][i][i] += *stiffness;
                            p[3 * disc + i] = dragged[i] - past[3 * n + i];
                        }
                    }
                    Some(slack) if *pulling => {
                        for i in 0..3 {
                            k[disc][i] = slack.direction.map(|d| *stiffness * (slack.direction[i] * d));
                            p[3 * disc + i] = *stiffness * slack.gap_m * slack.direction[i];
                        }
                    }
                    Some(_) => {}
                }
            }
        }
        Self { k, p }
    }

    /// `M K` for any matrix with one column a component.
    fn after(&self, m: &DMatrix<Dual>) -> DMatrix<Dual> {
        DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| {
            let (disc, axis) = (j / 3, j % 3);
            (0..3)
                // One that is zero here may not stay so: a slider that turns.
                .filter(|&l| self.k[disc][l][axis].re != 0.0 || self.k[disc][l][axis].eps.0.is_some())
                .map(|l| m[(i, 3 * disc + l)] * self.k[disc][l][axis])
                .sum()
        })
    }

    /// Forces at these displacements.
    fn forces(&self, u: &DVector<Dual>) -> DVector<Dual> {
        DVector::from_fn(self.p.len(), |i, _| {
            let (disc, axis) = (i / 3, i % 3);
            (0..3).fold(self.p[i], |f, j| f - self.k[disc][axis][j] * u[3 * disc + j])
        })
    }
}

/// The condensed body.
struct Compliance {
    a: DMatrix<Dual>,
    b: DMatrix<Dual>,
    d: DMatrix<Dual>,
}

impl Compliance {
    /// The system of one row: unknowns are the force of the tip, if it touches, and the discs' displacements.
    fn matrix(&self, law: &Law, e: Dual, tip: Option<&Tip<'_>>, sliding: Option<[f64; 2]>) -> DMatrix<Dual> {
        let (n, first) = (self.d.nrows(), if tip.is_some() { 3 } else { 0 });
        let mut m = DMatrix::from_element(first + n, first + n, Dual::from(0.0));
        m.view_mut((first, first), (n, n)).copy_from(&law.after(&self.d));
        for i in first..first + n {
            m[(i, i)] += e;
        }
        let Some(tip) = tip else { return m };
        let s = 3 * tip.site;
        let pull = law.after(&self.b.columns(s, 3).transpose());
        for i in 0..3 {
            for j in 0..3 {
                let give = tip.effects.stage_m_per_n * (tip.direction[i] * tip.direction[j]);
                m[(i, j)] = self.a[(s + i, s + j)] + e * give;
            }
            for j in 0..n {
                m[(3 + j, i)] = -self.b[(j, s + i)];
                m[(i, 3 + j)] = -pull[(i, j)];
            }
        }
        if let (Some(to), Some(friction)) = (sliding, tip.effects.friction) {
            tip.slide(&mut m, to, friction);
        }
        m
    }

    /// Its right-hand side: `past` under the discs, and the path of the tip in units of the modulus.
    fn right(
        &self,
        law: &Law,
        past: &DVector<Dual>,
        path: Option<&(&Tip<'_>, DVector<Dual>)>,
        sliding: Option<[f64; 2]>,
    ) -> DVector<Dual> {
        let under = if law.p.iter().all(|p| p.re == 0.0) { -past } else { &self.d * &law.p - past };
        let Some((tip, path)) = path else { return under };
        let pulls = law.p.iter().any(|p| p.re != 0.0);
        let mut tip_rows = path.clone();
        if pulls {
            tip_rows -= self.b.columns(3 * tip.site, 3).transpose() * &law.p;
        }
        if sliding.is_some() {
            tip.slide_right(&mut tip_rows);
        }
        let mut right = DVector::from_element(3 + under.len(), Dual::from(0.0));
        right.rows_mut(0, 3).copy_from(&tip_rows);
        right.rows_mut(3, under.len()).copy_from(&under);
        right
    }
}

/// The tip while it touches.
struct Tip<'a> {
    site: usize,
    direction: Vec3,
    inward: Vec3,
    effects: &'a Effects,
}

impl Tip<'_> {
    /// Two axes in the surface.
    fn across(&self) -> [Vec3; 2] {
        let basis = basis_from_axis(&self.inward);
        [basis.column(0).into_owned(), basis.column(1).into_owned()]
    }

    /// Of a sliding tip's three equations the one into the surface stays; along the surface the force is the friction's
    /// share of that into it.
    fn slide(&self, m: &mut DMatrix<Dual>, to: [f64; 2], friction: Dual) {
        for j in 0..m.ncols() {
            let into: Dual = (0..3).map(|i| m[(i, j)] * self.inward[i]).sum();
            m[(0, j)] = into;
            m[(1, j)] = Dual::from(0.0);
            m[(2, j)] = Dual::from(0.0);
        }
        for (row, (axis, share)) in self.across().iter().zip(to).enumerate() {
            for i in 0..3 {
                m[(1 + row, i)] = -friction * (share * self.inward[i]) + axis[i];
            }
        }
    }

    /// The same of the right-hand side.
    fn slide_right(&self, right: &mut DVector<Dual>) {
        let into: Dual = (0..3).map(|i| right[i] * self.inward[i]).sum();
        *right = DVector::from_vec(vec![into, Dual::from(0.0), Dual::from(0.0)]);
    }

    /// Where the tip slides to: nowhere while its force is within the cone of friction about the surface's normal.
    fn sliding(&self, x: &DVector<Dual>, before: Option<[f64; 2]>) -> Option<[f64; 2]> {
        let friction = self.effects.friction?.re;
        if before.is_some() {
            return before;
        }
        let force = Vec3::new(x[0].re, x[1].re, x[2].re);
        let pressed = force.dot(&self.inward);
        let aside = self.across().map(|axis| force.dot(&axis));
        let size = aside[0].hypot(aside[1]);
        (pressed > 0.0 && size > friction * pressed).then(|| aside.map(|s| s / size))
    }

    /// What the frame gives (m).
    fn stage_give(&self, q: &[Dual; 3]) -> [Dual; 3] {
        let along: Dual = (0..3).map(|i| q[i] * self.direction[i]).sum();
        std::array::from_fn(|i| self.effects.stage_m_per_n * along * self.direction[i])
    }
}

/// A slack band pulls while the mean of its discs is beyond the gap.
fn still_pulling(groups: &[Group], effects: &Effects, u: &DVector<Dual>) -> Vec<bool> {
    groups
        .iter()
        .zip(&effects.bands)
        .map(|(group, band)| {
            let Some(slack) = &band.slack else { return true };
            let along =
                |disc: usize| -> f64 { (0..3).map(|i| u[3 * disc + i].re * slack.direction[i]).sum() };
            let mean = group.discs.clone().map(along).sum::<f64>() / group.discs.len() as f64;
            mean > slack.gap_m.re
        })
        .collect()
}
