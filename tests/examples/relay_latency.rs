//! What a relay adds: two bridges in two processes over loopback, beside a bare line.
//!
//! `cargo build --workspace --bins && cargo run -p tests --example relay_latency -- 60`: a display says
//! a motion 500 times a second, with the instant in it at which it is written to its pseudo-terminal; a
//! sensor on another one notes when it reads it. Both are in this program and share a clock. The bare
//! line is one pseudo-terminal with the bridge's own link at its other end; the way over the bridges has
//! two of them.

use std::error::Error;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::host_clock::now_us;
use host_bridge::link::{Event, Link};
use host_bridge::place::Place;
use host_bridge::relay::histogram::Histogram;
use protocol::{Hello, MAX_FRAME, Message, Motion, Port, Role};
use rustix::process::Signal;
use tests::bridge;
use tests::pty::Near;
use tests::relay::{MOTION_US, Relay, free_port};

/// Longest wait of a board for bytes.
const PATIENCE: Duration = Duration::from_millis(2);
/// Far more than anything else takes.
const LIMIT: Duration = Duration::from_secs(20);

/// A board that reads as soon as bytes come and, if it is a display, says a motion every 2 ms.
struct Board {
    path: PathBuf,
    times_us: Arc<Mutex<Histogram>>,
    _kept: OwnedFd,
}

impl Board {
    fn new(role: Role) -> Result<Self, Box<dyn Error>> {
        let (near, kept, path) = Near::pair(PATIENCE)?;
        let times_us = Arc::default();
        let noted = Arc::clone(&times_us);
        thread::spawn(move || run(near, role, &noted));
        Ok(Self {
            path,
            times_us,
            _kept: kept,
        })
    }
}

fn run(mut near: Near, role: Role, times_us: &Mutex<Histogram>) {
    let mut port = Port::new(Hello::new(role, "stm32f429zi", [0, 1, 0]));
    let mut bytes = [0; 4_096];
    let mut frame = [0; MAX_FRAME];
    let mut sequence = 0;
    let mut due = Instant::now();
    loop {
        let count = match near.read(&mut bytes) {
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => 0,
            Err(_) => return,
        };
        let read_us = now_us();
        port.receive(read_us, &bytes[..count], |message| {
            if let Message::Motion(Motion { instant_us, .. }) = message {
                let mut times_us = times_us.lock().unwrap_or_else(PoisonError::into_inner);
                times_us.add(read_us.saturating_sub(instant_us));
            }
        });
        if role == Role::Display && Instant::now() >= due {
            due = Instant::now() + Duration::from_micros(MOTION_US);
            sequence += 1;
            port.post(&Message::Motion(Motion {
                sequence,
                instant_us: now_us(),
                position_um: 0,
                velocity_um_s: 0,
            }));
        }
        while let count @ 1.. = port.take(&mut frame) {
            if near.write_all(&frame[..count]).is_err() {
                break;
            }
        }
    }
}

fn print(what: &str, times_us: &Histogram) {
    match times_us.percentiles() {
        None => println!("{what}: nothing came"),
        Some(found) => println!(
            "{what}: p50 {} µs, p99 {} µs, max {} µs",
            found.p50_us, found.p99_us, found.max_us
        ),
    }
}

fn take(times_us: &Mutex<Histogram>) -> Histogram {
    std::mem::take(&mut *times_us.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The bare line.
fn bare(seconds: Duration) -> Result<(), Box<dyn Error>> {
    let display = Board::new(Role::Display)?;
    let (ends, ended): (_, Receiver<u64>) = channel();
    let link = Link::open(Role::Display, Place::Port(display.path), move |event| {
        if let Event::Heard {
            at_us,
            message: Message::Motion(Motion { instant_us, .. }),
        } = event
        {
            let _ = ends.send(at_us.saturating_sub(instant_us));
        }
    });
    let mut times_us = Histogram::default();
    ended.recv_timeout(LIMIT)?;
    let end = Instant::now() + seconds;
    while Instant::now() < end {
        times_us.add(ended.recv_timeout(LIMIT)?);
    }
    drop(link);
    print("a bare line, once", &times_us);
    Ok(())
}

/// The way over two bridges.
fn relayed(seconds: Duration, by_router: bool) -> Result<(), Box<dyn Error>> {
    let (sensor, display) = (Board::new(Role::Sensor)?, Board::new(Role::Display)?);
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let (router, end) = if by_router {
        let router = Relay::start(["router", "--listen", &at]);
        router.says("listening", LIMIT);
        (Some(router), "--connect")
    } else {
        (None, "--listen")
    };
    let sensors = Relay::bridge(Role::Sensor, &sensor.path, &[end, &at]);
    let displays = Relay::bridge(Role::Display, &display.path, &["--connect", &at]);
    sensors.says("the display's site: display", LIMIT);
    // What the first second takes is not what the others take.
    thread::sleep(Duration::from_secs(2));
    take(&sensor.times_us);
    thread::sleep(seconds);
    let what = if by_router {
        "over a router"
    } else {
        "peer to peer"
    };
    print(&format!("{what}, with two lines"), &take(&sensor.times_us));
    sensors.signal(Signal::INT);
    let (_, lines, _) = sensors.wait(LIMIT);
    let report: serde_json::Value = serde_json::from_str(lines.last().ok_or("no report")?)?;
    println!(
        "{what}, from line to line by the bridge itself: {}, incoming {}",
        report["age"], report["incoming"]
    );
    drop((displays, router));
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let seconds = std::env::args()
        .nth(1)
        .map_or(Ok(10), |given| given.parse())?;
    let seconds = Duration::from_secs(seconds);
    // Says what to do if it has not been built.
    bridge::path();
    bare(seconds)?;
    relayed(seconds, false)?;
    relayed(seconds, true)
}
