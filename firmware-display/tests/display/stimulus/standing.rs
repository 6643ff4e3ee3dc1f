//! No channel keeps a voltage.
//!
//! A sine cut off anywhere has a mean: 5/(π f) V over a second in the worst case, 45 mV at 35 Hz. So
//! means are taken over whole cycles, or whole strokes, of about a second.

use std::f64::consts::{PI, TAU};

use firmware_display::balance::{MARGIN, MOST_S};
use protocol::actuators::DEFAULT_ACTUATORS;
use protocol::{DisplayConfiguration, Friction, Mode, UpdateRate};

use crate::stimulus::rig::{
    MODES, OFF_V, RATES, Rig, VOLT_PER_STEP, largest, means, trimmed, wavelength,
};

/// The most that may stand.
const MOST_V: f64 = 0.005;

#[test]
fn in_steady_motion_none_over_whole_cycles() {
    for rate in RATES {
        for mode in MODES {
            for (counts, lambda_counts) in [(7, 166_usize), (-7, 400), (1, 800), (23, 210)] {
                let mut rig = Rig::new(mode, rate);
                rig.follow(lambda_counts as f64 * 0.005);
                rig.rub(rig.ticks(3.0), counts);
                // As many ticks as a wavelength has counts are whole cycles.
                let window = rig.ticks(1.0).div_ceil(lambda_counts) * lambda_counts;
                for _ in 0..3 {
                    let mean = largest(&means(&rig.rub(window, counts)));
                    // What rounding leaves is less than a step.
                    assert!(mean <= OFF_V, "{rate:?} {mode:?} {lambda_counts}: {mean} V");
                    const { assert!(OFF_V < MOST_V) };
                }
            }
        }
    }
}

#[test]
fn in_the_papers_strokes_none_over_whole_strokes() {
    const STROKE_HZ: f64 = 0.83;
    let mut worst: f64 = 0.0;
    for rate in RATES {
        for mode in MODES {
            for wavelength_mm in [1.0, 2.0, 3.0] {
                let mut rig = Rig::new(mode, rate);
                rig.follow(wavelength_mm);
                let half_mm = 70.0 / (TAU * STROKE_HZ);
                let position = |t: f64| -half_mm * (TAU * STROKE_HZ * t).cos();
                let volts = rig.stroke(rig.ticks(8.0), position);
                let stroke = rig.ticks(1.0 / STROKE_HZ);
                // Wherever the stroke is taken to begin.
                for from in (rig.ticks(3.0)..volts.len() - stroke).step_by(97) {
                    let mean = largest(&means(&volts[from..from + stroke]));
                    worst = worst.max(mean);
                    assert!(
                        mean <= MOST_V,
                        "{rate:?} {mode:?} {wavelength_mm} mm: {mean} V"
                    );
                }
            }
        }
    }
    println!("strokes: {:.2} mV at most", worst * 1e3);
}

/// Of two surfaces under one stroke the second is played weaker: by its own amplitude, or by how it rubs.
#[test]
fn where_a_part_of_the_stroke_is_weaker_none_over_whole_strokes() {
    let weaken: [fn(&mut Rig, bool, f64); 2] = [
        |rig, is_weak, mm| {
            let amplitude_lsb = if is_weak { 20.0 } else { 100.0 };
            rig.stimulus.follow(wavelength(mm), amplitude_lsb);
        },
        |rig, is_weak, _| {
            let fluctuation_mn = if is_weak { 0 } else { 100 };
            rig.stimulus.rub(Some(Friction {
                mean_mn: 500,
                fluctuation_mn,
            }));
        },
    ];
    let mut worst: f64 = 0.0;
    for (rate, mode) in RATES
        .into_iter()
        .flat_map(|rate| MODES.map(|mode| (rate, mode)))
    {
        for (stroke_hz, half_mm) in [(0.8, 13.4), (0.8, 5.0), (2.0, 3.0)] {
            for wavelength_mm in [2.0, 3.0, 5.0] {
                for weaken in weaken {
                    let configuration = DisplayConfiguration {
                        mode,
                        update_rate: rate,
                        reference_lsb: 100,
                        reference_mn: 100,
                        ..DisplayConfiguration::DEFAULT
                    };
                    let mut rig = Rig::with(configuration, DEFAULT_ACTUATORS);
                    rig.follow(wavelength_mm);
                    let [stroke, estimate] = [1.0 / stroke_hz, 0.01].map(|s| rig.ticks(s));
                    let mut volts = Vec::new();
                    for tick in 0..12 * stroke {
                        let turns = (tick % stroke) as f64 / stroke as f64;
                        if tick % estimate == 0 {
                            // Over the boundary 30 ms ago.
                            let place_mm = -half_mm * (TAU * (turns - 0.03 * stroke_hz)).cos();
                            weaken(&mut rig, place_mm > 0.0, wavelength_mm);
                        }
                        let target_mm = half_mm * (1.0 - (TAU * turns).cos());
                        let counts = ((target_mm - rig.position_mm()) / 0.005).round();
                        volts.push(rig.tick(counts as i16));
                    }
                    let mean = largest(&means(&volts[volts.len() - stroke..]));
                    worst = worst.max(mean);
                    assert!(
                        mean <= MOST_V,
                        "{rate:?} {mode:?} {stroke_hz} Hz ± {half_mm} mm on {wavelength_mm} mm: {mean} V"
                    );
                }
            }
        }
    }
    println!("weaker: {:.2} mV at most", worst * 1e3);
}

#[test]
fn under_a_hand_that_wobbles_about_any_phase_none_over_whole_wobbles() {
    let mut worst: f64 = 0.0;
    for rate in RATES {
        for mode in MODES {
            for wavelength_mm in [1.0, 2.0, 4.0] {
                for swing_mm in [0.1, 0.2, 0.3] {
                    for phase in 0..8 {
                        let mut rig = Rig::new(mode, rate);
                        rig.follow(wavelength_mm);
                        rig.rest_at(f64::from(phase) / 8.0, wavelength_mm);
                        let start = rig.ticks(5.0);
                        let volts = rig.stroke(start + rig.ticks(1.0), |t| {
                            0.0024 + swing_mm * (TAU * 5.0 * t).sin()
                        });
                        let mean = largest(&means(&volts[start..]));
                        worst = worst.max(mean);
                        assert!(
                            mean <= MOST_V,
                            "{rate:?} {mode:?} {wavelength_mm} mm ± {swing_mm} mm {phase}/8: {mean} V"
                        );
                    }
                }
            }
        }
    }
    println!("wobbles: {:.2} mV at most", worst * 1e3);
}

/// Estimates scatter by 0.1 to 0.3 % (rms) at 20 dB and by 1.1 % at 0 dB. In uniform mode that moves no
/// voltage, since the phase is the integral of them all. In travelling mode the outermost actuators follow
/// each of them, 6.75 mm away, so that a wave of 35 Hz, scattered a hundred times a second, also has slow
/// parts: 2 to 3 mV at ± 0.5 %, and in proportion more beyond (10 to 12 mV at ± 2 %).
#[test]
fn while_estimates_of_the_wavelength_scatter_none() {
    for rate in RATES {
        for (mode, most_scatter) in [(Mode::Uniform, 0.02), (Mode::Travelling, 0.005)] {
            let mut rig = Rig::new(mode, rate);
            let mut volts = Vec::new();
            for estimate in 0..600 {
                // As if at random, and evenly.
                let scatter = most_scatter * f64::from(estimate * 7_919 % 41 - 20) / 20.0;
                rig.follow(2.0 * (1.0 + scatter));
                volts.extend(rig.rub(rig.ticks(0.01), 7));
            }
            // Cycles of 28.6 ms on average have no whole number in any window. One that rises and falls as
            // sin² does holds 35 of them, of which it lets less than 1/35³ pass.
            let window = rig.ticks(1.0);
            let weight = |tick: usize| 2.0 * (PI * tick as f64 / window as f64).sin().powi(2);
            let mean = (rig.ticks(3.0)..volts.len() - window)
                .step_by(37)
                .map(|from| {
                    let weighted: Vec<_> = (0..window)
                        .map(|tick| volts[from + tick].map(|volt| volt * weight(tick)))
                        .collect();
                    largest(&means(&weighted))
                })
                .fold(0.0, f64::max);
            println!("{rate:?} {mode:?}: {:.2} mV", mean * 1e3);
            assert!(mean <= MOST_V, "{rate:?} {mode:?}: {mean} V");
        }
    }
}

/// A stimulus from 5 Hz on has no mean from its first whole cycle on, wherever in the wave it begins. But a
/// charge from before, of a slower wave or of a rest, that is more than the new one has room for is worked
/// off: no more than the slower one's room, 0.17 Vs of the 11.7 Hz here, and all but a tenth in a second.
#[test]
fn a_start_and_a_change_of_wavelength_leave_little() {
    let mut worst = [0.0_f64; 2];
    for rate in RATES {
        for mode in MODES {
            for (before, after) in [(400_usize, 400_usize), (400, 800), (600, 200), (200, 210)] {
                for phase in 0..8 {
                    let mut rig = Rig::new(mode, rate);
                    let mut check = |rig: &mut Rig, lambda: usize| {
                        let volts = rig.rub(rig.ticks(2.0) + 2 * lambda, 7);
                        // The gate, or the glide, is through in 20 ms.
                        let begins = rig.ticks(0.020);
                        let window = rig.ticks(1.0) / lambda * lambda;
                        for (second, worst) in worst.iter_mut().enumerate() {
                            let from = begins + second * window;
                            let mean = largest(&means(&volts[from..from + window]));
                            *worst = worst.max(mean);
                        }
                    };
                    rig.follow(before as f64 * 0.005);
                    rig.rest_at(f64::from(phase) / 8.0, before as f64 * 0.005);
                    check(&mut rig, before);
                    rig.follow(after as f64 * 0.005);
                    check(&mut rig, after);
                }
            }
        }
    }
    println!(
        "in the first second after it {:.2} mV, in the second {:.2} mV",
        worst[0] * 1e3,
        worst[1] * 1e3
    );
    let slower_hz = 7.0 * 2_000.0 / 600.0 / 2.0;
    assert!(worst[0] <= 5.0 * MARGIN / (PI * slower_hz), "{worst:?}");
    assert!(worst[1] <= worst[0] / 10.0, "{worst:?}");
}

/// However the hand moves, starts and stops: no channel's integral of voltage leaves ± 5 V · 0.282 s, so that
/// no minute has a mean of more than 47 mV.
#[test]
fn however_the_hand_moves_the_integral_stays_bounded() {
    for rate in RATES {
        for mode in MODES {
            let configuration = DisplayConfiguration {
                mode,
                update_rate: rate,
                ..DisplayConfiguration::DEFAULT
            };
            let mut rig = Rig::with(configuration, trimmed());
            rig.follow(2.0);
            let mut integrals = [0.0; firmware_display::ACTUATORS];
            let mut random = 12_345_u32;
            for tick in 0..rig.ticks(30.0) {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // Bursts of up to 7 counts a tick, either way, half of them rests.
                let burst = (random >> 8) % 15;
                let counts = if tick / 200 % 2 == 0 {
                    burst as i16 - 7
                } else {
                    0
                };
                for (integral, volt) in integrals.iter_mut().zip(rig.tick(counts)) {
                    *integral += volt / rig.hz();
                    // Rounding a word loses half a step a tick, in either direction.
                    let rounding = VOLT_PER_STEP / 2.0 * 30.0;
                    assert!(f64::abs(*integral) <= 5.0 * MOST_S + rounding);
                }
            }
        }
    }
}

/// An encoder that jumps to and fro in each tick asks for more than 8 V/ms and does not get it: no charge is counted that
/// does not go out.
#[test]
fn of_an_encoder_that_jumps_to_and_fro_the_integral_stays_bounded() {
    let mut worst: f64 = 0.0;
    for (rate, jumps) in RATES
        .into_iter()
        .zip([[40, 70, 150, 190], [20, 35, 75, 95]])
    {
        for (actuators, jump) in [DEFAULT_ACTUATORS, trimmed()]
            .iter()
            .flat_map(|actuators| jumps.map(|jump| (actuators, jump)))
        {
            for place in [0.1, 0.375, 0.6] {
                let configuration = DisplayConfiguration {
                    update_rate: rate,
                    ..DisplayConfiguration::DEFAULT
                };
                let mut rig = Rig::with(configuration, *actuators);
                rig.follow(2.0);
                rig.rest_at(place, 2.0);
                let mut integrals = [0.0; firmware_display::ACTUATORS];
                for tick in 0..rig.ticks(15.0) {
                    let counts = if tick % 2 == 0 { jump } else { -jump };
                    for (integral, volt) in integrals.iter_mut().zip(rig.tick(counts)) {
                        *integral += volt / rig.hz();
                        worst = worst.max(integral.abs());
                    }
                }
            }
        }
    }
    println!("jumps: {worst:.3} V s at most");
    // From what the hand left on its way there to the other end.
    assert!(worst <= 2.0 * 5.0 * MOST_S, "{worst} V s");
}

/// The same as however the hand moves, while the actuators' mode, rendering, gains, polarities and models change each second, and CLR takes all to
/// 0 V now and then: no charge is forgotten.
#[test]
fn whatever_is_described_meanwhile_the_integral_stays_bounded() {
    let mut worst = 0.0_f64;
    for rate in RATES {
        for hand in [Hand::Bursts, Hand::Wobble] {
            let mut rig = Rig::new(Mode::Uniform, rate);
            rig.follow(2.0);
            let mut integrals = [0.0; firmware_display::ACTUATORS];
            let mut random = 12_345_u32;
            let mut draw = move |count: u32| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (random >> 8) % count
            };
            let second = rig.ticks(1.0);
            for tick in 0..120 * second {
                if tick % second == 0 {
                    rig.describe(&mut draw);
                } else if tick % (7 * second) == 100 {
                    rig.stimulus.silence();
                }
                let counts = match hand {
                    Hand::Bursts if tick / 200 % 2 == 0 => draw(15) as i16 - 7,
                    Hand::Bursts => 0,
                    Hand::Wobble => {
                        let target_mm = 0.5 + 0.15 * (TAU * 5.0 * tick as f64 / rig.hz()).sin();
                        ((target_mm - rig.position_mm()) / 0.005).round() as i16
                    }
                };
                for (integral, volt) in integrals.iter_mut().zip(rig.tick(counts)) {
                    *integral += volt / rig.hz();
                    worst = worst.max(integral.abs());
                }
            }
        }
    }
    println!("described anew: {worst:.3} V s at most");
    let rounding = VOLT_PER_STEP / 2.0 * 120.0;
    assert!(worst <= 5.0 * MOST_S + rounding, "{worst} V s");
}

enum Hand {
    Bursts,
    Wobble,
}

#[test]
fn the_stimulus_is_in_step_with_the_motion() {
    for rate in RATES {
        for lambda_counts in [400_usize, 40] {
            // A count a tick at 2 kHz is 5 Hz on 2 mm and 50 Hz on 0.2 mm.
            let lambda_counts = lambda_counts * rate.hz() as usize / 2_000;
            let mut rig = Rig::new(Mode::Uniform, rate);
            rig.follow(lambda_counts as f64 * 0.005);
            rig.rub(rig.ticks(4.0) / lambda_counts * lambda_counts, 1);
            let (mut sine, mut cosine) = (0.0, 0.0);
            for _ in 0..10 * lambda_counts {
                let volt = rig.tick(1)[0];
                let angle = TAU * rig.position_mm() / (lambda_counts as f64 * 0.005);
                sine += volt * angle.sin();
                cosine += volt * angle.cos();
            }
            let ahead = cosine.atan2(sine) / TAU;
            println!("{rate:?}, {lambda_counts} counts: {ahead:.6} cycles ahead");
            // Words are rounded; counts are off by half of 2⁻³² turns each.
            assert!(ahead.abs() <= 1e-4, "{ahead}");
        }
    }
    const { assert!(UpdateRate::Hz2000.hz() == 2_000) };
}
