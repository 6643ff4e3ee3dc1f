//! One wavelength of the bank: what it sums up over the travel, and the fit that this amounts to.

use protocol::GAUGES;

use crate::estimator::{PLACES_PER_MM, Place};
use crate::phasor::phasor;

/// Touches that are taken up together: half the work, for a kernel in steps of 2 ms of travel.
pub(super) const BLOCK: usize = 2;
/// Weight below which nothing is fitted, and determinant relative to its square.
const LEAST_WEIGHT: f32 = 1e-3;
const LEAST_SOLVABLE: f32 = 0.02;

/// What a candidate sums up over its kernel, of weights w, gauge samples s and phases θ = 2πx/λ. In this
/// order: Re and Im of Σ w s exp(−jθ) for each gauge; Σ w s for each; Σ w s² for each; Re and Im of
/// Σ w exp(−jθ); Re and Im of Σ w exp(−2jθ); Σ w.
const SUMS: usize = 4 * GAUGES + 5;
const MEAN: usize = 2 * GAUGES;
const SQUARE: usize = 3 * GAUGES;
const FIRST: usize = 4 * GAUGES;
const SECOND: usize = FIRST + 2;
const WEIGHT: usize = FIRST + 4;
pub(super) type Sums = [f32; SUMS];

/// The two kernels of a candidate, by the low-pass they are taken behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kernel {
    /// Behind the first: exp(−s/a)/a. Forgets sooner, tells wavelengths apart less.
    Short,
    /// Behind both: s·exp(−s/a)/a².
    Long,
}

/// A wavelength and what it has summed up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) wavelength_mm: f32,
    /// Phase of a place unit in 2⁻³² cycles: times a wrapping place it gives a wrapping phase, exact for
    /// any travel.
    pub(super) increment: u32,
    /// 1/a, in 1/places.
    pub(super) per_place: f32,
    short: Sums,
    long: Sums,
}

/// A touch and its weight.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weighed {
    pub(super) place: Place,
    pub(super) weight: f32,
    pub(super) gauges: [f32; GAUGES],
}

/// The matrix of a candidate's fit, common to all gauges.
pub(super) struct Fit {
    pub(super) weight: f32,
    first: [f32; 2],
    p: f32,
    r: [f32; 2],
    scale: f32,
    determinant: f32,
}

impl Candidate {
    pub(super) fn new(wavelength_mm: f32, travel_wavelengths: f32) -> Self {
        let places = wavelength_mm * PLACES_PER_MM as f32;
        Self {
            wavelength_mm,
            increment: (4_294_967_296.0 / f64::from(places)) as u32,
            per_place: 1.0 / (travel_wavelengths * places),
            short: [0.0; SUMS],
            long: [0.0; SUMS],
        }
    }

    pub(super) fn sums(&self, kernel: Kernel) -> &Sums {
        match kernel {
            Kernel::Short => &self.short,
            Kernel::Long => &self.long,
        }
    }

    /// Energy in `gauges` that this wavelength explains, summed over them.
    pub(super) fn energy(&self, kernel: Kernel, gauges: u8) -> f32 {
        let sums = self.sums(kernel);
        Fit::of(sums).map_or(0.0, |fit| {
            gauges_of(gauges).map(|gauge| fit.energy(sums, gauge)).sum()
        })
    }

    /// What the peak is found by: the geometric mean of the energy that the fit explains and of its
    /// amplitude squared, each summed over `gauges`. As the latest travel covers a little more or less
    /// than whole waves both ripple, in opposite ways; their mean does half as much.
    pub(super) fn power(&self, kernel: Kernel, gauges: u8) -> f32 {
        let sums = self.sums(kernel);
        Fit::of(sums).map_or(0.0, |fit| {
            let (mut energy, mut squares) = (0.0, 0.0);
            for gauge in gauges_of(gauges) {
                energy += fit.energy(sums, gauge);
                squares += fit.amplitude_squared(sums, gauge);
            }
            libm::sqrtf(energy * squares)
        })
    }

    /// Takes up a block of `travel` places, above 0.
    #[inline]
    pub(super) fn take_up(&mut self, block: &[Weighed; BLOCK], rest: &Rest, travel: f32) {
        let mut sums = [0.0; SUMS];
        for weighed in block {
            let [cos, sin] = phasor((weighed.place as u32).wrapping_mul(self.increment));
            let (re, im) = (weighed.weight * cos, -weighed.weight * sin);
            for (gauge, x) in weighed.gauges.iter().enumerate() {
                sums[2 * gauge] += re * x;
                sums[2 * gauge + 1] += im * x;
            }
            sums[FIRST] += re;
            sums[FIRST + 1] += im;
            sums[SECOND] += re * cos + im * sin;
            sums[SECOND + 1] += im * cos - re * sin;
        }
        sums[MEAN..FIRST].copy_from_slice(&rest.0);
        sums[WEIGHT] = travel;
        // exp(−z), to within 2 % for whatever z ≥ 0, and within z³/6 for the small ones.
        let z = travel * self.per_place;
        let keep = 1.0 / (1.0 + z * (1.0 + 0.5 * z));
        let take = 1.0 - keep;
        let scale = take / travel;
        for ((short, long), sum) in self.short.iter_mut().zip(&mut self.long).zip(sums) {
            *short = keep * *short + scale * sum;
            *long = keep * *long + take * *short;
        }
    }
}

/// The sums of a block that are the same for every candidate: Σ w s and Σ w s² of each gauge.
pub(super) struct Rest([f32; 2 * GAUGES]);

impl Rest {
    pub(super) fn of(block: &[Weighed; BLOCK]) -> Self {
        let mut sums = [0.0; 2 * GAUGES];
        for weighed in block {
            for (gauge, x) in weighed.gauges.iter().enumerate() {
                sums[gauge] += weighed.weight * x;
                sums[GAUGES + gauge] += weighed.weight * x * x;
            }
        }
        Self(sums)
    }
}

impl Fit {
    /// The normal equations with the constant eliminated: of S = Σ w s e^(−jθ), C, Q, W the sums in the
    /// order of [`SUMS`], D = Σ w s and the wave's complex amplitude A, s ≈ d + Re(A e^(jθ)):
    /// P A + R A* = 2 (S − D C / W) with P = W − |C|²/W and R = Q − C²/W. None if constant, cosine and
    /// sine can't be told apart at all.
    pub(super) fn of(sums: &Sums) -> Option<Self> {
        let weight = sums[WEIGHT];
        if weight < LEAST_WEIGHT {
            return None;
        }
        let (c0, c1) = (sums[FIRST], sums[FIRST + 1]);
        let p = weight - (c0 * c0 + c1 * c1) / weight;
        let r0 = sums[SECOND] - (c0 * c0 - c1 * c1) / weight;
        let r1 = sums[SECOND + 1] - 2.0 * c0 * c1 / weight;
        let determinant = p * p - r0 * r0 - r1 * r1;
        (determinant > LEAST_SOLVABLE * weight * weight).then_some(Self {
            weight,
            first: [c0 / weight, c1 / weight],
            p,
            r: [r0, r1],
            scale: 2.0 / (determinant * weight),
            determinant,
        })
    }

    /// The determinant, 1 if the travel covers whole waves evenly.
    pub(super) fn determined(&self) -> f32 {
        self.determinant / (self.weight * self.weight)
    }

    /// Energy in the gauge that the wave explains, per weight: half its amplitude squared.
    pub(super) fn energy(&self, sums: &Sums, gauge: usize) -> f32 {
        let mean = sums[MEAN + gauge];
        let s0 = sums[2 * gauge] - mean * self.first[0];
        let s1 = sums[2 * gauge + 1] - mean * self.first[1];
        let [r0, r1] = self.r;
        let direct = self.p * (s0 * s0 + s1 * s1);
        let image = r0 * (s0 * s0 - s1 * s1) + 2.0 * r1 * s0 * s1;
        (self.scale * (direct - image)).max(0.0)
    }

    /// The wave's amplitude in the gauge, squared.
    fn amplitude_squared(&self, sums: &Sums, gauge: usize) -> f32 {
        let mean = sums[MEAN + gauge];
        let s0 = sums[2 * gauge] - mean * self.first[0];
        let s1 = sums[2 * gauge + 1] - mean * self.first[1];
        let [r0, r1] = self.r;
        // (P S − R S*) / (P² − |R|²)
        let a0 = self.p * s0 - (r0 * s0 + r1 * s1);
        let a1 = self.p * s1 - (r1 * s0 - r0 * s1);
        let scale = 2.0 / self.determinant;
        scale * scale * (a0 * a0 + a1 * a1)
    }

    /// The gauge's variance, per weight.
    pub(super) fn variance(&self, sums: &Sums, gauge: usize) -> f32 {
        let mean = sums[MEAN + gauge] / self.weight;
        sums[SQUARE + gauge] / self.weight - mean * mean
    }
}

/// The gauges whose bit is set.
pub(super) fn gauges_of(mask: u8) -> impl Iterator<Item = usize> {
    (0..GAUGES).filter(move |gauge| mask >> gauge & 1 == 1)
}
