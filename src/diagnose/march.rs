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
mod tests {
    use super::super::dual::{Field, gradient, variable};
    use super::super::effects::{Slack, Term};
    use super::super::sticky::Sticky;
    use super::super::track::{Row, Touch};
    use super::*;
    use crate::geometry::Vec3;
    use nalgebra::DMatrix;

    /// One site, one disc, a compliance of 4 under each and of 1 between them, along every axis alike.
    fn body() -> Body {
        let field = |size: f64| Field { value: DMatrix::from_diagonal_element(3, 3, size), by: Vec::new() };
        let markers = Field { value: DMatrix::zeros(0, 6), by: Vec::new() };
        Body { sites: 1, tips_tips: field(4.0), discs_tips: field(1.0), discs_discs: field(4.0), markers }
    }

    /// So deep (mm) every 0.1 s.
    fn poke_to(direction: Vec3, from_s: f64, depths_mm: &[f64]) -> impl Iterator<Item = Row> + Clone {
        depths_mm.iter().enumerate().map(move |(i, depth)| {
            let touch =
                Touch { site: 0, direction, inward: -Vec3::z(), reported_m: direction * (1e-3 * depth) };
            Row { time_s: from_s + 0.1 * i as f64, contact: Some(touch), first: i == 0 }
        })
    }

    fn poke(direction: Vec3, from_s: f64) -> impl Iterator<Item = Row> + Clone {
        poke_to(direction, from_s, &[0.0, 1.0, 2.0])
    }

    /// The disc is held by a band of this stiffness (N/m).
    fn march(
        rows: impl Iterator<Item = Row>,
        body: &Body,
        stiffness: Dual,
        effects: &Effects,
        fitted: usize,
    ) -> March {
        let timeline = &Timeline { rows: rows.collect(), deepest_m: Vec::new() };
        let (groups, modulus) = (&[Group { discs: 0..1, stiffness }], Dual::from(1e4));
        Marching { timeline, body, modulus, groups, effects, fitted }.march().expect("a march")
    }

    /// With a band of 2 kN/m.
    fn marched(rows: impl Iterator<Item = Row>, effects: &Effects) -> March {
        march(rows, &body(), Dual::from(2e3), effects, 1)
    }

    /// Force of the tip at every row, with its derivative by the first parameter.
    fn forces(rows: impl Iterator<Item = Row>, effects: &Effects) -> Vec<[(f64, f64); 3]> {
        marched(rows, effects).force.iter().map(|q| q.map(|q| (q.re, gradient(&q, 1)[0]))).collect()
    }

    /// A frame that gives does so along the poke: the same site pressed straight in and then aslant, which no memory tells apart, feels
    /// both times what it feels when that poke is the only one. With a drying that is nothing but in its derivative, which makes every row
    /// differ, too.
    #[test]
    fn a_site_that_is_pressed_along_two_directions_gives_along_each() {
        let (straight, aslant) = (poke(-Vec3::z(), 0.1), poke(Vec3::new(0.6, 0.0, -0.8), 0.4));
        for drying in [Dual::from(0.0), variable(0.0, 0)] {
            let effects =
                Effects { stage_m_per_n: Dual::from(5e-4), drying_per_s: drying, ..Effects::neutral(1) };
            let both = forces(straight.clone().chain(aslant.clone()), &effects);
            assert_eq!(both[..3], forces(straight.clone(), &effects));
            assert_eq!(both[3..], forces(aslant.clone(), &effects));
            // Without the band, by hand: the compliance of the body, 4/E, and that of the frame along the poke.
            let unheld = 2e-3 / (4e-4 + 5e-4);
            assert!((both[2][2].0 + unheld).abs() < 0.02 * unheld, "{both:?}");
        }
    }

    /// While it is pulled along its direction a band that could go slack relaxes as one that cannot. Let back after a hold it goes slack where that one
    /// pushes, and pulls again less than at first.
    #[test]
    fn a_band_that_pulls_relaxes_and_never_pushes() {
        let depths_mm = [0.0, 2.0, 2.0, 2.0, 2.0, 0.4, 0.2, 0.4, 2.0];
        let pulls = |slack: Option<Slack>| -> Vec<f64> {
            let mut effects = Effects::neutral(1);
            effects.bands[0].slack = slack;
            let term = Term { relaxed_fraction: Dual::from(0.6), time_constant_s: Dual::from(0.1) };
            effects.bands[0].memory.push(term);
            let marched = marched(poke_to(-Vec3::z(), 0.1, &depths_mm), &effects);
            marched.loads.iter().map(|load| load[(5, 0)]).collect()
        };
        let taut = Slack { gap_m: Dual::from(0.0), direction: [0.0, 0.0, -1.0] };
        let (held, pulled) = (pulls(None), pulls(Some(taut)));
        for row in 1..5 {
            assert!((held[row] - pulled[row]).abs() < 1e-12 * held[1], "{row}: {held:?} {pulled:?}");
        }
        assert!(held[4] < 0.8 * held[1] && held[5] < 0.0, "{held:?}");
        assert!(pulled.iter().all(|pull| *pull >= 0.0) && pulled[5] == 0.0, "{pulled:?}");
        assert!(pulled[8] > 0.0 && pulled[8] < held[1], "{pulled:?}");
    }

    /// A dry tip, pressed aslant until it slides, held, drawn back and pressed again: it never pulls, what it does along the surface is at most
    /// friction's share, and where it presses the surface goes into the body as far as it does. A body that gives sideways when it is pressed;
    /// with a memory, too, that leaves a dent out of which the tip comes early.
    #[test]
    fn a_dry_tip_never_pulls() {
        let depths_mm = [0.0, 0.5, 1.0, 1.5, 2.0, 2.0, 2.0, 2.0, 1.5, 1.0, 0.5, 0.2, 0.1, 0.0, 1.0, 2.0];
        let aslant = Vec3::new(0.8, 0.0, -0.6);
        let mut body = body();
        (body.tips_tips.value[(0, 2)], body.tips_tips.value[(2, 0)]) = (2.0, 2.0);
        let with = |friction: Option<f64>, relaxed: Option<f64>| {
            let mut effects = Effects::neutral(1);
            effects.friction = friction.map(Dual::from);
            let term = |share| Term { relaxed_fraction: Dual::from(share), time_constant_s: Dual::from(0.1) };
            effects.relaxation.extend(relaxed.map(term));
            let marched = march(poke_to(aslant, 0.1, &depths_mm), &body, Dual::from(2e3), &effects, 0);
            // The band is pulled by what the tip still does: u = (q + 4 f)/E and f = −k u.
            for load in marched.loads.iter().filter(|_| relaxed.is_none()) {
                for i in 0..3 {
                    assert!((load[3 + i] + 0.2 / 1.8 * load[i]).abs() < 1e-16, "{load}");
                }
            }
            for ((force, load), depth_mm) in marched.force.iter().zip(&marched.loads).zip(depths_mm) {
                let into = 4.0 * load[2] + 2.0 * load[0] + load[5];
                assert!(force[2].re > -1e-9 || (into + 0.6e-3 * depth_mm).abs() < 1e-14, "{into} {depth_mm}");
            }
            marched.force.iter().map(|q| (q[0].re, -q[2].re)).collect::<Vec<(f64, f64)>>()
        };
        let (plain, remembered, lasting) =
            (with(Some(0.5), None), with(Some(0.5), Some(0.0)), with(Some(0.5), Some(0.6)));
        for dry in [&plain, &remembered, &lasting] {
            let kept =
                |(aside, pressed): &(f64, f64)| *pressed > -1e-12 && aside.abs() <= 0.5 * pressed + 1e-12;
            assert!(dry.iter().all(kept), "{dry:?}");
            assert!((dry[4].0 - 0.5 * dry[4].1).abs() < 1e-9, "it slides: {dry:?}");
            assert!(dry[9].0 < -0.1, "it is pushed back: {dry:?}");
        }
        // A memory that forgets nothing is none.
        let apart = |a: &(f64, f64), b: &(f64, f64)| (a.0 - b.0).abs().max((a.1 - b.1).abs());
        assert!(plain.iter().zip(&remembered).all(|(a, b)| apart(a, b) < 1e-12), "{plain:?} {remembered:?}");
        let off = |dry: &[(f64, f64)]| dry[1..13].iter().filter(|q| q.0.abs().max(q.1.abs()) < 1e-12).count();
        assert_eq!(off(&plain), 0, "{plain:?}");
        assert!(off(&lasting) > 1, "{lasting:?}");
        // A bonded one does pull.
        assert!(with(None, Some(0.6)).iter().any(|(_, pressed)| *pressed < -1e-3));
    }

    /// What was let go of is remembered with its derivatives, on the way in and back.
    #[test]
    fn friction_has_the_derivative_of_its_differences() {
        let depths_mm = [0.0, 0.5, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5];
        let aslant = Vec3::new(0.7, 0.3, -0.6);
        for relaxed in [None, Some(0.4)] {
            let with = |friction: Dual| {
                let mut effects = Effects::neutral(1);
                effects.friction = Some(friction);
                let term =
                    |share| Term { relaxed_fraction: Dual::from(share), time_constant_s: Dual::from(0.5) };
                effects.relaxation.extend(relaxed.map(term));
                forces(poke_to(aslant, 0.1, &depths_mm), &effects)
            };
            let here = with(variable(0.5, 0));
            let (more, less) = (with(Dual::from(0.5 + 1e-6)), with(Dual::from(0.5 - 1e-6)));
            for ((here, more), less) in here.iter().zip(&more).zip(&less) {
                for i in 0..3 {
                    let slope = (more[i].0 - less[i].0) / 2e-6;
                    assert!((here[i].1 - slope).abs() < 1e-6 + 1e-6 * slope.abs(), "{here:?} {slope}");
                }
            }
            assert!(here[7][0].1.abs() > 0.1, "{here:?}");
        }
    }

    /// However many derivatives are carried along, those that there are and the values are the same.
    #[test]
    fn other_derivatives_change_nothing() {
        let depths_mm = [0.0, 0.5, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5];
        let mut effects = Effects { friction: Some(variable(0.5, 0)), ..Effects::neutral(1) };
        let (relaxed_fraction, time_constant_s) = (variable(0.4, 1), variable(0.5, 2));
        effects.relaxation.push(Term { relaxed_fraction, time_constant_s });
        effects.bands[0].sticky = Some(Sticky { ratio: variable(0.5, 3), slip_m: variable(1e-5, 4) });
        let rows = poke_to(Vec3::new(0.7, 0.3, -0.6), 0.1, &depths_mm);
        let with = |fitted: usize| march(rows.clone(), &body(), variable(2e3, 5), &effects, fitted);
        let few = with(FEW);
        for fitted in [SOME, MOST] {
            let more = with(fitted);
            for row in 0..depths_mm.len() {
                let (few, more) = (&few.loads[row], more.loads[row].columns(0, 1 + FEW));
                assert!((more - few).amax() <= 1e-12 * few.amax(), "{row}");
            }
            for (few, more) in few.force.iter().flatten().zip(more.force.iter().flatten()) {
                let slopes = gradient(few, FEW);
                let off = (gradient(more, FEW) - &slopes).amax() + (few.re - more.re).abs();
                assert!(off <= 1e-12 * (slopes.amax() + few.re.abs()), "{few} {more}");
            }
        }
        let last = &few.loads[depths_mm.len() - 1];
        assert!((1..=FEW).all(|p| last.column(p).amax() > 0.0), "{last}");
    }

    /// A gap of nothing has the derivative that a small one shows.
    #[test]
    fn a_gap_that_is_nothing_may_become_one() {
        let with = |gap_m: Dual| {
            let mut effects = Effects::neutral(1);
            effects.bands[0].slack = Some(Slack { gap_m, direction: [0.0, 0.0, -1.0] });
            forces(poke(-Vec3::z(), 0.1), &effects)[2][2]
        };
        let (closed, open) = (with(variable(0.0, 0)), with(Dual::from(1e-6)));
        let slope = (open.0 - closed.0) / 1e-6;
        assert!(slope > 10.0 && (closed.1 - slope).abs() < 1e-6 * slope, "{} {slope}", closed.1);
    }
}
