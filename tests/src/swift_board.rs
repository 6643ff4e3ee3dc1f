//! A board that reads as soon as bytes come, and shares its clock with this program: for measurements.

use std::io::{self, Read, Write};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use host_bridge::clock::now_us;
use protocol::{Hello, MAX_FRAME, Message, Port, Role};

use crate::pty::Near;
use crate::relay::{ESTIMATE_US, MOTION_US, estimate, motion};

/// Longest wait for bytes, and how late an estimate or a motion may be.
const PATIENCE: Duration = Duration::from_millis(1);

/// A board on a pseudo-terminal that says what the board of its role always says, at its pace, with the
/// instant of [`now_us`] in it at which it is written. Dropping it ends it, so that it takes nothing from
/// what is measured next.
pub struct SwiftBoard {
    /// Its port.
    pub path: PathBuf,
    is_ended: Arc<AtomicBool>,
    line: Option<JoinHandle<()>>,
    _kept: OwnedFd,
}

impl SwiftBoard {
    /// A board of `role`. `hear` is called with what it hears, and when, in µs of [`now_us`].
    ///
    /// # Errors
    /// If the system has no pseudo-terminal.
    pub fn new(role: Role, hear: impl FnMut(Message, u64) + Send + 'static) -> io::Result<Self> {
        let (near, kept, path) = Near::pair(PATIENCE)?;
        let is_ended = Arc::<AtomicBool>::default();
        let ends = Arc::clone(&is_ended);
        let line = thread::spawn(move || run(near, role, hear, &ends));
        Ok(Self {
            path,
            is_ended,
            line: Some(line),
            _kept: kept,
        })
    }
}

impl Drop for SwiftBoard {
    fn drop(&mut self) {
        self.is_ended.store(true, Ordering::Relaxed);
        if let Some(line) = self.line.take() {
            // One that panicked has said so on standard error.
            let _ = line.join();
        }
    }
}

fn run(mut near: Near, role: Role, mut hear: impl FnMut(Message, u64), ends: &AtomicBool) {
    let mut port = Port::new(Hello::new(role, "stm32f429zi", [0, 1, 0]));
    let mut bytes = [0; 4_096];
    let mut frame = [0; MAX_FRAME];
    let (period_us, make): (u64, fn(u32, u64) -> Message) = match role {
        Role::Sensor => (ESTIMATE_US, estimate),
        _ => (MOTION_US, motion),
    };
    let (began_us, mut said) = (now_us(), 0_u32);
    while !ends.load(Ordering::Relaxed) {
        let count = near.read(&mut bytes).unwrap_or(0);
        let read_us = now_us();
        port.receive(read_us, &bytes[..count], |message| hear(message, read_us));
        while began_us + u64::from(said) * period_us < now_us() {
            port.post(&make(said, now_us()));
            said += 1;
        }
        while let count @ 1.. = port.take(&mut frame) {
            if near.write_all(&frame[..count]).is_err() {
                // Nobody reads: the bytes are lost, as on a wire.
                break;
            }
        }
    }
}
