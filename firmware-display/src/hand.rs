//! The operator's hand: a 16-bit encoder counter in, travel, position and velocity out.

use protocol::{Motion, UpdateRate};

use crate::pace::{per_tick, quarters};
use crate::{MICROMETRES_PER_COUNT, MOTION_RATE_HZ};

/// Quarters of a millisecond between two motions.
const MOTION_QUARTERS: u32 = quarters(1_000) / MOTION_RATE_HZ;
/// Motions over which the velocity is taken: 16 ms.
const VELOCITY_SPAN: usize = 8;
/// Velocity of one count over the span, in µm/s, times two so that it is whole: 312.5 µm/s.
const DOUBLE_VELOCITY_PER_COUNT: i32 =
    2 * MICROMETRES_PER_COUNT * MOTION_RATE_HZ as i32 / VELOCITY_SPAN as i32;
/// No hand at a fingertip's stage is faster, in mm/s: several times a quick stroke.
pub const FASTEST_MM_S: u32 = 2_000;
/// Its counts in a quarter of a millisecond: 100.
const MOST_PER_QUARTER: u32 = FASTEST_MM_S * 1_000 / MICROMETRES_PER_COUNT as u32 / quarters(1_000);

const _: () = assert!(quarters(1_000).is_multiple_of(MOTION_RATE_HZ));
const _: () = assert!(MOTION_QUARTERS.is_multiple_of(per_tick(UpdateRate::Hz2000)));
const _: () = assert!(
    MOST_PER_QUARTER * quarters(1_000) * MICROMETRES_PER_COUNT as u32 == FASTEST_MM_S * 1_000
);
const _: () = assert!(VELOCITY_SPAN.is_power_of_two());
const _: () = assert!(
    DOUBLE_VELOCITY_PER_COUNT * VELOCITY_SPAN as i32
        == 2 * MICROMETRES_PER_COUNT * MOTION_RATE_HZ as i32
);

/// The encoder's counter has jumped further than a hand moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jump {
    /// By so many counts.
    pub counts: i16,
}

/// Follows the hand from its first reading, which is position 0.
///
/// The counter wraps; a travel of up to ±32 767 counts between two readings is read right. What is
/// further than a hand moves in the time is no travel: neither the stimulus nor the arm goes along.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hand {
    counter: Option<u16>,
    position_counts: i64,
    /// Time since the last motion.
    quarters: u32,
    /// Length of the tick before, in quarters of a millisecond.
    last_quarters: u32,
    sequence: u32,
    /// Positions at the last motions, the oldest at `sequence` modulo the length.
    past_counts: [i64; VELOCITY_SPAN],
}

impl Hand {
    /// Takes the encoder's counter, once a tick, `quarters` of a millisecond after the tick before.
    /// Returns the travel since then, in counts.
    ///
    /// # Errors
    /// A travel faster than [`FASTEST_MM_S`].
    pub fn read(&mut self, counter: u16, quarters: u32) -> Result<i16, Jump> {
        let counts = counter.wrapping_sub(self.counter.unwrap_or(counter)) as i16;
        self.counter = Some(counter);
        self.quarters = self.quarters.saturating_add(quarters);
        // The first tick after a change of the rate may still have the length of those before.
        let longest = quarters.max(self.last_quarters);
        self.last_quarters = quarters.min(per_tick(UpdateRate::Hz2000));
        if u32::from(counts.unsigned_abs()) > longest.saturating_mul(MOST_PER_QUARTER) {
            return Err(Jump { counts });
        }
        self.position_counts = self.position_counts.wrapping_add(i64::from(counts));
        Ok(counts)
    }

    /// A [`Motion`] every 2 ms, so at [`MOTION_RATE_HZ`]; `instant_us` is when the counter was read. To
    /// be called once after each tick.
    ///
    /// The velocity is the position's difference over the last 16 ms: the mean velocity of that
    /// span, so the velocity of 8 ms ago while the hand accelerates evenly, in steps of 312.5 µm/s.
    pub fn motion(&mut self, instant_us: u64) -> Option<Motion> {
        if self.quarters < MOTION_QUARTERS {
            return None;
        }
        // After missed ticks one motion stands for those that would have been due.
        self.quarters %= MOTION_QUARTERS;
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let past = &mut self.past_counts[sequence as usize % VELOCITY_SPAN];
        let span = self.position_counts.wrapping_sub(*past);
        *past = self.position_counts;
        // A hand that is no faster than the fastest travels 6 400 counts in the span; after missed
        // ticks it may be more, but of 64 ticks no more than 2²¹.
        let velocity_um_s = (span as i32).saturating_mul(DOUBLE_VELOCITY_PER_COUNT) / 2;
        Some(Motion {
            sequence,
            instant_us,
            position_um: self
                .position_counts
                .wrapping_mul(i64::from(MICROMETRES_PER_COUNT)),
            velocity_um_s,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];

    #[test]
    fn a_motion_comes_every_two_milliseconds_with_its_number_at_either_rate() {
        for rate in RATES {
            let mut hand = Hand::default();
            let tick_us = u64::from(1_000_000 / rate.hz());
            let mut motions = Vec::new();
            for tick in 1..=80 {
                hand.read(0, per_tick(rate)).unwrap();
                if let Some(motion) = hand.motion(tick * tick_us) {
                    motions.push((motion.sequence, motion.instant_us));
                }
            }
            let count = 80 * tick_us as u32 / 2_000;
            let expected: Vec<_> = (0..count).map(|n| (n, 2_000 * u64::from(n + 1))).collect();
            assert_eq!(motions, expected);
        }
    }

    #[test]
    fn motions_go_on_at_their_rate_when_the_ticks_change_theirs() {
        let mut hand = Hand::default();
        let mut motions = Vec::new();
        let mut now_us = 0;
        for tick in 0..4_000 {
            let rate = RATES[usize::from(tick / 400 % 2 == 0)];
            now_us += u64::from(1_000_000 / rate.hz());
            hand.read(0, per_tick(rate)).unwrap();
            motions.extend(hand.motion(now_us).map(|motion| motion.instant_us));
        }
        assert!(motions.len() > 700);
        assert!(motions.windows(2).all(|pair| pair[1] - pair[0] == 2_000));
    }

    #[test]
    fn position_counts_from_the_first_reading_across_the_counters_wrap() {
        let mut hand = Hand::default();
        let mut counter = 65_000_u16;
        hand.read(counter, 2).unwrap();
        for _ in 0..199_999 {
            counter = counter.wrapping_add(3);
            assert_eq!(hand.read(counter, 2), Ok(3));
        }
        assert_eq!(hand.motion(0).unwrap().position_um, 199_999 * 3 * 5);
        for _ in 0..400_000 {
            counter = counter.wrapping_sub(3);
            assert_eq!(hand.read(counter, 2), Ok(-3));
        }
        assert_eq!(hand.motion(0).unwrap().position_um, -200_001 * 3 * 5);
    }

    #[test]
    fn a_constant_velocity_is_told_after_sixteen_milliseconds() {
        let mut hand = Hand::default();
        let mut told = Vec::new();
        // 7 counts every 500 µs: 70 mm/s.
        for tick in 0..80_u16 {
            let counter = tick.wrapping_mul(7).wrapping_add(65_500);
            hand.read(counter, 2).unwrap();
            told.extend(hand.motion(0).map(|motion| motion.velocity_um_s));
        }
        // The first reading is travel 0, so the first span is a tick short.
        assert!(told[..8].is_sorted());
        assert!(
            told[8..].iter().all(|&velocity| velocity == 70_000),
            "{told:?}"
        );
    }

    #[test]
    fn a_hand_of_two_metres_a_second_is_followed_and_one_count_more_is_a_jump() {
        for rate in RATES {
            let quarters = per_tick(rate);
            let most = (2_000_000 / 5 / rate.hz()) as i16;
            for sign in [1, -1] {
                let mut hand = Hand::default();
                hand.read(0, quarters).unwrap();
                let mut counter = 0_u16.wrapping_add_signed(sign * most);
                assert_eq!(hand.read(counter, quarters), Ok(sign * most));
                counter = counter.wrapping_add_signed(sign * (most + 1));
                let counts = sign * (most + 1);
                assert_eq!(hand.read(counter, quarters), Err(Jump { counts }));
                // The jump is no travel, and what comes after it is again.
                assert_eq!(hand.read(counter.wrapping_add(1), quarters), Ok(1));
                assert_eq!(hand.position_counts, i64::from(sign * most + 1));
            }
        }
    }

    #[test]
    fn a_hand_may_travel_longer_where_ticks_were_missed() {
        let mut hand = Hand::default();
        hand.read(0, 2).unwrap();
        assert_eq!(hand.read(600, 6), Ok(600));
        // And in the first tick after a change of the rate, which began before it.
        assert_eq!(hand.read(800, 1), Ok(200));
        assert_eq!(hand.read(1_000, 1), Err(Jump { counts: 200 }));
    }

    #[test]
    fn the_longest_gap_with_the_furthest_travel_overflows_nothing() {
        let mut hand = Hand::default();
        let mut last = 0;
        for tick in 0..80_u32 {
            hand.read((tick * 32_767) as u16, u32::MAX).unwrap();
            if let Some(motion) = hand.motion(0) {
                last = motion.velocity_um_s;
            }
        }
        assert_eq!(last, 8 * 32_767 * 625 / 2);
    }
}
