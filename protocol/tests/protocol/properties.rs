//! What holds for every message, every corruption and every cut.

use crate::messages::{
    content, events, frame_of, greeted_receiver, hello, message, numbered, open_sender,
};
use proptest::prelude::*;
use protocol::{Event, MAX_FRAME, Message, PortCounters, Receiver, Stop, StopReason, Stopped};

fn expected(message: &Message) -> Event {
    match message {
        Message::Hello(hello) => Event::Greeted(*hello),
        message => Event::Message(message.clone()),
    }
}

/// Every frame that ended is counted exactly once; lines of text are not.
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

/// A stream of frames, lines of text and garbage, as it may come from a port: garbage never holds a 0x00.
fn stream() -> impl Strategy<Value = Vec<u8>> {
    let garbage = proptest::collection::vec(1_u8.., 1..2 * MAX_FRAME).prop_map(|mut bytes| {
        bytes.push(0);
        bytes
    });
    let frame =
        (any::<u16>(), message()).prop_map(|(sequence, message)| numbered(sequence, &message));
    let line = "[ -~]{0,40}\r\n\0".prop_map(String::into_bytes);
    proptest::collection::vec(
        prop_oneof![3 => frame, 1 => garbage, 1 => line, 1 => Just(vec![0])],
        0..20,
    )
    .prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn every_message_comes_out_as_it_went_in(messages in proptest::collection::vec(message(), 1..20)) {
        let mut sender = open_sender();
        let mut bytes = frame_of(&mut sender, &Message::Hello(hello()));
        let mut out = vec![Event::Greeted(hello())];
        for message in &messages {
            let frame = frame_of(&mut sender, message);
            prop_assert_eq!(frame.iter().position(|&byte| byte == 0), Some(frame.len() - 1));
            bytes.extend(frame);
            out.push(expected(message));
        }
        let mut receiver = Receiver::new();
        prop_assert_eq!(events(&mut receiver, &bytes), out);
        let received = 1 + messages.len() as u32;
        prop_assert_eq!(receiver.counters(), PortCounters { received, ..PortCounters::new() });
    }

    #[test]
    fn a_corrupted_frame_is_never_taken_for_another_and_the_next_one_is_received(
        message in content(),
        next in content(),
        flips in proptest::collection::vec((any::<prop::sample::Index>(), 1_u8..), 1..12),
    ) {
        let good = numbered(1, &message);
        let mut bad = good.clone();
        for (at, flip) in flips {
            // The closing 0x00 stays: without it the next frame is this one's end.
            let at = at.index(bad.len() - 1);
            bad[at] ^= flip;
        }
        let mut receiver = greeted_receiver();
        let received = events(&mut receiver, &bad);
        if bad == good {
            prop_assert_eq!(received, [Event::Message(message)]);
        } else {
            prop_assert_eq!(received, []);
            let counters = receiver.counters();
            prop_assert!(counters.corrupt >= 1);
            prop_assert_eq!(frames_counted(&counters), 1 + counters.corrupt);
        }
        let received = events(&mut receiver, &numbered(2, &next));
        prop_assert_eq!(received, [Event::Message(next)]);
    }

    #[test]
    fn a_lost_end_costs_the_two_frames_that_run_together_and_no_more(
        messages in proptest::collection::vec(content(), 3),
        end in 1_u8..,
    ) {
        let mut bytes = numbered(1, &messages[0]);
        *bytes.last_mut().expect("not empty") = end;
        bytes.extend(numbered(2, &messages[1]));
        bytes.extend(numbered(3, &messages[2]));
        let mut receiver = greeted_receiver();
        prop_assert_eq!(
            events(&mut receiver, &bytes),
            [Event::Message(messages[2].clone())]
        );
        let counters = receiver.counters();
        prop_assert_eq!(counters.corrupt + counters.overlong, 1);
        prop_assert_eq!(counters.lost, 2);
    }

    #[test]
    fn a_frame_cut_short_or_begun_late_costs_itself_only(
        message in content(),
        next in content(),
        cut in any::<prop::sample::Index>(),
        keep_the_start: bool,
    ) {
        let frame = numbered(1, &message);
        let body = &frame[..frame.len() - 1];
        // At least one byte is missing, at least one is left.
        let cut = 1 + cut.index(body.len() - 1);
        let mut bytes = if keep_the_start { body[..cut].to_vec() } else { body[cut..].to_vec() };
        bytes.push(0);
        bytes.extend(numbered(2, &next));
        let mut receiver = greeted_receiver();
        prop_assert_eq!(events(&mut receiver, &bytes), [Event::Message(next)]);
        prop_assert_eq!(receiver.counters().corrupt, 1);
        prop_assert_eq!(receiver.counters().lost, 1);
    }

    #[test]
    fn portions_make_no_difference(
        bytes in stream(),
        cuts in proptest::collection::vec(any::<prop::sample::Index>(), 0..40),
    ) {
        let mut whole = Receiver::new();
        let at_once = events(&mut whole, &bytes);

        let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut.index(bytes.len() + 1)).collect();
        cuts.extend([0, bytes.len()]);
        cuts.sort_unstable();
        let mut cut = Receiver::new();
        let mut in_portions = Vec::new();
        for portion in cuts.windows(2) {
            in_portions.extend(events(&mut cut, &bytes[portion[0]..portion[1]]));
        }
        let mut byte_by_byte = Receiver::new();
        let singly: Vec<Event> = bytes
            .iter()
            .flat_map(|byte| events(&mut byte_by_byte, core::slice::from_ref(byte)))
            .collect();

        prop_assert_eq!(&in_portions, &at_once);
        prop_assert_eq!(&singly, &at_once);
        prop_assert_eq!(cut.counters(), whole.counters());
        prop_assert_eq!(byte_by_byte.counters(), whole.counters());
        prop_assert_eq!(cut.peer(), whole.peer());
    }

    #[test]
    fn every_frame_that_ends_is_counted_once(bytes in stream()) {
        let mut receiver = Receiver::new();
        let lines = events(&mut receiver, &bytes).into_iter().filter(|event| *event == Event::Text);
        let lines = lines.count() as u32;
        let ended = bytes.split_inclusive(|&byte| byte == 0).filter(|frame| frame.len() > 1).count();
        prop_assert_eq!(lines + frames_counted(&receiver.counters()), ended as u32);
    }

    #[test]
    fn after_any_garbage_and_a_zero_it_is_in_step_again(
        garbage in proptest::collection::vec(any::<u8>(), 0..4 * MAX_FRAME),
        message in content(),
    ) {
        let mut receiver = greeted_receiver();
        events(&mut receiver, &garbage);
        events(&mut receiver, &[0]);
        let received = events(&mut receiver, &numbered(1, &message));
        prop_assert_eq!(received, [Event::Message(message)]);
    }

    #[test]
    fn no_order_of_arrival_hands_on_a_frame_twice_or_an_older_one_after_a_newer(
        // Frames moved by up to 40 places, some left out, some twice.
        arrivals in proptest::collection::vec((0_u16..40, 0_u8..10), 1..400),
        first in any::<u16>(),
    ) {
        let mut sent: Vec<(u16, u16)> = Vec::new();
        for (n, (delay, fate)) in (1..).zip(&arrivals) {
            let copies = match fate { 0 => 0, 1 => 2, _ => 1 };
            for copy in 0..copies {
                sent.push((n + delay + 7 * copy, n));
            }
        }
        sent.sort();
        let mut receiver = Receiver::new();
        events(&mut receiver, &numbered(first, &Message::Hello(hello())));
        let mut heard = Vec::new();
        for &(_, n) in &sent {
            let message = Message::Ping(protocol::Ping { sent_us: n.into() });
            for event in events(&mut receiver, &numbered(first.wrapping_add(n), &message)) {
                prop_assert_eq!(&event, &Event::Message(message.clone()));
                heard.push(n);
            }
        }
        prop_assert!(heard.is_sorted_by(|a, b| a < b));

        // The books balance: what came once is received or late, the rest of the copies duplicated,
        // and what did not come, up to the last that did, is lost.
        let counters = receiver.counters();
        let mut distinct: Vec<u16> = sent.iter().map(|&(_, n)| n).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let newest = distinct.last().copied().unwrap_or(0);
        prop_assert_eq!(counters.received + counters.late, 1 + distinct.len() as u32);
        prop_assert_eq!(counters.duplicated as usize, sent.len() - distinct.len());
        prop_assert_eq!(counters.lost as usize, usize::from(newest) - distinct.len());
    }

    #[test]
    fn a_stop_is_heard_whatever_came_before_it(
        before in stream(),
        garbage in proptest::collection::vec(any::<u8>(), 0..2 * MAX_FRAME),
        sequence in any::<u16>(),
        stop in prop_oneof![
            any::<bool>().prop_map(|by_operator| {
                let reason = if by_operator { StopReason::Operator } else { StopReason::Host };
                Message::Stop(Stop { reason })
            }),
            any::<u8>().prop_map(|cause| Message::Stopped(Stopped { cause })),
        ],
    ) {
        let mut receiver = Receiver::new();
        events(&mut receiver, &before);
        events(&mut receiver, &garbage);
        events(&mut receiver, &[0]);
        let heard = events(&mut receiver, &numbered(sequence, &stop));
        prop_assert_eq!(heard, [Event::Message(stop)]);
    }
}
