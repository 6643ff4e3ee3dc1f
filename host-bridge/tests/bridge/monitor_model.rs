//! What the monitor knows, and what it has said to the boards.

use firmware_display::{Display, Senses, Settings, ZERO_VOLT};
use host_bridge::link::Event;
use host_bridge::monitor::dashboard::Dashboard;
use host_bridge::monitor::fingertip::Fingertip;
use host_bridge::monitor::log_entry::LogEvent;
use host_bridge::monitor::orders::{Change, Orders, Outcome};
use host_bridge::monitor::settings::{self, Kind};
use host_bridge::monitor::trace::{Trace, column_us};
use host_bridge::state::State;
use protocol::actuators::{self, ACTUATORS, Actuator, DEFAULT_ACTUATORS, grid};
use protocol::{
    Arm, ArmState, Configuration, ConfigurationReport, Configure, Contact, DisplayConfiguration,
    DisplayState, Estimate, GAUGES, GaugeHealth, Hello, Message, Mode, PortCounters, Question,
    Range, Refusal, ResetCause, Role, RoleCounters, Safety, SensorConfiguration, SensorCounters,
    Setting, Status, Stopped, Trip,
};

fn connected() -> Dashboard {
    let mut dashboard = Dashboard::default();
    for role in [Role::Sensor, Role::Display] {
        let state = State::Known(
            "/dev/tty".into(),
            Hello::new(role, "stm32f429zi", [0, 1, 0]),
        );
        dashboard.on(0, role, Event::StateChanged(state));
    }
    dashboard
}

/// A board's word on its configuration.
fn report(configuration: Configuration, refused: Option<Setting>) -> ConfigurationReport {
    ConfigurationReport {
        refused: refused.map(|setting| Refusal {
            setting,
            index: 0,
            low: 1,
            high: 2,
        }),
        hash: configuration.hash(),
        configuration,
    }
}

/// What a board says of its configuration.
fn says(dashboard: &mut Dashboard, configuration: Configuration, refused: Option<Setting>) {
    let role = match configuration {
        Configuration::Sensor(_) => Role::Sensor,
        Configuration::Display(_) => Role::Display,
    };
    let message = Message::Configuration(report(configuration, refused));
    let at_us = dashboard.now_us;
    dashboard.on(at_us, role, Event::Heard { at_us, message });
}

#[test]
fn each_board_is_asked_for_its_configuration_until_it_answers() {
    let mut dashboard = connected();
    dashboard.elapse(1);
    let asks = vec![Message::Question(Question::Configuration)];
    assert_eq!(dashboard.take_outbox(Role::Sensor), asks);
    assert_eq!(dashboard.take_outbox(Role::Display), asks);
    dashboard.elapse(100_000);
    assert_eq!(dashboard.take_outbox(Role::Sensor), []);
    dashboard.elapse(400_000);
    assert_eq!(dashboard.take_outbox(Role::Sensor), asks);
    let own = Configuration::Sensor(SensorConfiguration {
        window_ms: 77,
        ..SensorConfiguration::DEFAULT
    });
    says(&mut dashboard, own, Some(Setting::Role));
    assert_eq!(dashboard.sensor.configuration, Some(own));
    dashboard.elapse(9_000_000);
    assert_eq!(dashboard.take_outbox(Role::Sensor), []);
}

#[test]
fn watching_gauges_changes_no_configuration() {
    let mut dashboard = connected();
    dashboard.elapse(1);
    dashboard.take_outbox(Role::Sensor);
    for streams in [true, false] {
        dashboard.toggle_gauges();
        assert_eq!(dashboard.streams, streams);
        dashboard.elapse(2);
        assert_eq!(dashboard.take_outbox(Role::Sensor), []);
    }
}

#[test]
fn a_change_is_made_of_what_is_in_force_and_again_if_another_comes_in_between() {
    let mut dashboard = connected();
    let setting = &settings::SENSOR[4];
    assert_eq!(setting.name, "waves");
    dashboard.change(Role::Sensor, setting, "5");
    dashboard.elapse(1);
    assert_eq!(
        dashboard.take_outbox(Role::Sensor),
        [Message::Question(Question::Configuration)]
    );
    let with = |window_ms, waves| {
        Configuration::Sensor(SensorConfiguration {
            window_ms,
            waves,
            ..SensorConfiguration::DEFAULT
        })
    };
    let change = |from: Configuration, to| {
        Message::Configure(Configure {
            replaces: Some(from.hash()),
            configuration: to,
        })
    };
    says(&mut dashboard, with(80, 8), None);
    let first = change(with(80, 8), with(80, 5));
    assert_eq!(dashboard.take_outbox(Role::Sensor), [first]);
    // Somebody else has set the window meanwhile.
    says(&mut dashboard, with(120, 8), Some(Setting::Replaces));
    let second = change(with(120, 8), with(120, 5));
    assert_eq!(dashboard.take_outbox(Role::Sensor), [second]);
    assert_eq!(dashboard.outcome, None);
    says(&mut dashboard, with(120, 5), None);
    assert_eq!(
        dashboard.outcome,
        Some(Outcome::Taken(vec![("waves", "5 λ".to_owned())]))
    );
}

/// Several settings and a description of the actuators, on their way to a display.
fn described() -> (Orders, [Actuator; ACTUATORS]) {
    let named = |name| {
        let mut all = settings::DISPLAY.iter();
        all.find(|setting| setting.name == name).expect(name)
    };
    let mut actuators = grid(1_200);
    actuators[31].inverted = true;
    let mut orders = Orders::default();
    let change = Change {
        settings: vec![
            (named("amplitude_mv"), "1000".to_owned()),
            (named("mode"), "travelling".to_owned()),
        ],
        actuators: Some(Box::new(actuators)),
    };
    orders.change(change, 0);
    orders.elapse(0, true);
    let asks = [Message::Question(Question::Configuration)];
    assert_eq!(orders.take(), asks);
    (orders, actuators)
}

#[test]
fn settings_and_a_description_of_the_actuators_are_one_change() {
    let (mut orders, described) = described();
    let before = DisplayConfiguration::DEFAULT;
    let after = DisplayConfiguration {
        amplitude_mv: 1_000,
        mode: Mode::Travelling,
        actuators: actuators::hash(&described),
        ..before
    };
    let own = Configuration::Display(before);
    assert_eq!(orders.on_report(1, &report(own, None)), None);
    let said = orders.take();
    // The display takes them, as they are said, and has then what was described.
    let mut display =
        Settings::new(DisplayConfiguration::DEFAULT, &DEFAULT_ACTUATORS).expect("in its ranges");
    let mut answers = Vec::new();
    for message in said {
        match message {
            Message::Actuators(block) => answers.extend(display.on_actuators(&block)),
            Message::Configure(configure) => {
                answers.push(display.on_configure(&configure));
            }
            message => panic!("{message:?}"),
        }
    }
    let after = Configuration::Display(after);
    assert_eq!(answers, [report(after, None)]);
    assert_eq!(*display.actuators(), described);
    let taken = vec![
        ("amplitude_mv", "1000 mV".to_owned()),
        ("mode", "travelling".to_owned()),
    ];
    let outcome = orders.on_report(2, &answers[0]);
    assert_eq!(outcome, Some(Outcome::Taken(taken)));
}

/// The same, sent to a display with its own settings at 1 ms, and overdue.
fn overdue() -> (Orders, Configuration) {
    let (mut orders, _) = described();
    let own = Configuration::Display(DisplayConfiguration::DEFAULT);
    assert_eq!(orders.on_report(1_000, &report(own, None)), None);
    let sent = match orders.take().last() {
        Some(Message::Configure(configure)) => configure.configuration,
        last => panic!("{last:?}"),
    };
    assert_eq!(orders.elapse(300_999, true), None);
    assert_eq!(orders.take(), []);
    assert_eq!(orders.elapse(301_000, true), None);
    let asks = [Message::Question(Question::Configuration)];
    assert_eq!(orders.take(), asks);
    (orders, sent)
}

#[test]
fn a_change_that_was_not_heard_is_made_again() {
    let (mut orders, sent) = overdue();
    let own = report(Configuration::Display(DisplayConfiguration::DEFAULT), None);
    assert_eq!(orders.on_report(302_000, &own), None);
    let again = orders.take();
    let last = Message::Configure(Configure {
        replaces: Some(own.hash),
        configuration: sent,
    });
    assert_eq!((again.len(), again.last()), (6, Some(&last)));
    let outcome = orders.on_report(303_000, &report(sent, None));
    assert!(matches!(outcome, Some(Outcome::Taken(_))), "{outcome:?}");
    assert_eq!(orders.elapse(3_000_000, true), None);
}

#[test]
fn a_change_whose_answer_was_lost_or_is_late_is_made_once() {
    let (mut orders, sent) = overdue();
    let outcome = orders.on_report(302_000, &report(sent, None));
    assert!(matches!(outcome, Some(Outcome::Taken(_))), "{outcome:?}");
    let (mut orders, _) = overdue();
    let own = Configuration::Display(DisplayConfiguration::DEFAULT);
    let late = orders.on_report(302_000, &report(own, Some(Setting::Rendering)));
    assert!(matches!(late, Some(Outcome::Refused(_))), "{late:?}");
    assert_eq!(orders.take(), []);
}

#[test]
fn a_description_of_which_a_part_was_lost_is_sent_again_but_not_at_once() {
    let (mut orders, described) = described();
    let own = Configuration::Display(DisplayConfiguration::DEFAULT);
    assert_eq!(orders.on_report(1_000, &report(own, None)), None);
    assert_eq!(orders.take().len(), 6);
    for at_us in [2_000, 3_000] {
        let part = report(own, Some(Setting::Actuators));
        assert_eq!(orders.on_report(at_us, &part), None);
        assert_eq!(orders.take(), []);
    }
    // Each description has a time of its own, so that two programs do not meet again.
    let asked = (0..1_000_000).step_by(1_000).find(|now_us| {
        assert_eq!(orders.elapse(*now_us, true), None);
        !orders.take().is_empty()
    });
    let spread_us = u64::from(actuators::hash(&described) % 500) * 1_000;
    assert_eq!(asked, Some(302_000 + spread_us));
    assert_eq!(orders.on_report(900_000, &report(own, None)), None);
    let again = orders.take();
    assert_eq!(again.len(), 6);
    let Some(Message::Configure(Configure { configuration, .. })) = again.last() else {
        panic!("{again:?}");
    };
    let outcome = orders.on_report(904_000, &report(*configuration, None));
    assert!(matches!(outcome, Some(Outcome::Taken(_))), "{outcome:?}");
}

#[test]
fn what_was_refused_to_another_program_is_not_taken_for_ones_own() {
    let own = Configuration::Display(DisplayConfiguration::DEFAULT);
    // The range of the report is 1 to 2: 1 000 mV are beyond it, a mode is no number.
    for (setting, is_own) in [
        (Setting::Role, false),
        (Setting::GlideMs, false),
        (Setting::ActuatorsFirst, false),
        (Setting::AmplitudeMv, true),
        (Setting::Rendering, true),
        (Setting::ActuatorX, true),
        (Setting::ActuatorResonance, true),
    ] {
        let (mut orders, sent) = overdue();
        let refusal = report(own, Some(setting));
        let outcome = orders.on_report(302_000, &refusal);
        let expected = refusal.refused.filter(|_| is_own).map(Outcome::Refused);
        assert_eq!(outcome, expected, "{setting:?}");
        let outcome = orders.on_report(303_000, &report(sent, None));
        assert_eq!(outcome.is_some(), !is_own, "{setting:?}");
    }
    // Where nothing else comes it is not known.
    let (mut orders, _) = overdue();
    orders.on_report(302_000, &report(own, Some(Setting::GlideMs)));
    assert_eq!(orders.elapse(2_000_000, true), Some(Outcome::Unanswered));
}

/// Many at one board: each hears what is said to all of them.
#[test]
fn a_change_is_made_again_once_for_each_that_came_in_between() {
    let (mut orders, _) = overdue();
    let of = |glide_ms| {
        Configuration::Display(DisplayConfiguration {
            glide_ms,
            ..DisplayConfiguration::DEFAULT
        })
    };
    // Refused to somebody else, who did not know what is in force.
    let known = report(of(20), Some(Setting::Replaces));
    assert_eq!(orders.on_report(302_000, &known), None);
    assert_eq!(orders.take(), []);
    for glide_ms in [30, 40] {
        let newer = report(of(glide_ms), Some(Setting::Replaces));
        for (at_us, frames) in [(303_000, 6), (304_000, 0), (305_000, 0)] {
            assert_eq!(orders.on_report(at_us, &newer), None);
            assert_eq!(orders.take().len(), frames, "{glide_ms}");
        }
    }
}

#[test]
fn an_answer_that_comes_after_all_is_one() {
    let (mut orders, sent) = overdue();
    assert_eq!(orders.elapse(2_000_000, true), Some(Outcome::Unanswered));
    orders.take();
    let change = Change {
        settings: vec![(&settings::DISPLAY[7], "1000".to_owned())],
        actuators: None,
    };
    orders.change(change, 2_000_000);
    let outcome = orders.on_report(2_100_000, &report(sent, None));
    let taken = vec![("amplitude_mv", "1000 mV".to_owned())];
    assert_eq!(outcome, Some(Outcome::Taken(taken)));
    assert_eq!(orders.take(), []);
}

#[test]
fn a_refusal_is_shown_by_name_and_range() {
    let mut dashboard = connected();
    let setting = &settings::DISPLAY[7];
    assert_eq!(setting.name, "amplitude_mv");
    dashboard.change(Role::Display, setting, "6000");
    dashboard.elapse(1);
    let own = Configuration::Display(DisplayConfiguration::DEFAULT);
    says(&mut dashboard, own, Some(Setting::Role));
    dashboard.take_outbox(Role::Display);
    says(&mut dashboard, own, Some(Setting::AmplitudeMv));
    let notice = dashboard.notice().expect("it was refused");
    assert!(notice.is_bad);
    assert_eq!(
        notice.text,
        "display: refused: amplitude_mv is out of range: give 1 to 2"
    );
}

#[test]
fn a_change_that_is_not_answered_is_given_up() {
    let mut dashboard = connected();
    dashboard.change(Role::Display, &settings::DISPLAY[0], "travelling");
    dashboard.elapse(1_999_000);
    assert_eq!(dashboard.outcome, None);
    dashboard.elapse(2_000_000);
    assert_eq!(dashboard.outcome, Some(Outcome::Unanswered));
}

#[test]
fn a_stop_is_over_when_every_board_has_answered_and_is_called_unanswered_until_then() {
    let mut dashboard = connected();
    dashboard.linked = vec![Role::Sensor, Role::Display];
    dashboard.stop();
    let text = |dashboard: &Dashboard| dashboard.notice().expect("it is told").text.clone();
    assert_eq!(text(&dashboard), "stop: sent, not confirmed yet");
    let stopped = |dashboard: &mut Dashboard, role: Role| {
        let message = Message::Stopped(Stopped::by(Trip::Operator));
        dashboard.on(10, role, Event::Heard { at_us: 10, message });
    };
    stopped(&mut dashboard, Role::Display);
    assert_eq!(text(&dashboard), "stop: confirmed by the display");
    dashboard.elapse(500_000);
    let words = text(&dashboard);
    assert!(
        words.starts_with("NOT STOPPED: sensor: no answer"),
        "{words}"
    );
    stopped(&mut dashboard, Role::Sensor);
    let all = "stop: confirmed by the sensor and the display";
    assert_eq!(text(&dashboard), all);
    dashboard.elapse(2_000_000);
    assert_eq!(text(&dashboard), all);
}

#[test]
fn a_stop_is_confirmed_by_whoever_answers_and_not_by_whose_port_it_was_to_be() {
    let mut dashboard = connected();
    dashboard.linked = vec![Role::Sensor, Role::Display];
    let stranger = State::Stranger {
        port: "/dev/tty".into(),
        hello: Hello::new(Role::Display, "stm32f429zi", [0, 1, 0]),
        wanted: Role::Sensor,
    };
    dashboard.on(1, Role::Sensor, Event::StateChanged(stranger));
    dashboard.stop();
    let message = Message::Stopped(Stopped::by(Trip::Operator));
    dashboard.on(10, Role::Sensor, Event::Heard { at_us: 10, message });
    let text = |dashboard: &Dashboard| dashboard.notice().expect("it is told").text.clone();
    assert_eq!(text(&dashboard), "stop: confirmed by the display");
    dashboard.elapse(600_000);
    let words = text(&dashboard);
    assert!(words.starts_with("NOT STOPPED: sensor: "), "{words}");
}

#[test]
fn for_an_arm_that_has_not_stopped_the_emergency_stop_is_no_advice() {
    let mut dashboard = connected();
    dashboard.linked = vec![Role::Sensor, Role::Display];
    dashboard.stop();
    dashboard.elapse(500_000);
    let text = |dashboard: &Dashboard| dashboard.notice().expect("it is told").text.clone();
    let none = "NOT STOPPED: sensor and display: no answer, told again: ";
    let both = "cut the power of the arm's drive and press the emergency stop";
    assert_eq!(text(&dashboard), format!("{none}{both}"));
    let message = Message::Stopped(Stopped::by(Trip::Operator));
    let stopped = Event::Heard { at_us: 10, message };
    dashboard.on(10, Role::Display, stopped);
    dashboard.elapse(600_000);
    let arm = "NOT STOPPED: sensor: no answer, told again: cut the power of the arm's drive";
    assert_eq!(text(&dashboard), arm);
}

#[test]
fn a_stop_that_has_no_way_to_any_board_is_called_so() {
    let mut dashboard = connected();
    dashboard.stop();
    let notice = dashboard.notice().expect("it is told");
    assert!(notice.is_bad && notice.text.starts_with("NOT STOPPED: there is no way"));
}

#[test]
fn each_change_of_the_supervisor_happens_once() {
    let mut dashboard = connected();
    dashboard.take_log_entries();
    for state in [
        DisplayState::Ready,
        DisplayState::Driving,
        DisplayState::Driving,
        DisplayState::Ready,
    ] {
        let message = Message::Safety(Safety {
            instant_us: 0,
            state,
        });
        dashboard.on(5, Role::Display, Event::Heard { at_us: 5, message });
    }
    let told: Vec<LogEvent> = dashboard
        .take_log_entries()
        .into_iter()
        .map(|log_entry| log_entry.what)
        .collect();
    assert_eq!(
        told,
        [
            LogEvent::Safety(DisplayState::Ready),
            LogEvent::Safety(DisplayState::Driving),
            LogEvent::Safety(DisplayState::Ready),
        ]
    );
}

#[test]
fn an_arm_that_stops_happens_once_for_each_start_of_its_board() {
    let mut dashboard = connected();
    dashboard.take_log_entries();
    let arm = |state| {
        Message::Arm(Arm {
            instant_us: 0,
            state,
        })
    };
    let status = |stopped| {
        Message::Status(Status {
            uptime_us: 0,
            reset: ResetCause::Watchdog,
            watchdog_resets: 1,
            stack_free_bytes: 0,
            peer: PortCounters::new(),
            console: PortCounters::new(),
            role: RoleCounters::Sensor(SensorCounters {
                stopped,
                ..SensorCounters::ZERO
            }),
        })
    };
    let mut hear = |events: Vec<Event>| -> (Vec<LogEvent>, Option<Trip>) {
        for event in events {
            dashboard.on(5, Role::Sensor, event);
        }
        let told = dashboard.take_log_entries().into_iter();
        (
            told.map(|log_entry| log_entry.what).collect(),
            dashboard.sensor.arm_stopped,
        )
    };
    let heard = |message| Event::Heard { at_us: 5, message };
    let trip = Trip::Operator;
    let stopped = LogEvent::ArmStopped(trip);
    assert_eq!(stopped.to_string(), "arm stopped: by the operator");
    let told = hear(vec![
        heard(arm(ArmState::Following)),
        heard(arm(ArmState::Stopped(trip))),
        heard(status(Some(trip))),
    ]);
    assert_eq!(told, (vec![stopped.clone()], Some(trip)));
    // Its watchdog's reset leaves it stopped.
    let told = hear(vec![Event::Restarted, heard(status(Some(trip)))]);
    assert_eq!(told, (vec![LogEvent::Restarted, stopped], Some(trip)));
    let told = hear(vec![Event::Restarted]);
    assert_eq!(told, (vec![LogEvent::Restarted], None));
    assert_eq!(hear(vec![heard(status(None))]), (vec![], None));
}

#[test]
fn every_setting_takes_its_own_value_back_and_names_its_range() {
    for (role, configuration) in [
        (
            Role::Sensor,
            Configuration::Sensor(SensorConfiguration::DEFAULT),
        ),
        (
            Role::Display,
            Configuration::Display(DisplayConfiguration::DEFAULT),
        ),
    ] {
        for setting in settings::of(role) {
            let value = setting.value(&configuration).expect("it is this board's");
            assert_eq!(setting.changed(configuration, &value), Ok(configuration));
            let wanted = setting.wanted(&configuration);
            match setting.kind {
                Kind::Number => assert!(wanted.contains(" to "), "{}: {wanted}", setting.name),
                Kind::Gauges => assert_eq!(wanted, "some of 01234"),
                Kind::Choice(words) => {
                    for (word, _) in words {
                        let changed = setting.changed(configuration, word).expect("a word of it");
                        assert_eq!(setting.value(&changed).as_deref(), Some(*word));
                    }
                }
            }
            let misread = setting.changed(configuration, "xyz").expect_err("no value");
            assert!(misread.to_string().contains(setting.name), "{misread}");
        }
    }
}

#[test]
fn a_trace_loses_no_spike_whatever_the_columns() {
    let mut trace = Trace::default();
    for ms in 0..10_000_u64 {
        let value = if ms == 5_003 { 9.0 } else { 1.0 };
        trace.put(ms * 1_000, value);
    }
    for count in [10, 77, 300] {
        let column_us = column_us(9.0, count);
        let columns: Vec<_> = trace.columns(9_999_000, column_us, count).collect();
        let highest = columns.iter().flatten().map(|extent| extent.high);
        assert_eq!(highest.fold(0.0, f32::max), 9.0, "{count} columns");
        assert!(columns.iter().filter(|column| column.is_none()).count() <= 1);
    }
}

#[test]
fn a_trace_shows_a_gap_where_nothing_came_and_forgets_what_is_too_old() {
    let mut trace = Trace::default();
    trace.put(1_000_000, 1.0);
    trace.put(3_000_000, 2.0);
    let columns: Vec<bool> = trace
        .columns(3_100_000, 100_000, 22)
        .map(|column| column.is_some())
        .collect();
    let mut expected = [false; 22];
    expected[1] = true;
    expected[21] = true;
    // The first value is at 1.0 s, of which the columns begin at 0.9 s.
    assert_eq!(columns.len(), expected.len());
    assert_eq!(
        columns.iter().filter(|column| **column).count(),
        2,
        "{columns:?}"
    );
    trace.put(60_000_000, 3.0);
    assert_eq!(trace.extent(0, 50_000_000), None);
    // What comes late is not put where something newer is.
    trace.put(1_000_000, 5.0);
    assert_eq!(
        trace.extent(0, u64::MAX / 2).map(|extent| extent.high),
        Some(3.0)
    );
}

/// The firmware's own display and the monitor's fingertip, fed alike, agree on every actuator's peak.
#[test]
fn the_fingertip_is_as_the_firmware_drives_it() {
    let description = grid(900);
    for mode in [Mode::Uniform, Mode::Travelling] {
        let configuration = DisplayConfiguration {
            mode,
            amplitude_mv: 4_000,
            actuators: actuators::hash(&description),
            ..DisplayConfiguration::DEFAULT
        };
        let settings = Settings::new(configuration, &description).expect("in its ranges");
        let mut display = Display::new(&settings, None);
        display.started(Ok(()));
        let mut fingertip = Fingertip::default();
        fingertip.configure(&configuration);
        let mut peaks_v = [0.0_f32; 50];
        let mut told = None;
        // 2 s at 35 mm/s, of which the last 50 ms are looked at.
        for tick in 1..=4_000_u32 {
            if tick % 20 == 1 {
                let estimate = estimate(tick / 20);
                display.on_estimate(&estimate);
                fingertip.hear(&estimate);
            }
            display.tick((tick * 7 / 2) as u16, &Senses::default());
            if told != Some(display.state()) {
                told = Some(display.state());
                fingertip.turn(told);
            }
            if let Some(motion) = display.motion(u64::from(tick) * 500) {
                fingertip.follow(&motion);
            }
            if tick > 3_900 {
                for (peak_v, word) in peaks_v.iter_mut().zip(display.words()) {
                    let volt = f32::from(word.abs_diff(ZERO_VOLT)) * 10.0 / 65_536.0;
                    *peak_v = peak_v.max(volt);
                }
            }
        }
        assert_eq!(display.state(), DisplayState::Driving);
        for (theirs, ours) in peaks_v.iter().zip(fingertip.peaks_v()) {
            // Peaks of 50 ms at 17.5 Hz hold a crest, of which a tick may miss 1 − cos(π · 17.5/2000).
            assert!(
                (theirs - ours).abs() < 0.01,
                "{mode:?}: {theirs} V, {ours} V"
            );
            assert!((3.9..=4.0).contains(theirs), "{theirs} V");
        }
    }
}

fn estimate(sequence: u32) -> Estimate {
    Estimate {
        sequence,
        instant_us: u64::from(sequence) * 10_000,
        wavelength_mm: Some(2.0),
        valid: true,
        confidence: 1.0,
        amplitude_lsb: 100.0,
        counted_mm: None,
        range: Range::T1,
        contact: Contact::Slip,
        velocity_um_s: 35_000,
        lag_um: None,
        gauges_used: 1,
        health: [GaugeHealth::Good; GAUGES],
    }
}
