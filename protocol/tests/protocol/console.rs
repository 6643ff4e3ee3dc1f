//! The console's two ways to speak, and how it goes from one to the other.

use crate::messages::{
    content, events, foreign_hello, greeted_receiver, message, numbered, samples,
};
use proptest::prelude::*;
use protocol::console::SILENCE_US;
use protocol::{
    Console, DisplayState, Event, Hello, Key, Message, Peer, Ping, Port, PortCounters, Receiver,
    Role, Safety, Stop, StopReason, Stopped, Trip,
};

const WORD: Message = Message::Safety(Safety {
    instant_us: 7,
    state: DisplayState::Ready,
});
/// How often a board looks after its console.
const POLL_US: u64 = 50_000;

fn console() -> Console {
    Console::new(Hello::new(Role::Display, "test", [1, 2, 3]))
}

fn host() -> Port {
    Port::new(Hello::new(Role::Host, "test", [1, 2, 3]))
}

/// All that is waiting to be sent.
fn said(port: &mut Port) -> Vec<u8> {
    let mut all = Vec::new();
    let mut bytes = [0; 64];
    loop {
        let count = port.take(&mut bytes);
        if count == 0 {
            return all;
        }
        all.extend_from_slice(&bytes[..count]);
    }
}

/// Both say what they have to say at `now_us`; what each hands on.
fn exchange(console: &mut Console, host: &mut Port, now_us: u64) -> (Vec<Message>, Vec<Message>) {
    let (mut to_console, mut to_host) = (Vec::new(), Vec::new());
    for _ in 0..2 {
        console.poll(now_us);
        host.poll(now_us);
        let bytes = said(console.port());
        host.receive(now_us, &bytes, |message| to_host.push(message));
        let bytes = said(host);
        let port = console.port();
        port.receive(now_us, &bytes, |message| to_console.push(message));
    }
    (to_console, to_host)
}

/// A console and a host that know each other since `now_us`.
fn acquainted(now_us: u64) -> (Console, Port) {
    let (mut console, mut host) = (console(), host());
    exchange(&mut console, &mut host, now_us);
    assert!(!console.is_text());
    assert!(matches!(host.peer(), Peer::Known(_)));
    (console, host)
}

/// Polls as a board does, from one instant to another; what was typed.
fn polled(console: &mut Console, from_us: u64, to_us: u64) -> Vec<Key> {
    (from_us..to_us)
        .step_by(POLL_US as usize)
        .filter_map(|now_us| console.poll(now_us))
        .collect()
}

#[test]
fn to_nobody_it_says_its_lines_and_nothing_else() {
    let mut console = console();
    assert!(polled(&mut console, 0, 3_000_000).is_empty());
    console.say("lambda 2.000 mm");
    console.port().post(&WORD);
    assert!(console.is_text());
    assert_eq!(said(console.port()), b"lambda 2.000 mm\r\n\0");
    assert_eq!(console.port().counters(), PortCounters::new());
}

#[test]
fn a_hello_is_answered_at_once_and_ends_the_text() {
    let (mut console, mut host) = acquainted(1_000);
    console.say("not to a program");
    assert!(!console.port().has_bytes());
    console.port().post(&WORD);
    assert_eq!(exchange(&mut console, &mut host, 2_000).1, [WORD]);
}

#[test]
fn a_foreign_hello_ends_the_text_too_and_is_told_who_speaks() {
    let mut console = console();
    let bytes = numbered(0, &Message::Hello(foreign_hello()));
    console.port().receive(1_000, &bytes, |_| {});
    assert!(!console.is_text());
    console.say("not to a program");
    let mut receiver = Receiver::new();
    let told = events(&mut receiver, &said(console.port()));
    assert!(matches!(told[..], [Event::Greeted(_)]), "{told:?}");
    console.port().post(&WORD);
    assert!(!console.port().has_bytes(), "it would not be understood");
}

#[test]
fn a_program_that_pings_once_a_second_keeps_the_frames() {
    let (mut console, mut host) = acquainted(0);
    for second in 1..60 {
        host.post(&Message::Ping(Ping { sent_us: second }));
        exchange(&mut console, &mut host, second * 1_000_000);
        assert!(!console.is_text());
    }
    assert_eq!(host.counters().corrupt, 0);
}

#[test]
fn text_comes_back_five_seconds_after_the_last_good_frame() {
    let (mut console, _) = acquainted(0);
    // Neither noise nor half a frame is somebody.
    console.port().receive(4_000_000, &[9, 1, 1, 0, 7], |_| {});
    polled(&mut console, POLL_US, SILENCE_US);
    assert!(!console.is_text());
    console.poll(SILENCE_US);
    assert!(console.is_text());
    said(console.port());
    console.say("again");
    assert_eq!(said(console.port()), b"again\r\n\0");
}

#[test]
fn a_stop_after_long_silence_is_obeyed_and_brings_the_frames_back() {
    let (mut console, mut host) = acquainted(0);
    polled(&mut console, 0, 2 * SILENCE_US);
    assert!(console.is_text());
    said(console.port());
    host.post(&WORD);
    let (to_console, _) = exchange(&mut console, &mut host, 2 * SILENCE_US);
    assert_eq!(to_console, [WORD]);
    assert!(!console.is_text());
}

#[test]
fn a_host_that_hears_text_says_hello_at_once() {
    let (_, mut host) = acquainted(0);
    // The board was reset.
    let mut console = console();
    console.say("ridgelink display 0.1.0: ? for help");
    let bytes = said(console.port());
    host.receive(3_000_000, &bytes, |_| {});
    assert_eq!(host.peer(), Peer::Text);
    exchange(&mut console, &mut host, 3_000_000);
    assert!(!console.is_text());
    console.port().post(&WORD);
    assert_eq!(exchange(&mut console, &mut host, 3_001_000).1, [WORD]);
    let counters = host.counters();
    assert_eq!(
        (counters.corrupt, counters.late, counters.duplicated),
        (0, 0, 0)
    );
}

#[test]
fn a_host_that_hears_nothing_but_text_says_hello_ten_times_a_second_at_most() {
    let mut host = host();
    host.poll(0);
    let mut hellos = 0;
    for now_us in (0..1_000_000).step_by(1_000) {
        host.receive(now_us, b"a line\r\n\0", |_| {});
        hellos += events(&mut Receiver::new(), &said(&mut host)).len();
    }
    assert_eq!(hellos, 10);
}

#[test]
fn a_program_whose_board_was_reset_without_its_notice_is_asked_who_it_is() {
    let (_, mut host) = acquainted(0);
    let mut console = console();
    host.post(&Message::Ping(Ping { sent_us: 1 }));
    console.port().receive(2_000_000, &said(&mut host), |_| {});
    assert!(console.is_text());
    exchange(&mut console, &mut host, 2_000_000);
    assert!(!console.is_text());
}

#[test]
fn keys_are_read_once_the_line_is_quiet() {
    for (typed, key) in [
        ("?", Some(Key::Help)),
        ("h", Some(Key::Help)),
        ("??\r", Some(Key::Help)),
        ("!", Some(Key::Stop)),
        ("!\r\n", Some(Key::Stop)),
        ("x!", Some(Key::Other)),
        ("\r", Some(Key::Other)),
        ("AT", Some(Key::Other)),
        // An arrow, an umlaut, a wrong baud rate.
        ("\u{1b}[A", None),
        ("ä", None),
        ("\u{1}!", None),
    ] {
        let mut console = console();
        console.port().receive(1_000, typed.as_bytes(), |_| {});
        assert_eq!(console.poll(40_000), None, "{typed:?}");
        assert_eq!(console.poll(90_000), key, "{typed:?}");
        assert_eq!(console.poll(140_000), None, "{typed:?}");
    }
}

#[test]
fn no_key_stands_in_the_way_of_a_hello() {
    for typed in ["?", "!", "x", "\u{1b}[A", "ä", &"long ".repeat(99)] {
        let (mut console, mut host) = (console(), host());
        console.port().receive(1_000, typed.as_bytes(), |_| {});
        console.poll(60_000);
        host.poll(60_000);
        let bytes = said(&mut host);
        console.port().receive(60_001, &bytes, |_| {});
        assert!(!console.is_text(), "{typed:?}");
        let counters = console.port().counters();
        assert_eq!((counters.received, counters.corrupt), (1, 0), "{typed:?}");
    }
}

#[test]
fn not_even_one_typed_right_before_it() {
    for typed in ["?", "!", "\r\n", "several"] {
        // Numbers whose frames begin with 1, 2 and 3.
        for sequence in [0, 1, 0x3F3F] {
            let mut console = console();
            let bytes = [
                typed.as_bytes(),
                &numbered(sequence, &Message::Hello(crate::messages::hello())),
            ]
            .concat();
            console.port().receive(1_000, &bytes, |_| {});
            assert!(!console.is_text(), "{typed:?}, {sequence}");
            let counters = console.port().counters();
            assert_eq!((counters.received, counters.corrupt), (1, 0), "{typed:?}");
        }
    }
}

#[test]
fn a_frame_in_the_making_is_no_key_and_is_heard_though_a_poll_falls_into_it() {
    let (mut console, mut host) = (console(), host());
    host.poll(0);
    let bytes = said(&mut host);
    for (at, byte) in bytes.iter().enumerate() {
        let now_us = 1_000 * at as u64;
        console.port().receive(now_us, &[*byte], |_| {});
        assert_eq!(console.poll(now_us), None);
    }
    assert!(!console.is_text());
}

#[test]
fn while_frames_are_spoken_nothing_is_a_key() {
    let (mut console, _) = acquainted(0);
    console.port().receive(1_000, b"?", |_| {});
    assert!(polled(&mut console, 1_000, 1_000_000).is_empty());
}

#[test]
fn a_line_too_long_is_cut_and_still_a_line() {
    let mut console = console();
    console.say(&"x".repeat(1_000));
    let mut receiver = Receiver::new();
    assert_eq!(events(&mut receiver, &said(console.port())), [Event::Text]);
    assert_eq!(receiver.counters(), PortCounters::new());
}

#[test]
fn who_joins_within_a_line_counts_nothing() {
    let line = b"lambda 2.000 mm valid\r\n\0";
    for cut in 0..line.len() - 1 {
        let mut receiver = Receiver::new();
        events(&mut receiver, &line[cut..]);
        // Within its very end it is no text any more.
        let corrupt = u32::from(cut == line.len() - 2);
        assert_eq!(receiver.counters().corrupt, corrupt, "{cut}");
    }
}

#[test]
fn only_printable_bytes_and_the_end_of_a_line_are_text() {
    for (bytes, text) in [
        (&b"ok\r\n\0"[..], true),
        (b"\r\n\0", true),
        (b"ok\n\0", false),
        (b"ok\0", false),
        (b"o\tk\r\n\0", false),
        (b"o\x7Fk\r\n\0", false),
        (b"\xC3\xA4\r\n\0", false),
    ] {
        let mut receiver = Receiver::new();
        let expected: &[Event] = if text { &[Event::Text] } else { &[] };
        assert_eq!(events(&mut receiver, bytes), expected, "{bytes:?}");
        assert_eq!(receiver.counters().corrupt, u32::from(!text), "{bytes:?}");
    }
}

#[test]
fn no_message_is_a_line_whatever_its_number() {
    for (name, message) in samples() {
        for sequence in 0..=u16::MAX {
            let frame = numbered(sequence, &message);
            // So early, a control character is no end of a line.
            assert!(frame.len() > 6, "{name}");
            let control = frame[..4].iter().any(u8::is_ascii_control);
            assert!(control, "{name}, {sequence}: {frame:?}");
        }
    }
}

/// A line as a board may say it.
fn line() -> impl Strategy<Value = String> {
    "[ -~]{0,208}"
}

proptest! {
    #[test]
    fn lines_between_frames_lose_none_and_count_nothing(
        first in line(),
        pieces in proptest::collection::vec((message(), proptest::option::of(line())), 1..20),
    ) {
        let mut console = console();
        console.say(&first);
        let mut bytes = said(console.port());
        let mut out = vec![Event::Text];
        let mut receiver = Receiver::new();
        let mut received = 0;
        for (sequence, (message, line)) in (0..).zip(&pieces) {
            // After text a frame wants a Hello before it.
            bytes.extend(numbered(2 * sequence, &Message::Hello(crate::messages::hello())));
            bytes.extend(numbered(2 * sequence + 1, message));
            out.push(Event::Greeted(crate::messages::hello()));
            out.push(match message {
                Message::Hello(hello) => Event::Greeted(*hello),
                message => Event::Message(message.clone()),
            });
            received += 2;
            if let Some(line) = line {
                console.say(line);
                bytes.extend(said(console.port()));
                out.push(Event::Text);
            }
        }
        prop_assert_eq!(events(&mut receiver, &bytes), out);
        prop_assert_eq!(receiver.counters(), PortCounters { received, ..PortCounters::new() });
    }

    #[test]
    fn a_corrupted_line_costs_nothing_behind_it(
        line in line(),
        at in any::<prop::sample::Index>(),
        byte in 1_u8..,
        next in content(),
    ) {
        let mut console = console();
        console.say(&line);
        let mut bytes = said(console.port());
        let at = at.index(bytes.len() - 1);
        bytes[at] = byte;
        let mut receiver = greeted_receiver();
        let before = events(&mut receiver, &bytes);
        prop_assert!(before.is_empty() || before == [Event::Text]);
        let frames = [
            numbered(0, &Message::Hello(crate::messages::hello())),
            numbered(1, &next),
        ].concat();
        let received = events(&mut receiver, &frames);
        prop_assert_eq!(received.last(), Some(&Event::Message(next)));
    }
}

#[test]
fn a_stop_is_heard_and_answered_while_the_console_speaks_text_whatever_was_typed_before() {
    let stop = Message::Stop(Stop {
        reason: StopReason::Operator,
    });
    let stopped = Message::Stopped(Stopped::by(Trip::Operator));
    for typed in [&b""[..], b"help", b"\x1b[A", b"\xFF\x80garbage"] {
        let (mut console, mut host) = (console(), host());
        host.post(&stop);
        let mut bytes = typed.to_vec();
        bytes.extend(said(&mut host));
        let mut heard = Vec::new();
        console
            .port()
            .receive(1_000, &bytes, |message| heard.push(message));
        assert_eq!(heard, std::slice::from_ref(&stop), "{typed:?}");
        console.say("lambda none");
        console.port().post(&stopped);
        let bytes = said(console.port());
        let mut answered = Vec::new();
        host.receive(2_000, &bytes, |message| answered.push(message));
        assert_eq!(answered, std::slice::from_ref(&stopped));
    }
}
