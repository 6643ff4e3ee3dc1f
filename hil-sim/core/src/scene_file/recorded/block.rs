//! Our own recordings of the gauges: several samples a message.

use protocol::{CHANNELS, GAUGES};
use serde_json::{Value, json};

/// The name of their schema.
pub const SCHEMA: &str = "ridgelink_msgs/msg/Gauges";
/// The fields of a message with the samples' codes, and those of a sample with its volts.
const FIELDS: [(&str, &str); CHANNELS] = [
    ("g0", "g0_v"),
    ("g1", "g1_v"),
    ("g2", "g2_v"),
    ("g3", "g3_v"),
    ("g4", "g4_v"),
    ("tangential", "tangential_v"),
];
const _: () = assert!(CHANNELS == GAUGES + 1);
/// A step of the codes, in V: [`protocol::GaugeSample::codes`].
const VOLTS_PER_CODE: f64 = 3.3 / 65_536.0;
const SAMPLE_US: u64 = 1_000;

/// The samples of a message, each with its own fields: `sample`, `instant_us`, `position_um`, `travel_um` and
/// the volts. None if it lacks some of what they are made of.
pub fn samples(block: &Value) -> Option<Vec<Value>> {
    let first = block.get("first_sample")?.as_u64()?;
    let instant_us = block.get("instant_us")?.as_u64()?;
    let mut position_um = block.get("position_um")?.as_i64()?;
    let travels = block.get("travel_um")?.as_array()?;
    let mut samples = Vec::with_capacity(travels.len());
    for (at, travel_um) in travels.iter().enumerate() {
        let travel_um = travel_um.as_i64()?;
        if at > 0 {
            position_um = position_um.saturating_add(travel_um);
        }
        let mut sample = json!({
            "sample": first + at as u64,
            "instant_us": instant_us + at as u64 * SAMPLE_US,
            "position_um": position_um,
            "travel_um": travel_um,
        });
        for (codes, volts) in FIELDS {
            let code = block.get(codes)?.get(at)?.as_f64()?;
            sample[volts] = (code * VOLTS_PER_CODE).into();
        }
        samples.push(sample);
    }
    Some(samples)
}
