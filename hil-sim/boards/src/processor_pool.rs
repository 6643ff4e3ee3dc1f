//! Emulated processors that outlive their runs, with what they have translated of the firmware.
//!
//! A fresh processor takes a second or two of a core until the firmware runs translated; the next run of the same
//! program takes it over as it was, put back to power-up. What it has translated changes nothing of what it
//! does: instants are counted in instructions, and a block is translated from the same bytes.

use std::fmt::{self, Debug, Formatter};
use std::hash::Hasher;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use rigless::emulator::{
    CoreBus, CoreSpec, DataModel, Error, Exit, HostCall, Processor, ProcessorConstructor, Queued,
};
use rigless::image::Image;
use rigless::soc::{Endian, Width};
use rigless::time::VirtualNanos;
use twox_hash::XxHash3_64;

/// How many runs a processor is kept for: its books of where memory once was grow by some 100 KB with each.
const RUNS: u32 = 64;

/// Processors without a run.
static IDLE: Mutex<Vec<PooledProcessor>> = Mutex::new(Vec::new());

/// What a processor is to run: equal for equal images at equal places.
pub fn program(images: &[Image]) -> u64 {
    let mut hash = XxHash3_64::new();
    for (address, bytes) in images.iter().flat_map(Image::segments) {
        hash.write(&address.to_le_bytes());
        hash.write(&(bytes.len() as u64).to_le_bytes());
        hash.write(bytes);
    }
    hash.finish()
}

/// Lets a run of `program` take over a processor that has run it before, and leave its own to the next.
pub fn keep(spec: &mut CoreSpec, program: u64) {
    let make = Arc::clone(&spec.processor);
    spec.processor = Arc::new(move |endian| {
        let kept = match idle(program) {
            Some(kept) => kept,
            None => PooledProcessor::new(&make, endian, program)?,
        };
        Ok(Box::new(Lease {
            kept: Some(kept),
            mapped: Vec::new(),
            is_as_made: true,
        }))
    });
}

/// A processor that waits for a run of this program, at power-up.
fn idle(program: u64) -> Option<PooledProcessor> {
    let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    let at = idle.iter().position(|kept| kept.program == program)?;
    let mut kept = idle.swap_remove(at);
    // A program that ended itself still waits for the answer to that, which is no part of the state that is saved.
    kept.processor.answer_host_call(Some(0));
    kept.processor.load(&kept.at_power_up).ok()?;
    Some(kept)
}

/// A page of a kept processor's ground, as large and as aligned as the emulator's own.
#[derive(Clone)]
#[repr(align(4096))]
struct Page(#[expect(dead_code, reason = "only its address counts")] [u8; Page::SIZE]);

impl Page {
    const SIZE: usize = 4096;
}

/// A processor, and what it takes to use it again.
struct PooledProcessor {
    processor: Box<dyn Processor>,
    /// Another one that never runs, once there has been a reset.
    twin: Option<Box<dyn Processor>>,
    make: ProcessorConstructor,
    endian: Endian,
    at_power_up: Vec<u8>,
    program: u64,
    runs_left: u32,
    /// What it has for memory while it has no run.
    ground: Vec<Page>,
}

impl PooledProcessor {
    fn new(make: &ProcessorConstructor, endian: Endian, program: u64) -> Result<Self, Error> {
        let processor = make(endian)?;
        Ok(Self {
            at_power_up: processor.save(),
            processor,
            twin: None,
            make: Arc::clone(make),
            endian,
            program,
            runs_left: RUNS,
            ground: Vec::new(),
        })
    }

    /// Resets the processor. By its own reset it would drop what it has translated, which is none of its state:
    /// so its state goes to the twin, is reset there, and comes back.
    fn reset(&mut self) -> Result<(), Error> {
        let twin = match &mut self.twin {
            Some(twin) => twin,
            None => self.twin.insert((self.make)(self.endian)?),
        };
        twin.load(&self.processor.save())?;
        twin.reset();
        self.processor.load(&twin.save())?;
        // No part of the state that is saved.
        self.processor.take_reset_request();
        Ok(())
    }

    /// Takes the run's memory away from under the processor: all of it is the ground from here on. False if
    /// that is too short, and the processor not to be kept.
    #[expect(unsafe_code, reason = "the emulator hands over memory by raw pointer")]
    fn ground(&mut self, mapped: &[Mapped]) -> bool {
        let longest = mapped.iter().map(|memory| memory.length).max();
        let pages = (longest.unwrap_or(0) as usize).div_ceil(Page::SIZE);
        // Once only: whatever has been mapped to it stays so.
        if self.ground.is_empty() {
            self.ground = vec![Page([0; Page::SIZE]); pages];
        }
        if self.ground.len() < pages {
            return false;
        }
        let host = self.ground.as_mut_ptr().cast();
        for memory in mapped {
            if memory.is_writable {
                let end = memory.start + memory.length;
                self.processor.ask(Queued::Invalidate(memory.start, end));
            }
            // SAFETY: the ground is aligned and at least as long, does not move, and goes after the processor,
            // which is declared before it. Nobody reads or writes it, and nothing runs while it is mapped.
            unsafe {
                let Mapped { start, length, .. } = *memory;
                self.processor.map(start, length, host, false);
            }
        }
        true
    }
}

/// What a run has given to a processor for memory.
struct Mapped {
    start: u64,
    length: u64,
    is_writable: bool,
}

/// A processor for the length of a run. No debugger is ever attached to one.
struct Lease {
    /// None only while it is dropped.
    kept: Option<PooledProcessor>,
    mapped: Vec<Mapped>,
    /// Whether [`Processor::load`] puts back all that the run has changed.
    is_as_made: bool,
}

impl Lease {
    fn processor(&self) -> &dyn Processor {
        &*self.kept.as_ref().expect("kept until dropped").processor
    }

    fn processor_mut(&mut self) -> &mut dyn Processor {
        &mut *self.kept.as_mut().expect("kept until dropped").processor
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        let Some(mut kept) = self.kept.take() else {
            return;
        };
        kept.runs_left -= 1;
        if !self.is_as_made || kept.runs_left == 0 || std::thread::panicking() {
            return;
        }
        if kept.ground(&self.mapped) {
            let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
            idle.push(kept);
        }
    }
}

impl Debug for Lease {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        self.processor().fmt(formatter)
    }
}

impl Processor for Lease {
    fn run(&mut self, budget: u32, bus: &mut dyn CoreBus) -> (Exit, u64) {
        self.processor_mut().run(budget, bus)
    }

    fn retired(&self) -> u64 {
        self.processor().retired()
    }

    fn ask(&mut self, queued: Queued) {
        match queued {
            // Before the first instruction that is the program, which is where it was.
            Queued::Invalidate(..) if self.retired() == 0 => return,
            // A page that is looked at is looked at for good.
            Queued::Route(_) => self.is_as_made = false,
            _ => {}
        }
        self.processor_mut().ask(queued);
    }

    fn maps(&self, start: u64, length: u64) -> bool {
        self.processor().maps(start, length)
    }

    fn page_size(&self) -> u64 {
        self.processor().page_size()
    }

    #[expect(unsafe_code, reason = "the emulator hands over memory by raw pointer")]
    unsafe fn map(&mut self, start: u64, length: u64, host: *mut u8, writable: bool) {
        self.mapped.push(Mapped {
            start,
            length,
            is_writable: writable,
        });
        // SAFETY: what the caller promises holds until this is dropped, which gives the processor other memory.
        unsafe { self.processor_mut().map(start, length, host, writable) };
    }

    fn boot(&mut self, table: u64, read: &dyn Fn(u64, Width) -> Option<u64>) {
        self.processor_mut().boot(table, read);
    }

    fn reset(&mut self) {
        if let Some(kept) = &mut self.kept
            && kept.reset().is_err()
        {
            kept.processor.reset();
        }
    }

    fn take_reset_request(&mut self) -> bool {
        self.processor_mut().take_reset_request()
    }

    fn next_event(&self) -> Option<VirtualNanos> {
        self.processor().next_event()
    }

    fn on_event(&mut self, now: VirtualNanos) {
        self.processor_mut().on_event(now);
    }

    fn waiting(&self) -> bool {
        self.processor().waiting()
    }

    fn pc(&self) -> u64 {
        self.processor().pc()
    }

    fn add_breakpoint(&mut self, address: u64) -> bool {
        self.is_as_made = false;
        self.processor_mut().add_breakpoint(address)
    }

    fn remove_breakpoint(&mut self, address: u64) {
        self.processor_mut().remove_breakpoint(address);
    }

    fn pass_breakpoint(&mut self, address: u64) {
        self.processor_mut().pass_breakpoint(address);
    }

    fn data_model(&self) -> DataModel {
        self.processor().data_model()
    }

    fn byte_order(&self, address: u64) -> Endian {
        self.processor().byte_order(address)
    }

    fn save(&self) -> Vec<u8> {
        self.processor().save()
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.processor_mut().load(bytes)
    }

    fn own_ranges(&self) -> Vec<Range<u64>> {
        self.processor().own_ranges()
    }

    fn host_call(&self, read: &mut dyn FnMut(u64, Width) -> Option<u64>) -> Option<HostCall> {
        self.processor().host_call(read)
    }

    fn answer_host_call(&mut self, answer: Option<u64>) {
        self.processor_mut().answer_host_call(answer);
    }
}
