//! What the boards say, watched: as a dashboard in a terminal, or line by line.
//!
//! ```text
//! links, or a recording ─> Source ─> Dashboard ─┬─> draw ─> terminal
//!                                       ^       └─> line ─> pipe, file
//!                    firmware_log ──────┘
//! ```
//!
//! The [`dashboard`] knows neither boards nor terminals: it is fed events, and says what is to be said.

pub mod board;
pub mod dashboard;
pub mod desk;
pub mod draw;
pub mod fingertip;
pub mod firmware_log;
pub mod form;
pub mod happening;
pub mod keys;
pub mod line;
pub mod orders;
pub mod plain;
pub mod screen;
pub mod settings;
pub mod theme;
pub mod trace;
pub mod view;
pub mod words;

pub use desk::{Keeper, Source};
