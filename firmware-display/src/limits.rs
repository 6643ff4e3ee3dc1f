//! What may go out, whatever was computed: the words are looked at on their way, and must keep limits of
//! voltage, slew, energy and standing voltage on each channel.
//!
//! The stimulus keeps all of them by itself. What breaks one is a fault of memory or of arithmetic, and
//! the words that broke it do not go out.
//!
//! | limit | why it is not met by a stimulus that works |
//! | --- | --- |
//! | voltage: the configured amplitude | each word is within it |
//! | slew: [`MOST_SLEW_V_PER_MS`] | the stimulus never exceeds [`crate::stimulus::MOST_V_PER_MS`] |
//! | energy: a mean of V² over about 1 s, [`MOST_ENERGY_V2`] | a full sine has 12.5 V²; a hand that swings to and fro over half a wavelength makes 16.3 V² of it, and the worst one, over ±0.3 λ, 17.5 V² |
//! | standing voltage: a mean of V over about 1 s, [`MOST_STANDING_V`] | [`crate::balance`] takes a standing voltage away so that ∫V dt is within ±5 V · [`crate::balance::MOST_S`] |

use protocol::UpdateRate;

use crate::pace::{per_tick, quarters};
use crate::{ACTUATORS, ZERO_VOLT};

/// The steepest slew, in V/ms.
pub const MOST_SLEW_V_PER_MS: i32 = 10;
/// The largest mean of V², in V².
pub const MOST_ENERGY_V2: i32 = 20;
/// The largest mean of V, in V.
pub const MOST_STANDING_V: f32 = 3.5;
/// The time constant of both means, in ticks at 4 kHz, as a power of two: 1.024 s.
const MEAN_SHIFT: u32 = 12;
/// Channels whose means are looked at in a tick.
const HALF: usize = ACTUATORS / 2;
const _: () = assert!(2 * HALF == ACTUATORS);
/// Fraction bits of the mean of V.
const FRACTION: u32 = 14;
/// A lower amplitude is reached within this time.
const SETTLING_QUARTERS: u32 = quarters(250);

/// DAC steps of 10 V.
const STEPS_PER_10_V: i32 = 1 << 16;
/// The largest offset from 0 V.
const LARGEST_OFFSET: i32 = 32_767;
/// In DAC steps a quarter of a millisecond.
const MOST_SLEW: i32 = MOST_SLEW_V_PER_MS * STEPS_PER_10_V / 10 / quarters(1) as i32;
/// In squared DAC steps: below 2³¹.
const MOST_ENERGY: i32 =
    (MOST_ENERGY_V2 as i64 * STEPS_PER_10_V as i64 * STEPS_PER_10_V as i64 / 100) as i32;
/// In DAC steps of Q14.
const MOST_STANDING: i32 =
    (MOST_STANDING_V / 10.0 * (STEPS_PER_10_V as f32) * (1 << FRACTION) as f32) as i32;

/// The limit that was broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Breach {
    /// A word is further from 0 V than the amplitude.
    Voltage,
    /// A word is too far from the one before.
    Slew,
    /// A channel's V² is too large in the mean.
    Energy,
    /// A channel's V is too far from 0 V in the mean.
    Standing,
}

/// The words so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Quarters of a millisecond in a tick.
    quarters: u32,
    /// The configured amplitude, and the largest offset from 0 V allowed now, in DAC steps.
    amplitude: i32,
    allowed: i32,
    settling: u32,
    before: [u16; ACTUATORS],
    second_half: bool,
    /// Means of V² in squared steps, and of V in steps of Q14.
    energies: [i32; ACTUATORS],
    standing: [i32; ACTUATORS],
}

impl Limits {
    /// 0 V so far, and an amplitude of `amplitude_mv`, at most 5 000.
    pub const fn new(rate: UpdateRate, amplitude_mv: u16) -> Self {
        let amplitude = steps(amplitude_mv);
        Self {
            quarters: per_tick(rate),
            amplitude,
            allowed: amplitude,
            settling: 0,
            before: [ZERO_VOLT; ACTUATORS],
            second_half: false,
            energies: [0; ACTUATORS],
            standing: [0; ACTUATORS],
        }
    }

    /// Takes another amplitude; a lower one has 250 ms to be reached.
    pub const fn set(&mut self, amplitude_mv: u16) {
        let amplitude = steps(amplitude_mv);
        // What is the same, said again, puts nothing off.
        if amplitude < self.amplitude {
            self.settling = SETTLING_QUARTERS;
        }
        self.amplitude = amplitude;
        if self.amplitude > self.allowed {
            self.allowed = self.amplitude;
        }
    }

    /// Ticks last as long as at this rate from now on.
    pub const fn pace(&mut self, rate: UpdateRate) {
        self.quarters = per_tick(rate);
    }

    /// Looks at the words of a tick.
    ///
    /// # Errors
    /// The first limit that a channel broke.
    pub fn check(&mut self, words: &[u16; ACTUATORS]) -> Result<(), Breach> {
        self.settling = self.settling.saturating_sub(self.quarters);
        if self.settling == 0 {
            self.allowed = self.amplitude;
        }
        let within = self.steps_within(words) | self.means_within(words);
        let result = if within < 0 {
            Err(self.breach(words))
        } else {
            Ok(())
        };
        self.before = *words;
        result
    }

    /// Voltage and slew: negative if a channel broke either.
    fn steps_within(&self, words: &[u16; ACTUATORS]) -> i32 {
        let (allowed, most_slew) = (self.allowed, MOST_SLEW * self.quarters as i32);
        let pairs = words.iter().zip(&self.before);
        pairs.fold(0, |within, (word, before)| {
            let offset = i32::from(*word) - i32::from(ZERO_VOLT);
            let step = i32::from(*word) - i32::from(*before);
            within | room(offset, allowed) | room(step, most_slew)
        })
    }

    /// Energy and standing voltage: negative if a channel broke either. One half of the channels is looked
    /// at in this tick, the other one in the next: V² has nothing above the 500 Hz of which 1 000 looks a
    /// second would make a constant.
    fn means_within(&mut self, words: &[u16; ACTUATORS]) -> i32 {
        self.second_half = !self.second_half;
        let start = if self.second_half { HALF } else { 0 };
        let shift = MEAN_SHIFT - 1 - self.quarters.ilog2();
        let means = self.energies.iter_mut().zip(&mut self.standing);
        let half = words.iter().zip(means).skip(start).take(HALF);
        half.fold(0, |within, (word, (energy, standing))| {
            let offset = i32::from(*word) - i32::from(ZERO_VOLT);
            // Below 2³¹ each, as is what is added: both ends of the difference are.
            *energy += (offset * offset - *energy) >> shift;
            *standing += ((offset << FRACTION) - *standing) >> shift;
            within | (MOST_ENERGY - *energy) | room(*standing, MOST_STANDING)
        })
    }

    /// The first limit that one of these words breaks.
    fn breach(&self, words: &[u16; ACTUATORS]) -> Breach {
        let most_slew = MOST_SLEW * self.quarters as i32;
        let mut pairs = words.iter().zip(&self.before);
        if words
            .iter()
            .any(|word| room(i32::from(*word) - i32::from(ZERO_VOLT), self.allowed) < 0)
        {
            Breach::Voltage
        } else if pairs
            .any(|(word, before)| room(i32::from(*word) - i32::from(*before), most_slew) < 0)
        {
            Breach::Slew
        } else if self.energies.iter().any(|energy| *energy > MOST_ENERGY) {
            Breach::Energy
        } else {
            Breach::Standing
        }
    }

    /// The outputs were set to 0 V without having been asked for.
    pub const fn cleared(&mut self) {
        self.before = [ZERO_VOLT; ACTUATORS];
    }
}

/// Negative where `value` is beyond ± `most`: the signs of many of these can be looked at as one.
const fn room(value: i32, most: i32) -> i32 {
    (most - value) | (most + value)
}

/// An amplitude in DAC steps, rounded up.
const fn steps(amplitude_mv: u16) -> i32 {
    let steps = (amplitude_mv as i32 * STEPS_PER_10_V + 9_999) / 10_000;
    if steps < LARGEST_OFFSET {
        steps
    } else {
        LARGEST_OFFSET
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::*;
    use crate::balance::{Balance, Drive, MOST_S};
    use crate::sine::ONE;

    const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];
    const VOLT: f64 = 6_553.6;

    fn word(volts: f64) -> u16 {
        let offset = (volts * VOLT).round().clamp(-32_767.0, 32_767.0);
        (32_768.0 + offset) as u16
    }

    /// Plays `volts(t_s)` on channel 17 for `seconds`; when and how it broke a limit.
    fn play(rate: UpdateRate, seconds: f64, volts: impl Fn(f64) -> f64) -> Option<(f64, Breach)> {
        let mut limits = Limits::new(rate, 5_000);
        let mut words = [ZERO_VOLT; ACTUATORS];
        (0..(seconds * f64::from(rate.hz())) as u32).find_map(|tick| {
            let t_s = f64::from(tick) / f64::from(rate.hz());
            words[17] = word(volts(t_s));
            limits.check(&words).err().map(|breach| (t_s, breach))
        })
    }

    #[test]
    fn a_full_sine_of_any_frequency_played_breaks_no_limit() {
        for rate in RATES {
            for hz in [2.0, 5.0, 20.0, 35.0, 100.0, 200.0, 249.0, 250.0] {
                assert_eq!(play(rate, 10.0, |t| 5.0 * (TAU * hz * t).sin()), None);
            }
        }
    }

    #[test]
    fn a_hand_that_swings_over_half_a_wavelength_breaks_no_limit() {
        // V² of 5 sin(β sin ωt) has a mean of 25 (1 − J₀(2β))/2, 17.5 at most, at 2β = 3.83; slow
        // swings show in the mean of 1 s, by 1/√(1 + (4π f τ)²) of half its range.
        for rate in RATES {
            for hz in [1.0, 2.0, 5.0, 10.0] {
                let swing = |t: f64| 5.0 * (1.916 * (TAU * hz * t).sin()).sin();
                assert_eq!(play(rate, 20.0, swing), None, "{hz} Hz");
            }
        }
    }

    #[test]
    fn no_standing_voltage_that_is_balanced_away_breaks_the_limit() {
        // Whatever the sine is, ∫y stays within ± 5 V · MOST_S: from the one end to the other it adds no
        // more than that over the time constant to the mean, 2.8 V. The worst is met by a crest that
        // follows a trough.
        for rate in RATES {
            let mut limits = Limits::new(rate, 5_000);
            let mut worst = 0.0_f64;
            let mut balance = Balance::default();
            for tick in 0..20 * rate.hz() {
                let crest = tick / (2 * rate.hz()) % 2 == 0;
                let mut lane = [if crest { ONE - 1 } else { -ONE }];
                let drive = Drive {
                    gain: 1 << 30,
                    turn: 0,
                    most_steps: 65_536,
                    rate,
                };
                balance.remove(&mut lane, drive);
                let y = 5.0 * f64::from(lane[0]) / f64::from(ONE);
                let words = [word(y); ACTUATORS];
                // The steps of s are no hand's.
                limits.before = words;
                assert_eq!(limits.check(&words), Ok(()));
                let standing = f64::from(limits.standing[0]) / f64::from(1 << FRACTION) / VOLT;
                worst = worst.max(standing.abs());
            }
            assert!((1.0..10.0 * MOST_S / 1.024).contains(&worst), "{worst} V");
        }
    }

    #[test]
    fn a_step_beyond_the_amplitude_is_found_at_once() {
        for rate in RATES {
            for amplitude_mv in [0, 1, 1_000, 4_999, 5_000] {
                let most = steps(amplitude_mv) as u16;
                for (offset, expected) in [(most, Ok(())), (most + 1, Err(Breach::Voltage))] {
                    for channel in [0, 31, 49] {
                        let mut limits = Limits::new(rate, amplitude_mv);
                        let mut words = [ZERO_VOLT; ACTUATORS];
                        words[channel] = ZERO_VOLT - offset;
                        // Slowly reached.
                        limits.before = words;
                        assert_eq!(limits.check(&words), expected, "{amplitude_mv} mV");
                    }
                }
            }
        }
    }

    #[test]
    fn a_lower_amplitude_has_a_quarter_of_a_second_and_a_higher_one_is_allowed_at_once() {
        for rate in RATES {
            let mut limits = Limits::new(rate, 5_000);
            let high = [word(5.0); ACTUATORS];
            limits.before = high;
            limits.set(1_000);
            let settling = 250 * rate.hz() / 1_000;
            for _ in 1..settling {
                assert_eq!(limits.check(&high), Ok(()));
            }
            assert_eq!(limits.check(&high), Err(Breach::Voltage));
            limits.set(5_000);
            assert_eq!(limits.check(&high), Ok(()));
        }
    }

    #[test]
    fn a_lower_amplitude_that_is_said_again_and_again_is_due_all_the_same() {
        for rate in RATES {
            let mut limits = Limits::new(rate, 5_000);
            let high = [word(5.0); ACTUATORS];
            limits.before = high;
            let (settling, often) = (250 * rate.hz() / 1_000, 100 * rate.hz() / 1_000);
            for tick in 1..settling {
                if tick % often == 1 {
                    limits.set(1_000);
                }
                assert_eq!(limits.check(&high), Ok(()), "tick {tick}");
            }
            assert_eq!(limits.check(&high), Err(Breach::Voltage));
        }
    }

    #[test]
    fn a_step_too_far_is_found_at_once() {
        for rate in RATES {
            let most_v = f64::from(MOST_SLEW_V_PER_MS) * 1_000.0 / f64::from(rate.hz());
            for (step_v, expected) in [(most_v - 0.01, None), (most_v + 0.01, Some(Breach::Slew))] {
                let up_and_down = |t: f64| {
                    if t < 0.01 {
                        -step_v / 2.0
                    } else {
                        step_v / 2.0
                    }
                };
                let found = play(rate, 0.02, up_and_down);
                assert_eq!(found.map(|(_, breach)| breach), expected);
            }
        }
    }

    #[test]
    fn a_standing_voltage_is_found_before_it_has_done_harm() {
        // 5 V after ln(1/(1 − 3.5/5)) time constants, 4 V after ln(1/(1 − 3.5/4)).
        for rate in RATES {
            for volts in [5.0_f64, -5.0, 4.0, -4.0] {
                let expected_s = -1.024 * (1.0 - 3.5 / volts.abs()).ln();
                let ramp = |t: f64| volts * (t / 0.001).min(1.0);
                let (at_s, breach) = play(rate, 3.0, ramp).unwrap();
                assert_eq!(breach, Breach::Standing);
                assert!((at_s - expected_s).abs() < 0.005, "{volts} V: {at_s} s");
            }
        }
    }

    #[test]
    fn a_square_wave_is_found_by_its_energy() {
        // 25 V² reach 20 V² after ln 5 time constants.
        for rate in RATES {
            let square = |t: f64| (200.0 * (TAU * 20.0 * t + 0.1).sin()).clamp(-4.99, 4.99);
            let slowed = |t: f64| (40.0 * (TAU * 20.0 * t).sin()).clamp(-4.99, 4.99);
            assert_eq!(play(rate, 3.0, square).unwrap().1, Breach::Slew);
            let (at_s, breach) = play(rate, 3.0, slowed).unwrap();
            assert_eq!(breach, Breach::Energy);
            assert!((1.5..2.5).contains(&at_s), "{at_s} s");
        }
    }

    #[test]
    fn the_means_of_all_words_overflow_nothing() {
        for rate in RATES {
            for words in [[0; ACTUATORS], [u16::MAX; ACTUATORS]] {
                let mut limits = Limits::new(rate, 5_000);
                for _ in 0..50_000 {
                    let _ = limits.check(&words);
                }
                assert!(limits.energies[0] > MOST_ENERGY);
                assert!(limits.standing[0].abs() > MOST_STANDING);
            }
        }
    }

    #[test]
    fn the_first_of_several_broken_limits_is_named() {
        for rate in RATES {
            let most_v = f64::from(MOST_SLEW_V_PER_MS) * 1_000.0 / f64::from(rate.hz());
            let most = (most_v * VOLT).round() as i32;
            for (amplitude_mv, from, to, energy, expected) in [
                (0, 0, 0, MOST_ENERGY, Breach::Standing),
                (5_000, -9_000, most - 9_000, MOST_ENERGY, Breach::Standing),
                (5_000, -9_000, most - 9_000, MOST_ENERGY + 1, Breach::Energy),
                (5_000, -9_000, most - 8_999, MOST_ENERGY + 1, Breach::Slew),
                (1_000, 32_766, 32_767, MOST_ENERGY + 1, Breach::Voltage),
            ] {
                for sign in [1, -1] {
                    let at = |offset: i32| (i32::from(ZERO_VOLT) + sign * offset) as u16;
                    let mut limits = Limits::new(rate, amplitude_mv);
                    limits.energies[49] = energy;
                    limits.before[0] = at(from);
                    let mut words = [ZERO_VOLT; ACTUATORS];
                    words[0] = at(to);
                    assert_eq!(limits.breach(&words), expected, "{rate:?} {from} {to}");
                }
            }
        }
    }

    #[test]
    fn limits_that_break_together_do_not_make_up_for_each_other() {
        for rate in RATES {
            // Of two channels; of energy and standing voltage; and of all of them.
            for (channels, energetic, standing) in [
                (2, true, false),
                (2, false, true),
                (1, true, true),
                (HALF, true, true),
            ] {
                for start in [0, HALF] {
                    let mut limits = Limits::new(rate, 5_000);
                    for channel in start..start + channels {
                        limits.energies[channel] = if energetic {
                            MOST_ENERGY + 9_999_999
                        } else {
                            0
                        };
                        limits.standing[channel] = if standing {
                            -MOST_STANDING - 9_999_999
                        } else {
                            0
                        };
                    }
                    let words = [ZERO_VOLT; ACTUATORS];
                    let found = (0..2).filter(|_| limits.means_within(&words) < 0);
                    assert_eq!(found.count(), 1, "{rate:?} {channels} {start}");
                }
            }
            for offset in [9_000, 20_000] {
                let mut limits = Limits::new(rate, 1_000);
                limits.before = [ZERO_VOLT - offset; ACTUATORS];
                let mut words = limits.before;
                assert!(limits.steps_within(&words) < 0, "voltage, of all");
                words = [ZERO_VOLT + offset; ACTUATORS];
                assert!(limits.steps_within(&words) < 0, "voltage and slew, of all");
            }
        }
    }
}
