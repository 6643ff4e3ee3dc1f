//! The charts of a run.

use std::ops::Range;

use protocol::{Contact, GAUGES, Mode};

use crate::output::plot::palette::{FIRST, QUIET, REFUSED, SECOND, SHADE};
use crate::output::plot::{Axis, Mark};
use crate::output::report::crossings::banded;
use crate::output::report::senses;
use crate::output::report::senses::stretches;
use crate::output::report::thin::{DOTS, LINE_POINTS, stride, thin};
use crate::output::report::{Chapter, Figure, draw};
use hil_sim_core::judge::track::Track;
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::judge::{JudgedEstimate, seconds};
use hil_sim_core::run::recording::{Recording, volts};

/// What the gauge signal's chart shows of a run, and the voltages'.
const SIGNAL_S: f64 = 0.5;
const VOLTAGE_S: f64 = 0.2;
/// Actuators shown when all have the same phase: both ends of the array and its middle.
const UNIFORM: [usize; 3] = [0, 24, 49];
/// Actuators shown when the pattern travels: every other one of the middle row.
const TRAVELLING: [usize; 5] = [20, 22, 24, 26, 28];
/// Distance between two actuators' zero lines: 5 V up, 5 V down and a gap.
const LANE_V: f64 = 13.0;
/// How long a fingertip that sticks is worth a shade.
const HELD_S: f64 = 0.049;
/// A difference between hand and arm worth a line of its own.
const APART_MM: f64 = 0.1;

pub fn figures(chapter: &Chapter) -> [Figure; 5] {
    let Chapter {
        truth, recording, ..
    } = chapter;
    [
        signal(truth, recording),
        wavelength(chapter),
        senses::figure(chapter),
        velocity(truth, recording),
        voltages(truth, recording),
    ]
}

/// The band-passed signal of the counted gauge and its impulses (Okamoto et al. 2009, Fig. 4).
fn signal(truth: &Truth, recording: &Recording) -> Figure {
    let window = middle(recording.duration_s, SIGNAL_S);
    let gauge = usize::from(truth.sensor.counted_gauge).min(GAUGES - 1);
    let (y, marks) = banded(&recording.scans, gauge, &window).drawn();
    Figure {
        title: format!("Gauge {gauge} behind the band-pass"),
        legend: vec![
            (FIRST, "signal, 5–100 Hz"),
            (REFUSED, "impulse at each zero crossing"),
        ],
        svg: draw(310.0, &Axis::round("time in s", window), &y, marks.into()),
        note: "The sensor's own filters, run over the recorded codes.".into(),
    }
}

/// λ̂ against the truth.
fn wavelength(chapter: &Chapter) -> Figure {
    let Chapter {
        truth, recording, ..
    } = chapter;
    let estimates = &chapter.verdict.estimates;
    let arm = Track::of_arm(recording);
    let truths: Vec<(f64, f64)> = thin(arm.points(), LINE_POINTS)
        .into_iter()
        .filter_map(|(t_s, x_mm)| Some((t_s, truth.wavelength_at(x_mm)?)))
        .collect();
    let largest = |value: &dyn Fn(&JudgedEstimate) -> Option<f64>| {
        estimates.iter().filter_map(value).fold(f64::NAN, f64::max)
    };
    let valid_mm = largest(&|e| e.wavelength_mm.filter(|_| e.valid));
    let count_mm = largest(&|e| e.counted_mm.filter(|_| speaks(e) && truth.counts_beside()));
    let true_mm = truths.iter().map(|point| point.1).fold(f64::NAN, f64::max);
    // Guesses at a near standstill can be huge: they stay at the upper edge.
    let shown_mm = (1.1 * valid_mm.max(count_mm)).min(2.0 * true_mm);
    let top_mm = (1.25 * true_mm).max(shown_mm);
    let y = Axis::round("wavelength λ in mm", 0.0..top_mm);
    let dots = |valid: bool| {
        let of_kind = estimates.iter().filter(|estimate| estimate.valid == valid);
        let points = of_kind.filter_map(|e| Some((e.t_s, e.wavelength_mm?.min(y.high))));
        thin(&points.collect::<Vec<_>>(), DOTS)
    };
    let mut held = stretches(estimates, |e| match e.contact {
        Contact::Stick | Contact::StickSlip => Some(()),
        Contact::Slip | Contact::Unknown => None,
    });
    // What alternates faster is in the strip of contact.
    held.retain(|(stretch, ())| stretch.end - stretch.start > HELD_S);
    let mut legend = vec![
        (SECOND, "true λ under the sensor"),
        (FIRST, "valid estimate"),
        (REFUSED, "estimate marked invalid"),
    ];
    let mut marks = Vec::new();
    if !held.is_empty() {
        legend.push((
            SHADE,
            "the fingertip sticks, or sticks and slips, for 50 ms or more by the sensor's word",
        ));
        let held = held.into_iter().map(|(stretch, ())| stretch).collect();
        marks.push(Mark::Shade(SHADE, held));
    }
    if truth.counts_beside() {
        legend.push((QUIET, "the paper's count beside it, A = 80 ms, in T1"));
        let lines = counted(estimates, y.high);
        marks.extend(lines.into_iter().map(|line| Mark::thin(QUIET, line)));
    }
    marks.extend([
        Mark::dots(REFUSED, dots(false)),
        Mark::dots(FIRST, dots(true)),
        Mark::line(SECOND, with_steps(&truths)),
    ]);
    let mut note = String::from("What lies above the chart is drawn at its upper edge.");
    if stride(estimates.len(), DOTS) > 1 {
        note += " Of many estimates only some are drawn.";
    }
    Figure {
        title: "Wavelength, estimated and true".into(),
        legend,
        svg: draw(310.0, &whole(recording), &y, marks),
        note,
    }
}

/// The paper's count as lines that break where it has nothing to say or is in T2.
fn counted(estimates: &[JudgedEstimate], top_mm: f64) -> Vec<Vec<(f64, f64)>> {
    let thinned = thin(estimates, LINE_POINTS);
    let lines = thinned.chunk_by(|one, next| speaks(one) && speaks(next));
    let lines = lines.map(|line| -> Vec<(f64, f64)> {
        let points = line.iter().filter(|estimate| speaks(estimate));
        points
            .filter_map(|e| Some((e.t_s, e.counted_mm?.min(top_mm))))
            .collect()
    });
    lines.filter(|line| !line.is_empty()).collect()
}

/// Whether the paper's count has a λ that the paper would go by.
fn speaks(estimate: &JudgedEstimate) -> bool {
    estimate.counted_mm.is_some() && estimate.range == protocol::Range::T1
}

/// The hand's velocity, and the arm's where it is another; the paper's range T2 shaded.
fn velocity(truth: &Truth, recording: &Recording) -> Figure {
    let hand = Track::of_hand(recording);
    let arm = Track::of_arm(recording);
    let velocities = |track: &Track| -> Vec<(f64, f64)> {
        let points = thin(track.points(), LINE_POINTS).into_iter();
        points
            .filter_map(|(t_s, _)| Some((t_s, track.velocity_mm_s(t_s)?)))
            .collect()
    };
    let of_hand = velocities(&hand);
    let apart = of_hand.iter().any(|&(t_s, _)| {
        let both_mm = hand.position_mm(t_s).zip(arm.position_mm(t_s));
        both_mm.is_some_and(|(hand, arm)| (hand - arm).abs() > APART_MM)
    });
    let mut legend = vec![(FIRST, "hand"), (SHADE, "range T2: v(t)·v(t − A) < 0")];
    let turns = range_t2(&of_hand, &hand, truth.window_s());
    let mut marks = vec![Mark::Shade(SHADE, turns)];
    let of_arm = if apart { velocities(&arm) } else { Vec::new() };
    let speeds = of_hand.iter().chain(&of_arm).map(|point| point.1);
    let low = speeds.clone().fold(0.0, f64::min);
    let high = speeds.fold(0.0, f64::max);
    if apart {
        legend.insert(1, (SECOND, "arm"));
        marks.push(Mark::line(SECOND, of_arm));
    }
    marks.push(Mark::line(FIRST, of_hand));
    let margin = 0.1 * (high - low).max(1.0);
    let y = Axis::round("velocity v in mm/s", low - margin..high + margin);
    Figure {
        title: "Rubbing velocity".into(),
        legend,
        svg: draw(250.0, &whole(recording), &y, marks),
        note: format!("The window A is {:.0} ms.", 1e3 * truth.window_s()),
    }
}

fn voltages(truth: &Truth, recording: &Recording) -> Figure {
    let (shown, title): (&[usize], _) = match truth.display.mode {
        Mode::Uniform => (&UNIFORM, "Voltages of three actuators, all in phase"),
        Mode::Travelling => (
            &TRAVELLING,
            "Voltages along the middle row, a travelling pattern",
        ),
    };
    let window = around_the_outputs(recording);
    let zero_v = |lane: usize| -(lane as f64) * LANE_V;
    let lanes = || shown.iter().enumerate();
    let marks = lanes().map(|(lane, &actuator)| {
        let colour = if lane % 2 == 0 { FIRST } else { SECOND };
        Mark::line(colour, held(recording, actuator, &window, zero_v(lane)))
    });
    let labels = lanes().flat_map(|(lane, actuator)| {
        let zero_v = zero_v(lane);
        [
            (zero_v, format!("#{actuator}: 0")),
            (zero_v + 5.0, "+5".into()),
            (zero_v - 5.0, "−5".into()),
        ]
    });
    let range = zero_v(shown.len() - 1) - 5.5..5.5;
    let y = Axis::named("actuator: voltage in V", range, labels.collect());
    let height = 75.0 + 100.0 * shown.len() as f64;
    let x = Axis::round("time in s", window.clone());
    Figure {
        title: title.into(),
        legend: Vec::new(),
        svg: draw(height, &x, &y, marks.collect()),
        note: "Held from one LDAC edge to the next, as the DACs hold it.".into(),
    }
}

fn whole(recording: &Recording) -> Axis {
    Axis::round("time in s", 0.0..recording.duration_s)
}

/// `length_s` from the middle of a run, or all of it.
fn middle(duration_s: f64, length_s: f64) -> Range<f64> {
    let start_s = (0.5 * (duration_s - length_s)).max(0.0);
    start_s..(start_s + length_s).min(duration_s)
}

/// [`VOLTAGE_S`] around the middle one of all output changes: there it vibrates, if anywhere.
fn around_the_outputs(recording: &Recording) -> Range<f64> {
    let middle_one = recording.outputs.get(recording.outputs.len() / 2);
    middle_one.map_or(middle(recording.duration_s, VOLTAGE_S), |output| {
        let start_s = (seconds(output.at_ns) - 0.5 * VOLTAGE_S).max(0.0);
        start_s..start_s + VOLTAGE_S
    })
}

/// An actuator's voltage in a stretch of time as the steps that it is, moved by `zero_v`.
fn held(
    recording: &Recording,
    actuator: usize,
    window: &Range<f64>,
    zero_v: f64,
) -> Vec<(f64, f64)> {
    let outputs = &recording.outputs;
    let first = outputs.partition_point(|output| seconds(output.at_ns) < window.start);
    let before = first.checked_sub(1).and_then(|before| outputs.get(before));
    let mut level = zero_v + before.map_or(0.0, |output| volts(output.words[actuator]));
    let mut points = vec![(window.start, level)];
    for output in &outputs[first..] {
        let t_s = seconds(output.at_ns);
        if t_s >= window.end {
            break;
        }
        points.push((t_s, level));
        level = zero_v + volts(output.words[actuator]);
        points.push((t_s, level));
    }
    points.push((window.end, level));
    points
}

/// The stretches in which the velocity has another sign than A before (equation (8)).
fn range_t2(velocities: &[(f64, f64)], hand: &Track, window_s: f64) -> Vec<Range<f64>> {
    let mut stretches: Vec<Range<f64>> = Vec::new();
    let mut inside = false;
    for &(t_s, v) in velocities {
        let before = hand
            .velocity_mm_s(t_s - window_s)
            .filter(|_| t_s >= window_s);
        let t2 = before.is_some_and(|before| v * before < 0.0);
        match stretches.last_mut() {
            Some(stretch) if inside => stretch.end = t_s,
            _ if t2 => stretches.push(t_s..t_s),
            _ => {}
        }
        inside = t2;
    }
    stretches
}

/// A line that stays level up to each change.
fn with_steps(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::new();
    for (index, &(t_s, value)) in points.iter().enumerate() {
        match line.last() {
            Some(&(_, before)) if before != value => line.extend([(t_s, before), (t_s, value)]),
            None => line.push((t_s, value)),
            Some(_) if index + 1 == points.len() => line.push((t_s, value)),
            Some(_) => {}
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::judge::synthetic::Run;

    #[test]
    fn range_t2_lasts_the_window_after_each_reversal() {
        let hand = Track::of_hand(&Run::swinging(70.0, 1.0, 2.0).record());
        let velocities: Vec<_> = hand
            .points()
            .iter()
            .map(|&(t_s, _)| (t_s, hand.velocity_mm_s(t_s).unwrap()))
            .collect();
        let stretches = range_t2(&velocities, &hand, 0.08);
        // v = 70 sin 2πt turns at 0.5, 1 and 1.5 s; ticks are 0.5 ms apart.
        assert_eq!(stretches.len(), 3);
        for (stretch, turn_s) in stretches.iter().zip([0.5, 1.0, 1.5]) {
            assert!((stretch.start - turn_s).abs() < 2e-3, "{stretch:?}");
            assert!((stretch.end - turn_s - 0.08).abs() < 2e-3, "{stretch:?}");
        }
    }

    #[test]
    fn steps_stay_steps_and_level_stretches_cost_two_points() {
        let points = [(0.0, 1.0), (1.0, 1.0), (2.0, 4.0), (3.0, 4.0), (4.0, 4.0)];
        assert_eq!(
            with_steps(&points),
            [(0.0, 1.0), (2.0, 1.0), (2.0, 4.0), (4.0, 4.0)]
        );
    }

    #[test]
    fn a_voltage_is_held_from_edge_to_edge() {
        let recording = Run::steady(50.0, 2.0).record();
        let points = held(&recording, 0, &(1.0..1.01), 0.0);
        assert_eq!(points.first().unwrap().0, 1.0);
        assert_eq!(points.last().unwrap().0, 1.01);
        assert!(
            points
                .windows(2)
                .all(|pair| pair[0].0 == pair[1].0 || pair[0].1 == pair[1].1)
        );
    }
}
