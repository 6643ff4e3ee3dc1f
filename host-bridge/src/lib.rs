//! Ridgelink at the operator's desk: boards found, watched, recorded, played back and carried over networks.
//!
//! ```text
//! bench file, --sensor, --display ─> place ─> link ─> monitor, record, relay, doctor
//! ```
//!
//! Nothing is estimated here: what the boards say is shown, kept and carried.

pub use cli::{Desk, run, run_at};

const PROGRAM: &str = concat!("host-bridge ", env!("CARGO_PKG_VERSION"));

pub mod bench;
mod bringup;
mod cli;
pub mod clock;
pub mod doctor;
mod engine;
pub mod export;
pub mod flash;
mod hand;
mod line;
mod line_monitor;
pub mod link;
mod live;
pub mod lock;
pub mod monitor;
mod output_file;
pub mod place;
pub mod recording;
pub mod relay;
pub mod replay;
mod search;
mod serial;
mod shared_port;
pub mod state;
pub mod system;
