//! The slave arm follows the operator's hand: [`Motion`]s in, PWM duty and direction out.

use protocol::{ArmState, Motion, Trip};

use crate::MICROMETRES_PER_COUNT;

/// Milliseconds without a [`Motion`] after which the arm stands still.
pub const SILENCE_MS: u32 = 100;
/// kp: the velocity that an error of position adds, in µm/s per µm. The error decays with a time
/// constant of 1/kp, 100 ms: slow beside the drive, so that no drive of this kind oscillates with it.
const POSITION_GAIN_PER_S: i64 = 10;
/// Commands below this part of full speed are not what a stall is seen by: so weak a one a drive may not obey.
const WEAK_PART: u32 = 20;
/// An arm that has not left its place by more than this while it was told to go as far as full speed brings it in
/// [`STALLED_MS`] has stalled, in µm: two counts, which an encoder may tremble by.
const TREMBLE_UM: u64 = 2 * MICROMETRES_PER_COUNT as u64;
/// See [`TREMBLE_UM`]. From rest, a drive with a lag as long as the controller can bear, 100 ms, takes 3 ms to leave them
/// at 200 mm/s.
const STALLED_MS: u32 = 50;
/// The same as a way, in nm, where full speed is slow: that drive takes 45 ms at 1 mm/s, and a coarse encoder has to show.
const STALLED_NM: u32 = 1_000_000;
/// Errors of position are taken for no larger than this, in µm: any such error asks for full speed, and
/// whatever number a frame carries, nothing overflows.
const MAX_ERROR_UM: i64 = 1_000_000;

/// What a hand may be away from where its last motion would have it, in µm a µs since then and in µm: it turns from no
/// more than 2 m/s. What is further away is another hand, with a zero of its own. An arm that goes further has an encoder
/// that has jumped.
const MOST_TURN_M_S: u64 = 2;
/// See [`MOST_TURN_M_S`].
const LEAST_TURN_UM: u64 = 1_000;
/// Longest time between two motions of a hand that is followed, by its own clock, in µs: the silence, and what a network
/// may hold up.
const LONGEST_GAP_US: u64 = 500_000;

/// What the arm's servo drive gets: its velocity command as PWM and a direction pin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drive {
    /// PWM high time, 0 to [`Drive::FULL`].
    pub duty: u16,
    /// Towards larger x.
    pub forward: bool,
}

impl Drive {
    /// The duty of 100 %, which asks for the configured full-scale speed: the ticks of a 20 kHz period
    /// of the 84 MHz timer clock.
    pub const FULL: u16 = (84_000_000_u32 / 20_000) as u16;
}

/// Follows the hand from where both were when its first motion came, until it is stopped.
#[derive(Clone, Debug, Default)]
pub struct Arm {
    following: Option<Following>,
    watch: Watch,
    /// What stopped it first, for good.
    stopped: Option<Trip>,
}

#[derive(Clone, Debug)]
struct Following {
    sequence: u32,
    /// Of the last motion, by the display's clock.
    instant_us: u64,
    /// Hand minus arm when the first motion came.
    offset_um: i64,
    hand_um: i64,
    velocity_um_s: i32,
    /// Since the last motion came.
    age_ms: u32,
}

/// Looks whether the arm does what its drive is told.
#[derive(Clone, Copy, Debug, Default)]
struct Watch {
    /// When it was where, if it has been seen since the first motion came.
    seen: Option<(u64, i64)>,
    /// Where it was when it was last seen to move.
    stood_um: i64,
    /// How far its drive was told to go since then, in nm, whatever became of the hand meanwhile.
    told_nm: i32,
}

impl Arm {
    /// Takes a motion that came while the arm was at `arm_um`. One with an older or the same sequence
    /// is refused, and false returned; so is any once it is stopped.
    ///
    /// The first motion, also the first one after [a silence](Arm::step) and the first of another hand, fixes the
    /// offset between hand and arm: the arm never jumps to where the hand went meanwhile, and a restarted
    /// display, which counts from 0 again, is followed.
    pub fn on_motion(&mut self, motion: &Motion, arm_um: i64) -> bool {
        if self.stopped.is_some() {
            return false;
        }
        let offset_um = match &self.following {
            Some(f) if motion.sequence.wrapping_sub(f.sequence).cast_signed() <= 0 => return false,
            Some(f) if f.leads_to(motion) => f.offset_um,
            _ => motion.position_um.saturating_sub(arm_um),
        };
        if self.following.is_none() {
            self.watch.seen = None;
        }
        self.following = Some(Following {
            sequence: motion.sequence,
            instant_us: motion.instant_us,
            offset_um,
            hand_um: motion.position_um,
            velocity_um_s: motion.velocity_um_s,
            age_ms: 0,
        });
        true
    }

    /// Nothing was heard and driven for longer than [a silence](Arm::step): the next motion is a first one.
    pub fn rest(&mut self) {
        self.following = None;
    }

    /// The drive is off from now on, for good.
    pub fn stop(&mut self, trip: Trip) {
        self.following = None;
        self.stopped = self.stopped.or(Some(trip));
    }

    /// What it does.
    pub fn state(&self) -> ArmState {
        match (self.stopped, &self.following) {
            (Some(trip), _) => ArmState::Stopped(trip),
            (None, Some(_)) => ArmState::Following,
            (None, None) => ArmState::Resting,
        }
    }

    /// What stopped it, if it is stopped.
    pub fn trip(&self) -> Option<Trip> {
        self.stopped
    }

    /// The drive for the next millisecond, with the arm at `arm_um` at `instant_us`: the hand's velocity plus kp
    /// times the distance to the hand, which is taken to move on with its last velocity. Within
    /// ±`full_scale_um_s`; 0 after 100 ms without a motion, and for good once the arm [has stalled](Trip::ArmStall) or
    /// its encoder [has jumped](Trip::ArmEncoder): without an encoder to be believed it would run on.
    pub fn step(&mut self, instant_us: u64, arm_um: i64, full_scale_um_s: u32) -> Drive {
        let Some(f) = &mut self.following else {
            return Drive::default();
        };
        if f.age_ms >= SILENCE_MS {
            self.following = None;
            return Drive::default();
        }
        if let Some(trip) = self.watch.look(instant_us, arm_um, full_scale_um_s) {
            self.stop(trip);
            return Drive::default();
        }
        let velocity_um_s = i64::from(f.velocity_um_s);
        let error_um = f
            .hand_after_um(u64::from(f.age_ms) * 1_000)
            .saturating_sub(f.offset_um)
            .saturating_sub(arm_um);
        let error_um = error_um.clamp(-MAX_ERROR_UM, MAX_ERROR_UM);
        f.age_ms += 1;
        let full_scale = i64::from(full_scale_um_s);
        let command_um_s =
            (velocity_um_s + POSITION_GAIN_PER_S * error_um).clamp(-full_scale, full_scale);
        self.watch.tell(command_um_s as i32, full_scale_um_s);
        drive(command_um_s, full_scale_um_s)
    }
}

impl Watch {
    /// Takes where the arm is. What is wrong with it, if something is.
    fn look(&mut self, instant_us: u64, arm_um: i64, full_scale_um_s: u32) -> Option<Trip> {
        if let Some((before_us, before_um)) = self.seen.replace((instant_us, arm_um)) {
            // A pause longer than a second would not be followed across.
            let us = instant_us.saturating_sub(before_us).min(1_000_000);
            let most_um = MOST_TURN_M_S * us + LEAST_TURN_UM;
            if before_um.abs_diff(arm_um) > most_um {
                return Some(Trip::ArmEncoder);
            }
        }
        if self.stood_um.abs_diff(arm_um) > TREMBLE_UM {
            self.stood_um = arm_um;
            self.told_nm = 0;
        }
        let most_nm = full_scale_um_s.saturating_mul(STALLED_MS).max(STALLED_NM);
        let has_stalled = self.told_nm.unsigned_abs() > most_nm;
        has_stalled.then_some(Trip::ArmStall)
    }

    /// Takes what the drive is told for the next millisecond.
    fn tell(&mut self, command_um_s: i32, full_scale_um_s: u32) {
        if command_um_s.unsigned_abs() >= full_scale_um_s / WEAK_PART {
            // µm/s for a ms are nm.
            self.told_nm = self.told_nm.saturating_add(command_um_s);
        }
    }
}

impl Following {
    /// Where the hand is so many µs after its last motion, up to a second, if it goes on with its velocity.
    fn hand_after_um(&self, us: u64) -> i64 {
        let moved_um = i64::from(self.velocity_um_s) * us.cast_signed() / 1_000_000;
        self.hand_um.saturating_add(moved_um)
    }

    /// Whether `motion` can be the same hand's, by the clock of its board: what a network held up comes in one go.
    fn leads_to(&self, motion: &Motion) -> bool {
        let passed_us = motion.instant_us.checked_sub(self.instant_us);
        passed_us
            .filter(|&us| us <= LONGEST_GAP_US)
            .is_some_and(|us| {
                let away_um = motion.position_um.saturating_sub(self.hand_after_um(us));
                away_um.unsigned_abs() <= LEAST_TURN_UM + MOST_TURN_M_S * us
            })
    }
}

fn drive(command_um_s: i64, full_scale_um_s: u32) -> Drive {
    let full_scale = u64::from(full_scale_um_s.max(1));
    let speed = command_um_s.unsigned_abs().min(full_scale);
    let duty = (speed * u64::from(Drive::FULL) + full_scale / 2) / full_scale;
    Drive {
        duty: duty as u16,
        forward: command_um_s > 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FULL_SCALE_UM_S: u32 = 200_000;

    fn motion(sequence: u32, position_um: i64, velocity_um_s: i32) -> Motion {
        Motion {
            sequence,
            instant_us: 0,
            position_um,
            velocity_um_s,
        }
    }

    /// The same instant each time: an arm that then goes no further than a millimetre a step is one.
    fn step(arm: &mut Arm, arm_um: i64) -> Drive {
        arm.step(0, arm_um, FULL_SCALE_UM_S)
    }

    fn command_um_s(drive: Drive) -> f64 {
        let speed = f64::from(drive.duty) * f64::from(FULL_SCALE_UM_S) / f64::from(Drive::FULL);
        if drive.forward { speed } else { -speed }
    }

    #[test]
    fn stands_still_until_the_first_motion() {
        assert_eq!(
            step(&mut Arm::default(), 123),
            Drive {
                duty: 0,
                forward: false
            }
        );
    }

    #[test]
    fn starts_from_wherever_the_hand_and_the_arm_are() {
        let mut arm = Arm::default();
        assert!(arm.on_motion(&motion(9, 5_000_000, 0), -777));
        assert_eq!(step(&mut arm, -777).duty, 0);
    }

    #[test]
    fn commands_the_hands_velocity_and_the_share_of_its_lead() {
        let mut arm = Arm::default();
        arm.on_motion(&motion(0, 0, 50_000), 0);
        assert_eq!(
            step(&mut arm, 0),
            Drive {
                duty: Drive::FULL / 4,
                forward: true
            }
        );
        arm.on_motion(&motion(1, 100, -50_000), 0);
        // One duty step is full scale / 4200 = 48 µm/s; rounding makes half of it.
        let command = command_um_s(step(&mut arm, 0));
        assert!((command + 49_000.0).abs() <= 24.0, "{command}");
    }

    #[test]
    fn a_speed_is_rounded_to_the_nearest_step_of_the_duty() {
        // A step is 47.6 µm/s.
        for (command_um_s, duty, forward) in [
            (0, 0, false),
            (23, 0, true),
            (24, 1, true),
            (-71, 1, false),
            (-72, 2, false),
        ] {
            let wanted = Drive { duty, forward };
            assert_eq!(
                drive(command_um_s, FULL_SCALE_UM_S),
                wanted,
                "{command_um_s}"
            );
        }
    }

    #[test]
    fn refuses_an_older_or_repeated_sequence_also_where_it_wraps() {
        let mut arm = Arm::default();
        assert!(arm.on_motion(&motion(u32::MAX - 1, 0, 1_000), 0));
        assert!(arm.on_motion(&motion(1, 0, 2_000), 0));
        assert!(!arm.on_motion(&motion(1, 0, 3_000), 0));
        assert!(!arm.on_motion(&motion(u32::MAX, 0, 4_000), 0));
        assert_eq!(step(&mut arm, 0).duty, Drive::FULL / 100);
    }

    #[test]
    fn a_stall_is_found_also_if_each_motion_comes_after_a_silence() {
        for gap_ms in [90, 101, 300] {
            let mut arm = Arm::default();
            let (mut ms, mut told_mm) = (0_u64, 0.0);
            for sequence in 0..20 {
                arm.on_motion(&motion(sequence, ms as i64 * 60, 60_000), 500);
                for _ in 0..gap_ms {
                    ms += 1;
                    let drive = arm.step(ms * 1_000, 500, FULL_SCALE_UM_S);
                    told_mm += command_um_s(drive) * 1e-6;
                }
            }
            assert_eq!(arm.trip(), Some(Trip::ArmStall), "{gap_ms}");
            assert!((9.0..11.0).contains(&told_mm), "{gap_ms}: {told_mm}");
        }
    }

    #[test]
    fn stops_after_100_ms_of_silence_and_then_takes_a_restarted_display() {
        let mut arm = Arm::default();
        arm.on_motion(&motion(1_000, 0, 50_000), 0);
        for ms in 0..100 {
            assert!(step(&mut arm, ms * 50).duty > 0, "at {ms} ms");
        }
        assert_eq!(step(&mut arm, 5_000).duty, 0);
        assert!(arm.on_motion(&motion(0, 900_000, 0), 5_000));
        assert_eq!(step(&mut arm, 5_000).duty, 0);
    }

    #[test]
    fn another_hand_with_newer_numbers_is_followed_from_where_both_are() {
        // 30 ms later by their clocks, half a metre away: no hand gets there. And a hand nearby whose clock is another.
        for (instant_us, position_um) in [(40_000, 500_000), (3_000_000, 20_000), (9_000, 20_000)] {
            let mut arm = Arm::default();
            let at = |sequence, instant_us, position_um| Motion {
                instant_us,
                ..motion(sequence, position_um, 0)
            };
            assert!(arm.on_motion(&at(10, 10_000, 0), 700));
            assert_eq!(step(&mut arm, 700).duty, 0);
            assert!(arm.on_motion(&at(1_000, instant_us, position_um), 700));
            assert_eq!(step(&mut arm, 700).duty, 0);
            // From there on it is followed.
            assert!(arm.on_motion(&at(1_001, instant_us + 2_000, position_um + 100), 700));
            assert!(step(&mut arm, 700).duty > 0);
        }
    }

    #[test]
    fn the_same_hand_is_followed_also_where_motions_come_late_and_in_one_go() {
        let mut arm = Arm::default();
        let at = |sequence, instant_us, position_um| Motion {
            instant_us,
            ..motion(sequence, position_um, 0)
        };
        assert!(arm.on_motion(&at(10, 10_000, 0), 700));
        step(&mut arm, 700);
        // A tenth of a second later by its clock, and a millisecond later here.
        assert!(arm.on_motion(&at(60, 110_000, 150_000), 700));
        assert_eq!(step(&mut arm, 700).duty, Drive::FULL);
    }

    #[test]
    fn after_a_rest_the_next_motion_is_a_first_one() {
        let mut arm = Arm::default();
        arm.on_motion(&motion(10, 0, 50_000), 0);
        step(&mut arm, 0);
        arm.rest();
        assert_eq!(step(&mut arm, 0), Drive::default());
        assert!(arm.on_motion(&motion(9, 900, 0), 0));
        assert_eq!(step(&mut arm, 0).duty, 0);
    }

    #[test]
    fn once_stopped_it_stands_still_whatever_comes_and_the_first_cause_is_told() {
        let mut arm = Arm::default();
        assert_eq!(arm.state(), ArmState::Resting);
        arm.on_motion(&motion(0, 0, 50_000), 0);
        assert_eq!(arm.state(), ArmState::Following);
        arm.stop(Trip::Operator);
        arm.stop(Trip::Host);
        for sequence in 1..300 {
            assert!(!arm.on_motion(&motion(sequence, 5_000_000, 50_000), 0));
            assert_eq!(step(&mut arm, 0), Drive::default());
        }
        assert_eq!(arm.state(), ArmState::Stopped(Trip::Operator));
        assert_eq!(arm.trip(), Some(Trip::Operator));
    }

    #[test]
    fn a_hand_that_is_not_heard_for_a_moment_is_taken_to_move_on() {
        let mut arm = Arm::default();
        arm.on_motion(&motion(0, 0, 50_000), 0);
        for ms in 0..40 {
            // 50 µm further each time, and ten times that in µm/s.
            let command = command_um_s(step(&mut arm, 0));
            let wanted = f64::from(50_000 + 500 * ms);
            assert!((command - wanted).abs() <= 24.0, "{command} at {ms} ms");
        }
    }

    #[test]
    fn never_exceeds_full_scale_whatever_the_frame_says() {
        for position_um in [i64::MIN, -1, 0, i64::MAX] {
            for velocity_um_s in [i32::MIN, 0, i32::MAX] {
                let mut arm = Arm::default();
                arm.on_motion(&motion(0, 0, 0), i64::MAX);
                arm.on_motion(&motion(1, position_um, velocity_um_s), 0);
                for _ in 0..100 {
                    assert!(step(&mut arm, i64::MIN).duty <= Drive::FULL);
                }
            }
        }
    }

    #[test]
    fn follows_a_rubbing_hand_to_within_a_tenth_of_a_millimetre() {
        // An ideal drive, motions every 2 ms. What is left is the hold between steps, at most
        // |a|·2 ms/kp, and rounding of the duty, 24 µm/s /kp: together below 0.1 mm.
        let angular = 2.0 * core::f64::consts::PI * 0.83;
        let hand = |ms: u32| 13_422.0 * libm::sin(angular * f64::from(ms) / 1_000.0);
        let mut arm = Arm::default();
        let mut arm_um = 0.0;
        for ms in 0..5_000_u32 {
            if ms % 2 == 0 {
                let velocity = (hand(ms + 1) - hand(ms.saturating_sub(1))) * 500.0;
                arm.on_motion(
                    &motion(ms / 2, hand(ms) as i64, velocity as i32),
                    arm_um as i64,
                );
            }
            arm_um += command_um_s(step(&mut arm, arm_um as i64)) / 1_000.0;
            let error = arm_um - hand(ms + 1);
            assert!(error.abs() < 100.0, "{error} µm at {ms} ms");
        }
    }

    /// An arm behind a drive with a lag, in its encoder's counts, and the hand that it follows at a steady speed.
    /// `encoder` makes of the ms and where the arm is what is read. Where the arm was when it stopped, in µm, when, and
    /// why, within a second.
    fn led(
        full_scale_um_s: u32,
        lag_ms: f64,
        speed_um_s: i32,
        encoder: impl Fn(u32, f64) -> f64,
    ) -> Option<(f64, u32, Trip)> {
        let mut arm = Arm::default();
        let (mut arm_um, mut velocity_um_s) = (0.0, 0.0);
        for ms in 0..1_000_u32 {
            let read_um = 5 * (encoder(ms, arm_um) / 5.0).floor() as i64;
            let hand_um = i64::from(speed_um_s) * i64::from(ms) / 1_000;
            arm.on_motion(&motion(ms, hand_um, speed_um_s), read_um);
            let drive = arm.step(u64::from(ms) * 1_000, read_um, full_scale_um_s);
            if let Some(trip) = arm.state().trip() {
                assert_eq!(drive, Drive::default());
                return Some((arm_um, ms, trip));
            }
            let scale = f64::from(full_scale_um_s) / f64::from(FULL_SCALE_UM_S);
            velocity_um_s += (scale * command_um_s(drive) - velocity_um_s) / (1.0 + lag_ms);
            arm_um += velocity_um_s / 1_000.0;
        }
        None
    }

    #[test]
    fn an_arm_whose_encoder_dies_is_stopped_within_a_centimetre() {
        for speed_um_s in [-150_000, -20_000, 30_000, 70_000] {
            for lag_ms in [0.0, 20.0] {
                let died_um = f64::from(speed_um_s) * 0.3;
                let dead = |ms, arm_um: f64| if ms < 300 { arm_um } else { died_um };
                let (arm_um, ms, trip) =
                    led(FULL_SCALE_UM_S, lag_ms, speed_um_s, dead).expect("it is noticed");
                assert_eq!(trip, Trip::ArmStall);
                // As far as full speed brings it in 50 ms, and what it is behind its command.
                let astray_um = (arm_um - died_um).abs();
                assert!(astray_um < 11_000.0, "{astray_um} µm at {speed_um_s} µm/s");
                assert!(ms < 700, "{ms} ms at {speed_um_s} µm/s");
            }
        }
    }

    #[test]
    fn an_arm_that_can_t_move_is_stopped() {
        for tremble_um in [0.0, 10.0] {
            let blocked = |ms, _| if ms % 2 == 0 { 0.0 } else { tremble_um };
            let (_, ms, trip) = led(FULL_SCALE_UM_S, 20.0, 50_000, blocked).expect("it is noticed");
            assert_eq!(trip, Trip::ArmStall);
            assert!(ms < 150, "{ms} ms");
        }
    }

    #[test]
    fn an_encoder_that_jumps_further_than_an_arm_moves_stops_it_at_once() {
        for (jump_um, trip) in [(3_100.0, Some(Trip::ArmEncoder)), (2_900.0, None)] {
            let jumps = |ms, arm_um| if ms < 300 { arm_um } else { arm_um + jump_um };
            let stopped = led(FULL_SCALE_UM_S, 20.0, 70_000, jumps);
            assert_eq!(stopped.map(|(.., trip)| trip), trip);
            assert!(stopped.is_none_or(|(_, ms, _)| ms == 300));
        }
    }

    #[test]
    fn a_slow_drive_a_weak_one_and_lost_samples_are_no_stall() {
        // As slow as the controller can bear, also where full speed is the slowest that can be configured.
        for full_scale_um_s in [1_000, 10_000, FULL_SCALE_UM_S] {
            assert_eq!(
                led(full_scale_um_s, 100.0, 150_000, |_, arm_um| arm_um),
                None
            );
        }
        // One that does not obey the last of a millimetre.
        let mut arm = Arm::default();
        for ms in 0..10_000 {
            arm.on_motion(&motion(ms, 10_000, 0), if ms == 0 { 10_000 } else { 9_010 });
            arm.step(u64::from(ms) * 1_000, 9_010, FULL_SCALE_UM_S);
        }
        assert_eq!(arm.state(), ArmState::Following);
        // A tenth of a second without a sample, at full speed.
        arm.step(10_100_000, 9_010 + 20_000, FULL_SCALE_UM_S);
        assert_eq!(arm.state(), ArmState::Following);
    }
}
