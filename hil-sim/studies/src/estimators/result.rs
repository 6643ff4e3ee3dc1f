//! Every estimator's scores and cost, and their CSV.

use protocol::SensorConfiguration;

use super::bound::{WAVES, window_mm};
use super::costs::Cost;
use super::family::Family;
use super::score::Score;
use super::settings::Setting;
use crate::study::{Record, csv, fixed, short};

#[derive(Clone, Debug)]
pub struct Entry {
    pub method: &'static str,
    pub knob: &'static str,
    pub value: u16,
    /// What the sensor board is set to, if it is one of ours.
    pub setting: Option<Setting>,
    pub cost: Option<Cost>,
    pub scores: Vec<Score>,
}

impl Entry {
    /// Whether it is what the board does without being told.
    pub fn is_default(&self) -> bool {
        let default = SensorConfiguration::DEFAULT;
        self.setting
            .is_some_and(|setting| setting.on(default) == default)
    }
}

/// Everything that the chart shows: the families, and the contestants, knobs in order.
#[derive(Clone, Debug)]
pub struct BenchmarkResult {
    pub(super) families: Vec<Family>,
    pub(super) entries: Vec<Entry>,
}

/// The windows that the Cramér–Rao bound is drawn for.
pub const WINDOWS: [Window; 3] = [Window::Waves(WAVES), Window::Ms(80), Window::Ms(160)];

/// A window of the bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    Waves(u8),
    Ms(u16),
}

impl Window {
    /// The bound on a family in percent, if it is of the kind that has one.
    pub fn bound_percent(self, family: &Family) -> Option<f64> {
        match self {
            Self::Waves(waves) => family.bound_percent(true, |wavelength_mm, speed_mm_s| {
                window_mm(waves, wavelength_mm) / speed_mm_s.abs()
            }),
            Self::Ms(ms) => family.bound_percent(false, |_, _| f64::from(ms) * 1e-3),
        }
    }
}

/// A contestant's score in a family, or the bound on it. Empty fields were not to be had.
fn record(
    family: &Family,
    (method, knob, value): (&str, &str, u16),
    cost: Option<Cost>,
    score: &Score,
) -> Record {
    let known = cost.map(|cost| {
        if cost.worst.is_some() {
            "counted"
        } else {
            "estimated"
        }
    });
    let (worst_percent, worst_scene) = score.worst.clone().unzip();
    Record::default()
        .with("family", family.folder)
        .with("method", method)
        .with("knob", knob)
        .with("value", (!knob.is_empty()).then(|| short(value)))
        .with("instructions_per_ms", fixed(cost.map(|cost| cost.mean), 0))
        .with(
            "worst_ms_instructions",
            fixed(cost.and_then(|cost| cost.worst), 0),
        )
        .with("cost", known)
        .with("rms_percent", fixed(score.rms_percent, 4))
        .with("worst_rms_percent", fixed(worst_percent, 4))
        .with("worst_scene", worst_scene)
        .with("valid_share", fixed(score.valid_share, 4))
        .with("wrong_share", fixed(score.wrong_share, 5))
        .with("settling_ms", fixed(score.settling_ms, 1))
        .with("longest_settling_ms", fixed(score.longest_settling_ms, 1))
}

fn record_of_bound(family: &Family, window: Window) -> Option<Record> {
    let (knob, value) = match window {
        Window::Waves(waves) => ("waves", waves.into()),
        Window::Ms(ms) => ("window_ms", ms),
    };
    let score = Score {
        rms_percent: Some(window.bound_percent(family)?),
        ..Score::default()
    };
    Some(record(family, ("Cramér–Rao", knob, value), None, &score))
}

impl BenchmarkResult {
    /// A line for each contestant and family, and for each bound.
    pub fn csv(&self) -> String {
        let of_family = |(index, family)| {
            let scored = self.entries.iter().map(move |entry| {
                let of = (entry.method, entry.knob, entry.value);
                record(family, of, entry.cost, &entry.scores[index])
            });
            let bounds = WINDOWS.into_iter();
            scored.chain(bounds.filter_map(move |window| record_of_bound(family, window)))
        };
        csv(self.families.iter().enumerate().flat_map(of_family))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimators::settings::{Knob, SETTINGS};
    use hil_sim_core::scene::{Gauges, Kinematic, Scene};

    #[test]
    fn the_csv_has_a_line_for_each_contestant_and_bound_of_a_family() {
        let mut scene = Scene::constant(1.0, 50.0);
        scene.gauges = Gauges::Kinematic(Kinematic {
            snr_db: Some(20.0),
            ..Kinematic::default()
        });
        let family = |folder, scene| Family {
            folder,
            title: "",
            scenes: vec![scene],
        };
        let entry = |method, knob, worst| Entry {
            method,
            knob,
            value: 70,
            setting: None,
            cost: Some(Cost {
                mean: 1_234.4,
                worst,
            }),
            scores: vec![
                Score {
                    rms_percent: Some(0.25),
                    worst: Some((0.5, "a".to_owned())),
                    valid_share: Some(0.99),
                    wrong_share: Some(0.0),
                    ..Score::default()
                },
                Score {
                    settling_ms: Some(90.0),
                    longest_settling_ms: Some(100.0),
                    ..Score::default()
                },
            ],
        };
        let result = BenchmarkResult {
            families: vec![
                family("steady", scene),
                family("clean", Scene::constant(1.0, 50.0)),
            ],
            entries: vec![
                entry("bank", "travel_percent", Some(5_000.0)),
                entry("YIN", "", None),
            ],
        };
        let csv = &result.csv();
        let lines: Vec<&str> = csv.lines().skip(1).collect();
        assert_eq!(lines.len(), 4 + WINDOWS.len());
        assert_eq!(
            lines[0],
            "steady,bank,travel_percent,70,1234,5000,counted,0.2500,0.5000,a,0.9900,0.00000,,"
        );
        assert_eq!(
            lines[1],
            "steady,YIN,,,1234,,estimated,0.2500,0.5000,a,0.9900,0.00000,,"
        );
        // 50 Hz at 20 dB, five gauges, 80 ms: see the bound's own tests.
        assert_eq!(lines[3], "steady,Cramér–Rao,window_ms,80,,,,0.0778,,,,,,");
        assert_eq!(
            lines[4 + 1],
            "clean,bank,travel_percent,70,1234,5000,counted,,,,,,90.0,100.0"
        );
    }

    #[test]
    fn the_default_is_one_point_of_each_sweep_of_the_spectrum() {
        for knob in [Knob::Waves, Knob::Gauges] {
            let defaults = SETTINGS.iter().filter(|setting| {
                let default = SensorConfiguration::DEFAULT;
                setting.knob == knob && setting.on(default) == default
            });
            assert_eq!(defaults.count(), 1, "{knob:?}");
        }
    }
}
