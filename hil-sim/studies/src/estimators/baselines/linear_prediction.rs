//! AR(2): a tone obeys x(t) + x(t − 2τ) = 2 cos(ωτ) x(t − τ). Pisarenko's closed form for cos(ωτ), from the
//! band-passed gauges' correlations over the last `N` ms, added over the gauges.

use firmware_sensor::bandpass::{BAND, BandPass, Lane, ORDER};
use protocol::GAUGES;

use super::{Rival, Window};

/// τ in samples. With 1 ms, ωτ would be next to 0 and noise would decide; with 3 ms it is π at 167 Hz.
const LAG: usize = 3;
/// A mean of the band-pass' delay over its band, in half ms.
const BAND_PASS_DELAY_HALF_MS: usize = 8;

/// Linear prediction over `N` ms.
#[derive(Clone, Debug)]
pub struct LinearPrediction<const N: usize> {
    band_pass: BandPass<ORDER>,
    lanes: [Lane<ORDER>; GAUGES],
    window: Window<N>,
}

impl<const N: usize> Default for LinearPrediction<N> {
    fn default() -> Self {
        let band_pass = BandPass::new(BAND);
        let lane = band_pass.settled(0.0);
        Self {
            band_pass,
            lanes: [lane; GAUGES],
            window: Window::default(),
        }
    }
}

impl<const N: usize> Rival for LinearPrediction<N> {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        let mut banded = *sample;
        for (x, lane) in banded.iter_mut().zip(&mut self.lanes) {
            *x = self.band_pass.step(lane, *x);
        }
        self.window.push(&banded);
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        if !self.window.is_full() {
            return None;
        }
        let (mut near, mut far) = (0.0, 0.0);
        for gauge in 0..GAUGES {
            let samples = self.window.samples(gauge);
            let triples = samples[2 * LAG..].iter().zip(&samples[LAG..]).zip(&samples);
            for ((new, middle), old) in triples {
                near += middle * (new + old);
                far += new * old;
            }
        }
        near *= 0.5;
        if near == 0.0 {
            return None;
        }
        let cosine = (far + libm::sqrtf(far * far + 8.0 * near * near)) / (4.0 * near);
        let angle = libm::acosf(cosine.clamp(-1.0, 1.0));
        let rate_hz = firmware_sensor::SAMPLE_RATE_HZ as f32;
        let frequency_hz = angle * rate_hz / (2.0 * core::f32::consts::PI * LAG as f32);
        (frequency_hz > 0.0).then_some(frequency_hz)
    }

    fn age_half_ms(&self) -> usize {
        Window::<N>::middle_half_ms() + BAND_PASS_DELAY_HALF_MS
    }
}
