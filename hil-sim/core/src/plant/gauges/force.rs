//! The sixth channel: the tangential force of the base sensor.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::stream;
use super::stream::Stream;
use super::{CODES, MID_RAIL_CODE, SCAN_RATE_HZ, SNR_BAND_HZ, VOLTS_FULL_SCALE, code};
use crate::scene::Force;

/// Standard deviation of the channel's noise in 0–500 Hz, in N, where the gauges have noise: a guess.
pub const NOISE_N: f64 = 0.002;

/// The channel and its noise.
#[derive(Clone, Debug)]
pub struct ForceChannel {
    /// None if it is not wired.
    codes_per_n: Option<f64>,
    noise_n: f64,
    noise: Xoshiro256PlusPlus,
}

impl ForceChannel {
    /// The channel of a scene, with noise or without.
    pub fn new(force: &Force, noisy: bool, seed: u64) -> Self {
        // White up to half the scan rate.
        let scan_noise_n = NOISE_N * (f64::from(SCAN_RATE_HZ) / 2.0 / SNR_BAND_HZ).sqrt();
        Self {
            codes_per_n: force
                .present
                .then(|| CODES / VOLTS_FULL_SCALE / force.n_per_v),
            noise_n: if noisy { scan_noise_n } else { 0.0 },
            noise: stream::draws(seed, Stream::Force),
        }
    }

    /// The code of `force_n`, positive above mid-rail; mid-rail if the channel is not wired.
    #[inline]
    pub fn scan(&mut self, force_n: f64) -> u16 {
        let Some(codes_per_n) = self.codes_per_n else {
            return code(MID_RAIL_CODE);
        };
        let mut measured_n = force_n;
        if self.noise_n > 0.0 {
            let sample: f64 = StandardNormal.sample(&mut self.noise);
            measured_n += self.noise_n * sample;
        }
        code(MID_RAIL_CODE + (measured_n * codes_per_n) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODES_PER_V: f64 = 4096.0 / 3.3;

    #[test]
    fn the_force_lies_over_mid_rail_in_its_scale_and_clips() {
        let mut channel = ForceChannel::new(
            &Force {
                present: true,
                n_per_v: 0.5,
                ..Force::default()
            },
            false,
            1,
        );
        for (force_n, code) in [
            (0.0, 2048.0),
            (0.3, 2048.0 + 0.6 * CODES_PER_V),
            (-0.3, 2048.0 - 0.6 * CODES_PER_V),
            (9.0, 4095.0),
            (-9.0, 0.0),
        ] {
            assert_eq!(f64::from(channel.scan(force_n)), f64::floor(code));
        }
        let mut absent = ForceChannel::new(&Force::default(), true, 1);
        assert_eq!(absent.scan(0.3), 2048);
    }

    #[test]
    fn the_noise_has_two_millinewton_in_its_band() {
        let force = Force {
            present: true,
            n_per_v: 0.05,
            ..Force::default()
        };
        let mut channel = ForceChannel::new(&force, true, 1);
        let scans = 40_000;
        let power = (0..scans)
            // floor takes half a code off.
            .map(|_| f64::from(channel.scan(0.0)) - 2047.5)
            .map(|codes| (codes / CODES_PER_V * 0.05).powi(2))
            .sum::<f64>()
            / f64::from(scans);
        // A quarter of it lies in 0–500 of 2000 Hz. σ of an RMS over 40 000 is 0.35 %; 4 σ. Rounding to
        // 40 µN adds nothing.
        let in_band_n = (power / 4.0).sqrt();
        assert!((in_band_n / 0.002 - 1.0).abs() < 0.014, "{in_band_n} N");
    }
}
