//! What a scene says of the boards reaches their own configurations, as a whole or not at all.

use hil_sim_boards::ElfError;
use protocol::{
    Configuration, ConfigurationReport, DisplayConfiguration, Mode, Rendering, SensorConfiguration,
    UpdateRate, actuators,
};
use tests::elves;
use tests::run::{Run, scene};

/// That the sensor board confirms what a run's scene asks for.
pub fn assert_taken(run: &Run) {
    let wanted = Configuration::Sensor(run.scene.sensor_configuration());
    let taken = ConfigurationReport {
        refused: None,
        hash: wanted.hash(),
        configuration: wanted,
    };
    let report = run.facts.sensor_told.map(|told| told.report);
    assert_eq!(report, Some(taken), "{}", run.scene.name);
}

#[test]
fn every_setting_of_the_estimator_but_the_method_becomes_the_boards() {
    let run = Run::of(scene(
        r#"
        duration_s = 0.2

        [surface]
        specimens = [{ wavelength_mm = 2.0 }]

        [gauges]
        tangential = true
        tangential_n_per_v = 1.5
        stiffness_n_per_m = 600

        [estimator]
        method = "spectrum"
        window_ms = 60
        counted_gauge = 1
        gauges = [0, 1, 4]
        waves = 5
        valid_percent = 95
        "#,
    ));
    assert_taken(&run);
    let expected = SensorConfiguration {
        window_ms: 60,
        counted_gauge: 1,
        gauges: 0b1_0011,
        waves: 5,
        valid_percent: 95,
        force_channel: true,
        force_mn_per_v: 1_500,
        stiffness_n_per_m: 600,
        ..SensorConfiguration::DEFAULT
    };
    assert_eq!(run.scene.sensor_configuration(), expected);
}

#[test]
fn no_gauge_takes_part_that_the_scene_leaves_out() {
    let run = Run::of(scene(
        r#"
        duration_s = 1.5

        [surface]
        specimens = [{ wavelength_mm = 2.0 }]

        [estimator]
        gauges = [0, 3]
        "#,
    ));
    let told = run.facts.sensor_told.expect("it is not the default");
    let after = run.recording.estimates.iter().filter(|record| {
        // The next estimate may be half made.
        record.made_ns > told.answered_ns + 20_000_000
    });
    let used: Vec<u8> = after.map(|record| record.estimate.gauges_used).collect();
    assert!(used.iter().all(|used| used & !0b0_1001 == 0), "{used:?}");
    assert_eq!(used.last(), Some(&0b0_1001));
}

#[test]
fn what_the_board_refuses_ends_the_run_with_the_settings_name() {
    let mut scene = scene("duration_s = 0.2\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n");
    scene.estimator.waves = 9;
    let error = hil_sim_boards::run(&scene, elves::both()).unwrap_err();
    assert!(
        matches!(
            error,
            ElfError::Configuration {
                board: "sensor",
                ..
            }
        ),
        "{error:?}"
    );
    let wanted = "waves is out of range: give 2 to 8";
    assert!(error.to_string().contains(wanted), "{error}");
}

#[test]
fn a_scene_too_short_for_the_board_to_answer_is_no_result() {
    let mut scene = scene(
        "duration_s = 0.2\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n\
         [estimator]\nmethod = \"counting\"\n",
    );
    scene.duration_s = 0.001;
    let error = hil_sim_boards::run(&scene, elves::both()).unwrap_err();
    assert!(error.to_string().contains("longer duration_s"), "{error}");
}

/// A scene that asks the display board for what `change` makes of its default, and what came of it.
fn display_asked(change: impl FnOnce(&mut hil_sim_core::scene::Display)) -> Result<(), String> {
    let mut scene = scene("duration_s = 0.2\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n");
    change(&mut scene.display);
    scene.display.configuration.actuators = actuators::hash(&scene.display.actuators);
    let wanted = Configuration::Display(scene.display.configuration);
    let answer = hil_sim_boards::run(&scene, elves::both()).map(|(_, facts)| {
        let report = facts.display_told.expect("it is not the default").report;
        let taken = ConfigurationReport {
            refused: None,
            hash: wanted.hash(),
            configuration: wanted,
        };
        assert_eq!(report, taken);
    });
    answer.map_err(|error| error.to_string())
}

#[test]
fn every_setting_of_a_scene_becomes_the_display_boards_and_is_acknowledged_with_its_hash() {
    let answer = display_asked(|display| {
        display.configuration = DisplayConfiguration {
            mode: Mode::Travelling,
            rendering: Rendering::Texture,
            update_rate: UpdateRate::Hz4000,
            max_age_ms: 300,
            fade_in_ms: 10,
            fade_out_ms: 30,
            glide_ms: 15,
            amplitude_mv: 4_000,
            reference_lsb: 250,
            reference_mn: 300,
            full_drive_s: 60,
            actuators: 0,
        };
        *display.actuators = actuators::grid(700);
        display.actuators[49].inverted = true;
        display.actuators[49].resonance_dhz = 1_200;
        display.actuators[49].damping_percent = 70;
    });
    assert_eq!(answer, Ok(()));
}

#[test]
fn the_display_board_refuses_what_is_out_of_range_by_name_and_range() {
    type Change = fn(&mut hil_sim_core::scene::Display);
    let cases: [(Change, &str); 3] = [
        (
            |display| display.configuration.amplitude_mv = 5_001,
            "amplitude_mv is out of range: give 0 to 5000",
        ),
        (
            |display| display.actuators[37].gain_q15 = 32_769,
            "gain_q15 of actuator 37 is out of range: give 0 to 32768",
        ),
        (
            |display| display.actuators[3].x_um = -20_001,
            "x_um of actuator 3 is out of range: give -20000 to 20000",
        ),
    ];
    for (change, wanted) in cases {
        let answer = display_asked(change);
        let error = answer.unwrap_err();
        assert!(error.contains(wanted), "{error}\nwanted {wanted}");
    }
}
