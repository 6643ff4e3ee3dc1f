//! A firmware's ELF: whose it is, whether it speaks our protocol, and what of it goes into the flash.

use std::fs;
use std::io;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use object::elf::{EM_ARM, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader as _, ProgramHeader as _, SectionHeader as _};
use object::{FileKind, LittleEndian};
use protocol::{Hello, PROTOCOL_VERSION, Role, SCHEMA_HASH};

/// The section in which a firmware carries its [`Hello`].
const IDENTITY: &[u8] = b".ridgelink";
/// The folder of the boards' ELFs, seen from the sources' top.
const BUILT: &str = "target/thumbv7em-none-eabihf/release";

type Header = FileHeader32<LittleEndian>;

/// Why an ELF is no firmware for the board.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum FirmwareError {
    #[error(
        "{path}: can't be read ({source}): build it with \
         `cargo build --release --target thumbv7em-none-eabihf -p firmware-{role}`, or name the ELF"
    )]
    Unreadable {
        path: PathBuf,
        role: &'static str,
        source: io::Error,
    },
    #[error("{0}: is no firmware's ELF ({1}): give the file as the build left it")]
    NoElf(PathBuf, String),
    #[error("{path}: is cut off: {found} of its {wanted} bytes are there; build or copy it again")]
    CutOff {
        path: PathBuf,
        /// Its length in bytes.
        found: u64,
        /// The length in bytes that its own tables ask for.
        wanted: u64,
    },
    #[error(
        "{0}: has no .ridgelink section: it is no firmware of Ridgelink, or was stripped of it"
    )]
    NoIdentity(PathBuf),
    #[error(
        "{path}: is the {found} board's firmware, and the {wanted} board was to get it: \
         exchange the two, or flash it as `host-bridge flash {found}`"
    )]
    WrongRole {
        path: PathBuf,
        found: &'static str,
        wanted: &'static str,
    },
    #[error(
        "{path}: speaks protocol {found_version} with schema {found_schema:016x}, this program \
         {PROTOCOL_VERSION} with {SCHEMA_HASH:016x}: build both from the same sources"
    )]
    OtherProtocol {
        path: PathBuf,
        found_version: u16,
        found_schema: u64,
    },
}

/// A piece of the flash to be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Where its first byte goes.
    pub address: u64,
    /// What goes there; never empty.
    pub bytes: Vec<u8>,
    /// The sections that it holds.
    pub sections: Vec<String>,
}

impl Segment {
    /// The addresses that it takes.
    pub fn range(&self) -> Range<u64> {
        self.address..self.address + self.bytes.len() as u64
    }
}

/// A firmware that is what it should be.
#[derive(Clone, Debug)]
pub struct Firmware {
    /// Where it came from.
    pub path: PathBuf,
    /// Whose it is.
    pub role: Role,
    /// What it says of itself.
    pub hello: Hello,
    /// What goes into the flash, by address.
    pub segments: Vec<Segment>,
}

/// A board's ELF with all that a debugger wants is a tenth of that; a device may never end.
const LONGEST_ELF: u64 = 1 << 27;

/// Where the build leaves the firmware of `role`.
pub fn built(role: Role) -> PathBuf {
    Path::new(BUILT).join(format!("firmware-{}", role.name()))
}

impl Firmware {
    /// Reads the ELF at `path`, which is to be the firmware of `role`. Fails if it can't be read, is no whole ELF
    /// of this protocol, or is another board's.
    pub fn read(path: &Path, role: Role) -> Result<Self, FirmwareError> {
        let mut elf = Vec::new();
        fs::File::open(path)
            .and_then(|file| file.take(LONGEST_ELF).read_to_end(&mut elf))
            .map_err(|source| FirmwareError::Unreadable {
                path: path.to_owned(),
                role: role.name(),
                source,
            })?;
        let elf = Elf::open(path, &elf)?;
        let hello = elf.identity()?;
        let found = Role::from_byte(hello.role);
        if found != Some(role) {
            return Err(FirmwareError::WrongRole {
                path: path.to_owned(),
                found: found.map_or("?", Role::name),
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
        Ok(Self {
            path: path.to_owned(),
            role,
            hello,
            segments: elf.segments()?,
        })
    }
}

struct Elf<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    header: &'a Header,
}

impl<'a> Elf<'a> {
    fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self, FirmwareError> {
        let no_elf = |reason: &str| FirmwareError::NoElf(path.to_owned(), reason.to_owned());
        let cut_off = |wanted| FirmwareError::CutOff {
            path: path.to_owned(),
            found: bytes.len() as u64,
            wanted,
        };
        if bytes.starts_with(b"\x7fELF") && bytes.len() < size_of::<Header>() {
            return Err(cut_off(size_of::<Header>() as u64));
        }
        match FileKind::parse(bytes) {
            Ok(FileKind::Elf32) => {}
            Ok(FileKind::Elf64) => return Err(no_elf("it is a 64-bit program's")),
            _ => return Err(no_elf("it does not begin like one")),
        }
        let header = Header::parse(bytes).map_err(|error| no_elf(&error.to_string()))?;
        if !header.is_little_endian() || header.e_machine.get(LittleEndian) != EM_ARM {
            return Err(no_elf("it is for another kind of processor"));
        }
        let elf = Self {
            path,
            bytes,
            header,
        };
        let wanted = elf.tables_end();
        if wanted > bytes.len() as u64 {
            return Err(cut_off(wanted));
        }
        let wanted = elf.contents_end()?;
        if wanted > bytes.len() as u64 {
            return Err(cut_off(wanted));
        }
        Ok(elf)
    }

    fn no_elf(&self, error: object::Error) -> FirmwareError {
        FirmwareError::NoElf(self.path.to_owned(), error.to_string())
    }

    /// Where the last of its two tables ends, by its header.
    fn tables_end(&self) -> u64 {
        let table = |offset: u32, count: u16, entry: u16| {
            u64::from(offset) + u64::from(count) * u64::from(entry)
        };
        let header = self.header;
        table(
            header.e_phoff.get(LittleEndian),
            header.e_phnum.get(LittleEndian),
            header.e_phentsize.get(LittleEndian),
        )
        .max(table(
            header.e_shoff.get(LittleEndian),
            header.e_shnum.get(LittleEndian),
            header.e_shentsize.get(LittleEndian),
        ))
    }

    /// Where the last segment or section ends, by the tables.
    fn contents_end(&self) -> Result<u64, FirmwareError> {
        let end = |(offset, size): (u64, u64)| offset + size;
        let segments = self
            .header
            .program_headers(LittleEndian, self.bytes)
            .map_err(|error| self.no_elf(error))?
            .iter()
            .map(|segment| end(segment.file_range(LittleEndian)));
        let sections = self
            .header
            .section_headers(LittleEndian, self.bytes)
            .map_err(|error| self.no_elf(error))?
            .iter()
            .filter_map(|section| section.file_range(LittleEndian))
            .map(end);
        Ok(segments.chain(sections).max().unwrap_or(0))
    }

    fn identity(&self) -> Result<Hello, FirmwareError> {
        let sections = self
            .header
            .sections(LittleEndian, self.bytes)
            .map_err(|error| self.no_elf(error))?;
        sections
            .section_by_name(LittleEndian, IDENTITY)
            .and_then(|(_, section)| section.data(LittleEndian, self.bytes).ok())
            .and_then(Hello::from_bytes)
            .ok_or_else(|| FirmwareError::NoIdentity(self.path.to_owned()))
    }

    /// What is loaded, by physical address: where it lies in the flash, not where it runs.
    fn segments(&self) -> Result<Vec<Segment>, FirmwareError> {
        let headers = self
            .header
            .program_headers(LittleEndian, self.bytes)
            .map_err(|error| self.no_elf(error))?;
        let mut segments = Vec::new();
        for header in headers {
            if header.p_type(LittleEndian) != PT_LOAD || header.p_filesz(LittleEndian) == 0 {
                continue;
            }
            let bytes = header.data(LittleEndian, self.bytes).map_err(|()| {
                FirmwareError::NoElf(
                    self.path.to_owned(),
                    "a segment lies outside the file".to_owned(),
                )
            })?;
            segments.push(Segment {
                address: u64::from(header.p_paddr(LittleEndian)),
                bytes: bytes.to_vec(),
                sections: self.sections_in(header.file_range(LittleEndian))?,
            });
        }
        segments.sort_by_key(|segment| segment.address);
        Ok(segments)
    }

    /// The names of the sections that lie in a part of the file.
    fn sections_in(&self, (start, size): (u64, u64)) -> Result<Vec<String>, FirmwareError> {
        let part = start..start + size;
        let sections = self
            .header
            .sections(LittleEndian, self.bytes)
            .map_err(|error| self.no_elf(error))?;
        let mut names = Vec::new();
        for section in sections.iter() {
            let Some((offset, size)) = section.file_range(LittleEndian) else {
                continue;
            };
            if size > 0 && part.contains(&offset) {
                let name = sections
                    .section_name(LittleEndian, section)
                    .map_err(|error| self.no_elf(error))?;
                names.push(String::from_utf8_lossy(name).into_owned());
            }
        }
        Ok(names)
    }
}
