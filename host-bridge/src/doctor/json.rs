//! The examination and its findings for scripts. Fields are only ever added; a field that has nothing to
//! tell is null. `format` is raised if one has to go or to change its meaning.

use protocol::{Hello, PROTOCOL_VERSION, ResetCause, RoleCounters, SCHEMA_HASH, Status};
use serde::Serialize;
use serde_json::Value;

use super::examination::{BoardFacts, ElfFacts, Examination, ProbeFacts};
use super::findings::{Finding, peer_grown};

/// The version of this shape.
const FORMAT: u32 = 1;

/// Everything.
#[derive(Serialize)]
struct Report<'a> {
    /// [`FORMAT`].
    format: u32,
    /// Whether there is no finding: exit status 0.
    well: bool,
    /// This program.
    program: Identity,
    /// How long the boards were listened to, in s.
    looked_s: f64,
    /// The serial ports of ST-LINKs.
    st_links: Vec<StLink<'a>>,
    /// Debug probes, as probe-rs lists them.
    probes: Vec<Probe<'a>>,
    /// The boards that were looked for.
    boards: Vec<Board<'a>>,
    /// What is wrong.
    findings: Vec<Wrong<'a>>,
}

/// Who speaks what.
#[derive(Serialize)]
struct Identity {
    /// "sensor", "display" or "host"; null if this build does not know it.
    role: Option<&'static str>,
    /// "1.2.3".
    version: String,
    chip: String,
    protocol: u16,
    /// 16 hexadecimal digits.
    schema: String,
}

#[derive(Serialize)]
struct StLink<'a> {
    port: String,
    serial: Option<&'a str>,
}

#[derive(Serialize)]
struct Probe<'a> {
    name: &'a str,
    /// "0483:374b".
    usb: String,
    serial: Option<&'a str>,
    /// Whether this user may open it.
    allowed: bool,
}

#[derive(Serialize)]
struct Board<'a> {
    /// "sensor" or "display".
    role: &'static str,
    /// "absent", "busy", "denied", "failed", "opened", "silent", "deaf", "garbage", "foreign",
    /// "wrong-role" or "known".
    state: &'static str,
    port: Option<String>,
    hello: Option<Identity>,
    /// Time since its start.
    uptime_s: Option<f64>,
    /// Why it started: "power", "pin", "watchdog" or "software".
    reset: Option<&'static str>,
    watchdog_resets: Option<u32>,
    /// Times that it started anew while it was listened to.
    restarts: u32,
    /// Times that its line was lost meanwhile.
    losses: u32,
    /// The supervisor's state, as "ready" or "stopped: emergency stop"; a display's.
    supervisor: Option<String>,
    /// "free", or what stopped it, as "stopped: by the operator"; a sensor's.
    arm: Option<String>,
    /// "good", "dead", "stuck", "saturated", "noisy" or "hum" for each; a sensor's.
    gauges: Option<Vec<String>>,
    /// Estimates or motions a second.
    rate_hz: Option<f64>,
    clock: Option<Clock>,
    /// Frames that it took from the other board while it was listened to.
    peer_frames: Option<u32>,
    /// Every counter, by its name on the wire.
    counters: Option<Counters>,
    /// Those of this computer's end of the console.
    this_end: Value,
    /// Frames among `this_end.lost` that were missed because the port changed hands between programs.
    missed_at_handover: u32,
    elf: Option<Elf<'a>>,
}

#[derive(Serialize)]
struct Clock {
    /// The board's clock minus this computer's, which starts with the program.
    offset_us: i64,
    round_trip_us: u64,
    /// How fast the board's clock gains.
    drift_ppm: Option<f64>,
    /// The bound of its error.
    drift_error_ppm: Option<f64>,
}

#[derive(Serialize)]
struct Counters {
    peer: Value,
    console: Value,
    role: Value,
}

#[derive(Serialize)]
struct Elf<'a> {
    path: String,
    hello: Option<Identity>,
    /// Why it can't be used.
    error: Option<&'a str>,
}

#[derive(Serialize)]
struct Wrong<'a> {
    /// "sensor" or "display"; null if it is of the bench as a whole.
    board: Option<&'static str>,
    kind: &'a str,
    what: &'a str,
    advice: &'a str,
}

/// The document, indented.
pub fn write(examination: &Examination, findings: &[Finding]) -> String {
    let report = Report {
        format: FORMAT,
        well: findings.is_empty(),
        program: Identity::from(&crate::link::host_hello()),
        looked_s: examination.looked_s,
        st_links: examination
            .st_links
            .iter()
            .map(|link| StLink {
                port: link.port.display().to_string(),
                serial: link.serial.as_deref(),
            })
            .collect(),
        probes: examination.probes.iter().map(Probe::from).collect(),
        boards: examination.boards.iter().map(Board::from).collect(),
        findings: findings.iter().map(Wrong::from).collect(),
    };
    debug_assert_eq!(
        (report.program.protocol, &report.program.schema),
        (PROTOCOL_VERSION, &format!("{SCHEMA_HASH:016x}"))
    );
    // Nothing in it can fail to be written: every key is a string.
    serde_json::to_string_pretty(&report).unwrap_or_default()
}

fn value(of: &impl Serialize) -> Value {
    serde_json::to_value(of).unwrap_or_default()
}

impl From<&Hello> for Identity {
    fn from(hello: &Hello) -> Self {
        let [major, minor, patch] = hello.version;
        Self {
            role: protocol::Role::from_byte(hello.role).map(protocol::Role::name),
            version: format!("{major}.{minor}.{patch}"),
            chip: hello.chip_name().to_owned(),
            protocol: hello.protocol_version(),
            schema: format!("{:016x}", hello.schema_hash()),
        }
    }
}

impl<'a> From<&'a ProbeFacts> for Probe<'a> {
    fn from(probe: &'a ProbeFacts) -> Self {
        Self {
            name: &probe.name,
            usb: format!("{:04x}:{:04x}", probe.vendor, probe.product),
            serial: probe.serial.as_deref(),
            allowed: probe.is_allowed,
        }
    }
}

impl<'a> From<&'a BoardFacts> for Board<'a> {
    fn from(board: &'a BoardFacts) -> Self {
        let status = board.status();
        Self {
            role: board.role.name(),
            state: board.state.word(),
            port: board.state.port().map(|port| port.display().to_string()),
            hello: board.hello.as_ref().map(Identity::from),
            uptime_s: status.map(|status| status.uptime_us as f64 / 1e6),
            reset: status.map(|status| reset_word(status.reset)),
            watchdog_resets: status.map(|status| status.watchdog_resets),
            restarts: board.restarts,
            losses: board.losses,
            supervisor: status.and_then(|status| match &status.role {
                RoleCounters::Display(display) => Some(display.state.to_string()),
                RoleCounters::Sensor(_) => None,
            }),
            arm: board.arm(),
            gauges: board.health.map(|health| {
                health
                    .iter()
                    .map(|health| format!("{health:?}").to_lowercase())
                    .collect()
            }),
            rate_hz: board.rate_hz,
            clock: board.clock.map(|clock| Clock {
                offset_us: clock.offset_us,
                round_trip_us: clock.round_trip_us,
                drift_ppm: clock.drift.map(|drift| drift.ppm),
                drift_error_ppm: clock.drift.map(|drift| drift.error_ppm),
            }),
            peer_frames: peer_grown(board),
            counters: status.map(Counters::from),
            this_end: value(&board.counters),
            missed_at_handover: board.missed.lost,
            elf: board.elf.as_ref().map(Elf::from),
        }
    }
}

impl From<&Status> for Counters {
    fn from(status: &Status) -> Self {
        let mut role = match &status.role {
            RoleCounters::Sensor(counters) => value(counters),
            RoleCounters::Display(counters) => value(counters),
        };
        // They count nothing, and are told as `supervisor` and `arm`.
        if let Value::Object(fields) = &mut role {
            fields.remove("state");
            fields.remove("stopped");
        }
        Self {
            peer: value(&status.peer),
            console: value(&status.console),
            role,
        }
    }
}

impl<'a> From<&'a ElfFacts> for Elf<'a> {
    fn from(elf: &'a ElfFacts) -> Self {
        Self {
            path: elf.path.display().to_string(),
            hello: elf.hello.as_ref().ok().map(Identity::from),
            error: elf.hello.as_ref().err().map(String::as_str),
        }
    }
}

impl<'a> From<&'a Finding> for Wrong<'a> {
    fn from(finding: &'a Finding) -> Self {
        Self {
            board: finding.board.map(protocol::Role::name),
            kind: finding.kind,
            what: &finding.what,
            advice: &finding.advice,
        }
    }
}

/// A word for why a board started.
pub const fn reset_word(reset: ResetCause) -> &'static str {
    match reset {
        ResetCause::Power => "power",
        ResetCause::Pin => "pin",
        ResetCause::Watchdog => "watchdog",
        ResetCause::Software => "software",
    }
}
