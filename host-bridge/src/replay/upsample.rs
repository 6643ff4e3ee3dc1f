//! From 1 kHz samples to the 4 kHz that an ADC scans at.
//!
//! A straight line between samples would weaken 200 Hz by an eighth and add images above 500 Hz; a sinc
//! under a Kaiser window passes what lies below 450 Hz within 0.1 % and adds nothing.

use std::f64::consts::PI;

/// Scans for a sample.
pub const SCANS: usize = 4;
/// Samples on either side that a scan depends on: the window's length makes the sinc's edge 50 Hz wide.
const REACH: usize = 48;
/// The Kaiser window's shape, for 60 dB.
const BETA: f64 = 5.65;

/// The weights of the samples around a scan, by how many scans it is after a sample.
pub struct Upsampler {
    weights: [[f64; 2 * REACH]; SCANS],
}

impl Default for Upsampler {
    fn default() -> Self {
        Self {
            weights: std::array::from_fn(weights),
        }
    }
}

fn weights(scan: usize) -> [f64; 2 * REACH] {
    let after = scan as f64 / SCANS as f64;
    let raw: [f64; 2 * REACH] = std::array::from_fn(|at| {
        let distance = at as f64 - (REACH - 1) as f64 - after;
        sinc(distance) * kaiser(distance / REACH as f64)
    });
    let sum: f64 = raw.iter().sum();
    raw.map(|weight| weight / sum)
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

/// The Kaiser window, 1 at 0, up to a constant factor; 0 outside of −1 to 1.
fn kaiser(x: f64) -> f64 {
    if x.abs() > 1.0 {
        0.0
    } else {
        bessel_i0(BETA * (1.0 - x * x).sqrt()) / bessel_i0(BETA)
    }
}

/// The modified Bessel function of the first kind and order 0, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    for k in 1..40 {
        term *= (x / 2.0 / f64::from(k)).powi(2);
        sum += term;
    }
    sum
}

impl Upsampler {
    /// The value `scan` quarters of a sample's time after sample `index`; beyond either end the samples
    /// are taken to go on as the last one.
    pub fn value(
        &self,
        samples: impl Fn(usize) -> f64,
        count: usize,
        index: usize,
        scan: usize,
    ) -> f64 {
        if scan == 0 {
            return samples(index);
        }
        self.weights[scan]
            .iter()
            .enumerate()
            .map(|(at, weight)| {
                let place = (index + at + 1).saturating_sub(REACH).min(count - 1);
                weight * samples(place)
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest error of scans made from samples of a sine of `hz`, relative to its amplitude.
    fn error(hz: f64) -> f64 {
        let upsampler = Upsampler::default();
        let sine = |ms: f64| (2.0 * PI * hz * ms / 1_000.0 + 0.3).sin();
        let mut worst = 0.0_f64;
        for index in 100..300 {
            for scan in 0..SCANS {
                let value = upsampler.value(|at| sine(at as f64), 400, index, scan);
                worst = worst.max((value - sine(index as f64 + scan as f64 / 4.0)).abs());
            }
        }
        worst
    }

    #[test]
    fn what_a_fingertip_says_is_kept() {
        // 60 dB is what the window is made for.
        for hz in [0.0, 5.0, 50.0, 200.0, 400.0, 450.0] {
            assert!(error(hz) < 1e-3, "{hz} Hz: {}", error(hz));
        }
    }

    #[test]
    fn samples_themselves_and_a_constant_are_kept_exactly_to_the_ends() {
        let upsampler = Upsampler::default();
        let samples = [3.0, 3.0, 3.0, 3.0];
        for index in 0..4 {
            for scan in 0..SCANS {
                let value = upsampler.value(|at| samples[at], 4, index, scan);
                assert!((value - 3.0).abs() < 1e-12);
            }
        }
    }
}
