//! The fifty actuators: where each sits, how strongly and which way round it is driven, and the DAC
//! words that come of it.

use crate::sine::Sine;
use crate::{ACTUATORS, ZERO_VOLT};

/// Actuators along the scan, x.
pub const COLUMNS: usize = 10;
/// Actuators across the scan, y.
pub const ROWS: usize = 5;

const _: () = assert!(COLUMNS * ROWS == ACTUATORS);

/// A gain of 1, in Q15.
pub const UNITY_GAIN: u16 = 1 << 15;
/// The level of 5 V, in DAC steps (10 V / 65 536) of Q16.
pub const FULL_LEVEL: u32 = 1 << 31;
/// The largest word above and below [`ZERO_VOLT`]: as far down as up, so that no mean is left.
const LARGEST_OFFSET: i32 = 32_767;

/// Which way round an actuator is wired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polarity {
    /// A positive voltage bends it towards the skin.
    #[default]
    Normal,
    /// A positive voltage bends it away from the skin: it gets the opposite voltage.
    Inverted,
}

/// What is particular to one actuator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trim {
    /// Gain in Q15, 0 to [`UNITY_GAIN`]; more counts as [`UNITY_GAIN`].
    pub gain_q15: u16,
    /// Which way round it is wired.
    pub polarity: Polarity,
}

impl Default for Trim {
    fn default() -> Self {
        Self {
            gain_q15: UNITY_GAIN,
            polarity: Polarity::Normal,
        }
    }
}

/// Where an actuator sits, from the middle of the fingertip, in µm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Along the scan.
    pub x_um: f32,
    /// Across the scan.
    pub y_um: f32,
}

/// Where `actuator` sits: counted along x first, from the lowest x and y, `pitch_um` apart.
pub const fn place(actuator: usize, pitch_um: u16) -> Place {
    let half_pitch_um = pitch_um as f32 / 2.0;
    Place {
        x_um: half_pitches_from_middle(actuator % COLUMNS, COLUMNS) as f32 * half_pitch_um,
        y_um: half_pitches_from_middle(actuator / COLUMNS, ROWS) as f32 * half_pitch_um,
    }
}

/// How far the `index`th of `count` evenly spaced places is from their middle, in half pitches: odd
/// numbers for an even count, even numbers for an odd one.
pub(crate) const fn half_pitches_from_middle(index: usize, count: usize) -> i32 {
    2 * index as i32 - (count as i32 - 1)
}

/// The actuators' gains and polarities.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    gains_q15: [u32; ACTUATORS],
    /// 0 or −1, to be combined with [`Sine::sign`].
    flips: [i32; ACTUATORS],
}

impl Array {
    /// The actuators with these trims.
    pub fn new(trims: &[Trim; ACTUATORS]) -> Self {
        Self {
            gains_q15: trims.map(|trim| u32::from(trim.gain_q15.min(UNITY_GAIN))),
            flips: trims.map(|trim| match trim.polarity {
                Polarity::Normal => 0,
                Polarity::Inverted => -1,
            }),
        }
    }

    /// Writes each actuator's word, 0 V + round(level · gain · polarity · sine of its column), and
    /// returns whether any differs from what was there. `level` is at most [`FULL_LEVEL`].
    ///
    /// Magnitudes are rounded and the sign is put on afterwards, so that rounding moves no mean; the
    /// word stays within ±32 767 of 0 V, which costs the peak of a full-scale sine half a step.
    pub fn draw(
        &self,
        level: u32,
        columns: &[Sine; COLUMNS],
        words: &mut [u16; ACTUATORS],
    ) -> bool {
        const HALF: u64 = 1 << 46;
        let mut difference = 0;
        let rows = words.chunks_exact_mut(COLUMNS);
        let gains = self.gains_q15.chunks_exact(COLUMNS);
        let flips = self.flips.chunks_exact(COLUMNS);
        for ((row, gains), flips) in rows.zip(gains).zip(flips) {
            for (((word, gain), flip), sine) in row.iter_mut().zip(gains).zip(flips).zip(columns) {
                // Q16 × Q15, back to Q16; then Q16 × Q31, rounded to whole steps.
                let peak = ((u64::from(level) * u64::from(*gain)) >> 15) as u32;
                let steps = ((u64::from(peak) * u64::from(sine.magnitude) + HALF) >> 47) as i32;
                let steps = steps.min(LARGEST_OFFSET);
                let sign = sine.sign ^ flip;
                let new = ZERO_VOLT.wrapping_add(((steps ^ sign) - sign) as u16);
                difference |= new ^ *word;
                *word = new;
            }
        }
        difference != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUARTER: u32 = 1 << 30;

    fn drawn(array: &Array, level: u32, turns: u32) -> [u16; ACTUATORS] {
        let mut words = [ZERO_VOLT; ACTUATORS];
        array.draw(level, &[Sine::of(turns); COLUMNS], &mut words);
        words
    }

    #[test]
    fn full_scale_reaches_as_far_down_as_up() {
        let array = Array::new(&[Trim::default(); ACTUATORS]);
        assert_eq!(drawn(&array, FULL_LEVEL, QUARTER), [65_535; ACTUATORS]);
        assert_eq!(drawn(&array, FULL_LEVEL, 3 * QUARTER), [1; ACTUATORS]);
        assert_eq!(drawn(&array, FULL_LEVEL, 0), [ZERO_VOLT; ACTUATORS]);
    }

    #[test]
    fn each_word_is_the_exact_sine_to_half_a_step() {
        let array = Array::new(&[Trim::default(); ACTUATORS]);
        for level in [FULL_LEVEL, FULL_LEVEL / 3, 12_345_678] {
            for i in 0..20_000_u32 {
                let turns = i.wrapping_mul(214_749);
                let peak = f64::from(level) / 65_536.0;
                let exact =
                    peak * (f64::from(turns) / 2_f64.powi(32) * core::f64::consts::TAU).sin();
                let word = f64::from(drawn(&array, level, turns)[7]) - 32_768.0;
                // Half a step of rounding, the sine's 2⁻¹⁸ of the peak, half a step lost at the top.
                let bound =
                    0.5 + peak / 2_f64.powi(18) + if exact.abs() > 32_767.0 { 0.5 } else { 0.0 };
                assert!(
                    (word - exact).abs() <= bound,
                    "level {level} phase {turns}: {word} {exact}"
                );
            }
        }
    }

    #[test]
    fn gain_and_polarity_are_each_actuators_own() {
        let mut trims = [Trim::default(); ACTUATORS];
        trims[3].gain_q15 = UNITY_GAIN / 2;
        trims[4].polarity = Polarity::Inverted;
        trims[5].gain_q15 = 0;
        trims[6].gain_q15 = u16::MAX;
        let words = drawn(&Array::new(&trims), FULL_LEVEL / 2, QUARTER);
        let offsets: std::vec::Vec<i32> = words.iter().map(|&w| i32::from(w) - 32_768).collect();
        assert_eq!(offsets[2..8], [16_384, 8_192, -16_384, 0, 16_384, 16_384]);
    }

    #[test]
    fn tells_whether_a_word_changed() {
        let array = Array::new(&[Trim::default(); ACTUATORS]);
        let mut words = [ZERO_VOLT; ACTUATORS];
        let columns = [Sine::of(QUARTER); COLUMNS];
        assert!(array.draw(FULL_LEVEL, &columns, &mut words));
        assert!(!array.draw(FULL_LEVEL, &columns, &mut words));
        assert!(array.draw(FULL_LEVEL - (2 << 16), &columns, &mut words));
    }

    #[test]
    fn places_are_centred_and_a_pitch_apart() {
        let sum = (0..ACTUATORS).fold((0.0, 0.0), |(x, y), i| {
            let place = place(i, 1_501);
            (x + place.x_um, y + place.y_um)
        });
        assert_eq!(sum, (0.0, 0.0));
        assert_eq!(
            place(0, 1_501),
            Place {
                x_um: -6_754.5,
                y_um: -3_002.0
            }
        );
        assert_eq!(
            place(49, 1_501),
            Place {
                x_um: 6_754.5,
                y_um: 3_002.0
            }
        );
        assert_eq!(place(1, 1_500).x_um - place(0, 1_500).x_um, 1_500.0);
        assert_eq!(place(10, 1_500).y_um - place(0, 1_500).y_um, 1_500.0);
    }
}
