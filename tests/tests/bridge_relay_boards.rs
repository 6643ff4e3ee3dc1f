//! The two boards' own firmware at two sites: nothing joins them but two bridges and a router.

use std::path::Path;
use std::time::{Duration, Instant};

use hil_sim_boards::bench::{Bench, Options, PortName};
use hil_sim_core::scene::{Follows, Specimen};
use protocol::Role;
use rustix::process::Signal;
use tests::elves;
use tests::fake_board::wait_until;
use tests::relay::{Relay, free_port};

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(300);
/// The wavelength that is rubbed, in mm.
const WAVELENGTH_MM: f64 = 2.0;

fn bench() -> Bench {
    let mut options = Options::new(Path::new(env!("CARGO_TARGET_TMPDIR")).join("bridge_relay"));
    options.is_apart = true;
    options.scene.arm.follows = Follows::Link;
    options.scene.surface.specimens = vec![Specimen {
        wavelength_mm: WAVELENGTH_MM,
        length_mm: f64::INFINITY,
    }];
    Bench::start(options, elves::both()).expect("the bench can be set up")
}

/// Whether the stimulus is felt, and within its limits.
fn is_felt(bench: &Bench) -> bool {
    let outputs = bench.outputs();
    assert!(
        outputs.volts.iter().all(|volts| volts.abs() <= 5.0),
        "{outputs:?}"
    );
    !outputs.is_clear && !outputs.are_silent()
}

#[test]
fn what_is_felt_comes_over_the_network_ends_with_it_and_comes_back() {
    let bench = bench();
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let router = || Relay::start(["router", "--listen", &at]);
    let mut running = router();
    let bridge = |role, port| Relay::bridge(role, &bench.path(port), &["--connect", &at]);
    let bridges = [
        bridge(Role::Sensor, PortName::SensorConsole),
        bridge(Role::Display, PortName::DisplayConsole),
    ];
    let words = || bridges.each_ref().map(Relay::words);
    // The arm moves only by what the display's bridge sends, and only then there is a wavelength.
    assert!(wait_until(LIMIT, || is_felt(&bench)), "{:?}", words());

    for _ in 0..2 {
        running.kill();
        let gone_s = bench.now_s();
        // A hand at rest is not felt either: silent for longer than it rests.
        let mut silent_s = None;
        let faded = || {
            let now_s = bench.now_s();
            if is_felt(&bench) {
                silent_s = None;
            } else if silent_s.is_none() {
                silent_s = Some(now_s);
            }
            silent_s.is_some_and(|silent_s| now_s - silent_s > 0.4)
        };
        assert!(wait_until(LIMIT, faded), "{:?}", words());
        let faded_s = silent_s.unwrap_or(f64::INFINITY) - gone_s;
        assert!(faded_s < 1.5, "felt for {faded_s} s without a network");

        running = router();
        running.says("router, listening", LIMIT);
        let back = Instant::now();
        assert!(wait_until(LIMIT, || is_felt(&bench)), "{:?}", words());
        println!(
            "silent {faded_s:.2} s after the router went, felt {:.2?} after it came back",
            back.elapsed()
        );
    }
    // The board's own word, carried back.
    let stopped = Relay::start(["stop", "--connect", &at]);
    let asked = Instant::now();
    let (status, _, said) = stopped.wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{said}, {:?}", words());
    assert!(
        said.contains("the display has stopped: by the operator"),
        "{said}"
    );
    println!("stopped and known within {:.2?}", asked.elapsed());
    assert!(!is_felt(&bench));
    for bridge in bridges {
        bridge.signal(Signal::INT);
        let (status, lines, words) = bridge.wait(LIMIT);
        assert_eq!(status.code(), Some(0), "{words}");
        println!("{}", lines.last().expect("a bridge reports"));
    }
    bench.stop().expect("no board has stopped");
}
