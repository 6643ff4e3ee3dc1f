//! How long it takes from each fault to 0 V on all channels: the numbers of the table of hazards in
//! docs/src/explanation/safety.md.

use firmware_display::{ConverterFault, Display, Output, Readback, Senses, Transfer, ZERO_VOLT};
use protocol::{DisplayConfiguration, DisplayState, Estimate, Hold, StopReason, Trip, UpdateRate};

use crate::rig::{RATES, Rig, at, configured, sound};

/// The bound on everything that could put out a wrong voltage.
const ALL_MS: u32 = 20;
/// The bound on a Stop and on the emergency stop.
const STOP_MS: u32 = 5;
/// The fade of a hold that has to be quick.
const QUICK_MS: u32 = 8;

/// Ticks from `fault`, which is at the first of them and lasts, until all words are 0 V; the hand goes on.
fn ticks_to_zero_volt(rig: &mut Rig, fault: impl FnOnce(&mut Rig)) -> u32 {
    fault(rig);
    rig.silent_after(1_000).unwrap()
}

/// Stays at 0 V for good, with CLR released, whatever comes.
fn assert_stays_stopped(rig: &mut Rig, trip: Trip) {
    assert_eq!(rig.state(), DisplayState::Stopped(trip));
    rig.senses = Default::default();
    rig.rub_while(300, 2.0, |rig| {
        assert_eq!(rig.state(), DisplayState::Stopped(trip));
        assert!(rig.is_silent());
        assert!(!rig.output.release);
        true
    });
    rig.display.started(Ok(()));
    rig.configure(&DisplayConfiguration::DEFAULT);
    rig.display.stop(StopReason::Host);
    rig.move_on();
    assert_eq!(rig.state(), DisplayState::Stopped(trip));
    assert!(rig.is_silent() && !rig.output.release);
}

#[test]
fn a_stopped_display_is_off_once_the_converters_have_0_v_or_clr_is_low_and_not_before() {
    // The words of the tick that stops fail twice; the third time they arrive. Or CLR falls meanwhile.
    let failed = Senses {
        transfer: Transfer::Failed,
        ..Senses::default()
    };
    let clear = Senses {
        is_clear: true,
        ..failed
    };
    for last in [Senses::default(), clear] {
        let mut rig = Rig::driving(&DisplayConfiguration::DEFAULT);
        assert_eq!(rig.display.off(), None);
        rig.display.stop(StopReason::Operator);
        rig.move_on();
        assert_eq!(rig.state(), DisplayState::Stopped(Trip::Operator));
        assert_eq!(rig.display.off(), None);
        for _ in 0..2 {
            rig.senses = failed;
            rig.move_on();
            assert_eq!(rig.display.off(), None);
        }
        rig.senses = last;
        rig.move_on();
        assert_eq!(rig.display.off(), Some(Trip::Operator));
    }
}

#[test]
fn each_trip_takes_its_ticks_to_zero_volt_and_is_kept() {
    type Fault = fn(&mut Rig);
    let faults: [(Trip, u32, Fault); 8] = [
        (Trip::Operator, 1, |rig| {
            rig.display.stop(StopReason::Operator);
        }),
        (Trip::Host, 1, |rig| rig.display.stop(StopReason::Host)),
        (Trip::EmergencyStop, 2, |rig| {
            rig.senses.stop_input_open = true;
        }),
        (Trip::Converter, 2, |rig| rig.senses.alarm = true),
        (Trip::Converter, 1, |rig| {
            rig.senses.readback = Readback::Differs;
        }),
        (Trip::Converter, 1, |rig| {
            rig.display
                .started(Err(ConverterFault::Transfer { chip: 2 }));
        }),
        (Trip::Transfer, 4, |rig| {
            rig.senses.transfer = Transfer::Failed;
        }),
        (Trip::Transfer, 4, |rig| {
            rig.senses.transfer = Transfer::Stalled;
        }),
    ];
    for rate in RATES {
        for (trip, expected, fault) in faults {
            // At different phases of the wave, none of which is a crossing.
            for further_ms in [1, 3, 8, 13, 22] {
                let mut rig = Rig::driving(&at(rate));
                rig.rub(further_ms, 2.0);
                let ticks = ticks_to_zero_volt(&mut rig, fault);
                assert_eq!(ticks, expected, "{trip:?} at {rate:?}");
                assert!(ticks <= rig.ticks(ALL_MS));
                let is_stop = matches!(trip, Trip::Operator | Trip::Host | Trip::EmergencyStop);
                assert!(!is_stop || ticks <= rig.ticks(STOP_MS));
                assert!(rig.output.send, "0 V is sent");
                assert_stays_stopped(&mut rig, trip);
            }
        }
    }
}

#[test]
fn a_jump_of_the_hand_is_at_zero_volt_in_the_tick_that_shows_it() {
    for rate in RATES {
        for counts in [201, -201, 5_000, i16::MIN] {
            let mut rig = Rig::driving(&at(rate));
            assert!(!rig.tick(counts).release);
            assert!(rig.is_silent());
            assert_stays_stopped(&mut rig, Trip::HandEncoder);
            assert_eq!(rig.display.counters().encoder_jumps, 1);
        }
    }
}

#[test]
fn a_stop_in_any_state_is_obeyed_in_the_next_tick() {
    for rate in RATES {
        let boot = Rig::of(Display::new(&configured(&at(rate)), None));
        let ready = Rig::new(&at(rate));
        let driving = Rig::driving(&at(rate));
        let mut fading = Rig::driving(&at(rate));
        fading.senses.unheard = true;
        fading.move_on();
        assert_eq!(fading.state(), DisplayState::Fading(Hold::Unheard));
        for mut rig in [boot, ready, driving, fading] {
            rig.display.stop(StopReason::Operator);
            // The first one is the one that is told.
            rig.display.stop(StopReason::Host);
            rig.senses.readback = Readback::Differs;
            rig.move_on();
            assert!(rig.is_silent() && !rig.output.release);
            assert_stays_stopped(&mut rig, Trip::Converter);
        }
    }
}

#[test]
fn each_quick_hold_is_at_zero_volt_eight_milliseconds_after_it_is_found() {
    type Fault = fn(&mut Rig);
    let faults: [(Hold, Fault); 3] = [
        (Hold::Unheard, |rig| rig.senses.unheard = true),
        (Hold::Flood, |rig| {
            (0..60).for_each(|_| rig.estimate(2.0));
        }),
        (Hold::Distrust, |rig| {
            (0..5).for_each(|_| rig.tell(sound(0, f32::NAN)));
        }),
    ];
    for rate in RATES {
        for (hold, fault) in faults {
            let mut rig = Rig::driving(&at(rate));
            fault(&mut rig);
            rig.move_on();
            assert_eq!(rig.state(), DisplayState::Fading(hold));
            let ticks = 1 + rig.silent_after(1_000).unwrap();
            assert_eq!(ticks, rig.ticks(QUICK_MS), "{hold:?} at {rate:?}");
            assert_eq!(rig.state(), DisplayState::Ready);
            assert!(rig.output.release);
        }
    }
}

#[test]
fn a_quick_hold_overtakes_a_slow_fade() {
    for rate in RATES {
        let mut rig = Rig::driving(&DisplayConfiguration {
            fade_out_ms: 1_000,
            ..at(rate)
        });
        let ticks = rig.ticks(1_000);
        let stale = (0..ticks).any(|_| {
            rig.move_on();
            rig.state() == DisplayState::Fading(Hold::Stale)
        });
        assert!(stale);
        rig.move_on();
        rig.senses.unheard = true;
        let ticks = rig.silent_after(1_000).unwrap();
        assert!(ticks <= rig.ticks(QUICK_MS), "{ticks}");
    }
}

#[test]
fn a_flood_of_one_estimate_in_each_tick_is_at_zero_volt_within_thirty_three_milliseconds() {
    // 25 ms to find it, see `firmware_display::flood`, and 8 ms to fade.
    for rate in RATES {
        let mut rig = Rig::driving(&at(rate));
        let ticks = (1..).find(|_| {
            rig.estimate(2.0);
            rig.move_on();
            rig.is_silent()
        });
        assert!(ticks.unwrap() <= rig.ticks(33), "{ticks:?}");
    }
}

#[test]
fn a_dead_encoder_is_at_zero_volt_within_twenty_milliseconds() {
    for rate in RATES {
        for further_ms in 0..20 {
            let mut rig = Rig::driving(&at(rate));
            rig.rub(further_ms, 2.0);
            let last_ms = (1..=rig.ticks(ALL_MS)).find(|_| {
                rig.tick(0);
                rig.is_silent()
            });
            assert!(last_ms.is_some(), "{rate:?}");
            for _ in 0..rig.ticks(400) {
                rig.tick(0);
                assert!(rig.is_silent());
            }
        }
    }
}

#[test]
fn an_arm_that_is_said_to_move_for_three_seconds_while_the_hand_rests_is_a_contradiction() {
    for rate in RATES {
        let mut rig = Rig::driving(&at(rate));
        let mut found = None;
        for tick in 1..=rig.ticks(4_000) {
            if tick.is_multiple_of(rig.ticks(10)) {
                rig.estimate(2.0);
            }
            rig.tick(0);
            if rig.state() == DisplayState::Fading(Hold::Contradiction) {
                found = found.or(Some(tick));
            }
        }
        // The hand is seen to rest within 20 ms.
        let found = found.unwrap();
        assert!(
            (rig.ticks(3_000)..=rig.ticks(3_020)).contains(&found),
            "{found}"
        );
        assert_eq!(rig.state(), DisplayState::Ready);
        // The hand moves again: so the encoder lives.
        rig.rub(40, 2.0);
        assert_eq!(rig.state(), DisplayState::Driving);
    }
}

#[test]
fn an_arm_that_strokes_to_and_fro_while_the_hand_rests_is_a_contradiction_too() {
    let mut rig = Rig::driving(&at(UpdateRate::Hz2000));
    let contradicted = (1..=rig.ticks(5_000)).any(|tick| {
        if tick.is_multiple_of(rig.ticks(10)) {
            // 0.83 Hz, with some 60 ms below 10 mm/s at each end.
            let turns = f64::from(tick) / f64::from(rig.ticks(1_000)) * 0.83;
            let velocity_um_s = (70_000.0 * (std::f64::consts::TAU * turns).sin()) as i32;
            rig.tell(Estimate {
                velocity_um_s,
                ..sound(0, 2.0)
            });
        }
        rig.tick(0);
        rig.state() == DisplayState::Fading(Hold::Contradiction)
    });
    assert!(contradicted);
}

#[test]
fn an_arm_that_stops_a_second_after_the_hand_is_none() {
    for rate in RATES {
        let mut rig = Rig::driving(&at(rate));
        for tick in 1..=rig.ticks(10_000) {
            let moves = tick % rig.ticks(4_000) < rig.ticks(2_900);
            if tick.is_multiple_of(rig.ticks(10)) {
                rig.tell(Estimate {
                    velocity_um_s: if moves { -70_000 } else { 9_000 },
                    ..sound(0, 2.0)
                });
            }
            rig.tick(0);
            assert_eq!(rig.state(), DisplayState::Driving);
        }
    }
}

#[test]
fn outputs_that_were_cleared_begin_again_from_zero_volt_and_fade_in() {
    for rate in RATES {
        // At different phases of the wave: at a crossing all words are 0 V anyway.
        for further_ms in [0, 1, 3, 8, 13, 22] {
            let fade_in_ms = 100;
            let mut rig = Rig::driving(&DisplayConfiguration {
                fade_in_ms,
                ..at(rate)
            });
            rig.rub(further_ms, 2.0);
            rig.senses.clear_fell = true;
            rig.senses.missed_ticks = 3;
            rig.estimate(2.0);
            let Output { send, release } = rig.move_on();
            assert!(send && release && rig.is_silent(), "{further_ms} ms");
            rig.senses = Default::default();
            assert_eq!(rig.display.counters().clears, 1);
            let ticks = rig.rub_while(100, 2.0, |rig| rig.is_silent());
            assert!(ticks <= rig.ticks(2));
            assert_eq!(rig.state(), DisplayState::Driving);
            for passed in ticks..rig.ticks(fade_in_ms.into()) {
                // What has passed of the fade, of 5 V, and the step that rounds.
                let most = 32_767 * (passed + 1) / rig.ticks(fade_in_ms.into()) + 1;
                let words = rig.display.words();
                assert!(
                    words
                        .iter()
                        .all(|word| u32::from(word.abs_diff(ZERO_VOLT)) <= most),
                    "{passed} ticks after {further_ms} ms"
                );
                rig.rub_while(1, 2.0, |_| false);
            }
        }
    }
}

#[test]
fn the_stimulus_fades_out_at_the_configured_age_and_in_again_at_the_next_trusted_estimate() {
    for rate in RATES {
        let configuration = DisplayConfiguration {
            max_age_ms: 100,
            fade_out_ms: 30,
            ..at(rate)
        };
        let mut rig = Rig::driving(&configuration);
        // Not at a crossing.
        rig.rub(1, 2.0);
        rig.estimate(2.0);
        let ticks = rig.stays_silent_after(1_000).unwrap();
        assert_eq!(ticks, rig.ticks(100 + 30));
        assert_eq!(rig.state(), DisplayState::Ready);
        assert_eq!(rig.display.counters().fades, 1);
        (0..1_000).for_each(|_| {
            assert!(!rig.move_on().send, "silence is not sent again");
        });
        rig.estimate(3.0);
        rig.move_on();
        assert_eq!(rig.state(), DisplayState::Driving);
        assert_eq!(rig.display.counters().fades, 1);
    }
}
