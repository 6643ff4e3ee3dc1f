//! Whether positions and gauges belong to the same instants: measured in µs, on strokes to and fro.
//!
//! A gauge that is felt τ too late lags by 2πvτ/λ on the way out and leads by as much on the way back. At
//! constant |v| the two ways' phases differ by 4πvτ/λ, whatever the surface, the encoder's offset and the
//! filter's delay are.

use std::f64::consts::TAU;

use firmware_sensor::{
    MICROMETRES_PER_COUNT, MID_RAIL_CODE, Output, SCAN_RATE_HZ, SCANS_PER_SAMPLE, Scan, Sensor,
};
use protocol::{GAUGES, SensorConfiguration, StreamGauges};

/// A triangular stroke: out and back at a speed, from 0.
#[derive(Clone, Copy)]
struct Stroke {
    speed_mm_s: f64,
    length_mm: f64,
}

impl Stroke {
    fn position_mm(self, t_s: f64) -> f64 {
        let way = (self.speed_mm_s * t_s).rem_euclid(2.0 * self.length_mm);
        way.min(2.0 * self.length_mm - way)
    }
}

/// Five gauges in turn on a sine, felt `late_s` after the encoder was read.
fn feel(stroke: Stroke, wavelength_mm: f64, late_s: f64, duration_s: f64) -> Vec<Output> {
    let mut sensor = Sensor::new(SensorConfiguration::DEFAULT);
    sensor.stream_gauges(&StreamGauges {
        for_ms: StreamGauges::LONGEST_MS,
    });
    let scan = |t_s: f64| -> Scan {
        let x_mm = stroke.position_mm(t_s - late_s);
        let mut scan = [MID_RAIL_CODE; 6];
        for (gauge, code) in scan.iter_mut().enumerate().take(GAUGES) {
            let theta = TAU * (x_mm / wavelength_mm + 0.2 * gauge as f64);
            *code = (f64::from(MID_RAIL_CODE) + 800.0 * theta.sin()).round() as u16;
        }
        scan
    };
    (1..=(duration_s * 1_000.0) as u64)
        .map(|ms| {
            let number = |i: usize| (ms * SCANS_PER_SAMPLE as u64 - 3 + i as u64) as f64;
            let scans = std::array::from_fn(|i| scan(number(i) / f64::from(SCAN_RATE_HZ)));
            // The board reads its encoder at the last scan.
            let x_mm = stroke.position_mm(number(3) / f64::from(SCAN_RATE_HZ));
            let counts = (1_000.0 * x_mm / f64::from(MICROMETRES_PER_COUNT)).floor() as i64;
            sensor.step(ms * 1_000, &scans, counts as u16)
        })
        .collect()
}

/// How late the streamed gauges are beside the streamed positions, in µs.
fn streamed_lateness_us(stroke: Stroke, wavelength_mm: f64, late_s: f64) -> f64 {
    let outputs = feel(stroke, wavelength_mm, late_s, 4.0);
    // Samples of whole ways at constant speed: without the filter's 8 ms and 2 ms around a turn.
    let margin_um = 10.0 * stroke.speed_mm_s;
    let inside = margin_um..1_000.0 * stroke.length_mm - margin_um;
    // Complex amplitudes of the gauges out and back, as a fit of cosine and sine by their normal
    // equations: the ways need not hold whole waves.
    let mut ways = [[[0.0; 5]; GAUGES]; 2];
    for block in outputs.iter().filter_map(|output| output.gauges) {
        let mut x_um = block.position_um as f64 - f64::from(block.samples[0].travel_um);
        for sample in block.samples {
            x_um += f64::from(sample.travel_um);
            if sample.travel_um == 0 || !inside.contains(&x_um) {
                continue;
            }
            let (sin, cos) = (TAU * x_um / 1_000.0 / wavelength_mm).sin_cos();
            let way = usize::from(sample.travel_um < 0);
            for (sums, code) in ways[way].iter_mut().zip(sample.codes) {
                let level = f64::from(code) / 16.0 - f64::from(MID_RAIL_CODE);
                let products = [cos * cos, cos * sin, sin * sin, cos * level, sin * level];
                for (sum, product) in sums.iter_mut().zip(products) {
                    *sum += product;
                }
            }
        }
    }
    let phase = |[cc, cs, ss, cl, sl]: [f64; 5]| {
        let (cosine, sine) = (cl * ss - sl * cs, sl * cc - cl * cs);
        sine.atan2(cosine)
    };
    let mean: f64 = (0..GAUGES)
        .map(|gauge| {
            let [out, back] = [0, 1].map(|way| phase(ways[way][gauge]));
            // Of A cos θ + B sin θ the phase grows as the wave comes later.
            (out - back + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0
        })
        .sum::<f64>()
        / GAUGES as f64;
    1e6 * mean * wavelength_mm / (2.0 * TAU * stroke.speed_mm_s)
}

#[test]
fn streamed_positions_and_gauges_are_of_the_same_instants_within_50_us() {
    for (speed_mm_s, wavelength_mm) in [(101.3, 2.0), (70.7, 1.0), (33.3, 3.1)] {
        let stroke = Stroke {
            speed_mm_s,
            length_mm: 17.3,
        };
        for late_us in [0.0, 50.0, 1_000.0, -1_000.0] {
            let got_us = streamed_lateness_us(stroke, wavelength_mm, late_us * 1e-6);
            // The counts' floor, evenly over 5 µm at speeds that are no whole number of counts in 1 ms, is
            // the same on both ways.
            assert!(
                (got_us - late_us).abs() <= 10.0,
                "{got_us} µs of {late_us} at {speed_mm_s} mm/s"
            );
        }
    }
}

/// Mean energy that the estimator's wave explains, in ADC steps² with its sign turned, over whole strokes.
fn unexplained(late_us: f64) -> f64 {
    // 5 turns a second, so that both ways are in the kernel nearly always; 67 Hz, far from the mains.
    let stroke = Stroke {
        speed_mm_s: 101.3,
        length_mm: 20.0,
    };
    let outputs = feel(stroke, 1.5, late_us * 1e-6, 4.4);
    let explained: Vec<f64> = outputs
        .iter()
        .filter_map(|output| output.estimate)
        .skip(40)
        .map(|estimate| f64::from(estimate.amplitude_lsb).powi(2))
        .collect();
    -explained.iter().sum::<f64>() / explained.len() as f64
}

#[test]
fn the_estimator_is_given_places_and_gauges_of_the_same_instants_within_50_us() {
    // What is unexplained grows with the square of the two ways' difference in phase: its least is where
    // there is none. A parabola through three skews.
    let [before, now, after] = [-500.0, 0.0, 500.0].map(unexplained);
    assert!(now < before.min(after), "{before} {now} {after}");
    // Measured 3 µs.
    let least_us = 250.0 * (before - after) / (before - 2.0 * now + after);
    assert!(least_us.abs() <= 50.0, "{least_us} µs");
}

#[test]
fn a_skew_of_1_ms_shows_in_the_wavelength_where_the_arm_turns() {
    let rms = |late_us: f64| {
        let stroke = Stroke {
            speed_mm_s: 100.0,
            length_mm: 10.0,
        };
        feel(stroke, 2.0, late_us * 1e-6, 4.0)
            .iter()
            .filter_map(|output| output.estimate)
            .skip(40)
            .map(|estimate| f64::from(estimate.wavelength_mm.unwrap_or(0.0)) / 2.0 - 1.0)
            .map(|error| error * error / 360.0)
            .sum::<f64>()
            .sqrt()
    };
    let [aligned, fifty, skewed] = [0.0, 50.0, 1_000.0].map(rms);
    // 50 µs are 5 µm, a count of the encoder, at the fastest; of eight waves of 2 mm that is 0.03 %.
    assert!(fifty < 1e-3, "{fifty} beside {aligned}");
    assert!(skewed > 2.5 * aligned, "{skewed} beside {aligned}");
}
