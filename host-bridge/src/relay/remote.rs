//! Who is at the other site, and since when nothing was heard from there.

use std::fmt;

use protocol::{Hello, PROTOCOL_VERSION, Role, SCHEMA_HASH};

use crate::relay::envelope::ENVELOPE_VERSION;
use crate::state::version;

/// After this long without a word the other site counts as silent, in µs.
pub const SILENCE_US: u64 = 2_000_000;

/// How the other site stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RemoteState {
    Unheard,
    /// A bridge of this build is there.
    Known {
        hello: Hello,
        session: u64,
    },
    /// A bridge was there, and nothing has been heard for [`SILENCE_US`].
    Silent,
    /// A bridge of another build is there.
    Foreign {
        hello: Hello,
        /// Its envelope's version.
        version: u8,
    },
}

/// Somebody besides the two bridges that talk to each other: told when he comes, and when he has gone.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bystander {
    heard_us: Option<u64>,
}

impl Bystander {
    /// He was heard. True if he is new.
    pub const fn hear(&mut self, now_us: u64) -> bool {
        self.heard_us.replace(now_us).is_none()
    }

    /// Time passes. True if he has just gone.
    pub fn elapse(&mut self, now_us: u64) -> bool {
        let is_silent = |heard_us| now_us.saturating_sub(heard_us) > SILENCE_US;
        self.heard_us
            .take_if(|heard_us| is_silent(*heard_us))
            .is_some()
    }
}

impl RemoteState {
    /// One word for it, for scripts; never changes.
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Unheard => "unheard",
            Self::Known { .. } => "known",
            Self::Silent => "silent",
            Self::Foreign { .. } => "foreign",
        }
    }
}

impl fmt::Display for RemoteState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unheard => f.write_str("not heard yet"),
            Self::Known { hello, .. } => write!(f, "{} is there", Bridge(hello)),
            Self::Silent => f.write_str("silent"),
            Self::Foreign { hello, version } => write!(
                f,
                "{} speaks protocol {} (schema {:016x}, envelope {version}), this one {PROTOCOL_VERSION} (schema {SCHEMA_HASH:016x}, envelope {ENVELOPE_VERSION}): install the same build at both sites",
                Bridge(hello),
                hello.protocol_version(),
                hello.schema_hash(),
            ),
        }
    }
}

/// A bridge in words: program and version.
struct Bridge<'a>(&'a Hello);

impl fmt::Display for Bridge<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(hello) = self;
        write!(f, "{} {}", hello.chip_name(), version(hello))
    }
}

/// The other site's bridge.
#[derive(Clone, Debug)]
pub struct RemoteBridge {
    state: RemoteState,
    heard_us: u64,
}

impl Default for RemoteBridge {
    fn default() -> Self {
        Self {
            state: RemoteState::Unheard,
            heard_us: 0,
        }
    }
}

impl RemoteBridge {
    pub const fn state(&self) -> &RemoteState {
        &self.state
    }

    /// A sound envelope came. True if it is the first one of another start of the bridge.
    pub fn hear(&mut self, hello: Hello, session: u64, now_us: u64) -> bool {
        let is_other = !self.is_session(session);
        self.heard_us = now_us;
        self.state = RemoteState::Known { hello, session };
        is_other
    }

    /// An envelope of another build came. It is no more than noted while a bridge of this build is there.
    pub fn hear_foreign(&mut self, hello: Hello, version: u8) {
        if !matches!(self.state, RemoteState::Known { .. }) {
            self.state = RemoteState::Foreign { hello, version };
        }
    }

    /// Time passes. True if the other site has just become silent.
    pub fn elapse(&mut self, now_us: u64) -> bool {
        let is_silent = matches!(self.state, RemoteState::Known { .. })
            && now_us.saturating_sub(self.heard_us) > SILENCE_US;
        if is_silent {
            self.state = RemoteState::Silent;
        }
        is_silent
    }

    /// Whether it is the one of this session.
    pub const fn is_session(&self, other: u64) -> bool {
        matches!(self.state, RemoteState::Known { session, .. } if session == other)
    }
}

pub const fn site(role: Role) -> &'static str {
    match role {
        Role::Sensor => "the sensor's site",
        Role::Display => "the display's site",
        Role::Host => "an operator",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::host_hello;

    #[test]
    fn a_bystander_is_told_of_when_he_comes_and_when_he_has_gone_each_time() {
        let mut other = Bystander::default();
        for start_us in [0, 100 * SILENCE_US] {
            assert!(!other.elapse(start_us));
            assert!(other.hear(start_us));
            assert!(!other.hear(start_us + SILENCE_US));
            assert!(!other.elapse(start_us + 2 * SILENCE_US));
            assert!(other.elapse(start_us + 2 * SILENCE_US + 1));
            assert!(!other.elapse(start_us + 3 * SILENCE_US));
        }
    }

    #[test]
    fn who_is_heard_is_known_until_it_is_silent() {
        let mut remote = RemoteBridge::default();
        assert!(remote.hear(host_hello(), 1, 0));
        assert!(!remote.hear(host_hello(), 1, 10));
        assert!(!remote.elapse(10 + SILENCE_US));
        assert!(remote.elapse(11 + SILENCE_US));
        assert!(!remote.elapse(12 + SILENCE_US), "said once");
        assert_eq!(remote.state(), &RemoteState::Silent);
    }

    #[test]
    fn another_build_is_named_unless_one_of_this_build_is_there() {
        let mut other = host_hello();
        other.protocol = 77_u16.to_le_bytes();
        let mut remote = RemoteBridge::default();
        remote.hear_foreign(other, 1);
        let words = remote.state().to_string();
        assert!(words.contains("speaks protocol 77"), "{words}");
        remote.hear(host_hello(), 1, 0);
        remote.hear_foreign(other, 1);
        assert_eq!(remote.state().word(), "known");
    }
}
