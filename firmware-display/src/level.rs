//! How strong the stimulus is: the configured amplitude, the surface's, what it rubs like, and none where the wave would
//! be too fast to be drawn.
//!
//! A wave of more than [`FALLS_FROM_HZ`] is beyond what skin and gel follow, and 5 V of it would slew
//! by more than 8 V/ms. From there its amplitude falls linearly, to 0 at [`SILENT_FROM_HZ`]: f (500 − f)
//! falls from 250 on, so that nothing slews faster than 5 V · 2π · 250 Hz = 7.9 V/ms.

use protocol::{DisplayConfiguration, Friction, UpdateRate};

use crate::gate::OPEN;
use crate::pace::RateChange;
use crate::ticks_at;

/// The level of 5 V: the largest word above and below 0 V, in DAC steps of Q16.
pub const FULL: u32 = 32_767 << 16;
/// The frequency up to which the whole amplitude is played.
pub const FALLS_FROM_HZ: u32 = 250;
/// The frequency from which on nothing is played.
pub const SILENT_FROM_HZ: u32 = 2 * FALLS_FROM_HZ;
/// Time in which a new amplitude is reached.
pub const GLIDE_MS: u16 = 20;

/// The voltage of [`FULL`], in mV.
const FULL_MV: u32 = 5_000;
/// The frequency is averaged over so many ticks of 2 kHz, as a power of two, and as long at 4 kHz: the
/// encoder's counts are too coarse for a single tick.
const SHIFT: u32 = 3;

/// The stimulus' amplitude, on its way to what is asked for, and the wave's frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    amplitude_mv: u32,
    reference_lsb: u16,
    reference_mn: u16,
    /// The surface's, as last told.
    surface_lsb: f32,
    /// How much the force fluctuates, if it is known.
    fluctuation_mn: Option<u16>,
    /// In Q16 DAC steps, 0 to [`FULL`].
    value: u32,
    target: u32,
    per_tick: i32,
    ticks_left: u32,
    /// The wave's turn a tick, averaged, in turns / 2³².
    turn: i32,
}

impl Level {
    /// At the configured amplitude, of a surface that is not known yet.
    pub fn new(configuration: &DisplayConfiguration) -> Self {
        let mut level = Self {
            amplitude_mv: 0,
            reference_lsb: 0,
            reference_mn: 0,
            surface_lsb: 0.0,
            fluctuation_mn: None,
            value: 0,
            target: 0,
            per_tick: 0,
            ticks_left: 0,
            turn: 0,
        };
        level.configure(configuration, configuration.update_rate);
        level.settle();
        level
    }

    /// Takes amplitude and references of a checked configuration, to be reached in [`GLIDE_MS`] of ticks of `rate`, whatever
    /// its own is.
    pub fn configure(&mut self, configuration: &DisplayConfiguration, rate: UpdateRate) {
        self.amplitude_mv = u32::from(configuration.amplitude_mv).min(FULL_MV);
        self.reference_lsb = configuration.reference_lsb;
        self.reference_mn = configuration.reference_mn;
        self.aim(rate);
    }

    /// Takes the surface's amplitude in ADC steps; what is no amplitude counts as none.
    pub fn follow(&mut self, surface_lsb: f32, rate: UpdateRate) {
        self.surface_lsb = surface_lsb;
        self.aim(rate);
    }

    /// Takes how the surface rubs; None if nothing is known of it, which takes nothing away.
    pub fn rub(&mut self, friction: Option<Friction>, rate: UpdateRate) {
        self.fluctuation_mn = friction.map(|friction| friction.fluctuation_mn);
        self.aim(rate);
    }

    fn aim(&mut self, rate: UpdateRate) {
        let configured = u64::from(FULL) * u64::from(self.amplitude_mv) / u64::from(FULL_MV);
        let part = if self.reference_lsb == 0 {
            1.0
        } else {
            self.surface_lsb / f32::from(self.reference_lsb)
        };
        let part = match self.fluctuation_mn {
            Some(mn) if mn < self.reference_mn => {
                // What is no number stays none.
                let whole = if part >= 1.0 { 1.0 } else { part };
                whole * (f32::from(mn) / f32::from(self.reference_mn))
            }
            _ => part,
        };
        let target = if part >= 1.0 {
            configured as u32
        } else {
            // What is no number, or negative, is cast to 0.
            (configured as f32 * part) as u32
        };
        if target != self.target {
            self.target = target;
            self.glide(ticks_at(rate, GLIDE_MS));
        }
    }

    /// Is there after `ticks` ticks, by equal steps; nothing changes with none.
    const fn glide(&mut self, ticks: u32) {
        self.ticks_left = ticks;
        if ticks > 0 {
            self.per_tick = (self.target as i32 - self.value as i32) / ticks as i32;
        }
    }

    /// Is there at once: for when nobody feels it.
    pub const fn settle(&mut self) {
        self.value = self.target;
        self.ticks_left = 0;
    }

    /// Ticks last another time from now on.
    pub fn change_rate(&mut self, change: RateChange) {
        self.glide(change.ticks(self.ticks_left));
        // As near to 0 as a tick's own.
        self.turn = change.a_tick(self.turn).clamp(1 - (1 << 30), (1 << 30) - 1);
    }

    /// One tick in which the wave turned by `turn` / 2³² turns.
    pub fn tick(&mut self, turn: i32, rate: UpdateRate) {
        match self.ticks_left {
            0 => {}
            1 => self.settle(),
            _ => {
                self.value = self.value.wrapping_add_signed(self.per_tick);
                self.ticks_left -= 1;
            }
        }
        let shift = match rate {
            UpdateRate::Hz2000 => SHIFT,
            UpdateRate::Hz4000 => SHIFT + 1,
        };
        // Either is nearer to 0 than 2³⁰, see `Phase::advance`.
        self.turn += (turn - self.turn) >> shift;
    }

    /// The amplitude in Q16 DAC steps, 0 to [`FULL`], whatever the frequency.
    pub const fn amplitude(&self) -> u32 {
        self.value
    }

    /// What a gain in Q30 leaves of [`FULL`] at this amplitude, in Q30: all of the gain at the whole amplitude.
    pub const fn part_of_full(&self, gain: u32) -> u32 {
        // FULL is less than 2³¹ by a 2¹⁵th.
        const { assert!(FULL == (1 << 31) - (1 << 16)) };
        let missing = FULL - self.value;
        let missing = missing + (missing >> 15);
        gain - ((missing as u64 * gain as u64) >> 31) as u32
    }

    /// The wave's turn a tick, averaged over 4 ms, in turns / 2³².
    pub const fn turn(&self) -> i32 {
        self.turn
    }

    /// The gain at the wave's frequency, in Q30, 0 to [`OPEN`].
    pub const fn roll_off(&self, rate: UpdateRate) -> u32 {
        // 250 Hz is an eighth of a turn a tick at 2 kHz, a sixteenth at 4 kHz.
        const { assert!(UpdateRate::Hz2000.hz() == 8 * FALLS_FROM_HZ) };
        const { assert!(UpdateRate::Hz4000.hz() == 16 * FALLS_FROM_HZ) };
        let (falls_from, shift) = match rate {
            UpdateRate::Hz2000 => (1 << 29, 1),
            UpdateRate::Hz4000 => (1 << 28, 2),
        };
        let below_silence = (2_u32 * falls_from).saturating_sub(self.turn.unsigned_abs());
        if below_silence >= falls_from {
            OPEN
        } else {
            below_silence << shift
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];

    fn at(amplitude_mv: u16, reference_lsb: u16, surface_lsb: f32) -> u32 {
        let mut level = Level::new(&DisplayConfiguration {
            amplitude_mv,
            reference_lsb,
            ..DisplayConfiguration::DEFAULT
        });
        level.follow(surface_lsb, UpdateRate::Hz2000);
        level.settle();
        level.amplitude()
    }

    #[test]
    fn the_amplitude_is_the_configured_one_scaled_by_the_surfaces_if_asked_to() {
        assert_eq!(at(5_000, 0, 0.0), FULL);
        assert_eq!(at(2_500, 0, 77.0), FULL / 2);
        assert_eq!(at(0, 0, 77.0), 0);
        assert_eq!(at(5_000, 200, 200.0), FULL);
        assert_eq!(at(5_000, 200, 1e9), FULL);
        for odd in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(at(5_000, 200, odd), 0, "{odd}");
        }
        // An f32 has 24 bits, so half of 2⁻²³ of the value.
        assert!(at(5_000, 200, 50.0).abs_diff(FULL / 4) <= FULL >> 24);
    }

    #[test]
    fn what_rubs_less_than_the_reference_is_played_weaker_if_the_force_is_known() {
        let at = |reference_mn, fluctuation_mn: Option<u16>, surface_lsb| {
            let mut level = Level::new(&DisplayConfiguration {
                reference_lsb: 200,
                reference_mn,
                ..DisplayConfiguration::DEFAULT
            });
            level.follow(surface_lsb, UpdateRate::Hz2000);
            let friction = fluctuation_mn.map(|fluctuation_mn| Friction {
                mean_mn: 1_000,
                fluctuation_mn,
            });
            level.rub(friction, UpdateRate::Hz2000);
            level.settle();
            level.amplitude()
        };
        for surface_lsb in [200.0, 1e9] {
            assert_eq!(at(0, Some(0), surface_lsb), FULL);
            assert_eq!(at(400, None, surface_lsb), FULL);
            assert_eq!(at(400, Some(400), surface_lsb), FULL);
            assert_eq!(at(400, Some(60_000), surface_lsb), FULL);
            assert_eq!(at(400, Some(0), surface_lsb), 0);
            assert!(at(400, Some(100), surface_lsb).abs_diff(FULL / 4) <= FULL >> 23);
        }
        // Both weaken it.
        assert!(at(400, Some(100), 100.0).abs_diff(FULL / 8) <= FULL >> 23);
        assert_eq!(at(400, Some(400), f32::NAN), 0);
        assert_eq!(at(400, Some(300), f32::NAN), 0);
    }

    #[test]
    fn what_is_too_fast_to_be_drawn_is_played_weaker_and_then_not_at_all() {
        let mut level = Level::new(&DisplayConfiguration::DEFAULT);
        for rate in RATES {
            let mut gain = |hz: u32| {
                level.turn = ((u64::from(hz) << 32) / u64::from(rate.hz())) as i32;
                level.roll_off(rate)
            };
            assert_eq!(gain(FALLS_FROM_HZ), OPEN);
            assert!(gain(FALLS_FROM_HZ + 1) < OPEN);
            assert_eq!(gain(375), OPEN / 2);
            assert!(gain(SILENT_FROM_HZ - 1) > 0);
            assert_eq!(gain(SILENT_FROM_HZ), 0);
        }
    }

    #[test]
    fn a_new_amplitude_is_reached_in_twenty_milliseconds_by_equal_steps() {
        for rate in RATES {
            let configuration = DisplayConfiguration {
                update_rate: rate,
                ..DisplayConfiguration::DEFAULT
            };
            let mut level = Level::new(&configuration);
            let quieter = DisplayConfiguration {
                amplitude_mv: 1_000,
                ..configuration
            };
            level.configure(&quieter, rate);
            let ticks = ticks_at(rate, GLIDE_MS);
            for tick in 1..=ticks {
                let before = level.amplitude();
                level.tick(0, rate);
                let equal = (FULL - FULL / 5) / ticks;
                assert!(
                    (before - level.amplitude()).abs_diff(equal) <= ticks,
                    "{tick}"
                );
            }
            assert_eq!(level.amplitude(), FULL / 5);
        }
    }

    #[test]
    fn however_often_the_rate_changes_no_glide_goes_beyond_its_end() {
        let [slow, fast] = RATES;
        for every in [1, 2, 3, 5, 11] {
            for (before_mv, after_mv) in [(1_000, 0), (0, 1_000), (5_000, 1_000), (1_000, 5_000)] {
                let configuration = |amplitude_mv| DisplayConfiguration {
                    amplitude_mv,
                    ..DisplayConfiguration::DEFAULT
                };
                let mut level = Level::new(&configuration(before_mv));
                let mut rate = slow;
                level.configure(&configuration(after_mv), rate);
                let (mut before, end) = (level.amplitude(), level.target);
                let far = before.abs_diff(end);
                for tick in 1..=200 {
                    level.tick(0, rate);
                    let now = level.amplitude();
                    assert!(now.abs_diff(end) <= before.abs_diff(end), "{tick}: {now}");
                    assert!((now <= end) == (before_mv < after_mv) || now == end);
                    // A tick of 2 kHz is a fortieth of the glide.
                    assert!(now.abs_diff(before) <= far / 40 + 40, "{tick}: {now}");
                    before = now;
                    if tick % every == 0 {
                        let from = rate;
                        rate = if rate == slow { fast } else { slow };
                        level.change_rate(RateChange { from, to: rate });
                    }
                }
                assert_eq!(level.amplitude(), end);
            }
        }
    }

    #[test]
    fn a_hand_that_is_torn_to_and_fro_overflows_nothing() {
        for rate in RATES {
            let mut level = Level::new(&DisplayConfiguration::DEFAULT);
            for tick in 0..2_000 {
                let turn = (1 << 30) - 1;
                level.tick(if tick / 500 % 2 == 0 { turn } else { -turn }, rate);
                assert!(level.roll_off(rate) <= OPEN);
            }
        }
    }

    #[test]
    fn the_whole_is_played_up_to_250_hz_and_nothing_from_500_hz_on_both_ways() {
        for rate in RATES {
            const MOST: f64 = ((1 << 30) - 1) as f64;
            let gain_at = |hz: f64| {
                let mut level = Level::new(&DisplayConfiguration::DEFAULT);
                let turn = (hz / f64::from(rate.hz()) * 2_f64.powi(32)).round();
                (0..400).for_each(|_| level.tick(turn.clamp(-MOST, MOST) as i32, rate));
                f64::from(level.roll_off(rate)) / f64::from(OPEN)
            };
            for hz in [0.0, 5.0, 200.0, 249.9] {
                assert_eq!((gain_at(hz), gain_at(-hz)), (1.0, 1.0), "{hz} Hz");
            }
            for hz in [300.0, 375.0, 450.0] {
                let expected = (500.0 - hz) / 250.0;
                // The average is rounded down, by less than 2⁴ of 2²⁸.
                assert!((gain_at(hz) - expected).abs() < 1e-6, "{hz} Hz");
                assert!((gain_at(-hz) - expected).abs() < 1e-6, "{hz} Hz");
                assert!(hz * gain_at(hz) < 250.0);
            }
            for hz in [500.0, 700.0, 5_000.0] {
                // The average stops up to 2⁴ short of its end, which is not half a step of the DAC.
                assert!(gain_at(hz) * 32_767.0 < 0.5, "{hz} Hz");
            }
        }
    }
}
