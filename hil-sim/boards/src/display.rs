//! What is on the display board's pins: the hand's encoder, the emergency-stop button, and four DAC81416
//! on SPI1 with common LDAC, CLR and ALMOUT. Some of it can be broken on purpose.

mod spi;

use rigless::device::{ErasedDevice, Level};
use rigless::mcu::Operate;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::TIM3;
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::stm32f427::peripherals::tim;
use rigless::soc::{Bus, Width};
use rigless::time::VirtualNanos;

pub use spi::CHIPS;
use spi::Spi;

use super::nucleo::{LATE_NS, Pins, TIM3_CLOCK_MHZ};
use crate::dac81416::{Dac81416, Defects};
use crate::wiring::{CHIP, EncoderWires, Mistake};
use hil_sim_core::plant::fault::encoder::EncoderFaults;
use hil_sim_core::plant::motion::encoder;
use hil_sim_core::plant::world::World;
use hil_sim_core::run::recording::{OutputRecord, TickRecord};
use hil_sim_core::scene::fault::{Fault, Kind};

/// Actuators on each chip but the last.
const ACTUATORS_PER_CHIP: usize = 13;
/// LDAC is D16 (PC6), channel 1 of TIM3; ALMOUT is D3 (PE13); the emergency stop is D4 (PF14).
const LOAD: Line = Line(2, 6);
const ALARM: Line = Line(4, 13);
const BUTTON: Line = Line(5, 14);
/// Index of TIM3, and the bytes of its registers.
const TIM3_INDEX: usize = 1;
const TIM3_SIZE: u64 = 0x400;
const CCR1: u64 = 0x34;

/// A pin with a wire on it: the port's index and the pin's.
#[derive(Clone, Copy, Debug)]
struct Line(usize, u8);

impl Line {
    fn pin(self) -> Pin {
        Pin::new(self.1).expect("a port has sixteen pins")
    }

    /// Puts `level` on the wire from outside, or leaves it to the pull-up.
    fn drive(self, part: &mut Stm32f427, at_ns: u64, level: Option<Level>) {
        part.drive_port(VirtualNanos(at_ns), self.0, |gpio, registers, context| {
            gpio.drive(self.pin(), level, registers, context);
        });
    }

    /// Puts `level` on the wire from the peripheral behind the pin.
    fn drive_function(self, part: &mut Stm32f427, at_ns: u64, level: Level) {
        part.drive_port(VirtualNanos(at_ns), self.0, |gpio, registers, context| {
            gpio.drive_function(self.pin(), Some(level), registers, context);
        });
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
    spi: Spi,
    world: World,
    hand: EncoderFaults,
    clear: Option<Level>,
    /// LDAC's level on the wire.
    load: Option<Level>,
    load_stuck: Option<Level>,
    clear_stuck: bool,
    button_open: bool,
    alarm: bool,
    alarm_stuck: bool,
    encoder: EncoderWires,
    /// When the encoder was read last.
    ticked_ns: u64,
    records: DisplayRecords,
}

impl DisplayPins {
    /// The surroundings that `world` describes.
    pub fn new(world: World, hand: EncoderFaults) -> Self {
        Self {
            spi: Spi::default(),
            world,
            hand,
            clear: None,
            load: None,
            load_stuck: None,
            clear_stuck: false,
            button_open: false,
            alarm: false,
            alarm_stuck: false,
            encoder: EncoderWires::Sound,
            ticked_ns: 0,
            records: DisplayRecords::default(),
        }
    }

    /// Wires the emergency-stop button up, closed.
    pub fn fit(part: &mut Stm32f427) {
        BUTTON.drive(part, 0, Some(Level::Low));
    }

    /// Whether CLR is low.
    pub fn is_clear(&self) -> bool {
        self.clear != Some(Level::High)
    }

    /// Presses the emergency stop, which opens its contact, or releases it.
    pub fn set_stop_button(&mut self, part: &mut Stm32f427, at_ns: u64, open: bool) {
        self.button_open = open;
        BUTTON.drive(part, at_ns, (!open).then_some(Level::Low));
    }

    /// Holds LDAC's wire at a level, whatever the board does, or lets go of it.
    pub fn set_load_stuck(&mut self, part: &mut Stm32f427, at_ns: u64, level: Option<Level>) {
        self.load_stuck = level;
        self.follow_load(part, at_ns);
    }

    /// Does something to the `nth` chip, and lets its voltages and its alarm be seen.
    ///
    /// # Panics
    /// If there is no such chip.
    pub fn with_chip<R>(
        &mut self,
        part: &mut Stm32f427,
        at_ns: u64,
        nth: usize,
        act: impl FnOnce(&mut Dac81416) -> R,
    ) -> R {
        let result = self.spi.chips_at(at_ns)[nth].drive(at_ns, act);
        self.record(at_ns);
        self.follow_alarm(part, at_ns);
        result
    }

    /// Loads by LDAC that the first chip has seen since power-up.
    pub fn loads(&self) -> u64 {
        self.spi.chips[0].chip.counters().loads
    }

    /// Puts what TIM3's channel 1 says on LDAC's wire.
    fn follow_load(&mut self, part: &mut Stm32f427, at_ns: u64) {
        let channel = tim::Channel::new(1).expect("a timer has a channel 1");
        let (timer, registers) = part.timer(TIM3_INDEX);
        let driven = timer.output(channel, registers).unwrap_or(Level::High);
        let level = self.load_stuck.unwrap_or(driven);
        if self.load == Some(level) {
            return;
        }
        self.load = Some(level);
        let at_ns = self.exactly(part, at_ns);
        LOAD.drive_function(part, at_ns, level);
        for chip in self.spi.chips_at(at_ns) {
            chip.drive(at_ns, |dac| dac.ldac(level == Level::High));
        }
        if level == Level::Low {
            self.record(at_ns);
        }
    }

    /// When TIM3's channel changed that is seen to have at `at_ns`: at its match, if that is just over.
    fn exactly(&self, part: &mut Stm32f427, at_ns: u64) -> u64 {
        let at = VirtualNanos(at_ns);
        let Ok(compare) = part.peek(at, TIM3.base + CCR1, Width::W32) else {
            return at_ns;
        };
        let due_ns = self.ticked_ns + (compare * 1_000).div_ceil(TIM3_CLOCK_MHZ);
        if (due_ns..due_ns + LATE_NS).contains(&at_ns) {
            due_ns
        } else {
            at_ns
        }
    }

    /// CLR is TIM1's channel 1, pulled low while nothing drives it.
    fn follow_clear(&mut self, part: &mut Stm32f427, at_ns: u64) {
        let channel = tim::Channel::new(1).expect("a timer has a channel 1");
        let (timer, registers) = part.advanced_timer(0);
        let driven = timer.output(channel, registers).unwrap_or(Level::Low);
        let level = if self.clear_stuck { Level::Low } else { driven };
        if self.clear == Some(level) {
            return;
        }
        if self.clear == Some(Level::High) {
            self.records.clears += 1;
            self.records.clears_ns.push(at_ns);
        }
        self.clear = Some(level);
        for chip in self.spi.chips_at(at_ns) {
            chip.drive(at_ns, |dac| dac.clr(level == Level::Low));
        }
        self.record(at_ns);
    }

    /// The chips' alarm outputs pull one wire low together.
    fn follow_alarm(&mut self, part: &mut Stm32f427, at_ns: u64) {
        let alarm = self.alarm_stuck || self.spi.chips.iter().any(|on_bus| on_bus.chip.alarm());
        if alarm != self.alarm {
            self.alarm = alarm;
            ALARM.drive(part, at_ns, alarm.then_some(Level::Low));
        }
    }

    /// Keeps the voltages, if any channel has changed since they were kept last.
    fn record(&mut self, at_ns: u64) {
        let chips = &mut self.spi.chips;
        let changes: Vec<u64> = chips
            .iter_mut()
            .filter_map(|chip| chip.changed_ns.take())
            .collect();
        let (Some(first), Some(last)) = (changes.iter().min(), changes.iter().max()) else {
            return;
        };
        let words = std::array::from_fn(|actuator| {
            let chip = &chips[actuator / ACTUATORS_PER_CHIP];
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

impl Pins for DisplayPins {
    const STAND_INS: &'static [&'static str] = &["SPI1"];

    type Records = DisplayRecords;

    fn take_records(&mut self) -> DisplayRecords {
        let chips = self.spi.chips.iter();
        self.records.dac_frame_errors = chips.map(|on_bus| on_bus.chip.counters().faults).sum();
        std::mem::take(&mut self.records)
    }

    fn on_trigger(&mut self, _part: &mut Stm32f427, at_ns: u64) -> u16 {
        let position_mm = self.world.hand_position_mm(at_ns as f64 * 1e-9);
        let counted = self.hand.counts(at_ns, encoder(position_mm));
        let counted = self.encoder.counts(counted);
        self.ticked_ns = at_ns;
        self.records.ticks.push(TickRecord {
            at_ns,
            encoder: counted,
            position_mm,
        });
        counted
    }

    fn stand_in(&mut self, _nth: usize, bus: &Bus) -> Option<&mut dyn ErasedDevice> {
        self.spi.expect_words(bus);
        Some(&mut self.spi)
    }

    fn on_reset(&mut self, part: &mut Stm32f427, at_ns: u64) {
        self.spi.restart(at_ns);
        self.load = None;
        self.alarm = false;
        self.set_stop_button(part, at_ns, self.button_open);
        self.on_stop(part, at_ns);
        self.follow_alarm(part, at_ns);
    }

    fn on_stop(&mut self, part: &mut Stm32f427, at_ns: u64) {
        self.follow_load(part, at_ns);
        self.follow_clear(part, at_ns);
    }

    fn on_write(&mut self, part: &mut Stm32f427, address: u64, _value: u64, at_ns: u64) {
        // It may have raised LDAC.
        if (TIM3.base..TIM3.base + TIM3_SIZE).contains(&address) {
            self.follow_load(part, at_ns);
        }
    }

    fn miswire(&mut self, part: &mut Stm32f427, at_ns: u64, mistake: Mistake, wrong: bool) {
        let or_sound = |wires| if wrong { wires } else { EncoderWires::Sound };
        match mistake {
            Mistake::HandSwapped => self.encoder = or_sound(EncoderWires::Exchanged),
            Mistake::HandOpen => self.encoder = or_sound(EncoderWires::Open),
            Mistake::StopOpen => self.set_stop_button(part, at_ns, wrong),
            Mistake::LoadHigh => self.set_load_stuck(part, at_ns, wrong.then_some(Level::High)),
            Mistake::ClearLow => {
                self.clear_stuck = wrong;
                self.follow_clear(part, at_ns);
            }
            Mistake::AlarmLow => {
                self.alarm_stuck = wrong;
                self.follow_alarm(part, at_ns);
            }
            Mistake::SelectOpen => {
                self.with_chip(part, at_ns, CHIP, |dac| dac.defects.deaf = wrong);
            }
            Mistake::SdiOpen => {
                let chips = self.spi.chips_at(at_ns).iter_mut();
                chips.for_each(|chip| chip.sdi_open = wrong);
            }
            Mistake::SdoOpen => {
                let chips = self.spi.chips_at(at_ns).iter_mut();
                chips.for_each(|chip| chip.sdo_open = wrong);
            }
            _ => {}
        }
    }

    fn break_by(&mut self, part: &mut Stm32f427, fault: &Fault, begins: bool, at_ns: u64) {
        let chip = fault.values[0] as usize;
        match fault.kind {
            Kind::EmergencyStop => self.set_stop_button(part, at_ns, begins),
            Kind::LdacStuck => {
                self.set_load_stuck(part, at_ns, begins.then_some(Level::High));
            }
            Kind::ClearStuckLow => {
                self.clear_stuck = begins;
                self.follow_clear(part, at_ns);
            }
            Kind::DacIgnoresWords => {
                self.with_chip(part, at_ns, chip, |dac| dac.defects.deaf = begins);
            }
            Kind::DacAlarm => {
                self.with_chip(part, at_ns, chip, |dac| dac.defects.overheated = begins);
            }
            Kind::DacPowerLost if begins => {
                self.with_chip(part, at_ns, chip, Dac81416::reset);
            }
            // With all power gone nothing that was broken is so any more: the next fault is another
            // day's.
            Kind::PowerCycle if begins => {
                self.clear_stuck = false;
                self.set_load_stuck(part, at_ns, None);
                self.set_stop_button(part, at_ns, false);
                for chip in 0..CHIPS {
                    self.with_chip(part, at_ns, chip, |dac| {
                        dac.defects = Defects::default();
                        dac.reset();
                    });
                }
                self.follow_clear(part, at_ns);
            }
            _ => {}
        }
    }
}
