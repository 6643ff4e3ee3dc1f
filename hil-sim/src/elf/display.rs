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
use crate::fault::HandFault;
use crate::motion::encoder;
use crate::recording::{OutputRecord, TickRecord};
use crate::world::World;

/// Chips on the bus, and the actuators on each but the last.
pub const CHIPS: usize = 4;
const ACTUATORS_PER_CHIP: usize = 13;
/// Channels of a DAC81416, used or not.
const CHANNELS_PER_CHIP: usize = 16;
/// Chip selects: D10 D9 D8 D7.
const SELECTS: [(&str, u8); CHIPS] = [("GPIOD", 14), ("GPIOD", 15), ("GPIOF", 12), ("GPIOF", 13)];
/// Index of SPI1.
const SPI: usize = 0;
/// LDAC is D5 (PE11): bits of the port's set and reset register.
const LDAC_PIN: u32 = 11;
const BSRR: u64 = 0x18;
const EIGHT_BITS: u8 = 8;

/// A chip behind the emulator's SPI seam, and when its voltages last changed.
#[derive(Debug, Default)]
struct OnBus {
    chip: Dac81416,
    volts: [f64; CHANNELS_PER_CHIP],
    changed_ns: Option<u64>,
}

impl Store for OnBus {}

impl OnBus {
    /// Does something to the chip at `at_ns` and sees what comes of it.
    fn drive<R>(&mut self, at_ns: u64, act: impl FnOnce(&mut Dac81416) -> R) -> R {
        let result = act(&mut self.chip);
        let volts = std::array::from_fn(|channel| self.chip.voltage(channel));
        if volts != self.volts {
            self.volts = volts;
            self.changed_ns = Some(at_ns);
        }
        result
    }
}

impl Peer for OnBus {
    fn transfer(&mut self, mosi: u32, bits: u8, _context: &mut Timeline<'_, '_>) -> u32 {
        let [low, high, ..] = mosi.to_le_bytes();
        if bits == EIGHT_BITS {
            return self.chip.transfer(low).into();
        }
        u32::from(self.chip.transfer(high)) << 8 | u32::from(self.chip.transfer(low))
    }

    fn select(&mut self, _context: &mut Timeline<'_, '_>) {
        self.chip.select();
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        self.drive(context.now().0, Dac81416::deselect);
    }
}

/// What is kept of the display board's run.
#[derive(Debug, Default)]
pub struct DisplayRecords {
    /// Every reading of the hand.
    pub ticks: Vec<TickRecord>,
    /// Every change of the outputs.
    pub outputs: Vec<OutputRecord>,
    /// How often CLR fell, after it was released for the first time.
    pub clears: u32,
    /// When they were, in ns since the scene's start.
    pub clears_ns: Vec<u64>,
    /// Frames that a converter could not make sense of.
    pub dac_frame_errors: u64,
}

/// The display board's surroundings.
#[derive(Debug)]
pub struct DisplayPins {
    world: World,
    hand: HandFault,
    clear: Option<Level>,
    records: DisplayRecords,
}

impl DisplayPins {
    /// The surroundings that `world` describes.
    pub fn new(world: World, hand: HandFault) -> Self {
        Self {
            world,
            hand,
            clear: None,
            records: DisplayRecords::default(),
        }
    }

    /// Wires the converters up.
    pub fn fit(part: &mut Stm32f427) {
        for (port, pin) in SELECTS {
            let pin = Pin::new(pin).expect("a port has sixteen pins");
            let select = Select {
                port,
                pin,
                active: Level::Low,
            };
            part.spi[SPI].attach_selected(OnBus::default(), select);
        }
    }

    /// What the run leaves, once it is over.
    pub fn leave(&mut self, part: &mut Stm32f427) -> DisplayRecords {
        let errors = |chip| on_bus(part, chip).chip.counters().faults;
        self.records.dac_frame_errors = (0..CHIPS).map(errors).sum();
        std::mem::take(&mut self.records)
    }

    /// The firmware wrote `value` to `address`: an edge of LDAC, if that is what it makes.
    pub fn on_write(&mut self, part: &mut Stm32f427, address: u64, value: u64, at_ns: u64) {
        if address != GPIOE.base + BSRR {
            return;
        }
        // In this register setting a pin wins over resetting it (RM0090, 8.4.7).
        let high = value & (1 << LDAC_PIN) != 0;
        let low = value & (1 << (16 + LDAC_PIN)) != 0;
        if high || low {
            for chip in 0..CHIPS {
                on_bus(part, chip).drive(at_ns, |dac| dac.ldac(high));
            }
            self.record(part, at_ns);
        }
    }

    /// Keeps the voltages, if any channel has changed since they were kept last.
    fn record(&mut self, part: &mut Stm32f427, at_ns: u64) {
        let changes: Vec<u64> = (0..CHIPS)
            .filter_map(|chip| on_bus(part, chip).changed_ns.take())
            .collect();
        let (Some(first), Some(last)) = (changes.iter().min(), changes.iter().max()) else {
            return;
        };
        let words = std::array::from_fn(|actuator| {
            let chip = on_bus(part, actuator / ACTUATORS_PER_CHIP);
            word_of(chip.volts[actuator % ACTUATORS_PER_CHIP])
        });
        let skew_ns = last - first;
        let outputs = &mut self.records.outputs;
        if outputs.last().is_none_or(|kept| kept.words != words) {
            outputs.push(OutputRecord {
                at_ns,
                words,
                skew_ns,
            });
        }
    }
}

/// The word of the ±5 V range that gives `volts`, to the nearest.
fn word_of(volts: f64) -> u16 {
    (volts * 65_536.0 / 10.0 + 32_768.0)
        .round()
        .clamp(0.0, 65_535.0) as u16
}

fn on_bus(part: &mut Stm32f427, chip: usize) -> &mut OnBus {
    part.spi[SPI]
        .chip_mut(chip)
        .expect("attached by fit, and kept through resets")
}

impl Pins for DisplayPins {
    fn on_trigger(&mut self, _part: &mut Stm32f427, at_ns: u64) -> u16 {
        let position_mm = self.world.hand_position_mm(at_ns as f64 * 1e-9);
        let encoder = self.hand.counts(at_ns, encoder(position_mm));
        self.records.ticks.push(TickRecord {
            at_ns,
            encoder,
            position_mm,
        });
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
            self.records.clears += 1;
            self.records.clears_ns.push(at_ns);
        }
        self.clear = Some(level);
        for chip in 0..CHIPS {
            on_bus(part, chip).drive(at_ns, |dac| dac.clr(level == Level::Low));
        }
        self.record(part, at_ns);
    }
}
