//! The clock tree: 168 MHz from the ST-LINK's 8 MHz.

use embassy_stm32::Config;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource,
    Sysclk,
};
use embassy_stm32::time::Hertz;

/// The clock that the ST-LINK puts on OSC_IN (UM1974, section 6.7.1).
const ST_LINK_CLOCK: Hertz = Hertz(8_000_000);

/// SYSCLK and AHB 168 MHz, APB1 42 MHz, APB2 84 MHz; timers at 84 and 168 MHz.
pub fn configuration() -> Config {
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
