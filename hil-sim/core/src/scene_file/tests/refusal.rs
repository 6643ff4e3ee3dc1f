//! What is refused, and with which words.

use std::path::Path;

use super::{refusal, refusal_of};
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
fn impossible_values_are_refused_at_their_line_and_key() {
    for (section, want) in [
        (
            "random = -0.1",
            "x.toml:3: surface.random: -0.1 is not a disturbance",
        ),
        (
            "second_wave = 1.1",
            "x.toml:3: surface.second_wave: 1.1 is not a share",
        ),
        (
            "second_wave = 0.5\nsecond_ratio = 0",
            "x.toml:4: surface.second_ratio: 0 is not a ratio of two wavelengths: give a number from 0.1 to 10",
        ),
        (
            "second_ratio = 0.5",
            "x.toml:3: surface.second_ratio: there is no second wave: give second_wave too",
        ),
        (
            "worn = 0.95",
            "x.toml:3: surface.worn: 0.95 is not a share of missing ridges: give a number from 0 to 0.9",
        ),
        (
            "[motion]\nspeed_mm_s = 1000.1",
            "x.toml:4: motion.speed_mm_s: 1000.1 is not a speed",
        ),
        (
            "[motion]\nspeed_mm_s = nan",
            "x.toml:4: motion.speed_mm_s: nan is not a speed",
        ),
        (
            "[motion]\nspeed_mm_s = 1e999",
            "x.toml:4: motion.speed_mm_s: 1e999 is not a speed",
        ),
        (
            "[motion]\nkind = \"sinusoid\"\namplitude_mm_s = -1\nfrequency_hz = 1",
            "x.toml:5: motion.amplitude_mm_s: -1 is not",
        ),
        (
            "[motion]\nkind = \"sinusoid\"\namplitude_mm_s = 70\nfrequency_hz = 0",
            "x.toml:6: motion.frequency_hz: 0 is not a frequency",
        ),
        (
            "[motion]\nkind = \"sinusoid\"\namplitude_mm_s = 1000\nfrequency_hz = 1e-3",
            "x.toml:6: motion.frequency_hz: at this amplitude a stroke is out of reach",
        ),
        (
            "[arm]\nfollows = \"link\"\nlag_ms = -0.1",
            "x.toml:5: arm.lag_ms: -0.1 is not a lag",
        ),
        (
            "[arm]\nlag_ms = 5",
            "x.toml:4: arm.lag_ms: an arm that follows \"motion\" has no lag",
        ),
        (
            "[link]\nloss = 1.01",
            "x.toml:4: link.loss: 1.01 is not a share: give a number from 0 to 1",
        ),
        (
            "[link]\nreorder = -0.1",
            "x.toml:4: link.reorder: -0.1 is not a share",
        ),
        (
            "[link]\n\ncorrupt = inf",
            "x.toml:5: link.corrupt: inf is not a share",
        ),
        (
            "[link]\ndelay_ms = -1",
            "x.toml:4: link.delay_ms: -1 is not a delay",
        ),
        (
            "[gauges]\nsnr_db = -inf",
            "x.toml:4: gauges.snr_db: -inf is not a signal-to-noise ratio",
        ),
        (
            "[gauges]\nhum_50_hz = -1",
            "x.toml:4: gauges.hum_50_hz: -1 is not",
        ),
        (
            "[gauges]\nhum_60_hz = 11",
            "x.toml:4: gauges.hum_60_hz: 11 is not",
        ),
        (
            "[gauges]\nhum_off_hz = 2.5",
            "x.toml:4: gauges.hum_off_hz: 2.5 is not",
        ),
        (
            "[gauges]\ndead = [0, 5]",
            "x.toml:4: gauges.dead[1]: 5 is not a gauge: the gauges are 0 to 4",
        ),
        (
            "[gauges]\ndead = [-1]",
            "x.toml:4: gauges.dead[0]: -1 is not a gauge",
        ),
        (
            "[gauges]\nsaturated = [1,\n1]",
            "x.toml:5: gauges.saturated[1]: 1 is named twice",
        ),
        (
            "[gauges]\ndead = [1.5]",
            "x.toml:4: gauges.dead[0]: 1.5 is no gauge number",
        ),
        (
            "[gauges]\ndead = [3]\nsaturated = [3]",
            "x.toml:5: gauges.saturated: gauge 3 is dead already",
        ),
        (
            "[gauges]\nstuck = [2, 3]\nhumming = [3]",
            "x.toml:5: gauges.humming: gauge 3 is stuck already",
        ),
        (
            "[gauges]\nnoisy = [0]\nsaturated = [0]",
            "x.toml:4: gauges.noisy: gauge 0 is saturated already",
        ),
        (
            "[gauges]\ntrouble_from_s = 1",
            "x.toml:4: gauges.trouble_from_s: there is no trouble",
        ),
        (
            "[gauges]\ndead = [1]\ntrouble_for_s = 0",
            "x.toml:5: gauges.trouble_for_s: no trouble lasts 0 s",
        ),
        (
            "[gauges]\ndead = [1]\ntrouble_from_s = -1",
            "x.toml:5: gauges.trouble_from_s: -1 is not an instant",
        ),
        (
            "[gauges]\ndead = [1]\ntrouble_from_s = 3",
            "x.toml:5: gauges.trouble_from_s: comes after the scene's end at 3 s: give less",
        ),
        (
            "[gauges]\nresonance_damping = 0.1",
            "x.toml:4: gauges.resonance_damping: has nothing to damp",
        ),
        (
            "[gauges]\nresonance_hz = 180\nresonance_damping = 1",
            "x.toml:5: gauges.resonance_damping: 1 is not a damping ratio",
        ),
        (
            "[gauges]\nresonance_hz = 5",
            "x.toml:4: gauges.resonance_hz: 5 is not a resonance",
        ),
        (
            "[gauges]\npink = -0.1",
            "x.toml:4: gauges.pink: -0.1 is not a disturbance",
        ),
        (
            "[gauges]\ndrift = 11",
            "x.toml:4: gauges.drift: 11 is not a disturbance",
        ),
        (
            "[gauges]\noffset = -1",
            "x.toml:4: gauges.offset: -1 is not a disturbance",
        ),
        (
            "[gauges]\nskew_us = 5001",
            "x.toml:4: gauges.skew_us: 5001 is not a skew",
        ),
        (
            "[gauges]\ntangential_n_per_v = 0",
            "x.toml:4: gauges.tangential_n_per_v: 0 is not a scale",
        ),
        (
            "[gauges]\nstiffness_n_per_m = 1",
            "x.toml:4: gauges.stiffness_n_per_m: 1 is not a fingertip's stiffness",
        ),
        (
            "[arm]\nencoder_um = 7",
            "x.toml:4: arm.encoder_um: 7 is not an encoder's resolution: give a whole multiple of 5",
        ),
        (
            "[arm]\nencoder_um = 505",
            "x.toml:4: arm.encoder_um: 505 is not an encoder's resolution",
        ),
        (
            "[contact]\nmodel = \"kinematic\"\nfriction = \"mild\"",
            "x.toml:5: contact.friction: a \"kinematic\" contact knows no friction",
        ),
        (
            "[contact]\nmodel = \"stick-slip\"",
            "x.toml:3: contact.friction: without friction nothing sticks",
        ),
        (
            "[contact]\nmodel = \"stick-slip\"\nfriction = \"none\"",
            "x.toml:5: contact.friction: without friction nothing sticks",
        ),
        (
            "[estimator]\nwindow_ms = 9",
            "x.toml:4: estimator.window_ms: 9 is out of range",
        ),
        (
            "[estimator]\ngauges = []",
            "x.toml:4: estimator.gauges: there are none: name one or more of 0 to 4",
        ),
        (
            "[estimator]\ngauges = [0, 7]",
            "x.toml:4: estimator.gauges[1]: 7 is not a gauge",
        ),
        (
            "[estimator]\ncounted_gauge = 5",
            "x.toml:4: estimator.counted_gauge: 5 is out of range",
        ),
        (
            "[estimator]\nwaves = 9",
            "x.toml:4: estimator.waves: 9 is out of range: give a whole number from 2 to 8",
        ),
        (
            "[estimator]\nvalid_percent = 49",
            "x.toml:4: estimator.valid_percent: 49 is out of range",
        ),
        (
            "[estimator]\nstiffness = \"guessed\"",
            "x.toml:4: estimator.stiffness: \"guessed\" is unknown",
        ),
        (
            "[estimator]\nstiffness = \"estimated\"",
            "x.toml:4: estimator.stiffness: cannot be estimated without the force channel",
        ),
        (
            "[expect]\nwrong_share_max = 1.1",
            "x.toml:4: expect.wrong_share_max: 1.1 is not a share",
        ),
        (
            "[expect]\nfelt_right_share_min = 1.1",
            "x.toml:4: expect.felt_right_share_min: 1.1 is not a share",
        ),
        (
            "[expect]\nfelt_wrong_share_max = -0.1",
            "x.toml:4: expect.felt_wrong_share_max: -0.1 is not a share",
        ),
        (
            "[expect]\nwavelength_rms_percent = 0",
            "x.toml:4: expect.wavelength_rms_percent: 0 is not a bound",
        ),
        (
            "[expect]\nmean_tolerance_mm = 0.1",
            "x.toml:4: expect.mean_tolerance_mm: has nothing to bound",
        ),
    ] {
        let refusal = refusal_of(section);
        assert!(refusal.contains(want), "{refusal}\nwanted {want}");
    }
    for (text, want) in [
        ("seed = -1", "x.toml:1: seed: -1 is out of range"),
        (
            "duration_s = 0",
            "x.toml:1: duration_s: 0 is not a duration: give a time above 0 in s",
        ),
        (
            "duration_s = -3.0",
            "x.toml:1: duration_s: -3.0 is not a duration",
        ),
        (
            "name = \"a/b\"",
            "x.toml:1: name: \"a/b\" cannot name a file",
        ),
        ("name = \"..\"", "x.toml:1: name: \"..\" cannot name a file"),
        ("name = \"\"", "x.toml:1: name: \"\" cannot name a file"),
        ("", "x.toml:1: surface.specimens: there are none"),
        (
            "[surface]\nspecimens = []",
            "x.toml:2: surface.specimens: there are none",
        ),
        (
            "[surface]\nspecimens = [{ length_mm = 3 }]",
            "x.toml:2: surface.specimens[0].wavelength_mm: is missing",
        ),
        (
            "[surface]\nspecimens = [{ wavelength_mm = 1 }, { wavelength_mm = 2 }]",
            "x.toml:2: surface.specimens[0].length_mm: is missing",
        ),
        (
            "[surface]\nspecimens = [{ wavelength_mm = 1, length_mm = 0 }, { wavelength_mm = 2 }]",
            "x.toml:2: surface.specimens[0].length_mm: 0 is not a length",
        ),
    ] {
        let refusal = refusal(text);
        assert!(refusal.contains(want), "{refusal}\nwanted {want}");
    }
}

#[test]
fn unknown_keys_are_refused_with_those_that_there_are() {
    for (section, want) in [
        (
            "[motion]\nspeed = 5",
            "x.toml:4: motion.speed: no such key here with kind = \"constant\"",
        ),
        (
            "[motion]\namplitude_mm_s = 5",
            "x.toml:4: motion.amplitude_mm_s: no such key here",
        ),
        ("[surfaces]\nx = 1", "x.toml:3: surfaces: no such key here"),
        (
            "[link]\nlost = 0.1",
            "there are delay_ms, jitter_ms, loss, reorder, corrupt",
        ),
        (
            "[expect]\nrms = 1",
            "x.toml:4: expect.rms: no such key here",
        ),
    ] {
        let refusal = refusal_of(section);
        assert!(refusal.contains(want), "{refusal}\nwanted {want}");
    }
    let text = "[surface]\nspecimens = [{ wavelength_mm = 1, wavelenght = 2 }]";
    assert!(refusal(text).contains("x.toml:2: surface.specimens[0].wavelenght: no such key here"));
}

#[test]
fn wrong_types_are_refused() {
    for (section, want) in [
        (
            "[motion]\nspeed_mm_s = \"fast\"",
            "x.toml:4: motion.speed_mm_s: holds a text: give a number",
        ),
        (
            "[motion]\nkind = 3",
            "x.toml:4: motion.kind: holds a whole number: give a text in quotes",
        ),
        (
            "[gauges]\ntangential = 1",
            "x.toml:4: gauges.tangential: holds a whole number: give true or false",
        ),
        (
            "[gauges]\ndead = 1",
            "x.toml:4: gauges.dead: holds a whole number: give a list of gauge numbers",
        ),
        (
            "[estimator]\nwindow_ms = 80.5",
            "x.toml:4: estimator.window_ms: holds a number: give a whole number",
        ),
        (
            "[expect]\nmean_mm = [1]",
            "x.toml:4: expect.mean_mm: holds a list: give a number",
        ),
        (
            "[[motion]]\nkind = \"constant\"",
            "x.toml:3: motion: holds a list: give a table",
        ),
    ] {
        let refusal = refusal_of(section);
        assert!(refusal.contains(want), "{refusal}\nwanted {want}");
    }
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
    for (section, parts) in [
        (
            "friction = \"mild\"\nmodel = \"rigid\"",
            &["contact.friction", "a \"rigid\" contact knows no friction"][..],
        ),
        (
            "model = \"stick-slip\"",
            &["contact.friction", "without friction nothing sticks"],
        ),
        (
            "model = \"magic\"",
            &["contact.model", "\"magic\" is unknown", "\"viscoelastic\""],
        ),
        (
            "friction = \"strong\"\nintegrator = \"euler\"\nstep_us = 100",
            &[
                "x.toml:6: contact.step_us",
                "errors grow with \"euler\"",
                "µs: give less",
            ],
        ),
        (
            "friction = \"mild\"\nintegrator = \"euler\"\nstep_us = 100",
            &["it bears 29.7 µs: give less"],
        ),
        (
            "friction = \"strong\"\nintegrator = \"rk4\"\nstep_us = 1000",
            &["contact.step_us", "250 (a scan)"],
        ),
        (
            "friction = \"strong\"\nstep_us = 10",
            &["contact.step_us", "an \"exact\" solution has no steps"],
        ),
        (
            "friction = \"strong\"\nintegrator = \"adaptive\"\nstep_us = 10",
            &["contact.step_us", "chooses its own steps"],
        ),
        (
            "integrator = \"rk4\"",
            &["contact.integrator", "there is nothing to integrate"],
        ),
        (
            "model = \"reference\"\nintegrator = \"rk4\"",
            &["contact.integrator", "the reference has its own"],
        ),
    ] {
        let refusal = refusal_of(&format!("[contact]\n{section}"));
        for part in parts {
            assert!(refusal.contains(part), "{refusal}\nwanted {part}");
        }
    }
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
