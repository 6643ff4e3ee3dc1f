//! How the wave lies over the fingertip: the phase by which each column of actuators is ahead.
//!
//! In travelling mode the actuator at xᵢ is 2π xᵢ/λ ahead of the fingertip's middle, so that the
//! pattern moves across the skin as the surface would. In uniform mode nobody is ahead, which is the
//! same with a wavenumber of 0, so that one mode turns into the other as one λ into another.
//!
//! The hand's phase goes on smoothly when λ changes, but 2π xᵢ/λ would jump. So the wavenumber
//! glides to its new value, and only while the hand moves: in a tick in which the hand turns the
//! phase by Δφ, no column is turned by more than Δφ/4 in addition, nor by more than 1/64 turn. No
//! voltage steps further than 5/4 of what the hand's motion makes it step, and a hand at rest feels
//! nothing. The outermost columns settle within four times as many wavelengths of travel as they
//! have turns to go.
//!
//! Phases are equal modulo a turn, so the wavenumber goes the shorter way round.

use crate::array::{COLUMNS, half_pitches_from_middle};
use crate::sine::Sine;

/// Half pitches from the middle to the outermost column.
const OUTERMOST: u32 = half_pitches_from_middle(COLUMNS - 1, COLUMNS) as u32;
/// The most that a column may be turned in addition to the hand, as a part of the hand's turn.
const PART_OF_THE_HANDS: u32 = 4;
/// The most that a column may be turned in addition to the hand, in turns / 2³²: 1/64 turn.
const MOST_PER_TICK: u32 = 1 << (32 - 6);

/// The wavenumber along x: phase per half pitch, in turns / 2³².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pattern {
    per_half_pitch: u32,
    target: u32,
}

impl Pattern {
    /// Where to glide: phase per half pitch, in turns / 2³²; 0 is uniform.
    pub const fn aim(&mut self, per_half_pitch: u32) {
        self.target = per_half_pitch;
    }

    /// Is there at once: for when no voltage shows it.
    pub const fn settle(&mut self) {
        self.per_half_pitch = self.target;
    }

    /// One tick, in which the hand turned the phase by `turned` (unsigned, turns / 2³²).
    pub fn glide(&mut self, turned: u32) {
        let bound = ((turned / PART_OF_THE_HANDS).min(MOST_PER_TICK) / OUTERMOST) as i32;
        let rest = self.target.wrapping_sub(self.per_half_pitch) as i32;
        self.per_half_pitch = self
            .per_half_pitch
            .wrapping_add(rest.clamp(-bound, bound) as u32);
    }

    /// Phase per half pitch now, in turns / 2³².
    pub const fn per_half_pitch(self) -> u32 {
        self.per_half_pitch
    }

    /// Each column's sine, with `turns` / 2³² in the middle of the fingertip.
    pub fn sines(self, turns: u32) -> [Sine; COLUMNS] {
        if self.per_half_pitch == 0 {
            return [Sine::of(turns); COLUMNS];
        }
        let mut sines = [Sine::default(); COLUMNS];
        for (column, sine) in sines.iter_mut().enumerate() {
            let half_pitches = half_pitches_from_middle(column, COLUMNS) as u32;
            let ahead = self.per_half_pitch.wrapping_mul(half_pitches);
            *sine = Sine::of(turns.wrapping_add(ahead));
        }
        sines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURN_32ND: u32 = 1 << 27;

    #[test]
    fn no_column_is_turned_by_more_than_a_quarter_of_the_hands_turn() {
        let mut pattern = Pattern::default();
        pattern.aim(5 * TURN_32ND);
        for turned in [0, 1, 35, 36, 1_000, 50_000_000, 1 << 28, u32::MAX] {
            let before = pattern;
            pattern.glide(turned);
            let moved = pattern.per_half_pitch.wrapping_sub(before.per_half_pitch);
            assert!(moved * OUTERMOST <= turned / 4);
            assert!(moved * OUTERMOST <= 1 << 26);
        }
        assert!(pattern.per_half_pitch > 0);
    }

    #[test]
    fn arrives_exactly_by_the_shorter_way() {
        let mut pattern = Pattern::default();
        pattern.aim(30 * TURN_32ND);
        let mut turned = 0_u64;
        while pattern.per_half_pitch != pattern.target {
            let before = pattern.per_half_pitch;
            pattern.glide(1 << 24);
            turned += 1 << 24;
            assert!(
                pattern.per_half_pitch.wrapping_sub(before) as i32 <= 0,
                "upwards is longer"
            );
        }
        // Two 32nds down for each half pitch, nine of them, at a quarter of the hand's turn.
        let expected = 4 * 9 * 2 * u64::from(TURN_32ND);
        assert!(turned.abs_diff(expected) <= 2 << 24, "{turned} {expected}");
    }

    #[test]
    fn columns_are_ahead_by_their_distance_from_the_middle() {
        let mut pattern = Pattern::default();
        pattern.aim(1_000);
        pattern.settle();
        let turns = 77_777_777;
        for (column, sine) in pattern.sines(turns).iter().enumerate() {
            let ahead = (2 * column as i32 - 9) * 1_000;
            assert_eq!(*sine, Sine::of(turns.wrapping_add_signed(ahead)));
        }
    }
}
