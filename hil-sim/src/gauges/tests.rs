//! What the gauges say of a known surface.

use super::*;
use crate::scene::{Scene, Specimen};

const SCANS: usize = 40_000;

fn surface() -> Surface {
    Surface::new(&Scene::constant(2.0, 50.0).surface, 0.0)
}

/// Ten seconds at 50 mm/s.
fn scans(kinematic: Kinematic, seed: u64) -> Vec<[u16; GAUGES]> {
    let surface = surface();
    let mut gauges = KinematicGauges::new(&kinematic, seed);
    (0..SCANS)
        .map(|scan| {
            let t_s = scan as f64 / f64::from(SCAN_RATE_HZ);
            gauges.scan(&surface, t_s, 50.0 * t_s)
        })
        .collect()
}

fn lane(scans: &[[u16; GAUGES]], channel: usize) -> Vec<f64> {
    scans
        .iter()
        .map(|codes| f64::from(codes[channel]))
        .collect()
}

/// Amplitude of the tone at `hz`, in codes, and its phase against a sine that starts with the scans.
fn tone(lane: &[f64], hz: f64) -> (f64, f64) {
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (scan, code) in lane.iter().enumerate() {
        let angle = TAU * hz * scan as f64 / f64::from(SCAN_RATE_HZ);
        sine += code * angle.sin();
        cosine += code * angle.cos();
    }
    (
        2.0 * sine.hypot(cosine) / lane.len() as f64,
        cosine.atan2(sine),
    )
}

#[test]
fn each_gauge_has_its_gain_place_and_phase() {
    let scans = scans(Kinematic::default(), 1);
    for gauge in 0..GAUGES {
        let lane = lane(&scans, gauge);
        let (amplitude, phase) = tone(&lane, 25.0);
        let expected = GAINS[gauge] * 0.3 / 3.3 * 4096.0;
        // Rounding down to codes adds less than a code's noise: 1/√12 · √(2/40 000) ≪ 0.1.
        assert!(
            (amplitude - expected).abs() < 0.1,
            "{gauge}: {amplitude} for {expected}"
        );
        let expected = TAU * PLACES_MM[gauge] / 2.0 + PHASES_RAD[gauge];
        let difference = ((phase - expected) / TAU + 0.5).rem_euclid(1.0) - 0.5;
        assert!(difference.abs() < 1e-3, "{gauge}: {phase} for {expected}");
        let mean = lane.iter().sum::<f64>() / SCANS as f64;
        // floor takes half a code off.
        assert!((mean - 2047.5).abs() < 0.1, "{gauge}: mean {mean}");
    }
}

#[test]
fn the_noise_has_the_power_that_the_ratio_asks_for_and_is_white() {
    let noisy = Kinematic {
        snr_db: Some(10.0),
        ..Kinematic::default()
    };
    let (clean, noisy) = (scans(Kinematic::default(), 1), scans(noisy, 1));
    for gauge in 0..GAUGES {
        let noise: Vec<f64> = lane(&noisy, gauge)
            .iter()
            .zip(lane(&clean, gauge))
            .map(|(noisy, clean)| noisy - clean)
            .collect();
        let power = noise.iter().map(|n| n * n).sum::<f64>() / SCANS as f64;
        // A quarter of it lies in 0–500 of 2000 Hz.
        let signal = 0.5 * CODES_PER_UNIT * CODES_PER_UNIT;
        let ratio_db = 10.0 * (signal / (power / 4.0)).log10();
        // χ² with 40 000 degrees of freedom: σ of the power 0.7 %, 0.03 dB; 5 σ.
        assert!((ratio_db - 10.0).abs() < 0.15, "{gauge}: {ratio_db} dB");
        let next: f64 =
            noise.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / SCANS as f64 / power;
        // σ = 1/√40 000 = 0.005; 5 σ.
        assert!(next.abs() < 0.025, "{gauge}: {next}");
    }
}

#[test]
fn hum_is_common_to_all_gauges_and_relative_to_the_signal() {
    let scans = scans(
        Kinematic {
            hum_50_hz: 0.5,
            ..Kinematic::default()
        },
        1,
    );
    for gauge in 0..GAUGES {
        let (amplitude, phase) = tone(&lane(&scans, gauge), 50.0);
        assert!(
            (amplitude - 0.5 * CODES_PER_UNIT).abs() < 0.1,
            "{gauge}: {amplitude}"
        );
        assert!(phase.abs() < 1e-3);
    }
}

#[test]
fn a_dead_gauge_rests_a_saturated_one_clips_and_the_others_stay_as_they_were() {
    let mut broken = Kinematic {
        snr_db: Some(20.0),
        hum_50_hz: 0.1,
        ..Kinematic::default()
    };
    let whole = scans(broken, 5);
    broken.dead[1] = true;
    broken.saturated[3] = true;
    let broken = scans(broken, 5);
    assert!(broken.iter().all(|codes| codes[1] == 2048));
    let clipped = broken
        .iter()
        .filter(|codes| codes[3] == 0 || codes[3] == 4095)
        .count();
    // A sine of amplitude a is beyond c for 1 − 2/π · asin(c/a) of the time: 70 % with
    // c/a = 1.65 / (20 · 0.3 · 0.6) = 0.46; the harmonics and the noise move it little.
    assert!(
        (0.6..0.9).contains(&(clipped as f64 / SCANS as f64)),
        "{clipped}"
    );
    for gauge in [0, 2, 4] {
        assert_eq!(lane(&broken, gauge), lane(&whole, gauge));
    }
}

#[test]
fn noise_is_the_seed_s() {
    let noisy = Kinematic {
        snr_db: Some(20.0),
        ..Kinematic::default()
    };
    assert_eq!(scans(noisy, 3), scans(noisy, 3));
    assert_ne!(scans(noisy, 3), scans(noisy, 4));
}

#[test]
fn at_a_boundary_each_gauge_feels_what_lies_under_its_own_place() {
    let mut scene = Scene::constant(2.0, 50.0).surface;
    scene.specimens = vec![
        Specimen {
            wavelength_mm: 1.0,
            length_mm: 60.0,
        },
        Specimen {
            wavelength_mm: 4.0,
            length_mm: f64::INFINITY,
        },
    ];
    let both = Surface::new(&scene, 0.0);
    scene.specimens.truncate(1);
    let first = Surface::new(&scene, 0.0);
    let feel =
        |surface| KinematicGauges::new(&Kinematic::default(), 1).scan(surface, 0.0, 60.2);
    let (both, first) = (feel(&both), feel(&first));
    // Places −3 and −1.5 mm are still before 60 mm.
    assert_eq!(both[..2], first[..2]);
    assert!((2..5).all(|gauge| both[gauge] != first[gauge]));
}
