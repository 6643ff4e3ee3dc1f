//! What stands beside each board of a bench: its ports, and the hands that reset and stop it.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use protocol::receiver::{Event, Receiver};
use protocol::{Estimate, Message, Role};
use rigless::emulator::Host;

use super::socket::Socket;
use super::surroundings::Surroundings;
use super::{Command, PortName, lock};
use crate::console::ConsoleHost;
use crate::display::DisplayPins;
use crate::lockstep::{BoardHook, QUANTUM_NS, QuantumContext};
use crate::nucleo::{CONSOLE_UART, Nucleo, PEER_UART, Pins};
use crate::rtt::Channel;
use crate::sensor::SensorPins;
use crate::wire::TimedByte;
use crate::wiring::Mistake;
use crate::{ElfError, WARM_UP_NS};
use hil_sim_core::run::recording::{ACTUATORS, volts};
use hil_sim_core::scene::Scene;

/// When a board has to have answered that it is set up.
const ANSWERS_NS: u64 = 5_000_000_000;
/// How long a reader is waited for at a time.
const WAITS: Duration = Duration::from_millis(20);

/// What the display's converters put out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// Each actuator's voltage, in V.
    pub volts: [f64; ACTUATORS],
    /// Whether CLR is low, which holds all of them at 0 V.
    pub is_clear: bool,
}

impl Outputs {
    /// Whether nothing is felt: every voltage is 0 V.
    pub fn are_silent(&self) -> bool {
        self.volts.iter().all(|&volts| volts == 0.0)
    }
}

impl Default for Outputs {
    fn default() -> Self {
        Self {
            volts: [0.0; ACTUATORS],
            is_clear: true,
        }
    }
}

/// What the sensor board makes of what it touches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorView {
    /// What it said last to its peer; none if it has not said anything yet.
    pub estimate: Option<Estimate>,
    /// The true wavelength under the fingertip, in mm.
    pub wavelength_mm: f64,
}

/// What a bench and its boards' threads share.
#[derive(Debug)]
pub struct Shared {
    pub sockets: [Socket; PortName::ALL.len()],
    pub surroundings: Arc<dyn Surroundings>,
    /// Whether the boards are not joined.
    pub is_apart: bool,
    /// Whether a port's reader is waited for.
    pub waits: bool,
    pub now_ns: AtomicU64,
    /// How far the wall clock is ahead.
    pub behind_us: AtomicU64,
    /// When both boards stop.
    pub end_ns: AtomicU64,
    /// Whether they are to stop before.
    pub stops: AtomicBool,
    pub sensed: Mutex<SensorView>,
    pub outputs: Mutex<Outputs>,
    pub orders: Mutex<VecDeque<(Role, Command)>>,
}

impl Shared {
    pub fn socket(&self, name: PortName) -> &Socket {
        &self.sockets[name as usize]
    }

    pub fn now_s(&self) -> f64 {
        self.now_ns.load(Ordering::Relaxed) as f64 * 1e-9
    }

    /// Has something done to the board of `role`.
    pub fn order(&self, role: Role, command: Command) {
        lock(&self.orders).push_back((role, command));
    }

    fn next_order(&self, role: Role) -> Option<Command> {
        let mut orders = lock(&self.orders);
        let place = orders.iter().position(|&(whose, _)| whose == role)?;
        orders.remove(place).map(|(_, command)| command)
    }

    /// Whether anybody has a port open, now.
    pub fn has_clients(&self) -> bool {
        self.sockets.iter().any(|socket| {
            socket.carry(self.now_ns.load(Ordering::Relaxed), &[], 0);
            socket.has_client()
        })
    }

    /// Hands on and takes what goes through a port of a board.
    fn carry(&self, name: PortName, now_ns: u64, sent: &[TimedByte], taken: usize) -> Vec<u8> {
        let socket = self.socket(name);
        let mut heard = socket.carry(now_ns, sent, taken);
        while self.waits && !self.stops.load(Ordering::Relaxed) && socket.is_behind(WAITS) {
            heard.extend(socket.carry(now_ns, &[], taken + heard.len()));
        }
        heard
    }
}

/// What differs between the two boards' pins.
pub trait BenchPins: Pins {
    /// Shows what the pins have come to since the last call, and forgets it.
    fn show(&mut self, shared: &Shared);
}

impl BenchPins for SensorPins {
    fn show(&mut self, shared: &Shared) {
        self.take_records();
        lock(&shared.sensed).wavelength_mm = self.wavelength_mm();
    }
}

impl BenchPins for DisplayPins {
    fn show(&mut self, shared: &Shared) {
        let last = self.take_records().outputs.pop();
        let mut outputs = lock(&shared.outputs);
        outputs.is_clear = self.is_clear();
        if let Some(last) = last {
            outputs.volts = last.words.map(volts);
        }
    }
}

/// Beside one board.
pub struct PortServer {
    role: Role,
    shared: Arc<Shared>,
    /// The host that sets the board up before anybody else has its console.
    setup: Option<ConsoleHost>,
    /// Told once the board is set up and the emulator warm.
    ready: Option<Sender<Result<(), ElfError>>>,
    rtt: Option<Channel>,
    logged: Vec<TimedByte>,
    /// What the board says to its peer.
    said: Receiver,
    /// Said since the last exchange.
    sent: Vec<TimedByte>,
    /// Whether the scene breaks the boards.
    is_broken: bool,
    /// Whether the wire from the other board's TX is not where it should be.
    is_cut: bool,
}

impl PortServer {
    /// Beside the board of `role` in `scene`, which runs `elf`.
    pub fn new(
        scene: &Scene,
        role: Role,
        elf: &[u8],
        shared: Arc<Shared>,
        ready: Sender<Result<(), ElfError>>,
    ) -> Self {
        Self {
            role,
            shared,
            setup: ConsoleHost::of_scene(scene, role),
            ready: Some(ready),
            rtt: Channel::find(elf),
            logged: Vec::new(),
            said: Receiver::new(),
            sent: Vec::new(),
            is_broken: !scene.faults.is_empty(),
            is_cut: false,
        }
    }

    fn ports(&self) -> [PortName; 3] {
        match self.role {
            Role::Display => [
                PortName::DisplayConsole,
                PortName::DisplayLink,
                PortName::DisplayRtt,
            ],
            _ => [
                PortName::SensorConsole,
                PortName::SensorLink,
                PortName::SensorRtt,
            ],
        }
    }

    /// Goes on with setting the board up; true once that is done.
    fn set_up<P: Pins>(&mut self, board: &mut Nucleo<P>, now_ns: u64) -> bool {
        if let Some(host) = &mut self.setup {
            host.serve(board, now_ns);
            let reason = match host.told {
                None if now_ns < ANSWERS_NS => return false,
                None => Some("it has not answered for 5 s".to_owned()),
                Some(told) => told.report.refused.map(|refusal| refusal.to_string()),
            };
            self.setup = None;
            if let Some(reason) = reason
                && let Some(ready) = self.ready.take()
            {
                let board = self.role.name();
                let _ = ready.send(Err(ElfError::Configuration { board, reason }));
            }
        }
        // Translated for the first time, a board answers so slowly that whoever asks gives it up.
        let is_warm = now_ns >= WARM_UP_NS.min(self.shared.end_ns.load(Ordering::Relaxed));
        if is_warm && let Some(ready) = self.ready.take() {
            let _ = ready.send(Ok(()));
        }
        true
    }

    fn miswire<P: BenchPins>(
        &mut self,
        board: &mut Nucleo<P>,
        at_ns: u64,
        mistake: Mistake,
        wrong: bool,
    ) {
        match mistake {
            Mistake::LinkStraight | Mistake::SensorTxOpen | Mistake::DisplayTxOpen => {
                self.is_cut = wrong;
            }
            Mistake::NoGround => board.break_line(wrong),
            _ => {
                let (pins, part) = board.pins();
                pins.miswire(part, at_ns, mistake, wrong);
            }
        }
    }

    fn carry<P: Pins>(
        &self,
        board: &mut Nucleo<P>,
        (uart, name): (usize, PortName),
        (now_ns, is_on): (u64, bool),
        sent: &[TimedByte],
    ) {
        let waiting = board.wire(uart).waiting();
        let heard = self.shared.carry(name, now_ns, sent, waiting);
        // A board without power hears nothing.
        for byte in heard.into_iter().filter(|_| is_on) {
            board.wire(uart).hear(now_ns, byte);
        }
    }
}

impl Drop for PortServer {
    fn drop(&mut self) {
        self.shared.surroundings.leave();
    }
}

impl<P: BenchPins> BoardHook<P> for PortServer {
    fn begin(&mut self, now_ns: u64) {
        let behind = self.shared.surroundings.wait(self.role, now_ns);
        if self.role != Role::Display {
            return;
        }
        let behind_us = behind.as_micros() as u64;
        self.shared.behind_us.store(behind_us, Ordering::Relaxed);
        self.shared.now_ns.store(now_ns, Ordering::Relaxed);
        // The other board, which has not begun its next quantum, is told too.
        if self.shared.stops.load(Ordering::Relaxed) {
            self.shared
                .end_ns
                .fetch_min(now_ns + QUANTUM_NS, Ordering::Relaxed);
        }
    }

    fn sent(&mut self, _board: &mut Nucleo<P>, sent: &[TimedByte]) {
        if self.role == Role::Sensor {
            for &(_, byte) in sent {
                self.said.receive(&[byte], |event| {
                    if let Event::Message(Message::Estimate(estimate)) = event {
                        lock(&self.shared.sensed).estimate = Some(estimate);
                    }
                });
            }
        }
        if self.shared.is_apart {
            self.sent.extend_from_slice(sent);
        }
    }

    fn is_joined(&self, _now_ns: u64) -> bool {
        !self.shared.is_apart && !self.is_cut
    }

    fn heard(&mut self, _due_ns: u64, _byte: u8) {}

    fn attend(&mut self, between: QuantumContext<'_, P>) {
        let QuantumContext {
            session,
            host,
            stop,
            now_ns,
            is_on,
        } = between;
        let board = session.board_mut();
        let (pins, _) = board.pins();
        pins.show(&self.shared);
        if self.set_up(board, now_ns) {
            let moment = (now_ns, is_on);
            let [console, link, rtt] = self.ports();
            let sent = board.wire(CONSOLE_UART).take_sent();
            self.carry(board, (CONSOLE_UART, console), moment, &sent);
            if self.shared.is_apart {
                let sent = std::mem::take(&mut self.sent);
                self.carry(board, (PEER_UART, link), moment, &sent);
            }
            let logged = std::mem::take(&mut self.logged);
            self.shared.carry(rtt, now_ns, &logged, 0);
        }
        // A firmware that has gone astray is not kept running; one that is broken on purpose is.
        if !self.is_broken && !session.unmapped().is_empty() {
            self.shared.stops.store(true, Ordering::Relaxed);
        }
        while let Some(order) = self.shared.next_order(self.role) {
            let (mistake, wrong) = match order {
                Command::Reset(_) => {
                    session.reset_by_pin(stop.at, stop.instruction_count, host);
                    continue;
                }
                // A pressed stop is an open loop.
                Command::Stop => (Mistake::StopOpen, true),
                Command::Release => (Mistake::StopOpen, false),
                Command::Wrong(mistake) => (mistake, true),
                Command::Right(mistake) => (mistake, false),
                _ => continue,
            };
            self.miswire(session.board_mut(), stop.at.0, mistake, wrong);
        }
    }

    fn log(&mut self, now_ns: u64, host: &mut dyn Host) {
        let bytes = self.rtt.map(|rtt| rtt.take(host)).unwrap_or_default();
        self.logged
            .extend(bytes.into_iter().map(|byte| (now_ns, byte)));
    }

    fn is_over(&self, now_ns: u64) -> bool {
        now_ns >= self.shared.end_ns.load(Ordering::Relaxed)
    }
}
