//! From what a link tells to rows with their times; what is missing is found and written down, too.

use protocol::{
    ClockOffset, Configuration, GAUGE_BLOCK, Message, PortCounters, Role, RoleCounters,
};

use super::row::{
    ClockRow, DisplayConfigurationRow, DisplayStatusRow, EstimateRow, GaugeRow, LinkRow, Lost,
    OtherRow, Row, SensorConfigurationRow, SensorStatusRow,
};
use crate::host_clock::unix_ns;
use crate::link::Event;

const SAMPLE_NS: u64 = 1_000_000;

/// A row and its times.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The board that it is of.
    pub role: Role,
    /// What is written down.
    pub row: Row,
    /// When it was heard, in ns since 1970. Samples come eight at a time: theirs is when they were taken.
    /// Never decreases on a channel.
    pub log_ns: u64,
    /// When it was said or taken, by the board's own clock mapped to this host's; when it was heard where
    /// the board gives no instant, or nothing is known of its clock yet.
    pub publish_ns: u64,
}

/// What has been counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Messages of the boards.
    pub messages: u64,
    /// Samples of the gauges, at 1 kHz.
    pub samples: u64,
    /// Samples, estimates and motions that were not heard.
    pub lost: u64,
    /// Times that some were not heard.
    pub gaps: u64,
    /// Messages that were heard but not written down, because the disk was too slow.
    pub unwritten: u64,
}

/// Turns events into entries.
#[derive(Default)]
pub struct RowBuilder {
    sensor: Board,
    display: Board,
    tally: Tally,
}

/// What is known of a board.
#[derive(Default)]
struct Board {
    clock: ClockOffset,
    samples: Numbers,
    estimates: Numbers,
    motions: Numbers,
    last_sample_ns: u64,
}

/// Numbers that count up by one.
#[derive(Default)]
struct Numbers {
    next: Option<u32>,
}

impl Numbers {
    /// Takes `count` numbers from `first` on; how many were skipped. Smaller ones are a new beginning.
    fn take(&mut self, first: u32, count: u32) -> u32 {
        let skipped = self.next.map_or(0, |next| first.wrapping_sub(next));
        self.next = Some(first.wrapping_add(count));
        if skipped <= i32::MAX.cast_unsigned() {
            skipped
        } else {
            0
        }
    }
}

impl Board {
    /// Everything that a restart ends.
    fn restart(&mut self) {
        *self = Self {
            last_sample_ns: self.last_sample_ns,
            ..Self::default()
        };
    }

    /// An instant of the board's on the calendar.
    fn calendar_ns(&self, instant_us: u64) -> Option<u64> {
        self.clock.to_own_us(instant_us).map(unix_ns)
    }
}

impl RowBuilder {
    /// What has been counted so far.
    pub const fn tally(&self) -> Tally {
        self.tally
    }

    /// Enters an event of the board of `role`, which was told at `at_us` of this host's clock.
    ///
    /// # Errors
    /// Whatever `put` fails with.
    pub fn enter<E>(
        &mut self,
        role: Role,
        event: &Event,
        at_us: u64,
        mut put: impl FnMut(Entry) -> Result<(), E>,
    ) -> Result<(), E> {
        let log_ns = unix_ns(at_us);
        let board = match role {
            Role::Display => &mut self.display,
            Role::Sensor | Role::Host => &mut self.sensor,
        };
        let tally = &mut self.tally;
        let mut write = |row, publish_ns| {
            put(Entry {
                role,
                row,
                log_ns,
                publish_ns,
            })
        };
        let message = match event {
            Event::StateChanged(state) => {
                return write(Row::Link(LinkRow::turned(state)), log_ns);
            }
            Event::Restarted => {
                board.restart();
                return write(Row::Link(LinkRow::restarted()), log_ns);
            }
            Event::Heard { message, .. } => message,
        };
        tally.messages += 1;
        let (lost, skipped) = match message {
            Message::Estimate(estimate) => {
                (Lost::Estimates, board.estimates.take(estimate.sequence, 1))
            }
            Message::Motion(motion) => (Lost::Motions, board.motions.take(motion.sequence, 1)),
            Message::Gauges(gauges) => {
                let count = GAUGE_BLOCK as u32;
                (
                    Lost::Samples,
                    board.samples.take(gauges.first_sample, count),
                )
            }
            _ => (Lost::Samples, 0),
        };
        if skipped > 0 {
            tally.gaps += 1;
            tally.lost += u64::from(skipped);
            write(Row::Link(LinkRow::gap(lost, skipped.into())), log_ns)?;
        }
        if let (Role::Sensor, Message::Gauges(gauges)) = (role, message) {
            tally.samples += GAUGE_BLOCK as u64;
            for (row, left) in GaugeRow::all(gauges)
                .into_iter()
                .zip((0..GAUGE_BLOCK as u64).rev())
            {
                let taken_ns = board
                    .calendar_ns(row.instant_us)
                    // A board whose time runs faster, as a simulator's may, was not ahead of its words.
                    .filter(|&taken_ns| taken_ns <= log_ns)
                    .unwrap_or_else(|| log_ns.saturating_sub(left * SAMPLE_NS))
                    .max(board.last_sample_ns + 1);
                board.last_sample_ns = taken_ns;
                put(Entry {
                    role,
                    row: Row::Gauges(row),
                    log_ns: taken_ns,
                    publish_ns: taken_ns,
                })?;
            }
            return Ok(());
        }
        let (row, instant_us) = row(role, message, at_us, &mut board.clock);
        let publish_ns = instant_us
            .and_then(|instant_us| board.calendar_ns(instant_us))
            .map_or(log_ns, |said_ns| said_ns.min(log_ns));
        write(row, publish_ns)
    }

    /// Enters what this end of the line to the board of `role` has counted.
    ///
    /// # Errors
    /// Whatever `put` fails with.
    pub fn enter_counters<E>(
        &self,
        role: Role,
        counters: PortCounters,
        at_us: u64,
        put: impl FnOnce(Entry) -> Result<(), E>,
    ) -> Result<(), E> {
        put(now(role, Row::Line(counters), at_us))
    }

    /// Enters that events of the board of `role` could not be taken.
    ///
    /// # Errors
    /// Whatever `put` fails with.
    pub fn enter_unwritten<E>(
        &mut self,
        role: Role,
        missing: u64,
        at_us: u64,
        put: impl FnOnce(Entry) -> Result<(), E>,
    ) -> Result<(), E> {
        self.tally.unwritten += missing;
        let row = LinkRow::gap(Lost::Unwritten, missing);
        put(now(role, Row::Link(row), at_us))
    }
}

fn now(role: Role, row: Row, at_us: u64) -> Entry {
    let log_ns = unix_ns(at_us);
    Entry {
        role,
        row,
        log_ns,
        publish_ns: log_ns,
    }
}

/// A message's row, and its instant of the board's clock if it has one. What that board never says goes
/// to the channel for others.
fn row(role: Role, message: &Message, at_us: u64, clock: &mut ClockOffset) -> (Row, Option<u64>) {
    match (role, message) {
        (Role::Sensor, Message::Estimate(estimate)) => (
            Row::Estimate(EstimateRow::from(*estimate)),
            Some(estimate.instant_us),
        ),
        (Role::Display, Message::Motion(motion)) => (Row::Motion(*motion), Some(motion.instant_us)),
        (Role::Display, Message::Safety(safety)) => {
            (Row::Safety((*safety).into()), Some(safety.instant_us))
        }
        (_, Message::Status(status)) => {
            let row = match (role, &status.role) {
                (Role::Sensor, RoleCounters::Sensor(sensor)) => {
                    Row::SensorStatus(SensorStatusRow::new(status, *sensor))
                }
                (Role::Display, RoleCounters::Display(display)) => {
                    Row::DisplayStatus(DisplayStatusRow::new(status, display))
                }
                _ => Row::Other(OtherRow::new(message)),
            };
            (row, Some(status.uptime_us))
        }
        (_, Message::Configuration(report)) => {
            let (refused, hash) = (report.refused, report.hash);
            let row = match (role, report.configuration) {
                (Role::Sensor, Configuration::Sensor(in_force)) => {
                    Row::SensorConfiguration(SensorConfigurationRow {
                        refused,
                        hash,
                        in_force,
                    })
                }
                (Role::Display, Configuration::Display(in_force)) => {
                    Row::DisplayConfiguration(DisplayConfigurationRow {
                        refused,
                        hash,
                        in_force,
                    })
                }
                _ => Row::Other(OtherRow::new(message)),
            };
            (row, None)
        }
        (_, Message::Pong(pong)) => {
            clock.on_pong(pong, at_us);
            let row = Row::Clock(ClockRow {
                sent_us: pong.sent_us,
                received_us: pong.received_us,
                answered_us: pong.answered_us,
                heard_us: at_us,
                offset_us: clock.offset_us(),
                round_trip_us: clock.round_trip_us(),
            });
            (row, Some(pong.answered_us))
        }
        _ => (Row::Other(OtherRow::new(message)), None),
    }
}
