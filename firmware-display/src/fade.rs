//! The stimulus' gain, faded in and out linearly, counted in ticks.

use crate::ticks;

/// The full gain, 1 in Q31.
pub const FULL: u32 = 1 << 31;

/// A gain from 0 to [`FULL`] on its way to one end or the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fade {
    gain: u32,
    rise: u32,
    fall: u32,
}

impl Fade {
    /// Silent; rises to full in `fade_in_ms`, falls to 0 in `fade_out_ms`, both 1 to 1 000 ms.
    pub const fn new(fade_in_ms: u16, fade_out_ms: u16) -> Self {
        Self {
            gain: 0,
            rise: per_tick(fade_in_ms),
            fall: per_tick(fade_out_ms),
        }
    }

    /// Takes other times, from the gain reached.
    pub const fn set_times(&mut self, fade_in_ms: u16, fade_out_ms: u16) {
        self.rise = per_tick(fade_in_ms);
        self.fall = per_tick(fade_out_ms);
    }

    /// One tick towards full if `up`, else towards 0.
    pub fn step(&mut self, up: bool) {
        self.gain = if up {
            self.gain.saturating_add(self.rise).min(FULL)
        } else {
            self.gain.saturating_sub(self.fall)
        };
    }

    /// The gain, 0 to [`FULL`].
    pub const fn gain(self) -> u32 {
        self.gain
    }
}

/// Rounded up, so that the end is reached in exactly the ticks asked for, not one later. A time of
/// 0, which no checked configuration has, is one tick.
const fn per_tick(ms: u16) -> u32 {
    let ticks = ticks(ms);
    if ticks == 0 {
        FULL
    } else {
        FULL.div_ceil(ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fade_takes_exactly_its_time() {
        for ms in [1, 7, 20, 50, 333, 1_000] {
            let mut fade = Fade::new(ms, ms);
            for up in [true, false] {
                let end = if up { FULL } else { 0 };
                for tick in 1..=ticks(ms) {
                    assert_ne!(
                        fade.gain(),
                        end,
                        "{ms} ms, up {up}: there before tick {tick}"
                    );
                    fade.step(up);
                }
                assert_eq!(fade.gain(), end, "{ms} ms, up {up}");
            }
        }
    }

    #[test]
    fn turns_back_from_where_it_is() {
        let mut fade = Fade::new(10, 10);
        (0..10).for_each(|_| fade.step(true));
        let half = fade.gain();
        fade.step(false);
        assert_eq!(fade.gain(), half - FULL.div_ceil(20));
    }
}
