//! `host-bridge monitor` with the boards' own firmwares at the far side.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader};
use std::process::Command;
use std::time::{Duration, Instant};

use hil_sim_boards::bench::{Command as Order, PortName};
use tests::bench::{ExclusiveBench, bench, until};
use tests::bridge;
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

#[test]
fn lines_tell_of_the_surface_the_cable_and_the_boards_logs() {
    let alone = steady("monitor-lines");
    let mut child = monitor(&alone)
        .args(["--plain", "--every", "0.2"])
        .spawn()
        .expect("the program can be started");
    let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
    let mut with = |words: &[&str]| {
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
    };
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
    order(Order::Reset(protocol::Role::Sensor));
    with(&["# ", "sensor log: info: "]);
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
