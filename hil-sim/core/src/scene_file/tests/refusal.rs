//! What is refused, and with which words.

use std::path::Path;

use super::{Folder, SURFACE, assert_refused, refusal, refusal_of};
use crate::scene::Scene;

#[test]
fn a_refusal_says_file_line_key_and_what_to_do() {
    let text = "name = \"x\"\n[surface]\nspecimens = [\n  { wavelength_mm = 1.0, length_mm = 3 },\n  { wavelength_mm = -1.0 },\n]\n";
    assert_eq!(
        refusal(text),
        "scenes/x.toml:5: surface.specimens[1].wavelength_mm: -1.0 is not a wavelength: \
         give a length above 0 in mm (0.01 to 100)"
    );
}

#[test]
fn a_key_that_stands_twice_is_named() {
    for (text, want) in [
        (
            "seed = 1\nseed = 2\n",
            "scenes/x.toml:2: seed: duplicate key",
        ),
        (
            "[link]\nloss = 0\n[link]\n",
            "scenes/x.toml:3: link: duplicate key",
        ),
        (
            "[link]\nloss = 0\n[gauges]\ndead = [1]\ndead = [2]\n",
            "scenes/x.toml:5: gauges.dead: duplicate key",
        ),
        (
            "[link]\n[gauges] # five\ndead = [\n[1]\n]\ndead = [2]\n",
            "scenes/x.toml:6: gauges.dead: duplicate key",
        ),
    ] {
        let refusal = refusal(text);
        assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
    }
}

#[test]
fn impossible_values_are_refused_at_their_line_and_key() {
    assert_refused(
        refusal_of,
        r#"
        random = -0.1 => x.toml:3: surface.random: -0.1 is not a disturbance
        second_wave = 1.1 => x.toml:3: surface.second_wave: 1.1 is not a share
        second_wave = 0.5; second_ratio = 0 => x.toml:4: surface.second_ratio: 0 is not a ratio of two wavelengths: give a number from 0.1 to 10
        second_ratio = 0.5 => x.toml:3: surface.second_ratio: there is no second wave: give second_wave too
        worn = 0.95 => x.toml:3: surface.worn: 0.95 is not a share of missing ridges: give a number from 0 to 0.9
        [motion]; speed_mm_s = 1000.1 => x.toml:4: motion.speed_mm_s: 1000.1 is not a speed
        [motion]; speed_mm_s = nan => x.toml:4: motion.speed_mm_s: nan is not a speed
        [motion]; speed_mm_s = 1e999 => x.toml:4: motion.speed_mm_s: 1e999 is not a speed
        [motion]; kind = "sinusoid"; amplitude_mm_s = -1; frequency_hz = 1 => x.toml:5: motion.amplitude_mm_s: -1 is not
        [motion]; kind = "sinusoid"; amplitude_mm_s = 70; frequency_hz = 0 => x.toml:6: motion.frequency_hz: 0 is not a frequency
        [motion]; kind = "sinusoid"; amplitude_mm_s = 1000; frequency_hz = 1e-3 => x.toml:6: motion.frequency_hz: at this amplitude a stroke is out of reach
        [arm]; follows = "link"; lag_ms = -0.1 => x.toml:5: arm.lag_ms: -0.1 is not a lag
        [arm]; lag_ms = 5 => x.toml:4: arm.lag_ms: an arm that follows "motion" has no lag
        [link]; loss = 1.01 => x.toml:4: link.loss: 1.01 is not a share: give a number from 0 to 1
        [link]; reorder = -0.1 => x.toml:4: link.reorder: -0.1 is not a share
        [link]; ; corrupt = inf => x.toml:5: link.corrupt: inf is not a share
        [link]; delay_ms = -1 => x.toml:4: link.delay_ms: -1 is not a delay
        [gauges]; snr_db = -inf => x.toml:4: gauges.snr_db: -inf is not a signal-to-noise ratio
        [gauges]; hum_50_hz = -1 => x.toml:4: gauges.hum_50_hz: -1 is not
        [gauges]; hum_60_hz = 11 => x.toml:4: gauges.hum_60_hz: 11 is not
        [gauges]; hum_off_hz = 2.5 => x.toml:4: gauges.hum_off_hz: 2.5 is not
        [gauges]; dead = [0, 5] => x.toml:4: gauges.dead[1]: 5 is not a gauge: the gauges are 0 to 4
        [gauges]; dead = [-1] => x.toml:4: gauges.dead[0]: -1 is not a gauge
        [gauges]; saturated = [1,; 1] => x.toml:5: gauges.saturated[1]: 1 is named twice
        [gauges]; dead = [1.5] => x.toml:4: gauges.dead[0]: 1.5 is no gauge number
        [gauges]; dead = [3]; saturated = [3] => x.toml:5: gauges.saturated: gauge 3 is dead already
        [gauges]; stuck = [2, 3]; humming = [3] => x.toml:5: gauges.humming: gauge 3 is stuck already
        [gauges]; noisy = [0]; saturated = [0] => x.toml:4: gauges.noisy: gauge 0 is saturated already
        [gauges]; trouble_from_s = 1 => x.toml:4: gauges.trouble_from_s: there is no trouble
        [gauges]; dead = [1]; trouble_for_s = 0 => x.toml:5: gauges.trouble_for_s: no trouble lasts 0 s
        [gauges]; dead = [1]; trouble_from_s = -1 => x.toml:5: gauges.trouble_from_s: -1 is not an instant
        [gauges]; dead = [1]; trouble_from_s = 3 => x.toml:5: gauges.trouble_from_s: comes after the scene's end at 3 s: give less
        [gauges]; resonance_damping = 0.1 => x.toml:4: gauges.resonance_damping: has nothing to damp
        [gauges]; resonance_hz = 180; resonance_damping = 1 => x.toml:5: gauges.resonance_damping: 1 is not a damping ratio
        [gauges]; resonance_hz = 5 => x.toml:4: gauges.resonance_hz: 5 is not a resonance
        [gauges]; pink = -0.1 => x.toml:4: gauges.pink: -0.1 is not a disturbance
        [gauges]; drift = 11 => x.toml:4: gauges.drift: 11 is not a disturbance
        [gauges]; offset = -1 => x.toml:4: gauges.offset: -1 is not a disturbance
        [gauges]; skew_us = 5001 => x.toml:4: gauges.skew_us: 5001 is not a skew
        [gauges]; tangential_n_per_v = 0 => x.toml:4: gauges.tangential_n_per_v: 0 is not a scale
        [gauges]; stiffness_n_per_m = 1 => x.toml:4: gauges.stiffness_n_per_m: 1 is not a fingertip's stiffness
        [arm]; encoder_um = 7 => x.toml:4: arm.encoder_um: 7 is not an encoder's resolution: give a whole multiple of 5
        [arm]; encoder_um = 505 => x.toml:4: arm.encoder_um: 505 is not an encoder's resolution
        [contact]; model = "kinematic"; friction = "mild" => x.toml:5: contact.friction: a "kinematic" contact knows no friction
        [contact]; model = "stick-slip" => x.toml:3: contact.friction: without friction nothing sticks
        [contact]; model = "stick-slip"; friction = "none" => x.toml:5: contact.friction: without friction nothing sticks
        [estimator]; window_ms = 9 => x.toml:4: estimator.window_ms: 9 is out of range
        [estimator]; gauges = [] => x.toml:4: estimator.gauges: there are none: name one or more of 0 to 4
        [estimator]; gauges = [0, 7] => x.toml:4: estimator.gauges[1]: 7 is not a gauge
        [estimator]; counted_gauge = 5 => x.toml:4: estimator.counted_gauge: 5 is out of range
        [estimator]; waves = 9 => x.toml:4: estimator.waves: 9 is out of range: give a whole number from 2 to 8
        [estimator]; valid_percent = 49 => x.toml:4: estimator.valid_percent: 49 is out of range
        [estimator]; stiffness = "guessed" => x.toml:4: estimator.stiffness: "guessed" is unknown
        [estimator]; stiffness = "estimated" => x.toml:4: estimator.stiffness: cannot be estimated without the force channel
        [expect]; wrong_share_max = 1.1 => x.toml:4: expect.wrong_share_max: 1.1 is not a share
        [expect]; felt_right_share_min = 1.1 => x.toml:4: expect.felt_right_share_min: 1.1 is not a share
        [expect]; felt_wrong_share_max = -0.1 => x.toml:4: expect.felt_wrong_share_max: -0.1 is not a share
        [expect]; wavelength_rms_percent = 0 => x.toml:4: expect.wavelength_rms_percent: 0 is not a bound
        [expect]; mean_tolerance_mm = 0.1 => x.toml:4: expect.mean_tolerance_mm: has nothing to bound
    "#,
    );
    assert_refused(
        refusal,
        r#"
        seed = -1 => x.toml:1: seed: -1 is out of range
        duration_s = 0 => x.toml:1: duration_s: 0 is not a duration: give a time above 0 in s
        duration_s = -3.0 => x.toml:1: duration_s: -3.0 is not a duration
        name = "a/b" => x.toml:1: name: "a/b" cannot name a file
        name = ".." => x.toml:1: name: ".." cannot name a file
        name = "" => x.toml:1: name: "" cannot name a file
        => x.toml:1: surface.specimens: there are none
        [surface]; specimens = [] => x.toml:2: surface.specimens: there are none
        [surface]; specimens = [{ length_mm = 3 }] => x.toml:2: surface.specimens[0].wavelength_mm: is missing
        [surface]; specimens = [{ wavelength_mm = 1 }, { wavelength_mm = 2 }] => x.toml:2: surface.specimens[0].length_mm: is missing
        [surface]; specimens = [{ wavelength_mm = 1, length_mm = 0 }, { wavelength_mm = 2 }] => x.toml:2: surface.specimens[0].length_mm: 0 is not a length
    "#,
    );
}

#[test]
fn unknown_keys_are_refused_with_those_that_there_are() {
    assert_refused(
        refusal_of,
        r#"
        [motion]; speed = 5 => x.toml:4: motion.speed: no such key here with kind = "constant"
        [motion]; amplitude_mm_s = 5 => x.toml:4: motion.amplitude_mm_s: no such key here
        [surfaces]; x = 1 => x.toml:3: surfaces: no such key here
        [link]; lost = 0.1 => there are delay_ms, jitter_ms, loss, reorder, corrupt
        [expect]; rms = 1 => x.toml:4: expect.rms: no such key here
    "#,
    );
    let text = "[surface]\nspecimens = [{ wavelength_mm = 1, wavelenght = 2 }]";
    assert!(refusal(text).contains("x.toml:2: surface.specimens[0].wavelenght: no such key here"));
}

#[test]
fn wrong_types_are_refused() {
    assert_refused(
        refusal_of,
        r#"
        [motion]; speed_mm_s = "fast" => x.toml:4: motion.speed_mm_s: holds a text: give a number
        [motion]; kind = 3 => x.toml:4: motion.kind: holds a whole number: give a text in quotes
        [gauges]; tangential = 1 => x.toml:4: gauges.tangential: holds a whole number: give true or false
        [gauges]; dead = 1 => x.toml:4: gauges.dead: holds a whole number: give a list of gauge numbers
        [estimator]; window_ms = 80.5 => x.toml:4: estimator.window_ms: holds a number: give a whole number
        [expect]; mean_mm = [1] => x.toml:4: expect.mean_mm: holds a list: give a number
        [[motion]]; kind = "constant" => x.toml:3: motion: holds a list: give a table
    "#,
    );
    assert!(
        refusal("surface = 1").contains("x.toml:1: surface: holds a whole number: give a table")
    );
    let text = "[surface]\nspecimens = [1.0]";
    assert!(refusal(text).contains("x.toml:2: surface.specimens[0]: holds a number: give a table"));
}

#[test]
fn broken_toml_is_refused_at_its_line() {
    assert!(refusal("name = \"x\"\nseed = \n").starts_with("scenes/x.toml:2: "));
    assert!(refusal("seed = 1\nseed = 2\n").starts_with("scenes/x.toml:2: "));
}

#[test]
fn a_contact_that_cannot_be_solved_so_is_refused_with_what_can() {
    assert_refused(
        |section| refusal_of(&format!("[contact]\n{section}")),
        r#"
        friction = "mild"; model = "rigid" => contact.friction … a "rigid" contact knows no friction
        model = "stick-slip" => contact.friction … without friction nothing sticks
        model = "magic" => contact.model … "magic" is unknown … "viscoelastic"
        friction = "strong"; integrator = "euler"; step_us = 100 => x.toml:6: contact.step_us … errors grow with "euler" … µs: give less
        friction = "mild"; integrator = "euler"; step_us = 100 => it bears 29.7 µs: give less
        friction = "strong"; integrator = "rk4"; step_us = 1000 => contact.step_us … 250 (a scan)
        friction = "strong"; step_us = 10 => contact.step_us … an "exact" solution has no steps
        friction = "strong"; integrator = "adaptive"; step_us = 10 => contact.step_us … chooses its own steps
        integrator = "rk4" => contact.integrator … there is nothing to integrate
        model = "reference"; integrator = "rk4" => contact.integrator … the reference has its own
    "#,
    );
    assert!(refusal_of("[estimator]\nmethod = \"magic\"").contains("\"magic\" is unknown"));
}

#[test]
fn a_missing_file_is_refused() {
    let missing = Scene::load(Path::new("no/such/scene.toml"))
        .unwrap_err()
        .to_string();
    assert!(
        missing.starts_with("no/such/scene.toml: cannot be read: "),
        "{missing}"
    );
    let refusal = refusal_of("[motion]\nkind = \"recorded\"\nfile = \"gone.csv\"");
    assert!(
        refusal.starts_with("scenes/x.toml:5: motion.file: scenes"),
        "{refusal}"
    );
    assert!(refusal.contains("gone.csv cannot be read: "), "{refusal}");
    assert!(
        refusal_of("[motion]\nkind = \"recorded\"").contains("x.toml:3: motion.file: is missing")
    );
}

#[test]
fn control_characters_of_a_scene_do_not_reach_the_terminal() {
    let text = "\"a\\u001b[31m\\nb\" = 1\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";
    let told = refusal(text);
    let want = "scenes/x.toml:1: a\\u{1b}[31m\\nb: no such key here";
    assert!(told.starts_with(want), "{told}");
    let word = "[surface]\nprofile = \"\\u0007\"\nspecimens = [{ wavelength_mm = 2.0 }]\n";
    let told = refusal(word);
    assert!(told.contains("\"\\u{7}\" is unknown"), "{told}");
}

#[test]
fn an_empty_name_of_a_file_is_called_empty() {
    assert_refused(
        refusal_of,
        r#"
        [gauges]; kind = "recorded"; file = "" => x.toml:5: gauges.file: is empty: give a CSV file with the columns t_s,g0,g1,g2,g3,g4, or a WAV or MCAP file
        [motion]; kind = "recorded"; file = "" => x.toml:5: motion.file: is empty: give a CSV file with the columns t_s,x_mm
        profile = "recorded"; file = "" => x.toml:4: surface.file: is empty: give a CSV file with the columns x_mm,height
        "#,
    );
}

#[test]
fn a_refusal_repeats_no_more_of_a_scene_than_can_be_read() {
    let long = "7".repeat(50_000);
    for section in [
        format!("{long} = 1\n"),
        format!("a{long} = 1\na{long} = 1\n"),
        format!("random = {long}\n"),
        format!("random = {long}.0\n"),
        format!("profile = \"{long}\"\n"),
        format!("profile = \"recorded\"\nfile = \"{long}\"\n"),
        format!("[estimator]\nwindow_ms = {long}\n"),
        format!("[gauges]\ndead = [{long}]\n"),
        format!("[[fault]]\nat_s = 1\nkind = \"{long}\"\n"),
    ] {
        let refusal = refusal_of(&section);
        assert!(refusal.contains('…') && refusal.len() < 1_500, "{refusal}");
    }
    let refusal = refusal(&format!("name = \"{long}\"\n{SURFACE}"));
    assert!(refusal.contains('…') && refusal.len() < 500, "{refusal}");
    let folder = Folder::new("long-names", SURFACE);
    let section = format!(
        "[gauges]\nkind = \"recorded\"\nfile = \"data.csv\"\nchannels = [0, 0, 0, 0, \"{long}\"]\n"
    );
    let refusal = folder.refusal(&section, "data.csv", &format!("t_s,{long}x\n0,1\n"));
    assert!(refusal.contains('…') && refusal.len() < 1_500, "{refusal}");
}
