//! What is on the display board's pins: the hand's encoder, and four DAC81416 on SPI1 with common
//! LDAC and CLR.

use rigless::chip::Timeline;
use rigless::chip::spi::Peer;
use rigless::device::Level;
use rigless::snapshot::Store;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::GPIOE;
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::stm32f427::peripherals::spi::Select;
use rigless::soc::stm32f427::peripherals::tim;

use super::nucleo::Pins;
use crate::dac81416::Dac81416;
use crate::recording::{ACTUATORS, OutputRecord, TickRecord};
use crate::world::World;

/// Chips on the bus, and the actuators on each but the last.
pub const CHIPS: usize = 4;
const ACTUATORS_PER_CHIP: usize = 13;
/// Chip selects: D10 D9 D8 D7.
const SELECTS: [(&str, u8); CHIPS] = [("GPIOD", 14), ("GPIOD", 15), ("GPIOF", 12), ("GPIOF", 13)];
/// Index of SPI1.
const SPI: usize = 0;
/// LDAC is D5 (PE11): bits of the port's set and reset register.
const LDAC_PIN: u32 = 11;
const BSRR: u64 = 0x18;
const EIGHT_BITS: u8 = 8;

/// A chip behind the emulator's SPI seam.
#[derive(Debug, Default)]
pub struct OnBus(pub Dac81416);

impl Store for OnBus {}

impl Peer for OnBus {
    fn transfer(&mut self, mosi: u32, bits: u8, _context: &mut Timeline<'_, '_>) -> u32 {
        if bits == EIGHT_BITS {
            return self.0.transfer(mosi.to_le_bytes()[0]).into();
        }
        let [low, high, ..] = mosi.to_le_bytes();
        u32::from(self.0.transfer(high)) << 8 | u32::from(self.0.transfer(low))
    }

    fn select(&mut self, _context: &mut Timeline<'_, '_>) {
        self.0.select();
    }

    fn deselect(&mut self, _context: &mut Timeline<'_, '_>) {
        self.0.deselect();
    }
}

/// The display board's surroundings.
#[derive(Debug)]
pub struct DisplayPins {
    world: World,
    clear: Option<Level>,
    /// Every reading of the hand so far.
    pub ticks: Vec<TickRecord>,
    /// Every change of the outputs so far.
    pub outputs: Vec<OutputRecord>,
    /// How often CLR fell, after it was released for the first time.
    pub clears: u32,
}

impl DisplayPins {
    /// The surroundings that `world` describes.
    pub fn new(world: World) -> Self {
        Self { world, clear: None, ticks: Vec::new(), outputs: Vec::new(), clears: 0 }
    }

    /// Wires the converters up.
    pub fn fit(part: &mut Stm32f427) {
        for (port, pin) in SELECTS {
            let pin = Pin::new(pin).expect("a port has sixteen pins");
            part.spi[SPI].attach_selected(
                OnBus::default(),
                Select { port, pin, active: Level::Low },
            );
        }
    }

    /// A write to `address` of `value`: an edge of LDAC, if that is what it makes.
    pub fn on_write(&mut self, part: &mut Stm32f427, address: u64, value: u64, at_ns: u64) {
        if address != GPIOE.base + BSRR {
            return;
        }
        let high = value & (1 << LDAC_PIN) != 0;
        let low = value & (1 << (16 + LDAC_PIN)) != 0;
        if !high && !low {
            return;
        }
        for chip in 0..CHIPS {
            chip_mut(part, chip).ldac(high);
        }
        if low && !high {
            self.record(part, at_ns);
        }
    }

    fn record(&mut self, part: &mut Stm32f427, at_ns: u64) {
        let mut words = [0; ACTUATORS];
        for (actuator, word) in words.iter_mut().enumerate() {
            let volts = chip_mut(part, actuator / ACTUATORS_PER_CHIP)
                .voltage(actuator % ACTUATORS_PER_CHIP);
            *word = (volts * 65_536.0 / 10.0 + 32_768.0).round().clamp(0.0, 65_535.0) as u16;
        }
        if self.outputs.last().is_none_or(|last| last.words != words) {
            self.outputs.push(OutputRecord { at_ns, words, skew_ns: 0 });
        }
    }
}

fn chip_mut(part: &mut Stm32f427, chip: usize) -> &mut Dac81416 {
    &mut part.spi[SPI].chip_mut::<OnBus>(chip).expect("attached by fit, and kept through resets").0
}

/// The chips' state after a run.
pub fn chips(part: &mut Stm32f427) -> Vec<Dac81416> {
    (0..CHIPS).map(|chip| std::mem::take(chip_mut(part, chip))).collect()
}

impl Pins for DisplayPins {
    fn on_trigger(&mut self, _part: &mut Stm32f427, at_ns: u64) -> u16 {
        let position_mm = self.world.hand_position_mm(at_ns as f64 * 1e-9);
        let encoder = World::encoder(position_mm);
        self.ticks.push(TickRecord { at_ns, encoder, position_mm });
        encoder
    }

    /// CLR is TIM1's channel 1, pulled low while nothing drives it.
    fn on_stop(&mut self, part: &mut Stm32f427, at_ns: u64) {
        let channel = tim::Channel::new(1).expect("a timer has a channel 1");
        let (timer, registers) = part.advanced_timer(0);
        let level = timer.output(channel, registers).unwrap_or(Level::Low);
        if self.clear == Some(level) {
            return;
        }
        if self.clear == Some(Level::High) {
            self.clears += 1;
        }
        self.clear = Some(level);
        for chip in 0..CHIPS {
            chip_mut(part, chip).clr(level == Level::Low);
        }
        self.record(part, at_ns);
    }
}
