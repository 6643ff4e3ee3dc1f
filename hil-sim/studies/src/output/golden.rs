//! Golden hashes: what scenes' runs were when somebody looked at them last, in a TOML file that is kept
//! beside the scenes.
//!
//! ```toml
//! ["fig7.toml"]
//! elf = "0123456789abcdef"
//! native = "fedcba9876543210"
//! ```

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use hil_sim_core::run::recording::Engine;
use hil_sim_core::scene_file::line::{line_at, line_of};
use hil_sim_core::scene_file::read_text;

use super::replace;

/// The file's first lines.
const HEADER: &str = "\
# Golden hashes: of every link byte and DAC word of a run, with its instant. A changed hash is a changed run.
# Look at what changed and why; if it is meant: hil-sim golden renew --file THIS_FILE SCENES...

";

/// Why golden hashes cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum GoldenError {
    /// There is no such file.
    #[error(
        "{path}: cannot be read: there is no such file: make it with hil-sim golden renew --file {path} SCENES...",
        path = .0.display()
    )]
    Missing(PathBuf),
    /// The file cannot be read.
    #[error("{}: cannot be read: {}: give a file of golden hashes", .0.display(), .1)]
    Unreadable(PathBuf, io::Error),
    /// The file holds something else, at this line.
    #[error(
        "{path}:{}: {}: mend it, or take it away and make it anew with hil-sim golden renew --file {path} SCENES...",
        .1, .2, path = .0.display()
    )]
    Foreign(PathBuf, usize, String),
    /// The file cannot be written.
    #[error("{}: cannot be written: {}: nothing was changed; give a file in a folder that exists and has room", .0.display(), .1)]
    NotWritten(PathBuf, io::Error),
    /// A scene's file is nowhere.
    #[error("{}: cannot be found: {}: give the name of a scene", .0.display(), .1)]
    NoScene(PathBuf, io::Error),
}

type Hashes = BTreeMap<String, BTreeMap<String, String>>;

/// What a run has to do with the golden hash of its scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Comparison {
    /// It is the same.
    Same,
    /// There is none.
    Missing,
    /// It is another: the golden one, and the line where it stands.
    Other(String, Option<usize>),
}

/// A file of golden hashes.
#[derive(Clone, Debug)]
pub struct Golden {
    path: PathBuf,
    /// The file's folder, as the system calls it.
    folder: PathBuf,
    text: String,
    hashes: Hashes,
}

impl Golden {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, GoldenError> {
        let text = read_text(path).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => GoldenError::Missing(path.to_owned()),
            _ => GoldenError::Unreadable(path.to_owned(), error),
        })?;
        let foreign = |line, what| GoldenError::Foreign(path.to_owned(), line, what);
        let hashes: Hashes = toml::from_str(&text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            foreign(line_at(text.as_bytes(), at), error.message().to_owned())
        })?;
        for (scene, engines) in &hashes {
            for (engine, hash) in engines {
                let is_hash = hash.len() == 16 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
                let is_engine = [Engine::Native, Engine::Elf]
                    .map(Engine::name)
                    .contains(&&**engine);
                if !is_hash || !is_engine {
                    let line = line_of(&text, &[scene, engine]).unwrap_or(1);
                    let what = format!("{engine} = {hash:?} is no hash of native or elf");
                    return Err(foreign(line, what));
                }
            }
        }
        Self::with(path, text, hashes)
    }

    /// Reads a file, or begins one if there is none.
    pub fn open(path: &Path) -> Result<Self, GoldenError> {
        match Self::read(path) {
            Err(GoldenError::Missing(_)) => Self::with(path, String::new(), Hashes::new()),
            read => read,
        }
    }

    fn with(path: &Path, text: String, hashes: Hashes) -> Result<Self, GoldenError> {
        let folder = path.parent().filter(|folder| *folder != Path::new(""));
        let folder = folder.unwrap_or(Path::new(".")).canonicalize();
        Ok(Self {
            path: path.to_owned(),
            folder: folder.map_err(|source| GoldenError::NotWritten(path.to_owned(), source))?,
            text,
            hashes,
        })
    }

    /// The file's name, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What a scene is called in the file: its place from the file's folder, with `/`.
    pub fn name(&self, scene: &Path) -> Result<String, GoldenError> {
        let no_scene = |source| GoldenError::NoScene(scene.to_owned(), source);
        let scene = scene.canonicalize().map_err(no_scene)?;
        let (own, its) = (self.folder.components(), scene.components());
        let alike = own.clone().zip(its.clone());
        let same = alike.take_while(|(one, other)| one == other).count();
        let up = own.skip(same).map(|_| "..".into());
        let down = its
            .skip(same)
            .map(|part| part.as_os_str().to_string_lossy());
        Ok(up.chain(down).collect::<Vec<_>>().join("/"))
    }

    /// What a run's hash has to do with the golden one of the scene of that name.
    pub fn standing(&self, name: &str, engine: Engine, hash: u64) -> Comparison {
        let golden = self.hashes.get(name).and_then(|of| of.get(engine.name()));
        match golden {
            None => Comparison::Missing,
            Some(golden) if *golden == format!("{hash:016x}") => Comparison::Same,
            Some(golden) => {
                let line = line_of(&self.text, &[name, engine.name()]);
                Comparison::Other(golden.clone(), line)
            }
        }
    }

    /// Takes a hash as the golden one, and gives the one before.
    pub fn renew(&mut self, name: &str, engine: Engine, hash: u64) -> Option<String> {
        self.hashes
            .entry(name.to_owned())
            .or_default()
            .insert(engine.name().to_owned(), format!("{hash:016x}"))
    }

    /// Writes the file.
    pub fn write(&self) -> Result<(), GoldenError> {
        let mut text = HEADER.to_owned();
        for (scene, engines) in &self.hashes {
            text += &format!("[{}]\n", toml::Value::String(scene.clone()));
            for (engine, hash) in engines {
                text += &format!("{engine} = \"{hash}\"\n");
            }
            text.push('\n');
        }
        let written = replace(&self.path, &(text.trim_end().to_owned() + "\n"));
        written.map_err(|source| GoldenError::NotWritten(self.path.clone(), source))
    }
}

/// What to say of a run whose hash is not the golden one; none if it is.
pub fn complaint(standing: &Comparison, hash: u64, golden: &Golden, name: &str) -> Option<String> {
    let path = golden.path().display();
    Some(match standing {
        Comparison::Same => return None,
        Comparison::Missing => {
            format!(
                "golden: {path} has no hash of {name}: look at the run, then hil-sim golden renew"
            )
        }
        Comparison::Other(golden, _) => format!(
            "golden: {hash:016x} is not {golden} of {path}: the run has changed: look at what and why, and if it is meant, hil-sim golden renew"
        ),
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn folder(test: &str) -> PathBuf {
        let path =
            std::env::temp_dir().join(format!("hil-sim-golden-{}-{test}", std::process::id()));
        fs::create_dir_all(path.join("sub")).unwrap();
        path
    }

    #[test]
    fn what_was_renewed_is_the_same_again_wherever_one_stands() {
        let folder = folder("renew");
        let scene = folder.join("sub/a \"b\".toml");
        fs::write(&scene, "").unwrap();
        let path = folder.join("golden.toml");
        let mut golden = Golden::open(&path).unwrap();
        let name = golden.name(&scene).unwrap();
        assert_eq!(name, "sub/a \"b\".toml");
        assert_eq!(
            golden.standing(&name, Engine::Native, 7),
            Comparison::Missing
        );
        assert_eq!(golden.renew(&name, Engine::Native, 7), None);
        golden.write().unwrap();

        let mut golden = Golden::read(&path).unwrap();
        assert_eq!(golden.standing(&name, Engine::Native, 7), Comparison::Same);
        assert_eq!(golden.standing(&name, Engine::Elf, 7), Comparison::Missing);
        let other = golden.standing(&name, Engine::Native, 8);
        assert_eq!(
            other,
            Comparison::Other("0000000000000007".to_owned(), Some(5))
        );
        let complaint = complaint(&other, 8, &golden, &name).unwrap();
        assert!(
            complaint.contains("0000000000000008 is not 0000000000000007"),
            "{complaint}"
        );
        golden.renew(&name, Engine::Elf, 9);
        golden.write().unwrap();
        let golden = Golden::read(&path).unwrap();
        assert_eq!(golden.standing(&name, Engine::Native, 7), Comparison::Same);
        assert_eq!(golden.standing(&name, Engine::Elf, 9), Comparison::Same);

        // From another folder the scene has another name.
        let elsewhere = Golden::open(&folder.join("sub/golden.toml")).unwrap();
        assert_eq!(
            elsewhere.name(&folder.join("golden.toml")).unwrap(),
            "../golden.toml"
        );
        assert_eq!(elsewhere.name(&scene).unwrap(), "a \"b\".toml");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_is_no_such_file_is_refused_with_its_line() {
        let folder = folder("foreign");
        let path = folder.join("golden.toml");
        for (text, want) in [
            ("[\"a.toml\"]\nnative = 7\n", "golden.toml:2: "),
            (
                "[\"a.toml\"]\n\nnative = \"7\"\n",
                "golden.toml:3: native = \"7\" is no hash",
            ),
            (
                "[\"a.toml\"]\nsteam = \"0123456789abcdef\"\n",
                "golden.toml:2: steam",
            ),
            ("[\n", "golden.toml:1: "),
        ] {
            fs::write(&path, text).unwrap();
            let refusal = Golden::read(&path).unwrap_err().to_string();
            assert!(refusal.contains(want), "{refusal}\nwanted {want}");
            assert!(refusal.contains("take it away and make it anew"));
        }
        let missing = Golden::read(&folder.join("none.toml"))
            .unwrap_err()
            .to_string();
        assert!(
            missing.contains("make it with hil-sim golden renew"),
            "{missing}"
        );
        assert!(Golden::open(&folder.join("no/golden.toml")).is_err());
        fs::remove_dir_all(&folder).unwrap();
    }
}
