//! What is written down: rows, one kind a channel, made of plain numbers, booleans and texts.

use postcard_schema::Schema;
use postcard_schema::schema::NamedType;
use protocol::{Motion, PortCounters, Role};
use serde_json::Value;

/// `copied!(from => Type { a, b; c })` is a `Type` with the fields a and b of `from`, and c as it is here.
macro_rules! copied {
    ($from:expr => $to:ident { $($field:ident),* $(,)? $(; $($own:ident),*)? }) => {
        $to { $($field: $from.$field,)* $($($own,)*)? }
    };
}

mod estimate;
mod gauges;
mod link;
mod log;
mod status;

pub use estimate::EstimateRow;
pub use estimate::TextureRow;
pub use gauges::{GaugeRow, GaugesRow, SAMPLE_US, VOLTS_PER_CODE, block};
pub use link::{ClockRow, HelloRow, LinkEvent, LinkRow, Lost, OtherRow};
pub use log::Text;
pub use log::{LEVELS, LogRow, Time};
pub use status::{DisplayReportRow, SensorReportRow};
pub use status::{DisplayStatusRow, SafetyRow, SensorStatusRow, Stand, StandName};

macro_rules! rows {
    ($($(#[$doc:meta])* $kind:ident($row:ty): $name:literal),* $(,)?) => {
        /// A kind of row.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Kind {
            $($(#[$doc])* $kind,)*
        }

        /// A row.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Row {
            $($(#[$doc])* $kind($row),)*
        }

        impl Kind {
            /// The last part of its channels' topics.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// The shape of its rows.
            pub fn shape(self) -> &'static NamedType {
                match self {
                    $(Self::$kind => <$row>::SCHEMA,)*
                }
            }

            /// A row from JSON. Fails if it is none of this kind.
            pub fn row(self, json: Value) -> serde_json::Result<Row> {
                match self {
                    $(Self::$kind => serde_json::from_value(json).map(Row::$kind),)*
                }
            }
        }

        impl Row {
            /// Its kind.
            pub const fn kind(&self) -> Kind {
                match self {
                    $(Self::$kind(_) => Kind::$kind,)*
                }
            }

            /// It as JSON. Every row can be said in JSON.
            pub fn value(&self) -> serde_json::Result<Value> {
                match self {
                    $(Self::$kind(row) => serde_json::to_value(row),)*
                }
            }
        }
    };
}

rows! {
    /// The surface, as the sensor sees it.
    Estimate(EstimateRow): "estimate",
    /// The surface besides its wavelength.
    Texture(TextureRow): "texture",
    /// The operator's hand.
    Motion(Motion): "motion",
    /// Samples of the gauges.
    Gauges(GaugesRow): "gauges",
    /// A sensor board's counters.
    SensorStatus(SensorStatusRow): "status",
    /// A display board's counters.
    DisplayStatus(DisplayStatusRow): "status",
    /// The supervisor has changed its state.
    Safety(SafetyRow): "safety",
    /// A sensor board's configuration, as reported.
    SensorConfiguration(SensorReportRow): "configuration",
    /// A display board's configuration, as reported.
    DisplayConfiguration(DisplayReportRow): "configuration",
    /// An answered ping: round trip and clock offset.
    Clock(ClockRow): "clock",
    /// The link to the board has changed, or something is missing.
    Link(LinkRow): "link",
    /// What this end of the line has counted.
    Line(PortCounters): "line",
    /// A line of the firmware's log.
    Log(LogRow): "log",
    /// Any other message.
    Other(OtherRow): "other",
}

/// Every channel of a recording: whose, and of what.
pub const CHANNELS: [(Role, Kind); 19] = [
    (Role::Sensor, Kind::Estimate),
    (Role::Sensor, Kind::Texture),
    (Role::Sensor, Kind::Gauges),
    (Role::Sensor, Kind::SensorStatus),
    (Role::Sensor, Kind::SensorConfiguration),
    (Role::Sensor, Kind::Clock),
    (Role::Sensor, Kind::Link),
    (Role::Sensor, Kind::Line),
    (Role::Sensor, Kind::Log),
    (Role::Sensor, Kind::Other),
    (Role::Display, Kind::Motion),
    (Role::Display, Kind::DisplayStatus),
    (Role::Display, Kind::Safety),
    (Role::Display, Kind::DisplayConfiguration),
    (Role::Display, Kind::Clock),
    (Role::Display, Kind::Link),
    (Role::Display, Kind::Line),
    (Role::Display, Kind::Log),
    (Role::Display, Kind::Other),
];

/// The index in [`CHANNELS`]; none if that board does not say such things.
pub fn channel(role: Role, kind: Kind) -> Option<usize> {
    CHANNELS.iter().position(|&found| found == (role, kind))
}

/// A channel's topic.
pub fn topic(role: Role, kind: Kind) -> String {
    format!("/{}/{}", role.name(), kind.name())
}
