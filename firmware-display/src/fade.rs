//! The stimulus' gain, faded in and out linearly.

use crate::pace::quarters;

/// The full gain, 1 in Q31.
pub const FULL: u32 = 1 << 31;
/// Time from full stimulus to 0, in ms, where there is no time for
/// [`fade_out_ms`](protocol::DisplayConfiguration::fade_out_ms).
pub const QUICK_MS: u16 = 8;

/// Where the gain is to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// To full, in the time for fading in.
    In,
    /// To 0, in the time for fading out.
    Out,
    /// To 0, in [`QUICK_MS`], or in the time for fading out if that is shorter.
    Quickly,
    /// To 0, at once.
    Off,
}

/// A gain from 0 to [`FULL`] on its way to one end or the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fade {
    gain: u32,
    /// Change of the gain in a quarter of a millisecond.
    rise: u32,
    fall: u32,
}

impl Fade {
    /// Silent; rises to full in `fade_in_ms`, falls to 0 in `fade_out_ms`, both 1 to 1 000 ms.
    pub const fn new(fade_in_ms: u16, fade_out_ms: u16) -> Self {
        Self {
            gain: 0,
            rise: per_quarter(fade_in_ms),
            fall: per_quarter(fade_out_ms),
        }
    }

    /// Takes other times, from the gain reached.
    pub const fn set_times(&mut self, fade_in_ms: u16, fade_out_ms: u16) {
        self.rise = per_quarter(fade_in_ms);
        self.fall = per_quarter(fade_out_ms);
    }

    /// One tick of `quarters` of a millisecond. Returns the gain, 0 to [`FULL`].
    pub fn step(&mut self, aim: Aim, quarters: u32) -> u32 {
        const QUICK: u32 = per_quarter(QUICK_MS);
        let after = |change: u32| change.saturating_mul(quarters);
        self.gain = match aim {
            Aim::In => self.gain.saturating_add(after(self.rise)).min(FULL),
            Aim::Out => self.gain.saturating_sub(after(self.fall)),
            Aim::Quickly => self.gain.saturating_sub(after(self.fall.max(QUICK))),
            Aim::Off => 0,
        };
        self.gain
    }
}

/// Rounded up, so that the end is reached in exactly the time asked for, not a tick later. A time of 0,
/// which no checked configuration has, is no time.
const fn per_quarter(ms: u16) -> u32 {
    if ms == 0 {
        FULL
    } else {
        FULL.div_ceil(quarters(ms as u32))
    }
}

#[cfg(test)]
mod tests {
    use protocol::UpdateRate;

    use super::*;
    use crate::pace::per_tick;

    const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];

    /// Ticks until `end`.
    fn ticks_to(fade: &mut Fade, aim: Aim, rate: UpdateRate, end: u32) -> u32 {
        (1..)
            .find(|_| fade.step(aim, per_tick(rate)) == end)
            .unwrap()
    }

    #[test]
    fn each_fade_takes_exactly_its_time_at_either_rate() {
        for rate in RATES {
            for ms in [1, 7, 20, 50, 333, 1_000] {
                let mut fade = Fade::new(ms, ms);
                for (aim, end) in [(Aim::In, FULL), (Aim::Out, 0)] {
                    let ticks = u32::from(ms) * rate.hz() / 1_000;
                    assert_eq!(
                        ticks_to(&mut fade, aim, rate, end),
                        ticks,
                        "{ms} ms, {aim:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_quick_way_out_takes_eight_milliseconds_or_less() {
        for rate in RATES {
            for (fade_out_ms, expected_ms) in [(1_000, 8), (8, 8), (3, 3)] {
                let mut fade = Fade::new(1, fade_out_ms);
                ticks_to(&mut fade, Aim::In, rate, FULL);
                assert_eq!(
                    ticks_to(&mut fade, Aim::Quickly, rate, 0),
                    expected_ms * rate.hz() / 1_000
                );
                ticks_to(&mut fade, Aim::In, rate, FULL);
                assert_eq!(ticks_to(&mut fade, Aim::Off, rate, 0), 1);
            }
        }
    }

    #[test]
    fn turns_back_from_where_it_is() {
        let mut fade = Fade::new(10, 10);
        (0..10).for_each(|_| {
            fade.step(Aim::In, 2);
        });
        let half = fade.gain;
        assert_eq!(fade.step(Aim::Out, 2), half - 2 * FULL.div_ceil(40));
    }

    #[test]
    fn other_times_hold_from_the_gain_reached() {
        let mut fade = Fade::new(1, 1);
        ticks_to(&mut fade, Aim::In, UpdateRate::Hz4000, FULL);
        fade.set_times(20, 50);
        assert_eq!(fade.gain, FULL);
        let out = ticks_to(&mut fade, Aim::Out, UpdateRate::Hz4000, 0);
        let back = ticks_to(&mut fade, Aim::In, UpdateRate::Hz4000, FULL);
        assert_eq!((out, back), (4 * 50, 4 * 20));
    }
}
