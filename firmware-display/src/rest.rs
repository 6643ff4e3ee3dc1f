//! Whether the hand rests.
//!
//! An encoder never says "at rest": it says nothing, or it trembles between two counts. So an interval of
//! two neighbouring counts follows the hand, as a loosely held object follows with play, and a hand that
//! has not pushed it for [`REST_MS`] rests. Voltage has to be gone within 20 ms of the last count, which
//! also makes an encoder harmless that has died, so [`REST_MS`] and the gate's ramp are 19 ms together.
//!
//! A reversal is no rest: at the turning point of the paper's stroke, 70 sin(2π 0.83 t) mm/s, whose
//! acceleration a is 365 mm/s², the interval is pushed for the last time within a count before the
//! turning point and pulled back within two after it, √(2·5 µm/a) + √(2·10 µm/a) = 12.6 ms later at most.
//!
//! The hand sets out when it moves by [`SETTING_OUT`] counts beyond the interval, which is put where the
//! hand is every [`REST_MS`]: a creeping hand rests below 5 µm in 13 ms, 0.38 mm/s, and sets out above
//! 0.77 to 1.15 mm/s. The little way is not lost: the phase has it.

use protocol::UpdateRate;

use crate::gate::RAMP_MS;
use crate::pace::{per_tick, quarters};

/// A hand that has not left two neighbouring counts for so long rests.
pub const REST_MS: u16 = 13;
/// Counts beyond the interval that end a rest.
pub const SETTING_OUT: i32 = 3;

const _: () = assert!(REST_MS + RAMP_MS <= 19);

/// Watches the hand's travel. The default is a hand at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rest {
    /// The hand's position above the lower count of the interval.
    above: i32,
    /// Quarters of a millisecond since the interval was moved.
    passed: u32,
    resting: bool,
}

impl Default for Rest {
    fn default() -> Self {
        Self {
            above: 0,
            passed: 0,
            resting: true,
        }
    }
}

impl Rest {
    /// One tick in which the hand moved by `travel` counts.
    pub fn tick(&mut self, travel: i16, rate: UpdateRate) {
        self.above += i32::from(travel);
        self.passed += per_tick(rate);
        // How far the hand may be outside of the interval.
        let room = if self.resting { SETTING_OUT - 1 } else { 0 };
        let outside = !(-room..=1 + room).contains(&self.above);
        if outside || self.passed >= quarters(REST_MS as u32) {
            self.resting = !outside;
            self.above = self.above.clamp(0, 1);
            self.passed = 0;
        }
    }

    /// Whether the hand rests.
    pub const fn is_resting(self) -> bool {
        self.resting
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ticks_at;

    const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];

    /// A hand that has just set out.
    fn moving(rate: UpdateRate) -> Rest {
        let mut rest = Rest::default();
        rest.tick(100, rate);
        assert!(!rest.is_resting());
        rest
    }

    /// Counts of 5 µm of a hand at `position_um` of the time in s, per tick.
    fn travels(
        rate: UpdateRate,
        seconds: f64,
        position_um: impl Fn(f64) -> f64,
    ) -> impl Iterator<Item = i16> {
        let hz = f64::from(rate.hz());
        let counts = move |tick: f64| (position_um(tick / hz) / 5.0).floor();
        (1..(seconds * hz) as u32)
            .map(move |tick| (counts(tick.into()) - counts(f64::from(tick) - 1.0)) as i16)
    }

    #[test]
    fn a_hand_rests_thirteen_milliseconds_after_its_last_count_even_if_the_encoder_trembles() {
        for rate in RATES {
            for tremble in [0, 1] {
                let mut rest = moving(rate);
                for tick in 1..10 * ticks_at(rate, REST_MS) {
                    rest.tick(if tick % 2 == 0 { tremble } else { -tremble }, rate);
                    assert_eq!(rest.is_resting(), tick >= ticks_at(rate, REST_MS), "{tick}");
                }
            }
        }
    }

    #[test]
    fn the_papers_strokes_never_rest_while_they_reverse() {
        use core::f64::consts::TAU;
        for rate in RATES {
            for place in 0..200 {
                // 70 sin(2π 0.83 t) mm/s, from every place within a count.
                let stroke = |t: f64| {
                    let half_stroke_um = 70_000.0 / (TAU * 0.83);
                    f64::from(place) * 0.025 - half_stroke_um * (TAU * (0.83 * t + 0.1)).cos()
                };
                let mut rest = moving(rate);
                for travel in travels(rate, 1.3, stroke) {
                    rest.tick(travel, rate);
                    assert!(!rest.is_resting());
                }
            }
        }
    }

    #[test]
    fn a_creeping_hand_rests_and_a_slow_one_moves() {
        for rate in RATES {
            let mut rest = moving(rate);
            for travel in travels(rate, 2.0, |t| 370.0 * t).skip(ticks_at(rate, REST_MS) as usize) {
                rest.tick(travel, rate);
            }
            assert!(rest.is_resting(), "0.37 mm/s is too slow");
            let mut set_out = false;
            for travel in travels(rate, 2.0, |t| 750.0 * t) {
                rest.tick(travel, rate);
                set_out |= !rest.is_resting();
            }
            assert!(!set_out, "0.75 mm/s does not end a rest");
            for travel in travels(rate, 0.1, |t| 1_200.0 * t) {
                rest.tick(travel, rate);
            }
            assert!(!rest.is_resting(), "1.2 mm/s ends it");
            for travel in travels(rate, 2.0, |t| 4.99 + 400.0 * t) {
                rest.tick(travel, rate);
                set_out |= rest.is_resting();
            }
            assert!(!set_out, "and 0.4 mm/s does not begin one");
        }
    }

    #[test]
    fn travel_within_three_counts_does_not_end_a_rest_and_more_does_at_once() {
        for rate in RATES {
            for (travel, ends) in [
                (2, false),
                (-2, false),
                (4, true),
                (-3, true),
                (i16::MIN, true),
            ] {
                let mut rest = Rest::default();
                rest.tick(travel, rate);
                assert_eq!(!rest.is_resting(), ends, "{travel}");
            }
        }
    }
}
