//! Output ticks of a moving hand: 500 µs each on the board.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use firmware_display::Display;
use protocol::{Contact, DisplayConfiguration, Estimate, GAUGES, GaugeHealth, Mode, Range};

const TICKS: u64 = 2_000;

fn estimate(sequence: u32, wavelength_mm: f32) -> Estimate {
    Estimate {
        sequence,
        instant_us: 0,
        wavelength_mm: Some(wavelength_mm),
        valid: true,
        confidence: 1.0,
        amplitude_lsb: 100.0,
        counted_mm: None,
        range: Range::T1,
        contact: Contact::Unknown,
        velocity_um_s: 70_000,
        lag_um: None,
        gauges_used: 0b1_1111,
        health: [GaugeHealth::Good; GAUGES],
    }
}

/// One second: 70 mm/s, an estimate every 20 ticks.
fn second(criterion: &mut Criterion, name: &str, mode: Mode) {
    let mut group = criterion.benchmark_group("tick");
    group.throughput(Throughput::Elements(TICKS));
    let configuration = DisplayConfiguration {
        mode,
        ..DisplayConfiguration::default()
    };
    let mut display = Display::new(configuration);
    let (mut sequence, mut encoder) = (0_u32, 0_u16);
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            for tick in 0..TICKS {
                if tick % 20 == 0 {
                    sequence = sequence.wrapping_add(1);
                    display.on_estimate(&estimate(sequence, 2.0 + (sequence % 7) as f32 * 0.01));
                }
                encoder = encoder.wrapping_add(7);
                black_box(display.tick(encoder));
                black_box(display.words());
                black_box(display.motion(tick));
            }
        });
    });
    group.finish();
}

fn ticks(criterion: &mut Criterion) {
    second(criterion, "one second, uniform", Mode::Uniform);
    second(criterion, "one second, travelling", Mode::Travelling);
}

criterion_group!(benches, ticks);
criterion_main!(benches);
