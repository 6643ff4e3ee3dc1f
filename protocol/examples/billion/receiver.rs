//! What holds of a receiver whatever comes: every frame is counted once and no line of text, portions make no
//! difference, and after a 0x00 the receiver is in step again.
//!
//! The judge of libFuzzer's target (`protocol/fuzz`) and of the drawn inputs alike.

use protocol::{Event, Hello, MAX_FRAME, Message, Peer, Ping, PortCounters, Receiver, Role, frame};

/// What is judged: a [`Receiver`], or in a test something worse.
pub trait Hears: Default {
    /// Takes bytes and hands on what they amount to.
    fn hear(&mut self, bytes: &[u8], handle: impl FnMut(Event));
    /// What came so far.
    fn counters(&self) -> PortCounters;
    /// Who is at the other end.
    fn peer(&self) -> Peer;
}

impl Hears for Receiver {
    fn hear(&mut self, bytes: &[u8], handle: impl FnMut(Event)) {
        self.receive(bytes, handle);
    }

    fn counters(&self) -> PortCounters {
        Self::counters(self)
    }

    fn peer(&self) -> Peer {
        Self::peer(self)
    }
}

/// Pings after which a receiver has to hear at the latest: more than the window of 256 frames.
const PINGS: u16 = 300;

/// Judges one input after the other; holds the memory and the frames that each of them needs.
pub struct Judge {
    hello: Vec<u8>,
    pings: Vec<(Ping, Vec<u8>)>,
    framed: Vec<u8>,
    at_once: Vec<Event>,
    in_portions: Vec<Event>,
}

impl Judge {
    /// A judge that has judged nothing yet.
    pub fn new() -> Self {
        let ping = |sequence: u16| {
            let ping = Ping {
                sent_us: sequence.into(),
            };
            (ping, frame_of(sequence, &Message::Ping(ping)))
        };
        Self {
            hello: frame_of(0, &Message::Hello(hello())),
            pings: (1..PINGS).map(ping).collect(),
            framed: Vec::new(),
            at_once: Vec::new(),
            in_portions: Vec::new(),
        }
    }

    /// One execution. The first byte of `input` says how long a portion is (its low six bits), whether the rest
    /// is put in frames (0x40), and whether a Hello came before (0x80). The error says what does not hold.
    pub fn judge<R: Hears>(&mut self, input: &[u8]) -> Result<(), &'static str> {
        let Some((&control, rest)) = input.split_first() else {
            return Ok(());
        };
        let framed = control & 0x40 != 0;
        let bytes = if framed {
            in_frames(rest, &mut self.framed);
            &self.framed[..]
        } else {
            rest
        };
        let (mut whole, mut cut) = (R::default(), R::default());
        if control & 0x80 != 0 {
            whole.hear(&self.hello, |_| {});
            cut.hear(&self.hello, |_| {});
        }
        let before = frames_counted(&whole.counters());

        self.at_once.clear();
        whole.hear(bytes, |event| self.at_once.push(event));
        self.in_portions.clear();
        for portion in bytes.chunks(1 + usize::from(control & 0x3F)) {
            cut.hear(portion, |event| self.in_portions.push(event));
        }
        // A NaN does not equal itself, but its text does.
        if self.at_once != self.in_portions
            && format!("{:?}", self.at_once) != format!("{:?}", self.in_portions)
        {
            return Err("portions make a difference to what is handed on");
        }
        let counters = whole.counters();
        if counters != cut.counters() || whole.peer() != cut.peer() {
            return Err("portions make a difference to what is counted or known");
        }

        let ended = bytes
            .split_inclusive(|&byte| byte == 0)
            .filter(|frame| frame.len() > 1 && frame.ends_with(&[0]))
            .count();
        let texts = self.at_once.iter().filter(|event| **event == Event::Text);
        if frames_counted(&counters) - before != (ended - texts.count()) as u32 {
            return Err("a frame that ended is not counted once");
        }
        if framed && (counters.corrupt, counters.overlong) != (0, 0) {
            return Err("a good frame is taken for a corrupt one");
        }
        self.in_step_again(&mut whole)
    }

    /// Whatever it was: after a 0x00 a good frame is received, and a restarted peer is understood: at once, or if
    /// its Hello filled a gap that the input left, after the window of 256 frames.
    fn in_step_again<R: Hears>(&self, receiver: &mut R) -> Result<(), &'static str> {
        let mut greeted = false;
        receiver.hear(&[0], |_| {});
        receiver.hear(&self.hello, |event| {
            greeted = event == Event::Greeted(hello());
        });
        if !greeted {
            return Err("a Hello after a 0x00 is not heard");
        }
        for (ping, bytes) in &self.pings {
            let mut heard = None;
            receiver.hear(bytes, |event| heard = Some(event));
            match heard {
                None => {}
                Some(Event::Message(Message::Ping(said))) if said == *ping => return Ok(()),
                Some(_) => return Err("a Ping is taken for something else"),
            }
        }
        Err("a peer that started over is never understood")
    }
}

/// Good frames around pieces of the input, because no fuzzer guesses a CRC: a length, a sequence, a payload, and
/// so on.
fn in_frames(mut input: &[u8], bytes: &mut Vec<u8>) {
    bytes.clear();
    let mut out = [0; MAX_FRAME];
    while let [length, low, high, rest @ ..] = input {
        let (payload, next) = rest.split_at(rest.len().min((*length).into()));
        let sequence = u16::from_le_bytes([*low, *high]);
        bytes.extend(frame::encode_payload(sequence, payload, &mut out).unwrap_or_default());
        input = next;
    }
}

fn hello() -> Hello {
    Hello::new(Role::Host, "fuzz", [0, 0, 0]).asking(true)
}

fn frame_of(sequence: u16, message: &Message) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    let frame = frame::encode(sequence, message, &mut out);
    frame.expect("every message fits").to_vec()
}

fn frames_counted(c: &PortCounters) -> u32 {
    c.received
        + c.corrupt
        + c.overlong
        + c.late
        + c.duplicated
        + c.malformed
        + c.foreign
        + c.unheralded
}
