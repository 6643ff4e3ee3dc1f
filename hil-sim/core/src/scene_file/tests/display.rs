//! `[display]`: what is taken, and what is refused with which words.

use protocol::actuators::{self, grid};
use protocol::{DEFAULT_ACTUATORS, DisplayConfiguration, Mode, Rendering, UpdateRate};

use super::*;

fn taken(section: &str) -> Scene {
    let text = format!("{SURFACE}{section}");
    Scene::parse(Path::new("scenes/x.toml"), &text).unwrap()
}

/// What a scene makes of a description of the actuators that stands in a file beside it.
fn described(name: &str, csv: &str) -> Result<Scene, SceneError> {
    let folder = Folder::new(&format!("display-{name}"), SURFACE);
    folder.load("[display]\nfile = \"data.csv\"\n", "data.csv", csv)
}

const HEADER: &str = "actuator,x_um,y_um,gain,phase_turns,inverted\n";

/// Fifty rows, one of them another.
fn rows(change: usize, row: &str) -> String {
    let rows = (0..50).map(|index| {
        if index == change {
            format!("{row}\n")
        } else {
            format!("{index},{},-700,0.5,0.25,1\n", 10 * index)
        }
    });
    format!("{HEADER}{}", rows.collect::<String>())
}

#[test]
fn without_the_section_the_board_is_as_it_starts() {
    let scene = taken("");
    assert_eq!(scene.display, Display::default());
    assert_eq!(scene.display_configuration(), DisplayConfiguration::DEFAULT);
    assert_eq!(*scene.display.actuators, DEFAULT_ACTUATORS);
}

#[test]
fn every_setting_becomes_the_boards() {
    let scene = taken(
        "[display]\nmode = \"travelling\"\nrendering = \"texture\"\nupdate_rate_hz = 4000\nmax_age_ms = 300\nfade_in_ms = 10\n\
         fade_out_ms = 30\nglide_ms = 0\namplitude_mv = 4000\nreference_lsb = 250\nreference_mn = 900\nfull_drive_s = 60\npitch_um = 700\n",
    );
    let expected = DisplayConfiguration {
        mode: Mode::Travelling,
        rendering: Rendering::Texture,
        update_rate: UpdateRate::Hz4000,
        max_age_ms: 300,
        fade_in_ms: 10,
        fade_out_ms: 30,
        glide_ms: 0,
        amplitude_mv: 4_000,
        reference_lsb: 250,
        reference_mn: 900,
        full_drive_s: 60,
        actuators: actuators::hash(&grid(700)),
    };
    assert_eq!(scene.display_configuration(), expected);
    assert_eq!(expected.check(), Ok(()));
    assert_eq!(*scene.display.actuators, grid(700));
}

#[test]
fn the_ranges_are_the_boards_own() {
    for (key, low, high) in [
        ("max_age_ms", 20, 5_000),
        ("fade_in_ms", 1, 1_000),
        ("fade_out_ms", 1, 1_000),
        ("glide_ms", 0, 500),
        ("amplitude_mv", 0, 5_000),
        ("reference_lsb", 0, 2_000),
        ("reference_mn", 0, 60_000),
        ("full_drive_s", 10, 3_600),
        ("pitch_um", 100, 4_000),
    ] {
        for value in [low, high] {
            let scene = taken(&format!("[display]\n{key} = {value}\n"));
            assert_eq!(
                scene.display_configuration().check(),
                Ok(()),
                "{key} = {value}"
            );
            assert_eq!(
                actuators::check(&scene.display.actuators),
                Ok(()),
                "{key} = {value}"
            );
        }
        for value in [low - 1, high + 1] {
            let refusal = refusal_of(&format!("[display]\n{key} = {value}\n"));
            let want = format!(
                "x.toml:4: display.{key}: {value} is out of range: give a whole number from {low} to {high}"
            );
            assert!(refusal.contains(&want), "{refusal}\nwanted {want}");
        }
    }
    assert!(
        refusal_of("[display]\nupdate_rate_hz = 3000\n")
            .contains("x.toml:4: display.update_rate_hz: is no rate: give 2000 or 4000")
    );
}

#[test]
fn a_described_array_is_taken_actuator_by_actuator() {
    let scene = described("taken", &rows(7, "7,-123,45,1,0,0")).unwrap();
    let actuators = &scene.display.actuators;
    assert_eq!(
        scene.display_configuration().actuators,
        actuators::hash(actuators)
    );
    let seventh = protocol::Actuator::at(-123, 45);
    assert_eq!(actuators[7], seventh);
    let tenth = protocol::Actuator {
        x_um: 100,
        y_um: -700,
        gain_q15: 1 << 14,
        phase: 1 << 14,
        inverted: true,
        ..protocol::Actuator::at(100, -700)
    };
    assert_eq!(actuators[10], tenth);
}

/// The same fifty with two more columns, one of the rows another.
fn modelled_rows(change: usize, columns: &str) -> String {
    let header = HEADER.trim_end();
    let rows = (0..50).map(|index| {
        let columns = if index == change {
            columns
        } else {
            "35.5,0.71"
        };
        format!("{index},{},-700,0.5,0.25,1,{columns}\n", 100 * (index % 10))
    });
    format!(
        "{header},resonance_hz,damping\n{}",
        rows.collect::<String>()
    )
}

#[test]
fn an_array_may_be_described_with_its_resonances() {
    let scene = described("modelled", &modelled_rows(7, "0,0")).unwrap();
    let actuators = &scene.display.actuators;
    assert_eq!(
        (actuators[6].resonance_dhz, actuators[6].damping_percent),
        (355, 71)
    );
    assert_eq!(actuators[7].resonance_dhz, 0);
    assert_eq!(actuators::check(actuators), Ok(()));
    let badly = |columns: &str| described("modelled-badly", &modelled_rows(7, columns));
    assert_refused(
        |columns| badly(columns).unwrap_err().to_string(),
        r#"
        19.9,0.7 => data.csv:9: column 7 (resonance_hz): "19.9" is no resonance: give 20 to 2000 Hz
        2001,0.7 => data.csv:9: column 7 (resonance_hz): "2001" is no resonance
        50,0.19 => data.csv:9: column 8 (damping): "0.19" is no damping: give 0.2 to 10
        50,10.1 => data.csv:9: column 8 (damping): "10.1" is no damping
        "#,
    );
}

#[test]
fn more_than_the_fundamental_is_refused_for_more_places_than_are_worked_out_in_time() {
    let scattered = |section: &str| {
        let rows = (0..50).map(|index| format!("{index},{},0,1,0,0\n", 10 * index));
        let csv = format!("{HEADER}{}", rows.collect::<String>());
        let section = format!("[display]\nmode = \"travelling\"\nfile = \"data.csv\"\n{section}");
        Folder::new("display-scattered", SURFACE).load(&section, "data.csv", &csv)
    };
    assert!(scattered("rendering = \"fundamental\"\n").is_ok());
    let refusal = scattered("rendering = \"shape\"\n")
        .unwrap_err()
        .to_string();
    let want = "display.rendering: is too much with these actuators";
    assert!(refusal.contains(want), "{refusal}");
}

#[test]
fn a_description_with_a_fault_is_refused_at_its_line() {
    let faulty = |row: &str| described("faulty", &rows(7, row));
    assert_refused(
        |row| faulty(row).unwrap_err().to_string(),
        r#"
        8,0,0,1,0,0 => data.csv:9: column 1 (actuator): "8" is not the next actuator: give 7
        7,20001,0,1,0,0 => data.csv:9: column 2 (x_um): "20001" is no place
        7,0,0.5,1,0,0 => data.csv:9: column 3 (y_um): "0.5" is no place
        7,0,0,1.1,0,0 => data.csv:9: column 4 (gain): "1.1" is no gain
        7,0,0,1,1,0 => data.csv:9: column 5 (phase_turns): "1" is no phase
        7,0,0,1,0,2 => data.csv:9: column 6 (inverted): "2" is neither
        "#,
    );
    let short = described("short", &format!("{HEADER}0,0,0,1,0,0\n1,0,0,1,0,0\n"));
    let short = short.unwrap_err().to_string();
    assert!(
        short.contains("describes 2 actuators: give all 50"),
        "{short}"
    );
}
