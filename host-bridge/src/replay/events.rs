//! From the rows of a recording to the events that the links told.

use std::collections::VecDeque;

use protocol::{Message, Role};

use crate::host_clock::now_us;
use crate::link::Event;
use crate::recording::Entry;
use crate::recording::reader::{ReadError, Reader};
use crate::recording::row::{Kind, LinkEvent, Row};

/// The events of a recording, in order.
pub struct Events {
    recording: Reader,
    /// What was known before the part that is played.
    known: Vec<(Role, Kind, Event)>,
    due: VecDeque<(f64, Role, Event)>,
    begun: bool,
}

impl Events {
    pub fn new(recording: Reader) -> Self {
        Self {
            recording,
            known: Vec::new(),
            due: VecDeque::new(),
            begun: false,
        }
    }

    pub const fn passed_over(&self) -> u64 {
        self.recording.passed_over()
    }

    pub fn is_cut(&self) -> bool {
        self.recording.is_cut()
    }

    /// The next event at or after `from_s` and its time in s since the recording's start; before the first
    /// one, what was known until then.
    pub fn next_from(&mut self, from_s: f64) -> Result<Option<(f64, Role, Event)>, ReadError> {
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
