//! The fifty actuators' gains and polarities, and the DAC words that come of them.

use protocol::actuators::{Actuator, UNITY_GAIN};

use crate::level::FULL;
use crate::sine::ONE;
use crate::{ACTUATORS, ZERO_VOLT};

/// Each actuator plays a lane of its own.
pub const EACH: [u8; ACTUATORS] = {
    let mut each = [0; ACTUATORS];
    let mut actuator = 0;
    while actuator < ACTUATORS {
        each[actuator] = actuator as u8;
        actuator += 1;
    }
    each
};

/// The gains, negative for the opposite voltage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    gains_q30: [i32; ACTUATORS],
    /// Whether all are alike.
    alike: bool,
}

impl Array {
    /// Gains, more than 1 counting as 1, and polarities of these actuators.
    pub fn new(actuators: &[Actuator; ACTUATORS]) -> Self {
        let gains_q30 = actuators.map(gain);
        Self {
            gains_q30,
            alike: gains_q30.iter().all(|gain| *gain == gains_q30[0]),
        }
    }

    /// The gains in Q30, negative for the opposite voltage.
    pub const fn gains_q30(&self) -> &[i32; ACTUATORS] {
        &self.gains_q30
    }

    /// Whether gain and polarity of one actuator, of those there are, follow from its description.
    pub const fn is_of(&self, index: usize, actuator: &Actuator) -> bool {
        self.gains_q30[index] == gain(*actuator)
    }

    /// Writes each actuator's word, 0 V + round(level · gain · its lane), but no further from what was there
    /// than `most` steps. True if any changed.
    ///
    /// `lanes` are within ± [`ONE`], in the order of the first actuators that play them, and `lane_of` is which of them
    /// each actuator plays; a single one stands for all, and may as long as one has since all words were 0 V. `level` is
    /// in Q16 DAC steps, [`FULL`] at most, so that no word is further than 32 767 steps from 0 V. Nothing is rounded but the word itself, half up: the product has 42 bits behind the point, so
    /// that halves as such do not occur and rounding moves no mean.
    pub fn draw(
        &self,
        level: u32,
        lanes: &[i32],
        lane_of: &[u8; ACTUATORS],
        most: i32,
        words: &mut [u16; ACTUATORS],
    ) -> bool {
        // The last two bits, which a gain of 1 would cut off, would do so downwards for either polarity.
        let level = (level & !0b11) as i32;
        if let &[lane] = lanes {
            if self.alike {
                let word = drawn(level, self.gains_q30[0], lane, most, words[0]);
                let changed = word != words[0];
                *words = [word; ACTUATORS];
                return changed;
            }
            return self.draw_each(level, core::iter::repeat(lane), most, words);
        }
        if self.alike {
            return self.draw_alike(level, lanes, lane_of, most, words);
        }
        // An actuator of no lane, which only a fault of memory makes, plays nothing.
        let lane = |index: &u8| lanes.get(usize::from(*index)).copied().unwrap_or(0);
        self.draw_each(level, lane_of.iter().map(lane), most, words)
    }

    /// Of equal gains those of a lane have had equal words since all were 0 V: each is worked out once, where it comes
    /// first, which is in the lanes' order.
    fn draw_alike(
        &self,
        level: i32,
        lanes: &[i32],
        lane_of: &[u8; ACTUATORS],
        most: i32,
        words: &mut [u16; ACTUATORS],
    ) -> bool {
        // A power of two, so that no index needs to be checked.
        const ROOM: usize = 64;
        const { assert!(ROOM >= ACTUATORS && ROOM.is_power_of_two()) };
        let mut new = [ZERO_VOLT; ROOM];
        let mut lanes = lanes.iter();
        let mut next = 0;
        let mut differences = 0;
        for (word, &lane_of) in words.iter_mut().zip(lane_of) {
            let new = &mut new[usize::from(lane_of) % ROOM];
            if lane_of == next
                && let Some(lane) = lanes.next()
            {
                *new = drawn(level, self.gains_q30[0], *lane, most, *word);
                next += 1;
            }
            differences |= *new ^ *word;
            *word = *new;
        }
        differences != 0
    }

    #[inline]
    fn draw_each(
        &self,
        level: i32,
        lanes: impl Iterator<Item = i32>,
        most: i32,
        words: &mut [u16; ACTUATORS],
    ) -> bool {
        let mut differences = 0;
        for ((word, gain), lane) in words.iter_mut().zip(&self.gains_q30).zip(lanes) {
            let new = drawn(level, *gain, lane, most, *word);
            differences |= new ^ *word;
            *word = new;
        }
        differences != 0
    }
}

/// The gain in Q30, negative for the opposite voltage.
const fn gain(actuator: Actuator) -> i32 {
    let gain_q15 = if actuator.gain_q15 < UNITY_GAIN {
        actuator.gain_q15
    } else {
        UNITY_GAIN
    };
    let gain = (gain_q15 as i32) << 15;
    if actuator.inverted { -gain } else { gain }
}

/// The word of a lane.
#[inline]
fn drawn(level: i32, gain: i32, lane: i32, most: i32, before: u16) -> u16 {
    // Bits behind the point: 16 of the level and 30 of the gain, of which the upper word has 14; and
    // 28 of the lane, so 10. 0 V and the half that rounds are added to them.
    const BITS: u32 = 10;
    const ZERO_AND_HALF: i32 = ((ZERO_VOLT as i32) << BITS) + (1 << (BITS - 1));
    const { assert!(FULL <= i32::MAX as u32 && ONE == 1 << 28) };
    let peak = ((i64::from(level) * i64::from(gain)) >> 32) as i32;
    let fine = ZERO_AND_HALF + ((i64::from(peak) * i64::from(lane)) >> 32) as i32;
    let before = i32::from(before);
    let step = (fine >> BITS) - before;
    (before + step.clamp(-most, most)) as u16
}

#[cfg(test)]
mod tests {
    use protocol::actuators::DEFAULT_ACTUATORS;

    use super::*;
    use crate::sine::sine;

    const QUARTER: u32 = 1 << 30;
    const NO_LIMIT: i32 = 65_536;

    fn offsets(array: &Array, level: u32, lanes: &[i32]) -> [i32; ACTUATORS] {
        let mut words = [ZERO_VOLT; ACTUATORS];
        array.draw(level, lanes, &EACH, NO_LIMIT, &mut words);
        words.map(|word| i32::from(word) - 32_768)
    }

    #[test]
    fn full_scale_reaches_as_far_down_as_up() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        for (lane, expected) in [(ONE, 32_767), (-ONE, -32_767), (0, 0)] {
            assert_eq!(offsets(&array, FULL, &[lane]), [expected; ACTUATORS]);
            assert_eq!(
                offsets(&array, FULL, &[lane; ACTUATORS]),
                [expected; ACTUATORS]
            );
        }
    }

    #[test]
    fn each_word_is_the_exact_sine_to_half_a_step() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        for level in [FULL, FULL / 3, 12_345_678] {
            for i in 0..20_000_u32 {
                let turns = i.wrapping_mul(214_749);
                let peak = f64::from(level) / 65_536.0;
                let exact =
                    peak * (f64::from(turns) / 2_f64.powi(32) * core::f64::consts::TAU).sin();
                let word = offsets(&array, level, &[sine(turns)])[7];
                // Half a step of rounding, the sine's 6.1·10⁻⁷ of the peak, and the peak's own 2⁻¹⁴ steps.
                let bound = 0.5 + 6.1e-7 * peak + 2_f64.powi(-14);
                assert!(
                    (f64::from(word) - exact).abs() <= bound,
                    "level {level} phase {turns}: {word} {exact}"
                );
            }
        }
    }

    #[test]
    fn rounding_is_symmetric_and_moves_no_mean() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        for level in [FULL, FULL / 7] {
            let mut errors = 0.0;
            for i in 0..50_000_u32 {
                let lane = sine(i.wrapping_mul(85_899));
                let [word, opposite] = [lane, -lane].map(|lane| offsets(&array, level, &[lane])[0]);
                assert_eq!(
                    word, -opposite,
                    "what is rounded up there is rounded down here"
                );
                let exact = f64::from(lane) / f64::from(ONE) * f64::from(level) / 65_536.0;
                errors += f64::from(word) - exact;
            }
            // Independent errors of a step's width have a mean of √(1/12/n) of a step; four times that is
            // never seen.
            let mean = errors / 50_000.0;
            let most = 4.0 * (1.0_f64 / 12.0 / 50_000.0).sqrt();
            assert!(mean.abs() <= most, "{mean} steps");
        }
    }

    #[test]
    fn the_rounding_errors_of_a_cycle_add_up_to_nothing() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        // Each of 400 places of a cycle has its opposite in it.
        let sum: i32 = (0..400_u32)
            .map(|place| {
                let turns = (u64::from(place) << 32) / 400;
                offsets(&array, FULL, &[sine(turns as u32)])[0]
            })
            .sum();
        // But for a place whose sine is cut off across a border between two words: one in 2¹⁴.
        assert!(sum.abs() <= 1, "{sum} steps");
    }

    #[test]
    fn gain_and_polarity_are_each_actuators_own() {
        let mut actuators = DEFAULT_ACTUATORS;
        actuators[3].gain_q15 = UNITY_GAIN / 2;
        actuators[4].inverted = true;
        actuators[5].gain_q15 = 0;
        actuators[6].gain_q15 = u16::MAX;
        let lane = sine(QUARTER);
        for lanes in [&[lane][..], &[lane; ACTUATORS][..]] {
            let offsets = offsets(&Array::new(&actuators), 16_384 << 16, lanes);
            assert_eq!(offsets[2..8], [16_384, 8_192, -16_384, 0, 16_384, 16_384]);
        }
    }

    #[test]
    fn each_actuator_plays_the_lane_that_is_its_own() {
        let mut lane_of = [0; ACTUATORS];
        lane_of[1] = 1;
        // A fault of memory.
        lane_of[2] = 7;
        let mut unlike = DEFAULT_ACTUATORS;
        unlike[4].gain_q15 = 0;
        for (actuators, fourth) in [(DEFAULT_ACTUATORS, 32_767), (unlike, 0)] {
            let array = Array::new(&actuators);
            let mut words = [ZERO_VOLT; ACTUATORS];
            assert!(array.draw(FULL, &[ONE, -ONE], &lane_of, NO_LIMIT, &mut words));
            let offsets = words.map(|word| i32::from(word) - 32_768);
            assert_eq!(offsets[..5], [32_767, -32_767, 0, 32_767, fourth]);
            assert!(!array.draw(FULL, &[ONE, -ONE], &lane_of, NO_LIMIT, &mut words));
        }
    }

    #[test]
    fn an_inverted_actuator_gets_exactly_the_opposite_voltage() {
        let mut actuators = DEFAULT_ACTUATORS;
        actuators[1].inverted = true;
        let array = Array::new(&actuators);
        for i in 0..10_000_u32 {
            let lane = (i.wrapping_mul(429_497) as i32) >> 1;
            let offsets = offsets(&array, FULL, &[lane]);
            assert_eq!(offsets[1], -offsets[0]);
        }
    }

    #[test]
    fn no_word_goes_further_in_a_tick_than_allowed() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        let mut words = [ZERO_VOLT; ACTUATORS];
        for expected in [10_000, 20_000, 30_000, 32_767, 32_767] {
            array.draw(FULL, &[ONE], &EACH, 10_000, &mut words);
            assert_eq!(words, [ZERO_VOLT + expected; ACTUATORS]);
        }
        array.draw(FULL, &[-ONE; ACTUATORS], &EACH, 10_000, &mut words);
        assert_eq!(words, [ZERO_VOLT + 22_767; ACTUATORS]);
    }

    #[test]
    fn tells_whether_a_word_changed() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        let mut words = [ZERO_VOLT; ACTUATORS];
        let mut lanes = [0; ACTUATORS];
        let mut changed = |lanes: &[i32]| array.draw(FULL, lanes, &EACH, NO_LIMIT, &mut words);
        assert!(!changed(&lanes));
        assert!(changed(&[ONE]));
        assert!(!changed(&[ONE]));
        assert!(changed(&lanes));
        lanes[49] = ONE;
        assert!(changed(&lanes));
    }
}
