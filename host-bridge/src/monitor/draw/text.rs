//! Titles, numbers and lines that fit.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Borders};

use crate::monitor::theme::Theme;

/// A thin line with a title in it; what is left below it.
pub fn panel(frame: &mut Frame<'_>, area: Rect, theme: Theme, title: Line<'_>) -> Rect {
    let mut spans = vec![Span::styled("─ ", theme.quiet())];
    spans.extend(title.spans);
    spans.push(Span::raw(" "));
    let block = Block::new()
        .borders(Borders::TOP)
        .border_style(theme.quiet())
        .title_top(Line::from(spans));
    let inner = block.inner(area);
    frame.render_widget(block, area);
    inner
}

/// A title of one word and what is to be said quietly about it.
pub fn title(theme: Theme, name: &str, about: &str) -> Line<'static> {
    let mut spans = vec![Span::styled(name.to_owned(), theme.strong())];
    if !about.is_empty() {
        spans.push(Span::styled(format!("  {about}"), theme.quiet()));
    }
    Line::from(spans)
}

/// Writes a line into a row of an area, if it has such a row.
pub fn put(frame: &mut Frame<'_>, area: Rect, row: u16, line: Line<'_>) {
    if row < area.height {
        let place = Rect {
            y: area.y + row,
            height: 1,
            ..area
        };
        frame.render_widget(line, place);
    }
}

/// A text in rows of at most `width` characters, broken at its spaces; a longer word is broken anywhere.
/// There is always one row.
pub fn broken(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    let mut rows = Vec::new();
    let mut row = String::new();
    let mut used = 0;
    for word in text.split(' ') {
        if used > 0 && used + 1 + word.chars().count() > width {
            rows.push(std::mem::take(&mut row));
            used = 0;
        } else if used > 0 {
            row.push(' ');
            used += 1;
        }
        for letter in word.chars() {
            if used == width {
                rows.push(std::mem::take(&mut row));
                used = 0;
            }
            row.push(letter);
            used += 1;
        }
    }
    rows.push(row);
    rows
}

/// Seconds as a person reads them: `0:12:31`, or `3 d 04:05`.
pub fn duration(us: u64) -> String {
    let s = us / 1_000_000;
    let (days, hours, minutes, seconds) = (s / 86_400, s / 3_600 % 24, s / 60 % 60, s % 60);
    if days > 0 {
        format!("{days} d {hours:02}:{minutes:02}")
    } else {
        format!("{hours}:{minutes:02}:{seconds:02}")
    }
}

/// A time with the unit that fits: `52 µs`, `1.4 ms`, `12.3 s`.
pub fn short(us: u64) -> String {
    match us {
        0..1_000 => format!("{us} µs"),
        1_000..10_000 => format!("{:.1} ms", us as f64 / 1e3),
        10_000..1_000_000 => format!("{} ms", us / 1_000),
        _ => seconds(us),
    }
}

/// A time to a tenth of a second while that is to be seen: `12.3 s`.
pub fn seconds(us: u64) -> String {
    match us {
        0..100_000_000 => format!("{:.1} s", us as f64 / 1e6),
        _ => duration(us),
    }
}

/// A count in at most six characters.
pub fn brief(count: u32) -> String {
    match count {
        0..100_000 => count.to_string(),
        100_000..10_000_000 => format!("{} k", count / 1_000),
        _ => format!("{} M", count / 1_000_000),
    }
}

/// A length of time looked back on, in s.
pub fn span(s: f32) -> String {
    if s < 1.0 {
        format!("{:.0} ms", s * 1e3)
    } else if s < 10.0 {
        format!("{s:.1} s")
    } else {
        format!("{s:.0} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_broken_at_its_spaces_and_a_long_word_anywhere() {
        assert_eq!(broken("one two three", 7), ["one two", "three"]);
        assert_eq!(broken("one two three", 8), ["one two", "three"]);
        assert_eq!(broken("a longish word", 4), ["a", "long", "ish", "word"]);
        assert_eq!(broken("", 4), [""]);
        assert_eq!(broken("λλλ", 0), ["λ", "λ", "λ"]);
    }
}
