//! What the gauges of a drawn surface say: levels, noise, hum, random parts.

use super::*;

#[test]
fn the_signal_has_its_level_and_gauges_their_signs() {
    let mut trial = clean_ridges(2.0, Class::Sine, Waveform::Sine);
    trial.pickup.gauges[2].place_mm = trial.pickup.gauges[1].place_mm;
    trial.pickup.gauges[2].gain = 0.5;
    let record = trial.record();
    assert_eq!(record.signal_rms, 200.0);
    let rms = power(steady(&gauge(&record, 0))).sqrt();
    // Over 88 whole waves and a part of one.
    assert!((rms / 200.0 - 1.0).abs() < 0.01, "{rms}");
    let [turned, half] = [1, 2].map(|number| gauge(&record, number));
    let (turned, half) = (steady(&turned), steady(&half));
    let product: f64 = turned.iter().zip(half).map(|(a, b)| a * b).sum();
    let gain = product / (half.len() as f64 * power(half));
    assert!((gain + 2.0).abs() < 0.01, "{gain}");
    assert!(record.scans.iter().flatten().all(|scan| scan[5] == 2_048));
}

#[test]
fn hum_has_its_frequency_and_its_power_in_all_gauges_and_one_phase() {
    let mut trial = clean(Class::HumOnly, Specimen::Plain(Plain::Flat));
    trial.pickup.hum_hz = 60.37;
    trial.pickup.hum = 1.5;
    trial.pickup.gauges[3].hum_gain = 0.6;
    let record = trial.record();
    let codes = gauge(&record, 0);
    let measured_hz = strongest(&codes, 45.0, 70.0, 0.02);
    assert!((measured_hz - 60.37).abs() < 0.03, "{measured_hz}");
    for (number, gain) in [(0, 1.0), (1, 1.0), (3, 0.6)] {
        let codes = gauge(&record, number);
        let rms = power(&codes).sqrt();
        assert!((rms / (1.5 * gain * 200.0) - 1.0).abs() < 0.01, "{rms}");
    }
    let others = gauge(&record, 3);
    let product: f64 = codes.iter().zip(&others).map(|(a, b)| a * b).sum();
    let alike = product / (codes.len() as f64 * (power(&codes) * power(&others)).sqrt());
    assert!(alike > 0.999, "{alike}");
}

#[test]
fn white_noise_has_its_power_in_the_band_with_a_corner_and_without() {
    for corner_hz in [0.0, 300.0] {
        let mut trial = clean(Class::Flat, Specimen::Plain(Plain::Flat));
        trial.pickup.snr_db = 6.0;
        trial.pickup.noise_corner_hz = corner_hz;
        trial.hand.duration_s = 4.0;
        let record = trial.record();
        let codes = gauge(&record, 2);
        // Power in 0–500 Hz: of a whole length's Fourier transform, by Parseval.
        let length = 4_000;
        let mut in_band = 0.0;
        for piece in codes.chunks_exact(length) {
            let mean = piece.iter().sum::<f64>() / length as f64;
            let piece: Vec<f64> = piece.iter().map(|code| code - mean).collect();
            for bin in (1..500).step_by(5) {
                let turn = TAU * f64::from(bin) / length as f64;
                let (mut re, mut im) = (0.0, 0.0);
                for (scan, code) in piece.iter().enumerate() {
                    re += code * (turn * scan as f64).cos();
                    im += code * (turn * scan as f64).sin();
                }
                // Each bin stands for the four that are left out.
                in_band += 5.0 * 2.0 * (re * re + im * im) / (length as f64).powi(2);
            }
        }
        in_band /= (codes.len() / length) as f64;
        let level = record.signal_rms;
        let due = level * level * 10f64.powf(-0.6);
        // χ² with 2 · 400 degrees of freedom: σ = 5 %; 4 σ.
        assert!(
            (in_band / due - 1.0).abs() < 0.2,
            "{corner_hz}: {in_band} of {due}"
        );
    }
}

#[test]
fn a_random_part_is_common_to_the_gauges_or_their_own() {
    let likeness_of_gauges = |common: f64| {
        let mut trial = clean(Class::Random, Specimen::Plain(Plain::Flat));
        trial.ground.texture = Some(Texture {
            share: 1.0,
            common,
            corner_mm: 0.5,
            poles: 1,
            longest_mm: 30.0,
        });
        for gauge in &mut trial.pickup.gauges {
            gauge.place_mm = 0.0;
            gauge.gain = 1.0;
        }
        let record = trial.record();
        let [one, other] = [0, 1].map(|number| gauge(&record, number));
        let product: f64 = one.iter().zip(&other).map(|(a, b)| a * b).sum();
        product / (one.len() as f64 * (power(&one) * power(&other)).sqrt())
    };
    assert!(likeness_of_gauges(1.0) > 0.99);
    assert!(likeness_of_gauges(0.0).abs() < 0.3);
}

#[test]
fn a_narrow_band_has_its_centre_and_its_width() {
    let trial = |bandwidth| {
        let band = Plain::NarrowBand {
            wavelength_mm: 1.0,
            bandwidth,
        };
        let mut trial = clean(Class::NarrowBand, Specimen::Plain(band));
        trial.hand.duration_s = 10.0;
        trial
    };
    for bandwidth in [0.2, 0.5] {
        let record = trial(bandwidth).record();
        let codes = gauge(&record, 0);
        let codes = steady(&codes);
        let centre_hz = SPEED_MM_S;
        let power_in = |low: f64, high: f64| -> f64 {
            let bins = (low * centre_hz / 0.2) as usize..(high * centre_hz / 0.2) as usize;
            bins.map(|bin| amplitude(codes, 0.2 * bin as f64).powi(2))
                .sum()
        };
        let half = 0.5 * bandwidth;
        let inside = power_in(1.0 - half, 1.0 + half);
        let all = power_in(0.05, 3.0);
        // Of a band with the shape 1/(1 + x²)², half the power at 0.6436, 74 % lie within.
        assert!(
            (inside / all - 0.74).abs() < 0.12,
            "{bandwidth}: {}",
            inside / all
        );
    }
}
