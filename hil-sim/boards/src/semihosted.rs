//! A program of any kind on a board: it runs until it ends itself, and what it says to its debugger's console, or logs,
//! is kept.

use std::path::Path;

use rigless::emulator::{Driver, Host, Settled, Start, Stop};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::stm32f427::Stm32f427;
use rigless::time::VirtualNanos;

use super::ElfError;
use super::cost::{BOARD, Bare};
use super::firmware::read_elf;
use super::jig::{Jig, Jumper};
use super::nucleo::{Nucleo, Pins};
use super::rtt::Log;

/// Virtual time after which a program that has not come to its end is given up, in s.
const LIMIT_S: u64 = 120;
/// Between two looks at the log, as probes take them.
const LOG_PERIOD_NS: u64 = 1_000_000;

/// What a program left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// All that it wrote to the console.
    pub console: String,
    /// The lines that it logged, each with its level first, if it has one.
    pub log: Vec<String>,
    /// Whether it ended well.
    pub is_done: bool,
}

struct Listener {
    console: Vec<u8>,
    log: Option<Log>,
    limit: VirtualNanos,
}

impl<P: Pins> Driver<Nucleo<P>> for Listener {
    fn on_settled(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        _host: &mut dyn Host,
        settled: Settled,
    ) {
        session.board_mut().follow(&settled);
    }

    fn on_stop(
        &mut self,
        _session: &mut Session<Nucleo<P>>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        let log = self.log.as_mut()?;
        log.read(stop.at.0, host);
        (stop.at < self.limit).then_some(VirtualNanos(stop.at.0 + LOG_PERIOD_NS))
    }

    fn on_console(&mut self, _at: VirtualNanos, _instruction_count: u64, bytes: &[u8]) {
        self.console.extend_from_slice(bytes);
    }
}

/// Runs the program at `path`, built by `cargo build -p` and `package`, on an emulated board with nothing on its pins.
///
/// # Errors
/// If it can't be read or placed, or has not ended itself after two minutes of its time.
pub fn run(path: &Path, package: &'static str) -> Result<Said, ElfError> {
    run_on(path, package, Bare, |_| {})
}

/// The same, on a board with `jumpers`.
///
/// # Errors
/// As [`run`].
pub fn run_with(path: &Path, package: &'static str, jumpers: &[Jumper]) -> Result<Said, ElfError> {
    run_on(path, package, Jig::new(jumpers), |part| {
        Jig::fit(part, jumpers);
    })
}

fn run_on<P: Pins>(
    path: &Path,
    package: &'static str,
    pins: P,
    fit: impl FnOnce(&mut Stm32f427),
) -> Result<Said, ElfError> {
    let elf = read_elf(path, package)?;
    let limit = VirtualNanos(LIMIT_S * 1_000_000_000);
    let listener = Listener {
        console: Vec::new(),
        log: Log::find(&elf),
        limit,
    };
    let first = if listener.log.is_some() {
        VirtualNanos(LOG_PERIOD_NS)
    } else {
        limit
    };
    let image = [Image::new(path, elf, None).map_err(ElfError::board(BOARD))?];
    let mut start = Start::new(&image);
    start.semihosting = true;
    let finished = Nucleo::new(pins, fit)
        .map_err(ElfError::board(BOARD))?
        .running(&image, None)
        .run(&start, first, listener)
        .map_err(ElfError::board(BOARD))?;
    let listener = finished.driver;
    let console = String::from_utf8_lossy(&listener.console).into_owned();
    let log: Vec<String> = listener.log.map_or_else(Vec::new, |log| {
        let lines = log.lines().into_iter();
        lines
            .map(|(_, line)| line.trim_start().to_owned())
            .collect()
    });
    match finished.exit_status {
        Some(status) => Ok(Said {
            console,
            log,
            is_done: status == 0,
        }),
        None => Err(ElfError::Stopped {
            board: BOARD,
            at_s: finished.stop.map_or(0.0, |stop| stop.at.0 as f64 * 1e-9),
            duration_s: LIMIT_S as f64,
            reason: format!(
                "{} never ended itself; it logged last: {}",
                path.display(),
                log.last().map_or("nothing", String::as_str)
            ),
        }),
    }
}
