//! `host-bridge monitor` with the boards' own firmwares at the far side.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::{self, BufRead, BufReader, Read};
use std::process::Command;
use std::time::{Duration, Instant};

use hil_sim_boards::bench::{Command as Order, PortName};
use host_bridge::recording::reader::Reader;
use host_bridge::recording::row::Row;
use protocol::Role;
use serde_json::Value;
use tests::bench::{BAUD, ExclusiveBench, bench, folder, until};
use tests::bridge;
use tests::elves;
use tests::relay::{Relay, free_port};
use tests::terminal::Terminal;

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(300);

fn monitor(alone: &ExclusiveBench) -> Command {
    let mut command = bridge::command();
    command
        .arg("monitor")
        .arg("--bench")
        .arg(alone.bench.bench_file());
    command
}

fn steady(name: &str) -> ExclusiveBench {
    bench(name, |options| {
        options.scene = hil_sim_core::scene::Scene::constant(2.0, 50.0);
    })
}

/// The next line with all of these words.
fn next_with(lines: &mut impl Iterator<Item = io::Result<String>>, words: &[&str]) -> String {
    let end = Instant::now() + LIMIT;
    let mut seen = String::new();
    while Instant::now() < end {
        let line = lines.next().expect("it goes on").expect("text");
        if words.iter().all(|words| line.contains(words)) {
            return line;
        }
        seen += &format!("{line}\n");
    }
    panic!("no line with {words:?} after\n{seen}");
}

#[test]
fn lines_tell_of_the_surface_the_cable_and_the_boards_logs() {
    let alone = steady("monitor-lines");
    let mut child = monitor(&alone)
        .args(["--plain", "--every", "0.2"])
        .spawn()
        .expect("the program can be started");
    let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
    let mut with = |words: &[&str]| next_with(&mut lines, words);
    let line = with(&[" valid ", " driving"]);
    let wavelength_mm: f64 = line
        .split_whitespace()
        .nth(3)
        .and_then(|cell| cell.parse().ok())
        .expect("a number");
    assert!((wavelength_mm - 2.0).abs() < 0.05, "{line}");
    // Pulled, and put back.
    let order = |order| alone.bench.command(order).expect("it can be done");
    order(Order::Pull(PortName::DisplayConsole));
    with(&["# ", "display absent: "]);
    order(Order::Plug(PortName::DisplayConsole));
    with(&["# ", "display known: "]);
    // Started anew, which its firmware logs.
    order(Order::Reset(Role::Sensor));
    with(&["# ", "sensor log: info: "]);
    child.kill().expect("it runs");
    child.wait().expect("it has run");
}

#[test]
fn the_other_site_reads_a_boards_log_and_configuration_and_has_its_gauges() {
    let alone = steady("monitor-far");
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let bench = alone.bench.bench_file().display().to_string();
    let name = format!("far-{}", std::process::id());
    let relay =
        |role: &str, end: &str| Relay::start([role, end, &at, "--name", &name, "--bench", &bench]);
    let _relays = [relay("sensor", "--listen"), relay("display", "--connect")];
    let far = format!("relay:{name}.sensor");
    let recording = folder("monitor-far").join("far.mcap");
    fs::create_dir_all(folder("monitor-far")).expect("a folder can be made");
    let mut recorder = bridge::command()
        .args(["record", "--force", "--sensor", &far])
        .arg(&recording)
        .spawn()
        .expect("the program can be started");
    let mut child = bridge::command()
        .args(["monitor", "--plain", "--sensor", &far])
        .spawn()
        .expect("the program can be started");
    let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
    next_with(&mut lines, &["sensor known: "]);
    let asked = bridge::command()
        .args(["configure", "--json", "--sensor", &far])
        .output()
        .expect("the program can be started");
    let words = String::from_utf8_lossy(&asked.stderr);
    assert_eq!(asked.status.code(), Some(0), "{words}");
    let shown: Value = serde_json::from_slice(&asked.stdout).expect("it is JSON");
    assert!(shown["sensor"].is_object(), "{shown}");
    // Until whoever watches has joined, its lines go to nobody: once a second.
    let is_logged = (0..200).any(|_| {
        let line = next_with(&mut lines, &[]);
        if !line.starts_with('#') {
            let order = alone.bench.command(Order::Reset(Role::Sensor));
            order.expect("it can be done");
        }
        line.contains("sensor log: info: ")
    });
    assert!(is_logged);
    child.kill().expect("it runs");
    child.wait().expect("it has run");
    // What another program records there: the samples that it asks for.
    until("samples", || {
        let mut reader = Reader::open(&recording).ok()?;
        std::iter::from_fn(|| reader.next_entry().ok()?)
            .any(|entry| matches!(entry.row, Row::Gauges(_)))
            .then_some(())
    });
    recorder.kill().expect("it runs");
    recorder.wait().expect("it has run");
}

/// What the sensor board logs at its start, as bytes of its RTT channel.
fn logged_at_start(alone: &ExclusiveBench) -> Vec<u8> {
    let name = alone.bench.path(PortName::SensorRtt);
    let mut port = serialport::new(name.to_string_lossy(), BAUD)
        .timeout(Duration::from_millis(20))
        .open()
        .expect("the port can be opened");
    let reset = alone.bench.command(Order::Reset(Role::Sensor));
    reset.expect("it can be done");
    let mut logged = Vec::new();
    until("a line and its end", || {
        let mut bytes = [0; 1_024];
        let count = port.read(&mut bytes).unwrap_or(0);
        logged.extend_from_slice(&bytes[..count]);
        (logged.len() > 1 && logged.last() == Some(&0)).then_some(())
    });
    logged
}

#[test]
fn a_log_in_a_file_that_is_cut_short_or_replaced_is_read_from_its_beginning() {
    let logged = {
        let alone = steady("monitor-log-file");
        logged_at_start(&alone)
    };
    let folder = folder("monitor-log-file");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let [log, other, bench] = ["log", "other", "file.toml"].map(|name| folder.join(name));
    fs::write(&log, logged.repeat(3)).expect("it can be written");
    let elf = elves::path(Role::Sensor);
    let seat = format!("[sensor]\nport = \"/dev/null/s\"\nelf = {elf:?}\nrtt = {log:?}\n");
    fs::write(&bench, seat).expect("it can be written");
    let mut child = bridge::command()
        .args(["monitor", "--plain", "--every", "600", "--bench"])
        .arg(&bench)
        .spawn()
        .expect("the program can be started");
    let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
    let started = ["sensor log: info: ", " started"];
    let lost = ["sensor log-lost: ", "log: was cut short or replaced"];
    for _ in 0..3 {
        next_with(&mut lines, &started);
    }
    fs::write(&log, logged.repeat(2)).expect("it can be written");
    next_with(&mut lines, &lost);
    for _ in 0..2 {
        next_with(&mut lines, &started);
    }
    // Also when it is longer than it was before anybody looks again.
    let longer = [&[0], &*logged.repeat(5)].concat();
    fs::write(&log, longer).expect("it can be written");
    next_with(&mut lines, &lost);
    for _ in 0..5 {
        next_with(&mut lines, &started);
    }
    fs::write(&other, logged.repeat(6)).expect("it can be written");
    fs::rename(&other, &log).expect("it can be renamed");
    next_with(&mut lines, &lost);
    for _ in 0..6 {
        next_with(&mut lines, &started);
    }
    child.kill().expect("it runs");
    child.wait().expect("it has run");
}

#[test]
fn the_dashboard_stops_a_board_and_streams_its_gauges() {
    let alone = steady("monitor-dashboard");
    let terminal = Terminal::new();
    let mut command = monitor(&alone);
    terminal.hold(&mut command);
    let mut child = command.spawn().expect("the program can be started");
    assert!(
        terminal.shows(LIMIT, "DRIVING"),
        "{}",
        terminal.last_shown()
    );
    terminal.types_until(LIMIT, "g", "the gauges are streamed from now on");
    assert!(
        terminal.shows(LIMIT, "LSB high"),
        "{}",
        terminal.last_shown()
    );
    terminal.type_keys("s");
    assert!(
        terminal.shows(LIMIT, "STOPPED: BY THE OPERATOR"),
        "{}",
        terminal.last_shown()
    );
    until("outputs at 0 V", || {
        alone.bench.outputs().is_clear.then_some(())
    });
    terminal.type_keys("q");
    let status = child.wait().expect("it ends");
    assert!(status.success());
}
