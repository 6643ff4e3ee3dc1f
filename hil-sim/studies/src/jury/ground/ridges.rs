//! Surfaces with a period: their waves, and how regular they are.

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;

use super::super::counts::Partials;
use super::super::dice::Dice;
use super::{LONGEST_MM, SHORTEST_MM};

/// One wave of a surface with a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Waveform {
    /// A sine.
    Sine,
    /// Flat ridges with straight flanks.
    Trapezoid {
        /// Share of the wave that is ridge, between the middles of the flanks.
        duty: f64,
        /// Share of the wave that one flank takes.
        flank: f64,
    },
    /// exp(κ cos φ): round ridges, the narrower the greater κ.
    Smooth {
        /// κ.
        sharpness: f64,
    },
    /// A sine with its second and third harmonics.
    Harmonics {
        /// Amplitudes over the fundamental's.
        shares: [f64; 2],
        /// Phases in rad.
        phases: [f64; 2],
    },
    /// A second wave that has no small common multiple with the first. The first is the stronger.
    TwoWaves {
        /// The second's wavelength over the first's.
        ratio: f64,
        /// The second's amplitude over the first's, under the fingertip.
        share: f64,
        /// Phase of the second, in rad.
        phase: f64,
    },
    /// A sine and its second harmonic, each wave of another height.
    Weave {
        /// The second harmonic's amplitude over the fundamental's.
        second: f64,
        /// Phase of the second harmonic, in rad.
        phase: f64,
        /// Standard deviation of a wave's height over their mean.
        uneven: f64,
    },
}

/// How regular ridges are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ridges {
    /// Of the surface as a mean, in mm.
    pub wavelength_mm: f64,
    /// Their form.
    pub waveform: Waveform,
    /// Share of them that is worn.
    pub worn: f64,
    /// Height of a worn one over a whole one's; 0 is missing.
    pub left: f64,
    /// Standard deviation of their places, over λ.
    pub jitter: f64,
    /// Whether a shift moves all ridges that follow, too.
    pub accumulates: bool,
    /// λ goes up and down by this share of its mean …
    pub gradient: f64,
    /// … as a sine of this period, in mm.
    pub gradient_mm: f64,
}

impl Waveform {
    /// Draws the second wave: 1.25 to 2.9 times as long or as short, a tenth away from ½, ⅔, 1½, 2.
    pub fn two_waves(dice: &mut Dice) -> Self {
        let ratio = loop {
            let ratio = dice.log_between(1.25, 2.9);
            if [1.5, 2.0]
                .iter()
                .all(|simple| (ratio / simple - 1.0).abs() > 0.1)
            {
                break if dice.chance(0.5) { ratio } else { 1.0 / ratio };
            }
        };
        Self::TwoWaves {
            ratio,
            share: dice.between(0.3, 0.7),
            phase: dice.angle(),
        }
    }
}

impl Ridges {
    /// Draws a waveform's surface: λ log-uniform in 0.7–7 mm; see [`super::super::stranger`] for the rest.
    pub fn draw(dice: &mut Dice, waveform: Waveform) -> Self {
        let wavelength_mm = dice.log_between(0.7, 7.0);
        let worn = dice.sometimes(0.35, 0.02, 0.3);
        let left = dice.sometimes(0.5, 0.0, 0.7);
        let jitter = dice.sometimes(0.5, 0.0, 0.04);
        let accumulates = dice.chance(0.5);
        let steepness_per_mm = dice.sometimes(0.35, 0.0, 0.01);
        let gradient_mm = dice.between(40.0, 200.0);
        // A sine of amplitude a has its steepest at a · 2π/period.
        let room = (LONGEST_MM / wavelength_mm - 1.0).min(1.0 - SHORTEST_MM / wavelength_mm);
        Self {
            wavelength_mm,
            waveform,
            worn,
            left,
            jitter,
            accumulates,
            gradient: (steepness_per_mm * gradient_mm / TAU).min(room),
            gradient_mm,
        }
    }

    /// The longest wave with the gradient, in mm.
    pub fn longest_mm(&self) -> f64 {
        self.wavelength_mm * (1.0 + self.gradient)
    }

    fn local_mm(&self, u_mm: f64) -> f64 {
        let swing = if self.gradient > 0.0 {
            self.gradient * libm::sin(TAU * u_mm / self.gradient_mm)
        } else {
            0.0
        };
        self.wavelength_mm * (1.0 + swing)
    }

    /// The partials of a whole ridge, Zₙ (Z̄₁/|Z₁|)ⁿ / |Z₁| where the wave is Σ |Zₙ| sin(nθ + arg Zₙ), under a contact
    /// of that deviation in mm. At the mean λ. None of two waves.
    pub(super) fn partials(&self, contact_sigma_mm: f64) -> Option<Partials> {
        const POINTS: u32 = 512;
        if matches!(self.waveform, Waveform::TwoWaves { .. }) {
            return None;
        }
        let partial = |n: f64| {
            let sum: Complex64 = (0..POINTS)
                .map(|point| {
                    let share = f64::from(point) / f64::from(POINTS);
                    let height = self.height(share, share, contact_sigma_mm);
                    Complex64::from_polar(height, -TAU * n * share)
                })
                .sum();
            let radian = TAU * n * contact_sigma_mm / self.wavelength_mm;
            sum * Complex64::I * libm::exp(-0.5 * radian * radian)
        };
        let first = partial(1.0);
        let back = first.conj() / first.norm();
        Some([2, 3].map(|n| partial(f64::from(n)) * back.powi(n) / first.norm()))
    }

    /// Heights and local λ at each point of the way; `across_mm` is the way across the ridges there.
    pub(super) fn lay(
        &self,
        across_mm: &[f64],
        contact_sigma_mm: f64,
        dice: &mut Dice,
    ) -> (Vec<f32>, Vec<f32>) {
        let mut phase = dice.uniform();
        let mut ridge = Ridge::first(self, dice);
        let mut before_mm = across_mm[0];
        let mut heights = Vec::with_capacity(across_mm.len());
        let mut waves = Vec::with_capacity(across_mm.len());
        let valley = self.height(0.0, 0.0, contact_sigma_mm);
        for &u_mm in across_mm {
            let local_mm = self.local_mm(u_mm);
            phase += (u_mm - before_mm) / local_mm;
            before_mm = u_mm;
            while phase >= ridge.end {
                ridge = ridge.next(self, dice);
            }
            let share = (phase - ridge.begin) / (ridge.end - ridge.begin);
            let whole = self.height(share, ridge.number + share, contact_sigma_mm);
            let base = if matches!(self.waveform, Waveform::TwoWaves { .. }) {
                0.0
            } else {
                valley
            };
            heights.push((base + ridge.height * (whole - base)) as f32);
            waves.push(local_mm as f32);
        }
        (heights, waves)
    }

    /// Height at a share of a wave, and at that many waves from the first on.
    fn height(&self, share: f64, waves: f64, contact_sigma_mm: f64) -> f64 {
        let turn = TAU * share;
        match self.waveform {
            Waveform::Sine => -libm::cos(turn),
            Waveform::Trapezoid { duty, flank } => {
                let from_middle = (share - 0.5).abs();
                ((0.5 * duty - from_middle) / flank).clamp(-0.5, 0.5)
            }
            Waveform::Smooth { sharpness } => libm::exp(sharpness * (-libm::cos(turn) - 1.0)),
            Waveform::Harmonics { shares, phases } => {
                -libm::cos(turn)
                    + shares[0] * libm::cos(2.0 * turn + phases[0])
                    + shares[1] * libm::cos(3.0 * turn + phases[1])
            }
            Waveform::TwoWaves {
                ratio,
                share: weaker,
                phase,
            } => {
                // What the contact takes from each is made up for, so that the share holds under it.
                let blur = |mm: f64| {
                    let radian = TAU * contact_sigma_mm / mm;
                    libm::exp(-0.5 * radian * radian)
                };
                let mm = self.wavelength_mm;
                let weaker = weaker * blur(mm) / blur(mm * ratio);
                -libm::cos(turn) + weaker * libm::cos(TAU * waves / ratio + phase)
            }
            Waveform::Weave { second, phase, .. } => {
                -libm::cos(turn) + second * libm::cos(2.0 * turn + phase)
            }
        }
    }
}

/// One ridge: where it begins and ends, in waves, and how high it is.
struct Ridge {
    number: f64,
    begin: f64,
    end: f64,
    /// Where the next one would begin if no other shift came.
    shift: f64,
    height: f64,
}

impl Ridge {
    fn first(ridges: &Ridges, dice: &mut Dice) -> Self {
        Self {
            number: -1.0,
            begin: -1.0,
            end: 0.0,
            shift: 0.0,
            height: 1.0,
        }
        .next(ridges, dice)
    }

    fn next(&self, ridges: &Ridges, dice: &mut Dice) -> Self {
        let number = self.number + 1.0;
        let chance = ridges.jitter * dice.gaussian();
        let shift = if ridges.accumulates {
            self.shift + chance
        } else {
            chance
        };
        let worn = dice.chance(ridges.worn);
        let uneven = match ridges.waveform {
            Waveform::Weave { uneven, .. } => (1.0 + uneven * dice.gaussian()).max(0.0),
            _ => 1.0,
        };
        Self {
            number,
            begin: self.end,
            // A tenth of a wave at least.
            end: (number + 1.0 + shift).max(self.end + 0.1),
            shift,
            height: uneven * if worn { ridges.left } else { 1.0 },
        }
    }
}
