//! How the commands that run scenes run them: engine, threads, annotations.

use std::fs;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::thread;

use clap::ValueEnum;
use hil_sim_boards::Firmwares;
use hil_sim_core::native;
use hil_sim_core::run::recording::{Engine, Recording};
use hil_sim_core::scene::{Scene, SceneError};
use hil_sim_core::scene_file::line::line_of;
use hil_sim_studies::jury::folder;
use hil_sim_studies::jury::folder::Entry;
use hil_sim_studies::output::annotation::Annotation;

use super::say::say;
use super::{Elves, EngineName};

/// How scenes are run, and how it is told.
#[derive(Debug, clap::Args)]
pub(super) struct RunOptions {
    /// What runs the firmware
    #[arg(long, value_enum, default_value_t = EngineName::Native)]
    engine: EngineName,
    /// Scenes to run at a time; 0: one per core. The results and their order are the same
    #[arg(short, long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Whether to print annotations that GitHub shows beside the line at fault
    #[arg(long, value_enum, default_value_t = Annotate::Auto)]
    annotate: Annotate,
    #[command(flatten)]
    elves: Elves,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Annotate {
    /// If GITHUB_ACTIONS is "true", as it is on GitHub's runners
    Auto,
    /// Yes
    Github,
    /// No
    Off,
}

/// What runs the scenes, ready.
pub(super) enum Ready {
    /// The libraries.
    Native,
    /// The ELFs.
    Elf(Box<Firmwares>),
}

/// A scene with its file.
pub(super) struct Loaded {
    /// The file, as it was named.
    pub path: PathBuf,
    /// What is in it.
    pub scene: Scene,
}

impl Ready {
    /// Reads the firmwares, if they are to run.
    pub fn new(engine: EngineName, elves: &Elves) -> anyhow::Result<Self> {
        Ok(match engine {
            EngineName::Native => Self::Native,
            EngineName::Elf => Self::Elf(Box::new(elves.read()?)),
        })
    }

    pub fn run(&self, scene: &Scene) -> anyhow::Result<Recording> {
        Ok(match self {
            Self::Native => native::run(scene)?,
            Self::Elf(firmwares) => hil_sim_boards::run(scene, firmwares)?.0,
        })
    }

    /// The hash of a scene's run.
    pub fn hash(&self, scene: &Scene) -> anyhow::Result<u64> {
        Ok(match self {
            Self::Native => native::run_before(scene, &mut ())?.hash,
            Self::Elf(firmwares) => hil_sim_boards::run(scene, firmwares)?.0.hash,
        })
    }
}

impl RunOptions {
    pub fn engine(&self) -> Engine {
        match self.engine {
            EngineName::Native => Engine::Native,
            EngineName::Elf => Engine::Elf,
        }
    }

    /// Reads the firmwares, if they are to run.
    pub fn ready(&self) -> anyhow::Result<Ready> {
        Ready::new(self.engine, &self.elves)
    }

    pub fn threads(&self) -> NonZero<usize> {
        NonZero::new(self.jobs)
            .or_else(|| thread::available_parallelism().ok())
            .unwrap_or(NonZero::<usize>::MIN)
    }

    /// Prints an annotation, if it is wanted.
    pub fn annotate(&self, annotation: &Annotation<'_>) {
        let wanted = match self.annotate {
            Annotate::Auto => std::env::var_os("GITHUB_ACTIONS").is_some_and(|set| set == "true"),
            Annotate::Github => true,
            Annotate::Off => false,
        };
        if wanted {
            say!("{annotation}");
        }
    }

    /// Reads all scenes, or gives every reason why not. What their authors should know goes to standard
    /// error.
    pub fn load(&self, files: &[PathBuf]) -> Vec<Result<Loaded, SceneError>> {
        let load = |path: &PathBuf| {
            Ok(Loaded {
                path: path.clone(),
                scene: load(path, self.engine)?,
            })
        };
        files.iter().map(load).collect()
    }

    /// Annotates refusals, and makes one error of them.
    pub fn refuse(&self, refusals: &[&SceneError]) -> anyhow::Error {
        for refusal in refusals {
            self.annotate(&Annotation {
                file: &refusal.file,
                line: refusal.line,
                title: "this scene cannot be used",
                message: &refusal.to_string(),
            });
        }
        let lines: Vec<String> = refusals.iter().map(ToString::to_string).collect();
        anyhow::anyhow!(lines.join("\n"))
    }
}

/// Tells on standard error what a scene's author should know.
pub(super) fn tell_notes(scene: &Scene) {
    for note in &scene.notes {
        eprintln!("{note}");
    }
}

/// Reads a scene that an engine is to run, and tells on standard error what its author should know.
pub(super) fn load(path: &Path, engine: EngineName) -> Result<Scene, SceneError> {
    let scene = Scene::load(path)?;
    tell_notes(&scene);
    if let EngineName::Native = engine {
        native::check(&scene).map_err(|error| at_home(path, error))?;
    }
    Ok(scene)
}

/// The scenes of a folder's list, all of them before anything is run: a refusal is not to come after half an hour.
pub(super) fn of_folder(folder: &Path, engine: EngineName) -> anyhow::Result<Vec<(Entry, Scene)>> {
    let entries = folder::read(folder)?.into_iter();
    let loaded = entries.map(|entry| {
        let scene = load(&entry.scene, engine)?;
        Ok((entry, scene))
    });
    loaded.collect()
}

/// A refusal of an engine's, with the scene's file and line.
fn at_home(path: &Path, error: SceneError) -> SceneError {
    let keys: Vec<&str> = error
        .key
        .split(['.', '[', ']'])
        .filter(|key| !key.is_empty())
        .collect();
    let text = fs::read_to_string(path).unwrap_or_default();
    SceneError {
        file: path.display().to_string(),
        line: line_of(&text, &keys),
        ..error
    }
}
