//! The far end of a board's UART: what it sent, with instants, and what it is to hear, and when.

use std::collections::VecDeque;

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::snapshot::Store;
use rigless::time::VirtualNanos;

/// A byte on a wire, and the instant its stop bit ends.
pub type TimedByte = (u64, u8);

/// Bytes that follow each other without a gap may be due a rounding of the baud rate after the
/// receiver asks for them.
const SLACK_NS: u64 = 1_000;

/// Both directions of one UART.
#[derive(Debug, Default)]
pub struct Wire {
    sent: Vec<TimedByte>,
    due: VecDeque<TimedByte>,
    is_deaf: bool,
}

impl Store for Wire {}

impl Wire {
    /// Takes what the board sent since the last call.
    pub fn take_sent(&mut self) -> Vec<TimedByte> {
        std::mem::take(&mut self.sent)
    }

    /// Lets the board hear `byte` from `at_ns` on; the UART adds the time of the byte itself.
    pub fn hear(&mut self, at_ns: u64, byte: u8) {
        self.due.push_back((at_ns, byte));
    }

    /// Bytes that have not been heard yet.
    pub fn waiting(&self) -> usize {
        self.due.len()
    }

    /// Forgets what has not been heard: nobody listened.
    pub fn lose(&mut self) {
        self.due.clear();
    }

    /// Loses what comes for as long as the board is deaf.
    pub fn deafen(&mut self, is_deaf: bool) {
        self.is_deaf = is_deaf;
    }

    /// When the next byte comes that has not been offered yet.
    pub fn next_due(&self) -> Option<u64> {
        self.due.front().map(|&(at, _)| at)
    }
}

impl Peer for Wire {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        self.sent.push((context.now().0, word.to_le_bytes()[0]));
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let (_, byte) = self
            .due
            .pop_front_if(|&mut (at, _)| at <= now.0 + SLACK_NS)?;
        (!self.is_deaf).then_some(byte.into())
    }
}
