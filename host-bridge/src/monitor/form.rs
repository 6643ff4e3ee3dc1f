//! The form in which a person changes a setting.

use protocol::{Configuration, Role};

use super::settings::{self, Kind, Setting};

/// Most characters of a value.
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
