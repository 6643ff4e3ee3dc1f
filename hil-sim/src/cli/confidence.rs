//! `hil-sim chart confidence`.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_studies::estimators::confidence::{BINS, GOAL, Reliability, strangers};
use hil_sim_studies::jury::seeds::REPORTING;
use hil_sim_studies::study::Table;
use protocol::SensorConfiguration;

use super::files::{create_folder, keep};
use super::say::say;
use super::{number, progress};

/// Levels of the printed table, in percent.
const TOLD: [usize; 8] = [0, 50, 70, 80, 85, 90, 95, 98];

#[derive(Debug, clap::Args)]
pub(super) struct Confidence {
    /// The first surface's seed; 10000 to 19999 are set aside for reporting
    #[arg(long, value_name = "N", default_value_t = *REPORTING.start())]
    seed: u64,
    /// How many surfaces
    #[arg(long, value_name = "N", default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    surfaces: u64,
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
}

impl Confidence {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        create_folder(&self.out)?;
        let seeds: Vec<u64> = (self.seed..self.seed.saturating_add(self.surfaces)).collect();
        let progress = progress(seeds.len() as u64, "surfaces");
        let configuration = SensorConfiguration::DEFAULT;
        let tallies = strangers::ask(&seeds, configuration, || progress.inc(1));
        progress.finish_and_clear();
        let reliability = Reliability::of(&tallies);
        tell(&reliability);
        keep(&reliability, &self.out)
    }
}

fn tell(reliability: &Reliability) {
    let mut bins = Table::new(&[
        "confidence",
        "estimates:",
        "mean confidence:",
        "within 5 %:",
        "95 % interval",
    ]);
    for (index, bar) in reliability.bars.iter().enumerate() {
        let (confidence, share) = bar.bin.means().unzip();
        let end = |index: usize| index as f64 / BINS as f64;
        bins.row([
            format!("{:.1}–{:.1}", end(index), end(index + 1)),
            bar.bin.estimates.to_string(),
            number(confidence, 3),
            number(share, 3),
            bar.interval.map_or("–".to_owned(), |interval| {
                format!("{:.3}–{:.3}", interval.low, interval.high)
            }),
        ]);
    }
    say!("{bins}");
    let interval = reliability
        .error_interval
        .map_or(String::new(), |interval| {
            format!(" ({:.3}–{:.3})", interval.low, interval.high)
        });
    say!(
        "\nExpected calibration error over {} surfaces: {}{interval}; goal {GOAL}.\n",
        reliability.surfaces,
        number(reliability.error, 3),
    );
    let mut levels = Table::new(&[
        "stood by from:",
        "right:",
        "wrong:",
        "silent:",
        "without a period: stood by:",
    ]);
    for level in TOLD.map(|level| &reliability.levels[level]) {
        levels.row([
            format!("{} %", level.percent),
            number(level.right, 3),
            number(level.wrong, 4),
            number(level.silent, 3),
            number(level.plain, 4),
        ]);
    }
    let mut classes = Table::new(&["class", "estimates:", "mean confidence:", "within 5 %:"]);
    for (class, bin) in &reliability.classes {
        let (confidence, share) = bin.means().unzip();
        classes.row([
            (*class).to_owned(),
            bin.estimates.to_string(),
            number(confidence, 3),
            number(share, 3),
        ]);
    }
    say!("{levels}\n\n{classes}\n");
}
