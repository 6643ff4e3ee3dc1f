//! Reads what went over a wire after the fact: every message, with the instant of its frame's last byte.

use protocol::Message;
use protocol::receiver::{Event, Receiver};

/// A message, and when its frame was complete.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedMessage {
    /// Instant of the frame's last byte, in ns since the scene's start.
    pub at_ns: u64,
    /// The message.
    pub message: Message,
}

/// Collects the messages of one direction of a link.
#[derive(Default)]
pub struct MessageDecoder {
    receiver: Receiver,
    said: Vec<TimedMessage>,
}

impl MessageDecoder {
    /// Takes bytes in their order.
    pub fn hear(&mut self, bytes: &[(u64, u8)]) {
        for &(at_ns, byte) in bytes {
            self.receiver.receive(&[byte], |event| {
                let message = match event {
                    Event::Message(message) => message,
                    Event::Greeted(hello) => Message::Hello(hello),
                    Event::Foreign(_) | Event::Unheralded | Event::Text => return,
                };
                self.said.push(TimedMessage { at_ns, message });
            });
        }
    }

    /// Takes what was said since the last call.
    pub fn take(&mut self) -> Vec<TimedMessage> {
        std::mem::take(&mut self.said)
    }

    /// What was said so far.
    pub fn messages(&self) -> impl DoubleEndedIterator<Item = &TimedMessage> {
        self.said.iter()
    }

    /// The same, for good.
    pub fn into_messages(self) -> Vec<TimedMessage> {
        self.said
    }
}
