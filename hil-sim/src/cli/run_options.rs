//! How the commands that run scenes run them: engine, threads, annotations.

use std::fs;
use std::num::NonZero;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use hil_sim_boards::FirmwareError;
use hil_sim_core::native;
use hil_sim_core::run::recording::Engine;
use hil_sim_core::scene::{Scene, SceneError};
use hil_sim_core::scene_file::line::line_of;
use hil_sim_studies::bench::Bench;
use hil_sim_studies::estimators::family::{self, Family, FamilyError};
use hil_sim_studies::jury::folder::{self, Entry};
use hil_sim_studies::output::annotation::annotation;

use super::say::{say, tell};
use super::{Elves, EngineName, threads};

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

pub(super) struct Loaded {
    pub path: PathBuf,
    pub scene: Scene,
}

impl RunOptions {
    pub fn engine(&self) -> Engine {
        self.engine.engine()
    }

    /// Reads the firmwares, if they are to run.
    pub fn ready(&self) -> Result<Bench, FirmwareError> {
        self.engine.bench(&self.elves)
    }

    pub fn threads(&self) -> NonZero<usize> {
        threads(self.jobs)
    }

    /// Prints an annotation, if it is wanted.
    pub fn annotate(&self, file: &Path, line: Option<usize>, title: &str, message: &str) {
        let wanted = match self.annotate {
            Annotate::Auto => std::env::var_os("GITHUB_ACTIONS").is_some_and(|set| set == "true"),
            Annotate::Github => true,
            Annotate::Off => false,
        };
        if wanted {
            let file = file.display().to_string();
            say!("{}", annotation(&file, line, title, message));
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

    /// All scenes, or one error of all refusals, which are annotated.
    pub fn accepted(&self, loaded: Vec<Result<Loaded, SceneError>>) -> anyhow::Result<Vec<Loaded>> {
        let mut lines = Vec::new();
        for refusal in loaded.iter().filter_map(|one| one.as_ref().err()) {
            let (file, line) = (Path::new(&refusal.file), refusal.line);
            lines.push(refusal.to_string());
            self.annotate(
                file,
                line,
                "this scene cannot be used",
                &refusal.to_string(),
            );
        }
        anyhow::ensure!(lines.is_empty(), lines.join("\n"));
        Ok(loaded.into_iter().flatten().collect())
    }
}

/// Tells on standard error what a scene's author should know.
pub(super) fn tell_notes(scene: &Scene) {
    for note in &scene.notes {
        tell!("{note}");
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

/// The scenes of all families. What their authors should know goes to standard error.
pub(super) fn families(root: &Path) -> Result<Vec<Family>, FamilyError> {
    let families = family::load(root)?;
    families
        .iter()
        .flat_map(|family| &family.scenes)
        .for_each(tell_notes);
    Ok(families)
}

/// A refusal of an engine's, with the scene's file and line.
fn at_home(path: &Path, error: SceneError) -> SceneError {
    let keys = error.key.split(['.', '[', ']']);
    let keys: Vec<&str> = keys.filter(|key| !key.is_empty()).collect();
    let text = fs::read_to_string(path).unwrap_or_default();
    SceneError {
        file: path.display().to_string(),
        line: line_of(&text, &keys),
        ..error
    }
}
