//! The bridge's way to a board: found, greeted, lost and found again, and named when something is wrong.

use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use host_bridge::link::{Event, Link, NotSent};
use host_bridge::place::Place;
use host_bridge::state::State;
use protocol::{
    Hello, Message, Motion, PortCounters, ResetCause, Role, RoleCounters, SensorCounters, Status,
    Stop, StopReason,
};
use serialport::{SerialPort, TTYPort};
use tests::fake_board::{FakeBoard, wait_until};

/// Far more than anything here takes.
const LIMIT: Duration = Duration::from_secs(10);

fn link(role: Role, board: &FakeBoard) -> (Link, Receiver<Event>) {
    link_to(role, Place::Port(board.path().clone()))
}

fn link_to(role: Role, place: Place) -> (Link, Receiver<Event>) {
    let (events, told) = channel();
    let link = Link::open(role, place, move |event| {
        let _ = events.send(event);
    });
    (link, told)
}

fn turned(told: &Receiver<Event>, wanted: impl Fn(&State) -> bool) -> State {
    loop {
        match told.recv_timeout(LIMIT).expect("the link turns in time") {
            Event::Turned(state) if wanted(&state) => return state,
            _ => {}
        }
    }
}

fn turns_to(told: &Receiver<Event>, word: &str) -> State {
    turned(told, |state| state.word() == word)
}

/// A name in a folder of its own, free to be linked to a board's port.
fn name_of_a_port(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("bridge_link")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder.join("ttyBoard")
}

/// Puts the name on `board`'s port, as udev does when a cable is put in.
fn plug(board: &FakeBoard, name: &Path) {
    symlink(board.path(), name).expect("a link can be made");
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
        peer: PortCounters::new(),
        console: PortCounters::new(),
        role: RoleCounters::Sensor(SensorCounters::ZERO),
    })
}

#[test]
fn a_board_is_greeted_heard_and_spoken_to() {
    let board = FakeBoard::new(Role::Display);
    let (link, told) = link(Role::Display, &board);
    turned(&told, State::is_known);
    board.say(motion(1));
    let heard = |event| matches!(event, Event::Heard { message, .. } if message == motion(1));
    assert!(wait_until(LIMIT, || told.try_iter().any(&heard)));
    link.post(&STOP).expect("the board is there");
    assert!(wait_until(LIMIT, || board.take_heard().contains(&STOP)));
    assert!(wait_until(LIMIT, || link.clocks().is_some()));
}

#[test]
fn a_board_that_is_not_there_is_absent_until_it_is_plugged_in() {
    let name = name_of_a_port("absent");
    let (link, told) = link_to(Role::Sensor, Place::Port(name.clone()));
    let state = turns_to(&told, "absent");
    assert_eq!(state.to_string(), format!("{}: not there", name.display()));
    assert_eq!(link.post(&STOP), Err(NotSent::NotKnown));
    let board = FakeBoard::new(Role::Sensor);
    plug(&board, &name);
    turns_to(&told, "known");
    drop(link);
}

#[test]
fn a_cable_put_back_is_seen_within_a_second() {
    let name = name_of_a_port("cable");
    let mut board = FakeBoard::new(Role::Display);
    plug(&board, &name);
    let (link, told) = link_to(Role::Display, Place::Port(name.clone()));
    turns_to(&told, "known");
    let mut longest = Duration::ZERO;
    for _ in 0..5 {
        drop(board);
        turns_to(&told, "absent");
        assert_eq!(link.post(&STOP), Err(NotSent::NotKnown));
        fs::remove_file(&name).expect("the name is there");
        board = FakeBoard::new(Role::Display);
        let back = Instant::now();
        plug(&board, &name);
        turns_to(&told, "known");
        longest = longest.max(back.elapsed());
        link.post(&STOP).expect("the board is back");
        assert!(wait_until(LIMIT, || board.take_heard().contains(&STOP)));
    }
    println!("back after {longest:?} at most");
    assert!(longest < Duration::from_secs(1), "{longest:?}");
}

#[test]
fn a_port_of_another_program_is_busy_until_that_ends() {
    let board = FakeBoard::new(Role::Sensor);
    // As tio and this program do it.
    let other = File::open(board.path()).expect("the port is there");
    other.try_lock().expect("nobody else has it");
    let (_link, told) = link(Role::Sensor, &board);
    let state = turns_to(&told, "busy");
    assert_eq!(
        state.to_string(),
        format!("{}: another program has it", board.path().display())
    );
    drop(other);
    turns_to(&told, "known");
}

#[test]
fn a_second_link_to_a_port_is_told_that_it_is_busy_and_leaves_the_first_alone() {
    let board = FakeBoard::new(Role::Sensor);
    let (first, told) = link(Role::Sensor, &board);
    turns_to(&told, "known");
    let (_second, of_second) = link(Role::Sensor, &board);
    turns_to(&of_second, "busy");
    first.post(&STOP).expect("the first one has the board");
    assert!(wait_until(LIMIT, || board.take_heard().contains(&STOP)));
    assert!(first.state().is_known());
    drop(first);
    turns_to(&of_second, "known");
}

#[test]
fn a_board_of_another_role_is_named_and_neither_heard_nor_spoken_to() {
    let board = FakeBoard::new(Role::Display);
    let (link, told) = link(Role::Sensor, &board);
    let state = turns_to(&told, "wrong-role");
    assert_eq!(
        state.to_string(),
        format!(
            "{}: display 0.1.0 on stm32f429zi, not the sensor",
            board.path().display()
        )
    );
    assert_eq!(link.post(&STOP), Err(NotSent::NotKnown));
    // Its Hellos are among what is counted: at most two of these five are.
    let before = link.counters().received;
    (0..5).for_each(|sequence| board.say(motion(sequence)));
    assert!(wait_until(LIMIT, || link.counters().received >= before + 5));
    drop(link);
    assert!(
        !told
            .iter()
            .any(|event| matches!(event, Event::Heard { .. }))
    );
    assert!(!board.take_heard().contains(&STOP));
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
        let board = FakeBoard::saying(hello);
        let (link, told) = link(Role::Sensor, &board);
        let state = turns_to(&told, "foreign");
        let said = state.to_string();
        assert!(said.contains("sensor 9.8.7 on stm32f429zi"), "{said}");
        assert_eq!(link.post(&STOP), Err(NotSent::NotKnown));
    }
}

#[test]
fn garbage_text_and_silence_are_told_apart() {
    let board = FakeBoard::new(Role::Sensor);
    board.mute(true);
    let (_link, told) = link(Role::Sensor, &board);
    turns_to(&told, "silent");
    // Bytes of a line at another speed: every value, none of them a frame.
    let mut seed = 1_u32;
    let garbage: Vec<u8> = (0..2_000)
        .map(|_| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed.to_le_bytes()[3]
        })
        .collect();
    board.send_bytes(&garbage);
    let state = turns_to(&told, "garbage");
    assert!(state.advice().expect("advice").contains("921600 baud"));
    turns_to(&told, "silent");
    board.send_bytes(b"sensor 0.1.0  lambda 2.03 mm  v 70 mm/s  link 12 ms\r\n\0");
    turns_to(&told, "deaf");
    // All of it was borne, and the board is understood as soon as it answers.
    board.mute(false);
    board.restart();
    turns_to(&told, "known");
}

#[test]
fn a_board_that_falls_silent_is_named_and_known_again_when_it_speaks() {
    let board = FakeBoard::new(Role::Sensor);
    let (link, told) = link(Role::Sensor, &board);
    turns_to(&told, "known");
    board.mute(true);
    turns_to(&told, "silent");
    assert_eq!(link.post(&STOP), Err(NotSent::NotKnown));
    board.mute(false);
    turns_to(&told, "known");
    link.post(&STOP).expect("the board is back");
    assert!(wait_until(LIMIT, || board.take_heard().contains(&STOP)));
}

#[test]
fn a_restart_is_told_and_the_clock_asked_for_anew() {
    let board = FakeBoard::new(Role::Sensor);
    let (link, told) = link(Role::Sensor, &board);
    turns_to(&told, "known");
    // The board's clock stands where the program's does but for its start; a status of a day's uptime.
    let day_us = 86_400_000_000;
    board.say(status(day_us));
    assert!(wait_until(LIMIT, || link.clocks().is_some()));
    let before_us = link.clocks().expect("an exchange").offset_us;
    let restarted = || {
        // It is said as soon as the two have greeted each other again.
        board.say(status(7));
        told.try_iter().any(|event| event == Event::Restarted)
    };
    board.restart();
    assert!(wait_until(LIMIT, restarted));
    // The clock that is asked for anew is the one that began again.
    let is_later = || {
        link.clocks()
            .is_some_and(|clocks| clocks.offset_us < before_us)
    };
    assert!(wait_until(LIMIT, is_later));
    assert!(link.state().is_known());
}

#[test]
fn what_is_no_serial_port_is_refused_by_what_it_is() {
    for (path, what) in [
        (std::env::temp_dir(), "is a folder, not a serial port"),
        (
            std::env::current_exe().expect("a test is a file"),
            "is a file, not a serial port",
        ),
    ] {
        let (_link, told) = link_to(Role::Sensor, Place::Port(path.clone()));
        let state = turns_to(&told, "failed");
        assert_eq!(state.to_string(), format!("{}: {what}", path.display()));
    }
}

#[test]
fn a_line_that_takes_no_bytes_holds_nobody_up() {
    let board = FakeBoard::new(Role::Display);
    let (link, told) = link(Role::Display, &board);
    turns_to(&told, "known");
    board.deafen(true);
    let long = Message::Hello(Hello::new(Role::Host, "host-bridge", [0, 1, 0]));
    let mut slowest = Duration::ZERO;
    let stuck = wait_until(LIMIT, || {
        (0..100).any(|_| {
            let asked = Instant::now();
            let said = link.post(&long);
            slowest = slowest.max(asked.elapsed());
            said == Err(NotSent::Stuck)
        })
    });
    assert!(stuck, "the line took everything");
    assert!(slowest < Duration::from_millis(500), "{slowest:?}");
    // The board is heard as before.
    board.say(motion(1));
    let heard = |event| matches!(event, Event::Heard { message, .. } if message == motion(1));
    assert!(wait_until(LIMIT, || told.try_iter().any(&heard)));
    assert_eq!(link.post(&STOP), Err(NotSent::Stuck));
    assert!(link.counters().dropped > 0);
    // What is said when the line takes bytes again is understood: no frame was left half said.
    board.deafen(false);
    assert!(wait_until(LIMIT, || link.post(&STOP).is_ok()));
    assert!(wait_until(LIMIT, || board.take_heard().contains(&STOP)));
}

#[test]
fn a_link_ends_at_once_whatever_it_does() {
    let quick = |link: Link| {
        let asked = Instant::now();
        drop(link);
        let took = asked.elapsed();
        assert!(took < Duration::from_millis(100), "{took:?}");
    };
    // While it looks for a port that is not there.
    for _ in 0..10 {
        let (link, told) = link_to(Role::Sensor, Place::Port("/dev/no-such-port".into()));
        turns_to(&told, "absent");
        quick(link);
    }
    // While the board speaks as fast as it can, into a line that takes nothing.
    let fast = |now_us| vec![motion(u32::try_from(now_us).unwrap_or(0)); 10];
    let board = FakeBoard::acting(
        Hello::new(Role::Display, "stm32f429zi", [0, 1, 0]),
        Box::new(fast),
    );
    let (link, told) = link(Role::Display, &board);
    turns_to(&told, "known");
    board.deafen(true);
    assert!(wait_until(LIMIT, || link.post(&STOP) == Err(NotSent::Stuck)));
    quick(link);
    assert!(
        told.iter()
            .any(|event| matches!(event, Event::Heard { .. }))
    );
}

#[test]
fn every_frame_of_a_full_line_is_heard_in_order() {
    /// Some 22 bytes each: 48 s of a line at 921 600 baud.
    const FRAMES: u32 = 200_000;
    /// Frames that may be under way: what a pseudo-terminal holds.
    const AHEAD: u64 = 1_000;
    let board = FakeBoard::new(Role::Display);
    board.lose_nothing();
    let heard = Arc::new(AtomicU64::new(0));
    let wrong = Arc::new(Mutex::new(Vec::new()));
    let (count, faults) = (Arc::clone(&heard), Arc::clone(&wrong));
    let link = Link::open(
        Role::Display,
        Place::Port(board.path().clone()),
        move |event| {
            if let Event::Heard {
                message: Message::Motion(motion),
                ..
            } = event
            {
                let expected = count.fetch_add(1, Ordering::SeqCst);
                if u64::from(motion.sequence) != expected {
                    faults.lock().expect("sound").push(motion.sequence);
                }
            }
        },
    );
    assert!(wait_until(LIMIT, || link.state().is_known()));
    let began = Instant::now();
    for sequence in 0..FRAMES {
        if sequence % 100 == 0 {
            let there = || heard.load(Ordering::SeqCst) + AHEAD > u64::from(sequence);
            assert!(wait_until(LIMIT, there), "stuck at {sequence}");
        }
        board.say(motion(sequence));
    }
    let all = || heard.load(Ordering::SeqCst) == u64::from(FRAMES);
    assert!(wait_until(LIMIT, all), "{}", heard.load(Ordering::SeqCst));
    println!("{FRAMES} frames in {:?}", began.elapsed());
    assert_eq!(*wrong.lock().expect("sound"), Vec::<u32>::new());
    let counters = link.counters();
    assert_eq!((counters.lost, counters.corrupt, counters.late), (0, 0, 0));
}

#[test]
fn a_link_that_waits_takes_next_to_no_processor_time() {
    // Time that this thread has had of a processor, in ns: told by the link's own thread.
    fn spent_ns() -> u64 {
        let facts = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
        let first = facts.split(' ').next().unwrap_or_default();
        first.parse().expect("Linux tells what a thread has taken")
    }
    let each_second = |now_us: u64| {
        if now_us % 1_000_000 < 1_000 {
            vec![status(now_us)]
        } else {
            Vec::new()
        }
    };
    let hello = Hello::new(Role::Sensor, "stm32f429zi", [0, 1, 0]);
    let board = FakeBoard::acting(hello, Box::new(each_second));
    let (events, told) = channel();
    let _link = Link::open(
        Role::Sensor,
        Place::Port(board.path().clone()),
        move |event| {
            if matches!(
                event,
                Event::Heard {
                    message: Message::Pong(_),
                    ..
                }
            ) {
                let _ = events.send((Instant::now(), spent_ns()));
            }
        },
    );
    let (began, first_ns) = told.recv_timeout(LIMIT).expect("a pong");
    let mut last = (began, first_ns);
    while last.0 - began < Duration::from_millis(1_900) {
        last = told.recv_timeout(LIMIT).expect("a pong a second");
    }
    let share = (last.1 - first_ns) as f64 / (last.0 - began).as_nanos() as f64;
    println!("{:.2} % of a processor", share * 100.0);
    // A thread that spins takes all of one, or its share of a busy machine's.
    assert!(share < 0.05, "{share}");
}

#[test]
fn two_links_find_their_boards_among_the_same_ports() {
    for roles in [[Role::Sensor, Role::Display], [Role::Display, Role::Sensor]] {
        let boards = roles.map(FakeBoard::new);
        // A third board on the desk that says nothing.
        let (_far, mute) = TTYPort::pair().expect("the system has pseudo-terminals");
        let ports = vec![
            PathBuf::from(mute.name().expect("a pseudo-terminal has a name")),
            boards[0].path().clone(),
            boards[1].path().clone(),
        ];
        let links = [Role::Sensor, Role::Display]
            .map(|role| (role, link_to(role, Place::Among(ports.clone()))));
        for (role, (link, told)) in &links {
            let state = turned(told, State::is_known);
            let at = roles.iter().position(|of| of == role).expect("one of two");
            assert_eq!(state.port(), Some(boards[at].path()));
            assert!(link.state().is_known());
        }
    }
}

#[test]
fn a_board_among_several_ports_is_found_again_behind_another_one() {
    let name = name_of_a_port("among");
    let other = name.with_file_name("ttyOther");
    let board = FakeBoard::new(Role::Sensor);
    plug(&board, &name);
    let (_link, told) = link_to(
        Role::Sensor,
        Place::Among(vec![name.clone(), other.clone()]),
    );
    assert_eq!(turns_to(&told, "known").port(), Some(&name));
    drop(board);
    turns_to(&told, "absent");
    let stranger = FakeBoard::new(Role::Display);
    fs::remove_file(&name).expect("the name is there");
    plug(&stranger, &name);
    turns_to(&told, "wrong-role");
    let board = FakeBoard::new(Role::Sensor);
    plug(&board, &other);
    assert_eq!(turns_to(&told, "known").port(), Some(&other));
}

#[test]
fn a_port_is_free_for_others_when_its_link_has_ended() {
    let board = FakeBoard::new(Role::Sensor);
    let (link, told) = link(Role::Sensor, &board);
    turns_to(&told, "known");
    drop(link);
    let other = OpenOptions::new()
        .read(true)
        .write(true)
        .open(board.path())
        .expect("the port is free");
    other.try_lock().expect("nobody has it");
}
