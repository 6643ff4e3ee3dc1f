//! Whether the stimulus stays in step with the hand while something is broken.

use std::mem;
use std::ops::Range;

use protocol::{Rendering, Role};

use crate::judge::displacement::Displacement;
use crate::judge::phase_error::{Demodulated, Demodulator, holds_a_cycle, mean_on_circle};
use crate::judge::seconds;
use crate::judge::stimulus::{Stimulus, Told};
use crate::judge::truth::Truth;
use crate::judge::voltage::Edge;
use crate::run::observer::{RunEvent, RunObserver};
use crate::run::recording::volts;

/// So long before a fault tells from where the phase goes on, in ns: a display that has started again counts from
/// another place than the scene.
const BEFORE_NS: u64 = 500_000_000;

/// Where nothing was to be heard, nobody can tell where a phase goes on; how it goes on from there can be told. Whether a λ
/// that comes at the end of a fade is glided to hangs on what of it the words still show. A silence is so many ticks
/// with no word above [`QUIET`], one of them at 0 V to the word: a wave's crossing is no silence.
const SILENT_TICKS: f64 = 1.8;
/// Of the highest voltage.
const QUIET: f64 = 0.03;

/// What does not repeat of a texture moves the phase of a single cycle, by a tenth on a rough surface: over so many cycles it
/// averages out.
const TEXTURE_CYCLES: usize = 10;

/// The phase of the stimulus against the one due, before the fault and since.
#[derive(Clone, Debug)]
pub(super) struct Step {
    judged_ns: Range<u64>,
    stimulus: Stimulus,
    reference: usize,
    before: Demodulator,
    /// When the display last began to count anew before the fault, in s.
    restarted_s: f64,
    /// Where it stood before the fault, in cycles.
    standing: Option<f64>,
    since: Demodulator,
    /// The windows up to the last silence.
    errors: Vec<Demodulated>,
    /// Whether where it goes on is unknown: there was a silence since the fault, or no whole cycle before it.
    is_unplaced: bool,
    quiet_since_s: Option<f64>,
    /// Whether all words were at 0 V since then.
    was_zero: bool,
    /// Of a silence, in s.
    least_silence_s: f64,
    /// What the stimulus then takes to its full amplitude, in s.
    fade_in_s: f64,
    /// When it is there, in s. A cycle that still rises, or a part of one, would be found up to 0.2 cycles off.
    full_from_s: f64,
    rendering: Rendering,
    peak_v: f64,
    /// Of the reference actuator, if it has a response of its own: then what it makes of the voltage is judged.
    displacement: Option<Displacement>,
}

impl Step {
    /// Until then, in ns, the hand's counts were not those of its place.
    pub fn new(truth: &Truth, judged_ns: Range<u64>, shifted_ns: u64) -> Self {
        Self {
            judged_ns,
            stimulus: Stimulus::new(truth),
            reference: truth.reference_actuator,
            before: Demodulator::new(truth.display.rendering),
            restarted_s: seconds(shifted_ns),
            standing: None,
            since: Demodulator::new(truth.display.rendering),
            errors: Vec::new(),
            is_unplaced: false,
            quiet_since_s: None,
            was_zero: false,
            least_silence_s: SILENT_TICKS / f64::from(truth.display.update_rate.hz()),
            fade_in_s: f64::from(truth.display.fade_in_ms) * 1e-3,
            full_from_s: f64::NEG_INFINITY,
            rendering: truth.display.rendering,
            peak_v: f64::from(truth.display.amplitude_mv) * 1e-3,
            displacement: Displacement::of(&truth.actuators[truth.reference_actuator]),
        }
    }

    /// The amplitude of what is judged, in V.
    fn amplitude_v(&self) -> f64 {
        let displaced = self.displacement.map(|moved| moved.amplitude_v());
        displaced.unwrap_or(self.peak_v)
    }

    fn restart(&mut self, at_ns: u64) {
        if at_ns < self.judged_ns.start {
            self.restarted_s = self.restarted_s.max(seconds(at_ns));
            self.before = Demodulator::new(self.rendering);
        }
    }

    /// Root mean square of what it is off since the fault, in cycles, each window as long as it is; none if no cycle was
    /// driven, or less than ten of a texture.
    pub fn finish(mut self) -> Option<f64> {
        self.stimulus.end();
        self.follow();
        self.end_stretch();
        if !holds_a_cycle(&self.errors) {
            return None;
        }
        if self.rendering == Rendering::Texture {
            if self.errors.len() < TEXTURE_CYCLES {
                return None;
            }
            let groups = (self.errors.len() / TEXTURE_CYCLES).max(1);
            let length = self.errors.len().div_ceil(groups);
            self.errors = self.errors.chunks(length).filter_map(together).collect();
        }
        let cycles: f64 = self.errors.iter().map(|window| window.cycles).sum();
        let square = |window: &Demodulated| window.cycles * window.error_cycles.powi(2);
        Some((self.errors.iter().map(square).sum::<f64>() / cycles).sqrt())
    }

    fn end_stretch(&mut self) {
        let since = mem::replace(&mut self.since, Demodulator::new(self.rendering));
        // The mean of less than two groups would take away all that a group could tell.
        let is_short = || since.clone().errors(self.amplitude_v()).len() < 2 * TEXTURE_CYCLES;
        if self.is_unplaced && self.rendering == Rendering::Texture && is_short() {
            return;
        }
        let standing = if self.is_unplaced {
            since.clone().standing(self.amplitude_v()).unwrap_or(0.0)
        } else {
            0.0
        };
        let windows = since.errors(self.amplitude_v()).into_iter();
        self.errors.extend(windows.map(|mut window| {
            window.error_cycles -= standing;
            window.error_cycles -= window.error_cycles.round();
            window
        }));
    }

    /// Takes a point since the fault, and ends a stretch where a silence is over. Whether the point is one of a silence.
    fn notice_silence(&mut self, edge: &Edge) -> bool {
        let loudest = edge.words.iter().map(|&word| volts(word).abs());
        let loudest_v = loudest.fold(0.0, f64::max);
        let least_s = self.least_silence_s;
        let lasts = |since_s: f64| edge.t_s - since_s >= least_s;
        if loudest_v <= QUIET * self.peak_v {
            self.was_zero |= loudest_v == 0.0;
            let since_s = *self.quiet_since_s.get_or_insert(edge.t_s);
            return self.was_zero && lasts(since_s);
        }
        let was_zero = mem::take(&mut self.was_zero);
        if was_zero && self.quiet_since_s.is_some_and(lasts) {
            self.end_stretch();
            self.is_unplaced = true;
            self.full_from_s = edge.t_s + self.fade_in_s;
        }
        self.quiet_since_s = None;
        false
    }

    /// Where it stood before the fault. If there was no whole cycle before it, or too few of a texture, nobody knows, as after
    /// a silence.
    fn stand(&mut self) -> f64 {
        let before = self.before.clone();
        let cycles = || before.clone().errors(self.amplitude_v()).len();
        let known = match self.rendering {
            Rendering::Texture if cycles() < TEXTURE_CYCLES => None,
            Rendering::Texture => before.standing(self.amplitude_v()),
            Rendering::Fundamental | Rendering::Shape => before.middle(self.amplitude_v()),
        };
        self.is_unplaced |= known.is_none();
        *self.standing.insert(known.unwrap_or(0.0))
    }

    fn follow(&mut self) {
        let (from_s, to_s) = (seconds(self.judged_ns.start), seconds(self.judged_ns.end));
        let before_s = (from_s - BEFORE_NS as f64 * 1e-9).max(self.restarted_s);
        while let Some(told) = self.stimulus.take() {
            let Told::Point(edge, mut due) = told else {
                continue;
            };
            let mut volts = volts(edge.words[self.reference]);
            if let Some(displacement) = &mut self.displacement {
                volts = displacement.at(edge.t_s, volts).unwrap_or(0.0);
            }
            let is_silent = edge.t_s >= from_s && self.notice_silence(&edge);
            if (before_s..from_s).contains(&edge.t_s) {
                self.before.add(due, volts);
            } else if (from_s..to_s).contains(&edge.t_s) {
                let standing = match self.standing {
                    Some(standing) => standing,
                    None => self.stand(),
                };
                due.cycles += standing;
                if edge.t_s >= self.full_from_s && !is_silent {
                    self.since.add(due, volts);
                }
            }
        }
    }
}

/// Some windows as one; none of none.
fn together(windows: &[Demodulated]) -> Option<Demodulated> {
    let mut one = *windows.first()?;
    one.error_cycles = mean_on_circle(windows)?;
    one.cycles = windows.iter().map(|window| window.cycles).sum();
    Some(one)
}

impl RunObserver for Step {
    fn see(&mut self, event: RunEvent<'_>) {
        self.stimulus.see(event);
        match event {
            RunEvent::Tick(_) => self.follow(),
            RunEvent::Reset(reset) if reset.role == Role::Display => self.restart(reset.at_ns),
            _ => {}
        }
    }
}
