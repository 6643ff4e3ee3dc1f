//! The report for people: one HTML file that needs nothing else.

use std::fmt::Write;

use serde_json::Value;

use super::progress::{Outcome, Progress};
use super::step;
use super::step::Figure;

const STYLE: &str = "body{font:16px/1.4 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}\
table{border-collapse:collapse;width:100%}td,th{border:1px solid #999;padding:.2em .5em;text-align:left}\
.passed{color:#060}.failed{color:#b00;font-weight:bold}.soft{color:#666}";

/// What every report begins with.
pub const BEGINNING: &str = "<!doctype html>\n<html lang=en>\n<meta charset=utf-8>\n<title>Ridgelink: a bench brought up</title>\n";

pub fn html(progress: &Progress) -> String {
    let mut page = format!(
        "{BEGINNING}<style>{STYLE}</style>\n<h1>A bench brought up</h1>\n\
         <p>{}, protocol {}, schema {}</p>\n",
        escape(&progress.program),
        progress.protocol,
        escape(&progress.schema),
    );
    boards(&mut page, &progress.doctor);
    page += "<h2>Steps</h2>\n<table>\n<tr><th>step<th>figure<th>value<th>has to be<th>result\n";
    for step in step::all() {
        let title = format!("<b>{}</b><br>{}", step.name, escape(&step.title));
        let Some(record) = progress.record(&step.name) else {
            let _ = writeln!(page, "<tr class=soft><td>{title}<td colspan=4>not tried");
            continue;
        };
        let class = match record.outcome {
            Outcome::Passed => "passed",
            Outcome::Failed => "failed",
            Outcome::LeftOut | Outcome::Blocked => "soft",
        };
        if record.figures.is_empty() {
            let note = record.note.as_deref().unwrap_or_default();
            let name = record.outcome.name();
            let _ = writeln!(
                page,
                "<tr class={class}><td>{title}<td colspan=4>{name}: {}",
                escape(note)
            );
        }
        for (at, figure) in record.figures.iter().enumerate() {
            let first = match at {
                0 => format!("<td rowspan={}>{title}", record.figures.len()),
                _ => String::new(),
            };
            let _ = writeln!(page, "<tr>{first}{}", cells(figure));
        }
    }
    page += "</table>\n";
    page
}

fn cells(figure: &Figure) -> String {
    let Figure {
        what, unit, limit, ..
    } = figure;
    let value = figure.value.as_ref();
    let value = value.map_or("not seen".to_owned(), ToString::to_string);
    let (class, result) = if figure.passes {
        ("passed", "passed".to_owned())
    } else {
        let advice = figure.advice.as_deref().unwrap_or_default();
        ("failed", format!("FAILED: {advice}"))
    };
    format!(
        "<td>{}<td>{} {unit}<td>{} {unit}<td class={class}>{}",
        escape(what),
        escape(&value),
        escape(limit),
        escape(&result),
    )
}

/// Versions and serial numbers, from what the doctor saw last.
fn boards(page: &mut String, doctor: &Value) {
    let text = |value: &Value| {
        value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned)
    };
    let list = |key: &str| doctor[key].as_array().cloned().unwrap_or_default();
    *page += "<h2>Boards</h2>\n<table>\n<tr><th>board<th>port<th>firmware<th>chip<th>protocol, schema<th>started by\n";
    for board in list("boards") {
        let hello = &board["hello"];
        let cells = [
            text(&board["role"]),
            text(&board["port"]),
            text(&hello["version"]),
            text(&hello["chip"]),
            format!("{}, {}", text(&hello["protocol"]), text(&hello["schema"])),
            text(&board["reset"]),
        ];
        let _ = writeln!(
            page,
            "<tr>{}",
            cells.map(|cell| format!("<td>{}", escape(&cell))).concat()
        );
    }
    *page += "</table>\n";
    for link in list("st_links") {
        let (port, serial) = (text(&link["port"]), text(&link["serial"]));
        let _ = writeln!(page, "<p>ST-LINK {} at {}", escape(&serial), escape(&port));
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bringup::sight::Sight;

    #[test]
    fn every_step_and_figure_is_in_it_and_markup_stays_text() {
        let mut progress = Progress::default();
        let step = step::named("link-to-display").expect("a step");
        let mut figures = step.judge(&Sight::default(), |_| None);
        figures[0].advice = Some("PD5 <to> PD6 & ground".to_owned());
        progress.put(step, Outcome::Failed, None, figures.clone(), 2.0);
        let page = html(&progress);
        for step in step::all() {
            assert!(page.contains(&format!("<b>{}</b>", step.name)));
        }
        for figure in figures {
            assert!(page.contains(&figure.what) && page.contains(&figure.limit));
        }
        assert!(page.contains("PD5 &lt;to&gt; PD6 &amp; ground"));
    }
}
