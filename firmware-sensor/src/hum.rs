//! Mains hum, taken out of the gauges.
//!
//! Each gauge's component at the mains' frequency is followed slowly (a notch some 1 Hz wide). A texture
//! may be at that frequency too, v/λ = 50 Hz. So as long as that may be, only what all gauges have in
//! common is taken for hum and out: hum enters the amplifiers alike, while a texture meets the gauges
//! with a different phase each.

use protocol::GAUGES;

use crate::SAMPLE_RATE_HZ;
use crate::phasor::phasor;

/// The mains' frequency in Hz.
pub const MAINS_HZ: u32 = 50;
/// Samples in a cycle of the mains.
const CYCLE: usize = (SAMPLE_RATE_HZ / MAINS_HZ) as usize;
const HALF: usize = CYCLE / 2;
const _: () = assert!(SAMPLE_RATE_HZ.is_multiple_of(2 * MAINS_HZ));
/// Time constant in samples.
const FOLLOWED_SAMPLES: f32 = 300.0;
/// Samples from the start until hum has been told from what else is at its frequency for the moment.
const LEARNED_SAMPLES: u32 = 400;
/// Samples from the start until a gauge may be blamed for its own hum: three time constants.
const SURE_SAMPLES: u32 = 3 * FOLLOWED_SAMPLES as u32;
/// Share of the gauges' power at the mains' frequency that is common to them, from which on it is taken
/// for hum, and up to which for texture. Five gauges of random phases have 0.2.
const COMMON: f32 = 0.6;
/// See [`COMMON`].
const DOUBTFUL: f32 = 0.4;
/// How near v/λ may come to the mains' frequency, in Hz, before a texture may be taken for hum.
const NEAR_HZ: f32 = 4.0;

/// What is known of the hum so far.
#[derive(Clone, Debug)]
pub struct Hum {
    /// Each gauge's complex amplitude at the mains' frequency.
    phasors: [[f32; 2]; GAUGES],
    before: [[f32; GAUGES]; HALF],
    samples: u32,
    near: bool,
}

impl Default for Hum {
    fn default() -> Self {
        Self {
            phasors: [[0.0; 2]; GAUGES],
            before: [[0.0; GAUGES]; HALF],
            samples: 0,
            near: true,
        }
    }
}

impl Hum {
    /// Takes hum out of a sample of the gauges, in place. `usable` are those that what is common is
    /// taken from.
    pub fn remove(&mut self, gauges: &mut [f32; GAUGES], usable: u8) {
        let at = self.samples as usize % CYCLE;
        let [cos, sin] = phasor((at as u64 * (1 << 32) / CYCLE as u64) as u32);
        let before = core::mem::replace(&mut self.before[at % HALF], *gauges);
        // Before there is a difference there is nothing to follow; then a plain mean, until it is as
        // long as the time constant.
        if let Some(samples) = self.samples.checked_sub(HALF as u32) {
            let follow = 1.0 / ((samples + 1) as f32).min(FOLLOWED_SAMPLES);
            for (gauge, z) in self.phasors.iter_mut().enumerate() {
                // What is at the mains' frequency comes out twice, offset and even harmonics not at all.
                let difference = gauges[gauge] - before[gauge];
                z[0] += follow * (difference * cos - z[0]);
                z[1] += follow * (-difference * sin - z[1]);
            }
        }
        self.samples = self.samples.saturating_add(1);
        if self.samples == u32::MAX {
            // Goes on where the phase was.
            self.samples -= CYCLE as u32 * HALF as u32;
        }
        let (common, share) = self.common(usable);
        let trust = ((share - DOUBTFUL) / (COMMON - DOUBTFUL)).clamp(0.0, 1.0);
        let common = common.map(|z| trust * z);
        for (x, own) in gauges.iter_mut().zip(self.phasors) {
            let z = if self.near { common } else { own };
            *x -= z[0] * cos - z[1] * sin;
        }
    }

    /// Tells at which frequency the texture is, v/λ̂ in Hz, if λ̂ can be relied on.
    pub fn texture_at(&mut self, frequency_hz: Option<f32>) {
        self.near = frequency_hz.is_none_or(|hz| (hz - MAINS_HZ as f32).abs() < NEAR_HZ);
    }

    /// Amplitude in ADC steps of what may be hum or texture and is not told apart yet; 0 from 0.4 s
    /// after the start on.
    pub fn pickup_lsb(&self, usable: u8) -> f32 {
        if self.samples >= LEARNED_SAMPLES {
            return 0.0;
        }
        let (common, share) = self.common(usable);
        if share < COMMON {
            return 0.0;
        }
        libm::hypotf(common[0], common[1])
    }

    /// Amplitude of a gauge's own hum in ADC steps, beyond what is common to `usable`; 0 as long as it
    /// may be texture.
    pub fn own_lsb(&self, gauge: usize, usable: u8) -> f32 {
        if self.near || self.samples < SURE_SAMPLES {
            return 0.0;
        }
        let (common, _) = self.common(usable & !(1 << gauge));
        let z = self.phasors[gauge];
        libm::hypotf(z[0] - common[0], z[1] - common[1])
    }

    /// The usable gauges' mean phasor, and the share of their power in it.
    fn common(&self, usable: u8) -> ([f32; 2], f32) {
        let (mut sum, mut power) = ([0.0; 2], 0.0);
        for (gauge, z) in self.phasors.iter().enumerate() {
            let take = f32::from(usable >> gauge & 1);
            sum[0] += take * z[0];
            sum[1] += take * z[1];
            power += take * (z[0] * z[0] + z[1] * z[1]);
        }
        let count = usable.count_ones().max(1) as f32;
        let mean = sum.map(|sum| sum / count);
        let common = count * (mean[0] * mean[0] + mean[1] * mean[1]);
        (mean, if power > 0.0 { common / power } else { 0.0 })
    }
}
