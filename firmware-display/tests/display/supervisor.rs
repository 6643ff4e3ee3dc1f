//! States and counters while all is well, or is not known yet.

use firmware_display::{ConverterFault, Display, MOTION_RATE_HZ, Senses, Transfer};
use protocol::{DisplayConfiguration, DisplayState, Estimate, Hold, Trip};

use crate::rig::{RATES, Rig, at, configured, sound};

#[test]
fn before_the_converters_have_started_nothing_is_driven() {
    for rate in RATES {
        let mut rig = Rig::of(Display::new(&configured(&at(rate)), None));
        rig.rub_while(500, 2.0, |rig| {
            assert_eq!(rig.state(), DisplayState::Boot);
            assert!(!rig.output.release && !rig.output.send && rig.is_silent());
            true
        });
        rig.display.started(Ok(()));
        rig.move_on();
        assert_eq!(rig.state(), DisplayState::Driving);
        assert!(rig.output.release);
    }
}

#[test]
fn converters_that_did_not_start_stop_the_display() {
    let mut rig = Rig::of(Display::new(&configured(&at(RATES[0])), None));
    rig.display.started(Err(ConverterFault::Register {
        chip: 1,
        register: 1,
        want: 0x0A60,
        got: 0xFFFF,
    }));
    rig.rub(100, 2.0);
    assert_eq!(rig.state(), DisplayState::Stopped(Trip::Converter));
    assert!(rig.is_silent() && !rig.output.release);
    assert_eq!(rig.display.counters().converter_faults, 1);
}

#[test]
fn a_trip_from_before_the_reset_is_kept() {
    let settings = configured(&DisplayConfiguration::DEFAULT);
    let mut rig = Rig::of(Display::new(&settings, Some(Trip::EmergencyStop)));
    assert_eq!(rig.state(), DisplayState::Stopped(Trip::EmergencyStop));
    rig.display.started(Ok(()));
    rig.rub_while(500, 2.0, |rig| {
        assert!(!rig.output.release && rig.is_silent());
        true
    });
    assert_eq!(rig.state(), DisplayState::Stopped(Trip::EmergencyStop));
}

#[test]
fn before_the_first_trusted_estimate_all_is_zero_volt_and_nothing_is_sent() {
    for rate in RATES {
        let mut rig = Rig::new(&at(rate));
        for tick in 0..rig.ticks(1_000) {
            if tick.is_multiple_of(rig.ticks(10)) {
                rig.tell(Estimate {
                    valid: false,
                    ..sound(0, 2.0)
                });
            }
            assert!(!rig.move_on().send);
            assert!(rig.output.release && rig.is_silent());
            assert_eq!(rig.state(), DisplayState::Ready);
        }
        let counters = rig.display.counters();
        assert_eq!((counters.updates, counters.fades), (0, 0));
    }
}

#[test]
fn the_stimulus_rises_to_full_within_the_fade_in() {
    for rate in RATES {
        // The largest word, in parts of 5 V, in each fifth of the fade-in and after it.
        let mut rig = Rig::new(&DisplayConfiguration {
            fade_in_ms: 500,
            ..at(rate)
        });
        let peaks: Vec<f64> = (0..6)
            .map(|_| {
                let mut peak = 0.0_f64;
                rig.rub_while(100, 2.0, |rig| {
                    let word = rig.display.words()[0];
                    peak = peak.max(f64::from(word.abs_diff(0x8000)) / 32_768.0);
                    true
                });
                peak
            })
            .collect();
        for (fifth, peak) in (1..).zip(&peaks[..5]) {
            let end = f64::from(fifth) / 5.0;
            // 35 Hz have a crest every 14 ms, and of the balance's high-pass a part of 1/56.
            assert!((end - 0.05..=end).contains(peak), "{peaks:?}");
        }
        assert!(peaks[5] > 0.98, "{peaks:?}");
    }
}

#[test]
fn the_last_trusted_wavelength_is_held_while_estimates_say_little() {
    for rate in RATES {
        let (mut held, mut fed) = (Rig::driving(&at(rate)), Rig::driving(&at(rate)));
        // Less than the 500 ms to which a λ may age.
        for tick in 0..held.ticks(450) {
            if tick.is_multiple_of(held.ticks(10)) {
                held.tell(Estimate {
                    valid: false,
                    confidence: 0.29,
                    ..sound(0, 9.0)
                });
                fed.estimate(2.0);
            }
            held.move_on();
            fed.move_on();
            assert_eq!(held.display.words(), fed.display.words());
        }
    }
}

#[test]
fn a_hand_that_rests_sends_nothing_and_one_that_sets_out_does() {
    for rate in RATES {
        let mut rig = Rig::driving(&at(rate));
        (0..rig.ticks(20)).for_each(|_| {
            rig.tick(0);
        });
        let updates = rig.display.counters().updates;
        for tick in 0..rig.ticks(2_000) {
            if tick.is_multiple_of(rig.ticks(10)) {
                rig.estimate(2.0);
            }
            assert!(!rig.tick(0).send);
        }
        assert_eq!(rig.display.counters().updates, updates);
        rig.rub(20, 2.0);
        assert!(rig.display.counters().updates > updates);
    }
}

#[test]
fn words_that_did_not_arrive_are_sent_again_until_they_do() {
    let mut rig = Rig::driving(&at(RATES[0]));
    (0..100).for_each(|_| {
        rig.tick(0);
    });
    for transfer in [Transfer::Failed, Transfer::Stalled] {
        for failures in 1..4 {
            rig.senses.transfer = transfer;
            (0..failures).for_each(|_| assert!(rig.tick(0).send));
            rig.senses.transfer = Transfer::Done;
            assert!(!rig.tick(0).send);
        }
    }
    assert_eq!(rig.state(), DisplayState::Driving);
}

#[test]
fn fading_counts_as_driving() {
    let mut rig = Rig::new(&DisplayConfiguration {
        full_drive_s: 10,
        max_age_ms: 20,
        fade_in_ms: 1,
        fade_out_ms: 1_000,
        ..DisplayConfiguration::DEFAULT
    });
    // A hand that never rests, and an estimate as soon as it is silent: nearly all of the time it fades.
    let mut ticks = 0;
    while rig.state() != DisplayState::Fading(Hold::FullDrive) {
        if rig.state() == DisplayState::Ready {
            rig.estimate(2.0);
        }
        rig.tick(7);
        ticks += 1;
        assert!(ticks < rig.ticks(11_000));
    }
    assert!(ticks >= rig.ticks(10_000));
}

#[test]
fn no_sequence_of_rates_and_references_breaks_a_limit() {
    let base = DisplayConfiguration {
        reference_lsb: 1_000,
        max_age_ms: 5_000,
        ..DisplayConfiguration::DEFAULT
    };
    let loud = Estimate {
        amplitude_lsb: 1_000.0,
        ..sound(0, 0.5)
    };
    let mut rig = Rig::new(&base);
    for tick in 0..4_000 {
        if tick % 40 == 0 {
            rig.tell(loud);
        }
        rig.tick(10);
    }
    for change in 0..1_400 {
        let fast = change % 2 == 0;
        rig.configure(&DisplayConfiguration {
            amplitude_mv: 1_000,
            reference_lsb: 1_000 + change / 2 % 2,
            update_rate: RATES[usize::from(fast)],
            ..base
        });
        if change % 40 == 0 {
            rig.tell(loud);
        }
        rig.tick(if fast { 5 } else { 10 });
        assert_eq!(rig.state(), DisplayState::Driving, "{change}");
    }
}

#[test]
fn too_long_a_drive_asks_for_a_rest_of_a_second() {
    for rate in RATES {
        let mut rig = Rig::new(&DisplayConfiguration {
            full_drive_s: 10,
            ..at(rate)
        });
        let ticks = rig.rub_while(20_000, 2.0, |rig| {
            rig.state() != DisplayState::Fading(Hold::FullDrive)
        });
        // Driving begins with the first tick, and counts from the next one on.
        assert_eq!(ticks, rig.ticks(10_000) + 1);
        rig.rub(100, 2.0);
        assert_eq!(rig.state(), DisplayState::Ready);
        // Rubbing on is of no use.
        rig.rub(5_000, 2.0);
        assert_eq!(rig.state(), DisplayState::Ready);
        let mut rested = 0;
        while rig.state() == DisplayState::Ready {
            if rested % rig.ticks(10) == 0 {
                rig.estimate(2.0);
            }
            rig.tick(0);
            rested += 1;
        }
        // It is seen to rest within 20 ms.
        assert!((rig.ticks(1_000)..rig.ticks(1_020)).contains(&rested));
    }
}

#[test]
fn a_drive_with_rests_goes_on_for_ever() {
    let mut rig = Rig::new(&DisplayConfiguration {
        full_drive_s: 10,
        ..at(RATES[0])
    });
    for _ in 0..12 {
        rig.rub(5_000, 2.0);
        assert_eq!(rig.state(), DisplayState::Driving);
        for tick in 0..rig.ticks(300) {
            if tick.is_multiple_of(rig.ticks(10)) {
                rig.estimate(2.0);
            }
            rig.tick(0);
        }
    }
    assert_eq!(rig.display.counters().changes, 2);
}

#[test]
fn a_lost_motion_holds_for_a_tenth_of_a_second() {
    for rate in RATES {
        let mut rig = Rig::driving(&at(rate));
        rig.senses.unheard = true;
        rig.move_on();
        rig.senses.unheard = false;
        let ticks = rig.rub_while(1_000, 2.0, |rig| rig.state() != DisplayState::Driving);
        assert_eq!(ticks, rig.ticks(100));
        assert_eq!(rig.display.counters().unheard, 1);
    }
}

#[test]
fn the_motion_is_the_hands_own_at_either_rate_and_in_any_state() {
    for rate in RATES {
        for stops in [false, true] {
            let mut rig = Rig::new(&at(rate));
            if stops {
                rig.display.stop(protocol::StopReason::Operator);
            }
            let mut motions = Vec::new();
            for tick in 0..rig.ticks(1_000) {
                rig.tick(if tick == 0 { 0 } else { -3 });
                motions.extend(rig.display.motion(u64::from(tick)));
            }
            assert_eq!(motions.len() as u32, MOTION_RATE_HZ);
            let last = motions.last().unwrap();
            let travels = i64::from(rig.ticks(1_000)) - 1;
            assert_eq!(last.position_um, -3 * 5 * travels);
            assert_eq!(last.velocity_um_s, -15 * rate.hz() as i32);
        }
    }
}

#[test]
fn the_rate_may_change_in_mid_stroke() {
    let mut rig = Rig::driving(&at(RATES[0]));
    for turn in 0..20 {
        rig.configure(&at(RATES[(turn + 1) % 2]));
        rig.rub(100, 2.0);
        assert_eq!(rig.state(), DisplayState::Driving);
        assert!(!rig.is_silent());
    }
}

#[test]
fn every_tick_update_and_change_is_counted() {
    let mut rig = Rig::new(&at(RATES[0]));
    let mut updates = 0;
    rig.rub_while(250, 2.0, |rig| {
        updates += u32::from(rig.output.send);
        true
    });
    let counters = rig.display.counters();
    assert_eq!((counters.ticks, counters.updates), (500, updates));
    assert_eq!(counters.estimates, 25);
    // Boot, Ready, Driving.
    assert_eq!((counters.changes, counters.state), (2, rig.state()));
}

#[test]
fn what_the_board_senses_is_counted() {
    let mut rig = Rig::driving(&at(RATES[0]));
    let healthy = rig.senses;
    for senses in [
        Senses {
            transfer: Transfer::Failed,
            ..healthy
        },
        healthy,
        Senses {
            transfer: Transfer::Stalled,
            missed_ticks: 2,
            ..healthy
        },
        Senses {
            clear_fell: true,
            missed_ticks: 5,
            unheard: true,
            ..healthy
        },
        Senses {
            alarm: true,
            ..healthy
        },
        // An alarm that lasts is one.
        Senses {
            alarm: true,
            ..healthy
        },
        Senses {
            alarm: true,
            ..healthy
        },
    ] {
        rig.senses = senses;
        rig.move_on();
    }
    let counters = rig.display.counters();
    assert_eq!((counters.spi_errors, counters.deadline_misses), (1, 8));
    assert_eq!((counters.clears, counters.unheard), (1, 1));
    assert_eq!(counters.converter_faults, 1);
}
