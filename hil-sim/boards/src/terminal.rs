//! The far end of the consoles, for who wants to sit there.

use super::nucleo::{CONSOLE_UART, Nucleo, Pins};
use super::wire::TimedByte;

/// Somebody at the far end of a board's console, in virtual time.
pub trait Terminal: Send + 'static {
    /// Takes what the board has sent by `now_ns`, each byte with its instant, and returns what is said to
    /// it from then on. Called every [`QUANTUM_NS`](super::QUANTUM_NS).
    fn serve(&mut self, now_ns: u64, sent: &[TimedByte]) -> Vec<u8>;
}

/// Who sits at the two consoles. A scene that needs a host there has that host instead.
#[derive(Default)]
pub struct Terminals {
    /// At the sensor board's.
    pub sensor: Option<Box<dyn Terminal>>,
    /// At the display board's.
    pub display: Option<Box<dyn Terminal>>,
}

/// Carries bytes between a board and its console.
pub(super) fn carry<P: Pins>(terminal: &mut dyn Terminal, board: &mut Nucleo<P>, now_ns: u64) {
    let wire = board.wire(CONSOLE_UART);
    let sent = wire.take_sent();
    for byte in terminal.serve(now_ns, &sent) {
        wire.hear(now_ns, byte);
    }
}
