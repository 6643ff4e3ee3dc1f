//! x
pub mod dac81416;
pub mod recording;
