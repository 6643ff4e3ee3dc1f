//! `hil-sim chart`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;
use hil_sim_core::scene::Scene;
use hil_sim_studies::display::texture;
use hil_sim_studies::estimators::bank;
use hil_sim_studies::estimators::benchmark;
use hil_sim_studies::estimators::benchmark::contestants;
use hil_sim_studies::estimators::costs::Costs;
use hil_sim_studies::estimators::efficiency;
use hil_sim_studies::estimators::family;
use hil_sim_studies::estimators::result::{BenchmarkResult, Entry};
use hil_sim_studies::estimators::score::Score;

use super::files::{create_folder, keep};
use super::{Elves, EngineName, confidence, display, models, progress, run_options};

#[derive(Debug, clap::Args)]
pub(super) struct Chart {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Accuracy against cost: every estimator with its knobs swept, and rivals, on the same samples of
    /// every scene, against the instructions they take on an emulated Cortex-M4F. Writes estimators.csv
    /// and estimators.svg
    Estimators(Estimators),
    /// The default estimator's error over the Cramér–Rao bound for the travel it fits, 5–100 Hz: exit status
    /// 1 if five gauges' is above 1.10 in the mean or above 1.25 anywhere. Writes bound.csv and bound.svg
    Bound(Bound),
    /// Whether the confidence is a probability, on surfaces drawn by strangers: a reliability diagram, and what
    /// is right, wrong and silent for each level from which on an estimate is stood by. Exit status 1 if the
    /// expected calibration error is above 0.05. Writes confidence.csv and confidence.svg
    Confidence(confidence::Confidence),
    /// The display's purity at the converters, from its ELF: spurs from 0 to 1 kHz for stimuli of
    /// 5–200 Hz, and each channel's mean. Exit status 1 if a goal is missed. Writes purity.csv,
    /// purity-spectra.csv and purity.svg
    Purity(display::Purity),
    /// What the voltage does when the hand stops at a crest and starts again, from the display's ELF: exit
    /// status 1 if a channel takes longer than 20 ms to 0 V. Writes stop.csv and stop.svg
    Stop(display::Stop),
    /// The stimulus' phase error against the motion over the link's delay, from the display's ELF, beside a
    /// stimulus that is relayed over the network. Exit status 1 if ours is more than 0.01 cycles off or 1 ms late
    /// at any delay. Writes delay.csv and delay.svg
    Delay(display::Delay),
    /// Whether partials and a random part carry more of a surface than λ: coherence and spectral distance of what is
    /// played with the surface under the hand, and which surfaces of one λ a simulated observer tells apart. Exit
    /// status 1 if partials or the random part bring a family of surfaces no nearer. Writes texture.csv, texture-pairs.csv and texture.svg
    Texture(Texture),
    /// Speed against accuracy of the contact models: every rung, every integrator, steps of many lengths,
    /// against the reference. Writes models.csv and models.svg
    Models(models::Models),
    /// Where integrators fail: maps over step and stiffness of a fingertip that should rest and of one that
    /// should swing. Writes stability.csv and stability.svg
    Stability(models::Stability),
}

#[derive(Debug, clap::Args)]
struct Bound {
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
}

#[derive(Debug, clap::Args)]
struct Texture {
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
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

#[derive(Debug, clap::Args)]
struct Estimators {
    /// The scenes: a folder with a folder for each family
    #[arg(
        long,
        value_name = "FOLDER",
        default_value = "hil-sim/scenes/estimation"
    )]
    scenes: PathBuf,
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
    /// The ELF that exercises the estimators: the example estimator_cost of firmware-sensor
    #[arg(
        long,
        value_name = "ELF",
        default_value = "target/thumbv7em-none-eabihf/release/examples/estimator_cost"
    )]
    elf: PathBuf,
}

impl Chart {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        match self.what {
            What::Estimators(estimators) => estimators.execute(),
            What::Bound(bound) => bound.execute(),
            What::Confidence(confidence) => confidence.execute(),
            What::Purity(purity) => purity.execute(),
            What::Stop(stop) => stop.execute(),
            What::Delay(delay) => delay.execute(),
            What::Texture(texture) => texture.execute(),
            What::Models(models) => models.execute(),
            What::Stability(stability) => stability.execute(),
        }
    }
}

impl Estimators {
    fn execute(self) -> anyhow::Result<ExitCode> {
        let families = family::load(&self.scenes)?;
        create_folder(&self.out)?;
        let costs = Costs::count(&self.elf)?;
        let contestants = contestants();

        let scenes: Vec<&Scene> = families.iter().flat_map(|family| &family.scenes).collect();
        let progress = progress(scenes.len() as u64, "scenes");
        let summaries = benchmark::run(&contestants, &scenes, |_| 0.0, || progress.inc(1))?;
        progress.finish_and_clear();

        let mut entries = bank::entries(&families)?;
        let running = contestants.iter().enumerate().map(|(index, contestant)| {
            let mut rest = &summaries[..];
            let scores = families
                .iter()
                .map(|family| {
                    let (these, others) = rest.split_at(family.scenes.len());
                    rest = others;
                    Score::new(&family.scenes, these.iter().map(|scene| &scene[index]))
                })
                .collect();
            Entry {
                method: contestant.method(),
                knob: contestant.knob(),
                value: contestant.value(),
                setting: contestant.setting(),
                cost: costs.of(index, contestant),
                scores,
            }
        });
        entries.extend(running);
        let result = BenchmarkResult { families, entries };
        keep(&result, &self.out)
    }
}

impl Texture {
    fn execute(self) -> anyhow::Result<ExitCode> {
        if let Some(folder) = &self.folder {
            let scenes = run_options::of_folder(folder, EngineName::Native)?;
            create_folder(&self.out)?;
            let progress = progress(scenes.len() as u64, "recordings");
            let recorded = texture::recorded::measure(&scenes, || progress.inc(1))?;
            progress.finish_and_clear();
            return keep(&recorded, &self.out);
        }
        let firmwares = self.elves.read()?;
        create_folder(&self.out)?;
        let progress = progress(texture::runs(self.quick), "runs");
        let measured = texture::measure(&firmwares, self.quick, || progress.inc(1))?;
        progress.finish_and_clear();
        keep(&measured, &self.out)
    }
}

impl Bound {
    fn execute(self) -> anyhow::Result<ExitCode> {
        create_folder(&self.out)?;
        let progress = progress(efficiency::SCENES, "scenes");
        let rows = efficiency::measure(|| progress.inc(1))?;
        progress.finish_and_clear();
        keep(&rows[..], &self.out)
    }
}
