//! No channel keeps a standing voltage, in which an ionic polymer gel would electrolyse.
//!
//! A sine has no mean over its cycles, but a hand that trembles about one place of the surface plays a
//! part of a cycle to and fro. So each channel's charge q = ∫ a y dt, of what goes out with an amplitude of a
//! times 5 V, is kept, and what is too much of it is worked off:
//!
//! y = s − m, m = e/τ, where e is by how much q is beyond the room it is given, and |m| ≤ 1.
//!
//! q counts volts, so that what a strong part of a surface leaves is not taken for made good by as much of a weak
//! one. A weak one works it off more slowly, with τ/a.
//!
//! A sine of ω goes through 2/ω of charge, wherever in the wave it begins. So a wave that gets on, by a turn
//! in the time of one of [`SLOWEST_HZ`] at least, is given a room of ± [`MARGIN`] · 2/ω, and is let alone. Any
//! other is none that is felt: a hand that trembles, or creeps, or turns back. Then, and when a charge is
//! beyond its room, as after a slower wave, none is given for [`WORKING_S`]. What remains is a first-order
//! high-pass, which brings the charge back to the middle, from where a wave does not come near its room.
//! The charge of a channel is never beyond ± [`MOST_S`] times 5 V, so that whatever repeats has no
//! mean at all; and what is too much is worked off with [`TIME_CONSTANT_S`].
//!
//! What is beyond a tick's limit of steepness is cut off here, before it is counted: a charge is that of what goes out.
//!
//! Channels that play the same lane have the same q, the lane's, since it counts before gains. A new description of the
//! actuators takes each channel's charge along ([`Balance::carry`]). Where channels of different charges come to share
//! a lane, each is balanced by itself until at a rest their charges are alike ([`Sharing::Each`], [`Balance::meet`]). So
//! that they get alike, none is given room for [`MEETING_S`].

use core::f64::consts::PI;

use protocol::UpdateRate;

use crate::ACTUATORS;
use crate::pace::RateChange;
use crate::sine::ONE;

/// τ in ticks is 2 to this at 2 kHz.
const SHIFT: u32 = 9;
/// τ at 5 V, at either rate.
pub const TIME_CONSTANT_S: f64 = (1 << SHIFT) as f64 / UpdateRate::Hz2000.hz() as f64;
/// How much more room a wave is given than it needs, and how much less it may get on: the encoder's counts
/// make it uneven.
pub const MARGIN: f64 = 1.25;
/// The slowest sine that is let alone, in Hz.
pub const SLOWEST_HZ: f64 = 5.0;
/// The most of any channel's charge, in 5 V times seconds: τ, and what the room adds that is given
/// until the next look and taken away again.
pub const MOST_S: f64 = 1.1 * TIME_CONSTANT_S;

const _: () = assert!(UpdateRate::Hz4000.hz() == 2 * UpdateRate::Hz2000.hz());

/// 5 V for [`TIME_CONSTANT_S`], in a charge's scale.
const CHARGE: f64 = (1 << 30) as f64;
/// The room of a wave of [`SLOWEST_HZ`].
const MOST_ROOM: f32 = (CHARGE * MARGIN / (PI * SLOWEST_HZ) / TIME_CONSTANT_S) as f32;
/// Room times the wave's turn a tick (turns / 2³²), at 2 kHz: half of it at 4 kHz.
const ROOM_AND_TURN: f32 = (CHARGE * MARGIN * crate::phase::TURN
    / (PI * TIME_CONSTANT_S * UpdateRate::Hz2000.hz() as f64)) as f32;
/// What a wave has to get on by in a period of [`SLOWEST_HZ`], in turns / 2³².
const ENOUGH: u64 = (crate::phase::TURN / MARGIN) as u64;
/// The room is changed with a time constant of τ over 2 to this, 16 ms.
const SOFTLY: u32 = 4;
/// Ticks from one look for charges beyond their room to the next.
const LOOK_TICKS: u32 = 16;
/// How long a charge beyond its room is worked off, in s: four time constants leave a 50th of it.
pub const WORKING_S: f32 = 1.024;

/// The most that a weaker gain makes of a charge, in its scale: so much that no room is left for more.
const MOST_CARRIED: f32 = 1.5 * CHARGE as f32;

/// Charges that differ by no more, by 0.16 mV·s, are alike.
const ALIKE: u32 = 1 << 17;
/// After so long at full amplitude, in s, the most different charges are alike: τ ln(2 · 1.5 · 2³⁰ / 2¹⁷).
pub const MEETING_S: f32 = 10.2 * TIME_CONSTANT_S as f32;

/// Which channels have the same charge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sharing {
    /// All: a single lane may stand for them.
    All,
    /// Those of a lane.
    Lanes,
    /// None, or none that helps.
    Each,
}

/// What becomes of the lanes in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    /// What they are going to be multiplied with, in Q30: 0 to 2³⁰, which is 5 V.
    pub gain: u32,
    /// By how much the wave turns, in turns / 2³².
    pub turn: i32,
    /// The most that a channel's voltage changes by, in steps of its DAC: 1 to 65 536, which are 10 V.
    pub most_steps: i32,
    /// So many ticks there are.
    pub rate: UpdateRate,
}

/// How the channels get what they play.
#[derive(Clone, Copy, Debug)]
pub struct Channels<'a> {
    /// Which lane each plays; the lanes are in the order of the first channels that play them.
    pub lane_of: &'a [u8; ACTUATORS],
    /// The gains in Q30, negative for the opposite voltage.
    pub gains_q30: &'a [i32; ACTUATORS],
}

/// Each channel's charge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Balance {
    /// q, before gains: 2³⁰ is 5 V for τ. Of all channels, of each lane or of each channel, as they are shared.
    charges: [i32; ACTUATORS],
    /// What each channel has besides, behind its gain: more than it can work off with that.
    owed: [i32; ACTUATORS],
    /// What went out in the tick before, for each of `charges`: 2²⁹ is 5 V.
    voltages: [i32; ACTUATORS],
    sharing: Sharing,
    /// What a charge may be, on its way to what it should.
    room: i32,
    /// Ticks for which no room is given, to bring charges back to the middle.
    working: u32,
    /// How far the wave has got in this period of [`SLOWEST_HZ`], in turns / 2³², and for how long it has.
    way: i64,
    ticks: u32,
    /// 1 or −1, and 0 at first.
    direction: i32,
}

impl Default for Balance {
    fn default() -> Self {
        Self {
            charges: [0; ACTUATORS],
            owed: [0; ACTUATORS],
            voltages: [0; ACTUATORS],
            sharing: Sharing::All,
            room: MOST_ROOM as i32,
            working: 0,
            way: 0,
            ticks: 0,
            direction: 0,
        }
    }
}

impl Balance {
    /// Which channels have the same charge.
    pub const fn sharing(&self) -> Sharing {
        self.sharing
    }

    /// Ticks last another time from now on.
    pub const fn change_rate(&mut self, change: RateChange) {
        self.working = change.ticks(self.working);
        self.ticks = change.ticks(self.ticks);
    }

    /// All outputs have gone to 0 V.
    pub const fn silence(&mut self) {
        self.voltages = [0; ACTUATORS];
    }

    /// Takes each channel's charge along from how it was played to how it is going to be, while nothing is played.
    pub fn carry(&mut self, before: Channels<'_>, after: Channels<'_>, rate: UpdateRate) {
        let mut charges = [0; ACTUATORS];
        for (channel, new) in charges.iter_mut().enumerate() {
            let place = match self.sharing {
                Sharing::All => 0,
                Sharing::Lanes => usize::from(before.lane_of[channel]),
                Sharing::Each => channel,
            };
            let charge = self.charges.get(place).copied().unwrap_or(0);
            let [gain, next] = [before, after].map(|channels| channels.gains_q30[channel]);
            let owed = &mut self.owed[channel];
            if gain == next && *owed == 0 {
                *new = charge;
                continue;
            }
            *owed += behind(gain, charge);
            if next != 0 {
                let wanted = *owed as f32 / next as f32 * CHARGE as f32;
                *new = wanted.clamp(-MOST_CARRIED, MOST_CARRIED) as i32;
            }
            *owed -= behind(next, *new);
        }
        self.share(charges, after, rate);
        self.silence();
    }

    /// Lets channels share their lanes if by now they have charges alike; while nothing is played.
    pub fn meet(&mut self, channels: Channels<'_>, rate: UpdateRate) {
        if self.sharing == Sharing::Each {
            self.share(self.charges, channels, rate);
        }
    }

    /// Takes charges of each channel, shared as far as they are alike.
    fn share(&mut self, charges: [i32; ACTUATORS], channels: Channels<'_>, rate: UpdateRate) {
        let mut ranges: [Option<(i32, i32)>; ACTUATORS] = [None; ACTUATORS];
        for (&charge, &lane) in charges.iter().zip(channels.lane_of) {
            if let Some(range) = ranges.get_mut(usize::from(lane)) {
                let (low, high) = range.unwrap_or((charge, charge));
                *range = Some((low.min(charge), high.max(charge)));
            }
        }
        let widest = ranges
            .iter()
            .flatten()
            .map(|(low, high)| high.abs_diff(*low));
        if widest.max() > Some(ALIKE) {
            self.sharing = Sharing::Each;
            self.charges = charges;
            self.work_off(MEETING_S, rate);
            return;
        }
        self.charges = ranges.map(|range| range.map_or(0, |(low, high)| low.midpoint(high)));
        let first = self.charges[0];
        let mut lanes = ranges.iter().zip(&self.charges);
        let all = lanes.all(|(range, charge)| range.is_none() || *charge == first);
        self.sharing = if all { Sharing::All } else { Sharing::Lanes };
        for (channel, owed) in self.owed.iter_mut().enumerate() {
            let of_lane = self.charges.get(usize::from(channels.lane_of[channel]));
            let differs = charges[channel] - of_lane.copied().unwrap_or(0);
            *owed += behind(channels.gains_q30[channel], differs);
        }
    }

    /// Takes what works off too much charge off each of `lanes` (Q28, within ± [`ONE`]), and what is too steep, to within
    /// ± [`ONE`] again. There are as many lanes as [`Balance::sharing`] says: a single one
    /// stands for all channels; more than that while all are shared part them into lanes.
    pub fn remove(&mut self, lanes: &mut [i32], drive: Drive) {
        let Drive {
            gain,
            turn,
            most_steps,
            rate,
        } = drive;
        if self.sharing == Sharing::All && lanes.len() > 1 {
            self.charges = [self.charges[0]; ACTUATORS];
            self.voltages = [self.voltages[0]; ACTUATORS];
            self.sharing = Sharing::Lanes;
        }
        let (shift, room_and_turn) = match rate {
            UpdateRate::Hz2000 => (SHIFT, ROOM_AND_TURN),
            UpdateRate::Hz4000 => (SHIFT + 1, ROOM_AND_TURN / 2.0),
        };
        self.watch(turn, rate);
        self.working = self.working.saturating_sub(1);
        let needed = if self.working == 0 {
            (room_and_turn / turn.unsigned_abs() as f32).min(MOST_ROOM) as i32
        } else {
            0
        };
        self.room += (needed - self.room) >> (shift - SOFTLY);
        let room = self.room;
        // gain/τ in Q34.
        let part = i64::from(gain >> (shift - 4));
        let most = most_steps << VOLTAGE_BITS_OF_A_STEP;
        let charges = self.charges.iter_mut().zip(&mut self.voltages);
        for (lane, (charge, before)) in lanes.iter_mut().zip(charges) {
            let beyond = *charge - (*charge).clamp(-room, room);
            // What is beyond may ask for more than there is.
            let mut rest = (*lane - (beyond >> 2)).clamp(-ONE, ONE - 1);
            let mut added = added_by(rest, part);
            let voltage = added << (shift - 1);
            if (voltage - *before).abs() > most {
                let steepest = *before + (voltage - *before).clamp(-most, most);
                rest = lane_of(steepest, gain);
                added = added_by(rest, part);
            }
            *charge += added;
            *before = added << (shift - 1);
            *lane = rest;
        }
        if self.ticks.is_multiple_of(LOOK_TICKS) && self.working == 0 {
            // Not beyond the room as it is: that may still be growing.
            let charges = &self.charges[..lanes.len()];
            if charges.iter().any(|charge| charge.abs() > needed) {
                self.work_off(WORKING_S, rate);
            }
        }
    }

    /// Looks whether the wave gets on, once in a period of the slowest, and does not turn back.
    fn watch(&mut self, turn: i32, rate: UpdateRate) {
        if turn.signum() * self.direction < 0 {
            self.work_off(WORKING_S, rate);
        }
        if turn != 0 {
            self.direction = turn.signum();
        }
        self.way += i64::from(turn);
        self.ticks += 1;
        if self.ticks >= rate.hz() / SLOWEST_HZ as u32 {
            if self.way.unsigned_abs() < ENOUGH {
                self.work_off(WORKING_S, rate);
            }
            self.way = 0;
            self.ticks = 0;
        }
    }

    /// No room is given for a while.
    fn work_off(&mut self, seconds: f32, rate: UpdateRate) {
        self.working = self.working.max((seconds * rate.hz() as f32) as u32);
    }
}

/// Steps of the DAC in [`Balance::voltages`] are shifted by so many bits: 2¹⁵ are 5 V.
const VOLTAGE_BITS_OF_A_STEP: u32 = 29 - 15;

/// What a lane adds to a charge in a tick, `part` of it. Rounded to the nearest, so that no charge comes of rounding.
#[inline]
fn added_by(lane: i32, part: i64) -> i32 {
    ((i64::from(lane) * part + (1 << 31)) >> 32) as i32
}

/// The lane that gives a voltage of [`Balance::voltages`], or what is nearest to it.
#[cold]
fn lane_of(voltage: i32, gain: u32) -> i32 {
    // Without a gain none is given.
    let lane = voltage as f32 / gain.max(1) as f32 * (1 << 29) as f32;
    (lane as i32).clamp(-ONE, ONE - 1)
}

/// A charge behind a gain.
fn behind(gain_q30: i32, charge: i32) -> i32 {
    ((i64::from(gain_q30) * i64::from(charge)) >> 30) as i32
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;
    use std::vec::Vec;

    use super::*;
    use crate::gate::OPEN;

    /// As steep as can be.
    const fn drive(gain: u32, turn: i32, rate: UpdateRate) -> Drive {
        Drive {
            gain,
            turn,
            most_steps: 65_536,
            rate,
        }
    }

    const RATES: [UpdateRate; 2] = [UpdateRate::Hz2000, UpdateRate::Hz4000];

    /// What comes out of the balance for each of the ticks of `seconds`: the sine of `turns(t)`, times
    /// `gain(t)`.
    fn balanced(
        rate: UpdateRate,
        seconds: f64,
        turns: impl Fn(f64) -> f64,
        gain: impl Fn(f64) -> f64,
    ) -> Vec<f64> {
        let hz = f64::from(rate.hz());
        let mut balance = Balance::default();
        (0..(seconds * hz) as u32)
            .map(|tick| {
                let t = f64::from(tick) / hz;
                let mut lane = [((TAU * turns(t)).sin() * f64::from(ONE)) as i32];
                let turn = (turns(t) - turns(t - 1.0 / hz)) * crate::phase::TURN;
                let gain = gain(t);
                let gain_q30 = (gain * f64::from(OPEN)) as u32;
                balance.remove(&mut lane, drive(gain_q30, turn as i32, rate));
                gain * f64::from(lane[0]) / f64::from(ONE)
            })
            .collect()
    }

    fn mean(samples: &[f64]) -> f64 {
        samples.iter().sum::<f64>() / samples.len() as f64
    }

    #[test]
    fn a_sine_from_five_hertz_on_is_let_alone_wherever_it_begins() {
        for rate in RATES {
            for hz in [5.0, 7.5, 35.0, 200.0] {
                for start in 0..8 {
                    let turns = |t: f64| f64::from(start) / 8.0 + hz * t;
                    let samples = balanced(rate, 3.0, turns, |_| 1.0);
                    for (tick, sample) in samples.iter().enumerate() {
                        let exact = (TAU * turns(tick as f64 / f64::from(rate.hz()))).sin();
                        // Cast down, and the highest is not quite one.
                        assert!((sample - exact).abs() <= 2.0 / f64::from(ONE), "{hz} Hz");
                    }
                }
            }
        }
    }

    #[test]
    fn what_repeats_keeps_no_mean_whatever_the_gain_does_meanwhile() {
        // A wobble of 5 Hz about a place, with a gain that goes to 0 at one of its ends.
        let gain = |t: f64| (0.5 + 0.6 * (TAU * 5.0 * t).sin()).clamp(0.0, 1.0);
        for rate in RATES {
            for place in 0..8 {
                let wobble = |t: f64| f64::from(place) / 8.0 + 0.08 * (TAU * 5.0 * t).sin();
                let samples = balanced(rate, 10.0, wobble, gain);
                let last_second = &samples[9 * rate.hz() as usize..];
                // The rest of 9 s, some ten mean gains of ½ over τ, and rounding.
                let bound = (-9.0 * 0.4 / TIME_CONSTANT_S).exp() + 1e-7;
                assert!(mean(last_second).abs() <= bound, "{}", mean(last_second));
            }
        }
    }

    #[test]
    fn a_standing_signal_is_worked_off_with_the_time_constant_once_there_is_no_room_for_it() {
        for rate in RATES {
            let samples = balanced(rate, 3.0, |_| 0.125, |_| 1.0);
            let stands = 0.5_f64.sqrt();
            // The room is full, then gone 0.2 s after the start, and its charge is to be worked off with
            // the rest's.
            for (tick, sample) in samples.iter().enumerate() {
                let t = tick as f64 / f64::from(rate.hz());
                if t < MARGIN / (PI * SLOWEST_HZ) / stands {
                    assert!((sample - stands).abs() <= 2.0 / f64::from(ONE));
                } else if t > 0.4 {
                    let decayed = (-(t - 0.4) / TIME_CONSTANT_S).exp();
                    assert!(
                        *sample <= stands * decayed + 1e-6 && *sample >= -1e-6,
                        "{t} s"
                    );
                }
            }
        }
    }

    #[test]
    fn the_charge_never_leaves_its_bound() {
        for rate in RATES {
            // The worst there is: full voltage the one way until it is worked off, then the other, while
            // the wave seems to get on slowly.
            let mut balance = Balance::default();
            let (mut charge_s, mut most_s) = (0.0_f64, 0.0_f64);
            let turn = (SLOWEST_HZ / f64::from(rate.hz()) * crate::phase::TURN) as i32;
            for tick in 0..8 * rate.hz() {
                let crest = tick / (4 * rate.hz()) == 0;
                let mut lane = [if crest { ONE - 1 } else { -ONE }];
                balance.remove(&mut lane, drive(OPEN, turn, rate));
                charge_s += f64::from(lane[0]) / f64::from(ONE) / f64::from(rate.hz());
                most_s = most_s.max(charge_s.abs());
            }
            // A tick may go beyond.
            assert!(most_s <= MOST_S + 1.0 / f64::from(rate.hz()), "{most_s}");
            assert!(most_s >= 0.9 * MOST_S, "the bound is not idle: {most_s}");
        }
    }

    #[test]
    fn room_changes_softly() {
        for rate in RATES {
            let mut balance = Balance::default();
            let ticks = f64::from(rate.hz()) * TIME_CONSTANT_S / f64::from(1 << SOFTLY);
            // 250 Hz at 2 kHz, then a hand that stands still, then 250 Hz again.
            for turn in [1 << 29, 0, 1 << 29] {
                for _ in 0..2 * rate.hz() {
                    let before = balance.room;
                    balance.remove(&mut [0], drive(OPEN, turn, rate));
                    let most = f64::from(MOST_ROOM) / ticks + 2.0;
                    assert!(f64::from((before - balance.room).abs()) <= most);
                }
                let of_rate = 2_000.0 / f64::from(rate.hz());
                let needed = match turn {
                    0 => 0.0,
                    turn => f64::from(ROOM_AND_TURN) / f64::from(turn) * of_rate,
                };
                // Shifting stops a step of 2⁶ short.
                assert!((f64::from(balance.room) - needed).abs() <= 64.0);
            }
        }
    }

    #[test]
    fn a_charge_from_a_slower_wave_is_gone_in_a_second_and_the_faster_one_is_let_alone_again() {
        for rate in RATES {
            for start in 0..8 {
                // 5 Hz for a second, then 35 Hz.
                let turns =
                    |t: f64| f64::from(start) / 8.0 + 5.0 * t.min(1.0) + 35.0 * (t - 1.0).max(0.0);
                let samples = balanced(rate, 4.0, turns, |_| 1.0);
                let settled = (2.3 * f64::from(rate.hz())) as usize;
                for (tick, sample) in samples.iter().enumerate().skip(settled) {
                    let exact = (TAU * turns(tick as f64 / f64::from(rate.hz()))).sin();
                    assert!((sample - exact).abs() <= 2.0 / f64::from(ONE), "{start}");
                }
            }
        }
    }

    #[test]
    fn lanes_that_were_shared_part_from_where_they_were() {
        let mut balance = Balance::default();
        (0..600).for_each(|_| balance.remove(&mut [ONE / 2], drive(OPEN, 0, UpdateRate::Hz2000)));
        let mut lanes = [ONE / 2; ACTUATORS];
        assert_eq!(balance.sharing(), Sharing::All);
        balance.remove(&mut lanes, drive(OPEN, 0, UpdateRate::Hz2000));
        assert_eq!(balance.sharing(), Sharing::Lanes);
        assert!(lanes.iter().all(|&lane| lane == lanes[0] && lane < ONE / 2));
    }

    /// Lanes of two channels each; gains of 1, but `gain` of the first two.
    fn channels(gain: i32) -> ([u8; ACTUATORS], [i32; ACTUATORS]) {
        let mut gains = [1 << 30; ACTUATORS];
        gains[..2].fill(gain);
        (core::array::from_fn(|channel| channel as u8 / 2), gains)
    }

    #[test]
    fn a_charge_goes_along_through_other_gains_and_back() {
        for gain in [1 << 29, 1 << 20, 1 << 15, 0, -1 << 30, -1 << 15] {
            let mut balance = Balance::default();
            let lane = |lane: i32| ONE / 30 * (lane - 12);
            for _ in 0..400 {
                let mut lanes: [i32; ACTUATORS / 2] = core::array::from_fn(|n| lane(n as i32));
                balance.remove(&mut lanes, drive(OPEN, 0, UpdateRate::Hz2000));
            }
            let [(lane_of, whole), (_, other)] = [1 << 30, gain].map(channels);
            let [first, second] = [&whole, &other].map(|gains_q30| Channels {
                lane_of: &lane_of,
                gains_q30,
            });
            let before = balance.clone();
            assert!(before.charges[0] < -(1 << 28));
            balance.carry(first, second, UpdateRate::Hz2000);
            assert_eq!(balance.sharing(), Sharing::Lanes);
            assert_eq!(balance.charges[1..25], before.charges[1..25]);
            // All of it is there, and of the right sign; no more than can be worked off is with the lane.
            let carried = i64::from(behind(gain, balance.charges[0])) + i64::from(balance.owed[0]);
            assert!(
                (carried - i64::from(before.charges[0])).abs() <= 2,
                "{gain}"
            );
            assert!(i64::from(balance.charges[0]) * i64::from(gain) <= 0);
            assert!(balance.charges[0].abs() <= MOST_CARRIED as i32);
            balance.carry(second, first, UpdateRate::Hz2000);
            assert!(
                balance.charges[0].abs_diff(before.charges[0]) <= 64,
                "{gain}"
            );
            assert!(balance.owed[0].abs() <= 64);
        }
    }

    #[test]
    fn channels_share_a_lane_only_while_their_charges_are_alike() {
        let (pairs, gains) = channels(1 << 30);
        let mut halves = [0; ACTUATORS];
        halves[25..].fill(1);
        let of = |lane_of| Channels {
            lane_of,
            gains_q30: &gains,
        };
        let mut balance = Balance::default();
        balance.carry(of(&pairs), of(&halves), UpdateRate::Hz2000);
        assert_eq!(balance.sharing(), Sharing::All);
        balance.remove(&mut [ONE, -ONE], drive(OPEN, 0, UpdateRate::Hz2000));
        let [up, down, ..] = balance.charges;
        // The middle pair has a channel of either half.
        balance.carry(of(&halves), of(&pairs), UpdateRate::Hz2000);
        assert_eq!(balance.sharing(), Sharing::Each);
        assert!(balance.charges[..25].iter().all(|charge| *charge == up));
        assert!(balance.charges[25..].iter().all(|charge| *charge == down));
        balance.carry(of(&pairs), of(&halves), UpdateRate::Hz2000);
        assert_eq!(balance.sharing(), Sharing::Lanes);
        assert_eq!(balance.charges[..2], [up, down]);
        // And alike they become, when they have been played for a while.
        balance.carry(of(&halves), of(&pairs), UpdateRate::Hz2000);
        for ticks in [400, (MEETING_S * 2_000.0) as u32] {
            balance.meet(of(&pairs), UpdateRate::Hz2000);
            assert_eq!(balance.sharing(), Sharing::Each);
            for tick in 0..ticks {
                let mut lanes = [crate::sine::sine(tick << 28); ACTUATORS];
                balance.remove(&mut lanes, drive(OPEN, 1 << 28, UpdateRate::Hz2000));
            }
        }
        balance.meet(of(&pairs), UpdateRate::Hz2000);
        assert_eq!(balance.sharing(), Sharing::Lanes);
        let most = balance.owed.map(i32::unsigned_abs);
        assert!(most.iter().all(|owed| *owed <= ALIKE / 2), "{most:?}");
    }
}
