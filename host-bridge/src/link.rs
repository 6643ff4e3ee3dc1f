//! One board at the end of a serial line: opened, greeted, listened to, and opened again when it is lost.
//!
//! A thread of its own reads the line and runs the protocol's own [`protocol::Port`]; who wants to say
//! something writes it himself, at once. A board that is unplugged is looked for every [`RETRY`].

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use protocol::{ClockOffset, Message, Peer, Ping, PortCounters, Role, Stop, StopReason};

use crate::clock::{Notify, micros};
pub use crate::line::{BAUD, Missed, NotSent, host_hello};
use crate::line::{Handovers, Line};
use crate::line_monitor::BoardClock;
use crate::line_monitor::{LineMonitor, Verdict};
use crate::lock::locked;
use crate::place::Place;
use crate::search::{Candidates, Search};
use crate::state::State;
use crate::system::{Opened, System};

/// How long a lost board is waited for between two looks: a cable that is put back is seen well within
/// a second.
pub const RETRY: Duration = Duration::from_millis(100);
/// Between two times that Stop is said to a board that has not answered it, in µs.
const STOP_AGAIN_US: u64 = 40_000;
/// Longest read: what comes in some 40 ms at full speed.
const READ_BYTES: usize = 4_096;

/// What a person says who wants the boards to stop.
pub const OPERATOR_STOP: Stop = Stop {
    reason: StopReason::Operator,
};

/// What a link tells its owner.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "an event is handed over once, and boxing every message would cost more"
)]
pub enum Event {
    /// The board has said something.
    Heard {
        /// When its last byte was read, in µs of the link's clock.
        at_us: u64,
        /// What it said.
        message: Message,
    },
    /// The board has started anew since it was heard last: its clock and counters begin again.
    Restarted,
    /// The link stands differently.
    StateChanged(State),
}

/// What the two clocks of a link are to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// The board's clock minus the link's, in µs.
    pub offset_us: i64,
    /// The shortest round trip of late, in µs: twice the bound of the offset's error.
    pub round_trip_us: u64,
}

/// The way to one board. Dropping it closes the line.
pub struct Link {
    shared: Arc<Shared>,
    reader: Option<JoinHandle<()>>,
}

/// What both sides of a link use.
struct Shared {
    role: Role,
    line: Mutex<Option<Line>>,
    state: Mutex<State>,
    clock: Mutex<ClockOffset>,
    /// Of the line before, while there is none.
    counters: Mutex<PortCounters>,
    /// On the line, or the one before.
    missed: Mutex<Missed>,
    /// A Stop that the board has not answered, and when it was said last.
    stop: Mutex<Option<(Stop, u64)>>,
    ended: AtomicBool,
    system: System,
    /// Wakes a reader that waits to try again.
    woken: Arc<dyn Notify>,
}

impl Link {
    /// Looks for the board of `role` at `place`, for as long as the link lives. `tell` is called from the
    /// link's thread with everything that happens; it may [`Link::post`], and it holds up the reading for
    /// as long as it takes.
    pub fn open(role: Role, place: Place, tell: impl FnMut(Event) + Send + 'static) -> Self {
        Self::open_on(&System::default(), role, place, tell)
    }

    /// The same among the ports of `system`, by its clock.
    pub fn open_on(
        system: &System,
        role: Role,
        place: Place,
        tell: impl FnMut(Event) + Send + 'static,
    ) -> Self {
        let wanted = match &place {
            Place::Anywhere => format!("an ST-LINK with the {} board", role.name()),
            named => named.to_string(),
        };
        let shared = Arc::new(Shared {
            role,
            line: Mutex::new(None),
            state: Mutex::new(State::Absent(wanted.clone())),
            clock: Mutex::new(ClockOffset::new()),
            counters: Mutex::new(PortCounters::new()),
            missed: Mutex::default(),
            stop: Mutex::new(None),
            ended: AtomicBool::new(false),
            woken: system.clock.notify(),
            system: system.clone(),
        });
        let reader = Reader {
            shared: Arc::clone(&shared),
            wanted,
            search: Search::new(place),
            tell,
            told: None,
            clock: BoardClock::default(),
        };
        Self {
            shared,
            reader: Some(system.clock.spawn(Box::new(|| reader.run()))),
        }
    }

    /// A way to say things that can be handed to other threads; it does not keep the link open.
    pub fn sender(&self) -> LinkSender {
        LinkSender {
            shared: Arc::clone(&self.shared),
        }
    }

    /// Says `message` now. See [`LinkSender::post`]. Fails if nobody is there, or the line is stuck.
    pub fn post(&self, message: &Message) -> Result<(), NotSent> {
        self.shared.post(message)
    }

    /// Stops the board. See [`LinkSender::stop`]. Fails if it could not be said yet.
    pub fn stop(&self, stop: Stop) -> Result<(), NotSent> {
        self.shared.stop(stop)
    }

    /// Whether the board has not answered a Stop yet.
    pub fn is_stopping(&self) -> bool {
        locked(&self.shared.stop).is_some()
    }

    /// How the link stands.
    pub fn state(&self) -> State {
        locked(&self.shared.state).clone()
    }

    /// What this end of the line has counted since the line was opened last.
    pub fn counters(&self) -> PortCounters {
        self.shared.counters()
    }

    /// What of [`Link::counters`] was missed because the port changed hands between programs.
    pub fn missed(&self) -> Missed {
        *locked(&self.shared.missed)
    }

    /// The board's clock; none before the first exchange since it started.
    pub fn clocks(&self) -> Option<Clocks> {
        let clock = locked(&self.shared.clock);
        Some(Clocks {
            offset_us: clock.offset_us()?,
            round_trip_us: clock.round_trip_us()?,
        })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Release);
        self.shared.woken.notify();
        if let Some(reader) = self.reader.take() {
            self.shared.system.clock.join(reader);
        }
    }
}

/// Says things to a board, from any thread.
#[derive(Clone)]
pub struct LinkSender {
    shared: Arc<Shared>,
}

impl LinkSender {
    /// Says `message` now: it is with the system when this returns. Fails if nobody is there, or the line is stuck.
    pub fn post(&self, message: &Message) -> Result<(), NotSent> {
        self.shared.post(message)
    }

    /// What this end of the line has counted. See [`Link::counters`].
    pub fn counters(&self) -> PortCounters {
        self.shared.counters()
    }

    /// Stops whatever board is there: says so now, and again until it answers that it has stopped; a board that
    /// comes later is told as soon as its port is open. Never waits. Fails if it could not be said yet.
    pub fn stop(&self, stop: Stop) -> Result<(), NotSent> {
        self.shared.stop(stop)
    }
}

/// Stops all of these boards for the operator, as [`LinkSender::stop`] does: never waits.
pub fn stop_all(boards: &[LinkSender]) {
    for board in boards {
        // What can't be said yet is said as soon as it can, and again until the board answers.
        let _ = board.stop(OPERATOR_STOP);
    }
}

/// What is left to do by hand for these boards, which have not stopped: the emergency stop ends the stimulus alone,
/// and the arm does not hear it.
pub fn by_hand(unstopped: &[Role]) -> String {
    let each = unstopped.iter().map(|role| match role {
        Role::Sensor => "cut the power of the arm's drive",
        Role::Display | Role::Host => "press the emergency stop",
    });
    each.collect::<Vec<_>>().join(" and ")
}

/// Words for boards that have not stopped, and what to do about them.
pub fn not_stopped(boards: &[Role], why: &str) -> String {
    let names: Vec<&str> = boards.iter().map(|role| role.name()).collect();
    let names = names.join(" and ");
    format!("NOT STOPPED: {names}: {why}: {}", by_hand(boards))
}

impl Shared {
    fn counters(&self) -> PortCounters {
        match &*locked(&self.line) {
            Some(line) => line.counters(),
            None => *locked(&self.counters),
        }
    }

    fn stop(&self, stop: Stop) -> Result<(), NotSent> {
        *locked(&self.stop) = Some((stop, self.now_us()));
        self.post(&Message::Stop(stop))
    }

    /// A Stop that is to be said again.
    fn stop_due(&self, at_us: u64) -> Option<Message> {
        let mut pending = locked(&self.stop);
        let (stop, said_us) = pending.as_mut()?;
        if at_us.saturating_sub(*said_us) < STOP_AGAIN_US {
            return None;
        }
        *said_us = at_us;
        Some(Message::Stop(*stop))
    }

    fn post(&self, message: &Message) -> Result<(), NotSent> {
        locked(&self.line)
            .as_mut()
            .ok_or(NotSent::NotKnown)?
            .say(message)
    }

    fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }

    fn now_us(&self) -> u64 {
        self.system.clock.now_us()
    }

    /// Waits for [`RETRY`], or until the link ends.
    fn rest(&self) {
        self.woken
            .wait_until(self.now_us().saturating_add(micros(RETRY)));
    }
}

struct Reader<F> {
    shared: Arc<Shared>,
    search: Search,
    /// What is looked for, in words.
    wanted: String,
    tell: F,
    told: Option<State>,
    /// Kept while the board is away: it may have lost its power with its cable.
    clock: BoardClock,
}

impl<F: FnMut(Event)> Reader<F> {
    fn run(mut self) {
        while !self.shared.is_ended() {
            let Candidates { ports, choosy } = self.search.candidates(&*self.shared.system.ports);
            let mut found = self.absent();
            for port in ports {
                let state = match self.shared.system.ports.open(&port) {
                    Ok(opened) => self.converse(&port, opened, choosy),
                    Err(state) => state,
                };
                if self.shared.is_ended() {
                    return;
                }
                if state.weight() > found.weight() {
                    found = state;
                }
            }
            self.set_state(found);
            self.shared.rest();
        }
    }

    /// Talks until the line is lost, or leads nowhere that was wanted although there is a choice; returns
    /// how it stood then. Where there is a choice, only a board that was found is told of.
    fn converse(&mut self, path: &Path, opened: Opened, choosy: bool) -> State {
        let Opened { mut input, output } = opened;
        let mut line_monitor =
            LineMonitor::new(self.shared.now_us(), self.search.patience_us(path));
        locked(&self.shared.clock).clear();
        *locked(&self.shared.line) = Some(Line::new(output));
        if let Some((_, said_us)) = locked(&self.shared.stop).as_mut() {
            // Nobody can have heard it on this line.
            *said_us = 0;
        }
        let mut bytes = vec![0; READ_BYTES];
        let mut messages = Vec::new();
        let mut handovers = Handovers::default();
        *locked(&self.shared.missed) = Missed::default();
        let mut end = None;
        while !self.shared.is_ended() && end.is_none() {
            let count = match input.read(&mut bytes) {
                Ok(0) => break,
                Ok(count) => count,
                Err(error) if is_pause(&error) => 0,
                Err(_) => break,
            };
            let at_us = self.shared.now_us();
            if let Some(line) = &*locked(&self.shared.line) {
                handovers.begin(input.changes(), &line.counters());
            }
            let state = self.hear(
                path,
                &mut line_monitor,
                &bytes[..count],
                at_us,
                &mut messages,
            );
            if let Some(line) = &*locked(&self.shared.line) {
                *locked(&self.shared.missed) = handovers.missed(&line.counters());
            }
            match &state {
                State::Known { .. } => self.search.remember(path, true),
                State::Opened { .. } => {}
                _ if choosy => {
                    self.search.remember(path, false);
                    end = Some(state.clone());
                }
                _ => {}
            }
            let is_known = state.is_known();
            // Of several ports, that behind which another board is, ends no Stop.
            let is_wanted = !choosy || state.is_of(self.shared.role);
            if !choosy || is_known {
                self.set_state(state);
            }
            for message in messages.drain(..) {
                // What another board says is nobody's business here, but that it has stopped.
                if let Message::Stopped(_) = message
                    && is_wanted
                {
                    locked(&self.shared.stop).take();
                    (self.tell)(Event::Heard { at_us, message });
                } else if is_known {
                    self.pass(&mut line_monitor, at_us, message);
                }
            }
        }
        let line = locked(&self.shared.line).take();
        if let Some(line) = line {
            *locked(&self.shared.counters) = line.counters();
            input.close(line.is_stuck());
        }
        let end = end.unwrap_or_else(|| self.absent());
        let told_of = !choosy || self.told.as_ref().is_some_and(State::is_known);
        if told_of && !self.shared.is_ended() {
            self.set_state(end.clone());
        }
        end
    }

    /// Runs the protocol on what came, says what is due, and judges how the link stands.
    fn hear(
        &self,
        path: &Path,
        line_monitor: &mut LineMonitor,
        bytes: &[u8],
        at_us: u64,
        messages: &mut Vec<Message>,
    ) -> State {
        let mut line = locked(&self.shared.line);
        let Some(line) = line.as_mut() else {
            return self.absent();
        };
        line_monitor.hear(at_us, bytes);
        line.port
            .receive(at_us, bytes, |message| messages.push(message));
        let peer = line.port.peer();
        line_monitor.understand(at_us, &line.counters());
        let state = self.state(path, line_monitor.judge(at_us, peer));
        line.is_known = state.is_known();
        // One that has fallen silent is asked as well: its console speaks frames for as long as it hears some.
        if matches!(peer, Peer::Known(_)) && line_monitor.ping_due(at_us) {
            line.queue(&Message::Ping(Ping { sent_us: at_us }));
        }
        if let Some(stop) = self.shared.stop_due(at_us) {
            line.queue(&stop);
        }
        // What a stuck line refuses is counted, and said again when it is due again.
        let _ = line.flush();
        state
    }

    /// The verdict on a line in words.
    fn state(&self, path: &Path, verdict: Verdict) -> State {
        let port = path.to_owned();
        match verdict {
            Verdict::Open => State::Opened(port),
            // A Hello's role stands where it stood in every version.
            Verdict::Known(hello) | Verdict::Foreign(hello)
                if hello.role != self.shared.role.byte() =>
            {
                State::Stranger {
                    port,
                    hello: hello.asking(false),
                    wanted: self.shared.role,
                }
            }
            // Whether it asks in return does not make another board of it.
            Verdict::Known(hello) => State::Known(port, hello.asking(false)),
            Verdict::Foreign(hello) => State::Foreign(port, hello.asking(false)),
            Verdict::Silent => State::Silent(port),
            Verdict::Deaf => State::Deaf(port),
            Verdict::Garbage => State::Garbage(port),
        }
    }

    fn absent(&self) -> State {
        State::Absent(self.wanted.clone())
    }

    fn pass(&mut self, line_monitor: &mut LineMonitor, at_us: u64, message: Message) {
        if self.clock.is_restart(&message) {
            locked(&self.shared.clock).clear();
            line_monitor.forget_ping();
            (self.tell)(Event::Restarted);
        }
        if let Message::Pong(pong) = &message {
            let line = locked(&self.shared.line);
            let is_ours = line
                .as_ref()
                .is_some_and(|line| line.is_answer(pong.sent_us));
            drop(line);
            if !is_ours {
                return;
            }
            locked(&self.shared.clock).on_pong(pong, at_us);
        }
        (self.tell)(Event::Heard { at_us, message });
    }

    /// Tells of a state that differs from the last one.
    fn set_state(&mut self, state: State) {
        if self.told.as_ref() == Some(&state) {
            return;
        }
        *locked(&self.shared.state) = state.clone();
        self.told = Some(state.clone());
        (self.tell)(Event::StateChanged(state));
    }
}

/// Whether a read only had nothing to give yet.
pub(crate) fn is_pause(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
    )
}
