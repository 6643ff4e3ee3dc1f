//! The display board's logic: the hand's travel and the surface's λ in, fifty DAC words out.
//!
//! ```text
//! encoder ──> Hand ── travel ─────────────────────────┐
//! Estimate ─> Plausibility ── λ, amplitude ────────────┼─> Stimulus ─> Limits ─> words
//! Texture ──> Relief ── wave, friction ────────────────┤
//! Senses ───> Watch, Memory, Endurance ─> supervisor ──┴── gain       CLR
//! ```
//!
//! Pure: no hardware, no clock (time is counted in ticks), no allocation, no panic. What the board
//! runs, a host can replay word for word.
//!
//! It needs `core` and no HAL. The package's default feature `board` is for its bin alone, which is the
//! Nucleo-F429ZI's program; other programs leave it out, as `tests/plain-board` does:
//!
//! ```toml
//! firmware-display = { path = "…", default-features = false }
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

pub mod array;
pub mod balance;
pub mod capabilities;
pub mod dac81416;
pub mod display;
pub mod endurance;
pub mod fade;
pub mod flood;
pub mod gate;
pub mod grain;
pub mod hand;
pub mod level;
pub mod limits;
pub mod line;
pub mod look;
pub mod memory;
pub mod order;
pub mod pace;
pub mod pattern;
pub mod phase;
pub mod plausibility;
pub mod relief;
pub mod rest;
pub mod senses;
pub mod settings;
pub mod sine;
pub mod skin;
pub mod stimulus;
pub mod supervisor;
pub mod watch;
pub mod wave;

pub use display::Display;
pub use protocol::ACTUATORS;
pub use senses::{ConverterFault, Output, Readback, Senses, Transfer};
pub use settings::Settings;
pub use stimulus::Stimulus;

/// Output ticks per second: ten samples a cycle at 200 Hz.
pub const TICK_RATE_HZ: u32 = 2_000;
/// Rate of [`protocol::Motion`], in Hz.
pub const MOTION_RATE_HZ: u32 = 500;
/// Travel of the hand for one count of its encoder, in µm.
pub const MICROMETRES_PER_COUNT: i32 = 5;
/// The DAC word of 0 V.
pub const ZERO_VOLT: u16 = 0x8000;

/// Ticks of `rate` in `ms` milliseconds.
const fn ticks_at(rate: protocol::UpdateRate, ms: u16) -> u32 {
    const { assert!(protocol::UpdateRate::Hz2000.hz().is_multiple_of(1_000)) };
    const { assert!(protocol::UpdateRate::Hz4000.hz().is_multiple_of(1_000)) };
    ms as u32 * (rate.hz() / 1_000)
}
