//! `host-bridge configure`: with the boards' own firmwares at the far side, and with what can't be done.
#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::fs;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

use hil_sim_boards::bench::PortName;
use hil_sim_core::scene::Scene;
use protocol::ACTUATORS;
use tests::bench::{ExclusiveBench, bench, folder, until};
use tests::bridge::{Ended, Running, command};

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(300);
/// The actuator that is described as dead.
const DEAD: usize = 23;

/// Fifty actuators in rows of `columns`, one of them with a gain of 0.
fn description(name: &str, columns: usize) -> PathBuf {
    let mut text = "actuator,x_um,y_um,gain,phase_turns,inverted\n".to_owned();
    for index in 0..ACTUATORS {
        let (x_um, y_um) = (index % columns * 300, index / columns * 300);
        let gain = u8::from(index != DEAD);
        writeln!(text, "{index},{x_um},{y_um},{gain},0,0").expect("a String takes all");
    }
    let folder = folder("configure-files");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let path = folder.join(name);
    fs::write(&path, text).expect("it can be written");
    path
}

/// Runs `configure` with `words` at the ports that `place` names.
fn configure(place: &[&Path], words: &[&str]) -> Ended {
    let mut command = command();
    command.arg("configure");
    for (option, path) in ["--sensor", "--display"].into_iter().zip(place) {
        command.arg(option).arg(path);
    }
    Running::start(command.args(words)).wait(LIMIT)
}

fn on(alone: &ExclusiveBench, words: &[&str]) -> Ended {
    let mut command = command();
    command.arg("configure").arg("--bench");
    command.arg(alone.bench.bench_file());
    // Beside other work the boards are slow to answer.
    command.args(["--within", "120"]).args(words);
    Running::start(&mut command).wait(LIMIT)
}

/// What has been done, as its lines.
fn done(ended: &Ended) -> Vec<&str> {
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    ended.stdout.lines().collect()
}

#[test]
fn settings_and_actuators_come_into_force_on_the_firmware_and_are_read_back() {
    let alone = bench("configure", |options| {
        options.scene = Scene::constant(2.0, 50.0);
    });
    let own = on(&alone, &[]);
    let own = done(&own);
    for line in ["# sensor", "window_ms=80", "# display", "amplitude_mv=5000"] {
        assert!(own.contains(&line), "{own:?}");
    }
    let path = description("array.csv", 10);
    let path = path.to_str().expect("UTF-8");
    let words = [
        "amplitude_mv=1000",
        "mode=travelling",
        "window_ms=120",
        "--actuators",
        path,
    ];
    let expected = [
        "sensor: window_ms is 120 ms now",
        "display: amplitude_mv is 1000 mV now",
        "display: mode is travelling now",
        &format!("display: actuators are those of {path} now"),
    ];
    // In the order in which the boards answer.
    let changed = on(&alone, &words);
    let mut changed = done(&changed);
    changed.sort_by_key(|line| line.starts_with("display"));
    assert_eq!(changed, expected);
    // It plays so: 1 V at most, and nothing at the dead one, once the wave before has gone.
    let bench = &alone.bench;
    let begun_s = bench.now_s();
    let mut largest_v = 0.0_f64;
    until("a second of it has passed", || {
        let (now_s, volts) = (bench.now_s() - begun_s, bench.outputs().volts);
        if now_s > 0.2 {
            assert_eq!(volts[DEAD], 0.0);
            largest_v = volts.iter().fold(largest_v, |most, v| most.max(v.abs()));
        }
        (now_s > 1.2).then_some(())
    });
    assert!((0.8..1.001).contains(&largest_v), "{largest_v} V");
    let in_force = || -> serde_json::Value {
        let ended = on(&alone, &["--json"]);
        done(&ended);
        serde_json::from_str(&ended.stdout).expect("JSON")
    };
    let kept = in_force();
    assert_eq!(kept["sensor"]["window_ms"], 120);
    assert_eq!(kept["sensor"]["method"], "spectrum");
    assert_eq!(kept["display"]["amplitude_mv"], 1_000);
    assert_eq!(kept["display"]["mode"], "travelling");
    let described = hil_sim_core::scene_file::display::actuators(Path::new(path)).expect("sound");
    let hash = format!("{:#010x}", protocol::actuators::hash(&described));
    assert_eq!(kept["display"]["actuators"], hash);
    // What is refused changes nothing, of all that was asked for.
    let far = description("far.csv", 50);
    let far = far.to_str().expect("UTF-8");
    for (words, why) in [
        (
            &["amplitude_mv=6000", "max_age_ms=100"][..],
            "display: refused: amplitude_mv is out of range: give 0 to 5000",
        ),
        (
            &["rendering=texture", "--actuators", far],
            "display: refused: rendering is too much with these actuators",
        ),
    ] {
        let refused = on(&alone, words);
        assert_eq!(refused.status.code(), Some(1), "{}", refused.stderr);
        assert!(refused.stderr.contains(why), "{}", refused.stderr);
        assert_eq!(refused.stdout, "");
        assert_eq!(in_force(), kept);
    }
    // The other board is changed, and so it is said, before it is known that one is not there.
    let mut half = command();
    half.args(["configure", "--within", "3600", "waves=5", "mode=uniform"]);
    half.args(["--sensor", "/dev/null/sensor", "--display"]);
    half.arg(alone.bench.path(PortName::DisplayConsole));
    let told = folder("configure-files").join("told");
    half.stdout(File::create(&told).expect("a file can be made"));
    let mut half = Running::start(&mut half);
    until("it is told", || {
        let text = fs::read_to_string(&told).expect("it is there");
        (text == "display: mode is uniform now\n").then_some(())
    });
    assert!(!half.has_ended());
    drop(half);
    // What was shown can be given again.
    let before: Vec<&str> = own
        .into_iter()
        .filter(|line| !line.starts_with('#'))
        .collect();
    done(&on(&alone, &before));
    let after = on(&alone, &[]);
    let after: Vec<&str> = done(&after);
    let after: Vec<&str> = after
        .into_iter()
        .filter(|line| !line.starts_with('#'))
        .collect();
    assert_eq!(after, before);
}

#[test]
fn what_is_no_setting_and_no_description_is_refused_before_a_board_is_asked() {
    let nowhere = ["/dev/null/sensor", "/dev/null/display"].map(Path::new);
    let cut = description("cut.csv", 10);
    let text = fs::read_to_string(&cut).expect("it is there");
    fs::write(&cut, text.replace("7,2100,0,1,", "7,2100,0,2,")).expect("it can be written");
    let cut = cut.to_str().expect("UTF-8");
    let wrong_gain = format!("{cut}:9: column 4 (gain): ");
    for (words, why) in [
        (&["amplitude_mv"][..], "give NAME=VALUE"),
        (&["volume=1"], "the display's are mode, rendering, "),
        (&["waves=5", "waves=6"], "waves is given twice"),
        (&["gauges=567"], "give some of 01234"),
        (&["mode=sideways"], "give uniform or travelling"),
        (
            &["waves=many"],
            "waves: \"many\" is none of its values: give ",
        ),
        (&["--actuators", cut], &wrong_gain),
        (
            &["--actuators", "/dev/null/none"],
            "/dev/null/none: cannot be read",
        ),
    ] {
        let ended = configure(&nowhere, words);
        assert_eq!(ended.status.code(), Some(2), "{words:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(why), "{words:?}: {}", ended.stderr);
    }
    let sensor_alone = configure(&nowhere[..1], &["mode=uniform"]);
    assert_eq!(sensor_alone.status.code(), Some(2));
    let why = "this bench has no display: give its port with --display";
    assert!(sensor_alone.stderr.contains(why), "{}", sensor_alone.stderr);
    // What may come is waited for.
    let absent = configure(&nowhere[..1], &["--within", "1", "waves=5", "--json"]);
    assert_eq!(absent.status.code(), Some(1), "{}", absent.stderr);
    let why = format!("sensor: {}: not there (", nowhere[0].display());
    assert!(absent.stderr.contains(&why), "{}", absent.stderr);
    assert_eq!(absent.stdout.trim(), "{}");
    let far = configure(&[Path::new("relay:bench.sensor")], &["waves=5"]);
    assert_eq!(far.status.code(), Some(2), "{}", far.stderr);
    let why = "sensor: relay:bench.sensor is at another site: run `host-bridge configure` there";
    assert!(far.stderr.contains(why), "{}", far.stderr);
    // It may be looked at, where there is a relay.
    let words = ["--within", "1"];
    let half = configure(&[Path::new("relay:no-bench.sensor"), nowhere[1]], &words);
    assert_eq!(half.status.code(), Some(1), "{}", half.stderr);
    let why = "sensor: relay:no-bench.sensor: not there (";
    assert!(half.stderr.contains(why), "{}", half.stderr);
    let why = format!("display: {}: not there (", nowhere[1].display());
    assert!(half.stderr.contains(&why), "{}", half.stderr);
}
