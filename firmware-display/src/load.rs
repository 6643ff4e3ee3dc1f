//! LDAC, of all chips: its falling edge makes the words voltages, at the same time after every tick.
//!
//! The pin is TIM3's channel 1. The tick forces it high; once the last frame is out it is armed to go low
//! when the counter matches [`OFFSET_US`], so that the edge has the timer's accuracy and nothing of the
//! software's. Armed after the match it stays high, and the tick sees that the words have not been loaded.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, OutputType, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::regs::CcmrOutputGp16;
use embassy_stm32::pac::timer::vals::Ocm;
use embassy_stm32::peripherals::PC6;

/// From the tick to the edge. The slowest tick, `texture` in travelling mode at 4 kHz, has its words out 97 µs after the
/// tick by the higher of two estimates (`hil-sim budget --rendering texture`); arming takes up to 4 µs more.
pub const OFFSET_US: u32 = 102;

const CHANNEL: usize = 0;
const PIN: usize = 6;
const ALTERNATE_FUNCTION: u8 = 2;

/// LDAC's pin.
pub struct Load {
    _pin: Flex<'static>,
}

impl Load {
    /// LDAC, high; TIM3 counts at `clock_hz`.
    pub fn new(pin: Peri<'static, PC6>, clock_hz: u32) -> Self {
        let timer = pac::TIM3;
        let offset = clock_hz / 1_000_000 * OFFSET_US;
        timer.ccr(CHANNEL).write(|w| w.set_ccr(offset as u16));
        timer.ccmr_output(0).write_value(mode(Ocm::FORCE_ACTIVE));
        timer.ccer().modify(|w| w.set_cce(CHANNEL, true));
        let mut pin = Flex::new(pin);
        let output = AfType::output(OutputType::PushPull, Speed::VeryHigh);
        pin.set_as_af_unchecked(ALTERNATE_FUNCTION, output);
        Self { _pin: pin }
    }
}

/// LDAC high, from any context; whether it was low.
pub fn raise() -> bool {
    let was_low = !is_high();
    pac::TIM3
        .ccmr_output(0)
        .write_value(mode(Ocm::FORCE_ACTIVE));
    was_low
}

/// LDAC low at the next match, if it is further away than `least_us`; whether it is.
pub fn arm(least_us: u32) -> bool {
    let timer = pac::TIM3;
    let offset = u32::from(timer.ccr(CHANNEL).read().ccr());
    let least = offset / OFFSET_US * least_us;
    let is_early = u32::from(timer.cnt().read().cnt()) + least < offset;
    if is_early {
        timer
            .ccmr_output(0)
            .write_value(mode(Ocm::INACTIVE_ON_MATCH));
    }
    is_early
}

/// The level on the wire, whatever the timer wants it to be.
pub fn is_high() -> bool {
    pac::GPIOC.idr().read().idr(PIN) == pac::gpio::vals::Idr::HIGH
}

fn mode(of_channel: Ocm) -> CcmrOutputGp16 {
    let mut mode = CcmrOutputGp16(0);
    mode.set_ocm(CHANNEL, of_channel);
    mode
}
