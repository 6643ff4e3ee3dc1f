//! `hil-sim size`.

use std::process::ExitCode;

use hil_sim_studies::study::Table;
use object::{Object, ObjectSection, SectionKind};

use super::Elves;
use super::say::say;

const FLASH: std::ops::Range<u64> = 0x0800_0000..0x0820_0000;
const RAM: std::ops::Range<u64> = 0x2000_0000..0x2003_0000;

/// What an ELF takes, in bytes.
#[derive(Debug, Default, PartialEq, Eq)]
struct Footprint {
    /// Code, constants and the initial values of variables.
    flash: u64,
    /// Variables; the stack has what is left.
    ram: u64,
}

pub(super) fn execute(elves: &Elves) -> anyhow::Result<ExitCode> {
    let firmwares = elves.read()?;
    let flash_total = FLASH.end - FLASH.start;
    let ram_total = RAM.end - RAM.start;
    let mut table = Table::new(&[
        "ELF",
        "flash, bytes:",
        "of 2 MiB:",
        "static RAM, bytes:",
        "of 192 KiB:",
    ]);
    for (name, firmware) in [
        ("firmware-sensor", &firmwares.sensor),
        ("firmware-display", &firmwares.display),
    ] {
        let Footprint { flash, ram } = footprint(&object::File::parse(&*firmware.elf)?);
        let share = |bytes: u64, of: u64| format!("{:.1} %", 100.0 * bytes as f64 / of as f64);
        table.row([
            name.to_owned(),
            flash.to_string(),
            share(flash, flash_total),
            ram.to_string(),
            share(ram, ram_total),
        ]);
    }
    say!("{table}");
    Ok(ExitCode::SUCCESS)
}

fn footprint(file: &object::File<'_>) -> Footprint {
    let mut footprint = Footprint::default();
    // Sections for tools only (symbols, defmt's strings) have no address in either memory.
    for section in file.sections() {
        let variable = RAM.contains(&section.address());
        let stored = !matches!(section.kind(), SectionKind::UninitializedData);
        if variable {
            footprint.ram += section.size();
        }
        if stored && (variable || FLASH.contains(&section.address())) {
            footprint.flash += section.size();
        }
    }
    footprint
}
