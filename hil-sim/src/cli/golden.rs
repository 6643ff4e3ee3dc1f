//! `hil-sim golden`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, bail};
use hil_sim_studies::output::golden::{Comparison, Golden, complaint};

use super::run_options::{Loaded, RunOptions};
use super::say::say;
use super::scene_files::scene_files;
use super::{status, under_bar};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// Runs scenes and compares their hashes with the golden ones: exit status 1 if one is another or is
    /// missing, 2 if a scene or a file cannot be used
    Check {
        #[command(flatten)]
        what: What,
        /// Run each scene so many times, and compare every run
        #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
        repeat: u32,
    },
    /// Runs scenes and takes their hashes as the golden ones: do it once the changes have been looked at
    Renew {
        #[command(flatten)]
        what: What,
    },
}

#[derive(Debug, clap::Args)]
pub(super) struct What {
    /// Scenes: TOML files, or folders of them
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// The file of golden hashes
    #[arg(long, value_name = "FILE", default_value = "golden.toml")]
    file: PathBuf,
    #[command(flatten)]
    way: RunOptions,
}

/// A scene's runs so far: each hash, and how many runs had it.
type Seen = Vec<(u64, u32)>;

impl Command {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        match self {
            Self::Check { what, repeat } => what.check(repeat),
            Self::Renew { what } => what.renew(),
        }
    }
}

impl What {
    fn check(&self, repeat: u32) -> anyhow::Result<ExitCode> {
        let golden = Golden::read(&self.file)?;
        let scenes = self.load()?;
        let started = Instant::now();
        let seen = self.run(&scenes, repeat)?;
        let wall_s = started.elapsed().as_secs_f64();
        let engine = self.way.engine();
        let mut met = true;
        for (Loaded { path, scene }, seen) in scenes.iter().zip(&seen) {
            let name = golden.name(path)?;
            for &(hash, count) in seen {
                let standing = golden.standing(&name, engine, hash);
                let Some(line) = complaint(&standing, hash, &golden, &name) else {
                    continue;
                };
                met = false;
                say!("{}: {line} ({count} of {repeat} runs)", path.display());
                let (file, at) = match standing {
                    Comparison::Other(_, at) => (golden.path(), at),
                    Comparison::Same | Comparison::Missing => (path.as_path(), None),
                };
                let title = format!("{} is not as it was", scene.name);
                self.way.annotate(file, at, &title, &line);
            }
        }
        let runs = scenes.len() as u64 * u64::from(repeat);
        say!(
            "{} scenes, {runs} runs ({}) in {wall_s:.1} s: {}",
            scenes.len(),
            engine.name(),
            if met {
                "all hashes are the golden ones"
            } else {
                "not all hashes are the golden ones"
            }
        );
        Ok(status(met))
    }

    fn renew(&self) -> anyhow::Result<ExitCode> {
        // A file that can't be used is refused before the runs, which take long.
        Golden::open(&self.file)?;
        let scenes = self.load()?;
        let seen = self.run(&scenes, 1)?;
        // Read again: what another `golden renew` has written meanwhile stays. Nothing is locked: of two that write at the
        // same moment, one may lose its hashes.
        let mut golden = Golden::open(&self.file)?;
        let engine = self.way.engine();
        let mut same = 0;
        for (Loaded { path, .. }, seen) in scenes.iter().zip(&seen) {
            let name = golden.name(path)?;
            for &(hash, _) in seen {
                let hash_text = format!("{hash:016x}");
                match golden.renew(&name, engine, hash) {
                    Some(before) if before == hash_text => same += 1,
                    Some(before) => say!("{name}: {}: {before} -> {hash_text}", engine.name()),
                    None => say!("{name}: {}: {hash_text}, new", engine.name()),
                }
            }
        }
        golden.write()?;
        say!(
            "{}: written, {same} of {} unchanged",
            golden.path().display(),
            scenes.len()
        );
        Ok(ExitCode::SUCCESS)
    }

    fn load(&self) -> anyhow::Result<Vec<Loaded>> {
        let files: Vec<PathBuf> = scene_files(&self.scenes, None)?;
        let own = |path: &Path| path.canonicalize().ok() == self.file.canonicalize().ok();
        if let Some(path) = files.iter().find(|path| path.exists() && own(path)) {
            bail!(
                "{}: holds the golden hashes, and is no scene: leave it out",
                path.display()
            );
        }
        self.way.accepted(self.way.load(&files))
    }

    fn run(&self, scenes: &[Loaded], repeat: u32) -> anyhow::Result<Vec<Seen>> {
        let ready = self.way.ready()?;
        let inputs: Vec<usize> = (0..repeat).flat_map(|_| 0..scenes.len()).collect();
        let hash = |&index: &usize| {
            let Loaded { path, scene } = &scenes[index];
            let hash = ready.hash(scene);
            hash.with_context(|| path.display().to_string())
        };
        let hashes = under_bar(&inputs, self.way.threads(), "runs", hash)?;
        let mut seen = vec![Seen::new(); scenes.len()];
        for (index, hash) in inputs.into_iter().zip(hashes) {
            match seen[index].iter_mut().find(|(other, _)| *other == hash) {
                Some((_, count)) => *count += 1,
                None => seen[index].push((hash, 1)),
            }
        }
        Ok(seen)
    }
}
