//! What becomes of a Stop besides being obeyed: what was heard of it is noted for [`crate::answer`].

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use protocol::{Message, Stop, Trip};

use crate::side::Side;

/// Set once the outputs are off for good, and by what.
pub static OFF: Signal<CriticalSectionRawMutex, Trip> = Signal::new();

/// What was heard; full only if the thread is held up, and who says a Stop says it again.
pub(crate) static HEARD: Channel<CriticalSectionRawMutex, Heard, 8> = Channel::new();

/// What has to do with a Stop.
pub(crate) enum Heard {
    /// A Stop came by a port.
    Stop(Side, Stop),
    /// A person typed one.
    Typed(Stop),
    /// The other board has stopped.
    OtherStopped,
}

/// Notes what came by a port, if it has to do with a Stop.
pub fn on(side: Side, message: &Message) {
    let heard = match (side, message) {
        (_, Message::Stop(stop)) => Heard::Stop(side, *stop),
        (Side::Peer, Message::Stopped(_)) => Heard::OtherStopped,
        _ => return,
    };
    let _ = HEARD.try_send(heard);
}

/// Notes that a person typed a Stop.
pub fn on_key(stop: Stop) {
    let _ = HEARD.try_send(Heard::Typed(stop));
}
