//! Nothing old after something newer: which envelopes of a stream may pass, and what became of the rest.

use std::collections::VecDeque;

/// How far back a late envelope is told from one that came twice.
const WINDOW: u64 = 128;
/// Whoever holds a stream keeps it for so long after it was heard last, in µs; then another may have it.
pub const LEASE_US: u64 = 1_000_000;

/// How many that held the stream before are remembered.
const PAST: usize = 8;

/// What an envelope's place says about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    Newer,
    /// A newer one came before: the network changed their order.
    Late,
    Duplicate,
    /// From a bridge that does not hold the stream: another does.
    Rival,
    /// Newer, and yet what the board says in it is not.
    Repeated,
}

/// What the gate has counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Arrivals {
    pub received: u64,
    /// Never came, of those between the first and the newest.
    pub lost: u64,
    pub late: u64,
    pub duplicated: u64,
    /// Came from a bridge while another held the stream, or repeated what the board had said before.
    pub superseded: u64,
}

/// What a board's message says of its own place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SequenceNumber {
    /// Counts the starts of the board, as its bridge sees them.
    pub start: u32,
    /// The board's own count.
    pub sequence: u32,
}

/// How far one bridge's stream has come.
#[derive(Clone, Copy, Debug, Default)]
struct Stream {
    /// The newest envelope's number, once there is one.
    newest: Option<u64>,
    /// Bit b set: number `newest - b` was skipped and is still missing.
    missing: u128,
    /// How many numbers before the newest belong to this session, below [`WINDOW`].
    depth: u64,
    last: Option<SequenceNumber>,
}

/// A bridge, and when it was heard last, in µs.
#[derive(Clone, Copy, Debug)]
struct Heard {
    session: u64,
    at_us: u64,
}

impl Heard {
    const fn is_silent(self, now_us: u64) -> bool {
        now_us.saturating_sub(self.at_us) >= LEASE_US
    }
}

/// The order of one stream, and whose it is.
#[derive(Clone, Debug, Default)]
pub struct Gate {
    holder: Option<Heard>,
    waiting: Option<Heard>,
    stream: Stream,
    /// Those that held it before, the newest first, and how far they came; none for one that has left for good. So
    /// nothing that they said before passes again, whoever repeats it.
    past: VecDeque<(u64, Option<Stream>)>,
    arrivals: Arrivals,
}

impl Gate {
    /// Judges the envelope numbered `counter` of `session`, and counts it. Who may pass is [`Order::Newer`]
    /// and nobody else.
    pub fn judge(&mut self, session: u64, counter: u64, sequence_number: SequenceNumber) -> Order {
        self.arrivals.received += 1;
        if !self.is_holder(session) {
            self.arrivals.superseded += 1;
            self.note_rival(session, counter);
            return Order::Rival;
        }
        match self.place(counter) {
            Order::Newer => {}
            other => return other,
        }
        let repeats = self.stream.last.is_some_and(|last| {
            sequence_number.start == last.start && !follows(sequence_number, last)
        });
        if repeats {
            self.arrivals.superseded += 1;
            return Order::Repeated;
        }
        self.stream.last = Some(sequence_number);
        Order::Newer
    }

    /// Whether the bridge of `session` holds the stream.
    pub fn is_holder(&self, session: u64) -> bool {
        self.holder.is_some_and(|holder| holder.session == session)
    }

    /// Whether a bridge holds the stream that was heard of late.
    pub fn is_held(&self, now_us: u64) -> bool {
        self.holder.is_some_and(|holder| !holder.is_silent(now_us))
    }

    /// The bridge of `session` was heard at `now_us`. It gets the stream if nobody holds it, or if who holds it
    /// has not been heard for [`LEASE_US`]: true if it got it just now. Who has left never gets it again.
    pub fn ask(&mut self, session: u64, now_us: u64) -> bool {
        let heard = Heard {
            session,
            at_us: now_us,
        };
        match self.holder {
            Some(holder) if holder.session == session => {
                self.holder = Some(heard);
                return false;
            }
            _ if self.has_left(session) => return false,
            Some(holder) if !holder.is_silent(now_us) => {}
            _ => {
                self.begin(heard);
                return true;
            }
        }
        let is_next = self
            .waiting
            .is_none_or(|waiting| waiting.session == session || waiting.is_silent(now_us));
        if is_next {
            self.waiting = Some(heard);
        }
        false
    }

    /// The bridge of `session` hands the stream over to who waits for it, at `now_us`: true if it was its own to
    /// hand over, and somebody waits.
    pub fn hand_over(&mut self, session: u64, now_us: u64) -> bool {
        let next = self.waiting.filter(|waiting| !waiting.is_silent(now_us));
        match next {
            Some(next) if self.is_holder(session) => {
                self.begin(next);
                true
            }
            _ => false,
        }
    }

    /// The bridge of `session` leaves for good: another may have the stream at once.
    pub fn leave(&mut self, session: u64) {
        if self.is_holder(session) {
            self.holder = None;
            self.remember(session, None);
        }
    }

    /// What has been counted so far.
    pub const fn arrivals(&self) -> Arrivals {
        self.arrivals
    }

    /// Another bridge speaks from now on.
    fn begin(&mut self, next: Heard) {
        if let Some(before) = self.holder.replace(next) {
            self.remember(before.session, Some(self.stream));
        }
        self.waiting = None;
        let known = self.past.iter().find(|(past, _)| *past == next.session);
        self.stream = known.and_then(|(_, stream)| *stream).unwrap_or_default();
    }

    /// What a bridge says after it has held the stream is not lost, should it hold it again.
    fn note_rival(&mut self, session: u64, counter: u64) {
        let known = self.past.iter_mut().find(|(past, _)| *past == session);
        if let Some((_, Some(stream))) = known
            && stream.newest.is_some_and(|newest| counter > newest)
        {
            *stream = Stream {
                newest: Some(counter),
                last: stream.last,
                ..Stream::default()
            };
        }
    }

    fn remember(&mut self, session: u64, stream: Option<Stream>) {
        self.past.retain(|(past, _)| *past != session);
        self.past.truncate(PAST - 1);
        self.past.push_front((session, stream));
    }

    fn has_left(&self, session: u64) -> bool {
        self.past
            .iter()
            .any(|(past, stream)| *past == session && stream.is_none())
    }

    fn place(&mut self, counter: u64) -> Order {
        let Some(newest) = self.stream.newest else {
            self.stream.newest = Some(counter);
            return Order::Newer;
        };
        if let Some(ahead @ 1..) = counter.checked_sub(newest) {
            self.arrivals.lost = self.arrivals.lost.saturating_add(ahead - 1);
            // The skipped ones are bits 1 to ahead - 1.
            let moved = u32::try_from(ahead)
                .ok()
                .and_then(|ahead| self.stream.missing.checked_shl(ahead))
                .unwrap_or(0);
            let skipped = 1_u128
                .checked_shl(u32::try_from(ahead).unwrap_or(u32::MAX))
                .map_or(u128::MAX, |bit| bit - 1);
            self.stream.missing = moved | (skipped & !1);
            self.stream.newest = Some(counter);
            self.stream.depth = self.stream.depth.saturating_add(ahead).min(WINDOW - 1);
            return Order::Newer;
        }
        let behind = newest - counter;
        let bit = 1_u128 << behind.min(WINDOW - 1);
        if behind < WINDOW && self.stream.missing & bit != 0 {
            self.stream.missing &= !bit;
            self.arrivals.lost -= 1;
            self.arrivals.late += 1;
            Order::Late
        } else if behind > self.stream.depth {
            // Older than can be remembered, or than the first that was heard.
            self.arrivals.late += 1;
            Order::Late
        } else {
            self.arrivals.duplicated += 1;
            Order::Duplicate
        }
    }
}

/// Whether a board said `sequence_number` after `last`, in counts that wrap.
const fn follows(sequence_number: SequenceNumber, last: SequenceNumber) -> bool {
    sequence_number
        .sequence
        .wrapping_sub(last.sequence)
        .cast_signed()
        > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(number: u64) -> SequenceNumber {
        SequenceNumber {
            start: 0,
            sequence: number as u32,
        }
    }

    /// A gate whose stream the bridge of `session` holds.
    fn held(session: u64) -> Gate {
        let mut gate = Gate::default();
        assert!(gate.ask(session, 0));
        gate
    }

    /// What becomes of the envelopes `counters` of one session.
    fn judged(counters: &[u64]) -> (Vec<Order>, Arrivals) {
        let mut gate = held(7);
        let orders = counters
            .iter()
            .map(|&counter| gate.judge(7, counter, said(counter)))
            .collect();
        (orders, gate.arrivals())
    }

    #[test]
    fn a_stream_in_order_passes_whole_wherever_it_begins() {
        let (orders, arrivals) = judged(&[1_000_000, 1_000_001, 1_000_002]);
        assert_eq!(orders, [Order::Newer; 3]);
        assert_eq!((arrivals.received, arrivals.lost), (3, 0));
    }

    #[test]
    fn a_gap_is_lost_until_it_is_filled_late_and_never_passes() {
        let (orders, arrivals) = judged(&[1, 4, 2, 3, 2, 5]);
        use Order::{Duplicate, Late, Newer};
        assert_eq!(orders, [Newer, Newer, Late, Late, Duplicate, Newer]);
        assert_eq!(
            (arrivals.lost, arrivals.late, arrivals.duplicated),
            (0, 2, 1)
        );
    }

    #[test]
    fn what_comes_twice_passes_once() {
        let (orders, arrivals) = judged(&[1, 1, 2, 2, 1]);
        use Order::{Duplicate, Newer};
        assert_eq!(orders, [Newer, Duplicate, Newer, Duplicate, Duplicate]);
        assert_eq!(arrivals.duplicated, 3);
    }

    #[test]
    fn a_long_gap_is_counted_whole_and_its_stragglers_are_late() {
        let (orders, arrivals) = judged(&[0, 1_000, 999, 5, 1_000_000, 1_000]);
        use Order::{Late, Newer};
        assert_eq!(orders, [Newer, Newer, Late, Late, Newer, Late]);
        assert_eq!(arrivals.lost, 999 - 1 + 998_999);
        assert_eq!(arrivals.late, 3);
    }

    #[test]
    fn every_number_passes_at_most_once_and_only_upwards_in_any_order() {
        // A generator of Lehmer's, so that the shuffling is the same each time.
        let mut state: u64 = 1;
        let mut gate = held(1);
        let mut newest = None;
        for step in 0..20_000_u64 {
            state = state * 48_271 % 0x7fff_ffff;
            let counter = (step / 2 + 300).saturating_sub(state % 300);
            let passes = gate.judge(1, counter, said(counter)) == Order::Newer;
            assert_eq!(passes, newest.is_none_or(|newest| counter > newest));
            newest = newest.max(Some(counter));
        }
        let arrivals = gate.arrivals();
        assert_eq!(arrivals.received, 20_000);
        assert!(
            arrivals.late > 1_000 && arrivals.duplicated > 1_000,
            "{arrivals:?}"
        );
    }

    #[test]
    fn the_first_bridge_keeps_the_stream_and_a_rival_that_comes_and_goes_leaves_no_trace() {
        let mut gate = held(1);
        assert_eq!(gate.judge(1, 500, said(500)), Order::Newer);
        assert!(!gate.ask(2, LEASE_US - 1));
        assert_eq!(gate.judge(2, 0, said(7)), Order::Rival);
        assert_eq!(gate.judge(1, 501, said(501)), Order::Newer);
        let arrivals = gate.arrivals();
        assert_eq!((arrivals.superseded, arrivals.lost), (1, 0));
    }

    #[test]
    fn a_stream_is_taken_when_its_bridge_leaves_or_is_silent() {
        let mut gate = held(1);
        assert!(!gate.ask(1, 5));
        assert!(!gate.ask(2, 4 + LEASE_US));
        assert!(gate.ask(2, 5 + LEASE_US));
        assert_eq!(gate.judge(1, 9, said(9)), Order::Rival);
        gate.leave(1);
        assert!(gate.is_holder(2), "it was another's to leave");
        gate.leave(2);
        assert!(gate.ask(1, 6 + LEASE_US));
        assert_eq!(gate.judge(1, 9, said(9)), Order::Newer);
    }

    #[test]
    fn a_stream_is_handed_over_by_its_holder_to_who_waits_and_by_nobody_else() {
        let mut gate = held(1);
        assert!(!gate.hand_over(1, 1), "nobody waits");
        assert!(!gate.ask(2, 2));
        assert!(!gate.ask(3, 3));
        assert!(!gate.hand_over(2, 4), "it is not its own");
        assert!(!gate.hand_over(3, 4), "nor this one's");
        assert!(gate.hand_over(1, 4));
        assert!(gate.is_holder(2), "who waits longest has it");
        assert!(!gate.ask(1, 5), "it waits now");
        assert!(!gate.hand_over(2, 5 + LEASE_US), "who waited is silent");
    }

    #[test]
    fn what_a_bridge_says_while_another_holds_the_stream_is_not_lost_once_it_holds_it_again() {
        let mut gate = held(1);
        assert_eq!(gate.judge(1, 9, said(9)), Order::Newer);
        assert!(!gate.ask(2, 1));
        assert!(gate.hand_over(1, 2));
        for counter in 10..1_000 {
            assert_eq!(gate.judge(1, counter, said(counter)), Order::Rival);
        }
        assert!(gate.ask(1, 1 + LEASE_US), "the second one is silent");
        assert_eq!(gate.judge(1, 999, said(999)), Order::Duplicate);
        // Two are lost on the way.
        assert_eq!(gate.judge(1, 1_002, said(1_002)), Order::Newer);
        let arrivals = gate.arrivals();
        assert_eq!((arrivals.superseded, arrivals.lost), (990, 2));
    }

    #[test]
    fn nothing_that_a_bridge_said_passes_again_when_it_has_left_or_was_silent() {
        let mut gate = held(1);
        assert_eq!(gate.judge(1, 9, said(9)), Order::Newer);
        assert!(gate.ask(2, LEASE_US), "the first one is silent");
        assert!(gate.ask(1, 2 * LEASE_US), "and is back");
        assert_eq!(gate.judge(1, 9, said(9)), Order::Duplicate);
        assert_eq!(gate.judge(1, 10, said(10)), Order::Newer);
        gate.leave(1);
        assert!(!gate.ask(1, 9 * LEASE_US), "it has left for good");
        assert_eq!(gate.judge(1, 11, said(11)), Order::Rival);
        // However many there were, no more is kept of them.
        for session in 3..1_000 {
            assert!(gate.ask(session, session * LEASE_US * 2));
            assert!(gate.past.len() <= PAST);
        }
    }

    #[test]
    fn a_board_that_was_started_anew_is_followed_and_one_that_repeats_itself_is_not() {
        let mut gate = held(1);
        let say = |start, sequence| SequenceNumber { start, sequence };
        assert_eq!(gate.judge(1, 1, say(0, 900)), Order::Newer);
        assert_eq!(gate.judge(1, 2, say(0, 900)), Order::Repeated);
        assert_eq!(gate.judge(1, 3, say(0, 899)), Order::Repeated);
        assert_eq!(gate.judge(1, 4, say(1, 0)), Order::Newer);
        assert_eq!(gate.judge(1, 5, say(1, 1)), Order::Newer);
        assert_eq!(gate.arrivals().superseded, 2);
    }

    #[test]
    fn more_lost_ones_than_any_number_holds_are_as_many_as_it_holds() {
        let mut gate = held(1);
        for session in [1, 2] {
            gate.ask(session, session * LEASE_US);
            assert_eq!(gate.judge(session, 0, said(0)), Order::Newer);
            assert_eq!(gate.judge(session, u64::MAX, said(1)), Order::Newer);
        }
        assert_eq!(gate.arrivals().lost, u64::MAX);
    }

    #[test]
    fn a_boards_count_may_wrap() {
        let mut gate = held(1);
        let say = |sequence| SequenceNumber { start: 0, sequence };
        assert_eq!(gate.judge(1, 1, say(u32::MAX)), Order::Newer);
        assert_eq!(gate.judge(1, 2, say(0)), Order::Newer);
    }
}
