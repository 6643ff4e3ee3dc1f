//! Both engines make the same of a recording, wherever their scans fall between its rows: the native engine's
//! fall where the scene's clock says, the emulated board's when its firmware has started. Needs the two ELFs,
//! as ./test builds them.

use std::env;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use hil_sim_boards::{Firmware, Firmwares};
use hil_sim_core::judge::Verdict;
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::native;
use hil_sim_core::scene::{Gauges, Scene};
use protocol::Role;
use stranger::{RECORDED_HZ, Stranger};

#[path = "../../../core/tests/sim_core/estimation/stranger.rs"]
mod stranger;

/// How far apart the engines' valid shares may be.
const VALID_APART: f64 = 0.02;
/// The same of strokes in rows of 4 kHz, which are known to be further apart: 0.034 over 40 s, the native engine's being the
/// lower one. Over 18 s it is 0.019 or 0.021.
const STROKES_AT_4_KHZ_APART: f64 = 0.04;
/// How far apart their RMS errors may be, relative to the larger one.
const RMS_APART: f64 = 0.1;
/// Or else, in %: both engines round places to 5 µm, each in its own way. Rounded by a deviation of 5 µm / √12 at
/// both ends, a travel of four λ of 2.3 mm is 2.2e-4 off.
const RMS_ROUNDED_PERCENT: f64 = 0.022;
/// Errors count from here on, as `hil-sim jury --folder` judges recordings: before it the waves are few, and one
/// estimate sooner or later is a tenth of the RMS.
const FROM_S: f64 = 1.0;
/// Long enough for the start, one estimate sooner or later, to be a few thousandths of it.
const DURATION_S: f64 = 12.0;
/// Around the turns an estimate hangs on where in a stroke it comes: many of them are needed.
const DURATION_OF_STROKES_S: f64 = 40.0;

/// λ in mm. At [`at_47`] ten milliseconds are 0.204 of it: the estimates meet every phase of the ridges alike,
/// whenever an engine's first one comes.
const WAVELENGTH_MM: f64 = 2.3;

fn at_47(t_s: f64) -> f64 {
    47.0 * t_s
}

/// v = 60 sin(2π 0.7 t) mm/s.
fn strokes(t_s: f64) -> f64 {
    60.0 / (TAU * 0.7) * (1.0 - (TAU * 0.7 * t_s).cos())
}

/// Recordings at either rate, quiet and noisy, with rows where the scene's instants are and halfway between.
fn recordings() -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for rows_per_s in RECORDED_HZ {
        for (name, arm_mm, snr_db, duration_s) in [
            ("steady", at_47 as fn(f64) -> f64, 20.0, DURATION_S),
            ("noisy", at_47, 3.0, DURATION_S),
            ("strokes", strokes, 10.0, DURATION_OF_STROKES_S),
        ] {
            for rows_early in [0.0, 0.5] {
                let stranger = Stranger {
                    surface: vec![(WAVELENGTH_MM, 0.0)],
                    arm_mm,
                    snr_db,
                    rows_per_s,
                    rows_early,
                    duration_s,
                    ..Stranger::default()
                };
                let name = format!("engines-{name}-{rows_per_s}-hz-{rows_early}-early");
                scenes.push((name.clone(), stranger.scene(&name)));
            }
        }
    }
    scenes
}

/// The committed scenes that play recorded gauges.
fn committed(folder: &Path, scenes: &mut Vec<(String, Scene)>) {
    for entry in folder.read_dir().unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            committed(&path, scenes);
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            let scene = Scene::load(&path).unwrap();
            if matches!(scene.gauges, Gauges::Recorded(_)) {
                scenes.push((path.display().to_string(), scene));
            }
        }
    }
}

fn firmware(role: Role) -> Firmware {
    let folder = env::var_os("RIDGELINK_ELVES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/thumbv7em-none-eabihf/release"),
        PathBuf::from,
    );
    let path = folder.join(format!("firmware-{}", role.name()));
    Firmware::read(&path, role).unwrap_or_else(|error| panic!("{error}"))
}

/// The valid share, and the valid estimates' RMS error in %, if there are any.
struct Made {
    valid_share: f64,
    rms_percent: Option<f64>,
}

impl Made {
    fn of(verdict: &Verdict) -> Self {
        let squares: Vec<f64> = verdict
            .estimates
            .iter()
            .filter(|estimate| estimate.valid && estimate.t_s >= FROM_S)
            .filter_map(|estimate| Some(estimate.wavelength_mm? / estimate.truth_mm? - 1.0))
            .map(|error| error * error)
            .collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        Self {
            valid_share: verdict.summary.valid_share.unwrap_or(0.0),
            rms_percent: (!squares.is_empty()).then(|| 100.0 * mean.sqrt()),
        }
    }
}

/// Whether both engines say the same.
fn agree(name: &str, native: &Made, elf: &Made) -> bool {
    let valid_apart = native.valid_share - elf.valid_share;
    let rms_agree = match (native.rms_percent, elf.rms_percent) {
        (Some(native), Some(elf)) => {
            (native - elf).abs() <= (RMS_APART * native.max(elf)).max(RMS_ROUNDED_PERCENT)
        }
        // Whether there is any valid estimate at all is told by the shares.
        _ => true,
    };
    let most_apart = if name.starts_with("engines-strokes-4000") {
        STROKES_AT_4_KHZ_APART
    } else {
        VALID_APART
    };
    valid_apart.abs() <= most_apart && rms_agree
}

#[test]
fn both_engines_make_the_same_of_every_recording() {
    let firmwares = Firmwares {
        sensor: firmware(Role::Sensor),
        display: firmware(Role::Display),
    };
    let mut scenes = recordings();
    committed(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes"),
        &mut scenes,
    );
    let mut disagreements = Vec::new();
    println!("{:40} valid: native, elf; rms %: native, elf", "");
    for (name, scene) in scenes {
        let made = |recording| Made::of(&Outcome::new(scene.clone(), recording).verdict);
        let native = made(native::run(&scene).unwrap());
        let elf = made(hil_sim_boards::run(&scene, &firmwares).unwrap().0);
        let line = format!(
            "{name:40} {:.3} {:.3}  {:.3} {:.3}",
            native.valid_share,
            elf.valid_share,
            native.rms_percent.unwrap_or(f64::NAN),
            elf.rms_percent.unwrap_or(f64::NAN),
        );
        println!("{line}");
        if !agree(&name, &native, &elf) {
            disagreements.push(line);
        }
    }
    assert!(disagreements.is_empty(), "{disagreements:#?}");
}
