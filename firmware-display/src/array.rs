//! The fifty actuators' gains and polarities, and the DAC words that come of them.

use protocol::actuators::{Actuator, UNITY_GAIN};

use crate::balance::ONE;
use crate::level::FULL;
use crate::{ACTUATORS, ZERO_VOLT};

/// The gains and polarities.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    gains_q31: [u32; ACTUATORS],
    /// 0, or −1 for the opposite voltage.
    flips: [i32; ACTUATORS],
    /// Whether all are alike.
    alike: bool,
}

/// What [`Array::draw`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drawn {
    /// Whether any word differs from what was there.
    pub changed: bool,
    /// Whether all words are 0 V.
    pub silent: bool,
}

impl Array {
    /// Gains, more than 1 counting as 1, and polarities of these actuators.
    pub fn new(actuators: &[Actuator; ACTUATORS]) -> Self {
        let alike = |actuator: &Actuator| {
            (gain(*actuator), flip(*actuator)) == (gain(actuators[0]), flip(actuators[0]))
        };
        Self {
            gains_q31: actuators.map(gain),
            flips: actuators.map(flip),
            alike: actuators.iter().all(alike),
        }
    }

    /// Whether gain and polarity of one actuator, of those there are, follow from its description.
    pub const fn is_of(&self, index: usize, actuator: &Actuator) -> bool {
        self.gains_q31[index] == gain(*actuator) && self.flips[index] == flip(*actuator)
    }

    /// Writes each actuator's word, 0 V + round(level · gain · polarity · its lane), but no further from
    /// what was there than `most` steps.
    ///
    /// `lanes` are within ± 1 in Q30, a single one stands for all; `level` is in Q16 DAC steps, [`FULL`] at
    /// most, so that no word is further than 32 767 steps from 0 V. Rounding is symmetric, half a step
    /// away from 0, so that it moves no mean.
    pub fn draw(
        &self,
        level: u32,
        lanes: &[i32],
        most: i32,
        words: &mut [u16; ACTUATORS],
    ) -> Drawn {
        let mut seen = Seen::default();
        if let &[lane] = lanes {
            if self.alike && words.iter().all(|word| *word == words[0]) {
                let word = self.word(0, level, lane, most, words[0]);
                seen.note(words[0], word);
                *words = [word; ACTUATORS];
            } else {
                for (actuator, word) in words.iter_mut().enumerate() {
                    let new = self.word(actuator, level, lane, most, *word);
                    seen.note(*word, new);
                    *word = new;
                }
            }
        } else {
            for ((actuator, word), lane) in words.iter_mut().enumerate().zip(lanes) {
                let new = self.word(actuator, level, *lane, most, *word);
                seen.note(*word, new);
                *word = new;
            }
        }
        seen.drawn()
    }

    #[inline]
    fn word(&self, actuator: usize, level: u32, lane: i32, most: i32, before: u16) -> u16 {
        // Q16 × Q31 is Q15 in the upper word, that and Q30 Q13.
        let peak = ((u64::from(level) * u64::from(self.gains_q31[actuator])) >> 32) as i32;
        let fine = ((i64::from(peak) * i64::from(lane) + (1 << 31)) >> 32) as i32;
        let steps = (fine + (1 << 12) + (fine >> 31)) >> 13;
        let flip = self.flips[actuator];
        let steps = (steps ^ flip) - flip;
        let before = i32::from(before) - i32::from(ZERO_VOLT);
        let steps = before + (steps - before).clamp(-most, most);
        ZERO_VOLT.wrapping_add(steps as u16)
    }
}

const fn gain(actuator: Actuator) -> u32 {
    let gain_q15 = if actuator.gain_q15 < UNITY_GAIN {
        actuator.gain_q15
    } else {
        UNITY_GAIN
    };
    (gain_q15 as u32) << 16
}

const fn flip(actuator: Actuator) -> i32 {
    -(actuator.inverted as i32)
}

const _: () = assert!(FULL >> 1 <= i32::MAX as u32 && ONE == 1 << 30);

/// Differences between words.
#[derive(Default)]
struct Seen {
    changes: u16,
    voltages: u16,
}

impl Seen {
    #[inline]
    fn note(&mut self, before: u16, after: u16) {
        self.changes |= before ^ after;
        self.voltages |= after ^ ZERO_VOLT;
    }

    const fn drawn(&self) -> Drawn {
        Drawn {
            changed: self.changes != 0,
            silent: self.voltages == 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::actuators::DEFAULT_ACTUATORS;

    use super::*;
    use crate::sine::Sine;

    const QUARTER: u32 = 1 << 30;
    const NO_LIMIT: i32 = 65_536;

    fn offsets(array: &Array, level: u32, lanes: &[i32]) -> [i32; ACTUATORS] {
        let mut words = [ZERO_VOLT; ACTUATORS];
        array.draw(level, lanes, NO_LIMIT, &mut words);
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
                let word = offsets(&array, level, &[Sine::of(turns).q30()])[7];
                // Half a step of rounding, a 2¹⁴th of one before, the sine's 2⁻¹⁸ of the peak, and the
                // peak's own 2⁻¹⁵ steps.
                let bound = 0.5 + 2_f64.powi(-14) + peak / 2_f64.powi(18) + 2_f64.powi(-15);
                assert!(
                    (f64::from(word) - exact).abs() <= bound,
                    "level {level} phase {turns}: {word} {exact}"
                );
            }
        }
    }

    #[test]
    fn rounding_moves_no_mean() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        // Every phase has its opposite: what is rounded up there is rounded down here.
        let mut errors = 0.0;
        for i in 0..50_000_u32 {
            let turns = i.wrapping_mul(85_899);
            let [here, there] = [turns, turns.wrapping_add(1 << 31)].map(|turns| {
                let lane = Sine::of(turns).q30();
                let exact = f64::from(lane) / f64::from(ONE) * f64::from(FULL) / 65_536.0;
                (f64::from(offsets(&array, FULL, &[lane])[0]), exact)
            });
            assert_eq!(here.0, -there.0);
            errors += here.0 - here.1;
        }
        // Independent errors of a step's width have a mean of √(1/12/n) of a step, four times that is
        // never seen.
        let mean = errors / 50_000.0;
        assert!(
            mean.abs() <= 4.0 * (1.0_f64 / 12.0 / 50_000.0).sqrt(),
            "{mean}"
        );
    }

    #[test]
    fn gain_and_polarity_are_each_actuators_own() {
        let mut actuators = DEFAULT_ACTUATORS;
        actuators[3].gain_q15 = UNITY_GAIN / 2;
        actuators[4].inverted = true;
        actuators[5].gain_q15 = 0;
        actuators[6].gain_q15 = u16::MAX;
        let lane = Sine::of(QUARTER).q30();
        for lanes in [&[lane][..], &[lane; ACTUATORS][..]] {
            let offsets = offsets(&Array::new(&actuators), 16_384 << 16, lanes);
            assert_eq!(offsets[2..8], [16_384, 8_192, -16_384, 0, 16_384, 16_384]);
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
            array.draw(FULL, &[ONE], 10_000, &mut words);
            assert_eq!(words, [ZERO_VOLT + expected; ACTUATORS]);
        }
        array.draw(FULL, &[-ONE; ACTUATORS], 10_000, &mut words);
        assert_eq!(words, [ZERO_VOLT + 22_767; ACTUATORS]);
    }

    #[test]
    fn tells_whether_a_word_changed_and_whether_all_are_silent() {
        let array = Array::new(&DEFAULT_ACTUATORS);
        let mut words = [ZERO_VOLT; ACTUATORS];
        let mut lanes = [0; ACTUATORS];
        let mut told = |lanes: &[i32]| {
            let drawn = array.draw(FULL, lanes, NO_LIMIT, &mut words);
            (drawn.changed, drawn.silent)
        };
        assert_eq!(told(&lanes), (false, true));
        assert_eq!(told(&[ONE]), (true, false));
        assert_eq!(told(&[ONE]), (false, false));
        assert_eq!(told(&lanes), (true, true));
        lanes[49] = ONE;
        assert_eq!(told(&lanes), (true, false));
    }
}
