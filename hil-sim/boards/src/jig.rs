//! Jumper wires from pins of a board to others of its own, as the tests that run on a board ask for.

use std::collections::VecDeque;

use rigless::chip::{Timeline, spi, uart};
use rigless::device::Level;
use rigless::mcu::Operate;
use rigless::snapshot::Store;
use rigless::soc::Width;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::TIM4;
use rigless::soc::stm32f427::peripherals::gpio::{Gpio, Pin};
use rigless::soc::stm32f427::peripherals::tim::Channel;
use rigless::time::VirtualNanos;
use strum::{EnumString, IntoStaticStr, VariantArray};

use super::nucleo::{CNT, ITR_OF_TIM3, PEER_UART, Pins, TIM3, TIM4_INDEX};
use super::sensor;

/// Index of SPI1, of TIM1 among the advanced timers, and of TIM2 among the others.
const SPI: usize = 0;
const TIM1: usize = 0;
const TIM2: usize = 0;

/// A jumper wire, or two that make one loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Jumper {
    /// D6 (PE9), TIM1's channel 1, to D36 (PB10), TIM2's channel 3.
    Pulse,
    /// D16 (PC6), TIM3's channel 1, to D35 (PB11), TIM2's channel 4.
    Load,
    /// D30 (PD11) to D29 (PD12), TIM4's channel 1.
    EncoderA,
    /// D31 (PE2) to D28 (PD13), TIM4's channel 2.
    EncoderB,
    /// USART2's TX to its RX.
    Serial,
    /// SPI1's MOSI, D11, to its MISO, D12.
    Spi,
}

impl Jumper {
    /// All of them.
    pub const ALL: [Self; 6] = *Self::VARIANTS.as_array().unwrap();

    /// Its name in commands.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The jumper of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }
}

/// An input of a timer that a jumper leads to.
#[derive(Clone, Copy, Debug)]
struct Input {
    timer: usize,
    channel: u8,
    port: usize,
    pin: u8,
    /// The alternate function that makes the pin the timer's.
    function: u8,
    /// The level of an open wire.
    open: Level,
}

/// A board with jumpers on it, and nothing else.
#[derive(Debug)]
pub struct Jig {
    jumpers: Vec<Jumper>,
    levels: [Option<Level>; 4],
}

impl Jig {
    /// A board with these jumpers.
    pub fn new(jumpers: &[Jumper]) -> Self {
        Self {
            jumpers: jumpers.to_vec(),
            levels: [None; 4],
        }
    }

    /// What the part itself has to know of `jumpers`.
    pub fn fit(part: &mut Stm32f427, jumpers: &[Jumper]) {
        part.usart[PEER_UART].attach(SerialLoop {
            open: !jumpers.contains(&Jumper::Serial),
            ..SerialLoop::default()
        });
        part.spi[SPI].attach(SpiLoop {
            open: !jumpers.contains(&Jumper::Spi),
        });
    }

    /// Puts what the wires' near ends say on their far ends.
    pub fn follow(&mut self, part: &mut Stm32f427, at_ns: u64) {
        // What a timer puts on its own pin can be read back there.
        for (port, number, level) in [(4, 9, pulse(part)), (2, 6, load(part))] {
            part.drive_port(VirtualNanos(at_ns), port, |gpio, registers, context| {
                gpio.drive_function(pin(number), Some(level), registers, context);
            });
        }
        let wires = [
            (Jumper::Pulse, pulse(part), PULSE),
            (Jumper::Load, load(part), LOAD),
            (Jumper::EncoderA, level(part, 3, 11), ENCODER_A),
            (Jumper::EncoderB, level(part, 4, 2), ENCODER_B),
        ];
        for ((jumper, near, input), known) in wires.into_iter().zip(&mut self.levels) {
            let level = if self.jumpers.contains(&jumper) {
                near
            } else {
                input.open
            };
            let (_, registers) = part.port(input.port);
            let is_timers = Gpio::function(pin(input.pin), registers) == Some(input.function);
            if is_timers && *known != Some(level) {
                *known = Some(level);
                let channel = Channel::new(input.channel).expect("a timer has four channels");
                part.drive_timer(
                    VirtualNanos(at_ns),
                    input.timer,
                    |timer, registers, context| {
                        timer.drive_input(channel, level, registers, context);
                    },
                );
            }
        }
    }
}

/// An input, its pin by its port, its number there and its alternate function.
const fn input(timer: usize, channel: u8, pin: (usize, u8, u8), open: Level) -> Input {
    Input {
        timer,
        channel,
        port: pin.0,
        pin: pin.1,
        function: pin.2,
        open,
    }
}

const PULSE: Input = input(TIM2, 3, (1, 10, 1), Level::Low);
const LOAD: Input = input(TIM2, 4, (1, 11, 1), Level::High);
/// The encoder's inputs are pulled up.
const ENCODER_A: Input = input(TIM4_INDEX, 1, (3, 12, 2), Level::High);
const ENCODER_B: Input = input(TIM4_INDEX, 2, (3, 13, 2), Level::High);

fn pin(number: u8) -> Pin {
    Pin::new(number).expect("a port has sixteen pins")
}

fn level(part: &mut Stm32f427, port: usize, number: u8) -> Level {
    let (port, registers) = part.port(port);
    port.level(pin(number), registers)
}

/// TIM1's channel 1, pulled low while nothing drives it.
fn pulse(part: &mut Stm32f427) -> Level {
    let channel = Channel::new(1).expect("a timer has a channel 1");
    let (timer, registers) = part.advanced_timer(TIM1);
    timer.output(channel, registers).unwrap_or(Level::Low)
}

/// TIM3's channel 1, pulled high while nothing drives it.
fn load(part: &mut Stm32f427) -> Level {
    let channel = Channel::new(1).expect("a timer has a channel 1");
    let (timer, registers) = part.timer(TIM3);
    timer.output(channel, registers).unwrap_or(Level::High)
}

impl Pins for Jig {
    type Records = ();

    fn take_records(&mut self) {}

    /// The encoder is what the wires make of it: it stays where it is.
    fn on_trigger(&mut self, part: &mut Stm32f427, at_ns: u64) -> u16 {
        let count = part.peek(VirtualNanos(at_ns), TIM4.base + CNT, Width::W32);
        count.map_or(0, |count| count as u16)
    }

    fn after_trigger(&mut self, part: &mut Stm32f427, at_ns: u64) {
        for level in [Level::High, Level::Low] {
            part.drive_timer(VirtualNanos(at_ns), TIM2, |timer, registers, context| {
                timer.drive_internal_trigger(ITR_OF_TIM3, level, registers, context);
            });
        }
        sensor::start_scan(part, at_ns);
    }

    fn on_reset(&mut self, part: &mut Stm32f427, at_ns: u64) {
        self.levels = [None; 4];
        self.follow(part, at_ns);
    }

    fn on_stop(&mut self, part: &mut Stm32f427, at_ns: u64) {
        self.follow(part, at_ns);
    }

    fn on_write(&mut self, part: &mut Stm32f427, _address: u64, _value: u64, at_ns: u64) {
        self.follow(part, at_ns);
    }
}

/// TX on RX: each byte is heard once it has been said.
#[derive(Debug, Default)]
struct SerialLoop {
    open: bool,
    said: VecDeque<u16>,
}

impl Store for SerialLoop {}

impl uart::Peer for SerialLoop {
    fn receive(&mut self, word: u16, _context: &mut Timeline<'_, '_>) {
        if !self.open {
            self.said.push_back(word);
        }
    }

    fn transmit(&mut self, _now: VirtualNanos) -> Option<u16> {
        self.said.pop_front()
    }
}

/// MOSI on MISO, which is pulled up.
#[derive(Debug)]
struct SpiLoop {
    open: bool,
}

impl Store for SpiLoop {}

impl spi::Peer for SpiLoop {
    fn transfer(&mut self, mosi: u32, bits: u8, _context: &mut Timeline<'_, '_>) -> u32 {
        if self.open { (1 << bits) - 1 } else { mosi }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_jumper_has_a_name_of_its_own() {
        for jumper in Jumper::ALL {
            assert_eq!(Jumper::from_name(jumper.name()), Some(jumper));
        }
    }
}
