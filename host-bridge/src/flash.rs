//! A firmware on its way into a board.
//!
//! ```text
//! ELF ─> firmware ─> plan ────────────┐
//!                                     ├─> programmer ─> console: Hello
//! probes, bench ─> the one to be used ┘
//! ```
//!
//! Everything that can be refused is refused before the programmer erases anything: what the ELF is and
//! where it goes by [`firmware`] and [`plan`], which need no probe, and what the chip is by
//! [`programmer`], which asks it first.

pub mod console;
pub mod firmware;
pub mod plan;
pub(crate) mod probes;
pub mod programmer;
