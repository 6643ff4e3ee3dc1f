//! What the filters and the estimators cost on the board, in instructions: each part is run for 1 000 ms
//! of a signal, between two marks that an emulator can see.
//!
//! A mark is a 32-bit write to the CRC unit's data register, `marks`: k at the start of part k, k + 100
//! at its end, 999 when all is done. The whole sensors have their marks around each millisecond, so that
//! the longest of them can be told.
//!
//! The filters alone work on noise. The whole sensors rub over a grating of 2 mm, v = 70 sin(2π 0.83 t)
//! mm/s, with noise 20 dB below the fundamental: what an estimator has to do depends on what it is given.
//!
//! | part | what |
//! | --- | --- |
//! | 0 | nothing but the loop over the signal |
//! | 1 | band-pass and crossings of five gauges, `firmware-sensor` |
//! | 2 | the same with `biquad`, direct form II transposed |
//! | 3 | the same with `idsp`, direct form II transposed |
//! | 4 | anti-aliasing of six channels |
//! | 5 | the whole of `Sensor::step`, `Method::Counting` |
//! | 6 | the same with `Method::AdaptedCounting` |
//! | 7 | the same with `Method::Crossings` |
//! | 8 | the same with `Method::Spectrum` |
//! | 9 | the same, 1 mm at 70 mm/s throughout |
//! | 10 | the same with noise as strong as the fundamental |
//! | 11 | the same as 9 with hum of 50 Hz as large as the signal |
//! | 12 | 4 mm at 30 mm/s, a second wave of 0.618 λ nearly as strong |
//!
//! On a computer this is an empty program: `cargo bench -p firmware-sensor` measures there.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod marks;

#[cfg(target_os = "none")]
mod board {
    use core::f32::consts::TAU;
    use core::hint::black_box;

    use biquad::Biquad;
    // The memory map, the vector table and the logger that the linker scripts ask for.
    use crate::marks::{DONE, enable_marks, mark};
    use defmt_rtt as _;
    use dsp_process::SplitProcess;
    use embassy_stm32 as _;
    use firmware_sensor::bandpass::{BAND, BandPass, ORDER};
    use firmware_sensor::crossing::Crossing;
    use firmware_sensor::decimate::{AntiAlias, History};
    use firmware_sensor::{
        MICROMETRES_PER_COUNT, MID_RAIL_CODE, SCAN_RATE_HZ, SCANS_PER_SAMPLE, Scan, Sensor,
    };
    use protocol::{CHANNELS, GAUGES, Method, SensorConfiguration};
    use static_cell::ConstStaticCell;

    const MILLISECONDS: usize = 1_000;

    type Millisecond = [Scan; SCANS_PER_SAMPLE];
    type Signal = [Millisecond; MILLISECONDS];

    // Statics, and never on the stack, which holds less.
    static SCANS: ConstStaticCell<Signal> =
        ConstStaticCell::new([[[0; CHANNELS]; SCANS_PER_SAMPLE]; MILLISECONDS]);
    static SAMPLES: ConstStaticCell<[[f32; GAUGES]; MILLISECONDS]> =
        ConstStaticCell::new([[0.0; GAUGES]; MILLISECONDS]);
    static ENCODER: ConstStaticCell<[u16; MILLISECONDS]> = ConstStaticCell::new([0; MILLISECONDS]);

    #[cortex_m_rt::entry]
    fn main() -> ! {
        enable_marks();
        let (scans, samples, encoder) = (SCANS.take(), SAMPLES.take(), ENCODER.take());
        let mut noise = Noise(1);
        for (scans, sample) in scans.iter_mut().zip(samples.iter_mut()) {
            *scans = [[(); CHANNELS]; SCANS_PER_SAMPLE].map(|scan| scan.map(|()| noise.code()));
            *sample = [(); GAUGES].map(|()| f32::from(noise.code()) - f32::from(MID_RAIL_CODE));
        }
        run(scans, samples);
        rub(&STROKE, scans, encoder, &mut noise);
        for (number, method) in [
            (5, Method::Counting),
            (6, Method::AdaptedCounting),
            (7, Method::Crossings),
            (8, Method::Spectrum),
        ] {
            sense(number, method, scans, encoder);
        }
        for (number, rubbed) in HARD {
            rub(&rubbed, scans, encoder, &mut noise);
            sense(number, Method::Spectrum, scans, encoder);
        }
        mark(DONE);
        loop {
            cortex_m::asm::wfi();
        }
    }

    fn run(scans: &Signal, samples: &[[f32; GAUGES]; MILLISECONDS]) {
        let ours = BandPass::<ORDER>::new(BAND);
        let biquads = ours.biquads();

        part(0, samples, |_, x| x);

        let mut lanes = [ours.settled(0.0); GAUGES];
        part(1, samples, |gauge, x| ours.step(&mut lanes[gauge], x));

        let sections = biquads.map(|[b0, b1, b2, a1, a2]| {
            biquad::DirectForm2Transposed::<f32>::new(biquad::Coefficients { b0, b1, b2, a1, a2 })
        });
        let mut lanes = [sections; GAUGES];
        part(2, samples, |gauge, x| {
            lanes[gauge].iter_mut().fold(x, |x, section| section.run(x))
        });

        // idsp's recursive coefficients have the other sign.
        let sections = biquads.map(|[b0, b1, b2, a1, a2]| idsp::iir::Biquad::<f32> {
            ba: [b0, b1, b2, -a1, -a2],
        });
        let mut lanes: [[idsp::iir::DirectForm2Transposed<f32>; ORDER]; GAUGES] =
            Default::default();
        part(3, samples, |gauge, x| {
            let sections = sections.iter().zip(&mut lanes[gauge]);
            sections.fold(x, |x, (section, lane)| section.process(lane, x))
        });

        let anti_alias = AntiAlias::new();
        let mut history = History::settled(&scans[0][0]);
        mark(4);
        for scans in black_box(scans) {
            black_box(anti_alias.step(&mut history, scans));
        }
        mark(104);
    }

    /// What is rubbed, and how.
    struct Rubbed {
        wavelength_mm: f32,
        /// The highest speed of a stroke; the only one, if `strokes_hz` is 0.
        peak_mm_s: f32,
        strokes_hz: f32,
        /// Noise, hum of 50 Hz and a second wave of 0.618 λ, over the fundamental's amplitude; the noise in rms.
        noise: f32,
        hum: f32,
        second_wave: f32,
    }

    /// The paper's stroke over 2 mm, noise 20 dB below the fundamental in 0–500 Hz, white to 2 kHz:
    /// 0.1/√2 · √4 of the amplitude.
    const STROKE: Rubbed = Rubbed {
        wavelength_mm: 2.0,
        peak_mm_s: 70.0,
        strokes_hz: 0.83,
        noise: 0.1 * core::f32::consts::SQRT_2,
        hum: 0.0,
        second_wave: 0.0,
    };
    const FINE: Rubbed = Rubbed {
        wavelength_mm: 1.0,
        strokes_hz: 0.0,
        ..STROKE
    };
    /// Seconds that take the default estimator longer.
    const HARD: [(u32, Rubbed); 4] = [
        (9, FINE),
        (
            10,
            Rubbed {
                noise: 10.0 * STROKE.noise,
                ..FINE
            },
        ),
        (11, Rubbed { hum: 1.0, ..FINE }),
        (
            12,
            Rubbed {
                wavelength_mm: 4.0,
                peak_mm_s: 30.0,
                second_wave: 0.9,
                ..FINE
            },
        ),
    ];

    /// A rub over a grating, as the gauges and the encoder have it.
    #[inline(never)]
    fn rub(
        rubbed: &Rubbed,
        scans: &mut Signal,
        encoder: &mut [u16; MILLISECONDS],
        noise: &mut Noise,
    ) {
        const SWING: f32 = 370.0;
        const PLACES_MM: [f32; GAUGES] = [-3.2, -1.3, 0.0, 1.6, 3.0];
        // Uniform codes, ±2 048, have a deviation of 1 182.
        let of_code = rubbed.noise * SWING / 1_182.0;
        let position_mm = |scan: usize| {
            let t_s = scan as f32 / SCAN_RATE_HZ as f32;
            if rubbed.strokes_hz == 0.0 {
                return rubbed.peak_mm_s * t_s;
            }
            let omega = TAU * rubbed.strokes_hz;
            rubbed.peak_mm_s / omega * (1.0 - libm::cosf(omega * t_s))
        };
        for (ms, (scans, encoder)) in scans.iter_mut().zip(encoder).enumerate() {
            let first = ms * SCANS_PER_SAMPLE;
            for (number, scan) in scans.iter_mut().enumerate() {
                let arm_mm = position_mm(first + number);
                let t_s = (first + number) as f32 / SCAN_RATE_HZ as f32;
                let hum = rubbed.hum * libm::sinf(TAU * 50.0 * t_s);
                for (code, place_mm) in scan.iter_mut().zip(PLACES_MM) {
                    let angle = TAU * (arm_mm + place_mm) / rubbed.wavelength_mm;
                    let second = rubbed.second_wave * libm::sinf(angle / 0.618);
                    let signal = libm::sinf(angle) + 0.2 * libm::sinf(3.0 * angle) + second + hum;
                    let random = f32::from(noise.code()) - f32::from(MID_RAIL_CODE);
                    *code = (f32::from(MID_RAIL_CODE) + SWING * signal + of_code * random) as u16;
                }
                scan[GAUGES] = MID_RAIL_CODE;
            }
            let position_um = 1_000.0 * position_mm(first + SCANS_PER_SAMPLE - 1);
            *encoder = (position_um / MICROMETRES_PER_COUNT as f32) as i32 as u16;
        }
    }

    /// Part `number`: a whole sensor.
    #[inline(never)]
    fn sense(number: u32, method: Method, scans: &Signal, encoder: &[u16; MILLISECONDS]) {
        let mut sensor = Sensor::new(SensorConfiguration {
            method,
            ..SensorConfiguration::DEFAULT
        });
        for (ms, (scans, encoder)) in black_box(scans).iter().zip(encoder).enumerate() {
            mark(number);
            black_box(&sensor.step(ms as u64 * 1_000, scans, *encoder));
            mark(number + 100);
        }
    }

    /// Part `number`: `filter` on all gauges and the crossings of what comes out.
    #[inline(never)]
    fn part(
        number: u32,
        samples: &[[f32; GAUGES]; MILLISECONDS],
        mut filter: impl FnMut(usize, f32) -> f32,
    ) {
        let mut crossing = [Crossing::default(); GAUGES];
        mark(number);
        for sample in black_box(samples) {
            let mut impulses = [false; GAUGES];
            for gauge in 0..GAUGES {
                impulses[gauge] = crossing[gauge].step(filter(gauge, sample[gauge]));
            }
            black_box(impulses);
        }
        mark(number + 100);
    }

    /// Xorshift, 32 bits.
    struct Noise(u32);

    impl Noise {
        fn code(&mut self) -> u16 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 17;
            self.0 ^= self.0 << 5;
            (self.0 >> 20) as u16
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}
