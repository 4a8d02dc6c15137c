//! Marches of small bodies whose answers are known.

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
        let touch = Touch { site: 0, direction, inward: -Vec3::z(), reported_m: direction * (1e-3 * depth) };
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
        let kept = |(aside, pressed): &(f64, f64)| *pressed > -1e-12 && aside.abs() <= 0.5 * pressed + 1e-12;
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
            let term = |share| Term { relaxed_fraction: Dual::from(share), time_constant_s: Dual::from(0.5) };
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
