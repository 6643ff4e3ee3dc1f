//! Families of scenes: the folders below `scenes/estimation`, each with what the goals say of it in its
//! scenes' `[expect]`.

use std::path::{Path, PathBuf};

use hil_sim_core::scene::{Contact, Gauges, Kinematic, Motion, Scene, SceneError};

use super::bound::Tone;

/// Every family: its folder, and its title in the chart.
const FAMILIES: [(&str, &str); 11] = [
    ("table-1-20-db", "Table I, 20 dB"),
    ("table-1-0-db", "Table I, 0 dB"),
    ("off-grid", "λ = 0.8–5 mm"),
    ("fig7", "Fig. 7: 0.83 Hz to and fro"),
    ("reversals", "reversed at 2 Hz"),
    ("boundary", "boundary 1 → 4 mm"),
    ("slow-fast", "v/λ = 2.5–150 Hz"),
    ("gauge-trouble", "gauges in trouble"),
    ("hum", "hum as large as the signal"),
    ("stick-slip-force", "stick-slip, with force channel"),
    ("stick-slip-blind", "stick-slip, without"),
];

/// The scenes of a folder.
#[derive(Clone, Debug)]
pub struct Family {
    /// The folder's name.
    pub folder: &'static str,
    /// Its title in the chart.
    pub title: &'static str,
    /// In the order of their files' names.
    pub scenes: Vec<Scene>,
}

/// Why the families can't be used.
#[derive(Debug, thiserror::Error)]
pub enum FamilyError {
    /// A folder can't be read.
    #[error(
        "{}: can't be read: give the folder of the families with --scenes, hil-sim/scenes/estimation",
        .0.display()
    )]
    Folder(PathBuf, #[source] std::io::Error),
    /// A folder that no family is made of, or a file among them.
    #[error("{}: is no family: there are {}", .0.display(), FAMILIES.map(|of| of.0).join(", "))]
    Unknown(PathBuf),
    /// A family without a scene.
    #[error("{}: holds no scene: a family needs one .toml file or more", .0.display())]
    Empty(PathBuf),
    /// A scene can't be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Reads all families below `root`, where nothing else may be.
///
/// # Errors
/// If a folder is missing, unknown or empty, or a scene can't be used.
pub fn load(root: &Path) -> Result<Vec<Family>, FamilyError> {
    for path in entries(root)? {
        let name = path.file_name().unwrap_or_default();
        if FAMILIES.iter().all(|(folder, _)| name != *folder) {
            return Err(FamilyError::Unknown(path));
        }
    }
    let load = |(folder, title)| {
        let path = root.join(folder);
        let files = entries(&path)?.into_iter();
        let files = files.filter(|file| file.extension().is_some_and(|ending| ending == "toml"));
        let scenes = files.map(|file| Scene::load(&file));
        let scenes: Vec<Scene> = scenes.collect::<Result<_, _>>()?;
        if scenes.is_empty() {
            return Err(FamilyError::Empty(path));
        }
        Ok(Family {
            folder,
            title,
            scenes,
        })
    };
    FAMILIES.into_iter().map(load).collect()
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, FamilyError> {
    let error = |source| FamilyError::Folder(folder.to_owned(), source);
    let entries = std::fs::read_dir(folder).map_err(error)?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()).map_err(error));
    let mut paths: Vec<PathBuf> = paths.collect::<Result<_, _>>()?;
    paths.sort();
    Ok(paths)
}

impl Family {
    /// The loosest bound on the RMS error that its scenes expect, in percent.
    pub fn goal_percent(&self) -> Option<f64> {
        let scenes = self.scenes.iter();
        let bounds = scenes.filter_map(|scene| scene.expect.wavelength_rms_percent);
        bounds.reduce(f64::max)
    }

    /// The root of the mean square over the scenes of the Cramér–Rao bound in percent, over a window in s
    /// that depends on λ in mm and v in mm/s, each gauge's slope unknown or not. None unless every scene is a steady tone in white
    /// noise on sound gauges, which is what the bound is of.
    pub(super) fn bound_percent(
        &self,
        slope: bool,
        window_s: impl Fn(f64, f64) -> f64,
    ) -> Option<f64> {
        let mut squares = 0.0;
        for scene in &self.scenes {
            let tone = Tone {
                slope,
                ..tone(scene)?
            };
            let window_s = window_s(tone.wavelength_mm, tone.speed_mm_s);
            squares += tone.relative_percent(window_s).powi(2);
        }
        Some((squares / self.scenes.len() as f64).sqrt())
    }
}

/// The tone that a scene is, if it is one.
fn tone(scene: &Scene) -> Option<Tone<'static>> {
    let ([specimen], Motion::Constant { speed_mm_s }, Gauges::Kinematic(kinematic)) =
        (&scene.surface.specimens[..], &scene.motion, &scene.gauges)
    else {
        return None;
    };
    let noise_alone = Kinematic {
        snr_db: kinematic.snr_db,
        ..Kinematic::default()
    };
    let sound = *kinematic == noise_alone
        && scene.surface.irregularity.is_none()
        && scene.contact == Contact::KINEMATIC;
    sound.then_some(Tone {
        wavelength_mm: specimen.wavelength_mm,
        speed_mm_s: *speed_mm_s,
        snr_db: kinematic.snr_db?,
        gauges: &[0, 1, 2, 3, 4],
        slope: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/estimation")
    }

    #[test]
    fn the_bound_is_of_noise_alone() {
        let with = |spoil: fn(&mut Kinematic)| {
            let mut scene = Scene::constant(2.0, 50.0);
            let mut kinematic = Kinematic {
                snr_db: Some(20.0),
                ..Kinematic::default()
            };
            spoil(&mut kinematic);
            scene.gauges = Gauges::Kinematic(kinematic);
            tone(&scene).is_some()
        };
        assert!(with(|_| {}));
        let spoils: [fn(&mut Kinematic); 14] = [
            |gauges| gauges.hum_50_hz = 1.0,
            |gauges| gauges.hum_60_hz = 1.0,
            |gauges| gauges.second_harmonic = 0.1,
            |gauges| gauges.dead[0] = true,
            |gauges| gauges.saturated[0] = true,
            |gauges| gauges.stuck[0] = true,
            |gauges| gauges.noisy[0] = true,
            |gauges| gauges.humming[0] = true,
            |gauges| gauges.pink = 1.0,
            |gauges| gauges.drift = 1.0,
            |gauges| gauges.offset = 1.0,
            |gauges| gauges.skew_us = 100.0,
            |gauges| gauges.snr_db = None,
            |gauges| gauges.hum_off_hz = 0.1,
        ];
        for (number, spoil) in spoils.into_iter().enumerate() {
            assert!(!with(spoil), "{number}");
        }
        let mut worn = Scene::constant(2.0, 50.0);
        worn.surface.irregularity.worn = 0.1;
        assert!(tone(&worn).is_none());
    }

    #[test]
    fn every_committed_scene_belongs_to_a_family_and_has_a_name_of_its_own() {
        let families = load(&root()).unwrap();
        let mut names: Vec<&str> = families
            .iter()
            .flat_map(|family| family.scenes.iter().map(|scene| &*scene.name))
            .collect();
        let files: usize = entries(&root())
            .unwrap()
            .iter()
            .map(|folder| entries(folder).unwrap().len())
            .sum();
        assert_eq!(names.len(), files);
        names.sort();
        names.dedup();
        assert_eq!(names.len(), files);
    }

    #[test]
    fn goals_are_those_of_the_scenes() {
        let families = load(&root()).unwrap();
        let goal = |folder| {
            let family = families.iter().find(|family| family.folder == folder);
            family.and_then(Family::goal_percent)
        };
        assert_eq!(goal("table-1-20-db"), Some(0.05));
        assert_eq!(goal("table-1-0-db"), Some(0.3));
        assert_eq!(goal("boundary"), None);
    }

    #[test]
    fn only_steady_tones_in_white_noise_are_bound() {
        for family in load(&root()).unwrap() {
            let bound = ["table-1-20-db", "table-1-0-db", "off-grid", "slow-fast"];
            let got = family.bound_percent(false, |_, _| 0.08);
            assert_eq!(
                got.is_some(),
                bound.contains(&family.folder),
                "{}",
                family.folder
            );
        }
    }

    #[test]
    fn a_folder_that_is_no_family_is_refused() {
        let error = load(&root().join("..")).unwrap_err();
        assert!(matches!(error, FamilyError::Unknown(_)), "{error}");
    }
}
