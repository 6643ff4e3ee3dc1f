//! Nonlinear least squares for the pitch of a sum of harmonics, in time: the fundamental whose first L
//! harmonics explain most of the last `N` ms, added over the gauges, L chosen by the Bayesian information
//! criterion. M. G. Christensen and A. Jakobsson, "Multi-Pitch Estimation" (2009), chapter 2: while harmonics
//! are well apart, least squares is a sum of the spectrum over them (a comb on the spectrum).
//!
//! So the fundamental is looked for from two cycles in the window upwards, below which the harmonics of a
//! Hann window run into each other. First by a Fourier transform, then, about the peak, exactly.

use protocol::GAUGES;

use super::spectrum::{LENGTH, LINE_HZ, LINES, add_power};
use super::{HIGHEST_HZ, Rival, Window};

/// Harmonics at most.
const HARMONICS: usize = 3;
/// Places that are looked at between two lines, so that the highest harmonic moves by a line.
const FINE: usize = HARMONICS;
const PLACES: usize = FINE * (LINES - 1);
/// The sum's own error, as a share of the energy: a rest below it says nothing of how many harmonics there
/// are. At two cycles in the window the image at −f alone makes 1 %.
const FLOOR: f32 = 0.02;
const SAMPLE_RATE_HZ: f32 = firmware_sensor::SAMPLE_RATE_HZ as f32;

const PLACE_HZ: f32 = LINE_HZ / FINE as f32;

/// The power between the lines: parabolas through its logarithm at three lines each.
fn between_lines(power: &[f32; LINES]) -> [f32; PLACES] {
    let mut fine = [0.0; PLACES];
    let log = |line: usize| libm::logf(power[line].max(f32::MIN_POSITIVE));
    for line in 1..LINES - 1 {
        let [before, here, after] = [log(line - 1), log(line), log(line + 1)];
        let (slope, bend) = (0.5 * (after - before), 0.5 * (before - 2.0 * here + after));
        for step in 0..FINE {
            let aside = (step as f32 - (FINE / 2) as f32) / FINE as f32;
            let log = here + aside * (slope + aside * bend);
            fine[FINE * line + step - FINE / 2] = libm::expf(log);
        }
    }
    fine
}

/// Harmonic summation over `N` ms, at most [`LENGTH`].
#[derive(Clone, Debug)]
pub struct HarmonicSum<const N: usize> {
    window: Window<N>,
    hann: [f32; N],
}

impl<const N: usize> Default for HarmonicSum<N> {
    fn default() -> Self {
        const { assert!(N <= LENGTH) };
        let angle = 2.0 * core::f32::consts::PI / N as f32;
        Self {
            window: Window::default(),
            hann: core::array::from_fn(|n| 0.5 - 0.5 * libm::cosf(angle * (n as f32 + 0.5))),
        }
    }
}

impl<const N: usize> HarmonicSum<N> {
    /// The lowest fundamental, as a place.
    const FIRST: usize = (2.0 * SAMPLE_RATE_HZ / N as f32 / PLACE_HZ) as usize + 1;

    /// A gauge's samples without their mean, weighted. They are made anew each time: kept, they would fill
    /// the board's stack.
    fn weighted(&self, gauge: usize) -> [f32; N] {
        let mut weighted = self.window.swing(gauge);
        for (x, weight) in weighted.iter_mut().zip(&self.hann) {
            *x *= weight;
        }
        weighted
    }

    /// The best fundamental, as a place, and how many harmonics it has. None without any signal.
    fn among_places(&mut self) -> Option<(usize, usize)> {
        let (mut power, mut energy) = ([0.0; LINES], 0.0);
        for gauge in 0..GAUGES {
            let swing = self.window.swing(gauge);
            let mut samples = [0.0; LENGTH];
            for ((to, x), weight) in samples.iter_mut().zip(&swing).zip(&self.hann) {
                *to = x * weight;
                energy += x * x * weight;
            }
            add_power(&mut samples, &mut power);
        }
        if energy <= 0.0 {
            return None;
        }
        let fine = between_lines(&power);
        let sum = |place: usize, harmonics: usize| -> f32 {
            let each = (1..=harmonics).map(|harmonic| fine.get(harmonic * place));
            each.map(|power| power.copied().unwrap_or_default()).sum()
        };
        // A Hann window's sum is N/2, and it is worth N/1.5 even samples of each gauge.
        let worth = (GAUGES * N) as f32 / 1.5;
        let penalty = (2 * GAUGES) as f32 * libm::logf(worth);
        let mut best: Option<(f32, usize, usize)> = None;
        for harmonics in 1..=HARMONICS {
            let (mut most, mut place) = (0.0, Self::FIRST);
            for candidate in Self::FIRST..=(PLACES - 1) / harmonics {
                let here = sum(candidate, harmonics);
                if here > most {
                    (most, place) = (here, candidate);
                }
            }
            let [before, after] = [place - 1, place + 1].map(|aside| sum(aside, harmonics));
            let bend = before - 2.0 * most + after;
            let top = if bend < 0.0 {
                most - (before - after) * (before - after) / (8.0 * bend)
            } else {
                most
            };
            let explained = top * 4.0 / N as f32;
            let rest = (1.0 - explained / energy).max(FLOOR);
            let cost = worth * libm::logf(rest) + harmonics as f32 * penalty;
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, place, harmonics));
            }
        }
        best.map(|(_, place, harmonics)| (place, harmonics))
    }

    /// Power at the harmonics of three frequencies in Hz, by Goertzel's filters.
    fn powers(&self, frequencies_hz: [f32; 3], harmonics: usize) -> [f32; 3] {
        let mut powers = [0.0; 3];
        for gauge in 0..GAUGES {
            let weighted = self.weighted(gauge);
            for (power, frequency_hz) in powers.iter_mut().zip(frequencies_hz) {
                for harmonic in 1..=harmonics {
                    let turns = harmonic as f32 * frequency_hz / SAMPLE_RATE_HZ;
                    let c = 2.0 * libm::cosf(2.0 * core::f32::consts::PI * turns);
                    let (mut last, mut before) = (0.0, 0.0);
                    for x in &weighted {
                        let next = x + c * last - before;
                        before = last;
                        last = next;
                    }
                    *power += last * last + before * before - c * last * before;
                }
            }
        }
        powers
    }
}

impl<const N: usize> Rival for HarmonicSum<N> {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        self.window.push(sample);
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        if !self.window.is_full() {
            return None;
        }
        let (place, harmonics) = self.among_places()?;
        if place == Self::FIRST {
            // What it takes for the peak may be the flank of a lower one.
            return None;
        }
        let mut frequency_hz = place as f32 * PLACE_HZ;
        for step_hz in [PLACE_HZ, PLACE_HZ / 8.0] {
            let [before, here, after] = self.powers(
                [frequency_hz - step_hz, frequency_hz, frequency_hz + step_hz],
                harmonics,
            );
            let bend = before - 2.0 * here + after;
            if bend < 0.0 {
                let aside = 0.5 * (before - after) / bend;
                frequency_hz += step_hz * aside.clamp(-1.0, 1.0);
            }
        }
        (frequency_hz < HIGHEST_HZ).then_some(frequency_hz)
    }

    fn age_half_ms(&self) -> usize {
        Window::<N>::middle_half_ms()
    }
}
