//! How signals end the program.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::link::{Link, stop_all};
use protocol::Role;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::flag;
use signal_hook::iterator::Signals;

/// What asks for an end; a terminal that goes away does.
pub const USUAL: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// Has SIGUSR1 stop the boards, and call `before` right before. Fails if the system does not let one listen to signals.
pub fn stop_boards(links: &[(Role, Link)], before: impl Fn() + Send + 'static) -> io::Result<()> {
    let boards: Vec<_> = links.iter().map(|(_, link)| link.sender()).collect();
    on_stop(move || {
        before();
        stop_all(&boards);
    })
}

/// Has SIGUSR1 call `stop`, by a thread that waits for nothing else. Fails if the system does not let one listen to signals.
pub fn on_stop(stop: impl Fn() + Send + 'static) -> io::Result<()> {
    let mut signals = Signals::new([SIGUSR1])?;
    std::thread::spawn(move || signals.forever().for_each(|_| stop()));
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
