//! Inputs for the receiver's judge, drawn: frames of every message, whole, spoiled and run together, garbage and
//! lines of text.

use protocol::{MAX_FRAME, Message, frame};

use super::draw::Draw;

/// Draws inputs as [`super::receiver::Judge::judge`] takes them.
pub struct Inputs {
    payloads: Vec<Vec<u8>>,
    frames: Vec<Vec<u8>>,
    input: Vec<u8>,
}

impl Inputs {
    /// Inputs around these messages.
    pub fn new(messages: &[Message]) -> Self {
        let mut frames = Vec::new();
        let mut payloads = Vec::new();
        for (sequence, message) in (0..).zip(messages) {
            let mut out = [0; MAX_FRAME];
            let frame = frame::encode(sequence, message, &mut out).expect("every message fits");
            frames.push(frame.to_vec());
            let mut content = frame[..frame.len() - 1].to_vec();
            let (_, payload) = frame::decode(&mut content).expect("what was encoded is whole");
            payloads.push(payload.to_vec());
        }
        Self {
            payloads,
            frames,
            input: Vec::new(),
        }
    }

    /// The next input: 1 to some 300 bytes.
    pub fn next(&mut self, draw: &mut Draw) -> &[u8] {
        self.input.clear();
        self.input.push(draw.bits() as u8);
        let framed = self.input[0] & 0x40 != 0;
        for _ in 0..1 + draw.below(3) {
            let begin = self.input.len();
            if framed {
                self.payload(draw);
            } else {
                self.piece(draw);
            }
            // Half of the pieces stay as they are.
            let spoiled = [0, 0, 0, 1, 1, 4][draw.below(6)];
            for _ in 0..spoiled {
                let at = begin + draw.below(self.input.len() - begin);
                self.input[at] = draw.bits() as u8;
            }
        }
        &self.input
    }

    /// A length, a sequence and a payload: a message's, or any bytes.
    fn payload(&mut self, draw: &mut Draw) {
        let sequence = (draw.bits() as u16) >> draw.below(16);
        let length_at = self.input.len();
        self.input.push(0);
        self.input.extend(sequence.to_le_bytes());
        if draw.below(4) == 0 {
            let count = draw.below(24);
            draw.bytes(count, &mut self.input);
        } else {
            let payload = &self.payloads[draw.below(self.payloads.len())];
            self.input.extend(payload);
        }
        let length = self.input.len() - length_at - 3;
        self.input[length_at] = length.min(255) as u8;
    }

    /// A frame or a part of one, garbage, a line of text.
    fn piece(&mut self, draw: &mut Draw) {
        let kind = draw.below(8);
        if kind < 6 {
            let frame = &self.frames[draw.below(self.frames.len())];
            let begin = if kind == 4 {
                draw.below(frame.len())
            } else {
                0
            };
            let end = if kind == 5 {
                1 + draw.below(frame.len())
            } else {
                frame.len()
            };
            self.input.extend(&frame[begin..end]);
        } else if kind == 6 {
            let count = 1 + draw.below(24);
            draw.bytes(count, &mut self.input);
        } else {
            let text = b"ridgelink sensor 0.1.0: ? for help";
            self.input.extend(&text[..draw.below(text.len())]);
            self.input.extend(b"\r\n\0");
        }
    }
}
