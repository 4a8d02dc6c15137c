//! A stock of phantoms: slabs with sites, patches and spots enough for many different sessions.

use super::phantom::{Disc, PhantomPlan, Site};
use crate::sim::hex_mesh::Slab;
use crate::sim::seed::{Use, stream};
use rand::{Rng, RngExt};

/// Radius of a tip and of a spring patch (m).
const TIP_RADIUS_M: f64 = 0.008;
const PATCH_RADIUS_M: f64 = 0.005;
/// Tips on sides, patches and spots keep this distance from edges, and patches from the glue (m).
const MARGIN_M: f64 = 0.002;
/// Tips on top keep this distance from edges: a deep poke beside an edge bulges it out, which takes many more boxes.
const TOP_MARGIN_M: f64 = 0.006;
/// Places on top, on sides and under the slab, spots.
const ON_TOP: usize = 8;
const ON_SIDES: usize = 2;
const PATCHES: usize = 6;
const SPOTS: usize = 1;
/// How often a place is tried before it is left out.
const TRIES: usize = 400;

/// The phantom number `index` of the stock of `seed`: a slab of 150 × 100 × 25 mm ± 20 %, glued for a third to a half of
/// its length, of Poisson's ratio 0.45 to 0.485.
pub fn stock(seed: u64, index: u64) -> PhantomPlan {
    let own = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(index);
    let rng = &mut stream(own, Use::Phantom);
    let size_m = [0.15, 0.1, 0.025].map(|l| l * rng.random_range(0.8..1.2));
    let slab = Slab { size_m, glue_end_m: size_m[0] * rng.random_range(0.33..0.45) };
    // The two halves of the top get as many sites each: over the glue and over the free part.
    let mut sites: Vec<Site> = Vec::new();
    for which in 0..ON_TOP {
        let inset = TIP_RADIUS_M + TOP_MARGIN_M;
        let (low, high) =
            if which % 2 == 0 { (inset, slab.glue_end_m) } else { (slab.glue_end_m, size_m[0] - inset) };
        for _ in 0..TRIES {
            let centre_m =
                [rng.random_range(low..high), rng.random_range(inset..size_m[1] - inset), size_m[2]];
            if sites.iter().all(|s| distance(s.centre_m, centre_m) > 2.0 * TIP_RADIUS_M) {
                sites.push(Site { centre_m, inward: [0.0, 0.0, -1.0], radius_m: TIP_RADIUS_M });
                break;
            }
        }
    }
    for axis in 0..ON_SIDES {
        sites.push(on_side(rng, &slab, axis));
    }
    let mut taken: Vec<Disc> = Vec::new();
    let spots = (0..SPOTS).filter_map(|_| {
        let radius_m = rng.random_range(0.008..0.012);
        underneath(rng, &slab, radius_m, &mut taken)
    });
    let spots: Vec<Disc> = spots.collect();
    let patches: Vec<Disc> =
        (0..PATCHES).filter_map(|_| underneath(rng, &slab, PATCH_RADIUS_M, &mut taken)).collect();
    PhantomPlan {
        seed: own,
        slab,
        poisson_ratio: rng.random_range(0.45..0.485),
        sites,
        patches,
        spots,
        marker_spacing_m: 0.011,
    }
}

/// A site in the middle of the height of a side whose normal is along `axis`.
fn on_side(rng: &mut impl Rng, slab: &Slab, axis: usize) -> Site {
    let inset = TIP_RADIUS_M + MARGIN_M;
    let size = slab.size_m;
    // The thinnest slab leaves a tip just room on its side.
    let clearance = 0.9 * (0.5 * size[2] - inset).max(0.0);
    let mut centre_m: [f64; 3] = std::array::from_fn(|a| match a {
        2 => 0.5 * size[2] + clearance * rng.random_range(-1.0..1.0),
        _ => rng.random_range(inset..size[a] - inset),
    });
    let high = rng.random_bool(0.5);
    centre_m[axis] = if high { size[axis] } else { 0.0 };
    let mut inward = [0.0; 3];
    inward[axis] = if high { -1.0 } else { 1.0 };
    Site { centre_m, inward, radius_m: TIP_RADIUS_M }
}

/// A disc on the search surface, clear of those that are `taken`, to which it is added.
fn underneath(rng: &mut impl Rng, slab: &Slab, radius_m: f64, taken: &mut Vec<Disc>) -> Option<Disc> {
    let inset = radius_m + MARGIN_M;
    for _ in 0..TRIES {
        let x = rng.random_range(slab.glue_end_m + inset..slab.size_m[0] - inset);
        let disc = Disc { centre_m: [x, rng.random_range(inset..slab.size_m[1] - inset), 0.0], radius_m };
        let clear =
            |other: &Disc| distance(other.centre_m, disc.centre_m) > other.radius_m + radius_m + MARGIN_M;
        if taken.iter().all(clear) {
            taken.push(disc);
            return Some(disc);
        }
    }
    None
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_phantom_has_room_for_its_places() {
        for index in 0..60 {
            let plan = stock(5, index);
            assert_eq!(plan, stock(5, index));
            assert_eq!((plan.patches.len(), plan.spots.len()), (PATCHES, SPOTS), "phantom {index}");
            assert!(plan.sites.len() >= ON_TOP, "phantom {index}: {} sites", plan.sites.len());
            assert!(plan.discs().is_ok(), "phantom {index}");
        }
        assert_ne!(stock(5, 1).slab, stock(6, 1).slab);
    }
}
