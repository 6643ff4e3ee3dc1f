//! A probe with a chip behind it: asked what it is, erased, written, verified, started; and what goes wrong there, in
//! words that say what to do.

use std::error::Error;
use std::io;

use probe_rs::flashing::{
    DownloadOptions, FlashError, FlashProgress, ProgressEvent, ProgressOperation,
};
use probe_rs::probe::{DebugProbeError, Probe, ProbeCreationError};
use probe_rs::{Core, MemoryInterface, Permissions, Session};

use super::plan::{CHIP, FLASH_START, Plan};

/// DBGMCU_IDCODE: the device in its low twelve bits (RM0090, 38.6.1).
const DEVICE_ID: u64 = 0xE004_2000;
/// The device of our chip: STM32F42x and F43x.
const OUR_DEVICE: u32 = 0x419;
/// The size of the flash in KiB, 16 bits (RM0090, 39.2), in a word that begins two bytes before it.
const FLASH_SIZE: u64 = 0x1FFF_7A20;
/// FLASH_OPTCR: RDP in bits 15:8, nWRP of sectors 0–11 in 27:16, SPRMOD in 31 (RM0090, 3.9.10).
const OPTIONS: u64 = 0x4002_3C14;
/// FLASH_OPTCR1: nWRP of sectors 12–23 in bits 27:16 (RM0090, 3.9.12).
const OPTIONS_1: u64 = 0x4002_3C18;
/// Below this a chip has no power: probe-rs warns at the same voltage.
const LEAST_VOLTS: f32 = 1.4;

/// Devices with an identity at the same place, of which some stand on boards that look just like ours.
const DEVICES: [(u32, &str); 22] = [
    (0x410, "an STM32F101/102/103 (medium density)"),
    (0x411, "an STM32F20x/21x"),
    (0x413, "an STM32F405/407/415/417"),
    (0x414, "an STM32F101/103 (high density)"),
    (0x415, "an STM32L475/476/486"),
    (0x416, "an STM32L1"),
    (0x421, "an STM32F446"),
    (0x422, "an STM32F302/303/358"),
    (0x423, "an STM32F401xB/C"),
    (0x431, "an STM32F411"),
    (0x433, "an STM32F401xD/E"),
    (0x434, "an STM32F469/479"),
    (0x435, "an STM32L43x/44x"),
    (0x438, "an STM32F303x6/8/328/334"),
    (0x441, "an STM32F412"),
    (0x446, "an STM32F302/303xD/E/398"),
    (0x449, "an STM32F745/746/756"),
    (0x451, "an STM32F765/767/769/777/779"),
    (0x452, "an STM32F722/723/732/733"),
    (0x458, "an STM32F410"),
    (0x463, "an STM32F413/423"),
    (0x469, "an STM32G47x/48x"),
];

/// Part of the way through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Sectors are being erased.
    Erase,
    /// Pages are being written.
    Write,
    /// The flash is being read back.
    Verify,
}

impl Stage {
    /// The stage in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Erase => "erasing",
            Self::Write => "writing",
            Self::Verify => "verifying",
        }
    }
}

/// How far it has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub stage: Stage,
    /// How many bytes of it are done.
    pub done_bytes: u64,
    /// How many there are.
    pub total_bytes: u64,
}

/// A chip that is the right one and may be written.
#[derive(Debug)]
pub struct Programmer {
    session: Session,
}

impl Programmer {
    /// Asks the chip behind `probe` whether `plan` can be carried out on it. Nothing is changed but that the chip
    /// may be halted or, if it does not answer otherwise, reset. `reopen` opens the probe a second time, for an
    /// attempt under reset. Fails if the chip has no power, does not answer, is another one, too small, locked or
    /// protected.
    pub fn attach(
        mut probe: Probe,
        plan: &Plan,
        reopen: impl FnOnce() -> Option<Probe>,
    ) -> Result<Self, Trouble> {
        if let Ok(Some(volts)) = probe.get_target_voltage()
            && volts < LEAST_VOLTS
        {
            return Err(Trouble::NoPower { volts });
        }
        let target = || plan.target.clone();
        let session = probe
            .attach(target(), Permissions::default())
            .or_else(|error| match reopen() {
                // A chip whose program sleeps deeply or has put the debug pins to other uses.
                Some(probe) => probe
                    .attach_under_reset(target(), Permissions::default())
                    .map_err(|_| error),
                None => Err(error),
            })
            .map_err(|error| Trouble::NoAnswer(chain(&error)))?;
        let mut programmer = Self { session };
        programmer.check(plan)?;
        Ok(programmer)
    }

    fn core(&mut self) -> Result<Core<'_>, Trouble> {
        self.session
            .core(0)
            .map_err(|error| Trouble::LostBefore(chain(&error)))
    }

    fn check(&mut self, plan: &Plan) -> Result<(), Trouble> {
        let mut core = self.core()?;
        let mut read = |address| {
            core.read_word_32(address)
                .map_err(|error| Trouble::LostBefore(chain(&error)))
        };
        let device = read(DEVICE_ID)? & 0xFFF;
        if device != OUR_DEVICE {
            return Err(Trouble::OtherChip(named(device)));
        }
        check_lock(read(OPTIONS)?, read(OPTIONS_1)?, plan)?;
        let found_kib = u64::from(read(FLASH_SIZE)? >> 16);
        let end = plan
            .firmware
            .segments
            .iter()
            .map(|segment| segment.range().end)
            .max()
            .unwrap_or(FLASH_START);
        let wanted_kib = (end - FLASH_START).div_ceil(1024);
        if found_kib < wanted_kib {
            return Err(Trouble::SmallFlash {
                found_kib,
                wanted_kib,
            });
        }
        Ok(())
    }

    /// Erases, writes and verifies. `tell` is called as it comes along. Fails if the flash could not be written, or
    /// does not hold what was written.
    pub fn write(&mut self, plan: &Plan, mut tell: impl FnMut(Progress)) -> Result<(), Trouble> {
        let loader = plan
            .loader()
            .map_err(|error| Trouble::flashing(&error, false))?;
        let mut all: Vec<Progress> = Vec::new();
        let mut is_begun = false;
        let mut options = DownloadOptions::default();
        options.verify = true;
        options.progress = FlashProgress::new(|event| {
            if let Some(progress) = advance(&mut all, &event) {
                is_begun |= progress.done_bytes > 0;
                tell(progress);
            }
        });
        let result = loader.commit(&mut self.session, options);
        result.map_err(|error| Trouble::flashing(&error, is_begun))
    }

    /// Resets the chip and lets it run. Fails if it does not take the reset.
    pub fn start(mut self) -> Result<(), Trouble> {
        self.session
            .core(0)
            .and_then(|mut core| core.reset())
            .map_err(|error| Trouble::NotStarted(chain(&error)))
    }
}

fn named(device: u32) -> String {
    DEVICES.iter().find(|(id, _)| *id == device).map_or_else(
        || format!("none that this program knows (device 0x{device:03X})"),
        |(id, name)| format!("{name} (device 0x{id:03X})"),
    )
}

/// Whether the option bytes allow the plan.
fn check_lock(options: u32, options_1: u32, plan: &Plan) -> Result<(), Trouble> {
    match (options >> 8) & 0xFF {
        0xAA => {}
        0xCC => return Err(Trouble::Locked { level: 2 }),
        _ => return Err(Trouble::Locked { level: 1 }),
    }
    // A bit of nWRP is 0 where the sector is protected. With SPRMOD the bits protect from reading, and the
    // other way round.
    let bits = ((options >> 16) & 0xFFF) | ((options_1 >> 16) & 0xFFF) << 12;
    let is_protected = |sector: usize| (bits >> sector) & 1 == options >> 31;
    match plan
        .sectors
        .iter()
        .find(|sector| is_protected(sector.number))
    {
        Some(sector) => Err(Trouble::Protected(sector.number)),
        None => Ok(()),
    }
}

/// Takes an event into account; what is to be told of it.
fn advance(all: &mut Vec<Progress>, event: &ProgressEvent) -> Option<Progress> {
    match event {
        ProgressEvent::AddProgressBar { operation, total } => {
            all.push(Progress {
                stage: stage(*operation)?,
                done_bytes: 0,
                total_bytes: total.unwrap_or(0),
            });
            None
        }
        ProgressEvent::Started(operation) => {
            let stage = stage(*operation)?;
            all.iter().find(|known| known.stage == stage).copied()
        }
        ProgressEvent::Progress {
            operation, size, ..
        } => {
            let stage = stage(*operation)?;
            let known = all.iter_mut().find(|known| known.stage == stage)?;
            known.done_bytes += size;
            Some(*known)
        }
        ProgressEvent::Finished(operation) => {
            let stage = stage(*operation)?;
            let known = all.iter_mut().find(|known| known.stage == stage)?;
            known.done_bytes = known.total_bytes;
            Some(*known)
        }
        ProgressEvent::FlashLayoutReady { .. }
        | ProgressEvent::Failed(_)
        | ProgressEvent::DiagnosticMessage { .. } => None,
    }
}

const fn stage(operation: ProgressOperation) -> Option<Stage> {
    match operation {
        ProgressOperation::Erase => Some(Stage::Erase),
        ProgressOperation::Program => Some(Stage::Write),
        ProgressOperation::Verify => Some(Stage::Verify),
        ProgressOperation::Fill => None,
    }
}

/// What lets people at their probes.
pub const UDEV_HINT: &str = "let its users at it by the udev rules in host-bridge/doc/70-ridgelink.rules \
    (what to do stands in the file), then plug the board in again";

/// Why a board was not flashed.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum Trouble {
    #[error("no permission to open the probe {0}: {UDEV_HINT}")]
    Denied(String),
    #[error(
        "another program has the probe {0}: close it (probe-rs, cargo run, OpenOCD, \
         STM32CubeProgrammer, a debugger in an editor)"
    )]
    Busy(String),
    #[error("the probe {0} is gone: plug it in again")]
    Gone(String),
    #[error("the probe {0} can't be opened: {1}; plug it in again, or update its firmware")]
    Unopened(String, String),
    #[error(
        "the probe sees {volts:.1} V on the board, not 3.3 V: see the board's supply \
         (jumper JP3 at U5V, JP5 on) and the probe's cable"
    )]
    NoPower { volts: f32 },
    #[error(
        "no chip answers behind the probe ({0}): see that both jumpers of CN4 are on and the board has \
         power, and hold its reset button while trying again"
    )]
    NoAnswer(String),
    #[error(
        "the chip behind the probe is {0}, and the firmware is for an {CHIP}: nothing was changed"
    )]
    OtherChip(String),
    #[error(
        "the chip behind the probe has {found_kib} KiB of flash, the firmware ends at {wanted_kib} KiB: \
         nothing was changed"
    )]
    SmallFlash { found_kib: u64, wanted_kib: u64 },
    #[error("the chip is locked (read-out protection level {level}): {}; nothing was changed", advice(*level))]
    Locked {
        /// RDP: 1 or 2.
        level: u8,
    },
    #[error(
        "sector {0} of the flash is write-protected: take the protection off (STM32CubeProgrammer, \
         option bytes nWRP); nothing was changed"
    )]
    Protected(usize),
    #[error(
        "the probe lost the chip before anything was erased ({0}): see cable and power, try again"
    )]
    LostBefore(String),
    #[error(
        "{0} failed ({1}): the board has no whole firmware now and its outputs stay at 0 V; see cable \
         and power, and flash it again"
    )]
    Broken(&'static str, String),
    #[error(
        "the flash does not hold what was written: flash it again, and if that fails again exchange the board"
    )]
    Unverified,
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
