//! What a bench stands in: whose time it waits for, and what its ports' cables lead to.

use std::fmt::Debug;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use protocol::Role;

use super::PortName;

/// Time and cables. Each board has a thread of its own.
pub trait Surroundings: Debug + Send + Sync {
    /// Returns when the board of `role` may go on from the virtual instant `now_ns`: how far it is behind. Each board
    /// asks at the end of each quantum, and comes to ask again before the other has to go on.
    fn wait(&self, role: Role, now_ns: u64) -> Duration;

    /// A board has ended, and asks no more.
    fn leave(&self) {}

    /// A cable for the port called `name`. Dropped, it is pulled.
    fn cable(&self, name: PortName) -> io::Result<Arc<dyn Line>>;
}

/// A port's cable, at the bench's end. Nothing here waits but [`Self::wait_for_room`]. All fail as the system does.
pub trait Line: Debug + Send + Sync {
    /// What a client opens.
    fn path(&self) -> &Path;

    /// Takes what the clients have written, as far as it fits: how many bytes, or none if nobody has the far end open.
    fn read(&self, bytes: &mut [u8]) -> io::Result<Option<usize>>;

    /// Hands on what there is room for: how many bytes.
    fn write(&self, bytes: &[u8]) -> io::Result<usize>;

    /// The rate that a client has set, in baud.
    fn baud(&self) -> io::Result<u32>;

    /// The last client has gone: what it has not read and that it wanted the port for itself alone is forgotten, as a
    /// serial port's driver does. Fails if the far end is busy, since a client was killed that had it for itself.
    fn forget_client(&self) -> io::Result<()>;

    /// Waits up to `limit` for room.
    fn wait_for_room(&self, _limit: Duration) {}
}
