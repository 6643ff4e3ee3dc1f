//! `host-bridge record`: everything that the boards say is in the file, and what was said to be safe stays
//! so, whatever happens to the program, the disk and the boards.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use host_bridge::clock::SystemClock;
use host_bridge::recording::Entry;
use host_bridge::recording::reader::Reader;
use host_bridge::replay::{Pace, play};
use protocol::{Message, Ping, Role};
use tests::bridge::{Ended, Running};
use tests::fake_board::{FakeBoard, wait_until};

mod boards;
mod disk;
mod said;

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

/// An empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("bridge_record")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// Two boards that lose nothing, and what they have heard.
struct Pair {
    sensor: FakeBoard,
    display: FakeBoard,
    pings: u64,
}

impl Pair {
    fn new() -> Self {
        let board = |role| {
            let board = FakeBoard::new(role);
            board.lose_nothing();
            board
        };
        Self {
            sensor: board(Role::Sensor),
            display: board(Role::Display),
            pings: 0,
        }
    }

    fn board(&self, role: Role) -> &FakeBoard {
        match role {
            Role::Display => &self.display,
            Role::Sensor | Role::Host => &self.sensor,
        }
    }

    /// Starts the program on these boards; `words` are the rest of its command line.
    fn record(&self, command: &mut Command, words: &[&str]) -> Running {
        command.arg("record").args(words);
        command.arg("--sensor").arg(self.sensor.path());
        command.arg("--display").arg(self.display.path());
        Running::start(command)
    }

    /// Waits until both boards have been asked for their configuration: they are known.
    fn wait_for_questions(&self) {
        for role in [Role::Sensor, Role::Display] {
            let board = self.board(role);
            let asked = || {
                let heard = board.take_heard();
                heard
                    .iter()
                    .any(|message| matches!(message, Message::Question(_)))
            };
            assert!(wait_until(LIMIT, asked), "the {} is not asked", role.name());
        }
    }

    /// Waits until a program answers, however much is lost until then. It answers in order: whoever does has heard
    /// everything that was said to it before.
    fn wait_until_heard(&mut self) {
        for role in [Role::Sensor, Role::Display] {
            self.pings += 1;
            let sent_us = self.pings;
            let board = self.board(role);
            let answered = || {
                board.say(Message::Ping(Ping { sent_us }));
                board.take_heard().iter().any(
                    |message| matches!(message, Message::Pong(pong) if pong.sent_us == sent_us),
                )
            };
            assert!(
                wait_until(LIMIT, answered),
                "the {} is not answered",
                role.name()
            );
        }
    }

    /// Waits until two programs answer the same question: a guest may speak before it is heard of as one who listens.
    fn wait_until_both_hear(&mut self) {
        for role in [Role::Sensor, Role::Display] {
            let board = self.board(role);
            let before = self.pings;
            let mut sent_us = before;
            let mut answers = BTreeMap::new();
            let both = || {
                sent_us += 1;
                board.say(Message::Ping(Ping { sent_us }));
                for message in board.take_heard() {
                    // Earlier questions were asked more than once.
                    if let Message::Pong(pong) = message
                        && pong.sent_us > before
                    {
                        *answers.entry(pong.sent_us).or_insert(0) += 1;
                    }
                }
                answers.values().any(|&count| count == 2)
            };
            assert!(
                wait_until(LIMIT, both),
                "two do not answer the {}",
                role.name()
            );
            self.pings = sent_us;
        }
    }
}

fn signal(running: &Running, name: &str) {
    let sent = Command::new("kill")
        .args([name, &running.child.id().to_string()])
        .status();
    assert!(
        sent.is_ok_and(|status| status.success()),
        "{name} can be sent"
    );
}

/// Everything in a file, and whether it was cut off.
fn entries(path: &Path) -> (Vec<Entry>, bool) {
    let mut reader = Reader::open(path).unwrap_or_else(|error| panic!("{error}"));
    let mut entries = Vec::new();
    while let Some(entry) = reader
        .next_entry()
        .unwrap_or_else(|error| panic!("{error}"))
    {
        entries.push(entry);
    }
    (entries, reader.is_cut())
}

/// The messages in a file, without the answers to the program's own pings.
fn messages(path: &Path) -> Vec<(Role, Message)> {
    let mut messages = Vec::new();
    let recording = Reader::open(path).unwrap_or_else(|error| panic!("{error}"));
    let pace = Pace {
        speed: 100.0,
        ..Pace::default()
    };
    let ended = AtomicBool::new(false);
    play(&SystemClock, recording, &pace, &ended, |role, event| {
        if let host_bridge::link::Event::Heard { message, .. } = event {
            messages.push((role, message));
        }
    })
    .unwrap_or_else(|error| panic!("{error}"));
    messages.retain(|(_, message)| !matches!(message, Message::Pong(_)));
    messages
}

fn of(role: Role, messages: &[(Role, Message)]) -> Vec<&Message> {
    let of = messages.iter().filter(|(said, _)| *said == role);
    of.map(|(_, message)| message).collect()
}

fn succeeded(ended: &Ended) {
    assert_eq!(
        ended.status.code(),
        Some(0),
        "{}{}",
        ended.stdout,
        ended.stderr
    );
}
