//! The spectrum of the latest path, and its average over fresh ground.
//!
//! Each candidate wavelength demodulates the gauges along the path, behind two poles of a share of λ of
//! travel. The energies of a moment tell a wave from a chance bump only after many waves; their average
//! over fresh ground does: a line stays where it is, chance does not (Welch 1967).

use protocol::GAUGES;

use super::knots::{Completed, Knot, SPACINGS, spacing_for};
use crate::estimator::MIN_AMPLITUDE_LSB;
use crate::phasor::phasor;
use crate::root::sqrt;
use crate::travel::PLACES_PER_MM;

/// Candidates: six an octave, so that a ratio of 2 lies on the grid, and one beyond either end.
pub(super) const CANDIDATES: usize = 26;
/// The shortest candidate, in mm.
const SHORTEST_MM: f32 = 0.5;
/// Candidates in an octave.
pub(super) const PER_OCTAVE: usize = 6;
/// Travel constant of each of the two poles, in wavelengths.
const POLE_WAVES: f32 = 0.7;
/// Travel that the energies lag behind by, in wavelengths: both poles'.
pub(super) const KERNEL_WAVES: f32 = 2.0 * POLE_WAVES;
/// Travel constant of the high-pass in front, in mm: drift and slopes are not to leak into long waves.
const HIGH_PASS_MM: f32 = 3.0;
/// Travel constant of the average, in wavelengths.
pub(super) const AVERAGE_WAVES: f32 = 14.0;
/// Energy over all candidates, in ADC steps², of the least wave that is listened to. Below it the gauges are silent, and
/// there is nothing to average.
const LEAST_ENERGY: f32 = 10.0 * MIN_AMPLITUDE_LSB * MIN_AMPLITUDE_LSB;
/// Weight of a pole below which it is not looked at.
const LEAST_WEIGHT: f32 = 1e-3;

/// A candidate wavelength.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    wavelength_mm: f32,
    /// Phase of a place in 2⁻³² cycles.
    increment: u32,
    spacing: usize,
    /// Re and Im of each gauge behind the first pole, and behind both.
    first: [[f32; 2]; GAUGES],
    second: [[f32; 2]; GAUGES],
    first_weight: f32,
    second_weight: f32,
    /// The average, and the weight that it has.
    mean: f32,
    mean_weight: f32,
}

/// All candidates' energies, in one way or another.
pub(super) type Spectrum = [f32; CANDIDATES];

/// The bank of candidates.
#[derive(Clone, Debug)]
pub(super) struct Periodogram {
    candidates: [Candidate; CANDIDATES],
    /// The high-pass' level of each gauge at each spacing; none before the first knot.
    level: [Option<[f32; GAUGES]>; SPACINGS],
}

impl Periodogram {
    /// Nothing felt yet.
    pub fn new() -> Self {
        Self {
            candidates: core::array::from_fn(|i| {
                let wavelength_mm = wavelength_mm(i);
                Candidate {
                    wavelength_mm,
                    increment: (4_294_967_296.0 / f64::from(wavelength_mm * PLACES_PER_MM as f32))
                        as u32,
                    spacing: spacing_for(wavelength_mm).min(1),
                    first: [[0.0; 2]; GAUGES],
                    second: [[0.0; 2]; GAUGES],
                    first_weight: 0.0,
                    second_weight: 0.0,
                    mean: 0.0,
                    mean_weight: 0.0,
                }
            }),
            level: [None; SPACINGS],
        }
    }

    /// Each gauge's present level in ADC steps; 0 before the first knot.
    pub fn level(&self) -> [f32; GAUGES] {
        self.level[0].unwrap_or_default()
    }

    /// Takes the knots that a millisecond completed.
    pub fn push(&mut self, completed: &Completed) {
        for (spacing, knot) in completed.iter().enumerate().take(2) {
            let Some(knot) = knot else { continue };
            let level = self.level[spacing].get_or_insert(knot.gauges);
            let z = knot.travel_mm * (1.0 / HIGH_PASS_MM);
            let follow = z / (1.0 + z);
            let mut felt = [0.0; GAUGES];
            for gauge in 0..GAUGES {
                level[gauge] += follow * (knot.gauges[gauge] - level[gauge]);
                felt[gauge] = knot.gauges[gauge] - level[gauge];
            }
            for candidate in &mut self.candidates {
                if candidate.spacing == spacing {
                    candidate.take(knot, &felt);
                }
            }
        }
    }

    /// Energy in the usable gauges over the latest waves: behind one pole, and behind both.
    pub fn energies(&self, usable: u8) -> (Spectrum, Spectrum) {
        let usable = &core::array::from_fn(|gauge| f32::from(usable >> gauge & 1));
        let (mut short, mut long) = ([0.0; CANDIDATES], [0.0; CANDIDATES]);
        for (i, candidate) in self.candidates.iter().enumerate() {
            short[i] = energy(&candidate.first, candidate.first_weight, usable);
            long[i] = energy(&candidate.second, candidate.second_weight, usable);
        }
        (short, long)
    }

    /// Takes the energies into the average, `travel_mm` after the last time.
    pub fn average(&mut self, energies: &Spectrum, travel_mm: f32) {
        let total: f32 = energies.iter().sum();
        if total < LEAST_ENERGY || travel_mm <= 0.0 {
            return;
        }
        let scale = 1.0 / total;
        for (candidate, energy) in self.candidates.iter_mut().zip(energies) {
            let z = travel_mm / (AVERAGE_WAVES * candidate.wavelength_mm);
            // A kernel that is not full yet says little.
            let full = candidate.second_weight * candidate.second_weight;
            let follow = z / (1.0 + z) * full * full;
            candidate.mean_weight += follow * (1.0 - candidate.mean_weight);
            candidate.mean += follow * (energy * scale - candidate.mean);
        }
    }

    /// Starts the average over with the energies of now, of that weight.
    pub fn restart(&mut self, energies: &Spectrum, weight: f32) {
        let total: f32 = energies.iter().sum::<f32>().max(f32::MIN_POSITIVE);
        for (candidate, energy) in self.candidates.iter_mut().zip(energies) {
            candidate.mean = weight * energy / total;
            candidate.mean_weight = weight;
        }
    }

    /// The average: shares of the energy.
    pub fn averaged(&self) -> Spectrum {
        core::array::from_fn(|i| {
            let candidate = &self.candidates[i];
            if candidate.mean_weight > 1e-6 {
                candidate.mean / candidate.mean_weight
            } else {
                0.0
            }
        })
    }

    /// How full the average of candidate `number` is, 0 to 1.
    pub fn maturity(&self, number: usize) -> f32 {
        self.candidates[number].mean_weight
    }
}

impl Candidate {
    #[inline]
    fn take(&mut self, knot: &Knot, felt: &[f32; GAUGES]) {
        let z = knot.travel_mm / (POLE_WAVES * self.wavelength_mm);
        // e^(−z) to within z³/6.
        let keep = 1.0 / (1.0 + z * (1.0 + 0.5 * z));
        let take = 1.0 - keep;
        let [cos, sin] = phasor((knot.place as u32).wrapping_mul(self.increment));
        let (re, im) = (take * cos, -take * sin);
        for ((first, second), x) in self.first.iter_mut().zip(&mut self.second).zip(felt) {
            first[0] = keep * first[0] + re * x;
            first[1] = keep * first[1] + im * x;
            second[0] = keep * second[0] + take * first[0];
            second[1] = keep * second[1] + take * first[1];
        }
        self.first_weight = keep * self.first_weight + take;
        self.second_weight = keep * self.second_weight + take * self.first_weight;
    }
}

fn energy(sums: &[[f32; 2]; GAUGES], weight: f32, usable: &[f32; GAUGES]) -> f32 {
    if weight < LEAST_WEIGHT {
        return 0.0;
    }
    let sum: f32 = sums
        .iter()
        .zip(usable)
        .map(|([re, im], usable)| usable * (re * re + im * im))
        .sum();
    2.0 * sum / (weight * weight)
}

/// A candidate's wavelength in mm, from the steps of an octave: 2^(n/6).
pub(super) const fn wavelength_mm(number: usize) -> f32 {
    const STEPS: [f32; PER_OCTAVE] = [
        1.0,
        1.122_462,
        1.259_921,
        core::f32::consts::SQRT_2,
        1.587_401,
        1.781_797,
    ];
    SHORTEST_MM * (1_u32 << (number / PER_OCTAVE)) as f32 * STEPS[number % PER_OCTAVE]
}

/// Whether there is a peak at candidate `number`: the ends have none.
pub(super) fn is_peak(spectrum: &Spectrum, number: usize) -> bool {
    number >= 1
        && number + 1 < CANDIDATES
        && spectrum[number] > 0.0
        && spectrum[number] >= spectrum[number - 1]
        && spectrum[number] >= spectrum[number + 1]
}

/// The highest peak.
pub(super) fn highest_peak(spectrum: &Spectrum) -> Option<usize> {
    (1..CANDIDATES - 1)
        .filter(|&number| is_peak(spectrum, number))
        .max_by(|&one, &other| spectrum[one].total_cmp(&spectrum[other]))
}

/// The wavelength of a peak in mm. Two poles leave of a wave k the energy P₀/(1 + (2πq)²(kλ − 1)²)² at the
/// candidate λ: to the power of −½ a parabola in λ; behind one pole, to the power of −1.
pub(super) fn vertex_mm(spectrum: &Spectrum, number: usize, both_poles: bool) -> f32 {
    let x1 = wavelength_mm(number);
    if number == 0 || number + 1 >= CANDIDATES {
        return x1;
    }
    let (x0, x2) = (wavelength_mm(number - 1), wavelength_mm(number + 1));
    let least = 1e-9 * spectrum[number];
    let [y0, y1, y2] = [number - 1, number, number + 1].map(|i| {
        let power = spectrum[i].max(least).max(f32::MIN_POSITIVE);
        if both_poles {
            1.0 / sqrt(power)
        } else {
            1.0 / power
        }
    });
    let rise = (y1 - y0) / (x1 - x0);
    let curvature = ((y2 - y1) / (x2 - x1) - rise) / (x2 - x0);
    if curvature > 0.0 {
        (0.5 * (x0 + x1 - rise / curvature)).clamp(x0, x2)
    } else {
        x1
    }
}

/// How far a peak stands above its flanks, a third of an octave to either side: a line has a kernel's
/// width, a band its own.
pub(super) fn sharpness(spectrum: &Spectrum, number: usize) -> f32 {
    let below = spectrum[number.saturating_sub(2)];
    let above = spectrum[(number + 2).min(CANDIDATES - 1)];
    2.0 * spectrum[number] / (below + above).max(0.1 * spectrum[number] + f32::MIN_POSITIVE)
}
