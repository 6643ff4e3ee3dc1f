//! Mains hum, taken out of the gauges.
//!
//! Each gauge's component at the mains' frequency is followed slowly (a notch some 1 Hz wide). A texture
//! may be at that frequency too, v/λ = 50 Hz. So as long as that may be, only what all gauges have in
//! common is taken for hum and out: hum enters the amplifiers alike, while a texture meets the gauges
//! with a different phase each. What a gauge holds of its own is forgotten each time a texture has been at
//! the mains' frequency or has passed it.

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
/// Estimates in a row without a texture that is known to be at the mains' frequency, before a gauge may
/// be blamed for its own hum: three time constants.
const SURE_ESTIMATES: u16 =
    (3 * FOLLOWED_SAMPLES as u32 * ESTIMATE_RATE_HZ / SAMPLE_RATE_HZ) as u16;
/// Share of the gauges' power at the mains' frequency that is common to them, from which on it is taken
/// for hum, and up to which for texture. Five gauges of random phases have 0.2.
const COMMON: f32 = 0.6;
/// Hum that does no harm, relative to the texture's amplitude.
const HARMLESS: f32 = 0.1;
/// Distance from the mains' frequency from which on a texture is elsewhere, in Hz.
const ELSEWHERE_HZ: f32 = 10.0;
/// Gauges that must speak before anything can be common to them.
const LEAST_WITNESSES: u32 = 3;
/// See [`COMMON`].
const DOUBTFUL: f32 = 0.4;
/// Power at the mains' frequency relative to the median of three gauges or more, from which on it is hum of
/// the gauge's own whatever the texture does: that would be in all of them.
const OUTSTANDING: f32 = 16.0;
/// How near v/λ may come to the mains' frequency, in Hz, before a texture may be taken for hum.
const NEAR_HZ: f32 = 4.0;

/// What all gauges have in common at the mains' frequency, before it is known whether that is hum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pickup {
    /// Amplitude in ADC steps.
    lsb: f32,
    /// Time that it has been heard for, in s.
    heard_s: f32,
}

impl Pickup {
    /// Whether it may be hum that a texture of `amplitude_lsb`, in ADC steps, at `frequency_hz` is not
    /// to be told from. A mean over a time T holds up to 1/(π |f − 50 Hz| T) of a texture that is
    /// elsewhere; one that seems to be at the mains' frequency may be the hum itself.
    pub fn hides(&self, amplitude_lsb: f32, frequency_hz: f32) -> bool {
        let away_hz = (frequency_hz - MAINS_HZ as f32).abs();
        let held = if away_hz > ELSEWHERE_HZ {
            1.0 / (core::f32::consts::PI * away_hz * self.heard_s)
        } else {
            0.0
        };
        self.lsb > (HARMLESS + held) * amplitude_lsb
    }
}

/// What is known of the hum so far.
#[derive(Clone, Debug)]
pub struct Hum {
    /// Each gauge's complex amplitude at the mains' frequency.
    phasors: [[f32; 2]; GAUGES],
    before: [[f32; GAUGES]; HALF],
    samples: u32,
    near: bool,
    /// How far the texture was from the mains' frequency last, in Hz; 0 if it was not known.
    off_hz: f32,
    /// Estimates since it was known to be near.
    clean: u16,
    /// It was, and the phasors hold it.
    tainted: bool,
    pickup: Pickup,
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
            off_hz: 0.0,
            clean: 0,
            tainted: false,
            pickup: Pickup::default(),
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
        let off_hz = texture_hz.map_or(0.0, |hz| hz - MAINS_HZ as f32);
        // A stroke may pass the mains' frequency between two estimates.
        let passed = off_hz * self.off_hz < 0.0;
        self.off_hz = off_hz;
        self.near = off_hz.abs() < NEAR_HZ || passed;
        let known_near = self.near && texture_hz.is_some();
        let (common, share) = self.common(usable);
        let trust = ((share - DOUBTFUL) / (COMMON - DOUBTFUL)).clamp(0.0, 1.0);
        let common_hum = [common.map(|z| trust * z); GAUGES];
        if known_near {
            self.clean = 0;
            self.tainted = true;
        } else {
            if self.tainted && !self.near {
                // What the gauges hold of their own is the texture's.
                self.phasors = common_hum;
                self.tainted = false;
            }
            self.clean = self.clean.saturating_add(1);
        }
        let learned = self.samples >= LEARNED_SAMPLES;
        let early = self.samples < FORGOTTEN_SAMPLES && share >= DOUBTFUL;
        self.pickup = Pickup {
            lsb: if early {
                libm::sqrtf(common[0] * common[0] + common[1] * common[1])
            } else {
                0.0
            },
            heard_s: self.samples.min(FORGOTTEN_SAMPLES) as f32 / SAMPLE_RATE_HZ as f32,
        };
        self.removed = if !learned {
            [[0.0; 2]; GAUGES]
        } else if self.near {
            common_hum
        } else {
            self.phasors
        };
    }

    /// What may be hum or texture and is not told apart yet; nothing from 0.5 s after the start on.
    pub fn pickup(&self) -> Pickup {
        self.pickup
    }

    /// Power of each gauge's own hum in ADC steps², beyond what is common to the `usable` ones; 0 as
    /// long as it may be texture.
    pub fn own_powers(&self, usable: u8) -> [f32; GAUGES] {
        if self.samples < LEARNED_SAMPLES {
            return [0.0; GAUGES];
        }
        if self.near || self.clean < SURE_ESTIMATES {
            return self.outstanding(usable);
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

    /// Power of those gauges that have far more of it than the `usable` ones.
    fn outstanding(&self, usable: u8) -> [f32; GAUGES] {
        let powers = self.phasors.map(|z| 0.5 * (z[0] * z[0] + z[1] * z[1]));
        let mut sorted = [0.0; GAUGES];
        let mut count = 0;
        for (gauge, power) in powers.iter().enumerate() {
            if usable >> gauge & 1 == 1 {
                sorted[count] = *power;
                count += 1;
            }
        }
        if count < 3 {
            return [0.0; GAUGES];
        }
        let sorted = &mut sorted[..count];
        sorted.sort_unstable_by(f32::total_cmp);
        let most = OUTSTANDING * sorted[count / 2];
        powers.map(|power| if power > most { power } else { 0.0 })
    }

    /// The usable gauges' mean phasor, and the share of their power in it; 0 if they are too few to tell.
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
        let tell = power > 0.0 && usable.count_ones() >= LEAST_WITNESSES;
        (mean, if tell { common / power } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: u8 = 0b11111;
    const TAU: f64 = 2.0 * core::f64::consts::PI;
    const AMPLITUDE: f64 = 500.0;

    /// What is left after `ms` of signals of gauge and s, with what is taken out renewed as on the board;
    /// each gauge's largest amount over the last cycle of the mains, in ADC steps.
    fn left(
        hum: &mut Hum,
        ms: u32,
        texture_hz: Option<f32>,
        mut signal: impl FnMut(usize, f64) -> f64,
    ) -> [f64; GAUGES] {
        let mut left = [0.0_f64; GAUGES];
        for n in 0..ms {
            let t_s = f64::from(n) * 1e-3;
            let mut gauges = core::array::from_fn(|gauge| signal(gauge, t_s) as f32);
            hum.remove(&mut gauges);
            if n % 10 == 9 {
                hum.renew(ALL, texture_hz);
            }
            if n + CYCLE as u32 >= ms {
                for (left, x) in left.iter_mut().zip(gauges) {
                    *left = left.max(f64::from(x.abs()));
                }
            }
        }
        left
    }

    /// The mains at a phase.
    fn mains(t_s: f64, phase: f64) -> f64 {
        AMPLITUDE * libm::cos(TAU * 50.0 * t_s + phase)
    }

    /// What a phasor's own ripple at 100 Hz leaves of hum: 1/300 beside 2 sin(π 100/1 000), and a little
    /// for the cosine's table and the mean that it began with, e^(−700/300) of 1/300 / sin(18°).
    fn ripple() -> f64 {
        let follow = f64::from(1.0 / FOLLOWED_SAMPLES);
        let sin = libm::sin(TAU * 50.0 / 1_000.0);
        AMPLITUDE * (follow / (2.0 * sin) + 0.1 * follow / sin + 2e-4)
    }

    #[test]
    fn common_hum_of_any_phase_is_gone_within_a_second() {
        for step in 0..16 {
            let phase = TAU * f64::from(step) / 16.0;
            let left = left(&mut Hum::default(), 1_000, None, |_, t_s| mains(t_s, phase));
            for left in left {
                assert!(left <= ripple(), "{left} at {phase}");
            }
        }
    }

    #[test]
    fn mains_a_twentieth_of_a_hertz_off_leave_a_tenth() {
        // A first-order follower of time constant τ lags behind by Δω τ = 2π · 0.05 · 0.3 = 0.094 rad.
        let lag = TAU * 0.05 * f64::from(FOLLOWED_SAMPLES) / 1e3;
        for off_hz in [-0.05, 0.05] {
            let left = left(&mut Hum::default(), 4_000, None, |_, t_s| {
                mains(t_s, TAU * off_hz * t_s)
            });
            for left in left {
                assert!(left <= lag * AMPLITUDE + ripple(), "{left}");
                assert!(left >= 0.8 * lag * AMPLITUDE, "{left}");
            }
        }
    }

    #[test]
    fn an_offset_and_what_is_at_twice_the_mains_pass_unchanged() {
        let mut hum = Hum::default();
        let mut gauges_before = [0.0; GAUGES];
        for n in 0..2_000 {
            let twice = [0.0, 3.0, -2.0, -3.0, 2.0, 0.0, 3.0, -2.0, -3.0, 2.0][n % 10];
            let gauges: [f32; GAUGES] =
                core::array::from_fn(|gauge| 700.0 * gauge as f32 - 1_500.0 + twice);
            let mut out = gauges;
            hum.remove(&mut out);
            hum.renew(ALL, if n % 3 == 0 { None } else { Some(20.0) });
            // Exactly: the difference over half a cycle is 0.
            assert_eq!(out, gauges);
            gauges_before = out;
        }
        assert!(gauges_before[4] > 1_000.0);
    }

    #[test]
    fn a_texture_at_the_mains_frequency_that_meets_the_gauges_in_turn_is_left_alone() {
        // Evenly spread phases have no mean; a share of 0.3 is below what is doubtful.
        for phases in [[0.0, 1.3, 2.5, 3.8, 5.0], [0.0, 3.54, -0.7, 4.24, -0.3]] {
            let mut hum = Hum::default();
            for n in 0..3_000 {
                let t_s = f64::from(n) * 1e-3;
                let gauges: [f32; GAUGES] =
                    core::array::from_fn(|gauge| mains(t_s, phases[gauge]) as f32);
                let mut out = gauges;
                hum.remove(&mut out);
                assert_eq!(out, gauges, "at {n} ms");
                if n % 10 == 9 {
                    hum.renew(ALL, Some(50.0));
                }
            }
            assert!(hum.common(ALL).1 < DOUBTFUL);
        }
    }

    #[test]
    fn one_gauges_own_hum_is_removed_and_named_once_the_texture_is_known_to_be_elsewhere() {
        let own = |gauge: usize, t_s: f64| if gauge == 3 { mains(t_s, 1.0) } else { 0.0 };
        let mut hum = Hum::default();
        // Alone, its share of what is common is a fifth.
        let left_near = left(&mut hum, 1_000, None, own);
        assert!(
            (left_near[3] - AMPLITUDE).abs() < 0.06 * AMPLITUDE,
            "{left_near:?}"
        );
        // No texture is in one gauge alone.
        let powers = hum.own_powers(ALL).map(f64::from);
        let want = AMPLITUDE * AMPLITUDE / 2.0;
        assert!((powers[3] / want - 1.0).abs() < 0.1, "{powers:?}");
        assert_eq!([powers[0], powers[1], powers[2], powers[4]], [0.0; 4]);
        let left_far = left(&mut hum, 100, Some(30.0), own);
        for left in left_far {
            assert!(left <= ripple(), "{left_far:?}");
        }
        let powers = hum.own_powers(ALL).map(f64::from);
        assert!((powers[3] / want - 1.0).abs() < 0.03, "{powers:?}");
        for gauge in [0, 1, 2, 4] {
            // Their distance from a mean to which the fifth contributes: (¼ A)² / 2.
            assert!(powers[gauge] <= 1.05 * want / 16.0, "{powers:?}");
        }
        // Left out, it does not stand against the others.
        let powers = hum.own_powers(0b10111);
        assert!(powers[0] < 1.0 && powers[3] > 1e5, "{powers:?}");
    }

    #[test]
    fn what_is_common_stands_in_the_way_until_it_is_learned() {
        let mut hum = Hum::default();
        for n in 0..1_000_u32 {
            let mut gauges = [mains(f64::from(n) * 1e-3, 0.3) as f32; GAUGES];
            hum.remove(&mut gauges);
            if n % 10 == 9 {
                hum.renew(ALL, None);
                let pickup = f64::from(hum.pickup().lsb);
                if n + 1 >= FORGOTTEN_SAMPLES {
                    assert_eq!(pickup, 0.0);
                } else if n >= 50 {
                    // A plain mean over n samples, with up to 1 / sin(18°) of them over: 3.24.
                    let bound = AMPLITUDE * 3.3 / f64::from((n - HALF as u32).min(300));
                    assert!((pickup - AMPLITUDE).abs() <= bound, "{pickup} at {n}");
                }
            }
        }
        // Phases of their own are no pickup.
        let mut hum = Hum::default();
        for n in 0..300 {
            let t_s = f64::from(n) * 1e-3;
            let mut gauges = core::array::from_fn(|gauge| mains(t_s, 1.2566 * gauge as f64) as f32);
            hum.remove(&mut gauges);
            hum.renew(ALL, None);
            assert!(n < 60 || hum.pickup().lsb == 0.0, "{n}");
        }
    }

    #[test]
    fn the_count_of_samples_wraps_at_the_same_phase() {
        let mut hum = Hum::default();
        left(&mut hum, 1_000, None, |_, t_s| mains(t_s, 0.3));
        // 1 000 is a multiple of 20, and so is this.
        hum.samples = WRAP_SAMPLES / 20 * 20 - 100;
        let left = left(&mut hum, 120 + 20, None, |_, t_s| mains(t_s, 0.3));
        assert!(hum.samples < WRAP_SAMPLES - 100_000);
        for left in left {
            assert!(left <= ripple(), "{left}");
        }
    }
}
