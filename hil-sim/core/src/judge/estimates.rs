//! The estimates beside the truth.

use std::collections::VecDeque;

use protocol::{Contact, Estimate, GAUGES, GaugeHealth, Range, Rendering};
use serde::Serialize;

use crate::judge::track::interpolate;
use crate::judge::truth::Truth;
use crate::judge::{MOTION_MM_S, finite, mean, seconds, words};
use crate::run::observer::{RunEvent, RunObserver, replay_to};
use crate::run::recording::{Arrival, EstimateRecord, Recording, ScanRecord};

/// Relative error within which an estimate counts as settled, and above which a valid one is wrong.
pub const SETTLED: f64 = 0.1;
/// Relative change of λ from one scan to the next that makes a boundary between specimens.
const BOUNDARY: f64 = 1e-3;
/// How long an estimate speaks for the surface, in s, if no other follows: one and a half of the
/// 10 ms between two, so that a little jitter leaves no gap.
const ESTIMATE_LASTS_S: f64 = 15e-3;
/// Estimates on their way at most: 40 s, twice what the longest delay and jitter of a scene may come to.
const TRAVELLING: usize = 4_096;

/// An estimate and the truth at its instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct JudgedEstimate {
    /// The instant the sensor gives it, in s since the scene's start.
    pub t_s: f64,
    /// The true λ under the sensor at that instant, in mm; none where there is no surface.
    pub truth_mm: Option<f64>,
    /// The estimated λ in mm.
    pub wavelength_mm: Option<f64>,
    /// The estimator's own probability that λ̂ is within 5 % of the truth, 0 to 1.
    pub confidence: Option<f64>,
    /// Whether the estimator stands by it.
    pub valid: bool,
    /// λ in mm by the paper's count, beside whatever method the estimate is of.
    pub counted_mm: Option<f64>,
    /// The paper's range.
    pub range: Range,
    /// Amplitude of the surface's fundamental in ADC steps.
    pub amplitude_lsb: Option<f64>,
    /// What the fingertip does.
    #[serde(serialize_with = "words::contact")]
    pub contact: Contact,
    /// How far the contact lags behind the arm, in µm.
    pub lag_um: Option<i32>,
    /// The gauges that took part, as a list of their numbers.
    #[serde(serialize_with = "words::gauges")]
    pub gauges_used: u8,
    /// What is wrong with each gauge.
    #[serde(serialize_with = "words::health")]
    pub health: [GaugeHealth; GAUGES],
}

/// The estimates as a whole. Relative errors are (λ̂ − λ)/λ of each valid estimate at its instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Root of the mean square of the relative errors, in %.
    pub rms_percent: Option<f64>,
    /// Mean of the relative errors, in %.
    pub bias_percent: Option<f64>,
    /// Mean of the valid λ̂, in mm.
    pub mean_mm: Option<f64>,
    /// Share of the time in motion (|v| > [`MOTION_MM_S`]) with a valid estimate, 0 to 1; none
    /// without motion.
    pub valid_share: Option<f64>,
    /// Share of all estimates that are valid and yet more than [`SETTLED`] off, 0 to 1; none without
    /// any estimate.
    pub wrong_share: Option<f64>,
    /// Root of the mean square of the relative errors of the paper's count, in %, over the estimates
    /// in T1 in which it has a λ: the ones the paper goes by.
    pub counted_rms_percent: Option<f64>,
    /// From the last boundary between two specimens until every later valid estimate is within
    /// [`SETTLED`], in ms; none without a boundary, or if that never came.
    pub settling_ms: Option<f64>,
    /// Mean time from an estimate's instant to its last byte at the display, in ms.
    pub latency_ms: Option<f64>,
    /// Share of the time in which the hand moves over a surface with a λ, in which the display drives at a λ
    /// within 5 % of it, 0 to 1: see [`crate::judge::felt`]. None without such time, or if only the
    /// estimates were judged.
    pub felt_right_share: Option<f64>,
    /// Share of the time in which the hand moves, in which the display drives at a λ more than [`SETTLED`] off,
    /// or at any where there is none, 0 to 1. None without motion, or if only the estimates were judged.
    pub felt_wrong_share: Option<f64>,
    /// The rendering that the surface needs: see [`crate::judge::needed`]. None if no texture was told, or if only the
    /// estimates were judged.
    #[serde(serialize_with = "crate::judge::needed::by_name")]
    pub rendering_needed: Option<Rendering>,
}

impl JudgedEstimate {
    /// The relative error of a valid estimate where there is a surface.
    pub fn relative_error(&self) -> Option<f64> {
        let truth_mm = self.truth_mm?;
        let wavelength_mm = self.wavelength_mm.filter(|_| self.valid)?;
        Some((wavelength_mm - truth_mm) / truth_mm)
    }

    /// The relative error of the paper's count where there is a surface, in T1.
    pub fn counted_error(&self) -> Option<f64> {
        let truth_mm = self.truth_mm?;
        let counted_mm = self.counted_mm.filter(|_| self.range == Range::T1)?;
        Some((counted_mm - truth_mm) / truth_mm)
    }

    /// Whether the estimator stands by something that is more than [`SETTLED`] off, or no number at
    /// all. Never where there is no surface.
    pub fn is_wrong(&self) -> bool {
        let right = |error: f64| error.abs() <= SETTLED;
        self.valid && self.truth_mm.is_some() && !self.relative_error().is_some_and(right)
    }
}

/// Judges the estimates of a recording, one by one and as a whole.
pub fn judge(truth: &Truth, recording: &Recording) -> (Vec<JudgedEstimate>, Summary) {
    let mut judge = Judge::new(truth);
    replay_to(recording, &mut judge);
    judge.finish()
}

/// Judges the estimates of a run as it goes on: they are kept, of the scans only the last.
pub struct Judge<'a> {
    truth: Truth<'a>,
    estimates: Vec<JudgedEstimate>,
    /// Estimates before this one are beside the truth: that takes the scan after them.
    placed: usize,
    /// The last few that have not arrived, until they do.
    travelling: VecDeque<EstimateRecord>,
    /// Of the time from an estimate to its arrival, in ms, and how many arrived.
    latency_ms: (f64, usize),
    /// The arm at the last scan, in s and mm.
    arm: Option<(f64, f64)>,
    /// Estimates made by the scan before the last one.
    made: usize,
    moving_s: f64,
    valid_s: f64,
    /// λ under the sensor at the last scan, in mm; none if there is no surface.
    under_mm: Option<f64>,
    /// λ under the sensor at the last scan with a surface, in mm.
    here_mm: Option<f64>,
    /// When the sensor last crossed from one specimen to another, in s.
    boundary_s: Option<f64>,
}

impl<'a> Judge<'a> {
    /// Before the run.
    pub fn new(truth: &Truth<'a>) -> Self {
        Self {
            truth: *truth,
            estimates: Vec::new(),
            placed: 0,
            travelling: VecDeque::new(),
            latency_ms: (0.0, 0),
            arm: None,
            made: 0,
            moving_s: 0.0,
            valid_s: 0.0,
            under_mm: None,
            here_mm: None,
            boundary_s: None,
        }
    }

    /// The estimates beside the truth, in the order they were made, and as a whole.
    pub fn finish(mut self) -> (Vec<JudgedEstimate>, Summary) {
        if let Some(last) = self.arm {
            self.place(&[last], f64::INFINITY);
        }
        let estimates = self.estimates;
        let errors = || estimates.iter().filter_map(JudgedEstimate::relative_error);
        let counted = estimates.iter().filter_map(JudgedEstimate::counted_error);
        let (latency_ms, arrived) = self.latency_ms;
        let summary = Summary {
            rms_percent: rms_percent(errors()),
            bias_percent: mean(errors()).map(|e| 100.0 * e),
            mean_mm: mean(
                estimates
                    .iter()
                    .filter(|e| e.valid)
                    .filter_map(|e| e.wavelength_mm),
            ),
            valid_share: finite(self.valid_s / self.moving_s),
            wrong_share: mean(estimates.iter().map(|e| f64::from(u8::from(e.is_wrong())))),
            counted_rms_percent: rms_percent(counted),
            settling_ms: self
                .boundary_s
                .and_then(|at_s| settling_ms(at_s, &estimates)),
            latency_ms: finite(latency_ms / arrived as f64),
            felt_right_share: None,
            felt_wrong_share: None,
            rendering_needed: None,
        };
        (estimates, summary)
    }

    /// λ under the sensor at the last scan, in mm; none if there is no surface there.
    pub fn under_mm(&self) -> Option<f64> {
        self.under_mm
    }

    /// How many scans, and estimates whose truth is not known, are held.
    pub fn held(&self) -> usize {
        usize::from(self.arm.is_some()) + self.estimates.len() - self.placed
    }

    /// Puts the estimates made before `until_s` beside the truth, by the arm's track about them.
    fn place(&mut self, track: &[(f64, f64)], until_s: f64) {
        while let Some(estimate) = self.estimates.get_mut(self.placed)
            && estimate.t_s < until_s
        {
            let x_mm = interpolate(track, estimate.t_s);
            estimate.truth_mm = x_mm.and_then(|x_mm| self.truth.wavelength_at(x_mm));
            self.placed += 1;
        }
    }

    /// Time in motion counts as valid if the last estimate made is.
    fn count(&mut self, (from_s, from_mm): (f64, f64), (to_s, to_mm): (f64, f64)) {
        let step_s = to_s - from_s;
        if step_s <= 0.0 || ((to_mm - from_mm) / step_s).abs() <= MOTION_MM_S {
            return;
        }
        self.moving_s += step_s;
        while self
            .estimates
            .get(self.made)
            .is_some_and(|estimate| estimate.t_s <= from_s)
        {
            self.made += 1;
        }
        let last = self.made.checked_sub(1).map(|last| &self.estimates[last]);
        if last.is_some_and(|e| e.valid && from_s - e.t_s < ESTIMATE_LASTS_S) {
            self.valid_s += step_s;
        }
    }
}

impl RunObserver for Judge<'_> {
    fn see(&mut self, event: RunEvent<'_>) {
        match event {
            RunEvent::Scan(scan) => self.scan(scan),
            RunEvent::Estimate(made_ns, estimate) => self.estimate(made_ns, estimate),
            RunEvent::Received(arrival) => self.received(arrival),
            _ => {}
        }
    }
}

impl Judge<'_> {
    fn scan(&mut self, scan: &ScanRecord) {
        let here @ (t_s, x_mm) = (seconds(scan.at_ns), scan.position_mm);
        match self.arm.replace(here) {
            Some(before) => {
                self.place(&[before, here], t_s);
                self.count(before, here);
            }
            None => self.place(&[here], t_s),
        }
        self.under_mm = self.truth.wavelength_at(x_mm);
        if let Some(here_mm) = self.under_mm {
            let before_mm = self.here_mm.replace(here_mm);
            if before_mm.is_some_and(|before_mm| (here_mm / before_mm - 1.0).abs() > BOUNDARY) {
                self.boundary_s = Some(t_s);
            }
        }
    }

    fn estimate(&mut self, made_ns: u64, estimate: &Estimate) {
        let millimetres = |mm: Option<f32>| mm.map(f64::from).and_then(finite);
        self.travelling.push_back(EstimateRecord {
            made_ns,
            received_ns: None,
            estimate: *estimate,
        });
        if self.travelling.len() > TRAVELLING {
            self.travelling.pop_front();
        }
        self.estimates.push(JudgedEstimate {
            t_s: seconds(made_ns),
            truth_mm: None,
            wavelength_mm: millimetres(estimate.wavelength_mm),
            confidence: finite(estimate.confidence.into()),
            valid: estimate.valid,
            counted_mm: millimetres(estimate.counted_mm),
            range: estimate.range,
            amplitude_lsb: finite(estimate.amplitude_lsb.into()),
            contact: estimate.contact,
            lag_um: estimate.lag_um,
            gauges_used: estimate.gauges_used,
            health: estimate.health,
        });
    }

    fn received(&mut self, arrival: &Arrival) {
        let is_it = |record: &EstimateRecord| record.is(&arrival.estimate);
        if let Some(place) = self.travelling.iter().position(is_it)
            && let Some(record) = self.travelling.remove(place)
        {
            self.latency_ms.0 += (arrival.at_ns as f64 - record.made_ns as f64) * 1e-6;
            self.latency_ms.1 += 1;
        }
    }
}

/// Root of the mean square of relative errors, in %; none if there are none.
fn rms_percent(errors: impl Iterator<Item = f64>) -> Option<f64> {
    mean(errors.map(|e| e * e)).map(|square| 100.0 * square.sqrt())
}

/// Time from `boundary_s` to the first valid estimate after which none is off by more than
/// [`SETTLED`], in ms.
fn settling_ms(boundary_s: f64, estimates: &[JudgedEstimate]) -> Option<f64> {
    let mut settled_s = None;
    for estimate in estimates
        .iter()
        .filter(|estimate| estimate.t_s >= boundary_s)
    {
        match estimate.relative_error() {
            Some(error) if error.abs() <= SETTLED => {
                settled_s = settled_s.or(Some(estimate.t_s));
            }
            Some(_) => settled_s = None,
            None => {}
        }
    }
    settled_s.map(|t_s| (t_s - boundary_s) * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::synthetic::Run;

    fn summary(run: &Run) -> Summary {
        judge(&Truth::new("", "", &*run.surface_mm), &run.record()).1
    }

    fn near(value: Option<f64>, expected: f64, bound: f64) -> bool {
        value.is_some_and(|value| (value - expected).abs() <= bound)
    }

    /// Two specimens, 1 mm and from x = 50 mm on 4 mm, at 50 mm/s: the boundary is at 1 s.
    fn over_a_boundary(estimate: impl Fn(f64) -> (f32, bool) + 'static) -> Run {
        Run {
            surface_mm: Box::new(|x_mm| if x_mm < 50.0 { 1.0 } else { 4.0 }),
            estimate: Box::new(estimate),
            ..Run::steady(50.0, 1.0)
        }
    }

    #[test]
    fn errors_are_relative_and_of_valid_estimates_only() {
        // λ = 2 mm: valid ones in turn 2.2 (+10 %) and 1.9 mm (−5 %), each third invalid and far off.
        let run = Run {
            estimate: Box::new(|t_s| match (t_s * 100.0).round() as u32 % 3 {
                0 => (2.2, true),
                1 => (1.9, true),
                _ => (7.0, false),
            }),
            duration_s: 1.51,
            ..Run::steady(50.0, 2.0)
        };
        let summary = summary(&run);
        // 50 of either sort: √((0.1² + 0.05²)/2), (0.1 − 0.05)/2, (2.2 + 1.9)/2; λ̂ is an f32.
        assert!(
            near(summary.rms_percent, 100.0 * 0.00625f64.sqrt(), 1e-4),
            "{summary:?}"
        );
        assert!(near(summary.bias_percent, 2.5, 1e-4), "{summary:?}");
        assert!(near(summary.mean_mm, 2.05, 1e-6), "{summary:?}");
        assert_eq!(summary.settling_ms, None);
    }

    #[test]
    fn wrong_are_the_valid_estimates_that_are_more_than_a_tenth_off() {
        // λ = 2 mm: in turn 2.3 mm valid (wrong), 2.3 mm invalid, 1.9 mm valid, no number but valid (wrong).
        let run = Run {
            estimate: Box::new(|t_s| match (t_s * 100.0).round() as u32 % 4 {
                0 => (2.3, true),
                1 => (2.3, false),
                2 => (1.9, true),
                _ => (f32::NAN, true),
            }),
            duration_s: 2.01,
            ..Run::steady(50.0, 2.0)
        };
        assert_eq!(summary(&run).wrong_share, Some(0.5));
    }

    #[test]
    fn the_papers_count_is_judged_in_t1_whatever_the_estimate_is() {
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        for (index, record) in recording.estimates.iter_mut().enumerate() {
            let estimate = &mut record.estimate;
            estimate.valid = false;
            // 10 % and 20 % off in turn; far off in T2; none.
            (estimate.counted_mm, estimate.range) = match index % 4 {
                0 => (Some(2.2), Range::T1),
                1 => (Some(1.6), Range::T1),
                2 => (Some(20.0), Range::T2),
                _ => (None, Range::T1),
            };
        }
        let (_, summary) = judge(&Truth::new("", "", &*run.surface_mm), &recording);
        // 50 of either; λ is an f32.
        let squares = (0.1f64.powi(2) + 0.2f64.powi(2)) / 2.0;
        assert!(
            near(summary.counted_rms_percent, 100.0 * squares.sqrt(), 1e-3),
            "{summary:?}"
        );
        assert_eq!(summary.rms_percent, None);
    }

    #[test]
    fn each_estimate_is_beside_the_wavelength_at_its_own_instant() {
        let run = over_a_boundary(|_| (1.0, true));
        let (estimates, _) = judge(&Truth::new("", "", &*run.surface_mm), &run.record());
        assert_eq!(estimates[98].t_s, 0.99);
        assert_eq!(estimates[98].truth_mm, Some(1.0));
        assert_eq!(estimates[100].truth_mm, Some(4.0));
    }

    #[test]
    fn a_surface_without_a_wavelength_is_not_judged() {
        let run = Run {
            surface_mm: Box::new(|_| f64::NAN),
            ..Run::steady(50.0, 2.0)
        };
        let (estimates, summary) = judge(&Truth::new("", "", &*run.surface_mm), &run.record());
        assert_eq!(estimates[0].truth_mm, None);
        assert_eq!(summary.rms_percent, None);
        assert!(near(summary.mean_mm, 2.0, 1e-9));
    }

    #[test]
    fn the_valid_share_is_of_the_time_in_motion() {
        // At rest for 1 s, then 50 mm/s for 1 s; valid in the last 0.25 s of it and while at rest.
        let run = Run {
            position_mm: Box::new(|t_s| 50.0 * (t_s - 1.0).max(0.0)),
            estimate: Box::new(|t_s| (2.0, !(0.995..1.745).contains(&t_s))),
            ..Run::steady(50.0, 2.0)
        };
        assert!(
            near(summary(&run).valid_share, 0.25, 1e-3),
            "{:?}",
            summary(&run)
        );
    }

    #[test]
    fn an_estimate_does_not_speak_for_a_long_silence() {
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        recording.estimates.truncate(99);
        let (_, summary) = judge(&Truth::new("", "", &*run.surface_mm), &recording);
        // From 10 ms to 15 ms after the last one at 0.99 s, of 2 s.
        assert!(near(summary.valid_share, 0.995 / 2.0, 1e-3), "{summary:?}");
    }

    #[test]
    fn a_hand_at_rest_has_no_valid_share() {
        assert_eq!(summary(&Run::steady(0.0, 2.0)).valid_share, None);
        assert_eq!(summary(&Run::steady(4.9, 2.0)).valid_share, None);
    }

    #[test]
    fn settling_is_counted_from_the_last_boundary_to_the_last_time_within_a_tenth() {
        // Within 10 % of 4 mm at 1.05 s, out of it again at 1.10 s, for good from 1.12 s on.
        let run = over_a_boundary(|t_s| {
            let tick = (t_s * 100.0).round() as u32;
            match tick {
                ..100 => (1.0, true),
                100..105 | 110..112 => (2.5, true),
                105..107 => (1.0, false),
                _ => (4.3, true),
            }
        });
        assert!(
            near(summary(&run).settling_ms, 120.0, 1e-6),
            "{:?}",
            summary(&run)
        );
    }

    #[test]
    fn estimates_that_stay_wrong_never_settle() {
        assert_eq!(summary(&over_a_boundary(|_| (1.0, true))).settling_ms, None);
        assert_eq!(
            summary(&over_a_boundary(|_| (4.0, false))).settling_ms,
            None
        );
    }

    #[test]
    fn latency_is_the_mean_from_instant_to_arrival() {
        let run = Run {
            transit_s: 3.5e-3,
            ..Run::steady(50.0, 2.0)
        };
        assert!(
            near(summary(&run).latency_ms, 3.5, 1e-6),
            "{:?}",
            summary(&run)
        );
        let mut recording = run.record();
        recording.arrived.clear();
        let (_, summary) = judge(&Truth::new("", "", &*run.surface_mm), &recording);
        assert_eq!(summary.latency_ms, None);
    }

    #[test]
    fn an_empty_recording_has_no_summary() {
        let run = Run {
            duration_s: 0.0,
            ..Run::steady(50.0, 2.0)
        };
        assert_eq!(summary(&run), Summary::default());
    }

    #[test]
    fn numbers_that_are_none_are_not_passed_on() {
        let run = Run {
            estimate: Box::new(|_| (f32::NAN, true)),
            ..Run::steady(50.0, 2.0)
        };
        let (estimates, summary) = judge(&Truth::new("", "", &*run.surface_mm), &run.record());
        assert_eq!(estimates[0].wavelength_mm, None);
        assert_eq!(summary.rms_percent, None);
    }
}
