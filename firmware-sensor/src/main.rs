//! The sensor board's firmware.
fn main() {}
