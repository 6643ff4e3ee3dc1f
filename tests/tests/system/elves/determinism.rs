//! A scene and its seed decide every byte on the link and every word at the converters.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use hil_sim_core::native;
use hil_sim_core::scene::Scene;
use hil_sim_core::scene::fault::{Fault, Kind};
use tests::run::{Run, scene};

/// Threads that do nothing but keep the cores from the boards.
const BUSY_THREADS: usize = 2;

/// All that is drawn from the seed: noise, and the link's weather.
fn drawn(seed: u64) -> Scene {
    scene(&format!(
        r#"
        seed = {seed}
        duration_s = 0.8

        [surface]
        specimens = [{{ wavelength_mm = 2.0 }}]

        [motion]
        kind = "sinusoid"
        amplitude_mm_s = 70.0
        frequency_hz = 0.83

        [gauges]
        snr_db = 10.0

        [link]
        delay_ms = 5.0
        jitter_ms = 5.0
        loss = 0.05
        reorder = 0.05
        corrupt = 0.0005
        "#
    ))
}

/// The same, and two faults, of the second of which both boards start anew.
fn broken(seed: u64) -> Scene {
    Scene {
        duration_s: 1.2,
        faults: vec![
            Fault::new(Kind::LinkGarbage, 0.3),
            Fault::new(Kind::PowerCycle, 0.7),
        ],
        ..drawn(seed)
    }
}

/// The first run, which the others are compared with.
static FIRST: LazyLock<Run> = LazyLock::new(|| Run::of(broken(5)));

/// That two runs are equal in all that they leave behind, apart from the time they took.
fn assert_equal(run: &Run, other: &Run) {
    assert_eq!(run.recording.scans, other.recording.scans);
    assert_eq!(run.recording.ticks, other.recording.ticks);
    assert_eq!(run.recording.estimates, other.recording.estimates);
    assert_eq!(run.recording.outputs, other.recording.outputs);
    assert_eq!(run.recording.log, other.recording.log);
    assert_eq!(run.recording.signs, other.recording.signs);
    assert_eq!(run.facts, other.facts);
    assert_eq!(run.recording.hash, other.recording.hash);
}

#[test]
fn the_elves_leave_the_same_behind_again_also_on_busy_cores() {
    assert!(!FIRST.recording.outputs.is_empty());
    assert_eq!(FIRST.facts.resets, 2);
    let over = AtomicBool::new(false);
    let run = thread::scope(|scope| {
        for _ in 0..BUSY_THREADS {
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        let run = std::panic::catch_unwind(|| Run::of(broken(5)));
        over.store(true, Ordering::Relaxed);
        run
    });
    assert_equal(
        &FIRST,
        &run.unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
    );
}

#[test]
fn another_seed_gives_the_elves_another_hash() {
    assert_ne!(Run::of(broken(6)).recording.hash, FIRST.recording.hash);
}

#[test]
fn the_native_engine_gives_the_same_hash_again_and_another_for_another_seed() {
    let hash = |seed| native::run(&drawn(seed)).unwrap().hash;
    assert_eq!(hash(5), hash(5));
    assert_ne!(hash(5), hash(6));
}
