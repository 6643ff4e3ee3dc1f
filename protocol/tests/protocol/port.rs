//! Two ports, joined in memory.

use protocol::{Hello, Message, Peer, Ping, Port, Role, Stop, StopReason};

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

const STOP: Message = Message::Stop(Stop {
    reason: StopReason::Operator,
});

#[test]
fn two_ports_know_each_other_after_one_exchange() {
    let (sensor, host) = acquainted();
    assert!(matches!(sensor.peer(), Peer::Known(hello) if hello.role == Role::Host.byte()));
    assert!(matches!(host.peer(), Peer::Known(hello) if hello.role == Role::Sensor.byte()));
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
    alone.post(&STOP);
    assert!(!alone.has_bytes());
    assert_eq!(alone.counters().sent, 0);
}

#[test]
fn a_message_is_handed_on_once_and_whole() {
    let (mut sensor, mut host) = acquainted();
    host.post(&STOP);
    assert_eq!(carry(&mut host, &mut sensor, 1), [STOP]);
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
        host.post(&STOP);
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
    sensor.post(&STOP);
    sensor.poll(4_000_000);
    let handed_on = carry(&mut sensor, &mut reflashed, 4_000_000);
    assert!(handed_on.is_empty(), "greetings only, not {handed_on:?}");
    assert!(
        matches!(reflashed.peer(), Peer::Known(_)),
        "it was told who speaks"
    );
}
