//! A terminal with a program in it: a pseudo-terminal whose other end a test holds.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::num::NonZeroU16;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::fake_board::wait_until;
use crate::pty::Near;

/// How long keys may wait.
const LOOK: Duration = Duration::from_millis(10);

const ROWS: NonZeroU16 = NonZeroU16::new(40).unwrap();
const COLUMNS: NonZeroU16 = NonZeroU16::new(120).unwrap();

/// A terminal of 120 × 40 characters.
pub struct Terminal {
    path: PathBuf,
    keys: Sender<String>,
    shown: Arc<Mutex<String>>,
    /// What stands in the window.
    screen: Arc<Mutex<vt100::Parser>>,
    ended: Arc<AtomicBool>,
    stands_still: Arc<AtomicBool>,
    window: JoinHandle<()>,
    /// Keeps the terminal alive while no program has it open.
    _kept: OwnedFd,
}

impl Terminal {
    /// One in which nothing runs yet.
    ///
    /// # Panics
    /// If the system has none.
    pub fn new() -> Self {
        let (window, kept, path) = Near::pair(LOOK).expect("the system has pseudo-terminals");
        let (keys, typed) = channel();
        let (shown, ended) = (
            Arc::<Mutex<String>>::default(),
            Arc::<AtomicBool>::default(),
        );
        let screen = Arc::new(Mutex::new(vt100::Parser::new(ROWS, COLUMNS, 0)));
        let stands_still = Arc::<AtomicBool>::default();
        let (theirs, their_end) = (Arc::clone(&shown), Arc::clone(&ended));
        let takes_none = Arc::clone(&stands_still);
        let drawn = Arc::clone(&screen);
        let terminal = Self {
            path,
            keys,
            shown,
            screen,
            ended,
            stands_still,
            window: thread::spawn(move || {
                run(window, &typed, &theirs, &drawn, &takes_none, &their_end);
            }),
            _kept: kept,
        };
        // As a shell leaves it: the pair was made for bytes, not for people.
        let (rows, columns) = (ROWS.to_string(), COLUMNS.to_string());
        terminal.stty(&["sane", "rows", &rows, "cols", &columns]);
        terminal
    }

    /// Has `command` run in it. `TERM` and `NO_COLOR` are set, so that what is shown is easy to read.
    ///
    /// # Panics
    /// If it can't be opened.
    pub fn hold(&self, command: &mut Command) {
        command
            .env("TERM", "xterm-256color")
            .env("NO_COLOR", "1")
            .stdin(self.end())
            .stdout(self.end())
            .stderr(Stdio::piped());
    }

    fn end(&self) -> File {
        OpenOptions::new()
            .read(true)
            .write(true)
            .open(&self.path)
            .expect("the terminal can be opened")
    }

    /// Types.
    ///
    /// # Panics
    /// If the window is gone.
    pub fn type_keys(&self, keys: &str) {
        self.keys.send(keys.to_owned()).expect("there is a window");
    }

    /// All that was shown so far, with what moves the cursor.
    pub fn shown(&self) -> String {
        self.shown
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// What stands in the window, and the last of what was sent to it, for a message.
    pub fn last_shown(&self) -> String {
        const LONGEST: usize = 3_000;
        let shown = self.shown();
        let characters = shown.chars().count();
        let last: String = shown
            .chars()
            .skip(characters.saturating_sub(LONGEST))
            .collect();
        format!("{}\n---\n{last:?}", self.window())
    }

    /// What stands in the window.
    fn window(&self) -> String {
        let screen = self.screen.lock().unwrap_or_else(PoisonError::into_inner);
        screen.screen().contents()
    }

    /// Waits until `words` stand in a row of the window, or were sent in one piece; whether they were. A
    /// program that writes only what has changed sends words in pieces where others stood before.
    pub fn shows(&self, limit: Duration, words: &str) -> bool {
        wait_until(limit, || {
            self.window().contains(words) || self.shown().contains(words)
        })
    }

    /// Types `keys` until `words` are shown, as a person does whose change has found no answer: on a busy machine
    /// the system itself may pass a board's bytes on later than the 2 s after which a change is given up.
    ///
    /// # Panics
    /// If they are not shown within `limit`.
    pub fn types_until(&self, limit: Duration, keys: &str, words: &str) {
        const PATIENCE: Duration = Duration::from_secs(6);
        let end = Instant::now() + limit;
        while Instant::now() < end {
            self.type_keys(keys);
            if self.shows(PATIENCE, words) {
                return;
            }
        }
        panic!("{words:?} was not shown:\n{}", self.last_shown());
    }

    /// How the terminal is set, as `stty` says it.
    pub fn settings(&self) -> String {
        self.stty(&["-a"])
    }

    /// Has the window take nothing for as long as it stands still: what is shown waits. It passes on keys.
    pub fn stand_still(&self, stands_still: bool) {
        self.stands_still.store(stands_still, Ordering::Release);
    }

    /// Closes the terminal's window.
    pub fn hang_up(self) {
        self.ended.store(true, Ordering::Release);
        let _ = self.window.join();
    }

    fn stty(&self, arguments: &[&str]) -> String {
        let output = Command::new("stty")
            .args(arguments)
            .stdin(self.end())
            .output()
            .expect("stty can be run");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }
}

impl Default for Terminal {
    fn default() -> Self {
        Self::new()
    }
}

/// The window: shows what comes, and passes on what is typed.
fn run(
    mut window: Near,
    typed: &Receiver<String>,
    shown: &Mutex<String>,
    screen: &Mutex<vt100::Parser>,
    stands_still: &AtomicBool,
    ended: &AtomicBool,
) {
    let mut bytes = [0; 4_096];
    while !ended.load(Ordering::Acquire) {
        let read = if stands_still.load(Ordering::Acquire) {
            thread::park_timeout(LOOK);
            Err(ErrorKind::TimedOut.into())
        } else {
            window.read(&mut bytes)
        };
        match read {
            Ok(count) => {
                let mut screen = screen.lock().unwrap_or_else(PoisonError::into_inner);
                screen.process(&bytes[..count]);
                let mut shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
                shown.push_str(&String::from_utf8_lossy(&bytes[..count]));
            }
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            Err(_) => return,
        }
        for keys in typed.try_iter() {
            if window.write_all(keys.as_bytes()).is_err() {
                return;
            }
        }
    }
}
