//! Virtual seconds that the native engine runs per second on the wall: `elem` is a virtual second.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hil_sim_core::native;
use hil_sim_core::scene::{
    Contact, ContactModel, Estimator, Friction, Gauges, Kinematic, Link, Motion, Scene,
};
use protocol::Method;

const VIRTUAL_S: u64 = 10;

fn scene() -> Scene {
    Scene {
        duration_s: VIRTUAL_S as f64,
        ..Scene::constant(2.0, 50.0)
    }
}

fn native_engine(criterion: &mut Criterion) {
    let noisy = Gauges::Kinematic(Kinematic {
        snr_db: Some(20.0),
        ..Kinematic::default()
    });
    let scenes = [
        ("constant", scene()),
        (
            "noisy",
            Scene {
                gauges: noisy.clone(),
                ..scene()
            },
        ),
        (
            "noisy sinusoid, bad weather",
            Scene {
                gauges: noisy,
                motion: Motion::Sinusoid {
                    amplitude_mm_s: 70.0,
                    frequency_hz: 0.83,
                },
                link: Link {
                    delay_ms: 20.0,
                    jitter_ms: 5.0,
                    loss: 0.05,
                    reorder: 0.02,
                    corrupt: 0.0002,
                },
                ..scene()
            },
        ),
        (
            "stick-slip",
            Scene {
                contact: Contact::stick_slip(Friction::Strong),
                ..scene()
            },
        ),
        (
            "viscoelastic",
            Scene {
                contact: Contact::of(ContactModel::Viscoelastic, None),
                ..scene()
            },
        ),
        (
            "counting",
            Scene {
                estimator: Estimator {
                    method: Method::Counting,
                    ..Estimator::default()
                },
                ..scene()
            },
        ),
    ];
    let mut group = criterion.benchmark_group("native");
    group.throughput(Throughput::Elements(VIRTUAL_S));
    for (name, scene) in &scenes {
        group.bench_function(*name, |bencher| {
            bencher.iter(|| native::run(black_box(scene)));
        });
    }
    group.finish();
}

criterion_group!(benches, native_engine);
criterion_main!(benches);
