//! The contest's result, and its CSV.

use protocol::SensorConfiguration;
use serde::Serialize;

use super::bound::{WAVES, window_mm};
use super::costs::Cost;
use super::family::Family;
use super::score::Score;
use super::settings::Setting;
use crate::study::{Fixed, csv_text};

/// A contestant's row.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The method's name.
    pub method: &'static str,
    /// The knob that is swept.
    pub knob: &'static str,
    /// Its value.
    pub value: u16,
    /// What the sensor board is set to, if it is one of ours.
    pub setting: Option<Setting>,
    /// What it costs on the board.
    pub cost: Option<Cost>,
    /// A score for each family.
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

/// Everything that the chart shows.
#[derive(Clone, Debug)]
pub struct BenchmarkResult {
    /// The families.
    pub families: Vec<Family>,
    /// The contestants, knobs in order.
    pub entries: Vec<Entry>,
}

/// The windows that the Cramér–Rao bound is drawn for.
pub const WINDOWS: [Window; 3] = [Window::Waves(WAVES), Window::Ms(80), Window::Ms(160)];

/// A window of the bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// So many waves of travel, each gauge's slope unknown too.
    Waves(u8),
    /// A time.
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
#[derive(Default, Serialize)]
struct Record<'a> {
    family: &'a str,
    method: &'a str,
    knob: &'a str,
    value: Option<u16>,
    instructions_per_ms: Fixed<0>,
    worst_ms_instructions: Fixed<0>,
    cost: &'a str,
    rms_percent: Fixed<4>,
    worst_rms_percent: Fixed<4>,
    worst_scene: &'a str,
    valid_share: Fixed<4>,
    wrong_share: Fixed<5>,
    settling_ms: Fixed<1>,
    longest_settling_ms: Fixed<1>,
}

impl<'a> Record<'a> {
    fn of(family: &Family, entry: &'a Entry, score: &'a Score) -> Self {
        let cost = entry.cost;
        let worst = score.worst.as_ref();
        Self {
            family: family.folder,
            method: entry.method,
            knob: entry.knob,
            value: (!entry.knob.is_empty()).then_some(entry.value),
            instructions_per_ms: cost.map(|cost| cost.mean).into(),
            worst_ms_instructions: cost.and_then(|cost| cost.worst).into(),
            cost: match cost {
                None => "",
                Some(Cost { worst: None, .. }) => "estimated",
                Some(_) => "counted",
            },
            rms_percent: score.rms_percent.into(),
            worst_rms_percent: worst.map(|worst| worst.0).into(),
            worst_scene: worst.map_or("", |worst| &worst.1),
            valid_share: score.valid_share.into(),
            wrong_share: score.wrong_share.into(),
            settling_ms: score.settling_ms.into(),
            longest_settling_ms: score.longest_settling_ms.into(),
        }
    }

    fn of_bound(family: &Family, window: Window) -> Option<Self> {
        let (knob, value) = match window {
            Window::Waves(waves) => ("waves", waves.into()),
            Window::Ms(ms) => ("window_ms", ms),
        };
        Some(Self {
            family: family.folder,
            method: "Cramér–Rao",
            knob,
            value: Some(value),
            rms_percent: window.bound_percent(family)?.into(),
            ..Self::default()
        })
    }
}

impl BenchmarkResult {
    /// A line for each contestant and family, and for each bound.
    ///
    /// # Errors
    /// If a line cannot be written, which nothing should bring about.
    pub fn csv(&self) -> Result<String, csv::Error> {
        let records = self
            .families
            .iter()
            .enumerate()
            .flat_map(|(index, family)| {
                let entries = self.entries.iter();
                let scored =
                    entries.map(move |entry| Record::of(family, entry, &entry.scores[index]));
                let bounds = WINDOWS.into_iter();
                scored.chain(bounds.filter_map(|window| Record::of_bound(family, window)))
            });
        csv_text(records)
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
        let csv = &result.csv().unwrap();
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
