//! What a fit leaves of one gauge, and its spectrum over wavenumber.

use protocol::texture::{BANDS, LOWEST_BAND_PER_MM};

use super::block::{Fit, Ground, KNOTS, TERMS, terms, waves};
use crate::phasor::phasor;

/// What is left is worked out for so many knots at a time.
const KNOTS_A_STEP: usize = 12;
/// Lines of its spectrum at a time.
const LINES_A_STEP: usize = 3;
/// Steps from one block's end to the next one's beginning, at least: at usual speeds a third of the ground is felt, at a
/// third of the cost.
const STEPS: usize = 50;

/// How far the spectrum of what a block's fit leaves has come.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    coefficients: [f32; TERMS],
    /// Of the block.
    length_mm: f32,
    pub wavelength_mm: f32,
    /// The highest wavenumber that is believed, per mm.
    highest_per_mm: f32,
    /// Touches in a knot.
    touches: f32,
    /// Density of the noise's power, in ADC steps² mm.
    noise: f32,
    /// Power of the gauge's fundamental, in ADC steps².
    pub fundamental: f32,
    /// Knots whose rest is known, and lines of the spectrum.
    next_knot: usize,
    next_line: usize,
    steps: usize,
    pub bands: [f32; BANDS],
    /// Lines in each band.
    pub lines: [f32; BANDS],
}

impl Rest {
    /// Of a block of that length and so many touches, with the fit of its ground, the power of its fundamental and the
    /// density of its noise in ADC steps² mm; above `highest_per_mm` nothing is believed.
    pub fn new(
        fit: &Fit,
        wavelength_mm: f32,
        [length_mm, touches]: [f32; 2],
        noise: f32,
        highest_per_mm: f32,
    ) -> Self {
        let touches = (touches * (1.0 / KNOTS as f32)).max(1.0);
        let knot_waves = length_mm / KNOTS as f32 / wavelength_mm;
        let mut coefficients = fit.coefficients;
        for (n, pair) in (1_u8..).zip(coefficients[2..].chunks_exact_mut(2)) {
            let left = left_of_mean(f32::from(n) * knot_waves, touches);
            pair.iter_mut().for_each(|part| *part *= left);
        }
        Self {
            coefficients,
            length_mm,
            wavelength_mm,
            highest_per_mm,
            touches,
            noise,
            fundamental: fit.power(1),
            next_knot: 0,
            next_line: 1,
            steps: 0,
            bands: [0.0; BANDS],
            lines: [0.0; BANDS],
        }
    }

    /// A step; true once all is done. Takes the fit off `ground`, of which nothing else is to be wanted.
    pub fn step(&mut self, ground: &mut Ground) -> bool {
        self.steps += 1;
        if self.next_knot < KNOTS {
            let end = (self.next_knot + KNOTS_A_STEP).min(KNOTS);
            for knot in self.next_knot..end {
                let waves = waves(u32::from(ground.phases[knot]) << 16);
                let fitted: f32 = terms(knot, waves)
                    .iter()
                    .zip(&self.coefficients)
                    .map(|(term, coefficient)| term * coefficient)
                    .sum();
                ground.felt[knot] -= fitted;
            }
            self.next_knot = end;
            return false;
        }
        for _ in 0..LINES_A_STEP {
            if self.next_line <= KNOTS / 2 {
                self.line(&ground.felt);
            }
        }
        self.next_line > KNOTS / 2 && self.steps >= STEPS
    }

    /// A line of the spectrum.
    fn line(&mut self, left: &[f32; KNOTS]) {
        let line = self.next_line;
        self.next_line += 1;
        let per_mm = line as f32 / self.length_mm;
        // What is beyond half the knots' rate is not there.
        let highest = self
            .highest_per_mm
            .min(0.5 * KNOTS as f32 / self.length_mm + 1e-3);
        let Some(band) = band_of(per_mm).filter(|&band| UPPER_ENDS[band] <= highest) else {
            return;
        };
        // Goertzel's recurrence.
        let [cos, _] = phasor((line as u32).wrapping_mul(u32::MAX / KNOTS as u32));
        let twice = 2.0 * cos;
        let (mut one, mut two) = (0.0, 0.0);
        for x in left {
            (one, two) = (x + twice * one - two, one);
        }
        // A mean square.
        let power = (one * one + two * two - twice * one * two) * (2.0 / (KNOTS * KNOTS) as f32);
        let of_mean = left_of_mean(line as f32 / KNOTS as f32, self.touches);
        // A line stands for as much of the spectrum as lies between two.
        self.bands[band] += (power - self.noise / self.length_mm) / (of_mean * of_mean);
        self.lines[band] += 1.0;
    }
}

/// What the mean over so many touches, evenly over so many waves, leaves of a wave.
fn left_of_mean(waves: f32, touches: f32) -> f32 {
    // Half of the waves' angle.
    let sine = |waves: f32| phasor((2_147_483_648.0 * waves) as u32)[1];
    sine(waves) / (touches * sine(waves / touches))
}

/// The upper end of each band, in waves per mm.
const UPPER_ENDS: [f32; BANDS] = {
    let mut ends = [2.0 * LOWEST_BAND_PER_MM; BANDS];
    let mut band = 1;
    while band < BANDS {
        ends[band] = 2.0 * ends[band - 1];
        band += 1;
    }
    ends
};

/// The band that a wavenumber is in, in waves per mm.
pub(super) fn band_of(per_mm: f32) -> Option<usize> {
    if per_mm < LOWEST_BAND_PER_MM {
        return None;
    }
    UPPER_ENDS.iter().position(|&end| per_mm < end)
}
