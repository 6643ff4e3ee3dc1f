//! The colours of reports and pictures. A report's are for light and for dark surroundings; a picture stands on
//! a ground of its own.

use std::fmt::Write;

/// A colour by its role: drawn as `light`, shown as `dark` where the reader prefers that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour {
    /// The style sheet's variable.
    pub name: &'static str,
    /// As drawn, `#rrggbb`.
    pub light: &'static str,
    dark: &'static str,
}

impl Colour {
    /// A colour of pictures, which have no dark surroundings.
    const fn of_pictures(light: &'static str) -> Self {
        Self {
            name: "",
            light,
            dark: light,
        }
    }
}

/// What things are drawn on.
pub const PAPER: Colour = Colour {
    name: "card",
    light: "#ffffff",
    dark: "#1c2026",
};
/// What is said beside the data.
pub const SOFT: Colour = Colour {
    name: "soft",
    light: "#59636e",
    dark: "#9aa4af",
};
/// Text and axes.
pub const INK: Colour = Colour {
    name: "ink",
    light: "#242930",
    dark: "#dde1e6",
};
/// Grid lines.
pub const GRID: Colour = Colour {
    name: "grid",
    light: "#e3e6ea",
    dark: "#333941",
};
/// The main thing measured.
pub const FIRST: Colour = Colour {
    name: "first",
    light: "#1f6fc9",
    dark: "#62a8f5",
};
/// The truth, or the second thing.
pub const SECOND: Colour = Colour {
    name: "second",
    light: "#158466",
    dark: "#43c59c",
};
/// What is not to be used.
pub const REFUSED: Colour = Colour {
    name: "refused",
    light: "#c84a1f",
    dark: "#f28c5a",
};
/// What stands beside the main thing, for comparison.
pub const QUIET: Colour = Colour {
    name: "quiet",
    light: "#98a1ab",
    dark: "#76808b",
};
/// A stretch of time set off from the rest.
pub const SHADE: Colour = Colour {
    name: "shade",
    light: "#f5e6be",
    dark: "#4a4022",
};

const THEMED: [Colour; 9] = [PAPER, SOFT, INK, GRID, FIRST, SECOND, REFUSED, QUIET, SHADE];

// Okabe and Ito's colours, which the colour-blind tell apart, for what a picture compares.
/// Blue.
pub const BLUE: Colour = Colour::of_pictures("#0072b2");
/// Vermilion.
pub const VERMILION: Colour = Colour::of_pictures("#d55e00");
/// Green.
pub const GREEN: Colour = Colour::of_pictures("#009e73");
/// Purple.
pub const PURPLE: Colour = Colour::of_pictures("#cc79a7");
/// Orange.
pub const ORANGE: Colour = Colour::of_pictures("#e69f00");
/// Light blue.
pub const SKY: Colour = Colour::of_pictures("#56b4e9");
/// Black.
pub const BLACK: Colour = Colour::of_pictures("#000000");
// Where eight are not enough.
/// Violet.
pub const VIOLET: Colour = Colour::of_pictures("#8250df");
/// Dark yellow.
pub const OCHRE: Colour = Colour::of_pictures("#b58900");
/// Brown.
pub const BROWN: Colour = Colour::of_pictures("#b35900");
/// Grey, for what is no longer or says nothing.
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
