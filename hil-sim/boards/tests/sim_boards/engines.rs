//! Both engines make the same of a recording, wherever their scans fall between its rows: the native engine's
//! fall where the scene's clock says, the emulated board's when its firmware has started. Needs the two ELFs,
//! as ./test builds them.

use std::convert::Infallible;
use std::env;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use hil_sim_boards::{Firmware, Firmwares, sensor_alone};
use hil_sim_core::judge::Verdict;
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::native;
use hil_sim_core::run::batch;
use hil_sim_core::run::recording::Recording;
use hil_sim_core::scene::{Gauges, Scene};
use protocol::{Estimate, Role};
use stranger::{RECORDED_HZ, Stranger};

#[path = "../../../core/tests/sim_core/estimation/stranger.rs"]
mod stranger;

/// How far apart the engines' valid shares may be.
const VALID_APART: f64 = 0.02;
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
const DURATION_OF_STROKES_S: f64 = 18.0;
/// At 10 dB a few bursts of noise pass for stick-slip; which ones hangs on where the scans fall, and moves the valid share
/// of one recording by ± 0.03. So the engines are compared over several, of one noise each.
const RECORDINGS_OF_STROKES: u64 = 4;

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

/// Recordings at either rate, quiet and noisy, with rows where the scene's instants are and halfway between. Those of one
/// name differ by their noise.
fn recordings() -> Vec<(String, Vec<Scene>)> {
    let mut scenes = Vec::new();
    for rows_per_s in RECORDED_HZ {
        for (name, arm_mm, snr_db, duration_s, count) in [
            ("steady", at_47 as fn(f64) -> f64, 20.0, DURATION_S, 1),
            ("noisy", at_47, 3.0, DURATION_S, 1),
            (
                "strokes",
                strokes,
                10.0,
                DURATION_OF_STROKES_S,
                RECORDINGS_OF_STROKES,
            ),
        ] {
            for rows_early in [0.0, 0.5] {
                let name = format!("engines-{name}-{rows_per_s}-hz-{rows_early}-early");
                let recorded = (1..=count).map(|seed| {
                    let stranger = Stranger {
                        surface: vec![(WAVELENGTH_MM, 0.0)],
                        arm_mm,
                        snr_db,
                        rows_per_s,
                        rows_early,
                        duration_s,
                        seed,
                        ..Stranger::default()
                    };
                    stranger.scene(&format!("{name}-{seed}"))
                });
                scenes.push((name.clone(), recorded.collect()));
            }
        }
    }
    scenes
}

/// The committed scenes that play recorded gauges.
fn committed(folder: &Path, scenes: &mut Vec<(String, Vec<Scene>)>) {
    for entry in folder.read_dir().unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            committed(&path, scenes);
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            let scene = Scene::load(&path).unwrap();
            if matches!(scene.gauges, Gauges::Recorded(_)) {
                scenes.push((path.display().to_string(), vec![scene]));
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

/// The mean valid share of some runs, and their valid estimates' RMS error in %, if there are any.
struct Made {
    valid_share: f64,
    rms_percent: Option<f64>,
}

impl Made {
    fn of(verdicts: &[Verdict]) -> Self {
        let squares: Vec<f64> = verdicts
            .iter()
            .flat_map(|verdict| &verdict.estimates)
            .filter(|estimate| estimate.valid && estimate.t_s >= FROM_S)
            .filter_map(|estimate| Some(estimate.wavelength_mm? / estimate.truth_mm? - 1.0))
            .map(|error| error * error)
            .collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        let valid_shares = verdicts
            .iter()
            .map(|verdict| verdict.summary.valid_share.unwrap_or(0.0));
        Self {
            valid_share: valid_shares.sum::<f64>() / verdicts.len() as f64,
            rms_percent: (!squares.is_empty()).then(|| 100.0 * mean.sqrt()),
        }
    }
}

/// Whether both engines say the same.
fn agree(native: &Made, elf: &Made) -> bool {
    let valid_apart = native.valid_share - elf.valid_share;
    let rms_agree = match (native.rms_percent, elf.rms_percent) {
        (Some(native), Some(elf)) => {
            (native - elf).abs() <= (RMS_APART * native.max(elf)).max(RMS_ROUNDED_PERCENT)
        }
        // Whether there is any valid estimate at all is told by the shares.
        _ => true,
    };
    valid_apart.abs() <= VALID_APART && rms_agree
}

#[test]
fn both_engines_make_the_same_of_every_recording() {
    let firmware = firmware(Role::Sensor);
    let mut scenes = recordings();
    committed(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes"),
        &mut scenes,
    );
    let each: Vec<&Scene> = scenes.iter().flat_map(|(_, scenes)| scenes).collect();
    let judged = |scene: &Scene, recording| Outcome::new(scene.clone(), recording).verdict;
    let Ok(verdicts) = batch::on_all_cores(&each, |scene| {
        let native = native::run(scene).unwrap();
        let elf = sensor_alone::run(scene, &firmware).unwrap();
        Ok::<_, Infallible>((judged(scene, native), judged(scene, elf)))
    });
    let (native, elf): (Vec<Verdict>, Vec<Verdict>) = verdicts.into_iter().unzip();
    let (mut native, mut elf) = (&native[..], &elf[..]);
    let mut disagreements = Vec::new();
    println!("{:40} valid: native, elf; rms %: native, elf", "");
    for (name, scenes) in &scenes {
        let made = |of: &mut &[Verdict]| Made::of(of.split_off(..scenes.len()).unwrap());
        let (native, elf) = (made(&mut native), made(&mut elf));
        let line = format!(
            "{name:40} {:.3} {:.3}  {:.3} {:.3}",
            native.valid_share,
            elf.valid_share,
            native.rms_percent.unwrap_or(f64::NAN),
            elf.rms_percent.unwrap_or(f64::NAN),
        );
        println!("{line}");
        if !agree(&native, &elf) {
            disagreements.push(line);
        }
    }
    assert!(disagreements.is_empty(), "{disagreements:#?}");
}

#[test]
fn a_sensor_alone_says_of_a_recording_what_it_says_beside_a_display() {
    let scene = Stranger {
        surface: vec![(WAVELENGTH_MM, 0.0)],
        arm_mm: at_47,
        snr_db: 3.0,
        duration_s: 2.0,
        ..Stranger::default()
    }
    .scene("alone");
    let firmwares = Firmwares {
        sensor: firmware(Role::Sensor),
        display: firmware(Role::Display),
    };
    let alone = sensor_alone::run(&scene, &firmwares.sensor).unwrap();
    let (both, _) = hil_sim_boards::run(&scene, &firmwares).unwrap();
    assert_eq!(alone.scans, both.scans);
    assert!(alone.ticks.is_empty() && alone.outputs.is_empty());
    let said = |recording: &Recording| {
        let records = recording.estimates.iter();
        records.map(|record| record.estimate).collect::<Vec<_>>()
    };
    let (alone, both) = (said(&alone), said(&both));
    // Which one comes first hangs on when the other end has said Hello.
    let first = alone[0].sequence.max(both[0].sequence);
    let known = |said: Vec<Estimate>| {
        let known = said.into_iter().filter(|one| one.sequence >= first);
        known.collect::<Vec<_>>()
    };
    let (alone, both) = (known(alone), known(both));
    assert!(alone.len() > 150, "{}", alone.len());
    assert_eq!(alone, both);
}
