//! The counters of every port: both of each board, and this program's ends of their consoles.

use protocol::PortCounters;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::text;
use super::text::cut_left;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::theme::Theme;

/// Width of a port's name, and of a number.
const NAME: usize = 16;
const NUMBER: usize = 8;

/// A counter.
struct Column {
    name: &'static str,
    /// Whether it counts what should not be.
    is_bad: bool,
    count: fn(&PortCounters) -> u32,
}

const fn column(name: &'static str, is_bad: bool, count: fn(&PortCounters) -> u32) -> Column {
    Column {
        name,
        is_bad,
        count,
    }
}

/// The counters, those first that tell most: what there is no room for is left out at the end.
const COLUMNS: [Column; 13] = [
    column("sent", false, |port| port.sent),
    column("heard", false, |port| port.received),
    column("lost", true, |port| port.lost),
    column("corrupt", true, |port| port.corrupt),
    column("dropped", true, |port| port.dropped),
    column("overrun", true, |port| port.overruns),
    column("noise", true, |port| port.line_errors),
    column("late", true, |port| port.late),
    column("twice", true, |port| port.duplicated),
    column("stray", false, |port| port.unheralded),
    column("foreign", true, |port| port.foreign),
    column("unread", true, |port| port.malformed),
    column("long", true, |port| port.overlong),
];

/// Rows of the table with its heading.
pub const HEIGHT: u16 = 7;

/// Draws the table. Where there is no room for all counters, the last column adds up what is left of those
/// that count what should not be.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, theme: Theme) {
    let fitting = usize::from(area.width).saturating_sub(NAME) / NUMBER;
    let is_narrow = fitting < COLUMNS.len();
    let shown_columns = if is_narrow {
        fitting.saturating_sub(1)
    } else {
        COLUMNS.len()
    };
    let (columns, rest) = COLUMNS.split_at(shown_columns);
    let others = |port: &PortCounters| {
        let bad = rest.iter().filter(|column| column.is_bad);
        bad.map(|column| (column.count)(port))
            .fold(0, u32::saturating_add)
    };
    // The names stand in the panel's own line, which takes a row less.
    let inner = text::panel(frame, area, theme, text::title(theme, "ports", ""));
    let names: Vec<Span<'_>> = columns
        .iter()
        .map(|column| column.name)
        .chain((!rest.is_empty()).then_some("others"))
        .map(|name| Span::styled(format!("{name:>NUMBER$}"), theme.quiet()))
        .collect();
    let [_, heading] = cut_left(area, NAME as u16);
    text::put(frame, heading, 0, Line::from(names));
    for (row, (name, counters)) in (0..).zip(shown.ports()) {
        let name = format!(" {name:<width$}", width = NAME - 1);
        let mut spans = vec![Span::styled(name, theme.quiet())];
        let count =
            |column: &Column| number(column.is_bad, counters.as_ref().map(column.count), theme);
        spans.extend(columns.iter().map(count));
        if !rest.is_empty() {
            spans.push(number(true, counters.as_ref().map(others), theme));
        }
        text::put(frame, inner, row, Line::from(spans));
    }
}

fn number(is_bad: bool, count: Option<u32>, theme: Theme) -> Span<'static> {
    let Some(count) = count else {
        return Span::styled(format!("{:>NUMBER$}", "-"), theme.quiet());
    };
    let style = match (is_bad, count) {
        (_, 0) => theme.quiet(),
        (true, _) => theme.warning(),
        (false, _) => ratatui::style::Style::new(),
    };
    Span::styled(format!("{:>NUMBER$}", text::brief(count)), style)
}
