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

/// A Fourier transform: a crate for the host, another for the board.
pub trait Transform {
    /// Adds the power of the first [`LINES`] lines of `samples`, which may be used up.
    fn add_power(&mut self, samples: &mut [f32; LENGTH], power: &mut [f32; LINES]);
}

/// The peak of the spectrum over `N` ms, at most [`LENGTH`].
#[derive(Clone, Debug)]
pub struct Spectrum<const N: usize, T> {
    window: Window<N>,
    hann: [f32; N],
    transform: T,
}

impl<const N: usize, T: Transform> Spectrum<N, T> {
    /// With this transform.
    pub fn new(transform: T) -> Self {
        const { assert!(N <= LENGTH) };
        let angle = 2.0 * core::f32::consts::PI / N as f32;
        Self {
            window: Window::default(),
            hann: core::array::from_fn(|n| 0.5 - 0.5 * libm::cosf(angle * (n as f32 + 0.5))),
            transform,
        }
    }
}

impl<const N: usize, T: Transform> Rival for Spectrum<N, T> {
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
            self.transform.add_power(&mut samples, &mut power);
        }
        Some((FIRST_LINE as f32 + peak(&power[FIRST_LINE..])?) * LINE_HZ)
    }

    fn age_half_ms(&self) -> usize {
        Window::<N>::middle_half_ms()
    }
}
