//! The spectrum of the latest path, and its average over fresh ground.
//!
//! Each candidate wavelength demodulates the gauges along the path, behind two poles of a share of λ of
//! travel. The energies of a moment tell a wave from a chance bump only after many waves; their average
//! over fresh ground does: a line stays where it is, chance does not (Welch 1967).

use protocol::GAUGES;

use super::knots::{Knot, spacing_for};
use crate::estimator::MIN_AMPLITUDE_LSB;
use crate::float::{larger, sqrt};
use crate::phasor::phasor;
use crate::travel::PLACES_PER_MM;

/// Candidates: six an octave, so that a ratio of 2 lies on the grid, and one beyond either end.
pub(super) const CANDIDATES: usize = 26;
/// Those that the finest knots serve; the next coarser ones serve the others.
const FINE: usize = 11;
/// Spacings of knots that serve candidates: the coarsest is for fits alone.
const SERVING: usize = 2;
/// The shortest candidate, in mm.
const SHORTEST_MM: f32 = 0.5;
/// Candidates in an octave.
pub(super) const PER_OCTAVE: usize = 6;
/// Travel constant of each of the two poles, in wavelengths.
const POLE_WAVES: f32 = 0.85;
/// Travel that the energies lag behind by, in wavelengths: both poles'.
pub(super) const KERNEL_WAVES: f32 = 2.0 * POLE_WAVES;
/// Travel constant of the two high-passes in front, in mm: drift, slopes and the form of a surface are not to leak into
/// long waves. The first takes off the level, the second what a slope leaves of it.
const HIGH_PASS_MM: f32 = 3.0;
/// How nearly gauges count alike, whatever their gains: one that feels nothing but its noise is not to count as the
/// others do. 0 would be alike, and much above 1 by their energies.
const EQUAL: f32 = 0.1;
/// Travel constant of the average, in wavelengths.
pub(super) const AVERAGE_WAVES: f32 = 14.0;
/// Energy over all candidates, in ADC steps², of the least wave that is listened to. Below it the gauges are silent, and
/// there is nothing to average.
const LEAST_ENERGY: f32 = 10.0 * MIN_AMPLITUDE_LSB * MIN_AMPLITUDE_LSB;
/// Travel constant of the mean energy, in mm.
const LOUDNESS_MM: f32 = 20.0;
/// How many times louder than that mean most gauges become where the fingertip comes down on its way: 15 dB. A force that
/// swings by a half makes 9.5 dB, and a surface that becomes louder by and by is followed by the mean.
const LANDING: f32 = 30.0;
/// Weight of the mean below which too little has been felt to tell: some 4.5 mm.
const LEAST_FELT: f32 = 0.2;
/// Weight of a pole below which it is not looked at.
const LEAST_WEIGHT: f32 = 1e-3;

/// Weight of an average below which nothing is known of a candidate: its kernel is not full yet, and the little that it
/// holds looks like much.
const LEAST_MATURITY: f32 = 1e-3;

/// A candidate wavelength.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Phase of a place in 2⁻³² cycles.
    increment: u32,
    /// Travel constants of its poles in a mm.
    poles_per_mm: f32,
    /// Re and Im of each gauge behind the first pole, and behind both.
    first: Phasors,
    second: Phasors,
    first_weight: f32,
    second_weight: f32,
    /// The average, and the weight that it has.
    mean: f32,
    mean_weight: f32,
}

/// All candidates' energies, in one way or another.
pub(super) type Spectrum = [f32; CANDIDATES];

/// Re and Im of each gauge in a candidate.
pub(super) type Phasors = [[f32; 2]; GAUGES];

/// The energies of a moment, in ADC steps².
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// Of each candidate in the usable gauges over the latest waves: behind one pole, and behind both.
    pub short: Spectrum,
    /// See `short`.
    pub long: Spectrum,
    /// Of each gauge in all candidates, behind both poles.
    pub totals: [f32; GAUGES],
}

/// The bank of candidates.
#[derive(Clone, Debug)]
pub(super) struct Periodogram {
    candidates: [Candidate; CANDIDATES],
    /// The high-passes' level of each gauge at each spacing, none before the first knot, and what a slope leaves of it.
    level: [Option<[f32; GAUGES]>; SERVING],
    slope: [[f32; GAUGES]; SERVING],
    /// Mean of [`Moment::totals`] over the latest travel, and the weight that it has.
    loudness: [f32; GAUGES],
    loudness_weight: f32,
}

impl Periodogram {
    /// Nothing felt yet.
    pub fn new() -> Self {
        const {
            assert!(spacing_for(wavelength_mm(FINE - 1)) == 0);
            assert!(spacing_for(wavelength_mm(FINE)) == 1);
        }
        Self {
            candidates: core::array::from_fn(|i| {
                let wavelength_mm = wavelength_mm(i);
                Candidate {
                    increment: (4_294_967_296.0 / f64::from(wavelength_mm * PLACES_PER_MM as f32))
                        as u32,
                    poles_per_mm: 1.0 / (POLE_WAVES * wavelength_mm),
                    first: [[0.0; 2]; GAUGES],
                    second: [[0.0; 2]; GAUGES],
                    first_weight: 0.0,
                    second_weight: 0.0,
                    mean: 0.0,
                    mean_weight: 0.0,
                }
            }),
            level: [None; SERVING],
            slope: [[0.0; GAUGES]; SERVING],
            loudness: [0.0; GAUGES],
            loudness_weight: 0.0,
        }
    }

    /// Each gauge's present level in ADC steps; 0 before the first knot.
    pub fn level(&self) -> [f32; GAUGES] {
        self.level[0].unwrap_or_default()
    }

    /// Takes a knot of any spacing.
    pub fn push(&mut self, spacing: usize, knot: &Knot) {
        let Some(level) = self.level.get_mut(spacing) else {
            return;
        };
        let level = level.get_or_insert(knot.gauges);
        let slope = &mut self.slope[spacing];
        let z = knot.travel_mm * (1.0 / HIGH_PASS_MM);
        let follow = z / (1.0 + z);
        let mut felt = [0.0; GAUGES];
        for gauge in 0..GAUGES {
            level[gauge] += follow * (knot.gauges[gauge] - level[gauge]);
            let above = knot.gauges[gauge] - level[gauge];
            slope[gauge] += follow * (above - slope[gauge]);
            felt[gauge] = above - slope[gauge];
        }
        let (fine, coarse) = self.candidates.split_at_mut(FINE);
        for candidate in if spacing == 0 { fine } else { coarse } {
            candidate.take(knot, &felt);
        }
    }

    /// The energies of now. The usable gauges count nearly alike: see [`EQUAL`].
    pub fn energies(&self, usable: u8) -> Moment {
        let mut weights: [f32; GAUGES] =
            core::array::from_fn(|gauge| f32::from(usable >> gauge & 1));
        let long: [[f32; GAUGES]; CANDIDATES] = core::array::from_fn(|i| {
            let candidate = &self.candidates[i];
            powers(&candidate.second, candidate.second_weight)
        });
        let totals: [f32; GAUGES] =
            core::array::from_fn(|gauge| long.iter().map(|powers| powers[gauge]).sum());
        let total = weighed(&totals, &weights);
        let equal = EQUAL * total / larger(weights.iter().sum(), 1.0);
        for (weight, total) in weights.iter_mut().zip(totals) {
            *weight /= larger(total + equal, f32::MIN_POSITIVE);
        }
        // Together they hold as much as before.
        let scale = total / larger(weighed(&totals, &weights), f32::MIN_POSITIVE);
        let weights = weights.map(|weight| scale * weight);
        let short = core::array::from_fn(|i| {
            let candidate = &self.candidates[i];
            let powers = powers(&candidate.first, candidate.first_weight);
            weighed(&powers, &weights)
        });
        Moment {
            short,
            long: long.map(|powers| weighed(&powers, &weights)),
            totals,
        }
    }

    /// Whether the fingertip has just come down: most of the usable gauges are much louder than they have been.
    pub fn lands(&self, now: &Moment, usable: u8) -> bool {
        let louder = (0..GAUGES)
            .filter(|&gauge| usable >> gauge & 1 == 1)
            .filter(|&gauge| {
                self.loudness_weight * now.totals[gauge] > LANDING * self.loudness[gauge]
            })
            .count();
        self.loudness_weight > LEAST_FELT && 2 * louder > usable.count_ones() as usize
    }

    /// Takes the energies into the average, `travel_mm` after the last time.
    pub fn average(&mut self, now: &Moment, travel_mm: f32) {
        if travel_mm <= 0.0 {
            return;
        }
        let follow = travel_mm / (LOUDNESS_MM + travel_mm);
        for (loudness, total) in self.loudness.iter_mut().zip(now.totals) {
            *loudness += follow * (total - *loudness);
        }
        self.loudness_weight += follow * (1.0 - self.loudness_weight);
        let total: f32 = now.long.iter().sum();
        if total < LEAST_ENERGY {
            return;
        }
        let scale = 1.0 / total;
        for (candidate, energy) in self.candidates.iter_mut().zip(now.long) {
            let z = travel_mm * (POLE_WAVES / AVERAGE_WAVES) * candidate.poles_per_mm;
            // A kernel that is not full yet says little.
            let full = candidate.second_weight * candidate.second_weight;
            let follow = z / (1.0 + z) * full * full;
            candidate.mean_weight += follow * (1.0 - candidate.mean_weight);
            candidate.mean += follow * (energy * scale - candidate.mean);
        }
    }

    /// What the average holds counts for so much of what it did, beside what is still to come.
    pub fn forget(&mut self, share: f32) {
        for candidate in &mut self.candidates {
            candidate.mean *= share;
            candidate.mean_weight *= share;
        }
    }

    /// Starts the average over with the energies of now, of that weight.
    pub fn restart(&mut self, energies: &Spectrum, weight: f32) {
        let total: f32 = larger(energies.iter().sum(), f32::MIN_POSITIVE);
        for (candidate, energy) in self.candidates.iter_mut().zip(energies) {
            candidate.mean = weight * energy / total;
            candidate.mean_weight = weight;
        }
    }

    /// The average: shares of the energy, 0 where nothing is known yet.
    pub fn averaged(&self) -> Spectrum {
        core::array::from_fn(|i| {
            let candidate = &self.candidates[i];
            if candidate.mean_weight > LEAST_MATURITY {
                candidate.mean / candidate.mean_weight
            } else {
                0.0
            }
        })
    }

    /// Of candidate `number` behind both poles, in an unknown scale.
    pub fn phasors(&self, number: usize) -> &Phasors {
        &self.candidates[number].second
    }

    /// How full the average of candidate `number` is, 0 to 1.
    pub fn maturity(&self, number: usize) -> f32 {
        self.candidates[number].mean_weight
    }
}

impl Candidate {
    #[inline]
    fn take(&mut self, knot: &Knot, felt: &[f32; GAUGES]) {
        let z = knot.travel_mm * self.poles_per_mm;
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

/// Each gauge's energy in a candidate.
fn powers(sums: &Phasors, weight: f32) -> [f32; GAUGES] {
    if weight < LEAST_WEIGHT {
        return [0.0; GAUGES];
    }
    let scale = 2.0 / (weight * weight);
    sums.map(|[re, im]| scale * (re * re + im * im))
}

fn weighed(powers: &[f32; GAUGES], weights: &[f32; GAUGES]) -> f32 {
    powers
        .iter()
        .zip(weights)
        .map(|(power, weight)| power * weight)
        .sum()
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

/// Whether there is a peak at candidate `number`: the ends have none, nor has one beside what is not known yet.
pub(super) fn is_peak(spectrum: &Spectrum, number: usize) -> bool {
    if number < 1 || number + 1 >= CANDIDATES {
        return false;
    }
    let [before, height, after] = [number - 1, number, number + 1].map(|i| spectrum[i]);
    height >= before && height >= after && before > 0.0 && after > 0.0
}

/// The highest peak.
pub(super) fn highest_peak(spectrum: &Spectrum) -> Option<usize> {
    highest_by(spectrum, |number| spectrum[number])
}

/// The peak that stands highest above the mean of its flanks: what is random lies higher at long waves, and a line
/// beside it need not be the highest.
pub(super) fn clearest_peak(spectrum: &Spectrum) -> Option<usize> {
    highest_by(spectrum, |number| rise(spectrum, number))
}

fn highest_by(spectrum: &Spectrum, height: impl Fn(usize) -> f32) -> Option<usize> {
    (1..CANDIDATES - 1)
        .filter(|&number| is_peak(spectrum, number))
        .map(|number| (number, height(number)))
        .max_by(|(_, one), (_, other)| one.total_cmp(other))
        .map(|(number, _)| number)
}

/// How high a peak stands above the mean of its flanks.
pub(super) fn rise(spectrum: &Spectrum, number: usize) -> f32 {
    spectrum[number] - 0.5 * flanks(spectrum, number)
}

/// The sum of a peak's flanks, a third of an octave to either side.
fn flanks(spectrum: &Spectrum, number: usize) -> f32 {
    spectrum[number.saturating_sub(2)] + spectrum[(number + 2).min(CANDIDATES - 1)]
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
        let power = larger(larger(spectrum[i], least), f32::MIN_POSITIVE);
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
    2.0 * spectrum[number]
        / larger(
            flanks(spectrum, number),
            0.1 * spectrum[number] + f32::MIN_POSITIVE,
        )
}
