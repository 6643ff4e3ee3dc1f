//! Two ports, joined in memory.

use protocol::port::QUEUE_BYTES;
use protocol::{
    Arm, ArmState, DisplayState, Hello, Message, Peer, Ping, Port, Role, Safety, Stop, StopReason,
    Stopped, Trip,
};

fn port(role: Role) -> Port {
    Port::new(Hello::new(role, "test", [1, 2, 3]))
}

/// Carries all that `from` has to say to `to`; returns what `to` hands on.
fn carry(from: &mut Port, to: &mut Port, now_us: u64) -> Vec<Message> {
    let mut messages = Vec::new();
    let mut bytes = [0; 64];
    loop {
        let count = from.take(&mut bytes);
        if count == 0 {
            return messages;
        }
        to.receive(now_us, &bytes[..count], |message| messages.push(message));
    }
}

/// Two ports that know each other.
fn acquainted() -> (Port, Port) {
    let (mut sensor, mut host) = (port(Role::Sensor), port(Role::Host));
    sensor.poll(0);
    assert!(carry(&mut sensor, &mut host, 0).is_empty());
    assert!(carry(&mut host, &mut sensor, 0).is_empty());
    (sensor, host)
}

/// A message like any other.
const WORD: Message = Message::Safety(Safety {
    instant_us: 7,
    state: DisplayState::Ready,
});
const ARM: Message = Message::Arm(Arm {
    instant_us: 8,
    state: ArmState::Stopped(Trip::Operator),
});
const STOP: Message = Message::Stop(Stop {
    reason: StopReason::Operator,
});

/// What a display says of its own halt.
const fn halted(state: DisplayState) -> Message {
    Message::Safety(Safety {
        instant_us: 7,
        state,
    })
}

#[test]
fn two_ports_know_each_other_after_one_exchange() {
    let (sensor, host) = acquainted();
    assert!(matches!(sensor.peer(), Peer::Known(hello) if hello.role == Role::Host.byte()));
    assert!(matches!(host.peer(), Peer::Known(hello) if hello.role == Role::Sensor.byte()));
}

#[test]
fn a_port_tells_once_that_its_peer_has_asked_for_a_greeting() {
    let (mut sensor, mut host) = (port(Role::Sensor), port(Role::Host));
    // At its start, and when it has started again.
    for _ in 0..2 {
        sensor.poll(0);
        carry(&mut sensor, &mut host, 0);
        assert!(host.take_asked());
        carry(&mut host, &mut sensor, 0);
        sensor.post(&WORD);
        assert_eq!(carry(&mut sensor, &mut host, 0), [WORD]);
        assert!(!host.take_asked() && !sensor.take_asked());
        sensor = port(Role::Sensor);
    }
}

#[test]
fn the_exchange_of_greetings_ends() {
    let (mut sensor, mut host) = acquainted();
    for _ in 0..4 {
        carry(&mut sensor, &mut host, 0);
        carry(&mut host, &mut sensor, 0);
    }
    for now_us in (0..5_000_000).step_by(100_000) {
        sensor.poll(now_us);
        host.poll(now_us);
    }
    assert!(!sensor.has_bytes() && !host.has_bytes());
}

#[test]
fn nothing_is_said_to_a_port_that_nobody_listens_on() {
    let mut alone = port(Role::Display);
    alone.post(&WORD);
    assert!(!alone.has_bytes());
    assert_eq!(alone.counters().sent, 0);
}

#[test]
fn a_message_is_handed_on_once_and_whole() {
    let (mut sensor, mut host) = acquainted();
    host.post(&WORD);
    assert_eq!(carry(&mut host, &mut sensor, 1), [WORD]);
    assert!(carry(&mut host, &mut sensor, 1).is_empty());
}

#[test]
fn a_ping_is_answered_with_the_clock_of_its_arrival() {
    let (mut sensor, mut host) = acquainted();
    host.post(&Message::Ping(Ping { sent_us: 77 }));
    assert!(carry(&mut host, &mut sensor, 500).is_empty());
    let answers = carry(&mut sensor, &mut host, 600);
    let [Message::Pong(pong)] = answers[..] else {
        panic!("one pong, not {answers:?}");
    };
    assert_eq!(
        (pong.sent_us, pong.received_us, pong.answered_us),
        (77, 500, 500)
    );
}

#[test]
fn a_full_queue_drops_whole_frames_and_counts_them() {
    let (mut sensor, mut host) = acquainted();
    let posts = 1_000;
    for _ in 0..posts {
        host.post(&WORD);
    }
    let dropped = host.counters().dropped;
    assert!(dropped > 0, "1 000 frames are more than the queue holds");
    let received = carry(&mut host, &mut sensor, 1);
    assert_eq!(received.len() as u32 + dropped, posts);
    let counters = sensor.counters();
    assert_eq!((counters.corrupt, counters.lost), (0, 0));
}

#[test]
fn overruns_and_line_errors_are_in_the_counters() {
    let mut noisy = port(Role::Display);
    noisy.on_overrun();
    noisy.on_line_error();
    noisy.on_line_error();
    let counters = noisy.counters();
    assert_eq!((counters.overruns, counters.line_errors), (1, 2));
}

#[test]
fn a_port_whose_peer_was_reflashed_with_another_version_tells_it_so() {
    let (mut sensor, _) = acquainted();
    let mut foreign = Hello::new(Role::Host, "test", [9, 0, 0]);
    foreign.protocol = [0xFF, 0xFF];
    let mut reflashed = Port::new(foreign);
    reflashed.poll(2_000_000);
    assert!(carry(&mut reflashed, &mut sensor, 2_000_000).is_empty());
    assert!(matches!(sensor.peer(), Peer::Foreign(hello) if hello.version == [9, 0, 0]));
    sensor.post(&WORD);
    sensor.poll(4_000_000);
    let handed_on = carry(&mut sensor, &mut reflashed, 4_000_000);
    assert!(handed_on.is_empty(), "greetings only, not {handed_on:?}");
    assert!(
        matches!(reflashed.peer(), Peer::Known(_)),
        "it was told who speaks"
    );
}

#[test]
fn a_stop_and_its_answer_go_out_to_whoever_is_there() {
    let stopped = Message::Stopped(Stopped::by(Trip::Operator));
    let mut foreign = Hello::new(Role::Host, "test", [9, 0, 0]);
    foreign.protocol = [0xFF, 0xFF];
    // Nobody, and somebody of another version.
    for stranger in [None, Some(foreign)] {
        let (mut host, mut board) = (port(Role::Host), port(Role::Display));
        if let Some(hello) = stranger {
            host = Port::new(hello);
            host.poll(0);
            carry(&mut host, &mut board, 0);
            carry(&mut board, &mut host, 0);
            assert!(matches!(board.peer(), Peer::Foreign(_)));
        }
        host.post(&STOP);
        assert_eq!(carry(&mut host, &mut board, 1), [STOP]);
        board.post(&stopped);
        let answered = carry(&mut board, &mut host, 2);
        assert_eq!(answered, std::slice::from_ref(&stopped));
    }
}

#[test]
fn a_stop_takes_the_place_of_all_that_waits_and_nothing_that_went_out_before_spoils_it() {
    let (mut host, mut board) = acquainted();
    while host.counters().dropped == 0 {
        host.post(&WORD);
    }
    // The beginning of a frame is gone already.
    let mut begun = [0; 5];
    assert_eq!(host.take(&mut begun), begun.len());
    board.receive(1, &begun, |message| panic!("{message:?}"));
    host.post(&STOP);
    let mut bytes = [0; QUEUE_BYTES];
    let count = host.take(&mut bytes);
    assert!(count <= 20, "{count} bytes before the Stop's end");
    let mut heard = Vec::new();
    board.receive(1, &bytes[..count], |message| heard.push(message));
    assert_eq!(heard, [STOP]);
    // All that was posted is accounted for.
    let counters = host.counters();
    let words = counters.sent - 2;
    assert_eq!(counters.dropped, words + 1, "{counters:?}");
    assert_eq!(board.counters().corrupt, 1);
}

#[test]
fn a_stop_that_is_said_again_counts_each_frame_once_that_it_takes_the_place_of() {
    let (mut host, mut board) = acquainted();
    host.post(&WORD);
    // All of the word has gone out but its end, which the Stop's 0x00 is.
    let mut bytes = [0; QUEUE_BYTES];
    let count = host.take(&mut bytes);
    host.post(&WORD);
    let mut again = [0; QUEUE_BYTES];
    let but_its_end = host.take(&mut again[..count - 1]);
    board.receive(1, &bytes[..count], |message| assert_eq!(message, WORD));
    board.receive(1, &again[..but_its_end], |message| panic!("{message:?}"));
    host.post(&STOP);
    assert_eq!(host.counters().dropped, 0);
    for said in 1..4 {
        host.post(&STOP);
        assert_eq!(host.counters().dropped, said);
    }
    assert_eq!(carry(&mut host, &mut board, 1), [WORD, STOP]);
}

/// A board stops by its own and passes a Stop on: both in one instant.
#[test]
fn a_stop_does_not_take_the_place_of_what_a_board_says_of_its_own_halt() {
    for halt in [halted(DisplayState::Stopped(Trip::Operator)), ARM] {
        let (mut board, mut host) = acquainted();
        board.post(&WORD);
        board.post(&halt);
        for _ in 0..3 {
            board.post(&STOP);
        }
        assert_eq!(carry(&mut board, &mut host, 1), [STOP, halt.clone()]);
        // It has gone out.
        board.post(&STOP);
        assert_eq!(carry(&mut board, &mut host, 2), [STOP]);
    }
}

#[test]
fn what_a_board_says_of_its_own_halt_is_heard_however_much_of_it_has_gone_out() {
    let halt = halted(DisplayState::Stopped(Trip::Operator));
    let length = {
        let (mut board, _) = acquainted();
        board.post(&halt);
        board.take(&mut [0; QUEUE_BYTES])
    };
    for gone in 0..=length {
        let (mut board, mut host) = acquainted();
        board.post(&halt);
        let mut bytes = [0; QUEUE_BYTES];
        assert_eq!(board.take(&mut bytes[..gone]), gone);
        let mut heard = Vec::new();
        host.receive(1, &bytes[..gone], |message| heard.push(message));
        board.post(&STOP);
        heard.extend(carry(&mut board, &mut host, 1));
        // All but its end, which the Stop's 0x00 is: it is heard, and said again, since the port cannot know.
        let expected = match gone {
            _ if gone == length => vec![halt.clone(), STOP],
            _ if gone + 1 == length => vec![halt.clone(), STOP, halt.clone()],
            _ => vec![STOP, halt.clone()],
        };
        assert_eq!(heard, expected, "{gone} of {length} bytes");
    }
}

#[test]
fn the_answer_to_a_stop_finds_room_in_a_full_queue() {
    let (mut board, mut host) = acquainted();
    while board.counters().dropped == 0 {
        board.post(&WORD);
    }
    let stopped = Message::Stopped(Stopped::by(Trip::Host));
    board.post(&stopped);
    assert_eq!(carry(&mut board, &mut host, 1), [stopped]);
}
