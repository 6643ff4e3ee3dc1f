//! The two boards' own firmwares behind serial ports in memory, by virtual time: the emulator goes on when the
//! programs that listen to it do, and they when it does. So no load of the machine is to be seen by either.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use hil_sim_boards::WARM_UP_NS;
use hil_sim_boards::bench::surroundings::{Line, Surroundings};
use hil_sim_boards::bench::{Bench, Options, PortName};
use host_bridge::clock::Clock;
use host_bridge::lock::locked;
use protocol::Role;

use crate::bench::folder;
use crate::elves;
use crate::virtual_clock::{VirtualClock, wait_until};
use crate::virtual_ports::{BoardEnd, Plug, VirtualBench};

/// Far more of virtual time than anything takes.
const LIMIT: Duration = Duration::from_secs(600);
/// When the boards begin to wait, in ns of their time: each has been set up by then, which goes by nobody's clock.
const BEGINS_NS: u64 = 2 * WARM_UP_NS;

/// A bench whose boards go by the clock of [`VirtualBench`].
pub struct VirtualBoards {
    /// The emulated boards.
    pub boards: Bench,
    /// The clock and the ports.
    pub bench: VirtualBench,
    gate: Arc<Gate>,
    keeper: Option<JoinHandle<()>>,
}

impl VirtualBoards {
    /// Sets up the bench of the test called `name`, as `change` has it.
    ///
    /// # Panics
    /// If it can't be set up.
    pub fn new(name: &str, change: impl FnOnce(&mut Options)) -> Self {
        let bench = VirtualBench::default();
        let gate = Arc::new(Gate::new(&bench));
        let mut options = Options::new(folder(name));
        change(&mut options);
        options.surroundings = Some(Arc::clone(&gate) as Arc<dyn Surroundings>);
        let boards = Bench::start(options, elves::both()).unwrap_or_else(|error| panic!("{error}"));
        let (keeping, clock) = (Arc::clone(&gate), bench.clock.clone());
        let keeper = bench.clock.spawn(Box::new(move || keep(&keeping, &clock)));
        Self {
            boards,
            bench,
            gate,
            keeper: Some(keeper),
        }
    }

    /// Waits for some seconds of the boards' time.
    ///
    /// # Panics
    /// If they do not go by.
    pub fn pass(&self, virtual_s: f64) {
        let end_s = self.boards.now_s() + virtual_s;
        self.wait_until("time", || self.boards.now_s() >= end_s);
    }

    /// Waits until `holds`, by the boards' time.
    ///
    /// # Panics
    /// If it does not in ten minutes of it; `what` says what is missing.
    pub fn wait_until(&self, what: &str, holds: impl FnMut() -> bool) {
        assert!(wait_until(&self.bench.clock, LIMIT, holds), "no {what}");
    }
}

impl Drop for VirtualBoards {
    fn drop(&mut self) {
        self.gate.end();
        if let Some(keeper) = self.keeper.take() {
            self.bench.clock.join(keeper);
        }
    }
}

/// Lets both boards go on whenever the clock has come to the end of their quantum. It has the turn while they do.
fn keep(gate: &Gate, clock: &VirtualClock) {
    let notify = clock.notify();
    let begun_us = clock.now_us();
    while let Some(next_ns) = gate.next_ns() {
        notify.wait_until(begun_us + (next_ns - BEGINS_NS) / 1_000);
        gate.open_until(next_ns);
    }
}

/// Where both boards wait at the end of a quantum.
struct Gate {
    bench: VirtualBench,
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// Up to which virtual instant the boards may go on.
    open_ns: u64,
    /// Where each board waits.
    waiting_ns: [Option<u64>; 2],
    is_over: bool,
}

impl Gate {
    fn new(bench: &VirtualBench) -> Self {
        Self {
            bench: bench.clone(),
            state: Mutex::new(State {
                open_ns: BEGINS_NS,
                waiting_ns: [None; 2],
                is_over: false,
            }),
            changed: Condvar::new(),
        }
    }

    /// Where both boards wait for the next quantum; none at the end.
    fn next_ns(&self) -> Option<u64> {
        let go_on = |state: &mut State| !state.is_over && state.waiting_ns.contains(&None);
        let state = self.changed.wait_while(locked(&self.state), go_on);
        let state = state.unwrap_or_else(PoisonError::into_inner);
        let next_ns = state.waiting_ns.iter().flatten().max().copied();
        next_ns.filter(|_| !state.is_over)
    }

    fn open_until(&self, open_ns: u64) {
        let mut state = locked(&self.state);
        state.open_ns = open_ns;
        state.waiting_ns = [None; 2];
        self.changed.notify_all();
    }

    fn end(&self) {
        let mut state = locked(&self.state);
        state.is_over = true;
        self.changed.notify_all();
    }
}

impl std::fmt::Debug for Gate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Gate")
    }
}

impl Surroundings for Gate {
    fn wait(&self, role: Role, now_ns: u64) -> Duration {
        let mut state = locked(&self.state);
        if now_ns > state.open_ns {
            state.waiting_ns[usize::from(role == Role::Display)] = Some(now_ns);
            self.changed.notify_all();
        }
        let is_shut = |state: &mut State| !state.is_over && now_ns > state.open_ns;
        let _passed = self.changed.wait_while(state, is_shut);
        Duration::ZERO
    }

    fn leave(&self) {
        self.end();
    }

    fn cable(&self, _name: PortName) -> io::Result<Arc<dyn Line>> {
        let (path, end) = self.bench.cable();
        let plug = end.plug();
        Ok(Arc::new(VirtualLine {
            path,
            end,
            _plug: plug,
        }))
    }
}

/// A cable in memory.
struct VirtualLine {
    path: PathBuf,
    end: BoardEnd,
    _plug: Plug,
}

impl std::fmt::Debug for VirtualLine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("VirtualLine").field(&self.path).finish()
    }
}

impl Line for VirtualLine {
    fn path(&self) -> &Path {
        &self.path
    }

    fn read(&self, bytes: &mut [u8]) -> io::Result<Option<usize>> {
        Ok(self.end.has_client().then(|| self.end.take(bytes)))
    }

    fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        Ok(self.end.put(bytes))
    }

    fn baud(&self) -> io::Result<u32> {
        Ok(self.end.baud())
    }

    fn forget_client(&self) -> io::Result<()> {
        self.end.forget_unread();
        Ok(())
    }
}
