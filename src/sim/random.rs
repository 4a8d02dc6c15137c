//! A random bench session: one member of the family over which the fit's stated uncertainty is checked.

use super::draw::{Draw, Instruments, Kinematics, PokePlan};
use super::hex_mesh::Slab;
use super::seed::{Use, stream};
use super::supports::Restraint;
use rand::{Rng, RngExt};

/// Radius of the tip (m).
const TIP_RADIUS_M: f64 = 0.008;
/// Tips keep this distance from edges, and patches from edges and from the glue (m).
const MARGIN_M: f64 = 0.002;
/// Radius of a spring patch (m).
const PATCH_RADIUS_M: f64 = 0.005;
/// Centres of restraints are at least this far apart, and rims of a glued spot and others half of it (m).
const APART_M: f64 = 0.015;
/// How often a place is tried before the restraint or site is left out.
const TRIES: usize = 200;

/// A log-uniform number.
fn log_uniform(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random())
}

/// The draw of a seed: a slab of 150 × 100 × 25 mm ± 20 %, E from 6 to 18 kPa, three to five sites of which one is
/// on a side, each poked once or twice, and none to three restraints.
pub fn draw(seed: u64) -> Draw {
    let rng = &mut stream(seed, Use::Draw);
    let size_m = [0.15, 0.1, 0.025].map(|l| l * rng.random_range(0.8..1.2));
    let slab = Slab { size_m, glue_end_m: size_m[0] * rng.random_range(0.33..0.45) };
    let young_modulus_pa = log_uniform(rng, 6e3, 18e3);
    let restraints = restraints(rng, &slab);
    let mut pokes = Vec::new();
    for (site_m, direction) in sites(rng, &slab) {
        for _ in 0..rng.random_range(1..=2) {
            pokes.push(PokePlan {
                site_m,
                direction,
                radius_m: TIP_RADIUS_M,
                depth_m: rng.random_range(0.0015..0.003),
                rate_m_s: log_uniform(rng, 0.001, 0.008),
                hold_s: rng.random_range(1.0..4.0),
            });
        }
    }
    Draw {
        name: format!("draw-{seed}"),
        seed,
        slab,
        poisson_ratio: 0.47,
        young_modulus_pa,
        modulus_range_pa: [5e3, 2e4],
        restraints,
        pokes,
        kinematics: Kinematics::SmallStrain,
        instruments: Instruments::default(),
        fit_cell_m: 0.0065,
    }
}

/// Tip centres with the directions into the phantom: one on a side, the others on top and apart from each other.
fn sites(rng: &mut impl Rng, slab: &Slab) -> Vec<([f64; 3], [f64; 3])> {
    let size = slab.size_m;
    let inset = TIP_RADIUS_M + MARGIN_M;
    let inside = |rng: &mut dyn Rng, axis: usize| rng.random_range(inset..size[axis] - inset);
    let count = rng.random_range(3..=5);
    let mut sites: Vec<([f64; 3], [f64; 3])> = Vec::with_capacity(count);
    for _ in 0..TRIES {
        let site = [inside(rng, 0), inside(rng, 1), size[2]];
        let clear = |other: &([f64; 3], [f64; 3])| distance(site, other.0) > 2.0 * TIP_RADIUS_M;
        if sites.len() + 1 < count && sites.iter().all(clear) {
            sites.push((site, [0.0, 0.0, -1.0]));
        }
    }
    let (axis, high) = (rng.random_range(0..2), rng.random_bool(0.5));
    // The thinnest slab leaves the tip just room on its side.
    let clearance = 0.5 * size[2] - inset;
    let mut site = [inside(rng, 0), inside(rng, 1), 0.5 * size[2] + rng.random_range(-0.9..0.9) * clearance];
    site[axis] = if high { size[axis] } else { 0.0 };
    let mut direction = [0.0; 3];
    direction[axis] = if high { -1.0 } else { 1.0 };
    sites.insert(rng.random_range(0..=sites.len()), (site, direction));
    sites
}

/// None to three restraints on the search surface, now and then a glued spot among them.
fn restraints(rng: &mut impl Rng, slab: &Slab) -> Vec<Restraint> {
    let count = rng.random_range(0..=3);
    let glued = count > 0 && rng.random_bool(0.2);
    let mut placed: Vec<([f64; 3], f64)> = Vec::new();
    let mut restraints = Vec::new();
    for which in 0..count {
        let spot = glued && which == 0;
        let radius = if spot { rng.random_range(0.008..0.012) } else { PATCH_RADIUS_M };
        let inset = radius + MARGIN_M;
        for _ in 0..TRIES {
            let centre_m = [
                rng.random_range(slab.glue_end_m + inset..slab.size_m[0] - inset),
                rng.random_range(inset..slab.size_m[1] - inset),
                0.0,
            ];
            let clear = |&(other, r): &([f64; 3], f64)| {
                distance(centre_m, other) > APART_M.max(r + radius + 0.5 * APART_M)
            };
            if placed.iter().all(clear) {
                placed.push((centre_m, radius));
                let stiffness_n_per_m = log_uniform(rng, 20.0, 300.0);
                restraints.push(if spot {
                    Restraint::Glued { centre_m, radius_m: radius }
                } else {
                    Restraint::Springs { centre_m, radius_m: radius, stiffness_n_per_m }
                });
                break;
            }
        }
    }
    restraints
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_keep_to_their_family() {
        let (mut bare, mut glued) = (0, 0);
        for seed in 0..400 {
            let d = draw(seed);
            assert_eq!(d, draw(seed));
            assert!((6e3..18e3).contains(&d.young_modulus_pa));
            let on_side = |p: &&PokePlan| p.direction[2] == 0.0;
            let sites: std::collections::BTreeSet<[u64; 3]> =
                d.pokes.iter().map(|p| p.site_m.map(f64::to_bits)).collect();
            assert!((3..=5).contains(&sites.len()), "seed {seed}: {} sites", sites.len());
            assert!(d.pokes.iter().any(|p| on_side(&p)));
            for p in &d.pokes {
                assert!(p.patch(&d).is_ok(), "seed {seed}: {p:?}");
                for a in (0..3).filter(|&a| p.direction[a] == 0.0) {
                    let gap = p.site_m[a].min(d.slab.size_m[a] - p.site_m[a]) - TIP_RADIUS_M;
                    assert!(gap > MARGIN_M - 1e-9, "seed {seed}: {gap} m from an edge");
                }
            }
            for (i, r) in d.restraints.iter().enumerate() {
                assert!(r.patch(&d.slab).is_ok());
                let (Restraint::Springs { centre_m, .. } | Restraint::Glued { centre_m, .. }) = r;
                assert!(centre_m[0] > d.slab.glue_end_m + PATCH_RADIUS_M);
                for other in &d.restraints[..i] {
                    let (Restraint::Springs { centre_m: there, .. }
                    | Restraint::Glued { centre_m: there, .. }) = other;
                    assert!(distance(*centre_m, *there) >= APART_M);
                }
                glued += usize::from(matches!(r, Restraint::Glued { .. }));
            }
            bare += usize::from(d.restraints.is_empty());
        }
        assert!((50..150).contains(&bare) && (30..100).contains(&glued), "{bare} bare, {glued} glued");
    }
}
