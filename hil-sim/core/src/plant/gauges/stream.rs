//! Independent streams of random numbers from a scene's one seed.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// What is drawn from a stream of its own, so that switching one on changes no other.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stream {
    /// The gauges' white noise.
    White,
    /// Their 1/f noise.
    Pink,
    /// The noise of gauges that are broken.
    Broken,
    /// The force channel's noise.
    Force,
}

/// The generator of a stream; they lie 2¹⁹² draws apart.
pub(super) fn draws(seed: u64, stream: Stream) -> Xoshiro256PlusPlus {
    let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
    for _ in 0..stream as u32 {
        draws.long_jump();
    }
    draws
}
