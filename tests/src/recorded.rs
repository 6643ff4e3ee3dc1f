//! Recordings of what boards said.

use std::path::Path;

use firmware_sensor::{SCANS_PER_SAMPLE, Sensor};
use hil_sim_core::run::recording::ScanRecord;
use host_bridge::clock::now_us;
use host_bridge::link::Event;
use host_bridge::recording::{Recorder, Settings};
use protocol::{
    Configuration, ConfigurationReport, Message, Role, SensorConfiguration, StreamGauges,
};

/// Records what was heard, each at its time in µs after the first.
///
/// # Panics
/// If the file can't be written.
pub fn record(path: &Path, said: impl IntoIterator<Item = (u64, Role, Message)>) {
    let recorder = Recorder::start(Settings {
        mcap: Some(path.to_owned()),
        ..Settings::default()
    })
    .expect("a file can be made");
    let start_us = now_us();
    for (after_us, role, message) in said {
        let at_us = start_us + after_us;
        recorder.on_event(role, &Event::Heard { at_us, message });
    }
    recorder.stop().expect("a whole file");
}

/// What a sensor board says that reads these scans, its gauges streamed, and how it is set.
pub fn said_of(
    scans: &[ScanRecord],
    configuration: SensorConfiguration,
) -> Vec<(u64, Role, Message)> {
    let report = ConfigurationReport::of(Configuration::Sensor(configuration), None);
    let mut said = vec![(0, Role::Sensor, Message::Configuration(report))];
    let mut sensor = Sensor::new(configuration);
    let (samples, _) = scans.as_chunks::<SCANS_PER_SAMPLE>();
    for scans in samples {
        sensor.stream_gauges(&StreamGauges { for_ms: 1_000 });
        let last = &scans[SCANS_PER_SAMPLE - 1];
        let at_us = last.at_ns / 1_000;
        let output = sensor.step(at_us, &scans.map(|scan| scan.codes), last.encoder);
        let estimate = output.estimate.map(Message::Estimate);
        // A board dates the samples of its first 4 ms by its start, and does not stream so soon.
        let gauges = output.gauges.filter(|gauges| gauges.instant_us > 0);
        let gauges = gauges.map(Message::Gauges);
        said.extend(
            estimate
                .into_iter()
                .chain(gauges)
                .map(|message| (at_us, Role::Sensor, message)),
        );
    }
    said
}
