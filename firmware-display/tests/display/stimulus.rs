//! What the actuators get while all is well.

use core::f64::consts::TAU;

use firmware_display::array::place;
use firmware_display::{ACTUATORS, Polarity, TICK_RATE_HZ, Trim};
use protocol::{DisplayConfiguration, Mode};

use crate::rig::{FADED_IN, Rig, VOLT_PER_STEP};

const MODES: [Mode; 2] = [Mode::Uniform, Mode::Travelling];

/// What a voltage can be off by: half a step of rounding, half a step at the very top, and the
/// sine's 2⁻¹⁸ of 5 V, which is an eighth of a step.
const OFF_V: f64 = 1.125 * VOLT_PER_STEP;

/// The largest step that a hand makes which moves by `counts` in a tick: 5·2π·Δx/λ.
fn natural_step_v(counts: i16, wavelength_mm: f32) -> f64 {
    5.0 * TAU * f64::from(counts.abs()) * 0.005 / f64::from(wavelength_mm) + 2.0 * OFF_V
}

fn largest_step_v(volts: &[[f64; ACTUATORS]]) -> f64 {
    let steps = volts.windows(2).flat_map(|pair| {
        pair[0]
            .iter()
            .zip(pair[1])
            .map(|(before, after)| (after - before).abs())
    });
    steps.fold(0.0, f64::max)
}

#[test]
fn each_actuator_follows_the_sine_of_travel_and_place_over_wavelength() {
    for mode in MODES {
        for wavelength_mm in [0.7_f32, 1.0, 2.0, 3.0, 4.0] {
            let mut rig = Rig::new(mode);
            rig.tick(0);
            // At rest the phase is 0, and the fade-in ends.
            rig.rub(FADED_IN, 0, wavelength_mm);
            for tick in 1..=4_000 {
                rig.rub(1, 7, wavelength_mm);
                let x_mm = f64::from(tick) * 7.0 * 0.005;
                for (actuator, volt) in rig.volts().into_iter().enumerate() {
                    let place_mm = match mode {
                        Mode::Uniform => 0.0,
                        Mode::Travelling => f64::from(place(actuator, 1_500).x_um) / 1_000.0,
                    };
                    let exact = 5.0 * (TAU * (x_mm + place_mm) / f64::from(wavelength_mm)).sin();
                    // 28 000 counts, each off by half of 2⁻³² turns, add 0.1 mV at most.
                    let drift_v = 5.0 * TAU * f64::from(tick) * 7.0 * 0.5 / 2_f64.powi(32);
                    assert!(
                        (volt - exact).abs() <= OFF_V + drift_v + 1e-9,
                        "{mode:?} {wavelength_mm} mm tick {tick} actuator {actuator}: {volt} {exact}"
                    );
                }
            }
        }
    }
}

#[test]
fn frequency_is_speed_over_wavelength_over_a_hundred_seconds() {
    // 70 mm/s over 0.83 mm and 3 mm.
    for wavelength_mm in [0.83_f32, 3.0] {
        let mut rig = Rig::new(Mode::Uniform);
        rig.rub(FADED_IN, 0, wavelength_mm);
        let ticks = 100 * TICK_RATE_HZ as usize;
        let volts = rig.rub(ticks, 7, wavelength_mm);
        let rises = volts
            .windows(2)
            .filter(|pair| pair[0][0] <= 0.0 && pair[1][0] > 0.0)
            .count();
        let cycles = ticks as f64 * 7.0 * 0.005 / f64::from(wavelength_mm);
        // The rise at the very start lies before the first pair.
        assert!(
            (rises as f64 - cycles).abs() <= 1.0,
            "{rises} rises, {cycles} cycles"
        );
    }
}

#[test]
fn a_reversed_stroke_plays_the_samples_back_exactly() {
    for mode in MODES {
        let mut rig = Rig::new(mode);
        rig.rub(FADED_IN, 0, 2.0);
        let strokes: Vec<i16> = (0..3_000).map(|tick| tick % 23 - 5).collect();
        let mut play = |counts: i16, tick: usize| {
            if tick.is_multiple_of(20) {
                rig.estimate(2.0);
            }
            rig.tick(counts);
            *rig.display.words()
        };
        let there: Vec<_> = strokes
            .iter()
            .enumerate()
            .map(|(i, &n)| play(n, i))
            .collect();
        for i in (1..strokes.len()).rev() {
            assert_eq!(play(-strokes[i], i), there[i - 1], "{mode:?} tick {i}");
        }
    }
}

#[test]
fn a_reversal_makes_no_step_larger_than_the_hands_own() {
    for mode in MODES {
        // Reversals at 40 different phases.
        for tick in 0..40 {
            let mut rig = Rig::new(mode);
            rig.rub(FADED_IN, 0, 2.0);
            let mut volts = rig.rub(200 + tick, 9, 2.0);
            volts.extend(rig.rub(200, -9, 2.0));
            let largest = largest_step_v(&volts);
            let natural = natural_step_v(9, 2.0);
            assert!(
                largest <= natural,
                "{mode:?}: {largest} V, natural {natural} V"
            );
            assert!(largest > 0.95 * natural, "the bound is not idle");
        }
    }
}

#[test]
fn a_change_of_wavelength_makes_no_step_larger_than_the_hands_own() {
    for (before_mm, after_mm) in [(2.0, 3.0), (3.0, 2.0), (1.0, 4.0), (4.0, 0.5), (2.0, 2.02)] {
        for tick in 0..40 {
            let mut rig = Rig::new(Mode::Uniform);
            rig.rub(FADED_IN, 0, before_mm);
            let mut volts = rig.rub(200 + tick, 9, before_mm);
            volts.extend(rig.rub(400, 9, after_mm));
            let largest = largest_step_v(&volts);
            let natural = natural_step_v(9, before_mm.min(after_mm));
            assert!(
                largest <= natural,
                "{before_mm} to {after_mm}: {largest} V, {natural} V"
            );
        }
    }
}

#[test]
fn a_travelling_pattern_adds_at_most_a_quarter_to_the_hands_step_while_it_glides() {
    for (before_mm, after_mm) in [(2.0, 3.0), (3.0, 2.0), (1.0, 4.0), (4.0, 0.5), (2.0, 2.02)] {
        for tick in 0..40 {
            let mut rig = Rig::new(Mode::Travelling);
            rig.rub(FADED_IN, 0, before_mm);
            let mut volts = rig.rub(200 + tick, 9, before_mm);
            volts.extend(rig.rub(1, 9, after_mm));
            // The first step after the change is the new wavelength's and the glide's.
            let last = volts.len() - 1;
            let allowed = 1.25 * natural_step_v(9, after_mm);
            assert!(largest_step_v(&volts[last - 1..]) <= allowed);

            // The outermost column has at most half a turn per half pitch to go, nine times, at a
            // quarter of the hand's turn: 18 wavelengths.
            let glide = (18.0 * f64::from(after_mm) / 0.045).ceil() as usize;
            let gliding = rig.rub(glide, 9, after_mm);
            assert!(largest_step_v(&gliding) <= allowed);
            let settled = rig.rub(400, 9, after_mm);
            assert!(largest_step_v(&settled) <= natural_step_v(9, after_mm));
        }
    }
}

#[test]
fn a_pattern_that_has_settled_lies_as_the_new_wavelength_does() {
    let mut rig = Rig::new(Mode::Travelling);
    rig.rub(FADED_IN, 0, 2.0);
    rig.rub(2_000, 9, 2.0);
    rig.rub(2_000, 9, 3.0);
    // Actuators 0 and 2 are two pitches of 1.5 mm apart, a wavelength of 3 mm.
    let volts = rig.rub(400, 9, 3.0);
    let apart = volts
        .iter()
        .map(|volts| (volts[0] - volts[2]).abs())
        .fold(0.0, f64::max);
    assert!(apart <= 2.0 * OFF_V, "{apart} V");
    let opposite = volts
        .iter()
        .map(|volts| (volts[0] + volts[1]).abs())
        .fold(0.0, f64::max);
    assert!(opposite <= 2.0 * OFF_V, "{opposite} V");
}

#[test]
fn a_wavelength_that_changes_under_a_hand_at_rest_is_not_felt() {
    for mode in MODES {
        let mut rig = Rig::new(mode);
        rig.rub(200, 7, 2.0);
        for tick in 0..400 {
            rig.estimate(1.0 + tick as f32 * 0.01);
            assert!(!rig.tick(0));
        }
    }
}

#[test]
fn the_mean_over_whole_cycles_is_within_five_millivolts_on_each_channel() {
    for mode in MODES {
        for counts_per_wavelength in [166_usize, 200, 400, 600, 800] {
            let wavelength_mm = counts_per_wavelength as f32 * 0.005;
            let mut rig = Rig::new(mode);
            rig.rub(FADED_IN, 0, wavelength_mm);
            // 7 counts a tick: as many ticks as a wavelength has counts are 7 cycles.
            let volts = rig.rub(counts_per_wavelength, 7, wavelength_mm);
            for actuator in 0..ACTUATORS {
                let sum: f64 = volts.iter().map(|volts| volts[actuator]).sum();
                let mean_v = sum / volts.len() as f64;
                // The sine's own mean is 0; what is left is rounding.
                assert!(
                    mean_v.abs() <= OFF_V,
                    "{mode:?} {wavelength_mm} mm: {mean_v} V"
                );
                const { assert!(OFF_V < 0.005) };
            }
        }
    }
}

#[test]
fn the_amplitude_is_the_configured_one() {
    for amplitude_mv in [0, 1, 1_000, 2_500, 5_000] {
        let configuration = DisplayConfiguration {
            amplitude_mv,
            ..Default::default()
        };
        let mut rig = Rig::with(configuration);
        rig.rub(FADED_IN, 0, 2.0);
        let volts = rig.rub(400, 7, 2.0);
        let peak = volts.iter().map(|volts| volts[0]).fold(0.0, f64::max);
        assert!(
            (peak - f64::from(amplitude_mv) / 1_000.0).abs() <= OFF_V,
            "{peak} V"
        );
    }
}

#[test]
fn an_inverted_actuator_gets_the_opposite_voltage() {
    let mut rig = Rig::new(Mode::Uniform);
    let mut trims = [Trim::default(); ACTUATORS];
    trims[17].polarity = Polarity::Inverted;
    rig.display.trim(&trims);
    rig.rub(FADED_IN, 0, 2.0);
    for volts in rig.rub(400, 7, 2.0) {
        assert_eq!(volts[17], -volts[16]);
    }
}

#[test]
fn a_new_configuration_makes_no_jump() {
    let quiet = DisplayConfiguration {
        amplitude_mv: 0,
        ..Default::default()
    };
    let loud = DisplayConfiguration {
        mode: Mode::Travelling,
        ..Default::default()
    };
    let mut rig = Rig::with(quiet);
    let mut volts = rig.rub(200, 9, 2.0);
    for configuration in [loud, quiet, Default::default(), loud] {
        rig.display.configure(configuration);
        assert_eq!(rig.display.configuration(), configuration);
        volts.extend(rig.rub(237, 9, 2.0));
    }
    // The hand's, the gliding pattern's quarter, and 5 V in 40 ticks.
    let allowed = 1.25 * natural_step_v(9, 2.0) + 5.0 / 40.0;
    assert!(largest_step_v(&volts) <= allowed);
    assert!(
        volts.iter().any(|volts| volts[0] > 4.9),
        "the loud one was heard"
    );
}
