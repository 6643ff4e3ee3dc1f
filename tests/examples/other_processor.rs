//! Runs a scene on the two flashed ELFs with the emulator's own processor and with rsemu's, and says whether they leave
//! the same behind: `cargo run --example other_processor SCENE`, once `./test` has built the ELFs. Some 5 s for each
//! second of the scene. Exit status 1 if they do not.

use std::env;
use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_core::scene::Scene;
use tests::{elves, other_processor};

fn main() -> ExitCode {
    let Some(path) = env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("give a scene file");
        return ExitCode::from(2);
    };
    let scene = match Scene::load(&path) {
        Ok(scene) => scene,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(2);
        }
    };
    let (ours, theirs) = other_processor::runs_on_both(&scene, elves::both());
    let unequal = other_processor::differences(&ours, &theirs);
    let says = if unequal.is_empty() {
        "the same".to_owned()
    } else {
        format!("not the same: {}", unequal.join(", "))
    };
    println!("{}: {says}", path.display());
    for (name, (recording, facts)) in [("rigless", &ours), ("rsemu", &theirs)] {
        println!(
            "{name}: {} and {} instructions, {} estimates, {} outputs",
            facts.sensor_instructions,
            facts.display_instructions,
            recording.estimates.len(),
            recording.outputs.len()
        );
    }
    ExitCode::from(u8::from(!unequal.is_empty()))
}
