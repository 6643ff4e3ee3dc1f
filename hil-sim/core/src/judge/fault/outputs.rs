//! What the outputs did about a fault.

use protocol::{Actuator, DisplayConfiguration, UNITY_GAIN};

use crate::run::recording::{ACTUATORS, OutputRecord, WORD_V, ZERO_VOLT};
use crate::scene::fault::{Class, Fault};

/// Longest time in ns that an output may stand at one voltage that is not 0: as long as any fault's
/// outputs have to be at 0 V.
const STANDING_NS: u64 = 20_000_000;
/// The same at a channel's amplitude: there a crest is cut flat while a charge is worked off under it.
const CREST_NS: u64 = 100_000_000;
/// An output that turns by itself is at its last step for up to so many times as long as at the step before: 4.8 times
/// where it goes as the square of the time, as at a crest or where the hand turns back, and 10.6 where it does both.
const TURNS_IN: u64 = 12;
/// Rounding, and a range that ends a step earlier above 0 V, take no more off a crest, in steps of the DAC.
const CREST_WORDS: u16 = 2;
/// How long before a fault an output has to have been driven for the stimulus to be called on: half a
/// cycle of 25 Hz passes 0 V once.
const DRIVEN_NS: u64 = 20_000_000;
/// All outputs at 0 V for so long, in ns, is no wave's passing: ten ticks.
pub(super) const SILENCE_NS: u64 = 5_000_000;
/// Steepest that an output may rise or fall, in V/ms.
const SLEW_V_PER_MS: f64 = 10.0;

/// What the outputs did about a fault, from what held when it began on.
#[derive(Clone, Debug)]
pub(super) struct Outputs {
    from_ns: u64,
    /// The end of what they have to be at 0 V for.
    rest_ns: u64,
    until_ns: u64,
    /// When all have to be at 0 V, if they have to be.
    late_ns: Option<u64>,
    /// Whether the stimulus was on when the fault began.
    pub was_driving: bool,
    /// Whether it had been on at any time before.
    pub drove: bool,
    /// From when on all stayed at 0 V for the rest of the fault, in ns since the scene's start.
    pub safe_ns: Option<u64>,
    /// What they hold; none before the first change.
    words: Option<[u16; ACTUATORS]>,
    /// Since when each is at one voltage, in ns.
    since_ns: [u64; ACTUATORS],
    /// For how long it was at the voltage before, in ns; 0 if it came from there by more than [`CREST_WORDS`].
    before_ns: [u64; ACTUATORS],
    /// Which were not at 0 V when they had to be.
    late: [bool; ACTUATORS],
    /// Which stood at another voltage.
    stands: [bool; ACTUATORS],
    /// Since when all are at 0 V, in ns.
    silent_ns: Option<u64>,
    /// Whether they were at 0 V for longer than a wave that passes it.
    answered: bool,
    /// Whether any was driven after that.
    pub drives_again: bool,
    limits: Limits,
    /// How far from 0 V each channel's crest is cut, in steps of the DAC.
    crests: [u16; ACTUATORS],
    /// Whether that may be anywhere below: the amplitude follows the surface, its force or an actuator's model.
    may_be_weaker: bool,
    last_ns: u64,
    /// When one went beyond the amplitude, or faster than any may, in ns since the scene's start.
    pub beyond_ns: Option<u64>,
}

/// What no voltage may go beyond, whatever is broken.
#[derive(Clone, Copy, Debug)]
struct Limits {
    /// Highest voltage of either sign, in steps of the DAC.
    words: u16,
    /// Steps of the DAC in a nanosecond.
    words_per_ns: f64,
    tick_ns: u64,
}

impl Limits {
    /// Ticks after which CLR falls: what is then at another voltage did not come there by a step.
    const HELD_TICKS: u64 = 4;

    fn of(configuration: &DisplayConfiguration) -> Self {
        let volts = f64::from(configuration.amplitude_mv) * 1e-3;
        Self {
            words: (volts / WORD_V).ceil() as u16 + 1,
            words_per_ns: SLEW_V_PER_MS * 1e-6 / WORD_V,
            tick_ns: 1_000_000_000 / u64::from(configuration.update_rate.hz()),
        }
    }

    /// Whether an output may go from one word to another, `after_ns` later. To 0 V it always may.
    fn allow(&self, from: u16, to: u16, after_ns: u64) -> bool {
        let after_ns = after_ns.clamp(self.tick_ns, Self::HELD_TICKS * self.tick_ns);
        to == ZERO_VOLT
            || (to.abs_diff(ZERO_VOLT) <= self.words
                && f64::from(from.abs_diff(to)) <= self.words_per_ns * after_ns as f64 + 1.0)
    }
}

/// How far from 0 V a channel's crest is cut, in steps of the DAC: at its amplitude.
fn crest(configuration: &DisplayConfiguration, actuator: &Actuator) -> u16 {
    let gain = f64::from(actuator.gain_q15) / f64::from(UNITY_GAIN);
    let volts = f64::from(configuration.amplitude_mv) * 1e-3 * gain;
    (volts / WORD_V).round() as u16
}

impl Outputs {
    pub fn new(
        fault: &Fault,
        until_ns: u64,
        configuration: &DisplayConfiguration,
        actuators: &[Actuator; ACTUATORS],
    ) -> Self {
        let from_ns = fault.begins_ns();
        let rest_ns = match fault.kind.row().class {
            // What is over stays answered.
            Class::Stops => until_ns,
            _ => fault.ends_ns().unwrap_or(until_ns).min(until_ns),
        };
        let is_dangerous = fault.kind.row().safe_within_ms.is_some();
        let late_ns = from_ns + STANDING_NS;
        Self {
            from_ns,
            rest_ns,
            until_ns,
            late_ns: (is_dangerous && late_ns < rest_ns).then_some(late_ns),
            was_driving: false,
            drove: false,
            safe_ns: Some(from_ns),
            words: None,
            since_ns: [from_ns; ACTUATORS],
            before_ns: [0; ACTUATORS],
            late: [false; ACTUATORS],
            stands: [false; ACTUATORS],
            silent_ns: None,
            answered: false,
            drives_again: false,
            limits: Limits::of(configuration),
            crests: actuators.map(|actuator| crest(configuration, &actuator)),
            may_be_weaker: configuration.reference_lsb > 0
                || configuration.reference_mn > 0
                || actuators.iter().any(|actuator| actuator.resonance_dhz > 0),
            last_ns: 0,
            beyond_ns: None,
        }
    }

    /// The outputs have changed.
    pub fn add(&mut self, output: &OutputRecord) {
        let at_ns = output.at_ns;
        let is_silent = output.words.iter().all(|&word| word == ZERO_VOLT);
        if at_ns > self.from_ns {
            self.change(at_ns, &output.words, is_silent);
            return;
        }
        if at_ns < self.from_ns {
            self.drove |= !is_silent;
            let is_held = at_ns <= self.from_ns.saturating_sub(DRIVEN_NS);
            self.was_driving = !is_silent || (self.was_driving && !is_held);
        }
        match self.words.replace(output.words) {
            Some(before) => self.step(at_ns, &before, &output.words),
            None => self.since_ns = [at_ns; ACTUATORS],
        }
        self.last_ns = at_ns;
        self.safe_ns = is_silent.then_some(self.from_ns);
        self.silent_ns = self.safe_ns;
    }

    /// They have changed after the fault had begun.
    fn change(&mut self, at_ns: u64, words: &[u16; ACTUATORS], is_silent: bool) {
        if self.late_ns.is_some_and(|late_ns| at_ns > late_ns) {
            self.look_late();
        }
        if at_ns >= self.until_ns {
            return;
        }
        if at_ns < self.rest_ns {
            self.safe_ns = match self.safe_ns {
                _ if !is_silent => None,
                None => Some(at_ns),
                safe_ns => safe_ns,
            };
        }
        self.answered |= self
            .silent_ns
            .is_some_and(|since_ns| at_ns - since_ns >= SILENCE_NS);
        self.drives_again |= self.answered && !is_silent;
        self.silent_ns = is_silent.then_some(at_ns);
        let Some(before) = self.words.replace(*words) else {
            self.since_ns = [at_ns; ACTUATORS];
            return;
        };
        let after_ns = at_ns - std::mem::replace(&mut self.last_ns, at_ns);
        for actuator in 0..ACTUATORS {
            if !self
                .limits
                .allow(before[actuator], words[actuator], after_ns)
            {
                self.beyond_ns.get_or_insert(at_ns);
            }
            if before[actuator] != words[actuator] {
                self.stand(actuator, before[actuator], at_ns);
            }
        }
        self.step(at_ns, &before, words);
    }

    /// Each output that has another word now has it from now on.
    fn step(&mut self, at_ns: u64, before: &[u16; ACTUATORS], words: &[u16; ACTUATORS]) {
        for actuator in 0..ACTUATORS {
            let steps = before[actuator].abs_diff(words[actuator]);
            if steps > 0 {
                let since_ns = std::mem::replace(&mut self.since_ns[actuator], at_ns);
                let is_step = steps <= CREST_WORDS;
                self.before_ns[actuator] = if is_step { at_ns - since_ns } else { 0 };
            }
        }
    }

    /// An output has been at this word until now.
    fn stand(&mut self, actuator: usize, word: u16, until_ns: u64) {
        let since_ns = self.since_ns[actuator].max(self.from_ns);
        let stood_ns = until_ns.saturating_sub(since_ns);
        let from_zero = word.abs_diff(ZERO_VOLT);
        let is_cut = if self.may_be_weaker {
            from_zero <= self.crests[actuator] + CREST_WORDS
        } else {
            from_zero.abs_diff(self.crests[actuator]) <= CREST_WORDS
        };
        let most_ns = if is_cut {
            CREST_NS
        } else {
            (TURNS_IN * self.before_ns[actuator]).clamp(STANDING_NS, CREST_NS)
        };
        self.stands[actuator] |= word != ZERO_VOLT && stood_ns > most_ns;
    }

    fn look_late(&mut self) {
        self.late_ns = None;
        if let Some(words) = &self.words {
            for (late, &word) in self.late.iter_mut().zip(words) {
                *late |= word != ZERO_VOLT;
            }
        }
    }

    pub fn finish(mut self) -> Self {
        if self.late_ns.is_some() {
            self.look_late();
        }
        let words = self.words.unwrap_or([ZERO_VOLT; ACTUATORS]);
        for (actuator, word) in words.into_iter().enumerate() {
            self.stand(actuator, word, self.until_ns);
        }
        self
    }

    /// How many were not at 0 V when they had to be, or stood at another voltage.
    pub fn stuck(&self) -> usize {
        let both = self.late.iter().zip(&self.stands);
        both.filter(|&(&late, &stands)| late || stands).count()
    }

    /// How many stood at another voltage than 0.
    pub fn standing(&self) -> usize {
        self.stands.iter().filter(|&&stands| stands).count()
    }
}
