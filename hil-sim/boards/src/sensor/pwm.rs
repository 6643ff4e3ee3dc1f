//! TIM1 as the arm's drive has it: pulses that repeat, and end by themselves.
//!
//! It stands in for the emulator's own TIM1, at which the board stops for both edges of each of 20 000 pulses a second,
//! though nothing looks at an edge. This one stops it once, where the pulses end.
//!
//! As RM0090, chapter 17, has it, for a counter that counts up from 0 and whose channel 1 is in a PWM mode. Left out,
//! for the sensor's firmware uses none of it: interrupts, requests, triggers, breaks, preloaded values, the other
//! channels, and what the counter stands at.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32f427::generated::tim1::{Register, bdtr, ccer, ccmr1_output, cr1, egr, rcr};
use rigless::time::{EventId, NANOS_PER_SECOND, VirtualNanos};

const PWM_MODE_1: u64 = 0b110;
const PWM_MODE_2: u64 = 0b111;

/// The timer.
#[derive(Debug, Default)]
pub struct Pwm {
    clock_hz: u64,
    is_counting: bool,
    /// The last pulse's end.
    end: Option<EventId>,
}

impl Pwm {
    /// For what share of the time channel 1's pin is high, as far as whole ns tell; 0 while it does not pulse.
    pub fn duty(&self, registers: &RegisterFile) -> f64 {
        let enables = registers.get(Register::Ccer);
        let is_out = ccer::CC1E.is_set(enables) && bdtr::MOE.is_set(registers.get(Register::Bdtr));
        if !self.is_counting || !is_out {
            return 0.0;
        }
        let period = registers.get(Register::Arr) + 1;
        let below = registers.get(Register::Ccr1).min(period);
        let active = match ccmr1_output::OC1M.get(registers.get(Register::Ccmr1Output)) {
            PWM_MODE_1 => below,
            PWM_MODE_2 => period - below,
            _ => return 0.0,
        };
        let high = if ccer::CC1P.is_set(enables) {
            period - active
        } else {
            active
        };
        self.ns(high, registers) as f64 / self.ns(period, registers) as f64
    }

    /// What `counts` take, in ns. The clock runs.
    fn ns(&self, counts: u64, registers: &RegisterFile) -> u64 {
        let cycles = counts * (registers.get(Register::Psc) + 1);
        (u128::from(cycles) * u128::from(NANOS_PER_SECOND) / u128::from(self.clock_hz)) as u64
    }

    /// Lets it count from 0, or not.
    fn count(&mut self, counts: bool, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        self.is_counting = counts && self.clock_hz > 0;
        self.end = None;
        if self.is_counting && cr1::OPM.is_set(registers.get(Register::Cr1)) {
            let pulses = rcr::REP.get(registers.get(Register::Rcr)) + 1;
            let period = registers.get(Register::Arr) + 1;
            let end_ns = context.now().0 + self.ns(pulses * period, registers);
            self.end = Some(context.schedule(VirtualNanos(end_ns)));
        }
    }

    fn stop(&mut self, registers: &mut RegisterFile) {
        self.is_counting = false;
        self.end = None;
        let control = registers.get(Register::Cr1);
        registers.set(Register::Cr1, cr1::CEN.set(control, 0));
    }
}

impl Device for Pwm {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        match register {
            // Begins anew, and ends one that ends by itself (17.3.10).
            Register::Egr if egr::UG.is_set(value) => {
                if cr1::OPM.is_set(registers.get(Register::Cr1)) {
                    self.stop(registers);
                } else {
                    self.count(self.is_counting, registers, context);
                }
            }
            Register::Cr1 if cr1::CEN.is_set(value) != self.is_counting => {
                self.count(!self.is_counting, registers, context);
            }
            _ => {}
        }
    }

    fn on_event(
        &mut self,
        event: EventId,
        registers: &mut RegisterFile,
        _: &mut DeviceContext<'_>,
    ) {
        if self.end == Some(event) {
            self.stop(registers);
        }
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.clock_hz = hz;
        let counts = cr1::CEN.is_set(registers.get(Register::Cr1));
        self.count(counts, registers, context);
    }

    fn reset(&mut self) {
        *self = Self {
            clock_hz: self.clock_hz,
            ..Self::default()
        };
    }
}

#[cfg(test)]
mod tests {
    use rigless::machine::Board;
    use rigless::mcu::Mcu;
    use rigless::soc::stm32f427::Stm32f427;
    use rigless::soc::stm32f427::generated::{RCC, TIM1};
    use rigless::soc::stm32f427::peripherals::tim::Channel;

    use crate::nucleo::Nucleo;
    use crate::nucleo::by_hand::{get, set};
    use crate::sensor::SensorPins;
    use hil_sim_core::scene::Scene;

    const APB2ENR: u64 = 0x44;
    const CR1: u64 = 0x00;
    const EGR: u64 = 0x14;
    const CCMR1: u64 = 0x18;
    const CCER: u64 = 0x20;
    const ARR: u64 = 0x2C;
    const RCR: u64 = 0x30;
    const CCR1: u64 = 0x34;
    const BDTR: u64 = 0x44;
    const CEN: u64 = 1;
    const OPM: u64 = 1 << 3;

    /// What is written to TIM1, and when, in µs: five pulses of 6.25 µs, with the 16 MHz after a reset.
    const SCRIPT: [(u64, u64, u64); 19] = [
        (1, ARR, 99),
        (1, RCR, 4),
        (1, CCR1, 100),
        (1, CCMR1, 0x70),
        (1, CCER, 1),
        (1, CR1, OPM),
        (2, BDTR, 1 << 15),
        // A command, whose pulses end after 31.25 µs.
        (3, CCR1, 30),
        (3, EGR, 1),
        (3, CR1, OPM | CEN),
        // The next two follow each other before the first one's end.
        (50, CCR1, 60),
        (50, EGR, 1),
        (50, CR1, OPM | CEN),
        (70, CCR1, 80),
        (70, EGR, 1),
        (70, CR1, OPM | CEN),
        // Without an end; the other mode; the other polarity.
        (120, CR1, CEN),
        (160, CCMR1, 0x60),
        (170, CCER, 0b11),
    ];

    /// CEN after each half microsecond of the script, and what `duty` makes of it.
    fn seen<M>(
        mut owner: M,
        mcu: impl Fn(&mut M) -> &mut dyn Mcu,
        duty: impl Fn(&mut M) -> f64,
    ) -> Vec<(u64, f64)> {
        set(mcu(&mut owner), 500, RCC.base + APB2ENR, 1);
        let mut script = SCRIPT.into_iter().peekable();
        let instants_ns = (1_000..180_000).step_by(500);
        instants_ns
            .map(|at_ns| {
                while let Some((_, register, value)) = script.next_if(|row| row.0 * 1_000 <= at_ns)
                {
                    set(mcu(&mut owner), at_ns, TIM1.base + register, value);
                }
                let is_on = get(mcu(&mut owner), at_ns, TIM1.base + CR1) & CEN;
                (is_on, duty(&mut owner))
            })
            .collect()
    }

    #[test]
    fn it_pulses_and_stops_when_the_emulators_own_does() {
        let pins = SensorPins::of_scene(&Scene::constant(2.0, 50.0)).unwrap();
        let here = seen(
            Nucleo::new(pins, SensorPins::fit).unwrap(),
            |board| board.mcu(0).unwrap(),
            |board| {
                let (pins, part) = board.pins();
                pins.drive.duty(part.bus().registers("TIM1").unwrap())
            },
        );
        let emulators = seen(
            Stm32f427::new().unwrap(),
            |part| part,
            |part| {
                let (timer, registers) = part.advanced_timer(0);
                let pulse = timer.pulse(Channel::new(1).unwrap(), registers);
                pulse.map_or(0.0, |pulse| pulse.width.0 as f64 / pulse.period.0 as f64)
            },
        );
        assert_eq!(here, emulators);
        let shares = [0.7, 0.4, 0.2, 0.8];
        let occurs = |share: f64| here.iter().any(|(_, duty)| (duty - share).abs() < 1e-9);
        assert!(shares.into_iter().all(occurs), "{here:?}");
    }
}
