//! More than the sine: the surface's partials, and what does not repeat.

use std::f64::consts::TAU;

use firmware_display::limits::Limits;
use firmware_display::stimulus::MOST_V_PER_MS;
use firmware_display::wave::GLIDE_MS;
use firmware_display::{ACTUATORS, Stimulus};
use proptest::prelude::*;
use protocol::actuators::{Actuator, DEFAULT_ACTUATORS};
use protocol::texture::BANDS;
use protocol::{DisplayConfiguration, Mode, Partial, Rendering, Texture, UpdateRate};

use crate::stimulus::rig::{
    FULL, MODES, OFF_V, RATES, Rig, VOLT_PER_STEP, Volts, largest, means, trimmed, wavelength,
};

pub const RENDERINGS: [Rendering; 3] =
    [Rendering::Fundamental, Rendering::Shape, Rendering::Texture];

/// Ratios in thousandths and phases in turns of both partials, and levels of the bands in thousandths.
fn texture(partials: [(u16, f64); 2], bands: [u16; BANDS]) -> Texture {
    Texture {
        valid: true,
        partials: partials.map(|(ratio, turns)| Partial {
            ratio,
            phase: (turns * 65_536.0) as u16,
        }),
        bands,
        ..Texture::default()
    }
}

fn rig(rendering: Rendering, mode: Mode, update_rate: UpdateRate) -> Rig {
    let configuration = DisplayConfiguration {
        mode,
        rendering,
        update_rate,
        ..DisplayConfiguration::DEFAULT
    };
    Rig::with(configuration, DEFAULT_ACTUATORS)
}

/// sin θ + Σ rₙ sin(nθ + φₙ), of the partials that are told to be played.
fn shape(texture: &Texture, turns: f64, played: [f64; 2]) -> f64 {
    let partials = texture.partials.iter().zip(played).zip(2..);
    let sum: f64 = partials
        .map(|((partial, played), n)| {
            let phase = TAU * (f64::from(n) * turns + f64::from(partial.phase) / 65_536.0);
            played * f64::from(partial.ratio) / 1_000.0 * phase.sin()
        })
        .sum();
    (TAU * turns).sin() + sum
}

/// What a wave is multiplied with: 0.84 over its peak, or 1/(1 + r/0.8367) if that is more.
fn scale(texture: &Texture) -> f64 {
    let peak = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
        .into_iter()
        .flat_map(|played| {
            (0..1_000).map(move |i| shape(texture, f64::from(i) / 1_000.0, played).abs())
        })
        .fold(0.0, f64::max);
    let sum: f64 = texture
        .partials
        .iter()
        .map(|partial| f64::from(partial.ratio) / 1_000.0)
        .sum();
    (0.84 / peak).max(1.0 / (1.0 + sum / 0.836_7))
}

#[test]
fn the_partials_lie_on_the_surface_as_they_were_told_whichever_way_the_hand_goes() {
    let told = [
        texture([(500, 0.0), (0, 0.0)], [0; BANDS]),
        texture([(0, 0.0), (333, 0.0)], [0; BANDS]),
        texture([(800, 0.3), (700, 0.9)], [0; BANDS]),
        texture([(9_000, 0.6), (10_000, 0.1)], [0; BANDS]),
    ];
    for (texture, rate, mode, counts) in itertools(&told) {
        let mut rig = rig(Rendering::Shape, mode, rate);
        rig.actuators = trimmed();
        rig = Rig::with(rig.configuration, rig.actuators);
        // 35 Hz at either rate.
        let wavelength_mm = rig.hz() / 1_000.0;
        rig.follow(wavelength_mm);
        rig.stimulus.wear(texture);
        rig.rub(rig.ticks(2.5), counts);
        let scale = scale(texture);
        for _ in 0..500 {
            let volts = rig.tick(counts);
            for (volt, actuator) in volts.iter().zip(&rig.actuators) {
                let place_mm = match mode {
                    Mode::Uniform => 0.0,
                    Mode::Travelling => f64::from(actuator.x_um) / 1_000.0,
                };
                let turns = (rig.position_mm() + place_mm) / wavelength_mm
                    + f64::from(actuator.phase) / 65_536.0;
                let sign = if actuator.inverted { -5.0 } else { 5.0 };
                let amplitude = sign * f64::from(actuator.gain_q15) / 32_768.0;
                let exact = amplitude * scale * shape(texture, turns, [1.0; 2]);
                // Places that the peak is looked for at are 5 % apart at most; the phase drifts by half of 2⁻³² turns a
                // count and micrometre.
                let most = 0.06 * amplitude.abs() + OFF_V;
                assert!(
                    (volt - exact).abs() <= most,
                    "{texture:?} {mode:?}: {volt} {exact}"
                );
            }
        }
    }
}

/// How strong the second partial is, of the first, over whole waves of 400 counts.
fn second_partial(volts: &[Volts]) -> f64 {
    let part = |n: f64| {
        let turn = |tick: usize| TAU * n * tick as f64 * 7.0 / 400.0;
        let sum = |f: fn(f64) -> f64| {
            let parts = volts
                .iter()
                .enumerate()
                .map(|(tick, volt)| volt[0] * f(turn(tick)));
            parts.sum::<f64>()
        };
        sum(f64::sin).hypot(sum(f64::cos))
    };
    part(2.0) / part(1.0)
}

/// Where channels of different charges come to share a place there is no time for more than the sine, until they have
/// charges alike and the hand rests.
#[test]
fn the_sine_alone_is_played_while_channels_of_a_place_have_different_charges() {
    for rate in RATES {
        let mut rig = rig(Rendering::Fundamental, Mode::Travelling, rate);
        rig.actuators = trimmed();
        rig = Rig::with(rig.configuration, rig.actuators);
        rig.follow(2.0);
        // A hand that trembles leaves charges.
        rig.stroke(rig.ticks(1.0), |t| 0.15 * (TAU * 5.0 * t).sin());
        rig.actuators = DEFAULT_ACTUATORS;
        rig.configure(DisplayConfiguration {
            rendering: Rendering::Shape,
            ..rig.configuration
        });
        rig.rub(rig.ticks(0.05), 7);
        rig.stimulus
            .wear(&texture([(500, 0.0), (0, 0.0)], [0; BANDS]));
        for (seconds, played) in [(0.5, 0.0), (2.8, 0.5)] {
            rig.rub(rig.ticks(seconds), 7);
            rig.rub(rig.ticks(0.1), 0);
            rig.rub(rig.ticks(0.1), 7);
            let told = second_partial(&rig.rub(2_000, 7));
            assert!((told - played).abs() <= 0.01, "{rate:?}: {told}");
        }
    }
}

/// All of these with each texture.
fn itertools(told: &[Texture]) -> impl Iterator<Item = (&Texture, UpdateRate, Mode, i16)> {
    told.iter().flat_map(|texture| {
        RATES.into_iter().flat_map(move |rate| {
            MODES
                .into_iter()
                .flat_map(move |mode| [7, -7].map(|counts| (texture, rate, mode, counts)))
        })
    })
}

#[test]
fn a_surface_that_is_a_sine_is_played_as_the_fundamental_is() {
    for rate in RATES {
        for mode in MODES {
            let rendered = RENDERINGS.map(|rendering| {
                let mut rig = rig(rendering, mode, rate);
                rig.follow(2.0);
                rig.stimulus.wear(&texture([(0, 0.0); 2], [0; BANDS]));
                let mut volts = rig.rub(rig.ticks(0.5), 7);
                volts.extend(rig.rub(rig.ticks(0.5), -3));
                volts.extend(rig.rub(rig.ticks(0.5), 90));
                volts
            });
            for (sine, others) in rendered[0].iter().zip(rendered[1].iter().zip(&rendered[2])) {
                for (sine, other) in sine.iter().zip(others.0).chain(sine.iter().zip(others.1)) {
                    assert!((sine - other).abs() <= VOLT_PER_STEP, "{sine} {other}");
                }
            }
        }
    }
}

#[test]
fn a_partial_fades_from_two_hundred_hertz_on_and_is_gone_at_two_hundred_and_fifty() {
    let told = texture([(500, 0.2), (400, 0.7)], [0; BANDS]);
    for rate in RATES {
        for (hz, played) in [
            (66.0, [1.0, 1.0]),
            (75.0, [1.0, 0.5]),
            (84.0, [1.0, 0.0]),
            (112.5, [0.5, 0.0]),
            (126.0, [0.0, 0.0]),
            (240.0, [0.0, 0.0]),
        ] {
            let mut rig = rig(Rendering::Shape, Mode::Uniform, rate);
            let wavelength_mm = 20.0 * 0.005 * rig.hz() / hz;
            rig.follow(wavelength_mm);
            rig.stimulus.wear(&told);
            rig.rub(rig.ticks(2.5), 20);
            let scale = scale(&told);
            for _ in 0..300 {
                let [volt, ..] = rig.tick(20);
                let exact = 5.0 * scale * shape(&told, rig.position_mm() / wavelength_mm, played);
                // The peak is looked for at places up to 5 % of it apart.
                assert!(
                    (volt - exact).abs() <= 0.05 * 5.0,
                    "{hz} Hz: {volt} {exact}"
                );
            }
        }
    }
}

/// The balance, which knows nothing of places, lets a steady stroke alone once what its turning point has left is worked
/// off, in a second.
#[test]
fn the_same_place_always_plays_the_same_words() {
    let told = texture([(600, 0.4), (300, 0.1)], [150, 100, 200, 120]);
    for rate in RATES {
        for mode in MODES {
            let mut rig = rig(Rendering::Texture, mode, rate);
            rig.follow(2.0);
            rig.stimulus.wear(&told);
            rig.rub(rig.ticks(0.2), 7);
            let stroke = rig.ticks(2.0);
            let settled = rig.ticks(1.2);
            let first = rig.rub(stroke, 7);
            rig.rub(stroke, -7);
            let second = rig.rub(stroke, 7);
            assert!(first[settled..] == second[settled..], "{rate:?} {mode:?}");
            // And it is no sine: no wave is as the next.
            let wave = 400;
            let differ = (settled..stroke - wave)
                .filter(|&tick| (first[tick][0] - first[tick + wave][0]).abs() > 0.05);
            assert!(differ.count() > (stroke - wave - settled) / 2);
        }
    }
}

#[test]
fn in_travelling_mode_what_one_actuator_plays_the_next_plays_a_pitch_later() {
    let told = texture([(300, 0.4), (200, 0.1)], [0, 200, 200, 200]);
    let mut rig = rig(Rendering::Texture, Mode::Travelling, UpdateRate::Hz2000);
    rig.follow(2.0);
    rig.stimulus.wear(&told);
    rig.rub(rig.ticks(2.5), 5);
    let volts = rig.rub(2_000, 5);
    // 1.5 mm of 25 µm a tick.
    for (before, after) in volts.iter().zip(&volts[60..]) {
        for column in 1..10 {
            assert!((before[column] - after[column - 1]).abs() <= 2.0 * OFF_V);
        }
    }
}

#[test]
fn the_levels_of_the_bands_are_those_told() {
    // λ of 4 mm: all bands are played. Each alone, at a tenth: the sine is as good as whole beside it.
    for band in 0..BANDS {
        let mut bands = [0; BANDS];
        bands[band] = 100;
        let told = texture([(0, 0.0); 2], bands);
        let mut rig = rig(Rendering::Texture, Mode::Uniform, UpdateRate::Hz2000);
        rig.follow(4.0);
        rig.stimulus.wear(&told);
        rig.rub(rig.ticks(2.5), 5);
        let (mut sum, mut count) = (0.0, 0.0);
        let mut sine_v = 0.0;
        let volts: Vec<(f64, f64)> = (0..400_000)
            .map(|_| {
                let [volt, ..] = rig.tick(5);
                (volt, (TAU * rig.position_mm() / 4.0).sin())
            })
            .collect();
        for (volt, sine) in &volts {
            sine_v += 2.0 * volt * sine / volts.len() as f64;
        }
        for (volt, sine) in &volts {
            sum += (volt - sine_v * sine).powi(2);
            count += 1.0;
        }
        let ratio = f64::sqrt(sum / count) / sine_v;
        // 2.5 km of 8 to 1 mm: a few hundred to thousand points.
        assert!((ratio / 0.1 - 1.0).abs() < 0.1, "{band}: {ratio}");
        assert!((0.75..1.0).contains(&(sine_v / 5.0)), "{sine_v}");
    }
}

fn largest_step(volts: &[Volts]) -> f64 {
    let steps = volts.windows(2).flat_map(|pair| {
        let both = pair[0].iter().zip(pair[1]);
        both.map(|(before, after)| (after - before).abs())
    });
    steps.fold(0.0, f64::max)
}

#[test]
fn another_texture_makes_no_step_but_its_glides() {
    let told = [
        texture([(500, 0.0), (333, 0.5)], [300; BANDS]),
        texture([(10_000, 0.9), (0, 0.0)], [0; BANDS]),
        texture([(0, 0.0), (0, 0.0)], [10_000; BANDS]),
        texture([(0, 0.0), (10_000, 0.5)], [0, 10_000, 0, 10_000]),
        texture([(1, 0.0), (2, 0.5)], [3; BANDS]),
    ];
    for rate in RATES {
        for mode in MODES {
            for rendering in [Rendering::Shape, Rendering::Texture] {
                let mut rig = rig(rendering, mode, rate);
                rig.follow(4.0);
                rig.rub(rig.ticks(0.1), 4);
                let mut volts = Vec::new();
                for round in 0..60 {
                    rig.stimulus.wear(&told[round % told.len()]);
                    // Some come before the last is there.
                    volts.extend(rig.rub(rig.ticks(0.01) + 37 * (round % 5), 4));
                    if round % 7 == 0 {
                        rig.stimulus.wear_off();
                        volts.extend(rig.rub(70, 4));
                    }
                }
                // From one wave to another, |g| ≤ 1 of both.
                let glide = 2.0 / (f64::from(GLIDE_MS) * 1e-3 * rig.hz());
                // 0.02 mm a tick: of a third of 4 mm, or of half a millimetre, at full amplitude.
                let slope = TAU * 0.02 / 0.5;
                let most = 5.0 * (glide + slope) + 2.0 * OFF_V;
                let found = largest_step(&volts);
                assert!(found <= most, "{rendering:?} {mode:?}: {found} V, {most} V");
            }
        }
    }
}

#[test]
fn a_slow_hand_feels_no_step_at_all_when_the_texture_changes() {
    let told = [
        texture([(900, 0.0), (700, 0.5)], [0; BANDS]),
        texture([(900, 0.5), (700, 0.0)], [0; BANDS]),
    ];
    for rate in RATES {
        let mut rig = rig(Rendering::Shape, Mode::Uniform, rate);
        rig.follow(8.0);
        rig.rub(rig.ticks(0.1), 1);
        let mut volts = Vec::new();
        for round in 0..40 {
            rig.stimulus.wear(&told[round % 2]);
            volts.extend(rig.rub(rig.ticks(0.1), 1));
        }
        let glide = 2.0 / (f64::from(GLIDE_MS) * 1e-3 * rig.hz());
        let most = 5.0 * (glide + 3.0 * TAU * 0.005 / 8.0) + 2.0 * OFF_V;
        let found = largest_step(&volts);
        assert!(found <= most, "{found} V, {most} V");
    }
}

#[test]
fn in_steady_motion_no_shape_leaves_a_mean_over_whole_cycles() {
    for rate in RATES {
        for mode in MODES {
            for (ratios, turns) in [
                ((333, 0), 0.0),
                ((1_000, 400), 0.25),
                ((10_000, 9_000), 0.7),
            ] {
                let mut rig = rig(Rendering::Shape, mode, rate);
                rig.follow(400.0 * 0.005);
                let told = [(ratios.0, turns), (ratios.1, 2.0 * turns / 3.0)];
                rig.stimulus.wear(&texture(told, [0; BANDS]));
                rig.rub(rig.ticks(3.0), 7);
                let window = rig.ticks(1.0).div_ceil(400) * 400;
                let mean = largest(&means(&rig.rub(window, 7)));
                assert!(mean <= OFF_V, "{rate:?} {mode:?}: {mean} V");
            }
        }
    }
}

#[test]
fn strokes_leave_no_mean_in_any_rendering() {
    const STROKE_HZ: f64 = 0.83;
    let told = texture([(500, 0.2), (300, 0.6)], [200; BANDS]);
    for rendering in RENDERINGS {
        for mode in MODES {
            let mut worst = 0.0_f64;
            for wavelength_mm in [1.0, 2.0, 4.0] {
                let mut rig = rig(rendering, mode, UpdateRate::Hz2000);
                rig.follow(wavelength_mm);
                rig.stimulus.wear(&told);
                let half_mm = 70.0 / (TAU * STROKE_HZ);
                let position = |t: f64| -half_mm * (TAU * STROKE_HZ * t).cos();
                let volts = rig.stroke(rig.ticks(8.0), position);
                let stroke = rig.ticks(1.0 / STROKE_HZ);
                for from in (rig.ticks(3.0)..volts.len() - stroke).step_by(97) {
                    worst = worst.max(largest(&means(&volts[from..from + stroke])));
                }
            }
            println!("{rendering:?} {mode:?}: {:.2} mV", worst * 1e3);
            assert!(worst <= 0.005, "{rendering:?} {mode:?}: {worst} V");
        }
    }
}

/// A hand that swings about a place, or goes on.
#[derive(Clone, Copy, Debug)]
struct Swing {
    hz: f64,
    half_mm: f64,
    drift_mm_s: f64,
}

fn swing() -> impl Strategy<Value = Swing> {
    let hz = prop_oneof![0.3..3.0_f64, 3.0..25.0_f64];
    (
        hz,
        -2.5..1.3_f64,
        prop_oneof![4 => Just(0.0), 1 => -100.0..100.0_f64],
    )
        .prop_map(|(hz, decades, drift_mm_s)| Swing {
            hz,
            // No faster than a hand: 2 m/s.
            half_mm: 10_f64.powf(decades).min(1_800.0 / (TAU * hz)),
            drift_mm_s,
        })
}

fn ratio() -> impl Strategy<Value = u16> {
    prop_oneof![
        1 => Just(0),
        2 => 0..=1_000_u16,
        1 => 0..=10_000_u16,
        1 => Just(10_000),
    ]
}

fn any_texture() -> impl Strategy<Value = Texture> {
    (
        [ratio(), ratio()],
        any::<[u16; 2]>(),
        [ratio(), ratio(), ratio(), ratio()],
    )
        .prop_map(|(ratios, phases, bands)| Texture {
            valid: true,
            partials: std::array::from_fn(|n| Partial {
                ratio: ratios[n],
                phase: phases[n],
            }),
            bands,
            ..Texture::default()
        })
}

/// No model in half of all cases, else one for each of two kinds of actuators.
fn any_actuators() -> impl Strategy<Value = [Actuator; ACTUATORS]> {
    let model = || (200..=20_000_u16, 20..=1_000_u16);
    prop_oneof![
        Just(None),
        (model(), prop_oneof![Just((0, 0)), model()]).prop_map(Some),
    ]
    .prop_map(|models| {
        let mut actuators = DEFAULT_ACTUATORS;
        if let Some((even, odd)) = models {
            for (index, actuator) in actuators.iter_mut().enumerate() {
                let (resonance_dhz, damping_percent) = if index % 2 == 0 { even } else { odd };
                (actuator.resonance_dhz, actuator.damping_percent) =
                    (resonance_dhz, damping_percent);
            }
        }
        actuators
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn no_limit_is_broken_whatever_the_surface_the_hand_and_the_actuators_are(
        rendering in prop::sample::select(RENDERINGS.to_vec()),
        mode in prop::sample::select(MODES.to_vec()),
        update_rate in prop::sample::select(RATES.to_vec()),
        actuators in any_actuators(),
        amplitude_mv in prop_oneof![3 => Just(5_000_u16), 1 => 0..=5_000_u16],
        pieces in prop::collection::vec(
            (swing(), any_texture(), -0.5..1.0_f64, prop::bool::weighted(0.2)), 1..4
        ),
    ) {
        let configuration = DisplayConfiguration {
            mode,
            rendering,
            update_rate,
            amplitude_mv,
            ..DisplayConfiguration::DEFAULT
        };
        let mut stimulus = Stimulus::new(&configuration, &actuators);
        let mut limits = Limits::new(update_rate, amplitude_mv);
        let most = (f64::from(amplitude_mv) * 6.5536).ceil() as i32;
        let hz = f64::from(update_rate.hz());
        for (hand, texture, decades, forgets) in pieces {
            stimulus.follow(wavelength(2.0 * 10_f64.powf(decades)), 100.0);
            if forgets {
                stimulus.wear_off();
            } else {
                stimulus.wear(&texture);
            }
            let counts = |tick: u32| {
                let t = f64::from(tick) / hz;
                let place = hand.half_mm * (TAU * hand.hz * t).sin() + hand.drift_mm_s * t;
                (place / 0.005).floor() as i64
            };
            // The means of the limits take a second.
            for tick in 0..3 * update_rate.hz() {
                stimulus.tick((counts(tick + 1) - counts(tick)) as i16, FULL);
                prop_assert_eq!(limits.check(stimulus.words()), Ok(()), "tick {}", tick);
                for word in stimulus.words() {
                    prop_assert!((i32::from(*word) - 0x8000).abs() <= most.min(32_767));
                }
            }
        }
    }
}

/// The clamp on slew is for hands that cannot be; a hand at a steady speed never meets it, since what would be steeper
/// has been rolled off.
#[test]
fn no_steady_hand_is_cut_off_in_any_rendering() {
    let told = [
        texture([(1_000, 0.1), (1_000, 0.4)], [0; BANDS]),
        texture([(0, 0.0), (10_000, 0.4)], [0; BANDS]),
        texture([(500, 0.0), (300, 0.4)], [1_000; BANDS]),
        texture([(0, 0.0); 2], [0, 0, 0, 10_000]),
    ];
    let mut modelled = DEFAULT_ACTUATORS;
    for actuator in &mut modelled {
        (actuator.resonance_dhz, actuator.damping_percent) = (600, 70);
    }
    for rate in RATES {
        for texture in &told {
            for actuators in [DEFAULT_ACTUATORS, modelled] {
                for counts in 1..60 {
                    let configuration = DisplayConfiguration {
                        rendering: Rendering::Texture,
                        mode: Mode::Travelling,
                        update_rate: rate,
                        ..DisplayConfiguration::DEFAULT
                    };
                    let mut rig = Rig::with(configuration, actuators);
                    rig.follow(2.0);
                    rig.stimulus.wear(texture);
                    rig.rub(rig.ticks(0.1), counts);
                    let volts = rig.rub(rig.ticks(0.2), counts);
                    let most = f64::from(MOST_V_PER_MS) * 1_000.0 / rig.hz();
                    let found = largest_step(&volts);
                    assert!(found < most, "{rate:?} {texture:?} {counts}: {found} V");
                }
            }
        }
    }
}
