//! The gauge signal as the sensor sees it: its own filters, run over the recorded codes.

use std::ops::Range;

use firmware_sensor::SCANS_PER_SAMPLE;
use firmware_sensor::bandpass::{BAND, BandPass, ORDER};
use firmware_sensor::crossing::Crossing;
use firmware_sensor::decimate::{AntiAlias, History};

use crate::output::plot::palette::{FIRST, REFUSED};
use crate::output::plot::{Axis, Mark};
use hil_sim_core::judge::seconds;
use hil_sim_core::run::recording::ScanRecord;

/// A gauge behind the band-pass.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Banded {
    /// Each sample: when it was done, in s, and its value in ADC steps.
    pub samples: Vec<(f64, f64)>,
    /// When an impulse was emitted, in s.
    pub impulses: Vec<f64>,
}

impl Banded {
    /// A chart's axis of the signal with room for the impulses below, and its marks.
    pub fn drawn(&self) -> (Axis, [Mark; 2]) {
        let swings = self.samples.iter().map(|sample| sample.1.abs());
        let peak = swings.fold(1.0, f64::max) * 1.1;
        let axis = Axis::round("signal in ADC steps", -1.4 * peak..peak);
        let impulses = Mark::strokes(REFUSED, &self.impulses, -1.35 * peak..-1.1 * peak);
        (axis, [impulses, Mark::line(FIRST, self.samples.clone())])
    }
}

/// Runs the sensor's filters over one gauge's scans, and keeps what is of a stretch of time in s.
pub fn banded(scans: &[ScanRecord], gauge: usize, within_s: &Range<f64>) -> Banded {
    let mut banded = Banded::default();
    let Some(first) = scans.first() else {
        return banded;
    };
    let anti_alias = AntiAlias::new();
    let band_pass = BandPass::<ORDER>::new(BAND);
    let mut history = History::settled(&first.codes);
    let mut lane = band_pass.settled(firmware_sensor::decimate::from_mid_rail(first.codes[gauge]));
    let mut crossing = Crossing::default();
    let (groups, _) = scans.as_chunks::<SCANS_PER_SAMPLE>();
    for group in groups {
        let t_s = seconds(group[SCANS_PER_SAMPLE - 1].at_ns);
        if t_s >= within_s.end {
            break;
        }
        let sample = anti_alias.step(&mut history, &group.map(|scan| scan.codes));
        let y = band_pass.step(&mut lane, sample[gauge]);
        let is_impulse = crossing.step(y);
        if t_s < within_s.start {
            continue;
        }
        banded.samples.push((t_s, f64::from(y)));
        if is_impulse {
            banded.impulses.push(t_s);
        }
    }
    banded
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::judge::synthetic::Run;

    #[test]
    fn a_sine_of_25_hz_gives_fifty_impulses_a_second() {
        let recording = Run::steady(50.0, 2.0).record();
        // Times are of the end of a millisecond, the last one's just below 1.5 s.
        let after = banded(&recording.scans, 2, &(0.5..1.5)).impulses.len();
        assert!((49..=51).contains(&after), "{after}");
        assert_eq!(
            banded(&recording.scans, 2, &(0.0..1.5)).samples.len(),
            1_500
        );
    }

    #[test]
    fn no_scans_give_no_signal() {
        assert_eq!(banded(&[], 0, &(0.0..1.0)), Banded::default());
    }
}
