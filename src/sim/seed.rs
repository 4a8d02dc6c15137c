//! Independent streams of random numbers from one seed.

use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::SeedableRng;

/// What a stream is for: adding a use must not change the numbers of another.
#[derive(Debug, Clone, Copy)]
pub(super) enum Use {
    Draw = 1,
    FitMesh = 2,
    MarkerSites = 3,
    Stage = 4,
    Wrench = 5,
    Camera = 6,
    Phantom = 7,
    Conceal = 8,
}

/// The stream of `seed` for one use.
pub(super) fn stream(seed: u64, purpose: Use) -> ChaCha12Rng {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    rng.set_stream(purpose as u64);
    rng
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn a_stream_is_its_own_and_repeats() {
        let first = |seed, purpose| -> u64 { stream(seed, purpose).random() };
        assert_eq!(first(7, Use::Stage), first(7, Use::Stage));
        assert_ne!(first(7, Use::Stage), first(7, Use::Wrench));
        assert_ne!(first(7, Use::Stage), first(8, Use::Stage));
    }
}
