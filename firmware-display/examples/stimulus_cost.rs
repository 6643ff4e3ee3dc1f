//! What the stimulus costs on the board, in instructions a tick: the whole of it in each mode, and its
//! parts, with fifty distinct actuators. Each part works for 1 000 ticks of a hand at 70 mm/s.
//!
//! A mark is a 32-bit write to the CRC unit's data register, `marks`: k before each tick of part k, k + 100
//! after it, 999 when all is done. The parts' numbers are in `PARTS`.
//!
//! On a computer this is an empty program.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
#[path = "../../firmware-sensor/examples/marks/mod.rs"]
mod marks;

#[cfg(target_os = "none")]
mod board {
    use core::hint::black_box;

    // The memory map, the vector table and the logger that the linker scripts ask for.
    use crate::marks::{DONE, enable_marks, mark};
    use defmt_rtt as _;
    use embassy_stm32 as _;
    use firmware_display::array::Array;
    use firmware_display::balance::Balance;
    use firmware_display::gate::OPEN;
    use firmware_display::level::FULL;
    use firmware_display::pattern::Pattern;
    use firmware_display::phase::{Phase, Wavelength};
    use firmware_display::{ACTUATORS, Stimulus, ZERO_VOLT};
    use protocol::actuators::DEFAULT_ACTUATORS;
    use protocol::{DisplayConfiguration, Mode, UpdateRate};

    /// Ticks of each part.
    const TICKS: u32 = 1_000;
    /// 70 mm/s at 2 kHz.
    const COUNTS: i16 = 7;
    /// The supervisor's whole gain.
    const WHOLE: u32 = 1 << 31;
    /// The most that a word may change by in a tick at 2 kHz: 4 V.
    const MOST: i32 = 26_214;

    /// The parts, by number.
    #[repr(u32)]
    enum Part {
        /// A tick in uniform mode, worked out once for all.
        Uniform = 1,
        /// A tick in travelling mode.
        Travelling,
        /// The same while it glides to another λ.
        Gliding,
        /// Another λ, in travelling mode.
        Follow,
        /// Phase and glide.
        Phase,
        /// Fifty sines.
        Sines,
        /// Fifty means.
        Balance,
        /// Fifty words.
        Words,
        /// A tick of a hand at rest.
        Resting,
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        enable_marks();
        whole();
        parts();
        mark(DONE);
        loop {
            cortex_m::asm::wfi();
        }
    }

    /// `step` at each tick of a part.
    #[inline(never)]
    fn count(part: Part, mut step: impl FnMut(u32)) {
        let number = part as u32;
        for tick in 0..TICKS {
            mark(number);
            step(tick);
            mark(number + 100);
        }
    }

    fn moving(mode: Mode) -> Stimulus {
        let configuration = DisplayConfiguration {
            mode,
            ..DisplayConfiguration::DEFAULT
        };
        let mut stimulus = Stimulus::new(&configuration, &DEFAULT_ACTUATORS);
        stimulus.follow(wavelength(0), 100.0);
        for _ in 0..100 {
            stimulus.tick(COUNTS, WHOLE);
        }
        stimulus
    }

    /// From 2 to 4 mm.
    fn wavelength(index: u32) -> Wavelength {
        let mm = 2.0 + (index % 128) as f32 / 64.0;
        match Wavelength::new(black_box(mm)) {
            Some(wavelength) => wavelength,
            None => loop {
                cortex_m::asm::wfi();
            },
        }
    }

    fn whole() {
        let mut uniform = moving(Mode::Uniform);
        count(Part::Uniform, |_| {
            black_box(uniform.tick(black_box(COUNTS), WHOLE));
        });
        let mut travelling = moving(Mode::Travelling);
        count(Part::Travelling, |_| {
            black_box(travelling.tick(black_box(COUNTS), WHOLE));
        });
        count(Part::Follow, |tick| {
            travelling.follow(wavelength(tick + 1), black_box(100.0));
        });
        for tick in 0..TICKS {
            // Glides take 40 ticks.
            if tick % 20 == 0 {
                travelling.follow(wavelength(tick / 20), 100.0);
            }
            mark(Part::Gliding as u32);
            black_box(travelling.tick(black_box(COUNTS), WHOLE));
            mark(Part::Gliding as u32 + 100);
        }
        for _ in 0..100 {
            travelling.tick(0, WHOLE);
        }
        count(Part::Resting, |_| {
            black_box(travelling.tick(black_box(0), WHOLE));
        });
    }

    fn parts() {
        let mut phase = Phase::default();
        let mut pattern = Pattern::new(Mode::Travelling, &DEFAULT_ACTUATORS);
        phase.follow(wavelength(0), 0);
        pattern.aim(wavelength(0).phase_per_micrometre(), 2 * TICKS);
        count(Part::Phase, |_| {
            black_box(phase.advance(black_box(COUNTS)));
            black_box(&mut pattern).glide();
        });
        let mut lanes = [0; ACTUATORS];
        count(Part::Sines, |_| {
            black_box(&pattern).sines(phase.turns(), black_box(&mut lanes));
        });
        let mut balance = Balance::default();
        count(Part::Balance, |_| {
            black_box(&mut balance).remove(
                black_box(&mut lanes),
                OPEN,
                black_box(1 << 26),
                UpdateRate::Hz2000,
            );
        });
        let array = Array::new(&DEFAULT_ACTUATORS);
        let mut words = [ZERO_VOLT; ACTUATORS];
        count(Part::Words, |_| {
            black_box(black_box(&array).draw(FULL, black_box(&lanes), MOST, &mut words));
        });
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}
