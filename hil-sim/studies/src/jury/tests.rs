//! Whether strangers are what their distributions say, measured on what comes out.

use std::f64::consts::TAU;

use firmware_display::Settings;
use protocol::SensorConfiguration;
use realfft::num_complex::Complex64;

use super::counts::Counts;
use super::dice::Dice;
use super::ground::{Bend, Ground, POLES, Plain, Ridges, Second, Specimen, Texture, Waveform};
use super::hand::{Encoder, Hand, SCANS_PER_S, Stroke};
use super::pickup::{Gauge, Pickup};
use super::play::play;
use super::stranger::{Class, Record, Trial};

mod signals;

const REST_S: f64 = 0.4;
const RISE_S: f64 = 0.2;
const SPEED_MM_S: f64 = 40.0;

/// A surface that nothing troubles, rubbed at one speed.
fn clean(class: Class, first: Specimen) -> Trial {
    Trial {
        class,
        seed: 5,
        ground: Ground {
            first,
            second: None,
            texture: None,
            form: None,
            bend: None,
            contact_mm: 0.1,
        },
        hand: Hand {
            duration_s: 5.0,
            rest_s: REST_S,
            stroke: Stroke::Constant {
                speed_mm_s: SPEED_MM_S,
                rise_s: RISE_S,
            },
            scatter: 0.0,
            tremor: 0.0,
            tremor_hz: 10.0,
            hysteresis_mm: 0.0,
            slider: None,
            encoder: Encoder {
                eccentricity_um: 0.0,
                turn_mm: 1.0,
                dither_um: 0.0,
                missed: 0.0,
            },
        },
        pickup: Pickup {
            gauges: std::array::from_fn(|gauge| Gauge {
                gain: if gauge == 1 { -1.0 } else { 1.0 },
                place_mm: gauge as f64 - 2.0,
                hum_gain: 1.0,
                friction_gain: 0.0,
                offset: 0.0,
                tuning: 1.0,
                drift_phase: 0.0,
            }),
            level: 200.0,
            snr_db: 60.0,
            noise_corner_hz: 0.0,
            pink: 0.0,
            hum_hz: 50.0,
            hum: 0.0,
            resonance_hz: 400.0,
            damping: 0.7,
            drift: 0.0,
            drift_hz: 0.1,
            swing: 0.0,
            swing_hz: 0.3,
            tilt: 0.0,
            friction: 0.0,
        },
        force: None,
    }
}

fn ridges(wavelength_mm: f64, waveform: Waveform) -> Ridges {
    Ridges {
        wavelength_mm,
        waveform,
        worn: 0.0,
        left: 0.0,
        jitter: 0.0,
        accumulates: false,
        gradient: 0.0,
        gradient_mm: 100.0,
    }
}

fn clean_ridges(wavelength_mm: f64, class: Class, waveform: Waveform) -> Trial {
    clean(class, Specimen::Ridged(ridges(wavelength_mm, waveform)))
}

/// A gauge's codes from mid-rail, scan by scan.
fn gauge(record: &Record, gauge: usize) -> Vec<f64> {
    let codes = record.scans.iter().flatten();
    codes.map(|scan| f64::from(scan[gauge]) - 2_048.0).collect()
}

/// From when the arm has its speed on.
fn steady(codes: &[f64]) -> &[f64] {
    &codes[((REST_S + RISE_S) * SCANS_PER_S as f64) as usize + 1..]
}

fn power(codes: &[f64]) -> f64 {
    codes.iter().map(|code| code * code).sum::<f64>() / codes.len() as f64
}

/// Amplitude of a frequency.
fn amplitude(codes: &[f64], hz: f64) -> f64 {
    phasor(codes, hz).norm()
}

/// Z of |Z| sin(ωt + arg Z), from a sum over a Hann window.
fn phasor(codes: &[f64], hz: f64) -> Complex64 {
    let (mut sum, mut weights) = (Complex64::ZERO, 0.0);
    for (scan, code) in codes.iter().enumerate() {
        let weight = 1.0 - (TAU * scan as f64 / codes.len() as f64).cos();
        let turn = TAU * hz * scan as f64 / SCANS_PER_S as f64;
        sum += Complex64::from_polar(weight * code, -turn);
        weights += weight;
    }
    2.0 * Complex64::I * sum / weights
}

/// The frequency with the largest amplitude of those from `low_hz` on, `step_hz` apart.
fn strongest(codes: &[f64], low_hz: f64, high_hz: f64, step_hz: f64) -> f64 {
    let steps = ((high_hz - low_hz) / step_hz) as usize;
    (0..=steps)
        .map(|step| low_hz + step_hz * step as f64)
        .max_by(|one, other| amplitude(codes, *one).total_cmp(&amplitude(codes, *other)))
        .unwrap()
}

/// Likeness of a signal to itself some scans later, 1 at most.
fn likeness(codes: &[f64], lag: usize) -> f64 {
    let (front, rear) = (&codes[..codes.len() - lag], &codes[lag..]);
    let product: f64 = front.iter().zip(rear).map(|(a, b)| a * b).sum();
    product / (front.len() as f64 * (power(front) * power(rear)).sqrt())
}

/// The least lag, in scans, at which a signal is as it was, after it has been otherwise.
fn period(codes: &[f64]) -> usize {
    let differs = (1..).find(|&lag| likeness(codes, lag) < 0.8).unwrap();
    let alike = (differs..)
        .find(|&lag| likeness(codes, lag) > 0.97)
        .unwrap();
    // The top of that peak.
    (alike..alike + 40)
        .take_while(|&lag| likeness(codes, lag) > 0.9)
        .max_by(|one, other| likeness(codes, *one).total_cmp(&likeness(codes, *other)))
        .unwrap()
}

#[test]
fn a_seed_means_the_same_trial_on_every_machine() {
    let hashes = [1, 2, 3].map(|seed| {
        let trial = Trial::draw(seed);
        assert_eq!(trial, Trial::draw(seed));
        let record = trial.record();
        // FNV-1a over the codes and counts.
        let words = record.scans.iter().flatten().flatten();
        words
            .chain(&record.encoder)
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &word| {
                (hash ^ u64::from(word)).wrapping_mul(0x100_0000_01b3)
            })
    });
    let expected = [
        0x9e3a_d0a5_77a8_c397,
        0x96bc_f3b5_164d_101a,
        0x4186_ca82_75bb_6afe,
    ];
    assert_eq!(hashes, expected, "{hashes:#x?}");
}

#[test]
fn the_period_of_every_waveform_is_the_truth() {
    let harmonics = Waveform::Harmonics {
        shares: [1.2, 1.0],
        phases: [0.3, 2.0],
    };
    let weave = Waveform::Weave {
        second: 0.6,
        phase: 1.0,
        uneven: 0.0,
    };
    let waveforms = [
        (Class::Sine, Waveform::Sine),
        (
            Class::Trapezoid,
            Waveform::Trapezoid {
                duty: 0.2,
                flank: 0.05,
            },
        ),
        (Class::Smooth, Waveform::Smooth { sharpness: 6.0 }),
        (Class::Harmonics, harmonics),
        (Class::Weave, weave),
    ];
    for (class, waveform) in waveforms {
        for wavelength_mm in [0.9, 2.2, 5.0] {
            let record = clean_ridges(wavelength_mm, class, waveform).record();
            let codes = gauge(&record, 0);
            let lag = period(steady(&codes));
            let measured_mm = SPEED_MM_S * lag as f64 / SCANS_PER_S as f64;
            // A lag is whole scans.
            let step_mm = SPEED_MM_S / SCANS_PER_S as f64;
            assert!(
                (measured_mm - wavelength_mm).abs() <= step_mm,
                "{class:?} {wavelength_mm}: {measured_mm}"
            );
            assert!(
                record
                    .truth_mm
                    .iter()
                    .all(|truth| (f64::from(*truth) - wavelength_mm).abs() < 1e-6)
            );
        }
    }
}

#[test]
fn the_partials_of_a_wave_are_the_truth() {
    let harmonics = Waveform::Harmonics {
        shares: [0.6, 0.4],
        phases: [1.0, 2.5],
    };
    let trapezoid = Waveform::Trapezoid {
        duty: 0.3,
        flank: 0.1,
    };
    for waveform in [harmonics, trapezoid, Waveform::Smooth { sharpness: 3.0 }] {
        let record = clean_ridges(4.0, Class::Harmonics, waveform).record();
        let codes = gauge(&record, 2);
        let of = |n: f64| phasor(steady(&codes), n * SPEED_MM_S / 4.0);
        let back = of(1.0).conj() / of(1.0).norm();
        let truth = record.partials.expect("it has one wave");
        for (n, truth) in [2, 3].into_iter().zip(truth) {
            let felt = of(f64::from(n)) * back.powi(n) / of(1.0).norm();
            assert!(
                (felt - truth).norm() < 0.02,
                "{waveform:?} {n}: {felt} {truth}"
            );
        }
    }
    let two = Waveform::TwoWaves {
        ratio: 1.3,
        share: 0.5,
        phase: 0.0,
    };
    assert_eq!(
        clean_ridges(2.0, Class::TwoWaves, two).record().partials,
        None
    );
    let flat = clean(Class::Flat, Specimen::Plain(Plain::Flat));
    assert_eq!(flat.record().partials, None);
}

#[test]
fn a_form_has_no_short_waves() {
    const MM: f64 = 2_000.0;
    let ground = Ground {
        first: Specimen::Plain(Plain::Flat),
        second: None,
        texture: None,
        form: Some(Texture {
            share: 2.0,
            common: 1.0,
            corner_mm: 12.0,
            poles: POLES,
            longest_mm: 200.0,
        }),
        bend: None,
        contact_mm: 0.2,
    };
    let profile = ground.lay(0.0, MM, 1, &mut Dice::new(3, 1));
    let at = |point: usize| f64::from(profile.height(0, 0.1 * point as f64));
    // Against the middle of its neighbours 1 mm away, a wave of 4 mm keeps all its height, one of 12 mm 0.13 of it.
    let points = 10..(10.0 * MM) as usize - 10;
    let (mut all, mut short) = (0.0, 0.0);
    for point in points.clone() {
        all += at(point).powi(2);
        short += (at(point) - 0.5 * (at(point - 10) + at(point + 10))).powi(2);
    }
    let rms = (all / points.len() as f64).sqrt();
    assert!((rms - 2.0).abs() < 0.05, "{rms}");
    assert!((short / all).sqrt() < 0.1, "{}", (short / all).sqrt());
}

#[test]
fn of_two_waves_the_truth_is_the_stronger_and_the_weaker_has_its_share() {
    for ratio in [0.6, 1.7] {
        let waveform = Waveform::TwoWaves {
            ratio,
            share: 0.5,
            phase: 0.0,
        };
        let record = clean_ridges(2.0, Class::TwoWaves, waveform).record();
        let codes = gauge(&record, 0);
        let codes = steady(&codes);
        let measured_hz = strongest(codes, 8.0, 60.0, 0.1);
        assert!(
            (measured_hz - SPEED_MM_S / 2.0).abs() < 0.11,
            "{measured_hz}"
        );
        let [first, second] = [2.0, 2.0 * ratio].map(|mm| amplitude(codes, SPEED_MM_S / mm));
        // The resonance, at 400 Hz with a damping of 0.7, adds less than 1 % at 33 Hz.
        assert!(
            (second / first / 0.5 - 1.0).abs() < 0.02,
            "{}",
            second / first
        );
    }
}

#[test]
fn gradient_and_curve_move_the_truth_as_they_say() {
    let mut trial = clean_ridges(2.0, Class::Sine, Waveform::Sine);
    if let Specimen::Ridged(ridges) = &mut trial.ground.first {
        ridges.gradient = 0.1;
        ridges.gradient_mm = 60.0;
    }
    let truth_mm = trial.record().truth_mm;
    let spread = |truth_mm: &[f32]| {
        let least = truth_mm.iter().copied().fold(f32::INFINITY, f32::min);
        let most = truth_mm.iter().copied().fold(0.0, f32::max);
        [least, most]
    };
    let [least, most] = spread(&truth_mm);
    assert!(
        (least - 1.8).abs() < 1e-3 && (most - 2.2).abs() < 1e-3,
        "{least} {most}"
    );
    let mut trial = clean_ridges(2.0, Class::Sine, Waveform::Sine);
    trial.ground.bend = Some(Bend {
        angle: 0.5,
        period_mm: 80.0,
        phase: 0.0,
    });
    let [least, most] = spread(&trial.record().truth_mm);
    let longest = 2.0 / 0.5_f32.cos();
    assert!(
        (least - 2.0).abs() < 1e-3 && (most - longest).abs() < 1e-3,
        "{least} {most}"
    );
}

#[test]
fn a_boundary_changes_the_truth_and_the_travel_begins_anew_behind_it() {
    let mut trial = clean_ridges(2.0, Class::Sine, Waveform::Sine);
    trial.ground.second = Some(Second {
        ridges: ridges(4.0, Waveform::Sine),
        place: 0.5,
        level: 1.0,
        step: 0.0,
    });
    let record = trial.record();
    let change = record
        .truth_mm
        .windows(2)
        .position(|pair| pair[0] != pair[1])
        .unwrap();
    assert_eq!(
        (record.truth_mm[change], record.truth_mm[change + 1]),
        (2.0, 4.0)
    );
    assert_eq!(record.travelled_mm[change], 0.0);
    // Gauges are 4 mm apart: 2 mm each way, 50 ms.
    let under: Vec<usize> = (change - 200..change + 200)
        .filter(|&ms| record.travelled_mm[ms] == 0.0)
        .collect();
    assert!((under.len() as i32 - 100).abs() <= 1, "{}", under.len());
    let behind = under[under.len() - 1] + 100;
    // 100 ms of 40 mm/s.
    assert!((record.travelled_mm[behind] - 4.0).abs() < 0.1);
    // 12 mm of travel count on 4 mm: 300 ms.
    assert!(!record.counts(behind) && record.counts(behind + 210));
}

#[test]
fn encoders_count_five_micrometres_and_lose_what_they_say() {
    let mut encoder = Encoder {
        eccentricity_um: 0.0,
        turn_mm: 1.0,
        dither_um: 0.0,
        missed: 0.0,
    };
    let arm_mm: Vec<f64> = (0..40_000).map(|scan| 0.01 * f64::from(scan)).collect();
    let travelled = |encoder: &Encoder| {
        let counts = encoder.counts(&arm_mm, &mut Dice::new(3, 1));
        assert_eq!(counts.len(), 10_000);
        let steps = counts.windows(2);
        steps
            .map(|pair| i64::from(pair[1].wrapping_sub(pair[0]) as i16))
            .sum::<i64>()
    };
    // From the end of the first ms to the end of the last: 39 996 scans of two counts.
    let whole = travelled(&encoder);
    assert!((whole - 79_992).abs() <= 1, "{whole}");
    encoder.missed = 1e-3;
    let lost = whole - travelled(&encoder);
    // Binomial: 80 lost, σ = 9; 5 σ.
    assert!((lost - 80).abs() < 45, "{lost}");
}

#[test]
fn draws_keep_their_ranges_and_their_shares() {
    let count = 4_000;
    let trials: Vec<Trial> = (1..=count).map(Trial::draw).collect();
    let share = |is: &dyn Fn(&Trial) -> bool| {
        trials.iter().filter(|trial| is(trial)).count() as f64 / count as f64
    };
    let near = |measured: f64, due: f64| {
        // Binomial, 4 σ.
        let bound = 4.0 * (due * (1.0 - due) / count as f64).sqrt();
        assert!(
            (measured - due).abs() < bound,
            "{measured} instead of {due}"
        );
    };
    near(share(&|trial| trial.class.has_a_period()), 0.7);
    for class in Class::PERIODIC {
        near(share(&|trial| trial.class == class), 0.7 / 6.0);
    }
    for class in Class::PLAIN {
        near(share(&|trial| trial.class == class), 0.3 / 7.0);
    }
    near(share(&|trial| trial.pickup.pink > 0.0), 0.5);
    near(share(&|trial| trial.pickup.noise_corner_hz > 0.0), 0.4);
    near(share(&|trial| trial.pickup.snr_db < 0.0), 5.0 / 45.0);
    near(share(&|trial| trial.hand.hysteresis_mm > 0.0), 0.5);
    // All of "hum only", and 0.3 of the others.
    near(
        share(&|trial| trial.pickup.hum > 0.0),
        0.3 + 0.7 * 0.3 / 7.0,
    );
    let mut logs = Vec::new();
    for trial in &trials {
        let Pickup {
            snr_db,
            hum,
            hum_hz,
            resonance_hz,
            damping,
            ..
        } = trial.pickup;
        assert!((-5.0..=40.0).contains(&snr_db) && (0.0..=2.0).contains(&hum));
        assert!(
            [50.0, 60.0]
                .iter()
                .any(|mains: &f64| (hum_hz - mains).abs() <= 0.5)
        );
        assert!(resonance_hz >= 100.0 && (0.1..=0.7).contains(&damping));
        assert!((4.0..=10.0).contains(&trial.hand.duration_s));
        assert!((0.3..=0.6).contains(&trial.hand.rest_s));
        assert!(trial.hand.fastest_mm_s() <= 150.0 + 1e-9);
        assert!(trial.ground.longest_mm() <= 8.0 + 1e-9);
        assert_eq!(trial.class.has_a_period(), trial.ground.longest_mm() > 0.0);
        if let Stroke::Sinusoid { length_mm, .. } | Stroke::Reaches { length_mm, .. } =
            trial.hand.stroke
        {
            assert!(length_mm >= 4.0 * trial.ground.longest_mm());
        }
        if let Specimen::Ridged(ridges) = trial.ground.first {
            assert!((0.7..=7.0).contains(&ridges.wavelength_mm) && ridges.jitter <= 0.04);
            assert!(ridges.gradient * TAU / ridges.gradient_mm <= 0.01 + 1e-12);
            logs.push((ridges.wavelength_mm / 0.7).log10());
        }
        if let Some(second) = trial.ground.second {
            let Specimen::Ridged(first) = trial.ground.first else {
                panic!("a second specimen beside none with a period");
            };
            let ratio = second.ridges.wavelength_mm / first.wavelength_mm;
            assert!(ratio.max(1.0 / ratio) >= 1.25);
        }
    }
    // Uniform over a decade: mean 0.5, σ of it √(1/12n); 4 σ.
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    assert!(
        (mean - 0.5).abs() < 4.0 / (12.0 * logs.len() as f64).sqrt(),
        "{mean}"
    );
}

#[test]
fn records_are_whole_rest_first_and_hardly_clip() {
    let mut clipped = 0;
    let mut all = 0;
    for seed in 1..=40 {
        let trial = Trial::draw(seed);
        let record = trial.record();
        let count = record.scans.len();
        assert_eq!(count, trial.hand.milliseconds());
        for other in [
            record.encoder.len(),
            record.truth_mm.len(),
            record.speed_mm_s.len(),
            record.travelled_mm.len(),
        ] {
            assert_eq!(other, count);
        }
        let rest = (trial.hand.rest_s * 1e3) as usize;
        assert!(record.speed_mm_s[..rest].iter().all(|speed| *speed == 0.0));
        // Scatter of turns and times, and tremor, on top of 150 mm/s.
        assert!(record.speed_mm_s.iter().all(|speed| speed.abs() < 300.0));
        assert!((0..count).any(|ms| record.counts(ms)), "seed {seed}");
        let truth = record.truth_mm.iter();
        assert!(
            truth
                .clone()
                .all(|mm| (*mm > 0.0) == trial.class.has_a_period())
        );
        let codes = record.scans.iter().flatten().flat_map(|scan| &scan[..5]);
        clipped += codes
            .clone()
            .filter(|code| [0, 4_095].contains(*code))
            .count();
        all += codes.count();
        assert!(
            (1.0..=600.0).contains(&record.signal_rms),
            "{}",
            record.signal_rms
        );
    }
    assert!(clipped * 1_000 < all, "{clipped} of {all}");
}

#[test]
fn a_clean_surface_is_right_and_felt_right_and_a_flat_one_is_silent() {
    let played = |trial: &Trial| {
        play(
            &trial.record(),
            SensorConfiguration::DEFAULT,
            &Settings::DEFAULT,
        )
    };
    let clean_sine = played(&clean_ridges(2.0, Class::Sine, Waveform::Sine));
    // Of 5 s, 0.4 rest, 0.2 rise, and 6 mm of travel take 0.15.
    assert!((400..450).contains(&clean_sine.said.all));
    assert!((4_000..4_500).contains(&clean_sine.felt.all));
    for Counts {
        all, right, wrong, ..
    } in [clean_sine.said, clean_sine.felt]
    {
        assert!(
            right * 10 > all * 9 && wrong == 0,
            "{right} {wrong} of {all}"
        );
    }
    let harmonics = Waveform::Harmonics {
        shares: [0.6, 0.4],
        phases: [1.0, 2.5],
    };
    let harmonics = played(&clean_ridges(2.0, Class::Harmonics, harmonics)).shaped;
    assert!(
        harmonics.all > 80 && harmonics.right * 10 > harmonics.all * 8,
        "{harmonics:?}"
    );
    assert_eq!(harmonics.wrong, 0, "{harmonics:?}");
    // Twenty a second, none before the first two blocks of ground.
    let Counts {
        all, right, silent, ..
    } = clean_sine.shaped;
    assert!(
        all > 80 && silent < 10 && right + silent == all,
        "{right} {silent} of {all}"
    );
    let flat = played(&clean(Class::Flat, Specimen::Plain(Plain::Flat)));
    assert_eq!(flat.shaped, Counts::default());
    assert_eq!(
        (flat.said.silent, flat.felt.silent),
        (flat.said.all, flat.felt.all)
    );
    assert!(flat.felt.all > 4_000);
}

#[test]
fn time_counts_in_motion_in_the_band_and_after_three_waves() {
    let record = |speed_mm_s: f32, truth_mm: f32, travelled_mm: f32| Record {
        scans: Vec::new(),
        encoder: Vec::new(),
        truth_mm: vec![truth_mm],
        speed_mm_s: vec![speed_mm_s],
        travelled_mm: vec![travelled_mm],
        signal_rms: 1.0,
        partials: None,
    };
    for (speed_mm_s, truth_mm, travelled_mm, counts) in [
        (50.0, 2.0, 6.0, true),
        (-50.0, 2.0, 6.0, true),
        (50.0, 2.0, 5.9, false),
        (5.0, 1.0, 9.0, false),
        // 2.4 Hz, and 151 Hz.
        (12.0, 5.0, 90.0, false),
        (151.0, 1.0, 90.0, false),
        (150.0, 1.0, 90.0, true),
        // Without a period only the motion matters.
        (6.0, 0.0, 0.0, true),
        (4.0, 0.0, 90.0, false),
    ] {
        assert_eq!(
            record(speed_mm_s, truth_mm, travelled_mm).counts(0),
            counts,
            "{speed_mm_s} {truth_mm} {travelled_mm}"
        );
    }
}
