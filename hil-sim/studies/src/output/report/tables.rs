//! The tables of the report.

use std::fmt::Write;

use protocol::{GAUGES, GaugeHealth, RoleCounters, Status};
use serde::Serialize;
use serde_json::Value;

use crate::output::escape::escape;
use crate::output::report::Chapter;
use hil_sim_core::judge::{JudgedEstimate, words};

/// Log lines shown, at most.
pub const LOG_LINES: usize = 200;

/// A number with so many decimals and its unit, or a dash.
fn number(value: Option<f64>, decimals: usize, unit: &str) -> String {
    value.map_or("–".into(), |value| {
        format!("{value:.decimals$}{unit}").replace('-', "−")
    })
}

/// One line per scene, each leading to its chapter.
pub fn index(chapters: &[Chapter]) -> String {
    let mut rows = String::new();
    for (at, chapter) in chapters.iter().enumerate() {
        let Chapter {
            truth,
            recording,
            verdict,
            ..
        } = chapter;
        let (summary, actuators) = (&verdict.summary, &verdict.actuators);
        let _ = writeln!(
            rows,
            "<tr><th scope=row><a href=\"#scene-{at}\">{}</a></th><td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escape(truth.name),
            if chapter.unmet.is_empty() {
                ""
            } else {
                "<span class=unmet>unmet</span>"
            },
            recording.engine.name(),
            escape(truth.method),
            number(summary.mean_mm, 3, " mm"),
            number(summary.rms_percent, 2, " %"),
            number(summary.wrong_share.map(|share| 100.0 * share), 2, " %"),
            number(summary.felt_right_share.map(|share| 100.0 * share), 1, " %"),
            number(summary.felt_wrong_share.map(|share| 100.0 * share), 2, " %"),
            number(actuators.frequency_hz, 3, " Hz"),
            number(actuators.truth_hz, 3, " Hz"),
            number(recording.realtime_factor(), 1, " ×"),
        );
    }
    format!(
        "<div class=wide><table><thead><tr><th>scene</th><th></th><th>engine</th><th>method</th><th>mean λ̂</th>\
         <th>RMS error</th><th>valid, wrong</th><th>felt right</th><th>felt wrong</th><th>actuators</th><th>v/λ̂</th><th>real time</th></tr></thead>\n\
         <tbody>{rows}</tbody></table></div>\n"
    )
}

/// What the run came to: the numbers of the JSON, in words.
pub fn summary(chapter: &Chapter) -> String {
    let (s, a) = (&chapter.verdict.summary, &chapter.verdict.actuators);
    let percent = |share: Option<f64>| number(share.map(|share| 100.0 * share), 1, " %");
    let reaction = |choose: fn(&hil_sim_core::judge::reaction::Reaction) -> f64| {
        number(a.hand_to_output.as_ref().map(choose), 3, " ms")
    };
    let millivolts = |value: Option<f64>| number(value.map(|v| 1e3 * v), 2, " mV");
    let estimates = [
        ("RMS error of λ̂", number(s.rms_percent, 2, " %")),
        ("bias of λ̂", number(s.bias_percent, 2, " %")),
        ("mean λ̂", number(s.mean_mm, 4, " mm")),
        ("valid while in motion", percent(s.valid_share)),
        (
            "valid and more than 10 % off",
            number(s.wrong_share.map(|share| 100.0 * share), 2, " %"),
        ),
        ("felt right while in motion", percent(s.felt_right_share)),
        (
            "felt and more than 10 % off",
            number(s.felt_wrong_share.map(|share| 100.0 * share), 2, " %"),
        ),
        (
            "rendering that the surface needs",
            s.rendering_needed
                .map_or("–", |rendering| rendering.name())
                .to_owned(),
        ),
        (
            "RMS error of the paper's count in T1",
            number(s.counted_rms_percent, 2, " %"),
        ),
        (
            "settled after the last boundary",
            number(s.settling_ms, 0, " ms"),
        ),
        ("from estimate to display", number(s.latency_ms, 2, " ms")),
    ];
    let actuators = [
        ("frequency", number(a.frequency_hz, 4, " Hz")),
        ("v/λ̂", number(a.truth_hz, 4, " Hz")),
        (
            "phase error, RMS",
            number(a.phase_error_rms_cycles, 4, " cycles"),
        ),
        (
            "phase error, mean",
            number(a.phase_error_mean_cycles, 4, " cycles"),
        ),
        ("largest step", number(a.max_step_v, 3, " V")),
        ("largest natural step", number(a.natural_step_v, 3, " V")),
        ("worst channel mean", millivolts(a.mean_v)),
        ("worst skew", number(a.skew_us, 3, " µs")),
        ("hand to output, median", reaction(|r| r.p50_ms)),
        ("hand to output, p99", reaction(|r| r.p99_ms)),
        ("hand to output, longest", reaction(|r| r.max_ms)),
    ];
    format!(
        "<div class=pair>{}{}{}</div>\n",
        facts("Estimates", &estimates),
        facts("Actuators", &actuators),
        facts("Contact and gauges", &senses(&chapter.verdict.estimates)),
    )
}

/// What the sensor says of the contact and of each gauge, as shares of the estimates.
fn senses(estimates: &[JudgedEstimate]) -> Vec<(&'static str, String)> {
    const NAMES: [&str; GAUGES] = ["gauge 0", "gauge 1", "gauge 2", "gauge 3", "gauge 4"];
    let mut lines = vec![(
        "contact",
        shares(estimates.iter().map(|e| words::of_contact(e.contact))),
    )];
    let lags = estimates.iter().filter_map(|e| e.lag_um);
    if let Some(most) = lags.map(i32::unsigned_abs).max() {
        lines.push((
            "largest lag behind the arm",
            number(Some(f64::from(most) * 1e-3), 3, " mm"),
        ));
    }
    for (gauge, name) in NAMES.into_iter().enumerate() {
        let said = estimates.iter().map(|e| match e.health[gauge] {
            GaugeHealth::Good if e.gauges_used >> gauge & 1 == 1 => "takes part",
            GaugeHealth::Good => "sound but unused",
            other => words::of_health(other),
        });
        lines.push((name, shares(said)));
    }
    lines
}

/// How often each word was said, the most frequent first: "slip 93.2 %, stick 6.8 %".
fn shares(said: impl Iterator<Item = &'static str>) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for word in said {
        match counts.iter_mut().find(|(known, _)| *known == word) {
            Some((_, count)) => *count += 1,
            None => counts.push((word, 1)),
        }
    }
    let total: usize = counts.iter().map(|(_, count)| count).sum();
    if total == 0 {
        return number(None, 0, "");
    }
    counts.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
    let share = |count: usize| 100.0 * count as f64 / total as f64;
    let words: Vec<String> = counts
        .into_iter()
        .map(|(word, count)| match count {
            all if all == total => word.to_owned(),
            some if share(some) < 0.05 => format!("{word} below 0.1 %"),
            some => format!("{word} {:.1} %", share(some)),
        })
        .collect();
    words.join(", ")
}

fn facts(caption: &str, facts: &[(&str, String)]) -> String {
    let rows = facts.iter().fold(String::new(), |mut rows, (name, value)| {
        let _ = writeln!(rows, "<tr><th scope=row>{name}</th><td>{value}</td></tr>");
        rows
    });
    format!("<table><caption>{caption}</caption><tbody>\n{rows}</tbody></table>\n")
}

/// The counters of both ends.
pub fn counters(chapter: &Chapter) -> String {
    let ends = [
        ("sensor", chapter.recording.sensor_status),
        ("display", chapter.recording.display_status),
    ];
    let mut html = String::new();
    let ports: Vec<_> = ends
        .iter()
        .filter_map(|(end, status)| Some((end, (*status)?)))
        .flat_map(|(end, Status { peer, console, .. })| {
            [
                (format!("{end}, peer"), fields(&peer)),
                (format!("{end}, console"), fields(&console)),
            ]
        })
        .collect();
    if let Some((_, first)) = ports.first() {
        let heads = ports.iter().fold(String::new(), |mut heads, (port, _)| {
            let _ = write!(heads, "<th>{port}</th>");
            heads
        });
        let mut rows = String::new();
        for (at, (name, _)) in first.iter().enumerate() {
            let _ = write!(rows, "<tr><th scope=row>{}</th>", name.replace('_', " "));
            for (_, fields) in &ports {
                let _ = write!(rows, "<td>{}</td>", fields[at].1);
            }
            rows += "</tr>\n";
        }
        let _ = write!(
            html,
            "<div class=wide><table><caption>Ports</caption><thead><tr><th></th>{heads}</tr></thead>\
             <tbody>\n{rows}</tbody></table></div>\n"
        );
    }
    html += "<div class=pair>";
    for (end, status) in ends {
        let Some(status) = status else {
            let _ = write!(html, "<p>No counters arrived from the {end} board.</p>");
            continue;
        };
        let mut all = vec![
            (
                "uptime".to_owned(),
                number(Some(status.uptime_us as f64 * 1e-6), 3, " s"),
            ),
            ("last reset".to_owned(), format!("{:?}", status.reset)),
            (
                "watchdog resets".to_owned(),
                status.watchdog_resets.to_string(),
            ),
        ];
        let role = match status.role {
            RoleCounters::Sensor(counters) => fields(&counters),
            RoleCounters::Display(counters) => fields(&counters),
        };
        all.extend(
            role.into_iter()
                .map(|(name, value)| (name.replace('_', " "), value)),
        );
        let all: Vec<(&str, String)> = all
            .iter()
            .map(|(name, value)| (name.as_str(), value.clone()))
            .collect();
        html += &facts(
            if end == "sensor" {
                "Sensor board"
            } else {
                "Display board"
            },
            &all,
        );
    }
    html + "</div>\n"
}

/// A structure's fields and their values: a counter added to it appears without a change here.
fn fields(counters: &impl Serialize) -> Vec<(String, String)> {
    match serde_json::to_value(counters) {
        Ok(Value::Object(fields)) => fields
            .into_iter()
            .map(|(name, value)| (name, value.to_string()))
            .collect(),
        _ => Vec::new(),
    }
}

/// The first lines of the boards' log.
pub fn log(chapter: &Chapter) -> String {
    let lines = &chapter.recording.log;
    if lines.is_empty() {
        return String::new();
    }
    let shown =
        lines
            .iter()
            .take(LOG_LINES)
            .fold(String::new(), |mut text, (at_ns, board, line)| {
                let _ = writeln!(
                    text,
                    "{:>11.6} {board:<8}{}",
                    *at_ns as f64 / 1e9,
                    escape(line)
                );
                text
            });
    let shown_count = lines.len().min(LOG_LINES);
    format!(
        "<details><summary>Log, {shown_count} of {} lines</summary><pre>{shown}</pre></details>\n",
        lines.len()
    )
}
