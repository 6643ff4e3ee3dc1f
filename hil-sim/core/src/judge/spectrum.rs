//! The spectrum of a voltage that holds from one instant to the next, at the instants as they are.
//!
//! The transform is that of the staircase itself, in closed form: what a converter with such edges puts
//! out, uneven edges included, and not that of samples on an even grid. The window is the seven-term
//! Blackman–Harris window, whose side lobes lie 180 dB below its main one: nothing that is more than
//! [`LOBE_BINS`] from a line is that line's.

use std::f64::consts::TAU;

/// Albrecht (2001), table II: seven terms, −180 dB.
const WINDOW: [f64; 7] = [
    0.271_051_400_693_42,
    0.433_297_939_234_48,
    0.218_122_999_543_11,
    0.065_925_446_388_03,
    0.010_811_742_098_37,
    0.000_776_584_825_22,
    0.000_013_887_217_35,
];
/// Half width of the window's main lobe, in bins.
pub const LOBE_BINS: usize = WINDOW.len();

/// A line of a spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// In Hz.
    pub frequency_hz: f64,
    /// Amplitude, in V.
    pub amplitude_v: f64,
}

/// The amplitudes of one channel, from 0 Hz on.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// From one amplitude to the next.
    pub bin_hz: f64,
    /// Amplitudes in V: a tone of 1 V shows as a peak of 1 V.
    pub amplitudes_v: Vec<f64>,
}

/// The spectra of several channels that change at the same instants, from 0 to `highest_hz`.
///
/// `edges_s` are the instants of the changes, increasing; `volts` holds for each channel what it is at
/// from each of them on. Looked at is `from_s` to `to_s`, which begins at or after the first edge.
pub fn spectra(
    edges_s: &[f64],
    volts: &[Vec<f64>],
    (from_s, to_s): (f64, f64),
    highest_hz: f64,
) -> Vec<Spectrum> {
    let length_s = to_s - from_s;
    let bins = (highest_hz * length_s).floor() as usize + 1;
    let reach = bins + LOBE_BINS;
    let within = edges_s.partition_point(|&t| t <= from_s)..edges_s.partition_point(|&t| t < to_s);
    let before = within.start.saturating_sub(1);
    // The transform of a staircase is the sum over its steps of step · e^(−jωt) / jω; from the last
    // value to the first is one more, at the ends.
    let mut sums = vec![vec![(0.0, 0.0); reach]; volts.len()];
    let mut areas = vec![0.0; volts.len()];
    for (channel, volts) in volts.iter().enumerate() {
        let (first, last) = (volts[before], volts[within.end - 1]);
        for sum in &mut sums[channel] {
            sum.0 = first - last;
        }
        areas[channel] = last * length_s;
    }
    for edge in within {
        let steps: Vec<f64> = volts.iter().map(|v| v[edge] - v[edge - 1]).collect();
        let place = (edges_s[edge] - from_s) / length_s;
        for (area, step) in areas.iter_mut().zip(&steps) {
            *area -= step * place * length_s;
        }
        let (sin, cos) = (TAU * place).sin_cos();
        let mut turn = (1.0, 0.0);
        for bin in 0..reach {
            for (sum, step) in sums.iter_mut().zip(&steps) {
                sum[bin].0 += step * turn.0;
                sum[bin].1 += step * turn.1;
            }
            turn = (turn.0 * cos + turn.1 * sin, turn.1 * cos - turn.0 * sin);
        }
    }
    sums.into_iter()
        .zip(areas)
        .map(|(sums, area)| {
            // Coefficients of the Fourier series over the window: c(k) = X(k) / T, c(−k) its conjugate.
            let coefficients: Vec<(f64, f64)> = sums
                .into_iter()
                .enumerate()
                .map(|(bin, (re, im))| {
                    if bin == 0 {
                        return (area / length_s, 0.0);
                    }
                    // 1/(jω T) = −j/(2π k)
                    let share = 1.0 / (TAU * bin as f64);
                    (im * share, -re * share)
                })
                .collect();
            let amplitudes_v = (0..bins).map(|bin| windowed(&coefficients, bin)).collect();
            Spectrum {
                bin_hz: 1.0 / length_s,
                amplitudes_v,
            }
        })
        .collect()
}

/// The amplitude at a bin through the window.
fn windowed(coefficients: &[(f64, f64)], bin: usize) -> f64 {
    let at = |bin: isize| {
        let (re, im) = coefficients[bin.unsigned_abs()];
        (re, if bin < 0 { -im } else { im })
    };
    let bin = bin as isize;
    let (mut re, mut im) = at(bin);
    re *= WINDOW[0];
    im *= WINDOW[0];
    let mut sign = -0.5;
    for (term, weight) in (1..).zip(&WINDOW[1..]) {
        let (low, high) = (at(bin - term), at(bin + term));
        re += sign * weight * (low.0 + high.0);
        im += sign * weight * (low.1 + high.1);
        sign = -sign;
    }
    let sides = if bin == 0 { 1.0 } else { 2.0 };
    sides * re.hypot(im) / WINDOW[0]
}

impl Spectrum {
    /// The highest peak within [`LOBE_BINS`] of `frequency_hz`.
    pub fn line(&self, frequency_hz: f64) -> Option<Line> {
        let middle = (frequency_hz / self.bin_hz).round() as usize;
        self.highest(
            middle.saturating_sub(LOBE_BINS)..middle + LOBE_BINS + 1,
            |_| true,
        )
    }

    /// The highest line that is neither the one at `frequency_hz` nor the mean.
    pub fn worst_spur(&self, frequency_hz: f64) -> Option<Line> {
        let tone = (frequency_hz / self.bin_hz).round() as usize;
        self.highest(LOBE_BINS..self.amplitudes_v.len(), |bin| {
            bin.abs_diff(tone) > LOBE_BINS
        })
    }

    fn highest(
        &self,
        bins: std::ops::Range<usize>,
        counts: impl Fn(usize) -> bool,
    ) -> Option<Line> {
        let end = bins.end.min(self.amplitudes_v.len());
        let bin = (bins.start..end)
            .filter(|&bin| counts(bin))
            .max_by(|&one, &other| self.amplitudes_v[one].total_cmp(&self.amplitudes_v[other]))?;
        Some(self.between(bin))
    }

    /// The top of the parabola through a bin and its neighbours, on a logarithmic scale; the bin itself if
    /// it is none.
    fn between(&self, bin: usize) -> Line {
        let here = self.amplitudes_v[bin];
        let plain = Line {
            frequency_hz: bin as f64 * self.bin_hz,
            amplitude_v: here,
        };
        let neighbours = bin
            .checked_sub(1)
            .and_then(|low| Some((self.amplitudes_v[low], *self.amplitudes_v.get(bin + 1)?)));
        let Some((low, high)) = neighbours.filter(|&(low, high)| low > 0.0 && high > 0.0) else {
            return plain;
        };
        let (low, here, high) = (low.ln(), here.ln(), high.ln());
        let curve = low - 2.0 * here + high;
        if curve >= 0.0 || low > here || high > here {
            return plain;
        }
        let offset = 0.5 * (low - high) / curve;
        Line {
            frequency_hz: (bin as f64 + offset) * self.bin_hz,
            amplitude_v: (here - 0.25 * (low - high) * offset).exp(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A staircase that takes `volts` at each tick of 2 kHz, `late_s` of it after the tick.
    fn staircase(
        seconds: f64,
        volts: impl Fn(f64) -> f64,
        late_s: impl Fn(usize) -> f64,
    ) -> (Vec<f64>, Vec<f64>) {
        (0..(seconds * 2_000.0) as usize)
            .map(|tick| {
                let t_s = tick as f64 / 2_000.0;
                (t_s + late_s(tick), volts(t_s))
            })
            .unzip()
    }

    fn sinc(x: f64) -> f64 {
        if x == 0.0 { 1.0 } else { x.sin() / x }
    }

    #[test]
    fn a_held_tone_shows_at_its_frequency_with_the_droop_of_the_hold() {
        // Between bins and on one; the hold takes sinc(π f / 2 kHz) of it.
        for frequency_hz in [35.0, 104.3, 200.2] {
            let (edges, volts) =
                staircase(2.6, |t| 5.0 * (TAU * frequency_hz * t + 0.3).sin(), |_| 0.0);
            let spectrum = &spectra(&edges, &[volts], (0.4, 2.4), 1_000.0)[0];
            let line = spectrum.line(frequency_hz).unwrap();
            let due = 5.0 * sinc(std::f64::consts::PI * frequency_hz / 2_000.0);
            assert!((line.frequency_hz - frequency_hz).abs() < 0.01, "{line:?}");
            // A parabola through the logarithm of this window's lobe is right to a hundredth of a dB.
            assert!(
                (line.amplitude_v / due - 1.0).abs() < 2e-3,
                "{line:?} {due}"
            );
            // What is left is the rounding of the sums.
            let spur = spectrum.worst_spur(frequency_hz).unwrap();
            assert!(spur.amplitude_v < 5e-8, "{spur:?}");
        }
    }

    #[test]
    fn a_second_tone_a_hundred_decibels_down_is_found_as_the_worst_spur() {
        let (edges, volts) = staircase(
            2.6,
            |t| 5.0 * (TAU * 35.0 * t).sin() + 5e-5 * (TAU * 612.0 * t).sin(),
            |_| 0.0,
        );
        let spur = spectra(&edges, &[volts], (0.4, 2.4), 1_000.0)[0]
            .worst_spur(35.0)
            .unwrap();
        let due = 5e-5 * sinc(std::f64::consts::PI * 612.0 / 2_000.0);
        assert!((spur.frequency_hz - 612.0).abs() < 0.05, "{spur:?}");
        assert!(
            (spur.amplitude_v / due - 1.0).abs() < 2e-3,
            "{spur:?} {due}"
        );
    }

    #[test]
    fn edges_that_come_late_at_every_other_tick_make_the_side_lines_that_theory_says() {
        // Every other edge late by ε is a phase modulation at 1 kHz: a step of s is s·ε late, which
        // adds s·ε at those instants. At f the steps are 2 sin(πf/2000) · 5 V tall; half of them late
        // by ε give lines of ε · 1 kHz · that height at 1 kHz ± f.
        let (frequency_hz, late_s) = (40.0, 10e-6);
        let (edges, volts) = staircase(
            2.6,
            |t| 5.0 * (TAU * frequency_hz * t).sin(),
            |tick| if tick % 2 == 0 { 0.0 } else { late_s },
        );
        let spectrum = &spectra(&edges, &[volts], (0.4, 2.4), 1_000.0)[0];
        let spur = spectrum.worst_spur(frequency_hz).unwrap();
        let height = 10.0 * (std::f64::consts::PI * frequency_hz / 2_000.0).sin();
        let due = late_s * 1_000.0 * height;
        assert!((spur.frequency_hz - 960.0).abs() < 0.05, "{spur:?}");
        assert!(
            (spur.amplitude_v / due - 1.0).abs() < 0.01,
            "{spur:?} {due}"
        );
    }

    #[test]
    fn a_standing_voltage_shows_at_zero_and_is_no_spur() {
        let (edges, volts) = staircase(2.6, |t| 0.25 + (TAU * 50.0 * t).sin(), |_| 0.0);
        let spectrum = &spectra(&edges, &[volts], (0.4, 2.4), 1_000.0)[0];
        assert!((spectrum.amplitudes_v[0] - 0.25).abs() < 1e-9);
        assert!(spectrum.worst_spur(50.0).unwrap().amplitude_v < 1e-8);
    }
}
