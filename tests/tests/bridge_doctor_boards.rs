//! `host-bridge doctor` before the two boards' own firmware, on an emulated bench at real time.

use std::fs::OpenOptions;
use std::time::{Duration, Instant};

use hil_sim_boards::bench;
use hil_sim_boards::bench::{Bench, PortName};
use protocol::Role;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serde_json::Value;
use tests::bench::{BAUD, ExclusiveBench, bench};
use tests::bridge::{self, Ended, Running};
use tests::fake_board::wait_until;

/// Far more than a look takes on a busy machine.
const LIMIT: Duration = Duration::from_secs(300);
/// A board that was understood is called silent after 2.5 s without a frame; what is heard instead is judged
/// by the 1.5 to 3 s before.
const GARBLED: Duration = Duration::from_secs(6);
/// What an emulator that does not keep pace with the wall clock is found by.
const OF_A_SLOW_MACHINE: [&str; 3] = ["drift", "rate", "round-trip"];

/// A doctor that looks until it is interrupted: for how long, the boards' time decides, and not how fast
/// this machine emulates them.
fn start(bench: &Bench) -> Running {
    let mut doctor = Running::start(
        bridge::command()
            .args(["doctor", "--json", "--for", "3600", "--bench"])
            .arg(bench.bench_file()),
    );
    for port in [PortName::SensorConsole, PortName::DisplayConsole] {
        let is_open = wait_until(LIMIT, || bench.has_client(port) || doctor.has_ended());
        assert!(is_open && bench.has_client(port), "{port} was not opened");
    }
    doctor
}

/// What a doctor tells that has looked for so many seconds of the boards' time.
fn look(bench: &Bench, virtual_s: f64) -> Ended {
    let doctor = start(bench);
    pass(bench, virtual_s);
    end(doctor)
}

/// What a doctor tells that is interrupted.
fn end(doctor: Running) -> Ended {
    doctor.signal("INT");
    doctor.wait(LIMIT)
}

/// Waits for some seconds of the boards' time.
fn pass(bench: &Bench, virtual_s: f64) {
    let end_s = bench.now_s() + virtual_s;
    assert!(wait_until(LIMIT, || bench.now_s() >= end_s));
}

fn document(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}{}", ended.stdout, ended.stderr))
}

/// The findings but for those of a slow machine, and whether there were such.
fn findings(document: &Value) -> (Vec<(String, String)>, bool) {
    let text = |value: &Value| value.as_str().unwrap_or("bench").to_owned();
    let all: Vec<(String, String)> = document["findings"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|finding| (text(&finding["board"]), text(&finding["kind"])))
        .collect();
    let is_of_boards = |found: &&(String, String)| !OF_A_SLOW_MACHINE.contains(&found.1.as_str());
    let of_boards: Vec<(String, String)> = all.iter().filter(is_of_boards).cloned().collect();
    let is_slow = of_boards.len() < all.len();
    (of_boards, is_slow)
}

fn found(board: &str, kind: &str) -> (String, String) {
    (board.to_owned(), kind.to_owned())
}

/// One pair of boards for all that leaves it as it was: what an emulated pair takes longest for is its start.
/// Those come first that want nothing found at all.
#[test]
fn a_day_at_one_bench() {
    // One specimen: at each border the sensor may say what the display finds implausible, and the doctor tells.
    let ExclusiveBench { bench, .. } = &bench("doctor", |options| {
        options
            .scene
            .surface
            .specimens
            .retain(|one| one.length_mm.is_infinite());
    });
    boards_that_are_well_are_told_so(bench);
    two_doctors_at_once_find_the_same(bench);
    a_cable_pulled_and_put_back_is_noticed(bench);
    an_emergency_stop_is_named(bench);
    a_board_that_restarts_is_noticed(bench);
    a_wrong_baud_rate_is_garbage_and_named(bench);
}

fn boards_that_are_well_are_told_so(bench: &Bench) {
    let ended = look(bench, 2.2);
    let document = document(&ended);
    let (findings, is_slow) = findings(&document);
    assert_eq!(findings, [], "{document:#}");
    assert_eq!(ended.status.code(), Some(i32::from(is_slow)));
    assert_eq!(document["well"], !is_slow);
    for board in [0, 1].map(|at| &document["boards"][at]) {
        assert_eq!(board["state"], "known");
        assert_eq!(board["hello"]["chip"], "STM32F429ZI");
        assert_eq!(board["reset"], "power");
        assert_eq!(board["elf"]["error"], Value::Null);
        assert!(board["peer_frames"].as_u64() > Some(0), "{board:#}");
        assert!(board["clock"]["drift_ppm"].is_number(), "{board:#}");
    }
    assert_eq!(document["boards"][0]["gauges"][0], "good");
}

fn an_emergency_stop_is_named(bench: &Bench) {
    bench
        .command(bench::Command::Stop)
        .expect("the bench stands");
    let document = document(&look(bench, 1.2));
    let (findings, _) = findings(&document);
    assert_eq!(findings, [found("display", "stopped")], "{document:#}");
    assert_eq!(
        document["boards"][1]["supervisor"],
        "stopped: emergency stop"
    );
}

fn a_cable_pulled_and_put_back_is_noticed(bench: &Bench) {
    let doctor = start(bench);
    let port = PortName::SensorConsole;
    // The board is heard first.
    pass(bench, 0.5);
    bench.pull(port).expect("the port is there");
    pass(bench, 0.3);
    bench.plug(port).expect("the port can be made");
    assert!(wait_until(LIMIT, || bench.has_client(port)));
    pass(bench, 1.2);
    let ended = end(doctor);
    let document = document(&ended);
    let (findings, _) = findings(&document);
    assert_eq!(findings, [found("sensor", "lost")], "{document:#}");
    assert_eq!(ended.status.code(), Some(1));
    assert_eq!(document["boards"][0]["state"], "known");
    assert_eq!(document["boards"][0]["losses"], 1);
}

fn a_board_that_restarts_is_noticed(bench: &Bench) {
    let doctor = start(bench);
    pass(bench, 0.7);
    bench
        .command(bench::Command::Reset(Role::Sensor))
        .expect("the bench stands");
    pass(bench, 1.5);
    let document = document(&end(doctor));
    let (findings, _) = findings(&document);
    assert!(
        findings.contains(&found("sensor", "restarted")),
        "{document:#}"
    );
    assert_eq!(document["boards"][0]["restarts"], 1);
    assert_eq!(document["boards"][0]["reset"], "pin");
}

#[test]
fn boards_that_are_not_joined_hear_nothing_of_each_other() {
    let alone = bench("doctor-apart", |options| options.is_apart = true);
    let apart = found("bench", "peer-link");
    let seen = document(&look(&alone.bench, 2.2));
    assert!(findings(&seen).0.contains(&apart), "{seen:#}");
}

fn a_wrong_baud_rate_is_garbage_and_named(bench: &Bench) {
    let path = bench.path(PortName::DisplayConsole);
    // Opened before the doctor has it for itself.
    let port = OpenOptions::new()
        .read(true)
        .open(path)
        .expect("the port is there");
    // Not by stty, which does not know a rate without a name of its own.
    let rate = || tcgetattr(&port).expect("a terminal").output_speed();
    let set_rate = |rate| {
        let mut settings = tcgetattr(&port).expect("a terminal");
        settings.set_speed(rate).expect("a rate");
        tcsetattr(&port, OptionalActions::Now, &settings).expect("a terminal");
    };
    // The doctor before has left its own.
    set_rate(38_400);
    let doctor = start(bench);
    assert!(wait_until(LIMIT, || rate() == BAUD));
    set_rate(115_200);
    let end_of_garbling = Instant::now() + GARBLED;
    assert!(wait_until(LIMIT, || Instant::now() >= end_of_garbling));
    let document = document(&end(doctor));
    let (findings, _) = findings(&document);
    assert!(
        findings.contains(&found("display", "garbage")),
        "{document:#}"
    );
    let advice = document["findings"].to_string();
    assert!(advice.contains("921600 baud, 8N1"), "{advice}");
}

fn two_doctors_at_once_find_the_same(bench: &Bench) {
    let both = [start(bench), start(bench)];
    pass(bench, 1.2);
    // What is said while the port changes hands, the guest misses: no fault of the line.
    for doctor in both {
        let document = document(&end(doctor));
        assert_eq!(findings(&document).0, [], "{document:#}");
    }
}
