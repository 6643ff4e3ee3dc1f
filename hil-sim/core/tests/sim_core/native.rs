//! The native engine as a whole, through the committed scenes.

use std::path::{Path, PathBuf};

use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::native;
use hil_sim_core::scene::fault::{Fault, Kind};
use hil_sim_core::scene::{
    ArmDrive, Contact, Follows, Force, Friction, Gauges, Kinematic, Motion, Scene,
};

/// All but the `estimation` scenes, which have a test of their own.
fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let mut found = Vec::new();
    let mut folders = vec![folder];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && !path.ends_with("estimation") {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "toml") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn every_committed_scene_is_as_it_expects() {
    let scenes = scenes();
    assert!(scenes.len() >= 18, "{scenes:?}");
    let mut failures = Vec::new();
    for path in scenes {
        let scene = Scene::load(&path).unwrap();
        let recording = native::run(&scene).unwrap();
        let outcome = Outcome::new(scene, recording);
        if !outcome.unmet.is_empty() {
            failures.push(format!("{}: {:?}", path.display(), outcome.unmet));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn the_same_scene_and_seed_gives_the_same_hash_and_another_seed_another() {
    for path in scenes() {
        let mut scene = Scene {
            duration_s: 1.0,
            ..Scene::load(&path).unwrap()
        };
        scene.gauges = Gauges::Kinematic(Kinematic {
            snr_db: Some(20.0),
            ..Kinematic::default()
        });
        let first = native::run(&scene).unwrap();
        let again = native::run(&scene).unwrap();
        assert_eq!(first.hash, again.hash);
        assert_eq!(first.scans, again.scans);
        assert_eq!(first.outputs, again.outputs);
        scene.seed += 1;
        assert_ne!(native::run(&scene).unwrap().hash, first.hash);
    }
}

#[test]
fn a_run_records_every_scan_tick_and_estimate_at_its_instant() {
    let recording = native::run(&Scene::constant(2.0, 50.0)).unwrap();
    assert_eq!(recording.scans.len(), 12_000);
    assert_eq!(recording.ticks.len(), 6_000);
    assert_eq!(recording.estimates.len(), 300);
    for (index, scan) in recording.scans.iter().enumerate() {
        assert_eq!(scan.at_ns, index as u64 * 250_000);
    }
    for (index, estimate) in recording.estimates.iter().enumerate() {
        assert_eq!(estimate.estimate.sequence as usize, index);
        // Its last sample ends with the fourth scan of the tenth millisecond.
        assert_eq!(estimate.made_ns, index as u64 * 10_000_000 + 9_750_000);
    }
    // All arrive, but the last, which is still on the wire, and the last of the scene.
    let arrived = recording
        .estimates
        .iter()
        .filter(|e| e.received_ns.is_some())
        .count();
    assert!(arrived >= 299, "{arrived}");
}

#[test]
fn a_link_that_is_down_leaves_the_display_at_zero_volt() {
    let mut scene = Scene::constant(2.0, 50.0);
    scene.link.loss = 1.0;
    let recording = native::run(&scene).unwrap();
    assert!(recording.outputs.is_empty());
    assert!(
        recording
            .estimates
            .iter()
            .all(|estimate| estimate.received_ns.is_none())
    );
}

#[test]
fn after_a_flood_each_estimate_is_matched_with_what_arrived_of_it() {
    let flood = Fault::new(Kind::LinkFlood, 1.0);
    let over_ns = flood.ends_ns().unwrap();
    let scene = Scene {
        duration_s: 2.0,
        faults: vec![flood],
        ..Scene::constant(2.0, 50.0)
    };
    let recording = native::run(&scene).unwrap();
    let arrived: Vec<_> = recording
        .estimates
        .iter()
        .filter_map(|record| Some((record.made_ns, record.received_ns?)))
        .collect();
    // Of nothing between the two but the line, each takes less than a millisecond and a display's tick.
    for &(made_ns, received_ns) in &arrived {
        let took_ns = received_ns - made_ns;
        assert!(took_ns < 1_500_000, "made at {made_ns}, took {took_ns} ns");
    }
    let made_later = |&&(made_ns, _): &&(u64, u64)| made_ns > over_ns + 10_000_000;
    let made = recording.estimates.iter();
    let due = made.filter(|record| (over_ns + 10_000_000..1_990_000_000).contains(&record.made_ns));
    assert!(arrived.iter().filter(made_later).count() >= due.count());
    // Those of the flood were nobody's.
    assert!(recording.arrived.len() > arrived.len() + 100);
}

/// A hand that swings over 3.3 mm, and a fault at 1.7 s.
fn broken(fault: Kind, follows: Follows, snr_db: Option<f64>) -> Outcome {
    swinging(3.3, Fault::new(fault, 1.7), follows, snr_db)
}

/// A hand that swings over `wavelength_mm`; it turns every 0.602 s.
fn swinging(wavelength_mm: f64, fault: Fault, follows: Follows, snr_db: Option<f64>) -> Outcome {
    let scene = Scene {
        motion: Motion::Sinusoid {
            amplitude_mm_s: 70.0,
            frequency_hz: 0.83,
        },
        arm: ArmDrive {
            follows,
            lag_ms: 10.0,
            ..ArmDrive::default()
        },
        gauges: Gauges::Kinematic(Kinematic {
            snr_db,
            ..Kinematic::default()
        }),
        faults: vec![fault],
        duration_s: 5.0,
        ..Scene::constant(wavelength_mm, 50.0)
    };
    let recording = native::run(&scene).unwrap();
    Outcome::new(scene, recording)
}

#[test]
fn an_arm_whose_encoder_breaks_does_not_run_away() {
    // As far as full speed brings it in 50 ms, and what it was behind.
    for (fault, most_mm) in [(Kind::ArmEncoderJump, 1.0), (Kind::ArmEncoderDead, 12.0)] {
        let outcome = broken(fault, Follows::Link, Some(15.0));
        let scans = &outcome.recording.scans;
        let broken = scans.iter().position(|scan| scan.at_ns >= 1_700_000_000);
        let broken_mm = scans[broken.unwrap()].position_mm;
        let away_mm = scans[broken.unwrap()..]
            .iter()
            .map(|scan| (scan.position_mm - broken_mm).abs())
            .fold(0.0, f64::max);
        assert!(away_mm < most_mm, "{fault:?}: {away_mm} mm");
        assert_eq!(outcome.unmet, [""; 0]);
    }
}

#[test]
fn no_wrong_wave_is_felt_where_encoder_or_converter_break_and_the_arm_goes_on() {
    let kinds = [Kind::ArmEncoderDead, Kind::ArmEncoderJump, Kind::AdcStuck];
    for (fault, snr_db) in kinds
        .into_iter()
        .flat_map(|kind| [(kind, None), (kind, Some(15.0))])
    {
        let outcome = broken(fault, Follows::Motion, snr_db);
        assert_eq!(outcome.unmet, [""; 0]);
        assert_eq!(outcome.findings[0].unjudged, [""; 0]);
        let summary = &outcome.verdict.summary;
        assert_eq!(summary.wrong_share, Some(0.0), "{fault:?}");
        assert!(
            summary.valid_share.unwrap() > 0.65,
            "{fault:?}: {summary:?}"
        );
    }
}

#[test]
fn an_estimator_that_begins_shortly_before_a_turn_stands_by_no_other_wave() {
    // The clearest peak of so short a path is somewhere else than the wave.
    for before_turn_ms in (90..130).step_by(2) {
        let at_s = 2.0 / 0.83 - 1e-3 * f64::from(before_turn_ms);
        let begins = Fault::new(Kind::ArmEncoderJump, at_s);
        let outcome = swinging(2.0, begins, Follows::Motion, None);
        let summary = &outcome.verdict.summary;
        assert_eq!(summary.wrong_share, Some(0.0), "{before_turn_ms} ms");
        assert!(summary.valid_share.unwrap() > 0.8, "{summary:?}");
    }
}

#[test]
fn a_force_channel_that_clips_takes_nothing_of_what_guards_against_slips() {
    for (wavelength_mm, speed_mm_s) in [(1.0, 30.0), (4.0, 55.0)] {
        let felt = |n_per_v| {
            let scene = Scene {
                contact: Contact::stick_slip(Friction::Severe),
                gauges: Gauges::Kinematic(Kinematic {
                    snr_db: Some(30.0),
                    ..Kinematic::default()
                }),
                force: Force {
                    present: true,
                    n_per_v,
                    ..Force::default()
                },
                duration_s: 6.0,
                ..Scene::constant(wavelength_mm, speed_mm_s)
            };
            let recording = native::run(&scene).unwrap();
            Outcome::new(scene, recording).verdict.summary
        };
        let sound = felt(1.0);
        assert!(sound.valid_share.unwrap() > 0.9, "{sound:?}");
        assert_eq!(sound.wrong_share, Some(0.0));
        // At 0.05 N/V it is at an end at 0.08 N.
        assert_eq!(felt(0.05).wrong_share, Some(0.0), "{wavelength_mm} mm");
    }
}
