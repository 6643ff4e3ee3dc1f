//! How strong the stimulus is.

use std::f64::consts::TAU;

use firmware_display::stimulus::MOST_V_PER_MS;
use protocol::actuators::DEFAULT_ACTUATORS;
use protocol::{DisplayConfiguration, Mode};

use crate::stimulus::rig::{MODES, OFF_V, RATES, Rig, corner_hz, largest};

fn peak(rig: &mut Rig, counts: i16, wavelength_mm: f64) -> f64 {
    rig.follow(wavelength_mm);
    rig.rub(rig.ticks(3.0), counts);
    let volts = rig.rub(rig.ticks(1.0), counts);
    volts.iter().map(largest).fold(0.0, f64::max)
}

#[test]
fn the_amplitude_is_the_configured_one_and_never_more() {
    for amplitude_mv in [0, 1, 1_000, 2_500, 5_000] {
        let configuration = DisplayConfiguration {
            amplitude_mv,
            ..DisplayConfiguration::DEFAULT
        };
        let mut rig = Rig::with(configuration, DEFAULT_ACTUATORS);
        let asked = f64::from(amplitude_mv) / 1_000.0;
        let peak = peak(&mut rig, 7, 2.0);
        assert!(peak <= asked + OFF_V / 2.0, "{peak} V");
        // The balance takes a part, 1 − cos atan(f₀/f).
        let taken = asked * (1.0 - (corner_hz() / 35.0).atan().cos());
        assert!(peak >= asked - taken - OFF_V, "{peak} V");
    }
}

#[test]
fn a_weaker_surface_is_played_weaker_if_asked_to() {
    let configuration = DisplayConfiguration {
        reference_lsb: 200,
        ..DisplayConfiguration::DEFAULT
    };
    for (amplitude_lsb, part) in [
        (0.0, 0.0),
        (20.0, 0.1),
        (100.0, 0.5),
        (200.0, 1.0),
        (900.0, 1.0),
    ] {
        let mut rig = Rig::with(configuration, DEFAULT_ACTUATORS);
        rig.stimulus
            .follow(crate::stimulus::rig::wavelength(2.0), amplitude_lsb);
        rig.rub(4_000, 7);
        let volts = rig.rub(400, 7);
        let peak = volts.iter().map(largest).fold(0.0, f64::max);
        assert!(
            (peak - 5.0 * part).abs() <= 5.0 * part * 2e-4 + OFF_V,
            "{peak} V"
        );
    }
}

#[test]
fn up_to_250_hz_the_whole_is_played_and_from_500_hz_nothing() {
    for rate in RATES {
        for mode in MODES {
            for (hz, part) in [
                (100.0, 1.0),
                (200.0, 1.0),
                (250.0, 1.0),
                (300.0, 0.8),
                (400.0, 0.4),
            ] {
                // 20 counts a tick, so a wavelength of 20 counts · ticks a cycle; a cycle is met at 64 of
                // its places at least, or at all of them.
                let mut rig = Rig::new(mode, rate);
                let wavelength_mm = 20.0 * 0.005 * rig.hz() / hz * 1.000_7;
                let peak = peak(&mut rig, 20, wavelength_mm);
                let hz = hz / 1.000_7;
                let part = f64::min(part, (500.0 - hz) / 250.0).max(part);
                let expected = 5.0 * part;
                assert!(
                    (peak / expected - 1.0).abs() <= 0.005,
                    "{rate:?} {hz} Hz: {peak} V, {expected} V"
                );
                // Between samples a voltage only changes as much as the wave does from sample to sample.
                assert!(TAU * hz * peak / 1_000.0 <= f64::from(MOST_V_PER_MS));
            }
            let mut rig = Rig::new(mode, rate);
            for (counts, wavelength_mm) in [(10, 0.2), (100, 0.5), (i16::MAX, 50.0)] {
                rig.follow(wavelength_mm);
                rig.rub(rig.ticks(0.2), counts);
                for _ in 0..500 {
                    rig.tick(counts);
                    assert!(rig.is_silent());
                }
            }
        }
    }
}

#[test]
fn gains_and_polarities_are_each_actuators_own() {
    let mut actuators = DEFAULT_ACTUATORS;
    actuators[7].gain_q15 = 16_384;
    actuators[17].inverted = true;
    actuators[27].gain_q15 = 0;
    for rate in RATES {
        let configuration = DisplayConfiguration {
            mode: Mode::Uniform,
            update_rate: rate,
            ..DisplayConfiguration::DEFAULT
        };
        let mut rig = Rig::with(configuration, actuators);
        rig.follow(2.0);
        for volts in rig.rub(2_000, 7) {
            assert!((volts[7] - volts[0] / 2.0).abs() <= OFF_V);
            assert_eq!(volts[17], -volts[0]);
            assert_eq!(volts[27], 0.0);
            assert_eq!(volts[49], volts[0]);
        }
    }
}

#[test]
fn equal_actuators_in_phase_get_equal_words() {
    for rate in RATES {
        let mut rig = Rig::new(Mode::Uniform, rate);
        for estimate in 0..100 {
            rig.follow(2.0 + f64::from(estimate % 7) * 0.1);
            rig.rub(20, 7);
            let words = rig.stimulus.words();
            assert!(words.iter().all(|word| *word == words[0]));
        }
    }
}
