//! The examination and its findings for scripts. Fields are only ever added; a field that has nothing to
//! tell is null. `format` is raised if one has to go or to change its meaning.

use protocol::{GaugeHealth, Hello, ResetCause, Role, RoleCounters, Status};
use serde_json::{Value, json};

use super::examination::{BoardFacts, ElfFacts, Examination, ProbeFacts};
use super::findings::{Finding, peer_grown};
use crate::link::host_hello;
use crate::place::StLink;
use crate::state::version;

const FORMAT: u32 = 1;

/// The document, indented.
pub fn write(examination: &Examination, findings: &[Finding]) -> String {
    let st_link = |link: &StLink| {
        let port = link.port.display().to_string();
        json!({ "port": port, "serial": link.serial })
    };
    let document = json!({
        "format": FORMAT,
        // Whether there is no finding: exit status 0.
        "well": findings.is_empty(),
        "program": identity(&host_hello()),
        "looked_s": examination.looked_s,
        "st_links": examination.st_links.iter().map(st_link).collect::<Value>(),
        "probes": examination.probes.iter().map(probe).collect::<Value>(),
        "boards": examination.boards.iter().map(board).collect::<Value>(),
        "findings": findings.iter().map(finding).collect::<Value>(),
    });
    format!("{document:#}")
}

/// Who speaks what; the role is null if this build does not know it.
pub fn identity(hello: &Hello) -> Value {
    json!({
        "role": Role::from_byte(hello.role).map(Role::name),
        "version": version(hello),
        "chip": hello.chip_name(),
        "protocol": hello.protocol_version(),
        "schema": format!("{:016x}", hello.schema_hash()),
    })
}

fn probe(probe: &ProbeFacts) -> Value {
    json!({
        "name": probe.name,
        "usb": format!("{:04x}:{:04x}", probe.vendor, probe.product),
        "serial": probe.serial,
        // Whether this user may open it.
        "allowed": probe.is_allowed,
    })
}

fn board(board: &BoardFacts) -> Value {
    let status = board.status();
    let clock = board.clock.map(|clock| {
        json!({
            // The board's clock minus this computer's, which starts with the program.
            "offset_us": clock.offset_us,
            "round_trip_us": clock.round_trip_us,
            // How fast the board's clock gains, and the bound of its error.
            "drift_ppm": clock.drift.map(|drift| drift.ppm),
            "drift_error_ppm": clock.drift.map(|drift| drift.error_ppm),
        })
    });
    let supervisor = status.and_then(|status| match &status.role {
        RoleCounters::Display(display) => Some(display.state.to_string()),
        RoleCounters::Sensor(_) => None,
    });
    json!({
        "role": board.role.name(),
        "state": board.state.word(),
        "port": board.state.port().map(|port| port.display().to_string()),
        "hello": board.hello.as_ref().map(identity),
        "uptime_s": status.map(|status| status.uptime_us as f64 / 1e6),
        "reset": status.map(|status| reset_word(status.reset)),
        "watchdog_resets": status.map(|status| status.watchdog_resets),
        // While it was listened to.
        "restarts": board.restarts,
        "losses": board.losses,
        // "ready", or "stopped: emergency stop"; a display's.
        "supervisor": supervisor,
        // "free", or "stopped: by the operator"; a sensor's.
        "arm": board.arm(),
        "gauges": board.health.map(|health| health.map(GaugeHealth::name)),
        // Estimates or motions a second.
        "rate_hz": board.rate_hz,
        "clock": clock,
        // Frames that it took from the other board while it was listened to.
        "peer_frames": peer_grown(board),
        "counters": status.map(counters),
        "this_end": board.counters,
        // Frames among `this_end.lost` that were missed because the port changed hands between programs.
        "missed_at_handover": board.missed.lost,
        "elf": board.elf.as_ref().map(elf),
    })
}

/// Every counter, by its name on the wire.
fn counters(status: &Status) -> Value {
    let mut role = match &status.role {
        RoleCounters::Sensor(counters) => json!(counters),
        RoleCounters::Display(counters) => json!(counters),
    };
    // They count nothing, and are told as `supervisor` and `arm`.
    if let Value::Object(fields) = &mut role {
        fields.remove("state");
        fields.remove("stopped");
    }
    json!({ "peer": status.peer, "console": status.console, "role": role })
}

fn elf(elf: &ElfFacts) -> Value {
    json!({
        "path": elf.path.display().to_string(),
        "hello": elf.hello.as_ref().ok().map(identity),
        // Why it can't be used.
        "error": elf.hello.as_ref().err(),
    })
}

fn finding(finding: &Finding) -> Value {
    json!({
        // Null if it is of the bench as a whole.
        "board": finding.board.map(Role::name),
        "kind": finding.kind,
        "what": finding.what,
        "advice": finding.advice,
    })
}

/// A word for why a board started.
pub const fn reset_word(reset: ResetCause) -> &'static str {
    match reset {
        ResetCause::Pin => "pin",
        other => other.name(),
    }
}
