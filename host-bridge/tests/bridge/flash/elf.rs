//! ELFs made by hand, as small as they can be.

use std::fs;
use std::path::{Path, PathBuf};

use protocol::{Hello, Role};

/// Where the flash begins.
pub const FLASH: u32 = 0x0800_0000;
/// The processor of the boards.
const EM_ARM: u16 = 40;

const HEADER_BYTES: usize = 52;
const SEGMENT_BYTES: usize = 32;
const SECTION_BYTES: usize = 40;

/// An ELF to be.
#[derive(Clone)]
pub struct Elf {
    /// What it says of itself.
    pub identity: Option<Vec<u8>>,
    /// The processor.
    pub machine: u16,
    /// What goes where.
    pub parts: Vec<(u32, Vec<u8>)>,
}

impl Elf {
    /// A firmware of `role` that every check lets pass: vectors and a kilobyte.
    pub fn of(role: Role) -> Self {
        Self::saying(&Hello::new(role, "STM32F429ZI", [0, 1, 0]))
    }

    /// The same, saying `hello` of itself.
    pub fn saying(hello: &Hello) -> Self {
        Self {
            identity: Some(hello.to_bytes().to_vec()),
            machine: EM_ARM,
            parts: vec![(FLASH, program(1024))],
        }
    }

    /// The same with other parts.
    pub fn with_parts(mut self, parts: Vec<(u32, Vec<u8>)>) -> Self {
        self.parts = parts;
        self
    }

    /// The file's bytes: header, segments' table, their contents, identity, names, sections' table.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut names = b"\0.shstrtab\0.part\0".to_vec();
        let (names_name, part_name) = (1u32, 11u32);
        let identity_name = names.len() as u32;
        names.extend_from_slice(b".ridgelink\0");

        let contents = HEADER_BYTES + self.parts.len() * SEGMENT_BYTES;
        let mut body = Vec::new();
        let mut segments = Vec::new();
        // The first section is none.
        let mut sections = vec![0; SECTION_BYTES];
        let mut section = |name: u32, kind: u32, address: u32, offset: usize, bytes: usize| {
            for word in [
                name,
                kind,
                2,
                address,
                offset as u32,
                bytes as u32,
                0,
                0,
                1,
                0,
            ] {
                sections.extend_from_slice(&word.to_le_bytes());
            }
        };
        for (address, bytes) in &self.parts {
            let offset = contents + body.len();
            let (load, length) = (1u32, bytes.len() as u32);
            for word in [
                load,
                offset as u32,
                *address,
                *address,
                length,
                length,
                5,
                4,
            ] {
                segments.extend_from_slice(&word.to_le_bytes());
            }
            section(part_name, 1, *address, offset, bytes.len());
            body.extend_from_slice(bytes);
        }
        if let Some(identity) = &self.identity {
            section(identity_name, 1, 0, contents + body.len(), identity.len());
            body.extend_from_slice(identity);
        }
        section(names_name, 3, 0, contents + body.len(), names.len());
        body.extend_from_slice(&names);
        let table = contents + body.len();
        let count = sections.len() / SECTION_BYTES;

        let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
        file.extend_from_slice(&2u16.to_le_bytes());
        file.extend_from_slice(&self.machine.to_le_bytes());
        for word in [1, FLASH | 0x41, HEADER_BYTES as u32, table as u32, 0] {
            file.extend_from_slice(&word.to_le_bytes());
        }
        for half in [
            HEADER_BYTES,
            SEGMENT_BYTES,
            self.parts.len(),
            SECTION_BYTES,
            count,
            count - 1,
        ] {
            file.extend_from_slice(&(half as u16).to_le_bytes());
        }
        assert_eq!(file.len(), HEADER_BYTES);
        file.extend_from_slice(&segments);
        file.extend_from_slice(&body);
        file.extend_from_slice(&sections);
        file
    }

    /// Writes it as `name` into the tests' folder.
    pub fn write(&self, name: &str) -> PathBuf {
        file(name, &self.to_bytes())
    }
}

/// `bytes` of a program that starts: a stack in RAM, a reset vector, then anything.
pub fn program(bytes: usize) -> Vec<u8> {
    let mut program: Vec<u8> = (0..bytes).map(|at| (at * 7 % 251) as u8).collect();
    program[..4].copy_from_slice(&0x2000_8000u32.to_le_bytes());
    program[4..8].copy_from_slice(&(FLASH | 0x41).to_le_bytes());
    program
}

/// A folder of the tests' own.
pub fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("flash");
    fs::create_dir_all(&folder).expect("the tests have a folder");
    folder
}

/// A file in it.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    fs::write(&path, bytes).expect("the tests' folder can be written");
    path
}
