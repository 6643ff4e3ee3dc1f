//! A hand that rests, and one that sets out again.

use protocol::Mode;

use crate::stimulus::rig::{MODES, RATES, Rig};

/// What the last count may be followed by before all is at 0 V, in ms.
const GONE_MS: f64 = 19.0;

#[test]
fn every_word_is_exactly_0_v_within_19_ms_of_the_last_count_whatever_the_phase() {
    for rate in RATES {
        for mode in MODES {
            for phase in 0..200 {
                let mut rig = Rig::new(mode, rate);
                rig.follow(2.0);
                // 14 counts more stop two counts further each.
                rig.rub(300, 7);
                rig.rub(phase, 2);
                // 400 counts are a cycle, which is at 0 V twice by itself.
                let crosses = (7 * 300 + 2 * phase).is_multiple_of(200);
                assert_eq!(rig.is_silent(), crosses && mode == Mode::Uniform, "{phase}");
                let ticks = (GONE_MS * 1e-3 * rig.hz()) as usize;
                rig.rub(ticks, 0);
                assert!(rig.is_silent(), "{rate:?} {mode:?} {phase}");
                for volts in rig.rub(500, 0) {
                    assert_eq!(volts, [0.0; 50]);
                }
            }
        }
    }
}

#[test]
fn an_encoder_that_trembles_by_a_count_is_at_rest_too() {
    for rate in RATES {
        let mut rig = Rig::new(Mode::Travelling, rate);
        rig.follow(2.0);
        rig.rub(300, 7);
        let ticks = (GONE_MS * 1e-3 * rig.hz()) as usize;
        for tick in 0..1_000 {
            rig.tick(if tick % 2 == 0 { -1 } else { 1 });
            assert!(tick < ticks || rig.is_silent());
        }
        assert!(rig.stimulus.is_resting());
    }
}

#[test]
fn a_hand_at_rest_sends_nothing_and_a_new_wavelength_is_not_felt() {
    for mode in MODES {
        let mut rig = Rig::new(mode, RATES[0]);
        rig.follow(2.0);
        rig.rub(300, 7);
        rig.rub(38, 0);
        for tick in 0..1_000 {
            rig.follow(1.0 + f64::from(tick) * 0.01);
            assert!(!rig.stimulus.tick(0, crate::stimulus::rig::FULL));
        }
        assert!(rig.is_silent());
    }
}

#[test]
fn the_whole_is_there_again_six_milliseconds_after_setting_out_with_the_phase_of_the_place() {
    for rate in RATES {
        for mode in MODES {
            let mut rig = Rig::new(mode, rate);
            rig.follow(2.0);
            let mut never_rested = rig.stimulus.clone();
            never_rested.tick(300, 0);
            rig.tick(300);
            let rest = rig.ticks(1.0);
            rig.rub(rest, 0);
            // Seven counts a tick from there, after a rest and without one: the same place, so the same
            // phase; the balances differ by f₀/f of 5 V.
            let mut twin = Rig::new(mode, rate);
            twin.follow(2.0);
            twin.rub(300, 1);
            let ramp = rig.ticks(0.006) + 1;
            for tick in 0..200 {
                let (volts, twins) = (rig.tick(7), twin.tick(7));
                if tick < ramp {
                    continue;
                }
                for (volt, twin) in volts.iter().zip(twins) {
                    let balances = 2.0 * 5.0 * 400.0 * crate::stimulus::rig::corner_hz() / rig.hz();
                    assert!((volt - twin).abs() <= balances, "{tick}: {volt} {twin}");
                }
            }
        }
    }
}

#[test]
fn silence_is_0_v_at_once_and_what_follows_begins_softly() {
    for mode in MODES {
        let mut rig = Rig::new(mode, RATES[0]);
        rig.follow(2.0);
        rig.rub(300, 7);
        assert!(!rig.is_silent());
        rig.stimulus.silence();
        assert!(rig.is_silent());
        rig.gain = 0;
        rig.rub(100, 7);
        assert!(rig.is_silent());
        rig.gain = crate::stimulus::rig::FULL;
        let volts = rig.rub(1, 7);
        // The smoothstep's first of 12.
        let part: f64 = (1.0_f64 / 12.0).powi(2) * 3.0;
        assert!(crate::stimulus::rig::largest(&volts[0]) <= 5.0 * part);
    }
}
