//! No channel keeps a standing voltage, in which an ionic polymer gel would electrolyse.
//!
//! A sine has no mean over its cycles, but a hand that trembles about one place of the surface plays a
//! part of a cycle to and fro. So each channel's mean m is taken off, and what remains is what m is
//! learnt from: z = s − m, dm/dt = gain · z/τ. However s and the gain go on, the integral of gain · z
//! is τ times the change of m, and |m| ≤ 1: no channel's integral ever leaves ± [`TIME_CONSTANT_S`] times
//! its amplitude, and whatever repeats has none at all (but for 5 µV, a 30th of a step of the DAC, that
//! learning loses by rounding down).
//!
//! With a gain of 1 it is a first-order high-pass. A sine of f comes out ahead by atan(f₀/f), where
//! f₀ = 1/(2π τ), in size by cos of that, and with no other frequency. τ is the shortest power of two of
//! ticks that keeps 5 Hz within 0.02 cycles of the motion; it forgets 5 V to 5 mV in ln(1000) τ = 1.8 s.

use protocol::UpdateRate;

use crate::ACTUATORS;
use crate::sine::ONE;

/// τ in ticks is 2 to this at 2 kHz.
const SHIFT: u32 = 9;
/// τ, at either rate.
pub const TIME_CONSTANT_S: f64 = (1 << SHIFT) as f64 / UpdateRate::Hz2000.hz() as f64;

const _: () = assert!(UpdateRate::Hz4000.hz() == 2 * UpdateRate::Hz2000.hz());

/// Each channel's mean, as a part of its amplitude.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Balance {
    /// m in Q30; of all channels the first one's while they share a lane.
    means: [i32; ACTUATORS],
    shared: bool,
}

impl Default for Balance {
    fn default() -> Self {
        Self {
            means: [0; ACTUATORS],
            shared: true,
        }
    }
}

impl Balance {
    /// Forgets what it has learnt.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Whether one lane has stood for all channels since the balance was last cleared.
    pub const fn is_shared(&self) -> bool {
        self.shared
    }

    /// Takes its mean off each of `lanes` (Q28, within ± [`ONE`]), to within ± [`ONE`] again, and learns.
    /// `gain` (Q30, 0 to [`OPEN`]) is what they are going to be multiplied with; without it nothing is
    /// learnt. A single lane stands for all channels, and only may while [`Balance::is_shared`].
    pub fn remove(&mut self, lanes: &mut [i32], gain: u32, rate: UpdateRate) {
        if self.shared && lanes.len() > 1 {
            self.means = [self.means[0]; ACTUATORS];
            self.shared = false;
        }
        let shift = match rate {
            UpdateRate::Hz2000 => SHIFT,
            UpdateRate::Hz4000 => SHIFT + 1,
        };
        // gain/τ in Q34.
        let part = i64::from(gain >> (shift - 4));
        for (lane, mean) in lanes.iter_mut().zip(&mut self.means) {
            let rest = *lane - (*mean >> 2);
            // The mean is learnt a tick late, for which fast waves come out larger by 1/2τ.
            let rest = rest - (rest >> (shift + 1));
            // One that is still being learnt may ask for more than there is.
            let rest = rest.clamp(-ONE, ONE - 1);
            *mean += ((i64::from(rest) * part) >> 32) as i32;
            *lane = rest;
        }
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;
    use std::vec::Vec;

    use super::*;
    use crate::gate::OPEN;

    const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];

    /// What comes out of the balance for each of the ticks of `seconds`.
    fn balanced(
        rate: UpdateRate,
        seconds: f64,
        signal: impl Fn(f64) -> f64,
        gain: impl Fn(f64) -> f64,
    ) -> Vec<f64> {
        let hz = f64::from(rate.hz());
        let mut balance = Balance::default();
        (0..(seconds * hz) as u32)
            .map(|tick| {
                let t = f64::from(tick) / hz;
                let mut lane = [(signal(t) * f64::from(ONE)) as i32];
                let gain = gain(t);
                balance.remove(&mut lane, (gain * f64::from(OPEN)) as u32, rate);
                gain * f64::from(lane[0]) / f64::from(ONE)
            })
            .collect()
    }

    fn mean(samples: &[f64]) -> f64 {
        samples.iter().sum::<f64>() / samples.len() as f64
    }

    #[test]
    fn a_sine_is_ahead_by_the_arc_tangent_of_the_corner_over_its_frequency() {
        let corner_hz = 1.0 / (TAU * TIME_CONSTANT_S);
        for rate in RATES {
            for (hz, most_cycles) in [(5.0, 0.02), (50.0, 0.003)] {
                let samples = balanced(rate, 6.0, |t| (TAU * hz * t).sin(), |_| 1.0);
                let last_second = &samples[5 * rate.hz() as usize..];
                let (mut sine, mut cosine) = (0.0, 0.0);
                for (tick, sample) in last_second.iter().enumerate() {
                    let angle = TAU * hz * tick as f64 / f64::from(rate.hz());
                    sine += sample * angle.sin();
                    cosine += sample * angle.cos();
                }
                let ahead = cosine.atan2(sine) / TAU;
                let expected = (corner_hz / hz).atan() / TAU;
                // Each step is learnt from a tick later: half a tick of the mean's, which is small.
                let late = 0.5 / f64::from(rate.hz()) * corner_hz / hz * TAU * hz / TAU;
                assert!(
                    (ahead - expected).abs() <= 2.0 * late + 1e-6,
                    "{ahead} {expected}"
                );
                assert!(ahead <= most_cycles, "{hz} Hz: {ahead} cycles");
            }
        }
    }

    #[test]
    fn what_repeats_keeps_no_mean_whatever_the_gain_does_meanwhile() {
        // A wobble of 5 Hz about a place, with a gain that goes to 0 at one of its ends.
        let wobble = |t: f64| (1.0 + 0.5 * (TAU * 5.0 * t).sin()).sin();
        let gain = |t: f64| (0.5 + 0.6 * (TAU * 5.0 * t).sin()).clamp(0.0, 1.0);
        for rate in RATES {
            let samples = balanced(rate, 10.0, wobble, gain);
            let last_second = &samples[9 * rate.hz() as usize..];
            // Learning is rounded down, by less than 2⁻³⁰ a tick.
            let bound = TIME_CONSTANT_S * f64::from(rate.hz()) / 2_f64.powi(30) + 1e-7;
            assert!(mean(last_second).abs() <= bound, "{}", mean(last_second));
        }
    }

    #[test]
    fn a_standing_signal_is_forgotten_with_the_time_constant() {
        for rate in RATES {
            let samples = balanced(rate, 2.0, |_| 0.7, |_| 1.0);
            for (tick, sample) in samples.iter().enumerate() {
                let t = tick as f64 / f64::from(rate.hz());
                let expected = 0.7 * (-t / TIME_CONSTANT_S).exp();
                // (1 − 1/n)ⁿ is less than 1/e by 1/2n of it at most, and n times as many ticks as τ.
                assert!(
                    (sample - expected).abs() <= 1e-3,
                    "{t} s: {sample} {expected}"
                );
            }
        }
    }

    #[test]
    fn the_integral_never_leaves_the_time_constant_times_the_amplitude() {
        for rate in RATES {
            // The worst there is: full voltage the one way until it is forgotten, then the other.
            let samples = balanced(rate, 8.0, |t| if t < 4.0 { 1.0 } else { -1.0 }, |_| 1.0);
            let mut integral_s: f64 = 0.0;
            for sample in samples {
                integral_s += sample / f64::from(rate.hz());
                // Rounding down loses less than 2⁻³⁰ of m a tick.
                let lost_s = 8.0 * f64::from(rate.hz()) * TIME_CONSTANT_S / 2_f64.powi(30);
                assert!(integral_s.abs() <= TIME_CONSTANT_S + lost_s);
            }
        }
    }

    #[test]
    fn lanes_that_were_shared_part_from_where_they_were() {
        let mut balance = Balance::default();
        (0..100).for_each(|_| balance.remove(&mut [ONE / 2], OPEN, UpdateRate::Hz2000));
        let mut lanes = [ONE / 2; ACTUATORS];
        assert!(balance.is_shared());
        balance.remove(&mut lanes, OPEN, UpdateRate::Hz2000);
        assert!(!balance.is_shared());
        assert!(lanes.iter().all(|&lane| lane == lanes[0] && lane < ONE / 2));
    }
}
