//! Files that are not the firmware wanted are refused before anything runs, by a message that names
//! the file and says what to do.

use std::fs;
use std::path::{Path, PathBuf};

use hil_sim_boards::{Firmware, FirmwareError};
use protocol::{Hello, PROTOCOL_VERSION, Role};
use tests::elves;

/// A file of the test's own.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("identity");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// The sensor's ELF with another identity in it.
fn sensor_that_says(hello: [u8; protocol::HELLO_LENGTH]) -> Vec<u8> {
    let sensor = &elves::both().sensor;
    let said = sensor.hello.to_bytes();
    let mut elf = sensor.elf.clone();
    let mut changed = 0;
    for at in 0..=elf.len() - said.len() {
        if elf[at..].starts_with(&said) {
            elf[at..at + hello.len()].copy_from_slice(&hello);
            changed += 1;
        }
    }
    assert!(changed > 0, "the ELF does not hold its identity");
    elf
}

/// The refusal of `path` for the sensor board; its message names the file and holds every word of `says`.
fn refusal(path: &Path, says: &[&str]) -> FirmwareError {
    let error = Firmware::read(path, Role::Sensor).unwrap_err();
    let message = error.to_string();
    assert!(
        message.starts_with(&path.display().to_string()),
        "{message}"
    );
    for word in says {
        assert!(message.contains(word), "{word:?} is not in {message:?}");
    }
    error
}

#[test]
fn both_firmwares_say_who_they_are() {
    let both = elves::both();
    for (firmware, role) in [(&both.sensor, Role::Sensor), (&both.display, Role::Display)] {
        assert_eq!(firmware.hello.role, role.byte());
        assert_eq!(firmware.hello.chip_name(), "STM32F429ZI");
        assert!(firmware.hello.is_compatible());
    }
}

#[test]
fn a_file_that_is_missing_is_refused_with_the_command_that_makes_it() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-such-elf");
    let error = refusal(
        &path,
        &[
            "can't be read",
            "./test",
            "cargo build",
            "-p firmware-sensor",
        ],
    );
    assert!(matches!(error, FirmwareError::Missing { .. }), "{error:?}");
}

#[test]
fn a_file_that_is_no_elf_is_refused() {
    for (name, bytes) in [
        ("text", &b"It was a dark and stormy night.\n"[..]),
        ("empty", b""),
    ] {
        let error = refusal(
            &file(name, bytes),
            &["is no ELF file", "as the build left it"],
        );
        assert!(matches!(error, FirmwareError::NoElf { .. }), "{error:?}");
    }
}

#[test]
fn an_elf_that_is_cut_off_anywhere_is_refused() {
    let elf = &elves::both().sensor.elf;
    for parts in 0..16 {
        let path = file(&format!("cut-{parts}"), &elf[..elf.len() * parts / 16]);
        refusal(&path, &[]);
        fs::remove_file(path).unwrap();
    }
    refusal(&file("cut-by-a-byte", &elf[..elf.len() - 1]), &[]);
}

#[test]
fn the_other_boards_elf_is_refused() {
    let says = [
        "is the display board's firmware",
        "the sensor board's is wanted",
        "exchange",
    ];
    let error = refusal(&elves::path(Role::Display), &says);
    assert!(
        matches!(error, FirmwareError::WrongRole { .. }),
        "{error:?}"
    );
}

#[test]
fn an_elf_of_another_protocol_version_is_refused() {
    let hello = Hello {
        protocol: (PROTOCOL_VERSION + 1).to_le_bytes(),
        ..elves::both().sensor.hello
    };
    let path = file("other-version", &sensor_that_says(hello.to_bytes()));
    let other = format!("speaks protocol {}", PROTOCOL_VERSION + 1);
    let error = refusal(&path, &[&other, "build both from the same sources"]);
    assert!(
        matches!(error, FirmwareError::OtherProtocol { .. }),
        "{error:?}"
    );
}

#[test]
fn an_elf_of_another_schema_is_refused() {
    let sensor = &elves::both().sensor;
    let hello = Hello {
        schema: (!sensor.hello.schema_hash()).to_le_bytes(),
        ..sensor.hello
    };
    let path = file("other-schema", &sensor_that_says(hello.to_bytes()));
    let other = format!("{:016x}", !sensor.hello.schema_hash());
    let error = refusal(&path, &[&other, "build both from the same sources"]);
    assert!(
        matches!(error, FirmwareError::OtherProtocol { .. }),
        "{error:?}"
    );
}

#[test]
fn an_elf_that_does_not_say_who_it_is_is_refused() {
    let path = file("nameless", &sensor_that_says([0; protocol::HELLO_LENGTH]));
    let error = refusal(&path, &[".ridgelink", "no firmware of Ridgelink"]);
    assert!(
        matches!(error, FirmwareError::NoIdentity { .. }),
        "{error:?}"
    );
    // This program, say.
    let error = refusal(&std::env::current_exe().unwrap(), &[".ridgelink"]);
    assert!(
        matches!(error, FirmwareError::NoIdentity { .. }),
        "{error:?}"
    );
}
