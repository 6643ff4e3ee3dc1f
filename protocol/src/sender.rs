//! Messages in, numbered frames out, and the handshake before them.

use crate::frame::{self, MAX_FRAME};
use crate::hello::Hello;
use crate::message::Message;

/// Between two unanswered Hellos, in µs.
const HELLO_PERIOD_US: u64 = 1_000_000;
/// Least time between two Hellos that ask because frames came unheralded, in µs.
const ASK_PERIOD_US: u64 = 100_000;

/// The sending direction of a port: numbers and encodes frames.
///
/// It lets nothing but [`Hello`], [`Stop`](crate::Stop) and the answer to one out until the peer has said a
/// compatible Hello itself, so that no version has to guess at what another one says. Who starts asks; who is asked answers; an answer
/// asks no more, so the exchange ends. One that waits to be spoken to does not start.
pub struct Sender {
    hello: Hello,
    sequence: u16,
    sent: u32,
    /// Says Hello unasked while it is not greeted.
    calls: bool,
    /// The peer has said a compatible Hello.
    greeted: bool,
    /// The peer asked for a Hello.
    answer_due: bool,
    /// A frame came from a peer that this end knows nothing of.
    ask_due: bool,
    /// When the last Hello was made, in µs of the owner's clock.
    last_hello_us: Option<u64>,
}

impl Sender {
    /// A closed sender that numbers from 0 and introduces itself with `hello`.
    pub const fn new(hello: Hello) -> Self {
        Self {
            hello,
            sequence: 0,
            sent: 0,
            calls: true,
            greeted: false,
            answer_due: false,
            ask_due: false,
            last_hello_us: None,
        }
    }

    /// The same, but it waits to be spoken to: until the peer has said a Hello, whatever its version, it
    /// says its own only to ask who sends unheralded frames.
    pub const fn waiting(hello: Hello) -> Self {
        let mut sender = Self::new(hello);
        sender.calls = false;
        sender
    }

    /// Encodes `message` as the next frame and counts it. None while the peer is not greeted, unless
    /// every version understands it: see [`crate::frame`].
    pub fn encode<'a>(
        &mut self,
        message: &Message,
        out: &'a mut [u8; MAX_FRAME],
    ) -> Option<&'a [u8]> {
        if !self.greeted
            && !matches!(
                message,
                Message::Hello(_) | Message::Stop(_) | Message::Stopped(_)
            )
        {
            return None;
        }
        let bytes = frame::encode(self.sequence, message, out)?;
        self.sequence = self.sequence.wrapping_add(1);
        self.sent = self.sent.wrapping_add(1);
        Some(bytes)
    }

    /// A Hello, if one is due at `now_us` of the owner's clock: at the start and once a second until
    /// greeted, unless it waits to be spoken to; when the peer asked for one, and when its frames came
    /// unheralded. It counts as said: encode it.
    pub fn hello_due(&mut self, now_us: u64) -> Option<Message> {
        let since_us = self
            .last_hello_us
            .map_or(u64::MAX, |last_us| now_us.saturating_sub(last_us));
        let asks = (self.calls && !self.greeted && since_us >= HELLO_PERIOD_US)
            || (self.ask_due && since_us >= ASK_PERIOD_US);
        if !asks && !self.answer_due {
            return None;
        }
        self.answer_due = false;
        if asks {
            self.ask_due = false;
        }
        self.last_hello_us = Some(now_us);
        Some(Message::Hello(self.hello.asking(asks)))
    }

    /// The peer said a compatible Hello: opens. If it `asks`, the next [`Sender::hello_due`] answers.
    pub fn on_greeting(&mut self, asks: bool) {
        self.calls = true;
        self.greeted = true;
        self.ask_due = false;
        self.answer_due |= asks;
    }

    /// A frame came from a peer that has not said Hello: the next [`Sender::hello_due`] asks for one,
    /// at most once in 100 ms.
    pub fn on_unheralded(&mut self) {
        self.ask_due = true;
    }

    /// The peer said a Hello of another protocol or schema: closes, and says Hello once a second, so
    /// that the peer learns it too.
    pub fn on_foreign(&mut self) {
        self.calls = true;
        self.greeted = false;
        self.answer_due = false;
    }

    /// The peer speaks text, as a board's console does that has not heard a Hello since its start, or
    /// for long: closes, and the next [`Sender::hello_due`] asks for one, at most once in 100 ms.
    pub fn on_text(&mut self) {
        self.greeted = false;
        self.answer_due = false;
        self.ask_due |= self.calls;
    }

    /// Nobody listens any more: closes, and waits to be spoken to.
    pub fn wait(&mut self) {
        self.calls = false;
        self.greeted = false;
        self.answer_due = false;
        self.ask_due = false;
    }

    /// Whether it waits to be spoken to.
    pub const fn waits(&self) -> bool {
        !self.calls
    }

    /// Frames encoded since the start; wraps at 2³².
    pub const fn sent(&self) -> u32 {
        self.sent
    }
}
