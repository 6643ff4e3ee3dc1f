//! A bound on the stack that a flashed ELF can need, from its code alone.
//!
//! What a function takes of the stack is all that its code ever pushes or subtracts. What it calls is read from its
//! branches. A call by a pointer may go to any function whose address stands anywhere in the flash, but a task only
//! runs in an executor: the thread's, or the one on UART5's vector. Functions that can call each other in a circle are
//! taken for one, which takes what all of them take: so the bound holds as long as no function is active twice in a
//! context. Of the interrupts of one priority the deepest counts, each with the frame that the processor pushes.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use hil_sim_boards::instructions::instructions;
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

/// What the processor pushes for an exception, with floating point and the alignment (ARMv7-M, B1.5.6).
const EXCEPTION_BYTES: u32 = 26 * 4 + 4;
/// Exceptions of the processor before those of peripherals, and what stands in the table first: the stack's start.
const RESET: usize = 1;

/// The vector that the boards' second executor runs on, in their `board.rs`.
const EXECUTOR: &str = "UART5";

/// The priority of a handler, as the boards' set-up and that of their ports have it; what is not named there has that
/// after a reset.
fn priority(handler: &str) -> i8 {
    match handler.trim_end_matches('_') {
        "USART2" | "USART3" => 7,
        ports if ports.starts_with("DMA1_STREAM") => 7,
        EXECUTOR | "ADC" => 6,
        "TIM3" => 5,
        "HardFault" => -1,
        _ => 0,
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The program outside of interrupts, in bytes.
    pub thread_bytes: u32,
    /// Each interrupt's handler, the processor's frame included, in bytes.
    pub interrupts: BTreeMap<String, u32>,
    /// The task that takes most, mangled, and what it takes, in bytes; it is part of the thread and of [`EXECUTOR`].
    pub task: (String, u32),
    /// Functions in the largest circle, and what they take together, in bytes.
    pub circle: (usize, u32),
    /// Functions whose stack grows by what can't be read from the code.
    pub unknown: Vec<String>,
}

impl Bound {
    /// All of it, in bytes: the thread, and the deepest interrupt of each priority.
    pub fn total_bytes(&self) -> u32 {
        let mut by_priority: BTreeMap<i8, u32> = BTreeMap::new();
        for (handler, &bytes) in &self.interrupts {
            let deepest = by_priority.entry(priority(handler)).or_default();
            *deepest = bytes.max(*deepest);
        }
        self.thread_bytes + by_priority.values().sum::<u32>()
    }
}

#[derive(Default)]
struct Function {
    name: String,
    bytes: u32,
    calls: BTreeSet<usize>,
    calls_by_pointer: bool,
    is_unknown: bool,
}

/// Reads it from an ELF; none if that has no code, no symbols, or no table of vectors.
pub fn bound(elf: &[u8]) -> Option<Bound> {
    let file = object::File::parse(elf).ok()?;
    let mut starts: BTreeMap<u64, (u64, String)> = BTreeMap::new();
    for symbol in file.symbols() {
        if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
            let name = symbol.name().unwrap_or_default().to_owned();
            starts.insert(symbol.address() & !1, (symbol.size(), name));
        }
    }
    let places: Vec<u64> = starts.keys().copied().collect();
    let place_of: HashMap<u64, usize> = places.iter().enumerate().map(|(n, &at)| (at, n)).collect();
    let mut functions: Vec<Function> = starts
        .values()
        .map(|(_, name)| Function {
            name: name.clone(),
            ..Function::default()
        })
        .collect();
    let mut pointed = BTreeSet::new();
    let mut halves: HashMap<(usize, u16), u32> = HashMap::new();
    for (at, code) in instructions(elf)? {
        let place = places
            .partition_point(|&start| start <= at)
            .checked_sub(1)?;
        let end = places[place] + starts[&places[place]].0;
        if at >= end {
            continue;
        }
        let function = &mut functions[place];
        match growth(code) {
            Some(bytes) => function.bytes += bytes,
            None => function.is_unknown = true,
        }
        match branch(at, code) {
            Branch::To(target) if !(places[place]..end).contains(&target) => {
                // What is no function's beginning is a part of one that the linker knows no name of.
                match place_of.get(&target) {
                    Some(&called) => {
                        function.calls.insert(called);
                    }
                    None => function.is_unknown = true,
                }
            }
            Branch::ByPointer => function.calls_by_pointer = true,
            Branch::To(_) | Branch::None => {}
        }
        // An address that the code itself makes, half by half.
        if let Some((is_high, register, half)) = constant(code) {
            if is_high {
                let low = halves.get(&(place, register)).copied().unwrap_or_default();
                let made = half << 16 | low;
                pointed.extend(pointer(&place_of, made));
            } else {
                halves.insert((place, register), half);
            }
        }
    }
    let mut vectors = Vec::new();
    for section in file.sections() {
        let is_vectors = section.name() == Ok(".vector_table");
        if !is_vectors
            && !matches!(
                section.kind(),
                SectionKind::Text | SectionKind::ReadOnlyData | SectionKind::Data
            )
        {
            continue;
        }
        for word in section.data().ok()?.chunks_exact(4) {
            let word = u32::from_le_bytes(word.try_into().ok()?);
            let found = pointer(&place_of, word);
            if is_vectors {
                vectors.push(found);
            } else {
                pointed.extend(found);
            }
        }
    }
    let is_task = |place: &usize| {
        let name = &functions[*place].name;
        name.contains("TaskStorage") && name.contains("poll")
    };
    let (tasks, pointed): (Vec<usize>, BTreeSet<usize>) = {
        let (tasks, others): (Vec<usize>, Vec<usize>) = pointed.into_iter().partition(is_task);
        (tasks, others.into_iter().collect())
    };
    let any = functions.len();
    functions.push(Function {
        name: "any function whose address is taken".to_owned(),
        calls: pointed,
        ..Function::default()
    });
    for function in &mut functions {
        if function.calls_by_pointer {
            function.calls.insert(any);
        }
    }
    let deepest = deepest(&functions);
    let reset = (*vectors.get(RESET)?)?;
    let handlers: BTreeSet<usize> = vectors[RESET + 1..].iter().flatten().copied().collect();
    let roots = handlers.iter().chain(&tasks).chain([&reset]).copied();
    let reached = reached(&functions, roots);
    let task = tasks.into_iter().max_by_key(|&task| deepest.bytes[task])?;
    let task_bytes = deepest.bytes[task];
    Some(Bound {
        thread_bytes: deepest.bytes[reset] + task_bytes,
        task: (functions[task].name.clone(), task_bytes),
        interrupts: handlers
            .into_iter()
            .map(|handler| {
                let name = functions[handler].name.clone();
                let task_bytes = if name == EXECUTOR { task_bytes } else { 0 };
                (name, deepest.bytes[handler] + task_bytes + EXCEPTION_BYTES)
            })
            .collect(),
        circle: deepest.circle,
        unknown: reached
            .into_iter()
            .filter(|&place| functions[place].is_unknown)
            .map(|place| functions[place].name.clone())
            .collect(),
    })
}

/// The function that a word points to, with the bit that says Thumb.
fn pointer(place_of: &HashMap<u64, usize>, word: u32) -> Option<usize> {
    (word & 1 == 1)
        .then(|| place_of.get(&u64::from(word - 1)).copied())
        .flatten()
}

fn reached(functions: &[Function], from: impl Iterator<Item = usize>) -> BTreeSet<usize> {
    let mut reached = BTreeSet::new();
    let mut left: Vec<usize> = from.collect();
    while let Some(place) = left.pop() {
        if reached.insert(place) {
            left.extend(&functions[place].calls);
        }
    }
    reached
}

struct Deepest {
    bytes: Vec<u32>,
    circle: (usize, u32),
}

/// What each function takes with all that it calls: circles first, by Tarjan's algorithm, without recursion.
fn deepest(functions: &[Function]) -> Deepest {
    const NEW: usize = usize::MAX;
    let count = functions.len();
    let (mut order, mut low) = (vec![NEW; count], vec![NEW; count]);
    let (mut open, mut is_open) = (Vec::new(), vec![false; count]);
    let mut bytes = vec![0; count];
    let mut circle = (0, 0);
    let mut next = 0;
    for root in 0..count {
        if order[root] != NEW {
            continue;
        }
        let mut walk = vec![(root, functions[root].calls.iter())];
        while let Some((place, calls)) = walk.last_mut() {
            let place = *place;
            if order[place] == NEW {
                order[place] = next;
                low[place] = next;
                next += 1;
                open.push(place);
                is_open[place] = true;
            }
            if let Some(&called) = calls.next() {
                if order[called] == NEW {
                    walk.push((called, functions[called].calls.iter()));
                } else if is_open[called] {
                    low[place] = low[place].min(order[called]);
                }
                continue;
            }
            walk.pop();
            if let Some(&(caller, _)) = walk.last() {
                low[caller] = low[caller].min(low[place]);
            }
            if low[place] == order[place] {
                let from = open
                    .iter()
                    .position(|&one| one == place)
                    .unwrap_or_default();
                let members = open.split_off(from);
                let own: u32 = members.iter().map(|&one| functions[one].bytes).sum();
                let below = members
                    .iter()
                    .flat_map(|&one| &functions[one].calls)
                    .filter(|called| !members.contains(called))
                    .map(|&called| bytes[called])
                    .max();
                for &one in &members {
                    is_open[one] = false;
                    bytes[one] = own + below.unwrap_or_default();
                }
                if members.len() > 1 && own > circle.1 {
                    circle = (members.len(), own);
                }
            }
        }
    }
    Deepest { bytes, circle }
}

/// The bytes by which an instruction lets the stack grow; none if that can't be told.
fn growth([first, second]: [u16; 2]) -> Option<u32> {
    let registers = |list: u16| 4 * list.count_ones();
    Some(match (first, second) {
        // PUSH, and SUB SP, SP, #imm7.
        (0xB400..=0xB5FF, _) => registers(first & 0x1FF),
        (0xB080..=0xB0FF, _) => u32::from(first & 0x7F) * 4,
        // STMDB SP!, and STR or STRD with SP written back.
        (0xE92D, list) => registers(list),
        (0xF84D, second) if second & 0x0F00 == 0x0D00 => u32::from(second & 0xFF),
        (0xE96D, second) => u32::from(second & 0xFF) * 4,
        // VPUSH, of double or single registers: the number of words.
        (0xED2D | 0xED6D, second) if second & 0x0E00 == 0x0A00 => u32::from(second & 0xFF) * 4,
        // SUB.W SP, SP, #const, and SUBW.
        (0xF1AD | 0xF5AD, second) if second & 0x0F00 == 0x0D00 => expanded(first, second),
        (0xF2AD | 0xF6AD, second) if second & 0x0F00 == 0x0D00 => {
            u32::from(first >> 10 & 1) << 11
                | u32::from(second >> 12 & 7) << 8
                | u32::from(second & 0xFF)
        }
        // SUB SP, SP, a register; MOV SP, a register, but for R7, which is a frame's own.
        (0xEBAD, second) if second & 0x0F00 == 0x0D00 => return None,
        (0x4680..=0x46FF, _) if first & 0x87 == 0x85 && first >> 3 & 0xF != 7 => return None,
        _ => 0,
    })
}

/// A constant of Thumb (ARMv7-M, A5.3.2).
fn expanded(first: u16, second: u16) -> u32 {
    let rotation = u32::from(first >> 10 & 1) << 4
        | u32::from(second >> 12 & 7) << 1
        | u32::from(second >> 7 & 1);
    let byte = u32::from(second & 0xFF);
    match rotation >> 1 {
        0..=1 if rotation < 2 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (byte | 0x80).rotate_right(rotation),
    }
}

enum Branch {
    To(u64),
    ByPointer,
    None,
}

/// Where an instruction at `at` goes, but for branches that are too short to leave a function.
fn branch(at: u64, [first, second]: [u16; 2]) -> Branch {
    let to = |offset: i64| Branch::To((at + 4).wrapping_add_signed(offset));
    let extended = |value: u32, bits: u32| i64::from((value << (32 - bits)) as i32 >> (32 - bits));
    if first & 0xF800 == 0xE000 {
        return to(extended(u32::from(first & 0x7FF) << 1, 12));
    }
    if first & 0xFF80 == 0x4780 || (first & 0xFF87 == 0x4700 && first != 0x4770) {
        return Branch::ByPointer;
    }
    if first & 0xF800 != 0xF000 || second & 0x8000 == 0 {
        return Branch::None;
    }
    let sign = u32::from(first >> 10 & 1);
    let (j1, j2) = (u32::from(second >> 13 & 1), u32::from(second >> 11 & 1));
    let low = u32::from(second & 0x7FF) << 1;
    match second & 0xD000 {
        // BL, B.W.
        0xD000 | 0x9000 => {
            let (i1, i2) = (1 ^ j1 ^ sign, 1 ^ j2 ^ sign);
            let high = u32::from(first & 0x3FF) << 12;
            to(extended(sign << 24 | i1 << 23 | i2 << 22 | high | low, 25))
        }
        // B<c>.W; the conditions 111x are other instructions.
        0x8000 if first >> 7 & 0b111 != 0b111 => {
            let high = u32::from(first & 0x3F) << 12;
            to(extended(sign << 20 | j2 << 19 | j1 << 18 | high | low, 21))
        }
        _ => Branch::None,
    }
}

/// The half of a constant that MOVW or MOVT puts into a register: whether it is the higher one, which register, what.
fn constant([first, second]: [u16; 2]) -> Option<(bool, u16, u32)> {
    let is_high = match first & 0xFBF0 {
        0xF240 => false,
        0xF2C0 => true,
        _ => return None,
    };
    if second & 0x8000 != 0 {
        return None;
    }
    let half = u32::from(first & 0xF) << 12
        | u32::from(first >> 10 & 1) << 11
        | u32::from(second >> 12 & 7) << 8
        | u32::from(second & 0xFF);
    Some((is_high, second >> 8 & 0xF, half))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lets_the_stack_grow_is_read_as_the_manual_has_it() {
        for (code, bytes) in [
            // push {r4, r5, r6, r7, lr}; sub sp, #24; push.w {r8, r9, r11}; vpush {d8, d9}
            ([0xB5F0, 0], Some(20)),
            ([0xB086, 0], Some(24)),
            ([0xE92D, 0x0B00], Some(12)),
            ([0xED2D, 0x8B04], Some(16)),
            // sub.w sp, sp, #1024; subw sp, sp, #1076; str r11, [sp, #-4]!
            ([0xF5AD, 0x6D80], Some(1_024)),
            ([0xF2AD, 0x4D34], Some(1_076)),
            ([0xF84D, 0xBD04], Some(4)),
            // sub.w sp, sp, r4; add sp, #24; mov sp, r7 is no growth, mov sp, r4 may be.
            ([0xEBAD, 0x0D04], None),
            ([0xB006, 0], Some(0)),
            ([0x46BD, 0], Some(0)),
            ([0x46A5, 0], None),
        ] {
            assert_eq!(growth(code), bytes, "{code:#06x?}");
        }
    }

    #[test]
    fn branches_go_where_the_manual_says() {
        let target = |at, code| match branch(at, code) {
            Branch::To(target) => Some(target),
            Branch::ByPointer | Branch::None => None,
        };
        // bl to itself, bl forwards over 4 bytes, b.w backwards, b forwards.
        assert_eq!(target(0x800_0100, [0xF7FF, 0xFFFE]), Some(0x800_0100));
        assert_eq!(target(0x800_0100, [0xF000, 0xF802]), Some(0x800_0108));
        assert_eq!(target(0x800_0100, [0xF7FF, 0xBFFC]), Some(0x800_00FC));
        assert_eq!(target(0x800_0100, [0xE002, 0]), Some(0x800_0108));
        // blx r3 and bx r2 go by a pointer, bx lr back.
        assert!(matches!(branch(0, [0x4798, 0]), Branch::ByPointer));
        assert!(matches!(branch(0, [0x4710, 0]), Branch::ByPointer));
        assert!(matches!(branch(0, [0x4770, 0]), Branch::None));
    }

    #[test]
    fn a_circle_takes_what_all_of_its_functions_take_and_what_is_below_it() {
        let function = |bytes, calls: &[usize]| Function {
            bytes,
            calls: calls.iter().copied().collect(),
            ..Function::default()
        };
        // 0 calls 1; 1 and 2 each other; 2 calls 3; 4 calls 3 alone.
        let functions = [
            function(8, &[1]),
            function(16, &[2]),
            function(32, &[1, 3]),
            function(64, &[]),
            function(128, &[3]),
        ];
        let found = deepest(&functions);
        assert_eq!(found.bytes, [120, 112, 112, 64, 192]);
        assert_eq!(found.circle, (2, 48));
    }
}
