//! What has been seen of a bench: facts, and nothing that follows from them but how its boards' clocks go.

use std::path::PathBuf;

use protocol::{
    ArmState, ClockOffset, GAUGES, GaugeHealth, Hello, Pong, PortCounters, Role, RoleCounters,
    Status,
};

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

/// One exchange of a ping and its pong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exchange {
    /// When the answer came, in µs of this computer's clock.
    pub at_us: u64,
    /// The board's clock minus this computer's, in µs: wrong by half the round trip at most.
    pub offset_us: i64,
    /// Time on the way, in µs.
    pub round_trip_us: u64,
}

impl Exchange {
    /// The exchange that an answer at `at_us` ends; none if its instants contradict each other.
    pub fn new(pong: &Pong, at_us: u64) -> Option<Self> {
        let mut clock = ClockOffset::new();
        clock.on_pong(pong, at_us).then_some(())?;
        Some(Self {
            at_us,
            offset_us: clock.offset_us()?,
            round_trip_us: clock.round_trip_us()?,
        })
    }
}

/// What several exchanges tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockFacts {
    /// The board's clock minus this computer's, in µs, by the shortest exchange.
    pub offset_us: i64,
    /// The shortest round trip, in µs.
    pub round_trip_us: u64,
    /// How fast the board's clock gains, if there was time to see it.
    pub drift: Option<Drift>,
}

/// How fast a clock gains on another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// In µs a second; above 0 if the board's clock is the faster one.
    pub ppm: f64,
    /// The bound of its error, from the round trips, in µs a second.
    pub error_ppm: f64,
}

impl ClockFacts {
    /// From exchanges in the order of time; none without one.
    pub fn new(exchanges: &[Exchange]) -> Option<Self> {
        let best = shortest(exchanges)?;
        Some(Self {
            offset_us: best.offset_us,
            round_trip_us: best.round_trip_us,
            drift: drift(exchanges),
        })
    }
}

fn shortest(exchanges: &[Exchange]) -> Option<&Exchange> {
    exchanges
        .iter()
        .min_by_key(|exchange| exchange.round_trip_us)
}

/// Between the shortest exchange of the first third and that of the last one: they have waited least in
/// queues, and each offset is wrong by no more than half its round trip.
fn drift(exchanges: &[Exchange]) -> Option<Drift> {
    let third = exchanges.len() / 3;
    let from = shortest(&exchanges[..third])?;
    let to = shortest(&exchanges[exchanges.len() - third..])?;
    let span_s = to.at_us.checked_sub(from.at_us).filter(|&us| us > 0)? as f64 / 1e6;
    let gained_us = (i128::from(to.offset_us) - i128::from(from.offset_us)) as f64;
    Some(Drift {
        ppm: gained_us / span_s,
        error_ppm: (from.round_trip_us as f64 + to.round_trip_us as f64) / 2.0 / span_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchange_is_read_from_its_instants() {
        let pong = Pong {
            sent_us: 1_000,
            received_us: 501_300,
            answered_us: 501_310,
        };
        let exchange = Exchange::new(&pong, 1_610).expect("in order");
        assert_eq!(exchange.round_trip_us, 600);
        assert_eq!(exchange.offset_us, 500_000);
        assert_eq!(Exchange::new(&pong, 900), None);
    }

    #[test]
    fn drift_is_found_among_exchanges_that_waited() {
        // 80 ppm fast; every answer but each third has waited 5 ms on its way back, which looks like an
        // offset of -2.5 ms.
        let exchanges: Vec<Exchange> = (0..30)
            .map(|at| {
                let at_us = 1_000_000 + at * 100_000;
                let waited_us = if at % 3 == 0 { 0 } else { 5_000 };
                let gained_us = i64::try_from(at_us * 80 / 1_000_000).expect("small");
                Exchange {
                    at_us,
                    offset_us: 7_000 + gained_us - i64::try_from(waited_us / 2).expect("small"),
                    round_trip_us: 100 + waited_us,
                }
            })
            .collect();
        let facts = ClockFacts::new(&exchanges).expect("exchanges");
        assert_eq!(facts.round_trip_us, 100);
        let drift = facts.drift.expect("three seconds");
        assert!((drift.ppm - 80.0).abs() <= 1.0, "{drift:?}");
        // 100 µs over the 2.1 s between the first and the 22nd exchange.
        assert!((drift.error_ppm - 100.0 / 2.1).abs() < 0.1, "{drift:?}");
    }

    #[test]
    fn two_exchanges_tell_no_drift_and_none_tells_nothing() {
        let exchange = Exchange {
            at_us: 5,
            offset_us: 1,
            round_trip_us: 2,
        };
        let facts = ClockFacts::new(&[exchange; 2]).expect("exchanges");
        assert_eq!(facts.drift, None);
        assert_eq!(ClockFacts::new(&[]), None);
    }
}
