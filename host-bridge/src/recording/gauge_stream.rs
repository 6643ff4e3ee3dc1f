//! Has a sensor board stream its gauges for as long as somebody wants them, and nothing changed.

use protocol::{Message, Question, Role, StreamGauges};

use crate::link::Event;

/// Between two times that something is asked for again.
const AGAIN_US: u64 = 500_000;
/// How long the gauges are asked for each time: a request may be lost.
const WHILE: StreamGauges = StreamGauges { for_ms: 1_500 };

/// Asks for gauges again and again, for as long as they are wanted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lease {
    due_us: u64,
}

impl Lease {
    /// What is to be said to the sensor board now.
    pub fn due(&mut self, now_us: u64) -> Option<Message> {
        is_due(&mut self.due_us, now_us).then_some(Message::StreamGauges(WHILE))
    }
}

/// Asks both boards for their configurations, and the sensor board for its gauges.
#[derive(Default)]
pub struct GaugeStream {
    /// None for a recording without gauges.
    lease: Option<Lease>,
    sensor: Interview,
    display: Interview,
}

/// What is still to be heard from a board.
#[derive(Default)]
struct Interview {
    is_known: bool,
    asks: bool,
    due_us: u64,
}

impl Interview {
    fn begin(&mut self) {
        *self = Self {
            is_known: true,
            asks: true,
            due_us: 0,
        };
    }
}

impl GaugeStream {
    /// For a recording with gauges or without.
    pub fn new(wanted: bool) -> Self {
        Self {
            lease: wanted.then(Lease::default),
            ..Self::default()
        }
    }

    /// Takes what the link to the board of `role` told.
    pub fn on_event(&mut self, role: Role, event: &Event) {
        let interview = match role {
            Role::Display => &mut self.display,
            Role::Sensor | Role::Host => &mut self.sensor,
        };
        match event {
            Event::StateChanged(state) if state.is_known() => interview.begin(),
            Event::StateChanged(_) => *interview = Interview::default(),
            Event::Restarted => interview.begin(),
            Event::Heard {
                message: Message::Configuration(_),
                ..
            } => interview.asks = false,
            Event::Heard { .. } => return,
        }
        if role == Role::Sensor && interview.asks {
            // One that has just come, or come back, does not stream.
            self.lease = self.lease.map(|_| Lease::default());
        }
    }

    /// What is to be said now, and to which board.
    pub fn due(&mut self, now_us: u64) -> Option<(Role, Message)> {
        for (role, interview) in [
            (Role::Display, &mut self.display),
            (Role::Sensor, &mut self.sensor),
        ] {
            if interview.asks && is_due(&mut interview.due_us, now_us) {
                return Some((role, Message::Question(Question::Configuration)));
            }
        }
        let lease = self.lease.as_mut().filter(|_| self.sensor.is_known)?;
        Some((Role::Sensor, lease.due(now_us)?))
    }
}

/// Whether it is time; if so, the next time is set.
const fn is_due(due_us: &mut u64, now_us: u64) -> bool {
    let due = now_us >= *due_us;
    if due {
        *due_us = now_us + AGAIN_US;
    }
    due
}
