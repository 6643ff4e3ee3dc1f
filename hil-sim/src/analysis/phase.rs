//! The phase that the stimulus should have: true travel over the wavelength in force.

use crate::analysis::seconds;
use crate::analysis::track::interpolate;
use crate::recording::Recording;
use crate::truth::Truth;

/// The phase due at every instant, ∫ v/λ̂ dt, in cycles: v is the true hand's, λ̂ the last valid
/// estimate received. 0 until there is one.
///
/// An estimate is in force from the first tick after its arrival on, for the whole travel since the
/// tick before: earlier no display that works in ticks could use it.
#[derive(Clone, Debug, Default)]
pub struct DuePhase {
    phase: Vec<(f64, f64)>,
    travelled: Vec<(f64, f64)>,
    shortest_mm: Option<f64>,
}

impl DuePhase {
    /// The phase due at the reference actuator.
    pub fn new(truth: &Truth, recording: &Recording) -> Self {
        let wavelengths = received_wavelengths(recording);
        let place_mm = truth.reference_place_mm();
        let mut due = Self::default();
        let mut next = 0;
        let mut in_force_mm: Option<f64> = None;
        let (mut cycles, mut travelled) = (0.0, 0.0);
        let mut before_mm = None;
        for tick in &recording.ticks {
            while let Some(&(received_ns, wavelength_mm)) = wavelengths.get(next)
                && received_ns <= tick.at_ns
            {
                in_force_mm = Some(wavelength_mm);
                next += 1;
            }
            let travel_mm = tick.position_mm - before_mm.unwrap_or(tick.position_mm);
            before_mm = Some(tick.position_mm);
            let mut ahead = 0.0;
            if let Some(wavelength_mm) = in_force_mm {
                cycles += travel_mm / wavelength_mm;
                travelled += travel_mm.abs() / wavelength_mm;
                ahead = place_mm / wavelength_mm;
                let shortest_mm = due.shortest_mm.unwrap_or(wavelength_mm);
                due.shortest_mm = Some(shortest_mm.min(wavelength_mm));
            }
            due.phase.push((seconds(tick.at_ns), cycles + ahead));
            due.travelled.push((seconds(tick.at_ns), travelled));
        }
        due
    }

    /// The phase at an instant, in cycles: signed, not wrapped.
    pub fn cycles(&self, t_s: f64) -> f64 {
        interpolate(&self.phase, t_s).unwrap_or(0.0)
    }

    /// The cycles gone through so far, forwards and backwards alike.
    pub fn travelled_cycles(&self, t_s: f64) -> f64 {
        interpolate(&self.travelled, t_s).unwrap_or(0.0)
    }

    /// The shortest λ̂ that was ever in force, in mm.
    pub fn shortest_mm(&self) -> Option<f64> {
        self.shortest_mm
    }
}

/// The valid estimates that reached the display, in ns and mm, by arrival. One that was made before
/// another that is already there is old news, and left out.
fn received_wavelengths(recording: &Recording) -> Vec<(u64, f64)> {
    let mut received: Vec<_> = recording
        .estimates
        .iter()
        .filter_map(|record| Some((record.received_ns?, record.estimate)))
        .collect();
    received.sort_by_key(|&(received_ns, _)| received_ns);
    let mut newest = None;
    received.retain(|(_, estimate)| {
        let news = newest.is_none_or(|newest| estimate.sequence > newest);
        if news {
            newest = Some(estimate.sequence);
        }
        news
    });
    received
        .into_iter()
        .filter(|(_, estimate)| estimate.valid)
        .filter_map(|(at_ns, estimate)| Some((at_ns, f64::from(estimate.wavelength_mm?))))
        .filter(|(_, wavelength_mm)| wavelength_mm.is_finite() && *wavelength_mm > 0.0)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::Run;

    #[test]
    fn the_due_phase_is_travel_over_the_wavelength_in_force() {
        // 2 mm, then 4 mm from 1 s on, at 50 mm/s: 25 and 12.5 cycles a second.
        let run = Run {
            estimate: Box::new(|t_s| (if t_s < 0.9999 { 2.0 } else { 4.0 }, true)),
            ..Run::steady(50.0, 2.0)
        };
        let recording = run.record();
        let surface = |_| 2.0;
        let due = DuePhase::new(&Truth::new("", "", &surface), &recording);
        // The first estimate arrives at 11 ms, that of 1 s at 1.001 s: each is used for the half
        // millisecond of travel before that tick as well.
        let expected = (1.0005 - 0.0105) * 25.0 + (1.9 - 1.0005) * 12.5;
        assert!(
            (due.cycles(1.9) - expected).abs() < 1e-6,
            "{} {expected}",
            due.cycles(1.9)
        );
        assert_eq!(due.shortest_mm(), Some(2.0));
    }

    #[test]
    fn a_reversed_stroke_takes_the_phase_back_and_goes_on_travelling() {
        let recording = Run::swinging(50.0, 1.0, 2.0).record();
        let surface = |_| 2.0;
        let due = DuePhase::new(&Truth::new("", "", &surface), &recording);
        // Two strokes of 2 · 50 / 2π mm each a second, less the little before the first estimate.
        let stroke_cycles = 100.0 / std::f64::consts::TAU / 2.0;
        assert!(due.cycles(1.0).abs() < 0.01, "{}", due.cycles(1.0));
        assert!((due.travelled_cycles(1.0) - 2.0 * stroke_cycles).abs() < 0.01);
    }

    #[test]
    fn an_estimate_overtaken_by_a_newer_one_is_not_in_force() {
        let mut recording = Run::steady(50.0, 2.0).record();
        recording.estimates.truncate(2);
        recording.estimates[0].received_ns = Some(500_000_000);
        recording.estimates[1].received_ns = Some(100_000_000);
        recording.estimates[0].estimate.wavelength_mm = Some(1.0);
        assert_eq!(received_wavelengths(&recording), [(100_000_000, 2.0)]);
    }
}
