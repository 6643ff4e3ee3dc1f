//! The phase that the stimulus should have: true travel times the wavenumber in force.

use std::collections::VecDeque;

use protocol::{DisplayConfiguration, Role};

use crate::judge::seconds;
use crate::judge::trust::{Trust, are_about_the_same};
use crate::judge::truth::Truth;
use crate::plant::motion::MM_PER_COUNT;
use crate::run::observer::{RunEvent, RunObserver};
use crate::run::recording::{Arrival, TickRecord, WORD_V, ZERO_VOLT};

/// Ticks kept: a point of the outputs is asked for at the next tick, and lies a tick or two before its edge.
const TICKS_KEPT: usize = 8;
/// Ticks at 0 V that are no wave's crossing.
const CROSSING_TICKS: u32 = 3;
/// The least time in ms in which an actuator's own phase glides.
const LEAST_AHEAD_MS: u16 = 10;
/// Places of actuators are whole µm.
const MM_PER_UM: f64 = 1e-3;
/// Time in ms within a tenth of the amplitude after which 0 V is no crossing, but for waves slower than 4 Hz.
const SOFT_MS: u32 = 4;

/// The phase due, as far as the run has come: ∫ v/λ̂ dt, in cycles: v is the true hand's, λ̂ the one in force,
/// in which each estimate that is to be trusted ([`Trust`] says which) takes
/// [`DisplayConfiguration::glide_ms`] to come into force, linearly in 1/λ̂, and none while nothing is
/// heard: what is on its way when silence falls is in force at once. An estimate of about the λ̂ that is on its way
/// comes into force when that does; what an actuator is ahead by for its place glides anew with each, for 10 ms at
/// least. 0 until there is one.
///
/// An estimate is followed from the second tick after its arrival on, for the whole travel since the
/// first: the board hears what has come once a tick's words are on their way.
#[derive(Clone, Debug)]
pub struct DuePhase {
    followed: Followed,
    ticks: VecDeque<Due>,
    before_mm: Option<f64>,
    cycles: f64,
    travelled: f64,
    shortest_mm: Option<f64>,
    /// What has arrived and was not followed yet.
    arrived: VecDeque<Arrival>,
    last_tick_ns: Option<u64>,
    /// Whether the last output was other than 0 V.
    loud: bool,
    /// Whether one is beyond a tenth of the amplitude.
    beyond: bool,
    /// Ticks at 0 V, and within that tenth. A wave crosses 0 V; silence stays there, or has come softly.
    silent_ticks: u32,
    soft_ticks: u32,
}

/// The phase due at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Due {
    /// When, in s.
    pub t_s: f64,
    /// The phase at the reference actuator, in cycles: signed, not wrapped.
    pub cycles: f64,
    /// The cycles gone through so far, forwards and backwards alike: never falls.
    pub travelled_cycles: f64,
    /// The last tick by then, in s, and the cycles gone through by that: they go straight from tick to tick.
    pub tick: (f64, f64),
}

impl DuePhase {
    /// Before the first tick.
    pub fn new(truth: &Truth) -> Self {
        Self {
            followed: Followed::new(truth.display, truth.reference_place_mm()),
            ticks: VecDeque::with_capacity(TICKS_KEPT + 1),
            before_mm: None,
            cycles: 0.0,
            travelled: 0.0,
            shortest_mm: None,
            arrived: VecDeque::new(),
            last_tick_ns: None,
            loud: false,
            silent_ticks: CROSSING_TICKS,
            beyond: false,
            soft_ticks: u32::MAX,
        }
    }

    /// The phase due at the last tick; none before the first.
    pub fn last(&self) -> Option<Due> {
        self.ticks.back().copied()
    }

    /// The phase due at an instant among the last few ticks, in a straight line between two of them; level
    /// after the last, and 0 if there is none.
    pub fn at(&self, t_s: f64) -> Due {
        let after = self.ticks.partition_point(|tick| tick.t_s <= t_s);
        let before = after
            .checked_sub(1)
            .and_then(|before| self.ticks.get(before));
        let (cycles, travelled_cycles) = match (before, self.ticks.get(after)) {
            (Some(from), Some(to)) => {
                let straight = |from_value: f64, to_value: f64| {
                    from_value + (to_value - from_value) * (t_s - from.t_s) / (to.t_s - from.t_s)
                };
                (
                    straight(from.cycles, to.cycles),
                    straight(from.travelled_cycles, to.travelled_cycles),
                )
            }
            (Some(end), None) | (None, Some(end)) => (end.cycles, end.travelled_cycles),
            (None, None) => (0.0, 0.0),
        };
        Due {
            t_s,
            cycles,
            travelled_cycles,
            tick: before.map_or((t_s, travelled_cycles), |tick| tick.tick),
        }
    }

    /// The wavenumber in force over the last tick's travel, in cycles per mm; 0 before there is any.
    pub fn in_force_per_mm(&self) -> f64 {
        self.followed.per_mm
    }

    fn is_silent(&self) -> bool {
        let soft_ticks = SOFT_MS * (self.followed.configuration.update_rate.hz() / 1_000);
        self.silent_ticks >= CROSSING_TICKS
            || (self.silent_ticks > 0 && self.soft_ticks >= soft_ticks)
    }

    /// The shortest λ̂ that has been in force, in mm.
    pub fn shortest_mm(&self) -> Option<f64> {
        self.shortest_mm
    }
}

impl RunObserver for DuePhase {
    fn see(&mut self, event: RunEvent<'_>) {
        match event {
            RunEvent::Received(arrival) => self.received(arrival),
            RunEvent::Output(output) => {
                let farthest = output.words.iter().map(|word| word.abs_diff(ZERO_VOLT));
                let farthest = farthest.max().unwrap_or(0);
                self.loud = farthest > 0;
                let amplitude_v = f64::from(self.followed.configuration.amplitude_mv) * 1e-3;
                self.beyond = f64::from(farthest) * WORD_V > 0.1 * amplitude_v;
            }
            RunEvent::Tick(tick) => self.tick(tick),
            RunEvent::Reset(reset) if reset.role == Role::Display => self.restart(),
            _ => {}
        }
    }
}

impl DuePhase {
    /// The display was reset: it counts anew, and knows no λ until the next one comes.
    fn restart(&mut self) {
        self.followed = Followed::new(self.followed.configuration, self.followed.place_mm);
        self.arrived.clear();
        self.cycles = 0.0;
        if let Some(last) = self.last() {
            self.ticks.clear();
            self.ticks.push_back(Due {
                cycles: 0.0,
                ..last
            });
        }
    }

    fn received(&mut self, arrival: &Arrival) {
        match self.last_tick_ns {
            Some(tick_ns) if arrival.at_ns <= tick_ns => {
                self.followed.hear(tick_ns, arrival, self.is_silent());
            }
            _ => self.arrived.push_back(*arrival),
        }
    }

    fn tick(&mut self, tick: &TickRecord) {
        let travel_mm = tick.position_mm - self.before_mm.unwrap_or(tick.position_mm);
        self.before_mm = Some(tick.position_mm);
        self.soft_ticks = if self.beyond {
            0
        } else {
            self.soft_ticks.saturating_add(1)
        };
        self.silent_ticks = if self.loud {
            0
        } else {
            self.silent_ticks.saturating_add(1)
        };
        if self.is_silent() {
            self.followed.arrive();
        }
        let per_mm = self.followed.tick();
        self.cycles += travel_mm * per_mm;
        let due_cycles = self.cycles + self.followed.ahead_cycles;
        let before_cycles = self.last().map_or(due_cycles, |due| due.cycles);
        self.travelled += (due_cycles - before_cycles).abs();
        if per_mm > 0.0 {
            let shortest_mm = self.shortest_mm.unwrap_or(f64::INFINITY);
            self.shortest_mm = Some(shortest_mm.min(1.0 / per_mm));
        }
        let t_s = seconds(tick.at_ns);
        self.ticks.push_back(Due {
            t_s,
            cycles: due_cycles,
            travelled_cycles: self.travelled,
            tick: (t_s, self.travelled),
        });
        if self.ticks.len() > TICKS_KEPT {
            self.ticks.pop_front();
        }
        self.last_tick_ns = Some(tick.at_ns);
        while let Some(arrival) = self
            .arrived
            .pop_front_if(|arrival| arrival.at_ns <= tick.at_ns)
        {
            let silent = self.is_silent();
            self.followed.hear(tick.at_ns, &arrival, silent);
        }
    }
}

/// Whether two wavenumbers turn the board's phase, in 2⁻³² turns, by other numbers of steps over a way: what is the same
/// to a step is no other one, and no reason to begin a glide anew.
fn differ_over(way_mm: f64, one_per_mm: f64, other_per_mm: f64) -> bool {
    const STEPS: f64 = (1u64 << 32) as f64;
    let steps = |per_mm: f64| (STEPS * way_mm * per_mm).round();
    steps(one_per_mm) != steps(other_per_mm)
}

/// The wavenumber that a display follows.
#[derive(Clone, Debug)]
struct Followed {
    configuration: DisplayConfiguration,
    trust: Trust,
    /// Of the reference actuator, in mm.
    place_mm: f64,
    /// In cycles per mm.
    per_mm: f64,
    target_per_mm: f64,
    /// What the actuator is ahead by for its place: it glides as well, the shorter way.
    ahead_cycles: f64,
    target_cycles: f64,
    ticks_left: u32,
    ahead_ticks_left: u32,
}

impl Followed {
    fn new(configuration: DisplayConfiguration, place_mm: f64) -> Self {
        Self {
            configuration,
            trust: Trust::new(configuration.max_age_ms),
            place_mm,
            per_mm: 0.0,
            target_per_mm: 0.0,
            ahead_cycles: 0.0,
            target_cycles: 0.0,
            ticks_left: 0,
            ahead_ticks_left: 0,
        }
    }

    /// An estimate is heard at a tick, while all was `silent` or not.
    fn hear(&mut self, tick_ns: u64, arrival: &Arrival, silent: bool) {
        let DisplayConfiguration {
            glide_ms,
            update_rate,
            ..
        } = self.configuration;
        if arrival.has_asked {
            self.trust.greet();
        }
        if let Some(wavelength_mm) = self.trust.hear(tick_ns, &arrival.estimate) {
            let target_per_mm = 1.0 / wavelength_mm;
            let ticks = |ms: u16| {
                let ms = if silent { 0 } else { u32::from(ms) };
                ms * (update_rate.hz() / 1_000)
            };
            if differ_over(MM_PER_UM, target_per_mm, self.target_per_mm) {
                let way_cycles = self.place_mm * target_per_mm - self.ahead_cycles;
                self.target_cycles = self.ahead_cycles + way_cycles - way_cycles.round();
                self.ahead_ticks_left = ticks(glide_ms.max(LEAST_AHEAD_MS));
            }
            if differ_over(MM_PER_COUNT, target_per_mm, self.target_per_mm) {
                let before_per_mm = std::mem::replace(&mut self.target_per_mm, target_per_mm);
                let before_mm = (1.0 / before_per_mm) as f32;
                let goes_on = !silent
                    && self.ticks_left > 0
                    && are_about_the_same(wavelength_mm as f32, before_mm);
                if !goes_on {
                    self.ticks_left = ticks(glide_ms);
                }
            }
        }
    }

    /// Glides no further.
    fn arrive(&mut self) {
        self.per_mm = self.target_per_mm;
        self.ahead_cycles = self.target_cycles;
        self.ticks_left = 0;
        self.ahead_ticks_left = 0;
    }

    /// The wavenumber of a tick's travel.
    fn tick(&mut self) -> f64 {
        step(&mut self.per_mm, self.target_per_mm, &mut self.ticks_left);
        step(
            &mut self.ahead_cycles,
            self.target_cycles,
            &mut self.ahead_ticks_left,
        );
        self.per_mm
    }
}

/// One tick on the straight way to a target.
fn step(value: &mut f64, target: f64, ticks_left: &mut u32) {
    *value += (target - *value) / f64::from((*ticks_left).max(1));
    *ticks_left = ticks_left.saturating_sub(1);
}

#[cfg(test)]
mod tests {
    use protocol::Mode;

    use super::*;
    use crate::judge::synthetic::Run;
    use crate::run::observer::replay_to;
    use crate::run::recording::{ACTUATORS, Recording};

    /// Asks for the phase at an instant as soon as it can be told.
    struct Asking {
        due: DuePhase,
        t_s: f64,
        answer: Option<Due>,
    }

    impl RunObserver for Asking {
        fn see(&mut self, event: RunEvent<'_>) {
            self.due.see(event);
            if let RunEvent::Tick(tick) = event
                && seconds(tick.at_ns) > self.t_s
                && self.answer.is_none()
            {
                self.answer = Some(self.due.at(self.t_s));
            }
        }
    }

    /// A hand at 50 mm/s that hears of 2 mm, and of another λ from 1 s on.
    fn changed_to(wavelength_mm: f32) -> Run {
        Run {
            estimate: Box::new(move |t_s| (if t_s < 0.9999 { 2.0 } else { wavelength_mm }, true)),
            ..Run::steady(50.0, 2.0)
        }
    }

    /// The phase due at `t_s` over a surface of 2 mm, and the shortest λ̂ in force until the end.
    fn due_at(t_s: f64, recording: &Recording) -> (Due, f64) {
        due_of(&Truth::new("", "", &|_| 2.0), t_s, recording)
    }

    fn due_of(truth: &Truth, t_s: f64, recording: &Recording) -> (Due, f64) {
        let mut asking = Asking {
            due: DuePhase::new(truth),
            t_s,
            answer: None,
        };
        replay_to(recording, &mut asking);
        let due = asking.answer.expect("the recording goes on after that");
        (due, asking.due.shortest_mm().expect("some λ̂ is in force"))
    }

    #[test]
    fn the_due_phase_is_travel_over_the_wavelength_in_force_to_which_it_glides() {
        // 2 mm, then 2.5 mm from 1 s on, at 50 mm/s: 25 and 20 cycles a second. Heard at a tick, or between two.
        for (transit_s, heard_after_s) in [(0.001, 0.001), (0.001_25, 0.001_5)] {
            let run = Run {
                transit_s,
                ..changed_to(2.5)
            };
            let (due, shortest_mm) = due_at(1.9, &run.record());
            // The estimates of 10 ms and of 1 s are used for the travel after the tick that hears them. Half of the
            // change comes on the way, for a glide of 40 ticks, of which the last has it in whole.
            let glided_s = 1.0 + heard_after_s + 0.5 * (0.020 - 0.0005);
            let expected = (glided_s - 0.010 - heard_after_s) * 25.0 + (1.9 - glided_s) * 20.0;
            assert!((due.cycles - expected).abs() < 1e-6, "{due:?} {expected}");
            assert!((shortest_mm - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn estimates_of_the_wavelength_glided_to_leave_the_glide_its_end() {
        // Half a per cent more and less, in turn, every 10 ms of a glide of 100 ms.
        let run = Run {
            estimate: Box::new(|t_s| {
                let noise = [1.0, 1.005][(t_s * 100.0).round() as usize % 2];
                (if t_s < 0.9999 { 2.0 } else { 2.5 * noise }, true)
            }),
            ..Run::steady(50.0, 2.0)
        };
        let mut truth = Truth::new("", "", &|_| 2.0);
        truth.display.glide_ms = 100;
        let cycles = |t_s| due_of(&truth, t_s, &run.record()).0.cycles;
        let hz = |from_s: f64, to_s: f64| (cycles(to_s) - cycles(from_s)) / (to_s - from_s);
        // Half of the way on the average, and then between the two.
        let (going_hz, there_hz) = (hz(1.001, 1.101), hz(1.101, 1.9));
        assert!((going_hz - 22.5).abs() < 0.1, "{going_hz} Hz");
        assert!((there_hz - 19.95).abs() < 0.05, "{there_hz} Hz");
    }

    #[test]
    fn what_is_the_same_wavelength_to_a_step_of_the_phase_begins_no_glide_anew() {
        // Two neighbours among the numbers of 32 bits, in turn from 1 s on, or one of them alone; at an actuator that is
        // ahead, 30 ms later.
        let mut truth = Truth::new("", "", &|_| 2.0);
        truth.display.mode = Mode::Travelling;
        truth.reference_actuator = 20;
        let due = |other_mm: f32| {
            let run = Run {
                estimate: Box::new(move |t_s| {
                    let later = [3.006_825, other_mm][(t_s * 100.0).round() as usize % 2];
                    (if t_s < 0.9999 { 2.0 } else { later }, true)
                }),
                ..Run::steady(50.0, 2.0)
            };
            due_of(&truth, 1.03, &run.record()).0.cycles
        };
        assert!((due(3.006_824_7) - due(3.006_825)).abs() < 1e-5);
        assert!((due(3.007) - due(3.006_825)).abs() > 0.01);
    }

    #[test]
    fn an_actuators_own_phase_glides_the_shorter_way() {
        // 2 mm, then 1 mm from 1 s on.
        let run = changed_to(1.0);
        let recording = run.record();
        let travelled = |mode| {
            let mut truth = Truth::new("", "", &|_| 2.0);
            truth.display.mode = mode;
            // At −6.75 mm, behind by 3.375 cycles and then by 6.75: it gets behind by 0.375 more.
            truth.reference_actuator = 20;
            let at = |t_s| due_of(&truth, t_s, &recording).0.travelled_cycles;
            at(1.9) - at(0.9)
        };
        let behind = travelled(Mode::Uniform) - travelled(Mode::Travelling);
        assert!((behind - 0.375).abs() < 1e-6, "{behind}");
    }

    #[test]
    fn an_actuators_own_phase_takes_ten_milliseconds_at_least() {
        // 2 mm, then 1 mm from 1 s on, which is heard at 1.001 s and in force at once.
        let run = changed_to(1.0);
        let recording = run.record();
        let ahead = |t_s, glide_ms| {
            let cycles = |mode| {
                let mut truth = Truth::new("", "", &|_| 2.0);
                (truth.display.mode, truth.display.glide_ms) = (mode, glide_ms);
                truth.reference_actuator = 20;
                due_of(&truth, t_s, &recording).0.cycles
            };
            cycles(Mode::Travelling) - cycles(Mode::Uniform)
        };
        // From 3.375 cycles behind by 0.375 more.
        for (t_s, glide_ms, share) in [(1.006, 0, 0.5), (1.011, 0, 1.0), (1.011, 20, 0.5)] {
            let gone = (ahead(1.0, glide_ms) - ahead(t_s, glide_ms)) / 0.375;
            assert!(
                (gone - share).abs() < 1e-6,
                "{t_s} s, {glide_ms} ms: {gone}"
            );
        }
    }

    #[test]
    fn where_silence_falls_the_wavelength_glided_to_is_in_force_at_once() {
        // As above, but soft for 6 ms and then silent for two ticks in the middle of the glide.
        let mut recording = changed_to(2.5).record();
        for output in &mut recording.outputs {
            let t_s = seconds(output.at_ns);
            if (1.0052..1.0122).contains(&t_s) {
                let word = ZERO_VOLT + u16::from(t_s < 1.0112);
                output.words = [word; ACTUATORS];
            }
        }
        let due = due_at(1.9, &recording).0;
        // From 25 cycles a second down to 22.5 in half a glide, then at once to 20.
        let expected = (1.001 - 0.011) * 25.0 + 0.0102 * 23.75 + (1.9 - 1.0112) * 20.0;
        assert!((due.cycles - expected).abs() < 0.003, "{due:?} {expected}");
    }

    #[test]
    fn a_loud_wave_that_crosses_zero_for_a_tick_is_no_silence() {
        let mut recording = changed_to(2.5).record();
        let glided = due_at(1.9, &recording).0;
        // In the middle of the glide.
        let crossing = recording.outputs.iter_mut();
        let mut crossing = crossing.filter(|output| seconds(output.at_ns) > 1.0105);
        crossing.next().expect("an output").words = [ZERO_VOLT; ACTUATORS];
        assert_eq!(due_at(1.9, &recording).0, glided);
    }

    #[test]
    fn a_jump_is_in_force_once_the_next_estimate_confirms_it() {
        let jump = |to: f32, for_s: f64| Run {
            estimate: Box::new(move |t_s| {
                let jumped = (0.9999..0.9999 + for_s).contains(&t_s);
                (if jumped { to } else { 2.0 }, true)
            }),
            ..Run::steady(50.0, 2.0)
        };
        let cycles = |run: Run| due_at(1.9, &run.record()).0.cycles;
        let (steady, once, twice) = (
            cycles(Run::steady(50.0, 2.0)),
            cycles(jump(5.0, 0.009)),
            cycles(jump(5.0, 0.95)),
        );
        assert_eq!(once, steady);
        // From 1.011 s on, half of the glide later.
        let late_s = 1.9 - 1.011 - 0.5 * (0.020 - 0.0005);
        let expected = steady - late_s * 15.0;
        assert!((twice - expected).abs() < 1e-6, "{twice} {expected}");
    }

    #[test]
    fn a_reversed_stroke_takes_the_phase_back_and_goes_on_travelling() {
        let (due, _) = due_at(1.0, &Run::swinging(50.0, 1.0, 2.0).record());
        // Two strokes of 2 · 50 / 2π mm each a second, less the little before the first estimate.
        let stroke_cycles = 100.0 / std::f64::consts::TAU / 2.0;
        assert!(due.cycles.abs() < 0.01, "{due:?}");
        assert!((due.travelled_cycles - 2.0 * stroke_cycles).abs() < 0.01);
    }

    #[test]
    fn an_estimate_overtaken_by_a_newer_one_is_not_in_force() {
        let late = |wavelength_mm: f32| {
            let mut recording = Run::steady(50.0, 2.0).record();
            let mut late = recording.arrived.remove(30);
            late.at_ns = 500_000_000;
            late.estimate.wavelength_mm = Some(wavelength_mm);
            recording.arrived.push(late);
            recording.arrived.sort_by_key(|arrival| arrival.at_ns);
            due_at(1.9, &recording).0
        };
        assert_eq!(late(2.2), late(2.0));
    }
}
