//! `hil-sim size`.

use std::process::ExitCode;

use hil_sim_studies::study::{Record, Table, short};
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
    let mut rows = Vec::new();
    for (name, firmware) in [
        ("firmware-sensor", &firmwares.sensor),
        ("firmware-display", &firmwares.display),
    ] {
        let Footprint { flash, ram } = footprint(&object::File::parse(&*firmware.elf)?);
        let share = |bytes: u64, of: u64| format!("{:.1} %", 100.0 * bytes as f64 / of as f64);
        let row = Record::default()
            .with("ELF", name)
            .with("flash, bytes:", short(flash))
            .with("of 2 MiB:", share(flash, flash_total))
            .with("static RAM, bytes:", short(ram))
            .with("of 192 KiB:", share(ram, ram_total));
        rows.push(row);
    }
    say!("{}", Table::from_iter(rows));
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
