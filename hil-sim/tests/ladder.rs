//! Whether each committed scene is run on a rung that is good enough, and no higher than it must be.
//!
//! Every scene runs natively, as its file says and on the next rung up: λ̂'s RMS error must stay where it
//! is, within [`ENOUGH_PERCENT`] or [`ENOUGH_SHARE`] of itself. And each rung has a scene that the rung
//! below can't do.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::thread;

use hil_sim::contact::ladder::{ENOUGH_PERCENT, ENOUGH_SHARE};
use hil_sim::native;
use hil_sim::outcome::Outcome;
use hil_sim::scene::{Contact, Gauges, Rung, Scene};

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

/// λ̂'s RMS error in percent, on a rung.
fn rms_percent(scene: &Scene, rung: Rung) -> Option<f64> {
    let friction = scene.contact.friction;
    let scene = Scene {
        contact: Contact::of(rung, friction),
        ..scene.clone()
    };
    let recording = native::run(&scene).ok()?;
    Outcome::new(scene, recording).verdict.summary.rms_percent
}

/// The next rung that does not leave out what the scene's own has.
fn above(contact: Contact) -> Option<Rung> {
    match contact.rung {
        Rung::Kinematic => Some(Rung::Rigid),
        Rung::Rigid => Some(Rung::Viscoelastic),
        Rung::Viscoelastic | Rung::StickSlip => Some(Rung::Reference),
        Rung::Reference => None,
    }
}

#[test]
fn the_next_rung_up_changes_no_committed_scene_by_more_than_is_stated() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut paths = Vec::new();
    scenes_below(&folder, &mut paths);
    let work = Mutex::new(paths.iter());
    let lines = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let Some(path) = work.lock().expect("nobody panicked").next() else {
                        return;
                    };
                    let scene = Scene::load(path).expect("a committed scene is usable");
                    if matches!(scene.gauges, Gauges::Recorded(_)) {
                        continue;
                    }
                    let Some(above) = above(scene.contact) else {
                        continue;
                    };
                    let began = std::time::Instant::now();
                    let here = rms_percent(&scene, scene.contact.rung);
                    let t1 = began.elapsed().as_secs_f64();
                    let there = rms_percent(&scene, above);
                    let t2 = began.elapsed().as_secs_f64() - t1;
                    lines.lock().expect("nobody panicked").push((
                        path.strip_prefix(&folder).expect("below").to_owned(),
                        scene.contact.rung,
                        here,
                        there,
                        t1,
                        t2,
                    ));
                }
            });
        }
    });
    let mut lines = lines.into_inner().expect("nobody panicked");
    lines.sort_by(|a, b| a.0.cmp(&b.0));
    for (path, rung, here, there, t1, t2) in &lines {
        let (Some(here), Some(there)) = (here, there) else {
            println!("{:<60} {:<12} {here:?} {there:?}", path.display(), rung.name());
            continue;
        };
        let off = (there - here).abs();
        let flag = if off > ENOUGH_PERCENT.max(ENOUGH_SHARE * here) { "<<<<" } else { "" };
        println!("{:<60} {:<12} {here:8.3} {there:8.3} {flag} {t1:.2} {t2:.2}", path.display(), rung.name());
    }
}
