//! What is refused, and with which words.

use std::path::Path;

use super::*;

mod display;
mod fault;
mod recorded;

const SURFACE: &str = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";

/// The text of the refusal of a scene that stands at `scenes/x.toml`.
fn refusal(text: &str) -> String {
    match Scene::parse(Path::new("scenes/x.toml"), text) {
        Ok(scene) => panic!("taken: {scene:?}"),
        Err(error) => error.to_string(),
    }
}

/// The refusal of a scene that is sound but for `section`, which starts at line 3.
fn refusal_of(section: &str) -> String {
    refusal(&format!("{SURFACE}{section}"))
}

#[test]
fn every_key_of_the_contract_parses() {
    let scene = Scene::parse(
        Path::new("x.toml"),
        r#"
        name = "boundary-1-4"
        seed = 7
        duration_s = 3.0
        [surface]
        specimens = [
          { wavelength_mm = 1.0, length_mm = 60.0 },
          { wavelength_mm = 4.0, length_mm = 200.0 },
        ]
        start_mm = 0.0
        profile = "trapezoid"
        [motion]
        kind = "constant"
        speed_mm_s = 50.0
        [arm]
        follows = "motion"
        lag_ms = 0.0
        encoder_um = 50
        [contact]
        model = "auto"
        friction = "strong"
        [gauges]
        snr_db = 20.0
        hum_50_hz = 0.0
        dead = []
        saturated = []
        tangential = true
        tangential_n_per_v = 0.5
        stiffness_n_per_m = 800
        second_harmonic = 0.15
        stuck = [0]
        noisy = [1]
        humming = [2]
        trouble_from_s = 1
        trouble_for_s = 0.5
        resonance_hz = 180
        resonance_damping = 0.2
        pink = 0.1
        drift = 0.3
        offset = 5
        skew_us = -250
        [link]
        delay_ms = 0.0
        jitter_ms = 0.0
        loss = 0.0
        reorder = 0.0
        corrupt = 0.0
        [estimator]
        method = "crossings"
        window_ms = 60
        counted_gauge = 1
        gauges = [0, 1, 4]
        travel_wavelengths = 1.5
        candidates = 20
        stiffness = "estimated"
        [display]
        mode = "travelling"
        [expect]
        wavelength_rms_percent = 1.0
        wrong_share_max = 0.001
        "#,
    )
    .unwrap();
    assert_eq!(scene.name, "boundary-1-4");
    assert_eq!(scene.seed, 7);
    let Gauges::Kinematic(gauges) = scene.gauges else {
        panic!("not kinematic")
    };
    assert_eq!(gauges.snr_db, Some(20.0));
    assert_eq!(
        gauges,
        Kinematic {
            snr_db: Some(20.0),
            second_harmonic: 0.15,
            stuck: [true, false, false, false, false],
            noisy: [false, true, false, false, false],
            humming: [false, false, true, false, false],
            trouble_from_s: 1.0,
            trouble_for_s: Some(0.5),
            resonance: Some(Resonance {
                hz: 180.0,
                damping: 0.2
            }),
            pink: 0.1,
            drift: 0.3,
            offset: 5.0,
            skew_us: -250.0,
            ..Kinematic::default()
        }
    );
    assert_eq!(
        scene.force,
        Force {
            present: true,
            n_per_v: 0.5,
            stiffness_n_per_m: 800.0
        }
    );
    assert_eq!(scene.contact, Contact::StickSlip(Friction::Strong));
    assert_eq!(scene.arm.encoder_um, 50);
    assert_eq!(scene.surface.specimens.len(), 2);
    assert_eq!(scene.surface.specimens[1].length_mm, f64::INFINITY);
    assert_eq!(scene.display.configuration.mode, protocol::Mode::Travelling);
    assert_eq!(scene.expect.wavelength_rms_percent, Some(1.0));
    assert_eq!(scene.expect.wrong_share_max, Some(0.001));
    assert_eq!(
        scene.estimator,
        Estimator {
            method: Method::Crossings,
            window_ms: 60,
            counted_gauge: 1,
            gauges: [true, true, false, false, true],
            travel_percent: 150,
            candidates: 20,
            stiffness: Stiffness::Estimated,
        }
    );
}

#[test]
fn what_the_estimator_section_says_is_what_the_sensor_is_configured_to() {
    let scene = Scene::parse(
        Path::new("x.toml"),
        &format!(
            "{SURFACE}[estimator]\nmethod = \"counting-adapted\"\nwindow_ms = 60\n\
             counted_gauge = 1\ngauges = [0, 1, 4]\ntravel_wavelengths = 1.5\ncandidates = 20\n"
        ),
    )
    .unwrap();
    let configuration = scene.sensor_configuration();
    assert_eq!(
        configuration,
        SensorConfiguration {
            method: Method::AdaptedCounting,
            window_ms: 60,
            counted_gauge: 1,
            gauges: 0b1_0011,
            bank_travel_percent: 150,
            bank_candidates: 20,
            ..SensorConfiguration::DEFAULT
        }
    );
    // Both ends of every range that a scene may give are in the sensor's.
    for [travel, candidates, window_ms, gauge] in
        [["0.3", "12", "10", "0"], ["3", "24", "200", "4"]]
    {
        let scene = Scene::parse(
            Path::new("x.toml"),
            &format!(
                "{SURFACE}[estimator]\ntravel_wavelengths = {travel}\ncandidates = {candidates}\n\
                 window_ms = {window_ms}\ncounted_gauge = {gauge}\ngauges = [{gauge}]\n"
            ),
        );
        assert_eq!(scene.unwrap().sensor_configuration().check(), Ok(()));
    }
}

#[test]
fn the_force_channel_is_the_sensors_as_the_gauges_section_has_it() {
    let configuration = |section: &str| {
        let text = format!("{SURFACE}{section}");
        let scene = Scene::parse(Path::new("x.toml"), &text).unwrap();
        let configuration = scene.sensor_configuration();
        assert_eq!(configuration.check(), Ok(()), "{section}");
        (
            configuration.force_channel,
            configuration.force_mn_per_v,
            configuration.stiffness_n_per_m,
        )
    };
    let wired = "[gauges]\ntangential = true\n";
    assert_eq!(configuration(wired), (true, 1_000, 400));
    let other = format!("{wired}tangential_n_per_v = 1.5\nstiffness_n_per_m = 600\n");
    assert_eq!(configuration(&other), (true, 1_500, 600));
    let estimated = format!("{other}[estimator]\nstiffness = \"estimated\"\n");
    assert_eq!(configuration(&estimated), (true, 1_500, 0));
    // Both ends of what a scene may give.
    for (n_per_v, n_per_m) in [("0.05", "10"), ("20", "10_000")] {
        configuration(&format!(
            "{wired}tangential_n_per_v = {n_per_v}\nstiffness_n_per_m = {n_per_m}\n"
        ));
    }
}

#[test]
fn every_method_has_its_word_and_the_default_is_the_boards() {
    for (word, method) in [
        ("default", SensorConfiguration::DEFAULT.method),
        ("bank", Method::Bank),
        ("crossings", Method::Crossings),
        ("counting", Method::Counting),
        ("counting-adapted", Method::AdaptedCounting),
    ] {
        let text = format!("{SURFACE}[estimator]\nmethod = \"{word}\"");
        let scene = Scene::parse(Path::new("x.toml"), &text).unwrap();
        assert_eq!(scene.sensor_configuration().method, method);
        assert!(word == "default" || scene.estimator.method_name() == word);
    }
}

#[test]
fn all_but_the_specimens_has_a_default() {
    let scene = Scene::parse(Path::new("some/scene.toml"), SURFACE).unwrap();
    assert_eq!(
        (scene.name.as_str(), scene.seed, scene.duration_s),
        ("scene", 1, 3.0)
    );
    assert!(matches!(scene.surface.profile, Profile::Trapezoid));
    assert!(matches!(
        scene.motion,
        Motion::Constant { speed_mm_s: 50.0 }
    ));
    assert_eq!(
        scene.arm,
        ArmDrive {
            follows: Follows::Motion,
            lag_ms: 0.0,
            encoder_um: 5,
        }
    );
    assert_eq!(scene.contact, Contact::Kinematic);
    assert_eq!(
        scene.force,
        Force {
            present: false,
            n_per_v: 1.0,
            stiffness_n_per_m: 400.0,
        }
    );
    assert!(matches!(scene.gauges, Gauges::Kinematic(k) if k == Kinematic::default()));
    assert_eq!(scene.link, Link::default());
    assert_eq!(scene.estimator, Estimator::default());
    assert_eq!(scene.sensor_configuration(), SensorConfiguration::DEFAULT);
    assert_eq!(
        scene.expect,
        Expect {
            mean_tolerance_mm: 0.03,
            ..Expect::default()
        }
    );
}

#[test]
fn friction_decides_the_contact_where_it_is_left_open() {
    let contact = |section: &str| {
        let text = format!("{SURFACE}[contact]\n{section}");
        Scene::parse(Path::new("x.toml"), &text).unwrap().contact
    };
    assert_eq!(contact(""), Contact::Kinematic);
    assert_eq!(contact("model = \"kinematic\""), Contact::Kinematic);
    for (word, friction) in [
        ("mild", Friction::Mild),
        ("strong", Friction::Strong),
        ("severe", Friction::Severe),
    ] {
        let given = format!("friction = \"{word}\"");
        assert_eq!(contact(&given), Contact::StickSlip(friction));
        let both = format!("{given}\nmodel = \"stick-slip\"");
        assert_eq!(contact(&both), Contact::StickSlip(friction));
    }
}

#[test]
fn whole_numbers_do_where_numbers_are_asked_for() {
    let text = "duration_s = 1_000_000\n";
    assert!(refusal(text).contains("is not a duration"));
    let scene = Scene::parse(
        Path::new("x.toml"),
        "duration_s = 2\n[surface]\nspecimens = [{ wavelength_mm = 0x2 }]",
    );
    let scene = scene.unwrap();
    assert_eq!(
        (scene.duration_s, scene.surface.specimens[0].wavelength_mm),
        (2.0, 2.0)
    );
}

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
            "[estimator]\ntravel_wavelengths = 0.29",
            "x.toml:4: estimator.travel_wavelengths: 0.29 is not a travel to average over",
        ),
        (
            "[estimator]\ncandidates = 25",
            "x.toml:4: estimator.candidates: 25 is out of range",
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
fn what_this_version_does_not_build_is_refused_as_such() {
    let refusal = refusal_of("[contact]\nmodel = \"rigid\"");
    for part in [
        "x.toml:4: contact.model: \"rigid\"",
        "known but not built in this version",
    ] {
        assert!(refusal.contains(part), "{refusal}\nwanted {part}");
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
