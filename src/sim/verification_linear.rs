//! Whether the linear bench is right: closed forms on its own elements, meshes and supports.

use super::SimError;
use super::brute_force::condense_rows;
use super::hex_mesh::{Feature, Grading, HexMesh, Place, Slab};
use super::linear::{analyse, assemble, element_stiffness, seen, unit_loads};
use super::quadratic::{NODES, PLACES};
use super::supports::{Patch, Restraint, Shape, Support};
use super::unknowns::{Row, Unknowns};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector, Matrix3};
use std::f64::consts::PI;

const POISSON_RATIO: f64 = 0.47;
/// How much longer boxes may be per distance from a rim.
const GROWTH: f64 = 0.6;

fn grading(cell_m: f64, halvings: u32) -> Grading {
    Grading { cell_m, halvings, finer_glue: None }
}

/// Energy of one box in the displacement u = H x, E = 1.
fn energy(size: [f64; 3], poisson_ratio: f64, h: Matrix3<f64>) -> f64 {
    let n = 3 * NODES;
    let stiffness = DMatrix::from_row_slice(n, n, &element_stiffness(size, poisson_ratio));
    let u = DVector::from_iterator(
        n,
        PLACES.iter().flat_map(|p| {
            let x = Vec3::from_fn(|a, _| 0.5 * f64::from(p[a]) * size[a]);
            <[f64; 3]>::from(h * x)
        }),
    );
    0.5 * u.dot(&(stiffness * &u))
}

#[test]
fn one_box_stretched_and_sheared_stores_the_closed_form_energy() {
    let (size, e, nu) = ([0.3, 0.2, 0.5], 0.013, POISSON_RATIO);
    let volume = 0.03;
    // Uniaxial stress: ½ E ε² V. Simple shear: ½ μ γ² V. All-round: ½ · 9 κ ε² V, κ = E / (3 (1 − 2ν)).
    let stretch = Matrix3::from_diagonal(&Vec3::new(-nu * e, e, -nu * e));
    assert!((energy(size, nu, stretch) / (0.5 * e * e * volume) - 1.0).abs() < 1e-12);
    let mut shear = Matrix3::zeros();
    shear[(0, 2)] = e;
    assert!((energy(size, nu, shear) / (0.5 * e * e * volume / (2.0 * (1.0 + nu))) - 1.0).abs() < 1e-12);
    let all_round = Matrix3::from_diagonal_element(e);
    assert!((energy(size, nu, all_round) / (1.5 * e * e * volume / (1.0 - 2.0 * nu)) - 1.0).abs() < 1e-12);
}

#[test]
fn one_box_has_six_rigid_modes_and_no_other_of_zero_energy() {
    let n = 3 * NODES;
    let stiffness = DMatrix::from_row_slice(n, n, &element_stiffness([0.3, 0.2, 0.5], POISSON_RATIO));
    assert!((&stiffness - stiffness.transpose()).norm() < 1e-12 * stiffness.norm());
    let mut eigenvalues: Vec<f64> = stiffness.symmetric_eigen().eigenvalues.iter().copied().collect();
    eigenvalues.sort_by(f64::total_cmp);
    let stiffest = eigenvalues[n - 1];
    assert!(eigenvalues[5].abs() < 1e-12 * stiffest, "{eigenvalues:?}");
    assert!(eigenvalues[6] > 1e-5 * stiffest, "{eigenvalues:?}");
}

/// A graded block, glued all over its underside, in the displacement u = a z: no force on any node inside,
/// and the energy of a uniform strain. Small boxes hang on large ones all around the rim.
#[test]
fn patch_test_on_boxes_of_different_size() -> Result<(), SimError> {
    let slab = Slab { size_m: [0.04, 0.03, 0.02], glue_end_m: 0.04 };
    let rim = Place::Rim { centre: [0.017, 0.013, 0.02], axis: 2, radius: 0.006 };
    let unknowns = Unknowns::new(HexMesh::new(
        slab,
        &[Feature { place: rim, cell_m: 0.001, growth: GROWTH }],
        &grading(0.01, 4),
    )?);
    let hanging = unknowns.elements.iter().filter(|e| e.follow.iter().any(|f| f.2 != 1.0)).count();
    assert!(hanging > 100, "{hanging} boxes with following nodes");
    let a = [0.011, -0.007, 0.005];
    let u: Vec<f64> = unknowns.position.iter().flat_map(|p| a.map(|a| a * p[2])).collect();
    let stiffness = assemble(&unknowns, POISSON_RATIO)?;
    let mut force = vec![0.0; u.len()];
    stiffness.multiply(&u, &mut force);
    let inside = |p: &[f64; 3]| (0..3).all(|c| p[c] > 1e-9 && p[c] < slab.size_m[c] - 1e-9);
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for (p, f) in unknowns.position.iter().zip(force.chunks_exact(3)) {
        let size = f.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        *(if inside(p) { &mut worst } else { &mut largest }) =
            size.max(if inside(p) { worst } else { largest });
    }
    assert!(worst < 1e-12 * largest, "{worst:e} inside, {largest:e} on the sides");
    let (nu, volume) = (POISSON_RATIO, 0.04 * 0.03 * 0.02);
    let (lambda, mu) = (nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 / (1.0 + nu));
    let shear = a[0] * a[0] + a[1] * a[1];
    let exact = 0.5 * volume * ((lambda + 2.0 * mu) * a[2] * a[2] + mu * shear);
    let stored: f64 = 0.5 * u.iter().zip(&force).map(|(u, f)| u * f).sum::<f64>();
    assert!((stored / exact - 1.0).abs() < 1e-12);
    Ok(())
}

/// A block so large against a disc of radius 1 at the middle of its top that it is a half-space to about 0.03 %.
fn half_space(rim_cell: f64) -> Result<(Unknowns, Patch), SimError> {
    let slab = Slab { size_m: [16e3, 16e3, 8e3], glue_end_m: 16e3 };
    let patch = Patch::on(&slab, "disc", MIDDLE, Vec3::z(), 1.0)?;
    let mesh = HexMesh::new(slab, &[patch.feature(rim_cell, GROWTH)], &grading(4e3, 18))?;
    Ok((Unknowns::new(mesh), patch))
}

/// Centre of that disc, on no edge of a box.
const MIDDLE: [f64; 3] = [8003.1, 7996.7, 8000.0];

/// Mean displacement of a uniformly loaded disc: 16 (1 − ν²) p a / (3 π E) along the pressure (Love 1929; Johnson
/// 1985, section 3.4). For a tangential traction the kernel (1 − ν)/r becomes (1 − ν)/r + ν x²/r³ (Cerruti; Johnson
/// 1985, 3.75), whose double integral over a disc is that of (1 − ν/2)/r.
#[test]
fn a_uniform_traction_on_a_disc_moves_it_as_on_a_half_space() -> Result<(), SimError> {
    let (unknowns, patch) = half_space(0.13)?;
    let compliance =
        condense_rows(&unknowns, POISSON_RATIO, &[&patch.rows(Shape::Uniform, &unknowns)[0]], &[])?.supports;
    let pressure = 1.0 / PI;
    let normal = 16.0 * (1.0 - POISSON_RATIO.powi(2)) * pressure / (3.0 * PI);
    let tangential = normal * (1.0 - 0.5 * POISSON_RATIO) / (1.0 - POISSON_RATIO);
    for (axis, exact) in [(0, tangential), (1, tangential), (2, normal)] {
        let ratio = compliance[(axis, axis)] / exact;
        assert!((ratio - 1.0).abs() < 0.003, "axis {axis}: {ratio}");
    }
    Ok(())
}

/// Stiffness of a disc that is held still by the functions of a glued spot and moved as a rigid body: along its
/// axis and about its axis, E = a = 1.
fn rigid_disc(rim_cell: f64) -> Result<[f64; 2], SimError> {
    let (unknowns, patch) = half_space(rim_cell)?;
    let rows = patch.rows(Shape::Held, &unknowns);
    let rows: Vec<&Row> = rows.iter().collect();
    let compliance = condense_rows(&unknowns, POISSON_RATIO, &rows, &[])?.supports;
    let factor = compliance.cholesky().expect("distinct functions");
    let stiffness = |motion: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let field: Vec<f64> = unknowns.position.iter().flat_map(|&p| motion(p)).collect();
        let g = seen(&rows, &field, unknowns.dimension()).column(0).into_owned();
        g.dot(&factor.solve(&g))
    };
    let pressed = stiffness(&|_| [0.0, 0.0, 1.0]);
    Ok([pressed, stiffness(&|p| [MIDDLE[1] - p[1], p[0] - MIDDLE[0], 0.0])])
}

/// Along its axis 4 μ a ln(3 − 4ν) / (1 − 2ν) (Mossakovskii 1954; Spence 1968), about it 16 μ a³ / 3 (Reissner &
/// Sagoci 1944). The traction is singular at the rim, so the error is of first order in the boxes there.
#[test]
fn a_glued_spot_is_as_stiff_as_a_bonded_rigid_disc() -> Result<(), SimError> {
    let (nu, mu) = (POISSON_RATIO, 0.5 / (1.0 + POISSON_RATIO));
    let exact = [4.0 * mu * (3.0 - 4.0 * nu).ln() / (1.0 - 2.0 * nu), 16.0 * mu / 3.0];
    let (coarse, fine) = (rigid_disc(0.13)?, rigid_disc(0.065)?);
    for i in 0..2 {
        let errors = [coarse[i], fine[i], 2.0 * fine[i] - coarse[i]].map(|k| k / exact[i] - 1.0);
        assert!((1.6..2.4).contains(&(errors[0] / errors[1])), "{errors:?}");
        assert!(errors[2].abs() < 0.003, "{errors:?}");
    }
    Ok(())
}

/// The forces that the condensed equations give, put on the uncondensed block, leave every support where it
/// should be: the tip at its displacement, the springs at minus force over stiffness, the spot at rest.
#[test]
fn the_condensed_answer_solves_the_whole_block() -> Result<(), SimError> {
    let slab = Slab { size_m: [0.06, 0.05, 0.02], glue_end_m: 0.02 };
    let tip = Patch::on(&slab, "tip", [0.041, 0.023, 0.02], Vec3::z(), 0.006)?;
    let restraints = [
        Restraint::Springs { centre_m: [0.03, 0.01, 0.0], radius_m: 0.004, stiffness_n_per_m: 80.0 },
        Restraint::Glued { centre_m: [0.048, 0.031, 0.0], radius_m: 0.006 },
    ];
    let unknowns = Unknowns::new(HexMesh::new(slab, &[tip.feature(0.5, GROWTH)], &grading(0.007, 2))?);
    let mut supports = vec![Support { row: tip.rows(Shape::Uniform, &unknowns).remove(0), compliance: 0.0 }];
    for restraint in &restraints {
        supports.extend(restraint.supports(&unknowns)?);
    }
    let rows: Vec<&Row> = supports.iter().map(|s| &s.row).collect();
    let point = unknowns.row_at([0.031, 0.028, 0.02]);
    let young_modulus = 9e3;
    let held: Vec<(usize, f64)> = supports.iter().map(|s| s.compliance).enumerate().skip(1).collect();
    let compliance = condense_rows(&unknowns, POISSON_RATIO, &rows, &[&point])?;
    let response = compliance.respond(young_modulus, 0, &held)?;

    let stiffness = assemble(&unknowns, POISSON_RATIO)?;
    let factor = analyse(&unknowns, stiffness.pattern())?.factor(&stiffness)?;
    let n = unknowns.dimension();
    let mut fields = unit_loads(&rows, n);
    factor.solve_in_place(&mut fields, 3 * rows.len())?;
    let all = DMatrix::from_column_slice(n, 3 * rows.len(), &fields) / young_modulus;
    let pushed = seen(&rows, all.as_slice(), n);
    let mut system = pushed.clone();
    for (i, s) in supports.iter().enumerate() {
        for c in 0..3 {
            system[(3 * i + c, 3 * i + c)] += s.compliance;
        }
    }
    let mut target = DVector::zeros(3 * rows.len());
    target[2] = -0.002;
    let force = system.lu().solve(&target).expect("regular");
    let u = &all * &force;
    let mut reaction = vec![0.0; n];
    stiffness.multiply(u.as_slice(), &mut reaction);
    let loads = DMatrix::from_column_slice(n, 3 * rows.len(), &unit_loads(&rows, n)) * &force;
    let unbalanced = (DVector::from_vec(reaction) * young_modulus - &loads).norm() / loads.norm();
    assert!(unbalanced < 1e-10, "{unbalanced:e}");
    let moved = seen(&rows, u.as_slice(), n);
    assert!((moved[2] + 0.002).abs() < 1e-12 && moved[0].abs() < 1e-12);
    for c in 3..6 {
        assert!((force[c] + 80.0 * moved[c]).abs() < 1e-9, "spring along {}", c - 3);
    }
    assert!(moved.rows_range(6..).norm() < 1e-9 * 0.002);
    let expected = response.stiffness * Vec3::new(0.0, 0.0, -0.002);
    assert!((expected - Vec3::new(force[0], force[1], force[2])).norm() < 1e-9 * expected.norm());
    let seen_there = seen(&[&point], u.as_slice(), n);
    assert!((response.watched.column(2) * -0.002 - seen_there.column(0)).norm() < 1e-10 * 0.002);
    Ok(())
}
