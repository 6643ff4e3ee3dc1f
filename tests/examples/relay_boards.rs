//! Two boards for bridges that are started by hand, be it in two network namespaces.
//!
//! `cargo run --example relay_boards -- 60` prints the two ports, and then once a second what
//! each board has heard: how much, how old, and how often something came that was not newer than what
//! came before, which must never be. Exit status 1 if it was.

use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::relay::histogram::Histogram;
use protocol::{Message, Role};
use tests::swift_board::SwiftBoard;

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
            self.longest_gap_us = self.longest_gap_us.max(at_us - self.last_us);
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

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let seconds = std::env::args()
        .nth(1)
        .map_or(Ok(60), |given| given.parse())?;
    let (_sensor, sensor) = board(Role::Sensor)?;
    let (_display, display) = board(Role::Display)?;
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(seconds) {
        thread::sleep(Duration::from_secs(1));
        let now_s = began.elapsed().as_secs_f64();
        println!("{now_s:6.1} s  sensor: {}", locked(&sensor).take());
        println!("          display: {}", locked(&display).take());
    }
    let not_newer = locked(&sensor).not_newer + locked(&display).not_newer;
    Ok(ExitCode::from(u8::from(not_newer > 0)))
}
