//! How a dashboard is looked at: what the keys change without the boards' knowing, and the form in which a person changes
//! a setting.

use protocol::{Configuration, Role};

use super::settings::{self, Kind, Setting};
use super::theme::Theme;

/// The spans that can be looked back on, in s.
pub const SPANS_S: [f32; 5] = [1.0, 2.0, 5.0, 10.0, 25.0];

/// What the lower part shows where there is no room for all of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Panel {
    /// The gauges' traces and health.
    #[default]
    Gauges,
    /// The counters of every port.
    Ports,
    /// What is known of the boards themselves.
    Boards,
    /// What has happened, and the boards' logs.
    Log,
}

impl Panel {
    /// The one after this.
    pub const fn next(self) -> Self {
        match self {
            Self::Gauges => Self::Ports,
            Self::Ports => Self::Boards,
            Self::Boards => Self::Log,
            Self::Log => Self::Gauges,
        }
    }
}

/// A recording that is being made, as it is shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// The file's name.
    pub name: String,
    /// Since when, in µs of [`crate::clock::now_us`].
    pub since_us: u64,
    /// Bytes that are safe on the disk.
    pub safe_bytes: u64,
}

/// How a dashboard is looked at.
#[derive(Clone, Debug)]
pub struct View {
    /// Its colours.
    pub theme: Theme,
    /// Which of [`SPANS_S`] the traces show.
    pub span: usize,
    /// Whether the fingertip shows the voltages of the moment, not their peaks.
    pub shows_moment: bool,
    /// What the lower part shows.
    pub panel: Panel,
    /// Whether the keys are explained.
    pub shows_help: bool,
    /// The form for settings, while it is open.
    pub form: Option<Form>,
    /// Whether what is shown stands still.
    pub is_frozen: bool,
    /// Whether nothing more will come: a recording that was watched is over.
    pub is_over: bool,
    /// The recording that is being made.
    pub kept: Option<Kept>,
}

impl View {
    /// How it begins.
    pub const fn new(theme: Theme) -> Self {
        Self {
            theme,
            span: 3,
            shows_moment: false,
            panel: Panel::Gauges,
            shows_help: false,
            form: None,
            is_frozen: false,
            is_over: false,
            kept: None,
        }
    }

    /// The traces' span in s.
    pub fn span_s(&self) -> f32 {
        SPANS_S[self.span.min(SPANS_S.len() - 1)]
    }
}

const LONGEST: usize = 10;

/// Which setting is looked at, and what is being typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Form {
    /// The board.
    pub role: Role,
    chosen: usize,
    /// The new value, while one is being given.
    pub draft: Option<String>,
}

impl Form {
    /// The first setting of the board of `role`.
    pub const fn new(role: Role) -> Self {
        Self {
            role,
            chosen: 0,
            draft: None,
        }
    }

    /// The setting looked at.
    pub fn setting(&self) -> Option<&'static Setting> {
        settings::of(self.role).get(self.chosen)
    }

    /// The next setting, or the one before.
    pub fn step(&mut self, forward: bool) {
        let count = settings::of(self.role).len();
        self.draft = None;
        self.chosen = match (forward, self.chosen) {
            (true, chosen) if chosen + 1 < count => chosen + 1,
            (true, _) => 0,
            (false, 0) => count.saturating_sub(1),
            (false, chosen) => chosen - 1,
        };
    }

    /// The other board.
    pub fn turn(&mut self) {
        *self = Self::new(match self.role {
            Role::Sensor => Role::Display,
            _ => Role::Sensor,
        });
    }

    /// A digit was typed. Others are passed over: letters are keys of the monitor, a stop above all.
    pub fn type_digit(&mut self, digit: char) {
        let takes = self
            .setting()
            .is_some_and(|setting| matches!(setting.kind, Kind::Number | Kind::Gauges));
        if takes && digit.is_ascii_digit() {
            let draft = self.draft.get_or_insert_default();
            if draft.len() < LONGEST {
                draft.push(digit);
            }
        }
    }

    /// The last digit goes.
    pub fn erase(&mut self, configuration: Option<&Configuration>) {
        let Some(setting) = self.setting() else {
            return;
        };
        if matches!(setting.kind, Kind::Choice(_)) {
            return;
        }
        let draft = self.draft.get_or_insert_with(|| {
            configuration
                .and_then(|configuration| setting.value(configuration))
                .unwrap_or_default()
        });
        draft.pop();
    }

    /// The next word of a choice, or the one before.
    pub fn roll(&mut self, forward: bool, configuration: Option<&Configuration>) {
        let Some(setting) = self.setting() else {
            return;
        };
        let Kind::Choice(words) = setting.kind else {
            return;
        };
        let current = self.draft.clone().or_else(|| setting.value(configuration?));
        let place = words
            .iter()
            .position(|(word, _)| Some(*word) == current.as_deref())
            .unwrap_or(0);
        let step = if forward { 1 } else { words.len() - 1 };
        self.draft = Some(words[(place + step) % words.len()].0.to_owned());
    }
}
