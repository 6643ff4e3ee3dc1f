//! What a pair of bridges is called on the network.

use std::fmt;
use std::str::FromStr;

use protocol::Role;

/// Longest name, in bytes.
const LONGEST: usize = 64;

/// The name that the bridges of one bench share: two benches may use one router.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(String);

/// Why a word is no name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{given:?} is no name: take 1 to {LONGEST} of a-z A-Z 0-9 . _ -")]
pub struct NameError {
    /// The word.
    pub given: String,
}

impl FromStr for Name {
    type Err = NameError;

    fn from_str(given: &str) -> Result<Self, NameError> {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        if (1..=LONGEST).contains(&given.len()) && given.bytes().all(is_plain) {
            Ok(Self(given.to_owned()))
        } else {
            Err(NameError {
                given: given.to_owned(),
            })
        }
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// What is said on a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// What the board says: only the newest counts.
    Board,
    /// Pings and pongs.
    Clock,
    /// What has to come: Stops, that they were heard, who leaves and who hands the bench over.
    Stop,
    /// All that the board says, for who watches.
    Shown,
}

impl Channel {
    /// Whether only the newest on it matters: what the network loses of it is not sent again, and holds up nothing.
    pub const fn is_fleeting(self) -> bool {
        matches!(self, Self::Board | Self::Clock)
    }
}

impl Name {
    /// The key under which the bridge of `role` speaks on `channel`. A host's is an operator who has no
    /// board.
    pub fn key(&self, role: Role, channel: Channel) -> String {
        let channel = match channel {
            Channel::Board => "board",
            Channel::Clock => "clock",
            Channel::Stop => "stop",
            Channel::Shown => "shown",
        };
        format!("ridgelink/{self}/{}/{channel}", role.name())
    }

    /// All that is said at the bench.
    pub fn all_keys(&self) -> String {
        format!("ridgelink/{self}/**")
    }

    /// All that the bridge of `role` says.
    pub fn keys(&self, role: Role) -> String {
        format!("ridgelink/{self}/{}/*", role.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_one_plain_word() {
        for good in ["bench", "lab-2.left_hand", "x"] {
            assert!(good.parse::<Name>().is_ok(), "{good}");
        }
        for bad in ["", "a/b", "*", "a b", "$x", "ä", &"x".repeat(65)] {
            assert!(bad.parse::<Name>().is_err(), "{bad}");
        }
    }

    #[test]
    fn keys_tell_bench_site_and_channel() {
        let name: Name = "bench".parse().expect("a name");
        let key = name.key(Role::Display, Channel::Board);
        assert_eq!(key, "ridgelink/bench/display/board");
        assert_eq!(name.keys(Role::Sensor), "ridgelink/bench/sensor/*");
    }
}
