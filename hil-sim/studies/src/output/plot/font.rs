//! How text looks and how much room it takes.
//!
//! A viewer draws `sans-serif` in a font of its own. Widths are those of DejaVu Sans, which is among the widest,
//! and [`SPARE`] of it is kept free.

use crate::output::plot::palette::{Colour, INK, SOFT};

/// Room for text, in its widths in DejaVu Sans.
pub const SPARE: f64 = 1.15;

/// Units of the widths below to an em.
const EM: f64 = 2_048.0;
/// Advance widths of DejaVu Sans, from space to tilde.
const REGULAR: [u16; 95] = [
    651, 821, 942, 1716, 1303, 1946, 1597, 563, 799, 799, 1024, 1716, 651, 739, 651, 690, 1303,
    1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 690, 690, 1716, 1716, 1716, 1087, 2048,
    1401, 1405, 1430, 1577, 1294, 1178, 1587, 1540, 604, 604, 1343, 1141, 1767, 1532, 1612, 1235,
    1612, 1423, 1300, 1251, 1499, 1401, 2025, 1403, 1251, 1403, 799, 690, 799, 1716, 1024, 1024,
    1255, 1300, 1126, 1300, 1260, 721, 1300, 1298, 569, 569, 1186, 569, 1995, 1298, 1253, 1300,
    1300, 842, 1067, 803, 1298, 1212, 1675, 1212, 1212, 1075, 1303, 690, 1303, 1716,
];
/// The same of DejaVu Sans Bold.
const BOLD: [u16; 95] = [
    713, 934, 1067, 1716, 1425, 2052, 1786, 627, 936, 936, 1071, 1716, 778, 850, 778, 748, 1425,
    1425, 1425, 1425, 1425, 1425, 1425, 1425, 1425, 1425, 819, 819, 1716, 1716, 1716, 1188, 2048,
    1585, 1561, 1503, 1700, 1399, 1399, 1681, 1714, 762, 762, 1587, 1305, 2038, 1714, 1741, 1501,
    1741, 1577, 1475, 1397, 1663, 1585, 2259, 1579, 1483, 1485, 936, 748, 936, 1716, 1024, 1024,
    1382, 1466, 1214, 1466, 1389, 891, 1466, 1458, 702, 702, 1362, 702, 2134, 1458, 1407, 1466,
    1466, 1010, 1219, 979, 1458, 1335, 1892, 1321, 1335, 1192, 1458, 748, 1458, 1716,
];
/// Other characters, with both widths.
const OTHERS: [(char, u16, u16); 37] = [
    ('°', 1024, 1024),
    ('±', 1716, 1716),
    ('²', 821, 897),
    ('³', 821, 897),
    ('·', 651, 778),
    ('¹', 821, 897),
    ('½', 1985, 2120),
    ('×', 1716, 1716),
    ('é', 1260, 1389),
    ('µ', 1303, 1507),
    ('Δ', 1401, 1585),
    ('Σ', 1294, 1399),
    ('α', 1350, 1407),
    ('θ', 1253, 1407),
    ('λ', 1212, 1296),
    ('π', 1233, 1620),
    ('σ', 1298, 1595),
    ('φ', 1351, 1602),
    ('χ', 1183, 1321),
    ('–', 1024, 1024),
    ('’', 651, 778),
    ('“', 1061, 1346),
    ('”', 1061, 1346),
    ('…', 2048, 2048),
    ('⁰', 821, 897),
    ('⁴', 821, 897),
    ('⁵', 821, 897),
    ('⁶', 821, 897),
    ('⁷', 821, 897),
    ('⁸', 821, 897),
    ('⁹', 821, 897),
    ('→', 1716, 1716),
    ('−', 1716, 1716),
    ('√', 1305, 1366),
    ('≈', 1716, 1716),
    ('≤', 1716, 1716),
    ('≥', 1716, 1716),
];

/// Which point of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    /// As SVG's `text-anchor` has it, and how much of a text's width lies before its place.
    pub const fn told(self) -> (&'static str, f64) {
        match self {
            Anchor::Start => ("start", 0.0),
            Anchor::Middle => ("middle", 0.5),
            Anchor::End => ("end", 1.0),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Font {
    /// Height of a line without leading, in the picture's units.
    pub size: f64,
    pub bold: bool,
    pub italic: bool,
    pub colour: Colour,
    pub anchor: Anchor,
}

impl Font {
    /// Plain text of a size, in ink.
    pub const fn new(size: f64) -> Self {
        Self {
            size,
            bold: false,
            italic: false,
            colour: INK,
            anchor: Anchor::Start,
        }
    }

    pub const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub const fn italic(self) -> Self {
        Self {
            italic: true,
            ..self
        }
    }

    /// The same in the grey of what is said beside the data.
    pub const fn soft(self) -> Self {
        self.coloured(SOFT)
    }

    pub const fn coloured(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }

    /// The same with another point of it at its place.
    pub const fn at(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The room that one line of it takes, [`SPARE`] included.
    pub fn width(&self, words: &str) -> f64 {
        let units: f64 = words.chars().map(|one| advance(one, self.bold)).sum();
        SPARE * self.size * units / EM
    }

    /// The text in lines that each fit into a room, as far as its words do.
    pub fn wrap(&self, words: &str, room: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in words.split_ascii_whitespace() {
            if let Some(line) = lines.last_mut() {
                let longer = format!("{line} {word}");
                if self.width(&longer) <= room {
                    *line = longer;
                    continue;
                }
            }
            lines.push(word.to_owned());
        }
        lines
    }
}

/// The advance width of a character; that of an em for one that is not in the tables.
fn advance(one: char, bold: bool) -> f64 {
    let ascii = if bold { &BOLD } else { &REGULAR };
    let known = (one as usize)
        .checked_sub(' ' as usize)
        .and_then(|at| ascii.get(at));
    let other = || {
        let of_char = OTHERS.iter().find(|other| other.0 == one)?;
        Some(if bold { of_char.2 } else { of_char.1 })
    };
    known.copied().or_else(other).map_or(EM, f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_as_wide_as_its_letters_and_a_seventh() {
        // DejaVu Sans: m 1995, λ 1212 of 2048.
        let width = Font::new(20.48).width("mλ");
        assert!(
            (width - 1.15 * 0.01 * (1995.0 + 1212.0)).abs() < 1e-9,
            "{width}"
        );
        assert!(Font::new(11.0).bold().width("error") > Font::new(11.0).width("error"));
        // Unknown: an em.
        assert!((Font::new(10.0).width("文") - 11.5).abs() < 1e-9);
    }

    #[test]
    fn text_is_broken_between_words_into_lines_that_fit() {
        let font = Font::new(12.0);
        let words = "error to the reference over speed on one core";
        let lines = font.wrap(words, 120.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| font.width(line) <= 120.0));
        assert_eq!(lines.join(" "), words);
        // A word wider than the room stands alone.
        assert_eq!(font.wrap("a incomprehensibilities b", 30.0).len(), 3);
    }
}
