//! What the sensor says of a surface besides λ.

use std::cell::{Cell, RefCell};
use std::f64::consts::TAU;
use std::rc::Rc;

use protocol::texture::BANDS;
use protocol::texture::{NOT_MEASURED, measured};
use protocol::{Estimate, GAUGES, SensorConfiguration, Texture};

use crate::felt::{Bench, CODES, GAINS, NOISE_20_DB, PHASES_RAD, PLACES_MM};
use crate::rubbing::Noise;

/// A wave's shape: of the second and third partial ratio and phase in turns.
type Shape = [(f64, f64); 2];

const PLAIN: Shape = [(0.0, 0.0); 2];
/// λ in mm and speed in mm/s of what is rubbed.
const RUBS: [(f64, f64); 6] = [
    (0.7, 30.0),
    (1.0, 40.0),
    (2.0, 20.0),
    (2.0, 70.0),
    (4.0, 70.0),
    (7.5, 100.0),
];

fn wave(shape: Shape, theta: f64) -> f64 {
    let partial = |n: f64, (ratio, turns): (f64, f64)| ratio * (n * theta + TAU * turns).sin();
    theta.sin() + partial(2.0, shape[0]) + partial(3.0, shape[1])
}

/// A sum of forty sines of scattered phases in an octave of wavenumber, RMS 1, at x in mm.
fn random(band: usize, x_mm: f64) -> f64 {
    let sine = |n: f64| {
        let per_mm = 0.125 * 2_f64.powf(band as f64 + (n + 0.5) / 40.0);
        (TAU * (per_mm * x_mm + (n * n * 0.618_034).fract())).sin()
    };
    (0..40).map(|n| sine(f64::from(n))).sum::<f64>() / 20_f64.sqrt()
}

/// What there is to feel of a wavelength in mm, a shape, and a random part in a band.
#[derive(Clone, Copy)]
struct Ground {
    wavelength_mm: f64,
    shape: Shape,
    random: Option<(usize, f64)>,
}

impl Ground {
    fn felt(&self, gauge: usize, x_mm: f64) -> f64 {
        let theta = TAU * (x_mm + PLACES_MM[gauge]) / self.wavelength_mm + PHASES_RAD[gauge];
        let irregular = self.random.map_or(0.0, |(band, rms)| {
            rms * random(band, x_mm + PLACES_MM[gauge])
        });
        CODES * GAINS[gauge] * (wave(self.shape, theta) + irregular)
    }
}

/// A bench that has made strokes of half a second over `ground` for `ms`, with noise of so many dB below it.
fn rubbed(ground: Ground, snr_db: f64, speed_mm_s: f64, ms: u64) -> Bench {
    let mut bench = noisy(snr_db);
    rub(&mut bench, ground, speed_mm_s, ms);
    bench
}

fn noisy(snr_db: f64) -> Bench {
    let mut bench = Bench::new(SensorConfiguration::DEFAULT);
    bench.noise_lsb = NOISE_20_DB * 10_f64.powf((20.0 - snr_db) / 20.0);
    bench
}

fn rub(bench: &mut Bench, ground: Ground, speed_mm_s: f64, ms: u64) {
    rub_by([1.0; GAUGES], bench, ground, speed_mm_s, ms);
}

/// Half a second there, half a second back: the velocity in mm/s, of s since the start.
fn strokes(speed_mm_s: f64) -> impl Fn(f64) -> f64 {
    move |t_s| {
        let there = ((2.0 * t_s) as u64).is_multiple_of(2);
        if there { speed_mm_s } else { -speed_mm_s }
    }
}

/// By gauges that feel the ground so many times as high, negative upside down.
fn rub_by(polarity: [f64; GAUGES], bench: &mut Bench, ground: Ground, speed_mm_s: f64, ms: u64) {
    bench.rub(ms, strokes(speed_mm_s), |gauge, x_mm, _| {
        polarity[gauge] * ground.felt(gauge, x_mm)
    });
}

/// By how much the partials that are told are off, at worst: in dB, and in degrees.
fn off(texture: &Texture, shape: Shape) -> (f64, f64) {
    let pairs = texture.partials.iter().zip(shape);
    pairs.fold((0.0, 0.0), |(db, degrees), (partial, (ratio, turns))| {
        let ratio_db = 20.0 * (f64::from(partial.ratio) / 1_000.0 / ratio).log10();
        let phase = f64::from(partial.phase) / 65_536.0 - turns;
        let phase = 360.0 * (phase - phase.round());
        (f64::max(db, ratio_db.abs()), f64::max(degrees, phase.abs()))
    })
}

fn last_valid(bench: &Bench) -> Texture {
    let valid = bench.textures.iter().rev().find(|told| told.valid);
    *valid.unwrap_or_else(|| panic!("none is valid: {:?}", bench.textures))
}

#[test]
fn partials_are_within_a_db_and_five_degrees_at_20_db_and_three_db_at_0_db() {
    let shapes = [
        [(0.4, 0.1), (0.25, 0.7)],
        [(0.25, 0.55), (0.3, 0.0)],
        [(0.3, 0.9), (0.5, 0.3)],
    ];
    for (snr_db, most_db, most_degrees) in [(20.0, 1.0, 5.0), (0.0, 3.0, 30.0)] {
        let (mut worst_db, mut worst_degrees) = (0.0, 0.0);
        for (wavelength_mm, speed_mm_s) in RUBS {
            for shape in shapes {
                let ground = Ground {
                    wavelength_mm,
                    shape,
                    random: None,
                };
                let textures = rubbed(ground, snr_db, speed_mm_s, 4_000).textures;
                let late: Vec<_> = textures.iter().skip(30).filter(|told| told.valid).collect();
                assert!(
                    late.len() >= 20,
                    "{snr_db} dB {wavelength_mm} mm: {} valid of {}",
                    late.len(),
                    textures.len()
                );
                for texture in late {
                    let (db, degrees) = off(texture, shape);
                    let what = format!("{snr_db} dB {wavelength_mm} mm {shape:?}: {texture:?}");
                    assert!(db <= most_db, "{db} dB: {what}");
                    assert!(degrees <= most_degrees, "{degrees}°: {what}");
                    worst_db = f64::max(worst_db, db);
                    worst_degrees = f64::max(worst_degrees, degrees);
                }
            }
        }
        println!("{snr_db} dB: {worst_db:.2} dB, {worst_degrees:.1}° at worst");
    }
}

/// What is told at `snr_db` by gauges of that polarity.
fn told_by(polarity: [f64; GAUGES], ground: Ground, snr_db: f64) -> Vec<Texture> {
    let mut bench = noisy(snr_db);
    rub_by(polarity, &mut bench, ground, 70.0, 8_000);
    let valid: Vec<_> = bench
        .textures
        .into_iter()
        .filter(|told| told.valid)
        .collect();
    assert!(valid.len() >= 100, "{} valid", valid.len());
    valid
}

/// Above 200 Hz the gauges do not tell: a third partial of 210 Hz, and a band that ends above it.
#[test]
fn what_was_too_fast_to_be_measured_is_told_as_such_until_it_is_measured() {
    for (wavelength_mm, speed_mm_s, partials, bands) in [
        (2.0, 140.0, [true, false], [true, true, true, false]),
        (2.0, 220.0, [false, false], [true, true, false, false]),
        (4.0, 250.0, [true, true], [true, true, false, false]),
        (2.0, 60.0, [true, true], [true; 4]),
    ] {
        let ground = Ground {
            wavelength_mm,
            shape: [(0.5, 0.25), (0.3, 0.5)],
            random: None,
        };
        let mut bench = rubbed(ground, 20.0, speed_mm_s, 3_000);
        let known = |told: Texture| {
            let ratios = told.partials.map(|partial| partial.ratio);
            (
                ratios.map(|ratio| measured(ratio).is_some()),
                told.bands.map(|band| measured(band).is_some()),
            )
        };
        let told = last_valid(&bench);
        assert_eq!(known(told), (partials, bands), "{speed_mm_s}: {told:?}");
        rub(&mut bench, ground, 50.0, 4_000);
        let told = last_valid(&bench);
        assert_eq!(known(told), ([true; 2], [true; 4]), "{told:?}");
        let (db, _) = off(&told, ground.shape);
        assert!(db < 1.0, "{told:?}");
    }
}

#[test]
fn gauges_that_feel_the_wave_upside_down_tell_of_the_same_partials() {
    let ground = Ground {
        wavelength_mm: 2.0,
        shape: [(0.4, 0.1), (0.25, 0.7)],
        random: None,
    };
    // Upside down, the even partials are half a turn further from the fundamental.
    let upside_down = [(0.4, 0.6), (0.25, 0.7)];
    for (polarity, shape) in [
        ([1.0, -1.0, 1.0, 1.0, 1.0], ground.shape),
        ([1.0, -1.0, 1.0, 1.0, -1.0], ground.shape),
        ([-1.0, 1.0, -1.0, -1.0, -1.0], upside_down),
        ([-1.0; 5], upside_down),
    ] {
        for texture in told_by(polarity, ground, 20.0) {
            let (db, degrees) = off(&texture, shape);
            assert!(
                db <= 1.0 && degrees <= 5.0,
                "{polarity:?}, {db} dB, {degrees}°: {texture:?}"
            );
        }
    }
}

#[test]
fn gauges_of_which_half_feel_the_wave_upside_down_do_not_change_their_mind() {
    let ground = Ground {
        wavelength_mm: 2.0,
        shape: [(0.4, 0.1), (0.25, 0.7)],
        random: None,
    };
    let told = told_by([1.0, -1.0, 1.0, -1.0, 0.0], ground, 0.0);
    for pair in told[20..].windows(2) {
        let [before, now] = [&pair[0].partials[0], &pair[1].partials[0]];
        let turned = now
            .phase
            .wrapping_sub(before.phase)
            .cast_signed()
            .unsigned_abs();
        assert!(turned < 1 << 14, "from {before:?} to {now:?}");
        assert!((250..550).contains(&now.ratio), "{now:?}");
    }
}

#[test]
fn what_does_not_repeat_is_told_in_its_band_whatever_the_speed() {
    let told_db = |told: u16| 20.0 * (f64::from(told).max(1.0) / 300.0).log10();
    for (wavelength_mm, speed_mm_s) in [(1.0, 40.0), (2.0, 20.0), (2.0, 70.0), (4.0, 70.0)] {
        for band in 0..BANDS {
            let ground = Ground {
                wavelength_mm,
                shape: PLAIN,
                random: Some((band, 0.3)),
            };
            let told = last_valid(&rubbed(ground, 20.0, speed_mm_s, 6_000));
            let what = format!("{wavelength_mm} mm, {speed_mm_s} mm/s, band {band}: {told:?}");
            // Of the lowest band, a block of 12 mm has one line, of which the fitted slope takes its share.
            let least_db = if (band, wavelength_mm) == (0, 4.0) {
                -9.0
            } else {
                -6.5
            };
            let own_db = told_db(told.bands[band]);
            assert!((least_db..1.0).contains(&own_db), "{own_db} dB: {what}");
            for (other, &level) in told.bands.iter().enumerate() {
                assert!(
                    other == band || told_db(level) < own_db - 2.5,
                    "band {other}: {what}"
                );
            }
            assert!((75..=97).contains(&told.repeating_percent), "{what}");
        }
    }
}

#[test]
fn noise_is_no_texture() {
    let plain = |wavelength_mm| Ground {
        wavelength_mm,
        shape: PLAIN,
        random: None,
    };
    for (wavelength_mm, speed_mm_s) in RUBS {
        for (snr_db, most, least_percent) in [(20.0, 30, 99), (0.0, 150, 94)] {
            let bench = rubbed(plain(wavelength_mm), snr_db, speed_mm_s, 4_000);
            let told = last_valid(&bench);
            let what = format!("{wavelength_mm} mm, {speed_mm_s} mm/s, {snr_db} dB: {told:?}");
            let bands = told.bands.into_iter().filter(|&band| band != NOT_MEASURED);
            assert!(bands.max().is_some_and(|band| band <= most), "{what}");
            let ratios = told.partials.map(|partial| partial.ratio);
            assert!(ratios.iter().all(|&ratio| ratio <= most / 3), "{what}");
            assert!(told.repeating_percent >= least_percent, "{what}");
        }
    }
}

#[test]
fn another_surface_is_not_told_of_by_what_was_felt_of_the_one_before() {
    let [one, other] = [(2.0, 0.5), (3.0, 0.2)].map(|(wavelength_mm, ratio)| Ground {
        wavelength_mm,
        shape: [(ratio, 0.25), (0.2, 0.5)],
        random: None,
    });
    let mut bench = rubbed(one, 20.0, 60.0, 3_000);
    assert!(off(&last_valid(&bench), one.shape).0 < 1.0);
    bench.textures.clear();
    rub(&mut bench, other, 60.0, 3_000);
    let of_other = bench
        .textures
        .iter()
        .filter(|told| told.valid && off(told, other.shape).0 < 1.0);
    let of_one = bench
        .textures
        .iter()
        .filter(|told| told.valid && off(told, one.shape).0 < 1.0);
    assert!(of_other.count() > 30, "{:?}", bench.textures);
    // Until λ̂ is the new one's.
    assert!(of_one.count() <= 6, "{:?}", bench.textures);
    // Some ms in a dozen belong to both.
    let neither = bench.textures.iter().filter(|told| {
        told.valid && off(told, other.shape).0 > 3.0 && off(told, one.shape).0 > 3.0
    });
    assert!(neither.count() <= 1, "{:?}", bench.textures);
}

#[test]
fn a_slow_stroke_tells_of_its_texture_too() {
    let shape = [(0.4, 0.1), (0.25, 0.7)];
    for (wavelength_mm, speed_mm_s) in [(8.0, 30.0), (4.0, 15.0), (2.0, 8.0), (0.7, 3.0)] {
        let ground = Ground {
            wavelength_mm,
            shape,
            random: None,
        };
        let mut bench = Bench::new(SensorConfiguration::DEFAULT);
        bench.noise_lsb = NOISE_20_DB;
        let felt = |gauge: usize, x_mm: f64, _| ground.felt(gauge, x_mm);
        bench.rub(12_000, |_| speed_mm_s, felt);
        let (db, degrees) = off(&last_valid(&bench), shape);
        assert!(db <= 1.0, "{wavelength_mm} mm, {speed_mm_s} mm/s: {db} dB");
        assert!(
            degrees <= 5.0,
            "{wavelength_mm} mm, {speed_mm_s} mm/s: {degrees}°"
        );
    }
}

#[test]
fn a_fingertip_that_comes_down_again_tells_nothing_of_the_surface_before() {
    let surface = |shape| Ground {
        wavelength_mm: 2.0,
        shape,
        random: None,
    };
    let (before, behind) = ([(0.5, 0.1), (0.1, 0.7)], [(0.1, 0.1), (0.5, 0.2)]);
    let mut bench = Bench::new(SensorConfiguration::DEFAULT);
    bench.noise_lsb = NOISE_20_DB;
    // Down at 3 times the wave's amplitude, up at 100 mm, down again at 200.
    let felt = |gauge: usize, x_mm: f64, _| match x_mm {
        ..100.0 => surface(before).felt(gauge, x_mm) + 3.0 * CODES * GAINS[gauge],
        ..200.0 => 0.0,
        _ => surface(behind).felt(gauge, x_mm) + 3.0 * CODES * GAINS[gauge],
    };
    bench.rub(7_000, |_| 50.0, felt);
    let told = bench.textures.iter().filter(|told| told.valid);
    let told: Vec<_> = told.filter(|told| told.instant_us > 4_050_000).collect();
    assert!(told.len() > 30, "{} are valid", told.len());
    for texture in told {
        let (db, degrees) = off(texture, behind);
        assert!(
            db <= 1.0 && degrees <= 5.0,
            "{db} dB, {degrees}°: {texture:?}"
        );
    }
}

#[test]
fn textures_bear_their_estimates_number_and_come_every_50_ms_while_the_arm_moves() {
    let ground = Ground {
        wavelength_mm: 2.0,
        shape: PLAIN,
        random: None,
    };
    let mut bench = rubbed(ground, 20.0, 60.0, 1_000);
    assert!((18..=20).contains(&bench.textures.len()));
    let numbered = bench.textures.windows(2).all(|pair| {
        pair[1].sequence == pair[0].sequence + 5 && pair[1].instant_us > pair[0].instant_us
    });
    assert!(numbered, "{:?}", bench.textures);
    assert!(bench.textures.iter().all(Texture::is_sound));
    bench.textures.clear();
    bench.rub(1_000, |_| 0.0, |gauge, x_mm, _| ground.felt(gauge, x_mm));
    assert!(bench.textures.len() <= 1, "{:?}", bench.textures);
}

#[test]
fn the_force_is_told_by_its_mean_and_fluctuation_against_the_movement() {
    let configuration = SensorConfiguration {
        force_channel: true,
        force_mn_per_v: 1_000,
        stiffness_n_per_m: 60_000,
        ..SensorConfiguration::DEFAULT
    };
    let ground = Ground {
        wavelength_mm: 2.0,
        shape: PLAIN,
        random: None,
    };
    let mut bench = Bench::new(configuration);
    // 0.5 N against the movement, and a sine of 0.1 N over place.
    let (mean_mn, swing_mn) = (500.0, 100.0);
    bench.force_mn = Some(Box::new(move |x_mm, forwards| {
        let against = mean_mn + swing_mn * (TAU * x_mm / 2.0).sin();
        if forwards { against } else { -against }
    }));
    rub(&mut bench, ground, 60.0, 3_000);
    let friction = last_valid(&bench)
        .friction
        .expect("there is a force channel");
    assert!(friction.mean_mn.abs_diff(500) <= 10, "{friction:?}");
    // A sine's RMS.
    assert!(friction.fluctuation_mn.abs_diff(71) <= 4, "{friction:?}");
    assert_eq!(
        last_valid(&rubbed(ground, 20.0, 60.0, 3_000)).friction,
        None
    );
}

/// Textures of strokes by a fingertip that is a spring of 400 N/m and slides where it pulls with `slides_n`, told by a force
/// channel that reads 50 mN at rest, with so much noise a scan.
fn slid(ground: Ground, speed_mm_s: f64, slides_n: f64, noise_n: f64) -> Vec<Texture> {
    const K_N_PER_MM: f64 = 0.4;
    let mut bench = Bench::new(SensorConfiguration {
        force_channel: true,
        force_mn_per_v: 1_000,
        stiffness_n_per_m: 400,
        ..SensorConfiguration::DEFAULT
    });
    let contact_mm = Rc::new(Cell::new(0.0));
    let (felt_mm, pulled_mm) = (contact_mm.clone(), contact_mm);
    let noise = RefCell::new(Noise::new(1));
    bench.force_mn = Some(Box::new(move |x_mm, _| {
        let noise_n = noise_n * noise.borrow_mut().normal();
        50.0 + 1e3 * (K_N_PER_MM * (x_mm - pulled_mm.get()) + noise_n)
    }));
    bench.rub(6_000, strokes(speed_mm_s), |gauge, x_mm, _| {
        let lag_mm = x_mm - felt_mm.get();
        let most_mm = slides_n / K_N_PER_MM;
        felt_mm.set(x_mm - lag_mm.clamp(-most_mm, most_mm));
        ground.felt(gauge, felt_mm.get())
    });
    bench.textures
}

#[test]
fn noise_of_the_force_channel_costs_no_textures() {
    let shape = [(0.4, 0.1), (0.25, 0.7)];
    for (wavelength_mm, speed_mm_s) in [(2.0, 60.0), (4.0, 60.0), (2.0, 30.0), (1.0, 30.0)] {
        let ground = Ground {
            wavelength_mm,
            shape,
            random: None,
        };
        let told = [0.0, 0.02].map(|noise_n| {
            let told = slid(ground, speed_mm_s, 0.5, noise_n);
            let valid: Vec<_> = told.iter().filter(|told| told.valid).copied().collect();
            (valid.len(), valid.last().copied())
        });
        let [(without, _), (with, texture)] = told;
        let what =
            format!("{wavelength_mm} mm, {speed_mm_s} mm/s: {with} of {without} {texture:?}");
        assert!(without >= 100 && 100 * with >= 98 * without, "{what}");
        let texture = texture.expect("some are valid");
        let (db, degrees) = off(&texture, shape);
        assert!(db <= 1.0 && degrees <= 5.0, "{db} dB, {degrees}°: {what}");
        let friction = texture.friction.expect("it slides");
        assert!(friction.mean_mn.abs_diff(500) <= 10, "{what}");
        // Half the noise is left behind the filter. Turns do not count.
        assert!(friction.fluctuation_mn <= 12, "{what}");
    }
}

/// Travel on `ground` after which 3 λ of it in a row are stood by, within 5 %, in mm. The fingertip comes down on it after
/// `air_mm`, in which there is noise alone.
fn learned_after_mm(ground: Ground, air_mm: f64) -> f64 {
    let mut bench = Bench::new(SensorConfiguration::DEFAULT);
    bench.noise_lsb = 0.05 * CODES;
    // It is the same ground, wherever the air ends.
    let felt = |gauge: usize, x_mm: f64| match x_mm - air_mm {
        on_mm if on_mm > 0.0 => ground.felt(gauge, on_mm) + 3.0 * CODES * GAINS[gauge],
        _ => 0.0,
    };
    let speed_mm_s = 50.0;
    let ms = ((air_mm + 150.0) / speed_mm_s * 1_000.0) as u64;
    let estimates = bench.rub(ms, |_| speed_mm_s, |gauge, x_mm, _| felt(gauge, x_mm));
    let row = (3.0 * ground.wavelength_mm / speed_mm_s * 100.0) as usize;
    let is_right = |estimate: &Estimate| {
        let mm = estimate.wavelength_mm.filter(|_| estimate.valid);
        mm.is_some_and(|mm| (f64::from(mm) / ground.wavelength_mm - 1.0).abs() < 0.05)
    };
    let learned = estimates.windows(row).find(|row| row.iter().all(is_right));
    let at_us = learned.expect("the ground is long enough")[0].instant_us;
    at_us as f64 * 1e-6 * speed_mm_s - air_mm
}

#[test]
fn a_fingertip_that_comes_down_on_its_way_learns_nearly_as_soon_as_one_that_starts_there() {
    let (mut started_mm, mut landed_mm) = (0.0, 0.0);
    for wavelength_mm in [1.6, 3.0, 6.0] {
        for band in [1, 2] {
            let ground = Ground {
                wavelength_mm,
                shape: PLAIN,
                random: Some((band, 0.6)),
            };
            started_mm += learned_after_mm(ground, 0.0);
            landed_mm += learned_after_mm(ground, 60.0);
        }
    }
    assert!(
        landed_mm <= 1.3 * started_mm,
        "{landed_mm} mm after landing, {started_mm} from the start, on six grounds"
    );
}
