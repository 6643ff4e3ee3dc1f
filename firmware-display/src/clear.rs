//! CLR, of all chips: high only as long as software says so again and again.
//!
//! CLR is low, and the outputs at 0 V, unless TIM1 counts: its channel is high from count 1 on, and it
//! stops by itself at the end of its only pulse. Software can only hold the fall off, tick by tick.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, OutputType, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::regs::{BdtrAdv, Cr1Gp16};
use embassy_stm32::pac::timer::vals::{Ocm, Ossi};
use embassy_stm32::peripherals::{PE9, TIM1};
use embassy_stm32::timer::low_level::Timer;

/// CLR falls this long after it was held off last: four ticks at 2 kHz.
const HOLD_OFF_US: u16 = 2_000;

/// So long before its end a pulse is left to end: from looking at it to starting it anew it takes less.
const FALLING_US: u16 = 2;

/// What holds CLR off.
pub struct ClearGuard {
    _timer: Timer<'static, TIM1>,
    _pin: Flex<'static>,
}

impl ClearGuard {
    /// CLR, low.
    pub fn new(timer: Timer<'static, TIM1>, pin: Peri<'static, PE9>) -> Self {
        let r = pac::TIM1;
        let clock_hz = timer.get_clock_frequency().0;
        r.psc().write_value((clock_hz / 1_000_000 - 1) as u16);
        r.arr().modify(|w| w.set_arr(HOLD_OFF_US));
        r.ccr(0).modify(|w| w.set_ccr(1));
        r.ccmr_output(0).modify(|w| w.set_ocm(0, Ocm::PWM_MODE2));
        r.ccer().modify(|w| w.set_cce(0, true));
        r.cr1().modify(|w| w.set_opm(true));
        // Loads the prescaler; the counter stays at 0 and CLR low.
        r.egr().write(|w| w.set_ug(true));
        r.bdtr().write_value(off());
        let mut pin = Flex::new(pin);
        pin.set_as_af_unchecked(1, AfType::output(OutputType::PushPull, Speed::Low));
        Self {
            _timer: timer,
            _pin: pin,
        }
    }

    /// Lets the counter drive the pin: CLR rises with [`ClearGuard::hold_off`].
    pub fn start(&mut self) {
        let mut on = off();
        on.set_moe(true);
        pac::TIM1.bdtr().write_value(on);
    }

    /// Whether CLR is low: it fell because it was not held off, or has never risen.
    pub fn is_low(&self) -> bool {
        !pac::TIM1.cr1().read().cen()
    }

    /// CLR high, for [`HOLD_OFF_US`] from now. Not if it has fallen, or is about to, though in this tick it was not seen low
    /// yet: it is left for the next tick to see.
    ///
    /// The counter is started before it is set: should software end between the two, it runs out and
    /// CLR falls. A counter that stood at 1 would keep CLR high: if the pulse before ended between the two, it is set
    /// back.
    pub fn hold_off(&mut self, was_low: bool) {
        let r = pac::TIM1;
        if !was_low && (self.is_low() || r.cnt().read().cnt() >= HOLD_OFF_US - FALLING_US) {
            return;
        }
        let mut running = Cr1Gp16(0);
        running.set_opm(true);
        running.set_cen(true);
        r.cr1().write_value(running);
        r.cnt().write(|w| w.set_cnt(1));
        if !r.cr1().read().cen() {
            r.cnt().write(|w| w.set_cnt(0));
        }
    }
}

/// CLR low, for good, from whatever context: for when the firmware can't go on.
pub fn pull() {
    pac::TIM1.bdtr().write_value(off());
    pac::TIM1.cr1().write(|w| w.set_cen(false));
}

/// The outputs off and at their idle level, which is low, rather than released.
fn off() -> BdtrAdv {
    let mut off = BdtrAdv(0);
    off.set_ossi(Ossi::IDLE_LEVEL);
    off
}
