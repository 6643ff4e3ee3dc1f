//! The ELFs compute what the libraries compute, bit for bit.

use std::sync::LazyLock;

use firmware_sensor::{SCANS_PER_SAMPLE, Sensor};
use protocol::{Estimate, SensorConfiguration};
use tests::history;
use tests::run::{Run, scene};

/// Ten seconds and a bit, so that ten are left once the boards know each other.
static RUBBED: LazyLock<Run> = LazyLock::new(|| {
    Run::of(scene(
        r#"
        seed = 3
        duration_s = 10.5

        [surface]
        specimens = [
          { wavelength_mm = 1.0, length_mm = 13.0 },
          { wavelength_mm = 4.0 },
        ]

        [motion]
        kind = "sinusoid"
        amplitude_mm_s = 70.0
        frequency_hz = 0.83

        [gauges]
        snr_db = 20.0
        "#,
    ))
});

/// Every tenth millisecond the sensor estimates.
const SAMPLES_PER_ESTIMATE: usize =
    (firmware_sensor::SAMPLE_RATE_HZ / firmware_sensor::ESTIMATE_RATE_HZ) as usize;

/// All bits of an estimate; those of its floats as they are.
fn bits(estimate: &Estimate) -> (u32, u64, Option<u32>, bool, u32, u32, bool, u8) {
    (
        estimate.sequence,
        estimate.instant_us,
        estimate.wavelength_mm.map(f32::to_bits),
        estimate.valid,
        estimate.amplitude_lsb.to_bits(),
        estimate.confidence.to_bits(),
        estimate.range == protocol::Range::T1,
        estimate.gauges_used,
    )
}

#[test]
fn the_sensors_estimates_are_those_of_the_library_fed_with_the_same_codes() {
    let recording = &RUBBED.recording;
    let said = &recording.estimates;
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

    let mut sensor = Sensor::new(SensorConfiguration::default());
    let mut said = said.iter().map(|record| &record.estimate).peekable();
    let mut valid = 0;
    for (sample, scans) in recording.scans.chunks_exact(SCANS_PER_SAMPLE).enumerate() {
        // Only an estimate shows its instant, and takes no other notice of it.
        let estimate_due = sample % SAMPLES_PER_ESTIMATE == SAMPLES_PER_ESTIMATE - 1;
        let sequence = (sample / SAMPLES_PER_ESTIMATE) as u32;
        let said = said.next_if(|said| estimate_due && said.sequence == sequence);
        let instant_us = said.map_or(0, |said| said.instant_us);
        let codes: [_; SCANS_PER_SAMPLE] = std::array::from_fn(|scan| scans[scan].codes);
        let encoder = scans[SCANS_PER_SAMPLE - 1].encoder;
        let computed = sensor.step(instant_us, &codes, encoder).estimate;
        if let Some(said) = said {
            let computed = computed.unwrap();
            assert_eq!(
                bits(said),
                bits(&computed),
                "the ELF says {said:?}, the library {computed:?}"
            );
            valid += u32::from(said.valid);
        }
    }
    assert_eq!(
        said.next(),
        None,
        "estimates of scans that were not recorded"
    );
    // In each period of 1.2 s the two times 80 ms of T2 are not valid: 13 %. Another 80 ms around
    // each turning point may be without a crossing.
    let made = recording.estimates.len() as u32;
    assert!(valid > made * 7 / 10, "{valid} of {made} are valid");
}

#[test]
fn the_dacs_words_are_those_of_the_library_fed_with_the_same_encoder_and_estimates() {
    let recording = &RUBBED.recording;
    let replay = history::replay(recording, RUBBED.scene.display_configuration()).unwrap();
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
    let error = history::replay(&recording, RUBBED.scene.display_configuration()).unwrap_err();
    assert!(error.contains("actuator 37"), "{error}");
    assert!(
        error.contains(&format!("after {place} equal outputs")),
        "{error}"
    );
}
