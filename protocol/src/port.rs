//! One end of one link, whole: handshake, numbering, counting, and the queue of bytes to send.
//!
//! A port is a port: the boards run one for the peer and one for the console, a host runs one for
//! each board, and the simulator runs the same code for all of them.

use heapless::Deque;

use crate::frame::MAX_FRAME;
use crate::message::{Message, Ping, Pong};
use crate::receiver::{Event, Peer, Receiver};
use crate::sender::Sender;
use crate::{Hello, PortCounters};

/// Bytes that may wait to be sent: some 20 ms of a 921 600 baud line.
pub const QUEUE_BYTES: usize = 2_048;

/// One end of one link.
pub struct Port {
    sender: Sender,
    receiver: Receiver,
    queue: Deque<u8, QUEUE_BYTES>,
    dropped: u32,
    overruns: u32,
    line_errors: u32,
}

impl Port {
    /// A port that introduces itself with `hello`.
    pub fn new(hello: Hello) -> Self {
        Self {
            sender: Sender::new(hello),
            receiver: Receiver::new(),
            queue: Deque::new(),
            dropped: 0,
            overruns: 0,
            line_errors: 0,
        }
    }

    /// Queues `message` if somebody who understands it listens. A frame that does not fit into the
    /// queue is dropped whole and counted.
    pub fn post(&mut self, message: &Message) {
        let mut frame = [0; MAX_FRAME];
        if self.queue.capacity() - self.queue.len() < MAX_FRAME {
            self.dropped = self.dropped.wrapping_add(1);
        } else if let Some(bytes) = self.sender.encode(message, &mut frame) {
            for &byte in bytes {
                let fits = self.queue.push_back(byte);
                debug_assert!(fits.is_ok(), "the queue had room for a whole frame");
            }
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
            sender, receiver, ..
        } = self;
        let mut ping: Option<Ping> = None;
        receiver.receive(bytes, |event| match event {
            Event::Message(Message::Ping(asked)) => ping = Some(asked),
            Event::Message(message) => handle(message),
            Event::Greeted(hello) => sender.on_greeting(hello.asks != 0),
            Event::Unheralded => sender.on_unheralded(),
            Event::Foreign(_) => sender.on_foreign(),
        });
        if let Some(Ping { sent_us }) = ping {
            self.post(&Message::Pong(Pong {
                sent_us,
                received_us: now_us,
                answered_us: now_us,
            }));
        }
        self.poll(now_us);
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
        taken
    }

    /// Whether bytes wait to be sent.
    pub fn has_bytes(&self) -> bool {
        !self.queue.is_empty()
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
