//! The report's colours, each for light and for dark surroundings.

use std::fmt::Write;

use plotters::style::RGBColor;

/// A colour by its role: drawn as `light`, shown as `dark` where the reader prefers that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour {
    /// The style sheet's variable.
    pub name: &'static str,
    light: (u8, u8, u8),
    dark: (u8, u8, u8),
}

/// Text and axes.
pub const INK: Colour = Colour {
    name: "ink",
    light: (0x24, 0x29, 0x30),
    dark: (0xdd, 0xe1, 0xe6),
};
/// Grid lines.
pub const GRID: Colour = Colour {
    name: "grid",
    light: (0xe3, 0xe6, 0xea),
    dark: (0x33, 0x39, 0x41),
};
/// The main thing measured.
pub const FIRST: Colour = Colour {
    name: "first",
    light: (0x1f, 0x6f, 0xc9),
    dark: (0x62, 0xa8, 0xf5),
};
/// The truth, or the second thing.
pub const SECOND: Colour = Colour {
    name: "second",
    light: (0x15, 0x84, 0x66),
    dark: (0x43, 0xc5, 0x9c),
};
/// What is not to be used.
pub const REFUSED: Colour = Colour {
    name: "refused",
    light: (0xc8, 0x4a, 0x1f),
    dark: (0xf2, 0x8c, 0x5a),
};
/// What stands beside the main thing, for comparison.
pub const QUIET: Colour = Colour {
    name: "quiet",
    light: (0x98, 0xa1, 0xab),
    dark: (0x76, 0x80, 0x8b),
};
/// A stretch of time set off from the rest.
pub const SHADE: Colour = Colour {
    name: "shade",
    light: (0xf5, 0xe6, 0xbe),
    dark: (0x4a, 0x40, 0x22),
};

const ALL: [Colour; 7] = [INK, GRID, FIRST, SECOND, REFUSED, QUIET, SHADE];

impl Colour {
    /// The colour as plots are drawn in.
    pub fn drawn(self) -> RGBColor {
        let (red, green, blue) = self.light;
        RGBColor(red, green, blue)
    }
}

/// The style rules that give every colour its variable, and a plot's drawn colours theirs.
pub fn style_rules() -> String {
    let hex = |(red, green, blue): (u8, u8, u8)| format!("#{red:02X}{green:02X}{blue:02X}");
    let variables = |choose: fn(&Colour) -> (u8, u8, u8)| {
        ALL.iter().fold(String::new(), |mut rules, colour| {
            let _ = write!(rules, "--{}:{};", colour.name, hex(choose(colour)));
            rules
        })
    };
    let mut rules = format!(
        ":root{{{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n",
        variables(|colour| colour.light),
        variables(|colour| colour.dark),
    );
    for colour in ALL {
        let (drawn, name) = (hex(colour.light), colour.name);
        let _ = writeln!(rules, "svg [fill=\"{drawn}\"]{{fill:var(--{name})}}");
        let _ = writeln!(rules, "svg [stroke=\"{drawn}\"]{{stroke:var(--{name})}}");
    }
    rules
}
