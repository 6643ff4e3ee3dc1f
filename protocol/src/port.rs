//! One end of one link, whole: handshake, numbering, counting, and the queue of bytes to send.
//!
//! A port is a port: the boards run one for the peer and one for the console, a host runs one for
//! each board, and the simulator runs the same code for all of them.

use heapless::Deque;

use crate::frame::MAX_FRAME;
use crate::message::{Message, Ping, Pong};
use crate::receiver::{Event, Peer, Receiver, is_typed};
use crate::sender::Sender;
use crate::{Arm, ArmState, DisplayState, Hello, PortCounters, Safety};

/// Bytes that may wait to be sent: some 20 ms of a 921 600 baud line.
pub const QUEUE_BYTES: usize = 2_048;

/// One end of one link.
pub struct Port {
    sender: Sender,
    receiver: Receiver,
    queue: Deque<u8, QUEUE_BYTES>,
    /// What the board said last of its own halt, and the bytes in the queue up to its end.
    halt: Option<(Halt, usize)>,
    /// See [`Port::take_asked`].
    asked: bool,
    /// When bytes came last, whatever they were.
    stirred_us: u64,
    /// When a good frame came last.
    heard_us: u64,
    dropped: u32,
    overruns: u32,
    line_errors: u32,
}

impl Port {
    /// A port that introduces itself with `hello`.
    pub fn new(hello: Hello) -> Self {
        Self::with(Sender::new(hello))
    }

    /// A port that waits to be spoken to, and introduces itself with `hello` then.
    pub(crate) fn waiting(hello: Hello) -> Self {
        Self::with(Sender::waiting(hello))
    }

    fn with(sender: Sender) -> Self {
        Self {
            sender,
            receiver: Receiver::new(),
            queue: Deque::new(),
            halt: None,
            asked: false,
            stirred_us: 0,
            heard_us: 0,
            dropped: 0,
            overruns: 0,
            line_errors: 0,
        }
    }

    /// Queues `message` if somebody who understands it listens. A frame that does not fit into the
    /// queue is dropped whole and counted.
    ///
    /// A [`Stop`](crate::Stop), and the answer to one, is queued whoever listens, and always: a Stop takes the
    /// place of all that waits to be sent, an answer does if there is no room. A 0x00 comes before it, to end
    /// whatever went out before. What a board says of its own halt, which it says once, comes again behind a Stop that
    /// took its place.
    pub fn post(&mut self, message: &Message) {
        match message {
            Message::Stop(_) => self.give_up(),
            Message::Stopped(_) if !self.has_room() => self.give_up(),
            _ => return self.queue_frame(message),
        }
        let halt = self.halt.take();
        self.queue_frame(message);
        if let Some((halt, _)) = halt {
            self.queue_frame(&halt.message());
        }
    }

    /// Queues `message` if somebody who understands it listens, and if there is room; counts it as dropped if not.
    fn queue_frame(&mut self, message: &Message) {
        let mut frame = [0; MAX_FRAME];
        if !self.has_room() {
            self.dropped = self.dropped.wrapping_add(1);
        } else if let Some(bytes) = self.sender.encode(message, &mut frame) {
            for &byte in bytes {
                let fits = self.queue.push_back(byte);
                debug_assert!(fits.is_ok(), "the queue had room for a whole frame");
            }
            if let Some(halt) = Halt::told_by(message) {
                self.halt = Some((halt, self.queue.len()));
            }
        }
    }

    /// Whether any frame finds room.
    fn has_room(&self) -> bool {
        self.queue.capacity() - self.queue.len() >= MAX_FRAME
    }

    /// Drops all that waits to be sent, and counts its frames. A 0x00 at the front, or behind another one, takes
    /// nothing away: the one that is queued instead ends what has gone out just as well.
    fn give_up(&mut self) {
        let mut before = 0;
        for &byte in &self.queue {
            self.dropped = self
                .dropped
                .wrapping_add(u32::from(byte == 0 && before != 0));
            before = byte;
        }
        self.queue.clear();
        let fits = self.queue.push_back(0);
        debug_assert!(fits.is_ok(), "the queue is empty");
    }

    /// Queues bytes that are no frame, if there is room for all of them.
    pub(crate) fn queue_raw(&mut self, parts: [&[u8]; 3]) {
        let length: usize = parts.iter().map(|part| part.len()).sum();
        if self.queue.capacity() - self.queue.len() >= length {
            self.queue.extend(parts.into_iter().flatten().copied());
        }
    }

    /// Queues a [`Hello`] when one is due. To be called at least every 100 ms and after each
    /// [`Port::receive`].
    pub fn poll(&mut self, now_us: u64) {
        if let Some(hello) = self.sender.hello_due(now_us) {
            self.post(&hello);
        }
    }

    /// Takes received bytes, in any portions, answers greetings and pings, and hands on the rest.
    pub fn receive(&mut self, now_us: u64, bytes: &[u8], mut handle: impl FnMut(Message)) {
        let Self {
            sender,
            receiver,
            asked,
            heard_us,
            ..
        } = self;
        let mut ping: Option<Ping> = None;
        // One that waits looks at every byte: a person may have typed right before a program came.
        let portion = if sender.waits() { 1 } else { bytes.len() };
        for bytes in bytes.chunks(portion.max(1)) {
            if sender.waits() && begins_frozen(bytes) && is_typed(receiver.unended()) {
                receiver.forget_unended();
            }
            receiver.receive(bytes, |event| {
                match event {
                    Event::Message(message) => {
                        // Nobody seemed to listen any more: somebody does.
                        if sender.waits() {
                            sender.on_unheralded();
                        }
                        match message {
                            Message::Ping(asked) => ping = Some(asked),
                            message => handle(message),
                        }
                    }
                    Event::Greeted(hello) => {
                        sender.on_greeting(hello.asks != 0);
                        *asked |= hello.asks != 0;
                    }
                    Event::Unheralded => sender.on_unheralded(),
                    Event::Foreign(_) => sender.on_foreign(),
                    Event::Text => return sender.on_text(),
                }
                *heard_us = now_us;
            });
        }
        self.stirred_us = now_us;
        if let Some(Ping { sent_us }) = ping {
            self.post(&Message::Pong(Pong {
                sent_us,
                received_us: now_us,
                answered_us: now_us,
            }));
        }
        self.poll(now_us);
    }

    /// Whether the peer has asked for a greeting since this was asked last, as one does that has started again.
    pub const fn take_asked(&mut self) -> bool {
        core::mem::replace(&mut self.asked, false)
    }

    /// Moves bytes to send into `out`; returns how many.
    pub fn take(&mut self, out: &mut [u8]) -> usize {
        let mut taken = 0;
        for place in out {
            let Some(byte) = self.queue.pop_front() else {
                break;
            };
            *place = byte;
            taken += 1;
        }
        self.halt = self.halt.take().and_then(|(halt, left)| {
            let left = left.saturating_sub(taken);
            (left > 0).then_some((halt, left))
        });
        taken
    }

    /// Whether bytes wait to be sent.
    pub fn has_bytes(&self) -> bool {
        !self.queue.is_empty()
    }

    /// Whether it waits to be spoken to.
    pub(crate) const fn waits(&self) -> bool {
        self.sender.waits()
    }

    /// Waits to be spoken to, if no good frame has come for `silence_us`. Who spoke last is still heard.
    pub(crate) fn wait_after(&mut self, silence_us: u64, now_us: u64) {
        if now_us.saturating_sub(self.heard_us) >= silence_us {
            self.sender.wait();
        }
    }

    /// Forgets what has not ended yet, after `act` had it, if nothing has come for `quiet_us`.
    pub(crate) fn take_unended<R>(
        &mut self,
        quiet_us: u64,
        now_us: u64,
        act: impl FnOnce(&[u8]) -> R,
    ) -> Option<R> {
        let unended = self.receiver.unended();
        if unended.is_empty() || now_us.saturating_sub(self.stirred_us) < quiet_us {
            return None;
        }
        let result = act(unended);
        self.receiver.forget_unended();
        Some(result)
    }

    /// Whom this port talks to.
    pub fn peer(&self) -> Peer {
        self.receiver.peer()
    }

    /// The receiver's buffer was overrun: bytes are missing.
    pub fn on_overrun(&mut self) {
        self.overruns = self.overruns.wrapping_add(1);
    }

    /// The UART reported noise or a framing error.
    pub fn on_line_error(&mut self) {
        self.line_errors = self.line_errors.wrapping_add(1);
    }

    /// What this port has seen.
    pub fn counters(&self) -> PortCounters {
        PortCounters {
            sent: self.sender.sent(),
            dropped: self.dropped,
            overruns: self.overruns,
            line_errors: self.line_errors,
            ..self.receiver.counters()
        }
    }
}

/// A board's own halt, as it tells of it.
#[derive(Clone, Copy)]
enum Halt {
    Display(Safety),
    Sensor(Arm),
}

impl Halt {
    /// The halt that a message tells of, if it tells of one.
    const fn told_by(message: &Message) -> Option<Self> {
        match message {
            Message::Safety(safety) if matches!(safety.state, DisplayState::Stopped(_)) => {
                Some(Self::Display(*safety))
            }
            Message::Arm(arm) if matches!(arm.state, ArmState::Stopped(_)) => {
                Some(Self::Sensor(*arm))
            }
            _ => None,
        }
    }

    const fn message(self) -> Message {
        match self {
            Self::Display(safety) => Message::Safety(safety),
            Self::Sensor(arm) => Message::Arm(arm),
        }
    }
}

/// Whether a frame may begin so that every version understands: with the code of one of the three bytes
/// before the rest of it, of which the last is always 0.
fn begins_frozen(bytes: &[u8]) -> bool {
    matches!(bytes, [1..=3, ..])
}
