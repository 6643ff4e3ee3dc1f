//! The whole [`Sensor`] on synthetic signals: ADC codes and encoder counts in, estimates out.

use std::f64::consts::{PI, TAU};

use crate::felt::{Bench, CODES, GAINS, PHASES_RAD, PLACES_MM, texture, valid_and_worst};
use firmware_sensor::counting::predicted_mean_mm;
use firmware_sensor::texture::Surface;
use firmware_sensor::{
    Drive, ESTIMATE_RATE_HZ, MICROMETRES_PER_COUNT, MID_RAIL_CODE, Output, SCAN_RATE_HZ,
    SCANS_PER_SAMPLE, Scan, Sensor,
};
use protocol::{
    ArmState, Estimate, GAUGE_BLOCK, Gauges, Method, Motion, Range, SensorConfiguration,
    StreamGauges, Trip,
};

const WINDOW_S: f64 = 0.08;
/// The codes that a gauge swings from mid-rail, and how far its rest may be off.
const SWING: f64 = 600.0;
const OFFSETS: [f64; 6] = [0.0, 31.0, -240.0, 5.0, 90.0, 0.0];

/// A trapezoidal grating's signal, fundamental 1, at place x in wavelengths.
fn grating(x: f64) -> f64 {
    [1.0, 3.0, 5.0]
        .map(|k: f64| (k * 0.1 * PI).sin() / (0.1 * PI * k * k) * (2.0 * PI * k * x).sin())
        .iter()
        .sum()
}

/// The sensor on a grating of `wavelength_mm`, moved along `position_mm` of time in s, for `duration_s`.
fn rub(
    sensor: &mut Sensor,
    duration_s: f64,
    wavelength_mm: f64,
    position_mm: impl Fn(f64) -> f64,
) -> Vec<Output> {
    rub_waves(sensor, duration_s, |mm| mm / wavelength_mm, position_mm)
}

/// The same on a surface with `waves_at` waves from 0 to a place in mm.
fn rub_waves(
    sensor: &mut Sensor,
    duration_s: f64,
    waves_at: impl Fn(f64) -> f64,
    position_mm: impl Fn(f64) -> f64,
) -> Vec<Output> {
    let scan = |number: u64| -> Scan {
        let x = waves_at(position_mm(number as f64 / f64::from(SCAN_RATE_HZ)));
        std::array::from_fn(|channel| {
            let swing = SWING * grating(x + 0.137 * channel as f64);
            (f64::from(MID_RAIL_CODE) + OFFSETS[channel] + swing).floor() as u16
        })
    };
    (0..(duration_s * 1_000.0) as u64)
        .map(|ms| {
            let last = (ms + 1) * SCANS_PER_SAMPLE as u64 - 1;
            let scans =
                std::array::from_fn(|i| scan(last + 1 + i as u64 - SCANS_PER_SAMPLE as u64));
            let position_um = 1_000.0 * position_mm(last as f64 / f64::from(SCAN_RATE_HZ));
            // The sum keeps positions on a count's edge from falling to either side of it.
            let counts = ((position_um + 1e-6) / f64::from(MICROMETRES_PER_COUNT)).floor() as i64;
            sensor.step((ms + 1) * 1_000, &scans, counts as u16)
        })
        .collect()
}

fn estimates(outputs: &[Output]) -> Vec<Estimate> {
    outputs
        .iter()
        .filter_map(|output| output.estimate)
        .collect()
}

/// The paper's method.
const COUNTING: SensorConfiguration = SensorConfiguration {
    method: Method::Counting,
    ..SensorConfiguration::DEFAULT
};

fn counting_sensor() -> Sensor {
    Sensor::new(COUNTING)
}

#[test]
fn every_cell_of_table_1_is_where_quantisation_puts_it() {
    for speed_mm_s in [30.0, 50.0, 70.0] {
        for wavelength_mm in [1.0, 2.0, 3.0, 4.0] {
            for gauge in 0..5 {
                let mut sensor = Sensor::new(SensorConfiguration {
                    counted_gauge: gauge,
                    ..COUNTING
                });
                let outputs = rub(&mut sensor, 2.5, wavelength_mm, |t_s| speed_mm_s * t_s);
                let settled = &estimates(&outputs)[50..];
                assert_eq!(settled.len(), 200);
                assert!(settled.iter().all(|estimate| estimate.valid));
                let sum: f64 = settled
                    .iter()
                    .filter_map(|estimate| estimate.wavelength_mm)
                    .map(f64::from)
                    .sum();
                let got = sum / 200.0;
                let want = predicted_mean_mm(wavelength_mm, speed_mm_s, WINDOW_S);
                assert!(
                    (got - want).abs() <= 0.03,
                    "{got} is not {want} at {speed_mm_s} mm/s on {wavelength_mm} mm, gauge {gauge}"
                );
            }
        }
    }
}

#[test]
fn every_estimate_has_the_arms_velocity_and_the_papers_count_beside_its_own() {
    // There and back, 50 mm/s each way.
    let there_and_back = |t_s: f64| 50.0 * (2.0 - (2.0 - t_s).abs());
    let mut sensor = Sensor::new(SensorConfiguration::DEFAULT);
    let estimates = estimates(&rub(&mut sensor, 4.0, 2.0, there_and_back));
    for (turn_s, velocity_um_s) in [(1.0, 50_000), (3.0, -50_000)] {
        let at = (turn_s * f64::from(ESTIMATE_RATE_HZ)) as usize;
        for estimate in &estimates[at - 40..at + 60] {
            assert_eq!(estimate.velocity_um_s, velocity_um_s);
            // Four crossings a window of 4 mm, and five now and then.
            let counted = estimate.counted_mm.expect("it counts");
            assert!((1.59..2.01).contains(&counted), "{counted} mm");
            let own = estimate.wavelength_mm.expect("a wavelength");
            assert!((own - 2.0).abs() < 0.02, "{own} mm");
        }
    }
}

#[test]
fn a_single_estimate_is_one_of_the_two_counts_that_fit() {
    // 30 mm/s on 3 mm: 1.6 crossings a window, so λe is 4.8 mm or 2.4 mm, and the speed 1 % off at most.
    let outputs = rub(&mut counting_sensor(), 2.5, 3.0, |t_s| 30.0 * t_s);
    for estimate in &estimates(&outputs)[50..] {
        let got = f64::from(estimate.wavelength_mm.unwrap_or(f32::NAN));
        let fits = |want: f64| (got / want - 1.0).abs() <= 0.0105;
        assert!(fits(4.8) || fits(2.4), "{got}");
    }
}

#[test]
fn estimates_come_at_100_hz_numbered_from_0() {
    let outputs = rub(&mut counting_sensor(), 1.0, 2.0, |t_s| 50.0 * t_s);
    let estimates = estimates(&outputs);
    assert_eq!(estimates.len(), ESTIMATE_RATE_HZ as usize);
    for (number, estimate) in estimates.iter().enumerate() {
        assert_eq!(estimate.sequence as usize, number);
        assert_eq!(estimate.instant_us, (number as u64 + 1) * 10_000);
        assert_eq!(estimate.gauges_used, 1 << 2);
    }
}

#[test]
fn nothing_is_valid_before_the_filters_have_settled_and_a_window_is_full() {
    let outputs = rub(&mut counting_sensor(), 1.0, 2.0, |t_s| 50.0 * t_s);
    let estimates = estimates(&outputs);
    // 135 ms of settling and 80 ms of window.
    for estimate in &estimates {
        let full = estimate.instant_us >= 215_000;
        assert_eq!(estimate.valid, full, "at {} µs", estimate.instant_us);
        assert_eq!(
            estimate.wavelength_mm.is_some(),
            full,
            "at {} µs",
            estimate.instant_us
        );
    }
}

#[test]
fn a_new_configuration_is_counted_for_a_whole_window_first() {
    let mut sensor = counting_sensor();
    rub(&mut sensor, 1.0, 2.0, |t_s| 50.0 * t_s);
    let configuration = SensorConfiguration {
        window_ms: 120,
        counted_gauge: 4,
        ..COUNTING
    };
    sensor.configure(configuration);
    assert_eq!(sensor.configuration(), configuration);
    let outputs = rub(&mut sensor, 1.0, 2.0, |t_s| 50.0 * (t_s + 1.0));
    // Another gauge's band-pass settles for 135 ms, then the window fills for 120 ms.
    for (number, estimate) in estimates(&outputs).iter().enumerate() {
        assert_eq!(estimate.sequence as usize, 100 + number);
        assert_eq!(estimate.gauges_used, 1 << 4);
        assert_eq!(
            estimate.wavelength_mm.is_some(),
            number >= 25,
            "number {number}"
        );
        if number >= 25 {
            // 50 mm/s on 2 mm: 6 crossings in every window.
            assert_eq!(estimate.wavelength_mm, Some(2.0));
            assert_eq!(estimate.confidence, 1.0 - 1.0 / 6.0);
        }
    }
}

#[test]
fn a_resting_sensor_has_no_valid_estimate() {
    let outputs = rub(&mut counting_sensor(), 1.0, 2.0, |_| 0.3);
    for estimate in estimates(&outputs) {
        assert!(!estimate.valid);
        assert_eq!(estimate.wavelength_mm, None);
        assert_eq!(estimate.confidence, 0.0);
        // A constant is no step: not even the filters' start shows.
        assert!(estimate.amplitude_lsb < 0.01, "{}", estimate.amplitude_lsb);
    }
}

#[test]
fn a_gauge_that_falls_silent_has_no_valid_estimate_once_the_filters_have_rung_out() {
    let mut sensor = counting_sensor();
    rub(&mut sensor, 1.0, 2.0, |t_s| 50.0 * t_s);
    let silent = [[MID_RAIL_CODE + 40; 6]; SCANS_PER_SAMPLE];
    // 50 mm/s are 10 counts a millisecond.
    let estimates: Vec<Estimate> = (1..=3_000_u16)
        .filter_map(|ms| {
            let encoder = 10_000_u16.wrapping_add(10 * ms);
            sensor.step(1_000_000, &silent, encoder).estimate
        })
        .collect();
    // The slowest poles' time constant is √2 / (2π · 5 Hz); below one step after ln(SWING) of them,
    // over the whole of a window.
    let ringing_s = 2f64.sqrt() / (2.0 * PI * 5.0) * SWING.ln() + WINDOW_S;
    let rung_out = (ringing_s * f64::from(ESTIMATE_RATE_HZ)).ceil() as usize;
    assert!(estimates[rung_out..].iter().all(|estimate| !estimate.valid));
    // Crossings of what is left of the ringing are still counted.
    let counted = estimates[rung_out..]
        .iter()
        .filter(|estimate| estimate.wavelength_mm.is_some());
    assert!(counted.count() > 10);
}

#[test]
fn a_creeping_sensor_has_no_valid_estimate() {
    let outputs = rub(&mut counting_sensor(), 3.0, 0.1, |t_s| 1.5 * t_s);
    let estimates = estimates(&outputs);
    assert!(
        estimates
            .iter()
            .any(|estimate| estimate.wavelength_mm.is_some())
    );
    assert!(estimates.iter().all(|estimate| !estimate.valid));
}

#[test]
fn the_amplitude_is_the_fundamentals_in_adc_steps() {
    // 50 mm/s on 1 mm: 50 Hz, whole cycles in a window. The band-pass takes 1.4 % of it and leaves 0.36 of
    // the third harmonic, which is 0.29 of the fundamental: 0.5 % more in RMS.
    let outputs = rub(&mut counting_sensor(), 2.0, 1.0, |t_s| 50.0 * t_s);
    let want = SWING * (0.1 * PI).sin() / (0.1 * PI);
    for estimate in &estimates(&outputs)[50..] {
        let got = f64::from(estimate.amplitude_lsb);
        assert!((got / want - 0.991).abs() <= 0.002, "{got} is not {want}");
    }
}

#[test]
fn a_rub_to_and_fro_is_in_t1_as_long_as_the_paper_says_and_valid_only_then() {
    // A·fv = 0.08 · 0.83, so 1 − 2 A fv of the time: 86.7 %. Over ten strokes, sampled at 100 Hz.
    let strokes_hz = 0.83;
    let position_mm =
        |t_s: f64| -70.0 / (2.0 * PI * strokes_hz) * (2.0 * PI * strokes_hz * t_s).cos();
    let outputs = rub(&mut counting_sensor(), 12.5, 2.0, position_mm);
    let settled = &estimates(&outputs)[45..];
    let in_t1 = settled
        .iter()
        .filter(|estimate| estimate.range == Range::T1)
        .count();
    let share = in_t1 as f64 / settled.len() as f64;
    let want = 1.0 - 2.0 * WINDOW_S * strokes_hz;
    // Forty borders of ranges, each placed to within an estimate, of 1 205 estimates.
    assert!(
        (share - want).abs() <= 40.0 / 1_205.0,
        "{share} is not {want}"
    );
    for estimate in settled {
        assert!(!estimate.valid || estimate.range == Range::T1);
        if let Some(wavelength_mm) = estimate.wavelength_mm {
            assert!(wavelength_mm.is_finite() && wavelength_mm > 0.0);
        }
    }
}

#[test]
fn the_gauge_blocks_follow_each_other_and_carry_the_signal_where_it_was_felt() {
    let mut sensor = Sensor::new(COUNTING);
    sensor.stream_gauges(&StreamGauges { for_ms: 1_000 });
    let speed_mm_s = 40.0;
    let outputs = rub(&mut sensor, 1.0, 4.0, |t_s| speed_mm_s * t_s);
    let blocks: Vec<Gauges> = outputs.iter().filter_map(|output| output.gauges).collect();
    assert_eq!(blocks.len(), 125);
    for (number, block) in blocks.iter().enumerate().skip(2) {
        assert_eq!(block.first_sample as usize, 8 * number);
        let first_ms = 8 * number as i64 + 1;
        assert_eq!(block.instant_us as i64, (first_ms - 4) * 1_000);
        let mut position_um = block.position_um;
        for (at, sample) in block.samples.iter().enumerate() {
            assert_eq!(sample.travel_um, 40);
            position_um += if at == 0 {
                0
            } else {
                i64::from(sample.travel_um)
            };
            // The encoder started at the first millisecond's last scan, three scans in.
            let x_mm = (position_um as f64 + speed_mm_s * 0.75) / 1_000.0;
            for (channel, (code, offset)) in sample.codes.iter().zip(OFFSETS).enumerate() {
                let code = f64::from(*code) / 16.0;
                let want = f64::from(MID_RAIL_CODE)
                    + offset
                    + SWING * grating(x_mm / 4.0 + 0.137 * channel as f64);
                // The codes' floor, up to 1; the encoder's, up to 5 µm of a slope of at most
                // 2 · 2π · 600 / 4 mm; the filter's flatness, 0.1 dB of 600 at most.
                let bound = 1.0 + 0.005 * 2.0 * 2.0 * PI * SWING / 4.0 + 0.0116 * SWING;
                assert!((code - want).abs() <= bound, "{code} is not {want}");
            }
        }
    }
    assert!(
        rub(&mut counting_sensor(), 0.1, 4.0, |_| 0.0)
            .iter()
            .all(|o| o.gauges.is_none())
    );
}

#[test]
fn gauges_stream_for_the_longest_time_that_anybody_asked_for_and_leave_the_estimates_alone() {
    let hand = |t_s: f64| 40.0 * t_s;
    let quiet = rub(&mut counting_sensor(), 1.5, 4.0, hand);
    let mut sensor = counting_sensor();
    let ask = |sensor: &mut Sensor, for_ms| sensor.stream_gauges(&StreamGauges { for_ms });
    // One wants half a second, another has had enough at once, a third wants less.
    ask(&mut sensor, 500);
    ask(&mut sensor, 0);
    ask(&mut sensor, 100);
    let streamed = rub(&mut sensor, 1.5, 4.0, hand);
    let blocks = streamed.iter().filter(|output| output.gauges.is_some());
    assert_eq!(blocks.count(), 500 / GAUGE_BLOCK);
    let estimates = |outputs: &[Output]| -> Vec<Estimate> {
        let estimates = outputs.iter().filter_map(|output| output.estimate);
        estimates.collect()
    };
    assert_eq!(estimates(&streamed), estimates(&quiet));
    // Nobody gets more than the longest while.
    ask(&mut sensor, u16::MAX);
    let longest = f64::from(StreamGauges::LONGEST_MS);
    let streamed = rub(&mut sensor, longest / 1e3 + 1.0, 4.0, |_| 0.0);
    let blocks = streamed.iter().filter(|output| output.gauges.is_some());
    let most = usize::from(StreamGauges::LONGEST_MS) / GAUGE_BLOCK;
    assert_eq!(blocks.count(), most);
}

#[test]
fn a_stop_takes_the_drive_off_for_good_and_the_estimates_go_on() {
    let mut sensor = counting_sensor();
    let motion = |sequence| Motion {
        sequence,
        instant_us: 0,
        position_um: 77_000,
        velocity_um_s: 100_000,
    };
    assert!(sensor.on_motion(&motion(0)));
    assert!(rub(&mut sensor, 0.05, 2.0, |_| 0.0)[49].drive.duty > 0);
    sensor.stop(Trip::Operator);
    assert_eq!(sensor.arm(), ArmState::Stopped(Trip::Operator));
    for sequence in 1..50 {
        assert!(!sensor.on_motion(&motion(sequence)));
        let outputs = rub(&mut sensor, 0.02, 2.0, |_| 0.0);
        assert!(
            outputs
                .iter()
                .all(|output| output.drive == Drive::default())
        );
        let estimates = outputs.iter().filter(|output| output.estimate.is_some());
        assert_eq!(estimates.count(), 2);
    }
    sensor.configure(COUNTING);
    assert_eq!(sensor.arm(), ArmState::Stopped(Trip::Operator));
}

#[test]
fn the_drive_follows_motions_and_stops_without_them() {
    let mut sensor = counting_sensor();
    let still = rub(&mut sensor, 0.01, 2.0, |_| 0.0);
    assert!(still.iter().all(|output| output.drive.duty == 0));
    let motion = Motion {
        sequence: 3,
        instant_us: 0,
        position_um: 77_000,
        velocity_um_s: -100_000,
    };
    assert!(sensor.on_motion(&motion));
    assert!(!sensor.on_motion(&motion));
    let moving = rub(&mut sensor, 0.2, 2.0, |t_s| -100.0 * (t_s - 0.000_75));
    assert_eq!(
        moving[0].drive,
        Drive {
            duty: Drive::FULL / 2,
            forward: false
        }
    );
    assert!(moving[..100].iter().all(|output| output.drive.duty > 0));
    assert!(moving[100..].iter().all(|output| output.drive.duty == 0));
}

#[test]
fn a_replay_is_the_same_bit_for_bit() {
    let play = || rub(&mut counting_sensor(), 1.0, 1.0, |t_s| 70.0 * t_s);
    assert_eq!(play(), play());
}

#[test]
fn the_state_of_the_wavelength_is_within_24_kib_and_that_of_the_texture_within_1_5() {
    let [whole, texture] = [size_of::<Sensor>(), size_of::<Surface>()];
    assert!(whole - texture <= 24 * 1_024, "{whole} - {texture} bytes");
    assert!(texture <= 3 * 512, "{texture} bytes");
}

#[test]
fn a_wave_outside_the_range_is_never_stood_by() {
    // At these speeds 0.5 mm have images within the range in knots of 0.1 and 0.25 mm; a third of 10 mm is in it.
    for (wavelength_mm, speed_mm_s) in [(0.5, 10.9), (0.5, 28.0), (0.5, 68.1), (10.0, 70.0)] {
        let mut sensor = Sensor::new(SensorConfiguration::DEFAULT);
        let outputs = rub(&mut sensor, 6.0, wavelength_mm, |t_s| speed_mm_s * t_s);
        let stood_by = estimates(&outputs).iter().filter(|one| one.valid).count();
        assert_eq!(stood_by, 0, "{wavelength_mm} mm at {speed_mm_s} mm/s");
    }
}

#[test]
fn on_a_gradient_the_wavelength_is_that_under_the_fingertip() {
    // λ = 3 mm · e^(slope · x), so 1/λ summed up to x is:
    let waves_at = |slope: f64| move |mm: f64| (1.0 - (-slope * mm).exp()) / (3.0 * slope);
    for slope in [0.006, -0.006] {
        let speed_mm_s = 60.0;
        let mut sensor = Sensor::new(SensorConfiguration::DEFAULT);
        let outputs = rub_waves(&mut sensor, 1.4, waves_at(slope), |t_s| speed_mm_s * t_s);
        for estimate in &estimates(&outputs)[60..] {
            let t_s = estimate.instant_us as f64 * 1e-6;
            let truth_mm = 3.0 * (slope * speed_mm_s * t_s).exp();
            let said_mm = f64::from(estimate.wavelength_mm.unwrap());
            assert!(estimate.valid, "slope {slope}, {t_s} s");
            assert!(
                (said_mm / truth_mm - 1.0).abs() < 0.012,
                "slope {slope}, {t_s} s: {said_mm} for {truth_mm} mm"
            );
        }
    }
}

#[test]
fn a_weaves_period_is_told_though_its_half_is_the_strongest() {
    let weave = |gauge: usize, x_mm: f64, _: f64| {
        let theta = TAU * (x_mm + PLACES_MM[gauge]) / 3.3 + PHASES_RAD[gauge];
        let third = 0.7 * (3.0 * theta).sin();
        CODES * GAINS[gauge] * (0.35 * theta.sin() + (2.0 * theta).sin() + third)
    };
    let mut bench = Bench::new(SensorConfiguration::DEFAULT);
    let begun = bench.rub(1_000, |_| 40.0, weave);
    assert!(valid_and_worst(&begun, 3.3).0 > 0.0);
    let (valid, worst) = valid_and_worst(&bench.rub(3_000, |_| 40.0, weave), 3.3);
    assert!(valid > 0.95 && worst < 0.05, "{valid} valid, {worst} off");
}

#[test]
fn a_fingertip_that_is_lifted_from_a_stroke_soon_feels_no_other_wave() {
    for (wavelength_mm, speed_mm_s) in [(1.0, 50.0), (2.0, 60.0), (4.0, 30.0)] {
        for later_ms in (0..120).step_by(10) {
            for deflection in [-800.0, 0.0, 800.0] {
                let mut bench = Bench::new(SensorConfiguration::DEFAULT);
                bench.noise_lsb = 1.0;
                let texture = texture(wavelength_mm);
                let felt = |gauge, x_mm, t_s| texture(gauge, x_mm, t_s) + deflection;
                bench.rub(2_000 + later_ms, |_| speed_mm_s, felt);
                let lifted_s = bench.t_s();
                let springs_back =
                    |gauge, x_mm, t_s| felt(gauge, x_mm, t_s) * (-(t_s - lifted_s) / 0.01).exp();
                // That the deflection goes may look like a longer wave while it is all that there is to see.
                bench.rub(150, |_| speed_mm_s, springs_back);
                let estimates = bench.rub(1_000, |_| speed_mm_s, springs_back);
                let (_, worst) = valid_and_worst(&estimates, wavelength_mm);
                assert!(
                    worst < 0.1,
                    "{wavelength_mm} mm, {later_ms} ms later, {deflection} steps: {worst}"
                );
            }
        }
    }
}

#[test]
fn what_shakes_the_sensor_is_no_surface_where_the_arm_swings() {
    let swing = |t_s: f64| 70.0 * (TAU * 0.83 * t_s).sin();
    let mut bench = Bench::new(SensorConfiguration::DEFAULT);
    bench.rub(2_000, swing, texture(2.0));
    let (valid, worst) = valid_and_worst(&bench.rub(3_000, swing, texture(2.0)), 2.0);
    assert!(valid > 0.8 && worst < 0.05, "{valid} valid, {worst} off");
    for hz in [12.0, 17.0, 30.0, 65.0] {
        let mut bench = Bench::new(SensorConfiguration::DEFAULT);
        bench.noise_lsb = 1.0;
        let shakes = |gauge: usize, _: f64, t_s: f64| CODES * GAINS[gauge] * (TAU * hz * t_s).sin();
        bench.rub(2_000, swing, shakes);
        let estimates = bench.rub(3_000, swing, shakes);
        let valid = estimates.iter().filter(|estimate| estimate.valid).count();
        assert_eq!(valid, 0, "{hz} Hz");
    }
}

/// Heights at random, blurred by the contact, with deviation 1, of x in mm from 0 to 80: what is longer than some mm is loudest.
fn rough(seed: u64) -> impl Fn(f64) -> f64 {
    const STEP_MM: f64 = 0.02;
    let mut random = seed;
    let keep = (-TAU * STEP_MM / 4.0).exp();
    let (mut height, mut blurred) = (0.0, 0.0);
    let heights = (0..5_000).map(|_| {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let even = (random >> 33) as f64 / f64::from(1_u32 << 31) - 0.5;
        height = keep * height + (12.0 * (1.0 - keep * keep)).sqrt() * even;
        blurred += 0.2 * (height - blurred);
        blurred
    });
    let heights: Vec<f64> = heights.skip(1_000).collect();
    move |x_mm| heights[((x_mm / STEP_MM) as usize).min(heights.len() - 1)]
}

/// Share of valid estimates, over surfaces of [`rough`], of a bench that rubs so; it is at x = 0 mm first.
fn valid_on_rough(velocity_mm_s: impl Fn(f64) -> f64 + Copy) -> f64 {
    const SEEDS: u64 = 24;
    let valid = (1..=SEEDS).map(|seed| {
        let rough = rough(seed);
        let felt = |gauge: usize, x_mm: f64, _: f64| {
            CODES * GAINS[gauge] * rough(x_mm + PLACES_MM[gauge] + 3.0)
        };
        let mut bench = Bench::new(SensorConfiguration::DEFAULT);
        bench.noise_lsb = 4.0;
        let settled = |t_s: f64| velocity_mm_s(t_s + 1.0);
        let _ = bench.rub(1_000, velocity_mm_s, felt);
        let estimates = bench.rub(4_000, settled, felt);
        estimates.iter().filter(|estimate| estimate.valid).count() as f64 / estimates.len() as f64
    });
    valid.sum::<f64>() / SEEDS as f64
}

/// Whoever rubs one place to and fro meets the same heights again, which then look periodic: a known weakness, that is not to
/// grow.
#[test]
fn one_place_of_a_rough_surface_is_taken_for_a_wave_no_more_often_than_is_said() {
    let along = valid_on_rough(|_| 14.0);
    let to_and_fro = [6.0, 12.0, 20.0]
        .map(|length_mm| valid_on_rough(move |t_s| 60.0 * (120.0 / length_mm * t_s).sin()));
    println!("valid along 70 mm: {along:.3}; to and fro over 6, 12, 20 mm: {to_and_fro:.3?}");
    assert!(along < 0.05, "{along}");
    assert!(
        to_and_fro.iter().all(|share| *share < 0.3),
        "{to_and_fro:?}"
    );
}

/// What follows clear ridges is more often a surface than not, but it need not be a periodic one.
#[test]
fn behind_clear_ridges_a_rough_surface_is_no_wave() {
    const BORDER_MM: f64 = 60.0;
    let mut valid = [0.0; 2];
    let seeds = 1..=16_u64;
    for (of, ridges_mm) in [None, Some(4.0)].into_iter().enumerate() {
        for seed in seeds.clone() {
            let rough = rough(seed);
            let felt = |gauge: usize, x_mm: f64, t_s: f64| match ridges_mm {
                Some(mm) if x_mm + PLACES_MM[gauge] < BORDER_MM => texture(mm)(gauge, x_mm, t_s),
                _ => CODES * GAINS[gauge] * rough((x_mm + PLACES_MM[gauge] - BORDER_MM).max(0.0)),
            };
            let mut bench = Bench::new(SensorConfiguration::DEFAULT);
            bench.noise_lsb = 4.0;
            let begins_mm = if ridges_mm.is_some() { 0.0 } else { BORDER_MM };
            bench.x_mm = begins_mm;
            let way_mm = BORDER_MM + 3.5 - begins_mm;
            bench.rub((way_mm / 0.05) as u64, |_| 50.0, felt);
            let beyond = bench.rub(1_200, |_| 50.0, felt);
            let share = beyond.iter().filter(|estimate| estimate.valid).count() as f64;
            valid[of] += share / beyond.len() as f64 / seeds.clone().count() as f64;
        }
    }
    let [without, behind] = valid;
    println!("valid {behind:.3} behind ridges, {without:.3} without");
    assert!(
        behind < 0.05 && without < 0.05,
        "{behind} behind ridges, {without} without"
    );
}
