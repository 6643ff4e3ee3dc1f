//! What the bridges say to each other: who, when, in which order, and the message.
//!
//! ```text
//! Hello: 35 bytes | envelope version: u8 | session, counter, sent µs: u64 LE | content: postcard
//! ```
//!
//! The [`Hello`] and the version behind it never move, so that any two builds can say that they differ.
//!
//! A Stop and what is answered never change either, so that any build stops any other's site:
//!
//! ```text
//! Hello: 35 bytes | 0 | session, counter, sent µs: u64 LE | which Stop: u64 LE | word: 6 bytes
//! ```
//!
//! with the words of [`protocol::stop`], `Stop` and `Stopped` (cause 0xff where it is not known), and for one that the board has
//! not obeyed yet 0x00 'W' 'A' 'I' 'T' and 1 if the board was told, else 0.

use protocol::frame::MAX_PAYLOAD;
use protocol::stop::{STOP_LENGTH, Stopped};
use protocol::{Estimate, HELLO_LENGTH, Hello, Message, Ping, Pong, Role, Stop, Trip};
use serde::{Deserialize, Serialize};

use crate::monitor::log_entry::LogLine;
use crate::relay::gate::SequenceNumber;

/// The version of everything in this file but for what never changes.
pub const ENVELOPE_VERSION: u8 = 6;
/// What stands in its place in an envelope that never changes.
const FROZEN: u8 = 0;
/// The word of a Stop that the board has not obeyed yet; whether it was told follows.
const WAITING: [u8; STOP_LENGTH - 1] = [0, b'W', b'A', b'I', b'T'];
/// The cause of a [`Stopped`] that this program does not know.
const NO_CAUSE: u8 = u8::MAX;

/// Bytes in front of the content.
const HEADER: usize = HELLO_LENGTH + 1 + 3 * size_of::<u64>();
/// Longest text of a line of a log, in bytes.
pub const MAX_LINE: usize = 400;
/// Longest content: a line of a log with its kind, number and level; or a message, its kind and its board's start.
const MAX_CONTENT: usize = if MAX_LINE + 18 > 1 + 5 + MAX_PAYLOAD {
    MAX_LINE + 18
} else {
    1 + 5 + MAX_PAYLOAD
};
/// Longest envelope, in bytes.
pub const MAX_ENVELOPE: usize = HEADER + MAX_CONTENT;

/// What stands in an envelope.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "it lives on the stack for one callback"
)]
pub enum Content {
    /// What the board said.
    Board {
        /// Counts the starts of the board, as its bridge sees them.
        start: u32,
        /// An estimate or a texture from a sensor, a motion from a display.
        message: Message,
    },
    /// Asks for a pong.
    Ping(Ping),
    /// Answers a ping.
    Pong {
        /// The session that asked.
        to: u64,
        /// The answer.
        pong: Pong,
        /// Whether who asked holds the bench.
        holds: bool,
    },
    /// An operator's Stop; repeated until it is heard.
    Stop {
        /// Which one: the same for all repetitions.
        id: u64,
        /// What the board is to be told.
        stop: Stop,
    },
    /// The Stop of this number is done.
    Stopped {
        /// Which one.
        id: u64,
        /// The reason for which the board says that it has stopped; none if the bridge does not know it.
        trip: Option<Trip>,
    },
    /// The Stop of this number was heard, and the board has not said yet that it has stopped.
    Stopping {
        /// Which one.
        id: u64,
        /// Whether the board has been told.
        is_told: bool,
    },
    /// The bridge ends: another one may have its place.
    Leaving,
    /// Somebody at this site watches the other site's board; repeated for as long as that is so.
    Watch,
    /// Who the board is, for who watches.
    Greeting(Hello),
    /// Anything that the board said, for who watches; in no way for the other board.
    Shown(Message),
    /// Who holds the bench hands it over to who waits for it.
    HandOver,
    /// What somebody who watches the other site's board asks it: see [`is_question`].
    Question(Message),
    /// A line of the board's log, for who watches.
    Log {
        /// Counts the lines that were sent, so that whoever misses some knows.
        number: u32,
        /// The line.
        line: LogLine,
    },
}

/// One thing said by one bridge to the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Envelope {
    /// Who speaks: the role is that of the board at the bridge's console, or a host's.
    pub hello: Hello,
    /// Drawn at random when the bridge was started.
    pub session: u64,
    /// Counts what the bridge has said of its board, or else is 0.
    pub counter: u64,
    /// When it was sent, in µs of the sender's clock: for what a board said, when its last byte was read.
    pub sent_us: u64,
    /// What is said.
    pub content: Content,
}

/// Why an envelope can't be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum EnvelopeError {
    #[error("it is no envelope of a bridge")]
    Strange,
    #[error("it is of another build")]
    Foreign { hello: Hello, version: u8 },
    #[error("its content is malformed")]
    Malformed,
}

impl Envelope {
    /// The envelope in bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; MAX_ENVELOPE];
        let (head, content) = bytes.split_at_mut(HEADER);
        let (version, length) = match frozen_bytes(&self.content) {
            Some(frozen) => {
                content[..frozen.len()].copy_from_slice(&frozen);
                (FROZEN, frozen.len())
            }
            // It always fits: see MAX_CONTENT.
            None => {
                let written = postcard::to_slice(&self.content, content);
                (ENVELOPE_VERSION, written.map_or(0, |content| content.len()))
            }
        };
        let numbers = [self.session, self.counter, self.sent_us];
        head[..HELLO_LENGTH].copy_from_slice(&self.hello.to_bytes());
        head[HELLO_LENGTH] = version;
        for (place, number) in head[HELLO_LENGTH + 1..].chunks_exact_mut(8).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes.truncate(HEADER + length);
        bytes
    }

    /// Reads what came over the network and believes nothing of it: length, build, shape, numbers, and whether the
    /// sender may say it at all. Fails if it is not an envelope of this build with a sound content, nor one that never
    /// changes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, EnvelopeError> {
        let (hello, rest) = bytes
            .split_at_checked(HELLO_LENGTH)
            .ok_or(EnvelopeError::Strange)?;
        let hello = Hello::from_bytes(hello).ok_or(EnvelopeError::Strange)?;
        let (&version, rest) = rest.split_first().ok_or(EnvelopeError::Strange)?;
        let is_frozen = version == FROZEN;
        if !is_frozen && (version != ENVELOPE_VERSION || !hello.is_compatible()) {
            return Err(EnvelopeError::Foreign { hello, version });
        }
        if bytes.len() > MAX_ENVELOPE {
            return Err(EnvelopeError::Malformed);
        }
        let (session, rest) = number(rest)?;
        let (counter, rest) = number(rest)?;
        let (sent_us, rest) = number(rest)?;
        let content = if is_frozen {
            frozen(rest)
        } else {
            // What is frozen is said in no other way.
            let read = postcard::take_from_bytes(rest).ok();
            read.filter(|(content, rest)| rest.is_empty() && frozen_bytes(content).is_none())
                .map(|(content, _)| content)
        };
        let envelope = Self {
            hello,
            session,
            counter,
            sent_us,
            content: content.ok_or(EnvelopeError::Malformed)?,
        };
        envelope
            .is_sound()
            .then_some(envelope)
            .ok_or(EnvelopeError::Malformed)
    }

    /// The role of the sender's board; a host has none.
    pub fn role(&self) -> Option<Role> {
        Role::from_byte(self.hello.role)
    }

    fn is_sound(&self) -> bool {
        match (self.role(), &self.content) {
            (None, _) => false,
            (Some(role), Content::Board { message, .. }) => is_carried(role, message),
            (Some(_), Content::Question(message)) => is_question(message),
            (Some(_), _) => true,
        }
    }
}

/// The bytes of a content that never changes; none of any other.
fn frozen_bytes(content: &Content) -> Option<Vec<u8>> {
    let (id, word) = match *content {
        Content::Stop { id, stop } => (id, stop.to_bytes()),
        Content::Stopped { id, trip } => {
            let unknown = Stopped { cause: NO_CAUSE };
            (id, trip.map_or(unknown, Stopped::by).to_bytes())
        }
        Content::Stopping { id, is_told } => {
            let [a, b, c, d, e] = WAITING;
            (id, [a, b, c, d, e, is_told.into()])
        }
        _ => return None,
    };
    Some([&id.to_le_bytes()[..], &word].concat())
}

/// The content that these bytes are; none if they are no such.
fn frozen(bytes: &[u8]) -> Option<Content> {
    let (id, word) = number(bytes).ok()?;
    if let Some(stop) = Stop::from_bytes(word) {
        return Some(Content::Stop { id, stop });
    }
    if let Some(stopped) = Stopped::from_bytes(word) {
        let trip = stopped.trip();
        return Some(Content::Stopped { id, trip });
    }
    match word.strip_prefix(&WAITING)? {
        [is_told] => Some(Content::Stopping {
            id,
            is_told: *is_told != 0,
        }),
        _ => None,
    }
}

fn number(bytes: &[u8]) -> Result<(u64, &[u8]), EnvelopeError> {
    let (number, rest) = bytes.split_first_chunk().ok_or(EnvelopeError::Malformed)?;
    Ok((u64::from_le_bytes(*number), rest))
}

/// Whether `message` is carried to the other site when the board of `role` says it, and sound.
pub fn is_carried(role: Role, message: &Message) -> bool {
    match (role, message) {
        (Role::Sensor, Message::Estimate(estimate)) => is_finite(estimate),
        (Role::Sensor, Message::Texture(texture)) => texture.is_sound(),
        (Role::Display, Message::Motion(_)) => true,
        _ => false,
    }
}

/// Whether `message` may be said to a board by whoever watches it from the other site: it asks, and changes nothing.
pub const fn is_question(message: &Message) -> bool {
    matches!(
        message,
        Message::Question(_) | Message::StreamGauges(_) | Message::Ping(_)
    )
}

/// What its board says of the place of a message that is carried: a texture comes after the estimate that it was made with.
pub const fn sequence_number(start: u32, message: &Message) -> Option<SequenceNumber> {
    let sequence = match message {
        Message::Estimate(estimate) => estimate.sequence.wrapping_mul(2),
        Message::Texture(texture) => texture.sequence.wrapping_mul(2).wrapping_add(1),
        Message::Motion(motion) => motion.sequence,
        _ => return None,
    };
    Some(SequenceNumber { start, sequence })
}

/// Whether an estimate keeps what its fields promise.
fn is_finite(estimate: &Estimate) -> bool {
    let is_length = |mm: Option<f32>| mm.is_none_or(|mm| mm.is_finite() && mm > 0.0);
    is_length(estimate.wavelength_mm)
        && is_length(estimate.counted_mm)
        && (0.0..=1.0).contains(&estimate.confidence)
        && (0.0..=f32::MAX).contains(&estimate.amplitude_lsb)
        && (!estimate.valid || estimate.wavelength_mm.is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::host_hello;
    use protocol::{Contact, GaugeHealth, Motion, Question, Range, StopReason};

    fn estimate() -> Estimate {
        Estimate {
            sequence: u32::MAX,
            instant_us: u64::MAX,
            wavelength_mm: Some(2.0),
            valid: true,
            confidence: 1.0,
            amplitude_lsb: 300.0,
            counted_mm: Some(2.1),
            range: Range::T1,
            contact: Contact::Slip,
            velocity_um_s: i32::MIN,
            lag_um: Some(i32::MIN),
            gauges_used: 0x1f,
            health: [GaugeHealth::Good; 5],
        }
    }

    fn of(role: Role, content: Content) -> Envelope {
        Envelope {
            hello: Hello {
                role: role.byte(),
                ..host_hello()
            },
            session: 3,
            counter: 4,
            sent_us: 5,
            content,
        }
    }

    fn board(message: Message) -> Content {
        Content::Board {
            start: u32::MAX,
            message,
        }
    }

    fn motion() -> Message {
        Message::Motion(Motion {
            sequence: 1,
            instant_us: 2,
            position_um: i64::MIN,
            velocity_um_s: i32::MIN,
        })
    }

    fn contents() -> Vec<Envelope> {
        let id = u64::MAX;
        let stop = Stop {
            reason: StopReason::Operator,
        };
        vec![
            of(Role::Sensor, board(Message::Estimate(estimate()))),
            of(Role::Display, board(motion())),
            of(Role::Sensor, Content::Ping(Ping { sent_us: id })),
            of(
                Role::Display,
                Content::Pong {
                    to: id,
                    pong: Pong {
                        sent_us: id,
                        received_us: id,
                        answered_us: id,
                    },
                    holds: true,
                },
            ),
            of(Role::Host, Content::Stop { id, stop }),
            of(
                Role::Display,
                Content::Stopped {
                    id,
                    trip: Some(Trip::StackOverflow),
                },
            ),
            of(Role::Sensor, Content::Stopped { id, trip: None }),
            of(Role::Display, Content::Stopping { id, is_told: true }),
            of(Role::Display, Content::Leaving),
            of(Role::Display, Content::Watch),
            of(Role::Sensor, Content::Greeting(host_hello())),
            of(Role::Sensor, Content::Shown(Message::Estimate(estimate()))),
            of(Role::Display, Content::HandOver),
            of(
                Role::Display,
                Content::Question(Message::Question(Question::Configuration)),
            ),
            of(
                Role::Sensor,
                Content::Log {
                    number: u32::MAX,
                    line: LogLine::Line {
                        level: Some("error".to_owned()),
                        text: "x".repeat(MAX_LINE),
                    },
                },
            ),
            of(
                Role::Sensor,
                Content::Log {
                    number: u32::MAX,
                    line: LogLine::Lost("x".repeat(MAX_LINE)),
                },
            ),
        ]
    }

    #[test]
    fn envelopes_are_read_as_they_were_written() {
        for envelope in contents() {
            let bytes = envelope.to_bytes();
            assert!(bytes.len() <= MAX_ENVELOPE);
            assert_eq!(Envelope::from_bytes(&bytes), Ok(envelope));
        }
    }

    #[test]
    fn the_bytes_of_an_envelope_stay_where_they_are() {
        let bytes = of(Role::Display, board(motion())).to_bytes();
        assert_eq!(bytes[..4], *b"RDGL");
        assert_eq!(bytes[14], b'd');
        assert_eq!(bytes[35], ENVELOPE_VERSION);
        assert_eq!(bytes[36..44], 3_u64.to_le_bytes());
        assert_eq!(bytes[44..52], 4_u64.to_le_bytes());
        assert_eq!(bytes[52..60], 5_u64.to_le_bytes());
        assert_eq!(bytes[60..66], [0, 0xff, 0xff, 0xff, 0xff, 0x0f]);
    }

    /// By its bytes, which no build may change.
    #[test]
    fn a_stop_and_its_answers_are_the_same_in_every_build() {
        let stop = Stop {
            reason: StopReason::Operator,
        };
        let trip = Some(Trip::Operator);
        for (content, word) in [
            (Content::Stop { id: 7, stop }, *b"\0STOP\0"),
            (
                Content::Stopped { id: 7, trip },
                Stopped::by(Trip::Operator).to_bytes(),
            ),
            (
                Content::Stopping {
                    id: 7,
                    is_told: true,
                },
                *b"\0WAIT\x01",
            ),
            (
                Content::Stopping {
                    id: 7,
                    is_told: false,
                },
                *b"\0WAIT\0",
            ),
        ] {
            let mut envelope = of(Role::Host, content);
            envelope.hello.protocol = 77_u16.to_le_bytes();
            envelope.hello.schema = [9; 8];
            let bytes = envelope.to_bytes();
            let numbers: Vec<u8> = [3, 4, 5, 7_u64]
                .into_iter()
                .flat_map(u64::to_le_bytes)
                .collect();
            let due = [&envelope.hello.to_bytes()[..], &[0], &numbers, &word].concat();
            assert_eq!(bytes, due);
            assert_eq!(Envelope::from_bytes(&bytes), Ok(envelope));
        }
        // A reason and a cause that only a later build knows.
        let mut later = of(Role::Host, Content::Stop { id: 7, stop }).to_bytes();
        *later.last_mut().expect("a word") = 200;
        let read = Envelope::from_bytes(&later).expect("it is a Stop");
        assert!(matches!(read.content, Content::Stop { id: 7, .. }));
    }

    #[test]
    fn a_stop_is_said_in_no_other_way() {
        let stop = Stop {
            reason: StopReason::Operator,
        };
        let mut bytes = of(Role::Display, Content::Leaving).to_bytes();
        bytes.truncate(HEADER);
        let mut room = [0; 64];
        let said = postcard::to_slice(&Content::Stop { id: 7, stop }, &mut room);
        bytes.extend_from_slice(said.expect("there is room"));
        assert_eq!(Envelope::from_bytes(&bytes), Err(EnvelopeError::Malformed));
    }

    #[test]
    fn an_envelope_of_another_build_is_named_and_not_read() {
        let ours = of(Role::Sensor, Content::Ping(Ping { sent_us: 0 }));
        let mut other = ours.clone();
        other.hello.protocol = 77_u16.to_le_bytes();
        let read = Envelope::from_bytes(&other.to_bytes());
        let hello = other.hello;
        let version = ENVELOPE_VERSION;
        assert_eq!(read, Err(EnvelopeError::Foreign { hello, version }));

        let mut bytes = ours.to_bytes();
        bytes[HELLO_LENGTH] = 9;
        bytes.truncate(HELLO_LENGTH + 1);
        let hello = ours.hello;
        let read = Envelope::from_bytes(&bytes);
        assert_eq!(read, Err(EnvelopeError::Foreign { hello, version: 9 }));
    }

    #[test]
    fn what_is_cut_short_or_too_long_is_refused() {
        for envelope in contents() {
            let bytes = envelope.to_bytes();
            for length in 0..bytes.len() {
                assert!(Envelope::from_bytes(&bytes[..length]).is_err(), "{length}");
            }
            let mut longer = bytes.clone();
            longer.push(0);
            let read = Envelope::from_bytes(&longer);
            assert_eq!(read, Err(EnvelopeError::Malformed));
            longer.resize(1 << 20, 0);
            assert_eq!(Envelope::from_bytes(&longer), Err(EnvelopeError::Malformed));
        }
    }

    #[test]
    fn noise_is_no_envelope() {
        let mut state: u64 = 1;
        for length in 0..400 {
            let noise: Vec<u8> = (0..length)
                .map(|_| {
                    state = state * 48_271 % 0x7fff_ffff;
                    state as u8
                })
                .collect();
            assert_eq!(Envelope::from_bytes(&noise), Err(EnvelopeError::Strange));
        }
    }

    #[test]
    fn a_flipped_bit_never_makes_a_number_that_is_none() {
        for envelope in contents() {
            let bytes = envelope.to_bytes();
            for bit in 0..bytes.len() * 8 {
                let mut flipped = bytes.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                if let Ok(read) = Envelope::from_bytes(&flipped) {
                    assert!(read.is_sound());
                }
            }
        }
    }

    #[test]
    fn numbers_that_are_none_are_refused() {
        let broken: [fn(&mut Estimate); 8] = [
            |estimate| estimate.wavelength_mm = Some(f32::NAN),
            |estimate| estimate.wavelength_mm = Some(0.0),
            |estimate| estimate.wavelength_mm = Some(-1.0),
            |estimate| estimate.counted_mm = Some(f32::INFINITY),
            |estimate| estimate.confidence = 1.1,
            |estimate| estimate.confidence = f32::NAN,
            |estimate| estimate.amplitude_lsb = f32::NEG_INFINITY,
            |estimate| estimate.wavelength_mm = None,
        ];
        for break_it in broken {
            let mut estimate = estimate();
            break_it(&mut estimate);
            let envelope = of(Role::Sensor, board(Message::Estimate(estimate)));
            let read = Envelope::from_bytes(&envelope.to_bytes());
            assert_eq!(read, Err(EnvelopeError::Malformed));
        }
    }

    #[test]
    fn who_may_not_say_it_is_refused() {
        let stop = Message::Stop(Stop {
            reason: StopReason::Host,
        });
        for envelope in [
            of(Role::Sensor, board(motion())),
            of(Role::Display, board(Message::Estimate(estimate()))),
            of(Role::Host, board(motion())),
            of(Role::Display, board(stop)),
        ] {
            let read = Envelope::from_bytes(&envelope.to_bytes());
            assert_eq!(read, Err(EnvelopeError::Malformed));
        }
    }
}
