//! Plays a recording back, in its own time or faster or slower.
//!
//! ```text
//! recording ─> events ─> pace ─┬─> a monitor, as from the boards' links
//!                              └─> stand-in ─> a board, as from its peer
//! recording ─> scene: TOML for the simulator, which reads the recording itself
//! ```

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use protocol::{Estimate, Message, Motion, Role};

use crate::clock::{Clock, micros, now_us};
use crate::link::Event;
use crate::recording::Entry;
use crate::recording::reader::{ReadError, Reader};
use crate::recording::row::{Kind, LinkEvent, Row};

pub mod scene;
/// The slowest and the fastest that a recording can be played, relative to its own time.
pub const SPEEDS: std::ops::RangeInclusive<f64> = 0.1..=100.0;
/// How soon a player hears that it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// Which part of a recording is played, and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Relative to its own time, within [`SPEEDS`].
    pub speed: f64,
    /// From where on, in s since its start.
    pub from_s: f64,
    /// To where, in s since its start; none to the end.
    pub to_s: Option<f64>,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            speed: 1.0,
            from_s: 0.0,
            to_s: None,
        }
    }
}

/// How a replay went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Played {
    /// Events that were told.
    pub events: u64,
    /// Recorded time that was played, in s.
    pub recorded_s: f64,
    /// How late the latest event was told.
    pub latest: Duration,
    /// Whether the recording was cut off.
    pub cut: bool,
    /// Rows of an older protocol that say nothing in this version's.
    pub passed_over: u64,
}

/// Tells the events of a recording, each at its time by `clock`, until its end or until `ended`.
///
/// What was known before `pace.from_s` of the links and the configurations is told first. Fails if the recording
/// can't be read to the end, or ends before `pace.from_s`; what was read before has been told.
pub fn play(
    clock: &dyn Clock,
    recording: Reader,
    pace: &Pace,
    ended: &AtomicBool,
    mut tell: impl FnMut(Role, Event),
) -> Result<Played, ReadError> {
    let mut events = Events::new(recording);
    let mut played = Played::default();
    let mut started: Option<(u64, f64)> = None;
    while let Some((at_s, role, event)) = events.next_from(pace.from_s)? {
        if pace.to_s.is_some_and(|to_s| at_s > to_s) {
            break;
        }
        let (start_us, start_s) = *started.get_or_insert((clock.now_us(), at_s.max(pace.from_s)));
        let after = Duration::from_secs_f64((at_s - start_s).max(0.0) / pace.speed);
        let due_us = start_us.saturating_add(micros(after));
        if !wait_until(clock, due_us, ended) {
            break;
        }
        let late = Duration::from_micros(clock.now_us().saturating_sub(due_us));
        played.latest = played.latest.max(late);
        played.recorded_s = (at_s - start_s).max(played.recorded_s);
        played.events += 1;
        tell(role, event);
    }
    events.refuse_ended(pace)?;
    played.cut = events.recording.is_cut();
    played.passed_over = events.recording.passed_over();
    Ok(played)
}

/// Whether a board of `role` is told anything by what is played at `pace`. Fails if the recording can't be read to
/// there, or ends before `pace.from_s`.
pub fn holds_for(recording: Reader, role: Role, pace: &Pace) -> Result<bool, ReadError> {
    let mut events = Events::new(recording);
    let mut peer = StandIn::new(role, pace.speed);
    while let Some((at_s, from, event)) = events.next_from(pace.from_s)? {
        if pace.to_s.is_some_and(|to_s| at_s > to_s) {
            return Ok(false);
        }
        if peer.say(from, &event, 0).is_some() {
            return Ok(true);
        }
    }
    events.refuse_ended(pace)?;
    Ok(false)
}

/// Waits; false if it is to end before.
fn wait_until(clock: &dyn Clock, due_us: u64, ended: &AtomicBool) -> bool {
    let notify = clock.notify();
    loop {
        let now_us = clock.now_us();
        if ended.load(Ordering::Relaxed) {
            return false;
        }
        if now_us >= due_us {
            return true;
        }
        notify.wait_until(due_us.min(now_us.saturating_add(micros(LOOK))));
    }
}

/// The events of a recording, in order.
struct Events {
    recording: Reader,
    /// What was known before the part that is played.
    known: Vec<(Role, Kind, Event)>,
    due: VecDeque<(f64, Role, Event)>,
    begun: bool,
    /// The time of the last row that was read, in s since the recording's start.
    last_s: f64,
}

impl Events {
    fn new(recording: Reader) -> Self {
        Self {
            recording,
            known: Vec::new(),
            due: VecDeque::new(),
            begun: false,
            last_s: 0.0,
        }
    }

    /// The next event at or after `from_s` and its time in s since the recording's start; before the first
    /// one, what was known until then.
    fn next_from(&mut self, from_s: f64) -> Result<Option<(f64, Role, Event)>, ReadError> {
        loop {
            if let Some(due) = self.due.pop_front() {
                return Ok(Some(due));
            }
            let entry = self.recording.next_entry()?;
            for (role, row) in self.recording.take_told() {
                self.keep(role, row);
            }
            let Some(entry) = entry else {
                return Ok(None);
            };
            let at_s = self.recording.since_start_s(entry.log_ns);
            self.last_s = self.last_s.max(at_s);
            if at_s < from_s {
                self.keep(entry.role, entry.row);
                continue;
            }
            if !std::mem::replace(&mut self.begun, true) {
                let known = std::mem::take(&mut self.known);
                self.due.extend(
                    known
                        .into_iter()
                        .map(|(role, _, event)| (at_s, role, event)),
                );
            }
            let Entry { role, row, .. } = entry;
            if let Some(event) = Self::event(role, row) {
                self.due.push_back((at_s, role, event));
            }
        }
    }

    /// Fails if all has been read, and ends before what is to be played.
    fn refuse_ended(&self, pace: &Pace) -> Result<(), ReadError> {
        if self.begun || pace.from_s <= self.last_s {
            return Ok(());
        }
        Err(ReadError::Ended {
            path: self.recording.path().to_owned(),
            last_s: self.last_s,
            from_s: pace.from_s,
        })
    }

    /// Keeps what a link or a configuration was last.
    fn keep(&mut self, role: Role, row: Row) {
        let kind = row.kind();
        let lasting = matches!(
            kind,
            Kind::Link | Kind::SensorConfiguration | Kind::DisplayConfiguration
        );
        if !lasting {
            return;
        }
        if let Some(event) = Self::event(role, row).filter(|event| *event != Event::Restarted) {
            self.known
                .retain(|(of, what, _)| (*of, *what) != (role, kind));
            self.known.push((role, kind, event));
        }
    }

    fn event(role: Role, row: Row) -> Option<Event> {
        let message = match row {
            Row::Estimate(row) => Message::Estimate(row.into()),
            Row::Texture(row) => Message::Texture(row.into()),
            Row::Motion(motion) => Message::Motion(motion),
            Row::Gauges(row) => Message::Gauges((&row).into()),
            Row::SensorStatus(row) => Message::Status(row.status()),
            Row::DisplayStatus(row) => Message::Status(row.status()?),
            Row::Safety(row) => Message::Safety(row.safety()?),
            Row::SensorConfiguration(row) => Message::Configuration(row.into()),
            Row::DisplayConfiguration(row) => Message::Configuration(row.into()),
            Row::Clock(row) => Message::Pong(row.pong()),
            Row::Other(row) => row.message().ok()?,
            Row::Link(row) => {
                return match row.event {
                    LinkEvent::Turned => row.state(role).map(Event::StateChanged),
                    LinkEvent::Restarted => Some(Event::Restarted),
                    LinkEvent::Gap => None,
                };
            }
            Row::Line(_) | Row::Log(_) => return None,
        };
        Some(Event::Heard {
            at_us: now_us(),
            message,
        })
    }
}

/// Between two estimates, in µs: what lies between the last one before a restart and the first one after.
const PAUSE_US: u64 = 10_000;

/// A board's peer.
pub struct StandIn {
    board: Role,
    speed: f64,
    sequence: u32,
    clock: Option<PeerClock>,
}

/// How recorded instants lie on the stand-in's clock.
#[derive(Clone, Copy)]
struct PeerClock {
    recorded_us: u64,
    own_us: u64,
    /// The instant that was played last: as it was recorded, and as it was said.
    last_recorded_us: u64,
    last_us: u64,
}

impl StandIn {
    /// The peer of the board of role `board`, in a replay at `speed`.
    pub const fn new(board: Role, speed: f64) -> Self {
        Self {
            board,
            speed,
            sequence: 0,
            clock: None,
        }
    }

    /// What is to be said to the board when the board of `role` said this: a sensor's estimates to a
    /// display, a display's motions to a sensor, nothing else. Numbers count from 0, as a board's do that
    /// has just started, which is how the other one follows; instants begin at `now_us` and run, as the
    /// speeds that are told, with the replay.
    pub fn say(&mut self, role: Role, event: &Event, now_us: u64) -> Option<Message> {
        let Event::Heard { message, .. } = event else {
            return None;
        };
        match (self.board, role, message) {
            (Role::Display, Role::Sensor, Message::Estimate(estimate)) => {
                let (sequence, instant_us) = self.number(estimate.instant_us, now_us);
                Some(Message::Estimate(Estimate {
                    sequence,
                    instant_us,
                    velocity_um_s: self.velocity_um_s(estimate.velocity_um_s),
                    ..*estimate
                }))
            }
            (Role::Sensor, Role::Display, Message::Motion(motion)) => {
                let (sequence, instant_us) = self.number(motion.instant_us, now_us);
                Some(Message::Motion(Motion {
                    sequence,
                    instant_us,
                    velocity_um_s: self.velocity_um_s(motion.velocity_um_s),
                    ..*motion
                }))
            }
            _ => None,
        }
    }

    fn number(&mut self, recorded_us: u64, now_us: u64) -> (u32, u64) {
        let sequence = self.sequence;
        self.sequence = self.sequence.wrapping_add(1);
        let clock = match self.clock {
            Some(clock) if recorded_us >= clock.last_recorded_us => clock,
            // The first one, or the recorded board started anew.
            before => {
                let own_us = before.map_or(now_us, |clock| clock.last_us.saturating_add(PAUSE_US));
                PeerClock {
                    recorded_us,
                    own_us,
                    last_recorded_us: recorded_us,
                    last_us: own_us,
                }
            }
        };
        let passed_us = (recorded_us - clock.recorded_us) as f64 / self.speed;
        let instant_us = clock.own_us.saturating_add(passed_us.round() as u64);
        self.clock = Some(PeerClock {
            last_recorded_us: recorded_us,
            last_us: instant_us,
            ..clock
        });
        (sequence, instant_us)
    }

    fn velocity_um_s(&self, recorded_um_s: i32) -> i32 {
        // Saturates.
        (f64::from(recorded_um_s) * self.speed).round() as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(sequence: u32, instant_us: u64, velocity_um_s: i32) -> Event {
        Event::Heard {
            at_us: 0,
            message: Message::Motion(Motion {
                sequence,
                instant_us,
                position_um: 7,
                velocity_um_s,
            }),
        }
    }

    fn said(message: Option<Message>) -> (u32, u64, i32) {
        let Some(Message::Motion(motion)) = message else {
            panic!("{message:?} is no motion");
        };
        assert_eq!(motion.position_um, 7);
        (motion.sequence, motion.instant_us, motion.velocity_um_s)
    }

    #[test]
    fn a_peer_that_has_just_started_counts_from_0_and_its_time_goes_with_the_replay() {
        let mut peer = StandIn::new(Role::Sensor, 2.0);
        let mut say = |event: &Event| said(peer.say(Role::Display, event, 1_000));
        assert_eq!(say(&motion(70, 500_000, -3)), (0, 1_000, -6));
        assert_eq!(say(&motion(71, 502_000, i32::MAX)), (1, 2_000, i32::MAX));
        // Started anew.
        assert_eq!(say(&motion(0, 2_000, 0)), (2, 12_000, 0));
        assert_eq!(say(&motion(1, 4_000, 0)), (3, 13_000, 0));
        // Once more, and heard only when its clock stood beyond the first one that was played.
        assert_eq!(say(&motion(0, 3_000, 0)), (4, 23_000, 0));
        assert_eq!(say(&motion(1, 5_000, 0)), (5, 24_000, 0));
    }

    #[test]
    fn a_board_hears_its_peer_only() {
        let event = motion(0, 0, 0);
        assert_eq!(
            StandIn::new(Role::Display, 1.0).say(Role::Display, &event, 0),
            None
        );
        assert_eq!(
            StandIn::new(Role::Sensor, 1.0).say(Role::Sensor, &event, 0),
            None
        );
        let turned = Event::Restarted;
        assert_eq!(
            StandIn::new(Role::Sensor, 1.0).say(Role::Display, &turned, 0),
            None
        );
    }
}
