//! What there is in the words besides the stimulus.
//!
//! A hand of a whole number of counts c a tick, on a λ of a whole number of counts n, plays c cycles in n
//! ticks, so that the words repeat every n ticks and a discrete Fourier transform over a multiple of n ticks
//! shows each of their lines in a bin of its own, undiminished. What does not repeat so, if anything, lies
//! between bins in the worst case, where a bin shows 2/π of it, −3.9 dB: the bound is lower by that much.

use std::f64::consts::{FRAC_2_PI, TAU};

use firmware_display::balance::TIME_CONSTANT_S;
use protocol::{DisplayConfiguration, Mode, UpdateRate};

use crate::stimulus::rig::{MODES, RATES, Rig, Volts, trimmed};

/// −80 dBc.
const SPUR: f64 = 1e-4 * FRAC_2_PI;

/// Amplitudes of 0 to 1 kHz, a bin for each cycle in all of `volts`.
fn spectrum(volts: &[Volts], actuator: usize, tick_hz: f64) -> Vec<f64> {
    let length = volts.len();
    let cosines: Vec<_> = (0..length)
        .map(|i| (TAU * i as f64 / length as f64).cos())
        .collect();
    let bins = (1_000.0 / tick_hz * length as f64) as usize;
    (0..=bins)
        .map(|bin| {
            let (mut re, mut im) = (0.0, 0.0);
            let mut angle = 0;
            for volts in volts {
                re += volts[actuator] * cosines[angle];
                im += volts[actuator] * cosines[(angle + length - length / 4) % length];
                angle = (angle + bin) % length;
            }
            // A line at 0, or at half the rate, has no partner at a negative frequency.
            let partners = if bin == 0 || 2 * bin == length {
                1.0
            } else {
                2.0
            };
            partners * f64::hypot(re, im) / length as f64
        })
        .collect()
}

/// The largest line besides the one of `cycles`, as a part of that.
fn largest_spur(spectrum: &[f64], cycles: usize) -> f64 {
    let others = spectrum
        .iter()
        .enumerate()
        .filter(|(bin, _)| *bin != cycles);
    others.map(|(_, line)| *line).fold(0.0, f64::max) / spectrum[cycles]
}

/// Largest spur of a steady hand after its start is forgotten, of the actuators named.
fn spur_of(mut rig: Rig, counts: i16, lambda_counts: usize, actuators: &[usize]) -> f64 {
    rig.follow(lambda_counts as f64 * 0.005);
    // 5 V are 1 µV after 15 time constants.
    rig.rub(rig.ticks(15.5 * TIME_CONSTANT_S), counts);
    let repeats = rig.ticks(0.5) / (4 * lambda_counts) + 1;
    let volts = rig.rub(4 * repeats * lambda_counts, counts);
    let cycles = 4 * repeats * counts.unsigned_abs() as usize;
    let spurs = actuators
        .iter()
        .map(|actuator| largest_spur(&spectrum(&volts, *actuator, rig.hz()), cycles));
    spurs.fold(0.0, f64::max)
}

/// Counts a tick and a wavelength of 5 to 200 Hz at 2 kHz.
const STIMULI: [(i16, usize); 9] = [
    (1, 400),
    (2, 311),
    (-7, 400),
    (7, 166),
    (9, 200),
    (-3, 50),
    (47, 613),
    (13, 130),
    (5, 50),
];

#[test]
fn spurs_are_below_minus_80_dbc_from_5_to_200_hz_uniform_and_travelling() {
    let mut worst: f64 = 0.0;
    for rate in RATES {
        for mode in MODES {
            for (counts, lambda_counts) in STIMULI {
                // The same frequency at 4 kHz is of a wavelength twice as long.
                let lambda_counts = lambda_counts * rate.hz() as usize / 2_000;
                let actuators: &[usize] = match mode {
                    Mode::Uniform => &[0],
                    Mode::Travelling => &[0, 4, 9],
                };
                let spur = spur_of(Rig::new(mode, rate), counts, lambda_counts, actuators);
                assert!(
                    spur <= SPUR,
                    "{rate:?} {mode:?} {counts}/{lambda_counts}: {spur:e}"
                );
                worst = worst.max(spur);
            }
        }
    }
    println!("worst spur {:.1} dBc", 20.0 * worst.log10());
}

#[test]
fn phases_and_gains_of_their_own_add_none() {
    let mut worst: f64 = 0.0;
    for rate in RATES {
        for mode in MODES {
            for (counts, lambda_counts) in [(1, 400), (7, 166), (5, 50)] {
                let lambda_counts = lambda_counts * rate.hz() as usize / 2_000;
                let configuration = DisplayConfiguration {
                    mode,
                    update_rate: rate,
                    ..DisplayConfiguration::DEFAULT
                };
                let rig = Rig::with(configuration, trimmed());
                let spur = spur_of(rig, counts, lambda_counts, &[0, 23, 49]);
                worst = worst.max(spur);
                assert!(
                    spur <= SPUR,
                    "{rate:?} {mode:?} {counts}/{lambda_counts}: {spur:e}"
                );
            }
        }
    }
    println!("worst spur with trims {:.1} dBc", 20.0 * worst.log10());
}

/// The encoder knows the hand to 5 µm: a phase that rises evenly rises by whole counts, with a saw-tooth of
/// Δ = 2π 5 µm/λ from peak to peak. The saw-tooth's fundamental, Δ/π, turns the phase to and fro, which is a
/// line of Δ/2π = 5 µm/λ on either side of the stimulus: −46 dBc on 1 mm, whatever is done behind the encoder
/// without making it late.
#[test]
fn between_whole_counts_a_tick_the_encoder_adds_five_micrometres_over_lambda() {
    for (wavelength_mm, speed_mm_s) in [(1.0, 50.3), (2.0, 50.4), (4.0, 81.2)] {
        let mut rig = Rig::new(Mode::Uniform, UpdateRate::Hz2000);
        rig.follow(wavelength_mm);
        let start = rig.ticks(15.5 * TIME_CONSTANT_S);
        // Ten seconds hold whole cycles of both the stimulus and the saw-tooth.
        let volts = rig.stroke(start + rig.ticks(10.0), |t| 0.0012 + speed_mm_s * t);
        let lines = spectrum(&volts[start..], 0, rig.hz());
        let cycles = 10.0 * speed_mm_s / wavelength_mm;
        let spur = largest_spur(&lines, cycles.round() as usize);
        let expected = 0.005 / wavelength_mm;
        println!(
            "{speed_mm_s} mm/s on {wavelength_mm} mm: {:.1} dBc",
            20.0 * spur.log10()
        );
        // Within 1 dB: the saw-tooth is sampled, and its harmonics fold back on each other.
        assert!(
            (0.89..1.12).contains(&(spur / expected)),
            "{spur:e} {expected:e}"
        );
    }
}
