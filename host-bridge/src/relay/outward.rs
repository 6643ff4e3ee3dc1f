//! What the board says, on its way to the other site: numbered and dated, and no more of it than the
//! network carries.

use protocol::{Hello, Message};

use crate::relay::envelope::{Content, Envelope, sequence_number};
use crate::relay::flow::Flow;
use crate::relay::gate::SequenceNumber;
use crate::relay::report::Outgoing;

/// The outward direction of a bridge.
#[derive(Clone, Debug)]
pub struct Outward {
    hello: Hello,
    session: u64,
    counter: u64,
    start: u32,
    last: Option<SequenceNumber>,
    pub flow: Flow,
    /// What has been counted so far.
    pub counts: Outgoing,
}

impl Outward {
    /// Nothing said yet by the bridge that introduces itself with `hello`, in this start of it.
    pub fn new(hello: Hello, session: u64) -> Self {
        Self {
            hello,
            session,
            counter: 0,
            start: 0,
            last: None,
            flow: Flow::default(),
            counts: Outgoing::default(),
        }
    }

    /// The envelope for what the board said at `at_us`. None if the network does not take more, or if it
    /// is not carried at all.
    pub fn carry(&mut self, at_us: u64, now_us: u64, message: Message) -> Option<Envelope> {
        let said = sequence_number(self.start, &message)?;
        // A serial line keeps the order: a board that counts backwards has started anew.
        let goes_on = self
            .last
            .is_none_or(|last| said.sequence.wrapping_sub(last.sequence).cast_signed() > 0);
        if !goes_on {
            self.start = self.start.wrapping_add(1);
        }
        self.last = Some(said);
        if !self.flow.admits(now_us) {
            self.counts.held += 1;
            return None;
        }
        let counter = self.counter;
        self.counter += 1;
        self.counts.sent += 1;
        let start = self.start;
        let envelope = self.other(at_us, Content::Board { start, message });
        Some(Envelope {
            counter,
            ..envelope
        })
    }

    pub const fn other(&self, at_us: u64, content: Content) -> Envelope {
        Envelope {
            hello: self.hello,
            session: self.session,
            counter: 0,
            sent_us: at_us,
            content,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::host_hello;
    use crate::relay::flow::Answer;
    use protocol::Motion;

    fn motion(sequence: u32) -> Message {
        Message::Motion(Motion {
            sequence,
            instant_us: 0,
            position_um: 0,
            velocity_um_s: 0,
        })
    }

    fn answer(sent_us: u64) -> Answer {
        Answer {
            sent_us,
            there_us: 0,
            round_trip_us: 10_000,
        }
    }

    /// A bridge whose network has just answered.
    fn answered() -> Outward {
        let mut outward = Outward::new(host_hello(), 1);
        outward.flow.on_answer(answer(0));
        outward
    }

    /// Number and board's start of what is carried.
    fn carried(outward: &mut Outward, sequence: u32) -> (u64, u32) {
        let envelope = outward.carry(9, 9, motion(sequence)).expect("carried");
        match envelope.content {
            Content::Board { start, .. } => (envelope.counter, start),
            _ => panic!("not the board's"),
        }
    }

    #[test]
    fn what_a_board_says_is_numbered_and_its_starts_are_counted() {
        let mut outward = answered();
        assert_eq!(carried(&mut outward, u32::MAX), (0, 0));
        assert_eq!(carried(&mut outward, 0), (1, 0));
        assert_eq!(carried(&mut outward, 700), (2, 0));
        assert_eq!(carried(&mut outward, 0), (3, 1));
        assert_eq!(carried(&mut outward, 1), (4, 1));
    }

    #[test]
    fn what_a_stuck_network_does_not_take_is_held_back_and_not_numbered() {
        let mut outward = Outward::new(host_hello(), 1);
        assert_eq!(outward.carry(9, 9, motion(5)), None);
        outward.flow.on_answer(answer(0));
        assert_eq!(carried(&mut outward, 6), (0, 0));
        assert_eq!(outward.carry(9, 9_000_000, motion(7)), None);
        outward.flow.on_answer(answer(9_000_000));
        assert_eq!(carried(&mut outward, 8), (1, 0));
        assert_eq!(outward.counts.held, 2);
    }
}
