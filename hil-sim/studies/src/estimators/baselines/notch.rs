//! An adaptive notch filter: a second-order section whose zeros, on the unit circle, take one tone out, and
//! whose poles stand just inside. The frequency is adapted until what is left is least.
//!
//! S.-C. Pei and C.-C. Tseng, "Real time cascade adaptive notch filter scheme for sinusoidal parameter
//! estimation", Signal Processing 39 (1994) 117–130: recursive maximum likelihood for the one coefficient
//! of a section. Of their cascade one section is enough here, for one tone. All gauges share the
//! coefficient, each has a section of its own.

use core::f32::consts::PI;

use firmware_sensor::bandpass::{BAND, BandPass, Lane, ORDER};
use protocol::GAUGES;

use super::{HIGHEST_HZ, LOWEST_HZ, Rival};

const SAMPLE_RATE_HZ: f32 = firmware_sensor::SAMPLE_RATE_HZ as f32;
/// The poles' radius to begin with, and in the end: a notch of 64, then of 16 Hz. A wide one sees a tone
/// that is far away.
const RADIUS: (f32, f32) = (0.8, 0.95);
/// Share of the way from the one to the other that is left after a ms.
const NARROWING: f32 = 0.98;
/// Where the search begins, in Hz: the middle of the band, in octaves.
const FIRST_HZ: f32 = 20.0;
/// A mean of the band-pass' delay over its band, in half ms.
const BAND_PASS_DELAY_HALF_MS: usize = 8;

/// The filter.
#[derive(Clone, Debug)]
pub struct Notch {
    band_pass: BandPass<ORDER>,
    lanes: [Lane<ORDER>; GAUGES],
    sections: [Section; GAUGES],
    /// −2 cos of the tone's angle a sample.
    coefficient: f32,
    radius: f32,
    /// Sum of the squared gradients, forgetting.
    certainty: f32,
    /// What is left of it after a ms.
    keep: f32,
    memory_ms: u16,
}

/// A gauge's section: inputs, outputs and gradients, the last first.
#[derive(Clone, Copy, Debug, Default)]
struct Section {
    inputs: [f32; 2],
    outputs: [f32; 2],
    gradients: [f32; 2],
}

impl Section {
    /// The output is `fixed − coefficient · slope`.
    fn parts(&self, radius: f32, x: f32) -> (f32, f32) {
        let slope = radius * self.outputs[0] - self.inputs[0];
        (
            x + self.inputs[1] - radius * radius * self.outputs[1],
            slope,
        )
    }
}

impl Notch {
    /// A filter that forgets with a time constant of `memory_ms`, 10 to 200.
    pub fn new(memory_ms: u16) -> Self {
        let band_pass = BandPass::new(BAND);
        let lane = band_pass.settled(0.0);
        Self {
            band_pass,
            lanes: [lane; GAUGES],
            sections: [Section::default(); GAUGES],
            coefficient: coefficient_of(FIRST_HZ),
            radius: RADIUS.0,
            certainty: 0.0,
            keep: 1.0 - 1.0 / f32::from(memory_ms),
            memory_ms,
        }
    }
}

fn coefficient_of(frequency_hz: f32) -> f32 {
    -2.0 * libm::cosf(2.0 * PI * frequency_hz / SAMPLE_RATE_HZ)
}

impl Rival for Notch {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        let radius = self.radius;
        let (mut pull, mut squares) = (0.0, 0.0);
        // Each gauge's input, and its output's parts.
        let mut next = [(0.0, 0.0, 0.0); GAUGES];
        let gauges = self.sections.iter_mut().zip(&mut self.lanes).zip(sample);
        for (((section, lane), x), next) in gauges.zip(&mut next) {
            let x = self.band_pass.step(lane, *x);
            let (fixed, slope) = section.parts(radius, x);
            let [last, before] = section.gradients;
            let gradient = slope - radius * (self.coefficient * last + radius * before);
            section.gradients = [gradient, last];
            pull += gradient * (fixed - self.coefficient * slope);
            squares += gradient * gradient;
            *next = (x, fixed, slope);
        }
        self.certainty = self.keep * self.certainty + squares;
        if self.certainty > f32::MIN_POSITIVE {
            self.coefficient += pull / self.certainty;
        }
        self.radius = RADIUS.1 + NARROWING * (radius - RADIUS.1);
        // Beyond the range there is nothing to find: it begins again.
        let range = coefficient_of(LOWEST_HZ)..=coefficient_of(HIGHEST_HZ);
        if !range.contains(&self.coefficient) {
            self.coefficient = coefficient_of(FIRST_HZ);
            self.radius = RADIUS.0;
            self.certainty = squares;
        }
        for (section, (x, fixed, slope)) in self.sections.iter_mut().zip(next) {
            section.inputs = [x, section.inputs[0]];
            section.outputs = [fixed - self.coefficient * slope, section.outputs[0]];
        }
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        let angle = libm::acosf(-0.5 * self.coefficient);
        (self.certainty > 0.0).then_some(angle * SAMPLE_RATE_HZ / (2.0 * PI))
    }

    /// The mean age of what is not forgotten.
    fn age_half_ms(&self) -> usize {
        2 * usize::from(self.memory_ms).min(190) + BAND_PASS_DELAY_HALF_MS
    }
}
