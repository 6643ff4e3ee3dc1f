//! What each estimator costs on the board, in instructions: every setting of ours and every rival that
//! runs here works through the same second of a fingertip on a 2 mm grating at 50 mm/s, 20 dB, after
//! another second that lets it start.
//!
//! A mark is a 32-bit write to the CRC unit's data register, `marks`: k before each millisecond of part k,
//! k + 100 after it, 999 when all is done. The parts' numbers, the settings and the
//! rivals are the simulator's own files.
//!
//! On a computer this is an empty program.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
#[path = "../../hil-sim/studies/src/estimators/baselines/mod.rs"]
#[allow(
    dead_code,
    reason = "the simulator has uses for it that a count has not"
)]
mod baselines;
#[cfg(target_os = "none")]
#[path = "../../hil-sim/studies/src/estimators/parts.rs"]
mod parts;
#[cfg(target_os = "none")]
#[path = "../../hil-sim/studies/src/estimators/settings.rs"]
#[allow(
    dead_code,
    reason = "the simulator has uses for it that a count has not"
)]
mod settings;

#[cfg(target_os = "none")]
mod marks;

#[cfg(target_os = "none")]
mod board {
    use core::f32::consts::PI;
    use core::hint::black_box;

    // The memory map, the vector table and the logger that the linker scripts ask for.
    use crate::marks::{DONE, enable_marks, mark};
    use defmt_rtt as _;
    use embassy_stm32 as _;
    use firmware_sensor::{MID_RAIL_CODE, SCANS_PER_SAMPLE, Scan, Sensor};
    use protocol::{CHANNELS, GAUGES, SensorConfiguration};
    use static_cell::ConstStaticCell;

    use crate::baselines::Rival;
    use crate::baselines::adapter::Entrant;
    use crate::baselines::registry::{Visitor, show_all};
    use crate::baselines::spectrum::LENGTH;
    use crate::parts::{FRONT, MILLISECONDS, RIVALS_FROM, SETTINGS_FROM, TRANSFORM};
    use crate::settings::SETTINGS;

    type Millisecond = [Scan; SCANS_PER_SAMPLE];
    /// One second, which fits its end to its beginning.
    type Signal = [Millisecond; MILLISECONDS as usize];

    /// v/λ of 50 mm/s and 2 mm, in cycles a ms.
    const CYCLES_PER_MS: f32 = 0.025;
    /// 50 mm/s in counts of 5 µm a ms.
    const COUNTS_PER_MS: usize = 10;
    /// Amplitude at unit gain, in ADC steps: 0.3 V of 3.3.
    const AMPLITUDE: f32 = 372.0;
    const GAINS: [f32; GAUGES] = [1.0, 0.8, 1.1, 0.6, 0.9];
    const PHASES_RAD: [f32; GAUGES] = [0.0, 0.4, -0.7, 1.1, -0.3];
    /// Half the width of an even spread with the RMS of 20 dB in 500 of 2 000 Hz: √3 · √(½ · 0.01 · 4).
    const NOISE: f32 = AMPLITUDE * 0.245;

    // Never on the stack, which holds less.
    static SIGNAL: ConstStaticCell<Signal> =
        ConstStaticCell::new([[[0; CHANNELS]; SCANS_PER_SAMPLE]; MILLISECONDS as usize]);
    static SENSOR: ConstStaticCell<Option<Sensor>> = ConstStaticCell::new(None);

    #[cortex_m_rt::entry]
    fn main() -> ! {
        enable_marks();
        let signal = SIGNAL.take();
        rub(signal);
        run_settings(signal);
        run_rivals(signal);
        run_front(signal);
        mark(DONE);
        loop {
            cortex_m::asm::wfi();
        }
    }

    fn rub(signal: &mut Signal) {
        let mut noise = Noise(1);
        for (ms, scans) in signal.iter_mut().enumerate() {
            for (quarter, scan) in scans.iter_mut().enumerate() {
                let cycles = CYCLES_PER_MS * (ms as f32 + 0.25 * quarter as f32);
                for (gauge, code) in scan.iter_mut().enumerate() {
                    *code = MID_RAIL_CODE;
                    if gauge < GAUGES {
                        let angle = 2.0 * PI * cycles + PHASES_RAD[gauge];
                        let height = libm::sinf(angle) + 0.25 * libm::sinf(3.0 * angle);
                        let swing = GAINS[gauge] * AMPLITUDE * height + NOISE * noise.even();
                        *code = (f32::from(MID_RAIL_CODE) + swing) as u16;
                    }
                }
            }
        }
    }

    // Each of these, and each rival, has a frame of its own: the stack does not hold all of them at once.
    #[inline(never)]
    fn run_settings(signal: &Signal) {
        let place = SENSOR.take();
        for (part, setting) in (SETTINGS_FROM..).zip(&SETTINGS) {
            let sensor = place.insert(Sensor::new(setting.on(SensorConfiguration::DEFAULT)));
            part_of(part, signal, |ms, scans, encoder| {
                black_box(sensor.step(ms as u64 * 1_000, scans, encoder));
            });
        }
    }

    #[inline(never)]
    fn run_rivals(signal: &Signal) {
        let mut field = Field {
            signal,
            next: RIVALS_FROM,
        };
        show_all(&mut field);
    }

    #[inline(never)]
    fn run_front(signal: &Signal) {
        let mut front = Entrant::new(Silent);
        part_of(FRONT, signal, |_, scans, encoder| {
            black_box(front.step(scans, encoder));
        });
        let mut samples = [1.0; LENGTH];
        part_of(TRANSFORM, signal, |_, _, _| {
            black_box(microfft::real::rfft_512(black_box(&mut samples)));
        });
    }

    /// Part `number`: `step` on every millisecond of two seconds, the second one counted.
    #[inline(never)]
    fn part_of(number: u32, signal: &Signal, mut step: impl FnMut(usize, &Millisecond, u16)) {
        for second in 0..2 {
            for (ms, scans) in black_box(signal).iter().enumerate() {
                let ms = second * signal.len() + ms;
                if second == 1 {
                    mark(number);
                }
                step(ms, scans, (ms * COUNTS_PER_MS) as u16);
                if second == 1 {
                    mark(number + 100);
                }
            }
        }
    }

    struct Field<'a> {
        signal: &'a Signal,
        next: u32,
    }

    impl Visitor for Field<'_> {
        #[inline(never)]
        fn visit<R: Rival + 'static>(&mut self, _: &'static str, _: u16, rival: fn() -> R) {
            let mut entrant = Entrant::new(rival());
            part_of(self.next, self.signal, |_, scans, encoder| {
                black_box(entrant.step(scans, encoder));
            });
            self.next += 1;
        }
    }

    /// What anti-aliasing and travel cost without a rival behind them.
    struct Silent;

    impl Rival for Silent {
        fn push(&mut self, sample: &[f32; GAUGES]) {
            black_box(sample);
        }

        fn frequency_hz(&mut self) -> Option<f32> {
            None
        }

        fn age_half_ms(&self) -> usize {
            8
        }
    }

    /// Xorshift, 32 bits.
    struct Noise(u32);

    impl Noise {
        /// From −1 to 1.
        fn even(&mut self) -> f32 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 17;
            self.0 ^= self.0 << 5;
            self.0 as f32 / 2_147_483_648.0 - 1.0
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}
