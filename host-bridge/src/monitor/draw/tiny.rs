//! The most needful lines, for a terminal that has room for no more.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::{header, surface, text};
use crate::monitor::dashboard::Dashboard;
use crate::monitor::view::View;

/// Draws as many lines as there is room for.
pub fn draw(frame: &mut Frame<'_>, area: Rect, live: &Dashboard, view: &View) {
    let theme = view.theme;
    let estimate = live.estimate.map(|(_, estimate)| estimate);
    let wavelength = estimate
        .and_then(|estimate| estimate.wavelength_mm)
        .map_or_else(|| "-".to_owned(), surface::millimetres);
    let sure = match estimate {
        Some(estimate) if estimate.valid => "valid",
        Some(_) => "unsure",
        None => "not heard",
    };
    let velocity = |um_s: Option<i32>| {
        let words = um_s.map(|um_s| format!("{:+.1}", um_s as f32 / 1e3));
        words.unwrap_or_else(|| "-".to_owned())
    };
    let hand = velocity(live.motion.map(|(_, motion)| motion.velocity_um_s));
    let arm = velocity(estimate.map(|estimate| estimate.velocity_um_s));
    let board = |role| {
        let board = live.board(role);
        let word = board.state.as_ref().map_or("-", |state| state.word());
        Line::from(vec![
            Span::styled(role.name(), theme.quiet()),
            Span::styled(format!(" {word}"), header::state_style(board, theme)),
        ])
    };
    let lines = [
        header::supervisor(live, theme),
        Line::from(vec![
            Span::styled("λ ", theme.quiet()),
            Span::styled(format!("{wavelength} mm"), theme.strong()),
            Span::raw(format!(" {sure}")),
        ]),
        Line::raw(format!("hand {hand} arm {arm} mm/s")),
        board(protocol::Role::Sensor),
        board(protocol::Role::Display),
        live.notice().map_or_else(
            || Line::styled("s stop  q quit", theme.quiet()),
            |notice| Line::styled(notice.text.clone(), header::notice_style(notice, theme)),
        ),
    ];
    for (row, line) in (0..).zip(lines) {
        text::put(frame, area, row, line);
    }
}
