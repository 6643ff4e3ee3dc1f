//! Gauges that are broken, for good or for a while.

use protocol::GAUGES;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::CODES_PER_UNIT;
use crate::scene::Kinematic;

/// A saturated gauge's amplifier has this gain too much: the ADC clips at ± 1.65 / (20 · 0.3), about a
/// quarter of the signal's amplitude.
pub const SATURATED_GAIN: f64 = 20.0;
/// The code at which a stuck gauge stands, about 2.3 V: a guess.
pub const STUCK_CODE: u16 = 2_900;
/// RMS of a noisy gauge's own noise, white up to half the scan rate, relative to the fundamental's
/// amplitude at unit gain.
pub const BROKEN_NOISE: f64 = 3.0;
/// Amplitude of a humming gauge's own 50 Hz, relative to the fundamental's at unit gain.
pub const BROKEN_HUM: f64 = 2.0;

/// What is wrong with which gauge, and when.
#[derive(Clone, Debug)]
pub(super) struct GaugeFault {
    from_s: f64,
    until_s: f64,
    ailments: [GaugeFaultKind; GAUGES],
    noise: Xoshiro256PlusPlus,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum GaugeFaultKind {
    None,
    Dead,
    Saturated,
    Stuck,
    Noisy,
    Humming,
}

impl GaugeFault {
    /// The troubles of a scene; `noise` is drawn from for the noisy gauges only.
    pub fn new(kinematic: &Kinematic, noise: Xoshiro256PlusPlus) -> Self {
        Self {
            from_s: kinematic.trouble_from_s,
            until_s: kinematic
                .trouble_for_s
                .map_or(f64::INFINITY, |for_s| kinematic.trouble_from_s + for_s),
            ailments: std::array::from_fn(|gauge| {
                let lists = [
                    (&kinematic.dead, GaugeFaultKind::Dead),
                    (&kinematic.saturated, GaugeFaultKind::Saturated),
                    (&kinematic.stuck, GaugeFaultKind::Stuck),
                    (&kinematic.noisy, GaugeFaultKind::Noisy),
                    (&kinematic.humming, GaugeFaultKind::Humming),
                ];
                lists
                    .into_iter()
                    .find(|(list, _)| list[gauge])
                    .map_or(GaugeFaultKind::None, |(_, ailment)| ailment)
            }),
            noise,
        }
    }

    /// Whether it is there at `t_s`.
    #[inline]
    pub fn is_on(&self, t_s: f64) -> bool {
        (self.from_s..self.until_s).contains(&t_s)
    }

    /// The gain of a gauge's amplifier while the trouble is on, relative to a sound one's.
    pub fn gain(&self, gauge: usize) -> f64 {
        match self.ailments[gauge] {
            GaugeFaultKind::Dead => 0.0,
            GaugeFaultKind::Saturated => SATURATED_GAIN,
            _ => 1.0,
        }
    }

    /// What becomes of a gauge's level, in codes, while the trouble is on. `hum` is the mains' phase as
    /// a sine of amplitude 1.
    #[inline]
    pub fn level(&mut self, gauge: usize, level: f32, hum: impl Fn() -> f64) -> f32 {
        match self.ailments[gauge] {
            GaugeFaultKind::None | GaugeFaultKind::Dead | GaugeFaultKind::Saturated => level,
            GaugeFaultKind::Stuck => f32::from(STUCK_CODE),
            GaugeFaultKind::Noisy => {
                let sample: f32 = StandardNormal.sample(&mut self.noise);
                level + sample * (BROKEN_NOISE * CODES_PER_UNIT) as f32
            }
            GaugeFaultKind::Humming => level + (BROKEN_HUM * CODES_PER_UNIT * hum()) as f32,
        }
    }
}
