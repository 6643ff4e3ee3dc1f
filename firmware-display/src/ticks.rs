//! The output tick: TIM3, and what hangs on it by hardware: the hand's position and LDAC.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embassy_stm32::interrupt::typelevel::{self, Handler};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::Mms;
use embassy_stm32::peripherals::TIM3;
use embassy_stm32::timer::low_level::Timer;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use nucleo::encoder::Encoder;
use protocol::UpdateRate;

use crate::load;

/// Ticks of TIM3 since the start, wrapping.
static TICKS: AtomicU32 = AtomicU32::new(0);
/// Whether LDAC had fallen when the last tick came.
static LOADED: AtomicBool = AtomicBool::new(false);
static TICKED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Counts TIM3's ticks, raises LDAC and wakes the output task. Deadline: [`load::OFFSET_US`]; missed, an
/// edge armed too late for the last tick comes now.
pub struct TickHandler;

impl Handler<typelevel::TIM3> for TickHandler {
    #[allow(unsafe_code, reason = "the trait's signature")]
    unsafe fn on_interrupt() {
        pac::TIM3.sr().write(|w| w.0 = !1);
        LOADED.store(load::raise(), Ordering::Relaxed);
        TICKS.store(
            TICKS.load(Ordering::Relaxed).wrapping_add(1),
            Ordering::Relaxed,
        );
        TICKED.signal(());
    }
}

/// Whether the words of the tick before this one became voltages.
pub fn loaded() -> bool {
    LOADED.load(Ordering::Relaxed)
}

/// The output tick and the hand's encoder, latched by it.
pub struct Ticks {
    timer: Timer<'static, TIM3>,
    encoder: Encoder,
    seen: u32,
}

impl Ticks {
    /// The tick, not yet started, with TIM3's trigger for `encoder` to latch.
    pub fn new(timer: Timer<'static, TIM3>, encoder: Encoder) -> Self {
        timer.set_autoreload_preload(true);
        let mut ticks = Self {
            timer,
            encoder,
            seen: 0,
        };
        ticks.set_rate(UpdateRate::default());
        // Loads what was set, which is no tick.
        pac::TIM3.egr().write(|w| w.set_ug(true));
        ticks.timer.set_master_mode(Mms::UPDATE);
        ticks
    }

    /// Starts the tick.
    pub fn start(&mut self) {
        self.timer.enable_update_interrupt(true);
        interrupt::TIM3.set_priority(Priority::P5);
        interrupt::TIM3.unpend();
        #[allow(
            unsafe_code,
            reason = "unmasking an interrupt whose handler is bound in board.rs"
        )]
        // SAFETY: no critical section relies on this interrupt being masked.
        unsafe {
            interrupt::TIM3.enable();
        }
        self.timer.start();
    }

    /// Sets the rate from the next tick on.
    pub fn set_rate(&mut self, rate: UpdateRate) {
        let clock_hz = self.timer.get_clock_frequency().0;
        pac::TIM3
            .arr()
            .write(|w| w.set_arr((clock_hz / rate.hz() - 1) as u16));
    }

    /// Waits for the next tick. Returns the hand encoder at it, and the ticks missed since the last call.
    pub async fn next(&mut self) -> (u16, u32) {
        TICKED.wait().await;
        let ticks = TICKS.load(Ordering::Relaxed);
        let missed = ticks.wrapping_sub(self.seen).saturating_sub(1);
        self.seen = ticks;
        (self.encoder.latched(), missed)
    }
}
