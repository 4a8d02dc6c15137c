//! The recording in time: what the stage reports → force of the tip and everything that the markers' motion follows from.
//!
//! The condensed body in units of a modulus: forces `q` of the tip and `f` of the restraint discs make
//! `v = C (q, f)`, and `v = 𝓔[u]` with the hereditary modulus `𝓔`, the same everywhere because Poisson's ratio does
//! not relax. At each row `𝓔[u] = e u + h`, `h` known from the past ([`Memory`]), and discs pull with
//! `f = −K u + p`, likewise. What is left is one linear system for `q` and the discs' displacements; which bands
//! pull, and which drag or slide ([`Sliders`]), is found by turns; what a tip that rubs lets go is taken off (`slip`).

use super::body::Body;
use super::contact::{Compliance, Contact, Law, Spot, Tip, UnderTip};
use super::dual::{Dual, DualSolver, MOST, columns, resized};
use super::effects::Effects;
use super::extra::Depth;
use super::memory::Memory;
use super::sticky::Sliders;
use super::tip_path::Play;
use super::track::Timeline;
use nalgebra::{DMatrix, DVector};

/// Restraint discs that share a law.
#[derive(Debug, Clone)]
pub(super) struct Group<const N: usize = MOST> {
    /// Its discs: a range of the body's discs.
    pub discs: std::ops::Range<usize>,
    /// Stiffness of one disc (N/m).
    pub stiffness: Dual<N>,
}

/// The march; one entry a row of the force sensor.
#[derive(Debug, Clone)]
pub(super) struct March {
    /// Force of the tip on the phantom (N).
    pub force: Vec<[Dual; 3]>,
    /// `𝓔⁻¹` of the forces of the tip at every site and of the discs, three components each: times the markers' compliance it
    /// is their displacement. Values, then derivatives; empty where nothing is loaded.
    pub loads: Vec<DMatrix<f64>>,
    /// How deep the tip is.
    pub depth: Vec<Depth>,
}

/// Most parameters of most marches, and of those with little restraint.
const SOME: usize = 12;
const FEW: usize = 6;

/// Rounds of finding which bands pull and which drag, at one row.
const ROUNDS: usize = 8;

/// Steps are multiples of a nanosecond.
const STEPS_PER_S: f64 = 1e9;

/// Time (s) before the first row at which everything was at rest.
const FIRST_STEP_S: f64 = 0.02;

/// What is marched through, and what acts.
pub(super) struct Marching<'a> {
    /// All rows of the recording.
    pub timeline: &'a Timeline,
    /// The body.
    pub body: &'a Body,
    /// Its modulus (Pa).
    pub modulus: Dual,
    /// Its restraint.
    pub groups: &'a [Group],
    /// Everything else.
    pub effects: &'a Effects,
    /// So many parameters are differentiated by, the first ones; nothing may depend on any beyond.
    pub fitted: usize,
}

impl Marching<'_> {
    /// From rest; between pokes nothing holds the surface. `None` when a row's system is singular.
    pub(super) fn march(&self) -> Option<March> {
        // Most of what it costs is to carry derivatives along.
        match self.fitted {
            0..=FEW => self.carrying::<FEW>(),
            _ if self.fitted <= SOME => self.carrying::<SOME>(),
            _ => self.carrying::<MOST>(),
        }
    }

    fn carrying<const N: usize>(&self) -> Option<March> {
        let Self { timeline, body, .. } = *self;
        let (modulus, effects) = (resized(&self.modulus), &self.effects.resized::<N>());
        let stiffness = |group: &Group| resized(&group.stiffness);
        let groups =
            self.groups.iter().map(|group| Group { discs: group.discs.clone(), stiffness: stiffness(group) });
        let groups: &[Group<N>] = &groups.collect::<Vec<_>>();
        let (tips, discs) = (3 * body.sites, body.discs_discs.value.nrows());
        let compliance =
            Compliance { a: body.tips_tips.dual(), b: body.discs_tips.dual(), d: body.discs_discs.dual() };
        let mut surface = Memory::new(modulus, &effects.relaxation, tips + discs);
        let mut loaded = Memory::new(modulus, &effects.relaxation, tips + discs);
        let mut bands: Vec<Memory<N>> = groups
            .iter()
            .zip(&effects.bands)
            .map(|(group, band)| Memory::new(group.stiffness, &band.memory, 3 * group.discs.len()))
            .collect();
        let mut sliders: Vec<Sliders<N>> = groups
            .iter()
            .zip(&effects.bands)
            .map(|(group, band)| {
                Sliders::new(band.sticky.filter(|_| band.slack.is_none()), group.stiffness, group.discs.len())
            })
            .collect();
        let mut kept: Option<(Key, DualSolver, Vec<DVector<Dual<N>>>)> = None;
        let mut under_tip: Vec<UnderTip<N>> = Vec::new();
        let mut state = Contact { at: None, pulling: vec![true; groups.len()] };
        let mut slid = [Dual::from(0.0); 3];
        let mut play = Play::default();
        let mut out = March { force: Vec::new(), loads: Vec::new(), depth: Vec::new() };
        let none = Depth { now: Dual::from(0.0), deepest: Dual::from(0.0) };
        let before_m = |site: usize| timeline.deepest_m.get(site).copied().unwrap_or(0.0);
        let mut deepest: Vec<Dual<N>> = (0..body.sites).map(|site| Dual::from(before_m(site))).collect();
        let mut before_s = timeline.rows.first().map_or(0.0, |row| row.time_s) - FIRST_STEP_S;
        // Without a clock in any law a row's answer is in proportion to the path of the tip.
        let ages = effects.drying_per_s.re != 0.0 || effects.drying_per_s.eps.0.is_some();
        let remembers = effects.remember();
        for row in &timeline.rows {
            if row.contact.is_none() && !remembers {
                // Nothing moves and nothing is remembered.
                out.force.push([Dual::from(0.0); 3]);
                out.loads.push(DMatrix::zeros(0, 1 + self.fitted));
                out.depth.push(none);
                continue;
            }
            // Equal steps differ in their last place, and what a row's matrix depends on would with them.
            let dt = ((row.time_s - before_s) * STEPS_PER_S).round().max(1.0) / STEPS_PER_S;
            before_s = row.time_s;
            let age = effects.drying_per_s * row.time_s + 1.0;
            let (e, past) = surface.step(dt, age);
            let own: Vec<(Dual<N>, DVector<Dual<N>>)> =
                bands.iter_mut().map(|band| band.step(dt, Dual::from(1.0))).collect();
            let at = row.contact.as_ref().map(|touch| Spot { site: touch.site, direction: touch.direction });
            if state.at != at || row.first {
                slid = [Dual::from(0.0); 3];
                play = Play::default();
            }
            state = Contact { at, ..state };
            let tip = at
                .zip(row.contact.as_ref())
                .map(|(at, touch)| (Tip { at, inward: touch.inward, effects }, play.follow(touch, effects)));
            let mut solved: Option<Solved<N>> = None;
            for _ in 0..ROUNDS {
                let law = Law::new(discs, groups, &effects.bands, &own, &state.pulling, &sliders);
                let path = tip.as_ref().map(|(tip, path)| {
                    (tip, DVector::from_fn(3, |i, _| e * (path[i] - slid[i]) + past[3 * tip.at.site + i]))
                });
                let (mut x, by_path) = match path {
                    Some((tip, path)) if !remembers && !ages => {
                        let alike =
                            |known: &&UnderTip<N>| known.at == tip.at && known.pulling == state.pulling;
                        let known = match under_tip.iter().position(|known| alike(&known)) {
                            Some(known) => known,
                            None => {
                                under_tip.push(UnderTip::new(&compliance, &law, e, tip, &state.pulling)?);
                                under_tip.len() - 1
                            }
                        };
                        let known = &under_tip[known];
                        (known.answer(&path)?, &known.by_path)
                    }
                    path => {
                        let key = Key {
                            e: e.re,
                            age_s: ages.then_some(row.time_s),
                            own: own.iter().map(|(k, _)| k.re).collect(),
                            state: state.clone(),
                            sliders: sliders.iter().flat_map(Sliders::state).collect(),
                        };
                        if kept.as_ref().is_none_or(|(known, ..)| *known != key) {
                            let matrix = compliance.matrix(&law, e, tip.as_ref().map(|(tip, _)| tip));
                            let solver = DualSolver::new(&matrix)?;
                            let paths = tip.as_ref().map_or_else(Vec::new, |(tip, _)| tip.paths(e));
                            let alone = |path: DVector<Dual<N>>| {
                                solver.solve(&path.resize_vertically(3 + discs, Dual::from(0.0)))
                            };
                            let by_path = paths.into_iter().map(alone).collect::<Option<_>>()?;
                            kept = Some((key, solver, by_path));
                        }
                        let past = past.rows(tips, discs).into_owned();
                        let (_, solver, by_path) = kept.as_ref()?;
                        (solver.solve(&compliance.right(&law, &past, path))?, by_path)
                    }
                };
                let gone = match &tip {
                    Some((tip, _)) => tip.rub(&mut x, by_path)?,
                    None => [Dual::from(0.0); 3],
                };
                let u = x.rows(x.len() - discs, discs).into_owned();
                let next = Contact { at: state.at, pulling: still_pulling(groups, effects, &own, &u) };
                let q = tip.as_ref().map_or([Dual::from(0.0); 3], |_| [x[0], x[1], x[2]]);
                solved = Some(Solved { f: law.forces(&u), q, u, gone, pulling: state.pulling.clone() });
                let of = |group: &Group<N>| 3 * group.discs.start..3 * group.discs.end;
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
            let Solved { q, f, u, gone, pulling } = solved?;
            // How the surface moved under the tips follows from the forces: under all of them where it is remembered.
            let mut moved = DVector::from_element(tips + discs, Dual::from(0.0));
            let under = if remembers { tips } else { 0 };
            for i in 0..under {
                let by_discs: Dual<N> = (0..discs).map(|j| compliance.b[(j, i)] * f[j]).sum();
                let by_tip: Dual<N> = at.map_or(Dual::from(0.0), |Spot { site, .. }| {
                    (0..3).map(|j| compliance.a[(i, 3 * site + j)] * q[j]).sum()
                });
                moved[i] = (by_tip + by_discs - past[i]) / e;
            }
            moved.rows_mut(tips, discs).copy_from(&u);
            if let Some((tip, _)) = &tip {
                // What it let go of along the surface it does not get back; into it, it may press again.
                let into: Dual<N> = (0..3).map(|i| gone[i] * tip.inward[i]).sum();
                slid = std::array::from_fn(|i| slid[i] + gone[i] - into * tip.inward[i]);
            }
            let (loads_e, loads_h) = loaded.step(dt, age);
            let per_modulus = Dual::from(1.0) / loads_e;
            let load = DVector::from_fn(tips + discs, |i, _| {
                let applied = match (i.checked_sub(tips), at) {
                    (Some(disc), _) => f[disc],
                    (None, Some(Spot { site, .. })) if i / 3 == site => q[i % 3],
                    _ if !remembers => return Dual::from(0.0),
                    _ => Dual::from(0.0),
                };
                (applied - loads_h[i]) * per_modulus
            });
            surface.advance(moved);
            loaded.advance(load.clone());
            let past =
                groups.iter().zip(&mut bands).zip(&mut sliders).zip(&effects.bands).zip(&own).zip(&pulling);
            for (((((group, band), sliders), law), own), pulling) in past {
                let u = &u.as_slice()[3 * group.discs.start..3 * group.discs.end];
                sliders.advance(u);
                band.advance(match &law.slack {
                    Some(slack) => slack.stretched(u, own, *pulling),
                    None => DVector::from_column_slice(u),
                });
            }
            out.depth.push(match &tip {
                Some((tip, path)) => {
                    let give = tip.stage_give(&q);
                    let now: Dual<N> = (0..3).map(|i| (path[i] - give[i]) * tip.at.direction[i]).sum();
                    let most = &mut deepest[tip.at.site];
                    if now > *most {
                        *most = now;
                    }
                    Depth { now: resized(&now), deepest: resized(most) }
                }
                None => none,
            });
            out.force.push([0, 1, 2].map(|i| resized(&q[i])));
            out.loads.push(columns(&load, self.fitted));
        }
        Some(out)
    }
}

/// One row, solved.
struct Solved<const N: usize> {
    q: [Dual<N>; 3],
    f: DVector<Dual<N>>,
    u: DVector<Dual<N>>,
    /// What the tip let go of its path.
    gone: [Dual<N>; 3],
    /// Which bands pulled.
    pulling: Vec<bool>,
}

/// What a row's matrix depends on.
#[derive(Debug, Clone, PartialEq)]
struct Key {
    e: f64,
    /// Time, where the modulus changes with it: it may do so in its derivative alone.
    age_s: Option<f64>,
    own: Vec<f64>,
    state: Contact,
    sliders: Vec<Option<[f64; 4]>>,
}

/// Which bands pull: those that are not slack do.
fn still_pulling<const N: usize>(
    groups: &[Group<N>],
    effects: &Effects<N>,
    own: &[(Dual<N>, DVector<Dual<N>>)],
    u: &DVector<Dual<N>>,
) -> Vec<bool> {
    let of = |group: &Group<N>| &u.as_slice()[3 * group.discs.start..3 * group.discs.end];
    let bands = groups.iter().zip(&effects.bands).zip(own);
    bands.map(|((group, band), own)| band.slack.is_none_or(|slack| slack.pulls(of(group), own))).collect()
}

#[cfg(test)]
mod tests;
