//! A command of `host-bridge` at a bench in memory, by virtual time, on a thread of its own.

use std::io::{self, Cursor, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use host_bridge::Desk;
use host_bridge::clock::Clock;
use host_bridge::lock::locked;

use crate::virtual_ports::VirtualBench;

/// What a command left behind.
#[derive(Clone, Debug, Default)]
pub struct Ended {
    /// Its exit status; none if it could not be done, as `output` says.
    pub status: Option<u8>,
    /// What it printed.
    pub output: String,
}

/// A command that runs.
pub struct Running {
    bench: VirtualBench,
    thread: JoinHandle<()>,
    interrupted: Arc<AtomicBool>,
    left: Arc<Mutex<Ended>>,
}

impl VirtualBench {
    /// Begins the command of these words, which reads `input`.
    pub fn start(&self, words: &[&str], input: &str) -> Running {
        let interrupted = Arc::<AtomicBool>::default();
        let left = Arc::<Mutex<Ended>>::default();
        let words: Vec<String> = ["host-bridge"]
            .iter()
            .chain(words)
            .map(|&word| word.to_owned())
            .collect();
        let (system, input) = (self.system(), Cursor::new(input.to_owned()));
        let (ended, leaves) = (Arc::clone(&interrupted), Arc::clone(&left));
        let thread = self.clock.spawn(Box::new(move || {
            let mut desk = Desk {
                system,
                input: Box::new(input),
                output: Box::new(Paper(Arc::clone(&leaves))),
                ended,
            };
            match host_bridge::run_at(&mut desk, words) {
                Ok(status) => locked(&leaves).status = Some(status),
                Err(error) => locked(&leaves).output += &format!("{error:#}"),
            }
        }));
        Running {
            bench: self.clone(),
            thread,
            interrupted,
            left,
        }
    }
}

impl Running {
    /// Interrupts it, and waits for its end.
    pub fn interrupt(self) -> Ended {
        self.interrupted.store(true, Ordering::Release);
        self.wait()
    }

    /// Waits for its end.
    pub fn wait(self) -> Ended {
        self.bench.clock.join(self.thread);
        locked(&self.left).clone()
    }
}

/// What is printed on.
struct Paper(Arc<Mutex<Ended>>);

impl Write for Paper {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        locked(&self.0).output += &String::from_utf8_lossy(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
