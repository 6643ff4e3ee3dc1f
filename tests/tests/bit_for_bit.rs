//! The ELFs compute what the libraries compute, bit for bit.

use std::sync::LazyLock;

use firmware_sensor::{SCANS_PER_SAMPLE, Sensor};
use hil_sim::scene::Scene;
use protocol::{Estimate, MAX_FRAME, Message, SensorConfiguration, frame};
use tests::history;
use tests::run::{Run, scene};

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
static RUBBED: LazyLock<Run> = LazyLock::new(|| Run::of(rubbing("default", 10.5)));

/// Every tenth millisecond the sensor estimates.
const SAMPLES_PER_ESTIMATE: usize =
    (firmware_sensor::SAMPLE_RATE_HZ / firmware_sensor::ESTIMATE_RATE_HZ) as usize;
const SAMPLE_NS: u64 = 1_000_000_000 / firmware_sensor::SAMPLE_RATE_HZ as u64;

/// All that a sensor says in an estimate, bit for bit: the bytes of a frame.
fn bytes(estimate: &Estimate) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    let frame = frame::encode(0, &Message::Estimate(*estimate), &mut out);
    frame.expect("every message fits").to_vec()
}

/// A library's sensor that is fed with what the board's converter and encoder gave, and takes the
/// scene's configuration before its sample number `told`. How many of the board's estimates are valid
/// and the same; else the first that is not.
fn replay(run: &Run, told: Option<usize>) -> Result<u32, String> {
    let mut sensor = Sensor::new(SensorConfiguration::default());
    let mut said = run.recording.estimates.iter().peekable();
    let mut valid = 0;
    let samples = run.recording.scans.chunks_exact(SCANS_PER_SAMPLE);
    for (sample, scans) in samples.enumerate() {
        if told == Some(sample) {
            sensor.configure(run.scene.sensor_configuration());
        }
        // Only an estimate shows its instant, and takes no other notice of it.
        let estimate_due = sample % SAMPLES_PER_ESTIMATE == SAMPLES_PER_ESTIMATE - 1;
        let sequence = (sample / SAMPLES_PER_ESTIMATE) as u32;
        let said = said.next_if(|said| estimate_due && said.estimate.sequence == sequence);
        let said = said.map(|record| &record.estimate);
        let instant_us = said.map_or(0, |said| said.instant_us);
        let codes: [_; SCANS_PER_SAMPLE] = std::array::from_fn(|scan| scans[scan].codes);
        let encoder = scans[SCANS_PER_SAMPLE - 1].encoder;
        let computed = sensor.step(instant_us, &codes, encoder).estimate;
        if let Some(said) = said {
            let computed = computed.ok_or("the library estimates at other times")?;
            if bytes(said) != bytes(&computed) {
                return Err(format!(
                    "the ELF says {said:?}, the library {computed:?}, told before sample {told:?}"
                ));
            }
            valid += u32::from(said.valid);
        }
    }
    match said.next() {
        None => Ok(valid),
        Some(said) => Err(format!("{said:?} is of scans that were not recorded")),
    }
}

/// When the sampling task may have taken the scene's configuration: from the sample after the host began
/// to ask until the one after it had the answer.
fn moments(run: &Run) -> Vec<Option<usize>> {
    let Some(told) = run.facts.sensor_told else {
        return vec![None];
    };
    let samples = run.recording.scans.chunks_exact(SCANS_PER_SAMPLE);
    let within = samples.enumerate().filter(|(_, scans)| {
        let at_ns = scans[SCANS_PER_SAMPLE - 1].at_ns;
        (told.asked_ns..=told.answered_ns + 2 * SAMPLE_NS).contains(&at_ns)
    });
    within.map(|(sample, _)| Some(sample)).collect()
}

/// The share of valid estimates of a run, every one of which is the library's.
fn share_explained(run: &Run) -> f64 {
    let outcomes: Vec<_> = moments(run)
        .into_iter()
        .map(|told| replay(run, told))
        .collect();
    let Some(Ok(valid)) = outcomes.iter().find(|outcome| outcome.is_ok()) else {
        panic!("{outcomes:#?}");
    };
    f64::from(*valid) / run.recording.estimates.len() as f64
}

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
    assert_eq!(RUBBED.facts.sensor_told, None);
    let share = share_explained(&RUBBED);
    assert!(share > 0.7, "{share} valid");
}

#[test]
fn so_are_those_of_every_other_method() {
    for method in ["crossings", "counting", "counting-adapted"] {
        let run = Run::of(rubbing(method, 3.2));
        let told = run.facts.sensor_told.expect("it is not the default");
        assert_eq!(told.report.refused, None);
        let share = share_explained(&run);
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
