//! How close the linear bench is to the limit of fine boxes, and to elements that hold the whole field.

use super::SimError;
use super::bench::{condensed, distinct_tips};
use super::brute_force;
use super::draw::{Draw, Instruments, Kinematics, PokePlan};
use super::hex_mesh::Slab;
use super::instruments::marker_sites;
use super::linear::TipResponse;
use super::random::draw;
use super::resolution::{RemainderResolution, Resolution};
use super::supports::Restraint;

/// Response of each distinct tip with and without the restraints.
fn responses(
    draw: &Draw,
    watched: &[[f64; 3]],
    resolution: &RemainderResolution,
) -> Result<Vec<[TipResponse; 2]>, SimError> {
    let sites = distinct_tips(&draw.pokes);
    let (compliance, held) = condensed(draw, &sites, watched, resolution)?;
    let respond = |tip| {
        let with = compliance.respond(draw.young_modulus_pa, tip, &held)?;
        Ok([with, compliance.respond(draw.young_modulus_pa, tip, &[])?])
    };
    (0..sites.len()).map(respond).collect()
}

/// A small slab on springs, poked from above and from the side.
fn small_session() -> Draw {
    let poke = |site_m, direction| PokePlan {
        site_m,
        direction,
        radius_m: 0.008,
        depth_m: 0.002,
        rate_m_s: 0.004,
        hold_s: 1.0,
    };
    Draw {
        name: "refinement".to_owned(),
        seed: 0,
        slab: Slab { size_m: [0.075, 0.06, 0.024], glue_end_m: 0.031 },
        poisson_ratio: 0.47,
        young_modulus_pa: 1e4,
        modulus_range_pa: [5e3, 2e4],
        restraints: vec![Restraint::Springs {
            centre_m: [0.053, 0.037, 0.0],
            radius_m: 0.005,
            stiffness_n_per_m: 150.0,
        }],
        pokes: vec![
            poke([0.0517, 0.0323, 0.024], [0.0, 0.0, -1.0]),
            poke([0.0, 0.0291, 0.0127], [1.0, 0.0, 0.0]),
        ],
        kinematics: Kinematics::SmallStrain,
        instruments: Instruments::default(),
        fit_cell_m: 0.0065,
    }
}

/// Elements that hold the whole field agree with the bench, which shares with them the elements but neither loads nor
/// meshes, to a fifth of a per cent. They must be cut finely along the sides that the glue reaches, too, where the stress is
/// singular as at its end: without that they are 0.3 % too stiff.
#[test]
fn elements_that_hold_everything_agree() -> Result<(), SimError> {
    let draw = small_session();
    let watched = [[0.062, 0.021, 0.024], [0.043, 0.047, 0.024]];
    let fine = Resolution {
        cell_m: 0.003,
        tip_share: 0.1,
        spring_share: 0.2,
        spot_share: 0.1,
        glue_end_m: 0.0012,
        growth: 0.5,
        halvings: 4,
        finer_glue: Some(0.3),
    };
    let whole = brute_force::responses(&draw, &watched, &fine)?;
    let bench = responses(&draw, &watched, &RemainderResolution::SMALL_STRAIN)?;
    for (whole, [bench, _]) in whole.iter().zip(&bench) {
        for axis in 0..3 {
            let ratio = bench.stiffness[(axis, axis)] / whole.stiffness[(axis, axis)] - 1.0;
            assert!(ratio.abs() < 0.002, "axis {axis}: {ratio:e}");
        }
        let apart = (&bench.watched - &whole.watched).amax() / whole.watched.amax();
        assert!(apart < 0.004, "watched points: {apart:e}");
    }
    Ok(())
}

/// Root of the mean square.
fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// Against finer boxes everywhere: relative deviation of the stiffnesses of all tips, of the differences that the restraints
/// make (where they are a fiftieth of the stiffness or more), and of the watched points (of the largest displacement), rms
/// and largest.
#[test]
#[ignore = "minutes and gigabytes: a study, run by name with --nocapture"]
fn refinement_study() -> Result<(), SimError> {
    let fine = RemainderResolution {
        cell_m: 0.004,
        glue_end_m: 0.0022,
        growth: 0.5,
        image_growth: 0.5,
        halvings: 4,
    };
    for seed in [3, 8, 12] {
        let draw = draw(seed);
        let markers = marker_sites(&draw);
        let bench = responses(&draw, &markers, &RemainderResolution::SMALL_STRAIN)?;
        let limit = responses(&draw, &markers, &fine)?;
        let (mut stiffness, mut difference, mut apart) = (Vec::new(), Vec::new(), Vec::new());
        for ([with, without], [exact, exact_without]) in bench.iter().zip(&limit) {
            for axis in 0..3 {
                let of = |r: &TipResponse| r.stiffness[(axis, axis)];
                stiffness.push(of(with) / of(exact) - 1.0);
                let made = of(exact) - of(exact_without);
                if made > 0.02 * of(exact) {
                    difference.push((of(with) - of(without)) / made - 1.0);
                }
            }
            apart.push((&with.watched - &exact.watched).amax() / exact.watched.amax());
        }
        for (what, values) in [("stiffness", stiffness), ("difference", difference), ("markers", apart)] {
            let largest = values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            println!(
                "draw {seed}, {what}: {:.3} % rms, {:.3} % at most",
                100.0 * rms(&values),
                100.0 * largest
            );
        }
    }
    Ok(())
}
