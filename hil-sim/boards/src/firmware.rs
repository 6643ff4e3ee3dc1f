//! A firmware's ELF, checked before anything runs: is it one, whose is it, does it speak our protocol.

use std::fmt::{self, Debug, Formatter};
use std::path::{Path, PathBuf};

use object::{Object, ObjectSection};
use protocol::{Hello, PROTOCOL_VERSION, Role, SCHEMA_HASH};
use rigless::emulator::ProcessorConstructor;
use rigless::image::Image;

/// The section in which a firmware carries its [`Hello`].
const IDENTITY: &str = ".ridgelink";

/// Why an ELF can't be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum FirmwareError {
    /// The file can't be read.
    #[error(
        "{}: can't be read: build the firmware with ./test or with \
         `cargo build --release --target thumbv7em-none-eabihf -p {package}`",
        path.display()
    )]
    Missing {
        path: PathBuf,
        package: &'static str,
        source: std::io::Error,
    },
    /// The file is no ELF.
    #[error("{}: is no ELF file ({reason}): give the firmware as the build left it", path.display())]
    NoElf { path: PathBuf, reason: String },
    /// The ELF does not say what it is.
    #[error("{}: has no {IDENTITY} section: it is no firmware of Ridgelink, or was stripped of it", path.display())]
    NoIdentity { path: PathBuf },
    /// The ELF is for the other board.
    #[error("{}: is the {found} board's firmware; the {wanted} board's is wanted: exchange the two", path.display())]
    WrongRole {
        path: PathBuf,
        found: String,
        wanted: &'static str,
    },
    /// The ELF was built from another protocol.
    #[error(
        "{}: speaks protocol {found_version} with schema {found_schema:016x}, this program \
         {PROTOCOL_VERSION} with {SCHEMA_HASH:016x}: build both from the same sources",
        path.display()
    )]
    OtherProtocol {
        path: PathBuf,
        found_version: u16,
        found_schema: u64,
    },
    /// The emulator can't place it.
    #[error("{}: {reason}", path.display())]
    Image { path: PathBuf, reason: String },
}

/// A firmware that may run.
#[derive(Clone)]
pub struct Firmware {
    /// Where it came from.
    pub path: PathBuf,
    /// The ELF, whole: defmt's strings are in it.
    pub elf: Vec<u8>,
    /// Who it says it is.
    pub hello: Hello,
    /// The same, as the emulator takes it.
    pub image: Image,
    /// What makes the processor that it runs on; none: the emulator, its own.
    pub processor: Option<ProcessorConstructor>,
}

impl Debug for Firmware {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Firmware")
            .field("path", &self.path)
            .field("hello", &self.hello)
            .finish_non_exhaustive()
    }
}

impl Firmware {
    /// Reads and checks the ELF at `path` for the board of `role`.
    pub fn read(path: &Path, role: Role) -> Result<Self, FirmwareError> {
        let package = match role {
            Role::Display => "firmware-display",
            _ => "firmware-sensor",
        };
        let elf = read_elf(path, package)?;
        let no_elf = |reason: String| FirmwareError::NoElf {
            path: path.to_owned(),
            reason,
        };
        let file = object::File::parse(&*elf).map_err(|error| no_elf(error.to_string()))?;
        let hello = file
            .section_by_name(IDENTITY)
            .and_then(|section| section.data().ok())
            .and_then(Hello::from_bytes)
            .ok_or_else(|| FirmwareError::NoIdentity {
                path: path.to_owned(),
            })?;
        let found = Role::from_byte(hello.role);
        if found != Some(role) {
            return Err(FirmwareError::WrongRole {
                path: path.to_owned(),
                found: found.map_or("?", Role::name).to_owned(),
                wanted: role.name(),
            });
        }
        if !hello.is_compatible() {
            return Err(FirmwareError::OtherProtocol {
                path: path.to_owned(),
                found_version: hello.protocol_version(),
                found_schema: hello.schema_hash(),
            });
        }
        let image = Image::new(path, elf.clone(), None).map_err(|error| FirmwareError::Image {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
        Ok(Self {
            path: path.to_owned(),
            elf,
            hello,
            image,
            processor: None,
        })
    }
}

/// Reads the ELF at `path`, which `cargo build -p` and `package` make.
pub(super) fn read_elf(path: &Path, package: &'static str) -> Result<Vec<u8>, FirmwareError> {
    std::fs::read(path).map_err(|source| FirmwareError::Missing {
        path: path.to_owned(),
        package,
        source,
    })
}

/// The two firmwares of a pair.
#[derive(Clone, Debug)]
pub struct Firmwares {
    /// The sensor board's.
    pub sensor: Firmware,
    /// The display board's.
    pub display: Firmware,
}
