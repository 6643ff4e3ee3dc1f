//! What the actuators did, against what the hand did and the wavelength in force.

use std::f64::consts::TAU;

use serde::Serialize;

use crate::judge::cycles::Cycles;
use crate::judge::displacement::Displacement;
use crate::judge::finite;
use crate::judge::middle::{AboutMiddle, Point};
use crate::judge::phase_error::Demodulator;
use crate::judge::reaction::{Peaks, Reaction, Reactions};
use crate::judge::standing::Standing;
use crate::judge::stimulus::{Stimulus, Told};
use crate::judge::truth::Truth;
use crate::plant::motion::MM_PER_COUNT;
use crate::run::observer::{RunEvent, RunObserver, replay_to};
use crate::run::recording::{ACTUATORS, OutputRecord, Recording, TickRecord, WORD_V, volts};

/// Voltage below which an actuator does not vibrate, in V.
const STILL_V: f64 = 0.05;

/// What the actuators did. None where nothing vibrated, or not long enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Actuators {
    /// Frequency of the reference actuator's voltage in Hz, between the first and the last upward
    /// crossing of its middle in the longest stretch at full amplitude in which the hand did not turn.
    pub frequency_hz: Option<f64>,
    /// Mean of |v|/λ̂ over the same stretch, in Hz.
    pub truth_hz: Option<f64>,
    /// Root mean square of the phase error, cycle by cycle, against [`crate::judge::phase::DuePhase`], in cycles: of the
    /// reference actuator's voltage, or of the displacement that it makes where that actuator's response is described.
    pub phase_error_rms_cycles: Option<f64>,
    /// Its mean, in cycles: above 0 where the stimulus is ahead.
    pub phase_error_mean_cycles: Option<f64>,
    /// The largest change of any channel at one LDAC edge, in V.
    pub max_step_v: Option<f64>,
    /// The largest step that one tick of travel explains: 2π · amplitude · Δx/λ̂ for the longest
    /// travel of a tick, one encoder count more, and the shortest λ̂ in force; and one step of the
    /// DAC, since both words are rounded.
    pub natural_step_v: Option<f64>,
    /// The mean over time of the channel for which it is farthest from 0, in V: over whole strokes to and fro,
    /// or whole cycles of a hand that makes none.
    pub mean_v: Option<f64>,
    /// The longest time from the first to the last channel's change at one edge, in µs.
    pub skew_us: Option<f64>,
    /// Time from a hand movement to the LDAC edge that carries it, p99, in ms.
    pub hand_to_output_p99_ms: Option<f64>,
    /// The same, its median and its longest.
    pub hand_to_output: Option<Reaction>,
}

/// Judges the outputs of a recording.
pub fn judge(truth: &Truth, recording: &Recording) -> Actuators {
    let mut judge = Judge::new(truth);
    replay_to(recording, &mut judge);
    judge.finish()
}

/// Judges the outputs of a run as it goes on.
#[derive(Clone, Debug)]
pub struct Judge {
    reference: usize,
    /// In V.
    amplitude_v: f64,
    stimulus: Stimulus,
    middle: AboutMiddle,
    cycles: Cycles,
    standing: Standing,
    demodulator: Demodulator,
    /// Of the reference actuator, if it has a response of its own.
    displacement: Option<Displacement>,
    reactions: Reactions,
    peaks: Peaks,
    /// The words before the next edge: all are at 0 V before the first.
    words: [u16; ACTUATORS],
    /// In steps of the DAC; none before the first edge.
    max_step: Option<u16>,
    skew_ns: u64,
    /// The last tick in ns, the hand's place then, and its longest travel in one tick, in mm.
    hand: Option<(u64, f64)>,
    tick_ns: f64,
    longest_mm: Option<f64>,
}

/// How much a judge holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// Points of the outputs, sums of cycles and different reaction times: bounded.
    pub points: usize,
    /// Numbers of cycles: so many a cycle at most.
    pub cycles: usize,
}

impl Judge {
    /// Before the run.
    pub fn new(truth: &Truth) -> Self {
        Self {
            reference: truth.reference_actuator.min(ACTUATORS - 1),
            amplitude_v: f64::from(truth.display.amplitude_mv) * 1e-3,
            stimulus: Stimulus::new(truth),
            middle: AboutMiddle::default(),
            cycles: Cycles::default(),
            standing: Standing::new(truth.reference_actuator.min(ACTUATORS - 1)),
            demodulator: Demodulator::new(truth.display.rendering),
            displacement: Displacement::of(
                &truth.actuators[truth.reference_actuator.min(ACTUATORS - 1)],
            ),
            reactions: Reactions::default(),
            peaks: Peaks::NONE,
            words: [0x8000; ACTUATORS],
            max_step: None,
            skew_ns: 0,
            hand: None,
            tick_ns: 1e9 / f64::from(truth.display.update_rate.hz()),
            longest_mm: None,
        }
    }

    /// What the actuators did.
    pub fn finish(mut self) -> Actuators {
        self.stimulus.end();
        self.follow();
        let shortest_mm = self.stimulus.shortest_mm();
        let reaction = self.reactions.finish(&self.peaks, shortest_mm);
        let mut actuators = Actuators {
            max_step_v: self.max_step.map(|steps| f64::from(steps) * WORD_V),
            natural_step_v: self.longest_mm.zip(shortest_mm).and_then(
                |(longest_mm, shortest_mm)| {
                    finite(
                        self.amplitude_v * TAU * (longest_mm + MM_PER_COUNT) / shortest_mm + WORD_V,
                    )
                },
            ),
            skew_us: self.max_step.map(|_| self.skew_ns as f64 * 1e-3),
            hand_to_output_p99_ms: reaction.map(|reaction| reaction.p99_ms),
            hand_to_output: reaction,
            ..Actuators::default()
        };
        let peak_v = self.peaks.volts(self.reference);
        if peak_v < STILL_V.min(0.5 * self.amplitude_v) {
            return actuators;
        }
        if let Some(stretch) = self.cycles.longest_stretch() {
            actuators.frequency_hz = finite(stretch.cycles as f64 / stretch.length_s);
            actuators.truth_hz = finite(stretch.travelled_cycles / stretch.length_s);
        }
        let displaced = self.displacement.map(|moved| moved.amplitude_v());
        let error = self.demodulator.finish(displaced.unwrap_or(peak_v));
        actuators.phase_error_rms_cycles = error.map(|error| error.rms_cycles);
        actuators.phase_error_mean_cycles = error.map(|error| error.mean_cycles);
        actuators.mean_v = self.standing.farthest_v().and_then(finite);
        actuators
    }

    /// How much is held.
    pub fn held(&self) -> Held {
        let (late, spreads) = self.reactions.held();
        Held {
            points: self.stimulus.held() + self.middle.held() + spreads,
            cycles: self.cycles.held() + self.demodulator.held() + late,
        }
    }

    /// The wavenumber in force over the last tick's travel, in cycles per mm; 0 before there is any.
    pub fn in_force_per_mm(&self) -> f64 {
        self.stimulus.in_force_per_mm()
    }

    fn follow(&mut self) {
        while let Some(told) = self.stimulus.take() {
            match told {
                Told::Turned(cycles) => {
                    self.middle.turn(cycles);
                    self.standing.turn();
                }
                Told::Point(edge, due) => {
                    let volts = volts(edge.words[self.reference]);
                    self.standing.add(&edge);
                    let felt = match &mut self.displacement {
                        Some(displacement) => displacement.at(edge.t_s, volts),
                        None => Some(volts),
                    };
                    if let Some(felt) = felt {
                        self.demodulator.add(due, felt);
                    }
                    let point = Point {
                        edge,
                        volts,
                        travelled_cycles: due.travelled_cycles,
                        tick: due.tick,
                    };
                    self.middle.add(point, |about| self.cycles.add(about));
                }
            }
        }
    }
}

impl RunObserver for Judge {
    fn see(&mut self, event: RunEvent<'_>) {
        match event {
            RunEvent::Tick(tick) => self.tick(tick),
            RunEvent::Output(output) => self.output(output),
            RunEvent::Received(_) | RunEvent::Reset(_) => self.stimulus.see(event),
            _ => {}
        }
    }
}

impl Judge {
    fn tick(&mut self, tick: &TickRecord) {
        if let Some((before_ns, before_mm)) = self.hand.replace((tick.at_ns, tick.position_mm)) {
            // A board that starts misses ticks.
            let ticks = (tick.at_ns.saturating_sub(before_ns) as f64 / self.tick_ns).max(1.0);
            let travel_mm = (tick.position_mm - before_mm).abs() / ticks;
            self.longest_mm = Some(self.longest_mm.unwrap_or(0.0).max(travel_mm));
        }
        self.reactions.tick(tick);
        self.stimulus.see(RunEvent::Tick(tick));
        self.follow();
    }

    fn output(&mut self, output: &OutputRecord) {
        let steps = self.words.iter().zip(&output.words);
        let step = steps.map(|(from, to)| from.abs_diff(*to)).max();
        self.max_step = self.max_step.max(step);
        self.words = output.words;
        self.skew_ns = self.skew_ns.max(output.skew_ns);
        self.peaks.add(&output.words);
        self.reactions.output(output, self.stimulus.shortest_mm());
        self.stimulus.see(RunEvent::Output(output));
    }
}

#[cfg(test)]
mod tests {
    use protocol::{Mode, Role};

    use super::*;
    use crate::judge::synthetic::{Run, TICK_S};
    use crate::run::fault_evidence::Reset;
    use crate::run::recording::Recording;

    fn judged(run: &Run) -> Actuators {
        judge(&Truth::new("", "", &*run.surface_mm), &run.record())
    }

    #[test]
    fn measures_a_steady_frequency_to_a_hundredth_of_a_percent() {
        // 50 mm/s over 2 mm is 25 Hz; an encoder count is 0.0025 of some 48 cycles.
        let actuators = judged(&Run::steady(50.0, 2.0));
        let (frequency_hz, truth_hz) =
            (actuators.frequency_hz.unwrap(), actuators.truth_hz.unwrap());
        assert!((truth_hz - 25.0).abs() < 25.0 * 1e-6, "{truth_hz}");
        assert!((frequency_hz - 25.0).abs() < 25.0 * 1e-4, "{frequency_hz}");
    }

    #[test]
    fn the_natural_step_is_of_one_tick_also_where_some_are_missing() {
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        let step_v = |recording: &Recording| {
            let judged = judge(&Truth::new("", "", &*run.surface_mm), recording);
            judged.natural_step_v.expect("a hand moves")
        };
        let whole_v = step_v(&recording);
        recording.ticks.drain(1..4);
        let v = step_v(&recording);
        assert!((v - whole_v).abs() < 1e-9, "{v} V for {whole_v} V");
    }

    #[test]
    fn measures_a_stimulus_at_the_wrong_frequency_as_such() {
        // 0.3 cycles a second too many.
        let run = Run {
            ahead_cycles: Box::new(|t_s| 0.3 * t_s),
            ..Run::steady(50.0, 2.0)
        };
        let actuators = judged(&run);
        assert!((actuators.frequency_hz.unwrap() - 25.3).abs() < 25.3e-4);
        assert!((actuators.truth_hz.unwrap() - 25.0).abs() < 25.0e-4);
    }

    #[test]
    fn measures_backwards_strokes_like_forward_ones() {
        let actuators = judged(&Run::steady(-70.0, 1.0));
        assert!((actuators.frequency_hz.unwrap() - 70.0).abs() < 70.0e-4);
        assert!((actuators.truth_hz.unwrap() - 70.0).abs() < 70.0e-4);
    }

    #[test]
    fn follows_a_swinging_hand_within_one_stroke() {
        let actuators = judged(&Run::swinging(70.0, 0.83, 2.0));
        let (frequency_hz, truth_hz) =
            (actuators.frequency_hz.unwrap(), actuators.truth_hz.unwrap());
        // A stroke holds 2 · 70 / (2π 0.83 · 2) = 13.4 cycles: a count at either end is 0.04 %.
        assert!(
            (frequency_hz / truth_hz - 1.0).abs() < 5e-4,
            "{frequency_hz} {truth_hz}"
        );
        assert!(actuators.phase_error_rms_cycles.unwrap() < 0.005);
    }

    #[test]
    fn an_actuator_with_a_response_of_its_own_is_judged_by_what_the_skin_gets() {
        // 25 Hz at a resonance of 60 Hz and ζ = 0.7: for a displacement in step the voltage leads by 0.098 cycles.
        let w: f64 = 25.0 / 60.0;
        let lead = (2.0 * 0.7 * w).atan2(1.0 - w * w) / TAU;
        assert!((lead - 0.0981).abs() < 1e-3, "{lead}");
        for (ahead, described, expected) in [
            (lead, true, 0.0),
            (lead, false, lead),
            (0.0, true, -lead),
            (lead - 0.05, true, -0.05),
        ] {
            let run = Run {
                ahead_cycles: Box::new(move |_| ahead),
                amplitude_v: 0.3,
                ..Run::steady(50.0, 2.0)
            };
            let mut truth = Truth::new("", "", &*run.surface_mm);
            if described {
                let actuator = &mut truth.actuators[truth.reference_actuator];
                (actuator.resonance_dhz, actuator.damping_percent) = (600, 70);
            }
            let actuators = judge(&truth, &run.record());
            let mean = actuators.phase_error_mean_cycles.expect("it vibrates");
            assert!(
                (mean - expected).abs() < 0.004,
                "{ahead} {described}: {mean}"
            );
        }
    }

    #[test]
    fn finds_a_phase_offset_of_a_twentieth_of_a_cycle() {
        let run = Run {
            ahead_cycles: Box::new(|_| -0.05),
            ..Run::steady(50.0, 2.0)
        };
        let actuators = judged(&run);
        // Counts are floored, so the display is behind by half a count, 0.00125 cycles, more.
        assert!((actuators.phase_error_mean_cycles.unwrap() + 0.05).abs() < 0.0025);
        assert!((actuators.phase_error_rms_cycles.unwrap() - 0.05).abs() < 0.0025);
    }

    #[test]
    fn a_display_that_starts_again_counts_from_there() {
        // 2 s, off for a quarter, and the same again: the hand is 55.66 cycles on, the display begins at 0.
        let run = Run::steady(47.0, 1.9);
        let mut recording = run.record();
        let off_ns = 2_000_000_000;
        recording.signs.resets.push(Reset {
            role: Role::Display,
            at_ns: off_ns,
            is_injected: true,
        });
        recording.outputs.push(OutputRecord {
            at_ns: off_ns,
            words: [0x8000; ACTUATORS],
            skew_ns: 0,
        });
        let (later_ns, farther_mm) = (2_250_000_000, 47.0 * 2.25);
        let Recording {
            mut ticks,
            mut outputs,
            mut arrived,
            ..
        } = run.record();
        for tick in &mut ticks {
            tick.at_ns += later_ns;
            tick.position_mm += farther_mm;
        }
        outputs.iter_mut().for_each(|one| one.at_ns += later_ns);
        arrived.iter_mut().for_each(|one| one.at_ns += later_ns);
        recording.ticks.append(&mut ticks);
        recording.outputs.append(&mut outputs);
        recording.arrived.append(&mut arrived);
        let actuators = judge(&Truth::new("", "", &*run.surface_mm), &recording);
        assert!(
            actuators.phase_error_rms_cycles.unwrap() < 0.005,
            "{actuators:?}"
        );
    }

    #[test]
    fn finds_the_rms_of_a_slow_jitter_of_phase() {
        // A sine of 0.04 cycles at 1 Hz, two whole periods of it: 0.04/√2.
        let run = Run {
            ahead_cycles: Box::new(|t_s| 0.04 * (TAU * t_s).sin()),
            ..Run::steady(50.0, 2.0)
        };
        let rms = judged(&run).phase_error_rms_cycles.unwrap();
        assert!((rms - 0.04 / 2f64.sqrt()).abs() < 0.001, "{rms}");
    }

    #[test]
    fn a_late_edge_is_a_phase_behind() {
        // 0.3 ms at 25 Hz: 0.0075 cycles.
        let run = Run {
            edge_s: Box::new(|_| 0.3e-3),
            ..Run::steady(50.0, 2.0)
        };
        let late = judged(&run).phase_error_mean_cycles.unwrap();
        let prompt = judged(&Run::steady(50.0, 2.0))
            .phase_error_mean_cycles
            .unwrap();
        assert!((prompt - late - 0.0075).abs() < 1e-4, "{prompt} {late}");
    }

    #[test]
    fn a_travelling_pattern_is_in_phase_at_its_place() {
        // The run's actuators are 0.3 mm apart from number 0 on, the array's 10 columns are so from
        // −1.35 mm on: number 3 is at 0.9 and at −0.45 mm, and the run's wave is to be late by both.
        let run = Run {
            pitch_mm: 0.3,
            ahead_cycles: Box::new(|_| (-0.45 - 0.9) / 2.0),
            ..Run::steady(50.0, 2.0)
        };
        let mut truth = Truth::new("", "", &*run.surface_mm);
        truth.reference_actuator = 3;
        truth.display.mode = Mode::Travelling;
        truth.actuators = protocol::actuators::grid(300);
        let actuators = judge(&truth, &run.record());
        assert!(
            actuators.phase_error_rms_cycles.unwrap() < 0.0025,
            "{actuators:?}"
        );
        assert!(
            actuators.mean_v.unwrap().abs() < 0.005,
            "{:?}",
            actuators.mean_v
        );
    }

    #[test]
    fn the_mean_is_one_over_time() {
        let swinging = |standing_v: fn(f64) -> f64| {
            let run = Run {
                duration_s: 6.5,
                amplitude_v: 4.0,
                standing_v: Box::new(standing_v),
                ..Run::swinging(70.0, 0.83, 2.4)
            };
            judged(&run).mean_v.unwrap()
        };
        // A plain wave of a hand that swings has a mean, though none by travel: 4 V sin z J₀(z), z = 2π A/λ, A the
        // hand's amplitude; the phase that it begins with is off by a hundredth of a cycle.
        let z = 70.0 / 0.83 / 2.4;
        let due_v = 4.0 * f64::sin(z) * libm::j0(z);
        let plain_v = swinging(|_| 0.0);
        assert!(
            (plain_v.abs() - due_v.abs()).abs() < 0.05,
            "{plain_v} {due_v}"
        );
        // A voltage counts for as long as it stands, be the hand slow or fast then.
        let stood_v = swinging(|t_s| if (t_s * 1.66).fract() < 0.1 { 0.9 } else { 0.0 });
        assert!(
            (stood_v - plain_v - 0.09).abs() < 2e-3,
            "{stood_v} {plain_v}"
        );
    }

    #[test]
    fn the_mean_is_that_of_the_worst_channel() {
        let run = Run {
            offset_v: -0.02,
            ..Run::steady(50.0, 2.0)
        };
        let mean_v = judged(&run).mean_v.unwrap();
        // Within 1 mV: the words are 0.15 mV apart, the others' means well below.
        assert!((mean_v + 0.02).abs() < 1e-3, "{mean_v}");
    }

    #[test]
    fn estimates_that_jump_give_no_mean_and_no_phase_error() {
        // What the paper's counting does at 30 mm/s over 4 mm: two counts in turn, three windows each.
        let run = Run {
            estimate: Box::new(|t_s| {
                (
                    if ((t_s / 0.03) as u32).is_multiple_of(2) {
                        2.4
                    } else {
                        4.8
                    },
                    true,
                )
            }),
            // The pattern comes again after 0.96 s and nine cycles: a mean of less than that is the wave's own. Two
            // of them from the first rise that counts.
            duration_s: 2.2,
            ..Run::steady(30.0, 4.0)
        };
        let actuators = judged(&run);
        assert!(
            actuators.mean_v.unwrap().abs() < 0.005,
            "{:?}",
            actuators.mean_v
        );
        // A count is 0.002 cycles at 2.4 mm; each of 66 changes leaves up to half of that, of either sign.
        assert!(actuators.phase_error_rms_cycles.unwrap() < 0.002 + 66f64.sqrt() * 0.0005);
        let ratio = actuators.frequency_hz.unwrap() / actuators.truth_hz.unwrap();
        assert!((ratio - 1.0).abs() < 5e-4, "{ratio}");
        assert!(actuators.max_step_v.unwrap() <= actuators.natural_step_v.unwrap());
    }

    #[test]
    fn the_natural_step_is_what_a_tick_of_travel_explains() {
        let actuators = judged(&Run::steady(50.0, 2.0));
        let expected_v = 5.0 * TAU * (50.0 * TICK_S + 0.005) / 2.0 + 10.0 / 65_536.0;
        assert!((actuators.natural_step_v.unwrap() - expected_v).abs() < 1e-9);
        assert!(actuators.max_step_v.unwrap() <= expected_v);
        // Five counts a tick: the step at the zero crossing is that of 0.025 mm.
        assert!(actuators.max_step_v.unwrap() > 0.99 * 5.0 * TAU * 0.025 / 2.0);
    }

    #[test]
    fn a_jump_of_one_channel_is_the_largest_step() {
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        for output in &mut recording.outputs[1_000..] {
            output.words[49] = 0xffff;
        }
        recording.outputs[999].words[49] = 0x8000;
        recording.outputs[5].skew_ns = 1_500;
        let actuators = judge(&Truth::new("", "", &*run.surface_mm), &recording);
        let expected_v = 32_767.0 * 10.0 / 65_536.0;
        assert!((actuators.max_step_v.unwrap() - expected_v).abs() < 1e-9);
        assert_eq!(actuators.skew_us, Some(1.5));
    }

    #[test]
    fn a_run_without_a_valid_estimate_has_no_frequency() {
        let run = Run {
            estimate: Box::new(|_| (2.0, false)),
            ..Run::steady(50.0, 2.0)
        };
        assert_eq!(judged(&run), Actuators::default());
    }

    #[test]
    fn recordings_of_any_length_are_judged_without_a_panic() {
        let run = Run::steady(50.0, 2.0);
        let whole = run.record();
        let truth = Truth::new("", "", &*run.surface_mm);
        for length in (0..80).chain([400, 3_999]) {
            let mut recording = whole.clone();
            recording.outputs.truncate(length);
            judge(&truth, &recording);
            recording.ticks.truncate(length);
            judge(&truth, &recording);
            recording.estimates.truncate(length);
            judge(&truth, &recording);
            recording.ticks.clear();
            judge(&truth, &recording);
        }
    }
}
