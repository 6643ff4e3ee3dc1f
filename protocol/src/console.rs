//! A board's console port: text for a person until a program says Hello, frames from then on.
//!
//! Whoever opens the port with a terminal program reads a line a second and may type a key. A program
//! says [`Hello`], which is answered at once, and the port speaks frames only. When no good frame has
//! come for [`SILENCE_US`], it speaks text again; a program that has nothing to say sends a
//! [`Ping`](crate::Ping) a second. What the program says after its silence is still heard, a
//! [`Stop`](crate::Stop) above all, and asks it for a Hello.
//!
//! Every line ends with a 0x00, which terminals pass over, so that no decoder is put out of step: a
//! [`Receiver`](crate::Receiver) takes a line for what it is, counts nothing, and its
//! [`Port`] says Hello.

use crate::Hello;
use crate::frame::MAX_FRAME;
use crate::port::Port;
use crate::receiver::{LINE_END, is_typed};

/// How long nobody may be heard until the port speaks text again, in µs: five pings of a program.
pub const SILENCE_US: u64 = 5_000_000;
/// How long the line must be quiet after a key, in µs: the bytes of a frame follow each other faster.
const QUIET_US: u64 = 50_000;
/// Most characters of a line.
pub const LINE_BYTES: usize = 208;
/// Ends a line for a decoder.
const FRAME_END: &[u8] = &[0];

const _: () = assert!(LINE_BYTES + LINE_END.len() + FRAME_END.len() <= MAX_FRAME);

/// A line of text in printable ASCII, without its end. What does not fit is cut off.
pub type Line = heapless::String<LINE_BYTES>;

/// What a person typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// `?` or `h`: asks for help.
    Help,
    /// `!` and nothing else: asks for a stop of the stimulus.
    Stop,
    /// Something that has no meaning.
    Other,
}

/// A console port.
pub struct Console {
    port: Port,
}

impl Console {
    /// A console that speaks text, and introduces itself with `hello` to who says Hello.
    pub fn new(hello: Hello) -> Self {
        Self {
            port: Port::waiting(hello),
        }
    }

    /// The port behind it. Messages posted while it speaks text are dropped, as on every port on which
    /// nobody listens.
    pub fn port(&mut self) -> &mut Port {
        &mut self.port
    }

    /// Whether it speaks text.
    pub const fn is_text(&self) -> bool {
        self.port.waits()
    }

    /// Queues a line, which must be printable ASCII, if it speaks text and there is room for the whole.
    pub fn say(&mut self, line: &str) {
        debug_assert!(line.bytes().all(|byte| matches!(byte, b' '..=b'~')));
        if self.is_text() {
            let text = line.as_bytes();
            let text = &text[..text.len().min(LINE_BYTES)];
            self.port.queue_raw([text, LINE_END, FRAME_END]);
        }
    }

    /// To be called at least every 100 ms: queues a Hello where one is due, goes back to text when
    /// nobody is heard any more, and returns what was typed since.
    pub fn poll(&mut self, now_us: u64) -> Option<Key> {
        let mut typed = None;
        if self.is_text() {
            // Taken out, so that it does not stand in front of a program's first Hello.
            typed = self.port.take_unended(QUIET_US, now_us, key).flatten();
        } else {
            self.port.wait_after(SILENCE_US, now_us);
        }
        self.port.poll(now_us);
        typed
    }
}

/// The meaning of what came before the line was quiet; none if it was not typed.
fn key(typed: &[u8]) -> Option<Key> {
    if !is_typed(typed) {
        return None;
    }
    if typed.iter().any(|byte| matches!(byte, b'?' | b'h')) {
        return Some(Key::Help);
    }
    let is_stop = typed.contains(&b'!')
        && typed
            .iter()
            .all(|byte| matches!(byte, b'!' | b'\r' | b'\n'));
    Some(if is_stop { Key::Stop } else { Key::Other })
}
