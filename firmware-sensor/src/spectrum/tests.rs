//! Each part alone, on paths whose truth is known.

extern crate std;

use core::f32::consts::TAU;
use std::vec::Vec;

use protocol::{GAUGES, SensorConfiguration};

use super::Spectrum;
use super::fit::{Fitted, LENGTH_COUNT, LENGTHS, Pass};
use super::knots::{Knot, Knots, SPACINGS_MM, spacing_for};
use super::periodogram::{
    CANDIDATES, Periodogram, clearest_peak, highest_peak, sharpness, vertex_mm, wavelength_mm,
};
use super::sidebands::wave_of;
use super::trend::Trend;
use crate::estimator::{Estimator, Finding, Touch};
use crate::travel::{PLACES_PER_MM, Travel};

const ALL: u8 = 0b1_1111;
const NO_BASE: [f32; GAUGES] = [0.0; GAUGES];

/// Even noise between −1 and 1, the same each time.
struct Noise(u32);

impl Noise {
    fn even(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 8_388_608.0 - 1.0
    }
}

/// A path of `ms` milliseconds at `mm_per_ms`, turned round every `stroke_ms`, over what `felt` says of a place in
/// mm and a gauge.
fn path(
    ms: i32,
    mm_per_ms: f32,
    stroke_ms: i32,
    mut felt: impl FnMut(f32, usize) -> f32,
) -> (Knots, Periodogram) {
    let (mut knots, mut periodogram) = (Knots::new(), Periodogram::new());
    let places = (mm_per_ms * PLACES_PER_MM as f32) as i32;
    let mut place = 0;
    for step in 0..ms {
        place += if step / stroke_ms % 2 == 0 {
            places
        } else {
            -places
        };
        let mm = place as f32 / PLACES_PER_MM as f32;
        let gauges = core::array::from_fn(|gauge| felt(mm, gauge));
        knots.push(place, places, &gauges, |spacing, knot| {
            periodogram.push(spacing, knot);
        });
    }
    (knots, periodogram)
}

fn wave(mm: f32, gauge: usize, wavelength_mm: f32) -> f32 {
    let phase = 0.7 * gauge as f32;
    300.0 * libm::sinf(TAU * libm::fmodf(mm, wavelength_mm) / wavelength_mm + phase)
}

fn run(knots: &Knots, start_mm: f32) -> Pass {
    let mut pass = Pass::default();
    pass.begin(start_mm, 0..LENGTH_COUNT, ALL, NO_BASE);
    while pass.run(knots, 7) == 0 {}
    pass
}

#[test]
fn knots_are_as_long_as_their_spacing_says_and_come_newest_first() {
    // Pieces that divide no spacing.
    for mm_per_ms in [0.013, 0.037, 0.071] {
        let (knots, _) = path(4_000, mm_per_ms, 1_000_000, |mm, _| mm);
        for (spacing, nominal_mm) in SPACINGS_MM.into_iter().enumerate() {
            let (partial, mut reader) = knots.backwards(spacing);
            let mut all: Vec<Knot> = partial.into_iter().collect();
            while let Some(knot) = knots.next(&mut reader) {
                all.push(*knot);
            }
            let whole = &all[1..all.len() - 1];
            assert!(whole.len() > 20, "{}", whole.len());
            let mean_mm = whole.iter().map(|knot| knot.travel_mm).sum::<f32>() / whole.len() as f32;
            // To half a piece, of which coarse ones are fine knots.
            let piece_mm = if spacing == 0 { mm_per_ms } else { 0.142 };
            assert!(
                (mean_mm - nominal_mm).abs() <= 0.51 * piece_mm,
                "{mean_mm} mm for {nominal_mm} at {mm_per_ms}"
            );
            for pair in whole.windows(2) {
                assert!(pair[0].place > pair[1].place);
                // What a knot says is the mean over it, as its place is.
                let mm = pair[0].place as f32 / PLACES_PER_MM as f32;
                assert!((pair[0].gauges[0] - mm).abs() < 1e-3 * (1.0 + mm));
            }
        }
    }
}

#[test]
fn a_spacing_leaves_enough_knots_a_wave() {
    for number in 0..CANDIDATES {
        let mm = wavelength_mm(number);
        let knots = mm / SPACINGS_MM[spacing_for(mm)];
        assert!((5.0..=18.0).contains(&knots), "{knots} at {mm} mm");
    }
}

#[test]
fn a_fit_finds_the_wave_over_every_length_from_a_start_a_little_off_with_a_slope_and_round_turns() {
    for truth_mm in [0.7_f32, 1.3, 2.1, 3.4, 7.6] {
        for stroke_ms in [1_000_000, 700] {
            let felt = |mm: f32, gauge: usize| wave(mm, gauge, truth_mm) + 40.0;
            let (knots, _) = path(6_000, 0.04, stroke_ms, felt);
            // A second pass from what the first found, as the next estimate does it.
            let first = run(&knots, truth_mm * 1.01);
            for (n, fitted) in first.found.into_iter().enumerate() {
                let fitted = fitted.expect("the path is long enough");
                let again = run(&knots, fitted.wavelength_mm).found[n].expect("as before");
                let off = (again.wavelength_mm / truth_mm - 1.0).abs();
                assert!(
                    off < 1.5e-3,
                    "{off} of {truth_mm} mm over {} waves",
                    LENGTHS[n]
                );
                assert!(again.share() > 0.99, "{}", again.share());
            }
        }
    }
}

#[test]
fn a_fit_knows_how_far_off_it_is_in_white_noise() {
    let mut noise = Noise(5);
    let (mut squares, mut sigmas, mut count) = ([0.0_f32; LENGTH_COUNT], [0.0; LENGTH_COUNT], 0.0);
    for _ in 0..60 {
        let felt = |mm: f32, gauge: usize| wave(mm, gauge, 2.0) + 150.0 * noise.even();
        let (knots, _) = path(500, 0.04, 1_000_000, felt);
        let found = run(&knots, 2.0).found;
        for (n, fitted) in found.into_iter().enumerate() {
            let fitted = fitted.expect("the path is long enough");
            squares[n] += (fitted.wavelength_mm / 2.0 - 1.0).powi(2);
            sigmas[n] += fitted.sigma * fitted.sigma;
        }
        count += 1.0;
    }
    for n in 0..LENGTH_COUNT {
        let ratio = (squares[n] / sigmas[n]).sqrt();
        // 60 draws tell a deviation to 9 %; a knot's mean takes some of the wave for noise.
        assert!(
            (0.7..1.3).contains(&ratio),
            "{ratio} over {} waves",
            LENGTHS[n]
        );
        assert!((sigmas[n] / count).sqrt() < 0.02);
    }
}

#[test]
fn a_gauge_that_says_nothing_takes_no_part_in_a_fit() {
    // Its codes stand still; what is left of them beside their mean is rounding.
    for standing in [0.0, 37.0, -301.7, 1_983.3] {
        let felt = |mm: f32, gauge: usize| match gauge {
            3 => standing,
            _ => wave(mm, gauge, 2.0),
        };
        let (knots, _) = path(6_000, 0.05, 1_000_000, felt);
        for (n, fitted) in run(&knots, 2.02).found.into_iter().enumerate() {
            let fitted = fitted.expect("the path is long enough");
            let off = (fitted.wavelength_mm / 2.0 - 1.0).abs();
            assert!(
                off < 3e-3,
                "{off} over {} waves beside {standing}",
                LENGTHS[n]
            );
        }
    }
}

#[test]
fn a_path_too_short_has_no_fit() {
    let (knots, _) = path(60, 0.04, 1_000_000, |mm, gauge| wave(mm, gauge, 2.0));
    assert_eq!(run(&knots, 2.0).found.iter().flatten().count(), 0);
    // Nor has one that only trembles by a twentieth of a wave.
    let (knots, _) = path(2_000, 0.02, 5, |mm, gauge| wave(mm, gauge, 2.0));
    assert_eq!(run(&knots, 2.0).found.iter().flatten().count(), 0);
}

#[test]
fn a_peak_lies_where_the_wave_is_between_candidates_and_is_sharp() {
    for truth_mm in [0.83_f32, 1.2, 2.6, 4.4, 6.1] {
        let (_, periodogram) = path(8_000, 0.04, 1_000_000, |mm, gauge| {
            wave(mm, gauge, truth_mm)
        });
        let energies = periodogram.energies(ALL).long;
        let peak = highest_peak(&energies).expect("there is a wave");
        let off = (vertex_mm(&energies, peak, true) / truth_mm - 1.0).abs();
        assert!(off < 0.02, "{off} of {truth_mm} mm");
        assert!(sharpness(&energies, peak) > 2.5);
    }
}

#[test]
fn gauges_that_are_left_out_have_no_energy() {
    let only_two = |mm: f32, gauge: usize| if gauge < 2 { wave(mm, gauge, 2.0) } else { 0.0 };
    let (_, periodogram) = path(4_000, 0.04, 1_000_000, only_two);
    let total = |usable| periodogram.energies(usable).long.iter().sum::<f32>();
    assert!(total(0b0_0011) > 1e3);
    assert!((total(ALL) / total(0b0_0011) - 1.0).abs() < 1e-6);
    assert_eq!(total(0b1_1100), 0.0);
    // Those that feel nothing hardly change what the others count for.
    let share = |usable, number: usize| periodogram.energies(usable).long[number] / total(usable);
    for number in 0..CANDIDATES {
        assert!((share(ALL, number) - share(0b0_0011, number)).abs() < 1e-3);
    }
}

#[test]
fn a_gauge_with_ten_times_the_gain_does_not_outvote_the_others() {
    let felt = |mm: f32, gauge: usize| match gauge {
        0 => 10.0 * wave(mm, gauge, 2.0),
        _ => wave(mm, gauge, 3.2),
    };
    let (_, periodogram) = path(8_000, 0.04, 1_000_000, felt);
    let energies = periodogram.energies(ALL).long;
    let peak = highest_peak(&energies).expect("there are waves");
    assert!((wavelength_mm(peak) / 3.2 - 1.0).abs() < 0.06, "{peak}");
}

#[test]
fn the_clearest_peak_is_a_line_beside_what_is_random_and_higher() {
    let mut spectrum = [0.0; CANDIDATES];
    for (number, energy) in spectrum.iter_mut().enumerate() {
        // A broad hump around 22.
        *energy = (10.0 - 0.08 * (number as f32 - 22.0).powi(2)).max(0.1);
    }
    spectrum[9] += 4.0;
    assert_eq!(highest_peak(&spectrum), Some(22));
    assert_eq!(clearest_peak(&spectrum), Some(9));
    assert_eq!(clearest_peak(&[0.0; CANDIDATES]), None);
    // Nothing is known of what is next to it.
    spectrum[10] = 0.0;
    assert_eq!(clearest_peak(&spectrum), Some(22));
}

#[test]
fn a_slope_lifts_no_long_wave() {
    let sloping = |mm: f32, gauge: usize| wave(mm, gauge, 1.2) + 400.0 * mm;
    let (_, periodogram) = path(8_000, 0.04, 1_000_000, sloping);
    let energies = periodogram.energies(ALL).long;
    let peak = highest_peak(&energies).expect("there is a wave");
    assert!((wavelength_mm(peak) / 1.2 - 1.0).abs() < 0.07, "{peak}");
    let long: f32 = energies[18..].iter().sum();
    assert!(long < 0.02 * energies[peak], "{long} {}", energies[peak]);
}

/// The averaged spectrum of what is felt on a straight path, and the bank behind it.
fn averaged(felt: impl FnMut(f32, usize) -> f32) -> (Periodogram, [f32; CANDIDATES]) {
    let (_, mut periodogram) = path(3_000, 0.05, 3_000, felt);
    periodogram.average(&periodogram.energies(ALL), 100.0);
    let averaged = periodogram.averaged();
    (periodogram, averaged)
}

/// Where each gauge lies, in mm.
const LIE_MM: [f32; GAUGES] = [-1.9, -0.8, 0.0, 1.3, 2.2];

/// The candidate nearest to a line.
fn nearest(per_mm: f32) -> usize {
    let away = |number: usize| (wavelength_mm(number) * per_mm.abs() - 1.0).abs();
    (0..CANDIDATES)
        .min_by(|&one, &other| away(one).total_cmp(&away(other)))
        .unwrap()
}

/// A wave that a fingertip feels whose place hops to and fro, so many times a mm, by so many rad of the wave's phase.
fn hopping(
    wave_per_mm: f32,
    hops_per_mm: f32,
    depth: f32,
    lie_mm: [f32; GAUGES],
) -> impl Fn(f32, usize) -> f32 {
    move |mm, gauge| {
        let hop = depth * libm::sinf(TAU * hops_per_mm * mm);
        300.0 * libm::sinf(TAU * wave_per_mm * (mm + lie_mm[gauge]) + hop)
    }
}

#[test]
fn the_wave_is_found_among_the_sidebands_of_a_hopping_fingertip() {
    // Hops of 1.6 rad make sidebands at 0.714 ± 0.5 per mm that are half as strong again as the wave.
    let (wave, lower, upper) = (nearest(0.714), nearest(0.214), nearest(1.214));
    let (periodogram, spectrum) = averaged(hopping(0.714, 0.5, 1.6, LIE_MM));
    assert!(spectrum[lower] > spectrum[wave] && spectrum[upper] > spectrum[wave]);
    for line in [lower, wave, upper] {
        assert_eq!(wave_of(&periodogram, &spectrum, line, ALL), wave, "{line}");
    }
    // Where all gauges lie at the same place, or there is one alone, another wave would look alike.
    for line in [lower, upper] {
        assert_eq!(wave_of(&periodogram, &spectrum, line, 1), line);
    }
    let (periodogram, spectrum) = averaged(hopping(0.714, 0.5, 1.6, [0.0; GAUGES]));
    for line in [lower, upper] {
        assert_eq!(wave_of(&periodogram, &spectrum, line, ALL), line);
    }
}

#[test]
fn other_waves_of_a_surface_are_no_sidebands() {
    let lines = [(0.214, 1.2), (0.714, 1.0), (1.214, 1.2)];
    let (periodogram, spectrum) = averaged(|mm, gauge| {
        lines
            .iter()
            .map(|&(per_mm, share)| share * hopping(per_mm, 0.0, 0.0, LIE_MM)(mm, gauge))
            .sum()
    });
    for (per_mm, _) in lines {
        let line = nearest(per_mm);
        assert_eq!(wave_of(&periodogram, &spectrum, line, ALL), line);
    }
}

#[test]
fn a_sideband_that_is_too_long_to_be_seen_is_missed_from_the_centre() {
    // At 0.36 ± 0.4 per mm: the lower one is 23 mm long.
    let (wave, upper) = (nearest(0.357), nearest(0.757));
    let (periodogram, spectrum) = averaged(hopping(0.357, 0.4, 1.3, LIE_MM));
    for line in [wave, upper] {
        assert_eq!(wave_of(&periodogram, &spectrum, line, ALL), wave, "{line}");
    }
}

/// A trend along strokes of 20 mm, of fits that are about a place 5 mm behind and off by `noise`, and of an average that
/// is not.
fn trend(ln_mm: impl Fn(f32) -> f32, mut noise: impl FnMut() -> f32) -> (Trend, f32) {
    let (mut trend, mut mm) = (Trend::default(), 0.0);
    for step in 0..300 {
        let forth = step / 40 % 2 == 0;
        mm += if forth { 0.5 } else { -0.5 };
        let behind_mm = if forth { mm - 5.0 } else { mm + 5.0 };
        let place = |mm: f32| (mm * PLACES_PER_MM as f32) as i32;
        let peak_mm = libm::expf(ln_mm(mm + trend.average_mm()));
        trend.advance(place(mm), 0.2, peak_mm);
        let fit_mm = libm::expf(ln_mm(behind_mm) + noise());
        trend.take(place(behind_mm), fit_mm, 0.2);
    }
    (trend, mm)
}

#[test]
fn the_trend_tells_the_wavelength_here() {
    let (trend, mm) = trend(|mm| 1.0 + 0.008 * mm, || 0.0);
    let course = trend.course().unwrap();
    assert!(
        (course.here - (1.0 + 0.008 * mm)).abs() < 1e-3,
        "{course:?} at {mm} mm"
    );
    assert!((course.slope - 0.008).abs() < 3e-4, "{course:?}");
}

#[test]
fn the_trend_finds_no_slope_in_chance() {
    let mut noise = Noise(7);
    let (trend, _) = trend(|_| 1.0, || 0.03 * noise.even());
    let course = trend.course().unwrap();
    assert!((course.here - 1.0).abs() < 0.01, "{course:?}");
    assert!(course.slope.abs() < 0.001, "{course:?}");
}

#[test]
fn the_trend_forgets_what_is_long_past() {
    let (mut trend, _) = trend(|mm| 1.0 + 0.008 * mm, || 0.0);
    let mm = libm::expf(1.0);
    for step in 0..20_000 {
        trend.advance(step, 0.2, mm);
        for said in [trend.of_average(mm), trend.of_fit(mm, 0)] {
            assert!(said.is_finite() && said > 0.0, "{said} mm after {step}");
        }
    }
    assert!(trend.course().is_none());
}

/// What an estimator says last of an arm at 30 mm/s, by `touch` at each millisecond and place in mm.
fn rubbed(configuration: &SensorConfiguration, touch: impl Fn(u16, f32) -> Touch) -> Finding {
    let mut spectrum = Spectrum::new(configuration);
    let mut travel = Travel::new(0);
    let mut finding = Finding::default();
    for ms in 0..3_000_u16 {
        // 6 counts of 5 µm.
        travel.push(6 * ms);
        let place = travel.place(0);
        let mm = place as f32 / PLACES_PER_MM as f32;
        spectrum.push(&Touch {
            place,
            usable: ALL,
            ..touch(ms, mm)
        });
        if ms % 10 == 9 {
            finding = spectrum.find(&travel);
        }
    }
    finding
}

#[test]
fn slips_are_looked_for_as_long_as_the_force_channel_does_not_tell_them() {
    // For 8 of 50 ms the fingertip slips.
    let slips = |ms: u16, mm: f32| {
        core::array::from_fn(|gauge| {
            let slip = if ms % 50 < 8 { 100.0 } else { 0.0 };
            wave(mm, gauge, 2.0) + slip * libm::sinf(TAU * 0.15 * f32::from(ms % 20))
        })
    };
    for force_channel in [false, true] {
        for deflection_known in [false, true] {
            let configuration = SensorConfiguration {
                force_channel,
                ..SensorConfiguration::DEFAULT
            };
            let finding = rubbed(&configuration, |ms, mm| Touch {
                gauges: slips(ms, mm),
                deflection_known,
                ..Touch::default()
            });
            assert_eq!(finding.jerky, !deflection_known, "{finding:?}");
        }
    }
}

#[test]
fn what_was_found_several_times_in_a_row_is_not_counted_on_where_nothing_is_found() {
    let mut spectrum = Spectrum::new(&SensorConfiguration::DEFAULT);
    (spectrum.sure_mm, spectrum.sure_times) = (2.0, 4);
    let nothing = spectrum.find(&Travel::new(0));
    assert_eq!(nothing, Finding::default());
    assert_eq!(spectrum.sure_times, 0);
}

#[test]
fn a_landing_is_felt_by_most_gauges_and_not_by_one_that_breaks() {
    let lands = |air_mm: f32, louder: u8, usable: u8| {
        // Noise of 10 steps, and a wave of 300 from there on.
        let mut noise = Noise(7);
        let (mut knots, mut periodogram) = (Knots::new(), Periodogram::new());
        let mut landed = false;
        let places = PLACES_PER_MM / 20;
        for step in 1..=((air_mm + 4.0) * 20.0) as i32 {
            let place = step * places;
            let mm = place as f32 / PLACES_PER_MM as f32;
            let gauges = core::array::from_fn(|gauge| {
                let is_louder = mm > air_mm && louder >> gauge & 1 == 1;
                let felt = if is_louder { wave(mm, gauge, 1.0) } else { 0.0 };
                felt + 10.0 * noise.even()
            });
            knots.push(place, places, &gauges, |spacing, knot| {
                periodogram.push(spacing, knot);
            });
            let now = periodogram.energies(usable);
            landed |= periodogram.lands(&now, usable);
            periodogram.average(&now, 0.05);
        }
        landed
    };
    assert!(lands(30.0, ALL, ALL) && lands(30.0, 0b0_0111, ALL));
    assert!(!lands(30.0, 0b0_0011, ALL));
    // Of those that can be used.
    assert!(lands(30.0, 0b0_0011, 0b0_0111) && !lands(30.0, 0b0_0111, 0b1_1100));
    // Where it starts there is nothing to compare with.
    assert!(!lands(1.0, ALL, ALL) && !lands(30.0, 0, ALL));
}

#[test]
fn the_wavelength_of_a_peak_is_that_of_the_line_that_made_it() {
    // What one and two poles leave of a wave, at each candidate.
    for both_poles in [false, true] {
        for wanted_mm in [1.1_f32, 1.9, 2.05, 3.3] {
            let spectrum = core::array::from_fn(|i| {
                let off = 6.0 * (wavelength_mm(i) / wanted_mm - 1.0);
                let one_pole = 100.0 / (1.0 + off * off);
                if both_poles {
                    one_pole * one_pole
                } else {
                    one_pole
                }
            });
            let peak = highest_peak(&spectrum).expect("a peak");
            let mm = vertex_mm(&spectrum, peak, both_poles);
            assert!(
                (mm / wanted_mm - 1.0).abs() < 1e-3,
                "{mm} for {wanted_mm} mm"
            );
        }
    }
    // The ends have no neighbours, and a plain no vertex.
    let flat = [1.0; CANDIDATES];
    for number in [0, 5, CANDIDATES - 1] {
        assert_eq!(vertex_mm(&flat, number, true), wavelength_mm(number));
    }
}

#[test]
fn the_highest_peak_is_at_neither_end() {
    let mut spectrum = [1.0; CANDIDATES];
    spectrum[0] = 9.0;
    spectrum[CANDIDATES - 1] = 9.0;
    spectrum[1] = 2.0;
    spectrum[CANDIDATES - 3] = 3.0;
    assert_eq!(highest_peak(&spectrum), Some(CANDIDATES - 3));
    spectrum[CANDIDATES - 3] = 1.0;
    spectrum[CANDIDATES - 2] = 10.0;
    assert_eq!(highest_peak(&spectrum), Some(CANDIDATES - 2));
}

#[test]
fn the_clearest_peak_is_not_the_highest_of_what_is_random() {
    let mut spectrum = [1.0; CANDIDATES];
    // A hill of low frequencies, and a line that stands on its own.
    for (number, height) in [(14, 8.0), (15, 9.0), (16, 10.0), (17, 9.0), (18, 8.0)] {
        spectrum[number] = height;
    }
    spectrum[6] = 6.0;
    assert_eq!(highest_peak(&spectrum), Some(16));
    assert_eq!(clearest_peak(&spectrum), Some(6));
}

#[test]
fn a_fits_shares_are_of_all_energy_and_of_each_usable_gauge_alike() {
    let fitted = Fitted {
        total: 200.0,
        explained: 150.0,
        totals: [100.0, 50.0, 0.0, 50.0, 80.0],
        explaineds: [90.0, 10.0, 0.0, 20.0, 80.0],
        ..Fitted::default()
    };
    assert_eq!(fitted.share(), 0.75);
    assert_eq!(Fitted::default().share(), 0.0);
    // The gauge without any energy has no share, and the last one is not usable.
    let share = fitted.gauges_share(0b0_1111);
    assert!((share - 0.5).abs() < 1e-6, "{share}");
    assert_eq!(fitted.gauges_share(0b0_0100), 0.0);
}
