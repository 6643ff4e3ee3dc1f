//! The phase that the stimulus should have: true travel times the wavenumber in force.

use firmware_display::ZERO_VOLT;
use firmware_display::pace::per_tick;
use firmware_display::plausibility::{Plausibility, Verdict};
use protocol::{DisplayConfiguration, Estimate};

use crate::analysis::seconds;
use crate::analysis::track::interpolate;
use crate::recording::Recording;
use crate::truth::Truth;

/// The phase due at every instant, ∫ v/λ̂ dt, in cycles: v is the true hand's, λ̂ the one in force, in
/// which each estimate that the display trusts (its own [`Plausibility`] says which) takes
/// [`DisplayConfiguration::glide_ms`] to come into force, linearly in 1/λ̂, and none while nothing is
/// heard. 0 until there is one.
///
/// An estimate is followed from the second tick after its arrival on, for the whole travel since the
/// first: the board hears what has come once a tick's words are on their way.
#[derive(Clone, Debug, Default)]
pub struct DuePhase {
    phase: Vec<(f64, f64)>,
    travelled: Vec<(f64, f64)>,
    shortest_mm: Option<f64>,
}

impl DuePhase {
    /// The phase due at the reference actuator.
    pub fn new(truth: &Truth, recording: &Recording) -> Self {
        let received = received(recording);
        let place_mm = truth.reference_place_mm();
        let mut due = Self::default();
        let (mut next, mut output) = (0, 0);
        let mut followed = Followed::new(truth.display);
        let (mut cycles, mut travelled) = (0.0, 0.0);
        let mut before_mm = None;
        for tick in &recording.ticks {
            let outputs = &recording.outputs[output..];
            output += outputs
                .iter()
                .take_while(|output| output.at_ns < tick.at_ns)
                .count();
            // A wave crosses 0 V; silence stays there.
            let heard = recording.outputs[output.saturating_sub(2)..output]
                .iter()
                .any(|output| output.words.iter().any(|&word| word != ZERO_VOLT));
            let travel_mm = tick.position_mm - before_mm.unwrap_or(tick.position_mm);
            before_mm = Some(tick.position_mm);
            let per_mm = followed.tick();
            cycles += travel_mm * per_mm;
            travelled += travel_mm.abs() * per_mm;
            if per_mm > 0.0 {
                let shortest_mm = due.shortest_mm.unwrap_or(f64::INFINITY);
                due.shortest_mm = Some(shortest_mm.min(1.0 / per_mm));
            }
            let ahead = place_mm * per_mm;
            due.phase.push((seconds(tick.at_ns), cycles + ahead));
            due.travelled.push((seconds(tick.at_ns), travelled));
            while let Some((received_ns, estimate)) = received.get(next)
                && *received_ns <= tick.at_ns
            {
                followed.hear(estimate, heard);
                next += 1;
            }
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

/// The wavenumber that a display follows.
struct Followed {
    configuration: DisplayConfiguration,
    plausibility: Plausibility,
    /// In cycles per mm.
    per_mm: f64,
    target_per_mm: f64,
    ticks_left: u32,
}

impl Followed {
    fn new(configuration: DisplayConfiguration) -> Self {
        Self {
            configuration,
            plausibility: Plausibility::new(),
            per_mm: 0.0,
            target_per_mm: 0.0,
            ticks_left: 0,
        }
    }

    /// An estimate has come, while something was `heard` or nothing.
    fn hear(&mut self, estimate: &Estimate, heard: bool) {
        let DisplayConfiguration {
            max_age_ms,
            glide_ms,
            update_rate,
            ..
        } = self.configuration;
        if let Verdict::Trusted(wavelength) = self.plausibility.judge(estimate, max_age_ms) {
            let target_per_mm = 1.0 / f64::from(wavelength.mm());
            if target_per_mm != self.target_per_mm {
                self.target_per_mm = target_per_mm;
                let glide_ms = if heard { u32::from(glide_ms) } else { 0 };
                self.ticks_left = glide_ms * (update_rate.hz() / 1_000);
            }
        }
    }

    /// The wavenumber of a tick's travel.
    fn tick(&mut self) -> f64 {
        // Whether the hand rests matters to what the sensor says of the arm, not to λ.
        self.plausibility
            .elapse(per_tick(self.configuration.update_rate), false);
        let left = f64::from(self.ticks_left.max(1));
        self.per_mm += (self.target_per_mm - self.per_mm) / left;
        self.ticks_left = self.ticks_left.saturating_sub(1);
        self.per_mm
    }
}

/// The estimates that reached the display, with their arrival in ns, by arrival.
fn received(recording: &Recording) -> Vec<(u64, Estimate)> {
    let mut received: Vec<_> = recording
        .estimates
        .iter()
        .filter_map(|record| Some((record.received_ns?, record.estimate)))
        .collect();
    received.sort_by_key(|&(received_ns, _)| received_ns);
    received
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::Run;

    #[test]
    fn the_due_phase_is_travel_over_the_wavelength_in_force_to_which_it_glides() {
        // 2 mm, then 2.5 mm from 1 s on, at 50 mm/s: 25 and 20 cycles a second.
        let run = Run {
            estimate: Box::new(|t_s| (if t_s < 0.9999 { 2.0 } else { 2.5 }, true)),
            ..Run::steady(50.0, 2.0)
        };
        let recording = run.record();
        let surface = |_| 2.0;
        let due = DuePhase::new(&Truth::new("", "", &surface), &recording);
        // The first estimate arrives at 11 ms, that of 1 s at 1.001 s: each is used for the travel after
        // that tick. Half of the change comes on the way, for a
        // glide of 40 ticks, of which the last has it in whole.
        let glided_s = 1.001 + 0.5 * (0.020 - 0.0005);
        let expected = (glided_s - 0.011) * 25.0 + (1.9 - glided_s) * 20.0;
        assert!(
            (due.cycles(1.9) - expected).abs() < 1e-6,
            "{} {expected}",
            due.cycles(1.9)
        );
        assert!((due.shortest_mm().unwrap() - 2.0).abs() < 1e-9);
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
        let surface = |_| 2.0;
        let cycles =
            |run: Run| DuePhase::new(&Truth::new("", "", &surface), &run.record()).cycles(1.9);
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
        let late = |wavelength_mm: f32| {
            let mut recording = Run::steady(50.0, 2.0).record();
            recording.estimates[30].received_ns = Some(500_000_000);
            recording.estimates[30].estimate.wavelength_mm = Some(wavelength_mm);
            let surface = |_| 2.0;
            DuePhase::new(&Truth::new("", "", &surface), &recording).cycles(1.9)
        };
        assert_eq!(late(2.2), late(2.0));
    }
}
