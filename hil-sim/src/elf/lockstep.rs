//! Two emulated boards in step: each on a thread of its own, exchanging what their wires carried at
//! the end of every quantum of virtual time. Which thread runs when decides nothing.

use std::sync::mpsc::{Receiver, SyncSender};
use std::time::Instant;

use protocol::{
    ACTUATOR_BLOCK, ACTUATORS, Actuator, Actuators, Configuration, ConfigurationReport, Hello,
    MAX_FRAME, Message, Peer, Port, Role,
};
use rigless::emulator::{Access, AccessKind, Driver, Host, Settled, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;

use super::display::DisplayPins;
use super::nucleo::{CONSOLE_UART, Nucleo, PEER_UART, Pins};
use super::rtt::Log;
use super::sensor::SensorPins;
use super::wire::TimedByte;
use crate::weather::Weather;

/// What a byte takes from board to board at the least, and how often the boards wait for each other.
/// Smaller is closer to a bare cable and slower; at 500 µs the pair keeps ahead of a wall clock.
pub const QUANTUM_NS: u64 = 500_000;
/// Virtual time by which the emulator has met, and translated, all of the firmware that a run needs.
pub const WARM_UP_NS: u64 = 500_000_000;
/// How often the log is read: well before the 1 KiB of RTT are full.
const LOG_PERIOD_NS: u64 = 10_000_000;
/// How long the host on the console waits for an answer before it asks again: ten times what the two
/// frames, a board's tasks and the exchange at the end of every quantum take together.
const PATIENCE_NS: u64 = 50_000_000;

/// What the driver does for one board's pins beyond the seam itself.
pub trait Watched: Pins {
    /// Sees every write of the firmware to a peripheral.
    fn on_write(board: &mut Nucleo<Self>, address: u64, value: u64, at_ns: u64)
    where
        Self: Sized;
}

impl Watched for SensorPins {
    fn on_write(board: &mut Nucleo<Self>, address: u64, value: u64, at_ns: u64) {
        let (pins, part) = board.pins();
        pins.on_write(part, address, value, at_ns);
    }
}

impl Watched for DisplayPins {
    fn on_write(board: &mut Nucleo<Self>, address: u64, value: u64, at_ns: u64) {
        let (pins, part) = board.pins();
        pins.on_write(part, address, value, at_ns);
    }
}

/// The ends of the channels to the other board's thread.
pub struct Cable {
    /// What this board sends.
    pub to_peer: SyncSender<Vec<TimedByte>>,
    /// What the other board sends.
    pub from_peer: Receiver<Vec<TimedByte>>,
}

/// A host on the console that wants the board configured.
pub struct ConsoleHost {
    port: Port,
    /// What is to be sent before the configuration that names it.
    described: Vec<Actuators>,
    wanted: Configuration,
    /// When it last asked.
    asked_ns: Option<u64>,
    told: Option<Told>,
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

/// Runs one board of a pair.
pub struct Lockstep {
    cable: Cable,
    weather: Weather,
    console: Option<ConsoleHost>,
    log: Option<Log>,
    next_exchange_ns: u64,
    next_log_ns: u64,
    end_ns: u64,
    /// What the board sent to its peer, with instants.
    pub sent: Vec<TimedByte>,
    /// What the board heard from its peer, with the instants at which each byte was complete.
    pub heard: Vec<TimedByte>,
    /// When the board had run for [`WARM_UP_NS`].
    pub warm: Option<Instant>,
    /// Set if the other board's thread is gone before the end.
    pub abandoned: bool,
}

impl Lockstep {
    /// A driver that stops after `end_ns`; `weather` is what the peer's bytes go through.
    pub fn new(
        cable: Cable,
        weather: Weather,
        console: Option<ConsoleHost>,
        log: Option<Log>,
        end_ns: u64,
    ) -> Self {
        Self {
            cable,
            weather,
            console,
            log,
            next_exchange_ns: QUANTUM_NS,
            next_log_ns: LOG_PERIOD_NS,
            end_ns,
            sent: Vec::new(),
            heard: Vec::new(),
            warm: None,
            abandoned: false,
        }
    }

    /// Whether a host on the console wants the board configured.
    pub fn is_asked(&self) -> bool {
        self.console.is_some()
    }

    /// What came of it.
    pub fn told(&self) -> Option<Told> {
        self.console.as_ref().and_then(|host| host.told)
    }

    /// The board's log.
    pub fn log_lines(&self) -> Vec<(u64, String)> {
        self.log.as_ref().map(Log::lines).unwrap_or_default()
    }

    /// Gives the other board what this one sent and takes what it sent; false if it is gone.
    fn exchange<P: Watched>(&mut self, board: &mut Nucleo<P>, now_ns: u64) -> bool {
        let sent = board.wire(PEER_UART).take_sent();
        self.sent.extend_from_slice(&sent);
        let (Ok(()), Ok(received)) = (self.cable.to_peer.send(sent), self.cable.from_peer.recv())
        else {
            self.abandoned = true;
            return false;
        };
        for (at_ns, byte) in received {
            self.weather.push(at_ns + QUANTUM_NS, byte);
        }
        while let Some((due_ns, byte)) = self.weather.pop(now_ns + QUANTUM_NS) {
            self.heard.push((due_ns, byte));
            board.wire(PEER_UART).hear(due_ns, byte);
        }
        if let Some(host) = &mut self.console {
            host.serve(board, now_ns);
        }
        true
    }
}

impl ConsoleHost {
    /// A host that asks for `wanted` as soon as the board has introduced itself, and sends the actuators
    /// `described` before.
    pub fn new(wanted: Configuration, described: Option<&[Actuator; ACTUATORS]>) -> Self {
        let (blocks, _) = described.map_or(&[][..], |all| &all[..]).as_chunks();
        let described = (0_u8..)
            .step_by(ACTUATOR_BLOCK)
            .zip(blocks)
            .map(|(first, &actuators)| Actuators { first, actuators });
        Self {
            port: Port::new(Hello::new(Role::Host, "hil-sim", [0, 1, 0])),
            described: described.collect(),
            wanted,
            asked_ns: None,
            told: None,
        }
    }

    /// What came of it.
    pub fn told(&self) -> Option<Told> {
        self.told
    }

    /// Hears the board's console and says what is due, with a patience of 50 ms.
    pub(super) fn serve<P: Watched>(&mut self, board: &mut Nucleo<P>, now_ns: u64) {
        let wire = board.wire(CONSOLE_UART);
        let bytes: Vec<u8> = wire.take_sent().into_iter().map(|(_, byte)| byte).collect();
        let mut answer = None;
        self.port.receive(now_ns / 1_000, &bytes, |message| {
            if let Message::Configuration(report) = message {
                answer = Some(report);
            }
        });
        if let (Some(report), Some(asked_ns), None) = (answer, self.asked_ns, self.told) {
            self.told = Some(Told {
                asked_ns,
                answered_ns: now_ns,
                report,
            });
        }
        let due = self
            .asked_ns
            .is_none_or(|asked_ns| now_ns - asked_ns >= PATIENCE_NS);
        if self.told.is_none() && due && matches!(self.port.peer(), Peer::Known(_)) {
            for &block in &self.described {
                self.port.post(&Message::Actuators(block));
            }
            self.port.post(&Message::Configure(self.wanted));
            self.asked_ns = Some(now_ns);
        }
        let mut out = [0; MAX_FRAME];
        loop {
            let count = self.port.take(&mut out);
            if count == 0 {
                break;
            }
            for &byte in &out[..count] {
                wire.hear(now_ns, byte);
            }
        }
    }
}

impl<P: Watched> Driver<Nucleo<P>> for Lockstep {
    fn on_settled(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        _host: &mut dyn Host,
        settled: Settled,
    ) {
        if let Settled::Access {
            access:
                Access {
                    kind: AccessKind::Write,
                    address,
                    value,
                    virtual_time,
                    ..
                },
            ..
        } = settled
        {
            P::on_write(session.board_mut(), address, value, virtual_time.0);
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        let now_ns = stop.at.0;
        if now_ns >= self.next_log_ns {
            self.next_log_ns = now_ns + LOG_PERIOD_NS;
            if let Some(log) = &mut self.log {
                log.read(now_ns, host);
            }
        }
        if now_ns >= self.next_exchange_ns {
            if !self.exchange(session.board_mut(), now_ns) || now_ns >= self.end_ns {
                return None;
            }
            if self.warm.is_none() && now_ns >= WARM_UP_NS {
                self.warm = Some(Instant::now());
            }
            self.next_exchange_ns += QUANTUM_NS;
        }
        let due_ns = session
            .board_mut()
            .wire(PEER_UART)
            .next_due()
            .filter(|&due| due > now_ns);
        Some(VirtualNanos(due_ns.map_or(self.next_exchange_ns, |due| {
            due.min(self.next_exchange_ns)
        })))
    }
}
