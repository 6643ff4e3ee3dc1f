//! How signals end the program.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

/// What asks for an end.
pub const USUAL: [i32; 2] = [SIGINT, SIGTERM];
/// And the terminal that goes away.
pub const OF_A_TERMINAL: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// What a second signal does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Again {
    /// Nothing: what is under way is ended as it should be.
    IsIgnored,
    /// It ends the program at once, whatever that does.
    EndsAtOnce,
}

/// A flag that the first of these signals sets.
///
/// # Errors
/// If the system does not let one listen to signals.
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
