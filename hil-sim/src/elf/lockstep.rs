//! Two emulated boards in step: each on a thread of its own, exchanging what their wires carried at
//! the end of every quantum of virtual time. Which thread runs when decides nothing.

use std::sync::mpsc::{Receiver, SyncSender};
use std::time::Instant;

use protocol::{Configuration, DisplayConfiguration, Role, SensorConfiguration};
use rigless::emulator::{Access, AccessKind, Driver, Host, Settled, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;

use super::console::{ConsoleHost, Told};
use super::display::DisplayPins;
use super::injector::Injector;
use super::nucleo::{CONSOLE_UART, Nucleo, PEER_UART, Pins};
use super::rtt::Log;
use super::sensor::SensorPins;
use super::terminal::{self, Terminal};
use super::wire::TimedByte;
use crate::fault::{Clock, Fault, Way};
use crate::scene::Scene;

/// What a byte takes from board to board at the least, and how often the boards wait for each other.
/// Smaller is closer to a bare cable and slower; at 500 µs the pair keeps ahead of a wall clock.
pub const QUANTUM_NS: u64 = 500_000;
/// Virtual time by which the emulator has met, and translated, all of the firmware that a run needs.
pub const WARM_UP_NS: u64 = 500_000_000;
/// How often the log is read: well before the 1 KiB of RTT are full.
const LOG_PERIOD_NS: u64 = 10_000_000;

/// What the driver does for one board's pins beyond the seam itself.
pub trait Watched: Pins {
    /// Sees every write of the firmware to a peripheral.
    fn on_write(board: &mut Nucleo<Self>, address: u64, value: u64, at_ns: u64)
    where
        Self: Sized;

    /// `fault` begins, or ends, at the pins.
    fn break_pins(_board: &mut Nucleo<Self>, _fault: &Fault, _begins: bool, _at_ns: u64)
    where
        Self: Sized,
    {
    }
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

    fn break_pins(board: &mut Nucleo<Self>, fault: &Fault, begins: bool, at_ns: u64) {
        let (pins, part) = board.pins();
        pins.break_by(part, fault, begins, at_ns);
    }
}

/// The ends of the channels to the other board's thread.
pub struct Cable {
    /// What this board sends.
    pub to_peer: SyncSender<Vec<TimedByte>>,
    /// What the other board sends.
    pub from_peer: Receiver<Vec<TimedByte>>,
}

/// Runs one board of a pair.
pub struct Lockstep {
    cable: Cable,
    /// What the peer's bytes go through.
    way: Way,
    console: Option<ConsoleHost>,
    /// Who sits at the console if no host does.
    pub terminal: Option<Box<dyn Terminal>>,
    injector: Injector,
    /// The board's.
    clock: Clock,
    log: Option<Log>,
    /// By the scene's clock, as all that is written down here.
    next_exchange_ns: u64,
    next_log_ns: u64,
    end_ns: u64,
    /// Resets seen so far.
    resets: usize,
    /// What the board sent to its peer, with instants.
    pub sent: Vec<TimedByte>,
    /// What the board heard from its peer, with the instants at which each byte was complete.
    pub heard: Vec<TimedByte>,
    /// When the board had run for [`WARM_UP_NS`].
    pub warm: Option<Instant>,
    /// Set if the other board's thread is gone before the end.
    pub abandoned: bool,
    /// Set once the scene is over.
    pub is_done: bool,
}

impl Lockstep {
    /// The driver of the board of `role` in `scene`, which runs `elf`.
    pub fn new(scene: &Scene, role: Role, elf: &[u8], cable: Cable) -> Self {
        let clock = match role {
            Role::Sensor => Clock::new(&scene.faults),
            _ => Clock::default(),
        };
        Self {
            cable,
            way: Way::new(scene, role),
            console: console_for(scene, role),
            terminal: None,
            injector: Injector::new(scene, role, elf, clock.clone()),
            clock,
            log: Log::find(elf),
            next_exchange_ns: QUANTUM_NS,
            next_log_ns: LOG_PERIOD_NS,
            end_ns: (scene.duration_s * 1e9).ceil() as u64,
            resets: 0,
            sent: Vec::new(),
            heard: Vec::new(),
            warm: None,
            abandoned: false,
            is_done: false,
        }
    }

    /// Whether a host on the console wants the board configured.
    pub fn is_asked(&self) -> bool {
        self.console.as_ref().is_some_and(ConsoleHost::asks)
    }

    /// What came of it.
    pub fn told(&self) -> Option<Told> {
        self.console.as_ref().and_then(|host| host.told)
    }

    /// The board's log.
    pub fn log_lines(&self) -> Vec<(u64, String)> {
        self.log.as_ref().map(Log::lines).unwrap_or_default()
    }

    /// The board's clock.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// What breaks the board.
    pub fn injector(&self) -> &Injector {
        &self.injector
    }

    /// Gives the other board what this one sent and takes what it sent; false if it is gone.
    fn exchange<P: Watched>(&mut self, board: &mut Nucleo<P>, now_ns: u64) -> bool {
        let mut sent = board.wire(PEER_UART).take_sent();
        for (at_ns, _) in &mut sent {
            *at_ns = self.clock.true_ns(*at_ns);
        }
        self.sent.extend_from_slice(&sent);
        let (Ok(()), Ok(received)) = (self.cable.to_peer.send(sent), self.cable.from_peer.recv())
        else {
            self.abandoned = true;
            return false;
        };
        for (at_ns, byte) in received {
            self.way.push(at_ns + QUANTUM_NS, byte);
        }
        while let Some((due_ns, byte)) = self.way.pop(now_ns + QUANTUM_NS) {
            if self.injector.is_off {
                continue;
            }
            self.heard.push((due_ns, byte));
            let due_ns = self.clock.local_ns(due_ns);
            board.wire(PEER_UART).hear(due_ns, byte);
        }
        if let Some(host) = &mut self.console {
            host.serve(board, now_ns);
        } else if let Some(terminal) = &mut self.terminal {
            terminal::carry(&mut **terminal, board, now_ns);
        }
        true
    }

    /// What comes next, by the board's clock.
    fn next_stop<P: Watched>(&self, board: &mut Nucleo<P>, local_ns: u64) -> VirtualNanos {
        let mut next_ns = self.clock.local_ns(self.next_exchange_ns);
        let due = [PEER_UART, CONSOLE_UART].map(|uart| board.wire(uart).next_due());
        for due_ns in due.into_iter().chain([self.injector.next_ns()]).flatten() {
            if due_ns > local_ns {
                next_ns = next_ns.min(due_ns);
            }
        }
        VirtualNanos(next_ns.max(local_ns + 1))
    }
}

/// A host on the console, if the scene wants of the board what is not its default, or has a host do
/// wrong.
fn console_for(scene: &Scene, role: Role) -> Option<ConsoleHost> {
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
    let is_needed = wanted.is_some() || faults.iter().any(|fault| ConsoleHost::does(fault.kind));
    is_needed.then(|| ConsoleHost::new(wanted, described, faults))
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
        let board_ns = stop.at.0;
        let now_ns = self.clock.true_ns(board_ns);
        if now_ns >= self.next_log_ns && !self.injector.is_off {
            self.next_log_ns = now_ns + LOG_PERIOD_NS;
            if let Some(log) = &mut self.log {
                log.read(now_ns, host);
            }
        }
        if self.injector.act(session, stop, host)
            && let Some(console) = &mut self.console
        {
            console.restart();
        }
        if session.resets().len() != self.resets {
            self.resets = session.resets().len();
            // Nobody listens until the firmware does again.
            session.board_mut().wire(PEER_UART).lose();
            session.board_mut().wire(CONSOLE_UART).lose();
        }
        if now_ns >= self.next_exchange_ns {
            if !self.exchange(session.board_mut(), now_ns) {
                return None;
            }
            if now_ns >= self.end_ns {
                self.is_done = true;
                return None;
            }
            if self.warm.is_none() && now_ns >= WARM_UP_NS {
                self.warm = Some(Instant::now());
            }
            self.next_exchange_ns += QUANTUM_NS;
        }
        Some(self.next_stop(session.board_mut(), board_ns))
    }
}
