//! Two boards for bridges that are started by hand, be it in two network namespaces; or with bridges of its own, over
//! a network with weather.
//!
//! `cargo run --example relay_boards -- 60` prints the two ports, and then once a second what
//! each board has heard: how much, how old, and how often something came that was not newer than what
//! came before, which must never be. Exit status 1 if it was.
//!
//! `cargo build --workspace --bins && cargo run --example relay_boards -- 60 udp 500 50 5` starts two bridges that meet by
//! `udp/`, over 500 ms each way, up to 50 ms more, and 5 % loss; `quic` in its place with certificates as well, `tcp` and
//! `tls` by a stream alone, which sends again what is lost. Ten seconds later the gaps of each board are counted, for 60 s, and told at the end.

use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::relay::report::Histogram;
use protocol::{Message, Role};
use rustix::process::Signal;
use tests::certificates::{Authority, Kind};
use tests::relay::{Relay, free_port};
use tests::swift_board::SwiftBoard;
use tests::weather::datagrams::DatagramWeather;
use tests::weather::{Sky, Weather};

/// How long nothing may come on a bad network, in µs.
const GOAL_US: u64 = 600_000;
/// How long bridges have to get used to a network.
const WARMING_UP: Duration = Duration::from_secs(10);
/// Far more than it takes two bridges to meet.
const LIMIT: Duration = Duration::from_secs(60);

/// What a board has heard.
#[derive(Default)]
struct Heard {
    newest: Option<u32>,
    count: u64,
    last_us: u64,
    longest_gap_us: u64,
    not_newer: u64,
    ages_us: Histogram,
    stops: u64,
    /// Gaps longer than [`GOAL_US`] that have ended, and the longest of all.
    gaps: (u64, u64),
}

impl Heard {
    fn hear(&mut self, message: &Message, at_us: u64) {
        let (sequence, instant_us) = match message {
            Message::Motion(motion) => (motion.sequence, motion.instant_us),
            Message::Estimate(estimate) => (estimate.sequence, estimate.instant_us),
            Message::Stop(_) => {
                self.stops += 1;
                return;
            }
            _ => return,
        };
        if let Some(newest) = self.newest.replace(sequence) {
            self.not_newer += u64::from(sequence <= newest);
            let gap_us = at_us - self.last_us;
            self.longest_gap_us = self.longest_gap_us.max(gap_us);
            self.gaps.0 += u64::from(gap_us > GOAL_US);
            self.gaps.1 = self.gaps.1.max(gap_us);
        }
        self.count += 1;
        self.last_us = at_us;
        self.ages_us.add(at_us.saturating_sub(instant_us));
    }

    /// What was heard since this was last asked, in words.
    fn take(&mut self) -> String {
        let count = std::mem::take(&mut self.count);
        let gap_ms = std::mem::take(&mut self.longest_gap_us) / 1_000;
        let ages = std::mem::take(&mut self.ages_us).percentiles();
        let ages = ages.map_or_else(String::new, |ages| {
            let ms = |time_us| time_us / 1_000;
            format!(
                ", age {} p50 {} p99 {} max ms",
                ms(ages.p50_us),
                ms(ages.p99_us),
                ms(ages.max_us)
            )
        });
        format!(
            "{count} heard{ages}, longest gap {gap_ms} ms, not newer {}, stops {}",
            self.not_newer, self.stops
        )
    }
}

fn locked(heard: &Mutex<Heard>) -> MutexGuard<'_, Heard> {
    heard.lock().unwrap_or_else(PoisonError::into_inner)
}

fn board(role: Role) -> std::io::Result<(SwiftBoard, Arc<Mutex<Heard>>)> {
    let heard = Arc::<Mutex<Heard>>::default();
    let noted = Arc::clone(&heard);
    let board = SwiftBoard::new(role, move |message, at_us| {
        locked(&noted).hear(&message, at_us);
    })?;
    println!("--{} {}", role.name(), board.path.display());
    Ok((board, heard))
}

/// Two bridges that meet over a network with weather.
struct Bridges {
    bridges: [Relay; 2],
    stream: Weather,
    datagrams: DatagramWeather,
}

impl Bridges {
    fn new(carrier: &str, sensor: &SwiftBoard, display: &SwiftBoard) -> Self {
        let port = free_port();
        let stream = Weather::over(port);
        let through = stream.port();
        let datagrams = DatagramWeather::over(through, port);
        let [listen, connect] = [port, through].map(|port| format!("{carrier}/localhost:{port}"));
        let authority = matches!(carrier, "tls" | "quic")
            .then(|| Authority::new(&std::env::temp_dir(), "relay_boards"));
        let start = |role: Role, board: &SwiftBoard, end: &str, at: &str| {
            let proofs = authority
                .iter()
                .flat_map(|ours| ours.proofs(role.name(), Kind::Good, ours));
            // Whatever comes is passed on, so that gaps are the network's.
            let ages = ["--max-age", "60000"].map(str::to_owned);
            let more: Vec<String> = proofs.chain(ages).collect();
            Relay::bridge_with(role, &board.path, [end, at], &more)
        };
        let listening = start(Role::Sensor, sensor, "--listen", &listen);
        listening.says("listening", LIMIT);
        let connecting = start(Role::Display, display, "--connect", &connect);
        connecting.says("the sensor's site: host-bridge", LIMIT);
        Self {
            bridges: [listening, connecting],
            stream,
            datagrams,
        }
    }

    fn turn(&self, sky: Sky) {
        self.stream.turn(sky);
        self.datagrams.turn(sky);
    }
}

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, or: u64| arguments.get(at).map_or(Ok(or), |given| given.parse());
    let seconds = number(0, 60)?;
    let (sensor_board, sensor) = board(Role::Sensor)?;
    let (display_board, display) = board(Role::Display)?;
    let bridges = arguments
        .get(1)
        .map(|carrier| Bridges::new(carrier, &sensor_board, &display_board));
    if let Some(bridges) = &bridges {
        bridges.turn(Sky {
            delay: Duration::from_millis(number(2, 0)?),
            jitter: Duration::from_millis(number(3, 0)?),
            loss: number(4, 0)? as f64 / 100.0,
        });
        thread::sleep(WARMING_UP);
        for heard in [&sensor, &display] {
            locked(heard).take();
            locked(heard).gaps = (0, 0);
        }
    }
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(seconds) {
        thread::sleep(Duration::from_secs(1));
        let now_s = began.elapsed().as_secs_f64();
        println!("{now_s:6.1} s  sensor: {}", locked(&sensor).take());
        println!("          display: {}", locked(&display).take());
    }
    for (role, heard) in [("sensor", &sensor), ("display", &display)] {
        let (count, longest_us) = locked(heard).gaps;
        println!(
            "{role}: {count} gaps above {} ms, the longest {} ms",
            GOAL_US / 1_000,
            longest_us / 1_000
        );
    }
    for bridge in bridges.into_iter().flat_map(|bridges| bridges.bridges) {
        bridge.signal(Signal::INT);
        println!("{}", bridge.wait(LIMIT).1.last().ok_or("no report")?);
    }
    let not_newer = locked(&sensor).not_newer + locked(&display).not_newer;
    Ok(ExitCode::from(u8::from(not_newer > 0)))
}
