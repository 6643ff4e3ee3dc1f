//! The way to the four converters: a frame for each on SPI1, by DMA, and one edge of LDAC for all.
//!
//! ```text
//! tick ─> select 1, stream on ─interrupt─> deselect 1, select 2, stream on ─ … ─interrupt─> deselect 4, LDAC
//! ```
//!
//! SPI1 and its DMA stream are set up once and stay on, so that a frame costs eight accesses to
//! registers; embassy's `Spi::write` sets both up for each transfer and polls for its end. The task
//! sleeps meanwhile, and learns at the next tick how it went.

use core::cell::RefCell;
use core::sync::atomic::{Ordering, fence};

use embassy_stm32::Peri;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::typelevel::{self, Handler};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::dma::regs::{Cr, Fcr, Ixr, Ndtr};
use embassy_stm32::pac::dma::vals::{Dir, Dmdis, Pl};
use embassy_stm32::pac::{DMA2, SPI1};
use embassy_stm32::peripherals::{self, DMA2_CH3};
use embassy_stm32::spi::{self, Spi, TxDma, mode::Master};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use firmware_display::ACTUATORS;
use firmware_display::dac81416::{self, CHIPS, Frame};
use static_cell::StaticCell;

const STREAM: usize = 3;
const CYCLES_PER_US: u32 = 168;
const CYCLES_PER_BIT: u32 = CYCLES_PER_US * 1_000_000 / dac81416::MAX_CLOCK_HZ;
/// The stream is done as soon as the last byte is in SPI1's buffer, when up to two bytes are still to
/// be shifted out. One bit more, because the STM32F4's BSY is said to fall before the last edge does.
const LAST_BYTES_CYCLES: u32 = (2 * 8 + 1) * CYCLES_PER_BIT;
/// From a broadcast to LDAC, 4 µs: the family's t_BCASTWAIT (DAC81408, SLASER3A), read on the safe side
/// as the time that the buffers take.
const BROADCAST_CYCLES: u32 = 4 * CYCLES_PER_US;
/// From a word to LDAC, and from LDAC's fall to its rise, 0.1 µs; the family asks for 80 and 20 ns
/// (DAC81404, SLASEH2A).
const LOAD_CYCLES: u32 = CYCLES_PER_US / 10 + 1;
/// Looks at a flag that is due, before it is given up: a microsecond and more.
const LOOKS: usize = 32;

/// Why an update did not reach the converters: their outputs are those of the last that did, their
/// buffers may hold anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The stream could not read the frames, or SPI1 did not send what it was given.
    Transfer,
    /// It was still going on when the next tick came.
    Stall,
}

/// The task's end: fills the frames, starts them, and asks how they went.
pub struct Chain {
    frames: &'static mut [Frame; CHIPS],
}

impl Chain {
    /// The way by SPI1, `spi` in 8-bit words and `stream`, to the chips behind `select`, with `load` on
    /// all their LDACs. To be called once.
    pub fn new(
        spi: Spi<'static, Blocking, Master>,
        stream: Peri<'static, DMA2_CH3>,
        select: [Output<'static>; CHIPS],
        load: Output<'static>,
    ) -> Self {
        static FRAMES: StaticCell<[Frame; CHIPS]> = StaticCell::new();
        let control = control(TxDma::<peripherals::SPI1>::request(&*stream));
        let line = Line {
            spi,
            control,
            _stream: stream,
            select,
            load,
            transfers: [Transfer::default(); CHIPS],
            state: State::Idle,
        };
        LINE.lock(|place| place.replace(Some(line)));
        Self {
            frames: FRAMES.init([Frame::ZERO_VOLT; CHIPS]),
        }
    }

    /// Writes `bytes` to each chip and waits, with interrupts held off while a chip is selected: for
    /// start-up, three bytes at a time, before [`Chain::open`].
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), spi::Error> {
        (0..CHIPS).try_for_each(|chip| with_line(|line| line.write(chip, bytes)).unwrap_or(Ok(())))
    }

    /// Makes ready for [`Chain::send`].
    pub fn open(&mut self) {
        with_line(|line| line.open());
    }

    /// Starts an update of all channels to `words`; they change together, some 50 µs later.
    /// [`Chain::finish`] comes between two of these.
    pub fn send(&mut self, words: &[u16; ACTUATORS]) {
        dac81416::stream(words, self.frames);
        let transfers = self.frames.each_ref().map(Transfer::of);
        with_line(|line| {
            line.transfers = transfers;
            line.send(0);
        });
    }

    /// How the last update went, if it has not been told yet. One that is still going on is aborted,
    /// and the way is made ready for the next.
    pub fn finish(&mut self) -> Result<(), Fault> {
        with_line(Line::finish).unwrap_or(Ok(()))
    }
}

/// The interrupt's end, shared with the task for moments.
static LINE: Mutex<CriticalSectionRawMutex, RefCell<Option<Line>>> = Mutex::new(RefCell::new(None));

/// Nothing only before [`Chain::new`]: the lock leaves nobody to hold a second borrow.
fn with_line<R>(act: impl FnOnce(&mut Line) -> R) -> Option<R> {
    LINE.lock(|line| line.try_borrow_mut().ok()?.as_mut().map(act))
}

/// Answers DMA2 stream 3: a frame is in SPI1, or something is wrong. Deadline: 450 µs for the four, the
/// rest of the tick; missed, the next tick aborts them.
pub struct FrameHandler;

impl Handler<typelevel::DMA2_STREAM3> for FrameHandler {
    #[allow(unsafe_code, reason = "the trait's signature")]
    unsafe fn on_interrupt() {
        with_line(Line::on_interrupt);
    }
}

/// Where a frame is, as the stream's registers take it.
#[derive(Clone, Copy, Default)]
struct Transfer {
    address: u32,
    length: u16,
    is_broadcast: bool,
}

impl Transfer {
    fn of(frame: &Frame) -> Self {
        let bytes = frame.bytes();
        Self {
            address: bytes.as_ptr() as u32,
            length: bytes.len() as u16,
            is_broadcast: frame.is_broadcast(),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    /// This chip's frame is on its way.
    Sending(usize),
    Failed,
}

struct Line {
    spi: Spi<'static, Blocking, Master>,
    /// The stream's control register, enabled.
    control: Cr,
    _stream: Peri<'static, DMA2_CH3>,
    select: [Output<'static>; CHIPS],
    load: Output<'static>,
    transfers: [Transfer; CHIPS],
    state: State,
}

impl Line {
    fn write(&mut self, chip: usize, bytes: &[u8]) -> Result<(), spi::Error> {
        self.select[chip].set_low();
        let written = self.spi.blocking_write(bytes);
        self.select[chip].set_high();
        written
    }

    /// Sets the stream up, off, and SPI1 to ask it for bytes.
    fn open(&mut self) {
        let stream = DMA2.st(STREAM);
        let mut off = self.control;
        off.set_en(false);
        stream.cr().write_value(off);
        stream.par().write_value(SPI1.dr().as_ptr() as u32);
        let mut direct = Fcr(0);
        direct.set_dmdis(Dmdis::ENABLED);
        stream.fcr().write_value(direct);
        DMA2.ifcr(0).write_value(FLAGS);
        SPI1.cr2().modify(|w| w.set_txdmaen(true));
        SPI1.cr1().modify(|w| w.set_spe(true));
    }

    fn send(&mut self, chip: usize) {
        let Transfer {
            address, length, ..
        } = self.transfers[chip];
        let stream = DMA2.st(STREAM);
        self.state = State::Sending(chip);
        self.select[chip].set_low();
        stream.m0ar().write_value(address);
        stream.ndtr().write_value(Ndtr(length.into()));
        // The frame is in RAM before the stream reads it.
        fence(Ordering::SeqCst);
        stream.cr().write_value(self.control);
    }

    fn on_interrupt(&mut self) {
        let flags = DMA2.isr(0).read();
        DMA2.ifcr(0).write_value(FLAGS);
        let State::Sending(chip) = self.state else {
            return;
        };
        if flags.teif(STREAM) {
            self.fail(chip);
        } else if flags.tcif(STREAM) {
            self.on_sent(chip);
        }
    }

    fn on_sent(&mut self, chip: usize) {
        if !is_shifted_out() {
            self.fail(chip);
            return;
        }
        self.select[chip].set_high();
        if chip + 1 < CHIPS {
            self.send(chip + 1);
            return;
        }
        wait(if self.transfers[chip].is_broadcast {
            BROADCAST_CYCLES
        } else {
            LOAD_CYCLES
        });
        self.load.set_low();
        wait(LOAD_CYCLES);
        self.load.set_high();
        self.state = State::Idle;
    }

    fn fail(&mut self, chip: usize) {
        self.close(chip);
        self.state = State::Failed;
    }

    fn finish(&mut self) -> Result<(), Fault> {
        let state = core::mem::replace(&mut self.state, State::Idle);
        // The stream has read the frames before they are written again.
        fence(Ordering::SeqCst);
        match state {
            State::Idle => Ok(()),
            State::Failed => Err(Fault::Transfer),
            State::Sending(chip) => {
                self.close(chip);
                Err(Fault::Stall)
            }
        }
    }

    /// Ends `chip`'s frame where it is and sets everything up anew.
    fn close(&mut self, chip: usize) {
        let stream = DMA2.st(STREAM);
        stream.cr().modify(|w| w.set_en(false));
        // It ends after the access under way.
        let _ = (0..LOOKS).any(|_| !stream.cr().read().en());
        // If bytes are stuck there is no more to be done about them than this.
        let _ = is_shifted_out();
        self.select[chip].set_high();
        SPI1.cr1().modify(|w| w.set_spe(false));
        self.open();
    }
}

/// Stream 3's flags of LISR. FEIF is among them, but is no fault: a stream in direct mode raises it if
/// SPI1 asks before the first byte has been fetched, as it does here, and loses nothing (RM0090,
/// 10.3.18).
const FLAGS: Ixr = Ixr(0x3D << 22);

/// Memory to SPI1, byte by byte, enabled, with interrupts at the end and at an error, on `request`.
fn control(request: u8) -> Cr {
    let mut control = Cr(0);
    control.set_chsel(request);
    control.set_pl(Pl::HIGH);
    control.set_minc(true);
    control.set_dir(Dir::MEMORY_TO_PERIPHERAL);
    control.set_tcie(true);
    control.set_teie(true);
    control.set_en(true);
    control
}

/// Waits for `cycles` at least. A turn of the loop takes a Cortex-M4 three: one to subtract, two to
/// branch.
fn wait(cycles: u32) {
    cortex_m::asm::delay(cycles.div_ceil(3));
}

/// Waits for SPI1's last two bytes; false if they do not come.
fn is_shifted_out() -> bool {
    wait(LAST_BYTES_CYCLES);
    (0..LOOKS).any(|_| {
        let status = SPI1.sr().read();
        status.txe() && !status.bsy()
    })
}
