//! Changes of the body against what they must be: limits, closed forms, differences, bodies built afresh.

use super::changes::BodyChange;
use super::knob::BulkKnob::{self, *};
use super::lab::Lab;
use crate::diagnose::known::Known;
use crate::diagnose::{DiagnoseError, Physics};
use crate::fem::{Model, Order, Spot, readings};
use crate::geometry::Vec3;
use crate::mesh::{Block, TetMesh, block};
use nalgebra::DMatrix;
use std::sync::Arc;

/// A slab of 60 × 50 × 20 mm, glued underneath for x ≤ 30 mm.
fn slab() -> TetMesh {
    let mut mesh = block(&Block { size_m: [0.06, 0.05, 0.02], cells: [8, 6, 3] }).expect("a block");
    let base = mesh.surface("z-").iter().copied();
    let glued = base.filter(|t| t.iter().all(|&n| mesh.nodes[n as usize].x < 0.0301)).collect();
    mesh.surfaces.insert("fixed".to_owned(), glued);
    mesh
}

fn model(mesh: &TetMesh, nu: f64) -> Model {
    Model::new(mesh, Order::P2, nu, "fixed").expect("held")
}

/// Two tips and a disc of restraint, two markers.
fn spots(model: &Model) -> (Vec<Spot>, Vec<Spot>) {
    let space = model.space();
    let on = |surface: &str, at: [f64; 3], radius| {
        Spot::disc(space, space.surface(surface), &Vec3::from(at), radius).expect("on the body")
    };
    let loads = vec![
        on("z+", [0.018, 0.025, 0.02], 0.006),
        on("z+", [0.045, 0.02, 0.02], 0.006),
        on("z-", [0.052, 0.03, 0.0], 0.004),
    ];
    let seen = vec![on("z+", [0.03, 0.01, 0.02], 0.001), on("x+", [0.06, 0.03, 0.01], 0.001)];
    (loads, seen)
}

/// In a laboratory whose baseline has what the elements say; without markers' fields at hand.
fn lab(model: &Model) -> Lab<'_> {
    lab_with(model, 1.0)
}

/// As [`lab`], the baseline so much softer under its loads than the elements say.
fn lab_with(model: &Model, softer: f64) -> Lab<'_> {
    let (loads, seen) = spots(model);
    let all = |spots: &[Spot]| spots.iter().flat_map(|s| s.weights.iter().cloned()).collect::<Vec<_>>();
    let (functionals, markers) = (all(&loads), all(&seen));
    let fields = nodal_fields(model, &functionals);
    let before = readings(&functionals, &fields);
    let own: Vec<DMatrix<f64>> =
        (0..loads.len()).map(|i| before.view((3 * i, 3 * i), (3, 3)) * softer).collect();
    Lab::of(model, 2, functionals, markers, Vec::new(), &own, None).expect("a laboratory")
}

fn nodal_fields(model: &Model, loads: &[crate::fem::Functional]) -> DMatrix<f64> {
    let solved = model.respond_to(loads).expect("solved");
    DMatrix::from_fn(loads.len(), model.space().components(), |i, c| solved[i][c])
}

/// All values of a change, or of one derivative, side by side.
fn all(change: &BodyChange, by: Option<usize>) -> Vec<f64> {
    [&change.tips_tips, &change.discs_tips, &change.discs_discs, &change.markers]
        .iter()
        .flat_map(|field| match by {
            None => field.value.as_slice().to_vec(),
            Some(knob) => {
                field.by.iter().find(|(k, _)| *k == knob).expect("a derivative").1.as_slice().to_vec()
            }
        })
        .collect()
}

fn size(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    size(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

fn before(lab: &Lab<'_>) -> Vec<f64> {
    all(&BodyChange::of(&lab.before, &[], 2), None)
}

fn ball(x: f64, y: f64, z: f64, radius: f64, log_ratio: f64) -> Vec<(BulkKnob, f64)> {
    vec![
        (BallCentre(0), x),
        (BallCentre(1), y),
        (BallCentre(2), z),
        (BallRadius, radius),
        (BallRatio, log_ratio),
    ]
}

fn loose(x: f64, y: f64, radius: f64) -> Vec<(BulkKnob, f64)> {
    vec![(LooseCentre(0), x), (LooseCentre(1), y), (LooseRadius, radius)]
}

/// What is known answers for what is close to it, by its derivatives to second order in the step, and for nothing else.
#[test]
fn what_is_known_leads_to_what_is_close() {
    let model = model(&slab(), 0.45);
    let lab = lab(&model);
    let known = Known::default();
    let longest = lab.range(Poisson).1;
    let knot = 0.12 * longest;
    let start = vec![(Poisson, knot)];
    // Asked for beside it first: what is known is where it is known, not where it was asked for.
    let first = known.nearest(&lab, &[(Poisson, knot - 0.015 * longest)]).expect("sound");
    let error = |step: f64| {
        let near = vec![(Poisson, knot + step * longest)];
        let found = known.nearest(&lab, &near).expect("sound");
        assert!(Arc::ptr_eq(&first, &found), "{step}");
        let exact = all(&lab.changed(&near).expect("sound"), None);
        let before = all(&lab.changed(&start).expect("sound"), None);
        let led = all(&found.moved(&near).expect("the same knobs"), None);
        (apart(&led, &exact), apart(&before, &exact))
    };
    let ((half, _), (whole, by)) = (error(0.009), error(0.018));
    assert!(whole < 0.02 * by, "{whole:e} of {by:e}");
    assert!((3.0..5.0).contains(&(whole / half)), "{}", whole / half);
    let far = known.nearest(&lab, &[(Poisson, knot + 0.022 * longest)]).expect("sound");
    assert!(!Arc::ptr_eq(&first, &far));
    assert!(first.moved(&[(BaseGive, 0.0)]).is_none());
    assert!(known.nearest(&lab, &[(Poisson, 0.7)]).is_none(), "no such body");
}

/// A ball like the rest, an axis like the others, a rigid hold change nothing; a ball that has everything in it scales
/// the compliance.
#[test]
fn what_is_no_change_changes_nothing_and_a_ball_around_all_scales() {
    let model = model(&slab(), 0.45);
    let lab = lab(&model);
    let before = before(&lab);
    for knobs in
        [ball(0.03, 0.02, 0.01, 0.006, 0.0), vec![(Along([1.0, 1.0, 0.0]), 0.0)], vec![(BaseGive, 0.0)]]
    {
        let change = lab.changed(&knobs).expect("sound");
        assert!(size(&all(&change, None)) < 1e-10 * size(&before), "{knobs:?}");
    }
    let change = lab.changed(&ball(0.03, 0.02, 0.01, 1.0, 3.0_f64.ln())).expect("sound");
    let expected: Vec<f64> = before.iter().map(|b| b * (1.0 / 3.0 - 1.0)).collect();
    assert!(apart(&all(&change, None), &expected) < 1e-10 * size(&before));
}

/// Derivatives by every knob, alone and together, are those of central differences.
#[test]
fn derivatives_are_those_of_differences() {
    let model = model(&slab(), 0.45);
    let lab = lab(&model);
    let mut together = ball(0.028, 0.022, 0.011, 0.007, 0.9);
    together.extend([(Along([0.3, 1.0, 0.2]), 0.4), (Turn(0), 0.2), (Turn(1), -0.1), (Poisson, -0.03)]);
    let mut hold = loose(0.021, 0.026, 0.008);
    hold.push((BaseGive, 2e-3));
    for knobs in [together, loose(0.021, 0.026, 0.008), hold, vec![(BaseGive, 1e-3)]] {
        let exact = lab.changed(&knobs).expect("sound");
        for (index, (knob, value)) in knobs.iter().enumerate() {
            // Metres or plain numbers; a longer step than rounding asks for, as the rim's quadrature is piecewise.
            let h = if *knob == BaseGive { 1e-7 } else { 1e-5 };
            let at = |shift: f64| {
                let mut moved = knobs.clone();
                moved[index].1 = value + shift;
                all(&lab.changed(&moved).expect("sound"), None)
            };
            let slope: Vec<f64> =
                at(h).iter().zip(at(-h)).map(|(plus, minus)| (plus - minus) / (2.0 * h)).collect();
            let own = all(&exact, Some(index));
            let off = apart(&own, &slope) / size(&slope);
            assert!(off < 2e-4, "{knob:?} among {knobs:?}: off by {off:e}");
        }
    }
}

/// What elements miss under a load, here a quarter of what they see, they miss of a change of the whole body too, whatever else changes; of
/// nothing else.
#[test]
fn what_elements_miss_of_the_whole_is_added_beside_anything() {
    let model = model(&slab(), 0.45);
    let labs = [lab(&model), lab_with(&model, 1.25)];
    let changed = |knobs: &[(BulkKnob, f64)]| labs.each_ref().map(|lab| lab.changed(knobs).expect("sound"));
    let missed = |[seen, whole]: &[BodyChange; 2], by: Option<usize>| -> Vec<f64> {
        all(whole, by).iter().zip(all(seen, by)).map(|(whole, seen)| whole - seen).collect()
    };
    // Beside each a ball, and one that has grown.
    for (along, radii) in [(0.4, &[0.006, 0.007][..]), (0.1, &[0.007])] {
        let alone = [(Finer, 0.0), (Along([0.3, 1.0, 0.2]), along), (Poisson, -0.03)];
        let of_whole = changed(&alone);
        for of in [None, Some(1), Some(2)] {
            // A tip's own three components are the first of six.
            let (missed, seen) = (missed(&of_whole, of), all(&of_whole[0], of));
            let share: Vec<f64> = seen[..3].iter().map(|x| 0.25 * x).collect();
            assert!(apart(&missed[..3], &share) < 1e-9 * size(&share), "{of:?} at {along}");
        }
        for radius in radii {
            let of_ball = ball(0.028, 0.022, 0.011, *radius, 0.9);
            let first = of_ball.len();
            let together = changed(&[&of_ball[..], &alone].concat());
            for of in [None, Some(1), Some(2)] {
                let expected = missed(&of_whole, of);
                let found = missed(&together, of.map(|of| first + of));
                let off = apart(&found, &expected) / size(&expected);
                assert!(off < 1e-9, "{of:?} at {along} beside {radius}: off by {off:e}");
            }
            assert!((0..first).all(|of| size(&missed(&together, Some(of))) == 0.0));
        }
    }
}

/// Small changes are those of the first order, which for a give of the hold is its slope at zero; a ball's screening goes
/// as its ratio goes to one.
#[test]
fn small_changes_are_of_first_order() {
    let model = model(&slab(), 0.45);
    let lab = lab(&model);
    for (knobs, within) in [
        // The scan's quadrature of a rim is coarser.
        (ball(0.028, 0.022, 0.011, 0.007, 1e-4), 1e-2),
        (vec![(Along([0.3, 1.0, 0.2]), 1e-4)], 1e-3),
        (vec![(Poisson, 1e-5)], 1e-3),
        (vec![(BaseGive, 1e-7)], 2e-3),
    ] {
        let exact = all(&lab.changed(&knobs).expect("sound"), None);
        let first = all(&lab.first_order(&knobs).expect("sound"), None);
        let off = apart(&exact, &first) / size(&exact);
        assert!(off < within, "{knobs:?}: off by {off:e}");
    }
    let slope = all(&lab.changed(&[(BaseGive, 0.0)]).expect("sound"), Some(0));
    let first = all(&lab.first_order(&[(BaseGive, 1.0)]).expect("sound"), None);
    assert!(apart(&slope, &first) < 1e-4 * size(&slope));
}

/// Another Poisson's ratio is that of a body built with it.
#[test]
fn another_poisson_ratio_is_that_of_a_body_built_afresh() {
    let mesh = slab();
    let (stated, truth) = (model(&mesh, 0.45), model(&mesh, 0.41));
    let (lab, afresh) = (lab(&stated), lab(&truth));
    let change = all(&lab.changed(&[(Poisson, -0.04)]).expect("sound"), None);
    let expected: Vec<f64> = before(&afresh).iter().zip(before(&lab)).map(|(a, b)| a - b).collect();
    assert!(apart(&change, &expected) < 1e-9 * size(&expected));
    assert!(matches!(lab.changed(&[(Poisson, 0.06)]), Err(DiagnoseError::KnobOutOfRange { .. })));
}

/// A column of 40 × 40 × `height` mm on its base, pulled by an even traction on its top, for a Poisson's ratio of zero: the
/// stress is the same everywhere.
fn column(height: f64, cells: [usize; 3]) -> (Model, Vec<crate::fem::Functional>) {
    let mut mesh = block(&Block { size_m: [0.04, 0.04, height], cells }).expect("a block");
    let base = mesh.surface("z-").to_vec();
    mesh.surfaces.insert("fixed".to_owned(), base);
    let model = model(&mesh, 0.0);
    let space = model.space();
    let whole = Spot::disc(space, space.surface("z+"), &Vec3::new(0.02, 0.02, height), 1.0).expect("on top");
    let loads = whole.weights.to_vec();
    (model, loads)
}

fn column_lab<'a>(model: &'a Model, loads: &[crate::fem::Functional]) -> Lab<'a> {
    let own = readings(loads, &nodal_fields(model, loads));
    Lab::of(model, 1, loads.to_vec(), loads.to_vec(), Vec::new(), &[own], None).expect("a laboratory")
}

/// A column that is stiffer along its height stretches by 1/ratio; stiffer across it, not less.
#[test]
fn a_stiffer_axis_follows_the_plain_stretch() {
    let (model, loads) = column(0.06, [2, 2, 3]);
    let lab = column_lab(&model, &loads);
    let plain = 0.06 / (0.04 * 0.04);
    assert!((lab.before[(2, 2)] / plain - 1.0).abs() < 1e-9);
    let stretch = |axis, ratio: f64| {
        lab.changed(&[(Along(axis), ratio.ln())]).expect("sound").tips_tips.value[(2, 2)] / plain
    };
    assert!((stretch([0.0, 0.0, 2.0], 1.6) - (1.0 / 1.6 - 1.0)).abs() < 1e-9);
    assert!((stretch([0.0, 0.0, 1.0], 0.7) - (1.0 / 0.7 - 1.0)).abs() < 1e-9);
    assert!(stretch([1.0, 0.0, 0.0], 1.6).abs() < 1e-9);
}

/// Eshelby (1957) for `ν = 0` (`α = 1/3`, `β = 8/15`) under a plain stress of `1/A`: a third of the energy is volumetric. The
/// rest of the column counts by its share of the volume, about 2 %.
#[test]
fn a_ball_far_inside_changes_the_energy_as_eshelby_says() {
    let (model, loads) = column(0.04, [10, 10, 10]);
    let lab = column_lab(&model, &loads);
    let (radius, area) = (0.007_f64, 0.04 * 0.04);
    let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    for ratio in [4.0_f64, 0.25] {
        let less = ratio - 1.0;
        let energy = less / (1.0 + less / 3.0) / 3.0 + less / (1.0 + less * 8.0 / 15.0) * 2.0 / 3.0;
        let expected = -volume / (area * area) * energy;
        let knobs = ball(0.0203, 0.0197, 0.0202, radius, ratio.ln());
        let exact = lab.changed(&knobs).expect("sound").tips_tips.value[(2, 2)];
        let first = lab.first_order(&knobs).expect("sound").tips_tips.value[(2, 2)];
        assert!((first / expected - 1.0).abs() < 0.01, "{ratio}: first {}", first / expected);
        assert!((exact / expected - 1.0).abs() < 0.06, "{ratio}: exact {}", exact / expected);
    }
}

/// A tilt by the tangent of an angle turns the axis by that angle; knobs say themselves in the catalogue's terms.
#[test]
fn knobs_are_said_in_the_terms_of_the_catalogue() {
    let knobs = [(Along([0.0, 0.0, 3.0]), 0.3), (Turn(0), 0.3_f64.tan()), (Turn(1), 0.0)];
    let (axis, by_tilt) = BulkKnob::axis(&knobs).expect("an axis");
    let tilted = |step: f64| {
        let knobs = [knobs[0], (Turn(0), knobs[1].1 + step), knobs[2]];
        BulkKnob::axis(&knobs).expect("an axis").0
    };
    assert!(((tilted(1e-6) - tilted(-1e-6)) / 2e-6 - by_tilt[0]).norm() < 1e-9);
    assert!((axis.norm() - 1.0).abs() < 1e-15 && (axis.z - 0.3_f64.cos()).abs() < 1e-15);
    assert!(BulkKnob::axis(&[(Poisson, 0.01)]).is_none());
    assert_eq!(BaseGive.said(2e-3, 1e4, 0.45).0, 5e6);
    assert_eq!(Poisson.said(-0.05, 1e4, 0.45).0, 0.4);
    for (knob, value) in
        [(BallRatio, 0.7), (BaseGive, 2e-3), (Along([1.0, 0.0, 0.0]), -0.2), (BallRadius, 0.01)]
    {
        let at = |shift: f64| knob.said(value + shift, 1e4, 0.45).0;
        let (_, slope) = knob.said(value, 1e4, 0.45);
        let h = 1e-6 * value;
        assert!(((at(h) - at(-h)) / (2.0 * h) / slope - 1.0).abs() < 1e-8, "{knob:?}");
    }
}

/// Glue must hold the body; half a place is none.
#[test]
fn nonsense_is_refused() {
    let model = model(&slab(), 0.45);
    let lab = lab(&model);
    assert!(matches!(lab.changed(&loose(0.015, 0.025, 0.1)), Err(DiagnoseError::GlueGone { .. })));
    assert!(matches!(
        lab.changed(&[(BallRadius, 0.01)]),
        Err(DiagnoseError::KnobMissing { id: "centre_x_m" })
    ));
    assert!(matches!(lab.first_order(&[(Turn(0), 0.1)]), Err(DiagnoseError::KnobMissing { .. })));
    assert!(matches!(lab.changed(&loose(0.015, 0.025, -0.01)), Err(DiagnoseError::KnobOutOfRange { .. })));
    assert!(matches!(lab.changed(&[(BaseGive, -1.0)]), Err(DiagnoseError::KnobOutOfRange { .. })));
}

/// Letting go of glue makes the body softer, the more the larger the disc; and as the elements get smaller the scan's crack
/// and the elements come to the same size for a disc amid a wide glue.
#[test]
fn loose_glue_gives_like_a_crack() {
    let mut mesh = block(&Block { size_m: [0.06, 0.06, 0.03], cells: [16, 16, 8] }).expect("a block");
    let base = mesh.surface("z-").to_vec();
    mesh.surfaces.insert("fixed".to_owned(), base);
    let model = model(&mesh, 0.3);
    let space = model.space();
    let whole = Spot::disc(space, space.surface("z+"), &Vec3::new(0.03, 0.03, 0.03), 1.0).expect("on top");
    let loads = whole.weights.to_vec();
    let own = readings(&loads, &nodal_fields(&model, &loads));
    let lab = Lab::of(&model, 1, loads.clone(), loads, Vec::new(), &[own], None).expect("a laboratory");
    let mut last = 0.0;
    for radius in [0.006, 0.008, 0.010] {
        let knobs = loose(0.0303, 0.0296, radius);
        let of = |change: BodyChange| [0, 2].map(|i| change.tips_tips.value[(i, i)]);
        let exact = of(lab.changed(&knobs).expect("sound"));
        let first = of(lab.first_order(&knobs).expect("sound"));
        assert!(exact[1] > last);
        last = exact[1];
        assert!((0.6..1.6).contains(&(exact[1] / first[1])), "{radius}: {}", exact[1] / first[1]);
    }
}

/// Places lie where the body and its glue are; every entry that is a change of the body has some.
#[test]
fn places_are_on_the_body() {
    let model = model(&slab(), 0.45);
    let lab = lab(&model);
    for physics in [
        Physics::Inclusion,
        Physics::Anisotropy,
        Physics::PoissonRatio,
        Physics::BaseDebonding,
        Physics::CompliantBase,
        Physics::CoarseMesh,
    ] {
        let places = lab.places(physics);
        assert!(!places.is_empty(), "{physics}");
        for (knob, value) in places.iter().flatten() {
            let ([low, high], step) = lab.range(*knob);
            assert!(knob.physics() == physics && (low..=high).contains(value) && step > 0.0, "{knob:?}");
        }
    }
    let glued = |knobs: &Vec<(BulkKnob, f64)>| knobs[0].1 <= 0.0301;
    assert!(lab.places(Physics::BaseDebonding).iter().all(glued));
    assert!(lab.places(Physics::Drying).is_empty());
}

/// A scan looks at every place, and at its opposite where there is one: a ball as much softer, a change of the whole body of the other sign.
#[test]
fn every_place_is_looked_at_with_its_opposite() {
    let model = model(&slab(), 0.45);
    let lab = lab(&model);
    let looks = lab.looks();
    assert!(std::ptr::eq(looks, lab.looks()));
    // How coarse the elements are is no change of the body.
    let changes = |physics: &Physics| *physics != Physics::CoarseMesh && !lab.places(*physics).is_empty();
    let mut entries: Vec<Physics> = looks.iter().map(|(physics, _)| *physics).collect();
    entries.sort_by_key(|physics| Physics::ALL.iter().position(|p| p == physics));
    assert_eq!(entries, Physics::ALL.iter().copied().filter(changes).collect::<Vec<_>>());
    for (physics, looks) in looks {
        let places = lab.places(*physics);
        let known = |knobs: &[(BulkKnob, f64)]| {
            let (_, change) = looks.iter().find(|(looked, _)| looked == knobs).expect("looked at");
            all(change, None)
        };
        let turned = |turns: fn(&BulkKnob) -> bool, knobs: &[(BulkKnob, f64)]| -> Vec<(BulkKnob, f64)> {
            knobs.iter().map(|&(knob, value)| (knob, if turns(&knob) { -value } else { value })).collect()
        };
        let alone = |knobs: &[(BulkKnob, f64)]| all(&lab.first_order(knobs).expect("sound"), None);
        for knobs in &places {
            assert_eq!(known(knobs), alone(knobs), "{knobs:?}");
        }
        let opposites = match physics {
            Physics::Inclusion => {
                for knobs in places.iter().map(|knobs| turned(|knob| *knob == BallRatio, knobs)) {
                    assert_eq!(known(&knobs), alone(&knobs), "{knobs:?}");
                }
                places.len()
            }
            Physics::Anisotropy | Physics::PoissonRatio => {
                for knobs in &places {
                    let opposite: Vec<f64> = known(knobs).iter().map(|x| -x).collect();
                    assert_eq!(known(&turned(|knob| knob.of_the_whole(), knobs)), opposite, "{knobs:?}");
                }
                places.len()
            }
            _ => 0,
        };
        assert_eq!(looks.len(), places.len() + opposites, "{physics}");
    }
}
