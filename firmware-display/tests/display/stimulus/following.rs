//! The stimulus follows the hand.

use std::f64::consts::TAU;

use firmware_display::balance::TIME_CONSTANT_S;
use protocol::{DisplayConfiguration, Mode, UpdateRate};

use crate::stimulus::rig::{MODES, OFF_V, RATES, Rig, corner_hz, largest, trimmed};

#[test]
fn each_actuator_follows_the_sine_of_travel_and_place_over_wavelength() {
    for update_rate in RATES {
        for mode in MODES {
            for wavelength_mm in [0.7_f32, 1.0, 2.0, 3.0, 4.0] {
                let configuration = DisplayConfiguration {
                    mode,
                    update_rate,
                    ..DisplayConfiguration::DEFAULT
                };
                let mut rig = Rig::with(configuration, trimmed());
                rig.follow(f64::from(wavelength_mm));
                let hz = 7.0 * 0.005 * rig.hz() / f64::from(wavelength_mm);
                let opened = rig.ticks(0.006);
                for tick in 1..=4_000 {
                    let volts = rig.tick(7);
                    if tick <= opened {
                        continue;
                    }
                    let t = tick as f64 / rig.hz();
                    // The balance: f₀/f of the amplitude in steady motion, as much at the start, and what
                    // it learns in the opening gate.
                    let balance = corner_hz() / hz * (1.0 + (-t / TIME_CONSTANT_S).exp())
                        + 0.006 / TIME_CONSTANT_S * (-t / TIME_CONSTANT_S).exp();
                    for (volt, actuator) in volts.iter().zip(&rig.actuators) {
                        let place_mm = match mode {
                            Mode::Uniform => 0.0,
                            Mode::Travelling => f64::from(actuator.x_um) / 1_000.0,
                        };
                        let turns = (rig.position_mm() + place_mm) / f64::from(wavelength_mm)
                            + f64::from(actuator.phase) / 65_536.0;
                        let sign = if actuator.inverted { -5.0 } else { 5.0 };
                        let amplitude = sign * f64::from(actuator.gain_q15) / 32_768.0;
                        let exact = amplitude * (TAU * turns).sin();
                        // Counts and micrometres are off by half of 2⁻³² turns each.
                        let drift =
                            TAU * (rig.position_mm() / 0.005 + 7_000.0) * 0.5 / 2_f64.powi(32);
                        assert!(
                            (volt - exact).abs() <= amplitude.abs() * (balance + drift) + OFF_V,
                            "{mode:?} {wavelength_mm} mm tick {tick}: {volt} {exact}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn frequency_is_speed_over_wavelength_over_a_hundred_seconds() {
    // 70 mm/s over 0.83 mm and 3 mm.
    for wavelength_mm in [0.83, 3.0] {
        let mut rig = Rig::new(Mode::Uniform, UpdateRate::Hz2000);
        rig.follow(wavelength_mm);
        let ticks = rig.ticks(100.0);
        let volts = rig.rub(ticks, 7);
        let rises = volts
            .windows(2)
            .filter(|pair| pair[0][0] <= 0.0 && pair[1][0] > 0.0)
            .count();
        let cycles = ticks as f64 * 7.0 * 0.005 / wavelength_mm;
        assert!(
            (rises as f64 - cycles).abs() <= 1.0,
            "{rises} rises, {cycles} cycles"
        );
    }
}

/// The phase comes back to the bit (see `phase`); the balance, which knows nothing of directions, makes the
/// voltages differ by as much as it takes off on either way.
#[test]
fn a_reversed_stroke_plays_the_voltages_back() {
    for rate in RATES {
        for mode in MODES {
            let mut rig = Rig::new(mode, rate);
            rig.follow(2.0);
            rig.rub(rig.ticks(2.0), 7);
            let there = rig.rub(600, 7);
            let back = rig.rub(599, -7);
            let taken = 5.0 * corner_hz() / (7.0 * 0.005 * rig.hz() / 2.0);
            for (there, back) in there[..599].iter().zip(back.iter().rev()) {
                let apart: [f64; 50] = std::array::from_fn(|i| there[i] - back[i]);
                // Its own on the way there, on the way back, and what the turn leaves of both.
                assert!(
                    largest(&apart) <= 4.0 * taken + OFF_V,
                    "{}",
                    largest(&apart)
                );
            }
        }
    }
}

#[test]
fn a_pattern_that_has_settled_lies_as_the_new_wavelength_does() {
    for rate in RATES {
        let mut rig = Rig::new(Mode::Travelling, rate);
        rig.follow(2.0);
        rig.rub(rig.ticks(1.0), 9);
        rig.follow(3.0);
        rig.rub(rig.ticks(3.0), 9);
        // Actuators 0 and 2 are two pitches of 1.5 mm apart, a wavelength of 3 mm.
        for volts in rig.rub(400, 9) {
            assert!((volts[0] - volts[2]).abs() <= 2.0 * OFF_V);
            assert!((volts[0] + volts[1]).abs() <= 2.0 * OFF_V);
        }
    }
}

/// What the words were before there was anything but the sine; of surfaces that are played weaker, since their charge
/// counts volts. The hash is FNV-1a's.
#[test]
fn the_fundamentals_words_are_those_that_they_have_always_been() {
    for (reference_lsb, expected) in [(0, 0x935E_1913_D97A_4E8F), (150, 0x3DB8_B841_FF66_AB36)] {
        let mut hash = 0xCBF2_9CE4_8422_2325_u64;
        for update_rate in RATES {
            for mode in MODES {
                for actuators in [protocol::actuators::DEFAULT_ACTUATORS, trimmed()] {
                    let configuration = DisplayConfiguration {
                        mode,
                        update_rate,
                        reference_lsb,
                        ..DisplayConfiguration::DEFAULT
                    };
                    let mut rig = Rig::with(configuration, actuators);
                    for tick in 0..8_000_i32 {
                        // After 25 ms at least: no glide of 20 ms is under way any more.
                        if tick % 100 == 0 {
                            rig.follow(1.0 + f64::from(tick / 100 % 31) * 0.1);
                        }
                        rig.tick(((tick / 700) % 5 * 4 - 6 + tick % 3) as i16);
                        for word in rig.stimulus.words() {
                            for byte in word.to_le_bytes() {
                                hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3);
                            }
                        }
                    }
                }
            }
        }
        assert_eq!(hash, expected, "{hash:#x}");
    }
}

#[test]
fn the_words_do_not_depend_on_whether_they_are_worked_out_once_or_for_each() {
    // A trim of 1/65 536 turn on one actuator, which plays nothing, makes all of them distinct.
    let mut distinct = protocol::actuators::DEFAULT_ACTUATORS;
    distinct[49].phase = 1;
    for update_rate in RATES {
        let configuration = DisplayConfiguration {
            update_rate,
            ..DisplayConfiguration::DEFAULT
        };
        let mut once = Rig::with(configuration, protocol::actuators::DEFAULT_ACTUATORS);
        let mut each = Rig::with(configuration, distinct);
        once.follow(2.0);
        each.follow(2.0);
        for tick in 0..3_000 {
            let counts = (tick % 23) - 5;
            assert_eq!(once.tick(counts)[..49], each.tick(counts)[..49]);
        }
    }
}
