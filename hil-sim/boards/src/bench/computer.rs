//! What a bench stands in by default: this computer.

use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use protocol::Role;

use super::pace::Pacer;
use super::pty::Pty;
use super::socket::BAUD;
use super::surroundings::{Line, Surroundings};
use super::{PortName, lock};

/// This computer's clock and pseudo-terminals.
#[derive(Debug)]
pub struct Computer(Mutex<Pacer>);

impl Computer {
    /// A bench that goes by the clock as `pacer` has it.
    pub fn new(pacer: Pacer) -> Self {
        Self(Mutex::new(pacer))
    }
}

impl Surroundings for Computer {
    /// One board waits for the clock, and the other, with which it exchanges bytes, for it.
    fn wait(&self, role: Role, now_ns: u64) -> Duration {
        match role {
            Role::Display => lock(&self.0).wait(now_ns),
            _ => Duration::ZERO,
        }
    }

    fn cable(&self, _name: PortName) -> io::Result<Arc<dyn Line>> {
        Ok(Arc::new(Pty::new(BAUD)?))
    }
}
