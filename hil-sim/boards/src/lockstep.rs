//! Two emulated boards in step: each on a thread of its own, exchanging what their wires carried in
//! portions of virtual time. Which thread runs when decides nothing.

use std::sync::mpsc::{Receiver, SyncSender};

use protocol::Role;
use rigless::emulator::{Driver, Host, Settled, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;

use super::injector::Injector;
use super::nucleo::{CONSOLE_UART, Nucleo, PEER_UART, Pins};
use super::wire::TimedByte;
use hil_sim_core::link::channel::LinkChannel;
use hil_sim_core::plant::fault::clock::Clock;
use hil_sim_core::scene::Scene;

/// What a byte takes from board to board at the least, the scene's delay included, and how often what stands
/// beside the boards has its turn.
/// Smaller is closer to a bare cable and slower; at 500 µs the pair keeps ahead of a wall clock.
pub const QUANTUM_NS: u64 = 500_000;
/// How often the boards hand each other their bytes. It is shorter than what a byte takes, so that neither
/// waits for what the other says in the portion before it needs it: the one that has more to do just then
/// falls behind by a portion and catches up in the next.
const PORTION_NS: u64 = QUANTUM_NS / 2;
/// Portions of the other board's that may lie ready: what it is ahead by at most.
pub(super) const PORTIONS_READY: usize = 3;
/// How often the log is read: well before the 1 KiB of RTT are full.
const LOG_PERIOD_NS: u64 = 10_000_000;

/// A board between two quanta.
pub struct QuantumContext<'a, P: Pins> {
    /// The board, as it is run.
    pub session: &'a mut Session<Nucleo<P>>,
    /// What runs it.
    pub host: &'a mut dyn Host,
    /// Where it was stopped.
    pub stop: Stop,
    /// When, by the scene's clock.
    pub now_ns: u64,
    /// Whether it has power.
    pub is_on: bool,
}

/// What stands beside one board of a pair and makes something of what it sees: all instants are the
/// scene's clock's.
pub trait BoardHook<P: Pins>: Send + 'static {
    /// The quantum that ends at `now_ns` is over; nothing of it has been exchanged yet.
    fn begin(&mut self, _now_ns: u64) {}

    /// The board put these on its wire to the peer, with the instants at which each was complete.
    fn sent(&mut self, board: &mut Nucleo<P>, sent: &[TimedByte]);

    /// Whether what the peer says goes on its way to the board.
    fn is_joined(&self, _now_ns: u64) -> bool {
        true
    }

    /// This byte of the peer's reaches the board.
    fn heard(&mut self, due_ns: u64, byte: u8);

    /// The peers' bytes have been exchanged: the console's turn, and whatever else is to be done to the
    /// board.
    fn attend(&mut self, between: QuantumContext<'_, P>);

    /// The log is to be read.
    fn log(&mut self, now_ns: u64, host: &mut dyn Host);

    /// Every access, stop and hit, once the models have settled.
    fn settled(&mut self, _settled: &Settled) {}

    /// The board has lost its power.
    fn restart(&mut self) {}

    /// Whether the run is over with the quantum that ended at `now_ns`. Both boards' have to agree.
    fn is_over(&self, now_ns: u64) -> bool;
}

/// The ends of the channels to the other board's thread.
pub struct Cable {
    /// What this board sends.
    pub to_peer: SyncSender<Vec<TimedByte>>,
    /// What the other board sends.
    pub from_peer: Receiver<Vec<TimedByte>>,
}

/// Runs one board, of a pair or alone.
pub struct Lockstep<W> {
    /// None if it is alone.
    cable: Option<Cable>,
    /// How often bytes are exchanged, and how often the witness has its turn.
    portion_ns: u64,
    quantum_ns: u64,
    /// What the peer's bytes go through.
    way: LinkChannel,
    /// What the scene's delay leaves of [`QUANTUM_NS`].
    more_ns: u64,
    injector: Injector,
    clock: Clock,
    /// What the board has sent in this quantum's portions.
    sent: Vec<TimedByte>,
    /// By the scene's clock, as all that follows.
    next_exchange_ns: u64,
    next_quantum_ns: u64,
    next_log_ns: u64,
    resets: usize,
    /// What makes something of it.
    pub witness: W,
    /// Set if the other board's thread is gone before the end.
    pub abandoned: bool,
    /// Set once the run is over.
    pub is_done: bool,
}

impl<W> Lockstep<W> {
    /// The driver of the board of `role` in `scene`, which runs `elf` beside another one.
    pub fn new(scene: &Scene, role: Role, elf: &[u8], cable: Cable, witness: W) -> Self {
        let spans_ns = (PORTION_NS, QUANTUM_NS);
        Self::with(scene, role, elf, Some(cable), spans_ns, witness)
    }

    /// The driver of a board without a peer but the witness, whose turn comes each `quantum_ns`.
    pub fn alone(scene: &Scene, role: Role, elf: &[u8], quantum_ns: u64, witness: W) -> Self {
        Self::with(scene, role, elf, None, (quantum_ns, quantum_ns), witness)
    }

    fn with(
        scene: &Scene,
        role: Role,
        elf: &[u8],
        cable: Option<Cable>,
        (portion_ns, quantum_ns): (u64, u64),
        witness: W,
    ) -> Self {
        let delay_ns = (scene.link.delay_ms * 1e6).round() as u64;
        let clock = match role {
            Role::Sensor => Clock::new(&scene.faults),
            _ => Clock::default(),
        };
        Self {
            cable,
            portion_ns,
            quantum_ns,
            way: LinkChannel::new(scene, role),
            more_ns: QUANTUM_NS.saturating_sub(delay_ns),
            injector: Injector::new(scene, role, elf, clock.clone()),
            clock,
            sent: Vec::new(),
            next_exchange_ns: portion_ns,
            next_quantum_ns: quantum_ns,
            next_log_ns: LOG_PERIOD_NS,
            resets: 0,
            witness,
            abandoned: false,
            is_done: false,
        }
    }

    /// The board's clock.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// When the board is to stop first.
    pub fn first_stop(&self) -> VirtualNanos {
        VirtualNanos(self.portion_ns)
    }

    /// What breaks the board.
    pub fn injector(&self) -> &Injector {
        &self.injector
    }

    /// Gives the other board what this one has sent in the portion that ends at `now_ns`, and takes what it
    /// sent in the one before; false if it is gone.
    fn exchange<P: Pins>(&mut self, board: &mut Nucleo<P>, now_ns: u64) -> bool
    where
        W: BoardHook<P>,
    {
        let mut portion = board.wire(PEER_UART).take_sent();
        for (at_ns, _) in &mut portion {
            *at_ns = self.clock.true_ns(*at_ns);
        }
        self.sent.extend_from_slice(&portion);
        if now_ns >= self.next_quantum_ns {
            self.witness.begin(now_ns);
            self.witness.sent(board, &self.sent);
            self.sent.clear();
        }
        if let Some(cable) = &self.cable {
            // At the end of a run the other board may be gone already, with all that it had to say said: only
            // what does not come tells that it failed.
            let _ = cable.to_peer.send(portion);
            // Nothing came before the first portion.
            if self.next_exchange_ns > self.portion_ns {
                let Ok(received) = cable.from_peer.recv() else {
                    self.abandoned = true;
                    return false;
                };
                if self.witness.is_joined(now_ns) {
                    for (at_ns, byte) in received {
                        self.way.push(at_ns + self.more_ns, byte);
                    }
                }
            }
        }
        while let Some((due_ns, byte)) = self.way.pop(now_ns + self.portion_ns) {
            if self.injector.is_off {
                continue;
            }
            self.witness.heard(due_ns, byte);
            let due_ns = self.clock.local_ns(due_ns);
            board.wire(PEER_UART).hear(due_ns, byte);
        }
        true
    }

    /// What comes next, by the board's clock.
    fn next_stop<P: Pins>(&self, board: &mut Nucleo<P>, local_ns: u64) -> VirtualNanos {
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

impl<P: Pins, W: BoardHook<P>> Driver<Nucleo<P>> for Lockstep<W> {
    fn on_settled(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        _host: &mut dyn Host,
        settled: Settled,
    ) {
        self.witness.settled(&settled);
        session.board_mut().follow(&settled);
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
            self.witness.log(now_ns, host);
        }
        if self.injector.act(session, stop, host) {
            self.witness.restart();
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
            self.next_exchange_ns += self.portion_ns;
        }
        if now_ns >= self.next_quantum_ns {
            self.witness.attend(QuantumContext {
                session: &mut *session,
                host,
                stop,
                now_ns,
                is_on: !self.injector.is_off,
            });
            // By the quantum's end, not by the stop, which comes an instruction later on one board or the other.
            if self.witness.is_over(self.next_quantum_ns) {
                self.is_done = true;
                return None;
            }
            self.next_quantum_ns += self.quantum_ns;
        }
        Some(self.next_stop(session.board_mut(), board_ns))
    }
}
