//! The maps there are.

use std::ops::RangeInclusive;

use super::Map;
use super::axis::Axis;
use super::error::MapError;
use super::knob::Knob;

/// Noise of all maps but the one that changes it, in dB.
const SNR_DB: f64 = 20.0;
/// Speed of the maps that need some constant speed, in mm/s.
const SPEED_MM_S: f64 = 50.0;
/// Reversals of the paper's Fig. 7, in Hz.
const FIG_7_HZ: f64 = 0.83;

/// λ of the map of second waves, in mm. They are weaker than the first, and not near twice as long: there λ
/// is the first's beyond dispute.
const SECOND_WAVE_TO_MM: f64 = 2.0;

/// Encoders, in µm: the model's counter has steps of 5 µm.
const ENCODER_UM: [f64; 11] = [
    5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 70.0, 100.0, 150.0, 200.0,
];

/// All maps, in order.
pub fn catalogue() -> Vec<Map> {
    let noise = || Knob::Snr.at(SNR_DB);
    let speed = || Knob::Speed.at(SPEED_MM_S);
    vec![
        Map {
            name: "speed-wavelength",
            title: "Rubbing speed × wavelength",
            conditions: "constant speed, 20 dB",
            x: Axis::log("speed v in mm/s", Knob::Speed, 3.0, 200.0, 40),
            y: wavelength(-8..=24),
            base: vec![noise()],
        },
        Map {
            name: "snr-wavelength",
            title: "Noise × wavelength",
            conditions: "50 mm/s",
            x: Axis::linear("signal to noise in dB", Knob::Snr, -10.0, 40.0, 26),
            y: wavelength(-4..=21),
            base: vec![speed()],
        },
        Map {
            name: "reversal-wavelength",
            title: "Reversals × wavelength",
            conditions: "v = 70 mm/s · sin(2π f t), 20 dB",
            x: Axis::log("reversals f in Hz", Knob::Reversal, 0.2, 8.0, 27),
            y: wavelength(-3..=19),
            base: vec![noise()],
        },
        Map {
            name: "friction-speed",
            title: "Friction × rubbing speed",
            conditions: "constant speed, 20 dB; with and without the tangential force channel",
            x: Axis::linear("speed v in mm/s", Knob::Speed, 10.0, 100.0, 19),
            y: friction(),
            base: vec![noise()],
        },
        Map {
            name: "skew-wavelength",
            title: "Skew between gauges and position × wavelength",
            conditions: "v = 70 mm/s · sin(2π 0.83 Hz t), 20 dB",
            x: Axis::linear_in("gauges late by, in ms", Knob::Skew, 1000.0, -3.0, 3.0, 25),
            y: wavelength(-3..=19),
            base: vec![noise(), Knob::Reversal.at(FIG_7_HZ)],
        },
        Map {
            name: "encoder-wavelength",
            title: "Encoder resolution × wavelength",
            conditions: "50 mm/s, 20 dB",
            x: Axis::listed("encoder resolution in µm", Knob::Encoder, &ENCODER_UM),
            y: wavelength(-3..=19),
            base: vec![noise(), speed()],
        },
        Map {
            name: "harmonic-wavelength",
            title: "Second harmonic × wavelength",
            conditions: "50 mm/s, 20 dB",
            x: Axis::linear(
                "second harmonic, relative",
                Knob::SecondHarmonic,
                0.0,
                1.0,
                21,
            ),
            y: wavelength(-3..=19),
            base: vec![noise(), speed()],
        },
        Map {
            name: "hum-wavelength",
            title: "Hum of 50 Hz × wavelength",
            conditions: "50 mm/s, 20 dB: at 1 mm the signal is 50 Hz too",
            x: Axis::linear("hum of 50 Hz, relative", Knob::Hum, 0.0, 2.0, 21),
            y: wavelength(-3..=19),
            base: vec![noise(), speed()],
        },
        Map {
            name: "random-wavelength",
            title: "Random heights × wavelength",
            conditions: "50 mm/s, 20 dB",
            x: Axis::linear("random heights, rms, relative", Knob::Random, 0.0, 2.0, 21),
            y: wavelength(-3..=19),
            base: vec![noise(), speed()],
        },
        Map {
            name: "second-wave-ratio",
            title: "A second wave: amplitude × wavelength",
            conditions: "λ = 2 mm, 50 mm/s, 20 dB",
            x: Axis::linear(
                "amplitude of the second wave, relative",
                Knob::SecondWave,
                0.0,
                0.9,
                19,
            ),
            y: Axis::log("its wavelength over λ", Knob::SecondRatio, 0.3, 1.7, 26),
            base: vec![noise(), speed(), Knob::Wavelength.at(SECOND_WAVE_TO_MM)],
        },
        Map {
            name: "pink-wavelength",
            title: "1/f noise × wavelength",
            conditions: "50 mm/s, 20 dB of white noise",
            x: Axis::linear("1/f noise, rms, relative", Knob::Pink, 0.0, 2.0, 21),
            y: wavelength(-3..=19),
            base: vec![noise(), speed()],
        },
        Map {
            name: "worn-wavelength",
            title: "Missing ridges × wavelength",
            conditions: "50 mm/s, 20 dB",
            x: Axis::linear("share of ridges missing", Knob::Worn, 0.0, 0.9, 19),
            y: wavelength(-3..=19),
            base: vec![noise(), speed()],
        },
    ]
}

/// The map of a name.
///
/// # Errors
/// If there is none; the error names those that there are.
pub fn find(name: &str) -> Result<Map, MapError> {
    let maps = catalogue();
    let known: Vec<&str> = maps.iter().map(|map| map.name).collect();
    let known = known.join(", ");
    maps.into_iter()
        .find(|map| map.name == name)
        .ok_or_else(|| MapError::UnknownMap {
            name: name.to_owned(),
            known,
        })
}

/// Wavelengths in eighths of an octave from 1 mm, so that the paper's 1, 2 and 4 mm are among them.
fn wavelength(eighths: RangeInclusive<i32>) -> Axis {
    let at = |eighths: i32| f64::from(eighths) / 8.0;
    Axis::log(
        "wavelength λ in mm",
        Knob::Wavelength,
        at(*eighths.start()).exp2(),
        at(*eighths.end()).exp2(),
        eighths.count(),
    )
}

/// Four frictions for each of three wavelengths, without and with the force channel.
fn friction() -> Axis {
    let mut axis = Axis::named("friction");
    for (tangential, channel) in [("false", "no force"), ("true", "force")] {
        for wavelength_mm in [1.0, 2.0, 4.0] {
            let steps = ["none", "mild", "strong", "severe"].map(|friction| {
                let settings = vec![
                    Knob::Wavelength.at(wavelength_mm),
                    Knob::Friction.is(friction),
                    Knob::Tangential.is(tangential),
                ];
                (friction, settings)
            });
            axis.group(format!("{wavelength_mm} mm, {channel}"), steps);
        }
    }
    axis
}
