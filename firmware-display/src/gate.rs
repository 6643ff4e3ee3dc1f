//! Opens and closes the stimulus without a click, when the hand rests and when the actuators' description
//! changes.
//!
//! The gain is the smoothstep p² (3 − 2p) of a p that rises and falls linearly: it leaves 0 and arrives
//! at 1 without a corner, and is never steeper than 3/2 of the straight ramp.

use protocol::UpdateRate;

use crate::ticks_at;

/// The gain of an open gate, 1 in Q30.
pub const OPEN: u32 = 1 << 30;
/// Time from closed to open and back.
pub const RAMP_MS: u16 = 6;

/// A gain from 0 to [`OPEN`]. The default is closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gate {
    /// p in Q30.
    position: u32,
}

impl Gate {
    /// One tick towards open, or towards closed.
    pub fn tick(&mut self, open: bool, rate: UpdateRate) {
        // Rounded up, so that either end is reached in exactly the ramp's ticks.
        let step = OPEN.div_ceil(ticks_at(rate, RAMP_MS));
        self.position = if open {
            (self.position + step).min(OPEN)
        } else {
            self.position.saturating_sub(step)
        };
    }

    /// Closed at once.
    pub const fn shut(&mut self) {
        self.position = 0;
    }

    /// The gain in Q30, 0 to [`OPEN`]: exactly 0 when closed, exactly [`OPEN`] when open.
    pub const fn gain(self) -> u32 {
        let p = self.position as u64;
        let square = (p * p) >> 30;
        ((square * (3 * OPEN as u64 - 2 * p)) >> 30) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opens_and_closes_in_its_time_and_never_steeper_than_three_halves() {
        for rate in [UpdateRate::Hz2000, UpdateRate::Hz4000] {
            let ramp = ticks_at(rate, RAMP_MS);
            let mut gate = Gate::default();
            let mut before = gate.gain();
            for open in [true, false] {
                let end = if open { OPEN } else { 0 };
                for _ in 0..ramp {
                    assert_ne!(gate.gain(), end);
                    gate.tick(open, rate);
                    // The smoothstep's steepest slope, and the ramp's rounding up.
                    let most = 3 * OPEN / 2 / ramp + 2;
                    assert!(gate.gain().abs_diff(before) <= most);
                    before = gate.gain();
                }
                assert_eq!(gate.gain(), end);
            }
        }
    }

    #[test]
    fn shut_is_closed_at_once_and_opens_in_its_time_again() {
        let rate = UpdateRate::Hz2000;
        let mut gate = Gate::default();
        for _ in 0..2 {
            (0..ticks_at(rate, RAMP_MS)).for_each(|_| gate.tick(true, rate));
            assert_eq!(gate.gain(), OPEN);
            gate.shut();
            assert_eq!(gate.gain(), 0);
        }
    }
}
