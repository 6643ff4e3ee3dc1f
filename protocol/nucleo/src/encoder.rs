//! The quadrature encoder, read at the very instant of the timer that paces everything else.
//!
//! TIM4 counts the encoder's edges (5 µm each). Its channel 3 captures the counter on TRC, which is
//! the trigger output of TIM3 (RM0090, 18.4.2 and 18.4.8): the position is latched by hardware at the
//! trigger, with no software in between, and may be read at any time before the next one.

use embassy_stm32::Peri;
use embassy_stm32::gpio::Pull;
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, Ts};
use embassy_stm32::peripherals::{PD12, PD13, TIM4};
use embassy_stm32::timer::qei::{self, Qei};

/// Channel 3, counted from 0.
const LATCH: usize = 2;

/// An encoder whose position is latched by TIM3.
pub struct Encoder {
    _counter: Qei<'static, TIM4>,
}

impl Encoder {
    /// Takes the counter and its pins; TIM3's trigger output must be its update event.
    pub fn new(
        counter: Peri<'static, TIM4>,
        a: Peri<'static, PD12>,
        b: Peri<'static, PD13>,
    ) -> Self {
        let configuration = qei::Config {
            ch1_pull: Pull::Up,
            ch2_pull: Pull::Up,
            ..Default::default()
        };
        let counter = Qei::new(counter, a, b, configuration);
        let timer = pac::TIM4;
        // ITR2 of TIM4 is TIM3 (RM0090 table 102).
        timer.smcr().modify(|w| w.set_ts(Ts::ITR2));
        timer
            .ccmr_input(LATCH / 2)
            .modify(|w| w.set_ccs(LATCH % 2, CcmrInputCcs::TRC));
        timer.ccer().modify(|w| w.set_cce(LATCH, true));
        Self { _counter: counter }
    }

    /// The counter at TIM3's last trigger.
    pub fn latched(&self) -> u16 {
        pac::TIM4.ccr(LATCH).read().ccr()
    }
}
