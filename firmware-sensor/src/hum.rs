//! Mains hum, taken out of the gauges.
//!
//! Both of the world's frequencies, 50 and 60 Hz, are followed up to 0.5 Hz off nominal (see
//! [`follower`]); the louder of them is the mains' (both at once do not occur: then the other is left in).
//! A texture may be at that frequency too, v/λ = 50 Hz, and is not to be taken for hum. They are told apart
//! by these, in this order:
//!
//! 1. While the arm rests nothing else than hum is there. Its amplitude in each gauge is known after 0.2 s,
//!    and while the arm moves no more than that is taken out: nothing, if there was nothing. From then on
//!    only its phase, its frequency and its scale are followed, as the gauges say together: the more slowly,
//!    the nearer v/λ̂ or a harmonic of it is.
//! 2. Where there has been no rest: what has been at the frequency, steadily, from the start on for 0.3 s
//!    and in the same phase in all gauges, is hum. A texture meets gauges that lie apart in different
//!    phases, and leaves the frequency as the speed changes.
//! 3. Hum that comes in while the arm moves is taken out from the next rest on, or once it has stayed in all
//!    gauges for 0.6 s through changes of speed by a fifth. At constant speed it stays in.
//!
//! What cannot be told: a texture that is at the mains' frequency from the very start on, at constant speed,
//! under gauges that all lie at one place or a multiple of λ apart. It is taken out for hum, until the
//! speed changes.

use protocol::GAUGES;

use crate::float::larger;
use crate::travel::MIN_SPEED_MM_S;
use crate::{ESTIMATE_RATE_HZ, SAMPLE_RATE_HZ};
use common::{Amplitudes, power};
use follower::{DIFFERENCE_SAMPLES, Follower, MAINS, Moment, RESTED_ESTIMATES};
use own::SteadyPowers;

mod common;
mod follower;
mod own;
mod steady;

/// Hum that does no harm, relative to the texture's amplitude.
const HARMLESS: f32 = 0.1;
/// Distance from the mains' frequency from which on a texture is elsewhere, in Hz.
const ELSEWHERE_HZ: f32 = 10.0;

/// What all gauges have in common at the mains' frequency, before it is known whether that is hum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pickup {
    /// Amplitude in ADC steps.
    lsb: f32,
    /// The mains' frequency in Hz.
    mains_hz: f32,
    /// Time that it has been heard for, in s.
    heard_s: f32,
}

impl Pickup {
    /// Whether it may be hum that a texture of `amplitude_lsb`, in ADC steps, at `frequency_hz` is not
    /// to be told from. A mean over a time T holds up to 1/(π Δf T) of a texture that is Δf
    /// elsewhere; one that seems to be at the mains' frequency may be the hum itself.
    pub fn hides(&self, amplitude_lsb: f32, frequency_hz: f32) -> bool {
        let away_hz = (frequency_hz - self.mains_hz).abs();
        let held = if away_hz > ELSEWHERE_HZ {
            1.0 / (core::f32::consts::PI * away_hz * larger(self.heard_s, f32::MIN_POSITIVE))
        } else {
            0.0
        };
        self.lsb > (HARMLESS + held) * amplitude_lsb
    }
}

/// What is known of the hum so far.
#[derive(Clone, Debug)]
pub struct Hum {
    followers: [Follower; 2],
    /// The follower that hears more.
    louder: usize,
    before: [[f32; GAUGES]; DIFFERENCE_SAMPLES],
    /// Where the oldest of these is.
    oldest: usize,
    /// There are as many as a difference needs.
    filled: bool,
    /// Since the last estimate.
    samples: u16,
    /// Estimates that the arm has rested for.
    resting: u16,
    pickup: Pickup,
    /// Whose hum is taken out, and what of each gauge: renewed with every estimate.
    removed: Option<(usize, Amplitudes)>,
    /// Power of each gauge's own hum, in ADC steps².
    own: [f32; GAUGES],
    own_steady: SteadyPowers,
}

impl Default for Hum {
    fn default() -> Self {
        Self {
            followers: [Follower::new(&MAINS[0]), Follower::new(&MAINS[1])],
            louder: 0,
            before: [[0.0; GAUGES]; DIFFERENCE_SAMPLES],
            oldest: 0,
            filled: false,
            samples: 0,
            resting: 0,
            pickup: Pickup::default(),
            removed: None,
            own: [0.0; GAUGES],
            own_steady: SteadyPowers::default(),
        }
    }
}

impl Hum {
    /// Takes hum out of a sample of the gauges, in place.
    pub fn remove(&mut self, gauges: &mut [f32; GAUGES]) {
        let before = &mut self.before[self.oldest];
        // Before there are differences there is nothing to follow.
        let differences = if self.filled {
            self.samples = self.samples.saturating_add(1);
            core::array::from_fn(|gauge| gauges[gauge] - before[gauge])
        } else {
            [0.0; GAUGES]
        };
        *before = *gauges;
        self.oldest += 1;
        if self.oldest == DIFFERENCE_SAMPLES {
            self.oldest = 0;
            self.filled = true;
        }
        let carriers = [
            self.followers[0].push(&differences),
            self.followers[1].push(&differences),
        ];
        if let Some((which, removed)) = &self.removed {
            let [cos, sin] = carriers[*which];
            for (x, z) in gauges.iter_mut().zip(removed) {
                *x -= z[0] * cos - z[1] * sin;
            }
        }
    }

    /// Renews what is taken out, once an estimate: `usable` are the gauges that what is common is taken
    /// from, `speed_mm_s` the arm's speed, `texture_hz` the texture's frequency v/λ̂, if λ̂ can be relied
    /// on.
    pub fn renew(&mut self, usable: u8, speed_mm_s: f32, texture_hz: Option<f32>) {
        self.resting = if speed_mm_s < MIN_SPEED_MM_S {
            self.resting.saturating_add(1)
        } else {
            0
        };
        let moment = Moment {
            usable,
            resting: self.resting,
            speed_mm_s,
            texture_hz,
        };
        let samples = core::mem::take(&mut self.samples);
        for (number, follower) in self.followers.iter_mut().enumerate() {
            follower.learn(samples, &moment, number == self.louder);
        }
        let [low, high] = [0, 1].map(|number| power(self.followers[number].found(), usable));
        self.louder = usize::from(high > low);
        let [low, high] = [0, 1].map(|number| self.followers[number].hum());
        self.removed = match (low, high) {
            (low, Some(high)) if self.louder == 1 || low.is_none() => Some((1, high)),
            (low, _) => low.map(|low| (0, low)),
        };

        let follower = &self.followers[self.louder];
        let (lsb, heard_s) = follower.undecided(usable);
        self.pickup = Pickup {
            lsb,
            mains_hz: follower.frequency_hz(),
            heard_s,
        };

        let rests = self.resting >= RESTED_ESTIMATES;
        let [low, high] = [0, 1].map(|number| self.followers[number].own_powers(usable, rests));
        let own = core::array::from_fn(|gauge| larger(low[gauge], high[gauge]));
        self.own = if rests {
            own
        } else {
            self.own_steady.update(own)
        };
    }

    /// What may be hum or texture and is not told apart yet; nothing from 0.2 s of rest on, or, if there
    /// is none, from 0.15 s after what is steady has been decided on.
    pub fn pickup(&self) -> Pickup {
        self.pickup
    }

    /// Power of each gauge's own hum in ADC steps², beyond what the usable ones have in common; 0 as
    /// long as it may be texture, or a blow.
    pub fn own_powers(&self) -> [f32; GAUGES] {
        self.own
    }
}

const _: () = assert!(SAMPLE_RATE_HZ == DIFFERENCE_SAMPLES as u32 * ESTIMATE_RATE_HZ);

#[cfg(test)]
mod tests;
