//! Corrupted frames against the CRC: how many reach it, and how many it lets through.

use protocol::frame::{self, FrameError};
use protocol::{MAX_FRAME, Message};

use super::draw::Draw;
use super::tally::Count;

/// How a frame is spoiled on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spoiling {
    /// One to eight bits turned over, anywhere.
    Bits,
    /// Two to twelve bytes in a row replaced by any others.
    Burst,
    /// One to four bytes in a row lost.
    Lost,
    /// The beginning of one frame and the end of another.
    Joined,
    /// Any bytes in the place of sequence, payload and CRC, in good COBS.
    Content,
}

impl Spoiling {
    /// Each of them.
    pub const ALL: [Self; 5] = [
        Self::Bits,
        Self::Burst,
        Self::Lost,
        Self::Joined,
        Self::Content,
    ];

    /// Its row in the tally.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bits => "bits",
            Self::Burst => "burst",
            Self::Lost => "lost",
            Self::Joined => "joined",
            Self::Content => "content",
        }
    }
}

/// Spoils frames and counts what a decoder makes of them.
pub struct Corruptor {
    frames: Vec<Vec<u8>>,
    spoiled: Vec<u8>,
    content: Vec<u8>,
}

impl Corruptor {
    /// Spoils frames of these messages.
    pub fn new(messages: &[Message]) -> Self {
        let frame_of = |(sequence, message): (u16, &Message)| {
            let mut out = [0; MAX_FRAME];
            let frame = frame::encode(sequence, message, &mut out).expect("every message fits");
            frame[..frame.len() - 1].to_vec()
        };
        // Numbers without a 0x00, and such that frames differ in more than the payload.
        let numbers = (0..).map(|n: u16| n.wrapping_mul(0x9E37));
        Self {
            frames: numbers.zip(messages).map(frame_of).collect(),
            spoiled: Vec::new(),
            content: Vec::new(),
        }
    }

    /// Spoils frames until `judged` of them have reached the CRC; `decode` is [`frame::decode`], or in a test
    /// something worse.
    pub fn run(
        &mut self,
        spoiling: Spoiling,
        judged: u64,
        draw: &mut Draw,
        decode: impl Fn(&mut [u8]) -> Result<(u16, &[u8]), FrameError>,
    ) -> Count {
        let mut count = Count::default();
        while count.runs < judged {
            let whole = draw.below(self.frames.len());
            self.spoil(whole, spoiling, draw);
            if self.spoiled.is_empty() || self.spoiled == self.frames[whole] {
                continue;
            }
            match decode(&mut self.spoiled) {
                Err(FrameError::Cobs | FrameError::Short { .. }) => count.refused += 1,
                Err(FrameError::Crc { carried, computed }) => {
                    count.runs += 1;
                    let differ = carried ^ computed;
                    count.low_8 += u64::from(differ & 0xFF == 0);
                    count.low_16 += u64::from(differ & 0xFFFF == 0);
                    count.low_24 += u64::from(differ & 0xFF_FFFF == 0);
                }
                // Let through. A frame that says what one that was sent says is not corrupted in effect: one that
                // was joined of another's beginning and the whole of its end, say.
                Ok(said) => {
                    let sent = &mut self.content;
                    let corrupt = self.frames.iter().all(|frame| {
                        sent.clear();
                        sent.extend(frame);
                        frame::decode(sent) != Ok(said)
                    });
                    if corrupt {
                        count.runs += 1;
                        count.low_8 += 1;
                        count.low_16 += 1;
                        count.low_24 += 1;
                        count.bad += 1;
                    }
                }
            }
        }
        count
    }

    /// Puts a spoiled frame into `spoiled`, up to its first 0x00, which would end it.
    fn spoil(&mut self, whole: usize, spoiling: Spoiling, draw: &mut Draw) {
        let Self {
            frames,
            spoiled,
            content,
        } = self;
        spoiled.clear();
        spoiled.extend(&frames[whole]);
        let length = spoiled.len();
        match spoiling {
            Spoiling::Bits => {
                for _ in 0..1 + draw.below(8) {
                    let bit = draw.below(8 * length);
                    spoiled[bit / 8] ^= 1 << (bit % 8);
                }
            }
            Spoiling::Burst => {
                let begin = draw.below(length);
                let end = length.min(begin + 2 + draw.below(11));
                for byte in &mut spoiled[begin..end] {
                    *byte = draw.bits() as u8;
                }
            }
            Spoiling::Lost => {
                let begin = draw.below(length);
                let end = length.min(begin + 1 + draw.below(4));
                spoiled.drain(begin..end);
            }
            Spoiling::Joined => {
                let other = &frames[draw.below(frames.len())];
                spoiled.truncate(draw.below(length));
                spoiled.extend(&other[draw.below(other.len())..]);
            }
            Spoiling::Content => {
                content.clear();
                let length = 6 + draw.below(40);
                draw.bytes(length, content);
                spoiled.resize(cobs::max_encoding_length(content.len()), 0);
                let length = cobs::encode(content, spoiled);
                spoiled.truncate(length);
            }
        }
        if let Some(end) = spoiled.iter().position(|&byte| byte == 0) {
            spoiled.truncate(end);
        }
    }
}
