//! Bridges and routers in processes of their own, over the system's sockets. Everything waits for events; the
//! limits are a hang's. What depends on time is in `bridge_relay`, by virtual time.

use std::net::TcpListener;
use std::path::Path;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use host_bridge::link::{Event, Link};
use host_bridge::place::Place;
use protocol::{
    Configuration, Configure, Message, Question, Role, SensorConfiguration, Stop, StopReason,
    StreamGauges,
};
use rustix::process::Signal;
use serde_json::Value;
use tests::certificates::{Authority, Kind};
use tests::fake_board::{FakeBoard, wait_until};
use tests::relay::{Relay, free_port, listen, sequences, talking_board};
use tests::utterance::Speaker;
use tests::weather::datagrams::DatagramWeather;
use tests::weather::{Sky, Weather};

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

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
    // What a bridge reads too late is lost on its line, which is not the relay's to count.
    display.lose_nothing();
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
    // A busy machine's network loses some, or brings two at once, of which one is replaced: none goes without
    // being counted.
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
fn what_goes_by_datagrams_goes_on_while_the_stream_stands_still_and_what_is_lost_is_not_sent_again()
{
    assert_datagrams_go_on("udp", "127.0.0.1", [&[], &[]]);
}

#[test]
fn datagrams_with_certificates_go_on_while_the_stream_stands_still() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let authority = Authority::new(folder, "datagrams");
    let proofs = ["sensor", "display"].map(|role| authority.proofs(role, Kind::Good, &authority));
    assert_datagrams_go_on("quic", "localhost", [&proofs[0], &proofs[1]]);
}

/// That two bridges, the sensor's and the display's, which prove who they are with `proofs`, hear each other by the
/// datagrams of `carrier` on a network that loses some, while the stream stands still.
fn assert_datagrams_go_on(carrier: &str, host: &str, proofs: [&[String]; 2]) {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let port = free_port();
    let stream = Weather::over(port);
    let datagrams = DatagramWeather::over(stream.port(), port);
    datagrams.turn(Sky {
        loss: 0.1,
        ..Sky::default()
    });
    let [listening, connecting] =
        [port, stream.port()].map(|port| format!("{carrier}/{host}:{port}"));
    let start = |role, board: &FakeBoard, end: [&str; 2], proofs| {
        Relay::bridge_with(role, board.path(), end, proofs)
    };
    let listener = start(Role::Sensor, &sensor, ["--listen", &listening], proofs[0]);
    let bridge = start(
        Role::Display,
        &display,
        ["--connect", &connecting],
        proofs[1],
    );
    // At first both carry everything; then only datagrams do, as soon as each end hears them.
    let lost = || {
        let lines = listener.lines();
        let report: Value = serde_json::from_str(lines.last()?).ok()?;
        report["incoming"]["lost"].as_u64()
    };
    assert!(wait_until(LIMIT, || lost() > Some(200)), "{:?}", lost());
    stream.hold_still(true);
    sensor.take_heard();
    display.take_heard();
    assert_rising(&listen(&sensor, LIMIT, at_least(1_000)));
    assert_rising(&listen(&display, LIMIT, at_least(200)));
    stream.hold_still(false);
    // What has to come goes by the stream, and is said again until it comes.
    bridge.signal(Signal::USR1);
    listen(&sensor, LIMIT, |heard| heard.iter().any(is_stop));
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
fn a_site_whose_address_changes_gives_its_connection_up_and_makes_a_new_one() {
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
    // The connection is given up when it was silent for as long as the engine was told; then a new one is made.
    assert!(pair.weather.connections() > before);
    motions.extend(listen(&sensor, LIMIT, at_least(100)));
    assert_rising(&motions);
}

#[test]
fn a_bridge_that_is_killed_and_started_anew_is_followed() {
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

#[test]
fn a_signal_says_stop_at_both_sites() {
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
    // Nor does a network that is stuck keep a bridge from ending.
    pair.weather.hold_still(true);
    pair.sensor.signal(Signal::TERM);
    let (status, _, words) = pair.sensor.wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{words}");
}

#[test]
fn a_bridge_that_ends_before_a_stop_is_answered_says_who_has_not_stopped() {
    let sensor = talking_board(Role::Sensor);
    sensor.disobey(true);
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let bridge = Relay::bridge(Role::Sensor, sensor.path(), &["--listen", &at]);
    bridge.says("board: ", LIMIT);
    bridge.signal(Signal::USR1);
    listen(&sensor, LIMIT, |heard| heard.iter().any(is_stop));
    bridge.signal(Signal::TERM);
    let (status, _, words) = bridge.wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{words}");
    for whose in ["the board here", "the board at the display's site"] {
        let part = format!("NOT STOPPED as far as is known: {whose} has not answered");
        assert!(words.contains(&part), "{words}");
    }
}

#[test]
fn relay_stop_says_what_has_come_of_it() {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let pair = Pair::new(&sensor, &display, &["--max-age", "60000"]);
    listen(&sensor, LIMIT, at_least(10));
    let at = format!("tcp/127.0.0.1:{}", pair.weather.port());
    let stop = |more: &[&str]| {
        let words = ["stop", "--connect", &at].into_iter();
        Relay::start(words.chain(more.iter().copied())).wait(LIMIT)
    };
    let (status, _, words) = stop(&["--within", "100"]);
    assert_eq!(status.code(), Some(0), "{words}");
    assert!(
        words.contains("the display has stopped: by the operator"),
        "{words}"
    );
    // Nobody of that name ever answers.
    let (status, _, words) = stop(&["--name", "other", "--within", "1"]);
    assert_eq!(status.code(), Some(1), "{words}");
    for part in [
        "NOT STOPPED",
        "no word from the display's bridge",
        "press the emergency stop, or cut the display's power",
    ] {
        assert!(words.contains(part), "{words}");
    }
}

#[test]
fn a_program_at_one_site_hears_all_that_the_other_sites_board_says_and_may_stop_it() {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let _pair = Pair::new(&sensor, &display, &["--name", "far"]);
    listen(&sensor, LIMIT, at_least(10));
    let (events, told) = channel();
    let place = Place::Port("relay:far.sensor".into());
    let link = Link::open(Role::Sensor, place, move |event| {
        let _ = events.send(event);
    });
    assert!(
        wait_until(LIMIT, || link.state().is_known()),
        "{}",
        link.state()
    );
    // What no relay carries to the other board, and no program here would hear otherwise.
    let block = Speaker::new(1).gauges(7);
    assert!(wait_until(LIMIT, || {
        sensor.say(block.clone());
        let is_block = |event| matches!(event, Event::Heard { message, .. } if message == block);
        told.try_iter().any(is_block)
    }));
    // It may be asked, and not changed.
    assert!(wait_until(LIMIT, || link.clocks().is_some()));
    sensor.take_heard();
    let change = Message::Configure(Configure {
        replaces: None,
        configuration: Configuration::Sensor(SensorConfiguration::DEFAULT),
    });
    let questions = [
        Message::Question(Question::Configuration),
        Message::Question(Question::Capabilities),
        Message::StreamGauges(StreamGauges { for_ms: 10 }),
    ];
    for message in [&[change], &questions[..]].concat() {
        link.post(&message).expect("it is said");
    }
    let mut heard = Vec::new();
    assert!(wait_until(LIMIT, || {
        heard.extend(sensor.take_heard());
        questions.iter().all(|question| heard.contains(question))
    }));
    link.stop(Stop {
        reason: StopReason::Operator,
    })
    .expect("it is said");
    assert!(wait_until(LIMIT, || {
        heard.extend(sensor.take_heard());
        heard.iter().any(is_stop)
    }));
    let is_change = |message: &Message| matches!(message, Message::Configure(_));
    assert!(!heard.iter().any(is_change));
    listen(&display, LIMIT, |heard| heard.iter().any(is_stop));
    assert!(wait_until(LIMIT, || !link.is_stopping()));
}

#[test]
fn relay_stop_does_not_wait_for_an_end_that_is_dead() {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let pair = Pair::new(&sensor, &display, &[]);
    listen(&sensor, LIMIT, at_least(10));
    // It takes connections, and never says a word.
    let dead = TcpListener::bind(("127.0.0.1", 0)).expect("a port is free");
    let dead = dead.local_addr().expect("it is bound");
    let (dead, at) = (
        format!("tcp/{dead}"),
        format!("tcp/127.0.0.1:{}", pair.weather.port()),
    );
    let words = [
        "stop",
        "--connect",
        &dead,
        "--connect",
        &at,
        "--within",
        "9",
    ];
    let (status, _, words) = Relay::start(words).wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{words}");
}

#[test]
fn an_end_that_cannot_be_used_keeps_no_stop_from_the_others() {
    let (sensor, display) = (talking_board(Role::Sensor), talking_board(Role::Display));
    let pair = Pair::new(&sensor, &display, &[]);
    listen(&sensor, LIMIT, at_least(10));
    // It wants certificates.
    let unusable = ["stop", "--connect", "tls/127.0.0.1:1"];
    let at = format!("tcp/127.0.0.1:{}", pair.weather.port());
    let words = unusable.into_iter().chain(["--connect", &at]);
    let (status, _, words) = Relay::start(words).wait(LIMIT);
    assert_eq!(status.code(), Some(0), "{words}");
    assert!(
        words.contains("tls/127.0.0.1:1 wants certificates"),
        "{words}"
    );
    let (status, _, words) = Relay::start(unusable).wait(LIMIT);
    assert_eq!(status.code(), Some(2), "{words}");
    assert!(
        words.contains("tls/127.0.0.1:1 wants certificates"),
        "{words}"
    );
}

#[test]
fn a_board_of_the_other_role_does_not_stop_for_the_display() {
    let (sensor, other) = (talking_board(Role::Sensor), talking_board(Role::Sensor));
    let pair = Pair::new(&sensor, &other, &[]);
    pair.display.says("not the display", LIMIT);
    let at = format!("tcp/127.0.0.1:{}", pair.weather.port());
    let (status, _, words) = Relay::start(["stop", "--connect", &at, "--within", "3"]).wait(LIMIT);
    assert_eq!(status.code(), Some(1), "{words}");
    assert!(words.contains("NOT STOPPED"), "{words}");
    // It is told to stop all the same.
    listen(&other, LIMIT, |heard| heard.iter().any(is_stop));
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
