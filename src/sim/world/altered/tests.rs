//! Whether altered bodies are right: closed forms on the elements, limits, and finer boxes.

use super::super::phantom::{Disc, Phantom, Site};
use super::super::plan::Press;
use super::*;
use crate::sim::draw::Instruments;
use crate::sim::linear::condense;
use crate::sim::resolution::RemainderResolution;
use nalgebra::{DMatrix, DVector, Matrix3};

const NU: f64 = 0.47;
const SLAB: Slab = Slab { size_m: [0.075, 0.06, 0.024], glue_end_m: 0.031 };

/// A small slab poked over its glue and beyond it, with a patch and no springs.
fn world() -> World {
    let down = [0.0, 0.0, -1.0];
    let site = |x, y| Site { centre_m: [x, y, 0.024], inward: down, radius_m: 0.008 };
    let press = |site| Press { site, direction: down, depth_m: 0.002, rate_m_s: 0.004, hold_s: 1.0 };
    World {
        name: "altered".to_owned(),
        seed: 1,
        phantom: PhantomPlan {
            seed: 1,
            slab: SLAB,
            poisson_ratio: NU,
            sites: vec![site(0.0161, 0.0311), site(0.0517, 0.0323)],
            patches: vec![Disc { centre_m: [0.053, 0.037, 0.0], radius_m: 0.005 }],
            spots: Vec::new(),
            marker_spacing_m: 0.012,
        },
        young_modulus_pa: 1e4,
        modulus_range_pa: [5e3, 2e4],
        stated_poisson_ratio: NU,
        holds: vec![Hold::Springs { patch: 0, stiffness_n_per_m: 100.0 }],
        pokes: vec![press(0), press(1)],
        instruments: Instruments::default(),
        fit_cell_m: 0.0065,
        effects: Vec::new(),
    }
}

fn solid<'a>(slab: &'a Slab, poisson_ratio: f64, alteration: &'a Alteration) -> Solid<'a> {
    Solid { slab, poisson_ratio, alteration }
}

/// A box stretched by ε along the axis: c ε² V / 2 more energy than an isotropic one, and none more when sheared across it.
#[test]
fn a_stiff_axis_stores_the_closed_form_energy() {
    let axis = Vec3::new(0.6, 0.0, 0.8);
    let across = Vec3::new(-0.8, 0.0, 0.6);
    let (size, c) = ([0.3, 0.2, 0.5], 0.7);
    let stiffer = Alteration { axes: vec![(axis, c)], ..Alteration::default() };
    let plain = Alteration::default();
    let energy = |alteration: &Alteration, h: Matrix3<f64>| {
        let n = 3 * NODES;
        let k = DMatrix::from_row_slice(n, n, &solid(&SLAB, NU, alteration).box_stiffness(size, 3, &|_| 1.0));
        let u = DVector::from_iterator(
            n,
            crate::sim::quadratic::PLACES.iter().flat_map(|p| {
                let x = Vec3::from_fn(|a, _| 0.5 * f64::from(p[a]) * size[a]);
                <[f64; 3]>::from(h * x)
            }),
        );
        0.5 * u.dot(&(k * &u))
    };
    let e = 0.01;
    let more = |h: Matrix3<f64>| energy(&stiffer, h) - energy(&plain, h);
    let stretched = more(e * axis * axis.transpose());
    assert!((stretched / (0.5 * c * e * e * 0.03) - 1.0).abs() < 1e-10);
    assert!(more(e * across * axis.transpose()).abs() < 1e-12 * stretched);
    assert!(more(e * Vec3::y() * Vec3::y().transpose()).abs() < 1e-12 * stretched);
}

/// A ball larger than the slab is a slab of another modulus; a gradient changes what is stiff and what is soft.
#[test]
fn a_ball_around_everything_scales_the_compliance() -> Result<(), SimError> {
    let world = world();
    let plan = session_plan(&world);
    let unknowns = mesh(&plan, &Alteration::default(), 1.3)?;
    let analysis = analyse(&unknowns, &pattern(&unknowns))?;
    let rows = support_rows(&plan.discs()?, &unknowns);
    let condensed =
        |alteration: &Alteration| solid(&SLAB, NU, alteration).condense(&unknowns, &analysis, &rows, &[]);
    let ball = Alteration { balls: vec![(Vec3::zeros(), 1.0, 2.5)], ..Alteration::default() };
    let (with, without) = (condensed(&ball)?.supports, condensed(&Alteration::default())?.supports);
    assert!((with * 2.5 - &without).amax() < 1e-9 * without.amax());
    let softer_below = Alteration { gradient_per_m: 20.0, ..Alteration::default() };
    let graded = condensed(&softer_below)?.supports;
    // Over the glue the modulus of the upper half, where a tip's strain is largest, counts most.
    assert!(graded[(2, 2)] < without[(2, 2)], "{} and {}", graded[(2, 2)], without[(2, 2)]);
    Ok(())
}

/// A column of layer and foundation, ν = 0: under a pressure p it shortens by p (h/E + 1/k), and nothing is left to
/// balance but at the top.
#[test]
fn a_foundation_is_in_series_with_the_layer() -> Result<(), SimError> {
    let slab = Slab { size_m: [0.03, 0.02, 0.012], glue_end_m: 0.03 };
    let k = 150.0;
    let alteration = Alteration { foundation: Some(k), ..Alteration::default() };
    let rim = Feature {
        place: Place::Rim { centre: [0.01, 0.011, 0.012], axis: 2, radius: 0.004 },
        cell_m: 0.002,
        growth: 1.0,
    };
    let grading = Grading { cell_m: 0.008, halvings: 2, finer_glue: None };
    let unknowns = Unknowns::unglued(HexMesh::new(slab, &[rim], &grading)?);
    let stiffness = solid(&slab, 0.0, &alteration).assemble(&unknowns)?;
    let u: Vec<f64> = unknowns.position.iter().flat_map(|p| [0.0, 0.0, -(p[2] + 1.0 / k)]).collect();
    let mut force = vec![0.0; u.len()];
    stiffness.multiply(&u, &mut force);
    let largest = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    let mut pressed = 0.0;
    for (p, f) in unknowns.position.iter().zip(force.chunks_exact(3)) {
        if p[2] > 0.012 - 1e-9 {
            pressed += f[2];
        } else {
            assert!(f.iter().all(|f| f.abs() < 1e-10 * largest), "{f:?} N at {p:?}");
        }
    }
    assert!((pressed / (-0.03 * 0.02) - 1.0).abs() < 1e-10, "{pressed}");
    Ok(())
}

/// Glue that has let go beyond a straight line is glue that ends there: against the accurate bench of a slab whose glue
/// ends where that of the elements seems to.
#[test]
fn glue_that_has_let_go_is_glue_that_ends_earlier() -> Result<(), SimError> {
    let world = world();
    // The rim of so large a disc is straight to 9 µm.
    let (radius, wanted) = (50.0, 0.0231);
    let loose = Alteration { loose: vec![([wanted + radius, 0.03], radius)], ..Alteration::default() };
    let change = difference(&world, &loose, &world.phantom.markers())?;
    let unknowns = mesh(&session_plan(&world), &loose, 1.0)?;
    let corners = |index: usize| unknowns.mesh.corners(unknowns.elements[index].cell);
    let faces = let_go(&unknowns, loose.loose[0].0, radius);
    let (low, high) = faces.into_iter().map(corners).min_by(|a, b| a.0[0].total_cmp(&b.0[0])).expect("faces");
    let ends_at = low[0] + GLUE_OVERREACH * (high[0] - low[0]);
    assert!((ends_at - wanted).abs() < 0.6 * (high[0] - low[0]));
    let compliance = |glue_end_m: f64| -> Result<Compliance, SimError> {
        let slab = Slab { glue_end_m, ..SLAB };
        let plan = PhantomPlan { slab, ..world.phantom.clone() };
        let fields = plan.fields()?;
        let meshes = RemainderResolution::SMALL_STRAIN.meshes(slab, &fields)?;
        Ok(condense(&meshes, NU, &fields, &[])?.0)
    };
    let exact = compliance(ends_at)?.supports - compliance(SLAB.glue_end_m)?.supports;
    for column in [2, 5] {
        let (found, exact) = (change.supports[(column, column)], exact[(column, column)]);
        assert!((found / exact - 1.0).abs() < 0.05, "{column}: {found:e}, {exact:e}");
    }
    Ok(())
}

/// A small ball in a block under simple shear: inside the strain is uniform, ε / (1 + β (r − 1)) with
/// β = 2 (4 − 5ν) / (15 (1 − ν)) (Eshelby 1957, equation 4.4). The block is ten radii wide.
#[test]
fn a_ball_under_shear_is_strained_as_eshelby_says() -> Result<(), SimError> {
    let slab = Slab { size_m: [0.1, 0.1, 0.1], glue_end_m: 0.1 };
    let (centre, radius, ratio, gamma) = (Vec3::new(0.047, 0.052, 0.051), 0.01, 3.5, 0.01);
    let alteration = Alteration { balls: vec![(centre, radius, ratio)], ..Alteration::default() };
    let ball = Feature {
        place: Place::Ball { centre: centre.into(), radius },
        cell_m: BALL_SHARE * radius,
        growth: GROWTH,
    };
    let grading = Grading { cell_m: 0.025, halvings: 3, finer_glue: None };
    let unknowns = Unknowns::new(HexMesh::new(slab, &[ball], &grading)?);
    let sheared: Vec<f64> = unknowns.position.iter().flat_map(|p| [gamma * p[2], 0.0, 0.0]).collect();
    let mut u = vec![0.0; sheared.len()];
    let plain = Alteration::default();
    solid(&slab, NU, &plain).assemble(&unknowns)?.multiply(&sheared, &mut u);
    let stiffness = solid(&slab, NU, &alteration).assemble(&unknowns)?;
    analyse(&unknowns, stiffness.pattern())?.factor(&stiffness)?.solve_in_place(&mut u, 1)?;
    let at = |p: Vec3| {
        let row = unknowns.row_at(p.into());
        Vec3::from_fn(|c, _| row.iter().map(|&(n, w)| w * u[3 * n as usize + c]).sum())
    };
    let reach = 0.4 * radius;
    let slope = |axis: usize| {
        (at(centre + Vec3::ith(axis, reach)) - at(centre - Vec3::ith(axis, reach))) / (2.0 * reach)
    };
    let strain = (slope(2).x + slope(0).z) / gamma;
    let beta = 2.0 * (4.0 - 5.0 * NU) / (15.0 * (1.0 - NU));
    let exact = 1.0 / (1.0 + beta * (ratio - 1.0));
    assert!((strain / exact - 1.0).abs() < 0.03, "{strain}, {exact}");
    Ok(())
}

/// How far each alteration's change of force and markers is from that on boxes of 0.6 times the length, in per cent of the
/// peak, with times.
#[test]
#[ignore = "a minute: a study, run by name with --nocapture"]
fn refinement_study() -> Result<(), SimError> {
    let plan = super::super::stock(1, 0);
    let phantom = Phantom::prepare(&plan)?;
    let press = |site: usize| Press {
        site,
        direction: plan.sites[site].inward,
        depth_m: 0.003,
        rate_m_s: 0.004,
        hold_s: 1.0,
    };
    let mut world = world();
    world.pokes = [0, 1, 2, 3, 8].map(press).into();
    world.holds = vec![
        Hold::Springs { patch: 0, stiffness_n_per_m: 100.0 },
        Hold::Springs { patch: 1, stiffness_n_per_m: 60.0 },
    ];
    world.phantom = plan.clone();
    let glued = plan.sites[0].centre_m;
    let cases = [
        ("anisotropy", Alteration { axes: vec![(Vec3::x(), 0.4)], ..Alteration::default() }),
        (
            "inclusion",
            Alteration {
                balls: vec![(Vec3::from(plan.sites[1].centre_m) - Vec3::new(0.01, 0.003, 0.011), 0.009, 3.5)],
                ..Alteration::default()
            },
        ),
        ("gradient", Alteration { gradient_per_m: 40.0, ..Alteration::default() }),
        (
            "debonding",
            Alteration { loose: vec![([glued[0] + 0.006, glued[1]], 0.012)], ..Alteration::default() },
        ),
        ("compliant", Alteration { foundation: Some(150.0), ..Alteration::default() }),
    ];
    for (name, alteration) in cases {
        let start = std::time::Instant::now();
        let usual = difference_at(&world, &alteration, &phantom.watched, 1.0)?;
        let seconds = start.elapsed().as_secs_f64();
        let fine = difference_at(&world, &alteration, &phantom.watched, 0.6)?;
        let plan = session_plan(&world);
        let dimension = mesh(&plan, &alteration, 1.0)?.dimension();
        let responses = |change: Option<&Compliance>| -> Result<Vec<_>, SimError> {
            let body = super::super::condensed::SessionBody::new(&world, &phantom, change)?;
            let n = body.supports.nrows();
            let compliance = Compliance {
                supports: body.supports.columns(0, n).into_owned(),
                watched: body.watched.columns(0, n).into_owned(),
            };
            (0..5).map(|tip| compliance.respond(1e4, tip, &[(5, 0.01), (6, 1.0 / 60.0)])).collect()
        };
        let (none, usual, fine) = (responses(None)?, responses(Some(&usual))?, responses(Some(&fine))?);
        for (tip, ((none, usual), fine)) in none.iter().zip(&usual).zip(&fine).enumerate() {
            let axis = if tip < 4 { 2 } else { 0 };
            let force = |r: &crate::sim::linear::TipResponse| r.stiffness[(axis, axis)];
            let moved = |r: &crate::sim::linear::TipResponse| r.watched.column(axis).into_owned();
            let peak = moved(fine).amax();
            println!(
                "{name} ({dimension} unknowns, {seconds:.2} s), tip {tip}: force changes by {:.3} %, off by {:.3} %; \
                 markers change by {:.3} %, off by {:.3} %",
                100.0 * (force(fine) / force(none) - 1.0),
                100.0 * (force(usual) / force(fine) - 1.0),
                100.0 * (moved(fine) - moved(none)).amax() / peak,
                100.0 * (moved(usual) - moved(fine)).amax() / peak,
            );
        }
    }
    Ok(())
}
