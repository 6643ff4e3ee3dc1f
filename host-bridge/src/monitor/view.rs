//! How a dashboard is looked at: what the keys change without the boards' knowing.

use super::form::Form;
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
    /// Since when, in µs of [`crate::host_clock::now_us`].
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
