//! What a relay adds: two bridges in two processes over loopback, beside a bare line.
//!
//! `cargo build --workspace --bins && cargo run --example relay_latency -- 60`: a display says
//! a motion 500 times a second, with the instant in it at which it is written to its pseudo-terminal; a
//! sensor on another one notes when it reads it. Both are in this program and share a clock. The bare
//! line is one pseudo-terminal with the bridge's own link at its other end; the way over the bridges has
//! two of them.

use std::error::Error;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::link::{Event, Link};
use host_bridge::place::Place;
use host_bridge::relay::report::Histogram;
use protocol::{Message, Motion, Role};
use rustix::process::Signal;
use tests::bridge;
use tests::relay::{Relay, free_port};
use tests::swift_board::SwiftBoard;

/// Far more than anything here takes.
const LIMIT: Duration = Duration::from_secs(20);

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
    let display = SwiftBoard::new(Role::Display, |_, _| {})?;
    let (ends, ended): (_, Receiver<u64>) = channel();
    let link = Link::open(
        Role::Display,
        Place::Port(display.path.clone()),
        move |event| {
            if let Event::Heard {
                at_us,
                message: Message::Motion(Motion { instant_us, .. }),
            } = event
            {
                let _ = ends.send(at_us.saturating_sub(instant_us));
            }
        },
    );
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
    let times_us = Arc::<Mutex<Histogram>>::default();
    let noted = Arc::clone(&times_us);
    let sensor = SwiftBoard::new(Role::Sensor, move |message, read_us| {
        if let Message::Motion(Motion { instant_us, .. }) = message {
            let mut times_us = noted.lock().unwrap_or_else(PoisonError::into_inner);
            times_us.add(read_us.saturating_sub(instant_us));
        }
    })?;
    let display = SwiftBoard::new(Role::Display, |_, _| {})?;
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
    sensors.says("the display's site: host-bridge", LIMIT);
    // What the first second takes is not what the others take.
    thread::sleep(Duration::from_secs(2));
    take(&times_us);
    thread::sleep(seconds);
    let what = if by_router {
        "over a router"
    } else {
        "peer to peer"
    };
    print(&format!("{what}, with two lines"), &take(&times_us));
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
