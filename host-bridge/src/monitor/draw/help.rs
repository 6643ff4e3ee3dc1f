//! What the keys do, and what is seen.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Borders, Clear, Paragraph};

use crate::monitor::theme::Theme;

/// Each key, or word, and what it means.
const LINES: [(&str, &str); 18] = [
    (
        "s, space",
        "stop: 0 V until the display board's reset button or power",
    ),
    ("c", "change a setting of a board"),
    (
        "r",
        "begin or end a recording; the gauges stream for as long",
    ),
    ("g", "stream the gauges, or no longer"),
    ("f", "freeze what is shown, or go on; nothing is missed"),
    ("+ -", "a shorter or a longer time"),
    (
        "m",
        "the fingertip's peaks of the last 0.1 s, or its volts now",
    ),
    (
        "Tab",
        "gauges, ports, boards or log, where there is no room for all",
    ),
    ("q, Ctrl-C", "quit; the boards go on"),
    (
        "λ",
        "the surface's wavelength: bold while the sensor stands by it",
    ),
    (
        "range",
        "T1: v kept its sign over the counting window; T2: it did not",
    ),
    (
        "paper's count",
        "λ by counting zero crossings, as Okamoto et al. (2009) do",
    ),
    ("LSB", "steps of the 12-bit converter, 3.3 V / 4096"),
    (
        "fingertip",
        "computed from motion and λ: the display sends no voltages",
    ),
    (
        "rtt, clock",
        "round trip to the board; its clock minus this computer's",
    ),
    (
        "misses, by",
        "samples or ticks not done in time; why the board started",
    ),
    ("stray", "frames from before the two ends knew each other"),
    ("unread", "good frames that hold no message of this version"),
];

/// Width with the frame.
const WIDTH: u16 = 78;

/// Draws the help over the middle of an area.
pub fn draw(frame: &mut Frame<'_>, area: Rect, theme: Theme) {
    let lines: Vec<Line<'_>> = LINES
        .iter()
        .map(|(word, meaning)| {
            Line::from(vec![
                Span::styled(format!(" {word:<14}"), theme.strong()),
                Span::raw(*meaning),
            ])
        })
        .collect();
    let place = middle(area, WIDTH, lines.len() as u16 + 2);
    frame.render_widget(Clear, place);
    let block = Block::new()
        .borders(Borders::ALL)
        .border_style(theme.quiet())
        .title(" any key closes this ");
    frame.render_widget(Paragraph::new(lines).block(block), place);
}

/// A place of this size in the middle of an area, or as much of it as there is.
pub fn middle(area: Rect, width: u16, height: u16) -> Rect {
    let (width, height) = (width.min(area.width), height.min(area.height));
    Rect {
        x: area.x + (area.width - width) / 2,
        y: area.y + (area.height - height) / 2,
        width,
        height,
    }
}
