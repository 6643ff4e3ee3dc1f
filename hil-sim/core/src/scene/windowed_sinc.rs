//! What lies between even samples of something band-limited: a sinc under a Kaiser window.
//!
//! The kernel is 1 at its own sample and 0 at every other, so an instant on a sample has the sample's value. Of
//! tones up to 0.96 of half the sample rate it makes the same tones within 2e-4 of their amplitude, whatever the
//! instants; of white noise it leaves 0.98 of the power and more. What jumps from one sample to the next is not
//! band-limited: between the samples beside it the value swings by 0.15 of the step at most, by 0.02 from 7 samples
//! on and by 0.01 from 13 on.

use std::sync::LazyLock;

use firmware_sensor::decimate::{kaiser, sinc};

/// Samples on either side that a value depends on.
pub const REACH: usize = 64;
/// Places between two samples for which the kernel is stored. Straight lines between them are off by
/// (π / 512)² / 8 = 4.7e-6 of a tone's amplitude at most: of 1.65 V a hundredth of the ADC's step.
const PLACES: usize = 512;

/// The weights of the samples around a place, the earliest first: [`REACH`] before it and as many behind it.
type Taps = [f64; 2 * REACH];

static TABLE: LazyLock<Vec<Taps>> = LazyLock::new(|| {
    let table = (0..=PLACES).map(|place| exactly(place as f64 / PLACES as f64));
    table.collect()
});

/// The weights for a place `share` of the way from one sample to the next, 0 to 1. Their sum is 1: a level stays.
pub fn taps(share: f64) -> Taps {
    let place = share * PLACES as f64;
    let below = (place as usize).min(PLACES - 1);
    let above = place - below as f64;
    let [low, high] = [&TABLE[below], &TABLE[below + 1]];
    std::array::from_fn(|tap| low[tap] + above * (high[tap] - low[tap]))
}

fn exactly(share: f64) -> Taps {
    let mut taps: Taps = std::array::from_fn(|tap| {
        let distance = (tap + 1) as f64 - REACH as f64 - share;
        sinc(distance) * kaiser(distance / REACH as f64)
    });
    let sum: f64 = taps.iter().sum();
    for tap in &mut taps {
        *tap /= sum;
    }
    taps
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// What is made of samples of `wave` at `share` of the way from 0 to the next.
    fn between(wave: impl Fn(f64) -> f64, share: f64) -> f64 {
        let samples = (1..).map(|tap| f64::from(tap) - REACH as f64);
        let products = taps(share).into_iter().zip(samples);
        products.map(|(tap, at)| tap * wave(at)).sum()
    }

    /// Shares from 0 to 1, on and between the stored ones.
    fn shares() -> impl Iterator<Item = f64> {
        (0..=1_000).map(|share| f64::from(share) / 1_000.0)
    }

    #[test]
    fn a_sample_has_its_own_value_and_a_level_stays() {
        let samples = |at: f64| if at == 0.0 { 1.0 } else { 1e3 * at };
        assert!((between(samples, 0.0) - 1.0).abs() < 1e-9);
        assert!((between(samples, 1.0) - 1e3).abs() < 1e-9);
        for share in shares() {
            assert!((between(|_| 1.65, share) - 1.65).abs() < 1e-12, "{share}");
        }
    }

    #[test]
    fn tones_up_to_096_of_half_the_rate_stay_as_they_are() {
        for half_rates in [0.01, 0.3, 0.7, 0.9, 0.95, 0.96] {
            for share in shares() {
                for phase in [0.0, 1.0, 2.0] {
                    let tone = |at: f64| (0.5 * TAU * half_rates * at + phase).sin();
                    let off = between(tone, share) - tone(share);
                    assert!(off.abs() < 2e-4, "{half_rates}, {share}: {off}");
                }
            }
        }
    }

    #[test]
    fn white_noise_keeps_its_power() {
        for share in shares() {
            let power: f64 = taps(share).iter().map(|tap| tap * tap).sum();
            assert!((0.98..1.000_1).contains(&power), "{power} at {share}");
        }
    }

    #[test]
    fn beside_a_step_it_swings_no_more_than_stated() {
        for (after, most) in [(0, 0.15), (7, 0.02), (13, 0.01)] {
            for samples in after..REACH as u32 {
                // A step from 0 to 1 so many samples ago.
                let step = |at: f64| f64::from(u8::from(at >= -f64::from(samples)));
                for share in shares() {
                    let swing = between(step, share) - 1.0;
                    assert!(swing.abs() < most, "{swing}, {samples} + {share} after");
                }
            }
        }
    }
}
