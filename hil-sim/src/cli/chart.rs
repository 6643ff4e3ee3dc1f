//! `hil-sim chart`, and `hil-sim timing`, which is another.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;
use hil_sim_boards::Firmware;
use hil_sim_studies::contact::{models, stability};
use hil_sim_studies::display::{delay, purity, rendering_of_word, stop, texture, timing};
use hil_sim_studies::estimators::{self, confidence, efficiency};
use hil_sim_studies::jury::seeds::{REPORTING, Seeds};
use hil_sim_studies::study::{Progress, Study};
use indicatif::ProgressBar;
use protocol::Rendering;

use super::files::{create_folder, write};
use super::say::say;
use super::{DisplayElf, Elves, EngineName, progress, run_options, status};

#[derive(Debug, Subcommand)]
pub(super) enum Chart {
    /// Accuracy against cost: every estimator with its knobs swept, and rivals, on the same samples of
    /// every scene, against the instructions they take on an emulated Cortex-M4F. Writes estimators.csv
    /// and estimators.svg
    Estimators(Estimators),
    /// The default estimator's error over the Cramér–Rao bound for the travel it fits, 5–100 Hz: exit status
    /// 1 if five gauges' is above 1.10 in the mean or above 1.25 anywhere. Writes bound.csv and bound.svg
    Bound(Out),
    /// Whether the confidence is a probability, on surfaces drawn by strangers: a reliability diagram, and what
    /// is right, wrong and silent for each level from which on an estimate is stood by. Exit status 1 if the
    /// expected calibration error is above 0.05. Writes confidence.csv and confidence.svg
    Confidence(Confidence),
    /// The display's purity at the converters, from its ELF: spurs from 0 to 1 kHz for stimuli of
    /// 5–200 Hz, and each channel's mean. Exit status 1 if a goal is missed. Writes purity.csv,
    /// purity-spectra.csv and purity.svg
    Purity(Purity),
    /// What the voltage does when the hand stops at a crest and starts again, from the display's ELF: exit
    /// status 1 if a channel takes longer than 20 ms to 0 V. Writes stop.csv and stop.svg
    Stop(OfDisplay),
    /// The stimulus' phase error against the motion over the link's delay, from the display's ELF, beside a
    /// stimulus that is relayed over the network. Exit status 1 if ours is more than 0.01 cycles off or 1 ms late
    /// at any delay. Writes delay.csv and delay.svg
    Delay(OfDisplay),
    /// Whether partials and a random part carry more of a surface than λ: coherence and spectral distance of what is
    /// played with the surface under the hand, and which surfaces of one λ a simulated observer tells apart. Exit
    /// status 1 if of a family of surfaces partials cost more than 0.02 of coherence, the random part brings the spectrum
    /// more than 0.3 dB further away, or nothing is played. Writes texture.csv, texture-pairs.csv and texture.svg
    Texture(Texture),
    /// Speed against accuracy of the contact models: every rung, every integrator, steps of many lengths,
    /// against the reference. Writes models.csv and models.svg
    Models(Out),
    /// Where integrators fail: maps over step and stiffness of a fingertip that should rest and of one that
    /// should swing. Writes stability.csv and stability.svg
    Stability(Out),
}

#[derive(Debug, clap::Args)]
pub(super) struct Out {
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
}

/// What is measured on the display's ELF alone.
#[derive(Debug, clap::Args)]
pub(super) struct OfDisplay {
    #[command(flatten)]
    elf: DisplayElf,
    #[command(flatten)]
    out: Out,
    /// A little of it only, to see that it works
    #[arg(long)]
    pub(super) quick: bool,
}

#[derive(Debug, clap::Args)]
pub(super) struct Estimators {
    /// The scenes: a folder with a folder for each family
    #[arg(
        long,
        value_name = "FOLDER",
        default_value = "hil-sim/scenes/estimation"
    )]
    scenes: PathBuf,
    #[command(flatten)]
    out: Out,
    /// The ELF that exercises the estimators: the example estimator_cost of firmware-sensor
    #[arg(
        long,
        value_name = "ELF",
        default_value = "target/thumbv7em-none-eabihf/release/examples/estimator_cost"
    )]
    elf: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(super) struct Confidence {
    /// The first surface's seed; 10000 to 19999 are set aside for reporting
    #[arg(long, value_name = "N", default_value_t = *REPORTING.start())]
    seed: u64,
    /// How many surfaces
    #[arg(long, value_name = "N", default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    surfaces: u64,
    #[command(flatten)]
    out: Out,
}

#[derive(Debug, clap::Args)]
pub(super) struct Purity {
    #[command(flatten)]
    measured: OfDisplay,
    /// How much of the surface is played: fundamental, shape or texture, of a surface that is a sine
    #[arg(long, value_name = "RENDERING", default_value = "fundamental", value_parser = rendering_of_word)]
    rendering: Rendering,
}

#[derive(Debug, clap::Args)]
pub(super) struct Texture {
    #[command(flatten)]
    out: Out,
    /// A little of it only, to see that it works
    #[arg(long)]
    quick: bool,
    /// Judge recordings instead: the scenes of this folder, which has an index.json with their truths as for `hil-sim
    /// jury`. Writes texture-recorded.csv and texture-recorded.svg
    #[arg(long, value_name = "DIR", conflicts_with = "quick")]
    folder: Option<PathBuf>,
    #[command(flatten)]
    elves: Elves,
}

/// How far a study is, as a bar.
struct Bar(ProgressBar);

impl Progress for Bar {
    fn begin(&self, runs: usize) {
        self.0.set_length(runs as u64);
    }

    fn step(&self) {
        self.0.inc(1);
    }
}

impl Chart {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        match self {
            Self::Estimators(Estimators { scenes, out, elf }) => {
                let families = run_options::families(&scenes)?;
                out.draw("scenes", |bar| {
                    Ok(estimators::compare(families, &elf, bar)?)
                })
            }
            Self::Bound(out) => out.draw("scenes", |bar| Ok(efficiency::measure(bar)?)),
            Self::Confidence(Confidence {
                seed,
                surfaces,
                out,
            }) => {
                let seeds = Seeds {
                    first: seed,
                    count: surfaces,
                };
                seeds.purpose()?;
                out.draw("surfaces", |bar| Ok(confidence::measure(&seeds.all(), bar)))
            }
            Self::Purity(Purity {
                measured,
                rendering,
            }) => measured.draw(|elf, quick, bar| Ok(purity::measure(elf, rendering, quick, bar)?)),
            Self::Stop(of) => of.draw(|elf, quick, bar| Ok(stop::measure(elf, quick, bar)?)),
            Self::Delay(of) => of.draw(|elf, quick, bar| Ok(delay::measure(elf, quick, bar)?)),
            Self::Texture(texture) => texture.execute(),
            Self::Models(out) => out.draw("runs", |bar| Ok(models::measure(bar))),
            Self::Stability(out) => out.draw("runs", |bar| Ok(stability::measure(bar))),
        }
    }
}

impl Out {
    /// Makes a study, prints its table and writes its files. Exit status 1 if it misses a goal.
    fn draw<S: Study>(
        &self,
        things: &str,
        measure: impl FnOnce(&Bar) -> anyhow::Result<S>,
    ) -> anyhow::Result<ExitCode> {
        create_folder(&self.out)?;
        let bar = Bar(progress(0, things));
        let study = measure(&bar)?;
        bar.0.finish_and_clear();
        if let Some(text) = study.text() {
            say!("{text}");
        }
        let path = |ending: &str| self.out.join(format!("{}{ending}", S::NAME));
        for (kind, text) in study.csvs() {
            write(&path(&format!("{kind}.csv")), &text)?;
        }
        write(&path(".svg"), &study.picture())?;
        Ok(status(study.is_met()))
    }
}

impl OfDisplay {
    fn draw<S: Study>(
        &self,
        measure: impl FnOnce(&Firmware, bool, &Bar) -> anyhow::Result<S>,
    ) -> anyhow::Result<ExitCode> {
        self.out
            .draw("runs", |bar| measure(&self.firmware()?, self.quick, bar))
    }

    pub(super) fn firmware(&self) -> anyhow::Result<Firmware> {
        Ok(self.elf.read()?)
    }

    pub(super) fn timing(&self) -> anyhow::Result<ExitCode> {
        self.draw(|elf, quick, bar| Ok(timing::measure(elf, quick, bar)?))
    }
}

impl Texture {
    fn execute(self) -> anyhow::Result<ExitCode> {
        if let Some(folder) = &self.folder {
            let scenes = run_options::of_folder(folder, EngineName::Native)?;
            return self.out.draw("recordings", |bar| {
                Ok(texture::recorded::measure(&scenes, bar)?)
            });
        }
        let firmwares = self.elves.read()?;
        self.out.draw("runs", |bar| {
            Ok(texture::measure(&firmwares, self.quick, bar)?)
        })
    }
}
