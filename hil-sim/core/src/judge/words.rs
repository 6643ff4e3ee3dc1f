//! What the sensor says of the contact and of its gauges, as JSON has it: in words.

use protocol::{Contact, GAUGES, GaugeHealth};
use serde::{Serialize, Serializer};

pub(super) fn contact<S: Serializer>(contact: &Contact, out: S) -> Result<S::Ok, S::Error> {
    contact.name().serialize(out)
}

pub(super) fn health<S: Serializer>(
    health: &[GaugeHealth; GAUGES],
    out: S,
) -> Result<S::Ok, S::Error> {
    health.map(GaugeHealth::name).serialize(out)
}

/// A set of gauges, bit g for gauge g, as the list of its numbers.
pub(super) fn gauges<S: Serializer>(set: &u8, out: S) -> Result<S::Ok, S::Error> {
    out.collect_seq((0..GAUGES).filter(|gauge| set >> gauge & 1 == 1))
}
