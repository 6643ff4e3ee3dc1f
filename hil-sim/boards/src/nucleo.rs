//! An emulated Nucleo-F429ZI: the part, its clock and its UARTs, and a seam for what else is on its pins.
//!
//! The part is rigless' STM32F427, which has the same registers for all that is used here. Two things
//! that the emulator leaves to a board are done at the seam, at the exact instant of TIM3's trigger:
//! the trigger reaches TIM4 (ITR2, RM0090 table 102), and whatever `Pins` makes of it.

use std::fmt::{self, Debug, Formatter};
use std::num::{NonZeroU32, NonZeroU64};

use rigless::chip::uart::Rate;
use rigless::device::{ErasedDevice, Level, ResetCause};
use rigless::emulator::{
    self, Access, AccessKind, Driver, Finished, ProcessorConstructor, Settled, Start,
};
use rigless::image::Image;
use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::session::Session;
use rigless::snapshot::Store;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::rcc::{Register, csr};
use rigless::soc::stm32f427::generated::{TIM3 as TIM3_REGISTERS, TIM4};
use rigless::soc::{Bus, Error, Slot, Width};
use rigless::time::VirtualNanos;

use super::wire::Wire;
use crate::processor_pool;
use crate::wiring::Mistake;
use hil_sim_core::scene::fault::Fault;

/// What the ST-LINK puts on OSC_IN.
const ST_LINK_CLOCK_HZ: u64 = 8_000_000;
const SUPPLY_MV: u32 = 3_300;
const CORE_CLOCK_HZ: NonZeroU64 = NonZeroU64::new(168_000_000).unwrap();
/// A fixed rate, so instructions can be counted but never called cycles. An M4F at 168 MHz behind its
/// flash accelerator needs some 1.4 cycles an instruction: a guess, on the slow side.
pub const INSTRUCTIONS_PER_SECOND: NonZeroU64 = NonZeroU64::new(120_000_000).unwrap();
/// RM0090 section 2.3: SysTick's reference clock is the core's over eight.
const REFCLK_DIVIDER: NonZeroU32 = NonZeroU32::new(8).unwrap();
const PRIORITY_BITS: u8 = 4;

/// Index of USART2, the port to the other board.
pub const PEER_UART: usize = 1;
/// Index of USART3, the console.
pub const CONSOLE_UART: usize = 2;
pub(super) const TIM3: usize = 1;
pub(super) const TIM4_INDEX: usize = 2;
/// The internal trigger by which TIM4 hears TIM3.
pub(super) const ITR_OF_TIM3: u8 = 2;
pub(super) const CNT: u64 = 0x24;

/// The emulation stops for an event at the end of the instruction that it falls into, within two of them.
pub const LATE_NS: u64 = 20;
/// TIM3's clock: APB1's, doubled.
pub const TIM3_CLOCK_MHZ: u64 = 84;
const ARR: u64 = 0x2C;

/// What is wired to a board's pins.
pub trait Pins: Debug + Send + 'static {
    /// The instances of the part that are modelled here instead of by the emulator.
    const STAND_INS: &'static [&'static str] = &[];

    /// What is written down at the pins.
    type Records: Send;

    /// Takes what has been written down since the last call.
    fn take_records(&mut self) -> Self::Records;

    /// The model of the `nth` of [`Pins::STAND_INS`]; `bus` tells what other instances' registers hold.
    fn stand_in(&mut self, _nth: usize, _bus: &Bus) -> Option<&mut dyn ErasedDevice> {
        None
    }

    /// TIM3 triggered at `at_ns`, for the `nth` time: the encoder's counter at this instant.
    fn on_trigger(&mut self, part: &mut Stm32f427, at_ns: u64) -> u16;

    /// After [`Pins::on_trigger`] and the latching of the counter.
    fn after_trigger(&mut self, _part: &mut Stm32f427, _at_ns: u64) {}

    /// The part has been reset at `at_ns`: what is put on its pins from outside has to be put there anew.
    fn on_reset(&mut self, _part: &mut Stm32f427, _at_ns: u64) {}

    /// At every stop of the emulation.
    fn on_stop(&mut self, _part: &mut Stm32f427, _at_ns: u64) {}

    /// The firmware wrote `value` to a peripheral's register.
    fn on_write(&mut self, _part: &mut Stm32f427, _address: u64, _value: u64, _at_ns: u64) {}

    /// `fault` of a scene begins, or ends: what of it is at the pins.
    fn break_by(&mut self, _part: &mut Stm32f427, _fault: &Fault, _begins: bool, _at_ns: u64) {}

    /// A wire at the pins is put wrong, or right. Those between the boards are not at the pins.
    fn miswire(&mut self, _part: &mut Stm32f427, _at_ns: u64, _mistake: Mistake, _wrong: bool) {}
}

/// A board.
pub struct Nucleo<P> {
    mcu: Wired<P>,
    /// What it is going to run, if its processor is to be kept.
    program: Option<u64>,
    /// What makes its processor, if not the emulator.
    processor: Option<ProcessorConstructor>,
}

/// The part with its pins connected.
#[derive(Debug)]
pub struct Wired<P> {
    part: Stm32f427,
    pins: P,
    triggers: u64,
    loses_power: bool,
    /// When the last trigger came.
    triggered_ns: u64,
    /// By the slot on the part's bus, which of [`Pins::STAND_INS`] it is.
    stand_ins: Vec<Option<usize>>,
}

impl<P: Pins> Nucleo<P> {
    /// A board at power-up; `fit` connects what needs the part, such as chips on a bus.
    pub fn new(pins: P, fit: impl FnOnce(&mut Stm32f427)) -> Result<Self, Error> {
        let mut part = Stm32f427::new()?;
        part.rcc.attach_crystals(ST_LINK_CLOCK_HZ, 0);
        part.set_supply(SUPPLY_MV);
        part.usart[PEER_UART].attach(Wire::default());
        part.usart[CONSOLE_UART].attach(Wire::default());
        fit(&mut part);
        let nth = |slot: &Slot| {
            let name = slot.peripheral().name;
            P::STAND_INS.iter().position(|instance| *instance == name)
        };
        let stand_ins = part.bus().slots().iter().map(nth).collect();
        Ok(Self {
            mcu: Wired {
                part,
                pins,
                triggers: 0,
                loses_power: false,
                triggered_ns: 0,
                stand_ins,
            },
            program: None,
            processor: None,
        })
    }

    /// The same board, about to run `images` on a processor that `make` makes; without, on the emulator's own: it
    /// takes over one that has run them before, if one is idle.
    pub fn running(self, images: &[Image], make: Option<ProcessorConstructor>) -> Self {
        Self {
            program: Some(processor_pool::program(images)),
            processor: make,
            ..self
        }
    }

    /// Runs from power-up until `driver`, which is asked for the first time at `first_stop`, ends it.
    pub fn run<D: Driver<Self> + 'static>(
        self,
        start: &Start<'_>,
        first_stop: VirtualNanos,
        driver: D,
    ) -> Result<Finished<Self, D>, String> {
        let session =
            Session::new(Box::new(self), 0, first_stop).map_err(|error| error.to_string())?;
        emulator::run(session, start, driver).map_err(|error| error.to_string())
    }

    /// Lets the pins follow what the firmware writes.
    pub fn follow(&mut self, settled: &Settled) {
        if let Settled::Access {
            access:
                Access {
                    kind: AccessKind::Write,
                    address,
                    value,
                    virtual_time,
                    ..
                },
            ..
        } = *settled
        {
            let (pins, part) = self.pins();
            pins.on_write(part, address, value, virtual_time.0);
        }
    }

    /// What is on the pins, and the part.
    pub fn pins(&mut self) -> (&mut P, &mut Stm32f427) {
        (&mut self.mcu.pins, &mut self.mcu.part)
    }

    /// What the next reset comes from is the supply: to be called before it.
    pub fn lose_power(&mut self) {
        self.mcu.loses_power = true;
    }

    /// Sets or clears bits of a register, whatever the firmware thinks of them; false if there is no
    /// such register.
    pub fn set_bits(&mut self, at: VirtualNanos, address: u64, bits: u64, set: bool) -> bool {
        let part = &mut self.mcu.part;
        let Ok(value) = part.peek(at, address, Width::W32) else {
            return false;
        };
        let value = if set { value | bits } else { value & !bits };
        part.write(at, address, Width::W32, value).is_ok()
    }

    /// Gives every byte that comes from the peer a framing error, or none.
    pub fn break_line(&mut self, broken: bool) {
        let framing = &mut self.mcu.part.usart[PEER_UART].errors_mut().framing;
        framing.name = "wire-stuck-low";
        framing.per_million = if broken { Rate::EVERY_WORD } else { 0 };
    }

    /// Loses every byte that comes to the UARTs, or none: what DMA1 does without its clock. The emulated one goes on.
    pub fn deafen(&mut self, is_deaf: bool) {
        for uart in [PEER_UART, CONSOLE_UART] {
            self.wire(uart).deafen(is_deaf);
        }
    }

    /// The far end of one of the UARTs.
    pub fn wire(&mut self, uart: usize) -> &mut Wire {
        self.mcu.part.usart[uart]
            .chip_mut()
            .expect("attached in new, and kept through resets")
    }
}

impl<P: Pins> Wired<P> {
    /// Passes TIM3's trigger on, if it came since the last look.
    fn follow_trigger(&mut self, at: VirtualNanos) {
        let (_, pulses) = self.part.tim[TIM3].trigger_output();
        let came = pulses != self.triggers;
        self.triggers = pulses;
        if !came {
            return;
        }
        self.triggered_ns = self.exactly(at);
        let count = self.pins.on_trigger(&mut self.part, self.triggered_ns);
        // While the counter's clock is off, before the firmware enables it, there is nothing to set.
        let _ = self
            .part
            .write(at, TIM4.base + CNT, Width::W32, count.into());
        for level in [Level::High, Level::Low] {
            self.part
                .drive_timer(at, TIM4_INDEX, |timer, registers, context| {
                    timer.drive_internal_trigger(ITR_OF_TIM3, level, registers, context);
                });
        }
        self.pins.after_trigger(&mut self.part, at.0);
    }

    /// When the trigger came that is seen at `at`: a period after the last one, if that is just over.
    fn exactly(&mut self, at: VirtualNanos) -> u64 {
        let Ok(reload) = self.part.peek(at, TIM3_REGISTERS.base + ARR, Width::W32) else {
            return at.0;
        };
        let due_ns = self.triggered_ns + (reload + 1) * 1_000 / TIM3_CLOCK_MHZ;
        if (due_ns..due_ns + LATE_NS).contains(&at.0) {
            due_ns
        } else {
            at.0
        }
    }
}

impl<P: Pins> Mcu for Wired<P> {
    fn bus(&self) -> &Bus {
        self.part.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.part.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.part.reset(at, cause);
        if std::mem::take(&mut self.loses_power) {
            // The emulator's part knows no power-on of its own: what tells it from the pin is its flags
            // (RM0090, 6.3.21).
            let (_, registers) = self.part.clocks();
            let flags = csr::PORRSTF.mask() | csr::BORRSTF.mask() | csr::PADRSTF.mask();
            registers.set(Register::Csr, flags);
        }
        self.triggers = 0;
        self.pins.on_reset(&mut self.part, at.0);
    }

    fn poll(&mut self, now: VirtualNanos) {
        self.part.poll(now);
        self.follow_trigger(now);
        self.pins.on_stop(&mut self.part, now.0);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        if let Some(nth) = self.stand_ins[slot]
            && let Some(model) = self.pins.stand_in(nth, self.part.bus())
        {
            return (self.part.bus_mut(), Some(model));
        }
        self.part.split(slot)
    }
}

impl<P: Debug> Debug for Nucleo<P> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        self.mcu.fmt(formatter)
    }
}

impl<P: Debug> Store for Nucleo<P> {}

impl<P: Pins> Board for Nucleo<P> {
    fn name(&self) -> &'static str {
        "nucleo-f429zi"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32f427"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let interrupt_lines = NonZeroU32::new(self.mcu.cpu().interrupt_lines.into())
            .expect("the part has interrupts");
        let mut core = armv7m::Core {
            variant: armv7m::Variant::M4,
            clock_hz: CORE_CLOCK_HZ,
            interrupt_lines,
            priority_bits: PRIORITY_BITS,
            refclk_divider: REFCLK_DIVIDER,
            instructions_per_second: INSTRUCTIONS_PER_SECOND,
            boot: "flash",
        }
        .spec_with_parts(
            &rigless::cpu::armv7m::windows(self.mcu.bus()),
            armv7m::Fpu::FpV4Sp,
            armv7m::MpuRegions::Eight,
        );
        if let Some(make) = &self.processor {
            core.processor = make.clone();
        } else if let Some(program) = self.program {
            processor_pool::keep(&mut core, program);
        }
        vec![Target::new("stm32f427", &mut self.mcu, core)]
    }
}

/// A part that no firmware runs on, but a test that sets registers and looks at them.
#[cfg(test)]
pub mod by_hand {
    use super::*;
    use rigless::emulator::{Error, Memory};

    /// RAM that holds its own addresses.
    struct Addresses;

    impl Memory for Addresses {
        fn read(&mut self, address: u64, width: Width) -> Result<u64, Error> {
            Ok(address & width.mask())
        }

        fn write(&mut self, _address: u64, _width: Width, _value: u64) -> Result<(), Error> {
            Ok(())
        }
    }

    /// Writes `value` to a register at `at_ns`.
    pub fn set(mcu: &mut dyn Mcu, at_ns: u64, address: u64, value: u64) {
        let at = VirtualNanos(at_ns);
        mcu.advance_to(at);
        assert_eq!(mcu.settle(&mut Addresses).unwrap(), []);
        mcu.write(at, address, Width::W32, value).unwrap();
        assert_eq!(mcu.settle(&mut Addresses).unwrap(), []);
    }

    /// Reads a register at `at_ns`.
    pub fn get(mcu: &mut dyn Mcu, at_ns: u64, address: u64) -> u64 {
        let at = VirtualNanos(at_ns);
        mcu.advance_to(at);
        assert_eq!(mcu.settle(&mut Addresses).unwrap(), []);
        let value = mcu.read(at, address, Width::W32).unwrap();
        assert_eq!(mcu.settle(&mut Addresses).unwrap(), []);
        value
    }
}
