//! How signals end the program.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::link::{Link, stop_all};
use crate::shared_port::claim::is_needed;
use protocol::Role;
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGUSR1};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

use super::output::say;

/// What asks for an end; a terminal that goes away does.
pub const USUAL: [i32; 4] = [SIGINT, SIGTERM, SIGHUP, SIGQUIT];

/// SIGUSR1, or another signal that asks for something. A command listens before it does anything that may take its
/// time: until then the signal ends the program, and afterwards it is kept until somebody can obey.
pub struct Orders(Signals);

impl Orders {
    /// Listens for Stops. Fails if the system does not let one listen to signals.
    pub fn to_stop() -> io::Result<Self> {
        Self::of(SIGUSR1)
    }

    /// Listens for `signal`. Fails if the system does not let one listen to signals.
    pub fn of(signal: i32) -> io::Result<Self> {
        Signals::new([signal]).map(Self)
    }

    /// Has them stop the boards, and call `before` right before.
    pub fn stop_boards(self, links: &[(Role, Link)], before: impl Fn() + Send + 'static) {
        let boards: Vec<_> = links.iter().map(|(_, link)| link.sender()).collect();
        self.obey(move || {
            before();
            stop_all(&boards);
        });
    }

    /// Has them call `act`, by a thread that waits for nothing else.
    pub fn obey(mut self, act: impl Fn() + Send + 'static) {
        std::thread::spawn(move || self.0.forever().for_each(|_| act()));
    }
}

/// Has Ctrl-Z halt this program only while no other one hears a board through it. Fails if the system does not let one listen
/// to signals.
pub fn guard_halt() -> io::Result<()> {
    let mut halts = Signals::new([SIGTSTP])?;
    std::thread::spawn(move || {
        for signal in halts.forever() {
            if is_needed() {
                say(
                    "Ctrl-Z does not halt it: other programs hear the boards through it. Ctrl-C ends it.",
                );
            } else {
                // Nobody is harmed if it goes on.
                let _ = emulate_default_handler(signal);
            }
        }
    });
    Ok(())
}

/// What a second signal does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Again {
    /// Nothing: what is under way is ended as it should be.
    IsIgnored,
    /// It ends the program at once, whatever that does.
    EndsAtOnce,
}

/// A flag that the first of these signals sets. Fails if the system does not let one listen to signals.
pub fn flag_set_by(signals: &[i32], again: Again) -> io::Result<Arc<AtomicBool>> {
    let ended = Arc::new(AtomicBool::new(false));
    for &signal in signals {
        if again == Again::EndsAtOnce {
            flag::register_conditional_shutdown(signal, 130, Arc::clone(&ended))?;
        }
        flag::register(signal, Arc::clone(&ended))?;
    }
    Ok(ended)
}

/// A wait for the first of these signals; the second one ends the program at once. Fails if the system does not let
/// one listen to signals.
pub fn wait_for(signals: &[i32]) -> io::Result<impl FnOnce()> {
    let mut first = Signals::new(signals)?;
    flag_set_by(signals, Again::EndsAtOnce)?;
    Ok(move || {
        first.forever().next();
    })
}
