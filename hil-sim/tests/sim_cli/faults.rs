//! Faults in scenes, on the native engine: what is expected of a kind comes of it, with no board that
//! could break.

use std::path::Path;

use hil_sim_core::judge::fault::judge;
use hil_sim_core::judge::outcome::{Judgement, Outcome};
use hil_sim_core::native;
use hil_sim_core::scene::Scene;
use hil_sim_core::scene::fault::catalogue::{Class, Needs};
use hil_sim_core::scene::fault::{Fault, Kind, Shows};

use crate::{errors, folder, hil_sim, hil_sim_anywhere, text};

/// The estimator is sure by then.
const AT_S: f64 = 1.0;

fn scene(fault: Fault) -> Scene {
    let watch_s = fault.kind.row().watch_s;
    Scene {
        duration_s: AT_S + watch_s.max(1.2),
        faults: vec![fault],
        ..Scene::constant(2.0, 50.0)
    }
}

#[test]
fn what_needs_no_board_comes_out_as_the_table_says() {
    let mut unmet = Vec::new();
    let kinds = Kind::all().filter(|kind| kind.row().needs == Needs::Nothing);
    for kind in kinds {
        let scene = scene(Fault::new(kind, AT_S));
        let recording = native::run(&scene).unwrap();
        let finding = judge(&scene, &recording).remove(0);
        assert!(finding.was_driving, "{kind:?}");
        if !finding.unmet().is_empty() {
            unmet.push(format!(
                "{}: {:?}, {finding:?}",
                kind.name(),
                finding.unmet()
            ));
        }
        // What fades for good in the scene has faded; what holds has held.
        if kind.row().class == Class::Holds {
            assert_eq!(finding.safe_ns, None, "{kind:?}");
        }
    }
    assert!(unmet.is_empty(), "{unmet:#?}");
}

#[test]
fn what_breaks_a_board_is_refused_with_the_key_and_the_engine_that_can() {
    let kinds = Kind::all().filter(|kind| kind.row().needs == Needs::Boards);
    for kind in kinds {
        let refusal = native::run(&scene(Fault::new(kind, AT_S))).unwrap_err();
        let refusal = refusal.to_string();
        assert!(refusal.contains("fault[0].kind: "), "{refusal}");
        assert!(refusal.contains(kind.name()), "{refusal}");
        assert!(refusal.contains("give --engine elf"), "{refusal}");
    }
}

#[test]
fn a_drifting_sensor_clock_shows_in_its_estimates_and_changes_nothing_else() {
    let mut drift = Fault::new(Kind::ClockDrift, 0.0);
    drift.values[0] = 200.0;
    let scene = scene(drift);
    let recording = native::run(&scene).unwrap();
    let last = recording.estimates.last().unwrap();
    let ahead_ns = last.estimate.instant_us as f64 * 1e3 - last.made_ns as f64;
    // Whole µs.
    let due_ns = last.made_ns as f64 * 200e-6;
    assert!((ahead_ns - due_ns).abs() < 1_001.0, "{ahead_ns} {due_ns}");
    assert!(last.estimate.valid);
}

#[test]
fn the_json_lists_every_fault_in_the_order_of_the_scene() {
    let text = r#"
        duration_s = 2.0
        [surface]
        specimens = [{ wavelength_mm = 2.0 }]
        [[fault]]
        at_s = 1.6
        kind = "hand-encoder-jump"
        [[fault]]
        at_s = 0.5
        kind = "nothing"
    "#;
    let scene = Scene::parse(Path::new("x.toml"), text).unwrap();
    let recording = native::run(&scene).unwrap();
    let outcome = Outcome::new(scene, recording);
    let judgement = outcome.judgement(true);
    let json = serde_json::to_value(hil_sim_studies::output::json::SceneResult::of(
        &judgement,
        &outcome.scene,
    ))
    .unwrap();
    let faults = json["faults"].as_array().unwrap();
    assert_eq!(faults.len(), 2);
    assert_eq!(faults[0]["kind"], "hand-encoder-jump");
    assert_eq!(faults[0]["at_s"], 1.6);
    // One tick, half a millisecond, and the tick that the jump fell into.
    assert!(
        faults[0]["safe_ms"].as_f64().unwrap() <= 1.0,
        "{}",
        faults[0]
    );
    assert!(
        faults[0]["detected_ms"].as_f64().unwrap() <= 1.0,
        "{}",
        faults[0]
    );
    assert_eq!(faults[1]["kind"], "nothing");
}

#[test]
fn a_fault_that_nothing_noticed_is_not_as_the_scene_expects() {
    let scene = scene(Fault::new(Kind::LinkDown, AT_S));
    let recording = native::run(&scene).unwrap();
    let unmet = |recording| {
        Outcome::new(scene.clone(), recording)
            .judgement(false)
            .unmet
    };
    assert_eq!(unmet(recording.clone()), [""; 0]);
    let mut unsaid = recording.clone();
    unsaid.signs.display.clear();
    let lines = unmet(unsaid);
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(lines[0].starts_with("fault[0] link-down: does not say that it holds, Stale, at 49"));
    // Without the hold, the last words would have stood.
    let mut driven = recording;
    let cut_ns = ((AT_S + 0.4) * 1e9) as u64;
    driven.outputs.retain(|output| output.at_ns < cut_ns);
    let lines = unmet(driven);
    assert!(
        lines
            .iter()
            .any(|line| line.starts_with("fault[0] link-down: drives at ")),
        "{lines:?}"
    );
}

#[test]
fn the_list_tells_of_every_kind_and_every_key() {
    let output = hil_sim_anywhere(&["faults"]);
    assert_eq!(output.status.code(), Some(0));
    let list = text(&output.stdout);
    for kind in Kind::all() {
        let row = kind.row();
        let entry = list.split(&format!("\n{}: ", row.name)).nth(1);
        let entry = entry.or_else(|| list.strip_prefix(&format!("{}: ", row.name)));
        let entry = entry.unwrap_or_else(|| panic!("{} is not in the list", row.name));
        let entry = entry.split("\n\n").next().unwrap();
        assert!(entry.contains(row.meaning) && entry.contains(row.injected));
        assert!(entry.contains(row.expected));
        // Such an arm brings no ground on which the display could drive again.
        assert_eq!(
            entry.contains("an arm that its drive moves rests for good"),
            kind.is_of_arm(),
            "{entry}"
        );
        let may_show_later = row.shows == Shows::WhenOver;
        assert_eq!(
            entry.contains("later where it lasts"),
            may_show_later,
            "{entry}"
        );
        let drives = row.shows == Shows::WhileDriving;
        assert_eq!(
            entry.contains("while the display drives"),
            drives,
            "{entry}"
        );
        for key in row.keys {
            assert!(
                entry.contains(&format!("(default {})", key.default)),
                "{entry}"
            );
        }
    }
}

#[test]
fn a_campaign_of_an_unknown_kind_is_refused() {
    let output = hil_sim_anywhere(&["campaign", "--kinds", "panic,gremlin"]);
    assert_eq!(output.status.code(), Some(2));
    let errors = errors(&output);
    assert!(errors.contains("gremlin: no such kind"), "{errors}");
}

#[test]
fn a_campaign_that_would_try_nothing_is_refused() {
    let output = hil_sim_anywhere(&["campaign", "--instants", "0"]);
    assert_eq!(output.status.code(), Some(2));
    let errors = errors(&output);
    assert!(errors.contains("a whole number of 1 or more"), "{errors}");
}

#[test]
fn scenes_that_nobody_thought_of_come_out_as_the_table_says() {
    let folder = folder("fuzz");
    let output = hil_sim(
        &folder,
        &["fuzz", "--seed", "1", "--scenes", "40", "-j", "2"],
    );
    let told = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{told}");
    assert!(told.starts_with("40 scenes with "), "{told}");
    let output = hil_sim(&folder, &["fuzz", "--scenes", "0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(errors(&output).contains("a whole number of 1 or more"));
}

/// What is not as expected of a scene in which nothing is at fault but what the scene breaks, and what is not judged.
fn judged(text: &str) -> (Vec<String>, Vec<String>) {
    let surface = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";
    let scene = Scene::parse(Path::new("x.toml"), &format!("{text}{surface}")).unwrap();
    let judgement = Judgement::of(&scene, false).unwrap();
    let unjudged = judgement.findings.into_iter().flat_map(|f| f.unjudged);
    (judgement.unmet, unjudged.collect())
}

#[test]
fn a_board_that_is_not_at_fault_is_not_blamed() {
    let mut blamed = Vec::new();
    let mut check = |text: String| {
        let (unmet, _) = judged(&text);
        if !unmet.is_empty() {
            blamed.push(format!("{text}{unmet:?}"));
        }
    };
    for kind in Kind::all().filter(|kind| kind.row().needs == Needs::Nothing) {
        let name = kind.name();
        let fault = |at_s: f64| format!("[[fault]]\nat_s = {at_s}\nkind = {name:?}\n");
        // At the end.
        for at_s in [0.6, 1.4, 1.499_999_9] {
            check(format!("duration_s = 1.5\n{}", fault(at_s)));
        }
        // At the start, where there is nothing to replay yet.
        for at_s in [0.0, 0.0004, 0.1, 0.2, 0.3] {
            check(format!("duration_s = 4.0\n{}", fault(at_s)));
        }
        // Nothing is ever driven.
        let silent = "[display]\namplitude_mv = 0\n";
        check(format!("duration_s = 4.0\n{}{silent}", fault(1.0)));
        // The arm stands still with the hand.
        let follows = "[arm]\nfollows = \"link\"\nlag_ms = 50\n";
        check(format!("duration_s = 6.0\n{}{follows}", fault(2.0)));
    }
    // There is nothing so old to replay.
    let replay = "[[fault]]\nat_s = 0.6\nkind = \"link-replay\"\nback_ms = 1000\n";
    check(format!("duration_s = 4.0\n{replay}"));
    // The hand is slow.
    for kind in ["hand-encoder-dead", "adc-stuck"] {
        let fault = format!("[[fault]]\nat_s = 2.0\nkind = {kind:?}\n");
        let slow = "[motion]\nspeed_mm_s = 5.0\n";
        check(format!("duration_s = 6.0\n{fault}{slow}"));
    }
    assert!(blamed.is_empty(), "{blamed:#?}");
}

#[test]
fn what_the_scenes_end_leaves_no_time_for_is_said_on_the_terminal() {
    let path = std::env::temp_dir().join(format!("hil-sim-unjudged-{}.toml", std::process::id()));
    let scene = "duration_s = 1.5\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n\
        [[fault]]\nat_s = 0.6\nkind = \"hand-encoder-dead\"\n";
    std::fs::write(&path, scene).unwrap();
    let output = hil_sim_anywhere(&["run", path.to_str().unwrap()]);
    std::fs::remove_file(&path).unwrap();
    let said = text(&output.stdout);
    let line = "  not judged: fault[0] hand-encoder-dead: whether it shows within 3500 ms: the scene ends before\n";
    assert!(said.contains(line), "{said}");
    assert_eq!(output.status.code(), Some(0), "{said}");
}
