//! What it costs to share a port: `cargo run --example shared_ports [KILLS]`.
//!
//! One board says what a display says, 500 motions a second, and 125 blocks of samples; eight programs hear it.
//! Each message bears the time at which it was said, so that each program can tell how late it hears it. Then
//! the program that owns the port is killed, 25 times unless said otherwise, and the others tell how long they
//! heard nothing. Exit status 0 if the goals are met: added delay p99 at most 1 ms, the owner at most a tenth of a
//! core, nothing lost, the others on within 1 s.

use std::collections::VecDeque;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use host_bridge::clock::unix_ns;
use host_bridge::link::{Event, Link};
use host_bridge::place::Place;
use host_bridge::relay::report::Histogram;
use protocol::{GAUGE_BLOCK, GaugeSample, Gauges, Hello, Message, Motion, Role};
use tests::fake_board::{FakeBoard, Script};

const CLIENTS: usize = 8;
const SECONDS: u64 = 10;
/// A motion every 2 ms, a block of samples every 8 ms.
const MOTION_US: u64 = 2_000;
/// Where a program finds the port, if it is one of those that listen.
const PORT: &str = "RIDGELINK_SHARED_PORT";

fn main() -> ExitCode {
    if let Some(port) = std::env::var_os(PORT) {
        listen(PathBuf::from(port));
        return ExitCode::SUCCESS;
    }
    let kills: usize = std::env::args()
        .nth(1)
        .map_or(25, |kills| kills.parse().expect("give a number of kills"));
    let board = FakeBoard::acting(
        Hello::new(Role::Display, "stm32f429zi", [0, 1, 0]),
        script(),
    );
    let mut clients: VecDeque<Client> = (0..CLIENTS).map(|_| Client::start(&board)).collect();
    thread::sleep(Duration::from_secs(2));
    for client in &clients {
        client.lines.try_iter().for_each(drop);
    }
    let owner = clients.front().map_or(0, |client| client.child.id());
    let before = cpu_s(owner);
    thread::sleep(Duration::from_secs(SECONDS));
    let share = (cpu_s(owner) - before) / SECONDS as f64;
    let reports: Vec<Report> = clients.iter().map(Client::report).collect();
    println!(
        "{:>6} {:>8} {:>6} {:>8} {:>8}",
        "", "heard", "lost", "p50 us", "p99 us"
    );
    for (number, report) in reports.iter().enumerate() {
        let name = if number == 0 { "owner" } else { "guest" };
        let Report {
            heard,
            lost,
            p50_us,
            p99_us,
            ..
        } = report;
        println!("{name:>6} {heard:>8} {lost:>6} {p50_us:>8} {p99_us:>8}");
    }
    let lost: u64 = reports.iter().map(|report| report.lost).sum();
    let slowest = reports
        .iter()
        .map(|report| report.p99_us)
        .max()
        .unwrap_or(0);
    let added_us = slowest.saturating_sub(reports[0].p99_us);
    println!(
        "owner: {:.1} % of a core; added delay p99 {added_us} us; lost {lost}",
        share * 100.0
    );

    let mut longest_us = 0;
    for _ in 0..kills {
        for client in &clients {
            client.lines.try_iter().for_each(drop);
        }
        let mut owner = clients.pop_front().expect("there are clients");
        owner.child.kill().expect("it runs");
        owner.child.wait().expect("it is ours");
        thread::sleep(Duration::from_millis(1_500));
        let gaps: Vec<u64> = clients
            .iter()
            .map(|client| client.report().gap_us)
            .collect();
        longest_us = longest_us.max(gaps.iter().copied().max().unwrap_or(0));
        println!(
            "killed; the others heard nothing for {:?} ms",
            gaps.iter().map(|us| us / 1_000).collect::<Vec<_>>()
        );
        // The one that heard something first owns the port now.
        let first = (0..gaps.len()).min_by_key(|&at| gaps[at]).unwrap_or(0);
        clients.rotate_left(first);
        clients.push_back(Client::start(&board));
        thread::sleep(Duration::from_millis(500));
    }
    println!(
        "{kills} owners killed: the longest silence of another was {} ms",
        longest_us / 1_000
    );
    let is_met = lost == 0 && added_us <= 1_000 && share <= 0.1 && longest_us <= 1_000_000;
    if is_met {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn now_us() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_micros() as u64)
}

fn script() -> Script {
    let mut due_us = now_us();
    let mut sequence = 0;
    Box::new(move |_| {
        let mut said = Vec::new();
        while due_us <= now_us() {
            let instant_us = now_us();
            said.push(Message::Motion(Motion {
                sequence,
                instant_us,
                position_um: 0,
                velocity_um_s: 0,
            }));
            if sequence.is_multiple_of(4) {
                said.push(Message::Gauges(Gauges {
                    first_sample: sequence * 2,
                    instant_us,
                    position_um: 0,
                    samples: [GaugeSample::default(); GAUGE_BLOCK],
                }));
            }
            sequence += 1;
            due_us += MOTION_US;
        }
        said
    })
}

/// User and system time of a process, in s.
fn cpu_s(process: u32) -> f64 {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let fields = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace();
    let ticks: u64 = fields
        .skip(11)
        .take(2)
        .filter_map(|ticks| ticks.parse::<u64>().ok())
        .sum();
    ticks as f64 / 100.0
}

/// A program that listens.
struct Client {
    child: Child,
    lines: Receiver<String>,
}

/// What a program has heard since it was last asked.
struct Report {
    heard: u64,
    lost: u64,
    p50_us: u64,
    p99_us: u64,
    gap_us: u64,
}

impl Client {
    fn start(board: &FakeBoard) -> Self {
        let this = std::env::current_exe().expect("it knows where it is");
        let mut child = Command::new(this)
            .env(PORT, board.path())
            .stdout(Stdio::piped())
            .spawn()
            .expect("it can be started");
        let stdout = child.stdout.take().expect("it is piped");
        let (sender, lines) = channel();
        thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
        let client = Self { child, lines };
        // It has begun when it has heard something.
        let _ = client.lines.recv_timeout(Duration::from_secs(20));
        client
    }

    /// Of all that was said until now: a line bears the lateness of a message, the gap before it and how many
    /// are missing there.
    fn report(&self) -> Report {
        let mut late = Histogram::default();
        let (mut heard, mut lost, mut gap_us) = (0, 0, 0);
        for line in self.lines.try_iter() {
            let mut numbers = line.split(' ').filter_map(|word| word.parse::<u64>().ok());
            late.add(numbers.next().unwrap_or(0));
            gap_us = gap_us.max(numbers.next().unwrap_or(0));
            lost += numbers.next().unwrap_or(0);
            heard += 1;
        }
        let percentiles = late.percentiles();
        let of = |pick: fn(&host_bridge::relay::report::Percentiles) -> u64| {
            percentiles.as_ref().map_or(u64::MAX, pick)
        };
        Report {
            heard,
            lost,
            p50_us: of(|ages| ages.p50_us),
            p99_us: of(|ages| ages.p99_us),
            gap_us,
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn listen(port: PathBuf) {
    let mut last: Option<(u32, u64)> = None;
    let _link = Link::open(Role::Display, Place::Port(port), move |event| {
        if let Event::Heard {
            at_us,
            message: Message::Motion(motion),
        } = event
        {
            let at_us = unix_ns(at_us) / 1_000;
            let (before, before_us) = last.unwrap_or((motion.sequence.wrapping_sub(1), at_us));
            last = Some((motion.sequence, at_us));
            let late_us = at_us.saturating_sub(motion.instant_us);
            let lost = motion.sequence.wrapping_sub(before).wrapping_sub(1);
            println!("{late_us} {} {lost}", at_us - before_us);
        }
    });
    loop {
        thread::park();
    }
}
