//! The ELFs under test.

use std::env;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use hil_sim_boards::{Firmware, FirmwareError, Firmwares};
use protocol::Role;

/// Names another folder to take the ELFs from.
const FOLDER_VARIABLE: &str = "RIDGELINK_ELVES";
/// Where cargo puts them, from the workspace on.
const BUILT: &str = "target/thumbv7em-none-eabihf/release";

/// Where the ELF of a board is, whether it has been built or not.
pub fn path(role: Role) -> PathBuf {
    folder().join(format!("firmware-{}", role.name()))
}

/// Where a program of `tests/plain-board` is, for the boards' core.
pub fn plain(name: &str) -> PathBuf {
    let built = "../target/plain-board/thumbv7em-none-eabihf/debug";
    Path::new(env!("CARGO_MANIFEST_DIR")).join(built).join(name)
}

/// Where the ELF of an example of the sensor's is.
pub fn example(name: &str) -> PathBuf {
    folder().join("examples").join(name)
}

/// Where a program of tests for a board is: its package, and its own name.
pub fn on_target(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../target/on-target")
        .join(name)
}

fn folder() -> PathBuf {
    env::var_os(FOLDER_VARIABLE).map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(BUILT),
        PathBuf::from,
    )
}

/// Both ELFs, read and checked once.
///
/// # Panics
/// If one of them can't be used: the message says what to do.
pub fn both() -> &'static Firmwares {
    static BOTH: LazyLock<Firmwares> = LazyLock::new(|| Firmwares {
        sensor: read(Role::Sensor),
        display: read(Role::Display),
    });
    &BOTH
}

fn read(role: Role) -> Firmware {
    Firmware::read(&path(role), role).unwrap_or_else(|error| panic!("{}", advice(&error)))
}

fn advice(error: &FirmwareError) -> String {
    format!(
        "{error}\nThese tests run the firmware as it is flashed. Run ./test, which builds it, or \
         `cargo build --release --target thumbv7em-none-eabihf -p firmware-sensor -p firmware-display`, \
         or name the folder that holds both ELFs in {FOLDER_VARIABLE}."
    )
}
