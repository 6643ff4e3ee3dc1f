//! A host on a board's console: sets the board up as the scene asks, and does what the scene's faults
//! have it do.

use protocol::actuators::ACTUATORS;
use protocol::{
    ACTUATOR_BLOCK, Actuator, Actuators, Configuration, ConfigurationReport, Configure,
    DisplayConfiguration, Hello, MAX_FRAME, Message, Peer, Ping, Port, Role, SensorConfiguration,
    Stop, StopReason,
};

use super::lockstep::QUANTUM_NS;
use super::nucleo::{CONSOLE_UART, Nucleo, Pins};
use hil_sim_core::link::impairments::BYTE_NS;
use hil_sim_core::scene::Scene;
use hil_sim_core::scene::fault::{Fault, Kind};

/// How long the host waits for an answer before it asks again: ten times what the two frames, a board's
/// tasks and the exchange at the end of every quantum take together.
const PATIENCE_NS: u64 = 50_000_000;
/// How often the host says that it is there: the board speaks text to who says nothing for long.
const PING_NS: u64 = 1_000_000_000;
/// An amplitude that no board takes.
const IMPOSSIBLE_MV: u16 = 60_000;

/// A host on the console.
pub struct ConsoleHost {
    port: Port,
    /// What is to be sent before the configuration that names it.
    described: Vec<Actuators>,
    wanted: Option<Configuration>,
    asked_ns: Option<u64>,
    /// Whether the board, as it stands since its power came on, has answered.
    is_answered: bool,
    next_ping_ns: u64,
    pub(super) told: Option<Told>,
    faults: Vec<Fault>,
    /// Faults that have been done.
    done: usize,
    free_ns: u64,
}

/// What a host on the console asked of a board, and the board's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Told {
    /// When the host began to ask, in ns since the scene's start.
    pub asked_ns: u64,
    /// When the host had the answer, in ns since the scene's start.
    pub answered_ns: u64,
    /// The answer.
    pub report: ConfigurationReport,
}

impl ConsoleHost {
    /// A host that asks for `wanted`, if anything, as soon as the board has introduced itself, and sends
    /// the actuators `described` before; of `faults` it does those that are a host's.
    pub fn new(
        wanted: Option<Configuration>,
        described: Option<&[Actuator; ACTUATORS]>,
        faults: &[Fault],
    ) -> Self {
        let (blocks, _) = described.map_or(&[][..], |all| &all[..]).as_chunks();
        let described = (0_u8..)
            .step_by(ACTUATOR_BLOCK)
            .zip(blocks)
            .map(|(first, &actuators)| Actuators { first, actuators });
        let mut faults: Vec<Fault> = faults
            .iter()
            .filter(|fault| fault.kind.is_of_host())
            .copied()
            .collect();
        faults.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        Self {
            port: port(),
            described: described.collect(),
            wanted,
            asked_ns: None,
            is_answered: false,
            next_ping_ns: PING_NS,
            told: None,
            faults,
            done: 0,
            free_ns: 0,
        }
    }

    /// A host if `scene` wants of the board of `role` what is not its default, or has a host do wrong.
    pub fn of_scene(scene: &Scene, role: Role) -> Option<Self> {
        let mut described = None;
        let (wanted, faults) = match role {
            Role::Display => {
                let wanted = scene.display_configuration();
                if wanted.actuators != DisplayConfiguration::DEFAULT.actuators {
                    described = Some(&*scene.display.actuators);
                }
                let differs = wanted != DisplayConfiguration::DEFAULT;
                let wanted = differs.then_some(Configuration::Display(wanted));
                (wanted, &scene.faults[..])
            }
            _ => {
                let wanted = scene.sensor_configuration();
                let differs = wanted != SensorConfiguration::DEFAULT;
                (differs.then_some(Configuration::Sensor(wanted)), &[][..])
            }
        };
        let is_needed = wanted.is_some() || faults.iter().any(|fault| fault.kind.is_of_host());
        is_needed.then(|| Self::new(wanted, described, faults))
    }

    /// Whether it wants the board configured.
    pub fn asks(&self) -> bool {
        self.wanted.is_some()
    }

    /// The board has lost its power: it has to be set up again.
    pub fn restart(&mut self) {
        self.port = port();
        self.asked_ns = None;
        self.is_answered = false;
    }

    pub(super) fn serve<P: Pins>(&mut self, board: &mut Nucleo<P>, now_ns: u64) {
        let wire = board.wire(CONSOLE_UART);
        let bytes: Vec<u8> = wire.take_sent().into_iter().map(|(_, byte)| byte).collect();
        let mut answer = None;
        self.port.receive(now_ns / 1_000, &bytes, |message| {
            if let Message::Configuration(report) = message {
                answer = Some(report);
            }
        });
        if let (Some(report), Some(asked_ns), false) = (answer, self.asked_ns, self.is_answered) {
            self.is_answered = true;
            self.told.get_or_insert(Told {
                asked_ns,
                answered_ns: now_ns,
                report,
            });
        }
        self.ask(now_ns);
        if now_ns >= self.next_ping_ns {
            self.next_ping_ns += PING_NS;
            let sent_us = now_ns / 1_000;
            self.port.post(&Message::Ping(Ping { sent_us }));
        }
        let mut said = self.take();
        for byte in said.drain(..) {
            wire.hear(now_ns, byte);
        }
        // What is due until the next time, at its instant.
        for (at_ns, bytes) in self.misbehave(now_ns, now_ns + QUANTUM_NS) {
            for byte in bytes {
                wire.hear(at_ns, byte);
            }
        }
    }

    fn ask(&mut self, now_ns: u64) {
        let due = self
            .asked_ns
            .is_none_or(|asked_ns| now_ns - asked_ns >= PATIENCE_NS);
        let Some(wanted) = self.wanted else { return };
        if !self.is_answered && due && matches!(self.port.peer(), Peer::Known(_)) {
            for &block in &self.described {
                self.port.post(&Message::Actuators(block));
            }
            self.port
                .post(&Message::Configure(Configure::anyway(wanted)));
            self.asked_ns = Some(now_ns);
        }
    }

    fn take(&mut self) -> Vec<u8> {
        let mut all = Vec::new();
        let mut out = [0; MAX_FRAME];
        loop {
            let count = self.port.take(&mut out);
            if count == 0 {
                return all;
            }
            all.extend_from_slice(&out[..count]);
        }
    }

    /// What the faults that begin or last from one instant to another have it say, and when.
    fn misbehave(&mut self, from_ns: u64, until_ns: u64) -> Vec<(u64, Vec<u8>)> {
        let mut said = Vec::new();
        while let Some(fault) = self.faults.get(self.done).copied() {
            let at_ns = fault.begins_ns();
            if at_ns >= until_ns {
                break;
            }
            if fault.kind == Kind::ConsoleFlood {
                self.free_ns = self.free_ns.max(at_ns).max(from_ns);
                let end_ns = fault.ends_ns().unwrap_or(u64::MAX);
                while self.free_ns < until_ns.min(end_ns) {
                    let sent_us = self.free_ns / 1_000;
                    self.port.post(&Message::Ping(Ping { sent_us }));
                    let bytes = self.take();
                    let length = bytes.len().max(1) as u64;
                    said.push((self.free_ns, bytes));
                    self.free_ns += length * BYTE_NS;
                }
                if end_ns > until_ns {
                    break;
                }
            } else {
                let message = if fault.kind == Kind::StopFromConsole {
                    Message::Stop(Stop {
                        reason: StopReason::Operator,
                    })
                } else {
                    self.impossible()
                };
                self.port.post(&message);
                said.push((at_ns.max(from_ns), self.take()));
            }
            self.done += 1;
        }
        said
    }

    /// What was wanted, with an amplitude that can't be.
    fn impossible(&self) -> Message {
        let wanted = match self.wanted {
            Some(Configuration::Display(wanted)) => wanted,
            _ => DisplayConfiguration::DEFAULT,
        };
        let configuration = Configuration::Display(DisplayConfiguration {
            amplitude_mv: IMPOSSIBLE_MV,
            ..wanted
        });
        Message::Configure(Configure::anyway(configuration))
    }
}

fn port() -> Port {
    Port::new(Hello::new(Role::Host, "hil-sim", [0, 1, 0]))
}
