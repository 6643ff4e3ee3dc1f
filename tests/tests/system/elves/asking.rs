//! What a host at a console asks for, and what the board makes of it.

use std::sync::{Arc, LazyLock, Mutex};

use hil_sim_boards::{Terminal, Terminals};
use hil_sim_core::run::recording::Recording;
use protocol::{
    Capabilities, Configuration, ConfigurationReport, Configure, DisplayConfiguration,
    DisplayState, GAUGE_BLOCK, Hello, MAX_FRAME, Message, Port, Question, Role, RoleCounters,
    SensorConfiguration, Setting, StreamGauges, Trip,
};
use tests::elves;
use tests::run::scene;

const MS: u64 = 1_000_000;

/// Says at their instants what it is given.
struct Host {
    port: Port,
    script: Vec<(u64, Message)>,
    heard: Arc<Mutex<Vec<(u64, Message)>>>,
}

impl Host {
    fn following(script: &[(u64, Message)]) -> (Box<dyn Terminal>, Heard) {
        let heard = Heard::default();
        let host = Self {
            port: Port::new(Hello::new(Role::Host, "asking", [0, 1, 0])),
            script: script.to_vec(),
            heard: Arc::clone(&heard),
        };
        (Box::new(host), heard)
    }
}

type Heard = Arc<Mutex<Vec<(u64, Message)>>>;

impl Terminal for Host {
    fn serve(&mut self, now_ns: u64, sent: &[(u64, u8)]) -> Vec<u8> {
        let bytes: Vec<u8> = sent.iter().map(|&(_, byte)| byte).collect();
        let mut heard = self.heard.lock().unwrap();
        self.port.receive(now_ns / 1_000, &bytes, |message| {
            heard.push((now_ns, message));
        });
        while self
            .script
            .first()
            .is_some_and(|&(at_ns, _)| at_ns <= now_ns)
        {
            let (_, message) = self.script.remove(0);
            self.port.post(&message);
        }
        let mut said = Vec::new();
        let mut out = [0; MAX_FRAME];
        while let count @ 1.. = self.port.take(&mut out) {
            said.extend_from_slice(&out[..count]);
        }
        said
    }
}

/// A run in which hosts ask both boards.
struct Asked {
    recording: Recording,
    sensor: Vec<(u64, Message)>,
    display: Vec<(u64, Message)>,
}

const SENSOR: Configuration = Configuration::Sensor(SensorConfiguration::DEFAULT);
const DISPLAY: Configuration = Configuration::Display(DisplayConfiguration::DEFAULT);

/// When the gauges are asked for, and how long they stream in all: the longer of two requests.
const STREAM_NS: u64 = 1_000 * MS;
const STREAM_MS: u16 = 400;

fn questions() -> [(u64, Message); 2] {
    [
        (300 * MS, Message::Question(Question::Configuration)),
        (320 * MS, Message::Question(Question::Capabilities)),
    ]
}

/// Two that replace the same configuration.
fn changes(of: Configuration, first: Configuration, second: Configuration) -> [(u64, Message); 2] {
    [(1_900, first), (1_950, second)].map(|(at_ms, configuration)| {
        let replaces = Some(of.hash());
        let configure = Configure {
            replaces,
            configuration,
        };
        (at_ms * MS, Message::Configure(configure))
    })
}

fn sensor_with(waves: u8) -> Configuration {
    Configuration::Sensor(SensorConfiguration {
        waves,
        ..SensorConfiguration::DEFAULT
    })
}

fn display_with(glide_ms: u16) -> Configuration {
    Configuration::Display(DisplayConfiguration {
        glide_ms,
        ..DisplayConfiguration::DEFAULT
    })
}

static ASKED: LazyLock<Asked> = LazyLock::new(|| {
    let lease = |for_ms| Message::StreamGauges(StreamGauges { for_ms });
    let mut at_sensor = questions().to_vec();
    at_sensor.push((STREAM_NS, lease(STREAM_MS)));
    at_sensor.push((STREAM_NS + 20 * MS, lease(0)));
    at_sensor.push((STREAM_NS + 40 * MS, lease(100)));
    at_sensor.extend(changes(SENSOR, sensor_with(5), sensor_with(6)));
    let mut at_display = questions().to_vec();
    at_display.extend(changes(DISPLAY, display_with(30), display_with(40)));
    let (sensor, sensor_heard) = Host::following(&at_sensor);
    let (display, display_heard) = Host::following(&at_display);
    let terminals = Terminals {
        sensor: Some(sensor),
        display: Some(display),
    };
    let scene = scene("duration_s = 2.2\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n");
    let (recording, _) = hil_sim_boards::run_at(&scene, elves::both(), terminals)
        .unwrap_or_else(|error| panic!("{error}"));
    let heard = |heard: Heard| heard.lock().unwrap().clone();
    Asked {
        recording,
        sensor: heard(sensor_heard),
        display: heard(display_heard),
    }
});

fn reports(heard: &[(u64, Message)]) -> Vec<ConfigurationReport> {
    let reports = heard.iter().filter_map(|(_, message)| match message {
        Message::Configuration(report) => Some(*report),
        _ => None,
    });
    reports.collect()
}

#[test]
fn a_configuration_is_read_without_being_changed() {
    for (heard, own) in [(&ASKED.sensor, SENSOR), (&ASKED.display, DISPLAY)] {
        assert_eq!(reports(heard)[0], ConfigurationReport::of(own, None));
    }
}

#[test]
fn each_board_tells_what_it_can_do() {
    let capabilities = |heard: &[(u64, Message)]| -> Vec<Capabilities> {
        let capabilities = heard.iter().filter_map(|(_, message)| match message {
            Message::Capabilities(capabilities) => Some(*capabilities),
            _ => None,
        });
        capabilities.collect()
    };
    assert_eq!(
        capabilities(&ASKED.sensor),
        [firmware_sensor::capabilities::CAPABILITIES]
    );
    assert_eq!(
        capabilities(&ASKED.display),
        [firmware_display::capabilities::CAPABILITIES]
    );
}

#[test]
fn of_two_changes_of_the_same_configuration_the_second_is_refused_with_the_one_in_force() {
    for (heard, first) in [
        (&ASKED.sensor, sensor_with(5)),
        (&ASKED.display, display_with(30)),
    ] {
        let reports = reports(heard);
        assert_eq!(reports.len(), 3, "{reports:?}");
        assert_eq!(reports[1], ConfigurationReport::of(first, None));
        let refused = reports[2].refused.map(|refusal| refusal.setting);
        assert_eq!(refused, Some(Setting::Replaces));
        assert_eq!(reports[2].configuration, first);
    }
}

#[test]
fn gauges_stream_while_they_are_asked_for_and_no_estimator_starts_over_for_it() {
    let blocks: Vec<(u64, u32)> = ASKED
        .sensor
        .iter()
        .filter_map(|(at_ns, message)| match message {
            Message::Gauges(gauges) => Some((*at_ns, gauges.first_sample)),
            _ => None,
        })
        .collect();
    // Whole blocks of a while in ms, which is one of samples.
    assert_eq!(blocks.len(), usize::from(STREAM_MS) / GAUGE_BLOCK);
    let follows = |pair: &[(u64, u32)]| pair[1].1 == pair[0].1 + GAUGE_BLOCK as u32;
    assert!(blocks.windows(2).all(follows), "{blocks:?}");
    assert!(blocks[0].0 > STREAM_NS, "{blocks:?}");
    // An estimator that starts over has nothing to stand by; the change of the configuration, at 1.9 s, is one.
    let estimates = ASKED.recording.estimates.iter();
    let mut meanwhile = estimates.filter(|record| (500 * MS..1_890 * MS).contains(&record.made_ns));
    assert!(meanwhile.all(|record| record.estimate.valid));
}

#[test]
fn every_estimate_comes_once_and_in_its_turn_on_the_console() {
    let estimates: Vec<(u64, u32)> = ASKED
        .sensor
        .iter()
        .filter_map(|(at_ns, message)| match message {
            Message::Estimate(estimate) => Some((*at_ns, estimate.sequence)),
            _ => None,
        })
        .collect();
    let follows = |pair: &[(u64, u32)]| pair[1].1 == pair[0].1 + 1;
    assert!(estimates.windows(2).all(follows), "{estimates:?}");
    let (first, last) = (estimates[0], estimates[estimates.len() - 1]);
    // 100 Hz, but for what waits behind other frames.
    let span_ns = i64::from(last.1 - first.1) * 10_000_000;
    let off_ns = (last.0 - first.0) as i64 - span_ns;
    assert!(off_ns.abs() <= 5 * MS as i64, "{off_ns}");
    assert!(estimates.len() >= 190, "{}", estimates.len());
}

#[test]
fn a_configuration_outlives_a_crash_and_not_the_power() {
    let wanted = Configuration::Sensor(SensorConfiguration {
        waves: 5,
        arm_full_scale_um_s: 1_000_000,
        ..SensorConfiguration::DEFAULT
    });
    let script = [
        (300 * MS, Message::Configure(Configure::anyway(wanted))),
        (2_600 * MS, Message::Question(Question::Configuration)),
    ];
    for (fault, in_force) in [
        ("kind = \"sensor-panic\"", wanted),
        ("kind = \"sensor-hang\"", wanted),
        ("kind = \"sensor-brown-out\"", SENSOR),
    ] {
        let (sensor, heard) = Host::following(&script);
        let terminals = Terminals {
            sensor: Some(sensor),
            ..Terminals::default()
        };
        let surface = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]";
        let scene = scene(&format!(
            "duration_s = 3.0\n{surface}\n[[fault]]\nat_s = 0.6\n{fault}\n"
        ));
        let (recording, _) = hil_sim_boards::run_at(&scene, elves::both(), terminals)
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(recording.signs.resets.len(), 1, "{fault}");
        let reports = reports(&heard.lock().unwrap());
        let [asked, .., told] = reports[..] else {
            panic!("{fault}: {reports:?}");
        };
        assert_eq!(
            (asked.configuration, asked.refused),
            (wanted, None),
            "{fault}"
        );
        assert_eq!(told.configuration, in_force, "{fault}");
    }
}

/// What came of a board whose host says this, while a hand rubs at 50 mm/s, with `faults` in a scene's words.
fn told(role: Role, script: &[(u64, Message)], faults: &str) -> (Recording, Heard) {
    let (host, heard) = Host::following(script);
    let mut terminals = Terminals::default();
    match role {
        Role::Sensor => terminals.sensor = Some(host),
        _ => terminals.display = Some(host),
    }
    let surface = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]";
    let motion = "[motion]\nkind = \"constant\"\nspeed_mm_s = 50.0";
    let scene = scene(&format!(
        "duration_s = 2.2\n{surface}\n{motion}\n{faults}\n"
    ));
    let (recording, _) = hil_sim_boards::run_at(&scene, elves::both(), terminals)
        .unwrap_or_else(|error| panic!("{error}"));
    (recording, heard)
}

/// The states that a display's supervisor told of, and when, in ns.
fn states(recording: &Recording) -> Vec<(u64, DisplayState)> {
    let said = recording.signs.display.iter();
    said.filter_map(|said| match said.message {
        Message::Safety(safety) => Some((said.at_ns, safety.state)),
        _ => None,
    })
    .collect()
}

#[test]
fn a_host_that_configures_without_a_pause_puts_off_no_look_into_the_converters() {
    let script: Vec<_> = (1_000..1_500)
        .map(|at_ms| (at_ms * MS, Message::Configure(Configure::anyway(DISPLAY))))
        .collect();
    let lost = "[[fault]]\nat_s = 1.2\nkind = \"dac-power-lost\"";
    let (recording, heard) = told(Role::Display, &script, lost);
    assert!(reports(&heard.lock().unwrap()).len() > 300);
    let states = states(&recording);
    let (at_ns, last) = states[states.len() - 1];
    assert_eq!(last, DisplayState::Stopped(Trip::Converter), "{states:?}");
    // What a look finds within 16 ms, and what waits on the wire.
    assert!(at_ns < 1_220 * MS, "{at_ns}");
}

#[test]
fn a_host_that_asks_without_a_pause_holds_nothing_up() {
    // 92 bytes a millisecond are nine questions.
    let script: Vec<_> = (1_000..1_500)
        .flat_map(|at_ms| [at_ms * MS; 9])
        .map(|at_ns| (at_ns, Message::Question(Question::Configuration)))
        .collect();
    let (recording, heard) = told(Role::Display, &script, "");
    assert!(reports(&heard.lock().unwrap()).len() > 100);
    let last = states(&recording).pop().map(|(_, state)| state);
    assert_eq!(last, Some(DisplayState::Driving));
    let Some(RoleCounters::Display(counters)) = recording.display_status.map(|told| told.role)
    else {
        panic!("no status of the display");
    };
    assert_eq!(counters.unheard, 0);

    let (_, heard) = told(Role::Sensor, &script, "");
    let heard = heard.lock().unwrap();
    assert!(reports(&heard).len() > 100);
    let estimates = heard.iter().filter(|(at_ns, message)| {
        (1_010 * MS..1_510 * MS).contains(at_ns) && matches!(message, Message::Estimate(_))
    });
    assert_eq!(estimates.count(), 50);
}
