//! The bridge's way to a board: found, greeted, lost and found again, and named when something is wrong.

use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use host_bridge::link::{Event, Link};
use host_bridge::place::Place;
use host_bridge::state::State;
use protocol::{Message, Motion, Role, Stop, StopReason};
use tests::fake_board::{FakeBoard, wait_until};

/// Far more than anything here takes.
const LIMIT: Duration = Duration::from_secs(10);

fn link(role: Role, board: &FakeBoard) -> (Link, Receiver<Event>) {
    let (events, told) = channel();
    let link = Link::open(role, Place::Port(board.path().clone()), move |event| {
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

#[test]
fn a_board_is_greeted_heard_and_spoken_to() {
    let board = FakeBoard::new(Role::Display);
    let (link, told) = link(Role::Display, &board);
    turned(&told, State::is_known);
    let motion = Message::Motion(Motion {
        sequence: 1,
        instant_us: 2,
        position_um: 3,
        velocity_um_s: 4,
    });
    board.say(motion.clone());
    let heard = |event| matches!(event, Event::Heard { message, .. } if message == motion);
    assert!(wait_until(LIMIT, || told.try_iter().any(&heard)));
    let stop = Message::Stop(Stop {
        reason: StopReason::Operator,
    });
    link.post(&stop).expect("the board is there");
    assert!(wait_until(LIMIT, || board.take_heard().contains(&stop)));
}
