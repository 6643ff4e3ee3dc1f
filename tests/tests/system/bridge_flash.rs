//! The bridge's flashing as far as it needs no probe: the real ELFs planned and exchanged, and the board's
//! console before and after.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use host_bridge::flash::console::{NoHello, look, look_at_all, wait};
use host_bridge::flash::firmware::{Firmware, FirmwareError};
use host_bridge::flash::plan::Plan;
use host_bridge::place::Place;
use host_bridge::state::State;
use host_bridge::system::System;
use protocol::{Hello, Role};
use tests::elves;
use tests::fake_board::FakeBoard;
use tests::virtual_ports::VirtualBench;

/// Of virtual time, but for what waits for an event of the system's: there only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

fn place(board: &FakeBoard) -> Place {
    Place::Port(board.path().clone())
}

fn hello(role: Role, version: [u8; 3]) -> Hello {
    Hello::new(role, "STM32F429ZI", version)
}

#[test]
fn both_firmwares_go_into_the_first_sectors() {
    for role in [Role::Sensor, Role::Display] {
        let firmware = Firmware::read(&elves::path(role), role).expect("the build's firmware");
        let plan = Plan::new(firmware).expect("it fits");
        assert_eq!(plan.sectors[0].number, 0);
        assert!(plan.share_percent() < 50.0, "{plan}");
        assert!(plan.pages as u64 * plan.page_bytes >= plan.bytes, "{plan}");
        plan.loader().expect("probe-rs agrees");
    }
}

#[test]
fn firmwares_that_were_exchanged_are_refused() {
    for (role, other) in [(Role::Sensor, Role::Display), (Role::Display, Role::Sensor)] {
        let error = Firmware::read(&elves::path(other), role).expect_err("the other board's");
        assert!(
            matches!(error, FirmwareError::WrongRole { .. }),
            "{error:?}"
        );
        assert!(
            error
                .to_string()
                .contains(&format!("flash {}", other.name())),
            "{error}"
        );
    }
}

#[test]
fn the_new_firmware_is_heard() {
    let bench = VirtualBench::default();
    let wanted = hello(Role::Sensor, [0, 1, 0]);
    let board = FakeBoard::acting_on(&bench, wanted, Box::new(|_| Vec::new()));
    let heard = wait(
        &bench.system(),
        Role::Sensor,
        place(&board),
        wanted,
        LIMIT,
        &AtomicBool::new(false),
    );
    assert_eq!(heard.expect("it says Hello").version, [0, 1, 0]);
}

#[test]
fn an_old_firmware_that_still_answers_is_not_taken_for_the_new_one() {
    let bench = VirtualBench::default();
    let old = hello(Role::Sensor, [0, 0, 9]);
    let board = FakeBoard::acting_on(&bench, old, Box::new(|_| Vec::new()));
    let wanted = hello(Role::Sensor, [0, 1, 0]);
    let error = wait(
        &bench.system(),
        Role::Sensor,
        place(&board),
        wanted,
        LIMIT,
        &AtomicBool::new(false),
    )
    .expect_err("another version");
    assert!(matches!(error, NoHello::AnotherVersion { .. }), "{error:?}");
    let text = error.to_string();
    assert!(
        text.contains("0.0.9") && text.contains("flashed and verified"),
        "{text}"
    );
}

#[test]
fn a_board_that_stays_silent_is_said_to_be_flashed_all_the_same() {
    let system = VirtualBench::default().system();
    let place = Place::Port("/dev/no-such-port".into());
    let wanted = hello(Role::Display, [0, 1, 0]);
    let called_off = AtomicBool::new(false);
    let error = wait(&system, Role::Display, place, wanted, LIMIT, &called_off)
        .expect_err("nobody is there");
    let text = error.to_string();
    assert!(
        text.contains("flashed and verified, but no Hello"),
        "{text}"
    );
    assert!(text.contains("/dev/no-such-port"), "{text}");
}

#[test]
fn a_wait_can_be_called_off() {
    let place = Place::Port("/dev/no-such-port".into());
    let wanted = hello(Role::Display, [0, 1, 0]);
    let system = VirtualBench::default().system();
    let called_off = AtomicBool::new(true);
    let error = wait(&system, Role::Display, place, wanted, LIMIT, &called_off);
    assert!(matches!(error, Err(NoHello::CalledOff)), "{error:?}");
}

#[test]
fn who_is_there_is_known_before_anything_is_erased() {
    let bench = VirtualBench::default();
    let [sensor, display] = [Role::Sensor, Role::Display].map(|role| FakeBoard::on(&bench, role));
    let nobody = Place::Port("/dev/no-such-port".into());
    let states = look_at_all(
        &bench.system(),
        Role::Sensor,
        vec![place(&sensor), place(&display), nobody],
    );
    assert!(matches!(states[0], State::Known { .. }), "{:?}", states[0]);
    assert!(
        matches!(states[1], State::Stranger { .. }),
        "{:?}",
        states[1]
    );
    assert!(matches!(states[2], State::Absent { .. }), "{:?}", states[2]);
}

#[test]
fn a_console_that_another_program_has_is_named() {
    let board = FakeBoard::saying(hello(Role::Sensor, [0, 1, 0]));
    let _monitor = serialport::new(board.path().to_string_lossy(), 921_600)
        .open_native()
        .expect("the port can be opened");
    let state = look(&System::default(), Role::Sensor, place(&board));
    assert!(matches!(state, State::Busy { .. }), "{state:?}");
}
