//! What the receiver makes of good, bad and missing frames, and how it counts them.

use crate::messages::{
    events, foreign_hello, greeted_receiver, hello, longest_like, numbered, raw_frame, samples,
};
use protocol::{
    Event, MAX_FRAME, Message, Peer, Ping, PortCounters, Receiver, Stop, StopReason, Stopped, Trip,
};

/// A message that names the frame it stood in.
fn ping(n: u16) -> Message {
    Message::Ping(Ping { sent_us: n.into() })
}

fn ping_frame(sequence: u16) -> Vec<u8> {
    numbered(sequence, &ping(sequence))
}

/// The pings handed on for frames of these numbers, by number.
fn heard(receiver: &mut Receiver, sequences: impl IntoIterator<Item = u16>) -> Vec<u64> {
    let mut heard = Vec::new();
    for sequence in sequences {
        for event in events(receiver, &ping_frame(sequence)) {
            let Event::Message(Message::Ping(ping)) = event else {
                panic!("only pings were sent, not {event:?}");
            };
            heard.push(ping.sent_us);
        }
    }
    heard
}

fn hello_frame(sequence: u16, asks: bool) -> Vec<u8> {
    numbered(sequence, &Message::Hello(hello().asking(asks)))
}

/// Counters with only the fields that differ from 0 given.
macro_rules! counted {
    ($($field:ident: $value:expr),* $(,)?) => {
        PortCounters { $($field: $value,)* ..PortCounters::new() }
    };
}

#[test]
fn the_longest_message_of_every_kind_fits_and_the_longest_of_all_fills_a_frame() {
    let mut longest = 0;
    for (name, message) in samples() {
        let message = longest_like(&message);
        let mut receiver = greeted_receiver();
        let frame = numbered(1, &message);
        assert!(frame.len() <= MAX_FRAME, "{name}");
        longest = longest.max(frame.len());
        let expected = match &message {
            Message::Hello(hello) => Event::Greeted(*hello),
            message => Event::Message(message.clone()),
        };
        assert_eq!(events(&mut receiver, &frame), [expected], "{name}");
    }
    assert_eq!(longest, MAX_FRAME);
}

#[test]
fn received_counts_what_is_handed_on() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, 1..=5), [1, 2, 3, 4, 5]);
    assert_eq!(receiver.counters(), counted!(received: 1 + 5));
}

#[test]
fn lost_counts_gaps() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, [1, 4, 5, 10]), [1, 4, 5, 10]);
    assert_eq!(receiver.counters(), counted!(received: 1 + 4, lost: 2 + 4));
}

#[test]
fn a_late_frame_fills_its_gap_and_is_not_handed_on() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, [1, 3, 2, 4]), [1, 3, 4]);
    assert_eq!(receiver.counters(), counted!(received: 1 + 3, late: 1));
}

#[test]
fn a_frame_from_before_the_first_one_heard_is_late_but_was_never_lost() {
    let mut receiver = Receiver::new();
    events(&mut receiver, &hello_frame(10, true));
    assert_eq!(heard(&mut receiver, [8, 9, 11]), [11]);
    assert_eq!(receiver.counters(), counted!(received: 2, late: 2));
}

#[test]
fn a_duplicate_is_counted_and_not_handed_on() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, [1, 1, 2, 1, 3]), [1, 2, 3]);
    assert_eq!(
        receiver.counters(),
        counted!(received: 1 + 3, duplicated: 2)
    );
}

#[test]
fn a_late_frame_that_comes_twice_is_late_once_and_then_a_duplicate() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, [1, 3, 2, 2]), [1, 3]);
    assert_eq!(
        receiver.counters(),
        counted!(received: 1 + 2, late: 1, duplicated: 1)
    );
}

#[test]
fn the_numbers_wrap_without_a_trace() {
    let mut receiver = greeted_receiver();
    let whole_turn: Vec<u16> = (1..=u16::MAX).chain(0..10).collect();
    let frames = whole_turn.len();
    assert_eq!(heard(&mut receiver, whole_turn).len(), frames);
    assert_eq!(receiver.counters(), counted!(received: 1 + frames as u32));
    // Gaps, late ones and duplicates are still told apart across the wrap.
    let mut receiver = Receiver::new();
    events(&mut receiver, &hello_frame(u16::MAX - 2, true));
    let around = [u16::MAX - 1, 1, u16::MAX, 0, 0, 2];
    assert_eq!(
        heard(&mut receiver, around),
        [u64::from(u16::MAX) - 1, 1, 2]
    );
    assert_eq!(
        receiver.counters(),
        counted!(received: 1 + 3, late: 2, duplicated: 1)
    );
}

#[test]
fn a_gap_longer_than_the_window_is_counted_whole() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, [1_000, 999, 745, 744]), [1_000]);
    // 1 to 999 never came in time; 999 and 745 are within the window of 256 and fill their gap,
    // 744 is late too but too far back to know whether it was counted.
    assert_eq!(
        receiver.counters(),
        counted!(received: 2, lost: 999 - 2, late: 3)
    );
}

#[test]
fn a_flipped_bit_is_corrupt_and_leaves_a_gap() {
    let mut receiver = greeted_receiver();
    let mut frame = ping_frame(1);
    frame[4] ^= 0x10;
    assert_eq!(events(&mut receiver, &frame), []);
    assert_eq!(heard(&mut receiver, [2]), [2]);
    assert_eq!(
        receiver.counters(),
        counted!(received: 2, corrupt: 1, lost: 1)
    );
}

#[test]
fn broken_cobs_and_frames_too_short_for_a_crc_are_corrupt() {
    let mut receiver = greeted_receiver();
    // The first code byte points beyond the end; the second frame is two bytes, a sequence only.
    assert_eq!(events(&mut receiver, &[9, 1, 1, 0, 3, 1, 1, 0]), []);
    assert_eq!(receiver.counters(), counted!(received: 1, corrupt: 2));
}

#[test]
fn empty_frames_are_no_error() {
    let mut receiver = greeted_receiver();
    assert_eq!(events(&mut receiver, &[0; 100]), []);
    assert_eq!(heard(&mut receiver, [1]), [1]);
    assert_eq!(receiver.counters(), counted!(received: 2));
}

#[test]
fn a_frame_without_end_is_overlong_once_and_passed_over() {
    let mut receiver = greeted_receiver();
    assert_eq!(events(&mut receiver, &[0x55; 10 * MAX_FRAME]), []);
    assert_eq!(receiver.counters(), counted!(received: 1));
    assert_eq!(events(&mut receiver, &[0]), []);
    assert_eq!(heard(&mut receiver, [1]), [1]);
    assert_eq!(receiver.counters(), counted!(received: 2, overlong: 1));
}

#[test]
fn one_byte_more_than_the_longest_frame_is_overlong() {
    let mut receiver = greeted_receiver();
    let mut bytes = vec![0x55; MAX_FRAME - 1];
    bytes.push(0);
    events(&mut receiver, &bytes);
    assert_eq!(receiver.counters(), counted!(received: 1, corrupt: 1));
    bytes.insert(0, 0x55);
    events(&mut receiver, &bytes);
    assert_eq!(
        receiver.counters(),
        counted!(received: 1, corrupt: 1, overlong: 1)
    );
}

#[test]
fn good_frames_that_hold_no_message_are_malformed() {
    let payload = postcard::to_stdvec(&ping(300)).expect("it encodes");
    let mut longer = payload.clone();
    longer.push(0);
    let mut no_magic = vec![0];
    no_magic.extend(hello().to_bytes());
    no_magic[1] ^= 1;
    let payloads: [&[u8]; 11] = [
        &[],
        &[200],
        &payload[..payload.len() - 1],
        &longer,
        &[0],
        &no_magic,
        // What is frozen, cut or too long, or as a message of this version.
        b"\0STOP",
        b"\0STOP\0\0",
        b"\0HAL\0",
        &[9, 0],
        &[12, 0],
    ];

    let mut receiver = greeted_receiver();
    for (payload, sequence) in payloads.iter().zip(1..) {
        assert_eq!(events(&mut receiver, &raw_frame(sequence, payload)), []);
    }
    assert_eq!(
        receiver.counters(),
        counted!(received: 1, malformed: payloads.len() as u32)
    );
}

#[test]
fn frames_before_a_hello_are_unheralded_and_not_read() {
    let mut receiver = Receiver::new();
    assert_eq!(events(&mut receiver, &ping_frame(500)), [Event::Unheralded]);
    assert_eq!(receiver.peer(), Peer::Silent);
    // Not even tried: what holds no message is unheralded too.
    assert_eq!(
        events(&mut receiver, &raw_frame(501, &[200])),
        [Event::Unheralded]
    );
    assert_eq!(
        events(&mut receiver, &hello_frame(502, false)),
        [Event::Greeted(hello().asking(false))]
    );
    assert_eq!(heard(&mut receiver, [503]), [503]);
    assert_eq!(receiver.counters(), counted!(received: 2, unheralded: 2));
}

#[test]
fn a_foreign_peer_is_recognised_and_not_read_until_a_compatible_one_comes() {
    let mut receiver = greeted_receiver();
    assert_eq!(
        events(
            &mut receiver,
            &numbered(1, &Message::Hello(foreign_hello()))
        ),
        [Event::Foreign(foreign_hello())]
    );
    assert_eq!(receiver.peer(), Peer::Foreign(foreign_hello()));
    // A message of this version, and one that this version could not read.
    assert_eq!(events(&mut receiver, &ping_frame(2)), []);
    assert_eq!(events(&mut receiver, &raw_frame(3, &[200, 1, 2])), []);
    assert_eq!(receiver.counters(), counted!(received: 1, foreign: 3));

    assert_eq!(
        events(&mut receiver, &hello_frame(4, true)),
        [Event::Greeted(hello())]
    );
    assert_eq!(receiver.peer(), Peer::Known(hello()));
    assert_eq!(heard(&mut receiver, [5]), [5]);
    assert_eq!(receiver.counters(), counted!(received: 3, foreign: 3));
}

#[test]
fn another_schema_is_as_foreign_as_another_version() {
    let mut other = hello();
    other.schema[3] ^= 1;
    let mut receiver = Receiver::new();
    assert_eq!(
        events(&mut receiver, &numbered(0, &Message::Hello(other))),
        [Event::Foreign(other)]
    );
}

#[test]
fn a_hello_is_handed_on_even_if_it_is_late_or_came_before() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, [1, 3]), [1, 3]);
    for _ in 0..2 {
        assert_eq!(
            events(&mut receiver, &hello_frame(2, false)),
            [Event::Greeted(hello().asking(false))]
        );
    }
    assert_eq!(
        receiver.counters(),
        counted!(received: 3, late: 1, duplicated: 1)
    );
}

#[test]
fn a_restarted_peer_is_heard_at_once_whatever_number_it_had_reached() {
    // Shortly after its own start, after a while, half a turn of the numbers on, near the wrap.
    for reached in [1, 3, 255, 256, 257, 5_000, 32_767, 32_768, 40_000, u16::MAX] {
        let mut receiver = Receiver::new();
        events(&mut receiver, &hello_frame(reached - 1, true));
        assert_eq!(heard(&mut receiver, [reached]), [u64::from(reached)]);
        let before = receiver.counters();

        assert_eq!(
            events(&mut receiver, &hello_frame(0, true)),
            [Event::Greeted(hello())],
            "reached {reached}"
        );
        let after: Vec<u64> = (1..300).collect();
        assert_eq!(heard(&mut receiver, 1..300), after, "reached {reached}");

        assert_eq!(
            receiver.counters(),
            counted!(received: before.received + 1 + 299),
            "reached {reached}"
        );
    }
}

#[test]
fn a_peer_cut_off_for_half_a_turn_of_the_numbers_is_not_late_for_ever() {
    let mut receiver = greeted_receiver();
    assert_eq!(heard(&mut receiver, [1]), [1]);
    // 40 000 frames later, without a Hello: seven are taken for very old ones, the eighth is not.
    let heard = heard(&mut receiver, 40_000..40_020);
    assert_eq!(heard, (40_007..40_020).collect::<Vec<u64>>());
    assert_eq!(receiver.counters(), counted!(received: 2 + 13, late: 7));
}

#[test]
fn a_few_very_old_frames_do_not_move_the_stream() {
    let mut receiver = Receiver::new();
    events(&mut receiver, &hello_frame(1_000, true));
    for round in 0..10 {
        assert_eq!(
            heard(&mut receiver, 100 * round / 20..100 * round / 20 + 7),
            []
        );
        assert_eq!(
            heard(&mut receiver, [1_001 + round]),
            [1_001 + u64::from(round)]
        );
    }
    assert_eq!(receiver.counters(), counted!(received: 11, late: 70));
}

/// A Stop, and the answer to one.
fn stops() -> [Message; 2] {
    [
        Message::Stop(Stop {
            reason: StopReason::Operator,
        }),
        Message::Stopped(Stopped::by(Trip::Limit)),
    ]
}

#[test]
fn a_stop_is_handed_on_from_whoever_says_it_and_leaves_what_is_known_of_him() {
    for stop in stops() {
        let silent = Receiver::new();
        let mut text = Receiver::new();
        assert_eq!(events(&mut text, b"lambda none\r\n\0"), [Event::Text]);
        let mut foreign = Receiver::new();
        events(&mut foreign, &numbered(4, &Message::Hello(foreign_hello())));
        for mut receiver in [silent, text, foreign, greeted_receiver()] {
            let before = (receiver.peer(), receiver.counters().received);
            let heard = events(&mut receiver, &numbered(5, &stop));
            assert_eq!(heard, [Event::Message(stop.clone())]);
            let after = (receiver.peer(), receiver.counters().received);
            assert_eq!(after, (before.0, before.1 + 1));
        }
    }
}

#[test]
fn a_stop_is_handed_on_late_and_twice_and_counted_so() {
    for stop in stops() {
        let mut receiver = greeted_receiver();
        assert_eq!(heard(&mut receiver, [1, 3]), [1, 3]);
        for _ in 0..2 {
            let heard = events(&mut receiver, &numbered(2, &stop));
            assert_eq!(heard, [Event::Message(stop.clone())]);
        }
        assert_eq!(
            receiver.counters(),
            counted!(received: 3, late: 1, duplicated: 1)
        );
    }
}

#[test]
fn a_stop_of_somebody_who_numbers_for_himself_puts_nothing_out_of_step() {
    for (number, stop) in [0, 20_000, 40_000].into_iter().zip(stops().iter().cycle()) {
        let mut receiver = Receiver::new();
        events(&mut receiver, &hello_frame(5_000, true));
        let stopped = events(&mut receiver, &numbered(number, stop));
        assert_eq!(stopped, [Event::Message(stop.clone())]);
        assert_eq!(heard(&mut receiver, 5_001..5_010).len(), 9);
        assert_eq!(receiver.counters(), counted!(received: 11));
    }
}
