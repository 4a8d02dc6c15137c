//! Whether a session in the condensed space obeys its laws: closed forms on one point and on two.

use super::super::hold_law::Friction;
use super::*;

const STEP_S: f64 = 0.01;
const E: f64 = 1e4;

/// A body of one tip and `springs` patches with this compliance at E = 1 Pa, axes apart.
fn body(compliance: &[&[f64]]) -> SessionBody {
    let points = compliance.len();
    let mut supports = DMatrix::zeros(3 * points, 3 * points + 3);
    for (i, row) in compliance.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            for c in 0..3 {
                supports[(3 * i + c, 3 * j + c)] = *value;
            }
        }
        for c in 0..3 {
            // The weight moves every point alike.
            supports[(3 * i + c, 3 * points + c)] = 1e-3;
        }
    }
    let watched = supports.rows(0, 3).into_owned();
    SessionBody { supports, watched, tips: 1, springs: points - 1 }
}

fn setup() -> Setup {
    Setup {
        young_modulus_pa: E,
        terms: Vec::new(),
        drift_per_s: 0.0,
        holds: Vec::new(),
        friction: None,
        stage_compliance: 0.0,
        weight: Vec3::zeros(),
    }
}

/// The tip along −z, in contact from the start.
fn pressed(targets: impl Iterator<Item = Vec3>) -> Vec<Option<Contact>> {
    let down = -Vec3::z();
    targets.map(|target| Some(Contact { tip: 0, target, direction: down, inward: down })).collect()
}

fn ramp_and_hold(seconds: f64, ramp_s: f64, rate: f64) -> Vec<Option<Contact>> {
    let count = (seconds / STEP_S) as usize;
    pressed((0..count).map(|n| -Vec3::z() * (n as f64 * STEP_S).min(ramp_s) * rate))
}

/// One point without springs is a standard linear solid: force = K₀ times the closed form of `memory`; and what is let go
/// creeps back to where it came from.
#[test]
fn one_point_relaxes_as_a_standard_linear_solid() -> Result<(), SimError> {
    let (g, tau, c, rate, ramp_s) = (0.25, 1.3, 8.0, 0.002, 1.0);
    let terms = vec![PronyTerm { relaxed_fraction: g, time_constant_s: tau }];
    let mut contacts = ramp_and_hold(4.0, ramp_s, rate);
    contacts.extend(vec![None; 1500]);
    let body = body(&[&[c]]);
    let course = carry(&body, Setup { terms, ..setup() }, &contacts, STEP_S)?;
    let k0 = E / (1.0 - g) / c;
    for (n, force) in course.force.iter().enumerate().take(400) {
        let t = n as f64 * STEP_S;
        let shape = if t <= ramp_s {
            t - g * (t + tau * (-t / tau).exp_m1())
        } else {
            ramp_s * (1.0 - g) + g * tau * ((-(t - ramp_s) / tau).exp() - (-t / tau).exp())
        };
        assert!((-force.z - k0 * rate * shape).abs() < 1e-12, "t = {t}");
    }
    let (at_release, late) = (&body.watched * &course.loads[400], &body.watched * &course.loads[1899]);
    assert!(at_release[2] < -1e-5 && late[2].abs() < 2e-2 * at_release[2].abs());
    Ok(())
}

/// Elastic springs under a phantom that relaxes: modulus and springs do not separate. Held still for long, the force is
/// that of the relaxed phantom with its springs; in an instant, that of the unrelaxed one: K = (E/c − coupling) by hand.
#[test]
fn elastic_springs_do_not_relax() -> Result<(), SimError> {
    let terms = vec![PronyTerm { relaxed_fraction: 0.3, time_constant_s: 0.4 }];
    let (a, b, d, k) = (8.0, 3.0, 6.0, 900.0);
    // u_tip = (a F + b f)/E, u_spring = (b F + d f)/E = −f/k.
    let stiffness = |e: f64| e / (a - b * b / (d + e / k));
    for (seconds, ramp_s, modulus) in [(0.02, 0.01, E / 0.7), (9.0, 0.5, E)] {
        let holds = vec![HoldLaw::new(k, &[], STEP_S, None, None)];
        let contacts = ramp_and_hold(seconds, ramp_s, 0.001 / ramp_s);
        let setup = Setup { terms: terms.clone(), holds, ..setup() };
        let course = carry(&body(&[&[a, b], &[b, d]]), setup, &contacts, STEP_S)?;
        let force = -course.force[contacts.len() - 1].z;
        let exact = 0.001 * stiffness(modulus);
        // One step of 0.01 s relaxes 0.3 · 0.01/(2 · 0.4) of it.
        let allowed = if seconds > 1.0 { 1e-8 } else { 6e-3 };
        assert!((force / exact - 1.0).abs() < allowed, "{force} N, {exact} N");
    }
    Ok(())
}

/// With all parts relaxing alike the force is the elastic one times one function of time: the independent check that
/// springs with memory are stepped as the phantom is.
#[test]
fn what_relaxes_alike_separates() -> Result<(), SimError> {
    let terms = vec![PronyTerm { relaxed_fraction: 0.35, time_constant_s: 0.9 }];
    let c = [&[8.0, 3.0][..], &[3.0, 6.0][..]];
    let contacts = ramp_and_hold(3.0, 0.7, 0.002);
    let run = |terms: Vec<PronyTerm>, with_springs: bool| {
        let holds =
            if with_springs { vec![HoldLaw::new(700.0, &terms, STEP_S, None, None)] } else { Vec::new() };
        let body = if with_springs { body(&c) } else { body(&[&[8.0]]) };
        carry(&body, Setup { terms, holds, ..setup() }, &contacts, STEP_S)
    };
    let (both, elastic) = (run(terms.clone(), true)?, run(Vec::new(), true)?);
    let (alone, alone_elastic) = (run(terms, false)?, run(Vec::new(), false)?);
    for n in 1..contacts.len() {
        let (x, y) = (both.force[n].z / elastic.force[n].z, alone.force[n].z / alone_elastic.force[n].z);
        assert!((x / y - 1.0).abs() < 1e-10, "{n}: {x}, {y}");
    }
    Ok(())
}

/// E(t) = E (1 + r t): force of a held tip in proportion to it.
#[test]
fn a_drying_phantom_gets_stiffer_with_the_clock() -> Result<(), SimError> {
    let contacts = ramp_and_hold(5.0, 0.5, 0.002);
    let course = carry(&body(&[&[8.0]]), Setup { drift_per_s: 0.01, ..setup() }, &contacts, STEP_S)?;
    for n in [100, 300, 499] {
        let exact = 0.001 * E / 8.0 * (1.0 + 0.01 * n as f64 * STEP_S);
        assert!((-course.force[n].z - exact).abs() < 1e-12);
    }
    Ok(())
}

/// A slack band under one point: force over depth in two straight pieces, with the corner where the patch has moved by the
/// gap; upwards it never pulls.
#[test]
fn a_slack_band_is_piecewise_linear() -> Result<(), SimError> {
    let (a, b, d, k, gap) = (8.0, 3.0, 6.0, 900.0, 3e-4);
    for sign in [1.0, -1.0] {
        let holds = vec![HoldLaw::new(k, &[], STEP_S, Some((-Vec3::z(), gap)), None)];
        let contacts = pressed((0..300).map(|n| -Vec3::z() * (sign * 1e-5 * f64::from(n))));
        let course = carry(&body(&[&[a, b], &[b, d]]), Setup { holds, ..setup() }, &contacts, STEP_S)?;
        for (n, force) in course.force.iter().enumerate() {
            let depth = sign * 1e-5 * n as f64;
            // The patch moves by b/a of the tip; beyond the gap f = −k (w − gap) with the tip held.
            let free = E * depth / a;
            let beyond = (depth * b / a - gap).max(0.0);
            let f = -beyond / (1.0 / k + (d - b * b / a) / E);
            let exact = free - b / a * f;
            assert!((-force.z - exact).abs() < 1e-11, "{depth}: {} N, {exact} N", -force.z);
        }
    }
    Ok(())
}

/// Pressed to a normal force N and moved sideways: the tangential force grows with E/c, stops at μ N, turns back with E/c
/// and stops at −μ N: stick and slip by hand.
#[test]
fn a_dry_tip_sticks_and_slips() -> Result<(), SimError> {
    let (c, mu, depth) = (8.0, 0.3, 0.002);
    let down = -Vec3::z();
    let sideways = |n: i32| {
        let x = 1e-5 * f64::from(n);
        if n <= 150 { x } else { 3e-3 - x }
    };
    let mut targets = vec![down * 0.5 * depth, down * depth];
    targets.extend((0..400).map(|n| down * depth + Vec3::x() * sideways(n)));
    let contacts = pressed(targets.into_iter());
    let course = carry(&body(&[&[c]]), Setup { friction: Some(mu), ..setup() }, &contacts, STEP_S)?;
    let (k, limit) = (E / c, mu * E / c * depth);
    let mut tangential = 0.0_f64;
    for n in 0..400_usize {
        if n > 0 {
            let move_x = sideways(n as i32) - sideways(n as i32 - 1);
            tangential = (tangential + k * move_x).clamp(-limit, limit);
        }
        let force = course.force[n + 2];
        assert!((force.x - tangential).abs() < 1e-10, "{n}: {} N, {tangential} N", force.x);
        assert!((-force.z - k * depth).abs() < 1e-10);
    }
    Ok(())
}

/// A dry tip that is drawn back leaves a phantom that has not crept back yet, and never pulls.
#[test]
fn a_dry_tip_lifts_off() -> Result<(), SimError> {
    let terms = vec![PronyTerm { relaxed_fraction: 0.6, time_constant_s: 0.8 }];
    let depth = |n: i32| 1e-5 * f64::from(n.min(400 - n)).min(100.0);
    let contacts = pressed((0..=400).map(|n| -Vec3::z() * depth(n)));
    let dry = Setup { terms: terms.clone(), friction: Some(0.4), ..setup() };
    let bonded = Setup { terms, ..setup() };
    let dry = carry(&body(&[&[8.0]]), dry, &contacts, STEP_S)?;
    let bonded = carry(&body(&[&[8.0]]), bonded, &contacts, STEP_S)?;
    assert!(bonded.force[400].z > 0.1, "a bonded tip pulls: {}", bonded.force[400].z);
    assert!(dry.force.iter().all(|f| f.z <= 1e-12), "a dry one does not");
    assert!((dry.force[200].z - bonded.force[200].z).abs() < 1e-10);
    Ok(())
}

/// The stage gives: force = depth / (c/E + stage compliance).
#[test]
fn a_soft_stage_is_a_spring_in_series() -> Result<(), SimError> {
    let contacts = ramp_and_hold(1.0, 0.5, 0.002);
    let setup = Setup { stage_compliance: 1e-4, ..setup() };
    let course = carry(&body(&[&[8.0]]), setup, &contacts, STEP_S)?;
    let exact = 0.001 / (8.0 / E + 1e-4);
    assert!((-course.force[99].z - exact).abs() < 1e-12);
    Ok(())
}

/// The weight pulls the point away under a held tip; springs carry their share.
#[test]
fn weight_acts_while_the_tip_touches() -> Result<(), SimError> {
    let contacts = vec![
        None,
        Some(Contact { tip: 0, target: Vec3::zeros(), direction: -Vec3::z(), inward: -Vec3::z() }),
        None,
    ];
    let setup = Setup { weight: -Vec3::z() * 1e4, ..setup() };
    let course = carry(&body(&[&[8.0]]), setup, &contacts, STEP_S)?;
    // The free point would sink by 10⁻³ · 10⁴ / E; the tip holds it up.
    let exact = 1e-3 * 1e4 / E / (8.0 / E);
    assert!((course.force[1].z - exact).abs() < 1e-10, "{} N", course.force[1].z);
    assert_eq!(course.force[2].z, 0.0);
    assert!(course.loads[2].amax() < 1e-12);
    Ok(())
}

/// Two springs with dry friction and a slack one at once: Newton's method finds what balances all, step after step.
#[test]
fn all_laws_at_once_balance() -> Result<(), SimError> {
    let c = [&[8.0, 3.0, 2.0][..], &[3.0, 7.0, 1.0][..], &[2.0, 1.0, 6.0][..]];
    let friction = Friction { stiffness: 400.0, yield_n: 0.02, slider: Vec3::zeros() };
    let terms = [PronyTerm { relaxed_fraction: 0.3, time_constant_s: 0.5 }];
    let holds = vec![
        HoldLaw::new(300.0, &terms, STEP_S, None, Some(friction)),
        HoldLaw::new(500.0, &[], STEP_S, Some((-Vec3::z(), 1e-4)), None),
    ];
    let contacts = pressed((0..400).map(|n| {
        let t = f64::from(n) * STEP_S;
        -Vec3::z() * (0.002 * (2.0 * t).sin().abs()) + Vec3::x() * 0.001 * t
    }));
    let setup = Setup { holds, friction: Some(0.3), terms: terms.to_vec(), ..setup() };
    let course = carry(&body(&c), setup, &contacts, STEP_S)?;
    let slid = course.force.iter().any(|f| f.x.abs() > 0.299 * f.z.abs() && f.z.abs() > 0.1);
    assert!(slid && course.force.iter().all(|f| f.x.abs() <= 0.3 * -f.z + 1e-9));
    Ok(())
}
