//! Areas, titles, numbers and lines that fit.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
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

/// The uppermost `height` rows, as far as there are so many, and the rest.
pub fn cut_top(area: Rect, height: u16) -> [Rect; 2] {
    let height = height.min(area.height);
    let (y, rest) = (area.y + height, area.height - height);
    [
        Rect { height, ..area },
        Rect {
            y,
            height: rest,
            ..area
        },
    ]
}

/// The leftmost `width` columns, as far as there are so many, and the rest.
pub fn cut_left(area: Rect, width: u16) -> [Rect; 2] {
    let width = width.min(area.width);
    let (x, rest) = (area.x + width, area.width - width);
    [
        Rect { width, ..area },
        Rect {
            x,
            width: rest,
            ..area
        },
    ]
}

/// Columns of one width, a space apart; what is left over stays empty at the right.
pub fn columns<const COUNT: usize>(area: Rect) -> [Rect; COUNT] {
    const GAP: u16 = 1;
    let count = COUNT as u16;
    let width = area.width.saturating_sub(GAP * (count - 1)) / count;
    std::array::from_fn(|index| Rect {
        x: area.x + (width + GAP) * index as u16,
        width,
        ..area
    })
    .map(|column| column.intersection(area))
}

pub const BIG_ROWS: usize = 3;
/// Dots of a character across, and down.
const WIDTH: usize = 3;
const HEIGHT: usize = 5;

/// Five rows of three bits, from the top, the left one highest.
const fn dots(character: char) -> [u8; HEIGHT] {
    match character {
        '0' => [0b111, 0b101, 0b101, 0b101, 0b111],
        '1' => [0b010, 0b110, 0b010, 0b010, 0b111],
        '2' => [0b111, 0b001, 0b111, 0b100, 0b111],
        '3' => [0b111, 0b001, 0b111, 0b001, 0b111],
        '4' => [0b101, 0b101, 0b111, 0b001, 0b001],
        '5' => [0b111, 0b100, 0b111, 0b001, 0b111],
        '6' => [0b111, 0b100, 0b111, 0b101, 0b111],
        '7' => [0b111, 0b001, 0b001, 0b001, 0b001],
        '8' => [0b111, 0b101, 0b111, 0b101, 0b111],
        '9' => [0b111, 0b101, 0b111, 0b001, 0b111],
        '-' => [0b000, 0b000, 0b111, 0b000, 0b000],
        '.' => [0b000, 0b000, 0b000, 0b000, 0b010],
        _ => [0; HEIGHT],
    }
}

pub fn big_lines(text: &str, style: Style) -> [Line<'static>; BIG_ROWS] {
    std::array::from_fn(|row| {
        let text: String = text
            .chars()
            .map(|character| cells(character, row))
            .collect();
        Line::from(Span::styled(text, style))
    })
}

/// A row of a character, and the space after it.
fn cells(character: char, row: usize) -> String {
    let dots = dots(character);
    let line = |at: usize| dots.get(at).copied().unwrap_or(0);
    let (upper, lower) = (line(2 * row), line(2 * row + 1));
    let columns = if character == '.' { 1..2 } else { 0..WIDTH };
    columns
        .map(|column| {
            let bit = 1 << (WIDTH - 1 - column);
            match (upper & bit != 0, lower & bit != 0) {
                (true, true) => '█',
                (true, false) => '▀',
                (false, true) => '▄',
                (false, false) => ' ',
            }
        })
        .chain([' '])
        .collect()
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
