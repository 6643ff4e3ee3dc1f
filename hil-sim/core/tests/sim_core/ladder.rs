//! Whether each committed scene is run on a rung that is good enough, and no higher than it must be.
//!
//! Every scene runs natively, as its file says and on the next rung up: λ̂'s RMS error must stay where it
//! is, within [`ENOUGH_PERCENT`] or [`ENOUGH_SHARE`] of itself. And each rung has a scene that the rung
//! below can't do.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use hil_sim_core::judge::event::{Kind, events};
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::native;
use hil_sim_core::scene::{Contact, ContactModel, Gauges, Scene};
use protocol::Method;

/// Change of λ̂'s RMS error that is no reason for a higher rung, in percent of λ.
const ENOUGH_PERCENT: f64 = 0.25;
/// The same as a share of the error, where that is more.
const ENOUGH_SHARE: f64 = 0.25;
/// The same in percent of λ where the fingertip sticks and slips and no force channel says so: λ̂ then hangs
/// on single hops, and no two models of friction hop alike.
const ENOUGH_BLIND_PERCENT: f64 = 2.5;
/// The same in percent of λ of the paper's count: one impulse more or less in its window is as much and more.
const ENOUGH_COUNT_PERCENT: f64 = 10.0;
/// For so long after a border, in s, nothing is compared.
const BORDER_S: f64 = 0.25;

fn scenes_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the folder can be read")
        .map(|entry| entry.expect("an entry can be read").path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            scenes_below(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            found.push(path);
        }
    }
}

/// λ̂'s RMS error in percent, on a rung, but for the time after each border; none without a valid estimate.
fn rms_percent(scene: &Scene, rung: ContactModel) -> Option<f64> {
    let friction = scene.contact.friction;
    let scene = Scene {
        contact: Contact::of(rung, friction),
        ..scene.clone()
    };
    let recording = native::run(&scene).expect("a committed scene runs on every rung");
    let borders_s: Vec<f64> = events(&scene, &recording)
        .into_iter()
        .filter(|event| matches!(event.kind, Kind::Border { .. }))
        .map(|event| event.t_s)
        .collect();
    let is_settled = |t_s: f64| {
        !borders_s
            .iter()
            .any(|border_s| (0.0..BORDER_S).contains(&(t_s - border_s)))
    };
    let outcome = Outcome::new(scene, recording);
    let errors: Vec<f64> = outcome
        .verdict
        .estimates
        .iter()
        .filter(|estimate| estimate.valid && is_settled(estimate.t_s))
        .filter_map(|estimate| {
            let (found_mm, truth_mm) = (estimate.wavelength_mm?, estimate.truth_mm?);
            Some(100.0 * (found_mm / truth_mm - 1.0))
        })
        .collect();
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    (!errors.is_empty()).then(|| (squares / errors.len() as f64).sqrt())
}

/// The next rung that does not leave out what the scene's own has.
fn above(contact: Contact) -> Option<ContactModel> {
    match contact.rung {
        ContactModel::Kinematic => Some(ContactModel::Rigid),
        ContactModel::Rigid => Some(ContactModel::Viscoelastic),
        ContactModel::Viscoelastic | ContactModel::StickSlip => Some(ContactModel::Reference),
        ContactModel::Reference => None,
    }
}

/// By how much the error may change from one rung to the next, in percent.
fn enough_percent(scene: &Scene, rms_percent: f64) -> f64 {
    let counts = matches!(
        scene.estimator.method,
        Method::Counting | Method::AdaptedCounting
    );
    let floor_percent = if counts {
        ENOUGH_COUNT_PERCENT
    } else if scene.contact.friction.is_some() && !scene.force.present {
        ENOUGH_BLIND_PERCENT
    } else {
        ENOUGH_PERCENT
    };
    floor_percent.max(ENOUGH_SHARE * rms_percent)
}

/// Calls `judge` with every scene that has a contact model, on two threads.
fn with_every_scene(judge: impl Fn(&Path, &Scene) + Sync) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let mut paths = Vec::new();
    scenes_below(&folder, &mut paths);
    assert!(paths.len() > 100, "only {} scenes", paths.len());
    let work = Mutex::new(paths.into_iter());
    let next = || work.lock().expect("nobody panicked").next();
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(path) = next() {
                    let scene = Scene::load(&path).expect("a committed scene is usable");
                    if matches!(scene.gauges, Gauges::Kinematic(_)) {
                        judge(&path, &scene);
                    }
                }
            });
        }
    });
}

#[test]
fn the_next_rung_up_changes_no_committed_scene_by_more_than_is_stated() {
    let judged = AtomicUsize::new(0);
    with_every_scene(|path, scene| {
        let Some(above) = above(scene.contact) else {
            return;
        };
        // A scene without an estimate has no error that could change.
        let (Some(here), Some(there)) = (
            rms_percent(scene, scene.contact.rung),
            rms_percent(scene, above),
        ) else {
            return;
        };
        judged.fetch_add(1, Ordering::Relaxed);
        assert!(
            (there - here).abs() <= enough_percent(scene, here),
            "{}: {here} % on \"{}\", {there} % on \"{}\"",
            path.display(),
            scene.contact.rung.name(),
            above.name(),
        );
    });
    assert!(judged.into_inner() > 100);
}

#[test]
fn each_rung_has_a_scene_that_the_rung_below_does_not_do() {
    for (file, below) in [
        ("ladder/second-harmonic", ContactModel::Kinematic),
        ("ladder/shaking", ContactModel::Rigid),
        ("ladder/sticky", ContactModel::Viscoelastic),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenes/{file}.toml"));
        let scene = Scene::load(&path).expect("a committed scene is usable");
        assert!(scene.contact.rung > below, "{file}");
        assert!(scene.contact_reason.is_some(), "{file} is left to \"auto\"");
        let here = rms_percent(&scene, scene.contact.rung).expect("it is estimated");
        let without_friction = Scene {
            contact: Contact::of(below, None),
            ..scene.clone()
        };
        // No estimate at all is further off than any.
        let simpler = rms_percent(&without_friction, below).unwrap_or(f64::INFINITY);
        assert!(
            (simpler - here).abs() > enough_percent(&scene, here),
            "{file}: {here} % on \"{}\", {simpler} % on \"{}\"",
            scene.contact.rung.name(),
            below.name(),
        );
    }
}
