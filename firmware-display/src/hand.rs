//! The operator's hand: a 16-bit encoder counter in, travel, position and velocity out.

use protocol::Motion;

use crate::{MICROMETRES_PER_COUNT, MOTION_RATE_HZ, TICK_RATE_HZ};

/// Output ticks for one [`Motion`].
const TICKS_PER_MOTION: u32 = TICK_RATE_HZ / MOTION_RATE_HZ;
/// Motions over which the velocity is taken: 16 ms.
const VELOCITY_SPAN: usize = 8;
/// Velocity of one count over the span, in µm/s, times two so that it is whole: 312.5 µm/s.
const DOUBLE_VELOCITY_PER_COUNT: i32 =
    2 * MICROMETRES_PER_COUNT * MOTION_RATE_HZ as i32 / VELOCITY_SPAN as i32;

const _: () = assert!(TICK_RATE_HZ.is_multiple_of(MOTION_RATE_HZ));
const _: () = assert!(VELOCITY_SPAN.is_power_of_two());
const _: () = assert!(
    DOUBLE_VELOCITY_PER_COUNT * VELOCITY_SPAN as i32
        == 2 * MICROMETRES_PER_COUNT * MOTION_RATE_HZ as i32
);

/// Follows the hand from its first reading, which is position 0.
///
/// The counter wraps; a travel of up to ±32 767 counts a tick, 327 m/s, is read right.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hand {
    counter: Option<u16>,
    position_counts: i64,
    ticks: u32,
    sequence: u32,
    /// Positions at the last motions, the oldest at `sequence` modulo the length.
    past_counts: [i64; VELOCITY_SPAN],
}

impl Hand {
    /// Takes the encoder's counter, once a tick. Returns the travel since the tick before, in counts.
    pub fn read(&mut self, counter: u16) -> i16 {
        let travel = counter.wrapping_sub(self.counter.unwrap_or(counter)) as i16;
        self.counter = Some(counter);
        self.position_counts = self.position_counts.wrapping_add(i64::from(travel));
        self.ticks = self.ticks.wrapping_add(1);
        travel
    }

    /// A [`Motion`] after every fourth tick, so at [`MOTION_RATE_HZ`]; `instant_us` is when the
    /// counter was read. To be called once after each tick.
    ///
    /// The velocity is the position's difference over the last 16 ms: the mean velocity of that
    /// span, so the velocity of 8 ms ago while the hand accelerates evenly, in steps of 312.5 µm/s.
    pub fn motion(&mut self, instant_us: u64) -> Option<Motion> {
        if !self.ticks.is_multiple_of(TICKS_PER_MOTION) {
            return None;
        }
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let past = &mut self.past_counts[sequence as usize % VELOCITY_SPAN];
        let span = self.position_counts.wrapping_sub(*past);
        *past = self.position_counts;
        // 32 ticks of 32 768 counts at most: below 2³¹ after the multiplication.
        let velocity_um_s = span as i32 * DOUBLE_VELOCITY_PER_COUNT / 2;
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
    use super::*;

    #[test]
    fn a_motion_comes_every_fourth_tick_with_its_number() {
        let mut hand = Hand::default();
        let mut motions = std::vec::Vec::new();
        for tick in 1..=40_u64 {
            hand.read(0);
            if let Some(motion) = hand.motion(tick * 500) {
                motions.push((motion.sequence, motion.instant_us));
            }
        }
        let expected: std::vec::Vec<_> = (0..10).map(|n| (n, 2_000 * (u64::from(n) + 1))).collect();
        assert_eq!(motions, expected);
    }

    #[test]
    fn position_counts_from_the_first_reading_across_the_counters_wrap() {
        let mut hand = Hand::default();
        let mut counter = 65_000_u16;
        hand.read(counter);
        for _ in 0..199_999 {
            counter = counter.wrapping_add(3);
            assert_eq!(hand.read(counter), 3);
        }
        assert_eq!(hand.motion(0).unwrap().position_um, 199_999 * 3 * 5);
        for _ in 0..400_000 {
            counter = counter.wrapping_sub(3);
            assert_eq!(hand.read(counter), -3);
        }
        assert_eq!(hand.motion(0).unwrap().position_um, -200_001 * 3 * 5);
    }

    #[test]
    fn a_constant_velocity_is_told_after_sixteen_milliseconds() {
        let mut hand = Hand::default();
        let mut told = std::vec::Vec::new();
        // 7 counts every 500 µs: 70 mm/s.
        for tick in 0..80_u16 {
            hand.read(tick.wrapping_mul(7).wrapping_add(65_500));
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
    fn the_fastest_travel_that_can_be_read_overflows_nothing() {
        let mut hand = Hand::default();
        let mut last = 0;
        for tick in 0..80_u32 {
            hand.read((tick * 32_767) as u16);
            if let Some(motion) = hand.motion(0) {
                last = motion.velocity_um_s;
            }
        }
        assert_eq!(last, 32_767 * 5 * 2_000);
    }
}
