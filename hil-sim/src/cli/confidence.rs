//! `hil-sim chart confidence`.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_studies::estimators::confidence::{BINS, GOAL, Reliability, picture, strangers};
use hil_sim_studies::jury::seeds::REPORTING;
use protocol::SensorConfiguration;

use super::files::{create_folder, write};
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
        let progress = progress(seeds.len() as u64);
        let configuration = SensorConfiguration::DEFAULT;
        let tallies = strangers::ask(&seeds, configuration, || progress.inc(1));
        progress.finish_and_clear();
        let reliability = Reliability::of(&tallies);
        tell(&reliability);
        write(&self.out.join("confidence.csv"), &reliability.csv()?)?;
        write(
            &self.out.join("confidence.svg"),
            &picture::draw(&reliability, configuration.valid_percent),
        )?;
        Ok(ExitCode::from(u8::from(!reliability.meets_goal())))
    }
}

fn tell(reliability: &Reliability) {
    say!("| confidence | estimates | mean confidence | within 5 % | 95 % interval |");
    say!("| --- | ---: | ---: | ---: | --- |");
    for (index, bar) in reliability.bars.iter().enumerate() {
        let (confidence, share) = bar.bin.means().unzip();
        say!(
            "| {:.1}–{:.1} | {} | {} | {} | {} |",
            index as f64 / BINS as f64,
            (index + 1) as f64 / BINS as f64,
            bar.bin.estimates,
            number(confidence, 3),
            number(share, 3),
            bar.interval.map_or("–".to_owned(), |interval| {
                format!("{:.3}–{:.3}", interval.low, interval.high)
            }),
        );
    }
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
    say!("| stood by from | right | wrong | silent | without a period: stood by |");
    say!("| ---: | ---: | ---: | ---: | ---: |");
    for level in TOLD.map(|level| &reliability.levels[level]) {
        say!(
            "| {} % | {:.3} | {:.4} | {:.3} | {:.4} |",
            level.percent,
            level.right,
            level.wrong,
            level.silent,
            level.plain,
        );
    }
    say!("\n| class | estimates | mean confidence | within 5 % |");
    say!("| --- | ---: | ---: | ---: |");
    for (class, bin) in &reliability.classes {
        let (confidence, share) = bin.means().unzip();
        say!(
            "| {class} | {} | {} | {} |",
            bin.estimates,
            number(confidence, 3),
            number(share, 3),
        );
    }
    say!("");
}
