//! What a scene may say, what it means, and what is refused.

mod display;
mod fault;
mod recorded;
mod refusal;

use std::fs;
use std::path::{Path, PathBuf};

use protocol::{Method, SensorConfiguration};

use crate::scene::*;

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

/// A folder of its own for a test's files, removed at the end.
pub(super) struct Folder {
    path: PathBuf,
    /// What its scenes begin with.
    head: &'static str,
}

impl Folder {
    pub(super) fn new(test: &str, head: &'static str) -> Self {
        let path = std::env::temp_dir().join(format!("hil-sim-{}-{test}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self { path, head }
    }

    /// Loads a scene with `section`, beside a file.
    pub(super) fn load(
        &self,
        section: &str,
        file: &str,
        bytes: &(impl AsRef<[u8]> + ?Sized),
    ) -> Result<Scene, SceneError> {
        fs::write(self.path.join(file), bytes).unwrap();
        let scene = self.path.join("x.toml");
        fs::write(&scene, format!("{}{section}", self.head)).unwrap();
        Scene::load(&scene)
    }

    /// The refusal, without the folder's name.
    pub(super) fn refusal(
        &self,
        section: &str,
        file: &str,
        bytes: &(impl AsRef<[u8]> + ?Sized),
    ) -> String {
        let error = self.load(section, file, bytes).unwrap_err().to_string();
        let folder = format!("{}{}", self.path.display(), std::path::MAIN_SEPARATOR);
        error.replace(&folder, "")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.path).ok();
    }
}

/// The rows of a table of "what is given => the words of its refusal", in which "; " is a line break of what is given.
pub(super) fn refusals(table: &str) -> impl Iterator<Item = (String, &str)> {
    let rows = table.lines().filter(|row| !row.trim().is_empty());
    rows.map(|row| {
        let (given, words) = row.split_once("=> ").expect("every row has an arrow");
        (given.trim().replace("; ", "\n"), words)
    })
}

/// Every row of such a table, held against what is refused; " … " stands between words that are apart.
fn assert_refused(refusal: impl Fn(&str) -> String, table: &str) {
    for (given, words) in refusals(table) {
        let refusal = refusal(&given);
        for want in words.split(" … ") {
            assert!(refusal.contains(want), "{refusal}\nwanted {want}");
        }
    }
}

#[test]
fn an_irregular_surface_has_the_scenes_seed_and_a_grating_is_none() {
    let text = format!(
        "seed = 9\n{SURFACE}random = 0.4\nsecond_wave = 0.5\nsecond_ratio = 1.7\nworn = 0.2\n"
    );
    let scene = Scene::parse(Path::new("x.toml"), &text).unwrap();
    assert_eq!(
        scene.surface.irregularity,
        Irregularity {
            random: 0.4,
            second_wave: 0.5,
            second_ratio: 1.7,
            worn: 0.2,
            seed: 9,
        }
    );
    let zeros = format!("{SURFACE}random = 0\nsecond_wave = 0.0\nworn = 0\n");
    for text in [SURFACE, &zeros] {
        let scene = Scene::parse(Path::new("x.toml"), text).unwrap();
        assert!(scene.surface.irregularity.is_none());
    }
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
        waves = 5
        valid_percent = 95
        stiffness = "estimated"
        [display]
        mode = "travelling"
        [expect]
        wavelength_rms_percent = 1.0
        wrong_share_max = 0.001
        felt_right_share_min = 0.85
        felt_wrong_share_max = 0.01
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
    assert_eq!(scene.contact, Contact::stick_slip(Friction::Strong));
    assert_eq!(scene.arm.encoder_um, 50);
    assert_eq!(scene.surface.specimens.len(), 2);
    assert_eq!(scene.surface.specimens[1].length_mm, f64::INFINITY);
    assert_eq!(scene.display.configuration.mode, protocol::Mode::Travelling);
    assert_eq!(scene.expect.wavelength_rms_percent, Some(1.0));
    assert_eq!(scene.expect.wrong_share_max, Some(0.001));
    assert_eq!(scene.expect.felt_right_share_min, Some(0.85));
    assert_eq!(scene.expect.felt_wrong_share_max, Some(0.01));
    assert_eq!(
        scene.estimator,
        Estimator {
            method: Method::Crossings,
            window_ms: 60,
            counted_gauge: 1,
            gauges: [true, true, false, false, true],
            waves: 5,
            valid_percent: 95,
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
             counted_gauge = 1\ngauges = [0, 1, 4]\nwaves = 5\nvalid_percent = 95\n"
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
            waves: 5,
            valid_percent: 95,
            ..SensorConfiguration::DEFAULT
        }
    );
    // Both ends of every range that a scene may give are in the sensor's.
    for [waves, percent, window_ms, gauge] in [["2", "50", "10", "0"], ["8", "99", "200", "4"]] {
        let scene = Scene::parse(
            Path::new("x.toml"),
            &format!(
                "{SURFACE}[estimator]\nwaves = {waves}\nvalid_percent = {percent}\n\
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
        ("spectrum", Method::Spectrum),
        ("crossings", Method::Crossings),
        ("counting", Method::Counting),
        ("counting-adapted", Method::AdaptedCounting),
    ] {
        let text = format!("{SURFACE}[estimator]\nmethod = \"{word}\"");
        let scene = Scene::parse(Path::new("x.toml"), &text).unwrap();
        assert_eq!(scene.sensor_configuration().method, method);
        assert!(word == "default" || scene.estimator.method.name() == word);
    }
}

#[test]
fn a_scene_of_the_banks_runs_by_its_successor_and_is_told_so_where_it_says_it() {
    let text = format!(
        "{SURFACE}[estimator]\nmethod = \"bank\"\ntravel_wavelengths = 0.8\ncandidates = 20\n"
    );
    let scene = Scene::parse(Path::new("scenes/x.toml"), &text).unwrap();
    assert_eq!(scene.estimator, Estimator::default());
    let notes: Vec<String> = scene.notes.iter().map(ToString::to_string).collect();
    let knob = "no longer does anything: take it out; \"spectrum\" has waves and valid_percent";
    assert_eq!(
        notes,
        [
            "scenes/x.toml:4: estimator.method: method = \"bank\" is now \"spectrum\", its successor"
                .to_owned(),
            format!("scenes/x.toml:5: estimator.travel_wavelengths: {knob}"),
            format!("scenes/x.toml:6: estimator.candidates: {knob}"),
        ]
    );
    let new = format!("{SURFACE}[estimator]\nmethod = \"spectrum\"\n");
    let scene = Scene::parse(Path::new("x.toml"), &new).unwrap();
    assert_eq!(scene.notes, []);
}

#[test]
fn a_count_of_a_gauge_that_is_left_out_is_told() {
    let notes = |estimator: &str| {
        let text = format!("{SURFACE}[estimator]\n{estimator}");
        let scene = Scene::parse(Path::new("x.toml"), &text).unwrap();
        scene.notes.iter().map(ToString::to_string).collect()
    };
    let told: Vec<String> = notes("method = \"counting\"\ngauges = [0, 1]\ncounted_gauge = 2\n");
    assert_eq!(
        told,
        [
            "x.toml:6: estimator.counted_gauge: gauge 2 is not among gauges: its count is never valid"
        ]
    );
    for sound in [
        "method = \"counting\"\ngauges = [0, 2]\n",
        "gauges = [0, 1]\n",
    ] {
        assert_eq!(notes(sound), [] as [String; 0]);
    }
}

#[test]
fn old_words_are_not_offered_to_those_who_mistake_a_word() {
    let text = refusal_of("[estimator]\nmethod = \"bunk\"");
    assert!(
        text.contains("give \"default\" or \"spectrum\" or \"crossings\""),
        "{text}"
    );
    assert!(!text.contains("bank"), "{text}");
    let text = refusal_of("[estimator]\ncandidate = 20");
    assert!(text.contains("valid_percent, stiffness"), "{text}");
    assert!(!text.contains("candidates"), "{text}");
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
    assert_eq!(scene.contact, Contact::KINEMATIC);
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
    assert_eq!(contact(""), Contact::KINEMATIC);
    assert_eq!(contact("model = \"kinematic\""), Contact::KINEMATIC);
    for (word, friction) in [
        ("mild", Friction::Mild),
        ("strong", Friction::Strong),
        ("severe", Friction::Severe),
    ] {
        let given = format!("friction = \"{word}\"");
        assert_eq!(contact(&given), Contact::stick_slip(friction));
        let both = format!("{given}\nmodel = \"stick-slip\"");
        assert_eq!(contact(&both), Contact::stick_slip(friction));
    }
}

#[test]
fn a_contact_that_is_left_open_is_the_lowest_rung_that_does_and_says_why() {
    let scene = |text: &str| Scene::parse(Path::new("x.toml"), text).unwrap();
    for (text, rung, reason) in [
        (SURFACE.to_owned(), ContactModel::Kinematic, "keeps up with"),
        (
            "[surface]\nspecimens = [{ wavelength_mm = 1.0, length_mm = 5.0 }, { wavelength_mm = 2.0 }]"
                .to_owned(),
            ContactModel::Kinematic,
            "a point can tell apart",
        ),
        (
            "[surface]\nspecimens = [{ wavelength_mm = 1.0, length_mm = 50.0 }, { wavelength_mm = 2.0, length_mm = 5.0 }, { wavelength_mm = 3.0 }]"
                .to_owned(),
            ContactModel::Rigid,
            "a specimen of 5 mm is shorter",
        ),
        (
            "[surface]\nspecimens = [{ wavelength_mm = 0.7, length_mm = 50.0 }, { wavelength_mm = 4.0 }]\n[gauges]\nsnr_db = 20"
                .to_owned(),
            ContactModel::Rigid,
            "of the longest's amplitude, in noise",
        ),
        (
            format!("{SURFACE}[gauges]\nsecond_harmonic = 0.8"),
            ContactModel::Rigid,
            "of a second harmonic of 0.8",
        ),
        (
            format!("{SURFACE}[motion]\nkind = \"sinusoid\"\namplitude_mm_s = 70\nfrequency_hz = 0.83"),
            ContactModel::Kinematic,
            "keeps up with",
        ),
        (
            format!("{SURFACE}[motion]\nkind = \"sinusoid\"\namplitude_mm_s = 70\nfrequency_hz = 8"),
            ContactModel::Viscoelastic,
            "swings on its spring by",
        ),
        (
            format!("{SURFACE}[contact]\nfriction = \"mild\""),
            ContactModel::StickSlip,
            "there is friction",
        ),
    ] {
        let scene = scene(&text);
        assert_eq!(scene.contact.rung, rung, "{text}");
        let given = scene.contact_reason.expect("it was left open");
        assert!(given.contains(reason), "{given}");
    }
    let told = scene(&format!("{SURFACE}[contact]\nmodel = \"reference\""));
    assert_eq!(told.contact, Contact::of(ContactModel::Reference, None));
    assert_eq!(told.contact_reason, None);
}

#[test]
fn a_step_that_is_left_open_is_one_that_is_borne() {
    for integrator in Integrator::ALL {
        let text = format!(
            "{SURFACE}[contact]\nfriction = \"severe\"\nintegrator = \"{}\"",
            integrator.name()
        );
        let scene = Scene::parse(Path::new("x.toml"), &text).unwrap();
        let Solver::Stepped {
            integrator: found,
            step_s,
        } = scene.contact.solver
        else {
            panic!("it is integrated");
        };
        assert_eq!(found, integrator);
        assert!(
            (1e-7..=250e-6).contains(&step_s),
            "{integrator:?}: {step_s}"
        );
        // What is said to be borne is.
        let again = format!("{text}\nstep_us = {}", (step_s * 1e8).floor() / 1e2);
        if integrator.is_fixed() {
            Scene::parse(Path::new("x.toml"), &again).unwrap();
        }
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
fn a_scene_without_a_name_has_its_files_whatever_that_is_called() {
    let long = "a".repeat(300);
    for (file, name) in [
        ("my scene.toml", "my_scene"),
        ("ü.toml", "_"),
        (".hidden.toml", "hidden"),
        ("3 mm, 70 mm_s.toml", "3_mm__70_mm_s"),
        (&*long, &long[..64]),
    ] {
        let scene = Scene::parse(Path::new(file), SURFACE).unwrap();
        assert_eq!(scene.name, name, "{file}");
    }
}
