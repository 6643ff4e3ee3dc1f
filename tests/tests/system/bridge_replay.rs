//! `host-bridge replay`: a recording is said to a board in order and in its time, and a scene of it gives
//! the estimates that were recorded.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::native;
use hil_sim_core::scene::Scene;
use host_bridge::clock::Clock;
use host_bridge::link::Link;
use host_bridge::place::Place;
use host_bridge::recording::reader::Reader;
use host_bridge::replay::StandIn;
use host_bridge::replay::scene::{self, Made};
use host_bridge::replay::{Pace, play};
use protocol::{Estimate, Message, Motion, Role};
use tests::bridge::{self, Running};
use tests::fake_board::{FakeBoard, wait_until};
use tests::recorded::{record, said_of};
use tests::run::scene as scene_of;
use tests::utterance::Speaker;
use tests::virtual_clock;
use tests::virtual_ports::VirtualBench;

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

/// An empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("bridge_replay")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

fn motion(at: u32) -> Motion {
    Motion {
        sequence: 1_000 + at,
        instant_us: 7_000_000 + 2_000 * u64::from(at),
        position_um: i64::from(at) * 100,
        velocity_um_s: 50_000,
    }
}

/// Motions at 500 Hz and estimates at 100 Hz, for half a second.
fn half_a_second() -> Vec<(u64, Role, Message)> {
    let mut speaker = Speaker::new(3);
    let mut said = Vec::new();
    for at in 0..250 {
        let after_us = 2_000 * u64::from(at);
        said.push((after_us, Role::Display, Message::Motion(motion(at))));
        if at % 5 == 0 {
            let Message::Estimate(estimate) = speaker.estimate() else {
                unreachable!("an estimate was asked for");
            };
            let estimate = Estimate {
                instant_us: 9_000_000 + after_us,
                velocity_um_s: 1_000,
                ..estimate
            };
            said.push((after_us, Role::Sensor, Message::Estimate(estimate)));
        }
    }
    said
}

/// Whether a message is one that a peer says.
fn is_of_peer(message: &Message) -> bool {
    matches!(message, Message::Motion(_) | Message::Estimate(_))
}

/// Replays into a board by virtual time; what it hears of its peer, and when each was said, in µs after the
/// first.
fn replayed(path: &Path, role: Role, speed: f64) -> (Vec<Message>, Vec<u64>) {
    let bench = VirtualBench::default();
    let board = FakeBoard::on(&bench, role);
    let place = Place::Port(board.path().clone());
    let link = Link::open_on(&bench.system(), role, place, |_| {});
    let until = |holds: &mut dyn FnMut() -> bool| {
        assert!(virtual_clock::wait_until(&bench.clock, LIMIT, holds));
    };
    until(&mut || link.state().is_known());
    let pace = Pace {
        speed,
        ..Pace::default()
    };
    let mut peer = StandIn::new(role, speed);
    let mut said_us = Vec::new();
    let recording = Reader::open(path).expect("a recording");
    let ended = AtomicBool::new(false);
    let played = play(&bench.clock, recording, &pace, &ended, |from, event| {
        let now_us = bench.clock.now_us();
        if let Some(message) = peer.say(from, &event, now_us) {
            link.post(&message).expect("the board is there");
            said_us.push(now_us);
        }
    });
    assert_eq!(played.expect("a whole file").latest, Duration::ZERO);
    let mut heard = Vec::new();
    until(&mut || {
        heard.extend(board.take_heard().into_iter().filter(is_of_peer));
        heard.len() >= said_us.len()
    });
    let first_us = said_us[0];
    let after = said_us.into_iter().map(|at_us| at_us - first_us);
    (heard, after.collect())
}

#[test]
fn a_sensor_board_hears_the_motions_in_order_and_in_their_time() {
    let path = folder("sensor").join("half.mcap");
    record(&path, half_a_second());
    for factor in [1, 10, 100] {
        let (heard, said_us) = replayed(&path, Role::Sensor, factor as f64);
        let Some(Message::Motion(first)) = heard.first().cloned() else {
            panic!("{heard:?}");
        };
        assert_eq!(heard.len(), 250);
        for ((message, at), said_us) in heard.iter().zip(0..).zip(said_us) {
            let after_us = 2_000 * u64::from(at) / factor;
            let want = Motion {
                sequence: at,
                instant_us: first.instant_us + after_us,
                velocity_um_s: 50_000 * factor as i32,
                ..motion(at)
            };
            assert_eq!(*message, Message::Motion(want), "at {factor} times");
            // A recording's times are in s.
            assert!(said_us.abs_diff(after_us) <= 1, "{said_us} at {after_us}");
        }
    }
}

#[test]
fn a_display_board_hears_the_estimates_in_order_and_in_their_time() {
    let path = folder("display").join("half.mcap");
    let said = half_a_second();
    record(&path, said.clone());
    let estimates: Vec<Estimate> = said
        .into_iter()
        .filter_map(|(_, _, message)| match message {
            Message::Estimate(estimate) => Some(estimate),
            _ => None,
        })
        .collect();
    let (heard, said_us) = replayed(&path, Role::Display, 1.0);
    let Some(Message::Estimate(first)) = heard.first().cloned() else {
        panic!("{heard:?}");
    };
    assert_eq!(heard.len(), estimates.len());
    for (((message, said), at), said_us) in heard.iter().zip(estimates).zip(0..).zip(said_us) {
        let after_us = 10_000 * u64::from(at);
        let want = Estimate {
            sequence: at,
            instant_us: first.instant_us + after_us,
            ..said
        };
        assert_eq!(*message, Message::Estimate(want));
        assert!(said_us.abs_diff(after_us) <= 1, "{said_us} at {after_us}");
    }
}

#[test]
fn the_command_says_a_recording_to_a_board_and_nothing_else() {
    let path = folder("command").join("half.mcap");
    record(&path, half_a_second());
    let board = FakeBoard::new(Role::Sensor);
    board.lose_nothing();
    let running = Running::start(
        bridge::command()
            .arg("replay")
            .arg(&path)
            .args(["--to", "sensor-board", "--speed", "10", "--sensor"])
            .arg(board.path()),
    );
    let mut heard = Vec::new();
    let complete = wait_until(LIMIT, || {
        heard.extend(board.take_heard().into_iter().filter(is_of_peer));
        heard.len() >= 250
    });
    let ended = running.wait(LIMIT);
    assert!(
        complete,
        "{}: {}{}",
        heard.len(),
        ended.stdout,
        ended.stderr
    );
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let numbers = heard.iter().map(|message| match message {
        Message::Motion(motion) => motion.sequence,
        other => panic!("{other:?}"),
    });
    assert!(numbers.eq(0..250));
    assert_eq!(board.take_heard().len(), 0, "nothing else is said");
}

#[test]
fn a_board_that_is_not_there_and_a_file_that_is_none_are_named() {
    let folder = folder("refusals");
    let path = folder.join("half.mcap");
    record(&path, half_a_second());
    let file = path.to_str().expect("UTF-8");
    let unsaid = folder.join("unsaid.mcap");
    let mut speaker = Speaker::new(1);
    let blocks = [0, 8, 16, 24].map(|first| (0, Role::Sensor, speaker.gauges(first)));
    record(&unsaid, blocks);
    let unsaid = unsaid.to_str().expect("UTF-8");
    let empty = folder.join("empty.mcap");
    record(&empty, []);
    let empty = empty.to_str().expect("UTF-8");
    let none = folder.join("none.mcap");
    fs::write(&none, "none at all").expect("the file can be written");
    let none = none.to_str().expect("UTF-8");
    let toml = folder.join("x.toml");
    let toml = toml.to_str().expect("UTF-8");
    let sensor = FakeBoard::new(Role::Sensor);
    let sensor = sensor.path().to_str().expect("UTF-8");
    let display = FakeBoard::new(Role::Display);
    let display = display.path().to_str().expect("UTF-8");
    for (words, want) in [
        (
            vec![unsaid, "--to", "sensor-board", "--sensor", sensor],
            "unsaid.mcap: holds no motions there, and a sensor board is told nothing else: give a recording",
        ),
        (
            vec![empty, "--to", "display-board", "--display", display],
            "empty.mcap: holds no estimates there, and a display board is told nothing else: give a recording",
        ),
        (
            vec![
                file,
                "--to",
                "display-board",
                "--from",
                "0.495",
                "--display",
                display,
            ],
            "half.mcap: holds no estimates there",
        ),
        (
            vec![file, "--to", "monitor", "--wavelength", "2"],
            "--wavelength: is for a scene: leave it out",
        ),
        (
            vec![file, "--to", "monitor", "--expect"],
            "--expect: is for a scene: leave it out",
        ),
        (
            vec![file, "--to", "display-board", "--force"],
            "--force: is for a scene: leave it out",
        ),
        (
            vec![file, "--to", "sensor-board", "--sensor", "/dev/null/s"],
            "/dev/null/s: not there: plug the board in",
        ),
        (vec![none, "--to", toml], "none.mcap: is no MCAP file"),
        (
            vec![file, "--to", "monitor", "--from", "500"],
            "and is to be read from 500 s on: give an earlier moment",
        ),
        (
            vec![file, "--to", toml],
            "half.mcap: 0 samples of the gauges there: record without --no-gauges",
        ),
        (
            vec![unsaid, "--to", toml],
            "unsaid.mcap: no valid estimate tells what was rubbed: give its wavelength",
        ),
        (
            vec![file, "--to", "nowhere"],
            "give monitor, sensor-board, display-board",
        ),
        (
            vec![file, "--to", toml, "--speed", "1000"],
            "give 0.1 to 100",
        ),
        (
            vec![file, "--to", toml, "--from", "2", "--to-time", "1"],
            "give a time after --from",
        ),
        (
            vec![file, "--to", "monitor", "--from", "nan"],
            "give a number of seconds, 0 or more",
        ),
        (
            vec![file, "--to", "display-board", "--to-time", "-1"],
            "give a number of seconds, 0 or more",
        ),
        (
            vec![file, "--to", toml, "--speed", "2"],
            "a scene has its own time",
        ),
    ] {
        let ended = bridge::run(["replay"].into_iter().chain(words.iter().copied()), LIMIT);
        assert_eq!(ended.status.code(), Some(2), "{words:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(want), "{words:?}: {}", ended.stderr);
    }
}

#[test]
fn a_monitor_of_a_recording_that_was_cut_off_says_so() {
    let path = folder("cut").join("half.mcap");
    record(&path, half_a_second());
    let watch = || {
        let file = path.to_str().expect("UTF-8");
        let ended = bridge::run(["replay", file, "--to", "monitor"], LIMIT);
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
        ended.stderr
    };
    assert_eq!(watch(), "");
    let bytes = fs::read(&path).expect("the file can be read");
    fs::write(&path, &bytes[..bytes.len() - 10]).expect("the file can be written");
    let said = watch();
    assert!(said.contains("half.mcap: was cut off at 0.5 s"), "{said}");
}

/// A scene that was recorded and made a scene of again.
struct Round {
    recorded: Vec<Estimate>,
    made: Made,
    outcome: Outcome,
}

/// Runs `toml`, records what the sensor says, makes a scene of what lies between two times and runs that.
fn round(test: &str, toml: &str, from_s: f64, to_s: Option<f64>) -> Round {
    let folder = folder(test);
    let original = scene_of(toml);
    let configuration = original.sensor_configuration();
    let scans = native::run(&original)
        .expect("a scene that loaded runs")
        .scans;
    let said = said_of(&scans, configuration);
    let recorded = said
        .iter()
        .filter_map(|(_, _, message)| match message {
            Message::Estimate(estimate) => Some(*estimate),
            _ => None,
        })
        .collect();
    let path = folder.join("bench.mcap");
    record(&path, said);
    let settings = scene::Settings {
        path: folder.join("again.toml"),
        from_s,
        to_s,
        wavelength_mm: None,
        expect: true,
        force: false,
    };
    let recording = Reader::open(&path).expect("a recording");
    let made = scene::write(recording, &settings).unwrap_or_else(|error| panic!("{error}"));
    let again = Scene::load(&made.path).unwrap_or_else(|error| panic!("{error}"));
    let run = native::run(&again).expect("a scene that loaded runs");
    Round {
        recorded,
        made,
        outcome: Outcome::new(again, run),
    }
}

impl Round {
    /// The recorded estimates and those of the scene at the same samples, from `from_s` of the scene on.
    fn pairs(&self, from_s: f64) -> Vec<(Estimate, Estimate)> {
        let at_us = |estimate: &Estimate| estimate.instant_us.cast_signed() - self.made.begin_us;
        let pairs: Vec<_> = self
            .outcome
            .recording
            .estimates
            .iter()
            .map(|record| record.estimate)
            .filter(|again| again.instant_us as f64 * 1e-6 >= from_s)
            .map(|again| {
                let same = self
                    .recorded
                    .iter()
                    .find(|recorded| at_us(recorded) == again.instant_us.cast_signed());
                (*same.expect("estimates fall on the same samples"), again)
            })
            .collect();
        assert!(!pairs.is_empty());
        pairs
    }

    /// The share of pairs that are valid or not alike, and the largest relative difference of λ of those
    /// that are valid.
    fn agreement(&self, from_s: f64) -> (f64, f64) {
        let pairs = self.pairs(from_s);
        let alike = pairs
            .iter()
            .filter(|(one, other)| one.valid == other.valid)
            .count();
        let worst = pairs
            .iter()
            .filter(|(one, other)| one.valid && other.valid)
            .filter_map(|(one, other)| Some((one.wavelength_mm?, other.wavelength_mm?)))
            .map(|(one, other)| f64::from((other / one - 1.0).abs()))
            .fold(0.0, f64::max);
        (alike as f64 / pairs.len() as f64, worst)
    }
}

/// Rubbed to and fro as in the paper's Fig. 7.
const STROKES: &str = "duration_s = 4.0\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n\
    [motion]\nkind = \"sinusoid\"\namplitude_mm_s = 70.0\nfrequency_hz = 0.83\n";
/// From here on the scene's estimators know as much as the board's did: half a second after the start, in
/// which something at 50 Hz might be hum, and the wave that is averaged over.
const KNOWN_S: f64 = 0.7;

/// How far λ of the scene may be from the recorded one, relative: six deviations of what one more rounding
/// makes of it. A scan's rounding has a variance of 1/12 step², of which the filter leaves 0.22 in a sample;
/// the weakest gauge's wave has an amplitude of 0.6 · 372 steps. At 70 mm/s, 0.7 λ are 20 samples of five
/// gauges, and a phase that is known to within σ at each of n places over q waves gives the wavenumber to
/// within σ √(12/n) / 2πq.
fn rounding_bound() -> f64 {
    let phase = (firmware_sensor::decimate::NOISE_GAIN as f64 / 12.0).sqrt() / (0.6 * 372.0);
    let places = 5.0 * 0.7 * 2.0 / 70.0 * 1_000.0;
    6.0 * phase * f64::sqrt(12.0 / places) / (std::f64::consts::TAU * 0.7)
}

#[test]
fn a_recording_makes_a_scene_that_gives_its_estimates_again() {
    let toml = format!("{STROKES}[estimator]\nwaves = 6\nvalid_percent = 80\n");
    let round = round("clean", &toml, 0.0, None);
    assert!(round.outcome.unmet.is_empty(), "{:?}", round.outcome.unmet);
    assert!((round.made.wavelength_mm / 2.0 - 1.0).abs() < 0.005);
    assert_eq!(round.outcome.scene.estimator.waves, 6);
    assert_eq!(round.outcome.scene.estimator.valid_percent, 80);
    assert_eq!(round.outcome.scene.notes, []);
    let (alike, worst) = round.agreement(KNOWN_S);
    assert!(alike == 1.0 && worst < rounding_bound(), "{alike}, {worst}");
}

#[test]
fn noise_does_not_keep_a_scene_from_giving_the_estimates_again() {
    // What the sensor takes for its noise has a spread of an eighth, here as there: at 10 dB that decides now
    // and then whether an estimate is stood by.
    for (snr_db, least) in [(20, 0.99), (10, 0.9)] {
        let toml = format!("{STROKES}[gauges]\nsnr_db = {snr_db}.0\n");
        let round = round(&format!("noisy-{snr_db}"), &toml, 0.0, None);
        assert!(round.outcome.unmet.is_empty(), "{:?}", round.outcome.unmet);
        let (alike, worst) = round.agreement(KNOWN_S);
        // A third of what λ is off anyhow.
        let off = round
            .outcome
            .verdict
            .summary
            .rms_percent
            .expect("valid ones")
            / 100.0;
        assert!(
            alike >= least && worst < off / 3.0,
            "{snr_db} dB: {alike}, {worst}, {off}"
        );
    }
}

#[test]
fn a_force_channel_is_recorded_and_played_too() {
    let toml = format!("{STROKES}[contact]\nfriction = \"mild\"\n[gauges]\ntangential = true\n");
    let round = round("force", &toml, 0.0, None);
    assert!(round.outcome.scene.force.present);
    let (alike, worst) = round.agreement(KNOWN_S);
    assert!(
        alike > 0.97 && worst < 2.0 * rounding_bound(),
        "{alike}, {worst}"
    );
}

#[test]
fn a_piece_of_a_recording_makes_a_scene() {
    // The longer fits are made by every fifth estimate: beginning here, the scene is in step with the board.
    let round = round("piece", STROKES, 1.335, Some(3.15));
    assert!(
        (1.7..=1.8).contains(&round.made.duration_s),
        "{:?}",
        round.made
    );
    let (alike, worst) = round.agreement(KNOWN_S);
    assert!(alike == 1.0 && worst < rounding_bound(), "{alike}, {worst}");
}

#[test]
fn samples_that_are_missing_are_named_with_the_longest_piece_without() {
    let folder = folder("gap");
    let original = scene_of(STROKES);
    let scans = native::run(&original)
        .expect("a scene that loaded runs")
        .scans;
    let mut said = said_of(&scans, original.sensor_configuration());
    said.retain(|(at_us, _, message)| {
        !(matches!(message, Message::Gauges(_)) && (1_000_000..1_100_000).contains(at_us))
    });
    let path = folder.join("gap.mcap");
    record(&path, said);
    let settings = scene::Settings {
        path: folder.join("again.toml"),
        from_s: 0.0,
        to_s: None,
        wavelength_mm: None,
        expect: false,
        force: false,
    };
    let open = || Reader::open(&path).expect("a recording");
    let error = scene::write(open(), &settings).expect_err("there is a gap");
    let scene::SceneError::Gap {
        at_s, from_s, to_s, ..
    } = error
    else {
        panic!("{error}");
    };
    assert!(
        (1.09..1.12).contains(&at_s) && from_s == at_s && to_s > 3.9,
        "{error}"
    );
    assert!(!settings.path.exists());
    let piece = scene::Settings {
        from_s,
        to_s: Some(to_s),
        ..settings.clone()
    };
    let made = scene::write(open(), &piece).unwrap_or_else(|error| panic!("{error}"));
    assert!(made.duration_s > 2.8, "{made:?}");
    let again = scene::write(open(), &piece).expect_err("the files are there");
    assert!(
        again.to_string().contains("again.toml: is there already"),
        "{again}"
    );
}
