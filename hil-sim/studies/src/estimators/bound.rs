//! The Cramér–Rao bound on λ: no unbiased estimator that is given a window of samples can have a smaller
//! error, whatever it does.
//!
//! The window holds, for each gauge, a tone of the common frequency v/λ with an amplitude, a phase and an
//! offset that are not known (and, if so asked, a slope), in white noise. The relative bounds of frequency
//! and of λ are the same.
//!
//! The noise of a scene is white up to 2 kHz and goes through the anti-aliasing filter with the tone. Only
//! its density about the tone matters over many waves, which that filter changes for both alike: it is the
//! density of noise at 1 kHz with the power that the signal-to-noise ratio counts in 0–500 Hz.

use std::f64::consts::TAU;

use protocol::SensorConfiguration;

use hil_sim_core::plant::gauges::{GAINS, PHASES_RAD, PLACES_MM};

const SAMPLE_RATE_HZ: f64 = firmware_sensor::SAMPLE_RATE_HZ as f64;
/// Phases of the tone in the window over which the bound is averaged.
const PHASES: u32 = 72;

/// Waves that the default estimator fits at most.
pub const WAVES: u8 = SensorConfiguration::DEFAULT.waves;

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
    /// Whether each gauge drifts steadily, by a slope that is not known.
    pub slope: bool,
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
        let [cc, cs, ss] = information(omega, samples, self.slope);
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

/// What a tone of amplitude 1 in noise of variance 1 says of its angular frequency, once amplitude, phase,
/// offset and, if it is not known, slope have taken their part: a quadratic form [cc, cs, ss] in cosine and sine of its phase.
///
/// Fisher's information of the derivatives by frequency, t·cos ωt and t·sin ωt, less their projection on
/// those by the other parameters: cos ωt, sin ωt, 1 and t.
fn information(omega: f64, samples: usize, slope: bool) -> [f64; 3] {
    let middle = (samples as f64 - 1.0) / 2.0;
    let instants: Vec<f64> = (0..samples)
        .map(|sample| (sample as f64 - middle) / SAMPLE_RATE_HZ)
        .collect();
    let column = |f: &dyn Fn(f64) -> f64| instants.iter().map(|&t| f(t)).collect::<Vec<f64>>();
    let mut known: Vec<Vec<f64>> = Vec::with_capacity(4);
    let mut others = vec![
        column(&|_| 1.0),
        column(&|t| (omega * t).cos()),
        column(&|t| (omega * t).sin()),
    ];
    if slope {
        // In windows: as long as the others.
        let window_s = samples as f64 / SAMPLE_RATE_HZ;
        others.push(column(&|t| t / window_s));
    }
    for mut column in others {
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

/// Travel in mm of a window of so many waves, evenly weighted: what the estimator fits its waves to.
pub fn window_mm(waves: u8, wavelength_mm: f64) -> f64 {
    f64::from(waves) * wavelength_mm
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
            slope: false,
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
            let [cc, _, ss] = information(omega, 80, false);
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
    fn an_unknown_slope_costs_a_little_and_next_to_nothing_over_eight_waves() {
        // 25 Hz: a wave is 40 ms. Over n whole waves the slope takes a share of 1152/(2πn)⁴ of what t·cos
        // says of the frequency, which is half of all, and more of it through the sine, by 1/(n² − …): at
        // most ten times that.
        for waves in [2u8, 3, 5, 8] {
            let window_s = window_mm(waves, 2.0) / 50.0;
            let without = tone(2.0, 50.0, 20.0, &ALL);
            let with = Tone {
                slope: true,
                ..without
            };
            let more = with.relative_percent(window_s) / without.relative_percent(window_s) - 1.0;
            let first_order = 1_152.0 / (TAU * f64::from(waves)).powi(4);
            assert!(
                more > 0.0 && more < 10.0 * first_order,
                "{more} over {waves} waves, {first_order}"
            );
        }
    }
}
