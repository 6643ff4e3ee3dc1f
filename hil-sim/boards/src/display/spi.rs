//! SPI1 and the four converters on it.
//!
//! It stands in for the emulator's own SPI1, at which the board stops for every word: 110 000 times a second in
//! travelling mode. Here the words of a DMA transfer are taken as soon as the stream has them, all but the last, and
//! each crosses the wire at the instant at which it would have. The stream is asked for its last word when it would
//! have been, so it interrupts when it should. Whoever looks at SPI1 meanwhile, or moves a chip select, finds what it
//! would have found. The one difference: the stream reads a frame from memory as it begins, and so it counts down, and
//! says that half is done, too early; and one that is switched off in the middle has left more words to SPI1.
//!
//! As RM0090, chapter 28, has it, for a master that sends and receives 8 or 16 bits, the highest first. Left out, for
//! the display's firmware uses none of it: CRC, receive-only and one-wire transfers, a slave, interrupts, requests to
//! read, mode faults, I2S. A word that waits while SPI1 is switched off is lost here; the part keeps one.

use std::collections::VecDeque;

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::Bus;
use rigless::soc::stm32f427::generated::dma2::{self, s3cr};
use rigless::soc::stm32f427::generated::spi1::{Register, cr1, cr2, sr};
use rigless::time::{EventId, Run, VirtualNanos};

use crate::dac81416::{CHANNELS, Dac81416};

/// Chips on the bus.
pub const CHIPS: usize = 4;
/// Chip selects: D10 D9 D8 D7.
const SELECTS: [(&str, usize); CHIPS] =
    [("GPIOD", 14), ("GPIOD", 15), ("GPIOF", 12), ("GPIOF", 13)];
/// SPI1's request for a word to send, as the emulator numbers its requests.
const TRANSMIT_REQUEST: usize = 1;
/// Whose stream 3 feeds SPI1.
const STREAM_OF: &str = "DMA2";
/// What an open line is pulled to.
const ONES: u8 = 0xFF;

/// A chip on the bus, and when its voltages last changed.
#[derive(Debug, Default)]
pub struct OnBus {
    /// The chip itself.
    pub chip: Dac81416,
    /// What its channels put out, in V.
    pub volts: [f64; CHANNELS],
    /// When they changed, until it is taken.
    pub changed_ns: Option<u64>,
    /// Whether its SDI hears nothing but ones.
    pub sdi_open: bool,
    /// Whether nothing of its SDO is heard but ones.
    pub sdo_open: bool,
    is_selected: bool,
}

impl OnBus {
    /// A byte over its wires, both ways.
    fn byte(&mut self, mosi: u8) -> u8 {
        let heard = if self.sdi_open { ONES } else { mosi };
        let said = self.chip.transfer(heard);
        if self.sdo_open { ONES } else { said }
    }

    /// Does something to the chip at `at_ns` and sees what comes of it.
    pub fn drive<R>(&mut self, at_ns: u64, act: impl FnOnce(&mut Dac81416) -> R) -> R {
        let result = act(&mut self.chip);
        let volts = std::array::from_fn(|channel| self.chip.voltage(channel));
        if volts != self.volts {
            self.volts = volts;
            self.changed_ns = Some(at_ns);
        }
        result
    }
}

/// 8 or 16 bits on the wire, or waiting for it.
#[derive(Clone, Copy, Debug)]
struct Word {
    bits: u8,
    value: u16,
    ends: VirtualNanos,
}

/// SPI1, with the chips.
#[derive(Debug, Default)]
pub struct Spi {
    /// The chips, as what had crossed at the last look at SPI1 has left them.
    pub chips: [OnBus; CHIPS],
    /// What the stream has still to hand over, the word that it is about to write included.
    to_come: u64,
    /// The slot of [`STREAM_OF`].
    stream: Option<usize>,
    clock_hz: u64,
    /// The first is on the wire.
    words: VecDeque<Word>,
    run: Option<Run>,
    received: u16,
    /// RXNE and OVR, and whether DR was read while OVR stood (28.3.10).
    is_received: bool,
    is_overrun: bool,
    overrun_was_read: bool,
    asks: bool,
    /// When the buffer will be free again.
    free: Option<EventId>,
}

impl Spi {
    /// Takes down how many words the stream that feeds SPI1 has still to hand over.
    pub fn expect_words(&mut self, bus: &Bus) {
        let slot = || bus.slot(STREAM_OF).expect("the part has two");
        let stream = bus.slots()[*self.stream.get_or_insert_with(slot)].registers();
        let is_on = s3cr::EN.is_set(stream.get(dma2::Register::S3cr));
        self.to_come = if is_on {
            stream.get(dma2::Register::S3ndtr)
        } else {
            0
        };
    }

    /// The chips, with all that they have been sent until `at_ns`.
    pub fn chips_at(&mut self, at_ns: u64) -> &mut [OnBus; CHIPS] {
        self.catch_up(VirtualNanos(at_ns));
        &mut self.chips
    }

    /// The part has been reset, with the clock off; the chips have not.
    pub fn restart(&mut self, at_ns: u64) {
        self.catch_up(VirtualNanos(at_ns));
        let chips = std::mem::take(&mut self.chips);
        *self = Self {
            chips: chips.map(|chip| OnBus {
                is_selected: false,
                ..chip
            }),
            ..Self::default()
        };
    }

    /// Lets each word cross that has had its time.
    fn catch_up(&mut self, now: VirtualNanos) {
        while let Some(word) = self.words.pop_front_if(|word| word.ends <= now) {
            let mut answers = self.chips.iter_mut().filter(|chip| chip.is_selected);
            let answer = answers.next().map_or(0, |chip| cross(chip, word));
            // Where two speak at once nobody can say what is heard.
            let fights = answers.fold(false, |_, chip| {
                cross(chip, word);
                true
            });
            if self.is_received {
                self.is_overrun = true;
            } else {
                self.is_received = true;
                self.received = if fights { 0 } else { answer };
            }
        }
    }

    fn begin(&mut self, value: u16, registers: &RegisterFile, now: VirtualNanos) {
        let control = registers.get(Register::Cr1);
        let bits = if cr1::DFF.is_set(control) { 16 } else { 8 };
        let baud_hz = self.clock_hz / (2 << cr1::BR.get(control));
        if !cr1::SPE.is_set(control) || baud_hz == 0 {
            return;
        }
        let is_busy = |run: &Run| run.ends > now;
        let mut run = self.run.filter(is_busy).unwrap_or(Run::at(now));
        run.extend(bits.into(), baud_hz);
        self.run = Some(run);
        self.words.push_back(Word {
            bits,
            value,
            ends: run.ends,
        });
    }

    /// Loses all words but so many, the first ones.
    fn cut_off(&mut self, kept: usize) {
        self.words.truncate(kept);
        self.run = self.words.back().map(|word| Run::at(word.ends));
    }

    /// Asks for the next word, or no more, as the buffer is: see 28.3.9.
    fn ask(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let waiting = self.words.len().saturating_sub(1);
        let is_free = waiting == 0 || self.to_come > 2;
        if !is_free && self.free.is_none() {
            // The last of them takes to the wire when the one before has crossed.
            self.free = Some(context.schedule(self.words[waiting - 1].ends));
        }
        let asks = is_free && cr2::TXDMAEN.is_set(registers.get(Register::Cr2));
        if asks != self.asks {
            self.asks = asks;
            context.request(TRANSMIT_REQUEST, Level::from(asks));
        }
    }

    fn status(&self, registers: &RegisterFile) -> u64 {
        let is_on = cr1::SPE.is_set(registers.get(Register::Cr1));
        let flags = [
            (sr::RXNE, self.is_received),
            (sr::TXE, self.words.len() <= 1),
            (sr::OVR, self.is_overrun),
            (sr::BSY, is_on && !self.words.is_empty()),
        ];
        let raised = flags.into_iter().filter(|(_, is_raised)| *is_raised);
        raised.map(|(flag, _)| flag.mask()).sum()
    }
}

fn cross(chip: &mut OnBus, word: Word) -> u16 {
    let [high, low] = word.value.to_be_bytes();
    if word.bits == 8 {
        return chip.byte(low).into();
    }
    u16::from_be_bytes([chip.byte(high), chip.byte(low)])
}

impl Device for Spi {
    type Register = Register;

    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.catch_up(context.now());
        match register {
            Register::Dr => {
                self.is_received = false;
                self.overrun_was_read = self.is_overrun;
                Some(self.received.into())
            }
            Register::Sr => {
                let status = self.status(registers);
                if std::mem::take(&mut self.overrun_was_read) {
                    self.is_overrun = false;
                }
                Some(status)
            }
            _ => None,
        }
    }

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.catch_up(context.now());
        match register {
            Register::Dr => self.begin(value as u16, registers, context.now()),
            Register::Cr1 if !cr1::SPE.is_set(value) => self.cut_off(1),
            _ => {}
        }
        self.ask(registers, context);
    }

    fn on_event(
        &mut self,
        event: EventId,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if self.free == Some(event) {
            self.free = None;
            self.catch_up(context.now());
            self.ask(registers, context);
        }
    }

    fn on_request(
        &mut self,
        change: RequestChange,
        _registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let is_wire = |&(port, pin): &_| (pin, port) == (change.request, change.instance);
        let Some(nth) = SELECTS.iter().position(is_wire) else {
            return;
        };
        let is_selected = change.level == Level::Low;
        let on_bus = &mut self.chips_at(context.now().0)[nth];
        if is_selected == on_bus.is_selected {
            return;
        }
        on_bus.is_selected = is_selected;
        if is_selected {
            on_bus.chip.select();
        } else {
            on_bus.drive(context.now().0, Dac81416::deselect);
        }
    }

    /// A word that is on its way when the clock stops is lost.
    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.catch_up(context.now());
        self.clock_hz = hz;
        if hz == 0 {
            self.cut_off(0);
            self.free = None;
            return;
        }
        self.ask(registers, context);
    }

    fn reset_line(&mut self, _registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.catch_up(context.now());
        if self.asks {
            context.request(TRANSMIT_REQUEST, Level::Low);
        }
        *self = Self {
            chips: std::mem::take(&mut self.chips),
            clock_hz: self.clock_hz,
            ..Self::default()
        };
    }
}

#[cfg(test)]
mod tests {
    use rigless::chip::Timeline;
    use rigless::chip::spi::Peer;
    use rigless::machine::Board;
    use rigless::mcu::Mcu;
    use rigless::snapshot::Store;
    use rigless::soc::stm32f427::Stm32f427;
    use rigless::soc::stm32f427::generated::{DMA2, GPIOD, RCC, SPI1};
    use rigless::soc::stm32f427::peripherals::gpio::Pin;
    use rigless::soc::stm32f427::peripherals::spi::Select;

    use super::*;
    use crate::dac81416::Counters;
    use crate::display::DisplayPins;
    use crate::nucleo::Nucleo;
    use crate::nucleo::by_hand::{get, set};
    use hil_sim_core::plant::fault::encoder::EncoderFaults;
    use hil_sim_core::plant::world::World;
    use hil_sim_core::scene::Scene;

    const AHB1ENR: u64 = RCC.base + 0x30;
    const APB2ENR: u64 = RCC.base + 0x44;
    const MODER: u64 = GPIOD.base;
    const BSRR: u64 = GPIOD.base + 0x18;
    const CR1: u64 = SPI1.base;
    const CR2: u64 = SPI1.base + 0x04;
    const SR: u64 = SPI1.base + 0x08;
    const DR: u64 = SPI1.base + 0x0C;
    const LISR: u64 = DMA2.base;
    /// HTIF3.
    const HALF_DONE: u64 = 1 << 26;
    const LIFCR: u64 = DMA2.base + 0x08;
    const S3CR: u64 = DMA2.base + 0x58;
    const NDTR: u64 = DMA2.base + 0x5C;
    const PAR: u64 = DMA2.base + 0x60;
    const M0AR: u64 = DMA2.base + 0x64;

    /// A master with its own select, off; on with bytes; on with words.
    const OFF: u64 = 1 << 2 | 1 << 8 | 1 << 9;
    const BYTES: u64 = OFF | 1 << 6;
    const WORDS: u64 = BYTES | 1 << 11;
    /// BSY.
    const BUSY: u64 = 1 << 7;
    const SELECT: u64 = 1 << (16 + 14);
    const DESELECT: u64 = 1 << 14;
    /// Channel 3, 16 bits, from memory, on.
    const STREAM: u64 = 3 << 25 | 1 << 13 | 1 << 11 | 1 << 10 | 1 << 6 | 1 << 4 | 1;

    /// A frame as the display sends it, its byte at `at_us` and its words a µs and a half later.
    fn frame(at_us: u64, words: u64, ends_us: u64) -> [(u64, u64, u64); 11] {
        let ns = at_us * 1_000;
        [
            (ns, CR1, OFF),
            (ns, CR1, BYTES),
            (ns, BSRR, SELECT),
            (ns, DR, 0x14),
            (ns, M0AR, 0x2000_0000),
            (ns, NDTR, words),
            (ns + 1_500, CR1, OFF),
            (ns + 1_500, CR1, WORDS),
            (ns + 1_500, S3CR, STREAM),
            (ends_us * 1_000, BSRR, DESELECT),
            (ends_us * 1_000, LIFCR, 0x3D << 22),
        ]
    }

    /// Clocks, the chip select's pin, the stream's far end, and SPI1 to ask it.
    const SET_UP: [(u64, u64, u64); 6] = [
        (100, AHB1ENR, 1 << 22 | 1 << 3),
        (100, APB2ENR, 1 << 12),
        (200, BSRR, DESELECT),
        (200, MODER, 1 << 28),
        (200, PAR, DR),
        (200, CR2, 1 << 1),
    ];

    /// What SPI1 and its stream say every 100 ns while frames are sent.
    fn said(mcu: &mut dyn Mcu) -> Vec<(u64, u64)> {
        let frames = [
            // Of one word, two, three, and of a chip's sixteen and one: all whole.
            frame(10, 1, 30),
            frame(40, 2, 60),
            frame(70, 3, 90),
            frame(100, 17, 150),
            // Ended in the middle: the stream off, and what is left of it for nobody.
            frame(200, 9, 210),
        ];
        let off = [(250_000, S3CR, STREAM & !1)];
        let mut script = SET_UP
            .into_iter()
            .chain(frames.into_iter().flatten())
            .chain(off)
            .peekable();
        let mut said = Vec::new();
        for at_ns in (100..300_000).step_by(100) {
            while let Some((_, address, value)) = script.next_if(|row| row.0 <= at_ns) {
                set(mcu, at_ns, address, value);
            }
            if at_ns > 200 {
                said.push((get(mcu, at_ns, SR), get(mcu, at_ns, LISR) & !HALF_DONE));
            }
            // Somebody reads what came back, now and then.
            if at_ns % 45_000 == 0 {
                said.push((get(mcu, at_ns, DR), 0));
            }
        }
        said
    }

    #[derive(Debug, Default)]
    struct Alone(Dac81416);

    impl Store for Alone {}

    impl Peer for Alone {
        fn transfer(&mut self, mosi: u32, bits: u8, _context: &mut Timeline<'_, '_>) -> u32 {
            let bytes = &mosi.to_be_bytes()[4 - usize::from(bits / 8)..];
            let answers = bytes.iter().map(|&byte| u32::from(self.0.transfer(byte)));
            answers.fold(0, |word, byte| word << 8 | byte)
        }

        fn select(&mut self, _context: &mut Timeline<'_, '_>) {
            self.0.select();
        }

        fn deselect(&mut self, _context: &mut Timeline<'_, '_>) {
            self.0.deselect();
        }
    }

    /// What it said, and what the chip makes of it.
    type Outcome = (Vec<(u64, u64)>, Counters, Vec<crate::dac81416::Fault>);

    fn here() -> Outcome {
        let world = World::new(&Scene::constant(2.0, 50.0)).unwrap();
        let pins = DisplayPins::new(world, EncoderFaults::of_hand(&[]));
        let mut board = Nucleo::new(pins, DisplayPins::fit).unwrap();
        let said = said(board.mcu(0).unwrap());
        let chip = &board.pins().0.spi.chips[0].chip;
        (said, chip.counters(), chip.faults().to_vec())
    }

    fn emulators() -> Outcome {
        let mut part = Stm32f427::new().unwrap();
        let select = Select {
            port: "GPIOD",
            pin: Pin::new(14).unwrap(),
            active: Level::Low,
        };
        part.spi[0].attach_selected(Alone::default(), select);
        let said = said(&mut part);
        let chip = &part.spi[0].chip_mut::<Alone>(0).unwrap().0;
        (said, chip.counters(), chip.faults().to_vec())
    }

    #[test]
    fn what_is_cut_off_holds_up_no_word_that_comes_after_it() {
        let world = World::new(&Scene::constant(2.0, 50.0)).unwrap();
        let pins = DisplayPins::new(world, EncoderFaults::of_hand(&[]));
        let mut board = Nucleo::new(pins, DisplayPins::fit).unwrap();
        let mcu = board.mcu(0).unwrap();
        for (at_ns, address, value) in SET_UP.into_iter().chain(frame(10, 17, 13)) {
            set(mcu, at_ns, address, value);
        }
        // Before the first of seventeen words has crossed, the stream is switched off, and SPI1 off and on again.
        for (address, value) in [(S3CR, STREAM & !1), (CR1, OFF), (CR1, BYTES)] {
            set(mcu, 13_250, address, value);
        }
        // That word ends at 13.5 µs, at 8 MHz; a byte behind it takes 1 µs.
        set(mcu, 13_300, DR, 0x14);
        assert_ne!(get(mcu, 14_400, SR) & BUSY, 0);
        assert_eq!(get(mcu, 14_600, SR) & BUSY, 0);
    }

    #[test]
    fn words_cross_and_the_stream_ends_when_the_emulators_own_spi1_has_them() {
        let (here, counters, faults) = here();
        let (emulators, their_counters, their_faults) = emulators();
        let differs = here.iter().zip(&emulators).position(|(a, b)| a != b);
        assert_eq!(
            differs,
            None,
            "{:x?}",
            differs.map(|at| (here[at], emulators[at]))
        );
        assert_eq!(here.len(), emulators.len());
        assert_eq!((counters, faults), (their_counters, their_faults));
        // Five frames reached the chip.
        assert_eq!(counters.frames, 5);
    }
}
