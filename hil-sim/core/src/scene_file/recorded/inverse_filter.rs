//! `filtered = true`: from samples that the sensor's own filter has made back to what stood at the ADC's pins.
//!
//! Samples of 1 kHz do not tell all of what was scanned at 4 kHz: the sensor's anti-aliasing filter has taken
//! most of what lay above 500 Hz. Of all that could have stood at the pins, the smallest is taken that the
//! filter turns into these very samples: with H the filter, this is H/(H(f)² + H(1 kHz − f)²) at each frequency f.
//! Noise is added of which the filter leaves nothing, as much as the samples have between 300 and 450 Hz,
//! where a fingertip is silent: the sensor measures its gauges' noise above 1 kHz, and would take its absence
//! for a surface that no wave explains.

use std::f64::consts::PI;

use firmware_sensor::decimate::{AntiAlias, History};
use firmware_sensor::{MID_RAIL_CODE, SCANS_PER_SAMPLE, Scan};
use protocol::CHANNELS;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::plant::gauges::SCAN_RATE_HZ;
use crate::scene::Series;

/// Scans that a sample depends on, and the one of them that it belongs to.
const TAPS: usize = 32;
const MIDDLE: i64 = TAPS as i64 / 2;
const SCANS: i64 = SCANS_PER_SAMPLE as i64;
/// Samples on either side that a scan is made of: the weights fall by six from one to the next.
const REACH: i64 = 16;
/// Samples that are looked at for noise at a time, and those of their frequencies, in bins of 1 kHz / 64.
const WINDOW: usize = 64;
const NOISE_BINS: std::ops::RangeInclusive<usize> = 20..=28;
/// Samples over which the noise is taken to be the same.
const PIECE: usize = 4_096;
/// Variance of an ADC's own rounding, in steps²: the scene's ADC brings its own.
const ROUNDING: f64 = 1.0 / 12.0;

/// Steps of the ADC, and one of them in V.
const STEPS: f64 = 4_096.0;
const VOLTS_PER_STEP: f64 = 3.3 / STEPS;

/// The filter's coefficients, the newest scan's first.
type Filter = [f64; TAPS];

/// The voltages at the pins of which the filter makes these, sample for sample: four rows for each but the
/// last, at the ADC's instants.
///
/// The ADC rounds down: half a step more, so that what comes out is rounded to the nearest.
pub fn at_the_pins(samples: &Series) -> Series {
    let inverse = InverseFilter::default();
    let scans: Vec<Vec<f64>> = (0..samples.width)
        .map(|column| {
            let values = samples.values.iter().skip(column).step_by(samples.width);
            let steps: Vec<f64> = values.map(|volts| volts / VOLTS_PER_STEP).collect();
            inverse.scans(&steps, column as u64)
        })
        .collect();
    let rate_hz = f64::from(SCAN_RATE_HZ);
    let count = (samples.at.len() * SCANS_PER_SAMPLE).saturating_sub(SCANS_PER_SAMPLE - 1);
    // A board's clock tells whole µs.
    let first = samples
        .at
        .first()
        .map_or(0.0, |first_s| (first_s * rate_hz).round());
    let volts = |scan: usize| {
        let row = scans.iter().map(move |scans| scans[scan]);
        row.map(|steps| (steps + 0.5).clamp(0.0, STEPS) * VOLTS_PER_STEP)
    };
    Series {
        at: (0..count)
            .map(|scan| (first + scan as f64) / rate_hz)
            .collect(),
        values: (0..count).flat_map(volts).collect(),
        width: samples.width,
    }
}

struct InverseFilter {
    filter: Filter,
    /// Weight of a sample in the scan that lies so many scans after it, from −4 · [`REACH`] on.
    weights: Vec<f64>,
    /// Power of white noise of variance 1, scanned, in each of [`NOISE_BINS`] of the samples.
    noise_power: Vec<f64>,
}

impl Default for InverseFilter {
    fn default() -> Self {
        let filter = filter();
        let overlap = |lag: i64| -> f64 {
            (0..TAPS as i64)
                .map(|at| tap(&filter, at) * tap(&filter, at + SCANS * lag))
                .sum()
        };
        let inverse = inverse(overlap);
        let weights = (-SCANS * REACH..=SCANS * REACH)
            .map(|after| {
                let lags = -(inverse.len() as i64 / 2)..;
                lags.zip(&inverse)
                    .map(|(lag, weight)| weight * tap(&filter, MIDDLE - after + SCANS * lag))
                    .sum()
            })
            .collect();
        let noise_power = NOISE_BINS
            .map(|bin| {
                let turn = 2.0 * PI * bin as f64 / WINDOW as f64;
                (-REACH..=REACH)
                    .map(|lag| overlap(lag) * (turn * lag as f64).cos())
                    .sum()
            })
            .collect();
        Self {
            filter,
            weights,
            noise_power,
        }
    }
}

/// The coefficients as the firmware's own filter answers a single scan.
fn filter() -> Filter {
    const HEIGHT: u16 = 2_000;
    let rest: [Scan; SCANS_PER_SAMPLE] = [[MID_RAIL_CODE; CHANNELS]; SCANS_PER_SAMPLE];
    let anti_alias = AntiAlias::new();
    let mut taps = [0.0; TAPS];
    for place in 0..SCANS_PER_SAMPLE {
        let mut history = History::settled(&rest[0]);
        let mut pulse = rest;
        pulse[place][0] += HEIGHT;
        for group in 0..TAPS / SCANS_PER_SAMPLE {
            let scans = if group == 0 { &pulse } else { &rest };
            let sample = anti_alias.step(&mut history, scans);
            let delay = group * SCANS_PER_SAMPLE + SCANS_PER_SAMPLE - 1 - place;
            taps[delay] = f64::from(sample[0]) / f64::from(HEIGHT);
        }
    }
    taps
}

fn tap(filter: &Filter, at: i64) -> f64 {
    usize::try_from(at)
        .ok()
        .and_then(|at| filter.get(at))
        .copied()
        .unwrap_or(0.0)
}

/// The symmetric sequence whose convolution with `overlap` is 1 at lag 0 and 0 elsewhere, by conjugate
/// gradients: the spectrum's largest value is twice its smallest, so that each step takes away five sixths
/// of the error.
fn inverse(overlap: impl Fn(i64) -> f64) -> Vec<f64> {
    const LENGTH: usize = 2 * REACH as usize + 1;
    let apply = |x: &[f64]| -> Vec<f64> {
        (0..LENGTH)
            .map(|at| {
                x.iter()
                    .enumerate()
                    .map(|(other, x)| overlap(at as i64 - other as i64) * x)
                    .sum()
            })
            .collect()
    };
    let dot = |x: &[f64], y: &[f64]| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    let mut solution = vec![0.0; LENGTH];
    let mut residual = vec![0.0; LENGTH];
    residual[LENGTH / 2] = 1.0;
    let mut direction = residual.clone();
    let mut error = dot(&residual, &residual);
    while error > 1e-24 {
        let image = apply(&direction);
        let step = error / dot(&direction, &image);
        for at in 0..LENGTH {
            solution[at] += step * direction[at];
            residual[at] -= step * image[at];
        }
        let next = dot(&residual, &residual);
        for at in 0..LENGTH {
            direction[at] = residual[at] + next / error * direction[at];
        }
        error = next;
    }
    solution
}

impl InverseFilter {
    /// What stood at a pin, in steps of the ADC, four scans for a sample, the first of them at
    /// its own instant. `samples` are the same; beyond their ends they are taken to go on as the last one.
    /// Equal seeds give equal noise.
    fn scans(&self, samples: &[f64], seed: u64) -> Vec<f64> {
        let mut scans = self.smallest(samples);
        let mut noise = self.noise(samples, seed);
        let rest = self.smallest(&self.filtered(&noise));
        for ((scan, noise), rest) in scans.iter_mut().zip(&mut noise).zip(rest) {
            *scan += *noise - rest;
        }
        scans
    }

    /// The smallest scans that the filter turns into these samples.
    fn smallest(&self, samples: &[f64]) -> Vec<f64> {
        let last = samples.len() as i64 - 1;
        (0..samples.len() as i64 * SCANS)
            .map(|scan| {
                let near = scan.div_euclid(SCANS);
                (near - REACH + 1..=near + REACH)
                    .map(|at| {
                        let weight = self.weights[(scan - SCANS * at + SCANS * REACH) as usize];
                        weight * samples[at.clamp(0, last) as usize]
                    })
                    .sum()
            })
            .collect()
    }

    fn filtered(&self, scans: &[f64]) -> Vec<f64> {
        let last = scans.len() as i64 - 1;
        (0..scans.len() as i64 / SCANS)
            .map(|sample| {
                (0..TAPS as i64)
                    .map(|at| {
                        let scan = (SCANS * sample + MIDDLE - at).clamp(0, last);
                        self.filter[at as usize] * scans[scan as usize]
                    })
                    .sum()
            })
            .collect()
    }

    /// White noise, as much as the samples tell of.
    fn noise(&self, samples: &[f64], seed: u64) -> Vec<f64> {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
        let pieces = samples.chunks(PIECE);
        let deviations =
            pieces.map(|piece| (self.noise_variance(piece) - ROUNDING).max(0.0).sqrt());
        deviations
            .zip(samples.chunks(PIECE))
            .flat_map(|(deviation, piece)| {
                std::iter::repeat_n(deviation, piece.len() * SCANS_PER_SAMPLE)
            })
            .map(|deviation| {
                let draw: f64 = StandardNormal.sample(&mut draws);
                deviation * draw
            })
            .collect()
    }

    /// Variance of the white noise in the scans that samples were made of, in steps²: the median over the
    /// frequencies, so that a few lines of something else do not count. 0 if there are too few samples.
    fn noise_variance(&self, samples: &[f64]) -> f64 {
        // Half over each other: what the one leaves out at its ends the next has in its middle.
        let windows = || samples.windows(WINDOW).step_by(WINDOW / 2);
        let count = windows().count();
        if count == 0 {
            return 0.0;
        }
        // Hann's, whose squares sum up to 3/8 of the window's length.
        let hann: [f64; WINDOW] =
            std::array::from_fn(|at| (PI * (at as f64 + 0.5) / WINDOW as f64).sin().powi(2));
        let mut variances: Vec<f64> = NOISE_BINS
            .zip(&self.noise_power)
            .map(|(bin, power)| {
                let turn = 2.0 * PI * bin as f64 / WINDOW as f64;
                let sum: f64 = windows()
                    .map(|window| {
                        let (mut real, mut imaginary) = (0.0, 0.0);
                        for (at, (sample, weight)) in window.iter().zip(hann).enumerate() {
                            let (sine, cosine) = (turn * at as f64).sin_cos();
                            real += weight * sample * cosine;
                            imaginary += weight * sample * sine;
                        }
                        real * real + imaginary * imaginary
                    })
                    .sum();
                sum / (count as f64 * 0.375 * WINDOW as f64 * power)
            })
            .collect();
        variances.sort_by(f64::total_cmp);
        variances[variances.len() / 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(seed: u64) -> impl FnMut() -> f64 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        move || StandardNormal.sample(&mut random)
    }

    /// The difference between samples and what the filter makes of their scans, away from the ends.
    fn worst(samples: &[f64], seed: u64) -> f64 {
        let inverse = InverseFilter::default();
        let again = inverse.filtered(&inverse.scans(samples, seed));
        let inner = 32..samples.len() - 32;
        inner
            .map(|at| (again[at] - samples[at]).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn the_filter_makes_the_samples_again_of_the_scans() {
        let mut draws = normal(1);
        let noise: Vec<f64> = (0..2_000).map(|_| 100.0 * draws()).collect();
        let tone = |hz: f64| -> Vec<f64> {
            let turn = 2.0 * PI * hz / 1_000.0;
            (0..2_000)
                .map(|at| 400.0 * (turn * f64::from(at)).sin())
                .collect()
        };
        // The filter's own coefficients are of 24 bits, and its weights are cut off at 6⁻¹⁶.
        for samples in [
            noise,
            tone(5.0),
            tone(150.0),
            tone(400.0),
            vec![700.0; 2_000],
        ] {
            assert!(worst(&samples, 5) < 1e-3, "{}", worst(&samples, 5));
        }
    }

    #[test]
    fn noise_is_found_and_stands_in_the_scans_as_it_stood_there() {
        // White noise of 40 steps with a tone, scanned, filtered and taken back.
        let inverse = InverseFilter::default();
        let mut draws = normal(9);
        let scans: Vec<f64> = (0..40_000)
            .map(|at| 40.0 * draws() + 500.0 * (2.0 * PI * f64::from(at) * 35.0 / 4_000.0).sin())
            .collect();
        let again = inverse.scans(&inverse.filtered(&scans), 3);
        // The third difference, as the sensor takes it: 20 times the variance.
        let power = |scans: &[f64]| -> f64 {
            let squares = scans
                .windows(4)
                .map(|w| (w[3] - w[0] - 3.0 * (w[2] - w[1])).powi(2));
            squares.sum::<f64>() / (20.0 * scans.len() as f64)
        };
        // Power of noise is as uncertain as it is large, at each of some 5 independent frequencies in each of
        // some 156 windows: 1/√780, and a quarter more as a median. Three of these.
        let ratio = power(&again) / power(&scans);
        assert!((ratio - 1.0).abs() < 3.0 * 1.25 / 780_f64.sqrt(), "{ratio}");
    }
}
