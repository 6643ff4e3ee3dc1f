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
/// Phase of a sample in 2⁻³² cycles of the mains.
const PHASE_PER_SAMPLE: u32 = ((1_u64 << 32) / CYCLE as u64) as u32;
/// Where the count of samples goes back by whole cycles.
const WRAP_SAMPLES: u32 = 1 << 31;
const _: () = assert!(SAMPLE_RATE_HZ.is_multiple_of(2 * MAINS_HZ));
/// Time constant in samples.
const FOLLOWED_SAMPLES: f32 = 300.0;
/// Samples from the start until hum has been told from what else is at its frequency for the moment.
const LEARNED_SAMPLES: u32 = 400;
/// Samples from the start until what was felt before is forgotten for the most part.
const FORGOTTEN_SAMPLES: u32 = LEARNED_SAMPLES + 100;
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
    pickup_lsb: f32,
    /// What is taken out of each gauge, renewed with every estimate.
    removed: [[f32; 2]; GAUGES],
}

impl Default for Hum {
    fn default() -> Self {
        Self {
            phasors: [[0.0; 2]; GAUGES],
            before: [[0.0; GAUGES]; HALF],
            samples: 0,
            near: true,
            pickup_lsb: 0.0,
            removed: [[0.0; 2]; GAUGES],
        }
    }
}

impl Hum {
    /// Takes hum out of a sample of the gauges, in place.
    pub fn remove(&mut self, gauges: &mut [f32; GAUGES]) {
        let at = self.samples as usize % CYCLE;
        let [cos, sin] = phasor(at as u32 * PHASE_PER_SAMPLE);
        let before = core::mem::replace(&mut self.before[at % HALF], *gauges);
        // Before there is a difference there is nothing to follow; then a plain mean, until it is as
        // long as the time constant.
        if let Some(samples) = self.samples.checked_sub(HALF as u32) {
            let follow = 1.0 / ((samples + 1) as f32).min(FOLLOWED_SAMPLES);
            let (re, im) = (follow * cos, -follow * sin);
            let keep = 1.0 - follow;
            for ((z, x), before) in self.phasors.iter_mut().zip(&*gauges).zip(before) {
                // What is at the mains' frequency comes out twice, offset and even harmonics not at all.
                let difference = x - before;
                z[0] = keep * z[0] + re * difference;
                z[1] = keep * z[1] + im * difference;
            }
        }
        self.samples += 1;
        if self.samples == WRAP_SAMPLES {
            // Goes on at the same phase.
            self.samples -= CYCLE as u32 * HALF as u32 * 1_000;
        }
        for (x, z) in gauges.iter_mut().zip(self.removed) {
            *x -= z[0] * cos - z[1] * sin;
        }
    }

    /// Renews what is taken out, once an estimate: `usable` are the gauges that what is common is taken
    /// from, `texture_hz` the texture's frequency v/λ̂, if λ̂ can be relied on.
    pub fn renew(&mut self, usable: u8, texture_hz: Option<f32>) {
        self.near = texture_hz.is_none_or(|hz| (hz - MAINS_HZ as f32).abs() < NEAR_HZ);
        let (common, share) = self.common(usable);
        let learned = self.samples >= LEARNED_SAMPLES;
        self.pickup_lsb = if self.samples < FORGOTTEN_SAMPLES && share >= DOUBTFUL {
            libm::sqrtf(common[0] * common[0] + common[1] * common[1])
        } else {
            0.0
        };
        self.removed = if !learned {
            [[0.0; 2]; GAUGES]
        } else if self.near {
            let trust = ((share - DOUBTFUL) / (COMMON - DOUBTFUL)).clamp(0.0, 1.0);
            [common.map(|z| trust * z); GAUGES]
        } else {
            self.phasors
        };
    }

    /// Amplitude in ADC steps of what may be hum or texture and is not told apart yet; 0 from 0.5 s
    /// after the start on.
    pub fn pickup_lsb(&self) -> f32 {
        self.pickup_lsb
    }

    /// Power of each gauge's own hum in ADC steps², beyond what is common to the `usable` ones; 0 as
    /// long as it may be texture.
    pub fn own_powers(&self, usable: u8) -> [f32; GAUGES] {
        if self.near || self.samples < SURE_SAMPLES {
            return [0.0; GAUGES];
        }
        let (common, _) = self.common(usable);
        let count = usable.count_ones() as f32;
        core::array::from_fn(|gauge| {
            let [re, im] = self.phasors[gauge];
            let [re, im] = [re - common[0], im - common[1]];
            // A gauge's distance from a mean that it is part of is short by its own share.
            let part = if usable >> gauge & 1 == 1 && count > 1.0 {
                count / (count - 1.0)
            } else {
                1.0
            };
            0.5 * part * part * (re * re + im * im)
        })
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
