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

    /// Who listened, or spoke, has started again: the frames before have nothing to do with those that come.
    pub fn restart(&mut self) {
        self.receiver = Receiver::default();
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

#[cfg(test)]
mod tests {
    use protocol::frame::encode;
    use protocol::{Hello, MAX_FRAME, Ping, Role};

    use super::*;

    /// What a board says that has just started: a greeting, and so many pings.
    fn said(asks: u8, pings: u16) -> Vec<(u64, u8)> {
        let hello = Message::Hello(Hello {
            asks,
            ..Hello::new(Role::Sensor, "chip", [0, 1, 0])
        });
        let pings = (0..pings).map(|_| Message::Ping(Ping { sent_us: 1 }));
        let mut bytes = Vec::new();
        let messages = [hello].into_iter().chain(pings);
        for (sequence, message) in (0_u16..).zip(messages) {
            let mut out = [0; MAX_FRAME];
            let frame = encode(sequence, &message, &mut out).expect("it has room");
            bytes.extend(frame.iter().map(|&byte| (0_u64, byte)));
        }
        bytes
    }

    #[test]
    fn after_a_restart_frames_of_any_number_are_read_whatever_was_cut_off() {
        let read = |restarts: bool| {
            let mut decoder = MessageDecoder::default();
            decoder.hear(&said(1, 50));
            assert_eq!(decoder.take().len(), 51);
            decoder.hear(&said(1, 0)[..9]);
            if restarts {
                decoder.restart();
            }
            // The other board has started too, and answers.
            decoder.hear(&said(0, 5));
            decoder.take().len()
        };
        assert_eq!(read(true), 6);
        assert_eq!(read(false), 0);
    }
}
