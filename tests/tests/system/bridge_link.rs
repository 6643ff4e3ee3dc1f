//! The bridge's way to a board, by virtual time: found, greeted, lost and found again, and named when
//! something is wrong.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use host_bridge::clock::Clock;
use host_bridge::link::{Event, Link, NotSent, host_hello};
use host_bridge::place::Place;
use host_bridge::state::State;
use protocol::{
    Hello, MAX_FRAME, Message, Motion, PortCounters, ResetCause, Role, RoleCounters,
    SensorCounters, Status, Stop, StopReason, Stopped, Trip, frame,
};
use tests::fake_board::{FakeBoard, wait_by};
use tests::virtual_clock::wait_until;
use tests::virtual_ports::VirtualBench;

/// Far more of virtual time than anything here takes.
const LIMIT: Duration = Duration::from_secs(60);
const S: u64 = 1_000_000;
const OPERATOR: Stop = Stop {
    reason: StopReason::Operator,
};

/// A link, and what it tells.
struct Watched {
    bench: VirtualBench,
    link: Link,
    told: Receiver<Event>,
}

impl Watched {
    fn new(bench: &VirtualBench, role: Role, place: Place) -> Self {
        let (events, told) = channel();
        let link = Link::open_on(&bench.system(), role, place, move |event| {
            let _ = events.send(event);
        });
        Self {
            bench: bench.clone(),
            link,
            told,
        }
    }

    fn at(bench: &VirtualBench, role: Role, board: &FakeBoard) -> Self {
        Self::new(bench, role, Place::Port(board.path().clone()))
    }

    fn turned(&self, wanted: impl Fn(&State) -> bool) -> State {
        let mut found = None;
        let mut turns = || {
            found = self.told.try_iter().find_map(|event| match event {
                Event::StateChanged(state) if wanted(&state) => Some(state),
                _ => None,
            });
            found.is_some()
        };
        let has_turned = wait_until(&self.bench.clock, LIMIT, &mut turns);
        assert!(has_turned, "it stays {}", self.link.state());
        found.expect("it has turned")
    }

    fn turns_to(&self, word: &str) -> State {
        self.turned(|state| state.word() == word)
    }

    fn tells(&self, wanted: impl Fn(&Event) -> bool) -> bool {
        wait_until(&self.bench.clock, LIMIT, || {
            self.told.try_iter().any(|event| wanted(&event))
        })
    }

    /// How long it takes to end, in µs.
    fn end_us(self) -> u64 {
        let Self { bench, link, told } = self;
        let began_us = bench.clock.now_us();
        drop(link);
        drop(told);
        bench.clock.now_us() - began_us
    }
}

fn hears_stop(board: &FakeBoard) -> bool {
    wait_by(board, LIMIT, || board.take_heard().contains(&STOP))
}

/// Lets time go by.
fn pass(bench: &VirtualBench, time_us: u64) {
    let notify = bench.clock.notify();
    notify.wait_until(bench.clock.now_us() + time_us);
}

fn motion(sequence: u32) -> Message {
    Message::Motion(Motion {
        sequence,
        instant_us: u64::from(sequence),
        position_um: 3,
        velocity_um_s: 4,
    })
}

const STOP: Message = Message::Stop(Stop {
    reason: StopReason::Operator,
});

fn status(uptime_us: u64) -> Message {
    Message::Status(Status {
        uptime_us,
        reset: ResetCause::Power,
        watchdog_resets: 0,
        stack_free_bytes: 0,
        peer: PortCounters::new(),
        console: PortCounters::new(),
        role: RoleCounters::Sensor(SensorCounters::ZERO),
    })
}

#[test]
fn a_board_is_greeted_heard_and_spoken_to() {
    let bench = VirtualBench::default();
    let board = FakeBoard::on(&bench, Role::Display);
    let watched = Watched::at(&bench, Role::Display, &board);
    watched.turned(State::is_known);
    board.say(motion(1));
    assert!(
        watched
            .tells(|event| matches!(event, Event::Heard { message, .. } if *message == motion(1)))
    );
    watched.link.post(&STOP).expect("the board is there");
    assert!(hears_stop(&board));
    let compared = || watched.link.clocks().is_some();
    assert!(wait_until(&bench.clock, LIMIT, compared));
}

#[test]
fn a_board_that_is_not_there_is_absent_until_it_is_plugged_in() {
    let bench = VirtualBench::default();
    let name = Path::new("/virtual/by-name");
    let watched = Watched::new(&bench, Role::Sensor, Place::Port(name.to_owned()));
    let state = watched.turns_to("absent");
    assert_eq!(state.to_string(), "/virtual/by-name: not there");
    assert_eq!(watched.link.post(&STOP), Err(NotSent::NotKnown));
    let board = FakeBoard::on(&bench, Role::Sensor);
    bench.ports.link(board.path(), name);
    watched.turns_to("known");
}

#[test]
fn a_cable_put_back_is_seen_within_a_second() {
    let bench = VirtualBench::default();
    let name = Path::new("/virtual/by-name");
    let mut board = FakeBoard::on(&bench, Role::Display);
    bench.ports.link(board.path(), name);
    let watched = Watched::new(&bench, Role::Display, Place::Port(name.to_owned()));
    watched.turns_to("known");
    for pause_ms in [0, 13, 50, 99, 1_000] {
        drop(board);
        watched.turns_to("absent");
        assert_eq!(watched.link.post(&STOP), Err(NotSent::NotKnown));
        board = FakeBoard::on(&bench, Role::Display);
        pass(&bench, pause_ms * 1_000);
        let back_us = bench.clock.now_us();
        bench.ports.link(board.path(), name);
        watched.turns_to("known");
        let took_us = bench.clock.now_us() - back_us;
        assert!(took_us < S, "{took_us} µs");
        watched.link.post(&STOP).expect("the board is back");
        assert!(hears_stop(&board));
    }
}

#[test]
fn a_board_of_another_role_is_named_and_neither_heard_nor_spoken_to() {
    let bench = VirtualBench::default();
    let board = FakeBoard::on(&bench, Role::Display);
    let watched = Watched::at(&bench, Role::Sensor, &board);
    let state = watched.turns_to("wrong-role");
    assert_eq!(
        state.to_string(),
        format!(
            "{}: display 0.1.0 on stm32f429zi, not the sensor",
            board.path().display()
        )
    );
    assert_eq!(watched.link.post(&motion(9)), Err(NotSent::NotKnown));
    // Its Hellos are among what is counted: at most two of these five are.
    let before = watched.link.counters().received;
    (0..5).for_each(|sequence| board.say(motion(sequence)));
    let all = || watched.link.counters().received >= before + 5;
    assert!(wait_until(&bench.clock, LIMIT, all));
    drop(watched.link);
    let is_heard = |event| matches!(event, Event::Heard { .. });
    assert!(!watched.told.iter().any(is_heard));
    assert!(!board.take_heard().contains(&motion(9)));
}

#[test]
fn a_board_of_another_role_is_named_by_it_whatever_its_version() {
    let display = Hello::new(Role::Display, "stm32f429zi", [9, 8, 7]);
    let other_protocol = Hello {
        protocol: [0xff, 0x7f],
        ..display
    };
    let other_schema = Hello {
        schema: [1; 8],
        ..display
    };
    for hello in [other_protocol, other_schema] {
        let bench = VirtualBench::default();
        let board = FakeBoard::acting_on(&bench, hello, Box::new(|_| Vec::new()));
        let watched = Watched::at(&bench, Role::Sensor, &board);
        let state = watched.turned(|state| !matches!(state, State::Opened { .. }));
        let said = state.to_string();
        assert_eq!(state.word(), "wrong-role", "{said}");
        assert!(said.contains("display 9.8.7"), "{said}");
        let advice = "exchange --sensor and --display, or flash the other firmware";
        assert_eq!(state.advice(), Some(advice));
    }
}

/// Stop is said, answered, and said no more.
fn assert_stopped(bench: &VirtualBench, watched: &Watched, board: &FakeBoard) {
    watched.link.stop(OPERATOR).expect("there is a line");
    assert!(hears_stop(board));
    assert!(wait_until(&bench.clock, LIMIT, || !watched
        .link
        .is_stopping()));
    board.take_heard();
    let end_us = bench.clock.now_us() + 1_000_000;
    assert!(wait_until(&bench.clock, LIMIT, || bench.clock.now_us() > end_us));
    assert!(!board.take_heard().contains(&STOP));
}

#[test]
fn a_stop_is_said_to_whoever_is_there() {
    let ours = Hello::new(Role::Sensor, "stm32f429zi", [9, 8, 7]);
    let foreign = Hello {
        protocol: [0xff, 0x7f],
        ..ours
    };
    let display = Hello::new(Role::Display, "stm32f429zi", [0, 1, 0]);
    for (hello, word) in [
        (foreign, "foreign"),
        (display, "wrong-role"),
        (ours, "known"),
    ] {
        let bench = VirtualBench::default();
        let board = FakeBoard::acting_on(&bench, hello, Box::new(|_| Vec::new()));
        let watched = Watched::at(&bench, Role::Sensor, &board);
        watched.turns_to(word);
        assert_stopped(&bench, &watched, &board);
    }
}

#[test]
fn a_stop_is_said_again_to_a_board_that_does_not_answer_and_to_one_that_comes_later() {
    let bench = VirtualBench::default();
    let board = FakeBoard::on(&bench, Role::Display);
    board.mute(true);
    let watched = Watched::at(&bench, Role::Display, &board);
    watched.link.stop(OPERATOR).ok();
    let mut said = 0;
    assert!(wait_until(&bench.clock, LIMIT, || {
        said += board
            .take_heard()
            .iter()
            .filter(|&message| *message == STOP)
            .count();
        said > 20
    }));
    assert!(watched.link.is_stopping());
    board.mute(false);
    assert!(wait_until(&bench.clock, LIMIT, || !watched
        .link
        .is_stopping()));

    let name = Path::new("/virtual/later");
    let absent = Watched::new(&bench, Role::Display, Place::Port(name.to_owned()));
    assert_eq!(absent.link.stop(OPERATOR), Err(NotSent::NotKnown));
    drop(watched);
    board.take_heard();
    bench.ports.link(board.path(), name);
    assert!(hears_stop(&board));
}

#[test]
fn a_stop_on_a_line_that_carries_one_way_is_said_until_it_is_answered() {
    let bench = VirtualBench::default();
    let stops = |board: &FakeBoard| {
        let heard = board.take_heard();
        heard.iter().filter(|&message| *message == STOP).count()
    };
    // What the board says is lost: it obeys, and whoever said it doesn't know.
    let board = FakeBoard::on(&bench, Role::Display);
    let watched = Watched::at(&bench, Role::Display, &board);
    watched.turned(State::is_known);
    board.mute(true);
    pass(&bench, S);
    watched.link.stop(OPERATOR).expect("there is a line");
    pass(&bench, 10 * S);
    assert!(stops(&board) > 200, "every 40 ms");
    assert!(watched.link.is_stopping());
    assert!(!watched.link.state().is_known());
    board.mute(false);
    let is_answered = || !watched.link.is_stopping();
    assert!(wait_until(&bench.clock, LIMIT, is_answered));
    drop(watched);

    // What is said to it is lost: it goes on, and says so for as long as it speaks in frames.
    let board = FakeBoard::on(&bench, Role::Display);
    let watched = Watched::at(&bench, Role::Display, &board);
    watched.turned(State::is_known);
    board.miss(true);
    pass(&bench, S);
    stops(&board);
    watched.link.stop(OPERATOR).expect("there is a line");
    board.say(motion(7));
    let goes_on =
        |event: &Event| matches!(event, Event::Heard { message, .. } if *message == motion(7));
    assert!(watched.tells(goes_on));
    pass(&bench, 10 * S);
    assert_eq!(stops(&board), 0);
    assert!(watched.link.is_stopping());
    board.miss(false);
    assert!(hears_stop(&board));
    let is_answered = || !watched.link.is_stopping();
    assert!(wait_until(&bench.clock, LIMIT, is_answered));
}

#[test]
fn a_board_of_another_protocol_or_schema_is_named_and_not_spoken_to() {
    let ours = Hello::new(Role::Sensor, "stm32f429zi", [9, 8, 7]);
    let other_protocol = Hello {
        protocol: [0xff, 0x7f],
        ..ours
    };
    let other_schema = Hello {
        schema: [1; 8],
        ..ours
    };
    for hello in [other_protocol, other_schema] {
        let bench = VirtualBench::default();
        let board = FakeBoard::acting_on(&bench, hello, Box::new(|_| Vec::new()));
        let watched = Watched::at(&bench, Role::Sensor, &board);
        let said = watched.turns_to("foreign").to_string();
        assert!(said.contains("sensor 9.8.7 on stm32f429zi"), "{said}");
        assert_eq!(watched.link.post(&motion(9)), Err(NotSent::NotKnown));
    }
}

#[test]
fn a_port_that_sends_back_what_it_is_told_is_named_as_such() {
    let bench = VirtualBench::default();
    let echo = FakeBoard::acting_on(&bench, host_hello(), Box::new(|_| Vec::new()));
    let watched = Watched::at(&bench, Role::Sensor, &echo);
    let state = watched.turns_to("wrong-role");
    let said = state.to_string();
    assert!(
        said.ends_with("sends back what this program says"),
        "{said}"
    );
    assert!(
        state
            .advice()
            .expect("advice")
            .contains("TX is joined to its RX")
    );
    assert_eq!(watched.link.post(&motion(9)), Err(NotSent::NotKnown));
}

#[test]
fn garbage_text_and_silence_are_told_apart() {
    let bench = VirtualBench::default();
    let board = FakeBoard::on(&bench, Role::Sensor);
    board.mute(true);
    let watched = Watched::at(&bench, Role::Sensor, &board);
    watched.turns_to("silent");
    // Bytes of a line at another speed: every value, none of them a frame.
    let mut seed = 1_u32;
    let garbage: Vec<u8> = (0..2_000)
        .map(|_| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed.to_le_bytes()[3]
        })
        .collect();
    board.send_bytes(&garbage);
    let state = watched.turns_to("garbage");
    assert!(state.advice().expect("advice").contains("921600 baud"));
    watched.turns_to("silent");
    board.send_bytes(b"sensor 0.1.0  lambda 2.03 mm  v 70 mm/s  link 12 ms\r\n\0");
    watched.turns_to("deaf");
    // All of it was borne, and the board is understood as soon as it answers.
    board.mute(false);
    board.restart();
    watched.turns_to("known");
}

#[test]
fn a_board_that_falls_silent_is_named_and_known_again_when_it_speaks() {
    let bench = VirtualBench::default();
    let board = FakeBoard::on(&bench, Role::Sensor);
    let watched = Watched::at(&bench, Role::Sensor, &board);
    watched.turns_to("known");
    board.mute(true);
    watched.turns_to("silent");
    assert_eq!(watched.link.post(&motion(9)), Err(NotSent::NotKnown));
    board.mute(false);
    watched.turns_to("known");
    watched.link.post(&STOP).expect("the board is back");
    assert!(hears_stop(&board));
}

#[test]
fn a_restart_is_told_and_the_clock_asked_for_anew() {
    let bench = VirtualBench::default();
    let board = FakeBoard::on(&bench, Role::Sensor);
    let watched = Watched::at(&bench, Role::Sensor, &board);
    let clocks = || watched.link.clocks();
    watched.turns_to("known");
    // A status of a day's uptime.
    board.say(status(86_400 * S));
    assert!(wait_until(&bench.clock, LIMIT, || clocks().is_some()));
    let before_us = clocks().expect("an exchange").offset_us;
    pass(&bench, S);
    board.restart();
    let restarted = || {
        // It is said as soon as the two have greeted each other again.
        board.say(status(7));
        watched
            .told
            .try_iter()
            .any(|event| event == Event::Restarted)
    };
    assert!(wait_until(&bench.clock, LIMIT, restarted));
    // The clock that is asked for anew is the one that began again.
    let is_later = || clocks().is_some_and(|clocks| clocks.offset_us < before_us);
    assert!(wait_until(&bench.clock, LIMIT, is_later));
    assert!(watched.link.state().is_known());
}

#[test]
fn a_link_ends_at_once_whatever_it_does() {
    const AT_ONCE_US: u64 = 100_000;
    let bench = VirtualBench::default();
    // While it looks for a port that is not there.
    let nowhere = Place::Port("/virtual/nowhere".into());
    for pause_us in [0, 20_000, 70_000] {
        let watched = Watched::new(&bench, Role::Sensor, nowhere.clone());
        watched.turns_to("absent");
        pass(&bench, pause_us);
        assert_eq!(watched.end_us(), 0);
    }
    // While the board speaks as fast as it can, into a line that takes nothing.
    let fast = |now_us| vec![motion(u32::try_from(now_us).unwrap_or(0)); 10];
    let hello = Hello::new(Role::Display, "stm32f429zi", [0, 1, 0]);
    let board = FakeBoard::acting_on(&bench, hello, Box::new(fast));
    let watched = Watched::at(&bench, Role::Display, &board);
    watched.turns_to("known");
    board.deafen(true);
    let is_stuck = || watched.link.post(&STOP) == Err(NotSent::Stuck);
    assert!(wait_until(&bench.clock, LIMIT, is_stuck));
    assert!(watched.tells(|event| matches!(event, Event::Heard { .. })));
    let took_us = watched.end_us();
    assert!(took_us < AT_ONCE_US, "{took_us} µs");
    // While nothing is said.
    let board = FakeBoard::on(&bench, Role::Display);
    board.mute(true);
    let watched = Watched::at(&bench, Role::Display, &board);
    watched.turns_to("silent");
    let took_us = watched.end_us();
    assert!(took_us < AT_ONCE_US, "{took_us} µs");
}

#[test]
fn a_link_that_waits_looks_at_its_line_fifty_times_a_second_and_for_its_port_ten_times() {
    let bench = VirtualBench::default();
    let nowhere = Place::Port("/virtual/nowhere".into());
    let watched = Watched::new(&bench, Role::Sensor, nowhere);
    watched.turns_to("absent");
    let before = bench.ports.looks();
    pass(&bench, 10 * S);
    let looks = bench.ports.looks() - before;
    assert!((99..=101).contains(&looks), "{looks} in 10 s");
    drop(watched);

    let board = FakeBoard::on(&bench, Role::Sensor);
    let watched = Watched::at(&bench, Role::Sensor, &board);
    watched.turns_to("known");
    let before = bench.ports.reads();
    pass(&bench, 10 * S);
    // Answers to its pings and the board's Hellos come in between, each of which takes a look of its own.
    let reads = bench.ports.reads() - before;
    assert!((500..=550).contains(&reads), "{reads} in 10 s");
}

#[test]
fn two_links_find_their_boards_among_the_same_ports() {
    for roles in [[Role::Sensor, Role::Display], [Role::Display, Role::Sensor]] {
        let bench = VirtualBench::default();
        let boards = roles.map(|role| FakeBoard::on(&bench, role));
        // A third board on the desk that says nothing.
        let (mute, _end) = bench.cable();
        let ports = vec![mute, boards[0].path().clone(), boards[1].path().clone()];
        let links = [Role::Sensor, Role::Display].map(|role| {
            (
                role,
                Watched::new(&bench, role, Place::Among(ports.clone())),
            )
        });
        for (role, watched) in &links {
            let state = watched.turned(State::is_known);
            let at = roles.iter().position(|of| of == role).expect("one of two");
            assert_eq!(state.port(), Some(boards[at].path()));
            assert!(watched.link.state().is_known());
        }
    }
}

#[test]
fn a_board_among_several_ports_is_found_again_behind_another_one() {
    let bench = VirtualBench::default();
    let [name, other] = ["/virtual/one", "/virtual/other"].map(PathBuf::from);
    let board = FakeBoard::on(&bench, Role::Sensor);
    bench.ports.link(board.path(), &name);
    let among = Place::Among(vec![name.clone(), other.clone()]);
    let watched = Watched::new(&bench, Role::Sensor, among);
    assert_eq!(watched.turns_to("known").port(), Some(&name));
    drop(board);
    watched.turns_to("absent");
    let stranger = FakeBoard::on(&bench, Role::Display);
    bench.ports.link(stranger.path(), &name);
    watched.turns_to("wrong-role");
    let board = FakeBoard::on(&bench, Role::Sensor);
    bench.ports.link(board.path(), &other);
    assert_eq!(watched.turns_to("known").port(), Some(&other));
}

#[test]
fn a_stop_among_several_ports_is_not_ended_by_the_answer_of_another_board() {
    let bench = VirtualBench::default();
    let (other, mut end) = bench.cable();
    let sensor = FakeBoard::on(&bench, Role::Sensor);
    let ports = vec![other, sensor.path().clone()];
    // A board of another bench says so, and nothing else.
    let mut frame = [0; MAX_FRAME];
    let stopped = Message::Stopped(Stopped::by(Trip::Operator));
    let said = frame::encode(0, &stopped, &mut frame).expect("it fits");
    end.write_all(said).expect("there is room");
    let watched = Watched::new(&bench, Role::Sensor, Place::Among(ports));
    // Whether it could be said at once is no matter.
    watched.link.stop(OPERATOR).ok();
    assert!(hears_stop(&sensor));
    let is_stopped = |event: &Event| {
        matches!(
            event,
            Event::Heard {
                message: Message::Stopped(_),
                ..
            }
        )
    };
    assert!(watched.tells(is_stopped));
    assert_eq!(watched.link.state().port(), Some(sensor.path()));
    assert!(wait_until(&bench.clock, LIMIT, || !watched
        .link
        .is_stopping()));
}
