//! Stimuli whose wavelength is given, as in the paper's section IV: the display alone, without a sensor.
//!
//! One run presents one wavelength after the other, each for a stroke to and fro of Fig. 7's hand.

use firmware_display::{Display, Senses, Settings};
use protocol::{DEFAULT_ACTUATORS, DisplayConfiguration};

use crate::display::seconds;
use crate::psychophysics::hand::{FREQUENCY_HZ, PEAK_MM_S};
use crate::psychophysics::presented::{ACTUATOR, Felt};
use hil_sim_boards::display_alone::{self, DisplayBench, SensorMessage};
use hil_sim_boards::{ElfError, Firmware};
use hil_sim_core::plant::motion::encoder;
use hil_sim_core::run::digest::Digest;
use hil_sim_core::run::recording::{Engine, OutputRecord, Recording, TickRecord};
use hil_sim_core::scene::Motion;

/// A stroke to and fro.
const PERIOD_S: f64 = 1.0 / FREQUENCY_HZ;
/// What is not looked at after λ changed: the display has to hear of it, and glides.
const LEARNS_S: f64 = 0.1;
/// Estimates come every so many ticks, at 2 kHz.
const TICKS_PER_ESTIMATE: u64 = 20;
const TICK_NS: u64 = 500_000;
const HAND: Motion = Motion::Sinusoid {
    amplitude_mm_s: PEAK_MM_S,
    frequency_hz: FREQUENCY_HZ,
};

#[derive(Clone, Debug, PartialEq)]
pub struct StimulusSequence {
    wavelengths_mm: Vec<f64>,
}

impl StimulusSequence {
    pub fn new(wavelengths_mm: &[f64]) -> Self {
        Self {
            wavelengths_mm: wavelengths_mm.to_vec(),
        }
    }

    /// Virtual time that it takes, in s: the first stroke to and fro is for the board to start.
    fn duration_s(&self) -> f64 {
        PERIOD_S * (self.wavelengths_mm.len() + 1) as f64
    }

    fn wavelength_mm(&self, t_s: f64) -> f64 {
        let place = (t_s / PERIOD_S - 1.0).max(0.0) as usize;
        self.wavelengths_mm[place.min(self.wavelengths_mm.len() - 1)]
    }

    pub(super) fn on_elf(&self, firmware: &Firmware) -> Result<Recording, ElfError> {
        let course = self.clone();
        let bench = DisplayBench {
            surface: Box::new(move |t_s| SensorMessage::of(course.wavelength_mm(t_s))),
            ..DisplayBench::new(HAND, self.wavelengths_mm[0], self.duration_s())
        };
        display_alone::run(bench, firmware).map(|run| run.recording)
    }

    /// Runs it on the display's library: an estimate is heard in the tick in which it is made.
    pub(super) fn on_library(&self) -> Recording {
        let settings = Settings::new(DisplayConfiguration::DEFAULT, &DEFAULT_ACTUATORS)
            .expect("the default is in its ranges");
        let mut display = Display::new(&settings, None);
        display.started(Ok(()));
        let mut recording = Recording::empty(Engine::Native, self.duration_s());
        for tick in 0..(self.duration_s() * 1e9) as u64 / TICK_NS {
            let at_ns = tick * TICK_NS;
            let t_s = seconds(at_ns);
            let position_mm = HAND.position_mm(t_s);
            let encoder = encoder(position_mm);
            recording.ticks.push(TickRecord {
                at_ns,
                encoder,
                position_mm,
            });
            if display.tick(encoder, &Senses::default()).send {
                recording.outputs.push(OutputRecord {
                    at_ns,
                    words: *display.words(),
                    skew_ns: 0,
                });
            }
            if tick.is_multiple_of(TICKS_PER_ESTIMATE) {
                let said = SensorMessage::of(self.wavelength_mm(t_s));
                let sequence = (tick / TICKS_PER_ESTIMATE) as u32;
                let velocity_mm_s = HAND.velocity_mm_s(t_s);
                display.on_estimate(&said.estimate(sequence, at_ns / 1_000, velocity_mm_s));
            }
        }
        let mut digest = Digest::default();
        digest.outputs(&recording.outputs);
        recording.hash = digest.finish();
        recording
    }

    /// What each wavelength of the course felt like, in order; none where nothing was felt.
    pub fn felt(&self, recording: &Recording) -> Vec<Option<Felt>> {
        let felt = |place| {
            let from_s = PERIOD_S * place as f64;
            Felt::of(recording, ACTUATOR, from_s + LEARNS_S, from_s + PERIOD_S)
        };
        (1..=self.wavelengths_mm.len()).map(felt).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::plant::motion::MM_PER_COUNT;

    #[test]
    fn the_display_presents_each_given_wavelength_to_a_count_of_the_encoder_at_either_end() {
        let given_mm = [0.4, 0.6, 1.0, 2.0, 4.0, 5.6];
        let course = StimulusSequence::new(&given_mm);
        let felt = course.felt(&course.on_library());
        for (given_mm, felt) in given_mm.into_iter().zip(felt) {
            let felt = felt.unwrap();
            // Also, at 4 mm and above, what a reversal leaves under the sine is worked off over a few waves:
            // 0.5 % of one.
            let bound_mm = 2.0 * MM_PER_COUNT + 0.005 * given_mm;
            let error_mm = felt.mean_mm() - given_mm;
            assert!(error_mm.abs() < bound_mm, "{given_mm}: {error_mm}");
            let scatter_mm = 0.01 * felt.scatter_percent() * given_mm;
            assert!(scatter_mm < bound_mm, "{given_mm}: {scatter_mm}");
        }
    }
}
