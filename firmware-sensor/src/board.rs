//! The sensor board's hardware: pins, clocks, timers and DMA; nothing that computes.
//!
//! | what | where |
//! | --- | --- |
//! | gauges 0–4, tangential force | A0–A5: PA3 PC0 PC3 PF3 PF5 PF10, all ADC3, DMA2 stream 0 |
//! | scan trigger, encoder latch | TIM3, 4 kHz |
//! | arm encoder | TIM4, PD12 PD13 |
//! | arm drive | TIM1 channel 1 PWM on D6 (PE9), direction on D7 (PF13) |
//! | peer | USART2, PD5 PD6, DMA1 streams 6 and 5 |
//! | console | USART3, PD8 PD9, DMA1 streams 3 and 1 |
//! | link LED | LD1 (PB0) |

use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_futures::select::{Either, select};
use embassy_stm32::adc::vals::Exten;
use embassy_stm32::adc::{Adc, AdcChannel, RingBufferedAdc, SampleTime};
use embassy_stm32::gpio::{AfType, Flex, Level, Output, OutputType, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::typelevel::{self, Handler};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::{Mms, Ocm, Ossi};
use embassy_stm32::peripherals::{ADC3, DMA2_CH0, PE9, TIM1, TIM3};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_stm32::triggers::TIM3_TRGO;
use embassy_stm32::{Peri, bind_interrupts, dma};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Duration;
use firmware_sensor::{Drive, SCAN_RATE_HZ, SCANS_PER_SAMPLE, Scan};
use nucleo::encoder::Encoder;
use nucleo::serial::{self, Serial};
use nucleo::supervision::Vitals;
use protocol::{CHANNELS, Configuration, Trip};
use static_cell::StaticCell;

bind_interrupts!(struct Irqs {
    DMA2_STREAM0 => dma::InterruptHandler<DMA2_CH0>;
    ADC => OverrunHandler;
});

/// Set by the converter when DMA did not fetch a word in time.
static OVERRUN: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The converter stops asking for DMA after an overrun (RM0090, 13.8.1): tells the sampler to begin anew.
pub struct OverrunHandler;

impl Handler<typelevel::ADC> for OverrunHandler {
    #[allow(unsafe_code, reason = "the trait's signature")]
    unsafe fn on_interrupt() {
        pac::ADC3.cr1().modify(|w| w.set_ovrie(false));
        OVERRUN.signal(());
    }
}

/// Words of the scans that make one sample.
const BLOCK: usize = SCANS_PER_SAMPLE * CHANNELS;
/// Two blocks: DMA fills one while the other is read.
const RING: usize = 2 * BLOCK;
/// 28 + 12 ADC clocks at 21 MHz: 1.9 µs a channel, 11.4 µs a scan.
const SAMPLE_TIME: SampleTime = SampleTime::CYCLES28;
const ARM_PWM: Hertz = Hertz(20_000);
/// Of a command: as many as the timer can count.
const PULSES: u16 = 256;
/// Waited for before a drive that was commanded off is said to be.
pub const ARM_PWM_PERIOD: Duration = Duration::from_hz(ARM_PWM.0 as u64);

/// Bytes of each port's ring. On a line without a gap half of it passes before anyone is told, 2.8 ms:
/// with that a Stop is obeyed within 5 ms.
const RING_BYTES: usize = 512;

/// Runs the sampling task above everything else, on the vector of a peripheral that is not used.
static SAMPLING: InterruptExecutor = InterruptExecutor::new();

#[embassy_stm32::interrupt]
#[allow(
    unsafe_code,
    reason = "the executor's interrupt hook is unsafe to call from elsewhere"
)]
unsafe fn UART5() {
    // SAFETY: this is the handler of the interrupt that SAMPLING was started with.
    unsafe { SAMPLING.on_interrupt() }
}

/// Everything on the board, ready and not yet running.
pub struct Board {
    /// Spawns tasks that preempt all others.
    pub sampling: SendSpawner,
    /// Gauges and encoder.
    pub sampler: Sampler,
    /// The arm's servo drive.
    pub arm: ArmDrive,
    /// Why the arm is to stay stopped, if a reset found it so.
    pub trip: Option<Trip>,
    /// What was in force before the watchdog restarted the board.
    pub configuration: Option<Configuration>,
    /// The port to the other board.
    pub peer: Serial,
    /// The console port.
    pub console: Serial,
    /// What keeps the board alive.
    pub vitals: Vitals,
}

impl Board {
    /// Sets the hardware up. To be called once.
    pub fn take() -> Self {
        static ADC_RING: StaticCell<[u16; RING]> = StaticCell::new();
        let started = nucleo::reset::cause();
        let trip = nucleo::trip::kept_after(started.0);
        let configuration = nucleo::kept_configuration::after(started.0);
        let p = nucleo::clock::start();
        let vitals = Vitals::new(p.IWDG, p.PB0, started);

        let encoder = Encoder::new(p.TIM4, p.PD12, p.PD13);
        let channels = [
            p.PA3.degrade_adc(),
            p.PC0.degrade_adc(),
            p.PC3.degrade_adc(),
            p.PF3.degrade_adc(),
            p.PF5.degrade_adc(),
            p.PF10.degrade_adc(),
        ];
        // The converters' common registers, which hold their prescaler, may hang on ADC1's clock; the manual does not say.
        // If they do, and it is off, ADC3 runs at 42 MHz, of 36 MHz at most.
        pac::RCC.apb2enr().modify(|w| w.set_adc1en(true));
        let mut adc = Adc::<ADC3>::new(p.ADC3).into_ring_buffered(
            p.DMA2_CH0,
            ADC_RING.init([0; RING]),
            Irqs,
            channels.into_iter().map(|channel| (channel, SAMPLE_TIME)),
            TIM3_TRGO,
            Exten::RISING_EDGE,
        );
        // Also after scans were lost: DMA tells of each block's end, and the encoder is read then.
        adc.set_alignment(BLOCK);
        let trigger = Timer::new(p.TIM3);
        trigger.set_frequency(Hertz(SCAN_RATE_HZ), RoundTo::Slower);
        trigger.set_master_mode(Mms::UPDATE);

        let forward = Output::new(p.PF13, Level::Low, Speed::Low);
        let arm = ArmDrive::new(Timer::new(p.TIM1), p.PE9, forward);

        static PEER: StaticCell<[u8; RING_BYTES]> = StaticCell::new();
        static CONSOLE: StaticCell<[u8; RING_BYTES]> = StaticCell::new();
        let (ring, other) = (PEER.init([0; RING_BYTES]), CONSOLE.init([0; RING_BYTES]));
        let peer = serial::peer(p.USART2, p.PD6, p.PD5, p.DMA1_CH6, p.DMA1_CH5, ring);
        let console = serial::console(p.USART3, p.PD9, p.PD8, p.DMA1_CH3, p.DMA1_CH1, other);

        interrupt::UART5.set_priority(Priority::P6);
        Self {
            sampling: SAMPLING.start(interrupt::UART5),
            sampler: Sampler {
                adc,
                trigger,
                encoder,
            },
            arm,
            trip,
            configuration,
            peer,
            console,
            vitals,
        }
    }
}

/// The gauges and the arm's encoder, sampled together by TIM3.
pub struct Sampler {
    adc: RingBufferedAdc<'static, ADC3>,
    trigger: Timer<'static, TIM3>,
    encoder: Encoder,
}

/// Why scans were lost. Sampling goes on with fresh ones.
pub enum ScansLost {
    /// The converter was overrun: DMA did not fetch a word before the next was there.
    Converter,
    /// The DMA ring was overrun: it was not read for 2 ms.
    Ring,
}

impl Sampler {
    /// Starts the trigger, once DMA and converter are ready for it.
    pub fn start(&mut self) {
        self.restart();
        interrupt::ADC.set_priority(Priority::P6);
        interrupt::ADC.unpend();
        #[allow(
            unsafe_code,
            reason = "unmasking an interrupt whose handler is bound above"
        )]
        // SAFETY: no critical section relies on this interrupt being masked.
        unsafe {
            interrupt::ADC.enable();
        }
        self.trigger.start();
    }

    fn restart(&mut self) {
        pac::ADC3.sr().modify(|w| w.set_ovr(false));
        self.adc.start();
        pac::ADC3.cr1().modify(|w| {
            // DMA fetches each word; an interrupt a conversion would only cost time.
            w.set_eocie(false);
            w.set_ovrie(true);
        });
    }

    /// The next sample's scans, and the encoder's position at the last of them. Nothing is lost if this is dropped.
    pub async fn next(&mut self) -> Result<([Scan; SCANS_PER_SAMPLE], u16), ScansLost> {
        let mut words = [0; BLOCK];
        match select(self.adc.read(&mut words), OVERRUN.wait()).await {
            Either::First(Ok(_)) => {}
            Either::First(Err(_)) => return Err(ScansLost::Ring),
            Either::Second(()) => {
                self.adc.stop();
                self.restart();
                return Err(ScansLost::Converter);
            }
        }
        let encoder = self.encoder.latched();
        let mut scans = [Scan::default(); SCANS_PER_SAMPLE];
        for (scan, words) in scans.iter_mut().zip(words.chunks_exact(CHANNELS)) {
            scan.copy_from_slice(words);
        }
        Ok((scans, encoder))
    }
}

/// The arm's servo drive: speed as PWM duty, direction on a pin.
///
/// TIM1 repeats its pulse [`PULSES`] times after each command, and stops at its beginning, where the pin is low (RM0090,
/// 17.3.3 and 17.3.10): whatever keeps the next command from coming, the drive is off 12.8 ms after the last one.
pub struct ArmDrive {
    _timer: Timer<'static, TIM1>,
    _pin: Flex<'static>,
    forward: Output<'static>,
    /// Counts of a period.
    period: u16,
}

impl ArmDrive {
    fn new(timer: Timer<'static, TIM1>, pin: Peri<'static, PE9>, forward: Output<'static>) -> Self {
        let period = (timer.get_clock_frequency().0 / ARM_PWM.0) as u16;
        let r = pac::TIM1;
        r.arr().modify(|w| w.set_arr(period - 1));
        r.rcr().modify(|w| w.set_rep(PULSES - 1));
        // Low first, and high for the rest of a period.
        r.ccr(0).modify(|w| w.set_ccr(period));
        r.ccmr_output(0).modify(|w| w.set_ocm(0, Ocm::PWM_MODE2));
        r.ccer().modify(|w| w.set_cce(0, true));
        r.cr1().modify(|w| w.set_opm(true));
        r.bdtr().modify(|w| w.set_ossi(Ossi::IDLE_LEVEL));
        let mut pin = Flex::new(pin);
        pin.set_as_af_unchecked(1, AfType::output(OutputType::PushPull, Speed::Low));
        Self {
            _timer: timer,
            _pin: pin,
            forward,
            period,
        }
    }

    /// Lets the drive follow commands; 0 until the first.
    pub fn enable(&mut self) {
        pac::TIM1.bdtr().modify(|w| w.set_moe(true));
    }

    /// Puts a command on the pins, for [`PULSES`] periods from now.
    pub fn set(&mut self, drive: Drive) {
        self.forward.set_level(if drive.forward {
            Level::High
        } else {
            Level::Low
        });
        let high = u32::from(self.period) * u32::from(drive.duty) / u32::from(Drive::FULL);
        let r = pac::TIM1;
        // Never all of it: the counter stops at 0, where the pin has to be low.
        let low = (u32::from(self.period) - high).max(1) as u16;
        r.ccr(0).modify(|w| w.set_ccr(low));
        // Begins a period and counts anew; it stops the counter as well.
        r.egr().write(|w| w.set_ug(true));
        r.cr1().modify(|w| w.set_cen(drive.duty > 0));
    }
}
