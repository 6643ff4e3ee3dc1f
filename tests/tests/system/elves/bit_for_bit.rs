//! The ELFs compute what the libraries compute, bit for bit.

use std::sync::LazyLock;

use hil_sim_core::scene::Scene;
use protocol::SensorConfiguration;
use tests::history;
use tests::run::{Run, scene};
use tests::sensing::{replay, share_explained};

use super::configuration::assert_taken;

/// To and fro over a boundary, with noise; for a second one gauge is dead and one saturates.
fn rubbing(method: &str, duration_s: f64) -> Scene {
    scene(&format!(
        r#"
        seed = 3
        duration_s = {duration_s}

        [surface]
        specimens = [
          {{ wavelength_mm = 1.0, length_mm = 13.0 }},
          {{ wavelength_mm = 4.0 }},
        ]

        [motion]
        kind = "sinusoid"
        amplitude_mm_s = 70.0
        frequency_hz = 0.83

        [gauges]
        snr_db = 20.0
        dead = [4]
        saturated = [1]
        trouble_from_s = 1.0
        trouble_for_s = 1.0

        [estimator]
        method = "{method}"
        "#
    ))
}

/// Ten seconds and a bit, so that ten are left once the boards know each other.
pub(crate) static RUBBED: LazyLock<Run> = LazyLock::new(|| Run::of(rubbing("default", 10.5)));

#[test]
fn the_sensors_estimates_are_those_of_the_library_fed_with_the_same_codes() {
    let said = &RUBBED.recording.estimates;
    let (first, last) = (
        said.first().unwrap().estimate,
        said.last().unwrap().estimate,
    );
    assert!(
        last.instant_us - first.instant_us >= 10_000_000,
        "only from {} to {} µs",
        first.instant_us,
        last.instant_us
    );
    assert_eq!(said.len() as u32, last.sequence - first.sequence + 1);
    // The boards run by their defaults, and nobody asks them.
    assert_eq!(
        RUBBED.scene.sensor_configuration(),
        SensorConfiguration::DEFAULT
    );
    assert_eq!(RUBBED.facts.sensor_told, None);
    assert_eq!(RUBBED.facts.display_told, None);
    let share = share_explained(&RUBBED).unwrap();
    assert!(share > 0.7, "{share} valid");
}

#[test]
fn so_are_those_of_every_other_method() {
    for method in ["crossings", "counting", "counting-adapted"] {
        let run = Run::of(rubbing(method, 3.2));
        assert_ne!(
            run.scene.sensor_configuration().method,
            SensorConfiguration::DEFAULT.method
        );
        assert_taken(&run);
        let share = share_explained(&run).unwrap();
        // The filters' 0.7 s are not valid, nor 13 % of the rest, in T2, nor half a window at either end
        // of it.
        assert!(share > 0.5, "{method}: {share} valid");
    }
}

#[test]
fn the_replay_finds_a_single_wrong_bit_of_an_estimate() {
    let mut recording = RUBBED.recording.clone();
    let place = recording.estimates.len() / 2;
    let amplitude = &mut recording.estimates[place].estimate.amplitude_lsb;
    *amplitude = f32::from_bits(amplitude.to_bits() ^ 1);
    let changed = recording.estimates[place].estimate.sequence;
    let run = Run {
        scene: RUBBED.scene.clone(),
        recording,
        verdict: RUBBED.verdict.clone(),
        facts: RUBBED.facts.clone(),
    };
    let error = replay(&run, None).unwrap_err();
    assert!(
        error.contains(&format!("ELF says Estimate {{ sequence: {changed},")),
        "{error}"
    );
}

#[test]
fn the_dacs_words_are_those_of_the_library_fed_with_the_same_encoder_and_estimates() {
    let recording = &RUBBED.recording;
    let replay = history::replay(recording, &RUBBED.scene.display_settings().unwrap()).unwrap();
    assert_eq!(replay.outputs, recording.outputs.len());
    // 2 kHz for ten seconds, less what a hand near its turning point leaves unchanged.
    assert!(replay.outputs > 18_000, "{replay:?}");
    // A status a second may hold an estimate up, nothing else does.
    assert!(replay.held_up <= 10, "{replay:?}");
}

#[test]
fn the_replay_finds_a_single_wrong_bit() {
    let mut recording = RUBBED.recording.clone();
    let place = recording.outputs.len() / 2;
    recording.outputs[place].words[37] ^= 1;
    let error = history::replay(&recording, &RUBBED.scene.display_settings().unwrap()).unwrap_err();
    assert!(error.contains("actuator 37"), "{error}");
    assert!(
        error.contains(&format!("after {place} equal outputs")),
        "{error}"
    );
}
