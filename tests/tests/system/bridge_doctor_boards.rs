//! `host-bridge doctor` before the two boards' own firmware, by virtual time: what is found hangs on nothing else.

use std::time::Duration;

use hil_sim_boards::bench::{Command, Options, PortName};
use protocol::Role;
use serde_json::Value;
use tests::bench::bench;
use tests::bridge;
use tests::fake_board::wait_until;
use tests::virtual_boards::VirtualBoards;
use tests::virtual_desk::{Ended, Running};

/// A board that was understood is called silent after 2.5 s without a frame; what is heard instead is judged
/// by the 1.5 to 3 s before.
const GARBLED_S: f64 = 6.0;

/// A doctor that looks until it is interrupted.
fn start(bench: &VirtualBoards) -> Running {
    let file = bench.boards.bench_file();
    let file = file.to_str().expect("UTF-8");
    let words = ["doctor", "--json", "--for", "3600", "--bench", file];
    let doctor = bench.bench.start(&words, "");
    for port in [PortName::SensorConsole, PortName::DisplayConsole] {
        bench.wait_until("open port", || bench.boards.has_client(port));
    }
    doctor
}

/// What a doctor tells that has looked for so many seconds.
fn look(bench: &VirtualBoards, virtual_s: f64) -> Ended {
    let doctor = start(bench);
    bench.pass(virtual_s);
    doctor.interrupt()
}

fn document(ended: &Ended) -> Value {
    serde_json::from_str(&ended.output).unwrap_or_else(|error| panic!("{error}: {}", ended.output))
}

/// What is found of which board.
fn findings(document: &Value) -> Vec<(String, String)> {
    let text = |value: &Value| value.as_str().unwrap_or("bench").to_owned();
    let findings = document["findings"].as_array().expect("a list");
    let of = |finding: &Value| (text(&finding["board"]), text(&finding["kind"]));
    findings.iter().map(of).collect()
}

fn found(board: &str, kind: &str) -> (String, String) {
    (board.to_owned(), kind.to_owned())
}

/// One specimen: at each border the sensor may say what the display finds implausible, and the doctor tells.
fn one_specimen(options: &mut Options) {
    let specimens = &mut options.scene.surface.specimens;
    specimens.retain(|one| one.length_mm.is_infinite());
}

/// One pair of boards for all that leaves it as it was: what an emulated pair takes longest for is its start.
/// Those come first that want nothing found at all.
#[test]
fn a_day_at_one_bench() {
    let bench = &VirtualBoards::new("doctor", one_specimen);
    boards_that_are_well_are_told_so(bench);
    a_cable_pulled_and_put_back_is_noticed(bench);
    an_emergency_stop_is_named(bench);
    a_board_that_restarts_is_noticed(bench);
    a_wrong_baud_rate_is_garbage_and_named(bench);
}

fn boards_that_are_well_are_told_so(bench: &VirtualBoards) {
    let ended = look(bench, 2.2);
    let document = document(&ended);
    assert_eq!(findings(&document), [], "{document:#}");
    assert_eq!(ended.status, Some(0));
    assert_eq!(document["well"], true);
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

fn an_emergency_stop_is_named(bench: &VirtualBoards) {
    bench
        .boards
        .command(Command::Stop)
        .expect("the bench stands");
    let document = document(&look(bench, 1.2));
    assert_eq!(
        findings(&document),
        [found("display", "stopped")],
        "{document:#}"
    );
    assert_eq!(
        document["boards"][1]["supervisor"],
        "stopped: emergency stop"
    );
}

fn a_cable_pulled_and_put_back_is_noticed(bench: &VirtualBoards) {
    let doctor = start(bench);
    let port = PortName::SensorConsole;
    // The board is heard first.
    bench.pass(0.5);
    bench.boards.pull(port).expect("the port is there");
    bench.pass(0.3);
    bench.boards.plug(port).expect("the port can be made");
    bench.wait_until("client", || bench.boards.has_client(port));
    bench.pass(1.2);
    let ended = doctor.interrupt();
    let document = document(&ended);
    assert_eq!(
        findings(&document),
        [found("sensor", "lost"), found("sensor", "rate")],
        "{document:#}"
    );
    assert_eq!(ended.status, Some(1));
    assert_eq!(document["boards"][0]["state"], "known");
    assert_eq!(document["boards"][0]["losses"], 1);
}

fn a_board_that_restarts_is_noticed(bench: &VirtualBoards) {
    let doctor = start(bench);
    bench.pass(0.7);
    bench
        .boards
        .command(Command::Reset(Role::Sensor))
        .expect("the bench stands");
    bench.pass(1.5);
    let document = document(&doctor.interrupt());
    assert!(
        findings(&document).contains(&found("sensor", "restarted")),
        "{document:#}"
    );
    assert_eq!(document["boards"][0]["restarts"], 1);
    assert_eq!(document["boards"][0]["reset"], "pin");
}

#[test]
fn boards_that_are_not_joined_hear_nothing_of_each_other() {
    let bench = VirtualBoards::new("doctor-apart", |options| options.is_apart = true);
    let seen = document(&look(&bench, 2.2));
    assert_eq!(findings(&seen), [found("bench", "peer-link")], "{seen:#}");
}

fn a_wrong_baud_rate_is_garbage_and_named(bench: &VirtualBoards) {
    let doctor = start(bench);
    let port = bench.boards.path(PortName::DisplayConsole);
    bench.bench.ports.set_baud(&port, 115_200);
    bench.pass(GARBLED_S);
    let document = document(&doctor.interrupt());
    assert!(
        findings(&document).contains(&found("display", "garbage")),
        "{document:#}"
    );
    let advice = document["findings"].to_string();
    assert!(advice.contains("921600 baud, 8N1"), "{advice}");
}

/// As programs, since what they share is a socket of the system's. What a machine finds that is too slow at the moment
/// is looked for again.
#[test]
fn two_doctors_at_once_find_the_same() {
    const LIMIT: Duration = Duration::from_secs(300);
    /// What an emulator that does not keep pace with the wall clock is found by.
    const OF_A_SLOW_EMULATOR: [&str; 3] = ["drift", "rate", "round-trip"];
    /// What is found of a line that stands still for a while.
    const OF_A_BUSY_MACHINE: [&str; 4] = ["lost", "silent", "opened", "no-status"];
    let alone = bench("doctors", one_specimen);
    // The gauges are known by then.
    assert!(wait_until(LIMIT, || alone.bench.now_s() >= 2.5));
    let start = || {
        let mut command = bridge::command();
        command.args(["doctor", "--json", "--for", "2", "--bench"]);
        bridge::Running::start(command.arg(alone.bench.bench_file()))
    };
    let are_well = || {
        // What is said while the port changes hands, the guest misses: no fault of the line.
        [start(), start()].map(|doctor| {
            let ended = doctor.wait(LIMIT);
            let document: Value = serde_json::from_str(&ended.stdout).expect("JSON");
            let mut found = findings(&document);
            found.retain(|(_, kind)| !OF_A_SLOW_EMULATOR.contains(&kind.as_str()));
            let is_busy = |(_, kind): &(String, String)| OF_A_BUSY_MACHINE.contains(&kind.as_str());
            assert!(found.iter().all(is_busy), "{document:#}");
            found.is_empty()
        })
    };
    assert!(wait_until(LIMIT, || are_well() == [true; 2]));
}
