//! The gauge signal as the sensor sees it: its own filters, run over the recorded codes.

use firmware_sensor::SCANS_PER_SAMPLE;
use firmware_sensor::bandpass::{BAND, BandPass, ORDER};
use firmware_sensor::crossing::Crossing;
use firmware_sensor::decimate::{AntiAlias, History};

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

/// Runs the sensor's filters over one gauge's scans, up to `until_s`.
pub fn banded(scans: &[ScanRecord], gauge: usize, until_s: f64) -> Banded {
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
        if t_s > until_s {
            break;
        }
        let sample = anti_alias.step(&mut history, &group.map(|scan| scan.codes));
        let y = band_pass.step(&mut lane, sample[gauge]);
        if crossing.step(y) {
            banded.impulses.push(t_s);
        }
        banded.samples.push((t_s, f64::from(y)));
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
        let banded = banded(&recording.scans, 2, 1.5);
        let within = banded
            .impulses
            .iter()
            .filter(|t_s| (0.5..1.5).contains(*t_s))
            .count();
        assert!((49..=51).contains(&within), "{within}");
        assert_eq!(banded.samples.len(), 1_500);
    }

    #[test]
    fn no_scans_give_no_signal() {
        assert_eq!(banded(&[], 0, 1.0), Banded::default());
    }
}
