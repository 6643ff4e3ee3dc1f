//! Pseudo-terminals that no program inherits: one that held a board's end could never see its cable pulled.

use serialport::TTYPort;

/// A pseudo-terminal for bytes: the end of who made it, and the end to be opened by name.
///
/// # Panics
/// If the system has none.
pub fn pair() -> (TTYPort, TTYPort) {
    let (near, far) = TTYPort::pair().expect("the system has pseudo-terminals");
    // A copy is closed when a program starts; the pair is not.
    let copy = |end: &TTYPort| end.try_clone_native().expect("an end can be copied");
    (copy(&near), copy(&far))
}
