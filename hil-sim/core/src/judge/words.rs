//! What the sensor says of the contact and of its gauges, in words.

use protocol::{Contact, GAUGES, GaugeHealth};
use serde::{Serialize, Serializer};

/// The word for what the fingertip does.
pub const fn of_contact(contact: Contact) -> &'static str {
    match contact {
        Contact::Unknown => "unknown",
        Contact::Slip => "slip",
        Contact::Stick => "stick",
        Contact::StickSlip => "stick-slip",
    }
}

/// The word for what is wrong with a gauge.
pub const fn of_health(health: GaugeHealth) -> &'static str {
    match health {
        GaugeHealth::Good => "good",
        GaugeHealth::Dead => "dead",
        GaugeHealth::Stuck => "stuck",
        GaugeHealth::Saturated => "saturated",
        GaugeHealth::Noisy => "noisy",
        GaugeHealth::Hum => "hum",
    }
}

pub(super) fn contact<S: Serializer>(contact: &Contact, out: S) -> Result<S::Ok, S::Error> {
    of_contact(*contact).serialize(out)
}

pub(super) fn health<S: Serializer>(
    health: &[GaugeHealth; GAUGES],
    out: S,
) -> Result<S::Ok, S::Error> {
    health.map(of_health).serialize(out)
}

/// A set of gauges, bit g for gauge g, as the list of its numbers.
pub(super) fn gauges<S: Serializer>(set: &u8, out: S) -> Result<S::Ok, S::Error> {
    out.collect_seq((0..GAUGES).filter(|gauge| set >> gauge & 1 == 1))
}
