//! A bank of Goertzel filters over the last `N` ms: the power at evenly spaced frequencies, added over the
//! gauges, and its peak.
//!
//! A few lines here, since the crates for it have seen a release or two each, years ago.

use protocol::GAUGES;

use super::{HIGHEST_HZ, Rival, Window, peak};

/// Filters at most.
const MOST: usize = 64;
const SAMPLE_RATE_HZ: f32 = firmware_sensor::SAMPLE_RATE_HZ as f32;

/// Goertzel filters, half of the window's resolution of 1/`N` ms apart.
#[derive(Clone, Debug)]
pub struct Goertzel<const N: usize> {
    window: Window<N>,
    /// 2 cos(2πf/fs) of each filter.
    coefficients: [f32; MOST],
    filters: usize,
}

impl<const N: usize> Goertzel<N> {
    /// Distance of two filters in Hz: the documented resolution is half of it.
    pub const STEP_HZ: f32 = SAMPLE_RATE_HZ / (2 * N) as f32;
}

impl<const N: usize> Default for Goertzel<N> {
    fn default() -> Self {
        let angle = 2.0 * core::f32::consts::PI * Self::STEP_HZ / SAMPLE_RATE_HZ;
        Self {
            window: Window::default(),
            coefficients: core::array::from_fn(|k| 2.0 * libm::cosf(angle * (k + 1) as f32)),
            filters: ((HIGHEST_HZ / Self::STEP_HZ) as usize).min(MOST),
        }
    }
}

impl<const N: usize> Rival for Goertzel<N> {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        self.window.push(sample);
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        if !self.window.is_full() {
            return None;
        }
        let mut power = [0.0; MOST];
        for gauge in 0..GAUGES {
            let samples = self.window.swing(gauge);
            for (power, c) in power.iter_mut().zip(&self.coefficients[..self.filters]) {
                let (mut last, mut before) = (0.0, 0.0);
                for x in &samples {
                    let next = x + c * last - before;
                    before = last;
                    last = next;
                }
                *power += last * last + before * before - c * last * before;
            }
        }
        Some((1.0 + peak(&power[..self.filters])?) * Self::STEP_HZ)
    }

    fn age_half_ms(&self) -> usize {
        Window::<N>::middle_half_ms()
    }
}
