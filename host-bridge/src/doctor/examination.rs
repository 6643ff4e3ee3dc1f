//! What has been seen of a bench: facts, and nothing that follows from them.

use std::path::PathBuf;

use protocol::{ArmState, GAUGES, GaugeHealth, Hello, PortCounters, Role, RoleCounters, Status};

use super::clock::ClockFacts;
use super::permission::Permission;
use crate::link::Missed;
use crate::place::StLink;
use crate::state::State;

/// Everything that has been seen of a bench.
#[derive(Clone, Debug, Default)]
pub struct Examination {
    /// How long the boards that were there have been listened to, in s.
    pub looked_s: f64,
    /// The ST-LINKs' serial ports.
    pub st_links: Vec<StLink>,
    /// The debug probes.
    pub probes: Vec<ProbeFacts>,
    /// The group that the system has for plugged-in devices, if it has one.
    pub has_plugdev: bool,
    /// The boards that were looked for.
    pub boards: Vec<BoardFacts>,
}

/// A debug probe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProbeFacts {
    /// What probe-rs calls it.
    pub name: String,
    /// USB vendor.
    pub vendor: u16,
    /// USB product.
    pub product: u16,
    /// Serial number.
    pub serial: Option<String>,
    /// Whether this user may open it.
    pub is_allowed: bool,
}

/// What has been seen of one board.
#[derive(Clone, Debug)]
pub struct BoardFacts {
    /// What it is to be.
    pub role: Role,
    /// How the way to it stood in the end.
    pub state: State,
    /// Who may open its port, if this user may not.
    pub permission: Option<Permission>,
    /// The last Hello that was understood as one, of whatever version.
    pub hello: Option<Hello>,
    /// Times that it started anew while it was listened to.
    pub restarts: u32,
    /// Times that its line was lost meanwhile, or that it fell silent.
    pub losses: u32,
    /// The first status of its last start.
    pub first: Option<Status>,
    /// The last one, if there was another.
    pub last: Option<Status>,
    /// Estimates or motions that it sent a second, of its role.
    pub rate_hz: Option<f64>,
    /// The gauges' health by the last estimate; a sensor's.
    pub health: Option<[GaugeHealth; GAUGES]>,
    /// Its clock.
    pub clock: Option<ClockFacts>,
    /// What this computer's end of the line has counted.
    pub counters: PortCounters,
    /// What of that was missed because the port changed hands between programs.
    pub missed: Missed,
    /// The firmware that the bench has for it.
    pub elf: Option<ElfFacts>,
}

/// A firmware that the bench names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ElfFacts {
    /// The file.
    pub path: PathBuf,
    /// What it says of itself, or why it can't be used.
    pub hello: Result<Hello, String>,
}

impl BoardFacts {
    /// Nothing seen yet of the board of `role`.
    pub fn new(role: Role, state: State) -> Self {
        Self {
            role,
            state,
            permission: None,
            hello: None,
            restarts: 0,
            losses: 0,
            first: None,
            last: None,
            rate_hz: None,
            health: None,
            clock: None,
            counters: PortCounters::new(),
            missed: Missed::default(),
            elf: None,
        }
    }

    /// The latest status.
    pub fn status(&self) -> Option<&Status> {
        self.last.as_ref().or(self.first.as_ref())
    }

    /// What the line itself has done to this end's counters.
    pub const fn line_counters(&self) -> PortCounters {
        let Self {
            counters, missed, ..
        } = self;
        PortCounters {
            lost: counters.lost.saturating_sub(missed.lost),
            corrupt: counters.corrupt.saturating_sub(missed.corrupt),
            ..*counters
        }
    }

    /// What a sensor board's arm is kept by, in words: "free", or "stopped: by the operator".
    pub fn arm(&self) -> Option<String> {
        match &self.status()?.role {
            RoleCounters::Sensor(counters) => Some(counters.stopped.map_or_else(
                || "free".to_owned(),
                |trip| ArmState::Stopped(trip).to_string(),
            )),
            RoleCounters::Display(_) => None,
        }
    }

    /// How often it is to say what its role says: [`protocol::Estimate`]s or [`protocol::Motion`]s.
    pub const fn nominal_rate_hz(&self) -> f64 {
        match self.role {
            Role::Display => 500.0,
            _ => 100.0,
        }
    }

    /// What it says at that rate.
    pub const fn speech(&self) -> &'static str {
        match self.role {
            Role::Display => "motions",
            _ => "estimates",
        }
    }
}

impl Examination {
    /// What has been seen of the board of `role`, if it was looked for.
    pub fn board(&self, role: Role) -> Option<&BoardFacts> {
        self.boards.iter().find(|board| board.role == role)
    }
}
