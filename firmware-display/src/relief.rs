//! Which textures are to be played, and for how long: [`crate::plausibility`] for what the surface is besides λ.
//!
//! | a texture is | if | then |
//! | --- | --- | --- |
//! | flooding | more come than a sensor sends: 8 at once, or above 80 Hz for longer | not used |
//! | late | its sequence is not after the last one's, and no new beginning | not used |
//! | unsound | a number is out of its range ([`Texture::is_sound`]) | not used |
//! | taken | none of these | its wave is played if it is valid, its friction if there is one |
//!
//! None of them is a hold: what a texture asks for is within all limits whatever it says. A wave that was taken counts for
//! [`max_age_ms`](protocol::DisplayConfiguration::max_age_ms), as λ does. Friction does until the textures of so long have
//! told of none, or were late or unsound: while there are none, as where an arm rests or a link fails, a weak stimulus is
//! not to burst out.

use protocol::Texture;

use crate::flood::Flood;
use crate::order::{Order, SENSORS, order};
use crate::pace::quarters;

/// From one texture of a sensor's to the next.
const PERIOD_MS: u32 = 50;

/// What is to be done with a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Its wave, if it is valid, and its friction, if it tells of one.
    Taken,
    /// It was sent before one that was seen already.
    Late,
    /// A number is out of its range.
    Unsound,
    /// It is one too many.
    Flooding,
}

/// The textures so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    last_sequence: Option<u32>,
    flood: Flood,
    /// Time since the last wave was taken, in quarters of a millisecond.
    wave_age: u32,
    /// What the textures since the last one that told of friction stand for, in quarters of a millisecond.
    friction_age: u32,
}

impl Relief {
    /// Before the first texture.
    pub const fn new() -> Self {
        Self {
            last_sequence: None,
            flood: Flood::OF_TEXTURES,
            wave_age: u32::MAX,
            friction_age: u32::MAX,
        }
    }

    /// The sensor has started again: the next texture is later than any other.
    pub const fn begin_anew(&mut self) {
        self.last_sequence = None;
    }

    /// A texture has come, of a sensor that may have started again or not.
    pub fn judge(&mut self, texture: &Texture, may_begin: bool) -> Verdict {
        if !self.flood.take() {
            return Verdict::Flooding;
        }
        // It tells of none until it has been looked at.
        self.friction_age = self.friction_age.saturating_add(quarters(PERIOD_MS));
        if order(self.last_sequence, texture.sequence, may_begin, &SENSORS) == Order::Late {
            return Verdict::Late;
        }
        self.last_sequence = Some(texture.sequence);
        if !texture.is_sound() {
            return Verdict::Unsound;
        }
        if texture.valid {
            self.wave_age = 0;
        }
        if texture.friction.is_some() {
            self.friction_age = 0;
        }
        Verdict::Taken
    }

    /// A tick of `quarters` of a millisecond has passed.
    pub fn elapse(&mut self, quarters: u32) {
        self.wave_age = self.wave_age.saturating_add(quarters);
        self.flood.elapse(quarters);
    }

    /// Whether the last wave taken is no older than this.
    pub const fn wave_is_fresh(&self, max_age_ms: u16) -> bool {
        self.wave_age <= quarters(max_age_ms as u32)
    }

    /// Whether the textures since the last friction that was taken stand for no longer than this.
    pub const fn friction_is_fresh(&self, max_age_ms: u16) -> bool {
        self.friction_age <= quarters(max_age_ms as u32)
    }
}

impl Default for Relief {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use protocol::{Friction, Partial};

    use super::*;

    fn texture(sequence: u32) -> Texture {
        Texture {
            sequence,
            valid: true,
            friction: Some(Friction::default()),
            ..Texture::default()
        }
    }

    #[test]
    fn a_texture_is_taken_in_its_order_and_if_it_is_sound() {
        let mut relief = Relief::new();
        let unsound = Texture {
            partials: [
                Partial::default(),
                Partial {
                    ratio: 10_001,
                    phase: 0,
                },
            ],
            ..texture(3)
        };
        for (texture, expected) in [
            (texture(1), Verdict::Taken),
            (texture(1), Verdict::Late),
            (unsound, Verdict::Unsound),
            (texture(3), Verdict::Late),
            (texture(4), Verdict::Taken),
        ] {
            assert_eq!(relief.judge(&texture, false), expected);
            relief.elapse(quarters(50));
        }
        // Of a sensor that may have started again.
        for (sequence, may_begin, expected) in [
            (400, false, Verdict::Taken),
            (60, false, Verdict::Late),
            (368, true, Verdict::Late),
            (60, true, Verdict::Taken),
            (65, false, Verdict::Taken),
        ] {
            assert_eq!(relief.judge(&texture(sequence), may_begin), expected);
            relief.elapse(quarters(50));
        }
    }

    #[test]
    fn only_what_a_texture_stands_by_is_young_again() {
        let mut relief = Relief::new();
        assert!(!relief.wave_is_fresh(5_000) && !relief.friction_is_fresh(5_000));
        relief.judge(&texture(1), false);
        relief.elapse(quarters(400));
        assert!(relief.wave_is_fresh(400) && relief.friction_is_fresh(400));
        let rubs = Texture {
            valid: false,
            ..texture(2)
        };
        relief.judge(&rubs, false);
        relief.elapse(quarters(200));
        assert!(!relief.wave_is_fresh(500) && relief.friction_is_fresh(500));
        // Time alone makes no friction old, but textures that tell of none.
        relief.elapse(quarters(10_000));
        for sequence in 3..13 {
            assert!(relief.friction_is_fresh(499), "{sequence}");
            let slides = Texture {
                friction: None,
                ..texture(sequence)
            };
            relief.judge(&slides, false);
            relief.elapse(quarters(50));
        }
        assert!(relief.wave_is_fresh(500) && !relief.friction_is_fresh(499));
        // Nor do those that are late tell of any.
        relief.judge(&texture(13), false);
        for _ in 0..10 {
            assert!(relief.friction_is_fresh(499));
            assert_eq!(relief.judge(&texture(12), false), Verdict::Late);
            relief.elapse(quarters(50));
        }
        assert!(!relief.friction_is_fresh(499));
    }

    #[test]
    fn four_times_the_sensors_rate_is_no_flood_and_more_is() {
        for (every_ms, floods) in [(50, false), (13, false), (10, true), (1, true)] {
            let mut relief = Relief::new();
            let flooded = (0..1_000).any(|sequence| {
                let verdict = relief.judge(&texture(sequence), false);
                relief.elapse(quarters(every_ms));
                verdict == Verdict::Flooding
            });
            assert_eq!(flooded, floods, "{every_ms} ms");
        }
    }
}
