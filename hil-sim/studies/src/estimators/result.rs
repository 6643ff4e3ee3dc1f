//! The contest's result, and its CSV.

use protocol::SensorConfiguration;

use super::bound::{WAVES, window_mm};
use super::costs::Cost;
use super::family::Family;
use super::score::Score;
use super::settings::Setting;

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
pub struct ContestResult {
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

impl ContestResult {
    /// A line for each contestant and family, and for each bound. Empty fields were not to be had.
    ///
    /// # Errors
    /// None in practice: it is written to memory.
    pub fn csv(&self) -> Result<String, csv::Error> {
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record([
            "family",
            "method",
            "knob",
            "value",
            "instructions_per_ms",
            "worst_ms_instructions",
            "cost",
            "rms_percent",
            "worst_rms_percent",
            "worst_scene",
            "valid_share",
            "wrong_share",
            "settling_ms",
            "longest_settling_ms",
        ])?;
        for (index, family) in self.families.iter().enumerate() {
            for entry in &self.entries {
                let score = &entry.scores[index];
                let cost = entry.cost;
                table.write_record([
                    family.folder.to_owned(),
                    entry.method.to_owned(),
                    entry.knob.to_owned(),
                    if entry.knob.is_empty() {
                        String::new()
                    } else {
                        entry.value.to_string()
                    },
                    field(cost.map(|cost| cost.mean), 0),
                    field(cost.and_then(|cost| cost.worst), 0),
                    match cost {
                        None => "",
                        Some(Cost { worst: None, .. }) => "estimated",
                        Some(_) => "counted",
                    }
                    .to_owned(),
                    field(score.rms_percent, 4),
                    field(score.worst.as_ref().map(|worst| worst.0), 4),
                    score
                        .worst
                        .as_ref()
                        .map_or(String::new(), |worst| worst.1.clone()),
                    field(score.valid_share, 4),
                    field(score.wrong_share, 5),
                    field(score.settling_ms, 1),
                    field(score.longest_settling_ms, 1),
                ])?;
            }
            for window in WINDOWS {
                let Some(bound) = window.bound_percent(family) else {
                    continue;
                };
                let (knob, value) = match window {
                    Window::Waves(waves) => ("waves", waves.to_string()),
                    Window::Ms(ms) => ("window_ms", ms.to_string()),
                };
                let bound = field(Some(bound), 4);
                let empty = "";
                table.write_record([
                    family.folder,
                    "Cramér–Rao",
                    knob,
                    &value,
                    empty,
                    empty,
                    empty,
                    &bound,
                    empty,
                    empty,
                    empty,
                    empty,
                    empty,
                    empty,
                ])?;
            }
        }
        let bytes = table
            .into_inner()
            .map_err(|error| csv::Error::from(error.into_error()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}

fn field(value: Option<f64>, decimals: usize) -> String {
    value.map_or(String::new(), |value| format!("{value:.decimals$}"))
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
        let result = ContestResult {
            families: vec![
                family("steady", scene),
                family("clean", Scene::constant(1.0, 50.0)),
            ],
            entries: vec![
                entry("bank", "travel_percent", Some(5_000.0)),
                entry("YIN", "", None),
            ],
        };
        let csv = result.csv().unwrap();
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
