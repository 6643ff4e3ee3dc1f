//! `host-bridge doctor` before boards that are well and boards that are not, by virtual time; and as its user
//! starts it.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use host_bridge::bench::{Bench, Seat};
use host_bridge::doctor::report::Style;
use host_bridge::doctor::{findings, json, look, report};

use protocol::{
    Contact, DisplayCounters, DisplayState, Estimate, GaugeHealth, Hello, Message, Motion,
    PortCounters, Range, ResetCause, Role, RoleCounters, SensorCounters, Status, Trip,
};
use serde_json::Value;
use tests::bridge::{self, Ended};
use tests::fake_board::{FakeBoard, Script};
use tests::virtual_ports::VirtualBench;

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);
/// How long the boards are listened to by virtual time.
const SPAN: Duration = Duration::from_secs(1);

fn hello(role: Role) -> Hello {
    Hello::new(role, "stm32f429zi", [0, 1, 0])
}

/// What a board says by itself: what its role says, at its rate, and `status` of each second.
fn script(role: Role, status: fn(u64) -> Status) -> Script {
    let mut said = 0;
    let mut told = 0;
    Box::new(move |now_us| {
        let mut messages = Vec::new();
        let period_us = if role == Role::Sensor { 10_000 } else { 2_000 };
        while u64::from(said) * period_us < now_us {
            messages.push(if role == Role::Sensor {
                estimate(said, now_us)
            } else {
                motion(said, now_us)
            });
            said += 1;
        }
        // Often, so that a short look sees two.
        if now_us / 250_000 > told {
            told = now_us / 250_000;
            messages.push(Message::Status(status(now_us)));
        }
        messages
    })
}

fn motion(sequence: u32, instant_us: u64) -> Message {
    Message::Motion(Motion {
        sequence,
        instant_us,
        position_um: 0,
        velocity_um_s: 0,
    })
}

fn estimate(sequence: u32, instant_us: u64) -> Message {
    Message::Estimate(Estimate {
        sequence,
        instant_us,
        wavelength_mm: Some(2.0),
        valid: true,
        confidence: 1.0,
        amplitude_lsb: 50.0,
        counted_mm: None,
        range: Range::T1,
        contact: Contact::Slip,
        velocity_um_s: 0,
        lag_um: None,
        gauges_used: 31,
        health: [GaugeHealth::Good; 5],
    })
}

fn well(uptime_us: u64, role: RoleCounters) -> Status {
    let port = PortCounters {
        received: u32::try_from(uptime_us / 2_000).unwrap_or(u32::MAX),
        ..PortCounters::new()
    };
    Status {
        uptime_us,
        reset: ResetCause::Power,
        watchdog_resets: 0,
        stack_free_bytes: 80_000,
        peer: port,
        console: PortCounters::new(),
        role,
    }
}

fn well_sensor(uptime_us: u64) -> Status {
    well(uptime_us, RoleCounters::Sensor(SensorCounters::ZERO))
}

fn well_display(uptime_us: u64) -> Status {
    well(
        uptime_us,
        RoleCounters::Display(DisplayCounters {
            state: DisplayState::Ready,
            ..DisplayCounters::ZERO
        }),
    )
}

fn board(bench: &VirtualBench, role: Role, status: fn(u64) -> Status) -> FakeBoard {
    FakeBoard::acting_on(bench, hello(role), script(role, status))
}

fn seat(port: &Path) -> Seat {
    Seat {
        port: Some(port.to_owned()),
        ..Seat::default()
    }
}

/// What a doctor finds.
struct Found {
    text: String,
    document: Value,
    is_well: bool,
}

fn examine(bench: &VirtualBench, boards: &Bench) -> Found {
    let ended = AtomicBool::new(false);
    let examination = look::look(&bench.system(), boards, SPAN, &ended);
    let findings = findings::of(&examination);
    let document = json::write(&examination, &findings);
    Found {
        text: report::write(&examination, &findings, Style::Plain),
        document: serde_json::from_str(&document).unwrap_or_else(|error| panic!("{error}")),
        is_well: findings.is_empty(),
    }
}

fn doctor(bench: &VirtualBench, sensor: &Path, display: &Path) -> Found {
    let boards = Bench {
        sensor: seat(sensor),
        display: seat(display),
    };
    examine(bench, &boards)
}

fn document(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}{}", ended.stdout, ended.stderr))
}

/// The kinds of a board's findings.
fn kinds(document: &Value, board: &str) -> Vec<String> {
    document["findings"]
        .as_array()
        .expect("a list")
        .iter()
        .filter(|finding| finding["board"] == board)
        .map(|finding| finding["kind"].as_str().expect("a word").to_owned())
        .collect()
}

#[test]
fn boards_that_are_well_are_told_so() {
    let bench = VirtualBench::default();
    let sensor = board(&bench, Role::Sensor, well_sensor);
    let display = board(&bench, Role::Display, well_display);
    let Found { text, is_well, .. } = doctor(&bench, sensor.path(), display.path());
    assert!(is_well && text.ends_with("\nall well\n"), "{text}");
    assert!(!text.contains('\x1b'), "{text}");
    assert!(
        text.lines().all(|line| line.chars().count() <= 80),
        "{text}"
    );
    assert!(text.contains("sensor 0.1.0 on stm32f429zi"), "{text}");
}

#[test]
fn scripts_get_the_same_as_json() {
    let bench = VirtualBench::default();
    let sensor = board(&bench, Role::Sensor, well_sensor);
    let display = board(&bench, Role::Display, well_display);
    let Found { document, .. } = doctor(&bench, sensor.path(), display.path());
    assert_eq!(document["well"], true, "{document:#}");
    let board = &document["boards"][0];
    assert_eq!(board["state"], "known");
    assert_eq!(board["hello"]["chip"], "stm32f429zi");
    // One clock for both, and lines that take no time.
    assert_eq!(board["clock"]["drift_ppm"].as_f64(), Some(0.0));
    assert_eq!(document["boards"][1]["supervisor"], "ready");
    for (at, wanted_hz) in [(0, 100.0), (1, 500.0)] {
        let rate_hz = document["boards"][at]["rate_hz"].as_f64();
        let rate_hz = rate_hz.expect("a second's messages");
        // To one message.
        assert!((rate_hz - wanted_hz).abs() <= 1.0, "{rate_hz}");
    }
}

#[test]
fn exchanged_boards_are_both_named() {
    let bench = VirtualBench::default();
    let sensor = board(&bench, Role::Sensor, well_sensor);
    let display = board(&bench, Role::Display, well_display);
    let Found { document, .. } = doctor(&bench, display.path(), sensor.path());
    assert_eq!(kinds(&document, "sensor"), ["wrong-role"]);
    assert_eq!(kinds(&document, "display"), ["wrong-role"]);
    assert_eq!(document["boards"][0]["hello"]["role"], "display");
}

#[test]
fn counters_and_a_stop_are_findings() {
    fn noisy(uptime_us: u64) -> Status {
        let mut status = well_sensor(uptime_us);
        status.peer.line_errors = u32::try_from(uptime_us / 1_000).unwrap_or(u32::MAX);
        status.watchdog_resets = 2;
        status
    }
    fn stopped(uptime_us: u64) -> Status {
        let mut status = well_display(uptime_us);
        status.console.corrupt = 3;
        status.role = RoleCounters::Display(DisplayCounters {
            state: DisplayState::Stopped(Trip::EmergencyStop),
            ..DisplayCounters::ZERO
        });
        status
    }
    let bench = VirtualBench::default();
    let sensor = board(&bench, Role::Sensor, noisy);
    let display = board(&bench, Role::Display, stopped);
    let Found { text, .. } = doctor(&bench, sensor.path(), display.path());
    let words: Vec<&str> = text.split_whitespace().collect();
    let said = words.join(" ");
    for line in [
        "sensor: restarted by its watchdog twice since power came on",
        "noise and framing errors (line_errors), ",
        "-> see the wires between the boards, their ground, and that nothing else drives PD6",
        "display: console: 3 damaged frames (corrupt), none while it was looked at",
        "display: no stimulus: stopped: emergency stop",
        "4 findings",
    ] {
        assert!(said.contains(line), "no {line:?} in:\n{text}");
    }
    assert!(said.contains("of them while it was looked at"), "{said}");
}

#[test]
fn a_board_that_is_absent_and_one_that_sends_garbage_are_named() {
    let mut seed = 7_u32;
    let noise: Vec<u8> = (0..1_500)
        .map(|_| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed.to_le_bytes()[3] | 0x80
        })
        .collect();
    let bench = VirtualBench::default();
    let (port, mut end) = bench.cable();
    end.write_all(&noise).expect("it takes so many");
    let Found { document, .. } = doctor(&bench, Path::new("/virtual/nowhere"), &port);
    assert_eq!(kinds(&document, "sensor"), ["absent"]);
    assert_eq!(kinds(&document, "display"), ["garbage"]);
    assert_eq!(document["boards"][0]["state"], "absent");
}

#[test]
fn a_port_of_another_program_is_named_and_left_to_it() {
    let [sensor, other_board] = [Role::Sensor, Role::Display].map(FakeBoard::new);
    let other = File::open(sensor.path()).expect("the port is there");
    other.try_lock().expect("nobody else has it");
    let [busy, wrong] = [&sensor, &other_board].map(|board| board.path().to_string_lossy());
    // Neither takes a look: nothing is heard, and how long it lasts is no matter.
    let words = ["doctor", "--json", "--for", "1", "--sensor", &busy];
    let ended = bridge::run(words.into_iter().chain(["--display", "/dev/none"]), LIMIT);
    let document = document(&ended);
    assert_eq!(ended.status.code(), Some(1), "{document:#}");
    assert_eq!(kinds(&document, "sensor"), ["busy"]);
    assert_eq!(kinds(&document, "display"), ["absent"]);
    let ended = bridge::run(["doctor", "--for", "1", "--sensor", &wrong], LIMIT);
    assert_eq!(ended.status.code(), Some(1));
    assert!(
        ended.stdout.contains("display 0.1.0 on stm32f429zi"),
        "{}",
        ended.stdout
    );
}

#[test]
fn one_board_alone_is_a_bench() {
    let bench = VirtualBench::default();
    let sensor = board(&bench, Role::Sensor, well_sensor);
    let boards = Bench {
        sensor: seat(sensor.path()),
        display: Seat::default(),
    };
    let Found { text, is_well, .. } = examine(&bench, &boards);
    assert!(is_well && !text.contains("\ndisplay\n"), "{text}");
}

#[test]
fn a_bench_file_that_is_wrong_is_refused_before_anything_is_looked_at() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bridge_doctor");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let bench = folder.join("bad.toml");
    fs::write(&bench, "[sensor]\nport = 3\n").expect("a file can be written");
    let path = bench.to_string_lossy();
    let ended = bridge::run(["doctor", "--json", "--bench", &*path], LIMIT);
    assert_eq!(ended.status.code(), Some(2));
    assert!(ended.stdout.is_empty(), "{}", ended.stdout);
    let place = format!("{path}:2: sensor.port: ");
    assert!(ended.stderr.contains(&place), "{}", ended.stderr);
}

#[test]
fn a_firmware_of_another_version_than_the_benchs_is_named() {
    let bench = VirtualBench::default();
    let newer = FakeBoard::acting_on(
        &bench,
        Hello::new(Role::Sensor, "stm32f429zi", [9, 9, 9]),
        script(Role::Sensor, well_sensor),
    );
    let display = board(&bench, Role::Display, well_display);
    let with = |port: &Path, elf| Seat {
        elf: Some(elf),
        ..seat(port)
    };
    let boards = Bench {
        sensor: with(newer.path(), tests::elves::path(Role::Sensor)),
        display: with(display.path(), "no-such.elf".into()),
    };
    let Found { document, .. } = examine(&bench, &boards);
    assert_eq!(kinds(&document, "sensor"), ["elf-differs"]);
    assert_eq!(kinds(&document, "display"), ["elf-unusable"]);
}

#[test]
fn help_tells_the_exit_statuses() {
    let ended = bridge::run(["doctor", "--help"], LIMIT);
    assert_eq!(ended.status.code(), Some(0));
    assert!(
        ended.stdout.contains("Exit status: 0 if all is well"),
        "{}",
        ended.stdout
    );
}
