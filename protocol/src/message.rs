//! The wire contract, as a table of types: everything a board or a host can say.
//!
//! | message | from | rate | what for |
//! | --- | --- | --- | --- |
//! | [`Hello`] | all | at start, on request, once a second until answered; from a [`console`](crate::console) only when spoken to | who is there, and do we understand each other |
//! | [`Estimate`] | sensor | 100 Hz | the surface, the contact with it, the gauges' health |
//! | [`Texture`] | sensor | 20 Hz, while the arm moves | what the surface is besides λ |
//! | [`Motion`] | display | 500 Hz | where the operator's hand is, for the arm |
//! | [`Gauges`] | sensor | 125 Hz, while asked for | samples, for recording |
//! | [`Status`] | boards | 1 Hz | every counter |
//! | [`Configure`] | host | – | asks for a configuration |
//! | [`Question`] | host | – | asks what is in force, or what the board can do |
//! | [`Actuators`] | host | – | a part of the fingertip's description, for the next configuration |
//! | [`ConfigurationReport`] | boards | – | answers these |
//! | [`Capabilities`] | boards | – | answers a question |
//! | [`StreamGauges`] | host | repeated | asks for gauges, for a while |
//! | [`Safety`] | display | at each change | the supervisor's state |
//! | [`Arm`] | sensor | at each change | what the arm does |
//! | [`Ping`], [`Pong`] | all | – | round trip and clock offset |
//! | [`Stop`] | all | – | no more stimulus, and the arm stands still |
//! | [`Stopped`] | boards | – | answers each Stop |
//!
//! The order of the variants and of the fields is the wire's: a change of either changes
//! [`SCHEMA_HASH`] and asks for a new [`PROTOCOL_VERSION`].

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::actuators::Actuators;
use crate::capabilities::{Capabilities, Question};
use crate::configuration::{ConfigurationReport, Configure};
use crate::hello::{Hello, MAGIC, Role};
use crate::safety::{Arm, Safety};
use crate::status::Status;
use crate::stop::{Stop, Stopped};
use crate::texture::Texture;

/// The version of everything in this crate that crosses the wire. Raised whenever a golden byte changes.
pub const PROTOCOL_VERSION: u16 = 7;

/// A hash of the shape of every message (names, types, order), so that two builds that disagree
/// in a single field recognise it by [`Hello`] even if someone forgot to raise the version.
pub const SCHEMA_HASH: u64 =
    u64::from_le_bytes(postcard_schema::key::Key::for_path::<Message>("ridgelink").to_bytes());

/// Strain gauges in the fingertip (Okamoto et al. 2009, section III-A).
pub const GAUGES: usize = 5;
/// ADC channels of a scan: the gauges, then the optional tangential force.
pub const CHANNELS: usize = GAUGES + 1;
/// Samples carried by one [`Gauges`] message.
pub const GAUGE_BLOCK: usize = 8;

/// Anything that can stand in a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(
    clippy::large_enum_variant,
    reason = "no allocator to box with, and a message lives on the stack for one frame"
)]
pub enum Message {
    /// Who speaks. Always variant 0, always the same layout: see [`Hello`].
    Hello(Hello),
    /// The surface, as the sensor sees it.
    Estimate(Estimate),
    /// The operator's hand, as the display's encoder sees it.
    Motion(Motion),
    /// A block of samples, for recording.
    Gauges(Gauges),
    /// Every counter of a board.
    Status(Status),
    /// Asks a board to take this configuration as a whole.
    Configure(Configure),
    /// A board's configuration as it stands, after a [`Message::Configure`], refused [`Actuators`] or a
    /// [`Question`].
    Configuration(ConfigurationReport),
    /// Asks for a [`Pong`].
    Ping(Ping),
    /// Answers a [`Ping`].
    Pong(Pong),
    /// Stops the board, until its reset button or power. On the wire it is [`Stop::to_bytes`]: always the
    /// same bytes, and never variant 9.
    Stop(Stop),
    /// Describes ten actuators, for a [`Message::Configure`] to come. Answered only if refused.
    Actuators(Actuators),
    /// The display's supervisor has changed its state.
    Safety(Safety),
    /// Answers a [`Message::Stop`]. On the wire it is [`Stopped::to_bytes`]: always the same bytes, and
    /// never variant 12.
    Stopped(Stopped),
    /// Asks a board something, and changes nothing.
    Question(Question),
    /// What a board can do.
    Capabilities(Capabilities),
    /// Asks for [`Gauges`], for a while.
    StreamGauges(StreamGauges),
    /// What the sensor does with the arm has changed.
    Arm(Arm),
    /// The surface besides its wavelength.
    Texture(Texture),
}

/// Which of the paper's ranges an instant is in, equation (8): T1 while v(t)·v(t−A) ≥ 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Range {
    /// The velocity kept its sign over the window.
    T1,
    /// The velocity changed its sign within the window: the counting estimate is not to be used.
    T2,
}

impl Range {
    /// The paper's name of it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::T1 => "T1",
            Self::T2 => "T2",
        }
    }
}

/// What the fingertip does at the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Contact {
    /// Nothing tells: the arm rests, or nothing can be seen without a force channel.
    #[default]
    Unknown,
    /// The fingertip slips over the surface as the arm moves.
    Slip,
    /// The fingertip holds to the surface while the arm moves.
    Stick,
    /// Stick and slip in turn, many times a second: see [`Estimate::lag_um`] for what can be known of it.
    StickSlip,
}

impl Contact {
    /// It in a word, as used in messages to people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Slip => "slip",
            Self::Stick => "stick",
            Self::StickSlip => "stick-slip",
        }
    }
}

/// What is wrong with a gauge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum GaugeHealth {
    /// Nothing.
    #[default]
    Good,
    /// Says nothing, or next to nothing, while others do.
    Dead,
    /// Gives the same code for ever.
    Stuck,
    /// Is driven into the ends of its amplifier's or the converter's range.
    Saturated,
    /// Says something that has nothing to do with the surface.
    Noisy,
    /// Carries more mains hum than signal.
    Hum,
}

impl GaugeHealth {
    /// The state in a word, as used in messages to people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Dead => "dead",
            Self::Stuck => "stuck",
            Self::Saturated => "saturated",
            Self::Noisy => "noisy",
            Self::Hum => "hum",
        }
    }
}

/// One estimate of the surface under the sensor, at 100 Hz.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Estimate {
    /// Counts the sensor's estimates from its start; an estimate with a smaller one is older.
    pub sequence: u32,
    /// When it was made, in µs of the sensor's clock.
    pub instant_us: u64,
    /// Surface wavelength λ in mm, if the estimator has one; always finite and above 0.
    pub wavelength_mm: Option<f32>,
    /// Whether the estimator stands by `wavelength_mm`. Never true without one.
    pub valid: bool,
    /// The probability, 0 to 1, that `wavelength_mm` is within 5 % of the truth; 0 without one.
    pub confidence: f32,
    /// Amplitude of the surface's fundamental in ADC steps (3.3 V / 4096), RMS over the gauges used,
    /// whatever the speed; 0 or above.
    pub amplitude_lsb: f32,
    /// λ in mm by the paper's count, A = 80 ms, equations (1), (2) and (5), of the counted gauge: made
    /// beside every other method, to be watched next to it.
    pub counted_mm: Option<f32>,
    /// The paper's range at this instant.
    pub range: Range,
    /// What the fingertip did some 7.5 ms before: the force comes 4 ms late out of its filter, and how arm
    /// and contact moved is looked at over 7 ms.
    pub contact: Contact,
    /// The arm's velocity in µm/s over the last 10 ms, positive towards larger x.
    pub velocity_um_s: i32,
    /// How far the fingertip's contact lags behind the arm, F/k, in µm, towards larger x if positive;
    /// none without the force channel.
    pub lag_um: Option<i32>,
    /// Bit g set: gauge g took part.
    pub gauges_used: u8,
    /// What is wrong with each gauge.
    pub health: [GaugeHealth; GAUGES],
}

/// The operator's hand, at 500 Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Motion {
    /// Counts the display's motions from its start.
    pub sequence: u32,
    /// When the encoder was read, in µs of the display's clock.
    pub instant_us: u64,
    /// Position x in µm since the display's start.
    pub position_um: i64,
    /// Velocity v in µm/s, positive towards larger x.
    pub velocity_um_s: i32,
}

/// One sample of all channels, at 1 kHz, after the anti-aliasing filter and before the band-pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct GaugeSample {
    /// Channel values in sixteenths of an ADC step: 0 to 65 535 for 0 to 3.3 V.
    pub codes: [u16; CHANNELS],
    /// Travel of the arm since the sample before, in µm.
    pub travel_um: i16,
}

/// A block of consecutive samples, sent for as long as [`StreamGauges`] asks for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Gauges {
    /// Index of the first sample since the sensor's start: a gap shows what was lost.
    pub first_sample: u32,
    /// Instant of the first sample, in µs of the sensor's clock.
    pub instant_us: u64,
    /// The arm's position at the first sample, in µm since the sensor's start.
    pub position_um: i64,
    /// The samples, 1 ms apart.
    pub samples: [GaugeSample; GAUGE_BLOCK],
}

/// Asks for [`Gauges`] from now on, for a while. Whoever wants them says so again before the while is over; the
/// longest that anybody asked for counts, so that nobody ends what another wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct StreamGauges {
    /// For how long, in ms; what is above [`StreamGauges::LONGEST_MS`] is taken for that.
    pub for_ms: u16,
}

impl StreamGauges {
    /// The longest while, in ms.
    pub const LONGEST_MS: u16 = 10_000;
}

/// Asks the other end for its clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Ping {
    /// The sender's clock when it sent this, in µs.
    pub sent_us: u64,
}

/// Answers a [`Ping`], with the three instants that give round trip and clock offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Pong {
    /// [`Ping::sent_us`], returned.
    pub sent_us: u64,
    /// The answerer's clock when the ping reached it, in µs.
    pub received_us: u64,
    /// The answerer's clock when it sent this, in µs.
    pub answered_us: u64,
}

impl Hello {
    /// A Hello of this build. `chip` is cut to 16 bytes.
    pub const fn new(role: Role, chip: &str, version: [u8; 3]) -> Self {
        let mut name = [0; 16];
        let bytes = chip.as_bytes();
        let mut at = 0;
        while at < bytes.len() && at < name.len() {
            name[at] = bytes[at];
            at += 1;
        }
        Self {
            magic: MAGIC,
            protocol: PROTOCOL_VERSION.to_le_bytes(),
            schema: SCHEMA_HASH.to_le_bytes(),
            role: role.byte(),
            chip: name,
            version,
            asks: 0,
        }
    }

    /// Whether this build can read what the speaker says next.
    pub const fn is_compatible(&self) -> bool {
        self.protocol_version() == PROTOCOL_VERSION && self.schema_hash() == SCHEMA_HASH
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_are_told_of_contact_and_gauges_in_words() {
        let contacts = [
            Contact::Unknown,
            Contact::Slip,
            Contact::Stick,
            Contact::StickSlip,
        ];
        assert_eq!(
            contacts.map(Contact::name),
            ["unknown", "slip", "stick", "stick-slip"]
        );
        let health = [
            GaugeHealth::Good,
            GaugeHealth::Dead,
            GaugeHealth::Stuck,
            GaugeHealth::Saturated,
            GaugeHealth::Noisy,
            GaugeHealth::Hum,
        ];
        assert_eq!(
            health.map(GaugeHealth::name),
            ["good", "dead", "stuck", "saturated", "noisy", "hum"]
        );
        assert_eq!([Range::T1, Range::T2].map(Range::name), ["T1", "T2"]);
    }
}
