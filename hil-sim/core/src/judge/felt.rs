//! What the operator's finger has of it: for how long, while the hand moves, the display drives at the right λ,
//! and for how long at a wrong one.
//!
//! Whether it drives is read off the outputs: it does unless all of them stay at 0 V. So hold, fades, stops and
//! rests count as the display makes them. At which λ is [`DuePhase`]'s to say: the one in force there, glide and
//! all; that the outputs do follow it is what `phase_error_rms_cycles` measures.
//!
//! [`DuePhase`]: crate::judge::phase::DuePhase

use crate::judge::MOTION_MM_S;
use crate::judge::estimates::SETTLED;
use crate::run::recording::{OutputRecord, TickRecord, ZERO_VOLT};

/// Relative error of λ within which what is driven is right.
pub const RIGHT: f64 = 0.05;
/// Relative error of λ above which what is driven is wrong.
pub const WRONG: f64 = SETTLED;
/// Ticks at 0 V that may be a wave's crossing: one, of which a tick sees the beginning and the end.
const CROSSING_TICKS: u32 = 2;
/// Speed of the hand in mm per ns above which it counts as in motion.
const MOTION_MM_NS: f64 = MOTION_MM_S * 1e-9;

/// What was felt, as shares of the time in which the hand moved, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Felt {
    /// Driven at a λ within [`RIGHT`] of the one under the sensor then, where there is one; none if that
    /// never was.
    pub right_share: Option<f64>,
    /// Driven at a λ more than [`WRONG`] off, or at any where there is none; none without motion.
    pub wrong_share: Option<f64>,
    /// The time over a λ, of which `right_share` is; none without motion.
    pub waves_share: Option<f64>,
}

/// The λ in force and the one under the sensor, at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waves {
    /// What the display goes by, in cycles per mm; 0 before it has any.
    pub in_force_per_mm: f64,
    /// What is under the sensor, in mm; none where there is no λ.
    pub under_mm: Option<f64>,
}

/// Adds up what is felt as the run goes on, from tick to tick.
#[derive(Clone, Debug)]
pub struct Judge {
    /// The hand at the last tick, in ns and mm.
    hand: Option<(u64, f64)>,
    /// Whether the last output was 0 V on all channels, or there was none yet.
    at_zero: bool,
    /// Ticks since it was not.
    zero_ticks: u32,
    moving_ns: u64,
    /// Of that, over a surface with a λ.
    over_waves_ns: u64,
    right_ns: u64,
    wrong_ns: u64,
}

impl Default for Judge {
    fn default() -> Self {
        Self {
            hand: None,
            at_zero: true,
            zero_ticks: CROSSING_TICKS,
            moving_ns: 0,
            over_waves_ns: 0,
            right_ns: 0,
            wrong_ns: 0,
        }
    }
}

impl Judge {
    /// The outputs have changed.
    pub fn output(&mut self, output: &OutputRecord) {
        self.at_zero = output.words.iter().all(|&word| word == ZERO_VOLT);
    }

    /// The display was reset: with its outputs at 0 V it drives nothing, however far off its next tick is.
    pub fn restart(&mut self) {
        self.zero_ticks = CROSSING_TICKS;
    }

    /// A tick, and the waves at its end: judges the time since the last one.
    pub fn tick(&mut self, tick: &TickRecord, waves: Waves) {
        self.zero_ticks = if self.at_zero {
            self.zero_ticks.saturating_add(1)
        } else {
            0
        };
        let Some((from_ns, from_mm)) = self.hand.replace((tick.at_ns, tick.position_mm)) else {
            return;
        };
        let step_ns = tick.at_ns.saturating_sub(from_ns);
        if (tick.position_mm - from_mm).abs() <= MOTION_MM_NS * step_ns as f64 {
            return;
        }
        self.moving_ns += step_ns;
        let is_driven = self.zero_ticks < CROSSING_TICKS;
        let Some(under_mm) = waves.under_mm else {
            if is_driven {
                self.wrong_ns += step_ns;
            }
            return;
        };
        self.over_waves_ns += step_ns;
        if !is_driven {
            return;
        }
        // λ/λ̂.
        let ratio = under_mm * waves.in_force_per_mm;
        if (1.0 - RIGHT) * ratio <= 1.0 && (1.0 + RIGHT) * ratio >= 1.0 {
            self.right_ns += step_ns;
        } else if (1.0 - WRONG) * ratio > 1.0 || (1.0 + WRONG) * ratio < 1.0 {
            self.wrong_ns += step_ns;
        }
    }

    /// What was felt.
    pub fn finish(self) -> Felt {
        let share = |part_ns: u64, of_ns: u64| (of_ns > 0).then(|| part_ns as f64 / of_ns as f64);
        Felt {
            right_share: share(self.right_ns, self.over_waves_ns),
            wrong_share: share(self.wrong_ns, self.moving_ns),
            waves_share: share(self.over_waves_ns, self.moving_ns),
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::Role;

    use crate::judge::synthetic::{Run, TICK_S};
    use crate::judge::truth::Truth;
    use crate::judge::{Summary, judge};
    use crate::run::fault_evidence::Reset;
    use crate::run::recording::{ACTUATORS, OutputRecord, Recording, ZERO_VOLT};

    /// What is felt of a run, as the summary has it.
    fn felt_of(run: &Run, recording: &Recording) -> (Option<f64>, Option<f64>) {
        let Summary {
            felt_right_share,
            felt_wrong_share,
            ..
        } = judge(&Truth::new("", "", &*run.surface_mm), recording).summary;
        (felt_right_share, felt_wrong_share)
    }

    fn felt(run: &Run) -> (Option<f64>, Option<f64>) {
        felt_of(run, &run.record())
    }

    /// That a share of a run of 2 s is of so many seconds, to within three ticks: an output belongs to the
    /// tick before it, the first word of a fade is 0 V, and the run ends with its last tick.
    fn assert_seconds(share: Option<f64>, expected_s: f64) {
        let seconds = 2.0 * share.expect("the hand moves");
        assert!(
            (seconds - expected_s).abs() <= 3.0 * TICK_S,
            "{seconds} {expected_s}"
        );
    }

    /// The first estimate arrives then, in s.
    const FIRST_S: f64 = 0.011;

    #[test]
    fn what_is_driven_at_the_right_wavelength_is_felt_right_from_the_first_estimate_on() {
        for speed_mm_s in [50.0, -50.0] {
            let (right, wrong) = felt(&Run::steady(speed_mm_s, 2.0));
            assert_seconds(right, 2.0 - FIRST_S);
            assert_eq!(wrong, Some(0.0));
        }
    }

    #[test]
    fn while_a_display_has_no_power_nothing_is_felt() {
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        let off_ns = 1_000_000_000..1_300_000_000;
        recording.ticks.retain(|one| !off_ns.contains(&one.at_ns));
        // It drives again once it has heard a λ, at 1.321 s.
        let unheard_ns = off_ns.start..1_320_000_000;
        let silent_ns = off_ns.start..1_322_500_000;
        recording
            .arrived
            .retain(|one| !unheard_ns.contains(&one.at_ns));
        recording
            .outputs
            .retain(|one| !silent_ns.contains(&one.at_ns));
        let after = recording
            .outputs
            .partition_point(|one| one.at_ns < off_ns.start);
        recording.outputs.insert(
            after,
            OutputRecord {
                at_ns: off_ns.start,
                words: [ZERO_VOLT; ACTUATORS],
                skew_ns: 0,
            },
        );
        recording.signs.resets.push(Reset {
            role: Role::Display,
            at_ns: off_ns.start,
            is_injected: true,
        });
        let (right, wrong) = felt_of(&run, &recording);
        // From its last tick on, half a ms before.
        assert_seconds(right, 2.0 - FIRST_S - 0.323);
        assert_seconds(wrong, 0.0);
    }

    #[test]
    fn right_is_within_5_percent_and_wrong_beyond_10_and_between_is_neither() {
        for (off, is_right, is_wrong) in [
            (0.049, true, false),
            (-0.049, true, false),
            (0.051, false, false),
            (-0.051, false, false),
            (0.099, false, false),
            (-0.099, false, false),
            (0.101, false, true),
            (-0.101, false, true),
            (1.0, false, true),
            (-0.5, false, true),
        ] {
            let run = Run {
                estimate: Box::new(move |_| (2.0 * (1.0 + off) as f32, true)),
                ..Run::steady(50.0, 2.0)
            };
            let (right, wrong) = felt(&run);
            let driven_s = |so| if so { 2.0 - FIRST_S } else { 0.0 };
            assert_seconds(right, driven_s(is_right));
            assert_seconds(wrong, driven_s(is_wrong));
        }
    }

    #[test]
    fn outputs_that_stay_at_0_v_are_not_felt_whatever_is_estimated() {
        let run = Run {
            amplitude_v: 0.0,
            ..Run::steady(50.0, 2.0)
        };
        assert_eq!(felt(&run), (Some(0.0), Some(0.0)));
    }

    #[test]
    fn after_a_fade_nothing_is_felt_until_there_is_another_voltage() {
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        let silence = OutputRecord {
            at_ns: 1_000_000_000,
            words: [0x8000; ACTUATORS],
            skew_ns: 0,
        };
        recording
            .outputs
            .retain(|output| !(1_000_000_000..1_400_000_000).contains(&output.at_ns));
        let at = recording
            .outputs
            .partition_point(|output| output.at_ns < silence.at_ns);
        recording.outputs.insert(at, silence);
        let (right, wrong) = felt_of(&run, &recording);
        assert_seconds(right, 2.0 - FIRST_S - 0.4);
        assert_eq!(wrong, Some(0.0));
    }

    #[test]
    fn a_wave_that_is_at_0_v_for_a_tick_is_felt_on() {
        // 2 mm at 50 mm/s are 80 ticks; every fortieth but the first is put to exactly 0 V.
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        for output in recording.outputs.iter_mut().skip(40).step_by(40) {
            output.words = [0x8000; ACTUATORS];
        }
        assert_seconds(felt_of(&run, &recording).0, 2.0 - FIRST_S);
    }

    #[test]
    fn over_a_boundary_what_is_still_played_is_wrong_until_the_new_wavelength_is_in_force() {
        // 1 mm, and from 1 s on 4 mm; said from 1.1 s on, which arrives at 1.101 s and glides in 20 ms.
        let run = Run {
            surface_mm: Box::new(|x_mm| if x_mm < 50.0 { 1.0 } else { 4.0 }),
            estimate: Box::new(|t_s| (if t_s < 1.0999 { 1.0 } else { 4.0 }, true)),
            ..Run::steady(50.0, 1.0)
        };
        let (right, wrong) = felt(&run);
        // A jump waits for a second estimate, 10 ms later. 1/λ̂ goes from 1 to 0.25: within 10 % of 4 mm below
        // 0.25/0.9, after 0.963 of the glide, and within 5 % below 0.25/0.95, after 0.982.
        let heard_s = 1.111;
        assert_seconds(wrong, heard_s - 1.0 + 0.020 * (1.0 - 0.25 / 0.9) / 0.75);
        let right_s = 2.0 - FIRST_S - (heard_s - 1.0) - 0.020 * (1.0 - 0.25 / 0.95) / 0.75;
        assert_seconds(right, right_s);
    }

    #[test]
    fn where_there_is_no_wavelength_all_that_is_driven_is_wrong_and_nothing_could_be_right() {
        let run = Run {
            surface_mm: Box::new(|_| f64::NAN),
            ..Run::steady(50.0, 2.0)
        };
        let (right, wrong) = felt(&run);
        assert_eq!(right, None);
        assert_seconds(wrong, 2.0 - FIRST_S);
    }

    #[test]
    fn where_only_a_part_has_a_wavelength_right_is_of_that_part_and_wrong_of_all() {
        let run = Run {
            surface_mm: Box::new(|x_mm| if x_mm < 50.0 { 2.0 } else { f64::NAN }),
            ..Run::steady(50.0, 2.0)
        };
        let (right, wrong) = felt(&run);
        // Of the first second, and of both.
        assert_seconds(right.map(|share| 0.5 * share), 1.0 - FIRST_S);
        assert_seconds(wrong, 1.0);
    }

    #[test]
    fn a_hand_at_rest_feels_nothing_that_could_be_judged() {
        assert_eq!(felt(&Run::steady(0.0, 2.0)), (None, None));
        assert_eq!(felt(&Run::steady(4.9, 2.0)), (None, None));
    }

    #[test]
    fn the_shares_are_of_the_time_in_which_the_hand_moves() {
        // At rest for 1 s, then 50 mm/s: estimated, and driven, from the start on.
        let run = Run {
            position_mm: Box::new(|t_s| 50.0 * (t_s - 1.0).max(0.0)),
            ..Run::steady(50.0, 2.0)
        };
        let (right, wrong) = felt(&run);
        assert_seconds(right.map(|share| 0.5 * share), 1.0);
        assert_eq!(wrong, Some(0.0));
    }
}
