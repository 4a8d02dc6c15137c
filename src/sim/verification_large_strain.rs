//! Whether the finite-strain bench is right: derivatives, closed forms and the limit of small loads.

use super::SimError;
use super::bench::finite_paths;
use super::brute_force::responses;
use super::draw::{Draw, Instruments, Kinematics, PokePlan};
use super::hex_mesh::{Feature, Grading, HexMesh, Place, Slab};
use super::large_strain::LargeStrain;
use super::neo_hookean::NeoHookean;
use super::resolution::Resolution;
use super::supports::Restraint;
use super::unknowns::Unknowns;

const E: f64 = 1e4;
const NU: f64 = 0.47;

/// A block glued all over its underside, with boxes of different size.
fn graded_block() -> Result<Unknowns, SimError> {
    let slab = Slab { size_m: [0.03, 0.03, 0.02], glue_end_m: 0.03 };
    let rim = Place::Rim { centre: [0.017, 0.013, 0.02], axis: 2, radius: 0.006 };
    let grading = Grading { cell_m: 0.01, halvings: 1, finer_glue: None };
    Ok(Unknowns::new(HexMesh::new(slab, &[Feature { place: rim, cell_m: 0.005, growth: 0.6 }], &grading)?))
}

/// Energy, force and stiffness are derivatives of one another along a direction: the remainder of the Taylor
/// series falls with the square of the step, after one term and, with the stiffness, with the cube.
#[test]
fn the_tangent_is_consistent() -> Result<(), SimError> {
    let unknowns = graded_block()?;
    let block = LargeStrain::new(&unknowns, NeoHookean::new(E, NU))?;
    let bump = |p: &[f64; 3], s: f64| {
        let z = p[2] / 0.02;
        [0.2 * s * p[2] * (90.0 * p[0]).sin(), -0.15 * s * p[2] * z, -0.25 * s * p[2] * (70.0 * p[1]).cos()]
    };
    let u: Vec<f64> = unknowns.position.iter().flat_map(|p| bump(p, 1.0)).collect();
    let v: Vec<f64> = unknowns.position.iter().flat_map(|p| bump(&[p[1], p[0], p[2]], 0.5)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (energy, force) = (block.energy(&u).expect("upright"), block.force(&u).expect("upright"));
    let mut kv = vec![0.0; v.len()];
    block.stiffness(&u).expect("upright").multiply(&v, &mut kv);
    let remainder = |t: f64| {
        let moved: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u + t * v).collect();
        let first = block.energy(&moved).expect("upright") - energy - t * dot(&force, &v);
        let second = first - 0.5 * t * t * dot(&v, &kv);
        (first.abs(), second.abs())
    };
    let (coarse, fine) = (remainder(0.1), remainder(0.05));
    assert!((1.9..2.1).contains(&(coarse.0 / fine.0).log2()), "{coarse:?} {fine:?}");
    assert!((2.8..3.2).contains(&(coarse.1 / fine.1).log2()), "{coarse:?} {fine:?}");
    Ok(())
}

/// The block in simple shear u = γ z e₁: μ/2 γ² V of energy, and no force on nodes inside.
#[test]
fn a_sheared_block_is_in_equilibrium() -> Result<(), SimError> {
    let unknowns = graded_block()?;
    let block = LargeStrain::new(&unknowns, NeoHookean::new(E, NU))?;
    let gamma = 0.6;
    let u: Vec<f64> = unknowns.position.iter().flat_map(|p| [gamma * p[2], 0.0, 0.0]).collect();
    let exact = 0.5 * E / (2.0 * (1.0 + NU)) * gamma * gamma * 0.03 * 0.03 * 0.02;
    assert!((block.energy(&u).expect("upright") / exact - 1.0).abs() < 1e-12);
    let force = block.force(&u).expect("upright");
    let size = unknowns.mesh.slab.size_m;
    let inside = |p: &[f64; 3]| (0..3).all(|c| p[c] > 1e-9 && p[c] < size[c] - 1e-9);
    let largest = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    for (p, f) in unknowns.position.iter().zip(force.chunks_exact(3)) {
        assert!(!inside(p) || f.iter().all(|f| f.abs() < 1e-12 * largest), "at {p:?}");
    }
    Ok(())
}

/// A session on a small slab.
fn session(depth_m: f64) -> Draw {
    let poke = |site_m, direction| PokePlan {
        site_m,
        direction,
        radius_m: 0.008,
        depth_m,
        rate_m_s: 0.004,
        hold_s: 1.0,
    };
    Draw {
        name: "large-strain".to_owned(),
        seed: 0,
        slab: Slab { size_m: [0.07, 0.05, 0.024], glue_end_m: 0.03 },
        poisson_ratio: NU,
        young_modulus_pa: E,
        modulus_range_pa: [5e3, 2e4],
        restraints: vec![
            Restraint::Springs { centre_m: [0.045, 0.013, 0.0], radius_m: 0.005, stiffness_n_per_m: 150.0 },
            Restraint::Glued { centre_m: [0.057, 0.037, 0.0], radius_m: 0.008 },
        ],
        pokes: vec![poke([0.0417, 0.0263, 0.024], [0.0, 0.0, -1.0])],
        kinematics: Kinematics::FiniteStrain,
        instruments: Instruments::default(),
        fit_cell_m: 0.0065,
    }
}

const COARSE: Resolution = Resolution {
    cell_m: 0.0125,
    tip_share: 0.8,
    spring_share: 1.2,
    spot_share: 0.8,
    glue_end_m: 0.006,
    growth: 1.0,
    halvings: 1,
    finer_glue: None,
};

/// Both benches on one mesh: the force at a small depth d differs by O(d²), so a tenth of the depth leaves a tenth
/// of the relative difference.
#[test]
fn small_pokes_are_linear_ones() -> Result<(), SimError> {
    let watched = [[0.031, 0.022, 0.024], [0.052, 0.03, 0.024]];
    let difference = |depth_m: f64| -> Result<f64, SimError> {
        let draw = session(depth_m);
        let large = finite_paths(&draw, &watched, &COARSE)?;
        let small = &responses(&draw, &watched, &COARSE)?[0];
        let (f, l) = (large[0].force(depth_m)[2], -depth_m * small.stiffness[(2, 2)]);
        let (u, v) = (large[0].watched(depth_m, 1)[2], -depth_m * small.watched[(5, 2)]);
        assert!((u / v - 1.0).abs() < 40.0 * depth_m / 0.008);
        Ok((f / l - 1.0).abs())
    };
    let (far, near) = (difference(2e-4)?, difference(2e-5)?);
    assert!(near < 1e-3 && (8.0..12.5).contains(&(far / near)), "{far:e}, {near:e}");
    Ok(())
}

/// Half a tip radius deep: a path with steps of another length has its equilibria where this one interpolates
/// between its own with their slopes.
#[test]
fn a_deep_poke_does_not_depend_on_its_steps() -> Result<(), SimError> {
    let watched = [[0.031, 0.022, 0.024]];
    let deep = &finite_paths(&session(0.004), &watched, &COARSE)?[0];
    let shallow = &finite_paths(&session(0.0034), &watched, &COARSE)?[0];
    let (depth, force) = (0.0034, shallow.force(0.0034)[2]);
    assert!((deep.force(depth)[2] / force - 1.0).abs() < 1e-4, "{} N, {force} N", deep.force(depth)[2]);
    let (u, v) = (deep.watched(depth, 0)[2], shallow.watched(depth, 0)[2]);
    assert!((u - v).abs() < 1e-4 * depth, "{u} m, {v} m");
    let stiffening = (force / depth) / (deep.force(1e-5)[2] / 1e-5) - 1.0;
    assert!(stiffening.abs() > 0.01, "large strain is felt: {stiffening}");
    Ok(())
}

/// A tip that would turn the block inside out is an error that says how far it came.
#[test]
fn an_impossible_depth_is_refused() {
    let refused = finite_paths(&session(0.0235), &[], &COARSE).expect_err("24 mm of gel, poked by 23.5 mm");
    match refused {
        SimError::NoEquilibrium { reached_m, wanted_m, .. } => {
            assert!(reached_m > 0.004 && reached_m < wanted_m);
        }
        other => panic!("{other}"),
    }
}
