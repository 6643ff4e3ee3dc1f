//! Brings a recording to a lower rate: band-limited, without a shift in time.
//!
//! rubato's synchronous resampler does it: the spectrum is cut by a linear-phase low-pass (a sinc under a
//! squared Blackman–Harris window) whose delay is a whole number of samples, which are dropped. What lies above
//! half of the new rate is suppressed by more than 100 dB; what lies below 0.94 of that is let through within
//! 0.01 dB. Beyond its ends a recording stands at its first and last value.

use rubato::audioadapter_buffers::direct::InterleavedSlice;
use rubato::{Fft, FixedSync, Resampler, WindowFunction};

/// Samples of the low-pass at the lower one of the two rates, at least: what its edge's width follows from.
const LEAST_TAPS: usize = 512;
/// The largest numbers of a ratio of rates. The best ratio of such numbers is 1e-10 off at most.
const LARGEST: f64 = 100_000.0;
/// Values are rounded to so many per unit, in volts to a nanovolt: processors add up in different orders, and
/// their last bits must not decide a code.
const PER_UNIT: f64 = 1e9;

/// Two rates: `input` samples last as long as `output` samples, and there is no smaller such pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ratio {
    /// At the recording's rate.
    pub input: usize,
    /// At the wanted rate.
    pub output: usize,
}

impl Ratio {
    /// The simplest ratio within `tolerance`, relative, of `input_per_output` (above 0), by continued
    /// fractions, or else the best of numbers up to 100 000; none if there is no such ratio at all.
    pub fn near(input_per_output: f64, tolerance: f64) -> Option<Self> {
        let (mut before, mut last) = ((0.0, 1.0), (1.0, 0.0));
        let mut rest = input_per_output;
        loop {
            let whole = rest.floor();
            let next: (f64, f64) = (whole * last.0 + before.0, whole * last.1 + before.1);
            let within = next.0 <= LARGEST && next.1 <= LARGEST;
            // Once there is no rest, they are no numbers.
            if !within {
                return Self::of(last);
            }
            if (next.0 / next.1 - input_per_output).abs() <= tolerance * input_per_output {
                return Self::of(next);
            }
            (before, last) = (last, next);
            rest = (rest - whole).recip();
        }
    }

    fn of((input, output): (f64, f64)) -> Option<Self> {
        (input >= 1.0 && output >= 1.0).then_some(Self {
            input: input as usize,
            output: output as usize,
        })
    }
}

/// The rows of `values`, `width` columns each, at another rate. The first row stays where it is; the last one
/// is at or before the last of `values`. None if the resampler refuses, which it does for no ratio and width
/// above 0.
pub fn resample(values: &[f64], width: usize, ratio: Ratio) -> Option<Vec<f64>> {
    let frames = values.len() / width;
    if frames == 0 {
        return Some(Vec::new());
    }
    // Even, so that half of a block, the delay, is a whole number of samples at both rates.
    let blocks = LEAST_TAPS
        .div_ceil(ratio.input.min(ratio.output))
        .next_multiple_of(2);
    let mut fft = Fft::<f64>::new_custom(
        ratio.input,
        ratio.output,
        blocks * ratio.input,
        1,
        width,
        WindowFunction::BlackmanHarris2,
        FixedSync::Both,
    )
    .ok()?;
    let (block_in, block_out) = (fft.input_frames_next(), fft.output_frames_next());
    // A block of the first value ahead, so that the filter has forgotten that there was nothing.
    let dropped = block_out + fft.output_delay();
    let wanted = (frames - 1) * ratio.output / ratio.input + 1;
    let mut input = vec![0.0; block_in * width];
    let mut output = vec![0.0; block_out * width];
    let mut resampled = Vec::with_capacity((dropped + wanted + block_out) * width);
    let mut block = 0;
    while resampled.len() < (dropped + wanted) * width {
        for (index, frame) in input.chunks_exact_mut(width).enumerate() {
            let at = (block * block_in + index)
                .saturating_sub(block_in)
                .min(frames - 1);
            frame.copy_from_slice(&values[at * width..][..width]);
        }
        let from = InterleavedSlice::new(&input[..], width, block_in).ok()?;
        let mut to = InterleavedSlice::new_mut(&mut output[..], width, block_out).ok()?;
        fft.process_into_buffer(&from, &mut to, None).ok()?;
        resampled.extend_from_slice(&output);
        block += 1;
    }
    resampled.drain(..dropped * width);
    resampled.truncate(wanted * width);
    for value in &mut resampled {
        *value = (*value * PER_UNIT).round() / PER_UNIT;
    }
    Some(resampled)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn the_simplest_ratio_is_found() {
        let ratio = |input, output| Some(Ratio { input, output });
        assert_eq!(Ratio::near(44_100.0 / 4_000.0, 1e-9), ratio(441, 40));
        assert_eq!(Ratio::near(0.25, 1e-9), ratio(1, 4));
        assert_eq!(Ratio::near(2_500.000_001 / 4_000.0, 1e-8), ratio(5, 8));
        // √2 has no such ratio, but one within 1e-9.
        let root = Ratio::near(2f64.sqrt(), 1e-9).unwrap();
        let off = root.input as f64 / root.output as f64 / 2f64.sqrt() - 1.0;
        assert!(off.abs() <= 1e-9, "{root:?}: {off}");
        // Beyond the tolerance, the best that there is.
        let best = Ratio::near(44_117.3 / 4_000.0, 1e-15).unwrap();
        let off = best.input as f64 / best.output as f64 * 4_000.0 / 44_117.3 - 1.0;
        assert!(off.abs() < 1e-8, "{best:?}: {off}");
        assert_eq!(Ratio::near(1e7, 1e-9), None);
        assert_eq!(Ratio::near(1e-7, 1e-9), None);
    }

    /// A tone of 1 at `tone_hz`, recorded for 8 s at `input_hz`, at 4 kHz: its largest value, and its largest
    /// difference from a tone of the same phase, in a second in the middle.
    fn tone(tone_hz: f64, input_hz: f64) -> (f64, f64) {
        let ratio = Ratio::near(input_hz / 4_000.0, 1e-9).unwrap();
        let frames = (8.0 * input_hz) as usize;
        let values: Vec<f64> = (0..frames)
            .map(|frame| (TAU * tone_hz * frame as f64 / input_hz).sin())
            .collect();
        let out = resample(&values, 1, ratio).unwrap();
        let (mut most, mut off) = (0f64, 0f64);
        for (index, value) in out.iter().enumerate().take(18_000).skip(14_000) {
            let wanted = (TAU * tone_hz * index as f64 / 4_000.0).sin();
            most = most.max(value.abs());
            off = off.max((value - wanted).abs());
        }
        (most, off)
    }

    #[test]
    fn what_the_lower_rate_can_carry_stays_as_it_is_and_the_rest_is_taken_out() {
        for input_hz in [4_100.0, 8_000.0, 11_025.0, 44_100.0, 48_000.0] {
            let half_hz = 2_000.0;
            for tone_hz in [0.02 * half_hz, 0.5 * half_hz, 0.94 * half_hz] {
                // 0.01 dB is 1.2e-3; a shift of a thousandth of a scan would be 1.5e-3 at 1.88 kHz.
                let (_, off) = tone(tone_hz, input_hz);
                assert!(off < 1.2e-3, "{tone_hz} Hz at {input_hz}: {off}");
            }
            for tone_hz in [2_001.0, 2_500.0, 0.49 * input_hz] {
                if tone_hz > 2_000.0 && tone_hz < input_hz / 2.0 {
                    let (most, _) = tone(tone_hz, input_hz);
                    assert!(most < 1e-5, "{tone_hz} Hz at {input_hz}: {most}");
                }
            }
        }
    }

    #[test]
    fn a_level_stays_to_the_last_digit_up_to_both_ends() {
        for (input, output) in [(8, 5), (441, 40), (12, 1), (1_237, 977)] {
            let values: Vec<f64> = (0..3_001).flat_map(|_| [1.65, -3.3]).collect();
            let out = resample(&values, 2, Ratio { input, output }).unwrap();
            assert_eq!(out.len(), 2 * (3_000 * output / input + 1));
            assert!(
                out.chunks(2).all(|row| row == [1.65, -3.3]),
                "{input}/{output}"
            );
        }
        assert_eq!(
            resample(
                &[],
                1,
                Ratio {
                    input: 4,
                    output: 1
                }
            ),
            Some(Vec::new())
        );
    }
}
