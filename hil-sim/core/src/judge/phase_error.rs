//! How far the stimulus is from its due phase, cycle by cycle.

use std::f64::consts::TAU;

use protocol::Rendering;

use crate::judge::mean;
use crate::judge::phase::Due;

/// Root mean square of a window's voltage, over the highest voltage, from which on the stimulus
/// counts as at full amplitude: a full sine has 0.71, one that fades in over half the window 0.58.
const FULL: f64 = 0.65;
/// Amplitude of the sine that has the loudest cycle's mean square, over the highest voltage, from which on that cycle
/// counts as one at full amplitude: a triangle has 0.82. What never gets so far fades.
const LEAST_FULL: f64 = 0.5;
/// A window with less than this left of the second harmonic is a whole cycle.
const WHOLE: f64 = 0.05;
/// Points that a window needs for its two unknowns to be worth anything.
const ENOUGH_POINTS: usize = 5;
/// Windows with less of a cycle tell too little of it beside a mean of the voltage.
const LEAST_PART: f64 = 0.5;
/// Windows that hold so much of a cycle together hold one: a point stands for a part of it.
const ONE_CYCLE: f64 = 0.9;

/// The stimulus' phase errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseError {
    /// Root mean square, in cycles.
    pub rms_cycles: f64,
    /// Mean, in cycles: above 0 where the stimulus is ahead.
    pub mean_cycles: f64,
}

/// Demodulates a voltage by its due phase φ: least squares of a sin 2πφ + b cos 2πφ over
/// each cycle of travel, forwards or backwards; the phase error is atan2(b, a)/2π.
#[derive(Clone, Debug)]
pub struct Demodulator {
    /// The last point and its voltage, whose weight is not known before the next one, and the cycles travelled
    /// at the point before it.
    last: Option<(Due, f64)>,
    before_cycles: f64,
    window: Window,
    /// Whether a window may hold a part of a cycle: a sine tells its phase by any part of it, but the partials of another
    /// wave cancel over whole cycles only.
    takes_parts: bool,
    demodulated: Vec<Demodulated>,
}

/// A window's sums, each point weighted with the cycles travelled for which it stands: half of the way to each
/// neighbour.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    /// Cycles travelled before it, a whole number.
    number: f64,
    points: usize,
    ss: f64,
    sc: f64,
    cc: f64,
    sv: f64,
    cv: f64,
    vv: f64,
}

/// A window's phase error, and what decides whether it counts.
#[derive(Clone, Copy, Debug)]
pub struct Demodulated {
    /// How far the stimulus is ahead, in cycles.
    pub error_cycles: f64,
    /// How much of a cycle the window holds: about 1, less where it was cut off. A mean of the voltage cancels in a whole
    /// cycle only, so that less than one tells less.
    pub cycles: f64,
    /// Of the squared voltage, in V²·cycles.
    square: f64,
}

impl Demodulator {
    /// For a stimulus of that rendering.
    pub fn new(rendering: Rendering) -> Self {
        Self {
            last: None,
            before_cycles: 0.0,
            window: Window::default(),
            takes_parts: rendering == Rendering::Fundamental,
            demodulated: Vec::new(),
        }
    }

    /// The voltage at the next point, in V.
    pub fn add(&mut self, due: Due, volts: f64) {
        self.weigh(due.travelled_cycles);
        self.last = Some((due, volts));
    }

    /// The errors of the windows at full amplitude, of a voltage of which `peak_v` is the highest; none if the
    /// stimulus never was at full amplitude for a cycle.
    pub fn finish(self, peak_v: f64) -> Option<PhaseError> {
        let errors = self.windows(peak_v);
        Some(PhaseError {
            rms_cycles: mean(errors.iter().map(|window| window.error_cycles.powi(2)))?.sqrt(),
            mean_cycles: mean(errors.iter().map(|window| window.error_cycles))?,
        })
    }

    /// The errors' mean on the circle, so that it tells what stands anywhere, with `peak_v` as in
    /// [`Demodulator::finish`] and each as long as it is; none if there is none.
    pub fn standing(self, peak_v: f64) -> Option<f64> {
        mean_on_circle(&self.errors(peak_v))
    }

    /// The errors' median on the circle: the one that the others are nearest to, with `peak_v` as in
    /// [`Demodulator::finish`]. A window in which the stimulus has only just begun does not move it. None if all together
    /// are no whole cycle.
    pub fn middle(self, peak_v: f64) -> Option<f64> {
        let windows = self.errors(peak_v);
        if !holds_a_cycle(&windows) {
            return None;
        }
        let errors: Vec<f64> = windows.iter().map(|window| window.error_cycles).collect();
        let apart = |one: f64, other: f64| (one - other - (one - other).round()).abs();
        let from_others = |one: f64| errors.iter().map(|&other| apart(one, other)).sum::<f64>();
        let nearer = |one: &f64, other: &f64| from_others(*one).total_cmp(&from_others(*other));
        errors.iter().copied().min_by(nearer)
    }

    /// The windows at full amplitude that hold half a cycle at least, with `peak_v` as in [`Demodulator::finish`].
    pub fn errors(self, peak_v: f64) -> Vec<Demodulated> {
        let mut windows = self.windows(peak_v);
        windows.retain(|window| window.cycles >= LEAST_PART);
        windows
    }

    fn windows(mut self, peak_v: f64) -> Vec<Demodulated> {
        if let Some((last, _)) = self.last {
            self.weigh(last.travelled_cycles);
        }
        self.demodulated
            .extend(self.window.demodulated(self.takes_parts));
        let mean_square = |window: &Demodulated| window.square / window.cycles;
        let loudest = self.demodulated.iter().map(mean_square).fold(0.0, f64::max);
        // A wave that is no sine has another mean square at the same peak: its loudest cycle is a full one.
        let is_rendered = loudest >= 0.5 * LEAST_FULL * LEAST_FULL * peak_v * peak_v;
        let peak_v = if is_rendered {
            peak_v.min((2.0 * loudest).sqrt())
        } else {
            peak_v
        };
        let full_v = FULL * peak_v;
        self.demodulated
            .retain(|window| mean_square(window) >= full_v * full_v);
        self.demodulated
    }

    /// How many windows are held.
    pub fn held(&self) -> usize {
        self.demodulated.len()
    }

    /// Enters the last point, now that the cycles travelled at the next one are known.
    fn weigh(&mut self, next_cycles: f64) {
        let Some((due, volts)) = self.last else {
            self.before_cycles = next_cycles;
            return;
        };
        let number = due.travelled_cycles.floor();
        if number != self.window.number {
            self.demodulated
                .extend(self.window.demodulated(self.takes_parts));
            self.window = Window {
                number,
                ..Window::default()
            };
        }
        let weight = 0.5 * (next_cycles - self.before_cycles);
        self.window.add(due.cycles, volts, weight);
        self.before_cycles = due.travelled_cycles;
    }
}

/// The errors' mean on the circle, in cycles, each as long as it is: half a cycle ahead is half a cycle behind. None if there
/// is none.
pub fn mean_on_circle(windows: &[Demodulated]) -> Option<f64> {
    let (mut s, mut c) = (0.0, 0.0);
    for window in windows {
        let angle = TAU * window.error_cycles;
        s += window.cycles * angle.sin();
        c += window.cycles * angle.cos();
    }
    (s != 0.0 || c != 0.0).then(|| s.atan2(c) / TAU)
}

/// Whether these hold a cycle together.
pub fn holds_a_cycle(windows: &[Demodulated]) -> bool {
    windows.iter().map(|window| window.cycles).sum::<f64>() >= ONE_CYCLE
}

impl Window {
    fn add(&mut self, due_cycles: f64, volts: f64, weight: f64) {
        let (s, c) = (TAU * due_cycles).sin_cos();
        self.points += 1;
        self.ss += weight * s * s;
        self.sc += weight * s * c;
        self.cc += weight * c * c;
        self.sv += weight * s * volts;
        self.cv += weight * c * volts;
        self.vv += weight * volts * volts;
    }

    /// The phase of the voltage relative to its due phase.
    fn demodulated(&self, takes_parts: bool) -> Option<Demodulated> {
        // sin² + cos² = 1: this is the sum of the weights.
        let whole = self.ss + self.cc;
        let determinant = self.ss * self.cc - self.sc * self.sc;
        // A window in which the phase hardly moved does not tell a from b.
        if self.points < ENOUGH_POINTS || determinant <= 1e-3 * whole * whole {
            return None;
        }
        // What the mean of e^(i 2·2πφ) leaves: 0 over a whole cycle.
        let left = (self.ss - self.cc).hypot(2.0 * self.sc);
        if !takes_parts && left > WHOLE * whole {
            return None;
        }
        let a = (self.sv * self.cc - self.cv * self.sc) / determinant;
        let b = (self.cv * self.ss - self.sv * self.sc) / determinant;
        Some(Demodulated {
            error_cycles: b.atan2(a) / TAU,
            cycles: whole,
            square: self.vv,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(cycles: f64, travelled_cycles: f64) -> Due {
        Due {
            t_s: 0.0,
            cycles,
            travelled_cycles,
            tick: (0.0, 0.0),
        }
    }

    /// Adds `cycles` in steps of a fortieth, of a wave of three partials that is highest where they meet, `ahead` of what
    /// is due.
    fn demodulate(rendering: Rendering, cycles: &[(f64, f64)], ahead: f64) -> Option<PhaseError> {
        let mut demodulator = Demodulator::new(rendering);
        let mut points = 0_u32;
        for &(from, to) in cycles {
            let steps = ((to - from).abs() * 40.0).round() as usize;
            for step in 0..steps {
                let cycles = from + (to - from) * step as f64 / steps as f64;
                let angle = TAU * (cycles + ahead);
                let volts = angle.sin() + (2.0 * angle + 1.5).sin() + (3.0 * angle).cos();
                demodulator.add(due(cycles, f64::from(points) / 40.0), volts);
                points += 1;
            }
        }
        demodulator.finish(2.6)
    }

    #[test]
    fn a_wave_of_another_form_is_judged_by_its_own_loudest_cycle() {
        // Its root mean square is 1.22 V, 0.47 of its peak.
        let error = demodulate(Rendering::Shape, &[(0.0, 12.0)], 0.1).expect("it is driven");
        assert!((error.mean_cycles - 0.1).abs() < 0.002, "{error:?}");
        assert!(error.rms_cycles < 0.105, "{error:?}");
    }

    #[test]
    fn of_a_wave_of_another_form_only_whole_cycles_count() {
        // At the end to and fro over the same 0.3 of a cycle, where the wave is loudest.
        let turning = [(0.0, 7.15), (7.15, 6.85), (6.85, 7.15), (7.15, 6.9)];
        let whole = demodulate(Rendering::Shape, &turning, 0.0).expect("seven cycles");
        assert!(whole.rms_cycles < 0.01, "{whole:?}");
    }

    #[test]
    fn the_middle_is_where_most_cycles_are_across_the_end_of_the_circle_too() {
        let mut demodulator = Demodulator::new(Rendering::Fundamental);
        for point in 0..200 {
            let cycles = f64::from(point) / 40.0;
            let ahead = if point < 40 {
                0.15
            } else {
                0.49 + 0.004 * cycles
            };
            demodulator.add(due(cycles, cycles), (TAU * (cycles + ahead)).sin());
        }
        let middle = demodulator.clone().middle(1.0).expect("five cycles");
        assert!((middle.abs() - 0.5).abs() < 0.01, "{middle}");
        let standing = demodulator.standing(1.0).expect("five cycles");
        assert!((standing.abs() - 0.5).abs() > 0.03, "{standing}");
    }

    #[test]
    fn what_only_fades_is_not_judged() {
        let mut demodulator = Demodulator::new(Rendering::Texture);
        for step in 0..400 {
            let cycles = f64::from(step) / 40.0;
            demodulator.add(due(cycles, cycles), 0.4 * (TAU * cycles).sin());
        }
        assert_eq!(demodulator.finish(1.0), None);
    }
}
