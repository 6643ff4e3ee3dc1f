//! Where the fingertip's contact is, and whether it slips: from the tangential force.
//!
//! The fingertip is a spring of stiffness k between the arm and its contact with the surface. The force
//! channel measures the spring, so the contact lags behind the arm by F/k, and *that* position is what
//! the texture is a function of. It repairs what stick and slip do to λ: see `docs/src/explanation/estimation.md`.
//!
//! If k is not known it is found where the contact sticks: there ΔF/Δx is k, elsewhere it is less. One stretch may
//! be a bump: another k is told by two.

use protocol::{Contact, SensorConfiguration};

use crate::decimate;
use crate::travel::{PLACES_PER_UM, Place, Travel};

/// Volts of an ADC step.
const VOLTS_PER_LSB: f32 = 3.3 / 4_096.0;
/// Places in a metre.
const PLACES_PER_M: f32 = 1e6 * PLACES_PER_UM as f32;
/// Travel of the arm over which ΔF/Δx is taken.
const STRETCH: Place = 300 * PLACES_PER_UM;
/// A stretch ends where the arm has gone back so far: two counts of the encoder.
const RETREAT: Place = 10 * PLACES_PER_UM;
/// Slopes from this share of k on are taken for a sticking contact's.
const STICKING: f32 = 0.75;
/// A slope so much above k is another k's, once the next one agrees that well with it.
const STIFFER: f32 = 1.15;
/// How much of a sticking contact's slope goes into k. The stretch in which it begins to slip is among
/// them a quarter of the time, an eighth too flat: that takes no more than 3 % off k.
const LEARNING: f32 = 0.1;
/// Stiffness in N/m that is believed: below, a stretch's change of force is not far above the channel's
/// noise; fingertips have a few hundred.
const BELIEVED_N_PER_M: core::ops::RangeInclusive<f32> = 100.0..=60_000.0;
/// Contact and arm are compared over this many ms.
const COMPARED_MS: usize = 8;
/// The contact sticks if it moves less than this share of the arm's movement.
const STUCK: f32 = 0.25;
/// Lags that swing by this have to do with slips: a tenth of the shortest wave. What slips by less spoils none.
const SWINGS: Place = 60 * PLACES_PER_UM;
/// What is left of a swing after a millisecond is less by one part in so many, and by a place. As long does the channel not
/// count as telling slips after a scan at an end of its range: longer than the jerk remembers them.
const SWING_MS: Place = 512;
/// So long does a scan at an end of the range take part in samples, behind the anti-aliasing filter.
const FILTER_MS: Place = 2 * decimate::DELAY_MS as Place + 1;
/// The arm moves, in mm/s.
const MOVING_MM_S: f32 = 2.0;

/// A stretch of travel one way.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Arm and force where it began.
    from: Place,
    force_n: f32,
    /// The longest way from there.
    longest: Place,
}

/// The force channel's interpreter.
#[derive(Clone, Debug)]
pub struct Slip {
    newtons_per_lsb: f32,
    /// k in N/m; none until it is found.
    stiffness_n_per_m: Option<f32>,
    find_stiffness: bool,
    stretch: Option<Stretch>,
    /// Another stretch has told the same.
    is_confirmed: bool,
    /// A slope in N/m that tells another k, if the next one agrees.
    other_n_per_m: Option<f32>,
    /// What k, as it became known, has added to the lag, in places.
    known_later: Place,
    /// Lags of the last [`COMPARED_MS`] without that, in places.
    lags: [Place; COMPARED_MS],
    next: usize,
    /// Between which the lag has swung lately, in places.
    swing: [Place; 2],
    /// Samples until it is taken to tell the force again, after one at an end of its range.
    untold: Place,
    present: bool,
}

impl Slip {
    /// As `configuration` says; that must have passed its check.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        let given = configuration.stiffness_n_per_m;
        Self {
            newtons_per_lsb: VOLTS_PER_LSB * f32::from(configuration.force_mn_per_v) * 1e-3,
            stiffness_n_per_m: (given > 0).then_some(f32::from(given)),
            find_stiffness: given == 0,
            stretch: None,
            is_confirmed: false,
            other_n_per_m: None,
            known_later: 0,
            lags: [0; COMPARED_MS],
            next: 0,
            swing: [0; 2],
            untold: 0,
            present: configuration.force_channel,
        }
    }

    /// Takes the arm's place and the force channel's sample of the same instant, in ADC steps from
    /// mid-rail, and whether one of the scans since the last one is at an end of the range, where it tells no force; returns
    /// how far the contact lags behind the arm, in places: but for what is constant, so that the contact
    /// jumps nowhere when k becomes known.
    pub fn push(&mut self, arm: Place, force_lsb: f32, ends: impl FnOnce() -> bool) -> Place {
        if !self.present {
            return 0;
        }
        let force_n = force_lsb * self.newtons_per_lsb;
        self.untold = if ends() {
            SWING_MS
        } else {
            (self.untold - 1).max(0)
        };
        let tells = self.untold <= SWING_MS - FILTER_MS;
        if self.find_stiffness && tells {
            let before = self.deflection(force_n);
            self.learn(arm, force_n);
            self.known_later = self
                .known_later
                .wrapping_add(self.deflection(force_n).wrapping_sub(before));
        }
        let lag = if tells {
            self.deflection(force_n).wrapping_sub(self.known_later)
        } else {
            self.newest()
        };
        let [low, high] = self.swing;
        let less = high.wrapping_sub(low) / SWING_MS + 1;
        self.swing = [
            lag.min(low.wrapping_add(less)),
            lag.max(high.wrapping_sub(less)),
        ];
        self.lags[self.next] = lag;
        self.next = (self.next + 1) % COMPARED_MS;
        lag
    }

    /// F/k in places; 0 as long as k is unknown.
    fn deflection(&self, force_n: f32) -> Place {
        self.stiffness_n_per_m
            .map_or(0, |k| (force_n / k * PLACES_PER_M) as Place)
    }

    /// Inlined, it would cost each millisecond its registers, also without a force channel.
    #[inline(never)]
    fn learn(&mut self, arm: Place, force_n: f32) {
        let begun = Stretch {
            from: arm,
            force_n,
            longest: 0,
        };
        let stretch = self.stretch.get_or_insert(begun);
        let travel = arm.wrapping_sub(stretch.from);
        if travel.unsigned_abs() > stretch.longest.unsigned_abs() {
            stretch.longest = travel;
        }
        let back = stretch.longest.wrapping_sub(travel);
        if back.unsigned_abs() > RETREAT.unsigned_abs() {
            // A spring that is let go over the way there and back would pass for one twice as stiff.
            self.stretch = Some(begun);
            return;
        }
        if travel.unsigned_abs() < STRETCH.unsigned_abs() {
            return;
        }
        let slope = (force_n - stretch.force_n) / travel as f32 * PLACES_PER_M;
        self.stretch = Some(begun);
        if !BELIEVED_N_PER_M.contains(&slope) {
            return;
        }
        let Some(known) = self.stiffness_n_per_m else {
            // Until then the contact is taken to be where the arm is: better a k that another stretch corrects.
            self.stiffness_n_per_m = Some(slope);
            return;
        };
        if (STICKING * known..=STIFFER * known).contains(&slope) {
            self.stiffness_n_per_m = Some(known + LEARNING * (slope - known));
            self.is_confirmed = true;
            self.other_n_per_m = None;
        } else if slope > known || !self.is_confirmed {
            let agrees = |other| (other / STIFFER..=other * STIFFER).contains(&slope);
            if self.other_n_per_m.is_some_and(agrees) {
                self.stiffness_n_per_m = Some(slope);
            }
            self.other_n_per_m = Some(slope);
        }
    }

    /// The tangential force in N of the channel's sample, in ADC steps from mid-rail; none without the channel.
    pub fn force_n(&self, force_lsb: f32) -> Option<f32> {
        self.present.then_some(force_lsb * self.newtons_per_lsb)
    }

    /// The contact's lag behind the arm at the last sample, in µm; none without a force channel or as
    /// long as k is unknown.
    pub fn lag_um(&self) -> Option<i32> {
        self.stiffness_n_per_m
            .filter(|_| self.present)
            .map(|_| self.newest().wrapping_add(self.known_later) / PLACES_PER_UM)
    }

    /// Whether the lag swings as slips make it. One that does not knows of none: the fingertip slides along, or the channel
    /// is dead, or at an end of its range.
    pub fn tells_slips(&self) -> bool {
        let [low, high] = self.swing;
        self.present && self.untold == 0 && high.wrapping_sub(low) > SWINGS
    }

    /// Stick or slip, from how contact and arm moved over the last 8 ms; unknown at rest and without a
    /// force channel. `arm_ms_ago` is the age of the last sample.
    pub fn contact(&self, travel: &Travel, arm_ms_ago: usize) -> Contact {
        let now = travel.place(arm_ms_ago);
        let before = travel.place(arm_ms_ago + COMPARED_MS - 1);
        let arm = now.wrapping_sub(before);
        let moving = MOVING_MM_S * (COMPARED_MS - 1) as f32 * PLACES_PER_UM as f32;
        if self.lag_um().is_none() || (arm.unsigned_abs() as f32) < moving {
            return Contact::Unknown;
        }
        let contact = arm - (self.newest() - self.lags[self.next]);
        if (contact.unsigned_abs() as f32) < STUCK * arm.unsigned_abs() as f32 {
            Contact::Stick
        } else {
            Contact::Slip
        }
    }

    fn newest(&self) -> Place {
        self.lags[(self.next + COMPARED_MS - 1) % COMPARED_MS]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MICROMETRES_PER_COUNT;

    const K_N_PER_M: f64 = 400.0;

    fn configuration(stiffness_n_per_m: u16) -> SensorConfiguration {
        SensorConfiguration {
            force_channel: true,
            stiffness_n_per_m,
            ..SensorConfiguration::DEFAULT
        }
    }

    /// A fingertip that is a spring, and sticks up to a force, at which it slips: down to another, or
    /// along with it if that is the same.
    struct Fingertip {
        contact_um: f64,
        sticks_up_to_n: f64,
        slips_down_to_n: f64,
    }

    impl Fingertip {
        fn force_n(&mut self, arm_um: f64) -> f64 {
            let force_n = K_N_PER_M * (arm_um - self.contact_um) * 1e-6;
            if force_n.abs() <= self.sticks_up_to_n {
                return force_n;
            }
            let left_n = self.slips_down_to_n.copysign(force_n);
            self.contact_um = arm_um - left_n / K_N_PER_M * 1e6;
            left_n
        }
    }

    /// The channel's interpreter on an arm that an encoder with counts reads, and a force that an ADC does.
    struct Rub {
        slip: Slip,
        travel: Travel,
        fingertip: Fingertip,
        lsb_per_n: f64,
    }

    impl Rub {
        fn new(
            configuration: &SensorConfiguration,
            sticks_up_to_n: f64,
            slips_down_to_n: f64,
        ) -> Self {
            Self {
                slip: Slip::new(configuration),
                travel: Travel::new(0),
                fingertip: Fingertip {
                    contact_um: 0.0,
                    sticks_up_to_n,
                    slips_down_to_n,
                },
                lsb_per_n: 1e3 / f64::from(configuration.force_mn_per_v) * 4_096.0 / 3.3,
            }
        }

        fn step(&mut self, arm_um: f64, noise_lsb: f64) -> Place {
            let force_lsb = self.fingertip.force_n(arm_um) * self.lsb_per_n + noise_lsb;
            let counts = libm::floor(arm_um / f64::from(MICROMETRES_PER_COUNT)) as i64;
            self.travel.push(counts as u16);
            self.slip
                .push(self.travel.place(0), libm::round(force_lsb) as f32, || {
                    false
                })
        }

        fn contact(&self) -> Contact {
            self.slip.contact(&self.travel, 0)
        }

        fn found_n_per_m(&self) -> Option<f64> {
            self.slip.stiffness_n_per_m.map(f64::from)
        }
    }

    /// A triangular stroke of ±`half_um` at `um_per_ms`.
    fn triangle_um(ms: u32, half_um: f64, um_per_ms: f64) -> f64 {
        let way = f64::from(ms) * um_per_ms / (2.0 * half_um);
        let part = way - libm::floor(way);
        let up = libm::floor(way) as i64 % 2 == 0;
        half_um
            * if up {
                2.0 * part - 1.0
            } else {
                1.0 - 2.0 * part
            }
    }

    #[test]
    fn the_contact_lags_behind_the_arm_by_force_over_stiffness() {
        for stiffness_n_per_m in [10, 400, 60_000] {
            for force_mn_per_v in [1, 1_000, 60_000] {
                let mut slip = Slip::new(&SensorConfiguration {
                    force_mn_per_v,
                    ..configuration(stiffness_n_per_m)
                });
                for force_lsb in [-2_048.0, -100.25, -1.0, 0.0, 1.0, 333.0, 2_047.0_f32] {
                    let force_n =
                        f64::from(force_lsb) * 3.3 / 4_096.0 * f64::from(force_mn_per_v) * 1e-3;
                    let want_um = force_n / f64::from(stiffness_n_per_m) * 1e6;
                    let lag = f64::from(slip.push(1_000_000, force_lsb, || false)) / 4.0;
                    // Cut to a quarter of a µm, after six roundings of f32.
                    let bound = 0.25 + 6.0 * 2f64.powi(-24) * want_um.abs();
                    assert!((lag - want_um).abs() <= bound, "{lag} not {want_um} µm");
                    let said = f64::from(slip.lag_um().unwrap());
                    assert!((said - want_um).abs() <= 1.0 + bound, "{said} µm");
                }
            }
        }
    }

    #[test]
    fn a_stiffness_that_is_not_known_is_found_within_3_percent_wherever_the_arm_turns() {
        // Free to 0.6 N: 1.5 mm from a rest, 3 mm from slipping the other way. Turning places at all
        // distances from where a stretch ends.
        for half_um in [1_800.0, 2_517.0, 4_003.0, 9_999.0] {
            for um_per_ms in [11.0, 50.0, 73.0] {
                let mut rub = Rub::new(&configuration(0), 0.6, 0.6);
                for ms in 0..4_000 {
                    rub.step(triangle_um(ms, half_um, um_per_ms) + half_um, 0.0);
                }
                let found = rub.found_n_per_m().unwrap();
                assert!(
                    (found / K_N_PER_M - 1.0).abs() <= 0.03,
                    "{found} N/m from ±{half_um} µm at {um_per_ms} µm/ms"
                );
            }
        }
    }

    #[test]
    fn a_stiffness_is_found_within_3_percent_where_the_fingertip_sticks_and_slips() {
        for (sticks_up_to_n, slips_down_to_n) in [(0.6, 0.3), (0.8, 0.1)] {
            let mut rub = Rub::new(&configuration(0), sticks_up_to_n, slips_down_to_n);
            for ms in 0..4_000 {
                rub.step(f64::from(ms) * 30.0, 0.0);
            }
            let found = rub.found_n_per_m().unwrap();
            assert!((found / K_N_PER_M - 1.0).abs() <= 0.03, "{found} N/m");
        }
    }

    #[test]
    fn noise_of_the_force_channel_makes_the_fingertip_a_little_too_stiff() {
        // Uniform over ±10 steps, σ = 5.8, so 8.2 in the difference over 149 steps of a stretch: 5.5 %. A
        // slope that is 15 % too large is taken at once, others for a fifth.
        let mut state = 7_u64;
        let mut rub = Rub::new(&configuration(0), 0.6, 0.6);
        let mut worst: f64 = 0.0;
        for ms in 0..20_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let uniform = (state >> 11) as f64 / (1_u64 << 53) as f64;
            rub.step(
                triangle_um(ms, 5_000.0, 50.0) + 5_000.0,
                20.0 * (uniform - 0.5),
            );
            if ms > 1_000 {
                worst = worst.max((rub.found_n_per_m().unwrap() / K_N_PER_M - 1.0).abs());
            }
        }
        // Measured 0.115.
        assert!(worst <= 0.15, "{worst}");
    }

    #[test]
    fn a_bump_makes_the_fingertip_no_stiffer() {
        let triangle_at = |ms| triangle_um(ms, 5_000.0, 50.0) + 5_000.0;
        let mut rub = Rub::new(&configuration(0), 0.6, 0.6);
        // 0.4 N more within a stretch of 0.3 mm, as at an edge that the fingertip catches: before k is known, and later.
        for ms in 0..2_000 {
            let caught = (3..14).contains(&ms) || (1_003..1_014).contains(&ms);
            let more_n = if caught { 0.4 } else { 0.0 };
            rub.step(triangle_at(ms), more_n * rub.lsb_per_n);
            let known = rub.found_n_per_m().filter(|_| ms > 500);
            assert!(
                known.is_none_or(|k| (k / K_N_PER_M - 1.0).abs() <= 0.03),
                "{known:?} N/m after {ms} ms"
            );
        }
        assert!(rub.found_n_per_m().is_some());
    }

    #[test]
    fn the_contact_jumps_nowhere_when_its_stiffness_becomes_known() {
        for (sticks_up_to_n, slips_down_to_n) in [(0.6, 0.6), (0.6, 0.3)] {
            let mut rub = Rub::new(&configuration(0), sticks_up_to_n, slips_down_to_n);
            let mut before = rub.step(0.0, 0.0);
            // Until it slips for the first time, at 1.5 mm.
            for ms in 1..30 {
                let lag = rub.step(f64::from(ms) * 50.0, 0.0);
                // As far as the arm goes, and a count, and what rounding of the force makes.
                let moved_um = f64::from(lag - before) / f64::from(PLACES_PER_UM);
                assert!(
                    (-5.0..=60.0).contains(&moved_um),
                    "{moved_um} µm at {ms} ms"
                );
                before = lag;
            }
            assert!(rub.found_n_per_m().is_some());
            let lag_um = rub.slip.lag_um().unwrap();
            assert!((lag_um - 1_450).abs() <= 45, "{lag_um}");
        }
    }

    #[test]
    fn no_stiffness_is_found_where_the_fingertip_only_slips() {
        let mut rub = Rub::new(&configuration(0), 0.6, 0.6);
        rub.fingertip.contact_um = -1_500.0;
        for ms in 0..2_000 {
            assert_eq!(rub.step(f64::from(ms) * 50.0, 0.0), 0);
        }
        assert_eq!(rub.slip.lag_um(), None);
        assert_eq!(rub.contact(), Contact::Unknown);
    }

    #[test]
    fn stick_slip_and_rest_are_told_apart() {
        for direction in [1.0, -1.0] {
            let mut rub = Rub::new(&configuration(400), 0.6, 0.6);
            let mut arm_um = 0.0;
            let mut after = |ms: u32, um_per_ms: f64| {
                for _ in 0..ms {
                    arm_um += direction * um_per_ms;
                    rub.step(arm_um, 0.0);
                }
                rub.contact()
            };
            assert_eq!(after(100, 0.0), Contact::Unknown);
            // 1.5 mm at 50 mm/s take 30 ms, during which the contact stands.
            assert_eq!(after(9, 50.0), Contact::Stick);
            assert_eq!(after(20, 50.0), Contact::Stick);
            assert_eq!(after(10, 50.0), Contact::Slip);
            assert_eq!(after(500, 50.0), Contact::Slip);
            // Back: 3 mm, 60 ms.
            assert_eq!(after(10, -50.0), Contact::Stick);
            assert_eq!(after(45, -50.0), Contact::Stick);
            assert_eq!(after(15, -50.0), Contact::Slip);
            // Below 2 mm/s the arm rests.
            assert_eq!(after(100, 1.0), Contact::Unknown);
        }
    }

    #[test]
    fn the_share_of_time_that_a_fingertip_sticks_is_reported() {
        // From 0.3 to 0.6 N are 750 µm, 25 ms at 30 mm/s, then a jump of 750 µm at once. A slip is seen in
        // the 8 ms that hold it: 7 of 25.
        let mut rub = Rub::new(&configuration(400), 0.6, 0.3);
        let (mut stick, mut slip) = (0, 0);
        for ms in 0..10_000 {
            rub.step(f64::from(ms) * 30.0, 0.0);
            match rub.contact() {
                Contact::Stick => stick += 1,
                Contact::Slip => slip += 1,
                _ => {}
            }
        }
        let share = f64::from(stick) / f64::from(stick + slip);
        assert!((share - 18.0 / 25.0).abs() < 0.02, "{share}");
    }

    #[test]
    fn without_a_force_channel_its_input_has_no_effect() {
        let mut rub = Rub::new(
            &SensorConfiguration {
                force_channel: false,
                ..configuration(400)
            },
            0.6,
            0.3,
        );
        for ms in 0..1_000 {
            assert_eq!(rub.step(f64::from(ms) * 30.0, 0.0), 0);
            assert_eq!(rub.contact(), Contact::Unknown);
            assert_eq!(rub.slip.lag_um(), None);
        }
    }

    #[test]
    fn the_arms_place_may_wrap() {
        let place_before_wrap = i32::MAX - 2_000 * PLACES_PER_UM;
        let mut found = [0.0; 2];
        for (found, start) in found.iter_mut().zip([0, place_before_wrap]) {
            let mut slip = Slip::new(&configuration(0));
            for ms in 0..100 {
                let arm_um = 40 * ms;
                let force_lsb = 400e-6 * f64::from(arm_um) * 4_096.0 / 3.3;
                slip.push(
                    start.wrapping_add(arm_um * PLACES_PER_UM),
                    force_lsb as f32,
                    || false,
                );
            }
            *found = slip.stiffness_n_per_m.unwrap();
        }
        assert_eq!(found[0], found[1]);
    }

    /// An arm at 50 mm/s under a fingertip that sticks up to 0.6 N and slips down to 0.3; `heard` makes of the force in ADC
    /// steps what the channel says, and whether it is at an end. Whether slips are told, each millisecond.
    fn tells(heard: impl Fn(u32, f64) -> (f64, bool)) -> [bool; 4_000] {
        let mut slip = Slip::new(&configuration(400));
        let mut fingertip = Fingertip {
            contact_um: 0.0,
            sticks_up_to_n: 0.6,
            slips_down_to_n: 0.3,
        };
        core::array::from_fn(|ms| {
            let ms = ms as u32;
            let arm_um = 50.0 * f64::from(ms);
            let (force_lsb, ends) = heard(ms, fingertip.force_n(arm_um) * 4_096.0 / 3.3);
            slip.push(arm_um as Place * PLACES_PER_UM, force_lsb as f32, || ends);
            slip.tells_slips()
        })
    }

    #[test]
    fn a_channel_that_is_dead_or_at_an_end_tells_of_no_slips_and_a_sound_one_does() {
        let all =
            |told: [bool; 4_000], which: bool| told[1_000..].iter().all(|&told| told == which);
        assert!(all(tells(|_, lsb| (lsb, false)), true));
        // Dead, but for its noise; clipped at half of the force; at the end of the range.
        let noise = |ms: u32| f64::from(ms * 7_919 % 7) - 3.0;
        assert!(all(tells(|ms, _| (noise(ms), false)), false));
        assert!(all(tells(|_, lsb| (lsb.min(500.0), lsb > 500.0)), false));
        assert!(all(tells(|_, _| (2_047.0, true)), false));
        // A wire that breaks for half a second.
        let broken = tells(|ms, lsb| match ms {
            2_000..2_500 => (2_047.0, true),
            _ => (lsb, false),
        });
        assert!(broken[1_000..2_000].iter().all(|&told| told));
        assert!(broken[2_000..3_011].iter().all(|&told| !told));
        assert!(broken[3_050..].iter().all(|&told| told));
    }

    #[test]
    fn while_the_channel_is_at_an_end_the_lag_is_the_one_before() {
        let mut slip = Slip::new(&configuration(400));
        let before = slip.push(0, 300.0, || false);
        for ms in 0..20 {
            // The scan at the end takes part in samples for as long as the filter is.
            assert_eq!(
                slip.push(ms, 700.0, || ms == 0) == before,
                ms < FILTER_MS,
                "{ms} ms"
            );
        }
    }
}
