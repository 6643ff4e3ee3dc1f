//! Another Cortex-M4F in the emulated boards' socket: rsemu's interpreter, with interrupt controller, exception entry
//! and lazy stacking of its own. It has no code in common with the emulator's, which translates.
//!
//! What is in the sockets is the processor alone. Memory, peripherals and the clock are the board's: it counts
//! instructions, so the two processors have to retire the same ones for their runs to be equal.

use std::cell::Cell;
use std::fmt::{self, Debug, Formatter};
use std::sync::Arc;

use hil_sim_boards::{BoardFacts, Firmware, Firmwares};
use hil_sim_core::run::recording::Recording;
use hil_sim_core::scene::Scene;
use rigless::device::Level;
use rigless::emulator::{
    Access, AccessKind, CoreBus, DataModel, Error, Exit, Processor, ProcessorConstructor, Queued,
};
use rigless::soc::{Endian, Width};
use rsemu::core::error::BusError;
use rsemu::core::space::{
    AccessConstraints, AddressSpace, MemAttrs, MemOps, MemResult, RamStore, Region,
};
use rsemu::cpu::arm::v7m::sys::Exception;
use rsemu::cpu::arm::v7m::{ArmV7m, Config, xpsr};

/// The part's flash, which nothing here writes to.
const FLASH: u64 = 0x0800_0000;
const FLASH_BYTES: u64 = 2 << 20;
/// All addresses: the processor keeps its own registers to itself.
const BUS_BYTES: u64 = 1 << 32;
/// Where registers begin; below is memory, which changes nothing but itself.
const REGISTERS: u64 = 0x4000_0000;
/// PM0214, 4.3: sixteen levels of priority.
const PRIORITY_BITS: u8 = 4;
/// DDI 0403, B1.5.6: the last word of a frame.
const STACKED_XPSR: u64 = 28;
/// DDI 0403, A7.7, encodings T1: the hints that concern the event register.
const WFE: u32 = 0xBF20;
const SEV: u32 = 0xBF40;

/// What a run of the two ELFs leaves behind.
pub type Left = (Recording, BoardFacts);

/// Runs `scene` on the emulator's own processor, and on this one.
///
/// # Panics
/// If a board can't be emulated or stops before the scene's end.
pub fn runs_on_both(scene: &Scene, firmwares: &Firmwares) -> (Left, Left) {
    let run = |firmwares: &Firmwares| {
        hil_sim_boards::run(scene, firmwares).unwrap_or_else(|error| panic!("{error}"))
    };
    (run(firmwares), run(&on_this(firmwares)))
}

/// What two runs differ in; empty if they left the same behind.
pub fn differences(one: &Left, other: &Left) -> Vec<&'static str> {
    let ((one, of_one), (other, of_other)) = (one, other);
    let parts = [
        ("instructions or resets", of_one == of_other),
        ("scans", one.scans == other.scans),
        ("ticks", one.ticks == other.ticks),
        ("estimates", one.estimates == other.estimates),
        ("outputs", one.outputs == other.outputs),
        ("log", one.log == other.log),
        ("signs", one.signs == other.signs),
        ("hash", one.hash == other.hash),
    ];
    let unequal = parts.into_iter().filter(|(_, is_equal)| !is_equal);
    unequal.map(|(part, _)| part).collect()
}

fn on_this(firmwares: &Firmwares) -> Firmwares {
    let on_it = |firmware: &Firmware| Firmware {
        processor: Some(maker()),
        ..firmware.clone()
    };
    Firmwares {
        sensor: on_it(&firmwares.sensor),
        display: on_it(&firmwares.display),
    }
}

fn maker() -> ProcessorConstructor {
    Arc::new(|_| Ok(Box::new(OtherProcessor::new())))
}

/// What the board lends for a stretch of instructions.
#[derive(Clone, Copy)]
struct Lent {
    bus: *mut (dyn CoreBus + 'static),
    /// Instructions retired before the one that is being executed.
    retired: u64,
    pc: u32,
    /// Whether it has reached a register.
    has_reached: bool,
}

thread_local! {
    static LENT: Cell<Option<Lent>> = const { Cell::new(None) };
}

/// What is outside of the processor from an address on, but the flash.
#[derive(Debug)]
struct Board {
    base: u64,
}

impl Board {
    fn access(kind: AccessKind, address: u64, width: usize, value: u64) -> Result<u64, BusError> {
        let width = match width {
            1 => Width::W8,
            2 => Width::W16,
            _ => Width::W32,
        };
        let mut lent = LENT.get().ok_or(BusError::Retry)?;
        lent.has_reached |= address >= REGISTERS;
        LENT.set(Some(lent));
        // SAFETY: `OtherProcessor::run` has the bus for itself, lends it to this thread while it makes a step, and
        // does not touch it meanwhile; nothing here holds it any longer than this call.
        #[expect(unsafe_code, reason = "the emulator lends its bus for a call only")]
        let bus = unsafe { &mut *lent.bus };
        let count = lent.retired + 1;
        let access = Access::new(kind, address, width, value)
            .at(count, bus.time(count))
            .by_instruction(lent.pc.into());
        bus.access(access, true).ok_or(BusError::BadAccess)
    }
}

impl MemOps for Board {
    fn read(&self, offset: u64, bytes: &mut [u8], attributes: MemAttrs) -> MemResult {
        if attributes.debug {
            return Err(BusError::BadAccess);
        }
        let value = Self::access(AccessKind::Read, self.base + offset, bytes.len(), 0)?;
        bytes.copy_from_slice(&value.to_le_bytes()[..bytes.len()]);
        Ok(())
    }

    fn write(&self, offset: u64, bytes: &[u8], attributes: MemAttrs) -> MemResult {
        if attributes.debug {
            return Err(BusError::BadAccess);
        }
        let mut value = [0; 8];
        value[..bytes.len()].copy_from_slice(bytes);
        let value = u64::from_le_bytes(value);
        Self::access(AccessKind::Write, self.base + offset, bytes.len(), value).map(|_| ())
    }

    fn constraints(&self) -> AccessConstraints {
        AccessConstraints::ANY
    }
}

/// The processor.
struct OtherProcessor {
    core: ArmV7m,
    flash: Arc<RamStore>,
    /// Where it boots from.
    table: u64,
    retired: u64,
    /// The event register (DDI 0403, B1.5.18), kept here: rsemu's knows of SEV only, and not of exceptions.
    event: bool,
    /// The exceptions that are active, the thread first, each interrupted by the next.
    active: Vec<u32>,
    /// Lines that have risen since the last instruction.
    risen: Vec<u16>,
    must_return: bool,
}

impl OtherProcessor {
    fn new() -> Self {
        let flash = Arc::new(RamStore::new(FLASH_BYTES));
        Self {
            core: core(&flash, FLASH),
            flash,
            table: FLASH,
            retired: 0,
            event: false,
            active: vec![0],
            risen: Vec::new(),
            must_return: false,
        }
    }

    fn drain(&mut self, bus: &mut dyn CoreBus) {
        for queued in bus.queued() {
            self.ask(queued);
        }
        self.pend();
    }

    /// A line that has risen leaves its interrupt pending, also one that has fallen again.
    fn pend(&mut self) {
        for line in std::mem::take(&mut self.risen) {
            self.core.pend_irq(line);
        }
    }

    fn halfword(&self) -> u32 {
        let offset = u64::from(self.core.pc()).checked_sub(FLASH);
        let mut bytes = [0; 2];
        match offset {
            Some(offset) if self.flash.read_at(offset, &mut bytes).is_ok() => {
                u16::from_le_bytes(bytes).into()
            }
            _ => 0,
        }
    }

    /// Whether the next step is an exception's entry.
    fn is_interrupted(&self) -> bool {
        let pending = self.core.with_sys(|sys| sys.highest_pending());
        pending.is_some_and(|(_, priority)| priority < self.core.execution_priority())
    }

    /// Does what the event register decides, if that is next.
    fn hint(&mut self) -> bool {
        let is_event = match self.halfword() {
            WFE if self.event => false,
            SEV => true,
            _ => return false,
        };
        if self.is_interrupted() {
            return false;
        }
        self.event = is_event;
        self.core.set_pc(self.core.pc() + 2);
        self.retired += 1;
        true
    }

    /// One instruction, or the entry to an exception; whether it has reached a register.
    fn step(&mut self, bus: &mut dyn CoreBus) -> bool {
        let (xpsr_before, fpscr_before) = (self.core.xpsr(), self.core.fpscr());
        let before = xpsr_before & xpsr::EXCEPTION;
        let has_reached = self.step_on(bus);
        let after = self.core.xpsr() & xpsr::EXCEPTION;
        if after == before {
            self.retired += 1;
            return has_reached;
        }
        self.event = true;
        if let Some(place) = self.active.iter().position(|&number| number == after) {
            // A return, to the handler that had been interrupted, or to the thread.
            self.active.truncate(place + 1);
            self.retired += 1;
            return has_reached;
        }
        let is_left = !(self.core).with_sys(|sys| sys.is_active(Exception(before as u16)));
        if before != 0 && is_left {
            // A return that another exception follows without unstacking.
            self.active.pop();
            self.retired += 1;
        } else {
            self.stack_it(xpsr_before & xpsr::IT_MASK, bus);
        }
        self.active.push(after);
        // rsemu 0.0.7 clears FPSCR whenever an exception is taken, before the lazy push has saved it
        // (`enter_fp_context`); by DDI 0403, B1.5.7, only its modes change, and that once the handler uses the unit. An
        // interrupt between VCMP and VMRS would turn the comparison.
        self.core.set_fpscr(fpscr_before);
        has_reached
    }

    /// rsemu 0.0.7 stacks xPSR without the state of an IT block (`exception_entry` masks it), against DDI 0403,
    /// B1.5.6: the rest of the block would run whatever its condition.
    fn stack_it(&self, it: u32, bus: &mut dyn CoreBus) {
        if it == 0 {
            return;
        }
        let address = u64::from(self.core.msp()) + STACKED_XPSR;
        let time = bus.time(self.retired);
        let access =
            |kind, value| Access::new(kind, address, Width::W32, value).at(self.retired, time);
        if let Some(stacked) = bus.access(access(AccessKind::Read, 0), false) {
            bus.access(access(AccessKind::Write, stacked | u64::from(it)), false);
        }
    }

    /// The same, with the bus lent.
    fn step_on(&self, bus: &mut dyn CoreBus) -> bool {
        let bus: *mut (dyn CoreBus + '_) = bus;
        // SAFETY: only the lifetime changes, and what is lent is taken back before it ends.
        #[expect(unsafe_code, reason = "a thread-local can't hold a lifetime")]
        let bus = unsafe {
            std::mem::transmute::<*mut (dyn CoreBus + '_), *mut (dyn CoreBus + 'static)>(bus)
        };
        LENT.set(Some(Lent {
            bus,
            retired: self.retired,
            pc: self.core.pc(),
            has_reached: false,
        }));
        self.core.step();
        LENT.take().is_some_and(|lent| lent.has_reached)
    }
}

impl Processor for OtherProcessor {
    fn run(&mut self, budget: u32, bus: &mut dyn CoreBus) -> (Exit, u64) {
        let begun = self.retired;
        let mut end = begun + u64::from(budget);
        self.must_return = false;
        self.drain(bus);
        let exit = loop {
            if self.core.is_asleep() && self.core.with_sys(|sys| sys.highest_pending()).is_none() {
                break Exit::Waiting;
            }
            if self.core.is_locked_up() {
                break Exit::Lockup;
            }
            if self.retired >= end {
                break Exit::Budget;
            }
            if self.hint() || !self.step(bus) {
                continue;
            }
            self.drain(bus);
            let is_over = self.must_return || self.core.reset_requested();
            match bus.carry_on(self.retired, None) {
                Some(more) if !is_over => end = self.retired + u64::from(more),
                _ => break Exit::Returned,
            }
        };
        (exit, self.retired - begun)
    }

    fn retired(&self) -> u64 {
        self.retired
    }

    fn ask(&mut self, queued: Queued) {
        match queued {
            Queued::Line(line, level) => {
                self.core.set_irq(line.index(), level == Level::High);
                if level == Level::High {
                    self.risen.push(line.index());
                }
            }
            Queued::Return => self.must_return = true,
            // Nothing is translated, and all data come from the bus.
            Queued::Invalidate(..) | Queued::Route(_) | Queued::Unroute(_) => {}
        }
    }

    fn boot(&mut self, table: u64, read: &dyn Fn(u64, Width) -> Option<u64>) {
        for offset in (0..FLASH_BYTES).step_by(4) {
            let word = read(FLASH + offset, Width::W32).unwrap_or(u32::MAX.into()) as u32;
            self.flash
                .write_at(offset, &word.to_le_bytes())
                .expect("as long as the flash");
        }
        self.table = table;
        self.reset();
    }

    fn reset(&mut self) {
        self.core = core(&self.flash, self.table);
        // The sequence that reads the table is no instruction.
        self.core.step();
        self.event = false;
        self.active = vec![0];
        self.risen.clear();
    }

    fn take_reset_request(&mut self) -> bool {
        let is_requested = self.core.reset_requested();
        self.core.clear_reset_request();
        is_requested
    }

    fn waiting(&self) -> bool {
        self.core.is_asleep()
    }

    fn pc(&self) -> u64 {
        self.core.pc().into()
    }

    fn data_model(&self) -> DataModel {
        DataModel::Ilp32
    }

    fn byte_order(&self, _address: u64) -> Endian {
        Endian::Little
    }

    fn save(&self) -> Vec<u8> {
        Vec::new()
    }

    fn load(&mut self, _bytes: &[u8]) -> Result<(), Error> {
        Err(Error::State)
    }
}

impl Debug for OtherProcessor {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} after {}", self.core.regs(), self.retired)
    }
}

fn core(flash: &Arc<RamStore>, table: u64) -> ArmV7m {
    let space = AddressSpace::new("board", 32);
    let above = FLASH + FLASH_BYTES;
    let flash = || Region::ram("flash", Arc::clone(flash));
    let board = |base, end| Region::io("board", end - base, Arc::new(Board { base }));
    let regions = [
        // Where it is seen when the part boots from it (RM0090, 2.4).
        (flash(), 0),
        (board(FLASH_BYTES, FLASH), FLASH_BYTES),
        (flash(), FLASH),
        (board(above, BUS_BYTES), above),
    ];
    for (region, base) in regions {
        space
            .topology()
            .map(region, base)
            .expect("apart from each other");
    }
    let config = Config::CORTEX_M4F
        .with_priority_bits(PRIORITY_BITS)
        .with_reset_vtor(table as u32);
    let core = ArmV7m::new(config);
    core.attach_space(Arc::new(space));
    core
}
