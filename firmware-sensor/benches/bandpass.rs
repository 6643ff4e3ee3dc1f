//! Band-pass and crossings of five gauges, a millisecond at a time, beside two other crates' biquads with
//! the same coefficients; then the whole sensor. For instructions on the board itself see `examples/filter_cost.rs`.

use std::hint::black_box;

use biquad::Biquad;
use criterion::{Criterion, criterion_group, criterion_main};
use dsp_process::SplitProcess;
use firmware_sensor::bandpass::{BAND, BandPass, ORDER};
use firmware_sensor::crossing::Crossing;
use firmware_sensor::{SCANS_PER_SAMPLE, Sensor};
use protocol::{GAUGES, SensorConfiguration};

const SAMPLES: usize = 1_000;

/// A second of five gauges: sines of textures from 10 Hz on, each a little different.
fn signal() -> Vec<[f32; GAUGES]> {
    let gauge = |ms: usize, gauge: usize| {
        let frequency_hz = 10.0 + 13.0 * gauge as f32;
        700.0 * (std::f32::consts::TAU * frequency_hz * ms as f32 / 1_000.0).sin()
    };
    (0..SAMPLES)
        .map(|ms| std::array::from_fn(|g| gauge(ms, g)))
        .collect()
}

/// Runs the signal through `filter`, which knows its gauges, and counts all crossings.
fn crossings(
    signal: &[[f32; GAUGES]],
    crossing: &mut [Crossing; GAUGES],
    mut filter: impl FnMut(usize, f32) -> f32,
) -> u32 {
    let mut count = 0;
    for sample in black_box(signal) {
        for (gauge, (x, crossing)) in sample.iter().zip(&mut *crossing).enumerate() {
            count += u32::from(crossing.step(filter(gauge, *x)));
        }
    }
    count
}

fn second_of_five_gauges(criterion: &mut Criterion) {
    let signal = signal();
    let ours = BandPass::<ORDER>::new(BAND);
    let biquads = ours.biquads();
    let mut group = criterion.benchmark_group("1000 ms of five gauges");

    group.bench_function("firmware-sensor", |bencher| {
        let mut lanes = [ours.settled(0.0); GAUGES];
        let mut crossing = [Crossing::default(); GAUGES];
        bencher.iter(|| crossings(&signal, &mut crossing, |g, x| ours.step(&mut lanes[g], x)));
    });
    group.bench_function("biquad", |bencher| {
        let sections = biquads.map(|[b0, b1, b2, a1, a2]| {
            biquad::DirectForm2Transposed::<f32>::new(biquad::Coefficients { b0, b1, b2, a1, a2 })
        });
        let mut lanes = [sections; GAUGES];
        let mut crossing = [Crossing::default(); GAUGES];
        bencher.iter(|| {
            crossings(&signal, &mut crossing, |g, x| {
                lanes[g].iter_mut().fold(x, |x, section| section.run(x))
            })
        });
    });
    group.bench_function("idsp", |bencher| {
        // idsp's recursive coefficients have the other sign.
        let sections = biquads.map(|[b0, b1, b2, a1, a2]| idsp::iir::Biquad::<f32> {
            ba: [b0, b1, b2, -a1, -a2],
        });
        let lane: [idsp::iir::DirectForm2Transposed<f32>; ORDER] = Default::default();
        let mut lanes: [_; GAUGES] = std::array::from_fn(|_| lane.clone());
        let mut crossing = [Crossing::default(); GAUGES];
        bencher.iter(|| {
            crossings(&signal, &mut crossing, |g, x| {
                sections
                    .iter()
                    .zip(&mut lanes[g])
                    .fold(x, |x, (section, lane)| section.process(lane, x))
            })
        });
    });
    group.finish();

    criterion.bench_function("1000 ms of the whole sensor", |bencher| {
        let mut sensor = Sensor::new(SensorConfiguration::default());
        let mut ms = 0_u64;
        bencher.iter(|| {
            for sample in &signal {
                let scan =
                    std::array::from_fn(|g| (2_048.0 + sample.get(g).unwrap_or(&0.0)) as u16);
                ms += 1;
                black_box(sensor.step(ms * 1_000, &[scan; SCANS_PER_SAMPLE], (ms * 10) as u16));
            }
        });
    });
}

criterion_group!(benches, second_of_five_gauges);
criterion_main!(benches);
