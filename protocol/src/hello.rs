//! The one message whose layout never changes, so that any two builds can say that they differ.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// First bytes of every [`Hello`], on the wire and in an ELF's `.ridgelink` section.
pub const MAGIC: [u8; 4] = *b"RDGL";
/// Length of a [`Hello`] in bytes, postcard-encoded: every field is made of single bytes.
pub const HELLO_LENGTH: usize = 4 + 2 + 8 + 1 + 16 + 3 + 1;

/// What a participant is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The board with the gauges.
    Sensor,
    /// The board with the actuators.
    Display,
    /// A program on a computer.
    Host,
}

impl Role {
    /// The role's byte in a [`Hello`].
    pub const fn byte(self) -> u8 {
        match self {
            Role::Sensor => b's',
            Role::Display => b'd',
            Role::Host => b'h',
        }
    }

    /// The role behind a [`Hello`]'s byte; none if a later version has roles that this one has not.
    pub const fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            b's' => Some(Role::Sensor),
            b'd' => Some(Role::Display),
            b'h' => Some(Role::Host),
            _ => None,
        }
    }

    /// The role in words, as used in messages to people.
    pub const fn name(self) -> &'static str {
        match self {
            Role::Sensor => "sensor",
            Role::Display => "display",
            Role::Host => "host",
        }
    }
}

/// Who speaks, and in which version: bytes only, so that no change of encoding can move a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello {
    /// [`MAGIC`].
    pub magic: [u8; 4],
    /// [`crate::PROTOCOL_VERSION`], little-endian.
    pub protocol: [u8; 2],
    /// [`crate::SCHEMA_HASH`], little-endian.
    pub schema: [u8; 8],
    /// [`Role::byte`].
    pub role: u8,
    /// The chip or computer in ASCII, zero-padded.
    pub chip: [u8; 16],
    /// Firmware or program version: major, minor, patch.
    pub version: [u8; 3],
    /// 1 if the speaker has not heard a Hello yet and would like one, else 0.
    pub asks: u8,
}

impl Hello {
    /// The same Hello, asking for an answer or not.
    pub const fn asking(mut self, asks: bool) -> Self {
        self.asks = asks as u8;
        self
    }

    /// The Hello as it lies in memory, on the wire and in an ELF.
    pub const fn to_bytes(self) -> [u8; HELLO_LENGTH] {
        let mut bytes = [0; HELLO_LENGTH];
        let mut at = 0;
        macro_rules! put {
            ($field:expr) => {{
                let field = $field;
                let mut i = 0;
                while i < field.len() {
                    bytes[at] = field[i];
                    at += 1;
                    i += 1;
                }
            }};
        }
        put!(self.magic);
        put!(self.protocol);
        put!(self.schema);
        put!([self.role]);
        put!(self.chip);
        put!(self.version);
        put!([self.asks]);
        assert!(at == HELLO_LENGTH);
        bytes
    }

    /// Reads what [`Hello::to_bytes`] wrote, by any version of this crate. None if the length or the
    /// magic is another.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != HELLO_LENGTH {
            return None;
        }
        let hello: Self = postcard::from_bytes(bytes).ok()?;
        (hello.magic == MAGIC).then_some(hello)
    }

    /// The protocol version spoken.
    pub const fn protocol_version(&self) -> u16 {
        u16::from_le_bytes(self.protocol)
    }

    /// The hash of the message shapes spoken.
    pub const fn schema_hash(&self) -> u64 {
        u64::from_le_bytes(self.schema)
    }

    /// The chip's name, as far as it is readable text.
    pub fn chip_name(&self) -> &str {
        let end = self
            .chip
            .iter()
            .position(|&b| b == 0)
            .unwrap_or(self.chip.len());
        core::str::from_utf8(&self.chip[..end]).unwrap_or("?")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_role_comes_back_from_its_byte() {
        for (role, byte) in [
            (Role::Sensor, b's'),
            (Role::Display, b'd'),
            (Role::Host, b'h'),
        ] {
            assert_eq!((role.byte(), Role::from_byte(byte)), (byte, Some(role)));
        }
        assert_eq!(Role::from_byte(b'S'), None);
    }

    #[test]
    fn people_are_told_who_it_is_and_on_which_chip() {
        let names = [Role::Sensor, Role::Display, Role::Host].map(Role::name);
        assert_eq!(names, ["sensor", "display", "host"]);
        let hello = |chip| Hello::new(Role::Sensor, chip, [0, 1, 0]);
        assert_eq!(hello("stm32f429zi").chip_name(), "stm32f429zi");
        let mut unreadable = hello("stm32f429zi");
        unreadable.chip[3] = 0xff;
        assert_eq!(unreadable.chip_name(), "?");
    }
}
