//! Which estimates are followed, and which are not.

use firmware_display::pace::quarters;
use firmware_display::phase::Wavelength;
use firmware_display::plausibility::{Plausibility, Verdict};
use protocol::{DisplayCounters, DisplayState, Estimate, Hold};

use crate::rig::{RATES, Rig, at, sound};

/// Age up to which a λ counts, in ms.
const MAX_AGE_MS: u16 = 500;

fn trusted(mm: f32) -> Verdict {
    Verdict::Trusted(Wavelength::new(mm).unwrap())
}

/// The verdicts on estimates that come every 10 ms.
fn verdicts(estimates: impl IntoIterator<Item = Estimate>) -> Vec<Verdict> {
    let mut plausibility = Plausibility::new();
    estimates
        .into_iter()
        .map(|estimate| {
            plausibility.elapse(quarters(10), false);
            plausibility.judge(&estimate, MAX_AGE_MS)
        })
        .collect()
}

/// The verdicts on sound estimates of these wavelengths.
fn on_wavelengths(wavelengths_mm: impl IntoIterator<Item = f32>) -> Vec<Verdict> {
    verdicts((0..).zip(wavelengths_mm).map(|(n, mm)| sound(n, mm)))
}

/// The verdict on `next` after a sound estimate of 2 mm with `sequence`.
fn after(sequence: u32, next: Estimate) -> Verdict {
    verdicts([sound(sequence, 2.0), next])[1]
}

#[test]
fn a_wavelength_that_is_no_number_or_out_of_range_is_refused() {
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
    for mm in wrong {
        assert_eq!(after(5, sound(6, mm)), Verdict::OutOfRange, "{mm}");
    }
    let missing = Estimate {
        wavelength_mm: None,
        ..sound(6, 2.0)
    };
    assert_eq!(after(5, missing), Verdict::OutOfRange);
    for mm in [0.1, 50.0] {
        assert_eq!(on_wavelengths([mm]), [trusted(mm)]);
    }
}

#[test]
fn an_estimate_that_contradicts_itself_is_implausible_valid_or_not() {
    let contradictions: [fn(&mut Estimate); 12] = [
        |e| e.confidence = f32::NAN,
        |e| e.confidence = -0.01,
        |e| e.confidence = 1.01,
        |e| e.amplitude_lsb = f32::NAN,
        |e| e.amplitude_lsb = f32::INFINITY,
        |e| e.amplitude_lsb = -1.0,
        |e| e.amplitude_lsb = 2_609.0,
        |e| e.velocity_um_s = 20_000_001,
        |e| e.velocity_um_s = i32::MIN,
        |e| e.gauges_used |= 1 << 5,
        |e| e.gauges_used = u8::MAX,
        |e| e.gauges_used = 0,
    ];
    for (index, contradict) in contradictions.iter().enumerate() {
        let mut estimate = sound(6, 2.0);
        contradict(&mut estimate);
        assert_eq!(after(5, estimate), Verdict::Implausible, "{index}");
    }
    // Just possible.
    let possible: [fn(&mut Estimate); 6] = [
        |e| e.confidence = 0.0,
        |e| e.confidence = 1.0,
        |e| e.amplitude_lsb = 2_608.0,
        |e| e.velocity_um_s = 20_000_000,
        |e| e.velocity_um_s = -20_000_000,
        |e| e.gauges_used = 0b1_1111,
    ];
    for (index, change) in possible.iter().enumerate() {
        let mut estimate = sound(6, 2.0);
        change(&mut estimate);
        assert_eq!(after(5, estimate), trusted(2.0), "{index}");
    }
    // Without a gauge that may take part there is an estimate nevertheless, which nobody stands by.
    let blind = Estimate {
        valid: false,
        gauges_used: 0,
        ..sound(6, 2.0)
    };
    assert_eq!(after(5, blind), Verdict::Idle);
}

#[test]
fn an_estimate_that_is_not_later_than_the_last_is_late() {
    for (last, next) in [
        (500, 500),
        (500, 499),
        (5_000, 4_000),
        (8, 3),
        // A restart begins further behind than a network reorders.
        (42, 10),
        (1_043, 43),
        (u32::MAX, u32::MAX - 9),
    ] {
        let verdict = after(last, sound(next, 2.0));
        assert_eq!(verdict, Verdict::Late, "{next} after {last}");
    }
    for (last, next) in [(500, 501), (500, 90_000), (u32::MAX, 0), (u32::MAX - 5, 20)] {
        let verdict = after(last, sound(next, 2.0));
        assert_eq!(verdict, trusted(2.0), "{next} after {last}");
    }
    // Even if the one seen since was doubtful.
    let doubtful = Estimate {
        valid: false,
        ..sound(7, 2.0)
    };
    let told = verdicts([doubtful, sound(6, 2.0)]);
    assert_eq!(told, [Verdict::Idle, Verdict::Late]);
}

#[test]
fn a_sensor_that_restarts_is_followed_at_once_on_whatever_surface() {
    for (last, next) in [
        (5_000, 0),
        (5_000, 3_999),
        (50, 0),
        (50, 10),
        (43, 10),
        (1_044, 43),
        (1_000_000, 17),
    ] {
        let verdict = after(last, sound(next, 9.0));
        assert_eq!(verdict, trusted(9.0), "{next} after {last}");
    }
    // Followed from there on, not once.
    let told = verdicts([70_000, 0, 1, 2, 3].map(|sequence| sound(sequence, 2.0)));
    assert_eq!(told, [trusted(2.0); 5]);
}

#[test]
fn a_sensor_that_asks_for_a_greeting_is_followed_whatever_it_begins_with() {
    // Of a slow link, the estimates until the answer came are missing.
    let told = |before: u32, in_order: u32, next: u32| {
        let mut plausibility = Plausibility::new();
        plausibility.judge(&sound(before, 2.0), MAX_AGE_MS);
        plausibility.on_greeting();
        for on_its_way in 1..=in_order {
            plausibility.elapse(quarters(10), false);
            plausibility.judge(&sound(before + on_its_way, 2.0), MAX_AGE_MS);
        }
        plausibility.judge(&sound(next, 9.0), MAX_AGE_MS)
    };
    for (before, in_order, next) in [(371, 0, 20), (371, 31, 20), (371, 31, 369), (500, 10, 300)] {
        let verdict = told(before, in_order, next);
        assert_eq!(verdict, trusted(9.0), "{next} after {before} + {in_order}");
    }
    // One that a network has put out of order is late all the same, and so are all once the sensor has gone on.
    for (before, in_order, next) in [(371, 0, 339), (371, 32, 371), (371, 32, 20)] {
        let verdict = told(before, in_order, next);
        assert_eq!(verdict, Verdict::Late, "{next} after {before} + {in_order}");
    }
}

#[test]
fn a_sensor_that_begins_anew_does_so_once_a_greeting() {
    let mut plausibility = Plausibility::new();
    let mut judge = |sequence: u32, asks: bool| {
        if asks {
            plausibility.on_greeting();
        }
        plausibility.judge(&sound(sequence, 2.0), MAX_AGE_MS)
    };
    let told = [
        (371, false),
        (20, true),
        (21, false),
        (300, false),
        (100, false),
    ];
    let told = told.map(|(sequence, asks)| judge(sequence, asks) == Verdict::Late);
    assert_eq!(told, [false, false, false, false, true]);
}

#[test]
fn a_boundary_between_specimens_costs_one_estimate() {
    for (before_mm, after_mm) in [(1.0, 4.0), (4.0, 1.0), (1.0, 2.2), (3.0, 1.4)] {
        let told = on_wavelengths([before_mm, before_mm, after_mm, after_mm, after_mm]);
        let [before, after] = [before_mm, after_mm].map(trusted);
        assert_eq!(told, [before, before, Verdict::Idle, after, after]);
    }
    // The second need not be the same as the first, but like it.
    assert_eq!(on_wavelengths([1.0, 3.7, 4.05])[2], trusted(4.05));
    // And a doubtful one in between takes nothing away.
    let doubtful = Estimate {
        valid: false,
        ..sound(2, 1.0)
    };
    let told = verdicts([sound(0, 1.0), sound(1, 4.0), doubtful, sound(3, 4.0)]);
    assert_eq!(told[1..], [Verdict::Idle, Verdict::Idle, trusted(4.0)]);
}

#[test]
fn a_count_of_one_instead_of_two_is_followed_at_once() {
    // λ = 2 v A / n at 30 mm/s, A = 80 ms.
    for (before_mm, after_mm) in [(2.4, 4.8), (4.8, 2.4), (1.6, 2.4), (2.4, 1.6)] {
        assert_eq!(on_wavelengths([before_mm, after_mm])[1], trusted(after_mm));
    }
}

#[test]
fn a_drift_is_followed_however_far_it_goes() {
    // From 0.2 mm to 40 mm and back by up to 10 % an estimate, of which three in a row may be lost.
    for percent in [0.1, 1.0, 5.0, 10.0_f64] {
        let factor = 1.0 + percent / 100.0;
        let steps = (40.0_f64 / 0.2).ln() / factor.ln();
        let up = (0..steps as u32).map(|n| 0.2 * factor.powi(n as i32));
        let down = up.clone().rev();
        let lost = |n: &usize| n % 7 > 3;
        let heard = up.chain(down).enumerate().filter(|(n, _)| !lost(n));
        let told = on_wavelengths(heard.map(|(_, mm)| mm as f32));
        assert!(
            told.iter()
                .all(|verdict| matches!(verdict, Verdict::Trusted(_))),
            "{percent} %"
        );
    }
}

#[test]
fn a_single_jump_is_never_followed() {
    let told = on_wavelengths([2.0, 5.0, 2.0, 2.0, 0.5, 7.0, 2.1]);
    let expected = [
        trusted(2.0),
        Verdict::Idle,
        trusted(2.0),
        trusted(2.0),
        Verdict::Idle,
        Verdict::Idle,
        trusted(2.1),
    ];
    assert_eq!(told, expected);
}

#[test]
fn a_wavelength_too_old_surprises_nobody() {
    let mut plausibility = Plausibility::new();
    assert_eq!(plausibility.judge(&sound(1, 1.0), MAX_AGE_MS), trusted(1.0));
    plausibility.elapse(quarters(u32::from(MAX_AGE_MS)), false);
    assert_eq!(
        plausibility.judge(&sound(2, 4.0), MAX_AGE_MS),
        Verdict::Idle
    );
    plausibility.elapse(1, false);
    assert_eq!(plausibility.judge(&sound(3, 9.0), MAX_AGE_MS), trusted(9.0));
}

/// A rig that drives, and then is told estimates that cannot be trusted, one every 10 ms; after how
/// many it fades.
fn distrusted_after(
    mut rig: Rig,
    mut estimate: impl FnMut(u32) -> Option<Estimate>,
) -> Option<u32> {
    let ticks = rig.ticks(10);
    (1..100).find(|&n| {
        if let Some(estimate) = estimate(n) {
            rig.tell(estimate);
        } else {
            rig.estimate(2.0);
        }
        (0..ticks).any(|_| {
            rig.move_on();
            rig.state() == DisplayState::Fading(Hold::Distrust)
        })
    })
}

#[test]
fn five_that_cannot_be_true_within_half_a_second_are_distrusted() {
    for rate in RATES {
        let driving = || Rig::driving(&at(rate));
        let no_gauges = Estimate {
            gauges_used: 0,
            ..sound(0, 2.0)
        };
        assert_eq!(distrusted_after(driving(), |_| Some(no_gauges)), Some(5));
        let no_number = sound(0, f32::NAN);
        assert_eq!(distrusted_after(driving(), |_| Some(no_number)), Some(5));
        // Each jump is found out by the next, which is another one.
        let jumps = |n: u32| Some(sound(0, if n.is_multiple_of(2) { 9.0 } else { 0.3 }));
        assert_eq!(distrusted_after(driving(), jumps), Some(6));
        // Every second one.
        let every_second = |n: u32| n.is_multiple_of(2).then_some(no_gauges);
        assert_eq!(distrusted_after(driving(), every_second), Some(10));
        // The first and the fifth are half a second apart, or more.
        let every = |every: u32| move |n: u32| n.is_multiple_of(every).then_some(no_gauges);
        assert_eq!(distrusted_after(driving(), every(12)), Some(60));
        assert_eq!(distrusted_after(driving(), every(13)), None);
    }
}

#[test]
fn trust_comes_back_after_half_a_second_without() {
    for rate in RATES {
        let mut rig = Rig::driving(&at(rate));
        for _ in 0..5 {
            rig.tell(sound(0, f32::NAN));
        }
        rig.move_on();
        assert_eq!(rig.state(), DisplayState::Fading(Hold::Distrust));
        let ticks = rig.rub_while(1_000, 2.0, |rig| rig.state() != DisplayState::Driving);
        // The tick above was the first, and of the last one it is that half a second is over.
        assert_eq!(ticks + 1, rig.ticks(500));
    }
}

#[test]
fn doubtful_and_refused_estimates_do_not_make_the_last_trusted_one_younger() {
    for rate in RATES {
        let mut rig = Rig::driving(&at(rate));
        rig.estimate(2.0);
        for n in 0..rig.ticks(500) {
            if n.is_multiple_of(rig.ticks(5)) {
                rig.tell(Estimate {
                    valid: false,
                    ..sound(0, 2.0)
                });
            }
            // Four in half a second are not yet too many.
            if n.is_multiple_of(rig.ticks(250)) {
                rig.tell(sound(0, f32::NAN));
                rig.tell(sound(0, 99.0));
            }
            rig.move_on();
            assert_eq!(rig.state(), DisplayState::Driving);
        }
        rig.move_on();
        assert_eq!(rig.state(), DisplayState::Fading(Hold::Stale));
    }
}

#[test]
fn every_estimate_that_is_not_used_is_counted_for_its_reason() {
    let mut rig = Rig::new(&at(RATES[0]));
    let mut expected = rig.display.counters();
    let mut tell = |estimate: Estimate, add: fn(&mut DisplayCounters)| {
        rig.display.on_estimate(&estimate);
        add(&mut expected);
        assert_eq!(rig.display.counters(), expected, "{estimate:?}");
    };
    tell(sound(1, 2.0), |c| c.estimates += 1);
    tell(sound(2, 2.1), |c| c.estimates += 1);
    tell(sound(1, 2.0), |c| c.refused_estimates += 1);
    tell(sound(3, f32::NAN), |c| c.refused_estimates += 1);
    let no_gauges = Estimate {
        gauges_used: 0,
        ..sound(4, 2.0)
    };
    tell(no_gauges, |c| c.implausible += 1);
    let doubtful = Estimate {
        valid: false,
        ..sound(5, 2.0)
    };
    tell(doubtful, |_| {});
    tell(sound(6, 9.0), |_| {});
    tell(sound(7, 2.0), |c| {
        c.estimates += 1;
        c.implausible += 1;
    });
    for n in 8..40 {
        tell(sound(n, 2.0), |c| c.estimates += 1);
    }
    // The forty-first without a tick.
    tell(sound(40, 2.0), |c| c.flooded += 1);
}

/// For how long λ is held after sound estimates of these wavelengths, one every 10 ms, in ms.
fn held_after_ms(wavelengths_mm: &[f32]) -> u32 {
    held_ms((0..).zip(wavelengths_mm).map(|(n, &mm)| sound(n, mm)))
}

/// For how long λ is held after estimates that come every 10 ms, in ms.
fn held_ms(estimates: impl Iterator<Item = Estimate>) -> u32 {
    let mut plausibility = Plausibility::new();
    for estimate in estimates {
        plausibility.elapse(quarters(10), false);
        plausibility.judge(&estimate, MAX_AGE_MS);
    }
    let mut held_ms = 0;
    while plausibility.is_fresh(MAX_AGE_MS) {
        plausibility.elapse(quarters(1), false);
        held_ms += 1;
    }
    held_ms - 1
}

#[test]
fn a_surface_that_was_met_just_now_is_held_for_less() {
    // One estimate, which may be chance; 40 ms, 90 ms, and a second of one surface, which may change a little.
    assert_eq!(held_after_ms(&[2.0]), 150);
    assert_eq!(held_after_ms(&[2.0; 5]), 200);
    assert_eq!(held_after_ms(&[2.0; 10]), 450);
    assert_eq!(held_after_ms(&[2.0; 11]), 500);
    let mut slowly = [2.0; 100];
    slowly[50..].fill(3.9);
    assert_eq!(held_after_ms(&slowly), 500);
    // Another surface, which the second of its estimates confirms, is new.
    slowly[97..].fill(9.0);
    assert_eq!(held_after_ms(&slowly), 150);
}

#[test]
fn doubtful_estimates_that_likely_say_the_same_make_a_surface_known() {
    // One that is trusted, and nine that are not, of so many mm and that confidence: λ is held from the tenth on.
    let after = |mm: f32, confidence: f32| {
        let doubtful = (1..10).map(|n| Estimate {
            valid: false,
            confidence,
            ..sound(n, mm)
        });
        held_ms([sound(0, 2.0)].into_iter().chain(doubtful))
    };
    // Known for 90 ms, so held until 450 ms after the first.
    assert_eq!(after(2.1, 0.5), 450 - 90);
    assert_eq!(after(2.1, 0.49), 150 - 90);
    assert_eq!(after(2.3, 0.29), 150 - 90);
}

#[test]
fn a_doubtful_estimate_that_may_be_right_about_another_surface_ends_the_hold() {
    let doubtful = |sequence, mm: f32, confidence| Estimate {
        valid: false,
        confidence,
        ..sound(sequence, mm)
    };
    for (other_mm, confidence, is_held) in [
        (2.3, 0.3, false),
        (1.75, 0.3, false),
        (2.3, 0.29, true),
        (2.1, 0.3, true),
    ] {
        let mut plausibility = Plausibility::new();
        let mut judge = |estimate| {
            plausibility.elapse(quarters(10), false);
            plausibility.judge(&estimate, MAX_AGE_MS);
            plausibility.is_fresh(MAX_AGE_MS)
        };
        for sequence in 0..20 {
            assert!(judge(sound(sequence, 2.0)));
        }
        let what = format!("{other_mm} mm, {confidence}");
        assert_eq!(judge(doubtful(20, other_mm, confidence)), is_held, "{what}");
        // One that says nothing of any surface changes nothing, nor one of the same that is likely wrong.
        let silent = Estimate {
            wavelength_mm: None,
            ..doubtful(21, 2.0, 0.5)
        };
        assert_eq!(judge(silent), is_held, "{what}");
        assert_eq!(judge(doubtful(22, 2.0, 0.49)), is_held, "{what}");
        // One that is likely right brings it back, as a trusted one does.
        assert!(judge(doubtful(23, 2.0, 0.5)), "{what}");
        judge(doubtful(24, other_mm, confidence));
        assert!(judge(sound(25, 2.0)), "{what}");
    }
}

#[test]
fn a_surface_that_is_doubted_is_at_zero_volt_as_soon_as_it_has_faded_out() {
    for rate in RATES {
        let configuration = at(rate);
        let mut rig = Rig::new(&configuration);
        for _ in 0..50 {
            rig.rub(3, 2.0);
            rig.estimate(2.0);
        }
        rig.tell(Estimate {
            valid: false,
            confidence: 0.5,
            ..sound(0, 3.0)
        });
        let ticks = rig.stays_silent_after(1_000).unwrap();
        assert_eq!(ticks, rig.ticks(u32::from(configuration.fade_out_ms)));
    }
}

#[test]
fn what_one_estimate_began_is_at_zero_volt_two_hundred_milliseconds_later() {
    for rate in RATES {
        let configuration = at(rate);
        let mut rig = Rig::new(&configuration);
        // Not at a crossing.
        rig.rub(3, 2.0);
        rig.estimate(2.0);
        let ticks = rig.stays_silent_after(1_000).unwrap();
        assert_eq!(ticks, rig.ticks(150 + u32::from(configuration.fade_out_ms)));
    }
}
