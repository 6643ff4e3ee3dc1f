//! Numbers three rows high, of half blocks.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

/// Rows of a number.
pub const ROWS: usize = 3;
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

/// A number, in three lines.
pub fn lines(text: &str, style: Style) -> [Line<'static>; ROWS] {
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
