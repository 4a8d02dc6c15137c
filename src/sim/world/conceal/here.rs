//! A world that conceals an effect on a bench that is there: phantom, pokes and instruments stay.

use super::effects::{ENTRIES, Entry, effect, either_sign, log_uniform};
use super::springs;
use crate::sim::seed::{Use, stream};
use crate::sim::world::phantom::Disc;
use crate::sim::world::plan::{Hold, World};
use rand::RngExt;

/// A band's centre is this far from the glue and from the edges, at least (m).
const INSET_M: f64 = 0.012;

/// Faults of a camera that tells where markers are.
const OF_TOLD_MARKERS: [Entry; 3] = [Entry::CameraMisalignment, Entry::CameraScale, Entry::CameraLag];

impl World {
    /// The same bench with another modulus, with its bands elsewhere and of other stiffness, and with one effect of the catalogue instead of
    /// those that it had. Entries that show only on slanted pokes are left out; so are, where markers are found `in_pictures`, those of a camera
    /// that tells positions: pictures have a pose and a lens instead, and how late they come is found and taken off.
    ///
    /// # Panics
    /// When it has less than three pokes.
    #[must_use]
    pub fn concealing(mut self, seed: u64, in_pictures: bool) -> Self {
        let rng = &mut stream(seed, Use::Conceal);
        self.seed = seed;
        self.young_modulus_pa = log_uniform(rng, 7e3, 15e3);
        let [length, width, _] = self.phantom.slab.size_m;
        for patch in &mut self.phantom.patches {
            let centre_m = [
                rng.random_range(self.phantom.slab.glue_end_m + INSET_M..length - INSET_M),
                rng.random_range(0.25 * width..0.75 * width),
                patch.centre_m[2],
            ];
            *patch = Disc { centre_m, ..*patch };
        }
        self.holds = (0..self.phantom.patches.len()).map(|patch| springs(rng, patch)).collect();
        let has_springs = self.holds.iter().any(|hold| matches!(hold, Hold::Springs { .. }));
        let entry = loop {
            let entry = ENTRIES[rng.random_range(0..ENTRIES.len())];
            let needs_springs = matches!(entry, Entry::SlackBand | Entry::BandViscosity);
            if entry != Entry::TipSlip
                && (has_springs || !needs_springs)
                && !(in_pictures && OF_TOLD_MARKERS.contains(&entry))
            {
                break entry;
            }
        };
        self.effects.clear();
        match effect(rng, entry, &self.phantom, &self.pokes) {
            Some(effect) => self.effects.push(effect),
            // What is stated stays; the phantom is another.
            None => {
                let size = log_uniform(rng, 0.01, 0.02);
                self.phantom.poisson_ratio = self.stated_poisson_ratio + either_sign(rng, size);
            }
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::world::effect::check;
    use crate::sim::world::{Answer, stock::stock};
    use std::collections::BTreeSet;

    /// Equal seeds, equal worlds; each conceals one entry, every entry but slip comes up, and nothing that the bench refuses.
    #[test]
    fn a_bench_conceals_one_entry_and_is_poked_as_before() {
        let bench = World { phantom: stock(1, 0), ..World::draw(3, 1, 1) };
        let (mut met, mut seen) = (BTreeSet::new(), BTreeSet::new());
        for seed in 0..400 {
            let world = bench.clone().concealing(seed, false);
            assert_eq!(world, bench.clone().concealing(seed, false));
            assert_eq!(check(&world), Ok(()), "seed {seed}");
            let answer = Answer::of(&world);
            assert_eq!(answer.physics.len(), 1, "seed {seed}");
            assert_eq!((&world.pokes, &world.instruments), (&bench.pokes, &bench.instruments));
            assert!(world.phantom.patches.iter().all(|p| p.centre_m[0] > world.phantom.slab.glue_end_m));
            met.extend(answer.physics);
            seen.extend(Answer::of(&bench.clone().concealing(seed, true)).physics);
        }
        assert_eq!(met.len(), ENTRIES.len() - 1, "{met:?}");
        assert!(seen.is_subset(&met) && seen.len() == met.len() - OF_TOLD_MARKERS.len(), "{seen:?}");
    }
}
