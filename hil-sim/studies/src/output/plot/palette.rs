//! The colours of reports and pictures. A report's are for light and for dark surroundings; a picture stands on
//! a ground of its own.

use std::fmt::Write;

/// A colour by its role: drawn as `light`, shown as `dark` where the reader prefers that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour {
    pub name: &'static str,
    pub light: &'static str,
    dark: &'static str,
}

impl Colour {
    const fn themed(name: &'static str, light: &'static str, dark: &'static str) -> Self {
        Self { name, light, dark }
    }

    /// A colour of pictures, which have no dark surroundings.
    const fn of_pictures(light: &'static str) -> Self {
        Self::themed("", light, light)
    }
}

/// What things are drawn on.
pub const PAPER: Colour = Colour::themed("card", "#ffffff", "#1c2026");
/// What is said beside the data.
pub const SOFT: Colour = Colour::themed("soft", "#59636e", "#9aa4af");
/// Text and axes.
pub const INK: Colour = Colour::themed("ink", "#242930", "#dde1e6");
/// Grid lines.
pub const GRID: Colour = Colour::themed("grid", "#e3e6ea", "#333941");
/// The main thing measured.
pub const FIRST: Colour = Colour::themed("first", "#1f6fc9", "#62a8f5");
/// The truth, or the second thing.
pub const SECOND: Colour = Colour::themed("second", "#158466", "#43c59c");
/// What is not to be used.
pub const REFUSED: Colour = Colour::themed("refused", "#c84a1f", "#f28c5a");
/// What stands beside the main thing, for comparison.
pub const QUIET: Colour = Colour::themed("quiet", "#98a1ab", "#76808b");
/// A stretch of time set off from the rest.
pub const SHADE: Colour = Colour::themed("shade", "#f5e6be", "#4a4022");

const THEMED: [Colour; 9] = [PAPER, SOFT, INK, GRID, FIRST, SECOND, REFUSED, QUIET, SHADE];

// Okabe and Ito's colours, which the colour-blind tell apart, for what a picture compares.
pub const BLUE: Colour = Colour::of_pictures("#0072b2");
pub const VERMILION: Colour = Colour::of_pictures("#d55e00");
pub const GREEN: Colour = Colour::of_pictures("#009e73");
pub const PURPLE: Colour = Colour::of_pictures("#cc79a7");
pub const ORANGE: Colour = Colour::of_pictures("#e69f00");
pub const SKY: Colour = Colour::of_pictures("#56b4e9");
pub const BLACK: Colour = Colour::of_pictures("#000000");
// Where eight are not enough.
pub const VIOLET: Colour = Colour::of_pictures("#8250df");
pub const OCHRE: Colour = Colour::of_pictures("#b58900");
pub const BROWN: Colour = Colour::of_pictures("#b35900");
/// For what is no longer or says nothing.
pub const GREY: Colour = Colour::of_pictures("#8a939c");

/// The style rules that give every colour its variable, and a plot's drawn colours theirs.
pub fn style_rules() -> String {
    let variables = |choose: fn(&Colour) -> &'static str| {
        THEMED.iter().fold(String::new(), |mut rules, colour| {
            let _ = write!(rules, "--{}:{};", colour.name, choose(colour));
            rules
        })
    };
    let mut rules = format!(
        ":root{{{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n",
        variables(|colour| colour.light),
        variables(|colour| colour.dark),
    );
    for Colour { name, light, .. } in THEMED {
        let _ = writeln!(rules, "svg [fill=\"{light}\"]{{fill:var(--{name})}}");
        let _ = writeln!(rules, "svg [stroke=\"{light}\"]{{stroke:var(--{name})}}");
    }
    rules
}
