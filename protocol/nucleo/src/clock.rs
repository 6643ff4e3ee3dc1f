//! The clock tree: 168 MHz from the ST-LINK's 8 MHz.

use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource,
    Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals, pac};

/// The clock that the ST-LINK puts on OSC_IN (UM1974, section 6.7.1).
const ST_LINK_CLOCK: Hertz = Hertz(8_000_000);

/// Sets the clocks up, lets the flash be read ahead and cached, and lets the time driver begin at zero. To be
/// called once.
///
/// At 168 MHz and 3.3 V a read of the flash takes six cycles, for sixteen bytes (RM0090, 3.5.1). The accelerator
/// that hides most of it is off after a reset, and embassy leaves it so.
///
/// The driver counts every compare match of TIM5's channel 1 as half a period gone by. When it sets the
/// timer up, counter and compare register are both zero, and RM0090 (18.4.5) calls CC1IF a match of the
/// two without saying whether an update generation may cause one. If it does, the clock begins 65.536 ms
/// ahead, and steps back by as much at the end of each half period, until the driver's interrupt has run.
/// So the flag is cleared before that interrupt may run: the first true match is 32 ms away.
pub fn start() -> Peripherals {
    critical_section::with(|_| {
        let peripherals = embassy_stm32::init(configuration());
        pac::FLASH.acr().modify(|flash| {
            flash.set_prften(true);
            flash.set_icen(true);
            flash.set_dcen(true);
        });
        // A flag is cleared by a zero, and left alone by a one.
        pac::TIM5.sr().write(|flags| {
            flags.0 = !0;
            flags.set_ccif(0, false);
        });
        peripherals
    })
}

/// SYSCLK and AHB 168 MHz, APB1 42 MHz, APB2 84 MHz; timers at 84 and 168 MHz.
fn configuration() -> Config {
    let mut configuration = Config::default();
    let rcc = &mut configuration.rcc;
    rcc.hse = Some(Hse {
        freq: ST_LINK_CLOCK,
        mode: HseMode::Bypass,
    });
    rcc.pll_src = PllSource::HSE;
    rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL168,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV4;
    rcc.apb2_pre = APBPrescaler::DIV2;
    configuration
}
