//! What happens to a link, and what this end finds out about it, as rows.

use postcard_schema::Schema;
use protocol::hello::MAGIC;
use protocol::{Hello, Message, Pong, Role};
use serde::{Deserialize, Serialize};

use super::Text;
use crate::state::State;

/// Something happened to a link.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct LinkRow {
    /// What.
    pub event: LinkEvent,
    /// In words.
    pub text: Text,
    /// How it stands now, in a word, if it turned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<Text>,
    /// The port, or where the board is looked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub port: Option<Text>,
    /// Why the port can't be opened: the system's reason, or the program that has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<Text>,
    /// What the board said of itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hello: Option<HelloRow>,
    /// Of what some are missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost: Option<Lost>,
    /// How many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<u64>,
}

/// What can happen to a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum LinkEvent {
    /// It stands differently.
    #[default]
    Turned,
    /// The board has started anew.
    Restarted,
    /// Numbers were skipped: what the board said under them has not been heard.
    Gap,
}

/// Of what some can be missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Lost {
    /// Samples of the gauges.
    Samples,
    /// Estimates.
    Estimates,
    /// Motions.
    Motions,
    /// Messages that were heard but not written down, because the disk was too slow.
    Unwritten,
}

impl Lost {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Estimates => "estimates",
            Self::Motions => "motions",
            Self::Unwritten => "messages heard but not written, the disk being too slow",
        }
    }
}

/// A [`Hello`], readable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct HelloRow {
    /// `sensor`, `display` or `host`; another byte as it is.
    pub role: Text,
    /// [`Hello::chip_name`]
    pub chip: Text,
    /// Major, minor, patch.
    pub version: [u8; 3],
    /// [`Hello::protocol_version`]
    pub protocol: u16,
    /// [`Hello::schema_hash`], sixteen hexadecimal digits.
    pub schema: Text,
    /// [`Hello::asks`]
    pub asks: u8,
}

impl From<&Hello> for HelloRow {
    fn from(hello: &Hello) -> Self {
        let role = Role::from_byte(hello.role);
        Self {
            role: role.map_or_else(|| hello.role.to_string().into(), |role| role.name().into()),
            chip: hello.chip_name().into(),
            version: hello.version,
            protocol: hello.protocol_version(),
            schema: format!("{:016x}", hello.schema_hash()).into(),
            asks: hello.asks,
        }
    }
}

impl HelloRow {
    /// The Hello; none if a part of it is no part of one.
    pub fn hello(&self) -> Option<Hello> {
        let roles = [Role::Sensor, Role::Display, Role::Host];
        let known = roles.into_iter().find(|role| role.name() == self.role.0);
        let mut chip = [0; 16];
        chip.get_mut(..self.chip.0.len())?
            .copy_from_slice(self.chip.0.as_bytes());
        Some(Hello {
            magic: MAGIC,
            protocol: self.protocol.to_le_bytes(),
            schema: u64::from_str_radix(&self.schema.0, 16).ok()?.to_le_bytes(),
            role: match known {
                Some(role) => role.byte(),
                None => self.role.0.parse().ok()?,
            },
            chip,
            version: self.version,
            asks: self.asks,
        })
    }
}

impl LinkRow {
    fn new(event: LinkEvent, text: impl Into<String>) -> Self {
        Self {
            event,
            text: text.into().into(),
            ..Self::default()
        }
    }

    /// The board has started anew.
    pub fn restarted() -> Self {
        Self::new(LinkEvent::Restarted, "the board has started anew")
    }

    /// So many are missing.
    pub fn gap(lost: Lost, missing: u64) -> Self {
        let text = match lost {
            Lost::Unwritten => format!("{missing} {}", lost.name()),
            _ => format!("{missing} {} lost", lost.name()),
        };
        Self {
            lost: Some(lost),
            missing: Some(missing),
            ..Self::new(LinkEvent::Gap, text)
        }
    }

    /// The link stands differently.
    pub fn turned(state: &State) -> Self {
        let port = match state {
            State::Absent(place) => Some(place.clone()),
            state => state.port().map(|port| port.display().to_string()),
        };
        let reason = match state {
            State::Failed(_, reason) | State::Hung(_, reason) => Some(reason.clone()),
            _ => None,
        };
        let hello = match state {
            State::Foreign(_, hello) | State::Stranger { hello, .. } | State::Known(_, hello) => {
                Some(hello.into())
            }
            _ => None,
        };
        Self {
            state: Some(state.word().into()),
            port: port.map(Text),
            reason: reason.map(Text),
            hello,
            ..Self::new(LinkEvent::Turned, state.to_string())
        }
    }

    /// The state that the link to the board of `role` turned to; none if it did not, or if a part of it
    /// is missing.
    pub fn state(&self, role: Role) -> Option<State> {
        let port = self.port.as_ref().map(|port| port.0.clone())?;
        let word = self.state.as_ref()?;
        let hello = || self.hello.as_ref().and_then(HelloRow::hello);
        let place = port.clone();
        let port = port.into();
        Some(match word.0.as_str() {
            "absent" => State::Absent(place),
            "busy" => match &self.reason {
                Some(holder) => State::Hung(port, holder.0.clone()),
                None => State::Busy(port),
            },
            "denied" => State::Denied(port),
            "failed" => State::Failed(port, self.reason.as_ref()?.0.clone()),
            "opened" => State::Opened(port),
            "silent" => State::Silent(port),
            "deaf" => State::Deaf(port),
            "garbage" => State::Garbage(port),
            "foreign" => State::Foreign(port, hello()?),
            "wrong-role" => State::Stranger {
                port,
                hello: hello()?,
                wanted: role,
            },
            "known" => State::Known(port, hello()?),
            _ => return None,
        })
    }
}

/// An answered ping.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ClockRow {
    /// [`Pong::sent_us`], of this program's clock.
    pub sent_us: u64,
    /// [`Pong::received_us`], of the board's clock.
    pub received_us: u64,
    /// [`Pong::answered_us`], of the board's clock.
    pub answered_us: u64,
    /// When the answer was heard, in µs of this program's clock.
    pub heard_us: u64,
    /// The board's clock minus this program's, in µs, by the best of the last eight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset_us: Option<i64>,
    /// The round trip of the best of the last eight, in µs: twice the bound of the offset's error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub round_trip_us: Option<u64>,
}

impl ClockRow {
    /// The message.
    pub const fn pong(self) -> Pong {
        copied!(self => Pong { sent_us, received_us, answered_us })
    }
}

/// A message that has no channel of its own: none that a board of this version would say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct OtherRow {
    /// The message as JSON, in a text.
    pub json: Text,
}

impl OtherRow {
    /// The row of a message.
    pub fn new(message: &Message) -> Self {
        // A message is made of what JSON can say.
        Self {
            json: serde_json::to_string(message).unwrap_or_default().into(),
        }
    }

    /// The message. Fails if it is none.
    pub fn message(&self) -> serde_json::Result<Message> {
        serde_json::from_str(&self.json.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_has_a_port_comes_back_from_its_row() {
        let port = "/dev/ttyACM0";
        let held = State::Hung(port.into(), "host-bridge record (process 4711)".to_owned());
        for state in [State::Busy(port.into()), held] {
            let row = LinkRow::turned(&state);
            assert_eq!(row.state(Role::Sensor), Some(state));
        }
    }
}
