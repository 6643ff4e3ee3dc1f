//! What the gauges say of a known surface.

use super::*;
use crate::scene::{Scene, Specimen};

const SCANS: usize = 40_000;

fn surface() -> Surface {
    Surface::new(&Scene::constant(2.0, 50.0).surface, 0.0)
}

/// Gauges in good order but for what `spoil` does to them.
fn spoilt(spoil: fn(&mut Kinematic)) -> Kinematic {
    let mut kinematic = Kinematic::default();
    spoil(&mut kinematic);
    kinematic
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

fn difference(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter()
        .zip(other)
        .map(|(one, other)| one - other)
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
    let noisy = spoilt(|gauges| gauges.snr_db = Some(10.0));
    let (clean, noisy) = (scans(Kinematic::default(), 1), scans(noisy, 1));
    for gauge in 0..GAUGES {
        let noise = difference(&lane(&noisy, gauge), &lane(&clean, gauge));
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
    let scans = scans(spoilt(|gauges| gauges.hum_50_hz = 0.5), 1);
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
fn mains_of_60_hz_and_off_nominal_are_where_they_are_said_to_be() {
    for (kinematic, hz) in [
        (spoilt(|gauges| gauges.hum_60_hz = 2.0), 60.0),
        (
            spoilt(|gauges| (gauges.hum_50_hz, gauges.hum_off_hz) = (2.0, -0.5)),
            49.5,
        ),
    ] {
        let scans = scans(kinematic, 1);
        for gauge in 0..GAUGES {
            // Ten seconds hold whole cycles, and none of the texture's 25 Hz and its odd harmonics.
            let (amplitude, phase) = tone(&lane(&scans, gauge), hz);
            assert!(
                (amplitude - 2.0 * CODES_PER_UNIT).abs() < 0.1,
                "{hz} Hz, {gauge}: {amplitude}"
            );
            assert!(phase.abs() < 1e-3);
        }
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
    let noisy = spoilt(|gauges| gauges.snr_db = Some(20.0));
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
    let feel = |surface| KinematicGauges::new(&Kinematic::default(), 1).scan(surface, 0.0, 60.2);
    let (both, first) = (feel(&both), feel(&first));
    // Places −3 and −1.5 mm are still before 60 mm.
    assert_eq!(both[..2], first[..2]);
    assert!((2..5).all(|gauge| both[gauge] != first[gauge]));
}

/// Gauge `gauge` of ten seconds of `kinematic`, in units of the fundamental, without rounding's half code.
fn units(kinematic: Kinematic, gauge: usize) -> Vec<f64> {
    lane(&scans(kinematic, 1), gauge)
        .into_iter()
        .map(|code| (code - 2047.5) / CODES_PER_UNIT)
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_stuck_a_noisy_and_a_humming_gauge_are_so_and_the_others_stay_as_they_were() {
    let mut broken = spoilt(|gauges| gauges.snr_db = Some(20.0));
    let whole = scans(broken, 5);
    broken.stuck[0] = true;
    broken.noisy[2] = true;
    broken.humming[4] = true;
    let broken = scans(broken, 5);
    assert!(broken.iter().all(|codes| codes[0] == STUCK_CODE));
    let added = |gauge: usize| -> Vec<f64> {
        lane(&broken, gauge)
            .iter()
            .zip(lane(&whole, gauge))
            .map(|(broken, whole)| (broken - whole) / CODES_PER_UNIT)
            .collect()
    };
    // The ends of the converter, ± 5.5, cut off what lies beyond 1.8 σ: less than 10 % of the RMS; σ of
    // the RMS itself is 0.35 %.
    let noise = rms(&added(2));
    assert!((2.7..3.0).contains(&noise), "{noise}");
    let (hum, phase) = tone(&added(4), 50.0);
    assert!((hum - 2.0).abs() < 0.01 && phase.abs() < 1e-2, "{hum}");
    for gauge in [1, 3] {
        assert_eq!(lane(&broken, gauge), lane(&whole, gauge));
    }
}

#[test]
fn troubles_come_and_go() {
    let sound = spoilt(|gauges| gauges.snr_db = Some(20.0));
    let mut broken = Kinematic {
        trouble_from_s: 2.0,
        trouble_for_s: Some(0.5),
        ..sound
    };
    broken.dead[0] = true;
    broken.saturated[1] = true;
    broken.stuck[2] = true;
    broken.noisy[3] = true;
    broken.humming[4] = true;
    let (sound, broken) = (scans(sound, 1), scans(broken, 1));
    assert_eq!(broken[..8_000], sound[..8_000]);
    assert_eq!(broken[10_000..], sound[10_000..]);
    for gauge in 0..GAUGES {
        let during = 8_000..10_000;
        let same = during
            .filter(|&scan| broken[scan][gauge] == sound[scan][gauge])
            .count();
        // A curve meets another, now and then.
        assert!(same < 100, "{gauge}: {same} of 2000 scans are as if sound");
    }
}

#[test]
fn drift_and_offset_are_what_they_are_said_to_be() {
    let offset = spoilt(|gauges| gauges.offset = 2.0);
    let drift = spoilt(|gauges| gauges.drift = 0.2);
    for gauge in 0..GAUGES {
        let quiet = units(Kinematic::default(), gauge);
        // A code is 0.0027 units.
        let offset = units(offset, gauge);
        let share = [-2.0, -1.0, 0.0, 1.0, 2.0][gauge];
        for (offset, quiet) in offset.iter().zip(&quiet) {
            assert!((offset - quiet - share).abs() < 0.003);
        }
        let drift = units(drift, gauge);
        for (scan, (drift, quiet)) in drift.iter().zip(&quiet).enumerate() {
            let turns = 0.11 * scan as f64 / 4000.0 + gauge as f64 / 5.0;
            assert!((drift - quiet - 0.2 * (TAU * turns).sin()).abs() < 0.003);
        }
    }
}

#[test]
fn pink_noise_has_its_rms_its_slope_and_its_own_stream() {
    let pink = Kinematic {
        pink: 0.5,
        snr_db: Some(20.0),
        ..Kinematic::default()
    };
    let white = Kinematic { pink: 0.0, ..pink };
    let (mut power, mut slow, mut fast) = (0.0, 0.0, 0.0);
    for gauge in 0..GAUGES {
        let noise = difference(&units(pink, gauge), &units(white, gauge));
        power += rms(&noise).powi(2) / 5.0;
        // An octave from 20 of its tones.
        let octave = |low_hz: f64| -> f64 {
            (0..20)
                .map(|tenth| {
                    tone(&noise, low_hz * (1.0 + f64::from(tenth) / 20.0))
                        .0
                        .powi(2)
                        * low_hz
                })
                .sum()
        };
        slow += octave(2.0);
        fast += octave(128.0);
    }
    // Most of the power lies below 10 Hz, some hundred degrees of freedom in all: 5 σ are 60 %.
    assert!((0.1..0.4).contains(&power), "{power} for 0.25");
    // Octaves of 1/f hold the same. 5 · 2 · 20 degrees of freedom in each: σ = 14 % of the ratio; 4 σ and
    // a decibel of ripple.
    assert!((0.45..1.8).contains(&(slow / fast)), "{slow} to {fast}");
}

#[test]
fn a_resonance_delays_the_texture_and_lifts_what_is_near_it() {
    let ringing = Kinematic {
        resonance: Some(crate::scene::Resonance {
            hz: 180.0,
            damping: 0.15,
        }),
        ..Kinematic::default()
    };
    let (quiet, ringing) = (units(Kinematic::default(), 0), units(ringing, 0));
    // 25 Hz of 2 mm at 50 mm/s, and its 7th harmonic close to the resonance; the start rings away.
    let answer = |n: f64| {
        let (quiet, ringing) = (
            tone(&quiet[4_000..], 25.0 * n),
            tone(&ringing[4_000..], 25.0 * n),
        );
        (ringing.0 / quiet.0, quiet.1 - ringing.1)
    };
    let ratio: f64 = 25.0 / 180.0;
    let (real, imaginary) = (1.0 - ratio * ratio, 0.3 * ratio);
    let (gain, phase) = answer(1.0);
    // Rounding to codes, 1/375 of the amplitude.
    assert!((gain * real.hypot(imaginary) - 1.0).abs() < 2e-3, "{gain}");
    assert!((phase - imaginary.atan2(real)).abs() < 2e-3, "{phase}");
    assert!(answer(7.0).0 > 2.5);
}
