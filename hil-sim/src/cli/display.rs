//! What is measured on the display's ELF alone: `hil-sim chart purity` and its kin.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_boards::{Firmware, FirmwareError};
use hil_sim_studies::display::purity;
use hil_sim_studies::display::purity::Extent;
use hil_sim_studies::display::rendering_of_word;
use hil_sim_studies::display::{delay, stop, timing};
use protocol::{Rendering, Role};

use super::files::{create_folder, keep};
use super::progress;

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
    /// How much of the surface is played: fundamental, shape or texture, of a surface that is a sine
    #[arg(long, value_name = "RENDERING", default_value = "fundamental", value_parser = rendering_of_word)]
    rendering: Rendering,
}

impl Purity {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let measured = &self.measured;
        let firmware = measured.begin()?;
        let progress = progress(purity::runs(measured.extent()), "runs");
        let rows = purity::measure(&firmware, self.rendering, measured.extent(), || {
            progress.inc(1)
        })?;
        progress.finish_and_clear();
        keep(&rows[..], &measured.out)
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
        let progress = progress(timing::runs(*quick), "runs");
        let rows = timing::measure(&firmware, *quick, || progress.inc(1))?;
        progress.finish_and_clear();
        keep(&rows[..], out)
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
        keep(&stops[..], out)
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
        let progress = progress(delay::runs(*quick), "runs");
        let rows = delay::measure(&firmware, *quick, || progress.inc(1))?;
        progress.finish_and_clear();
        keep(&rows[..], out)
    }
}
