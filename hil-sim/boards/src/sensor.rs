//! What is on the sensor board's pins: five gauges and the force channel on ADC3, the arm's encoder,
//! and the arm's servo drive.

mod pwm;

use protocol::CHANNELS;
use rigless::device::{ErasedDevice, Level};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::ADC3;
use rigless::soc::stm32f427::peripherals::adc::Channel;
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::{Bus, Width};
use rigless::time::VirtualNanos;

use pwm::Pwm;

use super::nucleo::Pins;
use crate::wiring::{EncoderWires, GAUGE, Mistake};
use hil_sim_core::plant::arm::Arm;
use hil_sim_core::plant::fault::clock::Clock;
use hil_sim_core::plant::fault::encoder::EncoderFaults;
use hil_sim_core::plant::fault::gauges::GaugeFaults;
use hil_sim_core::plant::world::World;
use hil_sim_core::run::recording::ScanRecord;
use hil_sim_core::scene::{Scene, SceneError};

/// ADC3's channels on A0–A5: PA3 PC0 PC3 PF3 PF5 PF10.
const ADC_CHANNELS: [u8; CHANNELS] = [3, 10, 13, 9, 15, 8];
/// Index of ADC3, and of port F.
const ADC: usize = 2;
const PORT_F: usize = 5;
/// What drives D6, the arm's speed.
const DRIVE: &str = "TIM1";
/// D7, the arm's direction.
const DIRECTION_PIN: u8 = 13;
/// The model converts ⌊input · 4095 / reference⌋; microvolts resolve every code.
const REFERENCE_UV: u32 = 3_300_000;
const FULL_SCALE: u32 = 4_095;
const HIGHEST_CODE: u16 = 4_095;
const MID_RAIL: u16 = 2_048;
const CR2: u64 = 0x08;
const CR2_SWSTART: u64 = 1 << 30;
const CR2_EXTEN: u64 = 0b11 << 28;
const CR2_EXTSEL: u64 = 0b1111 << 24;
/// EXTSEL of TIM3's trigger output (RM0090, 13.13.3).
const EXTSEL_TIM3_TRGO: u64 = 0b1000 << 24;

/// The sensor board's surroundings.
#[derive(Debug)]
pub struct SensorPins {
    drive: Pwm,
    world: World,
    arm: Arm,
    arm_full_scale_mm_s: f64,
    position_mm: f64,
    gauges: GaugeFaults,
    encoder_faults: EncoderFaults,
    clock: Clock,
    encoder: EncoderWires,
    /// The level that the pin of gauge [`GAUGE`] is held at by its wire.
    held: Option<u16>,
    /// What the arm makes of the speed that it is asked for: 1, unless its wires are wrong.
    drive_sign: f64,
    /// Every scan converted so far.
    scans: Vec<ScanRecord>,
}

impl SensorPins {
    /// The surroundings that `scene` describes; the servo drive is scaled as the board is told.
    ///
    /// # Errors
    /// If the scene's world can't be built.
    pub fn of_scene(scene: &Scene) -> Result<Self, SceneError> {
        let configuration = scene.sensor_configuration();
        Ok(Self {
            drive: Pwm::default(),
            world: World::new(scene)?,
            arm: Arm::new(&scene.arm, &scene.motion),
            arm_full_scale_mm_s: f64::from(configuration.arm_full_scale_um_s) * 1e-3,
            position_mm: 0.0,
            gauges: GaugeFaults::new(&scene.faults),
            encoder_faults: EncoderFaults::of_arm(&scene.faults),
            clock: Clock::new(&scene.faults),
            encoder: EncoderWires::Sound,
            held: None,
            drive_sign: 1.0,
            scans: Vec::new(),
        })
    }

    /// The true wavelength under the fingertip at the last scan, in mm.
    pub fn wavelength_mm(&self) -> f64 {
        self.world.wavelength_mm(self.position_mm)
    }

    /// Wires up what the part itself has to know.
    pub fn fit(part: &mut Stm32f427) {
        part.adc[ADC].set_reference(REFERENCE_UV);
    }

    /// Puts the voltages of `local_ns`, by the board's clock, on the pins for the scan that begins; returns the arm's encoder.
    fn present(&mut self, part: &mut Stm32f427, local_ns: u64) -> u16 {
        let at_ns = self.clock.true_ns(local_ns);
        let t_s = at_ns as f64 * 1e-9;
        self.position_mm = self.arm.position_mm(t_s);
        let codes = self.world.codes(t_s, self.position_mm);
        let mut codes = self.gauges.apply(at_ns, codes);
        if let Some(held) = self.held {
            codes[GAUGE] = held;
        }
        for (code, channel) in codes.into_iter().zip(ADC_CHANNELS) {
            if let Some(channel) = Channel::new(channel) {
                part.adc[ADC].set_input(channel, microvolts(code));
            }
        }
        let encoder = self.world.arm_encoder(t_s, self.position_mm);
        let encoder = self.encoder_faults.counts(at_ns, encoder);
        let encoder = self.encoder.counts(encoder);
        self.scans.push(ScanRecord {
            at_ns,
            codes,
            encoder,
            position_mm: self.position_mm,
        });
        encoder
    }

    /// The speed in mm/s that the firmware asks for on its PWM and direction pins.
    fn command_mm_s(&self, part: &mut Stm32f427) -> f64 {
        let registers = part.bus().registers(DRIVE).expect("the part has a TIM1");
        let duty = self.drive.duty(registers);
        let direction = Pin::new(DIRECTION_PIN).expect("a port has sixteen pins");
        let (port, registers) = part.port(PORT_F);
        let sign = if port.level(direction, registers) == Level::High {
            1.0
        } else {
            -1.0
        };
        self.drive_sign * sign * duty * self.arm_full_scale_mm_s
    }
}

/// The input in µV that the model converts to `code`.
fn microvolts(code: u16) -> u32 {
    let scaled = u64::from(code) * u64::from(REFERENCE_UV);
    u32::try_from(scaled.div_ceil(FULL_SCALE.into())).expect("at most the reference")
}

impl Pins for SensorPins {
    const STAND_INS: &'static [&'static str] = &[DRIVE];

    type Records = Vec<ScanRecord>;

    fn take_records(&mut self) -> Vec<ScanRecord> {
        std::mem::take(&mut self.scans)
    }

    fn stand_in(&mut self, _nth: usize, _bus: &Bus) -> Option<&mut dyn ErasedDevice> {
        Some(&mut self.drive)
    }

    fn on_reset(&mut self, _part: &mut Stm32f427, _at_ns: u64) {
        self.drive = Pwm::default();
    }

    fn on_trigger(&mut self, part: &mut Stm32f427, at_ns: u64) -> u16 {
        let command_mm_s = self.command_mm_s(part);
        let t_s = self.clock.true_ns(at_ns) as f64 * 1e-9;
        self.arm.command(t_s, command_mm_s);
        self.present(part, at_ns)
    }

    fn after_trigger(&mut self, part: &mut Stm32f427, at_ns: u64) {
        start_scan(part, at_ns);
    }

    fn on_write(&mut self, part: &mut Stm32f427, address: u64, value: u64, at_ns: u64) {
        // A scan that software starts, if that is what it makes.
        if address == ADC3.base + CR2 && value & CR2_SWSTART != 0 {
            self.present(part, at_ns);
        }
    }

    fn miswire(&mut self, _part: &mut Stm32f427, _at_ns: u64, mistake: Mistake, wrong: bool) {
        let or_sound = |wires| if wrong { wires } else { EncoderWires::Sound };
        match mistake {
            Mistake::ArmSwapped => self.encoder = or_sound(EncoderWires::Exchanged),
            Mistake::ArmOpen => self.encoder = or_sound(EncoderWires::Open),
            Mistake::PwmOpen => self.drive_sign = if wrong { 0.0 } else { 1.0 },
            Mistake::ArmBackwards => self.drive_sign = if wrong { -1.0 } else { 1.0 },
            Mistake::GaugeOpen => self.held = wrong.then_some(HIGHEST_CODE),
            Mistake::GaugeShort => self.held = wrong.then_some(MID_RAIL),
            _ => {}
        }
    }
}

/// The emulator does not pass a timer's trigger to a converter: starts the scan that the converter is set up to start.
pub(super) fn start_scan(part: &mut Stm32f427, at_ns: u64) {
    let at = VirtualNanos(at_ns);
    let Ok(cr2) = part.peek(at, ADC3.base + CR2, Width::W32) else {
        return;
    };
    if cr2 & CR2_EXTEN != 0 && cr2 & CR2_EXTSEL == EXTSEL_TIM3_TRGO {
        // A converter whose clock is off refuses the write, as it would ignore the trigger.
        let _ = part.write(at, ADC3.base + CR2, Width::W32, cr2 | CR2_SWSTART);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_way_through_microvolts() {
        for code in 0..=4_095u16 {
            let converted =
                u64::from(microvolts(code)) * u64::from(FULL_SCALE) / u64::from(REFERENCE_UV);
            assert_eq!(converted, u64::from(code));
        }
    }
}
