//! The sensor board's logic, from ADC scans to λ: pure, no hardware, the same on the board and on a host.
//!
//! ```text
//! 4 kHz scans ─┬─> health
//!              └─> decimate ─┬─> noise ─> health
//!                            ├─> hum ──────────┬─> Touch ─> the configured estimator ──┬─> Estimate, 100 Hz
//! encoder ─────> travel ─────┼─> slip: x − F/k ┘    (spectrum, crossings, counting)    │
//!                            └─> bandpass ─> crossing ─> counting: the paper's, always ─┘
//! Motion ──────> arm ─> Drive
//! ```
//!
//! [`Sensor::step`] is the whole of it, once per millisecond.
//!
//! It needs `core` and no HAL. The package's default feature `board` is for its bin alone, which is the
//! Nucleo-F429ZI's program; other programs leave it out, as `tests/plain-board` does:
//!
//! ```toml
//! firmware-sensor = { path = "…", default-features = false }
//! ```
#![no_std]

pub mod adapted;
pub mod amplitude;
pub mod arm;
pub mod bandpass;
pub mod block;
pub mod capabilities;
pub mod counting;
pub mod crossing;
pub mod crossings;
pub mod decimate;
pub mod estimator;
pub mod float;
pub mod health;
pub mod hum;
pub mod landmarks;
pub mod line;
pub mod method;
pub mod noise;
pub mod normal_equations;
pub mod phasor;
pub mod sensor;
pub mod settings;
pub mod slip;
pub mod spectrum;
pub mod stroke;
pub mod texture;
pub mod travel;
mod vibration;

pub use arm::Drive;
pub use sensor::{Output, Sensor};
pub use settings::Settings;

use protocol::CHANNELS;

/// ADC scans per second.
pub const SCAN_RATE_HZ: u32 = 4_000;
/// Samples per second behind the anti-aliasing filter, the paper's rate.
pub const SAMPLE_RATE_HZ: u32 = 1_000;
/// ADC scans that make one sample.
pub const SCANS_PER_SAMPLE: usize = (SCAN_RATE_HZ / SAMPLE_RATE_HZ) as usize;
/// Estimates per second, the paper's rate.
pub const ESTIMATE_RATE_HZ: u32 = 100;
/// Travel of the arm per encoder count, in µm.
pub const MICROMETRES_PER_COUNT: i32 = 5;
/// The ADC code of a gauge at rest.
pub const MID_RAIL_CODE: u16 = 2_048;

/// The ADC codes of one scan, 0 to 4 095: five gauges, then the tangential force.
pub type Scan = [u16; CHANNELS];

const _: () = assert!(SCAN_RATE_HZ.is_multiple_of(SAMPLE_RATE_HZ));
const _: () = assert!(SAMPLE_RATE_HZ.is_multiple_of(ESTIMATE_RATE_HZ));
// Delays and windows are counted in samples and named in ms.
const _: () = assert!(SAMPLE_RATE_HZ == 1_000);
