//! SPI1 and the four chip selects: what is done with them byte by byte.

use embassy_stm32::gpio::Output;
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::SPI1;
use embassy_stm32::pac::spi::regs::Cr1;
use embassy_stm32::pac::spi::vals::{Br, Dff};
use embassy_stm32::spi::{Spi, mode::Master};
use firmware_display::Readback;
use firmware_display::dac81416::{CHIPS, MAX_CLOCK_HZ};
use firmware_display::look::{self, Look};

/// The processor's.
pub const CYCLES_PER_US: u32 = 168;
/// Looks at a flag that is due, before it is given up: a microsecond and more.
pub const LOOKS: usize = 32;
const CYCLES_PER_BIT: u32 = CYCLES_PER_US * 1_000_000 / MAX_CLOCK_HZ;
/// Reading is this much slower than writing, as a power of two: 10.5 MHz.
const SLOWER: u32 = 2;
/// What a byte takes then, and two bits more.
const BYTE_CYCLES: u32 = (8 + 2) * (CYCLES_PER_BIT << SLOWER);

/// What SPI1 takes at once.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// 8 bits.
    Byte,
    /// 16 bits.
    Word,
}

/// SPI1 and what it is wired to.
pub struct Bus {
    _spi: Spi<'static, Blocking, Master>,
    /// CR1 as it was set up, for bytes, off.
    off: Cr1,
    select: [Output<'static>; CHIPS],
}

impl Bus {
    /// The bus of `spi`, set up for bytes.
    pub fn new(spi: Spi<'static, Blocking, Master>, select: [Output<'static>; CHIPS]) -> Self {
        let mut off = SPI1.cr1().read();
        off.set_spe(false);
        off.set_dff(Dff::BITS8);
        Self {
            _spi: spi,
            off,
            select,
        }
    }

    /// Makes a chip listen.
    pub fn select(&mut self, chip: usize) {
        self.select[chip].set_low();
    }

    /// Ends what a chip heard.
    pub fn deselect(&mut self, chip: usize) {
        self.select[chip].set_high();
    }

    /// Sets the width, which SPI1 takes only while it is off (RM0090, 28.5.1), with nothing under way.
    pub fn set_width(&mut self, width: Width) {
        let mut on = self.off;
        if width == Width::Word {
            on.set_dff(Dff::BITS16);
        }
        self.turn_on(on);
    }

    fn turn_on(&mut self, mut control: Cr1) {
        SPI1.cr1().write_value(self.off);
        control.set_spe(true);
        SPI1.cr1().write_value(control);
    }

    /// Sends a byte, in [`Width::Byte`].
    pub fn put(&mut self, byte: u8) {
        SPI1.dr().write(|w| w.set_dr(byte.into()));
    }

    /// Makes ready to read, at a quarter of the clock, for SDO, which the family reads slower than it
    /// writes.
    fn listen(&mut self) {
        let mut slow = self.off;
        slow.set_br(Br::from_bits(self.off.br().to_bits() + SLOWER as u8));
        self.turn_on(slow);
        // What came in while nobody listened, and that it was too much.
        let _ = SPI1.dr().read();
        let _ = SPI1.sr().read();
    }

    /// Sends three bytes under one chip select and returns those that came back.
    ///
    /// Each has its time and is then taken to be there: had SPI1 not sent it, what is read is an answer
    /// to nothing.
    fn exchange_frame(&mut self, chip: usize, bytes: look::Bytes) -> look::Bytes {
        self.select(chip);
        let answer = bytes.map(|byte| {
            self.put(byte);
            wait(BYTE_CYCLES);
            SPI1.dr().read().dr() as u8
        });
        self.deselect(chip);
        answer
    }

    /// Sends three bytes to `chip` and returns those that came back; None if SPI1 does not send.
    pub fn exchange(&mut self, chip: usize, bytes: look::Bytes) -> Option<look::Bytes> {
        self.listen();
        let answer = self.exchange_frame(chip, bytes);
        is_shifted_out(0).then_some(answer)
    }

    /// Looks into a chip, some 16 µs; None if SPI1 does not send, for then nothing is learned of the chip. LDAC's edge may
    /// come meanwhile: it is no part of the bus, and the words have been in the buffers since before.
    pub fn look(&mut self, look: &Look) -> Option<Readback> {
        self.listen();
        let answers = look
            .frames()
            .map(|frame| self.exchange_frame(look.chip, frame));
        if look.agrees(&answers) {
            return Some(Readback::Agrees);
        }
        is_shifted_out(0).then_some(Readback::Differs)
    }
}

/// Waits for SPI1's last `bytes` to be out; false if they don't go. One bit more than they take, because
/// the STM32F4's BSY is said to fall before the last edge does.
pub fn is_shifted_out(bytes: u32) -> bool {
    wait((8 * bytes + 1) * CYCLES_PER_BIT);
    (0..LOOKS).any(|_| {
        let status = SPI1.sr().read();
        status.txe() && !status.bsy()
    })
}

/// Waits for a byte to be out that was put just now, and four bits more.
pub fn wait_for_byte() {
    wait((8 + 4) * CYCLES_PER_BIT);
}

/// Waits for `cycles` at least. A turn of the loop takes a Cortex-M4 three: one to subtract, two to
/// branch.
#[inline]
pub fn wait(cycles: u32) {
    cortex_m::asm::delay(cycles.div_ceil(3));
}
