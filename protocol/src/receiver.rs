//! Bytes in, messages out: nothing on the line can put it out of step, and everything is counted.

use crate::frame::{self, MAX_FRAME};
use crate::hello::Hello;
use crate::message::Message;
use crate::sequence::{Arrival, Sequences};
use crate::status::PortCounters;

/// Ends a line on a terminal.
pub(crate) const LINE_END: &[u8] = b"\r\n";

/// Whether a person can have typed these.
pub(crate) fn is_typed(bytes: &[u8]) -> bool {
    bytes
        .iter()
        .all(|byte| matches!(byte, b' '..=b'~' | b'\r' | b'\n'))
}

/// What a receiver has to tell its owner.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "no allocator to box with, and an event lives on the stack for one frame"
)]
pub enum Event {
    /// A message from a compatible peer; never a Hello, and never one that is late or came before. A
    /// [`Stop`](crate::Stop), or the answer to one, from anybody, also late and once more.
    Message(Message),
    /// A compatible peer said Hello.
    Greeted(Hello),
    /// A peer of another protocol or schema said Hello: nothing else of it will be read.
    Foreign(Hello),
    /// A frame came from a peer that has not said Hello to this receiver: ask for one.
    Unheralded,
    /// A line of text came: the peer is a board's console that has not heard a Hello since its start, or
    /// for long. Say one.
    Text,
}

/// Who is at the other end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Peer {
    /// Nobody has said Hello yet.
    #[default]
    Silent,
    /// Somebody speaks text and has not said Hello since: see [`crate::console`].
    Text,
    /// The last Hello was of this protocol and schema.
    Known(Hello),
    /// The last Hello was of another protocol or schema.
    Foreign(Hello),
}

/// The receiving direction of a port.
///
/// Every frame that ends, except an empty one and a line of text, raises exactly one of the counters
/// `received`, `corrupt`, `overlong`, `late`, `duplicated`, `malformed`, `foreign` and `unheralded`;
/// `lost` counts the gaps between them. A Hello is handed on even if it is late or came before: what it
/// says does not grow old. So is a [`Stop`](crate::Stop), and the answer to one, from whoever it is: known,
/// foreign, speaking text or silent so far. A line of text says that the peer has started over, or has taken its leave:
/// what it said before is forgotten, and nothing else is read before its Hello.
pub struct Receiver {
    /// The frame so far, still in COBS.
    buffer: [u8; MAX_FRAME - 1],
    /// Bytes in `buffer`.
    length: usize,
    /// The frame is longer than `buffer`: the rest of it is passed over.
    overlong: bool,
    reader: Reader,
}

impl Receiver {
    /// A receiver that has heard nothing yet.
    pub const fn new() -> Self {
        Self {
            buffer: [0; MAX_FRAME - 1],
            length: 0,
            overlong: false,
            reader: Reader {
                sequences: Sequences::new(),
                peer: Peer::Silent,
                counters: PortCounters::new(),
            },
        }
    }

    /// Takes bytes as they come, in any portions, and hands on what they amount to.
    pub fn receive(&mut self, bytes: &[u8], mut handle: impl FnMut(Event)) {
        for &byte in bytes {
            if byte != 0 {
                if let Some(place) = self.buffer.get_mut(self.length) {
                    *place = byte;
                    self.length += 1;
                } else {
                    self.overlong = true;
                }
                continue;
            }
            let length = core::mem::take(&mut self.length);
            if core::mem::take(&mut self.overlong) {
                count(&mut self.reader.counters.overlong);
            } else if length > 0
                && let Some(event) = self.reader.read(&mut self.buffer[..length])
            {
                handle(event);
            }
        }
    }

    /// What has come of a frame, or of whatever it is, that has not ended yet: still in COBS, and cut
    /// where it is longer than a frame.
    pub fn unended(&self) -> &[u8] {
        &self.buffer[..self.length]
    }

    /// Forgets what has not ended yet: what comes next begins a frame.
    pub fn forget_unended(&mut self) {
        self.length = 0;
        self.overlong = false;
    }

    /// Who is at the other end, by the last Hello.
    pub const fn peer(&self) -> Peer {
        self.reader.peer
    }

    /// What was received so far. `sent`, `dropped`, `overruns` and `line_errors` are the owner's to
    /// fill in, and 0 here.
    pub const fn counters(&self) -> PortCounters {
        self.reader.counters
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

/// What is known of the peer and of its frames so far.
struct Reader {
    sequences: Sequences,
    peer: Peer,
    counters: PortCounters,
}

impl Reader {
    /// Reads one frame, without its closing 0x00.
    fn read(&mut self, frame: &mut [u8]) -> Option<Event> {
        if is_line(frame) {
            self.sequences = Sequences::new();
            self.peer = Peer::Text;
            return Some(Event::Text);
        }
        let Ok((sequence, payload)) = frame::decode(frame) else {
            count(&mut self.counters.corrupt);
            return None;
        };
        match frame::frozen(payload) {
            Some(Message::Hello(hello)) => return Some(self.read_hello(sequence, hello)),
            Some(stop) => return Some(self.read_stop(sequence, stop)),
            None => {}
        }
        let arrival = self.sequences.note(sequence);
        if !self.count_arrival(arrival) {
            return None;
        }
        match self.peer {
            Peer::Silent | Peer::Text => {
                count(&mut self.counters.unheralded);
                Some(Event::Unheralded)
            }
            Peer::Foreign(_) => {
                count(&mut self.counters.foreign);
                None
            }
            Peer::Known(_) => match frame::message(payload) {
                Some(message) => {
                    count(&mut self.counters.received);
                    Some(Event::Message(message))
                }
                None => {
                    count(&mut self.counters.malformed);
                    None
                }
            },
        }
    }

    fn read_hello(&mut self, sequence: u16, hello: Hello) -> Event {
        let arrival = self.sequences.note_hello(sequence, hello.asks != 0);
        let fresh = self.count_arrival(arrival);
        if hello.is_compatible() {
            self.peer = Peer::Known(hello);
            if fresh {
                count(&mut self.counters.received);
            }
            Event::Greeted(hello)
        } else {
            self.peer = Peer::Foreign(hello);
            if fresh {
                count(&mut self.counters.foreign);
            }
            Event::Foreign(hello)
        }
    }

    /// Hands on a Stop, or the answer to one, whoever says it and whenever.
    fn read_stop(&mut self, sequence: u16, message: Message) -> Event {
        let arrival = self.sequences.note_stop(sequence);
        if self.count_arrival(arrival) {
            count(&mut self.counters.received);
        }
        Event::Message(message)
    }

    /// Counts gaps, late and repeated frames; whether this one is neither late nor repeated.
    fn count_arrival(&mut self, arrival: Arrival) -> bool {
        let counters = &mut self.counters;
        match arrival {
            Arrival::Fresh { lost } => {
                counters.lost = counters.lost.wrapping_add(lost.into());
                return true;
            }
            Arrival::Late { filled } => {
                counters.lost = counters.lost.wrapping_sub(filled.into());
                count(&mut counters.late);
            }
            Arrival::Duplicate => count(&mut counters.duplicated),
        }
        false
    }
}

/// Whether this is a line of text, as [`crate::Console::say`] ends it. No frame of this version is one:
/// its fourth byte is the message's variant, a control character, or else one of the four is a code of
/// COBS below 4.
fn is_line(frame: &[u8]) -> bool {
    frame
        .strip_suffix(LINE_END)
        .is_some_and(|text| text.iter().all(|byte| matches!(byte, b' '..=b'~')))
}

/// One more; wraps at 2³².
fn count(counter: &mut u32) {
    *counter = counter.wrapping_add(1);
}
