//! The maps there are.

use std::ops::RangeInclusive;

use super::Map;
use super::axis::Axis;
use super::error::MapError;
use super::knob::Knob;

/// Noise of all maps but the one that changes it.
const SNR_DB: f64 = 20.0;
/// Speed of the maps that need some constant speed.
const SPEED_MM_S: f64 = 50.0;
/// Reversals of the paper's Fig. 7.
const FIG_7_HZ: f64 = 0.83;
/// λ of the map of second waves. They are weaker than the first, and not near twice as long: there λ
/// is the first's beyond dispute.
const SECOND_WAVE_TO_MM: f64 = 2.0;
/// Encoders: the model's counter has steps of 5 µm.
const ENCODER_UM: [f64; 11] = [
    5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 70.0, 100.0, 150.0, 200.0,
];

/// All maps, in order.
pub fn catalogue() -> Vec<Map> {
    let noise = || Knob::SNR.at(SNR_DB);
    let speed = || Knob::SPEED.at(SPEED_MM_S);
    // What wavelengths are held against, at some speed and noise.
    let against = |name, title, conditions, x| Map {
        name,
        title,
        conditions,
        x,
        y: wavelength(-3..=19),
        base: vec![noise(), speed()],
    };
    let usual = "50 mm/s, 20 dB";
    let harmonic = "second harmonic, relative";
    let wave = "amplitude of the second wave, relative";
    vec![
        Map {
            name: "speed-wavelength",
            title: "Rubbing speed × wavelength",
            conditions: "constant speed, 20 dB",
            x: Axis::log("speed v in mm/s", Knob::SPEED, 3.0, 200.0, 40),
            y: wavelength(-8..=24),
            base: vec![noise()],
        },
        Map {
            name: "snr-wavelength",
            title: "Noise × wavelength",
            conditions: "50 mm/s",
            x: Axis::linear("signal to noise in dB", Knob::SNR, -10.0, 40.0, 26),
            y: wavelength(-4..=21),
            base: vec![speed()],
        },
        Map {
            name: "reversal-wavelength",
            title: "Reversals × wavelength",
            conditions: "v = 70 mm/s · sin(2π f t), 20 dB",
            x: Axis::log("reversals f in Hz", Knob::REVERSAL, 0.2, 8.0, 27),
            y: wavelength(-3..=19),
            base: vec![noise()],
        },
        Map {
            name: "friction-speed",
            title: "Friction × rubbing speed",
            conditions: "constant speed, 20 dB; with and without the tangential force channel",
            x: Axis::linear("speed v in mm/s", Knob::SPEED, 10.0, 100.0, 19),
            y: friction(),
            base: vec![noise()],
        },
        Map {
            name: "skew-wavelength",
            title: "Skew between gauges and position × wavelength",
            conditions: "v = 70 mm/s · sin(2π 0.83 Hz t), 20 dB",
            x: Axis::linear_in("gauges late by, in ms", Knob::SKEW, 1000.0, -3.0..3.0, 25),
            y: wavelength(-3..=19),
            base: vec![noise(), Knob::REVERSAL.at(FIG_7_HZ)],
        },
        against(
            "encoder-wavelength",
            "Encoder resolution × wavelength",
            usual,
            Axis::listed("encoder resolution in µm", Knob::ENCODER, &ENCODER_UM),
        ),
        against(
            "harmonic-wavelength",
            "Second harmonic × wavelength",
            usual,
            Axis::linear(harmonic, Knob::SECOND_HARMONIC, 0.0, 1.0, 21),
        ),
        against(
            "hum-wavelength",
            "Hum of 50 Hz × wavelength",
            "50 mm/s, 20 dB: at 1 mm the signal is 50 Hz too",
            Axis::linear("hum of 50 Hz, relative", Knob::HUM, 0.0, 2.0, 21),
        ),
        against(
            "random-wavelength",
            "Random heights × wavelength",
            usual,
            Axis::linear("random heights, rms, relative", Knob::RANDOM, 0.0, 2.0, 21),
        ),
        Map {
            name: "second-wave-ratio",
            title: "A second wave: amplitude × wavelength",
            conditions: "λ = 2 mm, 50 mm/s, 20 dB",
            x: Axis::linear(wave, Knob::SECOND_WAVE, 0.0, 0.9, 19),
            y: Axis::log("its wavelength over λ", Knob::SECOND_RATIO, 0.3, 1.7, 26),
            base: vec![noise(), speed(), Knob::WAVELENGTH.at(SECOND_WAVE_TO_MM)],
        },
        against(
            "pink-wavelength",
            "1/f noise × wavelength",
            "50 mm/s, 20 dB of white noise",
            Axis::linear("1/f noise, rms, relative", Knob::PINK, 0.0, 2.0, 21),
        ),
        against(
            "worn-wavelength",
            "Missing ridges × wavelength",
            usual,
            Axis::linear("share of ridges missing", Knob::WORN, 0.0, 0.9, 19),
        ),
    ]
}

/// The map of a name.
pub fn find(name: &str) -> Result<Map, MapError> {
    let maps = catalogue();
    let known: Vec<&str> = maps.iter().map(|map| map.name).collect();
    let known = known.join(", ");
    let found = maps.into_iter().find(|map| map.name == name);
    found.ok_or_else(|| MapError::UnknownMap(name.to_owned(), known))
}

/// Wavelengths in eighths of an octave from 1 mm, so that the paper's 1, 2 and 4 mm are among them.
fn wavelength(eighths: RangeInclusive<i32>) -> Axis {
    let [first, last] = [*eighths.start(), *eighths.end()].map(|at| (f64::from(at) / 8.0).exp2());
    let count = eighths.count();
    Axis::log("wavelength λ in mm", Knob::WAVELENGTH, first, last, count)
}

/// Four frictions for each of six wavelengths, half an octave apart, without and with the force channel.
fn friction() -> Axis {
    let mut axis = Axis::named("friction");
    for (tangential, channel) in [("false", "no force"), ("true", "force")] {
        for wavelength_mm in [0.7, 1.0, 1.4, 2.0, 2.8, 4.0] {
            let steps = ["none", "mild", "strong", "severe"].map(|friction| {
                let settings = vec![
                    Knob::WAVELENGTH.at(wavelength_mm),
                    Knob::FRICTION.is(friction),
                    Knob::TANGENTIAL.is(tangential),
                ];
                (friction, settings)
            });
            axis.group(format!("{wavelength_mm} mm, {channel}"), steps);
        }
    }
    axis
}
