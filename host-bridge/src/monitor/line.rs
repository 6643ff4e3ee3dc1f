//! The monitor for pipes and logs: a line now and then, and one at each change; in columns for people and scripts, or
//! in JSON.

use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use protocol::{GaugeHealth, PortCounters, RoleCounters, Trip};
use serde_json::{Value, json};

use super::board::Board;
use super::dashboard::Dashboard;
use super::log_entry::{LogEntry, LogEvent};
use super::session::Session;
use crate::clock::micros;
use crate::clock::{now_us, unix_ns};
use crate::state::State;

/// The names of the columns of [`second`], over their values. What is not known is `-`, as is an estimate or a motion
/// that is not of the present any more; the last column may hold spaces.
pub const HEADING: &str = "#    t_s sensor     display    lambda_mm conf valid  range contact    \
                           count_mm  arm_mm_s hand_mm_s age_ms  lost   bad rtt_s_ms rtt_d_ms supervisor";

pub fn second(dashboard: &Dashboard) -> String {
    let estimate = dashboard.present_estimate();
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
    format!(
        "{:8.3} {:<10} {:<10} {:>9} {:>4} {valid:<6} {:<5} {:<10} {:>8} {:>9} {:>9} {age:>6} {lost:>5} {bad:>5} {:>8} {:>8} {}",
        seconds(dashboard.now_us),
        state_word(&dashboard.sensor),
        state_word(&dashboard.display),
        number(estimate.and_then(|estimate| estimate.wavelength_mm), 3),
        number(estimate.map(|estimate| estimate.confidence), 2),
        estimate.map_or("-", |estimate| estimate.range.name()),
        estimate.map_or("-", |estimate| estimate.contact.name()),
        number(estimate.and_then(|estimate| estimate.counted_mm), 2),
        mm_s(estimate.map(|estimate| estimate.velocity_um_s)),
        mm_s(
            dashboard
                .present_motion()
                .map(|motion| motion.velocity_um_s)
        ),
        rtt_ms(&dashboard.sensor),
        rtt_ms(&dashboard.display),
        dashboard
            .safety
            .map_or_else(|| "-".to_owned(), |(_, state)| state.to_string()),
    )
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

/// The present as one JSON object. Of an estimate or a motion that is not of the present any more only age and rate are
/// told; this rule is for those two alone.
pub fn second_json(dashboard: &Dashboard) -> Value {
    let present = dashboard.present_estimate();
    let estimate = dashboard.estimate.as_ref().map(|_| {
        json!({
            "wavelength_mm": present.and_then(|estimate| estimate.wavelength_mm),
            "confidence": present.map(|estimate| estimate.confidence),
            "valid": present.is_some_and(|estimate| estimate.valid),
            "range": present.map(|estimate| estimate.range.name()),
            "contact": present.map(|estimate| estimate.contact.name()),
            "counted_mm": present.and_then(|estimate| estimate.counted_mm),
            "amplitude_lsb": present.map(|estimate| estimate.amplitude_lsb),
            "velocity_mm_s": present.map(|estimate| mm_s(estimate.velocity_um_s)),
            "lag_um": present.and_then(|estimate| estimate.lag_um),
            "gauges": present.map(|estimate| estimate.health.map(GaugeHealth::name)),
            "age_ms": dashboard.estimate_age_ms(),
            "rate_hz": dashboard.sensor.rate.per_s(),
        })
    });
    let present = dashboard.present_motion();
    let motion = dashboard.motion.as_ref().map(|_| {
        json!({
            "velocity_mm_s": present.map(|motion| mm_s(motion.velocity_um_s)),
            "position_um": present.map(|motion| motion.position_um),
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

/// Longest wait until a signal, or a line of a log, is seen.
const LOOK: Duration = Duration::from_millis(20);

/// What the lines are to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    pub is_json: bool,
    pub every: Duration,
}

impl Default for Format {
    fn default() -> Self {
        Self {
            is_json: false,
            every: Duration::from_secs(1),
        }
    }
}

/// Writes lines until `ended`, for `limit` at most, until the source has ended, or until nobody reads them any
/// more.
///
/// True if a board was there, or if nobody reads any more. Fails if they can't be written for another reason.
pub fn run(
    mut session: Session,
    format: &Format,
    limit: Option<Duration>,
    ended: &AtomicBool,
    output: &mut impl Write,
) -> io::Result<bool> {
    match write_lines(&mut session, format, limit, ended, output) {
        // Who reads no more has seen enough.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(true),
        written => written.map(|()| session.has_met()),
    }
}

fn write_lines(
    session: &mut Session,
    format: &Format,
    limit: Option<Duration>,
    ended: &AtomicBool,
    output: &mut impl Write,
) -> io::Result<()> {
    let begun_us = now_us();
    let every_us = micros(format.every).max(1);
    let mut next_us = begun_us + every_us;
    let end_us = limit.map(|limit| begun_us.saturating_add(micros(limit)));
    if !format.is_json {
        writeln!(output, "{}", HEADING)?;
        output.flush()?;
    }
    loop {
        let now = now_us();
        let wait = Duration::from_micros(next_us.saturating_sub(now)).min(LOOK);
        session.wait(wait);
        session.take();
        let now = now_us();
        let log_entries = session.dashboard.take_log_entries();
        let is_due = now >= next_us;
        let is_over = session.is_over()
            || ended.load(Ordering::Acquire)
            || end_us.is_some_and(|end_us| now >= end_us);
        for entry in &log_entries {
            if format.is_json {
                writeln!(output, "{}", happening_json(entry))?;
            } else {
                writeln!(output, "{}", log_entry(entry))?;
            }
        }
        if is_due {
            // One line stands for those that would have been due while nobody took them.
            next_us = (next_us + every_us).max(now);
            if format.is_json {
                writeln!(output, "{}", second_json(&session.dashboard))?;
            } else {
                writeln!(output, "{}", second(&session.dashboard))?;
            }
        }
        if is_due || !log_entries.is_empty() {
            output.flush()?;
        }
        if is_over {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::{Contact, Estimate, GAUGES, Hello, Message, Motion, Range, Role};

    use super::*;
    use crate::link::Event;
    use crate::state::State;

    fn turn(dashboard: &mut Dashboard, now_us: u64, is_known: bool) {
        for role in [Role::Sensor, Role::Display] {
            let state = if is_known {
                State::Known("/dev/tty".into(), Hello::new(role, "chip", [0, 1, 0]))
            } else {
                State::Absent("/dev/tty".to_owned())
            };
            dashboard.on(now_us, role, Event::StateChanged(state));
        }
    }

    /// Boards that have spoken at `at_us`, and not since.
    fn spoken(at_us: u64) -> Dashboard {
        let mut dashboard = Dashboard::default();
        turn(&mut dashboard, at_us, true);
        let estimate = Message::Estimate(Estimate {
            sequence: 1,
            instant_us: 1,
            wavelength_mm: Some(2.0),
            valid: true,
            confidence: 0.9,
            amplitude_lsb: 300.0,
            counted_mm: Some(2.1),
            range: Range::T1,
            contact: Contact::Slip,
            velocity_um_s: 70_000,
            lag_um: Some(5),
            gauges_used: 1,
            health: [GaugeHealth::Good; GAUGES],
        });
        let motion = Message::Motion(Motion {
            sequence: 1,
            instant_us: 1,
            position_um: 9,
            velocity_um_s: 60_000,
        });
        for (role, message) in [(Role::Sensor, estimate), (Role::Display, motion)] {
            dashboard.on(at_us, role, Event::Heard { at_us, message });
        }
        dashboard
    }

    /// The columns from λ to the hand's velocity, and what JSON says of them.
    fn told(dashboard: &Dashboard) -> (String, [Value; 4]) {
        let line = second(dashboard);
        let columns: Vec<&str> = line.split_whitespace().skip(3).take(8).collect();
        let json = second_json(dashboard);
        let [estimate, motion] = [&json["estimate"], &json["motion"]];
        let values = [
            &estimate["wavelength_mm"],
            &estimate["valid"],
            &estimate["velocity_mm_s"],
            &motion["velocity_mm_s"],
        ];
        (columns.join(" "), values.map(Value::clone))
    }

    #[test]
    fn what_boards_have_said_is_not_told_as_the_present_once_it_is_old_or_they_are_gone() {
        let at_us = 1_000_000;
        let present = (
            "2.000 0.90 valid T1 slip 2.10 70.0 60.0".to_owned(),
            [json!(2.0), json!(true), json!(70.0), json!(60.0)],
        );
        let nothing = (
            "- - - - - - - -".to_owned(),
            [json!(null), json!(false), json!(null), json!(null)],
        );
        let mut dashboard = spoken(at_us);
        dashboard.elapse(at_us + 499_999);
        assert_eq!(told(&dashboard), present);
        dashboard.elapse(at_us + 500_000);
        assert_eq!(told(&dashboard), nothing);
        assert_eq!(second_json(&dashboard)["estimate"]["age_ms"], 500);
        let mut dashboard = spoken(at_us);
        turn(&mut dashboard, at_us + 1, false);
        assert_eq!(told(&dashboard), nothing);
    }
}
