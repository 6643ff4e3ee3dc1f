//! `host-bridge doctor` as its user starts it, before boards that are well and boards that are not.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::{
    Contact, DisplayCounters, DisplayState, Estimate, GaugeHealth, Hello, Message, Motion,
    PortCounters, Range, ResetCause, Role, RoleCounters, SensorCounters, Status, Trip,
};
use serde_json::Value;
use serialport::{SerialPort, TTYPort};
use tests::bridge::{self, Ended};
use tests::fake_board::{FakeBoard, Script};

/// Far more than a look of a second takes.
const LIMIT: Duration = Duration::from_secs(30);

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

fn board(role: Role, status: fn(u64) -> Status) -> FakeBoard {
    FakeBoard::acting(hello(role), script(role, status))
}

fn doctor(sensor: &Path, display: &Path, more: &[&str]) -> Ended {
    let (sensor, display) = (sensor.to_string_lossy(), display.to_string_lossy());
    let mut arguments = vec![
        "doctor",
        "--for",
        "1",
        "--sensor",
        &sensor,
        "--display",
        &display,
    ];
    arguments.extend(more);
    bridge::run(arguments, LIMIT)
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
    let sensor = board(Role::Sensor, well_sensor);
    let display = board(Role::Display, well_display);
    let ended = doctor(sensor.path(), display.path(), &[]);
    assert_eq!(
        ended.status.code(),
        Some(0),
        "{}{}",
        ended.stdout,
        ended.stderr
    );
    assert!(ended.stdout.ends_with("\nall well\n"), "{}", ended.stdout);
    assert!(!ended.stdout.contains('\x1b'), "{}", ended.stdout);
    assert!(
        ended.stdout.lines().all(|line| line.chars().count() <= 80),
        "{}",
        ended.stdout
    );
    assert!(
        ended.stdout.contains("sensor 0.1.0 on stm32f429zi"),
        "{}",
        ended.stdout
    );
}

#[test]
fn scripts_get_the_same_as_json() {
    let sensor = board(Role::Sensor, well_sensor);
    let display = board(Role::Display, well_display);
    let ended = doctor(sensor.path(), display.path(), &["--json"]);
    let document = document(&ended);
    assert_eq!(ended.status.code(), Some(0), "{document:#}");
    assert_eq!(document["well"], true);
    let board = &document["boards"][0];
    assert_eq!(board["state"], "known");
    assert_eq!(board["hello"]["chip"], "stm32f429zi");
    assert_eq!(
        board["clock"]["drift_ppm"].as_f64().map(f64::is_finite),
        Some(true)
    );
    let rate_hz = board["rate_hz"].as_f64().expect("a second's estimates");
    assert!((80.0..120.0).contains(&rate_hz), "{rate_hz}");
    assert_eq!(document["boards"][1]["supervisor"], "ready");
}

#[test]
fn exchanged_boards_are_both_named() {
    let sensor = board(Role::Sensor, well_sensor);
    let display = board(Role::Display, well_display);
    let ended = doctor(display.path(), sensor.path(), &["--json"]);
    let document = document(&ended);
    assert_eq!(ended.status.code(), Some(1), "{document:#}");
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
    let sensor = board(Role::Sensor, noisy);
    let display = board(Role::Display, stopped);
    let ended = doctor(sensor.path(), display.path(), &[]);
    assert_eq!(ended.status.code(), Some(1));
    let words: Vec<&str> = ended.stdout.split_whitespace().collect();
    let said = words.join(" ");
    for line in [
        "sensor: restarted by its watchdog twice since power came on",
        "noise and framing errors (line_errors), ",
        "-> see the wires between the boards, their ground, and that nothing else drives PD6",
        "display: console: 3 damaged frames (corrupt), none while it was looked at",
        "display: no stimulus: stopped: emergency stop",
        "4 findings",
    ] {
        assert!(said.contains(line), "no {line:?} in:\n{}", ended.stdout);
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
    let (mut far, near) = TTYPort::pair().expect("the system has pseudo-terminals");
    far.write_all(&noise).expect("it takes so many");
    let port = PathBuf::from(near.name().expect("a pseudo-terminal has a name"));
    let ended = doctor(Path::new("/dev/no-such-port"), &port, &["--json"]);
    let document = document(&ended);
    assert_eq!(ended.status.code(), Some(1), "{document:#}");
    assert_eq!(kinds(&document, "sensor"), ["absent"]);
    assert_eq!(kinds(&document, "display"), ["garbage"]);
    assert_eq!(document["boards"][0]["state"], "absent");
}

#[test]
fn a_port_of_another_program_is_named_and_left_to_it() {
    let sensor = board(Role::Sensor, well_sensor);
    let display = board(Role::Display, well_display);
    let other = File::open(sensor.path()).expect("the port is there");
    other.try_lock().expect("nobody else has it");
    let ended = doctor(sensor.path(), display.path(), &["--json"]);
    let document = document(&ended);
    assert_eq!(ended.status.code(), Some(1), "{document:#}");
    assert_eq!(kinds(&document, "sensor"), ["busy"]);
    assert_eq!(kinds(&document, "display"), Vec::<String>::new());
}

#[test]
fn one_board_alone_is_a_bench() {
    let sensor = board(Role::Sensor, well_sensor);
    let port = sensor.path().to_string_lossy();
    let ended = bridge::run(["doctor", "--for", "1", "--sensor", &*port], LIMIT);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stdout);
    assert!(!ended.stdout.contains("\ndisplay\n"), "{}", ended.stdout);
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
    for fact in [&*path, "line 2", "port"] {
        assert!(ended.stderr.contains(fact), "{}", ended.stderr);
    }
}

#[test]
fn a_firmware_of_another_version_than_the_benchs_is_named() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bridge_doctor");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let newer = FakeBoard::acting(
        Hello::new(Role::Sensor, "stm32f429zi", [9, 9, 9]),
        script(Role::Sensor, well_sensor),
    );
    let display = board(Role::Display, well_display);
    let bench = folder.join("elves.toml");
    let text = format!(
        "[sensor]\nport = {:?}\nelf = {:?}\n[display]\nport = {:?}\nelf = \"no-such.elf\"\n",
        newer.path(),
        tests::elves::path(Role::Sensor),
        display.path(),
    );
    fs::write(&bench, text).expect("a file can be written");
    let path = bench.to_string_lossy();
    let ended = bridge::run(["doctor", "--for", "1", "--json", "--bench", &*path], LIMIT);
    let document = document(&ended);
    assert_eq!(ended.status.code(), Some(1), "{document:#}");
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
