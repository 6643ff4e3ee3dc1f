//! What goes wrong between the probe and the chip, in words that say what to do.

use std::error::Error;
use std::io;

use probe_rs::flashing::FlashError;
use probe_rs::probe::{DebugProbeError, ProbeCreationError};

use super::plan::CHIP;

/// What lets people at their probes.
pub const UDEV_HINT: &str = "let its users at it by the udev rules in host-bridge/doc/70-ridgelink.rules \
    (what to do stands in the file), then plug the board in again";

/// Why a board was not flashed.
#[derive(Debug, thiserror::Error)]
pub enum Trouble {
    /// This user may not open the probe.
    #[error("no permission to open the probe {0}: {UDEV_HINT}")]
    Denied(String),
    /// Another program has the probe.
    #[error(
        "another program has the probe {0}: close it (probe-rs, cargo run, OpenOCD, \
         STM32CubeProgrammer, a debugger in an editor)"
    )]
    Busy(String),
    /// The probe went away.
    #[error("the probe {0} is gone: plug it in again")]
    Gone(String),
    /// The probe can't be opened, for another reason.
    #[error("the probe {0} can't be opened: {1}; plug it in again, or update its firmware")]
    Unopened(String, String),
    /// The chip has no power.
    #[error(
        "the probe sees {volts:.1} V on the board, not 3.3 V: see the board's supply \
         (jumper JP3 at U5V, JP5 on) and the probe's cable"
    )]
    NoPower {
        /// What it measures.
        volts: f32,
    },
    /// Nothing answers behind the probe.
    #[error(
        "no chip answers behind the probe ({0}): see that both jumpers of CN4 are on and the board has \
         power, and hold its reset button while trying again"
    )]
    NoAnswer(String),
    /// The chip behind the probe is another one.
    #[error(
        "the chip behind the probe is {0}, and the firmware is for an {CHIP}: nothing was changed"
    )]
    OtherChip(String),
    /// The chip's flash is smaller than the firmware.
    #[error(
        "the chip behind the probe has {found_kib} KiB of flash, the firmware ends at {wanted_kib} KiB: \
         nothing was changed"
    )]
    SmallFlash {
        /// Its size in KiB.
        found_kib: u64,
        /// What is wanted, in KiB.
        wanted_kib: u64,
    },
    /// The chip is locked for good, or until it is erased.
    #[error("the chip is locked (read-out protection level {level}): {}; nothing was changed", advice(*level))]
    Locked {
        /// RDP: 1 or 2.
        level: u8,
    },
    /// Sectors that are to be written are protected.
    #[error(
        "sector {0} of the flash is write-protected: take the protection off (STM32CubeProgrammer, \
         option bytes nWRP); nothing was changed"
    )]
    Protected(usize),
    /// The probe lost the chip before anything was erased.
    #[error(
        "the probe lost the chip before anything was erased ({0}): see cable and power, try again"
    )]
    LostBefore(String),
    /// Erasing or writing failed: the board has no whole firmware now.
    #[error(
        "{0} failed ({1}): the board has no whole firmware now and its outputs stay at 0 V; see cable \
         and power, and flash it again"
    )]
    Broken(&'static str, String),
    /// What was read back is not what was written.
    #[error(
        "the flash does not hold what was written: flash it again, and if that fails again exchange the board"
    )]
    Unverified,
    /// The firmware is in the flash but was not started.
    #[error("flashed and verified, but not started ({0}): press the board's reset button")]
    NotStarted(String),
}

impl Trouble {
    /// Whether the flash is as it was.
    pub const fn is_harmless(&self) -> bool {
        !matches!(
            self,
            Self::Broken { .. } | Self::Unverified | Self::NotStarted { .. }
        )
    }

    /// Why `probe` could not be opened.
    pub fn opening(probe: &str, error: &DebugProbeError) -> Self {
        let probe = probe.to_owned();
        if matches!(
            error,
            DebugProbeError::ProbeCouldNotBeCreated(ProbeCreationError::NotFound)
        ) {
            return Self::Gone(probe);
        }
        let system = sources(error).find_map(|source| source.downcast_ref::<io::Error>());
        match system.map(io::Error::kind) {
            Some(io::ErrorKind::PermissionDenied) => Self::Denied(probe),
            Some(io::ErrorKind::ResourceBusy) => Self::Busy(probe),
            Some(io::ErrorKind::NotConnected | io::ErrorKind::NotFound) => Self::Gone(probe),
            // The USB library has a kind of its own for this, which gets lost on the way, but not its words.
            _ if chain(error).contains("busy") => Self::Busy(probe),
            _ => Self::Unopened(probe, chain(error)),
        }
    }

    /// Why erasing, writing or verifying stopped; `is_begun` if a sector had been erased.
    pub fn flashing(error: &FlashError, is_begun: bool) -> Self {
        let reason = chain(error);
        match error {
            FlashError::Verify => Self::Unverified,
            // A sector whose erasing failed may be half erased.
            FlashError::EraseFailed { .. } => Self::Broken("erasing", reason),
            _ if is_begun => Self::Broken("writing", reason),
            _ => Self::LostBefore(reason),
        }
    }
}

const fn advice(level: u8) -> &'static str {
    match level {
        1 => {
            "set RDP back to 0xAA with STM32CubeProgrammer, which erases the whole chip, and flash it again"
        }
        _ => "level 2 is for ever: exchange the board",
    }
}

/// An error and what led to it.
fn sources<'a>(
    error: &'a (dyn Error + 'static),
) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    let mut next = Some(error);
    std::iter::from_fn(move || {
        let source = next?;
        next = source.source();
        Some(source)
    })
}

/// An error and what led to it, in one line.
pub fn chain(error: &(dyn Error + 'static)) -> String {
    let mut words: Vec<String> = Vec::new();
    for source in sources(error) {
        let text = source.to_string();
        let text = text.trim_end_matches('.');
        // Some errors repeat what their source says.
        if !words.last().is_some_and(|last| last.contains(text)) {
            words.push(text.to_owned());
        }
    }
    words.join(": ")
}
