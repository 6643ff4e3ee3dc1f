//! The tool at the operator's desk. See the library for what it is made of.

use std::process::ExitCode;

fn main() -> ExitCode {
    host_bridge::run()
}
