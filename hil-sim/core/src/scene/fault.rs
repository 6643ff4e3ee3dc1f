//! Faults: what a scene's `[[fault]]` tables break, and what is expected of the boards then.
//!
//! ```text
//! [[fault]] ─> Fault ─┬─> Way      (bytes between the boards)          ┐
//!                     ├─> GaugeFaults, EncoderFaults (what is sensed) ├─> Recording ─> judge ─> Finding
//!                     └─> elf's injector (pins, registers, memory)      ┘
//! ```
//!
//! The kinds and what is expected of each are data: [`catalogue::rows`]. `hil-sim faults` prints them, and
//! [`campaign`] judges by them.

pub mod catalogue;
mod kind;

pub use catalogue::{Class, Key, Lasts, Row, Shows, Sign};
pub use kind::Kind;

use protocol::Role;

/// Most keys that a kind has beside `at_s`, `kind` and `for_s`.
pub const MOST_KEYS: usize = 2;

/// One fault of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// What breaks.
    pub kind: Kind,
    /// When, in s since the scene's start, 0 to 600.
    pub at_s: f64,
    /// For how long, in s, above 0, to 600; none for good, or for what happens in an instant.
    pub for_s: Option<f64>,
    /// The values of [`Row::keys`], in their order; the rest is 0.
    pub values: [f64; MOST_KEYS],
}

impl Fault {
    /// A fault of `kind` at `at_s` with every other key at its default.
    pub fn new(kind: Kind, at_s: f64) -> Self {
        let row = kind.row();
        let mut values = [0.0; MOST_KEYS];
        for (value, key) in values.iter_mut().zip(row.keys) {
            *value = key.default;
        }
        Self {
            kind,
            at_s,
            for_s: row.lasts.default_s(),
            values,
        }
    }

    /// When it begins, in ns since the scene's start.
    pub fn begins_ns(&self) -> u64 {
        nanoseconds(self.at_s)
    }

    /// When it ends, in ns since the scene's start; none if it never does, or has no length.
    pub fn ends_ns(&self) -> Option<u64> {
        self.for_s.map(|for_s| nanoseconds(self.at_s + for_s))
    }

    /// In which time in ms it has to show; none if that depends on what arrives. See [`Row::seen_within_ms`].
    pub fn seen_within_ms(&self) -> Option<f64> {
        let row = self.kind.row();
        let longer_s = match (row.shows, self.for_s, row.lasts.default_s()) {
            (Shows::WhenOver, Some(for_s), Some(default_s)) => (for_s - default_s).max(0.0),
            _ => 0.0,
        };
        row.seen_within_ms.map(|ms| ms + longer_s * 1e3)
    }

    /// Whether it is there at `at_ns`, for kinds that last.
    pub fn is_on(&self, at_ns: u64) -> bool {
        at_ns >= self.begins_ns() && self.ends_ns().is_none_or(|end_ns| at_ns < end_ns)
    }

    /// Whether power of the board of `role` goes with it.
    pub fn cuts_power(&self, role: Role) -> bool {
        match self.kind {
            Kind::PowerCycle => role == Role::Display || self.values[0] != 0.0,
            Kind::BrownOut => role == Role::Display,
            Kind::SensorBrownOut => role == Role::Sensor,
            _ => false,
        }
    }
}

/// An instant in s as ns.
pub fn nanoseconds(s: f64) -> u64 {
    (s * 1e9).round() as u64
}
