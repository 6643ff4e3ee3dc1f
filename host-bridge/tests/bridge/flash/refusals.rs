//! What the command says, needing no probe.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use protocol::{Hello, PROTOCOL_VERSION, Role, SCHEMA_HASH};

use super::elf::{Elf, FLASH, file, folder, program};

/// The flash's size in bytes.
const FLASH_BYTES: usize = 2 * 1024 * 1024;

fn flash(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_host-bridge"))
        .arg("flash")
        .args(arguments)
        // Neither this machine's benches nor its builds.
        .current_dir(folder())
        .env_remove("RIDGELINK_BENCH")
        .env("XDG_CONFIG_HOME", "/nonexistent")
        .output()
        .expect("the bridge runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The refusal of `path` for the sensor board: status 2, nothing on standard output, the file named, and
/// every one of `words` said.
fn refused(path: &Path, words: &[&str]) {
    let output = flash(&["sensor", "--dry-run", &path.display().to_string()]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(output.stdout.is_empty(), "{}", text(&output.stdout));
    assert!(said.contains(&path.display().to_string()), "{said}");
    for word in words {
        assert!(said.contains(word), "{word:?} is not in {said:?}");
    }
}

fn sensor(parts: Vec<(u32, Vec<u8>)>, name: &str) -> PathBuf {
    Elf::of(Role::Sensor).with_parts(parts).write(name)
}

#[test]
fn the_right_firmware_is_planned() {
    let path = Elf::of(Role::Sensor)
        .with_parts(vec![
            (FLASH, program(20_000)),
            (FLASH + 0x1_0000, vec![1; 100]),
        ])
        .write("right");
    let output = flash(&["sensor", "--dry-run", &path.display().to_string()]);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let sectors = ["sector 0", "sector 1", "sector 4"];
    for word in [
        "sensor 0.1.0 on STM32F429ZI",
        "20000 bytes",
        "20100 bytes",
        "21 pages",
        "1.0 %",
    ]
    .iter()
    .chain(&sectors)
    {
        assert!(said.contains(word), "{word:?} is not in {said:?}");
    }
    assert!(!said.contains("sector 2"), "{said}");
}

#[test]
fn the_plan_is_there_for_scripts() {
    let path = Elf::of(Role::Display).write("json");
    let output = flash(&[
        "display",
        "--dry-run",
        "--json",
        &path.display().to_string(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(report["flashed"], false);
    assert_eq!(report["plan"]["role"], "display");
    assert_eq!(report["plan"]["bytes"], 1024);
    assert_eq!(report["plan"]["sectors"][0]["bytes"], 16 * 1024);
    assert_eq!(report["plan"]["schema"], format!("{SCHEMA_HASH:016x}"));
}

#[test]
fn the_firmware_is_the_benchs() {
    let elf = Elf::of(Role::Display).write("benchs");
    let bench = format!("[display]\nelf = {elf:?}\n");
    let bench = file("bench.toml", bench.as_bytes());
    let output = flash(&[
        "display",
        "--dry-run",
        "--bench",
        &bench.display().to_string(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}

#[test]
fn the_other_boards_firmware_is_refused() {
    let path = Elf::of(Role::Display).write("display");
    refused(
        &path,
        &["the display board's", "the sensor board", "flash display"],
    );
}

#[test]
fn a_firmware_for_another_chip_is_refused() {
    let path = Elf::saying(&Hello::new(Role::Sensor, "STM32F407VG", [0, 1, 0])).write("f407");
    refused(&path, &["STM32F407VG", "STM32F429ZI"]);
}

#[test]
fn a_firmware_of_another_protocol_is_refused() {
    let hello = Hello {
        protocol: (PROTOCOL_VERSION - 1).to_le_bytes(),
        ..Hello::new(Role::Sensor, "STM32F429ZI", [0, 1, 0])
    };
    let path = Elf::saying(&hello).write("old");
    let spoken = format!("protocol {}", PROTOCOL_VERSION - 1);
    refused(&path, &[&spoken, "from the same sources"]);
}

#[test]
fn a_firmware_of_another_schema_is_refused() {
    let hello = Hello {
        schema: (!SCHEMA_HASH).to_le_bytes(),
        ..Hello::new(Role::Sensor, "STM32F429ZI", [0, 1, 0])
    };
    let path = Elf::saying(&hello).write("foreign");
    refused(
        &path,
        &[&format!("{:016x}", !SCHEMA_HASH), "from the same sources"],
    );
}

#[test]
fn an_elf_that_does_not_say_who_it_is_is_refused() {
    let nameless = Elf {
        identity: None,
        ..Elf::of(Role::Sensor)
    };
    refused(&nameless.write("nameless"), &[".ridgelink"]);
    let strange = Elf {
        identity: Some(vec![0; 35]),
        ..nameless
    };
    refused(&strange.write("strange"), &[".ridgelink"]);
}

#[test]
fn a_program_for_another_processor_is_refused() {
    let path = Elf {
        machine: 243,
        ..Elf::of(Role::Sensor)
    }
    .write("riscv");
    refused(&path, &["another kind of processor"]);
    refused(
        Path::new(env!("CARGO_BIN_EXE_host-bridge")),
        &["no firmware's ELF"],
    );
}

#[test]
fn a_firmware_fills_the_flash_to_its_last_byte_and_no_further() {
    let full = sensor(vec![(FLASH, program(FLASH_BYTES))], "full");
    let output = flash(&["sensor", "--dry-run", &full.display().to_string()]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("100.0 %"));
    let more = sensor(vec![(FLASH, program(FLASH_BYTES + 1))], "too-large");
    refused(
        &more,
        &["too large", "0x08200001", "0x08200000", "--release"],
    );
}

#[test]
fn what_would_go_elsewhere_than_into_the_flash_is_refused() {
    let begun = |address: u32| vec![(FLASH, program(1024)), (address, vec![0; 16])];
    refused(
        &sensor(begun(0x2000_0000), "ram"),
        &["0x20000000", "RAM", ".part"],
    );
    refused(&sensor(begun(0x1FFF_7800), "otp"), &["0x1fff7800", "OTP"]);
    refused(
        &sensor(begun(0x4000_0000), "nowhere"),
        &["0x40000000", "nothing that the chip has"],
    );
    refused(
        &sensor(vec![(0x0820_0000, program(64))], "behind"),
        &["0x08200000"],
    );
}

#[test]
fn parts_that_want_the_same_place_are_refused() {
    let parts = vec![(FLASH, program(1024)), (FLASH + 1000, vec![0; 100])];
    refused(
        &sensor(parts, "overlap"),
        &["0x080003e8", "two of its parts"],
    );
}

#[test]
fn what_the_chip_would_not_start_is_refused() {
    refused(
        &sensor(Vec::new(), "empty-elf"),
        &["nothing that goes into the flash"],
    );
    let late = sensor(vec![(FLASH + 0x4000, program(1024))], "late");
    refused(&late, &["begins at 0x08004000"]);
    let mut program = program(1024);
    program[..4].copy_from_slice(&[0xFF; 4]);
    refused(
        &sensor(vec![(FLASH, program.clone())], "stackless"),
        &["stack is at 0xffffffff"],
    );
    program[..4].copy_from_slice(&0x2003_0000u32.to_le_bytes());
    program[4..8].copy_from_slice(&FLASH.to_le_bytes());
    refused(
        &sensor(vec![(FLASH, program)], "arm"),
        &["reset vector is 0x08000000"],
    );
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    let whole = Elf::of(Role::Sensor).to_bytes();
    for parts in 0..16 {
        refused(
            &file(&format!("cut-{parts}"), &whole[..whole.len() * parts / 16]),
            &[],
        );
    }
    let wanted = format!("{} of its {} bytes", whole.len() - 1, whole.len());
    refused(
        &file("cut-by-a-byte", &whole[..whole.len() - 1]),
        &[&wanted],
    );
}

#[test]
fn a_text_a_folder_and_a_missing_file_are_refused() {
    refused(
        &file("text", b"It was a dark and stormy night.\n"),
        &["is no firmware's ELF"],
    );
    refused(&file("empty", b""), &["is no firmware's ELF"]);
    refused(&folder(), &["can't be read"]);
    let command = "cargo build --release --target thumbv7em-none-eabihf -p firmware-sensor";
    refused(&folder().join("missing"), &["can't be read", command]);
}

#[test]
fn without_an_elf_the_builds_is_wanted() {
    let output = flash(&["display", "--dry-run"]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("target/thumbv7em-none-eabihf/release/firmware-display"),
        "{said}"
    );
}

#[test]
fn an_unknown_board_or_probe_is_refused_by_name() {
    for (arguments, word) in [
        (&["gripper"][..], "sensor, display"),
        (&["sensor", "--probe", "nonsense"], "0483:374b:066CFF"),
        (&["sensor", "--dry"], "--dry-run"),
    ] {
        let output = flash(arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(word), "{word:?} is not in {said:?}");
    }
}

#[test]
fn a_probe_that_is_not_there_is_refused() {
    let path = Elf::of(Role::Sensor)
        .write("probeless")
        .display()
        .to_string();
    // No probe of any maker has this identity.
    let output = flash(&["sensor", "--probe", "ffff:ffff:none", &path]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("probe"), "{said}");
}
