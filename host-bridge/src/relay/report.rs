//! What a bridge has carried, in numbers and in words.

use std::fmt;

use hdrhistogram::Histogram as Counts;
use protocol::{Role, Trip};
use serde::Serialize;

use crate::link::by_hand;
use crate::relay::endpoint::{Endpoint, Reach};
use crate::relay::gate::Arrivals;
use crate::relay::refused::Refused;
use crate::relay::remote::{RemoteState, site};
use crate::state::{Advised, State};

/// What has come from the other site, and what became of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Incoming {
    /// Order and loss on the network.
    #[serde(flatten)]
    pub arrivals: Arrivals,
    /// With the board's line.
    pub passed: u64,
    /// Not passed on: too long on the way.
    pub stale: u64,
    /// Not passed on: the clocks had not been compared yet.
    pub undated: u64,
    /// Not passed on: a newer one came before the line was free.
    pub replaced: u64,
    /// Not passed on: the board was not there.
    pub boardless: u64,
    /// Not passed on: the board's line took no more bytes.
    pub stuck: u64,
    /// Neither sound nor of this build.
    pub refused: u64,
}

/// What has gone to the other site.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Outgoing {
    /// Given to the network.
    pub sent: u64,
    /// Not sent: the other site does not answer, and it would be old when it came.
    pub held: u64,
    /// Refused by the network.
    pub failed: u64,
}

/// Whether a bridge holds the bench, as the other site sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Holding {
    /// The other site has not said.
    #[default]
    Unknown,
    /// It does.
    Held,
    /// Another bridge of its site does, and this one watches.
    Watched,
}

impl Holding {
    /// One word for it, for scripts; never changes.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Held => "held",
            Self::Watched => "watched",
        }
    }
}

/// A bridge at one moment. All counts are since its start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// The site: its board's role.
    pub site: &'static str,
    /// Since the bridge was started, in s.
    pub uptime_s: f64,
    /// [`State::word`] of the board.
    pub board: &'static str,
    /// [`RemoteState::word`] of the other site.
    pub far: &'static str,
    /// Whether this bridge holds the bench: [`Holding::word`].
    pub hand: &'static str,
    /// To the other bridge and back, in µs.
    pub round_trip_us: Option<u64>,
    /// From the other site.
    pub incoming: Incoming,
    /// To the other site.
    pub outgoing: Outgoing,
    /// From a message's last byte on the other bridge's serial port to its last byte on this one's:
    /// since the report before, or in the last report since the start.
    pub age: Option<Percentiles>,
    /// Whether this is the last report, with `age` of all messages.
    pub total: bool,
}

impl Report {
    /// The report in one line; rates are against `before`, an earlier one.
    pub fn line(&self, before: Option<&Self>) -> String {
        let seconds = self.uptime_s - before.map_or(0.0, |before| before.uptime_s);
        let rate = |count: u64| {
            if seconds > 0.0 {
                count as f64 / seconds
            } else {
                0.0
            }
        };
        let passed = self.incoming.passed - before.map_or(0, |before| before.incoming.passed);
        let sent = self.outgoing.sent - before.map_or(0, |before| before.outgoing.sent);
        let Self { incoming: i, .. } = self;
        let Arrivals {
            lost,
            late,
            duplicated,
            superseded,
            ..
        } = i.arrivals;
        let not_passed =
            i.stale + i.undated + i.replaced + i.boardless + i.stuck + i.refused + superseded;
        let round_trip = self
            .round_trip_us
            .map(|us| format!("{} ms", milliseconds(us)));
        format!(
            "{:8.1} s  in {:5.1}/s, age {}; lost {lost}, late {late}, twice {duplicated}, not passed on {not_passed}; out {:5.1}/s; round trip {}",
            self.uptime_s,
            rate(passed),
            ages(self.age),
            rate(sent),
            round_trip.unwrap_or_else(|| "unknown".to_owned()),
        )
    }
}

/// µs as ms.
fn milliseconds(us: u64) -> String {
    format!("{:.2}", us as f64 / 1_000.0)
}

fn ages(age: Option<Percentiles>) -> String {
    let Some(age) = age else {
        return "unknown".to_owned();
    };
    let [p50, p99, max] = [age.p50_us, age.p99_us, age.max_us].map(milliseconds);
    format!("{p50} p50, {p99} p99, {max} max ms")
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            uptime_s,
            site,
            incoming: i,
            outgoing: o,
            ..
        } = self;
        let Arrivals {
            received,
            lost,
            late,
            duplicated,
            superseded,
        } = i.arrivals;
        write!(
            f,
            "{uptime_s:.1} s at {site}: {received} came, {} passed on
  on the network: {lost} lost, {late} late, {duplicated} twice, {} refused
  not passed on: {} too old, {} of unknown age, {} replaced by a newer one, {superseded} superseded, {} without a board, {} to a full line
  sent: {}, held back: {}, refused by the network: {}
  age: {}",
            i.passed, i.refused, i.stale, i.undated, i.replaced, i.boardless, i.stuck, o.sent, o.held, o.failed, ages(self.age)
        )
    }
}

/// What a person should know.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// The board's link stands differently.
    Board(State),
    /// The other site stands differently.
    Remote(Role, RemoteState),
    /// A second bridge is heard from there; it watches while the first one speaks.
    Watcher(Role),
    /// None of these is heard from there any more.
    WatcherGone(Role),
    /// Another bridge has one's own role and name, and may hold the bench.
    Rival(Role),
    /// No other one is heard any more.
    RivalGone(Role),
    /// Whether this bridge holds the bench.
    Hand(Holding),
    /// At that site, who held the bench has handed it over to who waited.
    HandedOver(Role),
    /// The bench can't be handed over from here: this bridge does not hold it.
    NotHeld,
    /// The bench was to be handed over, but nobody waits for it.
    NobodyWaits,
    /// A program was refused something by its certificate's name.
    Refused(Refused),
    /// This many µs the network takes: longer than anything may be old.
    Slow {
        /// One way, in µs.
        age_us: u64,
        /// What is allowed, in µs.
        max_age_us: u64,
    },
    /// Nobody is heard, for this reason.
    Unreached(Endpoint, Reach),
    /// Somebody is reached, but not the other site's bridge.
    Alone(Role),
    /// Nobody has come from the other site.
    Unvisited(Role),
    /// Stop, said at this site.
    StopSaid(Role),
    /// This site's board was told to stop.
    StopPassed,
    /// This site's board says that it has stopped, for this reason, if this program knows it.
    Stopped(Option<Trip>),
    /// A board has not answered a Stop, and is told again.
    NotStopped {
        /// Whose it is.
        role: Role,
        /// Whether it is this site's.
        is_here: bool,
    },
    /// The Stop said here is done at that site: the reason for which its board says that it has stopped,
    /// if this program knows it.
    StopHeard(Role, Option<Trip>),
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Board(state) => write!(f, "board: {}", Advised(state)),
            Self::Remote(role, state) => write!(f, "{}: {state}", site(*role)),
            Self::Watcher(role) => write!(
                f,
                "{}: a second bridge is there; the first one keeps the bench until it ends, or is silent for a second",
                site(*role)
            ),
            Self::Rival(role) => write!(
                f,
                "another bridge calls itself {} under this name: whichever was first holds the bench, the other one watches; to hand it over, send SIGUSR2 to who holds it, or end that one",
                site(*role)
            ),
            Self::WatcherGone(role) => write!(f, "{}: the second bridge has gone", site(*role)),
            Self::RivalGone(role) => write!(
                f,
                "no other bridge calls itself {} under this name any more",
                site(*role)
            ),
            Self::Hand(Holding::Held) => f.write_str("this bridge holds the bench"),
            Self::Hand(Holding::Watched) => f.write_str(
                "another bridge of this site holds the bench: this one watches",
            ),
            Self::Hand(Holding::Unknown) => {
                f.write_str("who holds the bench is not known")
            }
            Self::HandedOver(role) => write!(
                f,
                "{}: the bench is handed over to the bridge that waited for it",
                site(*role)
            ),
            Self::NotHeld => f.write_str(
                "this bridge does not hold the bench, and can't hand it over: tell the one that does",
            ),
            Self::NobodyWaits => {
                f.write_str("nobody waits for the bench: this bridge keeps it")
            }
            Self::Refused(Refused::Named { peer, key }) => {
                let key = key.as_deref().unwrap_or("any key");
                write!(
                    f,
                    "REFUSED: {peer} may not speak on {key}: its certificate is for something else"
                )
            }
            Self::Refused(Refused::More(count)) => {
                write!(f, "REFUSED: {count} more of the last minute")
            }
            Self::Slow { age_us, max_age_us } => write!(
                f,
                "the network takes {} ms, longer than the {} ms of --max-age: nothing is passed on; give a longer one if such a delay is meant",
                milliseconds(*age_us),
                milliseconds(*max_age_us)
            ),
            Self::Unreached(endpoint, reach) => write!(f, "{endpoint}: {reach}"),
            Self::Alone(role) => write!(
                f,
                "the network is there, but {} is not heard: see whether its bridge runs, with the same --name",
                site(*role)
            ),
            Self::Unvisited(role) => write!(
                f,
                "nobody comes from {}: see whether its bridge runs, connects here, and has the same --name",
                site(*role)
            ),
            Self::StopSaid(role) => write!(f, "Stop, said by {}", site(*role)),
            Self::StopPassed => f.write_str("Stop: with the board here"),
            Self::Stopped(trip) => write!(f, "Stop: the board here has stopped: {}", cause(*trip)),
            Self::NotStopped { role, is_here } => {
                let place = if *is_here { "here".to_owned() } else { format!("at {}", site(*role)) };
                write!(
                    f,
                    "NOT STOPPED as far as is known: the board {place} has not answered: {}",
                    by_hand(&[*role])
                )
            }
            Self::StopHeard(role, trip) => write!(
                f,
                "Stop: the board at {} has stopped: {}",
                site(*role),
                cause(*trip)
            ),
        }
    }
}

/// Why a board has stopped, in words.
pub fn cause(trip: Option<Trip>) -> &'static str {
    trip.map_or("a cause that only a later version knows", Trip::name)
}

/// What is longer counts as that, in µs: 19 h.
const LONGEST_US: u64 = 1 << 36;
/// Decimal digits to which a time is known.
const DIGITS: u8 = 2;

/// How often each time came, in µs.
#[derive(Clone, Debug)]
pub struct Histogram(Counts<u64>);

impl Default for Histogram {
    fn default() -> Self {
        let counts = Counts::new_with_bounds(1, LONGEST_US, DIGITS);
        Self(counts.expect("bounds and digits that a histogram may have"))
    }
}

/// What times come to, in µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Percentiles {
    /// Half of all times were no longer.
    pub p50_us: u64,
    /// All but one in a hundred were no longer.
    pub p99_us: u64,
    /// The longest.
    pub max_us: u64,
}

impl Histogram {
    /// Counts a time.
    pub fn add(&mut self, time_us: u64) {
        self.0.saturating_record(time_us);
    }

    /// Median, 99th percentile and longest, rounded up by at most 1/100; `None` if nothing was counted.
    pub fn percentiles(&self) -> Option<Percentiles> {
        (!self.0.is_empty()).then(|| Percentiles {
            p50_us: self.0.value_at_quantile(0.5),
            p99_us: self.0.value_at_quantile(0.99),
            max_us: self.0.max(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_times_to_a_hundredth() {
        let mut times = Histogram::default();
        assert_eq!(times.percentiles(), None);
        (1..=1_000).for_each(|time_us| times.add(time_us));
        let found = times.percentiles().expect("times were counted");
        assert!((500..=505).contains(&found.p50_us), "{found:?}");
        assert!((990..=1_000).contains(&found.p99_us), "{found:?}");
        assert!((1_000..=1_010).contains(&found.max_us), "{found:?}");
        times.add(u64::MAX);
        let found = times.percentiles().expect("times were counted");
        assert!(found.max_us >= LONGEST_US, "{found:?}");
    }
}
