//! The tables of the report.

use protocol::{GAUGES, GaugeHealth, RoleCounters, Status};
use serde::Serialize;
use serde_json::Value;

use crate::output::escape::escape;
use crate::output::report::Chapter;
use crate::output::rounded;
use hil_sim_core::judge::JudgedEstimate;
use hil_sim_core::judge::fault::Finding;
use hil_sim_core::judge::reaction::Reaction;

/// Log lines shown, at most.
const LOG_LINES: usize = 200;

/// A number with so many decimals and its unit, or a dash.
fn number(value: Option<f64>, decimals: usize, unit: &str) -> String {
    value.map_or("–".into(), |value| {
        let text = rounded(value, decimals).replace('-', "−");
        format!("{text}{unit}")
    })
}

fn percent(share: Option<f64>, decimals: usize) -> String {
    number(share.map(|share| 100.0 * share), decimals, " %")
}

/// A row: its head, then its cells, all of them HTML.
fn row(head: &str, cells: &[String]) -> String {
    let cells: String = cells
        .iter()
        .map(|cell| format!("<td>{cell}</td>"))
        .collect();
    format!("<tr><th scope=row>{head}</th>{cells}</tr>\n")
}

fn heads(heads: &[&str]) -> String {
    heads
        .iter()
        .map(|head| format!("<th>{head}</th>"))
        .collect()
}

pub fn index(chapters: &[Chapter]) -> String {
    let line = |(at, chapter): (usize, &Chapter)| {
        let Chapter {
            truth,
            recording,
            verdict,
            unmet,
            ..
        } = chapter;
        let (summary, actuators) = (&verdict.summary, &verdict.actuators);
        let unmet = if unmet.is_empty() {
            ""
        } else {
            "<span class=unmet>unmet</span>"
        };
        row(
            &format!("<a href=\"#scene-{at}\">{}</a>", escape(truth.name)),
            &[
                unmet.to_owned(),
                recording.engine.name().to_owned(),
                escape(truth.method),
                number(summary.mean_mm, 3, " mm"),
                number(summary.rms_percent, 2, " %"),
                percent(summary.wrong_share, 2),
                percent(summary.felt_right_share, 1),
                percent(summary.felt_wrong_share, 2),
                number(actuators.frequency_hz, 3, " Hz"),
                number(actuators.truth_hz, 3, " Hz"),
                number(recording.realtime_factor(), 1, " ×"),
            ],
        )
    };
    let rows: String = chapters.iter().enumerate().map(line).collect();
    let heads = heads(&[
        "scene",
        "",
        "engine",
        "method",
        "mean λ̂",
        "RMS error",
        "valid, wrong",
        "felt right",
        "felt wrong",
        "actuators",
        "v/λ̂",
        "real time",
    ]);
    format!(
        "<div class=wide><table><thead><tr>{heads}</tr></thead>\n<tbody>{rows}</tbody></table></div>\n"
    )
}

/// What the run came to: the numbers of the JSON, in words.
pub fn summary(chapter: &Chapter) -> String {
    let (s, a) = (&chapter.verdict.summary, &chapter.verdict.actuators);
    let reaction =
        |choose: fn(&Reaction) -> f64| number(a.hand_to_output.as_ref().map(choose), 3, " ms");
    let needed = s.rendering_needed.map_or("–", |rendering| rendering.name());
    let estimates = [
        ("RMS error of λ̂", number(s.rms_percent, 2, " %")),
        ("bias of λ̂", number(s.bias_percent, 2, " %")),
        ("mean λ̂", number(s.mean_mm, 4, " mm")),
        ("valid while in motion", percent(s.valid_share, 1)),
        ("valid and more than 10 % off", percent(s.wrong_share, 2)),
        ("felt right while in motion", percent(s.felt_right_share, 1)),
        (
            "felt and more than 10 % off",
            percent(s.felt_wrong_share, 2),
        ),
        ("rendering that the surface needs", needed.to_owned()),
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
    let cycles = |value| number(value, 4, " cycles");
    let mean_mv = number(a.mean_v.map(|v| 1e3 * v), 2, " mV");
    let actuators = [
        ("frequency", number(a.frequency_hz, 4, " Hz")),
        ("v/λ̂", number(a.truth_hz, 4, " Hz")),
        ("phase error, RMS", cycles(a.phase_error_rms_cycles)),
        ("phase error, mean", cycles(a.phase_error_mean_cycles)),
        ("largest step", number(a.max_step_v, 3, " V")),
        ("largest natural step", number(a.natural_step_v, 3, " V")),
        ("worst channel mean", mean_mv),
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
    let contact = estimates.iter().map(|e| e.contact.name());
    let mut lines = vec![("contact", shares(contact))];
    let lags = estimates.iter().filter_map(|e| e.lag_um);
    if let Some(most) = lags.map(i32::unsigned_abs).max() {
        let most_mm = f64::from(most) * 1e-3;
        lines.push((
            "largest lag behind the arm",
            number(Some(most_mm), 3, " mm"),
        ));
    }
    for (gauge, name) in NAMES.into_iter().enumerate() {
        let said = estimates.iter().map(|e| match e.health[gauge] {
            GaugeHealth::Good if e.gauges_used >> gauge & 1 == 1 => "takes part",
            GaugeHealth::Good => "sound but unused",
            other => other.name(),
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
    let told = |(word, count): (&str, usize)| {
        let share = 100.0 * count as f64 / total as f64;
        match share {
            _ if count == total => word.to_owned(),
            ..0.05 => format!("{word} below 0.1 %"),
            _ => format!("{word} {share:.1} %"),
        }
    };
    let words: Vec<String> = counts.into_iter().map(told).collect();
    words.join(", ")
}

fn facts(caption: &str, facts: &[(&str, String)]) -> String {
    let rows = facts
        .iter()
        .map(|(name, value)| row(name, std::slice::from_ref(value)));
    let rows: String = rows.collect();
    format!("<table><caption>{caption}</caption><tbody>\n{rows}</tbody></table>\n")
}

pub fn counters(chapter: &Chapter) -> String {
    let ends = [
        ("sensor", "Sensor board", chapter.recording.sensor_status),
        ("display", "Display board", chapter.recording.display_status),
    ];
    let heard = ends
        .iter()
        .filter_map(|(end, _, status)| Some((end, (*status)?)));
    let ports = heard.flat_map(|(end, Status { peer, console, .. })| {
        [
            (format!("{end}, peer"), fields(&peer)),
            (format!("{end}, console"), fields(&console)),
        ]
    });
    let (names, ports): (Vec<String>, Vec<_>) = ports.unzip();
    let mut html = String::new();
    if let Some(first) = ports.first() {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let heads = heads(&names);
        let rows = first.iter().enumerate().map(|(at, (name, _))| {
            let values: Vec<String> = ports.iter().map(|fields| fields[at].1.clone()).collect();
            row(name, &values)
        });
        let rows: String = rows.collect();
        html += &format!(
            "<div class=wide><table><caption>Ports</caption><thead><tr><th></th>{heads}</tr></thead>\
             <tbody>\n{rows}</tbody></table></div>\n"
        );
    }
    html += "<div class=pair>";
    for (end, caption, status) in ends {
        let Some(status) = status else {
            html += &format!("<p>No counters arrived from the {end} board.</p>");
            continue;
        };
        let uptime_s = status.uptime_us as f64 * 1e-6;
        let own = [
            ("uptime", number(Some(uptime_s), 3, " s")),
            ("last reset", format!("{:?}", status.reset)),
            ("watchdog resets", status.watchdog_resets.to_string()),
        ];
        let role = match status.role {
            RoleCounters::Sensor(counters) => fields(&counters),
            RoleCounters::Display(counters) => fields(&counters),
        };
        let role = role.iter().map(|(name, value)| (&**name, value.clone()));
        let all: Vec<(&str, String)> = own.into_iter().chain(role).collect();
        html += &facts(caption, &all);
    }
    html + "</div>\n"
}

/// A structure's fields in words, and their values: a counter added to it appears without a change here.
fn fields(counters: &impl Serialize) -> Vec<(String, String)> {
    let Ok(Value::Object(fields)) = serde_json::to_value(counters) else {
        return Vec::new();
    };
    let field = |(name, value): (String, Value)| (name.replace('_', " "), words(&value));
    fields.into_iter().map(field).collect()
}

/// A field's value: a dash for none, and what a word says more closely behind it.
fn words(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::String(word) => word.clone(),
        Value::Object(fields) => {
            let told = fields
                .iter()
                .map(|(name, value)| format!("{name}: {}", words(value)));
            told.collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    }
}

pub fn faults(findings: &[Finding]) -> String {
    if findings.is_empty() {
        return String::new();
    }
    let ms = |ms: Option<f64>| ms.map_or("–".to_owned(), |ms| format!("{ms:.2} ms"));
    let line = |finding: &Finding| {
        let of_kind = finding.fault.kind.row();
        let unmet = finding.unmet().join("; ");
        let mut unmet = match &*unmet {
            "" => unmet,
            _ => format!("<span class=unmet>{}</span>", escape(&unmet)),
        };
        for line in &finding.unjudged {
            unmet += &format!(" not judged {}", escape(line));
        }
        let again = if finding.drives_again { "yes" } else { "no" };
        row(
            of_kind.name,
            &[
                format!("{:.3} s", finding.fault.at_s),
                of_kind.class.name().to_owned(),
                ms(finding.detected_ms()),
                escape(&finding.sign),
                ms(finding.safe_ms()),
                again.to_owned(),
                unmet,
            ],
        )
    };
    let rows: String = findings.iter().map(line).collect();
    let heads = heads(&[
        "kind",
        "at",
        "expected",
        "first sign after",
        "sign",
        "0 V after",
        "drives again",
        "",
    ]);
    format!(
        "<div class=wide><table><caption>Faults</caption><thead><tr>{heads}</tr></thead><tbody>\n\
         {rows}</tbody></table></div>\n"
    )
}

pub fn log(chapter: &Chapter) -> String {
    let lines = &chapter.recording.log;
    if lines.is_empty() {
        return String::new();
    }
    let shown = lines.iter().take(LOG_LINES).map(|(at_ns, board, line)| {
        let at_s = *at_ns as f64 / 1e9;
        format!("{at_s:>11.6} {board:<8}{}\n", escape(line))
    });
    let shown: String = shown.collect();
    let shown_count = lines.len().min(LOG_LINES);
    format!(
        "<details><summary>Log, {shown_count} of {} lines</summary><pre>{shown}</pre></details>\n",
        lines.len()
    )
}

#[cfg(test)]
mod tests {
    use protocol::{DisplayCounters, DisplayState, SensorCounters, Trip};

    use super::*;

    #[test]
    fn a_boards_state_is_told_in_words_and_what_is_none_by_a_dash() {
        let told = |counters: &[(String, String)], name: &str| {
            let found = counters.iter().find(|(counter, _)| counter == name);
            found.map(|(_, value)| value.clone()).expect(name)
        };
        for (state, words) in [
            (DisplayState::Driving, "Driving"),
            (
                DisplayState::Stopped(Trip::HandEncoder),
                "Stopped: HandEncoder",
            ),
        ] {
            let counters = DisplayCounters {
                state,
                ..DisplayCounters::ZERO
            };
            assert_eq!(told(&fields(&counters), "state"), words);
            assert_eq!(told(&fields(&counters), "deadline misses"), "0");
        }
        assert_eq!(told(&fields(&SensorCounters::default()), "stopped"), "–");
    }

    #[test]
    fn what_is_rounded_to_nothing_has_no_sign() {
        assert_eq!(number(Some(-0.004), 2, " mV"), "0.00 mV");
        assert_eq!(number(Some(-0.006), 2, " mV"), "−0.01 mV");
    }
}
