//! What has happened, and what the boards' firmware has logged, the newest last.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::text;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::log_entry::LogEvent;
use crate::monitor::theme::Theme;

/// Width of the time and of the board's name.
const HEAD_WIDTH: u16 = 19;

/// Draws the last lines, each over as many rows as it takes.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, theme: Theme) {
    let title = text::title(theme, "log", "s since the monitor's start");
    let area = text::panel(frame, area, theme, title);
    let room = usize::from(area.width.saturating_sub(HEAD_WIDTH)).max(1);
    let mut lines = VecDeque::new();
    for log_entry in shown.log_entries.iter().rev() {
        if lines.len() >= area.height.into() {
            break;
        }
        let style = match &log_entry.what {
            what if what.is_bad() => theme.bad(),
            LogEvent::Log { .. } => theme.quiet(),
            _ => ratatui::style::Style::new(),
        };
        let at = format!(" {:>9.3} ", log_entry.at_us as f64 / 1e6);
        let head = [
            Span::styled(at, theme.quiet()),
            Span::styled(
                format!("{:<8}", log_entry.role.name()),
                theme.of(log_entry.role),
            ),
        ];
        let words = log_entry.what.to_string();
        let mut rows = text::broken(&words, room);
        // The newest stands at the bottom, and each from its first row downwards.
        for row in rows.drain(1..).rev() {
            let margin = Span::raw(" ".repeat(HEAD_WIDTH.into()));
            lines.push_front(Line::from(vec![margin, Span::styled(row, style)]));
        }
        let mut line = head.to_vec();
        line.extend(rows.pop().map(|row| Span::styled(row, style)));
        lines.push_front(Line::from(line));
    }
    let excess = lines.len().saturating_sub(area.height.into());
    for (row, line) in (0..).zip(lines.into_iter().skip(excess)) {
        text::put(frame, area, row, line);
    }
}
