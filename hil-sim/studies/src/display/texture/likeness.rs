//! How alike two signals of [`TICKS_HZ`] are: coherence, and the distance of their spectra.

use std::f64::consts::TAU;

use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};

/// Samples a second: the display's ticks.
pub const TICKS_HZ: f64 = 2_000.0;
/// What is looked at, in Hz.
const BAND_HZ: (f64, f64) = (5.0, 200.0);
/// Third octaves in it.
pub const THIRDS: usize = 16;
/// A third octave so far below the whole counts as that far, in dB.
pub const FLOOR_DB: f64 = -30.0;
/// Samples in a segment, and from one to the next.
const SEGMENT: usize = 1_024;
const HOP: usize = SEGMENT / 2;

/// The spectra of half-overlapping segments under a Hann window.
pub fn segments(signal: &[f64]) -> Vec<Vec<Complex<f64>>> {
    // By name: what plans any transform brings all of them along.
    let transform = Radix4::new(SEGMENT, FftDirection::Forward);
    let hann = |n: usize| 0.5 - 0.5 * (TAU * n as f64 / SEGMENT as f64).cos();
    let transformed = |segment: &[f64]| {
        let windowed = segment.iter().enumerate();
        let mut lines: Vec<_> = windowed.map(|(n, x)| Complex::from(x * hann(n))).collect();
        transform.process(&mut lines);
        lines
    };
    let segments = signal.windows(SEGMENT).step_by(HOP);
    segments.map(transformed).collect()
}

fn lines() -> impl Iterator<Item = usize> {
    let per_hz = SEGMENT as f64 / TICKS_HZ;
    (BAND_HZ.0 * per_hz).ceil() as usize..=(BAND_HZ.1 * per_hz).floor() as usize
}

/// The share of `of`'s power that is coherent with `with`. So many segments show a coherence of 1/n where there is
/// none.
pub fn coherence(of: &[Vec<Complex<f64>>], with: &[Vec<Complex<f64>>]) -> f64 {
    let chance = 1.0 / of.len() as f64;
    let (mut coherent, mut all) = (0.0, 0.0);
    for line in lines() {
        let (mut own, mut others, mut common) = (0.0, 0.0, Complex::new(0.0, 0.0));
        for (one, other) in of.iter().zip(with) {
            own += one[line].norm_sqr();
            others += other[line].norm_sqr();
            common += one[line] * other[line].conj();
        }
        let share = if own * others > 0.0 {
            common.norm_sqr() / (own * others)
        } else {
            0.0
        };
        coherent += own * ((share - chance) / (1.0 - chance)).max(0.0);
        all += own;
    }
    coherent / all
}

/// Third octaves of [`BAND_HZ`], in dB over their sum.
pub fn thirds_db(signal: &[f64]) -> [f64; THIRDS] {
    thirds_where(signal, |_| true)
}

/// The same of the segments about such instants alone, in s from the signal's start.
pub fn thirds_where(signal: &[f64], counts: impl Fn(f64) -> bool) -> [f64; THIRDS] {
    let per_hz = SEGMENT as f64 / TICKS_HZ;
    let mut powers = [0.0; THIRDS];
    let middle_s = |n: usize| (n * HOP + SEGMENT / 2) as f64 / TICKS_HZ;
    let segments = segments(signal).into_iter().enumerate();
    for (_, segment) in segments.filter(|(n, _)| counts(middle_s(*n))) {
        for line in lines() {
            let octaves = (line as f64 / per_hz / BAND_HZ.0).log2();
            powers[((3.0 * octaves) as usize).min(THIRDS - 1)] += segment[line].norm_sqr();
        }
    }
    let all: f64 = powers.iter().sum();
    powers.map(|power| (10.0 * (power / all).log10()).max(FLOOR_DB))
}

/// RMS of the difference, in dB.
pub fn distance_db(one: &[f64; THIRDS], other: &[f64; THIRDS]) -> f64 {
    let squares = one.iter().zip(other).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f64>() / THIRDS as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// As good as white.
    fn grain(seed: u64) -> Vec<f64> {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
        (0..8_192).map(|_| draws.random::<f64>() - 0.5).collect()
    }

    #[test]
    fn a_signal_is_coherent_with_itself_and_with_what_it_is_filtered_of_and_not_with_another() {
        let (one, other) = (grain(1), grain(2));
        let late: Vec<f64> = one.iter().skip(3).map(|x| -2.0 * x).collect();
        let of = segments(&one);
        assert!(coherence(&of, &of) > 0.999);
        assert!(coherence(&of, &segments(&late)) > 0.95);
        assert!(coherence(&of, &segments(&other)) < 0.1);
        let half: Vec<f64> = one.iter().zip(&other).map(|(x, y)| x + y).collect();
        let share = coherence(&of, &segments(&half));
        assert!((0.4..0.6).contains(&share), "{share}");
    }

    #[test]
    fn third_octaves_hold_what_is_in_them_and_a_level_is_no_distance() {
        let tone = |hz: f64, volts: f64| -> Vec<f64> {
            (0..8_192)
                .map(|n| volts * (TAU * hz * f64::from(n) / TICKS_HZ).sin())
                .collect()
        };
        // 5 Hz · 2^(10/3) = 50.4 Hz begins the eleventh.
        let levels = thirds_db(&tone(56.0, 5.0));
        assert!(levels[10] > -0.1, "{levels:?}");
        assert_eq!((levels[8], levels[12]), (FLOOR_DB, FLOOR_DB));
        assert!(distance_db(&levels, &thirds_db(&tone(56.0, 0.1))) < 1e-6);
        assert!(distance_db(&levels, &thirds_db(&tone(112.0, 5.0))) > 8.0);
    }
}
