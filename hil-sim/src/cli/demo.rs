//! `hil-sim demo`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use firmware_sensor::counting::predicted_mean_mm;
use hil_sim_boards::Firmwares;
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::scene::Scene;
use hil_sim_studies::output::report::{Chapter, html};
use hil_sim_studies::paper::{CELLS_MM, PAPER_MM, SPEEDS_MM_S};

use super::files::{Format, Results};
use super::say::say;
use super::{Elves, number, status};

#[derive(Debug, clap::Args)]
pub(super) struct Demo {
    #[command(flatten)]
    elves: Elves,
    /// Where to write the report with plots
    #[arg(long, value_name = "FILE", default_value = "target/demo.html")]
    report: PathBuf,
}

/// The paper's counting window.
const WINDOW_S: f64 = 0.080;
/// The paper's two seconds of estimates, and what the filters need to settle before.
const DURATION_S: f64 = 2.3;
/// What the ELF's count may be from the prediction, which knows neither filters nor sampling.
const TOLERANCE_MM: f64 = 0.03;
/// What the default estimator may be off, root mean square of every instant.
const RMS_PERCENT: f64 = 0.5;
const FREQUENCY_TOLERANCE: f64 = 0.001;

impl Demo {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let firmwares = self.elves.read()?;
        let folder = self.report.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let report = Results::create(&self.report, Format::Html)?;
        say!(
            "Two emulated boards, a UART between them, {} and {}:\n",
            firmwares.sensor.path.display(),
            firmwares.display.path.display()
        );
        say!("{HEADER}");
        let mut outcomes = Vec::new();
        let mut as_predicted = true;
        for (speed_mm_s, paper_mm) in SPEEDS_MM_S.into_iter().zip(PAPER_MM) {
            for (wavelength_mm, paper_mm) in CELLS_MM.into_iter().zip(paper_mm) {
                let outcome = rub(wavelength_mm, speed_mm_s, &firmwares)?;
                let predicted_mm = predicted_mean_mm(wavelength_mm, speed_mm_s, WINDOW_S);
                let cells = row(paper_mm, predicted_mm, &outcome);
                say!("{speed_mm_s:>4} {wavelength_mm:>3} {cells}");
                as_predicted &= is_as_predicted(predicted_mm, &outcome);
                outcomes.push(outcome);
            }
        }
        let chapters: Vec<_> = outcomes.iter().map(Chapter::of).collect();
        report.write(&html(&chapters))?;
        say!("\n{}", verdict(as_predicted));
        say!("Plots of every cell: {}", self.report.display());
        Ok(status(as_predicted))
    }
}

fn rub(wavelength_mm: f64, speed_mm_s: f64, firmwares: &Firmwares) -> anyhow::Result<Outcome> {
    let mut scene = Scene::constant(wavelength_mm, speed_mm_s);
    scene.duration_s = DURATION_S;
    let (recording, _) = hil_sim_boards::run(&scene, firmwares)?;
    Ok(Outcome::new(scene, recording))
}

const HEADER: &str = concat!(
    "           mean of the count, mm      per instant, %           fifty actuators\n",
    "  v    λ   paper predicted   ELF     count  default        Hz   v/λ̂, Hz   off, %  × real\n",
    "mm/s  mm                                                                            time",
);

fn row(paper_mm: f64, predicted_mm: f64, outcome: &Outcome) -> String {
    let summary = &outcome.verdict.summary;
    let actuators = &outcome.verdict.actuators;
    format!(
        "{paper_mm:>8.3} {predicted_mm:>9.3} {:>7} {:>8} {:>8} {:>10} {:>9} {:>8} {:>8}",
        number(counted_mean_mm(outcome), 3),
        number(summary.counted_rms_percent, 2),
        number(summary.rms_percent, 2),
        number(actuators.frequency_hz, 3),
        number(actuators.truth_hz, 3),
        number(frequency_error(outcome).map(|error| 100.0 * error), 3),
        number(outcome.recording.realtime_factor(), 2),
    )
}

/// The mean of the paper's count, which stands beside the default estimator's λ̂ in every estimate.
fn counted_mean_mm(outcome: &Outcome) -> Option<f64> {
    let estimates = outcome.verdict.estimates.iter();
    let counted = estimates.filter_map(|e| e.counted_mm);
    let (count, sum) = counted.fold((0_u32, 0.0), |(count, sum), mm| (count + 1, sum + mm));
    (count > 0).then(|| sum / f64::from(count))
}

fn frequency_error(outcome: &Outcome) -> Option<f64> {
    let actuators = &outcome.verdict.actuators;
    Some(actuators.frequency_hz? / actuators.truth_hz? - 1.0)
}

fn is_as_predicted(predicted_mm: f64, outcome: &Outcome) -> bool {
    let summary = &outcome.verdict.summary;
    counted_mean_mm(outcome).is_some_and(|mean_mm| (mean_mm - predicted_mm).abs() <= TOLERANCE_MM)
        && summary.rms_percent.is_some_and(|rms| rms <= RMS_PERCENT)
        && frequency_error(outcome).is_some_and(|error| error.abs() <= FREQUENCY_TOLERANCE)
}

fn verdict(as_predicted: bool) -> String {
    let not = if as_predicted { "" } else { "NOT " };
    let percent = 100.0 * FREQUENCY_TOLERANCE;
    format!(
        "All cells are {not}as wanted: the count within {TOLERANCE_MM} mm of the prediction, the default estimator within {RMS_PERCENT} % per instant, every actuator within {percent} % of v/λ̂."
    )
}
