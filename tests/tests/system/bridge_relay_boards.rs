//! The two boards' own firmware at two sites, by virtual time: nothing joins them but two bridges and a network.

use std::sync::Arc;
use std::time::Duration;

use hil_sim_boards::bench::{Bench, PortName};
use hil_sim_core::scene::{Follows, Specimen};
use host_bridge::clock::Clock;
use host_bridge::relay::operator::{self, Progress, Stopping};
use protocol::{Stop, StopReason, Trip};
use tests::virtual_boards::VirtualBoards;
use tests::virtual_relay::{VirtualPair, name};

/// Far more of virtual time than anything here takes.
const LIMIT: Duration = Duration::from_secs(60);
/// What the command line has by default.
const MAX_AGE: Duration = Duration::from_millis(400);
/// The wavelength that is rubbed, in mm.
const WAVELENGTH_MM: f64 = 2.0;

/// Whether the stimulus is felt, and within its limits.
fn is_felt(boards: &Bench) -> bool {
    let outputs = boards.outputs();
    assert!(
        outputs.volts.iter().all(|volts| volts.abs() <= 5.0),
        "{outputs:?}"
    );
    !outputs.is_clear && !outputs.are_silent()
}

#[test]
fn what_is_felt_comes_over_the_network_ends_with_it_and_comes_back() {
    let bench = VirtualBoards::new("bridge_relay", |options| {
        options.is_apart = true;
        options.scene.arm.follows = Follows::Link;
        options.scene.surface.specimens = vec![Specimen {
            wavelength_mm: WAVELENGTH_MM,
            length_mm: f64::INFINITY,
        }];
    });
    let boards = &bench.boards;
    let [sensor, display] =
        [PortName::SensorConsole, PortName::DisplayConsole].map(|port| boards.path(port));
    let pair = VirtualPair::new(&bench.bench, &sensor, &display, MAX_AGE);
    // The arm moves only by what the display's bridge sends, and only then there is a wavelength.
    bench.wait_until("stimulus", || is_felt(boards));

    for _ in 0..2 {
        pair.network.cut(true);
        let gone_s = boards.now_s();
        // A hand at rest is not felt either: silent for longer than it rests.
        let mut silent_s = None;
        bench.wait_until("silence", || {
            let now_s = boards.now_s();
            if is_felt(boards) {
                silent_s = None;
            } else if silent_s.is_none() {
                silent_s = Some(now_s);
            }
            silent_s.is_some_and(|silent_s| now_s - silent_s > 0.4)
        });
        let faded_s = silent_s.unwrap_or(f64::INFINITY) - gone_s;
        assert!(faded_s < 1.5, "felt for {faded_s} s without a network");

        pair.network.cut(false);
        let back_s = boards.now_s();
        bench.wait_until("stimulus", || is_felt(boards));
        println!(
            "silent {faded_s:.2} s after the network went, felt {:.2} s after it came back",
            boards.now_s() - back_s
        );
    }
    // The board's own word, carried back.
    let clock: Arc<dyn Clock> = Arc::new(bench.bench.clock.clone());
    let stop = Stop {
        reason: StopReason::Operator,
    };
    let stopped = operator::stop(&pair.network, &clock, &name(), stop, LIMIT);
    let wanted = Stopping {
        progress: Progress::Stopped,
        trip: Some(Trip::Operator),
    };
    assert_eq!(stopped.expect("a network"), wanted);
    assert!(!is_felt(boards));
    // Neither board has ended by itself.
    bench.pass(0.5);
    assert!(!is_felt(boards));
    drop(pair);
    drop(clock);
}
