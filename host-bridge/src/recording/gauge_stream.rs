//! Has a sensor board stream its gauges for as long as they are recorded, and nothing else changed.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use protocol::{Configuration, DisplayConfiguration, Message, Role, SensorConfiguration};

use crate::link::{Event, Link};

/// Between two tries.
const RETRY_US: u64 = 1_000_000;
/// How long the sensor board may take to confirm at the end that it is as it was.
const RESTORED: Duration = Duration::from_secs(3);
/// How often it is told meanwhile.
const AGAIN: Duration = Duration::from_millis(50);

/// Asks both boards for their configurations, and the sensor board for its gauges.
#[derive(Default)]
pub struct GaugeStream {
    wanted: bool,
    sensor: Interview,
    display: Interview,
    /// The sensor's configuration as it was reported last.
    configuration: Option<SensorConfiguration>,
    /// Whether the streaming is this program's doing.
    switched: bool,
}

/// What is still to be heard from a board.
#[derive(Default)]
struct Interview {
    stage: Stage,
    /// When to ask, or to ask again.
    due_us: u64,
}

#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum Stage {
    /// The board is not there, or has said all.
    #[default]
    Done,
    /// Its configuration is asked for.
    Asked,
    /// Its gauges are asked for.
    Switching,
}

impl Interview {
    fn begin(&mut self) {
        *self = Self {
            stage: Stage::Asked,
            due_us: 0,
        };
    }

    /// Whether it is time to ask.
    const fn is_due(&mut self, now_us: u64) -> bool {
        let due = now_us >= self.due_us;
        if due {
            self.due_us = now_us + RETRY_US;
        }
        due
    }
}

impl GaugeStream {
    /// For a recording with gauges or without.
    pub fn new(wanted: bool) -> Self {
        Self {
            wanted,
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
            Event::StateChanged(_) => interview.stage = Stage::Done,
            Event::Restarted => interview.begin(),
            Event::Heard {
                message: Message::Configuration(report),
                ..
            } => {
                let before = std::mem::take(&mut interview.stage);
                let Configuration::Sensor(configuration) = report.configuration else {
                    return;
                };
                self.configuration = Some(configuration);
                let off = self.wanted && !configuration.stream_gauges;
                if off && before != Stage::Done {
                    self.sensor = Interview {
                        stage: Stage::Switching,
                        due_us: 0,
                    };
                }
            }
            Event::Heard { .. } => {}
        }
    }

    /// What is to be said now, and to which board.
    pub fn due(&mut self, now_us: u64) -> Option<(Role, Message)> {
        // A configuration for the other board is refused, and the report tells the one in force.
        if self.display.stage == Stage::Asked && self.display.is_due(now_us) {
            let other = Configuration::Sensor(SensorConfiguration::DEFAULT);
            return Some((Role::Display, Message::Configure(other)));
        }
        if self.sensor.stage == Stage::Done || !self.sensor.is_due(now_us) {
            return None;
        }
        let configure = match (self.sensor.stage, self.configuration) {
            (Stage::Switching, Some(configuration)) => {
                self.switched = true;
                streaming(configuration, true)
            }
            _ => Configuration::Display(DisplayConfiguration::DEFAULT),
        };
        Some((Role::Sensor, Message::Configure(configure)))
    }

    /// What gives the sensor board its quiet back; none if it streams of its own accord, or not. What it
    /// reports from now on tells whether it has taken it.
    fn restoration(&mut self) -> Option<Message> {
        if !self.switched {
            return None;
        }
        let configuration = self.configuration.take()?;
        Some(Message::Configure(streaming(configuration, false)))
    }

    /// Gives the sensor board its quiet back if it was taken, and waits until it says so; `pass` gets what the
    /// links tell meanwhile. Whether the board is as it was.
    pub fn restore(
        &mut self,
        events: &Receiver<(Role, Event)>,
        sensor: Option<&Link>,
        mut pass: impl FnMut(Role, Event),
    ) -> bool {
        let Some(message) = self.restoration() else {
            return true;
        };
        let post = || sensor.is_some_and(|link| link.post(&message).is_ok());
        let end = Instant::now() + RESTORED;
        let mut goes_on = post();
        while goes_on && !self.is_quiet() && Instant::now() < end {
            match events.recv_timeout(AGAIN) {
                Ok((role, event)) => {
                    self.on_event(role, &event);
                    pass(role, event);
                }
                Err(RecvTimeoutError::Timeout) => goes_on = post(),
                Err(RecvTimeoutError::Disconnected) => goes_on = false,
            }
        }
        self.is_quiet()
    }

    /// Whether the sensor board has said that it does not stream.
    fn is_quiet(&self) -> bool {
        self.configuration
            .is_some_and(|configuration| !configuration.stream_gauges)
    }
}

fn streaming(configuration: SensorConfiguration, stream_gauges: bool) -> Configuration {
    Configuration::Sensor(SensorConfiguration {
        stream_gauges,
        ..configuration
    })
}
