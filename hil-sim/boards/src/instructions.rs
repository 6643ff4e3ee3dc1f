//! What the display's ELF spends its instructions on: every instruction that it retires for a while,
//! counted, by the source file that it comes from.
//!
//! The whole code is watched for that while, instruction by instruction. Each is put down to the
//! innermost file of ours among the functions inlined at its address, by the ELF's own debug
//! information, so that a sine drawn inside the array's loop counts as the sine; code that is inlined
//! into nothing of ours counts as its crate's. What the compiler's own routines do, such as copying,
//! counts as the place that called them.

use std::collections::{BTreeMap, HashMap};

use addr2line::gimli::{self, EndianSlice, LittleEndian};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use rigless::emulator::{Access, AccessKind, Hit, HitKind, Host, Settled, Watch};

use super::{ElfError, Firmware};
use crate::cycles::{CycleMeter, Estimate};
use crate::display_alone;
use crate::display_alone::{DisplayBench, Watcher};

/// Instructions that a board retires in a second, as the emulator counts them.
pub const BUDGET: u64 = super::nucleo::INSTRUCTIONS_PER_SECOND.get();

/// What was counted.
#[derive(Clone, Debug, PartialEq)]
pub struct Counted {
    /// Instructions by file or crate.
    pub by_place: BTreeMap<String, u64>,
    /// Instructions by function, as the linker's symbols name it, mangled: what is inlined counts as the
    /// function that it is inlined into.
    pub by_function: BTreeMap<String, u64>,
    /// All of them.
    pub total: u64,
    /// Accesses to the registers of each peripheral.
    pub accesses: BTreeMap<&'static str, u64>,
    /// Output ticks meanwhile.
    pub ticks: u64,
    /// The time that it was counted for, in s.
    pub counted_s: f64,
    /// What it would take on silicon: the least, the most, and that without the flash's accelerator.
    pub cycles: [Cycles; 3],
    /// From the start of a tick's words to the arming of LDAC once they are out, the longest, in ns of the
    /// emulated board's time.
    pub transfer_ns: u64,
}

/// Processor cycles, estimated: see [`crate::cycles`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cycles {
    /// In all.
    pub total: u64,
    /// Of the output tick with the most, to the next one.
    pub worst_tick: u64,
    /// From a tick's interrupt to the start of its words' transfer, of the tick with the most.
    pub worst_start: u64,
}

/// Counts for the last `counted_s` of the run that `alone` describes, in whole ms.
///
/// # Errors
/// If the board can't be run, or the ELF's code can't be read.
pub fn count(
    alone: DisplayBench,
    firmware: &Firmware,
    counted_s: f64,
) -> Result<Counted, ElfError> {
    let code = instructions(&firmware.elf)
        .ok_or_else(|| unreadable("it has no code with mapping symbols"))?;
    let end_ns = (alone.duration_s * 1e3).ceil() as u64 * 1_000_000;
    let from_ns = end_ns - (counted_s * 1e3).round() as u64 * 1_000_000;
    let functions = functions(&firmware.elf);
    let watched = WatchedCode {
        timings: ESTIMATES.map(|estimate| Timing {
            meter: CycleMeter::new(&code, estimate),
            tick: None,
            cycles: Cycles::default(),
        }),
        started_ns: None,
        transfer_ns: 0,
        code: code.into_iter().map(|(address, _)| address).collect(),
        routines: routines(&functions),
        caller: None,
        by_caller: HashMap::new(),
        from_ns,
        running: None,
        counts: HashMap::new(),
        accesses: BTreeMap::new(),
        refused: 0,
    };
    let (run, watched) = display_alone::run_before(alone, firmware, watched)?;
    if watched.refused > 0 {
        return Err(unreadable("the emulator can't watch it"));
    }
    let places = Places::read(&firmware.elf).map_err(|error| unreadable(&error.to_string()))?;
    let mut by_place: BTreeMap<String, u64> = BTreeMap::new();
    for (address, count) in &watched.by_caller {
        *by_place.entry(places.of(*address)).or_default() += count;
    }
    let mut by_function: BTreeMap<String, u64> = BTreeMap::new();
    for (address, count) in &watched.counts {
        let name = functions.range(..=address).next_back();
        let name = name.map_or("unknown", |(_, name)| name);
        *by_function.entry(name.to_owned()).or_default() += count;
    }
    Ok(Counted {
        transfer_ns: watched.transfer_ns,
        cycles: watched.timings.map(|timing| Cycles {
            total: timing.meter.cycles(),
            ..timing.cycles
        }),
        by_function,
        total: watched.counts.values().sum(),
        by_place,
        accesses: watched.accesses,
        ticks: run
            .recording
            .ticks
            .iter()
            .filter(|tick| tick.at_ns >= from_ns)
            .count() as u64,
        counted_s: (end_ns - from_ns) as f64 * 1e-9,
    })
}

fn unreadable(reason: &str) -> ElfError {
    ElfError::Board {
        board: "display",
        reason: format!("its instructions can't be counted: {reason}"),
    }
}

/// Counts how often each instruction is come to.
struct WatchedCode {
    timings: [Timing; 3],
    /// When the last tick's words went on their way.
    started_ns: Option<u64>,
    transfer_ns: u64,
    code: Vec<u64>,
    /// Where the compiler's routines begin and end.
    routines: Vec<std::ops::Range<u64>>,
    /// The last instruction that was in none of them.
    caller: Option<u64>,
    /// The counts of routines put down to their callers.
    by_caller: HashMap<u64, u64>,
    from_ns: u64,
    /// The instruction come to last, and how many had been retired before it.
    running: Option<(u64, u64)>,
    counts: HashMap<u64, u64>,
    accesses: BTreeMap<&'static str, u64>,
    refused: usize,
}

impl Watcher for WatchedCode {
    fn on_look(&mut self, at_ns: u64, host: &mut dyn Host) {
        if at_ns < self.from_ns {
            return;
        }
        for address in std::mem::take(&mut self.code) {
            self.refused += usize::from(!host.watch(Watch::Instruction(address)));
        }
    }

    fn on_settled(&mut self, settled: &Settled) {
        if let Settled::Access {
            access:
                Access {
                    address,
                    kind,
                    virtual_time,
                    ..
                },
            ..
        } = *settled
            && self.running.is_some()
        {
            *self.accesses.entry(peripheral(address)).or_default() += 1;
            for timing in &mut self.timings {
                timing.meter.access(address);
            }
            if kind == AccessKind::Write {
                self.time(address, virtual_time.0);
            }
        }
        let Settled::Hit(Hit {
            kind: HitKind::Instruction,
            address,
            instruction_count,
            ..
        }) = *settled
        else {
            return;
        };
        for timing in &mut self.timings {
            timing.meter.retire(address);
        }
        if let Some((before, count)) = self.running {
            let retired = instruction_count - count;
            *self.counts.entry(before).or_default() += retired;
            let place = self.caller.unwrap_or(before);
            *self.by_caller.entry(place).or_default() += retired;
        }
        if !self
            .routines
            .iter()
            .any(|routine| routine.contains(&address))
        {
            self.caller = Some(address);
        }
        self.running = Some((address, instruction_count));
    }
}

impl WatchedCode {
    /// The register at `address` was written: the tick's interrupt takes its flag back, or its words start, or
    /// they are out.
    fn time(&mut self, address: u64, at_ns: u64) {
        if address == TICK_FLAGS {
            self.started_ns = None;
            for Timing {
                meter,
                tick,
                cycles,
            } in &mut self.timings
            {
                if let Some(before) = tick.replace(meter.cycles()) {
                    cycles.worst_tick = cycles.worst_tick.max(meter.cycles() - before);
                }
            }
        } else if let Some(started_ns) = self.started_ns {
            if address == LOAD_MODE {
                self.transfer_ns = self.transfer_ns.max(at_ns - started_ns);
            }
        } else if WORDS_DMA.contains(&address) {
            self.started_ns = Some(at_ns);
            for Timing {
                meter,
                tick,
                cycles,
            } in &mut self.timings
            {
                if let Some(tick) = tick {
                    cycles.worst_start = cycles.worst_start.max(meter.cycles() - *tick);
                }
            }
        }
    }
}

const ESTIMATES: [Estimate; 3] = [Estimate::Least, Estimate::Most, Estimate::Unaccelerated];

struct Timing {
    meter: CycleMeter,
    /// The cycles before the last tick's interrupt.
    tick: Option<u64>,
    cycles: Cycles,
}

/// TIM3_SR, TIM3_CCMR1, and the registers of DMA2's streams.
const TICK_FLAGS: u64 = 0x4000_0410;
const LOAD_MODE: u64 = 0x4000_0418;
const WORDS_DMA: std::ops::Range<u64> = 0x4002_6410..0x4002_64D0;

/// Each instruction of an ELF, with its first two halfwords: Thumb code between the mapping symbols $t and $d, in which
/// one whose first halfword begins with 0b11101, 0b11110 or 0b11111 has two.
pub fn instructions(elf: &[u8]) -> Option<Vec<(u64, [u16; 2])>> {
    let file = object::File::parse(elf).ok()?;
    let mut marks: BTreeMap<u64, bool> = BTreeMap::new();
    for symbol in file.symbols() {
        let name = symbol.name().unwrap_or_default();
        if name.starts_with("$t") || name.starts_with("$d") {
            marks.insert(symbol.address(), name.starts_with("$t"));
        }
    }
    let mut found = Vec::new();
    for section in file.sections().filter(|s| s.kind() == SectionKind::Text) {
        let (from, data) = (section.address(), section.data().ok()?);
        let to = from + data.len() as u64;
        let inside: Vec<(u64, bool)> = marks
            .range(from..to)
            .map(|(&at, &code)| (at, code))
            .collect();
        for (index, &(start, is_code)) in inside.iter().enumerate() {
            let end = inside.get(index + 1).map_or(to, |next| next.0);
            let mut at = start;
            while is_code && at + 1 < end {
                let offset = (at - from) as usize;
                let halfword = |at: usize| match data.get(at..at + 2) {
                    Some(&[low, high]) => u16::from_le_bytes([low, high]),
                    _ => 0,
                };
                let first = halfword(offset);
                found.push((at, [first, halfword(offset + 2)]));
                at += if first >> 11 >= 0b11101 { 4 } else { 2 };
            }
        }
    }
    found.sort_unstable();
    (!found.is_empty()).then_some(found)
}

/// Where the compiler's own routines begin and end.
fn routines(functions: &BTreeMap<u64, String>) -> Vec<std::ops::Range<u64>> {
    let ends = functions.keys().copied().skip(1).chain([u64::MAX]);
    functions
        .iter()
        .zip(ends)
        .filter(|((_, name), _)| {
            name.starts_with("__aeabi_")
                || name.contains("compiler_builtins")
                || matches!(&***name, "memcpy" | "memmove" | "memset" | "memcmp")
        })
        .map(|((&from, _), to)| from..to)
        .collect()
}

fn functions(elf: &[u8]) -> BTreeMap<u64, String> {
    let Ok(file) = object::File::parse(elf) else {
        return BTreeMap::new();
    };
    file.symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Text)
        .filter_map(|symbol| {
            let name = symbol.name().ok()?;
            // Bit 0 says that it is Thumb code; a mapping symbol is no function.
            (!name.starts_with('$')).then(|| (symbol.address() & !1, name.to_owned()))
        })
        .collect()
}

/// The peripheral that has the registers at an address, of those that the display uses (RM0090, table 1).
fn peripheral(address: u64) -> &'static str {
    match address & !0x3FF {
        0x4000_0400 => "TIM3 (tick, LDAC)",
        0x4000_0800 => "TIM4 (hand)",
        0x4000_0C00 => "TIM5 (time)",
        0x4000_3000 => "IWDG",
        0x4000_4400 => "USART2 (peer)",
        0x4000_4800 => "USART3 (console)",
        0x4001_0000 => "TIM1 (CLR)",
        0x4001_3000 => "SPI1",
        0x4002_0000..=0x4002_2800 => "GPIO",
        0x4002_6000 => "DMA1 (ports)",
        0x4002_6400 => "DMA2 (SPI1)",
        _ => "others",
    }
}

type Reader<'a> = EndianSlice<'a, LittleEndian>;

struct Places<'a> {
    context: addr2line::Context<Reader<'a>>,
}

impl<'a> Places<'a> {
    fn read(elf: &'a [u8]) -> Result<Self, gimli::Error> {
        let file = object::File::parse(elf).map_err(|_| gimli::Error::MissingUnitDie)?;
        let dwarf = gimli::Dwarf::load(|id| {
            let section = file.section_by_name(id.name());
            // Sections of an ELF as the linker leaves it are not compressed.
            let data = section.and_then(|section| section.data().ok());
            Ok::<_, gimli::Error>(EndianSlice::new(data.unwrap_or_default(), LittleEndian))
        })?;
        Ok(Self {
            context: addr2line::Context::from_dwarf(dwarf)?,
        })
    }

    /// The innermost file of ours at an address, else the crate of the function, else "unknown".
    fn of(&self, address: u64) -> String {
        let Ok(mut frames) = self.context.find_frames(address).skip_all_loads() else {
            return "unknown".to_owned();
        };
        let mut outermost = None;
        while let Ok(Some(frame)) = frames.next() {
            let file = frame.location.and_then(|location| location.file);
            if let Some(ours) = file.and_then(ours) {
                return ours;
            }
            outermost = file.map(crate_of).or(outermost);
        }
        outermost.unwrap_or_else(|| "unknown".to_owned())
    }
}

/// A file of this workspace's firmware, from its crate's folder on.
fn ours(path: &str) -> Option<String> {
    [
        "firmware-display/src/",
        "protocol/nucleo/src/",
        "protocol/src/",
    ]
    .into_iter()
    .find_map(|folder| {
        let at = path.find(folder)?;
        Some(path[at..].replace("src/", ""))
    })
}

/// The name of the crate that a source file is in, without its version.
fn crate_of(path: &str) -> String {
    let mut folders: Vec<&str> = path.split('/').collect();
    folders.pop();
    let source = folders.iter().rposition(|&folder| folder == "src");
    let name = source
        .and_then(|source| folders.get(source.checked_sub(1)?))
        .copied()
        .unwrap_or("unknown");
    let version = name
        .rfind('-')
        .filter(|&dash| name[dash + 1..].starts_with(|c: char| c.is_ascii_digit()));
    version.map_or(name, |dash| &name[..dash]).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_compiler_s_routines_are_known_by_their_names() {
        let functions = BTreeMap::from([
            (0x100, "_ZN7display4tick".to_owned()),
            (0x200, "__aeabi_memcpy4".to_owned()),
            (0x240, "_RNvNtCs7_17compiler_builtins3mem6memcpy".to_owned()),
            (0x280, "memcpy_of_our_own".to_owned()),
        ]);
        assert_eq!(routines(&functions), [0x200..0x240, 0x240..0x280]);
    }

    #[test]
    fn a_file_is_named_by_its_crate_wherever_it_lies() {
        assert_eq!(
            ours("/anywhere/firmware-display/src/array.rs").as_deref(),
            Some("firmware-display/array.rs")
        );
        assert_eq!(
            ours("protocol/nucleo/src/ports.rs").as_deref(),
            Some("protocol/nucleo/ports.rs")
        );
        assert_eq!(
            ours("/registry/src/index/heapless-0.9.3/src/deque.rs"),
            None
        );
        assert_eq!(
            crate_of(
                "/registry/src/index.crates.io-1949cf8c6b5b557f/embassy-stm32-0.6.0/src/dma/mod.rs"
            ),
            "embassy-stm32"
        );
        assert_eq!(crate_of("/rustc/0123/library/core/src/num/f32.rs"), "core");
        assert_eq!(crate_of("build.rs"), "unknown");
    }
}
