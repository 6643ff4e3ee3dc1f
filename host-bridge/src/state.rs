//! How a board's console stands, in words that say what to do.

use std::fmt;
use std::path::{Path, PathBuf};

use protocol::{Hello, PROTOCOL_VERSION, Role};

use crate::line::host_hello;
use crate::place::is_far;

/// How the way to one board stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// There is no such port: not plugged in, or another name.
    Absent(String),
    /// Another program has the port.
    Busy(PathBuf),
    /// A program of this user's that shares its ports has the port, and does not answer: which one.
    Hung(PathBuf, String),
    /// This user may not open the port.
    Denied(PathBuf),
    /// The port can't be used, for another reason.
    Failed(PathBuf, String),
    /// The port has just been opened: an answer may still come.
    Opened(PathBuf),
    /// The port is open, and nothing is heard.
    Silent(PathBuf),
    /// A board that speaks, text or frames, and does not answer: nothing that is sent reaches it.
    Deaf(PathBuf),
    /// What is heard is neither frames nor a board's text.
    Garbage(PathBuf),
    /// A board of another protocol or schema.
    Foreign(PathBuf, Hello),
    /// A board of another role than wanted, of whatever protocol.
    Stranger {
        /// The port.
        port: PathBuf,
        /// What it said.
        hello: Hello,
        /// What was wanted.
        wanted: Role,
    },
    /// The board is there and understood.
    Known(PathBuf, Hello),
}

impl State {
    /// Whether the board is there and understood.
    pub const fn is_known(&self) -> bool {
        matches!(self, Self::Known { .. })
    }

    /// Whether this program hears itself, or another of its kind.
    pub fn is_echo(&self) -> bool {
        matches!(self, Self::Stranger { hello, .. } if *hello == host_hello())
    }

    /// Whether the board of `role` is there, of whatever version.
    pub const fn is_of(&self, role: Role) -> bool {
        match self {
            Self::Known { .. } => true,
            Self::Foreign(_, hello) => hello.role == role.byte(),
            _ => false,
        }
    }

    /// Which board it is that is heard on the way to that of the role `wanted`; none if it is neither.
    pub fn who(&self, wanted: Role) -> Option<Role> {
        match self {
            Self::Stranger { hello, .. } => Role::from_byte(hello.role),
            _ => Some(wanted),
        }
    }

    /// The port, if one is or was to be opened.
    pub const fn port(&self) -> Option<&PathBuf> {
        match self {
            Self::Absent { .. } => None,
            Self::Busy(port)
            | Self::Hung(port, _)
            | Self::Denied(port)
            | Self::Failed(port, _)
            | Self::Opened(port)
            | Self::Silent(port)
            | Self::Deaf(port)
            | Self::Garbage(port)
            | Self::Foreign(port, _)
            | Self::Stranger { port, .. }
            | Self::Known(port, _) => Some(port),
        }
    }

    /// How much it tells: of several ports that were tried, the one that stands highest is told of.
    pub(crate) const fn weight(&self) -> u8 {
        self.rank().0
    }

    /// One word for it, for scripts; never changes.
    pub const fn word(&self) -> &'static str {
        self.rank().1
    }

    const fn rank(&self) -> (u8, &'static str) {
        match self {
            Self::Absent(..) => (0, "absent"),
            Self::Stranger { .. } => (1, "wrong-role"),
            Self::Opened(..) => (2, "opened"),
            Self::Busy(..) | Self::Hung(..) => (3, "busy"),
            Self::Silent(..) => (4, "silent"),
            Self::Failed(..) => (5, "failed"),
            Self::Deaf(..) => (6, "deaf"),
            Self::Garbage(..) => (7, "garbage"),
            Self::Denied(..) => (8, "denied"),
            Self::Foreign(..) => (9, "foreign"),
            Self::Known(..) => (10, "known"),
        }
    }

    /// What to do about it; none if there is nothing to be done.
    pub fn advice(&self) -> Option<&'static str> {
        Some(match self {
            Self::Absent(place) if is_far(Path::new(place)) => {
                "start the relay at this site, `host-bridge relay`, with that --name: it shows the other site's board"
            }
            Self::Absent { .. } => {
                "plug the board in at its ST-LINK's USB socket, or name its port with --sensor or --display"
            }
            Self::Busy { .. } => "close the other program (tio, screen, or one of another user's)",
            Self::Hung { .. } => {
                "let that process go on (`kill -CONT`), or end it (`kill -KILL`): then the port is had without it"
            }
            Self::Denied { .. } => {
                "join the group that owns it (often dialout: `sudo usermod -aG dialout $USER`, then log in again)"
            }
            Self::Failed { .. } => "see whether it is a serial port",
            Self::Opened { .. } | Self::Known { .. } => return None,
            Self::Silent { .. } => {
                "see whether the board has power and firmware (`host-bridge flash`), and whether the port is its console"
            }
            Self::Deaf { .. } => "nothing that is sent reaches the board: see its RX line (PD9)",
            Self::Garbage { .. } => {
                "see whether this is a Ridgelink board's console: 921600 baud, 8N1"
            }
            Self::Foreign { .. } => "flash the firmware of this build: `host-bridge flash`",
            Self::Stranger { .. } if self.is_echo() => {
                "see whether its TX is joined to its RX, or whether a computer is at its far end"
            }
            Self::Stranger { .. } => "exchange --sensor and --display, or flash the other firmware",
        })
    }
}

/// A state in one line, and what to do about it.
pub struct Advised<'a>(pub &'a State);

impl fmt::Display for Advised<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(state) = self;
        match state.advice() {
            Some(advice) => write!(f, "{state}: {advice}"),
            None => write!(f, "{state}"),
        }
    }
}

/// The state in one line, without the advice.
impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(port) = self.port() {
            write!(f, "{}: ", port.display())?;
        }
        match self {
            Self::Absent(place) => write!(f, "{place}: not there"),
            Self::Busy { .. } => f.write_str("another program has it"),
            Self::Hung(_, holder) => write!(f, "{holder} has it and does not answer"),
            Self::Denied { .. } => f.write_str("no permission to open it"),
            Self::Failed(_, reason) => f.write_str(reason),
            Self::Opened { .. } => f.write_str("opened"),
            Self::Silent { .. } => f.write_str("silent"),
            Self::Deaf { .. } => f.write_str("speaks and does not answer"),
            Self::Garbage { .. } => f.write_str("sends garbage"),
            Self::Foreign(_, hello) => write!(
                f,
                "{} of protocol {}, this program speaks {PROTOCOL_VERSION}",
                Named(hello),
                hello.protocol_version(),
            ),
            Self::Stranger { .. } if self.is_echo() => {
                f.write_str("sends back what this program says")
            }
            Self::Stranger { hello, wanted, .. } => {
                write!(f, "{}, not the {}", Named(hello), wanted.name())
            }
            Self::Known(_, hello) => write!(f, "{}", Named(hello)),
        }
    }
}

/// A speaker in words: role, version, chip.
pub struct Named<'a>(pub &'a Hello);

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(hello) = self;
        let role = Role::from_byte(hello.role).map_or("unknown board", Role::name);
        write!(f, "{role} {} on {}", version(hello), hello.chip_name())
    }
}

/// The version of who speaks, as "1.2.3".
pub fn version(hello: &Hello) -> String {
    let [major, minor, patch] = hello.version;
    format!("{major}.{minor}.{patch}")
}
