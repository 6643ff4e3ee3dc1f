//! Output ticks of a moving hand, the stimulus alone: 500 or 250 µs each on the board.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use firmware_display::Stimulus;
use firmware_display::phase::Wavelength;
use protocol::actuators::DEFAULT_ACTUATORS;
use protocol::{DisplayConfiguration, Mode, UpdateRate};

/// The whole gain.
const FULL: u32 = 1 << 31;

/// One second: 7 counts a tick, an estimate every 10 ms.
fn second(criterion: &mut Criterion, name: &str, mode: Mode, update_rate: UpdateRate) {
    let mut group = criterion.benchmark_group("tick");
    group.throughput(Throughput::Elements(update_rate.hz().into()));
    let configuration = DisplayConfiguration {
        mode,
        update_rate,
        ..DisplayConfiguration::DEFAULT
    };
    let mut stimulus = Stimulus::new(&configuration, &DEFAULT_ACTUATORS);
    let mut sequence = 0_u32;
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            for tick in 0..update_rate.hz() {
                if tick.is_multiple_of(update_rate.hz() / 100) {
                    sequence = sequence.wrapping_add(1);
                    if let Some(wavelength) = Wavelength::new(2.0 + (sequence % 7) as f32 * 0.01) {
                        stimulus.follow(wavelength, 100.0);
                    }
                }
                black_box(stimulus.tick(black_box(7), FULL));
                black_box(stimulus.words());
            }
        });
    });
    group.finish();
}

fn ticks(criterion: &mut Criterion) {
    for (name, mode, update_rate) in [
        ("2 kHz, uniform", Mode::Uniform, UpdateRate::Hz2000),
        ("2 kHz, travelling", Mode::Travelling, UpdateRate::Hz2000),
        ("4 kHz, uniform", Mode::Uniform, UpdateRate::Hz4000),
        ("4 kHz, travelling", Mode::Travelling, UpdateRate::Hz4000),
    ] {
        second(criterion, name, mode, update_rate);
    }
}

criterion_group!(benches, ticks);
criterion_main!(benches);
