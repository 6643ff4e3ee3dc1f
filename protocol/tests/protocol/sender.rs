//! The handshake, as the sender keeps it.

use crate::messages::{events, hello};
use protocol::{
    Event, Hello, MAX_FRAME, Message, Ping, Receiver, Sender, Stop, StopReason, Stopped, frame,
};

const PING: Message = Message::Ping(Ping { sent_us: 1 });
const SECOND_US: u64 = 1_000_000;

fn asks(message: Option<Message>) -> Option<bool> {
    match message? {
        Message::Hello(hello) => Some(hello.asks != 0),
        other => panic!("a Hello was due, not {other:?}"),
    }
}

#[test]
fn nothing_but_hello_stop_and_its_answer_leaves_before_the_peer_has_greeted() {
    let mut sender = Sender::new(hello());
    let mut out = [0; MAX_FRAME];
    assert_eq!(sender.encode(&PING, &mut out), None);
    assert_eq!(sender.sent(), 0);
    assert!(sender.encode(&Message::Hello(hello()), &mut out).is_some());
    assert_eq!(sender.sent(), 1);
    let reason = StopReason::Operator;
    let stop = Message::Stop(Stop { reason });
    let stopped = Message::Stopped(Stopped::by(reason.trip()));
    assert!(sender.encode(&stop, &mut out).is_some());
    assert!(sender.encode(&stopped, &mut out).is_some());
    sender.on_greeting(false);
    assert!(sender.encode(&PING, &mut out).is_some());
    assert_eq!(sender.sent(), 4);
}

#[test]
fn frames_are_numbered_from_zero_and_wrap() {
    let mut sender = Sender::new(hello());
    sender.on_greeting(false);
    let mut out = [0; MAX_FRAME];
    for number in (0..=u16::MAX).chain(0..2) {
        let mut bytes = sender.encode(&PING, &mut out).expect("open").to_vec();
        bytes.pop();
        let (sequence, _) = frame::decode(&mut bytes).expect("a good frame");
        assert_eq!(sequence, number);
    }
    assert_eq!(sender.sent(), (1 << 16) + 2);
}

#[test]
fn hello_is_due_at_once_and_every_second_until_greeted() {
    let mut sender = Sender::new(hello().asking(false));
    assert_eq!(asks(sender.hello_due(0)), Some(true));
    assert_eq!(sender.hello_due(0), None);
    assert_eq!(sender.hello_due(SECOND_US - 1), None);
    assert_eq!(asks(sender.hello_due(SECOND_US)), Some(true));
    assert_eq!(asks(sender.hello_due(2 * SECOND_US)), Some(true));
    sender.on_greeting(false);
    assert_eq!(sender.hello_due(100 * SECOND_US), None);
}

#[test]
fn who_is_asked_answers_once_without_asking() {
    let mut sender = Sender::new(hello());
    assert_eq!(asks(sender.hello_due(0)), Some(true));
    sender.on_greeting(true);
    assert_eq!(asks(sender.hello_due(1)), Some(false));
    assert_eq!(sender.hello_due(2), None);
}

#[test]
fn unheralded_frames_make_it_ask_at_most_every_tenth_of_a_second() {
    let mut sender = Sender::new(hello());
    sender.on_greeting(true);
    assert_eq!(asks(sender.hello_due(0)), Some(false));
    let mut asked = 0;
    for now_us in (0..SECOND_US).step_by(1_000) {
        sender.on_unheralded();
        if let Some(asks) = asks(sender.hello_due(now_us)) {
            assert!(asks);
            asked += 1;
        }
    }
    assert_eq!(asked, 9, "at 100 ms, 200 ms and so on up to 900 ms");
    sender.on_unheralded();
    sender.on_greeting(false);
    assert_eq!(sender.hello_due(10 * SECOND_US), None);
}

#[test]
fn a_foreign_peer_closes_it_and_is_told_so_every_second() {
    let mut sender = Sender::new(hello());
    sender.on_greeting(false);
    sender.on_foreign();
    let mut out = [0; MAX_FRAME];
    assert_eq!(sender.encode(&PING, &mut out), None);
    assert_eq!(asks(sender.hello_due(0)), Some(true));
    assert_eq!(sender.hello_due(1), None);
    assert_eq!(asks(sender.hello_due(SECOND_US)), Some(true));
    sender.on_greeting(false);
    assert!(sender.encode(&PING, &mut out).is_some());
}

/// One end of a link, with everything it was handed.
struct End {
    sender: Sender,
    receiver: Receiver,
    heard: Vec<Message>,
    said: u32,
}

impl End {
    fn new(hello: Hello) -> Self {
        Self {
            sender: Sender::new(hello),
            receiver: Receiver::new(),
            heard: Vec::new(),
            said: 0,
        }
    }

    fn speak(&mut self, now_us: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut out = [0; MAX_FRAME];
        if let Some(hello) = self.sender.hello_due(now_us) {
            self.said += 1;
            bytes.extend(self.sender.encode(&hello, &mut out).expect("a Hello may"));
        }
        bytes.extend(self.sender.encode(&PING, &mut out).unwrap_or_default());
        bytes
    }

    fn hear(&mut self, bytes: &[u8]) {
        for event in events(&mut self.receiver, bytes) {
            match event {
                Event::Message(message) => self.heard.push(message),
                Event::Greeted(hello) => self.sender.on_greeting(hello.asks != 0),
                Event::Foreign(_) => self.sender.on_foreign(),
                Event::Unheralded => self.sender.on_unheralded(),
                Event::Text => self.sender.on_text(),
            }
        }
    }
}

fn converse(a: &mut End, b: &mut End, from_ms: u64, to_ms: u64) {
    for now_us in (from_ms..to_ms).map(|ms| 1_000 * ms) {
        let said = a.speak(now_us);
        b.hear(&said);
        let said = b.speak(now_us);
        a.hear(&said);
    }
}

#[test]
fn two_ends_that_start_at_any_time_understand_each_other_and_fall_silent_on_hello() {
    let (mut a, mut b) = (End::new(hello()), End::new(hello()));
    // `a` starts alone, 1.5 s before `b`.
    for now_us in (0..1_500).map(|ms| 1_000 * ms) {
        a.speak(now_us);
    }
    converse(&mut a, &mut b, 1_500, 11_500);
    assert!(a.heard.len() >= 9_990 && b.heard.len() >= 9_990);
    // `a` asked twice in vain and answered once; `b` asked once and answered nobody.
    assert!(a.said + b.said <= 5, "{} and {}", a.said, b.said);
    assert_eq!(a.receiver.counters().unheralded, 0);
}

#[test]
fn an_end_that_restarts_is_understood_again_within_a_tenth_of_a_second() {
    let (mut a, mut b) = (End::new(hello()), End::new(hello()));
    converse(&mut a, &mut b, 0, 5_000);
    let mut b = End::new(hello());
    let before = a.heard.len();
    converse(&mut a, &mut b, 5_000, 5_200);
    assert!(a.heard.len() - before >= 100 && b.heard.len() >= 100);
    let counters = a.receiver.counters();
    assert_eq!((counters.lost, counters.late), (0, 0));
}

#[test]
fn an_end_that_was_flashed_with_another_version_is_told_and_recognised() {
    let (mut a, mut b) = (End::new(hello()), End::new(hello()));
    converse(&mut a, &mut b, 0, 1_000);
    let heard = a.heard.len();
    // The other version's handshake is this one's: that is what never changes.
    let foreign = crate::messages::foreign_hello();
    let mut told = 0;
    for (sequence, now_ms) in (1_000..3_500).step_by(1_000).enumerate() {
        a.hear(&crate::messages::numbered(
            sequence as u16,
            &Message::Hello(foreign),
        ));
        told += usize::from(!a.speak(1_000 * now_ms).is_empty());
    }
    assert_eq!(a.heard.len(), heard);
    assert_eq!(a.receiver.peer(), protocol::Peer::Foreign(foreign));
    assert_eq!(told, 3);
}
