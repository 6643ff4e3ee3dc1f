//! `hil-sim serve`: hosts at the pseudo-terminals of a bench meet what they meet at the real boards.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::{Read, Write};
use std::sync::Arc;
use std::time::{Duration, Instant};

use hil_sim_boards::bench::{Bench, Command, Hand, Options, Pace, PortName, ServeError};
use hil_sim_core::scene::fault::{Fault, Kind};
use hil_sim_core::scene::{Gauges, Kinematic, Link, Motion, Scene, Series, Waveform};
use protocol::{
    Configuration, DisplayState, Message, Role, RoleCounters, SensorConfiguration, Trip,
};
use tests::bench::{BAUD, Client, ExclusiveBench, bench, folder, until};
use tests::elves;

fn estimate(message: Message) -> Option<f32> {
    match message {
        Message::Estimate(estimate) if estimate.valid => estimate.wavelength_mm,
        _ => None,
    }
}

fn velocity_mm_s(message: Message) -> Option<f64> {
    match message {
        Message::Motion(motion) => Some(f64::from(motion.velocity_um_s) * 1e-3),
        _ => None,
    }
}

/// The bench that stands for a day.
const DAY: &str = "day";
/// What its sensor board is set to, and no board is by default.
const WINDOW_MS: u16 = 120;

/// One specimen of 2 mm under a hand that goes at 50 mm/s.
fn steady(options: &mut Options) {
    options.scene = Scene::constant(2.0, 50.0);
}

/// One pair of boards for all that leaves it as it was: what an emulated pair takes longest for is its start.
#[test]
fn a_day_at_one_bench() {
    let begun = Instant::now();
    let alone = bench(DAY, |options| {
        steady(options);
        options.scene.estimator.window_ms = WINDOW_MS;
    });
    let bench = &alone.bench;
    boards_are_set_as_the_scene_asks_before_their_ports_appear(bench);
    a_host_on_either_console_hears_the_whole_conversation_and_time_keeps_behind_the_wall_clock(
        bench, begun,
    );
    clients_come_and_go_and_none_gets_what_another_left(bench);
    a_pulled_cable_hangs_up_and_comes_back_under_its_name(bench);
    at_a_wrong_baud_rate_neither_side_understands_the_other_and_at_the_right_one_they_do(bench);
    the_emergency_stop_stops_and_a_reset_brings_the_board_and_its_log_back(bench);
    the_bench_file_tells_of_both_boards_and_all_is_gone_when_the_bench_is(alone);
}

fn a_host_on_either_console_hears_the_whole_conversation_and_time_keeps_behind_the_wall_clock(
    bench: &Bench,
    begun: Instant,
) {
    for name in [PortName::SensorConsole, PortName::DisplayConsole] {
        let mut client = Client::open(&bench.path(name), BAUD);
        let wavelength_mm = client.hear("an estimate on either console", |message| {
            // What the display hears it does not repeat: its own motions tell that it follows.
            match name {
                PortName::SensorConsole => estimate(message),
                _ => velocity_mm_s(message)
                    .filter(|v| (v - 50.0).abs() < 1.0)
                    .map(|_| 2.0),
            }
        });
        assert!((wavelength_mm - 2.0).abs() < 0.1, "{wavelength_mm}");
        client.hear("a status", |message| match message {
            Message::Status(_) => Some(()),
            _ => None,
        });
        assert!(bench.has_client(name));
        assert!(bench.now_s() <= begun.elapsed().as_secs_f64());
        assert_eq!(client.counters().lost, 0);
    }
    until("driven outputs", || {
        (!bench.outputs().are_silent() && !bench.outputs().is_clear).then_some(())
    });
    let standing = bench.standing();
    assert_eq!(standing.hand_mm_s, 50.0);
    assert_eq!(standing.sensed.wavelength_mm, 2.0);
}

fn the_bench_file_tells_of_both_boards_and_all_is_gone_when_the_bench_is(alone: ExclusiveBench) {
    let file = alone.bench.bench_file();
    let text = fs::read_to_string(&file).unwrap();
    for (name, key) in [
        (PortName::SensorConsole, "port"),
        (PortName::SensorRtt, "rtt"),
        (PortName::DisplayConsole, "port"),
        (PortName::DisplayRtt, "rtt"),
    ] {
        let path = alone.bench.path(name);
        assert!(path.is_absolute() && path.exists());
        assert!(
            text.contains(&format!("{key} = \"{}\"", path.display())),
            "{text}"
        );
    }
    assert!(text.contains("firmware-sensor\""), "{text}");
    let refused = Bench::start(Options::new(folder(DAY)), elves::both());
    assert!(
        matches!(refused, Err(ServeError::Taken { .. })),
        "{refused:?}"
    );
    // The refused one has taken nothing away.
    assert!(file.exists());
    alone.bench.stop().unwrap();
    assert!(!file.exists());
    for name in PortName::ALL {
        assert!(fs::symlink_metadata(folder(DAY).join(name.name())).is_err());
    }
}

fn a_pulled_cable_hangs_up_and_comes_back_under_its_name(bench: &Bench) {
    let path = bench.path(PortName::SensorConsole);
    for _ in 0..3 {
        let mut client = Client::open(&path, BAUD);
        client.hear("an estimate", estimate);
        bench
            .command(Command::Pull(PortName::SensorConsole))
            .unwrap();
        assert!(!path.exists() && !bench.is_plugged(PortName::SensorConsole));
        client.hang_up();
        bench
            .command(Command::Plug(PortName::SensorConsole))
            .unwrap();
        assert!(path.exists());
    }
    Client::open(&path, BAUD).hear("an estimate", estimate);
    let joined = bench.pull(PortName::SensorLink).unwrap_err();
    assert!(matches!(joined, ServeError::Joined { .. }), "{joined}");
}

fn clients_come_and_go_and_none_gets_what_another_left(bench: &Bench) {
    let path = bench.path(PortName::SensorConsole);
    let mut last = None;
    for _ in 0..4 {
        let mut client = Client::open(&path, BAUD);
        let first = client.hear("an estimate", |message| match message {
            Message::Estimate(estimate) => Some(estimate.sequence),
            _ => None,
        });
        assert!(last.is_none_or(|last| first > last), "{last:?}, {first}");
        last = Some(client.hear("another estimate", |message| match message {
            Message::Estimate(estimate) => Some(estimate.sequence),
            _ => None,
        }));
        // It goes with bytes unread.
    }
}

fn at_a_wrong_baud_rate_neither_side_understands_the_other_and_at_the_right_one_they_do(
    bench: &Bench,
) {
    let path = bench.path(PortName::SensorConsole);
    for baud in [115_200, 460_800, 1_000_000] {
        let mut client = Client::open(&path, baud);
        until("garbage", || {
            client
                .listen(|message| panic!("{message:?} at {baud} baud"))
                .unwrap();
            (client.bytes > 20).then_some(())
        });
        assert_eq!(client.counters().received, 0);
    }
    Client::open(&path, BAUD).hear("an estimate", estimate);
}

#[test]
fn boards_apart_hear_each_other_only_through_whoever_carries_their_bytes() {
    let alone = bench("apart", |options| {
        steady(options);
        options.is_apart = true;
    });
    let bench = &alone.bench;
    let mut console = Client::open(&bench.path(PortName::DisplayConsole), BAUD);
    let followed = |message| match message {
        Message::Status(status) => match status.role {
            RoleCounters::Display(counters) => Some(counters.estimates),
            RoleCounters::Sensor(_) => None,
        },
        _ => None,
    };
    assert_eq!(console.hear("a status", followed), 0);
    let open = |name| {
        serialport::new(bench.path(name).to_string_lossy(), BAUD)
            .timeout(Duration::from_millis(1))
            .open()
            .unwrap()
    };
    let mut ends = [open(PortName::SensorLink), open(PortName::DisplayLink)];
    let mut bytes = [0; 1024];
    until("an estimate that the display follows", || {
        for (from, to) in [(0, 1), (1, 0)] {
            if let Ok(count) = ends[from].read(&mut bytes) {
                ends[to].write_all(&bytes[..count]).unwrap();
            }
        }
        let mut count = 0;
        console
            .listen(|message| count = followed(message).unwrap_or(count))
            .unwrap();
        (count > 0).then_some(())
    });
    assert!(!bench.outputs().are_silent());
}

#[test]
fn the_hand_goes_as_it_is_told_and_the_stimulus_with_it() {
    let alone = bench("hand", |options| {
        options.hand = Hand::Told;
    });
    let bench = &alone.bench;
    let mut display = Client::open(&bench.path(PortName::DisplayConsole), BAUD);
    assert_eq!(display.hear("a motion", velocity_mm_s), 0.0);
    assert!(bench.outputs().are_silent());
    for speed_mm_s in [40.0, -25.0] {
        bench.command(Command::Hand { speed_mm_s }).unwrap();
        display.hear("the speed asked for", |message| {
            velocity_mm_s(message).filter(|v| (v - speed_mm_s).abs() < 1.0)
        });
        until("a stimulus", || {
            (!bench.outputs().are_silent()).then_some(())
        });
    }
    bench.command("hand 0".parse().unwrap()).unwrap();
    until("silence", || bench.outputs().are_silent().then_some(()));
}

fn is_stopped(state: DisplayState) -> bool {
    state == DisplayState::Stopped(Trip::EmergencyStop)
}

#[test]
fn a_scene_s_faults_come_at_their_time() {
    let alone = bench("faults", |options| {
        steady(options);
        options.scene.faults = vec![Fault::new(Kind::EmergencyStop, 1.5)];
    });
    let bench = &alone.bench;
    let mut display = Client::open(&bench.path(PortName::DisplayConsole), BAUD);
    display.hear("the emergency stop", |message| match message {
        Message::Safety(safety) => is_stopped(safety.state).then_some(()),
        _ => None,
    });
    assert!(bench.now_s() >= 1.5);
}

fn the_emergency_stop_stops_and_a_reset_brings_the_board_and_its_log_back(bench: &Bench) {
    let mut display = Client::open(&bench.path(PortName::DisplayConsole), BAUD);
    let state = |wanted: fn(DisplayState) -> bool| {
        move |message| match message {
            Message::Safety(safety) if wanted(safety.state) => Some(()),
            _ => None,
        }
    };
    let driving = |message| match message {
        Message::Status(status) => match status.role {
            RoleCounters::Display(counters) => {
                (counters.state == DisplayState::Driving).then_some(())
            }
            RoleCounters::Sensor(_) => None,
        },
        _ => None,
    };
    display.hear("a driving display", driving);
    bench.command(Command::Stop).unwrap();
    display.hear("the emergency stop", state(is_stopped));
    until("silence", || bench.outputs().are_silent().then_some(()));
    bench.command(Command::Release).unwrap();
    let mut log = serialport::new(bench.path(PortName::DisplayRtt).to_string_lossy(), BAUD)
        .timeout(Duration::from_millis(20))
        .open()
        .unwrap();
    until("the log's reader to be seen", || {
        bench.has_client(PortName::DisplayRtt).then_some(())
    });
    bench.command(Command::Reset(Role::Display)).unwrap();
    let mut bytes = [0; 64];
    until("the log of a start", || log.read(&mut bytes).ok());
    // Said once a second, whoever listened when it began.
    display.hear("a display that drives again", driving);
}

fn boards_are_set_as_the_scene_asks_before_their_ports_appear(bench: &Bench) {
    let mut client = Client::open(&bench.path(PortName::SensorConsole), BAUD);
    client.hear("an estimate", estimate);
    client.say(&Message::Question(protocol::Question::Configuration));
    let configuration = client.hear("the configuration", |message| match message {
        Message::Configuration(report) => Some(report.configuration),
        _ => None,
    });
    let wanted = SensorConfiguration {
        window_ms: WINDOW_MS,
        ..SensorConfiguration::DEFAULT
    };
    assert_eq!(configuration, Configuration::Sensor(wanted));
}

#[test]
fn as_fast_as_it_can_a_bench_waits_for_a_slow_reader_and_loses_nothing() {
    let alone = bench("max", |options| {
        steady(options);
        options.pace = Pace::Max;
        options.until_s = Some(8.0);
    });
    let bench = &alone.bench;
    let mut client = Client::open(&bench.path(PortName::SensorConsole), BAUD);
    // What a read brings may hold several.
    let mut next = 0;
    let mut follow = |client: &mut Client| {
        let heard = client.listen(|message| {
            if let Message::Estimate(estimate) = message {
                assert!(next == 0 || estimate.sequence == next, "{next}");
                next = estimate.sequence + 1;
            }
        });
        heard.unwrap();
        next
    };
    until("an estimate", || (follow(&mut client) > 0).then_some(()));
    // Nobody reads until the port is full and time stands: a bench that is not held up would be over.
    let mut last_s = bench.now_s();
    let mut looked = Instant::now();
    until("time to stand", || {
        client.stay();
        if bench.now_s() != last_s {
            (last_s, looked) = (bench.now_s(), Instant::now());
        }
        (looked.elapsed() > Duration::from_millis(200)).then_some(())
    });
    assert!(!bench.is_over(), "over at {last_s} s");
    let next = until("the last byte", || {
        let (is_over, before) = (bench.is_over(), client.bytes);
        client.stay();
        let next = follow(&mut client);
        (is_over && client.bytes == before).then_some(next)
    });
    // 100 Hz; the last is on its way for some milliseconds.
    assert!((790..=800).contains(&next), "{next}");
    assert_eq!(client.counters().lost, 0);
    assert_eq!(bench.standing().dropped, 0);
    alone.bench.stop().unwrap();
}

#[test]
fn at_a_set_pace_a_reader_that_sleeps_costs_bytes_and_these_are_counted() {
    let alone = bench("slow", |options| {
        steady(options);
        options.pace = Pace::Times(20.0);
    });
    let bench = &alone.bench;
    let mut client = Client::open(&bench.path(PortName::SensorConsole), BAUD);
    client.hear("an estimate", estimate);
    until("bytes lost", || {
        client.stay();
        (bench.standing().dropped > 0).then_some(())
    });
    assert!(bench.standing().now_s > 0.0);
}

#[test]
fn what_a_bench_cannot_do_is_refused_with_what_to_do() {
    let refusal = |change: &dyn Fn(&mut Options)| {
        let mut options = Options::new(folder("refused"));
        change(&mut options);
        Bench::start(options, elves::both())
            .unwrap_err()
            .to_string()
    };
    let rain = refusal(&|options| {
        options.is_apart = true;
        options.scene.link = Link {
            loss: 0.1,
            ..Link::default()
        };
    });
    assert!(rain.contains("--apart"), "{rain}");
    let flood = refusal(&|options| {
        options.scene.faults = vec![Fault::new(Kind::ConsoleFlood, 1.0)];
    });
    assert!(flood.contains("take it out"), "{flood}");
    let volts = Series {
        at: vec![0.0, 3.0],
        values: vec![1.65; 10],
        width: 5,
    };
    let recorded = refusal(&|options| {
        options.scene.gauges = Gauges::Recorded(Arc::new(Waveform::on_lines(volts.clone())));
        options.hand = Hand::Recorded(Motion::Constant { speed_mm_s: 1.0 });
    });
    assert!(recorded.contains("kinematic"), "{recorded}");
    let file = refusal(&|options| {
        options.dir = elves::path(Role::Sensor);
        options.scene.gauges = Gauges::Kinematic(Kinematic::default());
    });
    assert!(file.contains("--dir"), "{file}");
}
