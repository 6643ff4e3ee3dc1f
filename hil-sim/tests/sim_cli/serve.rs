//! `hil-sim serve` as a program: lines, signals, its end, and what it refuses. Needs the two ELFs, as
//! ./test builds them.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use object::{Object, ObjectSection};
use protocol::Role;
use rustix::process::{Pid, Signal, kill_process};

use crate::{elf as built, folder};

/// Only what hangs takes so long.
const PATIENCE: Duration = Duration::from_secs(300);
/// Between two looks: whoever looks without a pause takes from the boards the time in which it happens.
const LOOK: Duration = Duration::from_millis(2);
const LINKS: [&str; 4] = [
    "sensor-console",
    "display-console",
    "sensor-rtt",
    "display-rtt",
];

/// Two boards keep two cores busy: one bench at a time.
static ALONE: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn serve(folder: &Path) -> Command {
    serve_with(folder, &built(Role::Sensor), &built(Role::Display))
}

fn serve_with(folder: &Path, sensor: &Path, display: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-sim"));
    command
        .arg("serve")
        .arg("--dir")
        .arg(folder)
        .arg("--sensor-elf")
        .arg(sensor)
        .arg("--display-elf")
        .arg(display)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// A bench that stands: its ports are there.
struct Standing {
    child: Child,
    out: BufReader<ChildStdout>,
    greeting: String,
}

impl Standing {
    fn new(command: &mut Command) -> Self {
        let mut child = command.spawn().unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut greeting = String::new();
        while !greeting.contains("tio -b") {
            let read = out.read_line(&mut greeting).unwrap();
            assert!(read > 0, "{greeting:?} is all it says");
        }
        Self {
            child,
            out,
            greeting,
        }
    }

    fn next_line(&mut self) -> String {
        let mut line = String::new();
        self.out.read_line(&mut line).unwrap();
        line
    }

    fn say(&mut self, lines: &str) {
        self.say_bytes(lines.as_bytes());
    }

    fn say_bytes(&mut self, bytes: &[u8]) {
        let stdin = self.child.stdin.as_mut().unwrap();
        stdin.write_all(bytes).unwrap();
    }

    /// What it has complained about by its end, and its exit status.
    fn ended(mut self) -> (Option<i32>, String) {
        let begun = Instant::now();
        while self.child.try_wait().unwrap().is_none() {
            assert!(begun.elapsed() < PATIENCE, "it stands and stands");
            std::thread::park_timeout(LOOK);
        }
        let Output { status, stderr, .. } = self.child.wait_with_output().unwrap();
        (status.code(), String::from_utf8(stderr).unwrap())
    }
}

fn are_there(folder: &Path) -> [bool; LINKS.len()] {
    LINKS.map(|link| fs::symlink_metadata(folder.join(link)).is_ok())
}

fn wait_for(what: &str, condition: impl Fn() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < PATIENCE, "{what}: not in five minutes");
        std::thread::park_timeout(LOOK);
    }
}

#[test]
fn lines_on_standard_input_move_cables_and_quit_takes_everything_away() {
    let _turn = turn();
    let folder = folder("serve-cli/lines");
    let mut bench = Standing::new(serve(&folder).arg("--quiet"));
    assert_eq!(are_there(&folder), [true; 4]);
    assert!(folder.join("bench.toml").exists());
    for link in LINKS {
        let path = folder.join(link);
        assert!(
            bench.greeting.contains(&*path.to_string_lossy()),
            "{}",
            bench.greeting
        );
    }
    // What is no text is a line like any other.
    bench.say_bytes(b"caf\xe9\n");
    bench.say("hand 40\njump\npull sensor-link\nreset display\npull display-console\n");
    wait_for("a pulled cable", || {
        are_there(&folder) == [true, false, true, true]
    });
    bench.say("plug display-console\n");
    wait_for("the cable", || are_there(&folder) == [true; 4]);
    bench.say("quit\n");
    let (status, complaints) = bench.ended();
    assert_eq!(status, Some(0), "{complaints}");
    assert!(
        complaints.contains("\"jump\": is no command: give pull"),
        "{complaints}"
    );
    assert!(
        complaints.contains("\"caf\u{fffd}\": is no command"),
        "{complaints}"
    );
    assert!(
        complaints.contains("sensor-link: there is no such port"),
        "{complaints}"
    );
    assert_eq!(are_there(&folder), [false; 4]);
    assert!(!folder.join("bench.toml").exists());
}

#[test]
fn a_signal_takes_everything_away_and_a_second_bench_in_the_folder_is_refused() {
    let _turn = turn();
    for signal in [Signal::TERM, Signal::INT] {
        let folder = folder("serve-cli/signal");
        let mut bench = Standing::new(serve(&folder).arg("--apart"));
        assert!(folder.join("sensor-link").exists());
        // As they stand, on this computer.
        for (role, end) in [("sensor", "--listen"), ("display", "--connect")] {
            let link = folder.join(format!("{role}-link"));
            let advice = format!(
                "  host-bridge relay {role} --{role} {} {end} tcp/127.0.0.1:7447\n",
                link.display()
            );
            assert_eq!(bench.next_line(), advice);
        }
        let second = serve(&folder).output().unwrap();
        let complaint = String::from_utf8(second.stderr).unwrap();
        assert_eq!(second.status.code(), Some(2), "{complaint}");
        assert!(
            complaint.contains("another bench stands here"),
            "{complaint}"
        );
        kill_process(Pid::from_child(&bench.child), signal).unwrap();
        let (status, complaints) = bench.ended();
        assert_eq!(status, Some(0), "{complaints}");
        assert_eq!(are_there(&folder), [false; 4]);
        assert!(!folder.join("sensor-link").exists());
    }
}

#[test]
fn after_its_time_it_ends_and_tells_its_status_meanwhile() {
    let _turn = turn();
    let folder = folder("serve-cli/time");
    let hand = folder.join("hand.csv");
    fs::write(&hand, "t_s,x_mm\n0,0\n0.5,20\n").unwrap();
    let output = serve(&folder)
        .args(["--for", "1.5", "--hand"])
        .arg(&hand)
        .output()
        .unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{told}");
    assert!(
        told.contains("mm/s") && told.contains("dropped 0 B"),
        "{told}"
    );
    assert_eq!(are_there(&folder), [false; 4]);
}

#[test]
fn a_board_whose_firmware_goes_astray_ends_it_with_the_reason() {
    let _turn = turn();
    let folder = folder("serve-cli/astray");
    // Without vectors it begins at address 0, and nowhere.
    let mut elf = fs::read(built(Role::Display)).unwrap();
    let vectors = object::File::parse(&*elf)
        .unwrap()
        .section_by_name(".vector_table")
        .and_then(|section| section.file_range())
        .unwrap();
    let (begins, length) = (vectors.0 as usize, vectors.1 as usize);
    elf[begins..begins + length].fill(0);
    let broken = folder.join("broken");
    fs::write(&broken, elf).unwrap();
    let output = serve_with(&folder, &built(Role::Sensor), &broken)
        .output()
        .unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(
        told.contains("the display board's firmware reached"),
        "{told}"
    );
    assert_eq!(are_there(&folder), [false; 4]);
}

#[test]
fn what_it_cannot_do_is_refused_with_what_to_do() {
    let folder = folder("serve-cli/refused");
    let complaint = |command: &mut Command| {
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{command:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    for (arguments, due) in [
        (&["--pace", "0"][..], "give 0.01 to 100, or max"),
        (&["--pace", "fast"], "give 0.01 to 100, or max"),
        (&["--for", "0"], "give a time above 0 s"),
        (&["--for", "1e308"], "1 000 000 000 at most"),
        (&["--hand", "keyboard"], "needs a terminal"),
        (
            &["--hand", "nobody.csv"],
            "give a CSV file with the columns t_s,x_mm",
        ),
        (&["nowhere.toml"], "give the name of a scene"),
    ] {
        let told = complaint(serve(&folder).args(arguments));
        assert!(told.contains(due), "{arguments:?}: {told}");
    }
    let mut nowhere = serve_with(&folder, Path::new("nowhere"), &built(Role::Display));
    let told = complaint(&mut nowhere);
    assert!(told.contains("nowhere: can't be read"), "{told}");
    fs::create_dir(folder.join("sensor-console")).unwrap();
    let told = complaint(&mut serve(&folder));
    assert!(told.contains("sensor-console: can't be used"), "{told}");
    assert!(folder.join("sensor-console").is_dir());
    assert_eq!(are_there(&folder), [true, false, false, false]);
}
