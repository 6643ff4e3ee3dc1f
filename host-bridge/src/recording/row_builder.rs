//! From what a link tells to rows with their times; what is missing is found and written down, too.

use firmware_sensor::{ESTIMATE_RATE_HZ, SAMPLE_RATE_HZ};
use protocol::{ClockOffset, GAUGE_BLOCK, Message, Pong, PortCounters, Role, RoleCounters};

use super::row::{
    CHANNELS, ClockRow, DisplayReportRow, DisplayStatusRow, LinkRow, LogRow, Lost, OtherRow, Row,
    SensorReportRow, SensorStatusRow, channel,
};
use crate::clock::unix_ns;
use crate::link::Event;

const SAMPLE_NS: u64 = 1_000_000;
const SAMPLES_PER_ESTIMATE: u32 = SAMPLE_RATE_HZ / ESTIMATE_RATE_HZ;
/// So many samples in a row, a second of them, are not lost where no estimate is: their stream was off.
const PAUSE_SAMPLES: u32 = SAMPLE_RATE_HZ;
/// How far a clock may be from where its offset says, in µs, beyond the instants between which it was read:
/// twice what two crystals 100 ppm apart drift over the eight exchanges that the offset is the best of.
const DRIFT_US: u64 = 1_600;

/// A row and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The board that it is of.
    pub role: Role,
    /// What is written down.
    pub row: Row,
    /// When it was taken, in ns since 1970: the instant that the board gives, by its clock's offset to this
    /// host's; when it was heard where the board gives none, or nothing is known of its clock yet. Of a block of
    /// samples it is the first one's. Never later than when it was heard, and never decreases on a channel.
    ///
    /// Recordings of format 1 have the time at which it was heard here.
    pub log_ns: u64,
}

/// Something about a board that is to be written down.
#[derive(Clone, Debug, PartialEq)]
pub enum Note {
    /// What its link told.
    Event(Event),
    /// What this end of its line has counted.
    Counters(PortCounters),
    /// A line of its firmware's log, with defmt's level.
    Log(Option<&'static str>, String),
    /// That so many notes could not be taken from then on.
    Unwritten(u64),
}

/// What has been counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Messages of the boards.
    pub messages: u64,
    /// Samples of the gauges, at 1 kHz.
    pub samples: u64,
    /// Samples, estimates and motions that were said and not heard.
    pub lost: u64,
    /// Times that some were not heard.
    pub gaps: u64,
    /// Messages that were heard but not written down, because the disk was too slow.
    pub unwritten: u64,
}

/// Turns notes into entries.
#[derive(Default)]
pub struct RowBuilder {
    sensor: Board,
    display: Board,
    tally: Tally,
    /// The last time on each channel.
    last_ns: [u64; CHANNELS.len()],
}

/// What is known of a board.
#[derive(Default)]
struct Board {
    clock: ClockOffset,
    /// Whether the last answer came from where the offset says: a clock that goes at another rate, such as that
    /// of an emulator that can't keep up, tells nothing of this host's time.
    keeps_time: bool,
    samples: Numbers,
    estimates: Numbers,
    motions: Numbers,
    /// Estimates that came one after the other since the last block of samples; none if some are missing.
    estimates_in_a_row: Option<u32>,
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
    /// Takes an estimate's number; how many were skipped.
    fn take_estimate(&mut self, sequence: u32) -> u32 {
        let skipped = self.estimates.take(sequence, 1);
        let count = self.estimates_in_a_row.filter(|_| skipped == 0);
        self.estimates_in_a_row = count.map(|count| count.saturating_add(1));
        skipped
    }

    /// Takes a block's first number; how many samples were said before it and not heard. What nobody wanted was not
    /// said: a stream that begins anew seldom begins whole blocks after the last one, and estimates go on without it.
    fn take_block(&mut self, first_sample: u32) -> u32 {
        let skipped = self.samples.take(first_sample, GAUGE_BLOCK as u32);
        let estimates = self.estimates_in_a_row.replace(0);
        let has_heard_all = estimates
            .is_some_and(|count| count.saturating_add(2) >= skipped / SAMPLES_PER_ESTIMATE);
        let was_off = !skipped.is_multiple_of(GAUGE_BLOCK as u32)
            || (skipped >= PAUSE_SAMPLES && has_heard_all);
        if was_off { 0 } else { skipped }
    }

    /// Numbers that were heard and not written don't tell what was not heard.
    fn forget_numbers(&mut self) {
        self.samples = Numbers::default();
        self.estimates = Numbers::default();
        self.motions = Numbers::default();
    }

    /// An instant of the board's on the calendar.
    fn calendar_ns(&self, instant_us: u64) -> Option<u64> {
        let own_us = self.clock.to_own_us(instant_us);
        own_us.filter(|_| self.keeps_time).map(unix_ns)
    }

    /// Takes an answer that was heard at `at_us`.
    fn on_pong(&mut self, pong: &Pong, at_us: u64) {
        let expected_us = self.clock.to_own_us(pong.answered_us);
        self.keeps_time = expected_us.is_some_and(|own_us| {
            (pong.sent_us.saturating_sub(DRIFT_US)..=at_us.saturating_add(DRIFT_US))
                .contains(&own_us)
        });
        if !self.keeps_time {
            self.clock.clear();
        }
        self.clock.on_pong(pong, at_us);
    }
}

impl RowBuilder {
    /// What has been counted so far.
    pub const fn tally(&self) -> Tally {
        self.tally
    }

    /// The entries of a note on the board of `role`, which was made at `at_us` of this host's clock.
    pub fn enter(&mut self, role: Role, at_us: u64, note: &Note) -> Vec<Entry> {
        let heard_ns = unix_ns(at_us);
        let row = match note {
            Note::Event(Event::Heard { message, .. }) => {
                return self.enter_message(role, at_us, message);
            }
            Note::Event(Event::StateChanged(state)) => Row::Link(LinkRow::turned(state)),
            Note::Event(Event::Restarted) => {
                // It ends all that was known.
                *self.board(role) = Board::default();
                Row::Link(LinkRow::restarted())
            }
            Note::Counters(counters) => Row::Line(*counters),
            Note::Log(level, text) => Row::Log(LogRow::new(role.name(), *level, text, heard_ns)),
            Note::Unwritten(missing) => {
                self.tally.unwritten += missing;
                self.board(role).forget_numbers();
                Row::Link(LinkRow::gap(Lost::Unwritten, *missing))
            }
        };
        vec![self.entry(role, row, heard_ns)]
    }

    fn enter_message(&mut self, role: Role, at_us: u64, message: &Message) -> Vec<Entry> {
        let heard_ns = unix_ns(at_us);
        self.tally.messages += 1;
        let board = self.board(role);
        let (lost, skipped) = match message {
            Message::Estimate(estimate) => {
                (Lost::Estimates, board.take_estimate(estimate.sequence))
            }
            Message::Motion(motion) => (Lost::Motions, board.motions.take(motion.sequence, 1)),
            Message::Gauges(gauges) => (Lost::Samples, board.take_block(gauges.first_sample)),
            _ => (Lost::Samples, 0),
        };
        let (row, instant_us) = row(role, message, at_us, board);
        // A board whose time runs faster, as a simulator's may, was not ahead of its words.
        let taken_ns = instant_us.and_then(|instant_us| board.calendar_ns(instant_us));
        let mut latest_ns = heard_ns;
        if matches!(row, Row::Gauges(_)) {
            // A block has waited for its last sample.
            latest_ns = heard_ns.saturating_sub((GAUGE_BLOCK as u64 - 1) * SAMPLE_NS);
            self.tally.samples += GAUGE_BLOCK as u64;
        }
        let taken_ns = taken_ns.map_or(latest_ns, |taken_ns| taken_ns.min(latest_ns));
        let mut entries = Vec::with_capacity(2);
        if skipped > 0 {
            self.tally.gaps += 1;
            self.tally.lost += u64::from(skipped);
            // Right before what came after what is missing.
            let gap = Row::Link(LinkRow::gap(lost, skipped.into()));
            entries.push(self.entry(role, gap, taken_ns));
        }
        entries.push(self.entry(role, row, taken_ns));
        entries
    }

    const fn board(&mut self, role: Role) -> &mut Board {
        match role {
            Role::Display => &mut self.display,
            Role::Sensor | Role::Host => &mut self.sensor,
        }
    }

    /// An entry, no earlier than the one before on its channel.
    fn entry(&mut self, role: Role, row: Row, taken_ns: u64) -> Entry {
        let mut log_ns = taken_ns;
        if let Some(at) = channel(role, row.kind()) {
            log_ns = log_ns.max(self.last_ns[at]);
            self.last_ns[at] = log_ns;
        }
        Entry { role, row, log_ns }
    }
}

/// A message's row, and its instant of the board's clock if it has one. What that board never says goes
/// to the channel for others.
fn row(role: Role, message: &Message, at_us: u64, board: &mut Board) -> (Row, Option<u64>) {
    use Message::{Configuration, Estimate, Gauges, Motion, Pong, Safety, Status, Texture};
    use Role::{Display, Sensor};
    let other = || Row::Other(OtherRow::new(message));
    match (role, message) {
        (Sensor, Estimate(said)) => (Row::Estimate((*said).into()), Some(said.instant_us)),
        (Sensor, Texture(said)) => (Row::Texture((*said).into()), Some(said.instant_us)),
        (Sensor, Gauges(said)) => (Row::Gauges(said.into()), Some(said.instant_us)),
        (Display, Motion(said)) => (Row::Motion(*said), Some(said.instant_us)),
        (Display, Safety(said)) => (Row::Safety((*said).into()), Some(said.instant_us)),
        (_, Status(status)) => {
            let row = match (role, &status.role) {
                (Sensor, RoleCounters::Sensor(counters)) => {
                    Row::SensorStatus(SensorStatusRow::new(status, *counters))
                }
                (Display, RoleCounters::Display(counters)) => {
                    Row::DisplayStatus(DisplayStatusRow::new(status, counters))
                }
                _ => other(),
            };
            (row, Some(status.uptime_us))
        }
        (_, Configuration(report)) => {
            let (refused, hash) = (report.refused, report.hash);
            let row = match (role, report.configuration) {
                (Sensor, protocol::Configuration::Sensor(in_force)) => {
                    Row::SensorConfiguration(SensorReportRow {
                        refused,
                        hash,
                        in_force,
                    })
                }
                (Display, protocol::Configuration::Display(in_force)) => {
                    Row::DisplayConfiguration(DisplayReportRow {
                        refused,
                        hash,
                        in_force,
                    })
                }
                _ => other(),
            };
            (row, None)
        }
        (_, Pong(pong)) => {
            board.on_pong(pong, at_us);
            let row = ClockRow {
                sent_us: pong.sent_us,
                received_us: pong.received_us,
                answered_us: pong.answered_us,
                heard_us: at_us,
                offset_us: board.clock.offset_us(),
                round_trip_us: board.clock.round_trip_us(),
            };
            (Row::Clock(row), Some(pong.answered_us))
        }
        _ => (other(), None),
    }
}

#[cfg(test)]
mod tests {
    use protocol::{Contact, Estimate, GAUGES, GaugeHealth, GaugeSample, Gauges, Motion, Range};

    use super::*;

    /// The times, in µs of this host's clock, of motions that a display said at those and that were heard 3 ms
    /// later. Its clock is 7 s ahead and goes `rate` times as fast; a second lies between two pings.
    fn motion_times_us(rate: f64, said_us: &[u64]) -> Vec<u64> {
        let board_us = |own_us: u64| 7_000_000 + (own_us as f64 * rate) as u64;
        let mut builder = RowBuilder::default();
        let mut times = Vec::new();
        let mut pinged_us = 0;
        for &own_us in said_us {
            while pinged_us + 1_000_000 < own_us {
                pinged_us += 1_000_000;
                let pong = Pong {
                    sent_us: pinged_us,
                    received_us: board_us(pinged_us + 500),
                    answered_us: board_us(pinged_us + 520),
                };
                let event = Event::Heard {
                    at_us: pinged_us + 1_020,
                    message: Message::Pong(pong),
                };
                builder.enter(Role::Display, pinged_us + 1_020, &Note::Event(event));
            }
            let motion = Motion {
                sequence: times.len() as u32,
                instant_us: board_us(own_us),
                position_um: 0,
                velocity_um_s: 0,
            };
            let event = Event::Heard {
                at_us: own_us + 3_000,
                message: Message::Motion(motion),
            };
            for entry in builder.enter(Role::Display, own_us + 3_000, &Note::Event(event)) {
                times.push((entry.log_ns - unix_ns(0)) / 1_000);
            }
        }
        times
    }

    /// What is counted, and the links' rows in words, of notes on the sensor.
    fn counted(notes: impl IntoIterator<Item = Note>) -> (Tally, Vec<String>) {
        let mut builder = RowBuilder::default();
        let notes = notes.into_iter();
        let entries: Vec<Entry> = notes
            .flat_map(|note| builder.enter(Role::Sensor, 0, &note))
            .collect();
        let words = entries.into_iter().filter_map(|entry| match entry.row {
            Row::Link(link) => Some(link.text.0),
            _ => None,
        });
        (builder.tally(), words.collect())
    }

    fn heard(message: Message) -> Note {
        Note::Event(Event::Heard { at_us: 0, message })
    }

    fn motion(sequence: u32) -> Note {
        heard(Message::Motion(Motion {
            sequence,
            instant_us: 0,
            position_um: 0,
            velocity_um_s: 0,
        }))
    }

    fn estimate(sequence: u32) -> Note {
        heard(Message::Estimate(Estimate {
            sequence,
            instant_us: 0,
            wavelength_mm: None,
            valid: false,
            confidence: 0.0,
            amplitude_lsb: 0.0,
            counted_mm: None,
            range: Range::T1,
            contact: Contact::Stick,
            velocity_um_s: 0,
            lag_um: None,
            gauges_used: 0,
            health: [GaugeHealth::Good; GAUGES],
        }))
    }

    fn block(first_sample: u32) -> Note {
        heard(Message::Gauges(Gauges {
            first_sample,
            instant_us: 0,
            position_um: 0,
            samples: [GaugeSample::default(); GAUGE_BLOCK],
        }))
    }

    #[test]
    fn what_the_disk_was_too_slow_for_was_heard() {
        let notes = [
            motion(0),
            block(0),
            Note::Unwritten(5),
            motion(4),
            block(16),
            motion(6),
        ];
        let (tally, words) = counted(notes);
        assert_eq!((tally.unwritten, tally.lost, tally.gaps), (5, 1, 1));
        let want = [
            "5 messages heard but not written, the disk being too slow",
            "1 motions lost",
        ];
        assert_eq!(words, want);
    }

    #[test]
    fn samples_that_nobody_wanted_are_not_lost() {
        // A stream begins anew wherever the sensor is by then: in the middle of a block, as it was.
        let (tally, words) = counted([block(0), block(8), block(37), block(45)]);
        assert_eq!((tally.lost, tally.gaps), (0, 0), "{words:?}");
        // Or by chance where a block would have begun; the estimates came all the while.
        let estimates = |missing: Option<u32>| {
            let sequences = (0..100).filter(move |sequence| Some(*sequence) != missing);
            sequences.map(estimate)
        };
        for (missing, lost) in [(None, 0), (Some(50), 1_001)] {
            let before = [block(0)].into_iter();
            let (tally, words) = counted(before.chain(estimates(missing)).chain([block(1_008)]));
            assert_eq!(tally.lost, lost, "{words:?}");
        }
    }

    #[test]
    fn a_row_has_the_time_at_which_it_was_taken_once_the_boards_clock_is_known() {
        let times = motion_times_us(1.0, &[500_000, 1_500_000, 2_500_000, 2_502_000]);
        // One answer says where the clock stands, the second that it keeps time.
        assert_eq!(times[..2], [503_000, 1_503_000]);
        for (time, taken) in times[2..].iter().zip([2_500_000, 2_502_000_u64]) {
            // Half the round trip of 1 ms bounds the offset's error.
            assert!(time.abs_diff(taken) <= 510, "{time} for {taken}");
        }
    }

    #[test]
    fn a_clock_that_goes_at_another_rate_dates_nothing() {
        for rate in [0.5, 2.0] {
            let said: Vec<u64> = (1..20).map(|at| at * 500_000 + 250_000).collect();
            let heard: Vec<u64> = said.iter().map(|said_us| said_us + 3_000).collect();
            assert_eq!(motion_times_us(rate, &said), heard, "{rate}");
        }
    }
}
