//! Any bytes, in any portions: nothing panics, every frame is counted once and no line of text, portions make no
//! difference, and after a 0x00 the receiver is in step again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use protocol::{Event, Hello, MAX_FRAME, Message, Ping, PortCounters, Receiver, Role, frame};

fuzz_target!(|input: &[u8]| {
    // The first byte says how long a portion is, whether the rest is framed, and whether a Hello
    // came before.
    let Some((&control, rest)) = input.split_first() else {
        return;
    };
    let framed = control & 0x40 != 0;
    let bytes = if framed {
        in_frames(rest)
    } else {
        rest.to_vec()
    };
    let mut whole = Receiver::new();
    let mut cut = Receiver::new();
    if control & 0x80 != 0 {
        let hello = frame_of(0, &Message::Hello(hello()));
        whole.receive(&hello, |_| {});
        cut.receive(&hello, |_| {});
    }
    let before = frames_counted(&whole.counters());

    let mut at_once = Vec::new();
    whole.receive(&bytes, |event| at_once.push(event));
    let mut in_portions = Vec::new();
    for portion in bytes.chunks(1 + usize::from(control & 0x3F)) {
        cut.receive(portion, |event| in_portions.push(event));
    }
    // By their text, because a NaN does not equal itself.
    assert_eq!(format!("{at_once:?}"), format!("{in_portions:?}"));
    assert_eq!(whole.counters(), cut.counters());
    assert_eq!(whole.peer(), cut.peer());

    let ended = bytes
        .split_inclusive(|&byte| byte == 0)
        .filter(|frame| frame.len() > 1 && frame.ends_with(&[0]))
        .count();
    let lines = at_once.iter().filter(|event| **event == Event::Text).count();
    let counters = whole.counters();
    assert_eq!(frames_counted(&counters) - before, (ended - lines) as u32);
    if framed {
        assert_eq!((counters.corrupt, counters.overlong), (0, 0));
    }

    // Whatever it was: after a 0x00 a good frame is received, and a restarted peer is understood:
    // at once, or if its Hello filled a gap that the input left, after the window of 256 frames.
    let mut greeted = false;
    whole.receive(&[0], |_| {});
    whole.receive(&frame_of(0, &Message::Hello(hello())), |event| {
        greeted = event == Event::Greeted(hello());
    });
    assert!(greeted);
    let understood = (1..300).any(|sequence| {
        let ping = Message::Ping(Ping {
            sent_us: sequence.into(),
        });
        let mut heard = false;
        whole.receive(&frame_of(sequence, &ping), |event| {
            assert_eq!(event, Event::Message(ping.clone()));
            heard = true;
        });
        heard
    });
    assert!(understood);
});

/// Good frames around pieces of the input, because no fuzzer guesses a CRC: a length, a sequence,
/// a payload, and so on.
fn in_frames(mut input: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut out = [0; MAX_FRAME];
    while let [length, low, high, rest @ ..] = input {
        let (payload, next) = rest.split_at(rest.len().min((*length).into()));
        let sequence = u16::from_le_bytes([*low, *high]);
        bytes.extend(frame::encode_payload(sequence, payload, &mut out).unwrap_or_default());
        input = next;
    }
    bytes
}

fn hello() -> Hello {
    Hello::new(Role::Host, "fuzz", [0, 0, 0]).asking(true)
}

fn frame_of(sequence: u16, message: &Message) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    frame::encode(sequence, message, &mut out)
        .expect("every message fits")
        .to_vec()
}

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
