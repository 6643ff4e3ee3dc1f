//! The peak of the spectrum: the last `N` ms of each gauge under a Hann window, filled up with zeros to
//! [`LENGTH`], transformed, the power added over the gauges.

use protocol::GAUGES;

use super::{HIGHEST_HZ, LOWEST_HZ, Rival, Window, peak};

/// Samples that are transformed.
pub const LENGTH: usize = 512;
/// Distance of two lines of the spectrum, in Hz.
pub const LINE_HZ: f32 = firmware_sensor::SAMPLE_RATE_HZ as f32 / LENGTH as f32;
const FIRST_LINE: usize = (LOWEST_HZ / LINE_HZ) as usize;
/// The line after the last one that is looked at.
pub const LINES: usize = (HIGHEST_HZ / LINE_HZ) as usize + 1;

/// Adds the power of the first [`LINES`] lines of `samples`, which are used up.
pub fn add_power(samples: &mut [f32; LENGTH], power: &mut [f32; LINES]) {
    for (power, line) in power.iter_mut().zip(microfft::real::rfft_512(samples)) {
        *power += line.re * line.re + line.im * line.im;
    }
}

/// The peak of the spectrum over `N` ms, at most [`LENGTH`].
#[derive(Clone, Debug)]
pub struct Spectrum<const N: usize> {
    window: Window<N>,
    hann: [f32; N],
}

impl<const N: usize> Default for Spectrum<N> {
    fn default() -> Self {
        const { assert!(N <= LENGTH) };
        let angle = 2.0 * core::f32::consts::PI / N as f32;
        Self {
            window: Window::default(),
            hann: core::array::from_fn(|n| 0.5 - 0.5 * libm::cosf(angle * (n as f32 + 0.5))),
        }
    }
}

impl<const N: usize> Rival for Spectrum<N> {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        self.window.push(sample);
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        if !self.window.is_full() {
            return None;
        }
        let mut power = [0.0; LINES];
        for gauge in 0..GAUGES {
            let mut samples = [0.0; LENGTH];
            let swing = self.window.swing(gauge);
            for ((to, x), weight) in samples.iter_mut().zip(&swing).zip(&self.hann) {
                *to = x * weight;
            }
            add_power(&mut samples, &mut power);
        }
        Some((FIRST_LINE as f32 + peak(&power[FIRST_LINE..])?) * LINE_HZ)
    }

    fn age_half_ms(&self) -> usize {
        Window::<N>::middle_half_ms()
    }
}
