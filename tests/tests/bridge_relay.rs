//! Two bridges in two processes, with a board at each: what crosses, in which order, and what the network
//! may do meanwhile.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use host_bridge::relay::flow::LATE_SPACING_US;
use host_bridge::relay::network::LEASE;
use protocol::{Message, Role, StopReason};
use rustix::process::Signal;
use serde_json::Value;
use tests::fake_board::{FakeBoard, wait_until};
use tests::relay::{Relay, free_port, listen, motion, sequences, talking_board};
use tests::weather::Weather;

/// Far more than anything here takes.
const LIMIT: Duration = Duration::from_secs(20);

/// Two bridges, the display's connecting to the sensor's by way of `weather`.
struct Pair {
    sensor: Relay,
    display: Relay,
    weather: Weather,
}

impl Pair {
    fn new(sensor: &FakeBoard, display: &FakeBoard, more: &[&str]) -> Self {
        let port = free_port();
        let weather = Weather::over(port);
        let listen = format!("tcp/127.0.0.1:{port}");
        let connect = format!("tcp/127.0.0.1:{}", weather.port());
        let with = |end, at: &str| -> Vec<String> {
            let more = more.iter().map(|&word| word.to_owned());
            [end, at]
                .map(str::to_owned)
                .into_iter()
                .chain(more)
                .collect()
        };
        let start = |role, board: &FakeBoard, arguments: Vec<String>| {
            let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
            Relay::bridge(role, board.path(), &arguments)
        };
        Self {
            sensor: start(Role::Sensor, sensor, with("--listen", &listen)),
            display: start(Role::Display, display, with("--connect", &connect)),
            weather,
        }
    }
}

fn at_least(count: usize) -> impl FnMut(&[Message]) -> bool {
    move |heard| sequences(heard).len() >= count
}

/// That each number is above the one before.
fn assert_rising(heard: &[Message]) {
    let numbers = sequences(heard);
    for pair in numbers.windows(2) {
        assert!(pair[0] < pair[1], "{} after {}", pair[1], pair[0]);
    }
}

fn is_motion(message: &Message) -> bool {
    matches!(message, Message::Motion(_))
}

fn is_stop(message: &Message) -> bool {
    matches!(message, Message::Stop(stop) if stop.reason == StopReason::Operator)
}

/// The last report that a bridge printed.
fn last_report(lines: &[String]) -> Value {
    let last = lines.last().expect("a bridge reports");
    serde_json::from_str(last).expect("it reports in JSON")
}

#[test]
fn estimates_and_motions_cross_in_order_and_nothing_else_does() {
    let sensor = talking_board(Role::Sensor);
    let display = talking_board(Role::Display);
    let pair = Pair::new(&sensor, &display, &[]);
    let motions = listen(&sensor, LIMIT, at_least(1_000));
    let estimates = listen(&display, LIMIT, at_least(200));
    assert_rising(&motions);
    assert_rising(&estimates);
    let is_estimate = |message: &Message| matches!(message, Message::Estimate(_));
    let is_housekeeping =
        |message: &Message| matches!(message, Message::Ping(_) | Message::Pong(_));
    assert!(motions.iter().all(|m| is_motion(m) || is_housekeeping(m)));
    assert!(
        estimates
            .iter()
            .all(|m| is_estimate(m) || is_housekeeping(m))
    );

    for bridge in [&pair.sensor, &pair.display] {
        bridge.signal(Signal::INT);
    }
    let (_, lines, _) = pair.sensor.wait(LIMIT);
    let incoming = last_report(&lines)["incoming"].clone();
    let (status, lines, words) = pair.display.wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{words}");
    let report = last_report(&lines);
    assert_eq!(report["total"], true);
    assert_eq!(report["site"], "display");
    assert_eq!(report["incoming"]["lost"], 0);
    // A busy machine brings two at once, of which one is replaced, but none goes without being counted.
    let numbers = sequences(&motions);
    let missing = u64::from(numbers[numbers.len() - 1] - numbers[0]) + 1 - numbers.len() as u64;
    let reasons = ["lost", "replaced", "stale", "stuck", "undated", "boardless"];
    let counts = reasons.map(|reason| incoming[reason].as_u64());
    let counted = counts
        .into_iter()
        .chain([report["outgoing"]["held"].as_u64()])
        .sum::<Option<u64>>();
    assert!(
        Some(missing) <= counted,
        "{missing} missing: {incoming}, {report}"
    );
    // A newer one took their place, or the network had not answered yet: that is for the machine to decide,
    // all else is not.
    let replaced = incoming["replaced"].as_u64().unwrap_or(0);
    let held = report["outgoing"]["held"].as_u64().unwrap_or(0);
    let gone = missing.saturating_sub(replaced + held);
    assert_eq!(incoming["lost"], 0, "{incoming}");
    assert!(
        gone < numbers.len() as u64 / 20,
        "{gone} of {} missing: {incoming}, {report}",
        numbers.len()
    );
    assert!(
        report["incoming"]["passed"].as_u64() >= Some(200),
        "{report}"
    );
    assert!(
        report["outgoing"]["sent"].as_u64() >= Some(1_000),
        "{report}"
    );
    assert!(report["age"]["p99_us"].is_u64(), "{report}");
}

#[test]
fn a_network_that_takes_half_a_second_there_and_back_changes_neither_order_nor_flow() {
    let sensor = talking_board(Role::Sensor);
    let display = talking_board(Role::Display);
    let pair = Pair::new(&sensor, &display, &["--max-age", "2000"]);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    let mut estimates = Vec::new();
    for (delay_ms, jitter_ms) in [(500, 0), (100, 200), (0, 0), (250, 50)] {
        pair.weather.delay(
            Duration::from_millis(delay_ms),
            Duration::from_millis(jitter_ms),
        );
        motions.extend(listen(&sensor, LIMIT, at_least(400)));
        estimates.extend(listen(&display, LIMIT, at_least(80)));
    }
    assert_rising(&motions);
    assert_rising(&estimates);
}

#[test]
fn a_network_slower_than_anything_may_be_is_named_and_nothing_is_played() {
    let sensor = talking_board(Role::Sensor);
    let display = talking_board(Role::Display);
    let pair = Pair::new(&sensor, &display, &["--max-age", "100"]);
    pair.weather
        .delay(Duration::from_millis(300), Duration::ZERO);
    pair.display
        .says("longer than the 100.00 ms of --max-age", LIMIT);
    display.take_heard();
    pair.sensor
        .says("longer than the 100.00 ms of --max-age", LIMIT);
    assert!(sequences(&display.take_heard()).is_empty());
    pair.weather.delay(Duration::ZERO, Duration::ZERO);
    listen(&display, LIMIT, at_least(20));
}

#[test]
fn what_was_held_up_too_long_is_never_played() {
    const MAX_AGE_MS: u64 = 150;
    const STILL_MS: u64 = 1_000;
    const TIMES: u64 = 3;
    let sensor = talking_board(Role::Sensor);
    let display = talking_board(Role::Display);
    let pair = Pair::new(&sensor, &display, &["--max-age", &MAX_AGE_MS.to_string()]);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    for _ in 0..TIMES {
        pair.weather.hold_still(true);
        // So long that the silence is noticed and what was on its way is old.
        let still = Instant::now();
        let silent = || {
            motions.extend(sensor.take_heard());
            still.elapsed() >= Duration::from_millis(STILL_MS)
        };
        wait_until(LIMIT, silent);
        let newest_held = sequences(&motions).last().copied().unwrap_or(0);
        pair.weather.hold_still(false);
        let after = listen(&sensor, LIMIT, at_least(100));
        let first = sequences(&after)[0];
        // 1 s of 500 Hz was held up; all but the last 150 ms is too old. A loaded machine takes its time.
        assert!(first >= newest_held + 200, "{first} after {newest_held}");
        motions.extend(after);
    }
    assert_rising(&motions);
    // Nor does a network that is stuck keep a bridge from ending.
    pair.weather.hold_still(true);
    pair.sensor.signal(Signal::TERM);
    let asked = Instant::now();
    let (status, lines, words) = pair.sensor.wait(LIMIT);
    println!("ended after {:?}", asked.elapsed());
    assert_eq!(status.code(), Some(0), "{words}");
    let report = last_report(&lines);
    // While answers are late, a message goes into the network that stands still every so often. All of
    // them come, but for the last 150 ms too old; a loaded machine says half as many.
    let said = TIMES * (STILL_MS - MAX_AGE_MS) * 1_000 / LATE_SPACING_US;
    let stale = report["incoming"]["stale"].as_u64();
    println!("{stale:?} too old, {said} said");
    assert!(stale >= Some(said / 2), "{said} said: {report}");
}

#[test]
fn a_router_that_is_killed_and_started_again_brings_the_stream_back() {
    let sensor = talking_board(Role::Sensor);
    let display = talking_board(Role::Display);
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let router = || Relay::start(["router", "--listen", &at]);
    let mut running = router();
    let _bridges = [
        Relay::bridge(Role::Sensor, sensor.path(), &["--connect", &at]),
        Relay::bridge(Role::Display, display.path(), &["--connect", &at]),
    ];
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    for _ in 0..2 {
        running.kill();
        motions.extend(sensor.take_heard());
        running = router();
        running.says("router, listening", LIMIT);
        let back = Instant::now();
        motions.extend(listen(&sensor, LIMIT, at_least(1)));
        println!("back {:?} after the router", back.elapsed());
        motions.extend(listen(&sensor, LIMIT, at_least(100)));
        listen(&display, LIMIT, at_least(10));
    }
    assert_rising(&motions);
}

#[test]
fn a_site_whose_address_changes_is_back_within_some_seconds() {
    let sensor = talking_board(Role::Sensor);
    let display = talking_board(Role::Display);
    let pair = Pair::new(&sensor, &display, &[]);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    listen(&display, LIMIT, at_least(20));
    let before = pair.weather.connections();
    pair.weather.strand();
    let changed = Instant::now();
    // Nothing tells either end. What is on the way when this is asked has come from before.
    for bridge in [&pair.sensor, &pair.display] {
        bridge.says("silent", LIMIT);
    }
    motions.extend(sensor.take_heard());
    display.take_heard();
    let (mut of_sensor, mut of_display) = (false, false);
    let both = || {
        let heard = sensor.take_heard();
        of_sensor |= heard.iter().any(is_motion);
        motions.extend(heard);
        of_display |= !sequences(&display.take_heard()).is_empty();
        of_sensor && of_display
    };
    assert!(wait_until(LIMIT, both));
    println!("back {:?} after the change", changed.elapsed());
    // The connection is given up when it was silent for so long; then a new one is made.
    let most = LEASE + Duration::from_secs(2);
    assert!(changed.elapsed() < most, "{:?}", changed.elapsed());
    assert!(pair.weather.connections() > before);
    motions.extend(listen(&sensor, LIMIT, at_least(100)));
    assert_rising(&motions);
}

#[test]
fn a_bridge_that_is_started_anew_is_followed() {
    let sensor = talking_board(Role::Sensor);
    let display = talking_board(Role::Display);
    let mut pair = Pair::new(&sensor, &display, &[]);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    for _ in 0..2 {
        let connect = format!("tcp/127.0.0.1:{}", pair.weather.port());
        let fresh = ["--connect", &connect];
        std::mem::replace(
            &mut pair.display,
            Relay::bridge(Role::Display, display.path(), &fresh),
        )
        .kill();
        motions.extend(sensor.take_heard());
        motions.extend(listen(&sensor, LIMIT, at_least(200)));
        listen(&display, LIMIT, at_least(20));
    }
    assert_rising(&motions);
}

/// A name for a port that can be put on another one, as udev does when a cable is put in.
struct Socket(PathBuf);

impl Socket {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ridgelink-{name}-{}", std::process::id()));
        let _ = fs::remove_file(&path);
        Self(path)
    }

    fn plug(&self, board: &FakeBoard) {
        let _ = fs::remove_file(&self.0);
        symlink(board.path(), &self.0).expect("a link can be made");
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[test]
fn a_board_whose_cable_is_pulled_and_put_back_goes_on_also_if_it_starts_anew() {
    let sensor = talking_board(Role::Sensor);
    let mut display = talking_board(Role::Display);
    let socket = Socket::new("display");
    socket.plug(&display);
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let _sensors = Relay::bridge(Role::Sensor, sensor.path(), &["--listen", &at]);
    let displays = Relay::bridge(Role::Display, &socket.0, &["--connect", &at]);
    listen(&sensor, LIMIT, at_least(100));
    for _ in 0..2 {
        drop(display);
        displays.says("not there", LIMIT);
        // What it said last is on its way yet: it said something every other millisecond.
        let mut silent = 0;
        let is_silent = || {
            let is_new = !sequences(&sensor.take_heard()).is_empty();
            silent = if is_new { 0 } else { silent + 1 };
            silent == 50
        };
        assert!(wait_until(LIMIT, is_silent), "it goes on for ever");
        // Another start of the board: its numbers begin at 0.
        display = talking_board(Role::Display);
        socket.plug(&display);
        let motions = listen(&sensor, LIMIT, at_least(100));
        assert_rising(&motions);
        listen(&display, LIMIT, at_least(10));
    }
}

#[test]
fn a_board_that_takes_no_bytes_gets_the_newest_when_it_does_again() {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let pair = Pair::new(&sensor, &display, &[]);
    let mut motions = listen(&sensor, LIMIT, at_least(100));
    sensor.deafen(true);
    let is_stuck = || {
        let lines = pair.sensor.lines();
        !lines.is_empty() && last_report(&lines)["incoming"]["stuck"].as_u64() > Some(300)
    };
    assert!(wait_until(LIMIT, is_stuck), "{:?}", pair.sensor.lines());
    sensor.deafen(false);
    motions.extend(listen(&sensor, LIMIT, at_least(300)));
    assert_rising(&motions);
}

#[test]
fn stop_reaches_both_boards_from_either_site_also_when_the_network_was_away() {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let pair = Pair::new(&sensor, &display, &[]);
    listen(&sensor, LIMIT, at_least(10));

    pair.sensor.signal(Signal::USR1);
    listen(&display, LIMIT, |heard| heard.iter().any(is_stop));
    listen(&sensor, LIMIT, |heard| heard.iter().any(is_stop));
    pair.sensor.says(
        "Stop: the board at the display's site has stopped: by the operator",
        LIMIT,
    );
    pair.display.says("Stop, said by the sensor's site", LIMIT);
    pair.display
        .says("Stop: the board here has stopped: by the operator", LIMIT);

    pair.display.signal(Signal::USR1);
    pair.display
        .says("Stop: with the board at the sensor's site", LIMIT);

    // Said while the network is away, it comes when it is back.
    pair.weather.cut(true);
    pair.display.says("the sensor's site: silent", LIMIT);
    display.take_heard();
    pair.sensor.signal(Signal::USR1);
    pair.weather.cut(false);
    listen(&display, LIMIT, |heard| heard.iter().any(is_stop));
}

#[test]
fn relay_stop_ends_well_only_when_the_display_itself_says_that_it_has_stopped() {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let pair = Pair::new(&sensor, &display, &[]);
    listen(&sensor, LIMIT, at_least(10));
    let at = format!("tcp/127.0.0.1:{}", pair.weather.port());
    let stop = |more: &[&str]| {
        Relay::start(
            ["stop", "--connect", &at]
                .into_iter()
                .chain(more.iter().copied()),
        )
    };
    let fails = |stop: Relay, what: &str| {
        let (status, _, words) = stop.wait(LIMIT);
        assert_eq!(status.code(), Some(1), "{words}");
        for part in [
            "NOT STOPPED",
            what,
            "press the emergency stop, or cut the display's power",
        ] {
            assert!(words.contains(part), "{words}");
        }
    };

    // Its bridge has written it, and yet the display goes on.
    display.disobey(true);
    let short = ["--within", "1"];
    fails(stop(&short), "does not say that it has stopped");
    let told = display.take_heard().into_iter().filter(is_stop).count();
    assert!(
        told > 1,
        "a line may garble what is said: told {told} times"
    );

    // It is told until it obeys.
    let stopping = stop(&[]);
    listen(&display, LIMIT, |heard| heard.iter().any(is_stop));
    display.disobey(false);
    let (status, _, words) = stopping.wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{words}");
    assert!(
        words.contains("the display has stopped: by the operator"),
        "{words}"
    );

    let other = ["--name", "other", "--within", "1"];
    fails(stop(&other), "no word from the display's bridge");
    drop(display);
    pair.display.says("not there", LIMIT);
    fails(stop(&short), "its board is not there");
}

#[test]
fn two_bridges_of_one_role_and_name_are_told_so() {
    let (first, second) = (FakeBoard::new(Role::Display), FakeBoard::new(Role::Display));
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let _router = Relay::start(["router", "--listen", &at]);
    let one = Relay::bridge(Role::Display, first.path(), &["--connect", &at]);
    let other = Relay::bridge(Role::Display, second.path(), &["--connect", &at]);
    one.says("another bridge calls itself the display's site", LIMIT);
    other.says("another bridge calls itself the display's site", LIMIT);
}

#[test]
fn nobody_there_is_named_and_not_knocked_at_wildly() {
    let board = FakeBoard::new(Role::Display);
    let nowhere = Weather::over(free_port());
    nowhere.cut(true);
    let at = format!("tcp/127.0.0.1:{}", nowhere.port());
    let bridge = Relay::bridge(Role::Display, board.path(), &["--connect", &at]);
    let started = Instant::now();
    bridge.says(&at, LIMIT);
    bridge.says("nobody there speaks to us", LIMIT);
    let per_second = nowhere.connections() as f64 / started.elapsed().as_secs_f64();
    assert!(per_second < 10.0, "{per_second} connections a second");

    let refused = format!("tcp/127.0.0.1:{}", free_port());
    let other = FakeBoard::new(Role::Sensor);
    let bridge = Relay::bridge(Role::Sensor, other.path(), &["--connect", &refused]);
    bridge.says("nobody listens there", LIMIT);
}

#[test]
fn a_board_that_says_something_that_is_no_number_is_not_carried() {
    let sensor = FakeBoard::new(Role::Sensor);
    let display = talking_board(Role::Display);
    let _pair = Pair::new(&sensor, &display, &[]);
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
