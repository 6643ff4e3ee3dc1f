//! Noise of 1/f, as amplifiers and gels have it.
//!
//! White noise through one-pole low-passes with corners a factor of four apart, each weighted by its
//! corner to the power of −½: their sum falls by 10 dB a decade between [`LOWEST_HZ`] and
//! [`HIGHEST_HZ`], is level below and steeper above.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::SCAN_RATE_HZ;

const POLES: usize = 7;
const SPACING: f64 = 4.0;
/// The lowest corner, in Hz.
pub const LOWEST_HZ: f64 = 0.25;
/// The highest corner, in Hz: 1024.
pub const HIGHEST_HZ: f64 = 1024.0;
const _: () = assert!(LOWEST_HZ * 4096.0 == HIGHEST_HZ);
/// Time constants of the lowest corner until the noise has forgotten its start.
const WARM_UP: f64 = 5.0;

/// The filter's coefficients, for all gauges.
#[derive(Clone, Copy, Debug)]
pub struct Pink {
    keep: [f32; POLES],
    weight: [f32; POLES],
}

/// One gauge's filter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Poles([f32; POLES]);

impl Pink {
    /// Noise whose RMS, over all frequencies, is `rms`.
    pub fn new(rms: f64) -> Self {
        let corner_hz: [f64; POLES] = std::array::from_fn(|i| LOWEST_HZ * SPACING.powi(i as i32));
        let keep = corner_hz.map(|hz| libm::exp(-TAU * hz / f64::from(SCAN_RATE_HZ)));
        let weight: [f64; POLES] = std::array::from_fn(|i| (1.0 - keep[i]) / corner_hz[i].sqrt());
        // Σ over scans of one pole's answer times another's is 1/(1 − product).
        let mut power = 0.0;
        for i in 0..POLES {
            for j in 0..POLES {
                power += weight[i] * weight[j] / (1.0 - keep[i] * keep[j]);
            }
        }
        let scale = rms / power.sqrt();
        Self {
            keep: keep.map(|keep| keep as f32),
            weight: weight.map(|weight| (weight * scale) as f32),
        }
    }

    /// A gauge's filter, run in.
    pub fn start(&self, noise: &mut Xoshiro256PlusPlus) -> Poles {
        let mut poles = Poles::default();
        let scans = WARM_UP / (TAU * LOWEST_HZ) * f64::from(SCAN_RATE_HZ);
        for _ in 0..scans as u32 {
            self.step(&mut poles, noise);
        }
        poles
    }

    /// The next scan's noise.
    #[inline]
    pub fn step(&self, poles: &mut Poles, noise: &mut Xoshiro256PlusPlus) -> f32 {
        let white: f32 = StandardNormal.sample(noise);
        let mut sum = 0.0;
        for ((pole, keep), weight) in poles.0.iter_mut().zip(self.keep).zip(self.weight) {
            *pole = *pole * keep + white * weight;
            sum += *pole;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn the_noise_falls_by_ten_decibels_a_decade() {
        let pink = Pink::new(1.0);
        // Its spectrum, in closed form: |Σ weight / (1 − keep · e^(−jω))|².
        let density = |hz: f64| {
            let omega = TAU * hz / f64::from(SCAN_RATE_HZ);
            let (mut real, mut imaginary) = (0.0, 0.0);
            for (keep, weight) in pink.keep.into_iter().zip(pink.weight) {
                let (re, im) = (
                    1.0 - f64::from(keep) * omega.cos(),
                    f64::from(keep) * omega.sin(),
                );
                let size = re * re + im * im;
                real += f64::from(weight) * re / size;
                imaginary -= f64::from(weight) * im / size;
            }
            real * real + imaginary * imaginary
        };
        // A pole from either end, 1/f within a decibel.
        let mut hz = 1.0;
        while hz <= 256.0 {
            let off_db = 10.0 * (density(hz) * hz / (density(16.0) * 16.0)).log10();
            assert!(off_db.abs() < 1.0, "{hz} Hz: {off_db} dB");
            hz *= 1.3;
        }
    }

    #[test]
    fn the_noise_has_its_rms_from_the_first_scan_on() {
        let pink = Pink::new(0.1);
        let mut noise = Xoshiro256PlusPlus::seed_from_u64(1);
        let starts = 400;
        let power = (0..starts)
            .map(|_| {
                let mut poles = pink.start(&mut noise);
                f64::from(pink.step(&mut poles, &mut noise)).powi(2)
            })
            .sum::<f64>()
            / f64::from(starts);
        // χ² with 400 degrees of freedom: σ = √(2/400) = 7 %; 4 σ.
        assert!((power / 0.01 - 1.0).abs() < 0.28, "{power}");
    }
}
