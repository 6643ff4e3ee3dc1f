//! Colours: few, of a middle brightness that is legible on light and on dark, and none if told so.

use protocol::Role;
use ratatui::style::{Color, Modifier, Style};

/// Voltages from 0 to the largest: from grey over violet to orange.
const RISING: [u8; 8] = [240, 54, 90, 126, 161, 203, 209, 214];
/// From the lowest voltage to the highest: blue, grey at 0 V, red.
const SIGNED: [u8; 9] = [39, 33, 26, 24, 240, 88, 124, 160, 203];

/// The colours of a dashboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Theme {
    has_colour: bool,
}

impl Theme {
    /// With colours.
    pub const COLOUR: Self = Self { has_colour: true };
    /// Without: what matters is bold or reversed, and told in words in any case.
    pub const PLAIN: Self = Self { has_colour: false };

    /// As the environment asks for: no colours if `NO_COLOR` is set to anything.
    pub fn of_environment() -> Self {
        let is_asked = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        if is_asked { Self::PLAIN } else { Self::COLOUR }
    }

    /// Whether there are colours.
    pub const fn has_colour(self) -> bool {
        self.has_colour
    }

    const fn colour(self, index: u8, otherwise: Modifier) -> Style {
        if self.has_colour {
            Style::new().fg(Color::Indexed(index))
        } else {
            Style::new().add_modifier(otherwise)
        }
    }

    /// What is all right.
    pub const fn good(self) -> Style {
        self.colour(35, Modifier::empty())
    }

    /// What a person may want to look at.
    pub const fn warning(self) -> Style {
        self.colour(172, Modifier::BOLD)
    }

    /// What is wrong.
    pub const fn bad(self) -> Style {
        self.colour(167, Modifier::BOLD)
    }

    /// What must not be overlooked.
    pub const fn alarm(self) -> Style {
        let style = Style::new().add_modifier(Modifier::BOLD);
        if self.has_colour {
            style.fg(Color::Indexed(231)).bg(Color::Indexed(160))
        } else {
            style.add_modifier(Modifier::REVERSED)
        }
    }

    /// Names, units, lines.
    pub const fn quiet(self) -> Style {
        self.colour(244, Modifier::DIM)
    }

    /// Numbers that matter.
    pub const fn strong(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    /// What comes from the sensor.
    pub const fn sensor(self) -> Style {
        self.colour(37, Modifier::empty())
    }

    /// What comes from the display.
    pub const fn display(self) -> Style {
        self.colour(170, Modifier::empty())
    }

    /// What comes from the board of `role`.
    pub const fn of(self, role: Role) -> Style {
        match role {
            Role::Sensor => self.sensor(),
            Role::Display | Role::Host => self.display(),
        }
    }

    /// What is chosen.
    pub const fn chosen(self) -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    /// A place at this part, 0 to 1, of the largest voltage.
    pub fn rising(self, part: f32) -> Style {
        self.step(&RISING, part)
    }

    /// A place at this part, −1 to 1, of the largest voltage.
    pub fn signed(self, part: f32) -> Style {
        self.step(&SIGNED, (part + 1.0) / 2.0)
    }

    fn step(self, steps: &[u8], part: f32) -> Style {
        let last = steps.len() - 1;
        // What is no number is cast to 0.
        let step = (part.clamp(0.0, 1.0) * last as f32).round() as usize;
        self.colour(steps[step.min(last)], Modifier::empty())
    }
}
