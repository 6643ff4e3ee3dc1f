//! Code that a broken board runs into, and how it is led there.
//!
//! The code lies in flash that the firmware does not use, placed there before the run. An executor calls
//! its task by an entry in RAM (the task's header): a wrong word in it sends the processor wherever a
//! fault wants it, in the middle of what the executor does. A reset writes that RAM anew.

use std::path::Path;

use object::{Object, ObjectSymbol};
use rigless::emulator::Host;
use rigless::image::Image;
use rigless::soc::Width;

/// In the last but one sector of the STM32F427's flash; a firmware has some 100 KiB.
const BASE: u64 = 0x081C_0000;
/// Thumb code's addresses are odd where they are called.
const THUMB: u64 = 1;

/// What a task that is led astray does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trap {
    /// `b .`
    Loop,
    /// `cpsid i; b .`
    Hang,
    /// `udf #0`
    Undefined,
    /// `push {r4-r7, lr}; bl .-2`
    Recursion,
    /// `core::panicking::panic_bounds_check(50, 50, …)`
    Panic,
}

impl Trap {
    /// Its place behind [`BASE`].
    const fn offset(self) -> u64 {
        match self {
            Self::Loop => 0x00,
            Self::Hang => 0x04,
            Self::Undefined => 0x08,
            Self::Recursion => 0x0C,
            Self::Panic => 0x14,
        }
    }
}

/// The traps for one firmware, and what of it they need to know.
#[derive(Clone, Debug)]
pub struct Traps {
    /// Functions that poll tasks.
    polls: Vec<u64>,
    /// Statics of the firmware: name, address, size.
    statics: Vec<(String, u64, u64)>,
    panic: u64,
}

impl Traps {
    /// Looks for what is needed in an ELF's symbols; none if the ELF has been stripped of them.
    pub fn find(elf: &[u8]) -> Option<Self> {
        let file = object::File::parse(elf).ok()?;
        let named = || {
            file.symbols()
                .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol)))
        };
        let polls = named()
            .filter(|(name, _)| name.contains("TaskStorage") && name.contains("poll"))
            .map(|(_, symbol)| symbol.address() | THUMB)
            .collect();
        let (_, panic) = named().find(|(name, _)| name.contains("panic_bounds_check"))?;
        let ram = 0x2000_0000..0x2003_0000;
        let statics = named()
            .filter(|(_, symbol)| symbol.size() > 0 && ram.contains(&symbol.address()))
            .map(|(name, symbol)| (name, symbol.address(), symbol.size()))
            .collect();
        Some(Self {
            polls,
            statics,
            panic: panic.address() | THUMB,
        })
    }

    /// The code, to be placed beside the firmware.
    pub fn image(&self) -> Option<Image> {
        const FILE: &[u8] = b"fault\0\0\0";
        let mut halves: Vec<u16> = vec![
            0xE7FE, 0xBF00, // loop
            0xB672, 0xE7FE, // hang
            0xDE00, 0xBF00, // undefined
            0xB5F0, 0xF7FF, 0xFFFD, 0xBF00, // recursion
            0x2032, 0x2132, 0x4A01, 0x4B02, 0x4718,
            0xBF00, // panic: r0, r1, [location], [panic]
        ];
        let here = BASE + 2 * halves.len() as u64;
        let location = here + 8;
        let words = [location, self.panic, location + 16, 5, 1, 1];
        for word in words {
            halves.extend([word as u16, (word >> 16) as u16]);
        }
        let mut bytes: Vec<u8> = halves.into_iter().flat_map(u16::to_le_bytes).collect();
        bytes.extend_from_slice(FILE);
        Image::new(Path::new("traps"), bytes, Some(BASE)).ok()
    }

    /// Leads the task whose storage's name contains `task` into `trap`; false if it is not to be found.
    pub fn lead(&self, task: &str, trap: Trap, host: &mut dyn Host) -> bool {
        let mut led = false;
        for &(_, address, size) in self.statics.iter().filter(|(name, ..)| name.contains(task)) {
            for place in (address..address + size).step_by(4) {
                let is_entry = host
                    .read(place, Width::W32)
                    .is_ok_and(|word| self.polls.contains(&word));
                if is_entry {
                    let astray = BASE + trap.offset() + THUMB;
                    led |= host.write(place, Width::W32, astray).is_ok();
                }
            }
        }
        led
    }

    /// Every place of `pattern` in the statics whose names contain one of `names`, in order.
    pub fn places(&self, names: &[&str], pattern: &[u8], host: &mut dyn Host) -> Vec<u64> {
        let mut places = Vec::new();
        let is_named = |name: &str| names.iter().any(|part| name.contains(part));
        for (_, address, size) in self.statics.iter().filter(|(name, ..)| is_named(name)) {
            let bytes: Vec<u8> = (*address..address + size)
                .map(|at| host.read(at, Width::W8).map_or(0, |byte| byte as u8))
                .collect();
            let found = bytes.windows(pattern.len()).enumerate();
            places.extend(
                found
                    .filter(|(_, window)| *window == pattern)
                    .map(|(at, _)| address + at as u64),
            );
        }
        places.sort_unstable();
        places
    }
}
