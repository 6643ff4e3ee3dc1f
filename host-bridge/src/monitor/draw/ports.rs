//! The counters of every port: both of each board, and this program's ends of their consoles.

use protocol::PortCounters;
use ratatui::Frame;
use ratatui::layout::{Alignment, Rect};
use ratatui::text::{Line, Span};

use super::text;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::theme::Theme;

/// Width of a port's name, and of a number.
const NAME: usize = 17;
const NUMBER: usize = 8;

/// A counter.
struct Column {
    name: &'static str,
    count: fn(&PortCounters) -> u32,
    /// Whether it counts what should not be.
    is_bad: bool,
}

const fn column(name: &'static str, is_bad: bool, count: fn(&PortCounters) -> u32) -> Column {
    Column {
        name,
        count,
        is_bad,
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
    column("overlong", true, |port| port.overlong),
];

/// Draws the table.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, theme: Theme) {
    let area = text::panel(
        frame,
        area,
        theme,
        text::title(theme, "ports", "frames since their board's start"),
    );
    let fitting = usize::from(area.width).saturating_sub(NAME) / NUMBER;
    let columns = &COLUMNS[..fitting.min(COLUMNS.len())];
    let mut names = vec![Span::raw(" ".repeat(NAME))];
    names.extend(
        columns
            .iter()
            .map(|column| Span::styled(format!("{:>NUMBER$}", column.name), theme.quiet())),
    );
    text::put(frame, area, 0, Line::from(names));
    for (row, (name, counters)) in (1..).zip(shown.ports()) {
        let mut spans = vec![Span::styled(
            format!(" {name:<width$}", width = NAME - 1),
            theme.quiet(),
        )];
        spans.extend(
            columns
                .iter()
                .map(|column| number(column, counters.as_ref(), theme)),
        );
        text::put(
            frame,
            area,
            row,
            Line::from(spans).alignment(Alignment::Left),
        );
    }
}

fn number(column: &Column, counters: Option<&PortCounters>, theme: Theme) -> Span<'static> {
    let Some(counters) = counters else {
        return Span::styled(format!("{:>NUMBER$}", "-"), theme.quiet());
    };
    let count = (column.count)(counters);
    let style = match (column.is_bad, count) {
        (_, 0) => theme.quiet(),
        (true, _) => theme.warning(),
        (false, _) => ratatui::style::Style::new(),
    };
    Span::styled(format!("{:>NUMBER$}", text::brief(count)), style)
}
