//! The Cramér–Rao bound on λ: no unbiased estimator that is given a window of samples can have a smaller
//! error, whatever it does.
//!
//! The window holds, for each gauge, a tone of the common frequency v/λ with an amplitude, a phase and an
//! offset that are not known, in white noise. The relative bounds of frequency and of λ are the same.

use std::f64::consts::TAU;

use crate::gauges::{GAINS, PHASES_RAD, PLACES_MM};

const SAMPLE_RATE_HZ: f64 = firmware_sensor::SAMPLE_RATE_HZ as f64;
/// Phases of the tone in the window over which the bound is averaged.
const PHASES: u32 = 72;

/// Share of the bank's kernel's weight that counts as what it used.
pub const KERNEL_SHARE: f64 = 0.99;

/// A tone that gauges feel while the arm moves steadily.
#[derive(Clone, Copy, Debug)]
pub struct Tone<'a> {
    /// λ in mm.
    pub wavelength_mm: f64,
    /// v in mm/s, not 0.
    pub speed_mm_s: f64,
    /// Power of the tone over the noise's in 0–500 Hz, in dB, at unit gain.
    pub snr_db: f64,
    /// The gauges that are given, 0 to 4.
    pub gauges: &'a [usize],
}

impl Tone<'_> {
    /// The bound on λ in percent of it, over a window of `window_s` at 1 kHz.
    ///
    /// At less than a few cycles it depends on where in its cycle the tone is: this is the root of the mean
    /// square over all phases, which is what the error's RMS over time would be.
    pub fn relative_percent(&self, window_s: f64) -> f64 {
        let frequency_hz = self.speed_mm_s.abs() / self.wavelength_mm;
        let omega = TAU * frequency_hz;
        let samples = (window_s * SAMPLE_RATE_HZ).round().max(1.0) as usize;
        let [cc, cs, ss] = information(omega, samples);
        let noise = 0.5 * 10f64.powf(-self.snr_db / 10.0);
        let mean_square = (0..PHASES)
            .map(|phase| {
                let common = TAU * f64::from(phase) / f64::from(PHASES);
                let known: f64 = self
                    .gauges
                    .iter()
                    .map(|&gauge| {
                        let own = TAU * PLACES_MM[gauge] / self.wavelength_mm + PHASES_RAD[gauge];
                        let (sine, cosine) = (common + own).sin_cos();
                        let about =
                            cc * cosine * cosine + 2.0 * cs * cosine * sine + ss * sine * sine;
                        GAINS[gauge].powi(2) * about
                    })
                    .sum();
                noise / known
            })
            .sum::<f64>()
            / f64::from(PHASES);
        100.0 * mean_square.sqrt() / omega
    }
}

/// What a tone of amplitude 1 in noise of variance 1 says of its angular frequency, once amplitude, phase
/// and offset have taken their part: a quadratic form [cc, cs, ss] in cosine and sine of its phase.
///
/// Fisher's information of the derivatives by frequency, t·cos ωt and t·sin ωt, less their projection on
/// those by the other parameters: cos ωt, sin ωt and 1.
fn information(omega: f64, samples: usize) -> [f64; 3] {
    let middle = (samples as f64 - 1.0) / 2.0;
    let instants: Vec<f64> = (0..samples)
        .map(|sample| (sample as f64 - middle) / SAMPLE_RATE_HZ)
        .collect();
    let column = |f: &dyn Fn(f64) -> f64| instants.iter().map(|&t| f(t)).collect::<Vec<f64>>();
    let mut known: Vec<Vec<f64>> = Vec::with_capacity(3);
    for mut column in [
        column(&|_| 1.0),
        column(&|t| (omega * t).cos()),
        column(&|t| (omega * t).sin()),
    ] {
        take_off(&known, &mut column);
        let length = dot(&column, &column).sqrt();
        if length > 1e-9 {
            column.iter_mut().for_each(|x| *x /= length);
            known.push(column);
        }
    }
    let mut by_cosine = column(&|t| t * (omega * t).cos());
    let mut by_sine = column(&|t| t * (omega * t).sin());
    take_off(&known, &mut by_cosine);
    take_off(&known, &mut by_sine);
    [
        dot(&by_cosine, &by_cosine),
        dot(&by_cosine, &by_sine),
        dot(&by_sine, &by_sine),
    ]
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// Takes the part along each of the orthonormal `known` off, twice, against rounding.
fn take_off(known: &[Vec<f64>], column: &mut [f64]) {
    for _ in 0..2 {
        for direction in known {
            let part = dot(direction, column);
            for (x, d) in column.iter_mut().zip(direction) {
                *x -= part * d;
            }
        }
    }
}

/// Travel in mm that the bank's kernel holds [`KERNEL_SHARE`] of its weight in, at a knob of
/// `travel_percent`.
///
/// Two cascaded one-pole filters whose constant is a = qλ of travel have the kernel x·exp(−x/a)/a²; its
/// share within X is 1 − (1 + X/a)·exp(−X/a), 0.99 at X = 6.64 a.
pub fn bank_travel_mm(travel_percent: u16, wavelength_mm: f64) -> f64 {
    let mut reach = 1.0;
    while 1.0 - (1.0 + reach) * f64::exp(-reach) < KERNEL_SHARE {
        reach += 1e-3;
    }
    reach * f64::from(travel_percent) / 100.0 * wavelength_mm
}

/// Travel in mm of an evenly weighted window that has the bank's error in white noise: (192)^(1/3) a.
pub fn bank_equivalent_mm(travel_percent: u16, wavelength_mm: f64) -> f64 {
    192f64.cbrt() * f64::from(travel_percent) / 100.0 * wavelength_mm
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [usize; 5] = [0, 1, 2, 3, 4];

    fn tone(wavelength_mm: f64, speed_mm_s: f64, snr_db: f64, gauges: &[usize]) -> Tone<'_> {
        Tone {
            wavelength_mm,
            speed_mm_s,
            snr_db,
            gauges,
        }
    }

    /// An independent computation's bounds in percent at 80 ms, for λ = 1, 2, 3, 4 mm, with the last
    /// digit's half.
    fn each_cell(rows: [(f64, [f64; 4]); 3], check: impl Fn(f64, f64, f64)) {
        for (speed_mm_s, bounds) in rows {
            for (wavelength_mm, bound) in [1.0, 2.0, 3.0, 4.0].into_iter().zip(bounds) {
                check(wavelength_mm, speed_mm_s, bound);
            }
        }
    }

    #[test]
    fn one_gauge_is_bound_as_computed_elsewhere() {
        let rows = [
            (30.0, [0.26, 0.59, 1.93, 5.07]),
            (50.0, [0.16, 0.33, 0.48, 0.95]),
            (70.0, [0.11, 0.22, 0.35, 0.45]),
        ];
        each_cell(rows, |wavelength_mm, speed_mm_s, bound| {
            let got = tone(wavelength_mm, speed_mm_s, 20.0, &[0]).relative_percent(0.080);
            assert!(
                (got - bound).abs() <= 0.0051,
                "{got} is not {bound} at {wavelength_mm} mm, {speed_mm_s} mm/s"
            );
        });
    }

    /// Below one cycle in the window it matters how five gauges' phases are averaged over, which is not
    /// known of that computation: the mean of their information must be at least its, and the mean of
    /// the squared errors no less than its.
    #[test]
    fn five_gauges_are_bound_as_computed_elsewhere() {
        let rows = [
            (30.0, [1.29, 2.71, 7.29, 17.0]),
            (50.0, [0.78, 1.62, 2.36, 3.95]),
            (70.0, [0.55, 1.12, 1.74, 2.24]),
        ];
        let power: f64 = GAINS.iter().map(|gain| gain * gain).sum();
        each_cell(rows, |wavelength_mm, speed_mm_s, bound| {
            let highest = tone(wavelength_mm, speed_mm_s, 0.0, &ALL).relative_percent(0.080);
            let omega = TAU * speed_mm_s / wavelength_mm;
            let [cc, _, ss] = information(omega, 80);
            let lowest = 100.0 * (0.5 / (power * 0.5 * (cc + ss))).sqrt() / omega;
            let digits = if bound < 10.0 { 0.0051 } else { 0.051 };
            assert!(
                (lowest - digits..=highest + digits).contains(&bound),
                "{bound} is not within {lowest} and {highest} at {wavelength_mm} mm, {speed_mm_s} mm/s"
            );
        });
    }

    #[test]
    fn twice_the_time_at_7_5_hz_and_0_db_leaves_a_ninth() {
        // 1.9 %, to its digits.
        let got = tone(4.0, 30.0, 0.0, &ALL).relative_percent(0.160);
        assert!((got - 1.9).abs() <= 0.06, "{got}");
    }

    #[test]
    fn over_many_cycles_it_is_the_closed_form() {
        // var ω = 24 σ² / (A² N³) · fs², of the one tone in white noise.
        let samples = 2_000.0f64;
        let want = 100.0 * (24.0 * 0.005 / samples.powi(3)).sqrt() * 1_000.0 / (TAU * 50.0);
        let got = tone(2.0, 100.0, 20.0, &[0]).relative_percent(2.0);
        assert!((got / want - 1.0).abs() < 1e-3, "{got} is not {want}");
    }

    #[test]
    fn the_banks_kernel_is_longer_than_its_even_equivalent() {
        let (kernel, even) = (bank_travel_mm(70, 2.0), bank_equivalent_mm(70, 2.0));
        assert!((kernel / 1.4 - 6.64).abs() < 0.005, "{kernel}");
        assert!((even / 1.4 - 5.77).abs() < 0.005, "{even}");
    }
}
