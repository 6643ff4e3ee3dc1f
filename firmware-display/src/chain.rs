//! The way to the four converters: a frame for each on SPI1, by DMA, and one edge of LDAC for all.
//!
//! ```text
//! tick ─> select 1, stream on ─interrupt─> deselect 1, select 2, stream on ─ … ─interrupt─> deselect 4, arm LDAC
//!                                                                    then, if it is time: a look into one chip
//! ```
//!
//! SPI1 and its DMA stream are set up once and stay on, so that a frame costs few accesses to registers;
//! embassy's `Spi::write` sets both up for each transfer and polls for its end. The task sleeps
//! meanwhile, and learns at the next tick how it went. A frame is an odd number of bytes: its first goes
//! by itself, and the words by the stream, half as many transfers as if they went byte by byte.

use core::cell::RefCell;
use core::sync::atomic::{Ordering, fence};

use embassy_stm32::Peri;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::typelevel::{DMA2_STREAM3 as Interrupt, Handler, Interrupt as _};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::dma::regs::{Cr, Fcr, Ixr, Ndtr};
use embassy_stm32::pac::dma::vals::{Dir, Dmdis, Pl, Size};
use embassy_stm32::pac::{DMA2, SPI1};
use embassy_stm32::peripherals::{self, DMA2_CH3};
use embassy_stm32::spi::{Spi, TxDma, mode::Master};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use firmware_display::dac81416::{CHIPS, Frame, Frames};
use firmware_display::look::{self, Look};
use firmware_display::{ACTUATORS, Readback, Transfer};
use static_cell::StaticCell;

use crate::bus::{self, Bus, Width};
use crate::{load, ticks};

const STREAM: usize = 3;
/// From the last word to LDAC at least, in µs. A broadcast takes 4 µs: the family's t_BCASTWAIT (DAC81408,
/// SLASER3A), read on the safe side as the time that the buffers take. For any other word the family asks
/// for 80 ns (DAC81404, SLASEH2A).
const LEAST_TO_LOAD_US: u32 = 4;

/// The task's end: fills the frames, starts them, and asks how they went.
pub struct Chain {
    frames: &'static mut Frames,
}

impl Chain {
    /// The way by SPI1, `spi` in 8-bit words and `stream`, to the chips behind `select`. To be called
    /// once.
    pub fn new(
        spi: Spi<'static, Blocking, Master>,
        stream: Peri<'static, DMA2_CH3>,
        select: [Output<'static>; CHIPS],
    ) -> Self {
        static FRAMES: StaticCell<Frames> = StaticCell::new();
        let control = control(TxDma::<peripherals::SPI1>::request(&*stream));
        let line = Line {
            bus: Bus::new(spi, select),
            control,
            _stream: stream,
            shipments: [Shipment::default(); CHIPS],
            look: None,
            readback: Readback::None,
            state: State::Idle,
        };
        LINE.lock(|place| place.replace(Some(line)));
        Self {
            frames: FRAMES.init(Frames::ZERO_VOLT),
        }
    }

    /// Writes `bytes` to `chip`, waits, and returns what came back meanwhile; None if SPI1 does not send.
    /// For start-up, before [`Chain::open`].
    pub fn exchange(&mut self, chip: usize, bytes: look::Bytes) -> Option<look::Bytes> {
        with_line(|line| line.bus.exchange(chip, bytes)).flatten()
    }

    /// Makes ready for [`Chain::send`].
    pub fn open(&mut self) {
        with_line(|line| line.open());
    }

    /// Starts an update of all channels to `words`; they change together with LDAC's next edge. Once
    /// they are out, looks into a chip, if asked to. [`Chain::finish`] comes between two of these.
    pub fn send(&mut self, words: &[u16; ACTUATORS], look: Option<Look>) {
        self.frames.set(words);
        let shipments = self.frames.each().map(Shipment::of);
        with_line(|line| {
            line.shipments = shipments;
            line.look = look;
            line.send(0);
        });
    }

    /// Looks into a chip while nothing is sent, and waits for it.
    pub fn look(&mut self, look: Look) {
        with_line(|line| line.look(&look));
    }

    /// How the last update went, if it has not been told yet, and the last look. An update that is still
    /// going on is aborted, and the way is made ready for the next.
    pub fn finish(&mut self) -> (Transfer, Readback) {
        with_line(|line| {
            let readback = core::mem::take(&mut line.readback);
            (line.finish(), readback)
        })
        .unwrap_or_default()
    }
}

/// The interrupt's end, shared with the task for moments.
static LINE: Mutex<CriticalSectionRawMutex, RefCell<Option<Line>>> = Mutex::new(RefCell::new(None));

/// Nothing only before [`Chain::new`]: the lock leaves nobody to hold a second borrow.
fn with_line<R>(act: impl FnOnce(&mut Line) -> R) -> Option<R> {
    LINE.lock(|line| line.try_borrow_mut().ok()?.as_mut().map(act))
}

/// Answers DMA2 stream 3: a frame is in SPI1, or something is wrong. Deadline: LDAC's edge, for the four;
/// missed, they are sent again. It comes before the tick, so it must not come for ever: an interrupt that
/// cannot be ended is not heard until the way is set up anew.
pub struct FrameHandler;

impl Handler<Interrupt> for FrameHandler {
    #[allow(unsafe_code, reason = "the trait's signature")]
    unsafe fn on_interrupt() {
        with_line(Line::on_interrupt);
    }
}

/// A frame as SPI1 and the stream's registers take it.
#[derive(Clone, Copy, Default)]
struct Shipment {
    register: u8,
    address: u32,
    words: u16,
}

impl Shipment {
    fn of(frame: Frame<'_>) -> Self {
        Self {
            register: frame.register,
            address: frame.words.as_ptr() as u32,
            words: frame.words.len() as u16,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    /// This chip's frame is on its way.
    Sending(usize),
    /// All are in the chips, and LDAC is to fall.
    Armed,
    /// All are in the chips, but too late for this tick's edge.
    Late,
    Failed,
}

struct Line {
    bus: Bus,
    /// The stream's control register, enabled.
    control: Cr,
    _stream: Peri<'static, DMA2_CH3>,
    shipments: [Shipment; CHIPS],
    look: Option<Look>,
    readback: Readback,
    state: State,
}

impl Line {
    /// Sets the stream up, off, its interrupt heard, and SPI1 to ask it for words.
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
        hear();
        SPI1.cr2().modify(|w| w.set_txdmaen(true));
    }

    fn send(&mut self, chip: usize) {
        let Shipment {
            register,
            address,
            words,
        } = self.shipments[chip];
        self.state = State::Sending(chip);
        self.bus.set_width(Width::Byte);
        self.bus.select(chip);
        self.bus.put(register);
        let stream = DMA2.st(STREAM);
        stream.m0ar().write_value(address);
        stream.ndtr().write_value(Ndtr(words.into()));
        // Had the byte not gone, neither would the words that follow it.
        bus::wait_for_byte();
        self.bus.set_width(Width::Word);
        // The frame is in RAM before the stream reads it.
        fence(Ordering::SeqCst);
        stream.cr().write_value(self.control);
    }

    fn on_interrupt(&mut self) {
        let flags = DMA2.isr(0).read();
        DMA2.ifcr(0).write_value(FLAGS);
        let has_failed = flags.teif(STREAM);
        if !has_failed && !flags.tcif(STREAM) {
            // Without a clock DMA2 neither says what it asks for nor hears the answer. It would ask for ever, and
            // no tick would be served.
            Interrupt::disable();
            return;
        }
        let State::Sending(chip) = self.state else {
            return;
        };
        if has_failed {
            self.fail(chip);
        } else {
            self.on_sent(chip);
        }
    }

    fn on_sent(&mut self, chip: usize) {
        // The stream is done as soon as the last word is in SPI1's buffer, with one before it perhaps: of
        // their four bytes two have gone until here.
        if !bus::is_shifted_out(2) {
            self.fail(chip);
            return;
        }
        self.bus.deselect(chip);
        if chip + 1 < CHIPS {
            self.send(chip + 1);
            return;
        }
        self.state = if !load::is_high() {
            // The tick raised it: something holds the wire down.
            State::Failed
        } else if load::arm(LEAST_TO_LOAD_US) {
            State::Armed
        } else {
            State::Late
        };
        if let Some(look) = self.look.take() {
            self.look(&look);
        }
    }

    /// Looks into a chip. An SPI1 that does not send fails as it does for words, so that it and no chip is to blame.
    fn look(&mut self, look: &Look) {
        match self.bus.look(look) {
            Some(readback) => self.readback = readback,
            None => self.state = State::Failed,
        }
    }

    fn fail(&mut self, chip: usize) {
        self.close(chip);
        self.state = State::Failed;
    }

    fn finish(&mut self) -> Transfer {
        let state = core::mem::replace(&mut self.state, State::Idle);
        // The stream has read the frames before they are written again.
        fence(Ordering::SeqCst);
        match state {
            State::Idle => Transfer::Done,
            State::Armed if ticks::loaded() => Transfer::Done,
            // The edge did not come: the wire does not follow, or all was too late.
            State::Armed | State::Late => Transfer::Stalled,
            State::Failed => Transfer::Failed,
            State::Sending(chip) => {
                self.close(chip);
                Transfer::Stalled
            }
        }
    }

    /// Ends `chip`'s frame where it is and sets everything up anew.
    fn close(&mut self, chip: usize) {
        let stream = DMA2.st(STREAM);
        stream.cr().modify(|w| w.set_en(false));
        // It ends after the access under way.
        let _ = (0..bus::LOOKS).any(|_| !stream.cr().read().en());
        // If words are stuck there is no more to be done about them than this.
        let _ = bus::is_shifted_out(4);
        self.bus.deselect(chip);
        self.look = None;
        self.open();
    }
}

/// Lets the stream interrupt from now on. What its interrupt was for until now has been answered, and an interrupt
/// without a flag would look like a DMA2 that is silent.
fn hear() {
    Interrupt::unpend();
    #[allow(
        unsafe_code,
        reason = "unmasking an interrupt whose handler is bound in board.rs"
    )]
    // SAFETY: no critical section relies on this interrupt being masked.
    unsafe {
        Interrupt::enable();
    }
}

/// Stream 3's flags of LISR. FEIF is among them, but is no fault: a stream in direct mode raises it if
/// SPI1 asks before the first word has been fetched, as it does here, and loses nothing (RM0090,
/// 10.3.18).
const FLAGS: Ixr = Ixr(0x3D << 22);

/// Memory to SPI1, word by word, enabled, with interrupts at the end and at an error, on `request`.
fn control(request: u8) -> Cr {
    let mut control = Cr(0);
    control.set_chsel(request);
    control.set_pl(Pl::HIGH);
    control.set_minc(true);
    control.set_msize(Size::BITS16);
    control.set_psize(Size::BITS16);
    control.set_dir(Dir::MEMORY_TO_PERIPHERAL);
    control.set_tcie(true);
    control.set_teie(true);
    control.set_en(true);
    control
}
