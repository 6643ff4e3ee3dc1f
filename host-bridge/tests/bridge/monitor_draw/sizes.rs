//! At 80 × 24 and at 120 × 40 every word and number is there as a whole.

use host_bridge::link::{Clocks, Event};
use host_bridge::monitor::dashboard::Dashboard;
use host_bridge::monitor::orders::Outcome;
use host_bridge::monitor::view::Form;
use host_bridge::monitor::view::{Kept, Panel};
use host_bridge::state::State;
use protocol::{
    Configuration, ConfigurationReport, Contact, DisplayState, Estimate, GaugeHealth, Message,
    PortCounters, Range, Refusal, Role, SensorConfiguration, Setting, Trip,
};

use super::{NOW_US, assert_has, busy, estimate, heard, picture, view};

/// The usual terminal, and a large one.
const SIZES: [(u16, u16); 2] = [(80, 24), (120, 40)];

/// A bench on which everything takes the most room that it usually takes.
fn widest() -> Dashboard {
    let mut dashboard = busy(DisplayState::Driving);
    for role in [Role::Sensor, Role::Display] {
        let clocks = Clocks {
            offset_us: -3_599_123_456,
            round_trip_us: 1_350,
        };
        let counters = PortCounters {
            sent: 99_999,
            received: 9_876_543,
            late: 1,
            malformed: 20,
            overlong: 300,
            unheralded: 4_000,
            ..PortCounters::new()
        };
        dashboard.on_line(role, counters, Some(clocks));
    }
    let sequence = u32::try_from(NOW_US / 10_000).expect("a small number");
    let estimate = Estimate {
        wavelength_mm: Some(12.34),
        valid: false,
        amplitude_lsb: 2_047.0,
        counted_mm: Some(12.34),
        range: Range::T2,
        contact: Contact::StickSlip,
        velocity_um_s: -169_500,
        lag_um: Some(-123),
        gauges_used: 0b0_0011,
        health: [
            GaugeHealth::Good,
            GaugeHealth::Good,
            GaugeHealth::Saturated,
            GaugeHealth::Noisy,
            GaugeHealth::Hum,
        ],
        ..estimate(sequence)
    };
    dashboard.on(
        NOW_US,
        Role::Sensor,
        heard(NOW_US, Message::Estimate(estimate)),
    );
    let configuration = Configuration::Sensor(SensorConfiguration::DEFAULT);
    let report = ConfigurationReport {
        refused: None,
        hash: configuration.hash(),
        configuration,
    };
    dashboard.on(
        NOW_US,
        Role::Sensor,
        heard(NOW_US, Message::Configuration(report)),
    );
    dashboard
}

#[test]
fn the_surface_is_told_whole() {
    for (width, height) in SIZES {
        let mut dashboard = widest();
        let shown = picture(&dashboard, &view(), width, height);
        for words in [
            "▀ mm  2047 LSB",
            " unsure   contact stick-slip",
            " paper's count 12.34 mm   range T2",
            "━ hand  +70.0  ┅ arm -169.5",
            "━ valid  ┅ unsure  ┅ paper's",
        ] {
            assert_has(&shown, words);
        }
        let (at_us, before) = dashboard.estimate.expect("there is one");
        for (contact, words) in [
            (Contact::Unknown, "contact unknown"),
            (Contact::Stick, "contact stick"),
            (Contact::Slip, "contact slip"),
        ] {
            dashboard.estimate = Some((at_us, Estimate { contact, ..before }));
            assert_has(&picture(&dashboard, &view(), width, height), words);
        }
    }
}

#[test]
fn each_gauge_is_told_by_whole_words() {
    let [narrow, wide] =
        SIZES.map(|(width, height)| picture(&widest(), &view(), width, height).join("\n"));
    for words in ["2 saturated ", "3 noisy unused ", "4 hum unused 40"] {
        assert!(narrow.contains(words), "{words:?} is not in\n{narrow}");
    }
    for words in [
        "2 saturated unused ",
        "3 noisy unused 50",
        "4 hum unused 40",
    ] {
        assert!(wide.contains(words), "{words:?} is not in\n{wide}");
    }
}

#[test]
fn what_a_port_counts_is_there_or_added_up() {
    let mut view = view();
    view.panel = Panel::Ports;
    let narrow = picture(&widest(), &view, 80, 24);
    for words in [
        "─ ports ────────    sent   heard    lost corrupt dropped overrun   noise  others",
        // Late, unread and overlong; stray frames are none that should not be.
        " here, display     99999  9876 k       0       0       0       0       0     321",
    ] {
        assert_has(&narrow, words);
    }
    let wide = picture(&widest(), &view, 120, 40);
    for words in [
        "   noise    late   twice   stray foreign  unread    long",
        " here, sensor      99999  9876 k       0       0       0       0       0       1       0    4000       0      20     300",
    ] {
        assert_has(&wide, words);
    }
}

#[test]
fn a_board_is_told_by_whole_facts_and_on_a_panel_by_all_of_them() {
    let mut view = view();
    view.panel = Panel::Boards;
    let narrow = picture(&widest(), &view, 80, 24);
    assert_eq!(
        narrow[0],
        " sensor  ● /dev/tty-sensor  rtt 1.4 ms  up 0:01:11  misses 0  watchdog 2  0.1.0"
    );
    assert_has(
        &narrow,
        " display   rtt 1.4 ms  clock -3599.1235 s  up 0:01:11  misses 0  watchdog 2",
    );
    assert_has(&narrow, "           by watchdog  0.1.0  stm32f429zi");
}

#[test]
fn the_supervisor_s_reason_and_the_marks_are_both_there() {
    let mut view = view();
    view.is_frozen = true;
    view.kept = Some(Kept {
        name: "monitor-1.mcap".to_owned(),
        since_us: NOW_US - 5_000_000,
        safe_bytes: 1_234_567,
    });
    let marks = " FROZEN   ● recording 0:00:04, 1.2 MB safe, monitor-1.mcap";
    for (width, height) in SIZES {
        for trip in Trip::ALL {
            let state = DisplayState::Stopped(trip);
            let shown = picture(&busy(state), &view, width, height);
            let words = state.to_string().to_uppercase();
            assert_has(
                &shown,
                &format!("{words}, 0 V until the display board's reset"),
            );
            assert_has(&shown, marks);
            assert_has(&shown, " q quit");
        }
        assert_has(
            &picture(&busy(DisplayState::Driving), &view, width, height),
            marks,
        );
    }
}

#[test]
fn a_notice_is_told_to_its_end() {
    for (width, height) in SIZES {
        let mut dashboard = widest();
        dashboard.linked = vec![Role::Sensor, Role::Display];
        dashboard.stop();
        dashboard.elapse(dashboard.now_us + 500_000);
        let shown = picture(&dashboard, &view(), width, height);
        assert_has(
            &shown,
            " NOT STOPPED: sensor and display: no answer, told again",
        );
        assert_has(&shown, "press the emergency stop");
    }
}

#[test]
fn what_happened_is_told_to_its_end() {
    let mut view = view();
    view.panel = Panel::Log;
    for (width, height) in SIZES {
        let mut dashboard = widest();
        let absent = State::Absent("/dev/ttyACM1".to_owned());
        let advice = absent.advice().expect("there is something to be done");
        dashboard.on(NOW_US, Role::Display, Event::StateChanged(absent));
        let shown = picture(&dashboard, &view, width, height);
        let from = shown
            .iter()
            .position(|line| line.contains("─ log"))
            .expect("it is shown");
        let log: Vec<&str> = shown[from..]
            .iter()
            .flat_map(|line| line.split_whitespace())
            .collect();
        assert!(log.join(" ").contains(advice), "{}", shown.join("\n"));
    }
}

#[test]
fn the_help_is_there_to_its_last_word() {
    let mut view = view();
    view.shows_help = true;
    for (width, height) in SIZES {
        let shown = picture(&widest(), &view, width, height);
        for words in [
            "┌ any key closes this ──",
            "│ s, space      stop: 0 V, no arm drive, until each board's reset or power",
            "│ Tab           gauges, ports, boards or log, where there is no room for all │",
            "│ range         T1: v kept its sign over the counting window; T2: it did not │",
            "│ unread        good frames that hold no message of this version",
            "└─────",
        ] {
            assert_has(&shown, words);
        }
        // What must not be late is not covered.
        assert_has(&shown, " DRIVING");
    }
}

#[test]
fn the_form_is_there_to_its_last_word() {
    for (width, height) in SIZES {
        let mut dashboard = widest();
        let mut view = view();
        view.form = Some(Form::new(Role::Sensor));
        let refusal = Refusal {
            setting: Setting::Actuators,
            index: 0,
            low: 1,
            high: 0,
        };
        dashboard.outcome = Some(Outcome::Refused(refusal));
        let shown = picture(&dashboard, &view, width, height);
        for words in [
            "┌ sensor board ──",
            "│ method                       spectrum ",
            "│ spectrum or counting or counting-adapted or crossings ",
            "│ arm_full_scale_um_s ",
            " µm/s ",
            "refused: actuators names neither the description in force nor the one",
            "0x00000001",
            " ↑↓ setting  0-9 ←→ value  Enter send  Tab other board  Esc close ─",
        ] {
            assert_has(&shown, words);
        }
        let mut form = Form::new(Role::Sensor);
        form.step(false);
        view.form = Some(form);
        assert_has(
            &picture(&dashboard, &view, width, height),
            " µm/s   1000 to 2000000 ",
        );
    }
}
