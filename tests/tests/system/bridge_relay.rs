//! Two bridges with a board at each, by virtual time: what crosses, in which order, how old, and what the
//! network may do meanwhile.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use host_bridge::clock::Clock;
use host_bridge::lock::locked;
use host_bridge::relay::flow::LATE_SPACING_US;
use host_bridge::relay::name::Name;
use host_bridge::relay::operator::{self, Progress, Stopping};
use protocol::{DisplayState, Message, Role, Safety, Stop, StopReason, Stopped, Trip};
use tests::fake_board::{FakeBoard, wait_by};
use tests::relay::{ESTIMATE_US, MOTION_US, hello, listen, motion, sequences, talking_board_on};
use tests::virtual_network::VirtualNetwork;
use tests::virtual_ports::VirtualBench;
use tests::virtual_relay::{VirtualPair, VirtualSite, name};
use tests::weather::Sky;

mod stop;

/// Far more of virtual time than anything here takes.
const LIMIT: Duration = Duration::from_secs(60);
/// What the command line has by default.
const MAX_AGE: Duration = Duration::from_millis(400);
const STOP: Stop = Stop {
    reason: StopReason::Operator,
};

/// A bench with a talking board at each site.
struct Sites {
    sensor: FakeBoard,
    display: FakeBoard,
    pair: VirtualPair,
}

impl Sites {
    fn new(max_age: Duration) -> Self {
        let bench = VirtualBench::default();
        let [sensor, display] =
            [Role::Sensor, Role::Display].map(|role| talking_board_on(&bench, role));
        let pair = VirtualPair::new(&bench, sensor.path(), display.path(), max_age);
        Self {
            sensor,
            display,
            pair,
        }
    }
}

/// A second bridge of the display's site, with a board of its own.
fn rival(pair: &VirtualPair, board: &FakeBoard) -> VirtualSite {
    let bridge = VirtualSite::new(
        &pair.bench,
        &pair.network,
        Role::Display,
        board.path(),
        MAX_AGE,
    );
    pair.sensor.says("a second bridge is there", LIMIT);
    bridge
}

fn at_least(count: usize) -> impl FnMut(&[Message]) -> bool {
    move |heard| sequences(heard).len() >= count
}

/// That each number is above the one before.
fn assert_rising(heard: &[Message]) {
    for pair in sequences(heard).windows(2) {
        assert!(pair[0] < pair[1], "{} after {}", pair[1], pair[0]);
    }
}

fn is_motion(message: &Message) -> bool {
    matches!(message, Message::Motion(_))
}

fn is_stop(message: &Message) -> bool {
    matches!(message, Message::Stop(stop) if *stop == STOP)
}

/// Lets time go by.
fn pass(bench: &VirtualBench, time: Duration) {
    let until_us = bench.clock.now_us() + time.as_micros() as u64;
    bench.clock.notify().wait_until(until_us);
}

#[test]
fn every_estimate_and_every_motion_crosses_in_order_as_late_as_the_network_and_nothing_else_does() {
    const DELAY: Duration = Duration::from_millis(20);
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    pair.network.delay(DELAY, Duration::ZERO);
    let motions = listen(&sensor, LIMIT, at_least(5_000));
    let estimates = listen(&display, LIMIT, at_least(1_000));
    let is_estimate = |message: &Message| matches!(message, Message::Estimate(_));
    let is_housekeeping =
        |message: &Message| matches!(message, Message::Ping(_) | Message::Pong(_));
    assert!(motions.iter().all(|m| is_motion(m) || is_housekeeping(m)));
    assert!(
        estimates
            .iter()
            .all(|m| is_estimate(m) || is_housekeeping(m))
    );
    for heard in [&motions, &estimates] {
        for pair in sequences(heard).windows(2) {
            assert_eq!(pair[0] + 1, pair[1]);
        }
    }
    for (site, period_us) in [(&pair.sensor, MOTION_US), (&pair.display, ESTIMATE_US)] {
        let report = site.site.report(true);
        let incoming = report.incoming;
        let missed = [
            incoming.arrivals.lost,
            incoming.arrivals.late,
            incoming.arrivals.duplicated,
            incoming.arrivals.superseded,
            incoming.stale,
            incoming.undated,
            incoming.replaced,
            incoming.stuck,
            incoming.refused,
            report.outgoing.failed,
        ];
        assert_eq!(missed, [0; 10], "{report:?}");
        assert!(incoming.passed > 9_000_000 / period_us, "{report:?}");
        // As old as the network makes it, to the histogram's thirty-second; a board looks once in a ms.
        let age = report.age.expect("messages have passed");
        let delay_us = DELAY.as_micros() as u64;
        for age_us in [age.p50_us, age.p99_us, age.max_us] {
            let allowed_us = delay_us..=delay_us + delay_us / 32 + 1_000;
            assert!(allowed_us.contains(&age_us), "{age:?}");
        }
        assert_eq!(report.round_trip_us, Some(2 * delay_us));
    }
}

#[test]
fn a_network_that_takes_half_a_second_there_and_back_changes_neither_order_nor_flow() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(Duration::from_secs(2));
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    let mut estimates = Vec::new();
    for (delay_ms, jitter_ms) in [(500, 0), (100, 200), (0, 0), (250, 50)] {
        let [delay, jitter] = [delay_ms, jitter_ms].map(Duration::from_millis);
        pair.network.delay(delay, jitter);
        motions.extend(listen(&sensor, LIMIT, at_least(400)));
        estimates.extend(listen(&display, LIMIT, at_least(80)));
    }
    assert_rising(&motions);
    assert_rising(&estimates);
}

#[test]
fn a_network_slower_than_anything_may_be_is_named_and_nothing_is_played() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(Duration::from_millis(100));
    pair.network
        .delay(Duration::from_millis(300), Duration::ZERO);
    for site in [&pair.sensor, &pair.display] {
        site.says("longer than the 100.00 ms of --max-age", LIMIT);
    }
    pass(&pair.bench, Duration::from_secs(10));
    for board in [&sensor, &display] {
        assert_eq!(sequences(&board.take_heard()), [] as [u32; 0]);
    }
    pair.network.delay(Duration::ZERO, Duration::ZERO);
    listen(&display, LIMIT, at_least(20));
    listen(&sensor, LIMIT, at_least(20));
}

#[test]
fn what_was_held_up_too_long_is_never_played() {
    const MAX_AGE_MS: u64 = 150;
    const STILL_MS: u64 = 1_000;
    const TIMES: u64 = 3;
    let Sites {
        sensor,
        display: _display,
        pair,
    } = Sites::new(Duration::from_millis(MAX_AGE_MS));
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    for _ in 0..TIMES {
        pair.network.hold_still(true);
        // So long that the silence is noticed and what was on its way is old.
        pass(&pair.bench, Duration::from_millis(STILL_MS));
        motions.extend(sensor.take_heard());
        let newest_held = sequences(&motions).last().copied().unwrap_or(0);
        pair.network.hold_still(false);
        let after = listen(&sensor, LIMIT, at_least(100));
        // The last that was said before it went on: while answers are late, one goes every 10 ms.
        let [still, spacing] = [STILL_MS * 1_000, LATE_SPACING_US].map(|us| us / MOTION_US);
        let first = u64::from(sequences(&after)[0] - newest_held);
        assert!(first + spacing >= still, "{first} after {newest_held}");
        motions.extend(after);
    }
    assert_rising(&motions);
    // All of them came, but for the last 150 ms too old.
    let said = TIMES * (STILL_MS - MAX_AGE_MS) * 1_000 / LATE_SPACING_US;
    let incoming = pair.sensor.site.report(true).incoming;
    assert!(incoming.stale >= said, "{said} said: {incoming:?}");
    assert_eq!(incoming.arrivals.lost, 0, "{incoming:?}");
}

#[test]
fn a_bridge_that_is_started_anew_is_followed() {
    let Sites {
        sensor,
        display,
        mut pair,
    } = Sites::new(MAX_AGE);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    for _ in 0..2 {
        let fresh = || {
            VirtualSite::new(
                &pair.bench,
                &pair.network,
                Role::Display,
                display.path(),
                MAX_AGE,
            )
        };
        // Its line is free when the one before is gone.
        let fresh = fresh();
        drop(std::mem::replace(&mut pair.display, fresh));
        motions.extend(sensor.take_heard());
        motions.extend(listen(&sensor, LIMIT, at_least(200)));
        listen(&display, LIMIT, at_least(20));
    }
    assert_rising(&motions);
}

#[test]
fn a_second_bridge_watches_while_the_first_one_speaks_and_leaves_no_trace() {
    let Sites {
        sensor,
        display: _display,
        pair,
    } = Sites::new(MAX_AGE);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    let other_board = talking_board_on(&pair.bench, Role::Display);
    let rival = rival(&pair, &other_board);
    rival.says("another bridge calls itself the display's site", LIMIT);
    pass(&pair.bench, Duration::from_secs(3));
    drop(rival);
    pass(&pair.bench, Duration::from_secs(3));
    motions.extend(sensor.take_heard());
    // All of the first one's, 500 a second, and none of another's.
    let numbers = sequences(&motions);
    let gap = numbers
        .windows(2)
        .map(|pair| pair[1].wrapping_sub(pair[0]))
        .max();
    assert_eq!(gap, Some(1), "{:?}", pair.sensor.words());
}

#[test]
fn the_bench_is_taken_by_who_waits_when_its_holder_is_silent() {
    let Sites {
        sensor,
        display,
        mut pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(100));
    let other_board = talking_board_on(&pair.bench, Role::Display);
    let waiting = rival(&pair, &other_board);
    drop(display);
    sensor.take_heard();
    // The board is gone, and its bridge still there: the bench stays with it.
    pass(&pair.bench, Duration::from_secs(3));
    assert_eq!(sequences(&sensor.take_heard()), [] as [u32; 0]);
    drop(std::mem::replace(&mut pair.display, waiting));
    listen(&sensor, Duration::from_millis(500), at_least(100));
}

#[test]
fn the_bench_is_handed_over_by_who_holds_it_and_by_nobody_else() {
    let Sites {
        sensor,
        display: _display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(100));
    pair.display.says("this bridge holds the bench", LIMIT);
    // With nobody there who could have it, it stays.
    pair.display.site.hand_over();
    pair.display.says("nobody waits for the bench", LIMIT);

    let other_board = FakeBoard::on(&pair.bench, Role::Display);
    let waiting = rival(&pair, &other_board);
    waiting.says("another bridge of this site holds the bench", LIMIT);
    waiting.site.hand_over();
    waiting.says("this bridge does not hold the bench", LIMIT);
    let hands = || [&pair.display, &waiting].map(|bridge| bridge.site.report(true).hand);
    assert_eq!(hands(), ["held", "watched"]);
    sensor.take_heard();
    // A number that the other board does not come to: whose motions come shows by it.
    let far = 1_000_000;
    other_board.say(motion(far, 0));
    pass(&pair.bench, Duration::from_secs(1));
    assert!(
        sequences(&sensor.take_heard())
            .iter()
            .all(|&number| number < far)
    );

    pair.display.site.hand_over();
    pair.sensor.says("the bench is handed over", LIMIT);
    waiting.says("this bridge holds the bench", LIMIT);
    pair.display
        .says("another bridge of this site holds the bench", LIMIT);
    assert_eq!(hands(), ["watched", "held"]);
    sensor.take_heard();
    other_board.say(motion(far + 1, 0));
    pass(&pair.bench, Duration::from_secs(1));
    assert_eq!(sequences(&sensor.take_heard()), [far + 1]);

    // And back: who gave it waits for it.
    waiting.site.hand_over();
    let is_back = || hands() == ["held", "watched"];
    assert!(wait_by(&sensor, LIMIT, is_back), "{:?}", hands());
    listen(&sensor, LIMIT, at_least(100));
}

#[test]
fn between_two_holders_the_board_hears_nothing_for_as_long_as_it_follows_the_first() {
    // The arm stands still after 0.1 s of silence, and then follows another hand from where both are.
    const SILENCE: Duration = Duration::from_millis(110);
    for leaves in [false, true] {
        let Sites {
            sensor,
            display: _display,
            mut pair,
        } = Sites::new(MAX_AGE);
        listen(&sensor, LIMIT, at_least(100));
        // Up for longer: its numbers are the newer ones.
        let other_board = FakeBoard::acting_on(&pair.bench, hello(Role::Display), {
            let mut said_us = 0;
            Box::new(move |now_us| {
                let is_due = now_us >= said_us + MOTION_US;
                said_us = if is_due { now_us } else { said_us };
                let number = 1_000_000 + (now_us / MOTION_US) as u32;
                is_due.then(|| motion(number, now_us)).into_iter().collect()
            })
        });
        let waiting = rival(&pair, &other_board);
        waiting.says("another bridge of this site holds the bench", LIMIT);
        pass(&pair.bench, Duration::from_secs(1));
        sensor.take_heard();
        let clock = pair.bench.clock.clone();
        let (mut last_us, mut first_us) = (clock.now_us(), None);
        let _kept = if leaves {
            drop(std::mem::replace(&mut pair.display, waiting));
            None
        } else {
            pair.display.site.hand_over();
            Some(waiting)
        };
        let is_others = |message: &Message| matches!(message, Message::Motion(motion) if motion.sequence >= 1_000_000);
        let changed = wait_by(&sensor, LIMIT, || {
            for message in sensor.take_heard() {
                match is_others(&message) {
                    true => first_us = first_us.or(Some(clock.now_us())),
                    false if is_motion(&message) => last_us = clock.now_us(),
                    false => {}
                }
            }
            first_us.is_some()
        });
        assert!(changed, "nobody took the bench");
        let silence = Duration::from_micros(first_us.unwrap() - last_us);
        assert!(silence > SILENCE, "{silence:?}, leaves: {leaves}");
    }
}

#[test]
fn what_makes_way_for_a_newer_one_between_two_holders_is_counted() {
    let Sites {
        sensor,
        display: _display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(100));
    let other_board = FakeBoard::on(&pair.bench, Role::Display);
    let waiting = rival(&pair, &other_board);
    waiting.says("another bridge of this site holds the bench", LIMIT);
    pair.display.site.hand_over();
    waiting.says("this bridge holds the bench", LIMIT);
    let before = pair.sensor.site.report(true).incoming;
    // The board is told nothing yet: only the last of them is passed on.
    const SAID: u32 = 5;
    for number in 1..=SAID {
        other_board.say(motion(1_000_000 + number, 0));
        pass(&pair.bench, Duration::from_millis(2));
    }
    pass(&pair.bench, Duration::from_secs(1));
    let after = pair.sensor.site.report(true).incoming;
    assert_eq!(after.passed - before.passed, 1, "{before:?}, {after:?}");
    let replaced = after.replaced - before.replaced;
    assert_eq!(replaced, u64::from(SAID - 1), "{before:?}, {after:?}");
}

#[test]
fn what_a_bridge_said_before_it_left_moves_nothing_whoever_says_it_again() {
    let bench = VirtualBench::default();
    let [sensor, display] =
        [Role::Sensor, Role::Display].map(|role| talking_board_on(&bench, role));
    let network = VirtualNetwork::new(&bench.clock);
    // Long enough for what was said a moment ago.
    let max_age = Duration::from_secs(60);
    let site =
        |role, board: &FakeBoard| VirtualSite::new(&bench, &network, role, board.path(), max_age);
    let sensors = site(Role::Sensor, &sensor);
    for leaves in [true, false] {
        let displays = site(Role::Display, &display);
        let before = listen(&sensor, LIMIT, at_least(100));
        network.listen_in();
        let heard = listen(&sensor, LIMIT, at_least(500));
        let newest = sequences(&heard).last().copied();
        assert!(sequences(&before).last() < sequences(&heard).first());
        if !leaves {
            // Nor where it just falls silent.
            network.cut(true);
        }
        drop(displays);
        pass(
            &bench,
            Duration::from_millis(if leaves { 5 } else { 1_500 }),
        );
        network.cut(false);
        sensor.take_heard();
        network.replay();
        pass(&bench, Duration::from_secs(1));
        let again = sequences(&sensor.take_heard());
        assert!(
            again.iter().all(|&number| Some(number) > newest),
            "after {newest:?}: {again:?}"
        );
    }
    drop(sensors);
    network.end();
}

/// The longest time in which a board heard no motion or estimate, over `time`.
fn longest_gap(bench: &VirtualBench, board: &FakeBoard, time: Duration) -> Duration {
    const STEP: Duration = Duration::from_millis(5);
    let (mut gap, mut longest) = (Duration::ZERO, Duration::ZERO);
    for _ in 0..time.as_millis() / STEP.as_millis() {
        pass(bench, STEP);
        gap += STEP;
        longest = longest.max(gap);
        if !sequences(&board.take_heard()).is_empty() {
            gap = Duration::ZERO;
        }
    }
    longest
}

#[test]
fn a_network_that_loses_makes_no_gap_in_what_goes_by_datagrams() {
    let sky = Sky {
        delay: Duration::from_millis(500),
        jitter: Duration::from_millis(50),
        loss: 0.05,
    };
    let goal = Duration::from_millis(600);
    for has_datagrams in [false, true] {
        let Sites {
            sensor,
            display,
            pair,
        } = Sites::new(Duration::from_secs(2));
        pair.network.use_datagrams(has_datagrams);
        listen(&sensor, LIMIT, at_least(100));
        pair.network.turn(sky);
        pass(&pair.bench, Duration::from_secs(10));
        for board in [&sensor, &display] {
            board.take_heard();
            let gap = longest_gap(&pair.bench, board, Duration::from_secs(60));
            // By a stream, everything waits for what is lost.
            assert_eq!(gap <= goal, has_datagrams, "{gap:?}");
        }
        // What has to come does come.
        pair.sensor.site.stop(STOP);
        listen(&display, LIMIT, |heard| heard.iter().any(is_stop));
    }
}

#[test]
fn a_relay_on_loopback_adds_no_millisecond() {
    let Sites {
        sensor,
        display,
        pair,
    } = Sites::new(MAX_AGE);
    listen(&sensor, LIMIT, at_least(5_000));
    listen(&display, LIMIT, at_least(1_000));
    // On a network that takes nothing: all that the relay itself makes a message wait, from line to line.
    for site in [&pair.sensor, &pair.display] {
        let age = site.site.report(true).age.expect("messages have passed");
        assert!(age.p99_us <= 1_000, "{age:?}");
    }
}

#[test]
fn a_board_whose_cable_is_pulled_and_put_back_goes_on_also_if_it_starts_anew() {
    let bench = VirtualBench::default();
    let sensor = talking_board_on(&bench, Role::Sensor);
    let mut display = talking_board_on(&bench, Role::Display);
    let name = Path::new("/virtual/by-name");
    bench.ports.link(display.path(), name);
    let pair = VirtualPair::new(&bench, sensor.path(), name, MAX_AGE);
    listen(&sensor, LIMIT, at_least(100));
    for times in 1..=2 {
        drop(display);
        let is_told = || {
            let words = pair.display.words();
            let told = words.iter().filter(|line| line.contains("not there"));
            told.count() == times
        };
        assert!(wait_by(&sensor, LIMIT, is_told));
        pass(&bench, Duration::from_millis(50));
        sensor.take_heard();
        pass(&bench, Duration::from_secs(1));
        assert_eq!(sequences(&sensor.take_heard()), [] as [u32; 0]);
        // Another start of the board: its numbers begin at 0.
        display = talking_board_on(&bench, Role::Display);
        bench.ports.link(display.path(), name);
        let motions = listen(&sensor, LIMIT, at_least(100));
        assert_rising(&motions);
        listen(&display, LIMIT, at_least(10));
    }
}

#[test]
fn a_board_that_takes_no_bytes_gets_the_newest_when_it_does_again() {
    let Sites {
        sensor,
        display: _display,
        pair,
    } = Sites::new(MAX_AGE);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    sensor.deafen(true);
    let is_stuck = || pair.sensor.site.report(false).incoming.stuck > 300;
    assert!(
        wait_by(&sensor, LIMIT, is_stuck),
        "{:?}",
        pair.sensor.words()
    );
    sensor.deafen(false);
    motions.extend(listen(&sensor, LIMIT, at_least(300)));
    assert_rising(&motions);
}

#[test]
fn a_board_that_says_something_that_is_no_number_is_not_carried() {
    let bench = VirtualBench::default();
    let sensor = FakeBoard::on(&bench, Role::Sensor);
    let display = talking_board_on(&bench, Role::Display);
    let _pair = VirtualPair::new(&bench, sensor.path(), display.path(), MAX_AGE);
    listen(&sensor, LIMIT, at_least(10));
    let say = |sequence, wavelength_mm: f32| {
        let Message::Estimate(mut estimate) = tests::relay::estimate(sequence, 0) else {
            unreachable!("an estimate is one");
        };
        estimate.wavelength_mm = Some(wavelength_mm);
        sensor.say(Message::Estimate(estimate));
    };
    for (sequence, wavelength_mm) in [(1, f32::NAN), (2, f32::INFINITY), (3, -1.0), (4, 2.0)] {
        say(sequence, wavelength_mm);
    }
    // A display's word is not a sensor's.
    sensor.say(motion(5, 0));
    let heard = listen(&display, LIMIT, at_least(1));
    assert_eq!(sequences(&heard), [4]);
}
