//! The tool at the operator's desk. It has no commands yet; until it has, boards are flashed by cargo's
//! runner and watched by probe-rs (README, "On hardware").

fn main() -> std::process::ExitCode {
    eprintln!(
        "host-bridge has no commands in this version: flash a board with \
         `cargo run --release --target thumbv7em-none-eabihf -p firmware-sensor` (or firmware-display), \
         run the pair without hardware with ./demo"
    );
    std::process::ExitCode::from(2)
}
