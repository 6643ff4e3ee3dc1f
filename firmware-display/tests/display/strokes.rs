//! What a hand can do to the limits: how close a stimulus that works comes to those of energy and of
//! standing voltage, see `firmware_display::limits`.

use std::f64::consts::TAU;

use firmware_display::limits::{MOST_ENERGY_V2, MOST_STANDING_V};
use protocol::{DisplayConfiguration, DisplayState, Estimate, UpdateRate};

use crate::rig::{Rig, at, sound};

/// The limits' time constant.
const MEAN_S: f64 = 1.024;

/// The largest means of V² and of |V|.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    energy_v2: f64,
    standing_v: f64,
}

/// The worst of channels at both ends and in the middle in 5 s of a hand at `position_mm` of the time in
/// s over a surface of `wavelength_mm`.
fn worst(
    configuration: &DisplayConfiguration,
    wavelength_mm: f32,
    position_mm: impl Fn(f64) -> f64,
) -> Worst {
    let mut rig = Rig::new(configuration);
    let rate_hz = f64::from(configuration.update_rate.hz());
    let counts = |t_s: f64| (position_mm(t_s) / 0.005).round() as i32;
    let part = 1.0 / (MEAN_S * rate_hz);
    let mut here = counts(0.0);
    let mut means = [(0.0_f64, 0.0_f64); 3];
    let mut worst = Worst::default();
    for tick in 0..rig.ticks(5_000) {
        if tick.is_multiple_of(rig.ticks(10)) {
            // Of an arm that goes along, and so is slow while the hand is.
            rig.tell(Estimate {
                velocity_um_s: 0,
                ..sound(0, wavelength_mm)
            });
        }
        let next = counts(f64::from(tick) / rate_hz);
        rig.tick((next - here) as i16);
        here = next;
        assert_eq!(rig.state(), DisplayState::Driving, "{wavelength_mm} mm");
        for ((energy, standing), channel) in means.iter_mut().zip([0, 25, 49]) {
            let volts = (f64::from(rig.display.words()[channel]) - 32_768.0) / 6_553.6;
            *energy += (volts * volts - *energy) * part;
            *standing += (volts - *standing) * part;
            worst.energy_v2 = worst.energy_v2.max(*energy);
            worst.standing_v = worst.standing_v.max(standing.abs());
        }
    }
    worst
}

/// Strokes of all lengths and speeds, about places all over the wave.
fn worst_of_all(rate: UpdateRate) -> Worst {
    let configuration = at(rate);
    let mut all = Worst::default();
    let mut note = |one: Worst| {
        all.energy_v2 = all.energy_v2.max(one.energy_v2);
        all.standing_v = all.standing_v.max(one.standing_v);
    };
    for wavelength_mm in [0.5, 2.0, 4.0, 20.0_f32] {
        let mm = f64::from(wavelength_mm);
        for hz in [0.3, 0.83, 3.0, 8.0] {
            // Trembling, swinging over half a wavelength, rubbing.
            for length_mm in [0.02, 0.05 * mm, 0.25 * mm, 0.305 * mm, 0.5 * mm, 13.4] {
                if TAU * hz * length_mm > 500.0 {
                    continue;
                }
                for place in [0.0, 0.125, 0.25] {
                    let onset = |t: f64| (t / 0.05).min(1.0);
                    note(worst(&configuration, wavelength_mm, |t| {
                        onset(t) * (place * mm + length_mm * (TAU * hz * t).sin())
                    }));
                }
            }
        }
        // Creeping, and going on from crest to trough every half second.
        for creep_mm_s in [0.5, 1.0, 3.0] {
            note(worst(&configuration, wavelength_mm, |t| {
                0.25 * mm * (t / 0.05).min(1.0) + creep_mm_s * t
            }));
            note(worst(&configuration, wavelength_mm, |t| {
                let halves = (2.0 * t).floor();
                let way = (2.0 * t - halves) / 0.1;
                (0.25 + 0.5 * (halves + way.min(1.0))) * mm + creep_mm_s * t
            }));
        }
    }
    all
}

fn assert_far_from_the_limits(rate: UpdateRate) {
    let Worst {
        energy_v2,
        standing_v,
    } = worst_of_all(rate);
    println!("{rate:?}: {energy_v2:.2} V², {standing_v:.3} V");
    assert!(energy_v2 < 0.9 * f64::from(MOST_ENERGY_V2));
    assert!(standing_v < 0.6 * f64::from(MOST_STANDING_V));
    // The strokes are the ones that matter.
    assert!(energy_v2 > 17.0 && standing_v > 1.0);
}

#[test]
fn no_stroke_of_a_hand_comes_near_the_limits_of_energy_and_standing_voltage() {
    assert_far_from_the_limits(UpdateRate::Hz2000);
}

#[test]
fn nor_does_one_at_the_higher_rate() {
    assert_far_from_the_limits(UpdateRate::Hz4000);
}
