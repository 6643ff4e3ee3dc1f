//! Bridges that relay, each in a process of its own, and the boards at their consoles.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::Duration;

use host_bridge::lock::locked;
use protocol::{Contact, Estimate, GaugeHealth, Hello, Message, Motion, Range, Role};
use rustix::process::{Pid, Signal, kill_process};

use crate::bridge;
use crate::fake_board::{FakeBoard, Script, wait_by, wait_until};
use crate::virtual_ports::VirtualBench;

/// Between two motions of a display, in µs.
pub const MOTION_US: u64 = 2_000;
/// Between two estimates of a sensor, in µs.
pub const ESTIMATE_US: u64 = 10_000;

/// Lines that a program says, as they come.
#[derive(Clone, Default)]
struct Lines {
    said: Arc<Mutex<Vec<String>>>,
    ended: Arc<AtomicBool>,
}

impl Lines {
    fn of(pipe: Option<impl Read + Send + 'static>) -> Self {
        let lines = Self::default();
        let written = lines.clone();
        if let Some(pipe) = pipe {
            thread::spawn(move || {
                for line in BufReader::new(pipe).lines().map_while(Result::ok) {
                    written.all().push(line);
                }
                written.ended.store(true, Ordering::Release);
            });
        }
        lines
    }

    fn all(&self) -> MutexGuard<'_, Vec<String>> {
        locked(&self.said)
    }

    /// Whether nothing more comes.
    fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }
}

/// A `host-bridge relay` that runs. Dropping it kills it; where a test fails, what it said is told.
pub struct Relay {
    child: Child,
    stdout: Lines,
    stderr: Lines,
}

impl Relay {
    /// Starts `host-bridge relay` with `arguments`.
    ///
    /// # Panics
    /// If it can't be started.
    pub fn start<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Self {
        let mut child = bridge::command()
            .arg("relay")
            .args(arguments)
            .spawn()
            .expect("the program can be started");
        Self {
            stdout: Lines::of(child.stdout.take()),
            stderr: Lines::of(child.stderr.take()),
            child,
        }
    }

    /// The bridge at the site of the board of `role`, whose console is `port`, with its statistics in JSON.
    pub fn bridge(role: Role, port: &Path, more: &[&str]) -> Self {
        let board = format!("--{}", role.name());
        let port = port.display().to_string();
        let arguments = [role.name(), &board, &port, "--json"];
        Self::start(arguments.into_iter().chain(more.iter().copied()))
    }

    /// The same, with one end and the options for its certificate.
    pub fn bridge_with(role: Role, port: &Path, end: [&str; 2], proofs: &[String]) -> Self {
        let more = end.into_iter().chain(proofs.iter().map(String::as_str));
        Self::bridge(role, port, &more.collect::<Vec<_>>())
    }

    /// What it has said on standard error so far.
    pub fn words(&self) -> String {
        self.stderr.all().join("\n")
    }

    /// What it has printed so far.
    pub fn lines(&self) -> Vec<String> {
        self.stdout.all().clone()
    }

    /// Waits until it says `part` on standard error.
    ///
    /// # Panics
    /// If it does not within `limit`.
    pub fn says(&self, part: &str, limit: Duration) {
        let says = || self.stderr.all().iter().any(|line| line.contains(part));
        assert!(
            wait_until(limit, says),
            "{part:?} is not said: {}",
            self.words()
        );
    }

    /// The names of its threads.
    ///
    /// # Panics
    /// If it has ended.
    pub fn threads(&self) -> Vec<String> {
        let tasks = fs::read_dir(format!("/proc/{}/task", self.child.id())).expect("it runs");
        let names =
            tasks.filter_map(|task| fs::read_to_string(task.ok()?.path().join("comm")).ok());
        names.collect()
    }

    /// Sends it a signal.
    ///
    /// # Panics
    /// If it has ended.
    pub fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        kill_process(id.expect("a process has a number"), signal).expect("it runs");
    }

    /// Kills it without a chance to say good-bye.
    pub fn kill(mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Waits for its end: how it ended, and what it printed.
    ///
    /// # Panics
    /// If it has not ended within `limit`.
    pub fn wait(mut self, limit: Duration) -> (ExitStatus, Vec<String>, String) {
        let mut status = None;
        let ended = wait_until(limit, || {
            status = self.child.try_wait().expect("a child can be waited for");
            status.is_some()
        });
        assert!(ended, "not ended after {limit:?}: {}", self.words());
        // Its pipes are read to the end when nothing more comes.
        wait_until(limit, || self.stdout.is_ended() && self.stderr.is_ended());
        let status = status.expect("it has ended");
        (status, self.lines(), self.words())
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if thread::panicking() {
            let lines = self.lines();
            let last = lines.last().map_or("", String::as_str);
            eprintln!("a relay that ran said:\n{}\n{last}", self.words());
        }
    }
}

/// A port that nobody listens on at the moment.
///
/// # Panics
/// If the system has none.
pub fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("the system has ports");
    let address = listener.local_addr().expect("a port has an address");
    address.port()
}

/// Motion number `sequence`, made at `instant_us`.
pub fn motion(sequence: u32, instant_us: u64) -> Message {
    Message::Motion(Motion {
        sequence,
        instant_us,
        position_um: i64::from(sequence) * 5,
        velocity_um_s: 2_500,
    })
}

/// Estimate number `sequence`, made at `instant_us`.
pub fn estimate(sequence: u32, instant_us: u64) -> Message {
    Message::Estimate(Estimate {
        sequence,
        instant_us,
        wavelength_mm: Some(2.0),
        valid: true,
        confidence: 0.9,
        amplitude_lsb: 300.0,
        counted_mm: Some(2.1),
        range: Range::T1,
        contact: Contact::Slip,
        velocity_um_s: 2_500,
        lag_um: None,
        gauges_used: 0x1f,
        health: [GaugeHealth::Good; 5],
    })
}

/// A board that says what the board of `role` always says, at its pace, numbered from 0.
pub fn talking_board(role: Role) -> FakeBoard {
    FakeBoard::acting(hello(role), script(role))
}

/// The same on a line of `bench`.
pub fn talking_board_on(bench: &VirtualBench, role: Role) -> FakeBoard {
    FakeBoard::acting_on(bench, hello(role), script(role))
}

/// What a board of `role` says of itself.
pub const fn hello(role: Role) -> Hello {
    Hello::new(role, "stm32f429zi", [0, 1, 0])
}

fn script(role: Role) -> Script {
    let mut next = 0_u32;
    let (period_us, make): (u64, fn(u32, u64) -> Message) = match role {
        Role::Sensor => (ESTIMATE_US, estimate),
        _ => (MOTION_US, motion),
    };
    Box::new(move |now_us| {
        let mut said = Vec::new();
        while u64::from(next) * period_us < now_us {
            said.push(make(next, now_us));
            next += 1;
        }
        said
    })
}

/// The board's own numbers of the estimates or motions among `messages`, in the order in which they came.
pub fn sequences(messages: &[Message]) -> Vec<u32> {
    messages
        .iter()
        .filter_map(|message| match message {
            Message::Estimate(estimate) => Some(estimate.sequence),
            Message::Motion(motion) => Some(motion.sequence),
            _ => None,
        })
        .collect()
}

/// Listens to `board` until `enough` holds for all that it has heard.
///
/// # Panics
/// If it does not within `limit`.
pub fn listen(
    board: &FakeBoard,
    limit: Duration,
    mut enough: impl FnMut(&[Message]) -> bool,
) -> Vec<Message> {
    let mut heard = Vec::new();
    let came = wait_by(board, limit, || {
        heard.extend(board.take_heard());
        enough(&heard)
    });
    assert!(came, "not enough after {limit:?}: {} heard", heard.len());
    heard
}
