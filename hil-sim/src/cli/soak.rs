//! `hil-sim soak`.

use std::process::ExitCode;
use std::time::Instant;

use hil_sim_boards::soak;
use hil_sim_boards::soak::SHORTEST_S;
use hil_sim_studies::display::rendering_of_word;
use protocol::Rendering;

use super::say::say;
use super::{Elves, progress, status};

#[derive(Debug, clap::Args)]
pub(super) struct Soak {
    /// Virtual time
    #[arg(long, value_name = "HOURS", default_value_t = 1.0)]
    hours: f64,
    /// The same in minutes
    #[arg(long, value_name = "MINUTES", conflicts_with = "hours")]
    minutes: Option<f64>,
    /// All randomness comes from it
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How much of the surface the display plays: fundamental, shape or texture
    #[arg(long, value_name = "RENDERING", default_value = "fundamental", value_parser = rendering_of_word)]
    rendering: Rendering,
    #[command(flatten)]
    elves: Elves,
}

impl Soak {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let minutes = self.minutes.unwrap_or(60.0 * self.hours);
        let duration_s = 60.0 * minutes;
        anyhow::ensure!(
            (SHORTEST_S..=86_400.0).contains(&duration_s),
            "{minutes} minutes can't be run: give {:.2} to 1440",
            SHORTEST_S / 60.0
        );
        let firmwares = self.elves.read()?;
        let bar = progress(duration_s.ceil() as u64, "virtual s");
        let begun = Instant::now();
        let told = bar.clone();
        let soaked = soak::run(
            &soak::Soak {
                duration_s,
                seed: self.seed,
                rendering: self.rendering,
                link: soak::Soak::WEATHER,
            },
            &firmwares,
            move |t_s| told.set_position(t_s as u64),
        )?;
        bar.finish_and_clear();
        say!("| counted | |");
        say!("| --- | ---: |");
        for (what, count) in &soaked.counts {
            say!("| {what} | {count} |");
        }
        say!("\n| checked | seen |");
        say!("| --- | ---: |");
        for check in &soaked.checks {
            let verdict = if check.holds {
                ""
            } else {
                " not as it must be"
            };
            say!("| {} | {} |{verdict}", check.what, check.seen);
        }
        let wall_s = begun.elapsed().as_secs_f64();
        say!(
            "\n{duration_s:.0} virtual s in {wall_s:.0} s: {}",
            if soaked.holds() {
                "all as it must be"
            } else {
                "not as it must be"
            }
        );
        Ok(status(soaked.holds()))
    }
}
