//! The examination and its findings for people, in 80 columns.

use std::fmt::Write;

use protocol::{GaugeHealth, PROTOCOL_VERSION, RoleCounters, SCHEMA_HASH, Status};

use super::examination::{BoardFacts, Examination};
use super::findings::{Finding, peer_grown};
use super::json::reset_word;
use crate::state::Named;

/// Widest line. What can't be broken, a rule to be copied above all, may be longer.
const COLUMNS: usize = 80;
/// Where the facts of a board begin.
const INDENT: usize = 15;

/// How words stand out on a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Not at all.
    Plain,
    /// By weight and colour.
    Terminal,
}

impl Style {
    fn bold(self, text: &str) -> String {
        self.wrap("1", text)
    }

    fn red(self, text: &str) -> String {
        self.wrap("1;31", text)
    }

    fn green(self, text: &str) -> String {
        self.wrap("1;32", text)
    }

    fn wrap(self, code: &str, text: &str) -> String {
        match self {
            Self::Plain => text.to_owned(),
            Self::Terminal => format!("\x1b[{code}m{text}\x1b[0m"),
        }
    }
}

/// The whole report.
pub fn write(examination: &Examination, findings: &[Finding], style: Style) -> String {
    let mut out = format!(
        "host-bridge {}, protocol {PROTOCOL_VERSION}, schema {SCHEMA_HASH:016x}\n",
        env!("CARGO_PKG_VERSION")
    );
    attached(&mut out, examination, style);
    for board in &examination.boards {
        of_board(&mut out, board, style);
    }
    of_findings(&mut out, findings, style);
    out
}

fn attached(out: &mut String, examination: &Examination, style: Style) {
    let mut lines = Vec::new();
    for link in &examination.st_links {
        let serial = link.serial.as_deref().unwrap_or("without a serial number");
        lines.push(format!("ST-LINK {serial}: {}", link.port.display()));
    }
    for probe in &examination.probes {
        let serial = probe.serial.as_deref().unwrap_or("");
        let denied = if probe.is_allowed {
            ""
        } else {
            ", no permission"
        };
        lines.push(format!(
            "probe {:04x}:{:04x}:{serial} {}{denied}",
            probe.vendor, probe.product, probe.name
        ));
    }
    if lines.is_empty() {
        lines.push("no ST-LINK and no probe".to_owned());
    }
    let _ = writeln!(out, "\n{}", style.bold("attached"));
    for line in lines {
        wrapped(out, &line, 2);
    }
}

fn of_board(out: &mut String, board: &BoardFacts, style: Style) {
    let _ = writeln!(out, "\n{}", style.bold(board.role.name()));
    let mut fact = |name: &str, text: String| {
        let _ = write!(out, "  {name:<width$}", width = INDENT - 2);
        wrapped_after(out, &text, INDENT);
    };
    fact("port", board.state.to_string());
    if let Some(elf) = &board.elf {
        let what = match &elf.hello {
            Ok(hello) => Named(hello).to_string(),
            Err(_) => "can't be used".to_owned(),
        };
        fact("bench's ELF", format!("{}: {what}", elf.path.display()));
    }
    if !board.state.is_known() {
        return;
    }
    if let Some(status) = board.status() {
        fact("up", uptime(status));
        if let RoleCounters::Display(display) = &status.role {
            fact("supervisor", display.state.to_string());
        }
        if let Some(arm) = board.arm() {
            fact("arm", arm);
        }
    }
    if let Some(health) = board.health {
        let words = health.map(GaugeHealth::name);
        fact("gauges 0-4", words.join(", "));
    }
    if let Some(clock) = &board.clock {
        fact(
            "clock",
            format!(
                "{:+.6} s to this program's, {}",
                clock.offset_us as f64 / 1e6,
                clock.drift.map_or_else(
                    || "drift not seen yet".to_owned(),
                    |drift| format!("drifts {:+.0} ± {:.0} ppm", drift.ppm, drift.error_ppm)
                )
            ),
        );
        fact(
            "round trip",
            format!("{:.1} ms", clock.round_trip_us as f64 / 1e3),
        );
    }
    if let Some(rate_hz) = board.rate_hz {
        fact("says", format!("{rate_hz:.0} {} a second", board.speech()));
    }
    if board.missed.lost > 0 {
        let missed = board.missed.lost;
        fact(
            "handed over",
            format!("{missed} frames missed while its port changed hands between programs"),
        );
    }
    if let Some(frames) = peer_grown(board) {
        fact("other board", format!("{frames} frames heard from it"));
    }
}

/// How long a board has been up, and why it started.
fn uptime(status: &Status) -> String {
    let s = status.uptime_us / 1_000_000;
    let (days, hours, minutes) = (s / 86_400, s / 3_600 % 24, s / 60 % 60);
    let time = if days > 0 {
        format!("{days} d {hours} h")
    } else if hours > 0 {
        format!("{hours} h {minutes} min")
    } else if minutes > 0 {
        format!("{minutes} min {} s", s % 60)
    } else {
        format!("{s} s")
    };
    let resets = match status.watchdog_resets {
        0 => "no watchdog reset".to_owned(),
        1 => "1 watchdog reset".to_owned(),
        count => format!("{count} watchdog resets"),
    };
    format!("{time}, started by {}, {resets}", reset_word(status.reset))
}

fn of_findings(out: &mut String, findings: &[Finding], style: Style) {
    if findings.is_empty() {
        let _ = writeln!(out, "\n{}", style.green("all well"));
        return;
    }
    let head = match findings.len() {
        1 => "1 finding".to_owned(),
        count => format!("{count} findings"),
    };
    let _ = writeln!(out, "\n{}", style.red(&head));
    for (number, finding) in findings.iter().enumerate() {
        let _ = write!(out, "{:>3}. ", number + 1);
        wrapped_after(out, &finding.to_string(), 5);
        let _ = write!(out, "     -> ");
        wrapped_after(out, &finding.advice, 8);
    }
}

fn wrapped(out: &mut String, text: &str, indent: usize) {
    let _ = write!(out, "{:indent$}", "");
    wrapped_after(out, text, indent);
}

/// `text` after something that is `indent` columns wide already; further lines begin below it.
fn wrapped_after(out: &mut String, text: &str, indent: usize) {
    let mut column = indent;
    for (at, word) in text.split(' ').enumerate() {
        let width = word.chars().count();
        if at > 0 && column + 1 + width > COLUMNS {
            let _ = write!(out, "\n{:indent$}", "");
            column = indent;
        } else if at > 0 {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += width;
    }
    out.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_broken_between_words_below_itself() {
        let mut out = "12345".to_owned();
        wrapped_after(&mut out, &["word"; 20].join(" "), 5);
        let lines: Vec<&str> = out.lines().collect();
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[0].len(), 79);
        assert_eq!(lines[1], "     word word word word word");
    }
}
