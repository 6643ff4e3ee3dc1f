//! The monitor's dashboard as it is drawn, at fixed inputs.

mod sizes;

use host_bridge::link::{Clocks, Event};
use host_bridge::monitor::dashboard::Dashboard;
use host_bridge::monitor::draw::draw;
use host_bridge::monitor::theme::Theme;
use host_bridge::monitor::view::Form;
use host_bridge::monitor::view::{Panel, View};
use host_bridge::state::State;
use protocol::{
    Configuration, ConfigurationReport, Contact, DisplayConfiguration, DisplayCounters,
    DisplayState, Estimate, GAUGE_BLOCK, GAUGES, GaugeHealth, GaugeSample, Gauges, Hello, Message,
    Motion, PortCounters, Range, ResetCause, Role, RoleCounters, SensorCounters, Status, Trip,
};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::style::Color;

/// A while after the start, in µs.
const NOW_US: u64 = 20_000_000;

fn known(role: Role) -> Event {
    Event::StateChanged(State::Known(
        format!("/dev/tty-{}", role.name()).into(),
        Hello::new(role, "stm32f429zi", [0, 1, 0]),
    ))
}

fn heard(at_us: u64, message: Message) -> Event {
    Event::Heard { at_us, message }
}

fn estimate(sequence: u32) -> Estimate {
    let mut health = [GaugeHealth::Good; GAUGES];
    health[4] = GaugeHealth::Hum;
    Estimate {
        sequence,
        instant_us: u64::from(sequence) * 10_000,
        wavelength_mm: Some(2.0),
        valid: true,
        confidence: 0.93,
        amplitude_lsb: 103.0,
        counted_mm: Some(2.4),
        range: Range::T1,
        contact: Contact::Slip,
        velocity_um_s: 69_500,
        lag_um: None,
        gauges_used: 0b0_1111,
        health,
    }
}

fn status(role: RoleCounters) -> Status {
    Status {
        uptime_us: 61_000_000,
        reset: ResetCause::Watchdog,
        watchdog_resets: 2,
        stack_free_bytes: 0,
        peer: PortCounters {
            sent: 1_234_567,
            lost: 3,
            ..PortCounters::new()
        },
        console: PortCounters::new(),
        role,
    }
}

/// Both boards, a hand at 70 mm/s, everything streaming for 10 s.
fn busy(state: DisplayState) -> Dashboard {
    let mut dashboard = Dashboard::default();
    dashboard.on(0, Role::Sensor, known(Role::Sensor));
    dashboard.on(0, Role::Display, known(Role::Display));
    let clocks = Clocks {
        offset_us: 0,
        round_trip_us: 350,
    };
    for role in [Role::Sensor, Role::Display] {
        dashboard.on_line(role, PortCounters::new(), Some(clocks));
    }
    let display = RoleCounters::Display(DisplayCounters {
        state,
        ..DisplayCounters::ZERO
    });
    let sensor = RoleCounters::Sensor(SensorCounters::ZERO);
    let begin_us = NOW_US - 10_000_000;
    let configuration = Configuration::Display(DisplayConfiguration::DEFAULT);
    for message in [
        Message::Status(status(display)),
        Message::Configuration(ConfigurationReport {
            refused: None,
            hash: configuration.hash(),
            configuration,
        }),
    ] {
        dashboard.on(begin_us, Role::Display, heard(begin_us, message));
    }
    let message = Message::Status(status(sensor));
    dashboard.on(begin_us, Role::Sensor, heard(begin_us, message));
    for ms in (0..10_000_u64).step_by(2) {
        let at_us = begin_us + ms * 1_000;
        if ms.is_multiple_of(10) {
            let estimate = estimate((at_us / 10_000) as u32);
            dashboard.on(
                at_us,
                Role::Sensor,
                heard(at_us, Message::Estimate(estimate)),
            );
        }
        let motion = Motion {
            sequence: (ms / 2) as u32,
            instant_us: at_us,
            position_um: 70 * ms as i64 / 5 * 5,
            velocity_um_s: 70_000,
        };
        dashboard.on(at_us, Role::Display, heard(at_us, Message::Motion(motion)));
        if ms.is_multiple_of(8) {
            let sample = GaugeSample {
                codes: std::array::from_fn(|gauge| {
                    let lsb = if ms.is_multiple_of(16) { 100.0 } else { -100.0 };
                    (32_768.0 + 16.0 * lsb / (gauge + 1) as f64) as u16
                }),
                ..GaugeSample::default()
            };
            let block = Gauges {
                first_sample: ms as u32,
                instant_us: at_us,
                position_um: 0,
                samples: [sample; GAUGE_BLOCK],
            };
            dashboard.on(at_us, Role::Sensor, heard(at_us, Message::Gauges(block)));
        }
    }
    dashboard.elapse(NOW_US - 1_000);
    dashboard
}

fn view() -> View {
    View::new(Theme::PLAIN)
}

fn picture(dashboard: &Dashboard, view: &View, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("no I/O");
    terminal
        .draw(|frame| draw(frame, dashboard, dashboard, view))
        .expect("no I/O");
    let buffer = terminal.backend().buffer();
    (0..height)
        .map(|y| {
            let line: String = (0..width).map(|x| buffer[(x, y)].symbol()).collect();
            line.trim_end().to_owned()
        })
        .collect()
}

fn assert_has(picture: &[String], words: &str) {
    assert!(
        picture.iter().any(|line| line.contains(words)),
        "{words:?} is not in\n{}",
        picture.join("\n")
    );
}

#[test]
fn the_header_says_how_both_boards_and_the_supervisor_are() {
    let picture = picture(&busy(DisplayState::Driving), &view(), 120, 40);
    assert_eq!(
        picture[..3],
        [
            " sensor  ● /dev/tty-sensor  rtt 350 µs  clock +0.0000 s  up 0:01:10  misses 0  watchdog 2  by watchdog  0.1.0",
            " display ● /dev/tty-display  rtt 350 µs  clock +0.0000 s  up 0:01:10  misses 0  watchdog 2  by watchdog  0.1.0",
            " DRIVING  for 10.0 s",
        ]
    );
}

#[test]
fn a_stop_fills_its_line_and_says_what_ends_it() {
    let stopped = busy(DisplayState::Stopped(Trip::EmergencyStop));
    let picture = picture(&stopped, &view(), 80, 24);
    assert_eq!(
        picture[2],
        " STOPPED: EMERGENCY STOP, 0 V until the display board's reset button or power"
    );
}

#[test]
fn the_surface_is_told_in_numbers_three_rows_high_and_in_words() {
    let picture = picture(&busy(DisplayState::Driving), &view(), 80, 24);
    let surface: Vec<&str> = picture[4..10]
        .iter()
        .map(|line| {
            line.get(..line.char_indices().nth(35).map_or(line.len(), |(at, _)| at))
                .unwrap_or_default()
                .trim_end()
        })
        .collect();
    assert_eq!(
        surface,
        [
            "   ▀▀█   █▀█ █▀█",
            "   █▀▀   █ █ █ █",
            " λ ▀▀▀ ▀ ▀▀▀ ▀▀▀ mm  103 LSB",
            " confidence ━━━━━━━━━━━━━─ 0.93",
            " valid   contact slip",
            " paper's count 2.40 mm   range T1",
        ]
    );
}

#[test]
fn fifty_places_show_the_volts_that_the_firmware_computes() {
    let picture = picture(&busy(DisplayState::Driving), &view(), 80, 24);
    assert_has(&picture, "fingertip  peak V, computed");
    let rows = picture
        .iter()
        .filter(|line| line.starts_with("  5  5  5  5  5  5  5  5  5  5"))
        .count();
    assert_eq!(rows, 5, "{}", picture.join("\n"));
    assert_has(&picture, "uniform");
}

#[test]
fn a_display_that_does_not_drive_shows_no_voltage() {
    for state in [
        DisplayState::Boot,
        DisplayState::Ready,
        DisplayState::Stopped(Trip::Operator),
    ] {
        let picture = picture(&busy(state), &view(), 80, 24);
        let rows = picture
            .iter()
            .filter(|line| line.starts_with("  0  0  0  0  0  0  0  0  0  0"))
            .count();
        assert_eq!(rows, 5, "{state}\n{}", picture.join("\n"));
    }
}

#[test]
fn every_panel_can_be_had_on_eighty_by_twenty_four() {
    let dashboard = busy(DisplayState::Driving);
    let mut view = view();
    for (panel, words) in [
        (Panel::Gauges, "4 hum unused"),
        (Panel::Ports, " sensor peer      1234 k       0       3"),
        (Panel::Boards, " display   rtt 350 µs"),
        (Panel::Log, " display driving"),
    ] {
        assert_eq!(view.panel, panel);
        assert_has(&picture(&dashboard, &view, 80, 24), words);
        view.panel = view.panel.next();
    }
    assert_eq!(view.panel, Panel::Gauges);
}

#[test]
fn a_tall_terminal_shows_all_panels_at_once() {
    let picture = picture(&busy(DisplayState::Driving), &view(), 120, 40);
    for words in [
        "surface",
        "fingertip",
        "gauges",
        "ports",
        "log",
        "λ  mm",
        "v  mm/s",
    ] {
        assert_has(&picture, &format!("─ {words}"));
    }
    assert_has(
        &picture,
        " s stop  c configure  r record  g gauges  f freeze",
    );
}

#[test]
fn a_constant_is_a_straight_line_between_round_numbers() {
    let picture = picture(&busy(DisplayState::Driving), &view(), 80, 24);
    let velocity: Vec<String> = picture[11..17]
        .iter()
        .map(|line| line.chars().skip(35).collect())
        .collect();
    assert_eq!(
        velocity,
        [
            "    85",
            "",
            "",
            "    70 ⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉",
            "",
            "    55",
        ]
    );
}

#[test]
fn an_estimate_that_grows_old_is_said_to() {
    let mut dashboard = busy(DisplayState::Driving);
    dashboard.elapse(NOW_US + 3_000_000);
    let picture = picture(&dashboard, &view(), 80, 24);
    assert_has(&picture, "─ surface  3.0 s old");
    assert_has(&picture, "hand      -  ┅ arm      -");
}

#[test]
fn a_board_that_is_not_there_is_told_with_advice() {
    let mut dashboard = busy(DisplayState::Driving);
    let absent = State::Absent("/dev/ttyACM9".to_owned());
    let advice = absent.advice().expect("there is something to be done");
    let first = &advice[..30];
    dashboard.on(NOW_US, Role::Display, Event::StateChanged(absent));
    let picture = picture(&dashboard, &view(), 120, 40);
    assert_has(&picture, " display ● /dev/ttyACM9: not there: ");
    assert_has(&picture, first);
    assert_has(&picture, " supervisor not heard");
    assert_has(&picture, " the display is not heard");
}

#[test]
fn an_array_that_is_not_known_is_not_guessed() {
    let mut dashboard = busy(DisplayState::Driving);
    let configuration = Configuration::Display(DisplayConfiguration {
        actuators: 0x1234_5678,
        ..DisplayConfiguration::DEFAULT
    });
    let report = Message::Configuration(ConfigurationReport {
        refused: None,
        hash: configuration.hash(),
        configuration,
    });
    dashboard.on(NOW_US, Role::Display, heard(NOW_US, report));
    assert_has(
        &picture(&dashboard, &view(), 80, 24),
        "the display's array is none that",
    );
}

#[test]
fn nothing_panics_at_any_size() {
    let dashboard = busy(DisplayState::Driving);
    let mut open = view();
    open.form = Some(Form::new(Role::Sensor));
    let mut help = view();
    help.shows_help = true;
    let mut moment = View::new(Theme::COLOUR);
    moment.shows_moment = true;
    moment.is_frozen = true;
    for view in [&view(), &open, &help, &moment] {
        for width in (1..90).step_by(3).chain([120, 300]) {
            for height in (1..50).step_by(2).chain([100]) {
                picture(&dashboard, view, width, height);
                picture(&Dashboard::default(), view, width, height);
            }
        }
    }
}

#[test]
fn a_small_terminal_shows_what_matters_most() {
    let picture = picture(&busy(DisplayState::Driving), &view(), 30, 6);
    assert_eq!(
        picture,
        [
            " DRIVING  for 10.0 s",
            "λ 2.00 mm valid",
            "hand +70.0 arm +69.5 mm/s",
            "sensor known",
            "display known",
            "s stop  q quit",
        ]
    );
}

#[test]
fn without_colours_there_are_none() {
    let dashboard = busy(DisplayState::Stopped(Trip::Operator));
    let colours = |theme| {
        let mut terminal = Terminal::new(TestBackend::new(120, 40)).expect("no I/O");
        terminal
            .draw(|frame| draw(frame, &dashboard, &dashboard, &View::new(theme)))
            .expect("no I/O");
        let cells = terminal.backend().buffer().content().to_vec();
        cells
            .iter()
            .filter(|cell| cell.fg != Color::Reset || cell.bg != Color::Reset)
            .count()
    };
    assert_eq!(colours(Theme::PLAIN), 0);
    assert!(colours(Theme::COLOUR) > 500);
}

#[test]
fn the_form_shows_values_units_and_the_range_of_the_one_chosen() {
    let mut view = view();
    let mut form = Form::new(Role::Display);
    for _ in 0..3 {
        form.step(true);
    }
    form.type_digit('7');
    view.form = Some(form);
    let picture = picture(&busy(DisplayState::Driving), &view, 80, 24);
    assert_has(
        &picture,
        "│ max_age_ms                         7_ ms     20 to 5000",
    );
    assert_has(&picture, "│ amplitude_mv                     5000 mV");
}
