//! The command `hil-sim`, as a user runs it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{env, fs};

use protocol::Role;

mod ci;
mod display;
mod elf;
mod faults;
mod jury;
mod map;
mod paper;
mod people;
mod run;
mod serve;

/// A folder of a test's own, empty.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::remove_dir_all(&folder).ok();
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Where cargo, or the folder named in RIDGELINK_ELVES, has the ELF of a board.
fn elf(role: Role) -> PathBuf {
    let folder = env::var_os("RIDGELINK_ELVES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/thumbv7em-none-eabihf/release"),
        PathBuf::from,
    );
    folder.join(format!("firmware-{}", role.name()))
}

/// `hil-sim` in a folder, as if it were in nobody's CI.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-sim"));
    command.current_dir(folder).args(arguments);
    command.env_remove("GITHUB_ACTIONS");
    command
}

/// Runs it.
fn hil_sim(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Runs it where it may write.
fn hil_sim_anywhere(arguments: &[&str]) -> Output {
    hil_sim(Path::new(env!("CARGO_TARGET_TMPDIR")), arguments)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn errors(output: &Output) -> String {
    text(&output.stderr)
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Exit status, standard output, standard error.
fn told(output: Output) -> (Option<i32>, String, String) {
    (output.status.code(), text(&output.stdout), errors(&output))
}
