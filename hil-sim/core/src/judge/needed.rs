//! Which rendering a surface needs: the lowest from which no higher one differs by what a fingertip can tell.
//!
//! What each rendering would play is taken as lines of power over frequency, the fundamental's being ½: the partials and
//! bands that the sensor told of last, at the hand's mean speed, from 2 to 200 Hz. Two renderings differ if their power
//! differs by the limen of amplitude, or the mean frequency of their power by that of frequency. By the smallest limens
//! that are found there, so that a doubt asks for more: 2.2 dB, and a Weber fraction of 0.18.

use protocol::texture::{LOWEST_BAND_PER_MM, UNITY};
use protocol::{Message, Role, Texture};
use serde::Serialize;
use strum::{IntoStaticStr, VariantArray};

use crate::judge::MOTION_MM_S;
use crate::run::decoder::TimedMessage;
use crate::run::recording::TickRecord;

/// The smallest limen of a vibration's amplitude on the fingertip, in dB.
pub const LIMEN_DB: f64 = 2.2;
/// The smallest Weber fraction of its frequency.
pub const WEBER: f64 = 0.18;
/// What is felt as vibration, in Hz.
const FELT_HZ: std::ops::RangeInclusive<f64> = 2.0..=200.0;

/// How much of the surface there is to be played.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, IntoStaticStr, VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Rendering {
    /// The fundamental alone.
    Fundamental,
    /// With its partials.
    Shape,
    /// With what does not repeat.
    Texture,
}

impl Rendering {
    /// As scenes and the JSON have it.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Listens to the sensor and watches the hand.
#[derive(Clone, Debug, Default)]
pub struct Judge {
    wavelength_mm: Option<f64>,
    texture: Option<Texture>,
    /// The hand at the last tick, in ns and mm.
    hand: Option<(u64, f64)>,
    moving_s: f64,
    travel_mm: f64,
}

impl Judge {
    /// What a board said.
    pub fn said(&mut self, role: Role, said: &TimedMessage) {
        match &said.message {
            Message::Estimate(estimate) if role == Role::Sensor && estimate.valid => {
                self.wavelength_mm = estimate.wavelength_mm.map(f64::from);
            }
            Message::Texture(texture) if role == Role::Sensor && texture.valid => {
                self.texture = Some(*texture);
            }
            _ => {}
        }
    }

    /// A tick of the display's.
    pub fn tick(&mut self, tick: &TickRecord) {
        let Some((at_ns, position_mm)) = self.hand.replace((tick.at_ns, tick.position_mm)) else {
            return;
        };
        let passed_s = (tick.at_ns - at_ns) as f64 * 1e-9;
        let travel_mm = (tick.position_mm - position_mm).abs();
        if travel_mm > MOTION_MM_S * passed_s {
            self.moving_s += passed_s;
            self.travel_mm += travel_mm;
        }
    }

    /// The rendering that the surface needs; none if the sensor told of no texture, or the hand did not move.
    pub fn finish(&self) -> Option<Rendering> {
        let speed_mm_s = self.travel_mm / self.moving_s;
        let (texture, wavelength_mm) = (self.texture?, self.wavelength_mm?);
        speed_mm_s
            .is_finite()
            .then(|| needed(&texture, wavelength_mm, speed_mm_s))
    }
}

/// The rendering that a surface needs under a hand of this speed.
fn needed(texture: &Texture, wavelength_mm: f64, speed_mm_s: f64) -> Rendering {
    let played = |rendering| played(texture, wavelength_mm, speed_mm_s, rendering);
    let differ = |one: (f64, f64), other: (f64, f64)| {
        let db = 10.0 * (other.0 / one.0).log10();
        db.abs() >= LIMEN_DB || (other.1 / one.1 - 1.0).abs() >= WEBER
    };
    let is_enough = |rendering: &&Rendering| {
        let mut more = Rendering::VARIANTS.iter().filter(|more| more > rendering);
        !more.any(|&more| differ(played(**rendering), played(more)))
    };
    let enough = Rendering::VARIANTS.iter().find(is_enough);
    enough.copied().unwrap_or(Rendering::Texture)
}

/// Power and mean frequency in Hz of what a rendering plays.
fn played(
    texture: &Texture,
    wavelength_mm: f64,
    speed_mm_s: f64,
    rendering: Rendering,
) -> (f64, f64) {
    let in_units = |told: u16| f64::from(told) / f64::from(UNITY);
    let fundamental_hz = speed_mm_s / wavelength_mm;
    let mut lines = vec![(0.5, fundamental_hz)];
    if rendering >= Rendering::Shape {
        let partials = (2..).zip(&texture.partials);
        lines.extend(partials.map(|(n, partial)| {
            (
                0.5 * in_units(partial.ratio).powi(2),
                f64::from(n) * fundamental_hz,
            )
        }));
    }
    if rendering == Rendering::Texture {
        let bands = (0..).zip(texture.bands);
        lines.extend(bands.map(|(band, level)| {
            // The middle of an octave.
            let per_mm = f64::from(LOWEST_BAND_PER_MM) * 2_f64.powf(f64::from(band) + 0.5);
            (in_units(level).powi(2), per_mm * speed_mm_s)
        }));
    }
    let (power, moment) = lines
        .iter()
        // The fundamental is what the others are compared with, wherever it is.
        .enumerate()
        .filter(|(at, (_, hz))| *at == 0 || FELT_HZ.contains(hz))
        .fold((0.0, 0.0), |(power, moment), (_, (of_line, hz))| {
            (power + of_line, moment + of_line * hz)
        });
    (power, moment / power)
}

#[cfg(test)]
mod tests {
    use protocol::Partial;

    use super::*;

    fn texture(ratios: [u16; 2], bands: [u16; 4]) -> Texture {
        Texture {
            valid: true,
            partials: ratios.map(|ratio| Partial { ratio, phase: 0 }),
            bands,
            ..Texture::default()
        }
    }

    #[test]
    fn the_lowest_from_which_none_higher_is_felt_as_other_is_needed() {
        for (ratios, bands, expected) in [
            ([0, 0], [0; 4], Rendering::Fundamental),
            // 1 % of the power at twice the frequency.
            ([100, 0], [0; 4], Rendering::Fundamental),
            ([700, 300], [0; 4], Rendering::Shape),
            ([700, 300], [0, 20, 20, 20], Rendering::Shape),
            ([0, 0], [0, 0, 300, 500], Rendering::Texture),
            ([700, 300], [0, 0, 300, 800], Rendering::Texture),
        ] {
            let told = texture(ratios, bands);
            assert_eq!(needed(&told, 2.0, 50.0), expected, "{ratios:?} {bands:?}");
        }
    }

    #[test]
    fn the_limens_are_where_they_are_said_to_be() {
        // The power of a partial of the share x of the fundamental's at twice its frequency: (1 + 2x)/(1 + x) is the
        // mean frequency's rise. 0.18 is at x = 0.22.
        for (ratio, expected) in [(460, Rendering::Fundamental), (480, Rendering::Shape)] {
            assert_eq!(needed(&texture([ratio, 0], [0; 4]), 2.0, 50.0), expected);
        }
    }

    #[test]
    fn what_is_too_fast_to_be_felt_is_not_needed() {
        let told = texture([0, 900], [0; 4]);
        assert_eq!(needed(&told, 1.0, 60.0), Rendering::Shape);
        assert_eq!(needed(&told, 1.0, 80.0), Rendering::Fundamental);
    }

    #[test]
    fn without_a_texture_or_a_movement_nothing_is_said() {
        let mut judge = Judge::default();
        assert_eq!(judge.finish(), None);
        judge.wavelength_mm = Some(2.0);
        judge.texture = Some(texture([700, 300], [0; 4]));
        assert_eq!(judge.finish(), None);
        for (at_ns, position_mm) in [(0, 0.0), (500_000, 0.025)] {
            judge.tick(&TickRecord {
                at_ns,
                encoder: 0,
                position_mm,
            });
        }
        assert_eq!(judge.finish(), Some(Rendering::Shape));
    }
}
