//! The display board's firmware.
fn main() {}
