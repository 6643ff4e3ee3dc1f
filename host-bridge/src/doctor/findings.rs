//! What follows from the facts: each thing that is wrong, and one line of advice for it.

use std::fmt;
use std::path::Path;

use protocol::{
    ArmState, DisplayState, GaugeHealth, Hello, PROTOCOL_VERSION, ResetCause, Role, RoleCounters,
    SCHEMA_HASH, Status,
};

use super::counters::{self, Count};
use super::examination::{BoardFacts, ClockFacts, ElfFacts, Examination, ProbeFacts};
use super::permission::{RELOAD, RULES, probe_rule};
use crate::state::{Named, State};

/// Beyond this, a clock is not a crystal's, in ppm: two of 100 ppm, and as much again for heat and age.
const CRYSTAL_PPM: f64 = 500.0;
/// Longest round trip of a console on its own: a USB frame each way and a board's millisecond are 5 ms.
const ROUND_TRIP_US: u64 = 50_000;
/// A board says what its role says at least at this share of its rate.
const LEAST_RATE: f64 = 0.9;
/// A stack that once had less room than this was nearly full, in bytes.
const LITTLE_STACK_BYTES: u32 = 2_048;
/// Longest start of the converters, in µs.
const START_US: u64 = 2_000_000;

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The board; none if it is of the bench as a whole.
    pub board: Option<Role>,
    /// What kind of thing it is, for scripts: a word that never changes.
    pub kind: &'static str,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub advice: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.board {
            Some(role) => write!(f, "{}: {}", role.name(), self.what),
            None => f.write_str(&self.what),
        }
    }
}

/// Everything that is wrong: of the bench, then board by board.
pub fn of(examination: &Examination) -> Vec<Finding> {
    let mut found = Findings::default();
    for probe in examination.probes.iter().filter(|probe| !probe.is_allowed) {
        found.of_probe(probe, examination.has_plugdev);
    }
    found.between(examination);
    for board in &examination.boards {
        found.board = Some(board.role);
        found.of_board(board);
    }
    found.all
}

/// Frames that a board has taken from the other one while it was looked at.
pub fn peer_grown(board: &BoardFacts) -> Option<u32> {
    let (first, last) = (board.first.as_ref()?, board.last.as_ref()?);
    Some(last.peer.received.wrapping_sub(first.peer.received))
}

/// Whether a board has taken what the other one says while nothing came over the link between them: a relay told it.
/// The count of a board that has started anew falls, which tells nothing.
fn is_relayed(board: &BoardFacts) -> bool {
    let taken = |status: &Status| match &status.role {
        RoleCounters::Sensor(counters) => counters.motions,
        RoleCounters::Display(counters) => counters.estimates,
    };
    let statuses = board.first.as_ref().zip(board.last.as_ref());
    peer_grown(board) == Some(0) && statuses.is_some_and(|(first, last)| taken(last) > taken(first))
}

struct Spoken<'a>(&'a Hello);

impl fmt::Display for Spoken<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(hello) = self;
        write!(
            f,
            "protocol {} schema {:016x}",
            hello.protocol_version(),
            hello.schema_hash()
        )
    }
}

/// What has been found so far.
#[derive(Default)]
struct Findings {
    /// The board that is looked at; none if it is the bench as a whole.
    board: Option<Role>,
    all: Vec<Finding>,
}

impl Findings {
    fn add(&mut self, kind: &'static str, what: impl Into<String>, advice: impl Into<String>) {
        self.all.push(Finding {
            board: self.board,
            kind,
            what: what.into(),
            advice: advice.into(),
        });
    }

    fn of_probe(&mut self, probe: &ProbeFacts, has_plugdev: bool) {
        let serial = probe.serial.as_deref().unwrap_or("without a serial number");
        let what = format!("no permission to use {} {serial} as a probe", probe.name);
        let rule = probe_rule(probe.vendor, probe.product, has_plugdev);
        let advice = format!("put this line into {RULES}, then `{RELOAD}`: {rule}");
        self.add("probe-denied", what, advice);
    }

    /// What is wrong between the boards.
    fn between(&mut self, examination: &Examination) {
        let [Some(sensor), Some(display)] =
            [Role::Sensor, Role::Display].map(|role| examination.board(role))
        else {
            return;
        };
        let (Some(one), Some(other)) = (&sensor.hello, &display.hello) else {
            return;
        };
        if (one.protocol, one.schema) != (other.protocol, other.schema) {
            let (one, other) = (Spoken(one), Spoken(other));
            return self.add(
                "boards-differ",
                format!("the boards do not understand each other: sensor {one}, display {other}"),
                "flash both boards with one build: `host-bridge flash`",
            );
        }
        if !(sensor.state.is_known() && display.state.is_known()) {
            return;
        }
        if [sensor, display].into_iter().any(is_relayed) {
            return;
        }
        let is_deaf = [sensor, display].map(|board| peer_grown(board) == Some(0));
        let (hears, advice) = match is_deaf {
            [false, false] => return,
            [true, true] => (
                "neither hears the other",
                "see the wires between the boards: PD5 and PD6 crossed, a common ground",
            ),
            [is_sensor, _] => (
                if is_sensor {
                    "the sensor hears nothing"
                } else {
                    "the display hears nothing"
                },
                "see the wire to its PD6 from the other board's PD5, and the common ground",
            ),
        };
        self.add(
            "peer-link",
            format!("the link between the boards is down: {hears}"),
            advice,
        );
    }

    fn of_board(&mut self, board: &BoardFacts) {
        self.of_state(board);
        if let Some(elf) = &board.elf {
            self.of_elf(elf, board.hello.as_ref());
        }
        if board.losses > 0 {
            let what = format!(
                "its line was lost {} while it was looked at",
                times(board.losses)
            );
            self.add(
                "lost",
                what,
                "see USB cable, plug and hub, and the board's supply",
            );
        }
        if !board.state.is_known() {
            return;
        }
        if board.restarts > 0 {
            self.add(
                "restarted",
                format!("started anew {} while it was looked at", times(board.restarts)),
                "see its supply; if that is well, keep its log (`host-bridge monitor` with its ELF)",
            );
        }
        match board.status() {
            Some(status) => self.of_status(board, status),
            None => self.add(
                "no-status",
                "says nothing of itself",
                "reset the board; if it stays so, flash it: `host-bridge flash`",
            ),
        }
        self.of_rate(board);
        self.of_gauges(board);
        if let Some(clock) = &board.clock {
            self.of_clock(clock);
        }
        for count in counters::of_this_end(&board.line_counters()) {
            self.of_count("this end of the console", &count);
        }
    }

    fn of_state(&mut self, board: &BoardFacts) {
        let Some(advice) = board.state.advice() else {
            if let State::Opened(port) = &board.state {
                self.add(
                    "opened",
                    format!("{}: has not answered yet", port.display()),
                    "look longer: --for 10",
                );
            }
            return;
        };
        let what = board.state.to_string();
        match (&board.state, &board.permission) {
            (State::Denied { .. }, Some(permission)) => self.add(
                board.state.word(),
                format!(
                    "{what} (group {}, mode {:04o})",
                    permission.group, permission.mode
                ),
                permission.advice(),
            ),
            (State::Foreign(_, hello), _) if hello.protocol_version() == PROTOCOL_VERSION => {
                self.add(
                    board.state.word(),
                    format!(
                        "{what} too, but of schema {:016x}, not {SCHEMA_HASH:016x}",
                        hello.schema_hash()
                    ),
                    advice,
                );
            }
            _ => self.add(board.state.word(), what, advice),
        }
    }

    fn of_elf(&mut self, elf: &ElfFacts, runs: Option<&Hello>) {
        let board = self.board.map_or("", Role::name);
        let hello = match &elf.hello {
            Ok(hello) => hello,
            Err(reason) => {
                let advice = format!(
                    "name the right file as `elf` under [{board}] in the bench file, or build it"
                );
                return self.add("elf-unusable", reason.clone(), advice);
            }
        };
        let Some(runs) = runs else { return };
        if runs.role != hello.role || same_build(runs, hello) {
            return;
        }
        self.add(
            "elf-differs",
            format!(
                "runs {} with {}, but {} is {} with {}",
                Named(runs),
                Spoken(runs),
                file_name(&elf.path),
                Named(hello),
                Spoken(hello)
            ),
            format!("flash what the bench names: `host-bridge flash {board}`"),
        );
    }

    fn of_status(&mut self, board: &BoardFacts, status: &Status) {
        if status.watchdog_resets > 0 {
            let is_last = status.reset == ResetCause::Watchdog;
            let last = if is_last {
                ", the last start among them"
            } else {
                ""
            };
            self.add(
                "watchdog",
                format!(
                    "restarted by its watchdog {} since power came on{last}",
                    times(status.watchdog_resets)
                ),
                "its firmware hung or panicked: keep its log, report it; power takes the count back",
            );
        }
        if (1..LITTLE_STACK_BYTES).contains(&status.stack_free_bytes) {
            let what = format!(
                "its stack had no more than {} bytes left",
                status.stack_free_bytes
            );
            self.add(
                "stack",
                what,
                "report it with its log: a board whose stack is full stops",
            );
        }
        let (Some(first), last) = (&board.first, board.last.as_ref()) else {
            return;
        };
        let peer = counters::of_peer(&first.peer, last.map(|last| &last.peer));
        let console = counters::of_console(&first.console, last.map(|last| &last.console));
        let role = counters::of_role(&first.role, last.map(|last| &last.role));
        for (place, counts) in [("peer link", peer), ("console", console), ("board", role)] {
            for count in counts {
                self.of_count(place, &count);
            }
        }
        match &status.role {
            RoleCounters::Display(display) => self.of_supervisor(display.state, status.uptime_us),
            RoleCounters::Sensor(sensor) => {
                if let Some(trip) = sensor.stopped {
                    self.add(
                        "arm-stopped",
                        format!("arm {}", ArmState::Stopped(trip)),
                        counters::arm_advice(trip),
                    );
                }
            }
        }
    }

    fn of_supervisor(&mut self, state: DisplayState, uptime_us: u64) {
        let is_starting = state == DisplayState::Boot && uptime_us < START_US;
        if let Some(advice) = counters::supervisor_advice(state).filter(|_| !is_starting) {
            self.add(state.name(), format!("no stimulus: {state}"), advice);
        }
    }

    fn of_count(&mut self, place: &str, count: &Count) {
        let Count {
            name,
            what,
            advice,
            count,
            grown,
        } = count;
        let growth = match grown {
            None => String::new(),
            Some(0) => ", none while it was looked at".to_owned(),
            Some(grown) if grown == count => ", all of them while it was looked at".to_owned(),
            Some(grown) => format!(", {grown} of them while it was looked at"),
        };
        self.add(
            "counter",
            format!("{place}: {count} {what} ({name}){growth}"),
            *advice,
        );
    }

    fn of_rate(&mut self, board: &BoardFacts) {
        let Some(rate_hz) = board.rate_hz else { return };
        let nominal_hz = board.nominal_rate_hz();
        if rate_hz == 0.0 {
            self.add(
                "rate",
                format!("sends no {}", board.speech()),
                "reset the board; if it stays so, keep its log and report it",
            );
        } else if rate_hz < LEAST_RATE * nominal_hz {
            self.add(
                "rate",
                format!(
                    "{rate_hz:.0} {} a second arrive instead of {nominal_hz:.0}",
                    board.speech()
                ),
                "see whether this computer, its USB hub or the console line is too busy",
            );
        }
    }

    fn of_gauges(&mut self, board: &BoardFacts) {
        for (gauge, health) in board.health.iter().flatten().enumerate() {
            let (word, advice) = match health {
                GaugeHealth::Good => continue,
                GaugeHealth::Dead => (
                    "dead",
                    "see the gauge, its bridge's supply and the wire from its amplifier",
                ),
                GaugeHealth::Stuck => (
                    "stuck at one code",
                    "see the amplifier's supply and the wire: the input does not move at all",
                ),
                GaugeHealth::Saturated => (
                    "saturated",
                    "balance its bridge to mid-rail (1.65 V), or lower the amplifier's gain",
                ),
                GaugeHealth::Noisy => (
                    "noisy",
                    "see the gauge's bond and its wires' screen: it shows nothing of the surface",
                ),
                GaugeHealth::Hum => (
                    "full of mains hum",
                    "screen its wires and ground the screen at one end",
                ),
            };
            self.add(
                "gauge",
                format!("gauge {gauge} (A{gauge}) is {word}"),
                advice,
            );
        }
    }

    fn of_clock(&mut self, clock: &ClockFacts) {
        if clock.round_trip_us > ROUND_TRIP_US {
            self.add(
                "round-trip",
                format!(
                    "no answer comes within {:.0} ms: the quickest took {:.0} ms",
                    ROUND_TRIP_US as f64 / 1e3,
                    clock.round_trip_us as f64 / 1e3
                ),
                "see whether this computer or its USB hub is too busy",
            );
        }
        if let Some(drift) = clock.drift
            && drift.ppm.abs() - drift.error_ppm > CRYSTAL_PPM
        {
            let way = if drift.ppm > 0.0 { "gains" } else { "loses" };
            self.add(
                "drift",
                format!(
                    "its clock {way} {:.0} ppm on this computer's: more than crystals differ by",
                    drift.ppm.abs()
                ),
                "see the 8 MHz clock that the ST-LINK gives the board; an emulated one needs an idle computer",
            );
        }
    }
}

fn same_build(one: &Hello, other: &Hello) -> bool {
    (one.protocol, one.schema, one.chip, one.version)
        == (other.protocol, other.schema, other.chip, other.version)
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(
        || path.display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    )
}

fn times(count: u32) -> String {
    match count {
        1 => "once".to_owned(),
        2 => "twice".to_owned(),
        _ => format!("{count} times"),
    }
}
