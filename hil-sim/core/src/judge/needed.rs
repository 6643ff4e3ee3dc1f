//! Which rendering a surface needs: the lowest from which no higher one differs by what a fingertip can tell.
//!
//! What each rendering would play of what the sensor told is taken from the display's own library
//! ([`crate::native::rendered`]), at the hand's mean speed, as lines of power over frequency from 2 to 200 Hz. Two
//! renderings differ if their power differs by the limen of amplitude, or the mean frequency of their power by that of
//! frequency. By the smallest limens that are found there, so that a doubt asks for more: 2.2 dB, and a Weber fraction of
//! 0.18. Of several surfaces, the one that needs most counts.

use protocol::{ACTUATORS, Actuator, Message, Rendering, Role, Texture};
use serde::Serializer;

use crate::judge::MOTION_MM_S;
use crate::judge::truth::Truth;
use crate::native::rendered::{self, Line};
use crate::run::decoder::TimedMessage;
use crate::run::recording::TickRecord;

/// The smallest limen of a vibration's amplitude on the fingertip, in dB.
pub const LIMEN_DB: f64 = 2.2;
/// The smallest Weber fraction of its frequency.
pub const WEBER: f64 = 0.18;
/// λ that differs by more than this share is another surface's.
const ANOTHER: f64 = 0.1;
/// A surface of which less than one in so many textures tells is passed over: a first λ may be wrong.
const SELDOM: usize = 10;
/// What is felt as vibration, in Hz.
const FELT_HZ: std::ops::RangeInclusive<f64> = 2.0..=200.0;

/// A surface.
#[derive(Clone, Copy, Debug)]
struct Surface {
    wavelength_mm: f64,
    /// What was told of it last, and how often something was.
    texture: Texture,
    told: usize,
}

/// Listens to the sensor and watches the hand.
#[derive(Clone, Debug)]
pub struct Judge {
    actuators: [Actuator; ACTUATORS],
    /// Of the last valid estimate: its number, and λ.
    wavelength_mm: Option<(u32, f64)>,
    surfaces: Vec<Surface>,
    /// The hand at the last tick, in ns and mm.
    hand: Option<(u64, f64)>,
    moving_s: f64,
    travel_mm: f64,
}

impl Judge {
    /// Before the run.
    pub fn new(truth: &Truth) -> Self {
        Self {
            actuators: truth.actuators,
            wavelength_mm: None,
            surfaces: Vec::new(),
            hand: None,
            moving_s: 0.0,
            travel_mm: 0.0,
        }
    }

    /// What a board said.
    pub fn said(&mut self, role: Role, said: &TimedMessage) {
        match &said.message {
            Message::Estimate(estimate) if role == Role::Sensor && estimate.valid => {
                let wavelength_mm = estimate.wavelength_mm.map(f64::from);
                self.wavelength_mm = wavelength_mm.map(|mm| (estimate.sequence, mm));
            }
            Message::Texture(texture) if role == Role::Sensor && texture.valid => {
                if let Some((sequence, wavelength_mm)) = self.wavelength_mm
                    && sequence == texture.sequence
                {
                    self.told(wavelength_mm, *texture);
                }
            }
            _ => {}
        }
    }

    fn told(&mut self, wavelength_mm: f64, texture: Texture) {
        let is_it =
            |known: &&mut Surface| (wavelength_mm / known.wavelength_mm - 1.0).abs() <= ANOTHER;
        let told = match self.surfaces.iter_mut().find(is_it) {
            Some(known) => {
                known.texture = texture;
                known.wavelength_mm = wavelength_mm;
                known.told += 1;
                return;
            }
            None => 1,
        };
        self.surfaces.push(Surface {
            wavelength_mm,
            texture,
            told,
        });
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
        let told: usize = self.surfaces.iter().map(|surface| surface.told).sum();
        let is_passed_over = |surface: &&Surface| SELDOM * surface.told < told;
        let counts = |surface: &&Surface| speed_mm_s.is_finite() && !is_passed_over(surface);
        let needed = |surface: &Surface| {
            let Surface {
                wavelength_mm,
                texture,
                ..
            } = surface;
            needed(&self.actuators, texture, *wavelength_mm, speed_mm_s)
        };
        let surfaces = self.surfaces.iter().filter(counts);
        surfaces
            .filter_map(needed)
            .max_by_key(|rendering| *rendering as u8)
    }
}

/// The rendering that a surface needs under a hand of this speed; none if the display refuses its λ.
fn needed(
    actuators: &[Actuator; ACTUATORS],
    texture: &Texture,
    wavelength_mm: f64,
    speed_mm_s: f64,
) -> Option<Rendering> {
    let felt = |rendering| {
        let lines = rendered::lines(actuators, rendering, texture, wavelength_mm, speed_mm_s);
        lines.map(|lines| felt(&lines))
    };
    let plain = felt(Rendering::Fundamental)?;
    let shape = felt(Rendering::Shape)?;
    let whole = felt(Rendering::Texture)?;
    Some(if differ(shape, whole) {
        Rendering::Texture
    } else if differ(plain, shape) || differ(plain, whole) {
        Rendering::Shape
    } else {
        Rendering::Fundamental
    })
}

/// A rendering as scenes and the JSON have it.
pub(super) fn by_name<S: Serializer>(
    rendering: &Option<Rendering>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match rendering {
        Some(rendering) => serializer.serialize_some(rendering.name()),
        None => serializer.serialize_none(),
    }
}

/// Whether a fingertip tells one from the other by power or by mean frequency.
fn differ(one: (f64, f64), other: (f64, f64)) -> bool {
    let db = 10.0 * (other.0 / one.0).log10();
    db.abs() >= LIMEN_DB || (other.1 / one.1 - 1.0).abs() >= WEBER
}

/// Power, and mean frequency in Hz, of what is felt of what is played.
fn felt(lines: &[Line]) -> (f64, f64) {
    let (power, moment) = lines
        .iter()
        // The fundamental is what the others are compared with, wherever it is.
        .enumerate()
        .filter(|(at, line)| *at == 0 || FELT_HZ.contains(&line.hz))
        .fold((0.0, 0.0), |(power, moment), (_, line)| {
            (power + line.power, moment + line.power * line.hz)
        });
    (power, moment / power)
}

#[cfg(test)]
mod tests {
    use protocol::{Contact, DEFAULT_ACTUATORS, Estimate, GAUGES, GaugeHealth, Partial, Range};

    use super::*;

    fn texture(ratios: [u16; 2], bands: [u16; 4]) -> Texture {
        Texture {
            valid: true,
            partials: ratios.map(|ratio| Partial { ratio, phase: 0 }),
            bands,
            ..Texture::default()
        }
    }

    fn needed(told: &Texture, wavelength_mm: f64, speed_mm_s: f64) -> Option<Rendering> {
        super::needed(&DEFAULT_ACTUATORS, told, wavelength_mm, speed_mm_s)
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
            assert_eq!(
                needed(&told, 2.0, 50.0),
                Some(expected),
                "{ratios:?} {bands:?}"
            );
        }
    }

    /// A partial and a band need room below the limits, and take it from the fundamental.
    #[test]
    fn what_makes_the_stimulus_weaker_by_a_limen_is_needed() {
        for (ratio, expected) in [(270, Rendering::Fundamental), (300, Rendering::Shape)] {
            let told = texture([ratio, 0], [0; 4]);
            assert_eq!(needed(&told, 2.0, 50.0), Some(expected));
        }
        let grain = texture([0, 0], [0, 0, 120, 120]);
        assert_eq!(needed(&grain, 2.0, 50.0), Some(Rendering::Texture));
    }

    #[test]
    fn what_the_display_leaves_out_is_not_needed() {
        let long = texture([0, 0], [500, 600, 0, 0]);
        assert_eq!(needed(&long, 1.0, 50.0), Some(Rendering::Fundamental));
        assert_eq!(needed(&long, 4.0, 50.0), Some(Rendering::Texture));
        assert_eq!(needed(&long, 0.01, 50.0), None);
    }

    #[test]
    fn the_limens_are_where_they_are_said_to_be() {
        let plain = (0.5, 25.0);
        for (power, hz, expected) in [
            (0.5, 25.0 * 1.17, false),
            (0.5, 25.0 * 1.19, true),
            (0.5, 25.0 * 0.81, true),
            (0.5 * 10_f64.powf(0.21), 25.0, false),
            (0.5 * 10_f64.powf(0.23), 25.0, true),
            (0.5 * 10_f64.powf(-0.23), 25.0, true),
        ] {
            assert_eq!(differ(plain, (power, hz)), expected, "{power} {hz}");
        }
    }

    #[test]
    fn what_is_too_fast_to_be_felt_does_not_count() {
        let line = |hz| Line { power: 0.5, hz };
        assert_eq!(felt(&[line(60.0), line(180.0)]), (1.0, 120.0));
        assert_eq!(felt(&[line(80.0), line(240.0)]), (0.5, 80.0));
        assert_eq!(felt(&[line(240.0)]), (0.5, 240.0));
    }

    fn said(message: Message) -> TimedMessage {
        TimedMessage { at_ns: 0, message }
    }

    fn goes(judge: &mut Judge) {
        for (at_ns, position_mm) in [(0, 0.0), (500_000, 0.025)] {
            judge.tick(&TickRecord {
                at_ns,
                encoder: 0,
                position_mm,
            });
        }
    }

    #[test]
    fn without_a_texture_or_a_movement_nothing_is_said() {
        let mut judge = Judge::new(&Truth::new("", "", &|_| 2.0));
        assert_eq!(judge.finish(), None);
        judge.told(2.0, texture([700, 300], [0; 4]));
        assert_eq!(judge.finish(), None);
        goes(&mut judge);
        assert_eq!(judge.finish(), Some(Rendering::Shape));
    }

    #[test]
    fn of_several_surfaces_the_one_that_needs_most_counts_by_what_was_told_of_it_last() {
        let mut judge = Judge::new(&Truth::new("", "", &|_| 2.0));
        goes(&mut judge);
        let (sine, ridges) = (texture([0, 0], [0; 4]), texture([700, 300], [0; 4]));
        for (mm, told, expected) in [
            (2.0, ridges, Rendering::Shape),
            (2.05, sine, Rendering::Fundamental),
            (3.0, ridges, Rendering::Shape),
            (2.0, sine, Rendering::Shape),
        ] {
            let estimate = Estimate {
                sequence: 0,
                instant_us: 0,
                wavelength_mm: Some(mm),
                valid: true,
                confidence: 1.0,
                amplitude_lsb: 300.0,
                counted_mm: None,
                range: Range::T1,
                contact: Contact::Slip,
                velocity_um_s: 0,
                lag_um: None,
                gauges_used: 0x1f,
                health: [GaugeHealth::Good; GAUGES],
            };
            judge.said(Role::Sensor, &said(Message::Estimate(estimate)));
            judge.said(Role::Sensor, &said(Message::Texture(told)));
            assert_eq!(judge.finish(), Some(expected), "{mm}");
        }
        // One of another estimate's, and one that is told of seldom.
        let late = Texture {
            sequence: 7,
            ..ridges
        };
        judge.said(Role::Sensor, &said(Message::Texture(late)));
        assert_eq!(judge.surfaces.len(), 2);
        for _ in 0..10 {
            judge.told(2.0, sine);
        }
        assert_eq!(judge.finish(), Some(Rendering::Fundamental));
    }
}
