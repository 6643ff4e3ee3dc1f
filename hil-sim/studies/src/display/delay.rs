//! The paper's claim, as a chart: how far the stimulus is from the motion that it belongs to, over the
//! link's one-way delay d.
//!
//! Ours is measured on the display's ELF: λ crosses the link, the stimulus is made of the hand's own
//! motion. Beside it stands a stimulus that is relayed, as in the systems of the paper's introduction:
//! "tactile information sensed by the tactile sensors was sequentially transferred to the display side".
//! There the arm follows the hand's motion d late, its finger feels sin 2π x(t − d)/λ, and the display
//! plays that another d later:
//!
//! relayed(t) = sin 2π x(t − 2d)/λ, where sin 2π x(t)/λ is due: off by (x(t) − x(t − 2d))/λ cycles.
//!
//! It has no other fault: no loss, no jitter, no buffer, no sampling, an arm without lag, a display
//! without a tick. A real one is worse.

mod picture;

use std::f64::consts::TAU;
use std::ops::Range;

use super::timing::{STROKE, WAVELENGTH_MM};
use super::{bad, late, seconds};
use crate::study::{Progress, Record, Study, Table, csv, fixed, number, short};
use hil_sim_boards::display_alone::{self, DisplayBench};
use hil_sim_boards::{ElfError, Firmware};
use hil_sim_core::judge::actuators;
use hil_sim_core::judge::edges::edges;
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::run::recording::volts;
use hil_sim_core::scene::{Link, Motion};
use protocol::DisplayConfiguration;

const DELAYS_MS: [f64; 8] = [0.0, 10.0, 20.0, 50.0, 100.0, 200.0, 350.0, 500.0];
/// The delay whose voltages are drawn, and what of it: about a reversal of the hand.
const SHOWN_MS: f64 = 100.0;
const SHOWN_S: Range<f64> = 5.2..5.75;
/// The most that our phase may be off at any delay, in cycles rms, and our outputs behind the hand, in ms: a
/// hundredth of a cycle, two ticks.
const GOAL_CYCLES: f64 = 0.01;
const GOAL_MS: f64 = 1.0;
const AMPLITUDE_V: f64 = 5.0;

/// A delay, and what came of it.
#[derive(Clone, Debug)]
pub struct Row {
    link: Link,
    /// Root mean square of our phase error about its mean, cycle by cycle.
    ours_cycles: Option<f64>,
    /// From a movement of the hand to our output, median.
    ours_ms: Option<f64>,
    /// From a tick to its edge: what of it is not the wait for the tick.
    edge_ms: Option<f64>,
    /// Root mean square of the relayed stimulus' phase error about its mean, not wrapped.
    relayed_cycles: f64,
    /// The phase that our stimulus happened to begin with, ahead of x/λ.
    begins_cycles: f64,
    /// Our voltage in V over s, of the delay that is drawn.
    drawn: Vec<(f64, f64)>,
}

/// Measures all rows.
pub fn measure(
    firmware: &Firmware,
    quick: bool,
    progress: &impl Progress,
) -> Result<Vec<Row>, ElfError> {
    let links = if quick {
        vec![late(SHOWN_MS)]
    } else {
        DELAYS_MS.map(|ms| [late(ms), bad(ms)]).concat()
    };
    progress.begin(links.len());
    progress.each(&links, |&link| row(firmware, link, quick))
}

fn row(firmware: &Firmware, link: Link, quick: bool) -> Result<Row, ElfError> {
    let duration_s = if quick { 2.0 } else { 8.0 };
    let bench = DisplayBench {
        link,
        ..DisplayBench::new(STROKE, WAVELENGTH_MM, duration_s)
    };
    let recording = display_alone::run(bench, firmware)?.recording;
    let surface = |_| WAVELENGTH_MM;
    let mut truth = Truth::new("delay", "", &surface);
    truth.display = DisplayConfiguration::DEFAULT;
    let judged = actuators::judge(&truth, &recording);
    let outputs = recording.outputs.iter();
    let voltages = outputs.map(|o| (seconds(o.at_ns), volts(o.words[truth.reference_actuator])));
    let mut voltages: Vec<(f64, f64)> = voltages.collect();
    let begins_cycles = begins_cycles(&voltages);
    let is_drawn = link.delay_ms == SHOWN_MS && link.loss == 0.0;
    voltages.retain(|(t_s, _)| is_drawn && SHOWN_S.contains(t_s));
    Ok(Row {
        link,
        ours_cycles: about_mean(
            judged.phase_error_rms_cycles,
            judged.phase_error_mean_cycles,
        ),
        ours_ms: judged.hand_to_output.map(|reaction| reaction.p50_ms),
        edge_ms: edges(&recording.ticks, &recording.outputs, 0)
            .map(|edges| edges.after.p50_us * 1e-3),
        relayed_cycles: relayed_cycles(&STROKE, WAVELENGTH_MM, link.delay_ms * 1e-3, duration_s),
        begins_cycles,
        drawn: voltages,
    })
}

/// Root mean square about the mean. Which phase the stimulus has when it begins is nobody's choice: the
/// first estimate comes in the middle of a stroke. Being late is not in the mean, since it changes its
/// sign with every stroke.
fn about_mean(rms: Option<f64>, mean: Option<f64>) -> Option<f64> {
    let (rms, mean) = (rms?, mean?);
    Some((rms * rms - mean * mean).max(0.0).sqrt())
}

/// The phase error of a relayed stimulus, in cycles: root mean square about its mean, over the time after its
/// first round trip.
fn relayed_cycles(hand: &Motion, wavelength_mm: f64, delay_s: f64, duration_s: f64) -> f64 {
    const STEP_S: f64 = 0.5e-3;
    let trip_s = 2.0 * delay_s;
    let steps = ((duration_s - trip_s) / STEP_S).floor().max(1.0) as u32;
    let errors = || {
        (0..steps)
            .map(|step| trip_s + f64::from(step) * STEP_S)
            .map(|t_s| (hand.position_mm(t_s) - hand.position_mm(t_s - trip_s)) / wavelength_mm)
    };
    let square: f64 = errors().map(|error| error * error).sum::<f64>() / f64::from(steps);
    let mean = errors().sum::<f64>() / f64::from(steps);
    (square - mean * mean).max(0.0).sqrt()
}

/// How much a voltage (s, V) is ahead of sin 2π x/λ on the whole, in cycles.
fn begins_cycles(voltages: &[(f64, f64)]) -> f64 {
    let (mut along, mut across) = (0.0, 0.0);
    for (t_s, volts) in voltages {
        let turns = STROKE.position_mm(*t_s) / WAVELENGTH_MM;
        let (sin, cos) = (TAU * turns).sin_cos();
        along += volts * sin;
        across += volts * cos;
    }
    across.atan2(along) / TAU
}

/// A stimulus by the hand's position `late_s` ago that began with such a phase, in V.
fn stimulus_v(t_s: f64, late_s: f64, begins_cycles: f64) -> f64 {
    let turns = STROKE.position_mm((t_s - late_s).max(0.0)) / WAVELENGTH_MM + begins_cycles;
    AMPLITUDE_V * (TAU * turns).sin()
}

impl Row {
    fn is_met(&self) -> bool {
        self.ours_cycles.is_some_and(|cycles| cycles <= GOAL_CYCLES)
            && self.ours_ms.is_some_and(|ms| ms <= GOAL_MS)
    }

    fn relayed_ms(&self) -> f64 {
        2.0 * self.link.delay_ms
    }

    /// Cycles and ms of the relayed stimulus, which is modelled with the delay alone.
    fn relayed(&self) -> (Option<f64>, Option<f64>) {
        let modelled = (self.relayed_cycles, self.relayed_ms());
        (self.link.loss == 0.0).then_some(modelled).unzip()
    }
}

impl Study for Vec<Row> {
    const NAME: &'static str = "delay";

    fn table(&self) -> Option<Table> {
        let rows = self.iter().map(|row| {
            let (cycles, ms) = row.relayed();
            Record::default()
                .with("delay, ms:", short(row.link.delay_ms))
                .with("jitter, ms:", short(row.link.jitter_ms))
                .with("loss, %:", number(100.0 * row.link.loss, 0))
                .with("ours: phase error RMS, cycles:", number(row.ours_cycles, 4))
                .with("hand to output p50, ms:", number(row.ours_ms, 3))
                .with("relayed: phase error RMS, cycles:", number(cycles, 3))
                .with("late, ms:", number(ms, 0))
                .judged(row.is_met())
        });
        Some(rows.collect())
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let rows = self.iter().map(|row| {
            let (relayed_cycles, relayed_ms) = row.relayed();
            Record::default()
                .with("delay_ms", short(row.link.delay_ms))
                .with("jitter_ms", short(row.link.jitter_ms))
                .with("loss", short(row.link.loss))
                .with("ours_rms_cycles", fixed(row.ours_cycles, 5))
                .with("ours_hand_to_output_p50_ms", fixed(row.ours_ms, 5))
                .with("ours_edge_after_tick_ms", fixed(row.edge_ms, 5))
                .with("relayed_rms_cycles", fixed(relayed_cycles, 5))
                .with("relayed_late_ms", fixed(relayed_ms, 5))
        });
        vec![("", csv(rows))]
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        self.iter().all(Row::is_met)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relayed_sine_is_off_by_the_chord_of_its_round_trip() {
        // x(t) − x(t − 2d) = 2 X sin ωd · sin ω(t − d), X = α/ω: √2 X sin ωd / λ over whole strokes.
        let omega = TAU * 0.83;
        for delay_s in [0.01, 0.1, 0.3] {
            let due = 2f64.sqrt() * 70.0 / omega * f64::sin(omega * delay_s) / 2.0;
            let whole_strokes_s = 2.0 * delay_s + 6.0 / 0.83;
            let cycles = relayed_cycles(&STROKE, 2.0, delay_s, whole_strokes_s);
            assert!((cycles / due - 1.0).abs() < 1e-3, "{cycles} {due}");
        }
        assert_eq!(relayed_cycles(&STROKE, 2.0, 0.0, 4.0), 0.0);
    }

    #[test]
    fn a_stimulus_that_is_late_or_out_of_step_does_not_meet_the_claim() {
        let row = Row {
            link: Link::default(),
            ours_cycles: Some(0.004),
            ours_ms: Some(0.345),
            edge_ms: None,
            relayed_cycles: 0.0,
            begins_cycles: 0.0,
            drawn: Vec::new(),
        };
        let is_met = |row: Row| vec![row].is_met();
        assert!(is_met(row.clone()));
        // Relayed over 1 ms, 50 mm/s over 2 mm are off by 0.05 cycles.
        for (ours_cycles, ours_ms) in [
            (Some(0.05), Some(0.3)),
            (Some(0.004), Some(2.0)),
            (None, Some(0.3)),
        ] {
            let late = Row {
                ours_cycles,
                ours_ms,
                ..row.clone()
            };
            assert!(!is_met(late));
        }
    }

    #[test]
    fn a_constant_phase_is_no_error() {
        assert_eq!(about_mean(Some(0.05), Some(-0.05)), Some(0.0));
        let spread = about_mean(Some(0.05), Some(0.03)).unwrap();
        assert!((spread - 0.04).abs() < 1e-12);
        assert_eq!(about_mean(None, None), None);
    }

    #[test]
    fn the_stimulus_due_is_the_one_that_is_not_late() {
        assert_eq!(stimulus_v(0.0, 0.0, 0.0), 0.0);
        assert_eq!(stimulus_v(3.25, 0.25, 0.1), stimulus_v(3.0, 0.0, 0.1));
    }

    #[test]
    fn the_phase_that_a_stimulus_began_with_is_found() {
        let voltages: Vec<_> = (0..8_000)
            .map(|tick| f64::from(tick) * 0.5e-3)
            .map(|t_s| (t_s, stimulus_v(t_s, 0.0, 0.2)))
            .collect();
        assert!((begins_cycles(&voltages) - 0.2).abs() < 0.01);
    }
}
