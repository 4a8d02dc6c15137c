//! The session that comes with the program: small, but with everything that a fit has to find.

use super::draw::{Draw, Instruments, Kinematics, PokePlan};
use super::hex_mesh::Slab;
use super::supports::Restraint;

/// A slab of 140 × 90 × 25 mm glued for 55 mm, held by two bands; four sites, five pokes.
///
/// Why so few markers and frames: the bundle lies in the program's repository, and its marker rows are most of it.
pub fn demo() -> Draw {
    let down = [0.0, 0.0, -1.0];
    let poke = |site_m, direction, depth_m, rate_m_s, hold_s| PokePlan {
        site_m,
        direction,
        radius_m: 0.008,
        depth_m,
        rate_m_s,
        hold_s,
    };
    Draw {
        name: "demo".to_owned(),
        seed: 2024,
        slab: Slab { size_m: [0.14, 0.09, 0.025], glue_end_m: 0.055 },
        poisson_ratio: 0.47,
        young_modulus_pa: 11_300.0,
        modulus_range_pa: [5e3, 2e4],
        restraints: vec![
            Restraint::Springs { centre_m: [0.112, 0.024, 0.0], radius_m: 0.005, stiffness_n_per_m: 95.0 },
            Restraint::Springs { centre_m: [0.105, 0.068, 0.0], radius_m: 0.005, stiffness_n_per_m: 48.0 },
        ],
        pokes: vec![
            poke([0.028, 0.047, 0.025], down, 0.002, 0.004, 1.5),
            poke([0.091, 0.043, 0.025], down, 0.0025, 0.005, 1.5),
            poke([0.119, 0.041, 0.025], down, 0.0025, 0.0025, 1.0),
            poke([0.0, 0.044, 0.0135], [1.0, 0.0, 0.0], 0.0015, 0.003, 1.0),
            poke([0.112, 0.066, 0.025], down, 0.003, 0.006, 1.5),
        ],
        kinematics: Kinematics::SmallStrain,
        instruments: Instruments { marker_spacing_m: 0.0118, ..Instruments::default() },
        fit_cell_m: 0.0068,
    }
}
