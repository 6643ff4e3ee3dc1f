//! No step is larger than the natural one: what the hand's motion makes, and the ramps that are asked for.

use std::f64::consts::{PI, TAU};

use firmware_display::balance::TIME_CONSTANT_S;
use firmware_display::stimulus::MOST_V_PER_MS;
use protocol::actuators::{DEFAULT_ACTUATORS, grid};
use protocol::{DisplayConfiguration, Mode, UpdateRate};

use crate::stimulus::rig::{FULL, MODES, OFF_V, RATES, Rig, Volts, trimmed};

/// The most that a channel changes by in a tick at full amplitude.
struct Natural {
    /// The phase's turn.
    turns: f64,
    /// What is added by gains on their way: parts of the whole.
    ramps: f64,
}

impl Natural {
    fn volts(&self, rig: &Rig) -> f64 {
        // Two points of a sine of 5 V that are so many turns apart.
        let wave = 2.0 * (PI * self.turns.min(0.5)).sin();
        // The balance takes z/τ away in a tick.
        let balance = 1.0 / (TIME_CONSTANT_S * rig.hz());
        5.0 * (wave + balance + self.ramps) + 2.0 * OFF_V
    }
}

fn largest_step(volts: &[Volts]) -> f64 {
    let steps = volts.windows(2).flat_map(|pair| {
        pair[0]
            .iter()
            .zip(pair[1])
            .map(|(before, after)| (after - before).abs())
    });
    steps.fold(0.0, f64::max)
}

fn turns(counts: i16, wavelength_mm: f64) -> f64 {
    f64::from(counts.abs()) * 0.005 / wavelength_mm
}

/// The gate's steepest step: 3/2 of an even ramp of 6 ms.
fn gate(rig: &Rig) -> f64 {
    1.5 / (0.006 * rig.hz())
}

/// An actuator's phase goes half a turn at most, in the glide's time.
fn glide(rig: &Rig, glide_ms: u16) -> f64 {
    0.5 / (f64::from(glide_ms) * 1e-3 * rig.hz())
}

#[test]
fn a_reversal_makes_none() {
    for rate in RATES {
        for mode in MODES {
            for tick in 0..40 {
                let mut rig = Rig::new(mode, rate);
                rig.follow(2.0);
                rig.rub(200 + tick, 9);
                let mut volts = rig.rub(50, 9);
                volts.extend(rig.rub(200, -9));
                let natural = Natural {
                    turns: turns(9, 2.0),
                    ramps: 0.0,
                };
                let (largest, natural) = (largest_step(&volts), natural.volts(&rig));
                assert!(largest <= natural, "{mode:?}: {largest} V, {natural} V");
                assert!(largest > 0.95 * natural, "the bound is not idle");
            }
        }
    }
}

#[test]
fn the_papers_stroke_makes_none_at_its_ends_either() {
    for rate in RATES {
        for mode in MODES {
            for place in 0..10 {
                let mut rig = Rig::new(mode, rate);
                rig.follow(2.0);
                let half_mm = 70.0 / (TAU * 0.83);
                let mut before = rig.stroke(rig.ticks(1.5), |t| {
                    f64::from(place) * 5e-4 - half_mm * (TAU * 0.83 * t).cos()
                });
                // Around a turning point, at 1.205 s, the hand is slow, and so are the voltages.
                let volts = before.drain(rig.ticks(1.185)..rig.ticks(1.225));
                let fastest_mm_s = 70.0 * (TAU * 0.83 * 0.02).sin();
                let counts = (fastest_mm_s / rig.hz() / 0.005).ceil() as i16;
                let natural = Natural {
                    turns: turns(counts, 2.0),
                    ramps: 0.0,
                };
                assert!(largest_step(&volts.collect::<Vec<_>>()) <= natural.volts(&rig));
            }
        }
    }
}

#[test]
fn a_change_of_wavelength_makes_none() {
    for rate in RATES {
        for mode in MODES {
            for (before_mm, after_mm) in
                [(2.0, 3.0), (3.0, 2.0), (1.0, 4.0), (4.0, 0.5), (2.0, 2.02)]
            {
                for tick in 0..20 {
                    let mut rig = Rig::new(mode, rate);
                    rig.follow(before_mm);
                    rig.rub(200 + tick, 9);
                    rig.follow(after_mm);
                    let volts = rig.rub(400, 9);
                    let glide = match mode {
                        Mode::Uniform => 0.0,
                        Mode::Travelling => glide(&rig, 20),
                    };
                    let natural = Natural {
                        turns: turns(9, f64::min(before_mm, after_mm)) + glide,
                        ramps: 0.0,
                    };
                    let (largest, natural) = (largest_step(&volts), natural.volts(&rig));
                    assert!(
                        largest <= natural,
                        "{mode:?} {before_mm} to {after_mm}: {largest} V, {natural} V"
                    );
                    // And after the glide the hand's alone.
                    let natural = Natural {
                        turns: turns(9, after_mm),
                        ramps: 0.0,
                    };
                    let settled = rig.ticks(0.021);
                    assert!(largest_step(&volts[settled..]) <= natural.volts(&rig));
                }
            }
        }
    }
}

#[test]
fn without_a_glide_a_change_of_wavelength_jumps_no_further_than_in_ten_milliseconds() {
    for rate in RATES {
        let configuration = DisplayConfiguration {
            mode: Mode::Travelling,
            update_rate: rate,
            glide_ms: 0,
            ..DisplayConfiguration::DEFAULT
        };
        for tick in 0..40 {
            let mut rig = Rig::with(configuration, trimmed());
            rig.follow(2.0);
            rig.rub(200 + tick, 9);
            rig.follow(3.1);
            let volts = rig.rub(400, 9);
            let natural = Natural {
                turns: turns(9, 2.0) + glide(&rig, 10),
                ramps: 0.0,
            };
            assert!(largest_step(&volts) <= natural.volts(&rig));
        }
    }
}

#[test]
fn a_stop_and_a_start_make_none_beyond_the_gates() {
    for rate in RATES {
        for mode in MODES {
            for tick in 0..60 {
                let mut rig = Rig::new(mode, rate);
                rig.follow(2.0);
                rig.rub(200, 9);
                let mut volts = rig.rub(tick, 3);
                volts.extend(rig.rub(rig.ticks(0.05), 0));
                assert!(rig.is_silent());
                let stopping = Natural {
                    turns: turns(3, 2.0),
                    ramps: 0.0,
                };
                let closing = Natural {
                    turns: 0.0,
                    ramps: gate(&rig),
                };
                // While the gate closes the hand rests.
                let most = stopping.volts(&rig).max(closing.volts(&rig));
                assert!(largest_step(&volts) <= most);
                let volts = rig.rub(rig.ticks(0.1), 9);
                let starting = Natural {
                    turns: turns(9, 2.0),
                    ramps: gate(&rig),
                };
                assert!(largest_step(&volts) <= starting.volts(&rig));
            }
        }
    }
}

#[test]
fn a_new_configuration_or_description_makes_none_beyond_the_gates_and_the_levels() {
    for update_rate in RATES {
        for tick in 0..20 {
            let base = DisplayConfiguration {
                update_rate,
                ..DisplayConfiguration::DEFAULT
            };
            let travelling = DisplayConfiguration {
                mode: Mode::Travelling,
                ..base
            };
            let quiet = DisplayConfiguration {
                amplitude_mv: 0,
                ..base
            };
            let mut rig = Rig::with(base, DEFAULT_ACTUATORS);
            rig.follow(2.0);
            let mut volts = rig.rub(300 + tick, 9);
            for (configuration, actuators) in [
                (travelling, DEFAULT_ACTUATORS),
                (travelling, trimmed()),
                (quiet, trimmed()),
                (travelling, grid(700)),
                (base, DEFAULT_ACTUATORS),
                (travelling, grid(3_000)),
            ] {
                rig.actuators = actuators;
                rig.configure(configuration);
                // Another comes while this one is waiting.
                volts.extend(rig.rub(tick, 9));
                rig.configure(configuration);
                volts.extend(rig.rub(237, 9));
            }
            let natural = Natural {
                turns: turns(9, 2.0),
                // A new amplitude is reached in 20 ms.
                ramps: gate(&rig) + 1.0 / (0.020 * rig.hz()),
            };
            let (largest, natural) = (largest_step(&volts), natural.volts(&rig));
            assert!(
                largest <= natural,
                "{update_rate:?}: {largest} V, {natural} V"
            );
            // In the end the last one is in force, as if it had always been.
            let mut other = Rig::with(travelling, grid(3_000));
            other.follow(2.0);
            other.tick(((300 + tick + 6 * (237 + tick)) * 9) as i16);
            let second = rig.ticks(3.0);
            let (ours, others) = (rig.rub(second, 9), other.rub(second, 9));
            let (ours, others) = (ours[second - 1], others[second - 1]);
            for (ours, others) in ours.iter().zip(others) {
                // Their balances differ by what they had learnt 3 s ago.
                let forgotten = 5.0 * (-3.0 / TIME_CONSTANT_S).exp();
                assert!((ours - others).abs() <= forgotten + 2.0 * OFF_V);
            }
        }
    }
}

#[test]
fn another_rate_makes_none() {
    for mode in MODES {
        for tick in 0..40 {
            let mut rig = Rig::new(mode, UpdateRate::Hz2000);
            rig.follow(2.0);
            let mut volts = rig.rub(200 + tick, 8);
            for (update_rate, counts) in [(UpdateRate::Hz4000, 4), (UpdateRate::Hz2000, 8)] {
                rig.configure(DisplayConfiguration {
                    update_rate,
                    ..rig.configuration
                });
                volts.extend(rig.rub(301, counts));
            }
            let natural = Natural {
                turns: turns(8, 2.0),
                ramps: 0.0,
            };
            // The start is the gate's.
            assert!(largest_step(&volts[30..]) <= natural.volts(&rig));
        }
    }
}

/// Counts of a hand of 80 mm/s in a tick.
fn counts(rate: UpdateRate) -> i16 {
    (80.0 / 0.005) as i16 / rate.hz() as i16
}

fn largest(volts: &[Volts]) -> f64 {
    volts
        .iter()
        .flatten()
        .fold(0.0, |most, v| v.abs().max(most))
}

#[test]
fn another_rate_changes_no_amplitude() {
    // 200 Hz are at full amplitude, 230 Hz on their way down, 470 Hz at its end.
    for wavelength_mm in [0.4, 0.348, 0.17] {
        for [from, to] in [RATES, [RATES[1], RATES[0]]] {
            for offset in 0..20 {
                let mut rig = Rig::new(Mode::Uniform, from);
                rig.follow(wavelength_mm);
                let before = rig.rub(2_000 + offset, counts(from)).split_off(1_800);
                rig.configure(DisplayConfiguration {
                    update_rate: to,
                    ..rig.configuration
                });
                // The period under way keeps its length.
                let mut after = vec![before[before.len() - 1]];
                after.extend(rig.rub(1, counts(from)));
                assert!(
                    largest_step(&after) <= f64::from(MOST_V_PER_MS) * 1e3 / f64::from(from.hz())
                );
                after.extend(rig.rub(80, counts(to)));
                let [before, after] = [largest(&before), largest(&after)];
                assert!(
                    (after - before).abs() <= 0.08 * before + 0.02,
                    "{wavelength_mm} mm, from {from:?}: {before} V, {after} V"
                );
            }
        }
    }
}

#[test]
fn another_rate_puts_no_rest_off() {
    for [from, to] in [RATES, [RATES[1], RATES[0]]] {
        for still in 0..40 {
            let mut rig = Rig::new(Mode::Uniform, from);
            rig.follow(2.0);
            rig.rub(2_017, counts(from));
            rig.rub(still, 0);
            rig.configure(DisplayConfiguration {
                update_rate: to,
                ..rig.configuration
            });
            rig.rub(1, 0);
            let mut ms = (still + 1) as f64 * 1e3 / f64::from(from.hz());
            while !rig.is_silent() {
                rig.rub(1, 0);
                ms += 1e3 / f64::from(to.hz());
                assert!(ms < 100.0, "{still}: no rest after {ms} ms");
            }
            assert!(
                ms <= 19.0 || still as f64 * 1e3 / f64::from(from.hz()) >= 18.0,
                "{still}: {ms} ms"
            );
        }
    }
}

#[test]
fn a_surface_of_another_amplitude_makes_none_beyond_the_levels() {
    for update_rate in RATES {
        for mode in MODES {
            let configuration = DisplayConfiguration {
                update_rate,
                mode,
                reference_lsb: 100,
                ..DisplayConfiguration::DEFAULT
            };
            let mut rig = Rig::with(configuration, DEFAULT_ACTUATORS);
            let mut volts = Vec::new();
            for amplitude_lsb in [100.0, 5.0, 60.0, 0.0, 1e6] {
                rig.stimulus
                    .follow(crate::stimulus::rig::wavelength(2.0), amplitude_lsb);
                volts.extend(rig.rub(211, 9));
            }
            let natural = Natural {
                turns: turns(9, 2.0),
                ramps: 1.0 / (0.020 * rig.hz()),
            };
            // The start is the gate's.
            assert!(largest_step(&volts[30..]) <= natural.volts(&rig));
        }
    }
}

#[test]
fn the_supervisors_gain_makes_none_beyond_its_own() {
    for rate in RATES {
        for mode in MODES {
            for tick in 0..20 {
                let mut rig = Rig::new(mode, rate);
                rig.follow(2.0);
                let mut volts = rig.rub(200 + tick, 9);
                let fade = rig.ticks(0.010);
                for step in (0..fade).rev().chain(0..fade) {
                    rig.gain = (u64::from(FULL) * step as u64 / fade as u64) as u32;
                    volts.extend(rig.rub(1, 9));
                    assert!(rig.gain > 0 || rig.is_silent(), "no gain is 0 V");
                }
                let natural = Natural {
                    turns: turns(9, 2.0),
                    ramps: 1.0 / fade as f64,
                };
                assert!(largest_step(&volts[30..]) <= natural.volts(&rig));
            }
        }
    }
}

#[test]
fn whatever_the_hand_and_the_supervisor_do_nothing_slews_by_more_than_eight_volts_a_millisecond() {
    for update_rate in RATES {
        for mode in MODES {
            let configuration = DisplayConfiguration {
                update_rate,
                mode,
                ..DisplayConfiguration::DEFAULT
            };
            let mut rig = Rig::with(configuration, trimmed());
            let mut random = 1_u32;
            let mut next = |below: u32| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (random >> 8) % below
            };
            let mut volts = Vec::new();
            for _ in 0..4_000 {
                rig.follow(0.1 + f64::from(next(4_000)) * 1e-3);
                rig.gain = match next(4) {
                    0 => 0,
                    1 => next(u32::MAX >> 8) << 7,
                    _ => FULL,
                };
                let fastest = 1 + next(400) as i16;
                for _ in 0..next(10) {
                    volts.extend(rig.rub(1, next(2 * fastest as u32) as i16 - fastest));
                }
            }
            let most = f64::from(MOST_V_PER_MS) / (rig.hz() / 1_000.0);
            let largest = largest_step(&volts);
            assert!(largest <= most, "{largest} V");
            assert!(largest > 0.99 * most, "the hand was wild enough");
        }
    }
    const { assert!(MOST_V_PER_MS == 8 && UpdateRate::Hz2000.hz() == 2_000) };
}
