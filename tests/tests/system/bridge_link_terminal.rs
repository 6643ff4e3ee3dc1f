//! The bridge's way to a board over the system's own terminals: who has a port, what is none, and lines that
//! are full in one direction or the other. Everything waits for events; the limits are a hang's.

use std::fs::{File, OpenOptions};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use host_bridge::link::{Event, Link, NotSent};
use host_bridge::place::Place;
use host_bridge::state::State;
use protocol::{Hello, Message, Motion, Role, Stop, StopReason};
use tests::fake_board::{FakeBoard, wait_until};

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

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
        match told.recv_timeout(LIMIT).expect("the link turns") {
            Event::StateChanged(state) if wanted(&state) => return state,
            _ => {}
        }
    }
}

fn turns_to(told: &Receiver<Event>, word: &str) -> State {
    turned(told, |state| state.word() == word)
}

fn hears(told: &Receiver<Event>, sequence: u32) {
    let wanted = motion(sequence);
    while !matches!(told.recv_timeout(LIMIT).expect("it is heard"), Event::Heard { message, .. } if message == wanted)
    {
    }
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
fn programs_that_share_a_port_hear_the_same_and_are_one_host_to_the_board() {
    let board = FakeBoard::new(Role::Sensor);
    let links: Vec<(Link, Receiver<Event>)> = (0..4).map(|_| link(Role::Sensor, &board)).collect();
    for (_, told) in &links {
        turns_to(told, "known");
    }
    board.say(motion(1));
    for (_, told) in &links {
        hears(told, 1);
    }
    for (link, _) in &links {
        link.post(&STOP).expect("each has the board");
    }
    let mut stops = 0;
    assert!(wait_until(LIMIT, || {
        let heard = board.take_heard();
        stops += heard.iter().filter(|&message| *message == STOP).count();
        stops == links.len()
    }));
    for (link, _) in &links {
        let counters = link.counters();
        assert_eq!((counters.lost, counters.corrupt, counters.late), (0, 0, 0));
    }
}

#[test]
fn when_the_owner_of_a_port_ends_another_goes_on_without_a_word_to_its_user() {
    let board = FakeBoard::new(Role::Sensor);
    let mut links: Vec<(Link, Receiver<Event>)> = Vec::new();
    for _ in 0..4 {
        let next = link(Role::Sensor, &board);
        turns_to(&next.1, "known");
        links.push(next);
    }
    let mut sequence = 0;
    while links.len() > 1 {
        drop(links.remove(0));
        for (link, told) in &links {
            let first = sequence + 1;
            // What is said while nobody has the port is lost, and counted: it is said again until heard.
            assert!(wait_until(LIMIT, || {
                sequence += 1;
                board.say(motion(sequence));
                told.try_iter().any(|event| match event {
                    Event::StateChanged(state) => panic!("{state}"),
                    Event::Heard {
                        message: Message::Motion(motion),
                        ..
                    } => motion.sequence >= first,
                    Event::Heard { .. } => false,
                    Event::Restarted => false,
                })
            }));
            assert!(wait_until(LIMIT, || {
                let _ = link.post(&STOP);
                board.take_heard().contains(&STOP)
            }));
        }
    }
}

#[test]
fn a_board_at_another_site_that_no_relay_shows_is_absent_and_the_relay_to_be_started() {
    let name = format!("relay:no-bench-{}.sensor", std::process::id());
    let (_link, told) = link_to(Role::Sensor, Place::Port(name.clone().into()));
    let state = turns_to(&told, "absent");
    assert_eq!(state.to_string(), format!("{name}: not there"));
    let advice = state.advice().expect("there is something to be done");
    assert!(advice.starts_with("start the relay"), "{advice}");
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
    // A write that waited would wait for ever: nobody reads.
    let stuck = wait_until(LIMIT, || {
        (0..100).any(|_| link.post(&long) == Err(NotSent::Stuck))
    });
    assert!(stuck, "the line took everything");
    // The board is heard as before.
    board.say(motion(1));
    let heard = |event| matches!(event, Event::Heard { message, .. } if message == motion(1));
    assert!(wait_until(LIMIT, || told.try_iter().any(&heard)));
    // A little may still go: the kernel moves bytes on when it comes to it.
    assert!(wait_until(LIMIT, || link.post(&STOP) == Err(NotSent::Stuck)));
    assert!(link.counters().dropped > 0);
    // What is said when the line takes bytes again is understood: no frame was left half said.
    board.deafen(false);
    assert!(wait_until(LIMIT, || link.post(&STOP).is_ok()));
    assert!(wait_until(LIMIT, || board.take_heard().contains(&STOP)));
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
    for sequence in 0..FRAMES {
        if sequence % 100 == 0 {
            let there = || heard.load(Ordering::SeqCst) + AHEAD > u64::from(sequence);
            assert!(wait_until(LIMIT, there), "stuck at {sequence}");
        }
        board.say(motion(sequence));
    }
    let all = || heard.load(Ordering::SeqCst) == u64::from(FRAMES);
    assert!(wait_until(LIMIT, all), "{}", heard.load(Ordering::SeqCst));
    assert_eq!(*wrong.lock().expect("sound"), Vec::<u32>::new());
    let counters = link.counters();
    assert_eq!((counters.lost, counters.corrupt, counters.late), (0, 0, 0));
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
