//! The noise of each gauge, from its quiet moments in the upper part of the band that is used.
//!
//! No sensor's bandwidth promises anything above 500 Hz, nor has a recording of 1 kHz anything there. So the noise
//! is looked for in the samples behind the anti-aliasing filter, around 370 Hz: (1 − z⁻¹)⁵ (1 + z⁻¹) leaves
//! 2e-8 of the power of a tone of 36 Hz and 4e-4 at 100 Hz, relative to noise, and nothing at 500 Hz, where the
//! filter lets two kinds of noise through unlike each other: noise that is white up to 2 kHz and noise that ends at
//! 500 Hz are measured alike.
//!
//! Edges of ridges and a fingertip that sticks and slips are loud there now and then, noise always is: what counts
//! is the second quietest of the latest eight looks of 10 ms. Sharp edges leave a thousandth of their power up to 12
//! ridges a second, half a hundredth at 25.
//!
//! A sensor that ends below 200 Hz leaves no noise to measure here: the ADC's rounding is what is found then. So this
//! is no more than a lower bound of what disturbs the wave.

use protocol::GAUGES;

use crate::SAMPLE_RATE_HZ;
use crate::float::{larger, smaller};

/// Samples that a difference spans.
const SPAN: usize = 7;
/// Power gain of the difference for white noise behind the anti-aliasing filter.
const DIFFERENCE_GAIN: f32 = 76.0;
/// Samples from one difference to the next: those between say little more.
const STRIDE: usize = 2;
/// Differences in a look of 10 ms.
const IN_LOOK: u32 = SAMPLE_RATE_HZ / 100 / STRIDE as u32;
/// Looks that are kept. The second quietest of them counts.
const LOOKS: usize = 8;
/// That one's mean power for noise, relative to the mean of all.
const SECOND_OF_MEAN: f32 = 0.455;
/// Time constant in looks that its swings of two fifths are smoothed with, to a tenth.
const FOLLOWED_LOOKS: f32 = 50.0;
/// More than so many times the variance so far is another noise, and at once believed. White noise that stays as it is does
/// that once in 400 000 looks, more than an hour: seven of eight have to be beyond 1.8 times their mean.
const ANOTHER: f32 = 4.0;

/// Variances so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    /// The latest samples; `newest` is the last one's.
    samples: [[f32; GAUGES]; SPAN + 1],
    newest: usize,
    /// Samples so far, until there is a difference.
    starting: usize,
    /// Sums of the differences' squares since the last look.
    sums: [f32; GAUGES],
    taken: u32,
    /// Sums of the latest looks.
    looks: [[f32; LOOKS]; GAUGES],
    looked: usize,
    /// Looks that the variances follow, so far.
    followed: f32,
    variances: [f32; GAUGES],
}

impl Noise {
    /// Takes a millisecond's sample from behind the anti-aliasing filter, in ADC steps.
    pub fn push(&mut self, sample: &[f32; GAUGES]) {
        // A power of two, so that places are masked.
        const PLACES: usize = SPAN + 1;
        self.newest = (self.newest + 1) % PLACES;
        self.samples[self.newest] = *sample;
        // The first differences would be with nothing.
        if self.starting < SPAN - 1 {
            self.starting += 1;
            return;
        }
        if !self.newest.is_multiple_of(STRIDE) {
            return;
        }
        self.taken += 1;
        let [x0, x1, x2, _, x4, x5, x6] =
            core::array::from_fn(|age| &self.samples[(self.newest + PLACES - age) % PLACES]);
        for (gauge, sum) in self.sums.iter_mut().enumerate() {
            let difference = (x0[gauge] - x6[gauge]) - 4.0 * (x1[gauge] - x5[gauge])
                + 5.0 * (x2[gauge] - x4[gauge]);
            *sum += difference * difference;
        }
        if self.taken == IN_LOOK {
            self.look();
        }
    }

    fn look(&mut self) {
        self.taken = 0;
        let place = self.looked % LOOKS;
        self.looked += 1;
        if self.looked == 2 * LOOKS {
            self.looked = LOOKS;
        }
        for (looks, sum) in self.looks.iter_mut().zip(&mut self.sums) {
            looks[place] = core::mem::take(sum);
        }
        if self.looked < LOOKS {
            return;
        }
        self.followed = smaller(self.followed + 1.0, FOLLOWED_LOOKS);
        let follow = 1.0 / self.followed;
        for (variance, looks) in self.variances.iter_mut().zip(&self.looks) {
            const SCALE: f32 = 1.0 / (IN_LOOK as f32 * DIFFERENCE_GAIN * SECOND_OF_MEAN);
            let now = SCALE * second_least(looks);
            *variance = if now > ANOTHER * *variance {
                now
            } else {
                *variance + follow * (now - *variance)
            };
        }
    }

    /// Variance of the noise in each gauge behind the anti-aliasing filter, in ADC steps². 0 in the first 86 ms.
    pub fn variances(&self) -> [f32; GAUGES] {
        self.variances
    }
}

fn second_least(looks: &[f32; LOOKS]) -> f32 {
    let (mut least, mut second) = (f32::INFINITY, f32::INFINITY);
    for &look in looks {
        second = smaller(second, larger(look, least));
        least = smaller(least, look);
    }
    second
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decimate::{self, AntiAlias, History};
    use crate::{SCANS_PER_SAMPLE, Scan};
    use core::f64::consts::PI;
    use protocol::CHANNELS;

    const SCANS_PER_S: f64 = crate::SCAN_RATE_HZ as f64;
    const MILLISECONDS: usize = 40_000;

    /// What is measured, as a mean over time, of codes behind the anti-aliasing filter, and their variance there.
    fn measured(mut code: impl FnMut(usize) -> f64) -> (f64, f64) {
        let filter = AntiAlias::new();
        let mut scans_at = |ms: usize| -> [Scan; SCANS_PER_SAMPLE] {
            core::array::from_fn(|scan| {
                let level = 2_048.0 + code(ms * SCANS_PER_SAMPLE + scan);
                [libm::round(level) as u16; CHANNELS]
            })
        };
        let mut history = History::settled(&[2_048; CHANNELS]);
        let mut noise = Noise::default();
        let (mut sum, mut squares, mut count, mut variance) = (0.0, 0.0, 0.0, 0.0);
        for ms in 0..MILLISECONDS {
            let sample = filter.step(&mut history, &scans_at(ms));
            noise.push(&core::array::from_fn(|gauge| sample[gauge]));
            // Once the first looks are gone.
            if ms >= 1_000 {
                let x = f64::from(sample[3]);
                sum += x;
                squares += x * x;
                count += 1.0;
                variance += f64::from(noise.variances()[3]);
            }
        }
        let mean = sum / count;
        (variance / count, squares / count - mean * mean)
    }

    /// Seeded numbers of variance 1, Gaussian as far as the sum of twelve even ones is.
    fn normals() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        let mut even = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        move || (0..12).map(|_| even()).sum()
    }

    /// Rows of noise, `scans_per_row` scans apart, and what is band-limited between them: 32 rows reach 0.1 % of it.
    fn rows(scans_per_row: usize, level: f64) -> impl FnMut(usize) -> f64 {
        const REACH: usize = 32;
        let mut normal = normals();
        let mut rows = [0.0; 2 * REACH];
        let mut taken = 0;
        move |scan| {
            while taken <= scan / scans_per_row {
                rows.rotate_left(1);
                rows[2 * REACH - 1] = level * normal();
                taken += 1;
            }
            let share = (scan % scans_per_row) as f64 / scans_per_row as f64;
            let value = |(row, level): (usize, &f64)| {
                let x = row as f64 - (REACH - 1) as f64 - share;
                let hann = 0.5 * (1.0 + libm::cos(PI * x / (REACH + 1) as f64));
                let sinc = if x == 0.0 {
                    1.0
                } else {
                    libm::sin(PI * x) / (PI * x)
                };
                level * hann * sinc
            };
            rows.iter().enumerate().map(value).sum()
        }
    }

    /// The second of eight looks swings by 0.41, and in 40 s there are 500 of them without a common look: four
    /// deviations.
    const SPREAD: f64 = 4.0 * 0.41 / 22.4;
    /// What rounding to codes adds.
    const ROUNDING: f64 = decimate::NOISE_GAIN as f64 / 12.0;

    #[test]
    fn measures_white_noise_however_far_it_reaches() {
        // A row a scan, and rows of 1 kHz.
        for scans_per_row in [1, 4] {
            let (variance, want) = measured(rows(scans_per_row, 35.0));
            assert!(
                (variance / want - 1.0).abs() < SPREAD,
                "{variance} not {want} at {scans_per_row} scans a row"
            );
        }
        let (variance, _) = measured(rows(1, 35.0));
        let want = 35.0 * 35.0 * f64::from(decimate::NOISE_GAIN) + ROUNDING;
        assert!(
            (variance / want - 1.0).abs() < SPREAD,
            "{variance} not {want}"
        );
    }

    #[test]
    fn of_a_slow_sensor_only_the_rounding_is_found() {
        // Noise up to half of 36 and of 108 Hz. What a Hann window leaves beyond is below −60 dB.
        for scans_per_row in [111, 37] {
            let (variance, all) = measured(rows(scans_per_row, 230.0));
            assert!(all > 1e4, "{all}");
            assert!(variance < 2.0 * ROUNDING, "{variance} of {all}");
        }
    }

    #[test]
    fn does_not_take_a_texture_for_noise() {
        // A tone of 100 Hz, and ridges with edges of a tenth of their length, a few mm at 50 mm/s.
        let tone = |scan: usize| 400.0 * libm::sin(2.0 * PI * 100.0 * scan as f64 / SCANS_PER_S);
        let (variance, all) = measured(tone);
        assert!(
            variance < 2.0 * ROUNDING + 1e-3 * all,
            "{variance} of {all}"
        );
        for (frequency_hz, most) in [(8.0, 1e-3), (12.5, 1e-3), (25.0, 5e-3)] {
            let ridges = |scan: usize| {
                let phase = frequency_hz * scan as f64 / SCANS_PER_S;
                let triangle = 4.0 * (phase - libm::floor(phase + 0.5)).abs() - 1.0;
                400.0 * (triangle * 5.0).clamp(-1.0, 1.0)
            };
            let (variance, all) = measured(ridges);
            assert!(
                variance < most * all,
                "{variance} of {all}, {frequency_hz} Hz"
            );
        }
    }

    #[test]
    fn noise_that_begins_is_known_in_a_tenth_of_a_second() {
        let mut normal = normals();
        let mut noise = Noise::default();
        let mut unknown_ms = 0;
        for ms in 0..4_000 {
            let level = if ms < 3_000 { 2.0 } else { 20.0 };
            noise.push(&core::array::from_fn(|gauge| {
                let x = if gauge == 2 { level } else { 2.0 } * normal();
                x as f32
            }));
            let known = noise.variances().map(|variance| variance > 200.0);
            assert!(!known[0] && !known[1] && !known[3] && !known[4]);
            if ms >= 3_000 && !known[2] {
                unknown_ms += 1;
            }
        }
        assert!(unknown_ms <= 100, "{unknown_ms} ms");
    }
}
