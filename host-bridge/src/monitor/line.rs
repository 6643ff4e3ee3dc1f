//! A dashboard in lines: columns for people and scripts, or JSON.

use std::fmt::Write as _;

use protocol::{GaugeHealth, PortCounters, RoleCounters, Trip};
use serde_json::{Value, json};

use super::board::Board;
use super::dashboard::Dashboard;
use super::log_entry::{LogEntry, LogEvent};
use super::words;
use crate::host_clock::unix_ns;
use crate::state::State;

/// The names of the columns of [`second`], over their values. What is not known is `-`; the last column
/// may hold spaces.
pub const HEADING: &str = "#    t_s sensor     display    lambda_mm conf valid  range contact    \
                           count_mm  arm_mm_s hand_mm_s age_ms  lost   bad rtt_s_ms rtt_d_ms supervisor";

/// The present in one line.
pub fn second(dashboard: &Dashboard) -> String {
    let estimate = dashboard.estimate.map(|(_, estimate)| estimate);
    let number = |value: Option<f32>, digits: usize| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
    };
    let mm_s = |um_s: Option<i32>| number(um_s.map(|um_s| um_s as f32 / 1e3), 1);
    let rtt_ms = |board: &Board| {
        let rtt_us = board.clocks.map(|clocks| clocks.round_trip_us);
        number(rtt_us.map(|us| us as f32 / 1e3), 2)
    };
    let (lost, bad) = troubles(dashboard);
    let valid = estimate.map_or(
        "-",
        |estimate| if estimate.valid { "valid" } else { "unsure" },
    );
    let age = dashboard
        .estimate_age_ms()
        .map_or_else(|| "-".to_owned(), |ms| ms.to_string());
    let mut line = format!("{:8.3}", seconds(dashboard.now_us));
    for (width, cell) in [
        (10, state_word(&dashboard.sensor).to_owned()),
        (10, state_word(&dashboard.display).to_owned()),
    ] {
        let _ = write!(line, " {cell:<width$}");
    }
    let _ = write!(
        line,
        " {:>9} {:>4} {valid:<6} {:<5} {:<10} {:>8} {:>9} {:>9} {age:>6} {lost:>5} {bad:>5} {:>8} {:>8} {}",
        number(estimate.and_then(|estimate| estimate.wavelength_mm), 3),
        number(estimate.map(|estimate| estimate.confidence), 2),
        estimate.map_or("-", |estimate| words::range(estimate.range)),
        estimate.map_or("-", |estimate| words::contact(estimate.contact)),
        number(estimate.and_then(|estimate| estimate.counted_mm), 2),
        mm_s(estimate.map(|estimate| estimate.velocity_um_s)),
        mm_s(dashboard.motion.map(|(_, motion)| motion.velocity_um_s)),
        rtt_ms(&dashboard.sensor),
        rtt_ms(&dashboard.display),
        dashboard
            .safety
            .map_or_else(|| "-".to_owned(), |(_, state)| state.to_string()),
    );
    line
}

/// Something that happened, in one line, which scripts that read the columns take for a comment.
pub fn log_entry(log_entry: &LogEntry) -> String {
    let word = match &log_entry.what {
        LogEvent::Link(state) => state.word(),
        what => what.word(),
    };
    format!(
        "# {:8.3} {} {word}: {}",
        seconds(log_entry.at_us),
        log_entry.role.name(),
        log_entry.what
    )
}

/// The present as one JSON object.
pub fn second_json(dashboard: &Dashboard) -> Value {
    let estimate = dashboard.estimate.map(|(_, estimate)| {
        json!({
            "wavelength_mm": estimate.wavelength_mm,
            "confidence": estimate.confidence,
            "valid": estimate.valid,
            "range": words::range(estimate.range),
            "contact": words::contact(estimate.contact),
            "counted_mm": estimate.counted_mm,
            "amplitude_lsb": estimate.amplitude_lsb,
            "velocity_mm_s": mm_s(estimate.velocity_um_s),
            "lag_um": estimate.lag_um,
            "gauges": estimate.health.map(GaugeHealth::name),
            "age_ms": dashboard.estimate_age_ms(),
            "rate_hz": dashboard.sensor.rate.per_s(),
        })
    });
    let motion = dashboard.motion.map(|(_, motion)| {
        json!({
            "velocity_mm_s": mm_s(motion.velocity_um_s),
            "position_um": motion.position_um,
            "age_ms": dashboard.motion_age_ms(),
            "rate_hz": dashboard.display.rate.per_s(),
        })
    });
    let supervisor = dashboard.safety.map(|(since_us, state)| {
        json!({
            "state": state.name(),
            "reason": state.reason(),
            "for_s": seconds(dashboard.now_us.saturating_sub(since_us)),
        })
    });
    let ports: Vec<Value> = dashboard
        .ports()
        .into_iter()
        .filter_map(|(name, counters)| Some(json!({ "port": name, "counters": counters? })))
        .collect();
    json!({
        "kind": "second",
        "t_s": seconds(dashboard.now_us),
        "unix_s": unix_s(dashboard.now_us),
        "sensor": board_json(&dashboard.sensor, dashboard.now_us),
        "display": board_json(&dashboard.display, dashboard.now_us),
        "estimate": estimate,
        "motion": motion,
        "arm_stopped": dashboard.sensor.arm_stopped.map(Trip::name),
        "supervisor": supervisor,
        "ports": ports,
    })
}

/// Something that happened, as one JSON object.
pub fn happening_json(log_entry: &LogEntry) -> Value {
    let mut object = json!({
        "kind": log_entry.what.word(),
        "t_s": seconds(log_entry.at_us),
        "unix_s": unix_s(log_entry.at_us),
        "board": log_entry.role.name(),
        "text": log_entry.what.to_string(),
    });
    match &log_entry.what {
        LogEvent::Link(state) => {
            object["state"] = state.word().into();
            object["advice"] = state.advice().into();
        }
        LogEvent::Safety(state) => {
            object["state"] = state.name().into();
            object["reason"] = state.reason().into();
        }
        LogEvent::ArmStopped(trip) => object["reason"] = trip.name().into(),
        LogEvent::Log { level, text } => {
            object["level"] = (*level).into();
            object["text"] = text.as_str().into();
        }
        LogEvent::Restarted | LogEvent::LogLost { .. } => {}
    }
    object
}

fn board_json(board: &Board, now_us: u64) -> Value {
    let status = board.status.as_ref().map(|(_, status)| status);
    json!({
        "state": state_word(board),
        "text": board.state.as_ref().map(State::to_string),
        "advice": board.state.as_ref().and_then(State::advice),
        "uptime_s": board.uptime_us(now_us).map(seconds),
        "started_by": status.map(|status| status.reset.name()),
        "watchdog_resets": status.map(|status| status.watchdog_resets),
        "round_trip_ms": board.clocks.map(|clocks| clocks.round_trip_us as f64 / 1e3),
        "clock_offset_ms": board.clocks.map(|clocks| clocks.offset_us as f64 / 1e3),
        "counters": status.map(|status| match status.role {
            RoleCounters::Sensor(counters) => json!(counters),
            RoleCounters::Display(counters) => json!(counters),
        }),
    })
}

fn state_word(board: &Board) -> &'static str {
    board.state.as_ref().map_or("-", State::word)
}

/// Frames lost and frames that came wrong, over all ports that are known.
fn troubles(dashboard: &Dashboard) -> (u32, u32) {
    let known = dashboard.ports().into_iter().filter_map(|(_, port)| port);
    known.fold((0, 0), |(lost, bad), port: PortCounters| {
        let wrong = [port.corrupt, port.overlong, port.malformed, port.foreign];
        (
            lost.saturating_add(port.lost),
            wrong.into_iter().fold(bad, u32::saturating_add),
        )
    })
}

fn mm_s(um_s: i32) -> f64 {
    f64::from(um_s) / 1e3
}

fn seconds(us: u64) -> f64 {
    us as f64 / 1e6
}

fn unix_s(at_us: u64) -> f64 {
    (unix_ns(at_us) / 1_000_000) as f64 / 1e3
}
