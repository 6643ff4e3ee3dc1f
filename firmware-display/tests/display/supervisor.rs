//! What the actuators get when something is missing, late or wrong.

use firmware_display::{ACTUATORS, Display, MOTION_RATE_HZ, TICK_RATE_HZ, ZERO_VOLT};
use protocol::{DisplayConfiguration, Estimate, Mode};

use crate::rig::{FADED_IN, Rig, valid};

const SILENCE: [u16; ACTUATORS] = [ZERO_VOLT; ACTUATORS];

/// A display that has seen `sequence`, and the counts of used and refused estimates after `next`.
fn after(sequence: u32, next: Estimate) -> (u32, u32) {
    let mut display = Display::new(DisplayConfiguration::default());
    display.on_estimate(&valid(sequence, 2.0));
    display.on_estimate(&next);
    (
        display.counters().estimates - 1,
        display.counters().refused_estimates,
    )
}

const USED: (u32, u32) = (1, 0);
const REFUSED: (u32, u32) = (0, 1);

#[test]
fn before_the_first_valid_estimate_all_is_zero_volt_and_nothing_is_sent() {
    let mut rig = Rig::new(Mode::Travelling);
    for tick in 0..1_000 {
        if tick % 20 == 0 {
            rig.doubtful(Some(2.0));
            rig.doubtful(None);
        }
        assert!(!rig.tick(11));
        assert_eq!(*rig.display.words(), SILENCE);
    }
    assert_eq!(rig.display.counters().updates, 0);
    assert_eq!(rig.display.counters().fades, 0);
}

#[test]
fn the_stimulus_rises_evenly_from_zero_within_the_fade_in() {
    let mut rig = Rig::new(Mode::Uniform);
    // A quarter of a wavelength on, so that the voltage shows the gain.
    rig.tick(0);
    rig.estimate(2.0);
    rig.tick(100);
    let mut volts = vec![rig.volts()[0]];
    for _ in 0..45 {
        rig.tick(0);
        volts.push(rig.volts()[0]);
    }
    for (tick, volt) in volts.iter().enumerate() {
        let expected = 5.0 * (tick + 1).min(40) as f64 / 40.0;
        assert!(
            (volt - expected).abs() < 0.001,
            "tick {tick}: {volt} V, not {expected} V"
        );
    }
}

#[test]
fn fades_out_at_the_configured_age_and_in_again_at_the_next_valid_estimate() {
    let configuration = DisplayConfiguration {
        max_age_ms: 100,
        fade_out_ms: 30,
        fade_in_ms: 10,
        ..Default::default()
    };
    let mut rig = Rig::with(configuration);
    rig.tick(0);
    rig.estimate(2.0);
    // 100 counts are a quarter of a wavelength: full voltage, and the hand rests there.
    rig.tick(100);
    for tick in 2..=200 {
        rig.tick(0);
        if tick >= 20 {
            assert!(rig.volts()[0] > 4.999, "full until tick 200: tick {tick}");
        }
    }
    assert_eq!(rig.display.counters().fades, 0);
    for tick in 1..=60 {
        rig.tick(0);
        let expected = 5.0 * f64::from(60 - tick) / 60.0;
        assert!(
            (rig.volts()[0] - expected).abs() < 0.001,
            "tick {tick} of the fade"
        );
        assert_eq!(rig.display.counters().fades, 1);
    }
    assert_eq!(*rig.display.words(), SILENCE);
    assert!(!rig.tick(31) && !rig.tick(-31), "silence is not sent again");
    rig.estimate(2.0);
    for tick in 1..=20 {
        rig.tick(0);
        let expected = 5.0 * f64::from(tick) / 20.0;
        assert!(
            (rig.volts()[0] - expected).abs() < 0.001,
            "tick {tick} of the fade-in"
        );
    }
    assert_eq!(rig.display.counters().fades, 1);
}

#[test]
fn the_last_valid_wavelength_is_held_while_estimates_are_doubtful() {
    let (mut held, mut fed) = (Rig::new(Mode::Uniform), Rig::new(Mode::Uniform));
    held.rub(100, 7, 2.0);
    fed.rub(100, 7, 2.0);
    // Less than the 500 ms to which a λ may age.
    for tick in 0..900 {
        if tick % 20 == 0 {
            held.doubtful(Some(9.0));
            fed.estimate(2.0);
        }
        held.tick(7);
        fed.tick(7);
        assert_eq!(held.display.words(), fed.display.words());
    }
}

#[test]
fn doubtful_and_refused_estimates_do_not_make_the_last_valid_one_younger() {
    let mut rig = Rig::new(Mode::Uniform);
    rig.rub(FADED_IN, 7, 2.0);
    // 500 ms of age, 50 ms of fade-out, at two ticks a millisecond.
    for _ in 0..1_100 {
        rig.doubtful(Some(2.0));
        rig.estimate(f32::NAN);
        rig.estimate(99.0);
        rig.tick(7);
    }
    assert_eq!(*rig.display.words(), SILENCE);
    assert_eq!(rig.display.counters().fades, 1);
}

#[test]
fn a_wavelength_that_is_no_number_or_out_of_range_is_refused_and_counted() {
    let wrong = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        0.0,
        -2.0,
        0.09,
        50.1,
        f32::MAX,
    ];
    for wavelength_mm in wrong {
        assert_eq!(
            after(5, valid(6, wavelength_mm)),
            REFUSED,
            "{wavelength_mm}"
        );
    }
    let missing = Estimate {
        wavelength_mm: None,
        ..valid(6, 2.0)
    };
    assert_eq!(after(5, missing), REFUSED);
    assert_eq!(after(5, valid(6, 0.1)), USED);
    assert_eq!(after(5, valid(6, 50.0)), USED);
}

#[test]
fn an_estimate_that_is_not_later_than_the_last_is_refused() {
    for (last, next) in [
        (500, 500),
        (500, 499),
        (5_000, 4_000),
        (8, 3),
        (u32::MAX, u32::MAX - 9),
    ] {
        assert_eq!(
            after(last, valid(next, 3.0)),
            REFUSED,
            "{next} after {last}"
        );
    }
    for (last, next) in [(500, 501), (500, 90_000), (u32::MAX, 0), (u32::MAX - 5, 20)] {
        assert_eq!(after(last, valid(next, 3.0)), USED, "{next} after {last}");
    }
}

#[test]
fn an_old_estimate_is_refused_even_if_the_one_seen_since_was_doubtful() {
    let mut display = Display::new(DisplayConfiguration::default());
    display.on_estimate(&Estimate {
        valid: false,
        ..valid(7, 2.0)
    });
    display.on_estimate(&valid(6, 2.0));
    assert_eq!(display.counters().estimates, 0);
    assert_eq!(display.counters().refused_estimates, 1);
}

#[test]
fn a_sensor_that_restarts_is_followed_again() {
    for (last, next) in [
        (5_000, 0),
        (5_000, 3_999),
        (50, 0),
        (50, 10),
        (1_000_000, 17),
    ] {
        assert_eq!(after(last, valid(next, 3.0)), USED, "{next} after {last}");
    }
    // Followed from there on, not once.
    let mut display = Display::new(DisplayConfiguration::default());
    for sequence in [70_000, 0, 1, 2, 3] {
        display.on_estimate(&valid(sequence, 2.0));
    }
    assert_eq!(display.counters().estimates, 5);
}

#[test]
fn a_stop_is_obeyed_at_the_next_tick_and_kept() {
    let mut rig = Rig::new(Mode::Travelling);
    rig.rub(150, 7, 2.0);
    assert_ne!(*rig.display.words(), SILENCE);
    rig.display.stop();
    assert!(rig.tick(7), "0 V is sent");
    let mut motions = 0;
    assert_eq!(*rig.display.words(), SILENCE);
    for tick in 0..2_000 {
        if tick % 20 == 0 {
            rig.estimate(2.0);
            rig.display.configure(DisplayConfiguration::default());
        }
        assert!(!rig.tick(7));
        assert_eq!(*rig.display.words(), SILENCE);
        motions += usize::from(rig.display.motion(0).is_some());
    }
    assert_eq!(motions, 500, "the arm is still told of the hand");
}

#[test]
fn a_stop_before_the_first_estimate_is_kept_too() {
    let mut rig = Rig::new(Mode::Uniform);
    rig.display.stop();
    rig.rub(500, 7, 2.0);
    assert_eq!(*rig.display.words(), SILENCE);
}

#[test]
fn a_hand_that_stops_sends_nothing() {
    for mode in [Mode::Uniform, Mode::Travelling] {
        let mut rig = Rig::new(mode);
        rig.rub(333, 7, 2.0);
        let updates = rig.display.counters().updates;
        for tick in 0..3_000 {
            if tick % 20 == 0 {
                rig.estimate(2.0);
            }
            assert!(!rig.tick(0), "{mode:?}");
        }
        assert_eq!(rig.display.counters().updates, updates);
        assert!(rig.tick(1), "and one count is sent again");
    }
}

#[test]
fn words_asked_for_again_are_sent_once() {
    let mut rig = Rig::new(Mode::Uniform);
    rig.rub(333, 7, 2.0);
    let words = *rig.display.words();
    rig.display.resend();
    assert!(rig.tick(0));
    assert_eq!(*rig.display.words(), words);
    assert!(!rig.tick(0));
}

#[test]
fn the_motion_is_the_hands_own_whatever_the_estimates() {
    let mut rig = Rig::new(Mode::Uniform);
    let mut last = None;
    for tick in 0..TICK_RATE_HZ {
        rig.tick(if tick == 0 { 0 } else { -7 });
        last = rig.display.motion(u64::from(tick) * 500).or(last);
    }
    let last = last.unwrap();
    assert_eq!(last.sequence, MOTION_RATE_HZ - 1);
    assert_eq!(last.instant_us, u64::from(TICK_RATE_HZ - 1) * 500);
    assert_eq!(last.position_um, -7 * 5 * i64::from(TICK_RATE_HZ - 1));
    assert_eq!(last.velocity_um_s, -70_000);
}

#[test]
fn every_tick_and_update_is_counted() {
    let mut rig = Rig::new(Mode::Uniform);
    let updates = (0..500).filter(|_| {
        rig.estimate(2.0);
        rig.tick(3)
    });
    let updates = updates.count() as u32;
    let counters = rig.display.counters();
    assert_eq!(
        (counters.ticks, counters.updates, counters.estimates),
        (500, updates, 500)
    );
}
