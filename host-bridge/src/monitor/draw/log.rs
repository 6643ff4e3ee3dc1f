//! What has happened, and what the boards' firmware has logged, the newest last.

use protocol::Role;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::text;
use crate::monitor::dashboard::Dashboard;
use crate::monitor::happening::What;
use crate::monitor::theme::Theme;

/// Draws the last lines.
pub fn draw(frame: &mut Frame<'_>, area: Rect, shown: &Dashboard, theme: Theme) {
    let area = text::panel(
        frame,
        area,
        theme,
        text::title(theme, "log", "s since the monitor's start"),
    );
    let count = shown.happenings.len();
    let first = count.saturating_sub(area.height.into());
    for (row, happening) in (0..).zip(shown.happenings.iter().skip(first)) {
        let role = match happening.role {
            Role::Sensor => theme.sensor(),
            Role::Display | Role::Host => theme.display(),
        };
        let style = match &happening.what {
            what if what.is_bad() => theme.bad(),
            What::Log { .. } => theme.quiet(),
            _ => ratatui::style::Style::new(),
        };
        let line = Line::from(vec![
            Span::styled(
                format!(" {:>9.3} ", happening.at_us as f64 / 1e6),
                theme.quiet(),
            ),
            Span::styled(format!("{:<8}", happening.role.name()), role),
            Span::styled(happening.what.to_string(), style),
        ]);
        text::put(frame, area, row, line);
    }
}
