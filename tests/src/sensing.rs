//! Replays what a sensor board did with its own library, bit for bit.

use firmware_sensor::{SCANS_PER_SAMPLE, Sensor};
use protocol::{Estimate, MAX_FRAME, Message, SensorConfiguration, frame};

use crate::run::Run;

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
/// scene's configuration before its sample number `told`, if it is told any.
///
/// # Errors
/// The first estimate of the board that is not the library's; else returns how many are valid.
pub fn replay(run: &Run, told: Option<usize>) -> Result<u32, String> {
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
///
/// # Errors
/// What differs first, for each moment at which the board may have been configured.
pub fn share_explained(run: &Run) -> Result<f64, String> {
    let mut differences = Vec::new();
    for told in moments(run) {
        match replay(run, told) {
            Ok(valid) => return Ok(f64::from(valid) / run.recording.estimates.len() as f64),
            Err(difference) => differences.push(difference),
        }
    }
    Err(differences.join("\n"))
}
