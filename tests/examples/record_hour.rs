//! Records an hour of everything, as fast as it goes, and says what it took:
//! `cargo run --example record_hour [HOURS [FILE]]`, once `cargo build --workspace --bins` has built
//! `host-bridge`.
//!
//! Two boards that are not there say what real ones say in that time: samples of the gauges at 1 kHz,
//! estimates at 100 Hz, motions at 500 Hz, both boards' status at 1 Hz. Exit status 0 if nothing is lost, no
//! more than 50 MB were resident, and the second half of the time took no more of them than the index of the
//! file does.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::recording::reader::Reader;
use host_bridge::recording::row::Row;
use protocol::{
    DisplayCounters, Estimate, GAUGE_BLOCK, Hello, Message, Motion, PortCounters, ResetCause, Role,
    RoleCounters, SensorCounters, Status,
};
use tests::bridge::{self, Running};
use tests::fake_board::{FakeBoard, Script, wait_until};
use tests::utterance::Speaker;

/// What a board says at a time, in ms of the recorded time.
const TURN_MS: u64 = 40;
const MOST_KB: u64 = 50_000;
/// What the index of the file takes for a chunk, in bytes: a map entry, and some, for each channel.
const INDEX_BYTES: u64 = 1_000;
const LOOK: Duration = Duration::from_millis(500);

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let hours: f64 = arguments
        .next()
        .map_or(1.0, |hours| hours.parse().expect("give a number of hours"));
    let path = arguments
        .next()
        .map_or_else(|| std::env::temp_dir().join("hour.mcap"), PathBuf::from);
    let _ = fs::remove_file(&path);
    let until_ms = (hours * 3_600_000.0) as u64;

    let begun = Arc::new(AtomicBool::new(false));
    let done_ms = [(); 2].map(|()| Arc::new(AtomicU64::new(0)));
    let boards = [Role::Sensor, Role::Display].map(|role| {
        let done = Arc::clone(&done_ms[usize::from(role == Role::Display)]);
        let board = FakeBoard::acting(
            Hello::new(role, "stm32f429zi", [0, 1, 0]),
            script(role, until_ms, Arc::clone(&begun), done),
        );
        board.lose_nothing();
        board
    });
    let running = Running::start(
        bridge::command()
            .arg("record")
            .arg(&path)
            .args([
                "--no-gauges",
                "--quiet",
                "--json",
                "--split",
                "0",
                "--sensor",
            ])
            .arg(boards[0].path())
            .arg("--display")
            .arg(boards[1].path()),
    );
    // Before that a board speaks to nobody.
    for board in &boards {
        let asked = || {
            let heard = board.take_heard();
            heard
                .iter()
                .any(|message| matches!(message, Message::Question(_)))
        };
        assert!(
            wait_until(Duration::from_secs(30), asked),
            "the boards are asked"
        );
    }
    begun.store(true, Ordering::Relaxed);
    let started = Instant::now();
    let mut resident_kb = Vec::new();
    let mut told = 0;
    while done_ms
        .iter()
        .any(|done| done.load(Ordering::Relaxed) < until_ms)
    {
        thread::park_timeout(LOOK);
        resident_kb.push(resident(running.child.id()));
        // Answers to pings, and what is asked, would pile up.
        boards.iter().for_each(|board| drop(board.take_heard()));
        if resident_kb.len() / 20 > told {
            told = resident_kb.len() / 20;
            let done_s = done_ms[0].load(Ordering::Relaxed) / 1_000;
            eprintln!(
                "{done_s} s in {:.0} s: {} kB",
                started.elapsed().as_secs_f64(),
                resident(running.child.id())
            );
        }
    }
    let took_s = started.elapsed().as_secs_f64();
    // What is on the line yet is read within this.
    thread::park_timeout(Duration::from_secs(3));
    let interrupted = Command::new("kill")
        .args(["-INT", &running.child.id().to_string()])
        .status();
    assert!(
        interrupted.is_ok_and(|status| status.success()),
        "it can be interrupted"
    );
    let ended = running.wait(Duration::from_secs(60));
    print!("{}", ended.stdout);

    let (samples, chunks) = check(&path, until_ms);
    let half = resident_kb.len() / 2;
    let most_kb = resident_kb.iter().copied().max().unwrap_or(0);
    let grown_kb = resident_kb[half..]
        .iter()
        .max()
        .copied()
        .unwrap_or(0)
        .saturating_sub(
            resident_kb[half / 2..half]
                .iter()
                .max()
                .copied()
                .unwrap_or(0),
        );
    let allowed_kb = chunks * INDEX_BYTES / 1_000;
    println!(
        "{:.0} s recorded in {took_s:.0} s, {:.1} times real time; {samples} samples, each once, in order; \
         at most {most_kb} kB resident, {grown_kb} kB more in the second half ({chunks} chunks); {} bytes",
        hours * 3_600.0,
        hours * 3_600.0 / took_s,
        fs::metadata(&path).map_or(0, |facts| facts.len()),
    );
    let lost = samples != until_ms / GAUGE_BLOCK as u64 * GAUGE_BLOCK as u64;
    if !ended.status.success() || lost || most_kb > MOST_KB || grown_kb > allowed_kb {
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// Says what a board says in a time, in turns.
fn script(role: Role, until_ms: u64, begun: Arc<AtomicBool>, done: Arc<AtomicU64>) -> Script {
    let mut speaker = Speaker::new(1);
    let mut now_ms = 0;
    Box::new(move |_| {
        let mut said = Vec::new();
        if !begun.load(Ordering::Relaxed) {
            return said;
        }
        let end_ms = (now_ms + TURN_MS).min(until_ms);
        while now_ms < end_ms {
            said.extend(said_at(role, now_ms, &mut speaker));
            now_ms += 1;
        }
        done.store(now_ms, Ordering::Relaxed);
        said
    })
}

fn said_at(role: Role, now_ms: u64, speaker: &mut Speaker) -> Vec<Message> {
    let instant_us = now_ms * 1_000;
    let mut said = Vec::new();
    match role {
        Role::Display => {
            if now_ms.is_multiple_of(2) {
                said.push(Message::Motion(Motion {
                    sequence: (now_ms / 2) as u32,
                    instant_us,
                    position_um: (now_ms * 50).cast_signed(),
                    velocity_um_s: 50_000,
                }));
            }
        }
        Role::Sensor | Role::Host => {
            if now_ms % 8 == 7 {
                said.push(speaker.gauges((now_ms - 7) as u32));
            }
            if now_ms % 10 == 9
                && let Message::Estimate(estimate) = speaker.estimate()
            {
                said.push(Message::Estimate(Estimate {
                    instant_us,
                    ..estimate
                }));
            }
        }
    }
    if now_ms % 1_000 == 999 {
        said.push(Message::Status(Status {
            uptime_us: instant_us,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            stack_free_bytes: 0,
            peer: PortCounters::new(),
            console: PortCounters::new(),
            role: match role {
                Role::Display => RoleCounters::Display(DisplayCounters::ZERO),
                Role::Sensor | Role::Host => RoleCounters::Sensor(SensorCounters::ZERO),
            },
        }));
    }
    said
}

/// Resident memory of a process in kB; 0 if it can't be told.
fn resident(id: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))
        .and_then(|size| size.split_whitespace().next()?.parse().ok())
        .unwrap_or(0)
}

/// Reads the file: samples in order from 0 on, and how many chunks there are at least.
fn check(path: &Path, until_ms: u64) -> (u64, u64) {
    let mut reader = Reader::open(path).unwrap_or_else(|error| panic!("{error}"));
    let (mut samples, mut motions, mut lines) = (0, 0, 0);
    while let Some(entry) = reader
        .next_entry()
        .unwrap_or_else(|error| panic!("{error}"))
    {
        match entry.row {
            Row::Gauges(row) => {
                assert_eq!(u64::from(row.first_sample), samples, "in order");
                samples += GAUGE_BLOCK as u64;
            }
            Row::Motion(motion) => {
                assert_eq!(u64::from(motion.sequence), motions, "in order");
                motions += 1;
            }
            Row::Line(_) => lines += 1,
            _ => {}
        }
    }
    assert!(!reader.is_cut(), "the file is whole");
    assert_eq!(motions, until_ms / 2, "every motion");
    // A chunk for each MB, some 5 000 rows, and one for each second that it took.
    (samples, samples / 4_000 + lines)
}
