//! A link as bad as it may be is no reason to hold.

use std::collections::BTreeMap;

use protocol::{DisplayState, UpdateRate};

use crate::rig::{RATES, Rig, at, sound};

/// SplitMix64 (Steele et al. 2014).
struct Dice(u64);

impl Dice {
    /// From 0 to 1.
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }
}

/// Two minutes of strokes of 0.83 Hz over specimens of 1 to 4 mm, with an estimate every 10 ms that is off
/// by up to 3 % and arrives after `delay_ms` and up to 50 ms more, if it is not among the 20 % that get
/// lost. How often the state changed once it drove.
fn changes_over(rate: UpdateRate, delay_ms: u32) -> u32 {
    let mut rig = Rig::new(&at(rate));
    let mut dice = Dice(7 + u64::from(delay_ms));
    // Estimates by the tick of their arrival, in the order of sending among those of one tick.
    let mut under_way: BTreeMap<(u32, u32), (u32, f32)> = BTreeMap::new();
    let mut changes = None;
    let mut position = 0;
    for tick in 0..rig.ticks(120_000) {
        let t_s = f64::from(tick) / f64::from(rate.hz());
        if tick.is_multiple_of(rig.ticks(10)) {
            let sequence = tick / rig.ticks(10);
            let specimen_mm = [1.0, 4.0, 2.0, 3.0][t_s as usize / 3 % 4];
            let mm = specimen_mm * (1.0 + 0.06 * (dice.roll() - 0.5));
            let late_ms = f64::from(delay_ms) + 50.0 * dice.roll();
            let due = tick + (late_ms * f64::from(rate.hz()) / 1_000.0) as u32;
            if dice.roll() > 0.2 {
                under_way.insert((due, sequence), (sequence, mm as f32));
            }
        }
        while under_way
            .first_key_value()
            .is_some_and(|(due, _)| due.0 <= tick)
        {
            let (_, (sequence, mm)) = under_way.pop_first().unwrap();
            rig.display.on_estimate(&sound(sequence, mm));
        }
        // 70 mm/s at most, in counts of 5 µm.
        let omega = std::f64::consts::TAU * 0.83;
        let here = (70.0 / omega * (omega * t_s).sin() / 0.005).round() as i32;
        rig.tick((here - position) as i16);
        position = here;
        if changes.is_none() && rig.state() == DisplayState::Driving {
            changes = Some(rig.display.counters().changes);
        }
    }
    assert_eq!(rig.state(), DisplayState::Driving);
    rig.display.counters().changes - changes.unwrap()
}

#[test]
fn half_a_second_of_delay_with_loss_and_jitter_is_never_a_hold() {
    for rate in RATES {
        for delay_ms in [0, 100, 250, 500] {
            assert_eq!(changes_over(rate, delay_ms), 0, "{rate:?}, {delay_ms} ms");
        }
    }
}
