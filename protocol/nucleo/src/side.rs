//! Which of a board's two ports.

/// Which port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The other board.
    Peer,
    /// The ST-LINK's virtual COM port.
    Console,
}
