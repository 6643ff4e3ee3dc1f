//! What is measured on the display's ELF alone: `hil-sim chart purity` and its kin.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_boards::{Firmware, FirmwareError};
use hil_sim_studies::display::purity;
use hil_sim_studies::display::purity::Extent;
use hil_sim_studies::display::{delay, stop, timing, word_of_mode};
use protocol::Role;

use super::files::{create_folder, write};
use super::say::say;
use super::{number, runs};

/// The display's ELF, and where to write what it does.
#[derive(Debug, clap::Args)]
pub(super) struct Measured {
    /// The display board's ELF
    #[arg(
        long,
        value_name = "ELF",
        default_value = "target/thumbv7em-none-eabihf/release/firmware-display"
    )]
    display_elf: PathBuf,
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
    /// A little of it only, to see that it works
    #[arg(long)]
    pub(super) quick: bool,
}

impl Measured {
    /// The ELF; the folder is made.
    fn begin(&self) -> anyhow::Result<Firmware> {
        create_folder(&self.out)?;
        Ok(self.firmware()?)
    }

    pub(super) fn firmware(&self) -> Result<Firmware, FirmwareError> {
        Firmware::read(&self.display_elf, Role::Display)
    }

    fn extent(&self) -> Extent {
        if self.quick {
            Extent::Quick
        } else {
            Extent::Whole
        }
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct Purity {
    #[command(flatten)]
    measured: Measured,
}

impl Purity {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let measured = &self.measured;
        let firmware = measured.begin()?;
        let progress = runs(purity::runs(measured.extent()));
        let rows = purity::measure(&firmware, measured.extent(), || progress.inc(1))?;
        progress.finish_and_clear();
        say!(
            "| rate, Hz | mode | hand | mm/s | λ, mm | stimulus, Hz | V | worst spur, dBc | at, Hz | \
             mean over whole cycles, mV | over any second, mV |"
        );
        say!("| ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
        for row in &rows {
            say!(
                "| {} | {} | {} | {:.1} | {:.2} | {} | {} | {} | {} | {:.2} | {:.1} |{}",
                row.rate_hz,
                word_of_mode(row.mode),
                purity::word_of(row.hand),
                row.speed_mm_s,
                row.wavelength_mm,
                number(row.frequency_hz, 0),
                number(row.stimulus_v, 3),
                number(row.spur.map(|spur| spur.0), 1),
                number(row.spur.map(|spur| spur.1), 1),
                row.whole_mean_mv,
                row.second_mean_mv,
                if purity::is_met(row) {
                    ""
                } else {
                    " goal missed"
                },
            );
        }
        let out = &measured.out;
        write(&out.join("purity.csv"), &purity::csv(&rows)?)?;
        write(
            &out.join("purity-spectra.csv"),
            &purity::spectra_csv(&rows)?,
        )?;
        write(&out.join("purity.svg"), &purity::picture::draw(&rows))?;
        Ok(ExitCode::from(u8::from(!rows.iter().all(purity::is_met))))
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct Timing {
    #[command(flatten)]
    measured: Measured,
}

impl Timing {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let Measured { out, quick, .. } = &self.measured;
        let firmware = self.measured.begin()?;
        let progress = runs(timing::runs(*quick));
        let rows = timing::measure(&firmware, *quick, || progress.inc(1))?;
        progress.finish_and_clear();
        say!(
            "| rate, Hz | delay, ms | jitter, ms | loss, % | LDAC after tick, µs | its jitter p50, µs | p99 | \
             longest | skew, µs | hand to output p50, ms | p99 | longest | estimates arrived |"
        );
        say!(
            "| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        );
        for row in &rows {
            let edges = &row.edges;
            say!(
                "| {} | {} | {} | {:.0} | {:.2} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | \
                 {} of {} |{}",
                row.rate_hz,
                row.link.delay_ms,
                row.link.jitter_ms,
                100.0 * row.link.loss,
                edges.after.p50_us,
                edges.jitter.p50_us,
                edges.jitter.p99_us,
                edges.jitter.max_us,
                edges.skew_us,
                row.reaction.p50_ms,
                row.reaction.p99_ms,
                row.reaction.max_ms,
                row.estimates.1,
                row.estimates.0,
                if timing::is_met(row) {
                    ""
                } else {
                    " goal missed"
                },
            );
        }
        write(&out.join("timing.csv"), &timing::csv(&rows)?)?;
        write(&out.join("timing.svg"), &timing::picture::draw(&rows))?;
        Ok(ExitCode::from(u8::from(!rows.iter().all(timing::is_met))))
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct Stop {
    #[command(flatten)]
    measured: Measured,
}

impl Stop {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let Measured { out, quick, .. } = &self.measured;
        let firmware = self.measured.begin()?;
        let stops = stop::measure(&firmware, *quick)?;
        say!(
            "| rate, Hz | mode | crest, V | last count to 0 V, ms | the last channel's, ms | first count to \
             voltage, ms | largest step, V | of the wave itself, V |"
        );
        say!("| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |");
        for row in &stops {
            say!(
                "| {} | {} | {:.2} | {} | {} | {} | {:.3} | {:.3} |{}",
                row.rate_hz,
                word_of_mode(row.mode),
                row.crest_v,
                number(row.watched_ms, 2),
                number(row.all_ms, 2),
                number(row.starts_ms, 2),
                row.largest_step_v,
                row.natural_step_v,
                if stop::is_met(row) {
                    ""
                } else {
                    " goal missed"
                },
            );
        }
        write(&out.join("stop.csv"), &stop::csv(&stops)?)?;
        write(&out.join("stop.svg"), &stop::picture::draw(&stops))?;
        Ok(ExitCode::from(u8::from(!stops.iter().all(stop::is_met))))
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct Delay {
    #[command(flatten)]
    measured: Measured,
}

impl Delay {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let Measured { out, quick, .. } = &self.measured;
        let firmware = self.measured.begin()?;
        let progress = runs(delay::runs(*quick));
        let rows = delay::measure(&firmware, *quick, || progress.inc(1))?;
        progress.finish_and_clear();
        say!(
            "| delay, ms | jitter, ms | loss, % | ours: phase error RMS, cycles | hand to output p50, ms | \
             relayed: phase error RMS, cycles | late, ms |"
        );
        say!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
        for row in &rows {
            let relayed = (row.link.loss == 0.0).then_some(row);
            say!(
                "| {} | {} | {:.0} | {} | {} | {} | {} |",
                row.link.delay_ms,
                row.link.jitter_ms,
                100.0 * row.link.loss,
                number(row.ours_cycles, 4),
                number(row.ours_ms, 3),
                number(relayed.map(|row| row.relayed_cycles), 3),
                number(relayed.map(|row| row.relayed_ms), 0),
            );
        }
        write(&out.join("delay.csv"), &delay::csv(&rows)?)?;
        write(&out.join("delay.svg"), &delay::picture::draw(&rows))?;
        Ok(ExitCode::SUCCESS)
    }
}
