//! Virtual seconds that the display board's ELF, alone on an emulated board, runs per second on the
//! wall: `elem` is a virtual second. Fifty words change at each of 2 000 ticks a second. The goal is
//! three. Needs the ELF, as ./test builds it; what the emulator takes to translate it is in the time.

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hil_sim_boards::Firmware;
use hil_sim_boards::display_alone::{DisplayBench, run};
use hil_sim_core::scene::Motion;
use protocol::actuators::grid;
use protocol::{DisplayConfiguration, Mode, Role};

const VIRTUAL_S: u64 = 10;

fn display_alone(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../target/thumbv7em-none-eabihf/release/firmware-display");
    let firmware = Firmware::read(&path, Role::Display).expect("the display's ELF");
    let mut group = criterion.benchmark_group("display alone");
    group
        .throughput(Throughput::Elements(VIRTUAL_S))
        .sample_size(10);
    for (name, mode) in [
        ("fifty alike", Mode::Uniform),
        ("fifty distinct", Mode::Travelling),
    ] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let hand = Motion::Sinusoid {
                    amplitude_mm_s: 70.0,
                    frequency_hz: 0.83,
                };
                let mut actuators = grid(1_500);
                for (actuator, phase) in actuators.iter_mut().zip(0u16..) {
                    actuator.phase = if mode == Mode::Travelling {
                        1_000 * phase
                    } else {
                        0
                    };
                }
                let alone = DisplayBench {
                    configuration: DisplayConfiguration {
                        mode,
                        ..DisplayConfiguration::DEFAULT
                    },
                    actuators,
                    ..DisplayBench::new(hand, 2.0, VIRTUAL_S as f64)
                };
                run(alone, &firmware).expect("it runs")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, display_alone);
criterion_main!(benches);
