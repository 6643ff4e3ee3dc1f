//! Mains hum, taken out of the gauges.
//!
//! Each gauge's component at the mains' frequency is followed slowly (a notch some 1 Hz wide). A texture
//! may be at that frequency too, v/λ = 50 Hz. So as long as that may be, only what all gauges have in
//! common is taken for hum and out: hum enters the amplifiers alike, while a texture meets the gauges
//! with a different phase each.

use protocol::GAUGES;

use crate::phasor::phasor;
use crate::{ESTIMATE_RATE_HZ, SAMPLE_RATE_HZ};

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
/// Part of a gauge's component at the mains' frequency that may be of a texture which was near it, up to
/// which the component is the gauge's own: e^(−2.3), after 0.7 s for one that stayed there long.
const REMEMBERED: f32 = 0.1;
/// How much of what is remembered of the texture is followed with every estimate.
const FOLLOWED_PER_ESTIMATE: f32 = (SAMPLE_RATE_HZ / ESTIMATE_RATE_HZ) as f32 / FOLLOWED_SAMPLES;

/// What is known of the hum so far.
#[derive(Clone, Debug)]
pub struct Hum {
    /// Each gauge's complex amplitude at the mains' frequency.
    phasors: [[f32; 2]; GAUGES],
    before: [[f32; GAUGES]; HALF],
    samples: u32,
    /// Share of what is followed in which a texture was near the mains' frequency, or may have been.
    remembered: f32,
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
            remembered: 1.0,
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
        let near = texture_hz.is_none_or(|hz| (hz - MAINS_HZ as f32).abs() < NEAR_HZ);
        self.remembered += FOLLOWED_PER_ESTIMATE * (f32::from(u8::from(near)) - self.remembered);
        let (common, share) = self.common(usable);
        let learned = self.samples >= LEARNED_SAMPLES;
        self.pickup_lsb = if self.samples < FORGOTTEN_SAMPLES && share >= DOUBTFUL {
            libm::sqrtf(common[0] * common[0] + common[1] * common[1])
        } else {
            0.0
        };
        self.removed = if !learned {
            [[0.0; 2]; GAUGES]
        } else if self.may_be_texture() {
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
        if self.may_be_texture() || self.samples < SURE_SAMPLES {
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

    /// Whether what is at the mains' frequency may be of a texture, the present one or one before it.
    fn may_be_texture(&self) -> bool {
        self.remembered > REMEMBERED
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

#[cfg(test)]
mod tests {
    use super::*;

    const AMPLITUDE: f32 = 400.0;
    const ALL: u8 = 0b1_1111;
    const SAMPLES_PER_ESTIMATE: u32 = SAMPLE_RATE_HZ / ESTIMATE_RATE_HZ;

    /// Feeds `samples` in which gauge g has `amplitudes[g]` at the mains' frequency, with a phase of g
    /// radians, and looks at the hum after each estimate.
    fn feed(
        hum: &mut Hum,
        samples: u32,
        amplitudes: [f32; GAUGES],
        texture_hz: f32,
        mut look: impl FnMut(&Hum),
    ) {
        for sample in 1..=samples {
            let cycles = f64::from(hum.samples % CYCLE as u32) / CYCLE as f64;
            let mut gauges = core::array::from_fn(|gauge| {
                let phase = core::f64::consts::TAU * cycles + gauge as f64;
                amplitudes[gauge] * libm::cos(phase) as f32
            });
            hum.remove(&mut gauges);
            if sample.is_multiple_of(SAMPLES_PER_ESTIMATE) {
                hum.renew(ALL, Some(texture_hz));
                look(hum);
            }
        }
    }

    #[test]
    fn a_texture_that_leaves_the_mains_frequency_is_not_taken_for_hum_of_the_gauges() {
        let mut hum = Hum::default();
        let none = |hum: &Hum| assert_eq!(hum.own_powers(ALL), [0.0; GAUGES]);
        feed(&mut hum, 2_000, [AMPLITUDE; GAUGES], 50.0, none);
        // 1 mm at 50 mm/s goes over into 4 mm. It is remembered in steps of an estimate, which go a
        // little faster than what is followed goes in steps of a sample.
        let left = 1.1 * REMEMBERED * AMPLITUDE;
        // Off from a mean of up to as much, which lacks its own fifth.
        let own = 2.0 * left * 5.0 / 4.0;
        let most = 0.5 * own * own;
        feed(&mut hum, 2_000, [0.0; GAUGES], 12.5, |hum| {
            let powers = hum.own_powers(ALL);
            assert!(powers.iter().all(|&power| power <= most), "{powers:?}");
            let removed = hum.removed.map(|z| libm::hypotf(z[0], z[1]));
            assert!(removed.iter().all(|&z| z <= left), "{removed:?}");
        });
    }

    #[test]
    fn a_gauges_own_hum_is_known_for_what_it_is_once_no_texture_can_be_it() {
        let mut hum = Hum::default();
        let one = [0.0, AMPLITUDE, 0.0, 0.0, 0.0];
        feed(&mut hum, SURE_SAMPLES, one, 12.5, |_| {});
        let powers = hum.own_powers(ALL);
        // A mean over at least three cycles of the mains is within some percent of a steady amplitude.
        assert!(powers[1] > 0.8 * 0.5 * AMPLITUDE * AMPLITUDE, "{powers:?}");
        for gauge in [0, 2, 3, 4] {
            // Of the mean, a fifth of one gauge's, each is as far as that; taken for four fifths of it.
            assert!(powers[gauge] < 0.1 * powers[1], "{powers:?}");
        }
    }
}
