//! What it is worth that gauges and positions belong to the same instants. That they do is measured in
//! µs in the sensor's own tests; this is what would become of λ if they did not.

use hil_sim::scene::Scene;

use crate::running::{folder, of_each, run};

#[test]
fn a_millisecond_of_skew_doubles_the_error_and_50_microseconds_change_it_by_less_than_a_tenth() {
    let names = ["0-us", "50-us", "1000-us"];
    let rms_percent = of_each(&names, |name| {
        let path = folder("alignment").join(format!("{name}.toml"));
        let run = run(Scene::load(&path).unwrap());
        assert!(run.unmet.is_empty(), "{name}: {:?}", run.unmet);
        run.verdict.summary.rms_percent.unwrap()
    });
    println!("{rms_percent:.3?} % at 0, 50 and 1000 µs");
    let [none, little, much] = rms_percent[..] else {
        panic!("three scenes, {rms_percent:?}");
    };
    // Measured: 0.30, 0.32 and 0.81 %.
    assert!(much > 2.0 * none, "{rms_percent:?}");
    assert!((little - none).abs() < 0.1 * none, "{rms_percent:?}");
}
