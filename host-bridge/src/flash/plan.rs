//! What a firmware would do to the flash, found out without a probe.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

use probe_rs::Target;
use probe_rs::config::{MemoryRegion, Registry, RegistryError};
use probe_rs::flashing::{FlashAlgorithm, FlashError, FlashLoader};
use serde::Serialize;
use serde_json::{Value, json};

use super::firmware::{Firmware, Segment};
use crate::state::{Named, version};

/// The chip of both boards, as their firmwares name it.
pub const CHIP: &str = "STM32F429ZI";
/// The same in its package, as probe-rs names it.
const PART: &str = "STM32F429ZITx";
/// Where the flash begins, and in it what the chip starts from: its stack's top and the reset vector.
pub const FLASH_START: u64 = 0x0800_0000;

/// Why a firmware can't go into the flash.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum PlanError {
    #[error(
        "{0}: is for the chip {1}, and Ridgelink's boards have an {CHIP}: build it for \
         thumbv7em-none-eabihf from these sources"
    )]
    OtherChip(PathBuf, String),
    #[error("{0}: has nothing that goes into the flash: give the file as the build left it")]
    Empty(PathBuf),
    #[error(
        "{path}: is too large: it ends at {end:#010x}, the flash of the {CHIP} at {flash_end:#010x}; \
         build it with --release"
    )]
    TooLarge {
        path: PathBuf,
        end: u64,
        flash_end: u64,
    },
    #[error(
        "{path}: its part of {bytes} bytes ({sections}) at {address:#010x} would go into {what}, not into the \
         flash: see the linker's memory.x"
    )]
    Outside {
        path: PathBuf,
        address: u64,
        bytes: usize,
        sections: String,
        what: &'static str,
    },
    #[error("{0}: two of its parts want the flash at {1:#010x}: see the linker's script")]
    Overlap(PathBuf, u64),
    #[error(
        "{0}: the chip would not start: at {FLASH_START:#010x} there must be a stack in RAM and a reset \
         vector into the flash, and {1}"
    )]
    NoVectors(PathBuf, String),
    #[error("probe-rs does not know {PART}: {0}")]
    Registry(#[from] RegistryError),
    #[error("probe-rs has no way to write the flash of {PART}: {0}")]
    Algorithm(#[from] FlashError),
    #[error("probe-rs knows no flash of {PART} at {FLASH_START:#010x}")]
    NoFlash,
}

/// A sector to be erased: the least that can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Sector {
    /// Its number in the flash, from 0.
    pub number: usize,
    /// Where it begins.
    pub address: u64,
    /// Its size in bytes.
    pub bytes: u64,
}

/// What would be done to the flash.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The firmware.
    pub firmware: Firmware,
    /// The chip, as probe-rs knows it.
    pub target: Target,
    /// The sectors that would be erased.
    pub sectors: Vec<Sector>,
    /// How many pages would be written.
    pub pages: usize,
    /// A page's size in bytes.
    pub page_bytes: u64,
    /// How many bytes the firmware has.
    pub bytes: u64,
    /// The chip's flash.
    pub flash: Range<u64>,
}

impl Plan {
    /// The plan for `firmware`. Fails if the firmware is for another chip, does not fit, would touch anything but
    /// the flash, or would not start.
    pub fn new(firmware: Firmware) -> Result<Self, PlanError> {
        let path = || firmware.path.clone();
        if !firmware.hello.chip_name().eq_ignore_ascii_case(CHIP) {
            return Err(PlanError::OtherChip(
                path(),
                firmware.hello.chip_name().to_owned(),
            ));
        }
        let target = Registry::from_builtin_families().get_target_by_name(PART)?;
        let algorithm = flash_algorithm(&target)?;
        let flash = algorithm.flash_properties.address_range.clone();
        if firmware.segments.is_empty() {
            return Err(PlanError::Empty(path()));
        }
        for segment in &firmware.segments {
            check_place(&firmware, segment, &flash, &target)?;
        }
        for pair in firmware.segments.windows(2) {
            if pair[1].address < pair[0].range().end {
                return Err(PlanError::Overlap(path(), pair[1].address));
            }
        }
        check_vectors(&firmware, &flash, &target)?;
        let touches = |start: u64, bytes: u64| {
            firmware.segments.iter().any(|segment| {
                let range = segment.range();
                range.start < start + bytes && start < range.end
            })
        };
        let sectors = algorithm
            .iter_sectors()
            .enumerate()
            .map(|(number, sector)| Sector {
                number,
                address: sector.base_address,
                bytes: sector.size,
            })
            .filter(|sector| touches(sector.address, sector.bytes))
            .collect();
        let pages = algorithm
            .iter_pages()
            .filter(|page| touches(page.base_address, u64::from(page.size)))
            .count();
        Ok(Self {
            sectors,
            pages,
            page_bytes: u64::from(algorithm.flash_properties.page_size),
            bytes: firmware
                .segments
                .iter()
                .map(|segment| segment.bytes.len() as u64)
                .sum(),
            flash,
            target,
            firmware,
        })
    }

    /// How much of the flash the firmware takes, in percent.
    pub fn share_percent(&self) -> f64 {
        100.0 * self.bytes as f64 / (self.flash.end - self.flash.start) as f64
    }

    /// The same for probe-rs, with all that goes into the flash. Fails if probe-rs sees what this plan did not.
    pub fn loader(&self) -> Result<FlashLoader, FlashError> {
        let mut loader = self.target.flash_loader();
        for segment in &self.firmware.segments {
            loader.add_data(segment.address, &segment.bytes)?;
        }
        Ok(loader)
    }

    /// The plan for scripts: what `--json` prints.
    pub fn summary(&self) -> Value {
        let hello = &self.firmware.hello;
        let segment = |segment: &Segment| {
            json!({
                "address": segment.address,
                "bytes": segment.bytes.len(),
                "sections": segment.sections,
            })
        };
        json!({
            "elf": self.firmware.path.display().to_string(),
            "role": self.firmware.role.name(),
            "version": version(hello),
            "chip": hello.chip_name(),
            "protocol": hello.protocol_version(),
            "schema": format!("{:016x}", hello.schema_hash()),
            "segments": self.firmware.segments.iter().map(segment).collect::<Value>(),
            // What is erased, and how many pages are written.
            "sectors": self.sectors,
            "pages": self.pages,
            "page_bytes": self.page_bytes,
            // Of the firmware, and of the chip's flash.
            "bytes": self.bytes,
            "flash_bytes": self.flash.end - self.flash.start,
            "share_percent": self.share_percent(),
        })
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hello = &self.firmware.hello;
        writeln!(
            f,
            "{}, protocol {}, schema {:016x}",
            Named(hello),
            hello.protocol_version(),
            hello.schema_hash()
        )?;
        for segment in &self.firmware.segments {
            writeln!(
                f,
                "  segment {:#010x}  {:>7} bytes  {}",
                segment.address,
                segment.bytes.len(),
                segment.sections.join(" ")
            )?;
        }
        for sector in &self.sectors {
            writeln!(
                f,
                "  erase   {:#010x}  {:>7} KiB    sector {}",
                sector.address,
                sector.bytes / 1024,
                sector.number
            )?;
        }
        writeln!(
            f,
            "  write   {} pages of {} bytes",
            self.pages, self.page_bytes
        )?;
        write!(
            f,
            "{} bytes, {:.1} % of the flash",
            self.bytes,
            self.share_percent()
        )
    }
}

/// How probe-rs works on the chip's flash.
fn flash_algorithm(target: &Target) -> Result<FlashAlgorithm, PlanError> {
    let raw = target
        .flash_algorithms
        .iter()
        .find(|raw| raw.default && raw.flash_properties.address_range.contains(&FLASH_START))
        .ok_or(PlanError::NoFlash)?;
    let core = &target.default_core().name;
    Ok(FlashAlgorithm::assemble_from_raw_with_core(
        raw, core, target,
    )?)
}

/// Whether `segment` goes into the flash, whole. probe-rs itself would also write to RAM, and to the
/// area that can be written once and never again.
fn check_place(
    firmware: &Firmware,
    segment: &Segment,
    flash: &Range<u64>,
    target: &Target,
) -> Result<(), PlanError> {
    let range = segment.range();
    if !flash.contains(&range.start) {
        return Err(PlanError::Outside {
            path: firmware.path.clone(),
            address: range.start,
            bytes: segment.bytes.len(),
            sections: segment.sections.join(" "),
            what: match target.memory_region_by_address(range.start) {
                Some(MemoryRegion::Ram(_)) => "RAM",
                Some(MemoryRegion::Nvm(_)) => {
                    "memory that is not for programs (OTP or option bytes)"
                }
                Some(MemoryRegion::Generic(_)) | None => "nothing that the chip has",
            },
        });
    }
    if range.end > flash.end {
        return Err(PlanError::TooLarge {
            path: firmware.path.clone(),
            end: range.end,
            flash_end: flash.end,
        });
    }
    Ok(())
}

/// Whether the chip would start: the first two words of the flash are its stack's top and where it goes.
fn check_vectors(
    firmware: &Firmware,
    flash: &Range<u64>,
    target: &Target,
) -> Result<(), PlanError> {
    let refuse = |found: String| Err(PlanError::NoVectors(firmware.path.clone(), found));
    let first = &firmware.segments[0];
    let Some((stack, reset)) = first
        .bytes
        .first_chunk::<8>()
        .filter(|_| first.address == FLASH_START)
        .map(|&[a, b, c, d, e, f, g, h]| {
            (
                u64::from(u32::from_le_bytes([a, b, c, d])),
                u64::from(u32::from_le_bytes([e, f, g, h])),
            )
        })
    else {
        return refuse(format!("it begins at {:#010x}", first.address));
    };
    // A stack grows down: its top is the first address behind it.
    let stack_is_sound = stack.is_multiple_of(8)
        && stack > 0
        && matches!(
            target.memory_region_by_address(stack - 1),
            Some(MemoryRegion::Ram(_))
        );
    if !stack_is_sound {
        return refuse(format!("the stack is at {stack:#010x}"));
    }
    // Bit 0 says that the code is Thumb; the processor knows no other.
    if reset & 1 == 0 || !flash.contains(&reset) {
        return refuse(format!("the reset vector is {reset:#010x}"));
    }
    Ok(())
}
