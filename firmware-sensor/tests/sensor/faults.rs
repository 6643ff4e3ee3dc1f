//! What becomes of the estimates of the whole [`firmware_sensor::Sensor`] as gauges fail and recover,
//! mains hum comes in, and settings change on the way.

use crate::felt::{Bench, CODES, PLACES_MM, texture, valid_and_worst};
use protocol::{GAUGES, GaugeHealth, Method, SensorConfiguration};
use std::f64::consts::TAU;

const DEFAULT: SensorConfiguration = SensorConfiguration::DEFAULT;

/// `texture` on all gauges but one, which says `fault` of x and s.
fn but(
    gauge: usize,
    wavelength_mm: f64,
    fault: impl Fn(f64, f64) -> f64,
) -> impl Fn(usize, f64, f64) -> f64 {
    let texture = texture(wavelength_mm);
    move |at, x_mm, t_s| {
        if at == gauge {
            fault(x_mm, t_s)
        } else {
            texture(at, x_mm, t_s)
        }
    }
}

/// A broken gauge's signal, of x in mm and s.
type Fault = fn(f64, f64) -> f64;

fn hum(t_s: f64) -> f64 {
    CODES * (TAU * 50.0 * t_s + 0.4).sin()
}

#[test]
fn one_gauges_faults_are_found_reported_left_out_and_forgiven_while_the_others_go_on() {
    let faults: [(GaugeHealth, Fault, f64, f64); 5] = [
        // At an end of the range, whether driven there or broken off. Averages over 0.3 s fall from 1 to
        // 0.1 in 0.7 s, and 0.5 s have to be without a fault.
        (GaugeHealth::Saturated, |_, _| -2_500.0, 0.1, 1.3),
        (
            GaugeHealth::Saturated,
            |x_mm, _| 20.0 * CODES * (TAU * x_mm / 2.0).sin(),
            0.1,
            1.3,
        ),
        // Own hum beside which the others have none; averages over 0.3 s.
        (GaugeHealth::Hum, |_, t_s| 2.0 * hum(t_s), 0.3, 1.5),
        // Another surface: thirty estimates that it does not fit, once the two have come apart.
        (
            GaugeHealth::Noisy,
            |x_mm, _| CODES * (TAU * x_mm / 2.9).sin(),
            0.6,
            1.0,
        ),
        // A texture's power, of noise that lies in the scans' upper half as well: thirty estimates, too.
        (
            GaugeHealth::Noisy,
            |x_mm, t_s| 1_900.0 * (1e7 * (x_mm + t_s)).sin(),
            0.4,
            2.0,
        ),
    ];
    for (which, (health, fault, found_s, well_s)) in faults.into_iter().enumerate() {
        let mut bench = Bench::new(DEFAULT);
        bench.rub(2_000, |_| 40.0, texture(2.0));
        let began_s = bench.t_s();
        let estimates = bench.rub(4_000, |_| 40.0, but(1, 2.0, fault));
        let left_out = estimates.iter().find(|e| e.health[1] != GaugeHealth::Good);
        let found = left_out.unwrap().instant_us as f64 * 1e-6 - began_s;
        assert!(found <= found_s, "{which} {health:?} after {found} s");
        let (last, others) = (estimates.last().unwrap(), [0, 2, 3, 4]);
        assert_eq!(last.health[1], health, "{which}");
        assert_eq!(last.gauges_used, 0b11101);
        for gauge in others {
            assert!(
                estimates
                    .iter()
                    .all(|e| e.health[gauge] == GaugeHealth::Good)
            );
        }
        // Valid nearly all the time, and never wrong.
        let (valid, worst) = valid_and_worst(&estimates, 2.0);
        assert!(
            valid >= 0.9 && worst < 0.03,
            "{which} {health:?}: {valid} {worst}"
        );
        let began_s = bench.t_s();
        let estimates = bench.rub(4_000, |_| 40.0, texture(2.0));
        let back = estimates.iter().find(|e| e.gauges_used == 0b11111).unwrap();
        let well = back.instant_us as f64 * 1e-6 - began_s;
        assert!(
            (0.5..=well_s).contains(&well),
            "{which} {health:?} until {well} s"
        );
        let last = estimates.last().unwrap();
        assert_eq!(last.health, [GaugeHealth::Good; GAUGES]);
        assert!(last.valid);
    }
}

#[test]
fn gauges_that_land_one_after_another_are_sound() {
    for (first, ahead_s) in
        (0..GAUGES).flat_map(|first| [0.01, 0.02, 0.03, 0.04].map(|s| (first, s)))
    {
        let mut bench = Bench::new(DEFAULT);
        bench.rub(1_000, |_| 40.0, |_, _, _| 0.0);
        let landed_s = bench.t_s();
        let texture = texture(2.0);
        let lands = |gauge, x_mm: f64, t_s: f64| {
            let at_s = landed_s + if gauge == first { 0.0 } else { ahead_s };
            if t_s < at_s {
                0.0
            } else {
                texture(gauge, x_mm, t_s) + 1_200.0 * ((at_s - t_s) / 0.1).exp()
            }
        };
        for estimate in bench.rub(2_000, |_| 40.0, lands) {
            let (health, at_us) = (estimate.health, estimate.instant_us);
            assert_eq!(
                health,
                [GaugeHealth::Good; GAUGES],
                "{first} {ahead_s} s ahead, at {at_us} us"
            );
        }
    }
}

#[test]
fn codes_that_do_not_change_for_four_millimetres_are_stood_by_no_longer() {
    for (wavelength_mm, speed_mm_s) in [(1.0, 50.0), (2.0, 60.0), (4.0, 30.0)] {
        for later_ms in (0..120).step_by(5) {
            let mut bench = Bench::new(DEFAULT);
            let speed = |t_s: f64| speed_mm_s + 10.0 * (TAU * 0.8 * t_s).sin();
            bench.rub(2_000 + later_ms, speed, texture(wavelength_mm));
            let (noise_lsb, x_mm) = (bench.noise_lsb, bench.x_mm);
            bench.noise_lsb = 0.0;
            let stuck = |gauge, _, _| texture(wavelength_mm)(gauge, x_mm, 0.0);
            let began_mm = bench.x_mm;
            while bench.x_mm < began_mm + 5.0 {
                for estimate in bench.rub(10, speed, stuck) {
                    let off =
                        f64::from(estimate.wavelength_mm.unwrap_or(0.0)) / wavelength_mm - 1.0;
                    assert!(!estimate.valid || off.abs() < 0.05, "{estimate:?}");
                }
            }
            let what = format!("{wavelength_mm} mm, {later_ms} ms later");
            for estimate in bench.rub(700, speed, stuck) {
                assert!(!estimate.valid, "{what}: {estimate:?}");
                assert_eq!(estimate.gauges_used, 0, "{what}");
            }
            // Nor does it have a hold on what comes after.
            bench.noise_lsb = noise_lsb;
            let estimates = bench.rub(1_500, speed, texture(wavelength_mm));
            let (_, worst) = valid_and_worst(&estimates, wavelength_mm);
            assert!(worst < 0.05, "{what}: {worst}");
            assert!(
                estimates[100..].iter().all(|estimate| estimate.valid),
                "{what}"
            );
        }
    }
}

#[test]
fn a_connector_that_bounces_is_left_out_at_once_and_leaves_nothing_wrong_behind() {
    // Between the signal and an end of the range, anew every 2 ms. One gauge is looked at a millisecond, and so may be seen
    // at the end late, or not at all if it is short; of five some are seen at once.
    let bounces = [
        (0b00100_u8, 0.05, 1.0),
        (0b00010, 0.05, -1.0),
        (0b11111, 0.02, 1.0),
        (0b11111, 0.05, 1.0),
        (0b11111, 0.05, -1.0),
    ];
    for (bouncing, for_s, end) in bounces {
        for later_ms in (0..50).step_by(7) {
            let mut bench = Bench::new(DEFAULT);
            bench.rub(2_000 + later_ms, |_| 50.0, texture(2.0));
            let from_s = bench.t_s();
            let felt = |gauge: usize, x_mm: f64, t_s: f64| {
                let since_s = t_s - from_s;
                // As if by chance.
                let number = (since_s / 0.002).floor();
                let is_off = (number * number * 0.618 + 0.3).fract() < 0.5;
                if bouncing >> gauge & 1 == 1 && since_s < for_s && is_off {
                    2_500.0 * end
                } else {
                    texture(2.0)(gauge, x_mm, t_s)
                }
            };
            let estimates = bench.rub(2_000, |_| 50.0, felt);
            let what = format!("{bouncing:05b} for {for_s} s, {later_ms} ms later");
            let (_, worst) = valid_and_worst(&estimates, 2.0);
            assert!(worst < 0.05, "{what}: {worst}");
            let valid = estimates.iter().filter(|e| e.valid).count();
            if bouncing.count_ones() == 1 {
                assert!(valid >= 190, "{what}: {valid}");
            } else {
                assert!(estimates[50..].iter().all(|e| e.valid), "{what}: {valid}");
            }
        }
    }
}

#[test]
fn a_gauge_that_breaks_off_is_not_taken_for_stick_and_slip() {
    for speed_mm_s in [6.0, 20.0, 50.0] {
        let mut bench = Bench::new(DEFAULT);
        bench.rub(4_000, |_| speed_mm_s, texture(2.0));
        let broken = but(1, 2.0, |_, _| -2_500.0);
        let estimates = bench.rub(1_000, |_| speed_mm_s, broken);
        let (valid, worst) = valid_and_worst(&estimates, 2.0);
        assert!(
            valid >= 0.9 && worst < 0.01,
            "{speed_mm_s} mm/s: {valid}, {worst}"
        );
    }
}

#[test]
fn one_two_three_or_four_dead_gauges_leave_the_others_as_they_are() {
    for dead in [0b00001, 0b00110, 0b11010, 0b11110, 0b01111_u8] {
        let mut bench = Bench::new(DEFAULT);
        bench.noise_lsb = 0.0;
        let texture = texture(2.0);
        let estimates = bench.rub(
            3_000,
            |_| 40.0,
            |gauge, x_mm, t_s| {
                if dead >> gauge & 1 == 1 {
                    0.0
                } else {
                    texture(gauge, x_mm, t_s)
                }
            },
        );
        let last = estimates.last().unwrap();
        assert_eq!(last.gauges_used, 0b11111 & !dead, "{dead:05b}");
        for gauge in 0..GAUGES {
            let is_dead = last.health[gauge] == GaugeHealth::Dead;
            assert_eq!(is_dead, dead >> gauge & 1 == 1, "{dead:05b}");
        }
        let (valid, worst) = valid_and_worst(&estimates[50..], 2.0);
        assert!(valid == 1.0 && worst < 0.01, "{dead:05b}: {valid} {worst}");
    }
}

#[test]
fn of_dead_gauges_alone_nothing_is_stood_by() {
    for (level, noise_lsb) in [(0.0, 0.0), (0.0, 0.5), (-2_500.0, 0.0), (2_500.0, 3.0)] {
        let mut bench = Bench::new(DEFAULT);
        bench.rub(1_000, |_| 40.0, texture(2.0));
        bench.noise_lsb = noise_lsb;
        // The kernel still holds the texture for a few waves.
        bench.rub(1_500, |_| 40.0, |_, _, _| level);
        let estimates = bench.rub(5_000, |_| 40.0, |_, _, _| level);
        assert!(estimates.iter().all(|e| !e.valid), "{level} ± {noise_lsb}");
    }
}

#[test]
fn a_surface_without_texture_has_no_wavelength_and_no_faults() {
    for noise_lsb in [0.0, 0.3, 1.0, 50.0] {
        let mut bench = Bench::new(DEFAULT);
        bench.noise_lsb = noise_lsb;
        let estimates = bench.rub(20_000, |_| 40.0, |gauge, _, _| 300.3 * (gauge as f64 - 2.0));
        for estimate in estimates {
            assert!(!estimate.valid);
            assert_eq!(estimate.health, [GaugeHealth::Good; GAUGES], "±{noise_lsb}");
        }
    }
}

#[test]
fn hum_that_all_gauges_have_does_not_disturb_once_it_is_learned() {
    for speed_mm_s in [30.0, 50.0, 70.0, 95.0, 100.0, 105.0] {
        let mut bench = Bench::new(DEFAULT);
        let texture = texture(2.0);
        let estimates = bench.rub(
            3_000,
            |_| speed_mm_s,
            |gauge, x_mm, t_s| texture(gauge, x_mm, t_s) + hum(t_s),
        );
        let (valid, worst) = valid_and_worst(&estimates[100..], 2.0);
        assert!(
            valid >= 0.95 && worst < 0.03,
            "{speed_mm_s}: {valid} {worst}"
        );
    }
}

#[test]
fn hum_alone_is_never_taken_for_a_surface() {
    for speed_mm_s in [10.0, 50.0, 100.0, 200.0] {
        let mut bench = Bench::new(DEFAULT);
        let estimates = bench.rub(5_000, |_| speed_mm_s, |_, _, t_s| hum(t_s));
        let valid = estimates.iter().filter(|e| e.valid).count();
        assert_eq!(valid, 0, "{speed_mm_s}");
    }
}

#[test]
fn a_texture_that_was_at_the_mains_frequency_is_not_taken_for_hum_afterwards() {
    for (first_mm_s, then_mm_s) in [(50.0, 60.0), (50.0, 70.0), (50.0, 30.0), (49.0, 45.0)] {
        let mut bench = Bench::new(DEFAULT);
        bench.rub(500, |_| 30.0, texture(1.0));
        let at = bench.rub(2_000, |_| first_mm_s, texture(1.0));
        let after = bench.rub(2_000, |_| then_mm_s, texture(1.0));
        for estimates in [at, after] {
            let (valid, worst) = valid_and_worst(&estimates, 1.0);
            assert!(valid >= 0.98 && worst < 0.01, "{valid} {worst}");
            let faults = estimates
                .iter()
                .filter(|e| e.health != [GaugeHealth::Good; GAUGES]);
            assert_eq!(faults.count(), 0, "{first_mm_s} and {then_mm_s} mm/s");
        }
    }
}

#[test]
fn strokes_that_pass_the_mains_frequency_again_and_again_blame_no_gauge() {
    for wavelength_mm in [0.8, 1.0, 1.5] {
        let mut bench = Bench::new(DEFAULT);
        let velocity = |t_s: f64| 100.0 * (TAU * 2.0 * t_s).sin();
        let estimates = bench.rub(5_000, velocity, texture(wavelength_mm));
        let (valid, worst) = valid_and_worst(&estimates[50..], wavelength_mm);
        assert!(
            valid >= 0.95 && worst < 0.03,
            "{wavelength_mm}: {valid} {worst}"
        );
        assert!(
            estimates
                .iter()
                .all(|e| e.health == [GaugeHealth::Good; GAUGES])
        );
    }
}

#[test]
fn a_new_configuration_on_the_way_starts_the_estimator_over_and_nothing_else() {
    let mut bench = Bench::new(DEFAULT);
    bench.noise_lsb = 0.0;
    // Gauge 1 is stuck, and known to be.
    let before = bench.rub(2_000, |_| 40.0, but(1, 2.0, |_, _| 500.0));
    assert_eq!(before.last().unwrap().gauges_used, 0b11101);
    for (method, settled_ms) in [(Method::Spectrum, 250), (Method::Crossings, 250)] {
        let configuration = SensorConfiguration {
            method,
            gauges: 0b11011,
            ..DEFAULT
        };
        bench.sensor.configure(configuration);
        assert_eq!(bench.sensor.configuration(), configuration);
        let estimates = bench.rub(1_000, |_| 40.0, but(1, 2.0, |_, _| 500.0));
        for (number, estimate) in estimates.iter().enumerate() {
            assert_eq!(estimate.health[1], GaugeHealth::Stuck, "{method:?}");
            assert_eq!(estimate.gauges_used & !0b11001, 0, "{method:?}");
            if number * 10 >= settled_ms {
                assert!(estimate.valid, "{method:?} {number}");
            }
            if estimate.valid {
                let error = estimate.wavelength_mm.unwrap() / 2.0 - 1.0;
                assert!(error.abs() < 0.03, "{method:?} {error}");
            }
        }
        // At once it knows nothing.
        assert!(!estimates[0].valid);
    }
}

#[test]
fn a_boundary_that_a_slow_fingertip_takes_seconds_for_makes_no_gauge_noisy() {
    for (from_mm, to_mm, speed_mm_s) in [(0.7, 1.0, 3.0), (1.0, 0.7, 4.0), (0.6, 0.75, 6.0)] {
        let (before, behind) = (texture(from_mm), texture(to_mm));
        let felt = |gauge: usize, x_mm: f64, t_s: f64| {
            if x_mm + PLACES_MM[gauge] < 15.0 {
                before(gauge, x_mm, t_s)
            } else {
                behind(gauge, x_mm, t_s)
            }
        };
        let mut bench = Bench::new(DEFAULT);
        let estimates = bench.rub((30e3 / speed_mm_s) as u64, |_| speed_mm_s, felt);
        let (valid, worst) = valid_and_worst(&estimates[estimates.len() * 4 / 5..], to_mm);
        assert!(valid == 1.0 && worst < 0.03, "{to_mm} mm: {valid} {worst}");
        let blamed = estimates
            .iter()
            .filter(|estimate| estimate.health != [GaugeHealth::Good; GAUGES])
            .count();
        assert_eq!(blamed, 0, "{from_mm} to {to_mm} mm at {speed_mm_s} mm/s");
    }
}
