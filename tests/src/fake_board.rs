//! A board that is not there: the protocol's own port behind a pseudo-terminal or a line in memory, with
//! whatever a test wants said. For the bridge's tests that need no firmware.

use std::any::Any;
use std::io::{self, ErrorKind, Read, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use protocol::{
    Console, DisplayState, Hello, MAX_FRAME, Message, Role, Safety, Stop, StopReason, Stopped,
};

use host_bridge::clock::{Clock, SystemClock};
use host_bridge::lock::locked;

use crate::pty::Near;
use crate::virtual_clock;
use crate::virtual_ports::VirtualBench;

/// Between two lines of text, in µs.
const LINE_US: u64 = 1_000_000;
/// How often the board looks at its line.
const LOOK: Duration = Duration::from_millis(1);

/// What a test has the board do.
enum Order {
    Say(Box<Message>),
    Bytes(Vec<u8>),
    Mute(bool),
    Deafen(bool),
    Miss(bool),
    Disobey(bool),
    Restart,
    UpSince(u64),
    Patience,
    End,
}

/// What a board does by itself: called about once in a ms with the board's clock in µs, it returns what is
/// to be said.
pub type Script = Box<dyn FnMut(u64) -> Vec<Message> + Send>;

/// A board on a line. Dropping it pulls the cable.
pub struct FakeBoard {
    path: PathBuf,
    orders: Sender<Order>,
    heard: Arc<Mutex<Vec<Message>>>,
    clock: Arc<dyn Clock>,
    line: Option<JoinHandle<()>>,
    /// Set when the cable is pulled: a patient write ends.
    pulled: Arc<AtomicBool>,
    /// Keeps the line alive while nobody has it open.
    kept: Option<Box<dyn Any + Send>>,
}

impl FakeBoard {
    /// A board of `role` and of this build.
    pub fn new(role: Role) -> Self {
        Self::saying(Hello::new(role, "stm32f429zi", [0, 1, 0]))
    }

    /// A board that introduces itself with `hello`, whatever it says.
    pub fn saying(hello: Hello) -> Self {
        Self::acting(hello, Box::new(|_| Vec::new()))
    }

    /// A board that introduces itself with `hello` and says by itself what `script` has it say.
    pub fn acting(hello: Hello, script: Script) -> Self {
        let (master, kept, path) = Near::pair(LOOK).expect("the system has pseudo-terminals");
        Self::at(
            master,
            Box::new(kept),
            path,
            Arc::new(SystemClock),
            hello,
            script,
        )
    }

    /// The same on a line of `bench`, by its clock.
    pub fn acting_on(bench: &VirtualBench, hello: Hello, script: Script) -> Self {
        let (path, end) = bench.cable();
        let clock = Arc::new(bench.clock.clone());
        let plug = Box::new(end.plug());
        Self::at(end, plug, path, clock, hello, script)
    }

    /// A board of `role` and of this build on a line of `bench`.
    pub fn on(bench: &VirtualBench, role: Role) -> Self {
        let hello = Hello::new(role, "stm32f429zi", [0, 1, 0]);
        Self::acting_on(bench, hello, Box::new(|_| Vec::new()))
    }

    fn at(
        end: impl Read + Write + Send + 'static,
        kept: Box<dyn Any + Send>,
        path: PathBuf,
        clock: Arc<dyn Clock>,
        hello: Hello,
        script: Script,
    ) -> Self {
        let (orders, given) = channel();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let pulled = Arc::new(AtomicBool::new(false));
        let (hears, own, gone) = (Arc::clone(&heard), Arc::clone(&clock), Arc::clone(&pulled));
        let line = clock.spawn(Box::new(move || {
            run(end, &*own, hello, script, &given, &hears, &gone);
        }));
        Self {
            path,
            orders,
            heard,
            clock,
            line: Some(line),
            pulled,
            kept: Some(kept),
        }
    }

    /// The clock that it goes by.
    pub fn clock(&self) -> &dyn Clock {
        &*self.clock
    }

    /// The port to open.
    pub fn path(&self) -> &PathBuf {
        &self.path
    }

    /// Has the board say `message`, if somebody has said Hello.
    pub fn say(&self, message: Message) {
        let _ = self.orders.send(Order::Say(Box::new(message)));
    }

    /// Puts bytes on the line as they are.
    pub fn send_bytes(&self, bytes: &[u8]) {
        let _ = self.orders.send(Order::Bytes(bytes.to_vec()));
    }

    /// Has the board say nothing at all for as long as it is mute; it hears.
    pub fn mute(&self, is_mute: bool) {
        let _ = self.orders.send(Order::Mute(is_mute));
    }

    /// Has the board take no bytes from the line for as long as it is deaf, so that the line fills up.
    pub fn deafen(&self, is_deaf: bool) {
        let _ = self.orders.send(Order::Deafen(is_deaf));
    }

    /// Has all that is said to the board be lost on its way, for as long as it misses it.
    pub fn miss(&self, misses: bool) {
        let _ = self.orders.send(Order::Miss(misses));
    }

    /// Has the board take no notice of a Stop, for as long as it disobeys; it obeys otherwise, and says so.
    pub fn disobey(&self, disobeys: bool) {
        let _ = self.orders.send(Order::Disobey(disobeys));
    }

    /// Restarts the board: its clock, its counters and whom it knows.
    pub fn restart(&self) {
        let _ = self.orders.send(Order::Restart);
    }

    /// Has the board be up since `at_us` of [`clock`](Self::clock): it is one that was there before, and returns. To be
    /// said before anybody hears of it.
    pub fn be_up_since(&self, at_us: u64) {
        let _ = self.orders.send(Order::UpSince(at_us));
    }

    /// Has the board wait from now on for whoever reads its line slowly, instead of losing what finds no room.
    pub fn lose_nothing(&self) {
        let _ = self.orders.send(Order::Patience);
    }

    /// What the board has heard so far; the list is emptied.
    pub fn take_heard(&self) -> Vec<Message> {
        std::mem::take(&mut locked(&self.heard))
    }
}

impl Drop for FakeBoard {
    fn drop(&mut self) {
        let _ = self.orders.send(Order::End);
        // A patient write would wait for ever for a reader who will not come: a pseudo-terminal that nobody has
        // open is full, or takes nothing, and says no more.
        self.pulled.store(true, Ordering::Relaxed);
        self.kept = None;
        if let Some(line) = self.line.take() {
            self.clock.join(line);
        }
    }
}

fn run(
    mut master: impl Read + Write,
    clock: &dyn Clock,
    hello: Hello,
    mut script: Script,
    given: &Receiver<Order>,
    heard: &Mutex<Vec<Message>>,
    pulled: &AtomicBool,
) {
    let mut started_us = clock.now_us();
    let pause = clock.notify();
    // As at a board: text for a person until a program says Hello.
    let mut console = Console::new(hello);
    let mut line_us = 0;
    let (mut is_mute, mut is_deaf, mut misses, mut is_patient) = (false, false, false, false);
    let is_display = hello.role == Role::Display.byte();
    let mut obeys = true;
    let mut bytes = [0; 4_096];
    let mut out = [0; MAX_FRAME];
    loop {
        let count = if is_deaf {
            pause.wait_until(clock.now_us() + 1_000);
            0
        } else {
            match master.read(&mut bytes) {
                Ok(_) if misses => 0,
                Ok(count) => count,
                Err(error) if is_pause(&error) => 0,
                Err(_) => return,
            }
        };
        let now_us = clock.now_us() - started_us;
        let mut stop = None;
        console.port().receive(now_us, &bytes[..count], |message| {
            if let Message::Stop(Stop { reason }) = message {
                stop = Some(reason);
            }
            locked(heard).push(message);
        });
        let stop = stop.filter(|_| obeys);
        let state = stop.filter(|_| is_display);
        let state = state.map(|reason| safety(now_us, reason));
        let answer = stop.map(|reason| Message::Stopped(Stopped::by(reason.trip())));
        let mut said = script(now_us).into_iter().chain(state).chain(answer);
        console.poll(now_us);
        if now_us >= line_us {
            line_us = now_us + LINE_US;
            console.say("a fake board: ? for help");
        }
        loop {
            while let count @ 1.. = console.port().take(&mut out) {
                if !is_mute && !write(&mut master, &out[..count], is_patient, pulled) {
                    // Nobody reads: the bytes are lost, as on a wire.
                    break;
                }
            }
            if let Some(message) = said.next() {
                console.port().post(&message);
                continue;
            }
            match given.try_recv() {
                Ok(Order::Say(message)) => console.port().post(&message),
                Ok(Order::Bytes(bytes)) => {
                    let _ = master.write_all(&bytes);
                }
                Ok(Order::Mute(now)) => is_mute = now,
                Ok(Order::Deafen(now)) => is_deaf = now,
                Ok(Order::Miss(now)) => misses = now,
                Ok(Order::Disobey(now)) => obeys = !now,
                Ok(Order::UpSince(at_us)) => started_us = at_us,
                Ok(Order::Patience) => is_patient = true,
                Ok(Order::Restart) => {
                    console = Console::new(hello);
                    line_us = 0;
                    started_us = clock.now_us();
                }
                Ok(Order::End) => return,
                Err(_) => break,
            }
        }
    }
}

/// What a display says at `instant_us` when it has obeyed a Stop.
const fn safety(instant_us: u64, reason: StopReason) -> Message {
    let state = DisplayState::Stopped(reason.trip());
    Message::Safety(Safety { instant_us, state })
}

/// Writes all of it; false if it found no room, in spite of all patience.
fn write(master: &mut impl Write, mut bytes: &[u8], is_patient: bool, pulled: &AtomicBool) -> bool {
    if !is_patient {
        return master.write_all(bytes).is_ok();
    }
    while !bytes.is_empty() {
        if pulled.load(Ordering::Relaxed) {
            return false;
        }
        match master.write(bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(error) if is_pause(&error) => {}
            Err(_) => return false,
        }
    }
    true
}

fn is_pause(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock)
}

/// Waits by the clock of `board` until `holds`, for at most `limit`; whether it did.
pub fn wait_by(board: &FakeBoard, limit: Duration, holds: impl FnMut() -> bool) -> bool {
    virtual_clock::wait_until(board.clock(), limit, holds)
}

/// Waits until `holds`, for at most `limit`; whether it did.
pub fn wait_until(limit: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let end = Instant::now() + limit;
    while !holds() {
        if Instant::now() >= end {
            return false;
        }
        thread::park_timeout(LOOK);
    }
    true
}
