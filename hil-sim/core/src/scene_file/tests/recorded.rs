//! The CSV files that a scene names.

use std::path::Path;

use super::{Folder, SURFACE, refusals};
use crate::scene::{Motion, Scene};

#[test]
fn recorded_motion_is_read_and_bad_rows_are_refused_at_line_and_column() {
    const MOTION: &str = "[motion]\nkind = \"recorded\"\nfile = \"data.csv\"\n";
    let folder = Folder::new("motion", SURFACE);
    let scene = folder
        .load(MOTION, "data.csv", "t_s, x_mm\n0, 0\n1, 50\n3, 25\n")
        .unwrap();
    assert_eq!(scene.motion.position_mm(0.5), 25.0);
    assert_eq!(scene.motion.velocity_mm_s(2.0), -12.5);
    for (csv, want) in refusals(
        r#"
        t_s,x_mm; 0,0; 1,fast; 3,1 => data.csv:3: column 2 (x_mm): "fast" is no number
        t_s,x_mm; 0,0; 1,NaN; 3,1 => data.csv:3: column 2 (x_mm): "NaN" is not finite
        t_s,x_mm; 0,0; ; 1,; 3,1 => data.csv:4: column 2 (x_mm): "" is no number
        t_s,x_mm; 0,0; 2,0; 2,1 => data.csv:4: column 1 (t_s): "2" does not increase, after 2
        t_s,x_mm; 0,0; 1 => data.csv:3: 1 cells where the first line has 2
        t_s,x_mm; 0,0 => data.csv: 1 row(s) of numbers: give two or more
        t_s,x_mm => data.csv: 0 row(s) of numbers
        t,x; 0,0; 3,1 => data.csv:1: the first line is "t,x": it must be t_s,x_mm
        0,0; 3,1 => data.csv:1: the first line is "0,0"
        t_s,x_mm; 0,0; 0.001,2; 3,1 => data.csv:3: column 2 (x_mm): "2" is 2000 mm/s from the row before
        t_s,x_mm; 0,0; 2,50 => x.toml:5: motion.file: lasts from 0 to 2 s, the scene from 0 to 3 s
        "#,
    ) {
        let refusal = folder.refusal(MOTION, "data.csv", &format!("{csv}\n"));
        assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
    }
    let refusal = folder.refusal(MOTION, "data.csv", "");
    let want = "data.csv:1: the first line is \"\": it must be t_s,x_mm";
    assert!(refusal.starts_with(want), "{refusal}");
}

#[test]
fn a_byte_order_mark_in_front_of_a_scene_or_of_csv_is_no_part_of_it() {
    const MOTION: &str = "[motion]\nkind = \"recorded\"\nfile = \"data.csv\"\n";
    let folder = Folder::new("marked", SURFACE);
    let scene = folder.load(MOTION, "data.csv", "\u{feff}t_s,x_mm\r\n0,0\r\n3,150\r\n");
    assert_eq!(scene.unwrap().motion.position_mm(1.0), 50.0);
    let text = format!("\u{feff}{SURFACE}seeds = 1\n");
    let refusal = Scene::parse(Path::new("x.toml"), &text)
        .unwrap_err()
        .to_string();
    assert!(refusal.starts_with("x.toml:3: surface.seeds"), "{refusal}");
}

#[test]
fn a_refusal_repeats_no_more_of_a_file_than_can_be_read() {
    const MOTION: &str = "[motion]\nkind = \"recorded\"\nfile = \"data.csv\"\n";
    let folder = Folder::new("long", SURFACE);
    let zeros = "\0".repeat(10_000);
    for csv in [
        zeros.clone(),
        format!("t_s,x_mm\n0,{zeros}\n"),
        format!("t_s,{zeros}\n0,0\n"),
    ] {
        let refusal = folder.refusal(MOTION, "data.csv", &csv);
        assert!(refusal.starts_with("data.csv:"), "{refusal}");
        assert!(refusal.contains('…') && refusal.len() < 500, "{refusal}");
    }
}

#[test]
fn whoever_is_told_to_name_the_gauges_columns_is_told_that_volts_must_be_said() {
    let folder = Folder::new("volts", SURFACE);
    let refusal = |section: &str| {
        let keys = format!("[{section}]\nkind = \"recorded\"\nfile = \"data.csv\"\n");
        folder.refusal(&keys, "data.csv", "t_s,g0,g1,g2,g3,g4,x\n0,1,1,1,1,1,1\n")
    };
    let want = "by channels and time in the scene, with offset_v = 0 if they hold volts";
    let gauges = refusal("gauges");
    assert!(gauges.ends_with(want), "{gauges}");
    let motion = refusal("motion");
    assert!(
        motion.ends_with("by channels and time in the scene"),
        "{motion}"
    );
}

#[test]
fn recorded_gauges_are_played_and_refused_below_200_hz() {
    const GAUGES: &str = "[gauges]\nkind = \"recorded\"\nfile = \"data.csv\"\n";
    let folder = Folder::new("gauges", SURFACE);
    let rows: String = (0..=3000)
        .map(|ms| format!("{},0,0.825,1.65,2.475,3.3\n", f64::from(ms) / 1000.0))
        .collect();
    let scene = folder
        .load(GAUGES, "data.csv", &format!("t_s,g0,g1,g2,g3,g4\n{rows}"))
        .unwrap();
    let mut world = crate::plant::world::World::new(&scene).unwrap();
    assert_eq!(world.codes(1.00025, 0.0), [0, 1024, 2048, 3072, 4095, 2048]);
    // The last row goes on for as long as the others do.
    let whole = rows.trim_end().rsplit_once('\n').expect("rows").0;
    let load =
        |rows: &str| folder.load(GAUGES, "data.csv", &format!("t_s,g0,g1,g2,g3,g4\n{rows}\n"));
    assert!(whole.contains("\n2.999,") && !whole.contains("\n3,"));
    load(whole).expect("3 s at 1 kHz are 3 000 rows");
    let short = whole.rsplit_once('\n').expect("rows").0;
    load(short).expect_err("2.999 s are no 3 s");
    for (csv, want) in refusals(
        r#"
        0,1,1,1,1,1; 0.01,1,1,1,1,1 => data.csv:3: column 1 (t_s): "0.01" comes more than 5 ms
        0,1,1,1,1,12 => data.csv:2: column 6 (g4): "12" is no voltage
        0,1,1,1,1,1; 0.001,1,1,1,1,1 => x.toml:5: gauges.file: lasts from 0 to 0.001 s
        "#,
    ) {
        let refusal = folder.refusal(GAUGES, "data.csv", &format!("t_s,g0,g1,g2,g3,g4\n{csv}\n"));
        assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
    }
    let both = folder.refusal(
        &format!("{GAUGES}snr_db = 20"),
        "data.csv",
        &format!("t_s,g0,g1,g2,g3,g4\n{rows}"),
    );
    assert!(
        both.starts_with("x.toml:6: gauges.snr_db: no such key here with kind = \"recorded\""),
        "{both}"
    );
}

#[test]
fn gauges_that_are_recorded_beyond_the_converters_range_are_told_and_played() {
    let folder = Folder::new("beyond", SURFACE);
    // The force and g0 always, g1 in a fifth and g2 in a twentieth of the rows, g3 and g4 nowhere, once 1.65 V is added.
    let rows: String = (0..=3000)
        .map(|ms| {
            let g1 = if ms % 5 == 0 { 1.7 } else { 1.65 };
            let g2 = if ms % 20 == 0 { -1.7 } else { -1.65 };
            format!("{},1.8,{g1},{g2},0,1,2\n", f64::from(ms) / 1000.0)
        })
        .collect();
    let csv = format!("t_s,a,b,c,d,e,f\n{rows}");
    let notes = |keys: &str| -> Vec<String> {
        let section = format!("[gauges]\nkind = \"recorded\"\nfile = \"data.csv\"\n{keys}");
        let scene = folder.load(&section, "data.csv", &csv).unwrap();
        let notes = scene.notes.iter().map(ToString::to_string);
        let place = |note: String| note[note.find("x.toml").expect("the scene")..].to_owned();
        notes.map(place).collect()
    };
    let all = "channels = [\"a\", \"b\", \"c\", \"d\", \"e\", \"f\"]\n";
    let lie = "x.toml:6: gauges.channels: of the rows of gauge 0 100 %, of gauge 1 20 %, of the tangential force 100 % \
               lie beyond the 0 to 3.3 V that the ADC converts, and are clipped: ";
    assert_eq!(
        notes(all),
        [format!(
            "{lie}1.65 V is added: give offset_v = 0 if the file holds volts, else a smaller volts_per_unit"
        )]
    );
    assert_eq!(
        notes(&format!("{all}tangential = false\noffset_v = 1.65\n")),
        [format!(
            "{}give another volts_per_unit or offset_v, or record with less gain",
            lie.replace(", of the tangential force 100 %", "")
        )]
    );
    assert_eq!(
        notes(&format!("{all}volts_per_unit = 0.5\n")),
        [] as [&str; 0]
    );
    // Only what the scene plays of a recording counts.
    let rows: String = (0..=5000)
        .map(|ms| {
            let volts = if ms < 1000 { 3.5 } else { 3.3 };
            format!("{},{volts},0,0,0,0\n", f64::from(ms) / 1000.0)
        })
        .collect();
    let csv = format!("t_s,g0,g1,g2,g3,g4\n{rows}");
    for (start, count) in [("start_s = 1.0\n", 0), ("", 1)] {
        let section = format!("[gauges]\nkind = \"recorded\"\nfile = \"data.csv\"\n{start}");
        let scene = folder.load(&section, "data.csv", &csv).unwrap();
        assert_eq!(scene.notes.len(), count, "{:?}", scene.notes);
    }
    let note = folder.load(
        "[gauges]\nkind = \"recorded\"\nfile = \"data.csv\"\n",
        "data.csv",
        &csv,
    );
    let note = note.unwrap().notes[0].to_string();
    let want = "x.toml:5: gauges.file: of the rows of gauge 0 33 % lie beyond";
    assert!(note.contains(want), "{note}");
}

#[test]
fn a_recorded_force_is_played_unless_it_is_taken_out() {
    const GAUGES: &str = "[gauges]\nkind = \"recorded\"\nfile = \"data.csv\"\n";
    let folder = Folder::new("force", SURFACE);
    let rows = |force: &str| -> String {
        (0..=3000)
            .map(|ms| format!("{},0,1,1,1,1{force}\n", f64::from(ms) / 1000.0))
            .collect()
    };
    let with = format!("t_s,g0,g1,g2,g3,g4,tangential\n{}", rows(",2.475"));
    let without = format!("t_s,g0,g1,g2,g3,g4\n{}", rows(""));
    for (keys, csv, present, code) in [
        ("", &with, true, 3072),
        ("tangential = true", &with, true, 3072),
        ("tangential = false", &with, false, 2048),
        ("", &without, false, 2048),
        ("tangential = false", &without, false, 2048),
    ] {
        let keys = format!("{GAUGES}{keys}\ntangential_n_per_v = 2\nstiffness_n_per_m = 500\n");
        let scene = folder.load(&keys, "data.csv", csv).unwrap();
        let force = scene.force;
        assert_eq!(
            (force.present, force.n_per_v, force.stiffness_n_per_m),
            (present, 2.0, 500.0)
        );
        let mut world = crate::plant::world::World::new(&scene).unwrap();
        assert_eq!(world.codes(1.0, 0.0)[5], code);
    }
    let refusal = folder.refusal(&format!("{GAUGES}tangential = true"), "data.csv", &without);
    assert!(
        refusal.starts_with("x.toml:6: gauges.tangential: true, but the file has no column"),
        "{refusal}"
    );
    // What says that there is none of it goes with recorded gauges.
    let nothing =
        "dead = []\nhum_50_hz = 0\npink = 0.0\n[contact]\nmodel = \"auto\"\nfriction = \"none\"\n";
    folder
        .load(&format!("{GAUGES}{nothing}"), "data.csv", &with)
        .unwrap();
    let refusal = folder.refusal(&format!("{GAUGES}pink = 0.1\n"), "data.csv", &with);
    assert!(refusal.contains("gauges.pink"), "{refusal}");
    let refusal = folder.refusal(
        &format!("{GAUGES}[contact]\nfriction = \"mild\""),
        "data.csv",
        &with,
    );
    assert!(
        refusal.contains("does not apply to recorded gauges"),
        "{refusal}"
    );
}

#[test]
fn a_recorded_profile_must_cover_the_travel() {
    let folder = Folder::new("profile", SURFACE);
    let profile = "profile = \"recorded\"\nfile = \"data.csv\"\n";
    let heights = |to: i32| {
        let rows: String = (-40..=to)
            .map(|x| format!("{},{}\n", f64::from(x) / 10.0, f64::from(x % 20)))
            .collect();
        format!("x_mm,height\n{rows}")
    };
    // 3 s at 50 mm/s, and the outermost gauges 3 mm further.
    folder.load(profile, "data.csv", &heights(1530)).unwrap();
    let refusal = folder.refusal(profile, "data.csv", &heights(1500));
    assert!(
        refusal.contains("the gauges come from -3.000 to 153.000 mm"),
        "{refusal}"
    );
}

#[test]
fn lines_of_blanks_in_a_csv_file_are_passed_over_as_empty_ones_are() {
    let folder = Folder::new("blank-lines", SURFACE);
    let motion = "[motion]\nkind = \"recorded\"\nfile = \"data.csv\"\n";
    for csv in [
        "t_s,x_mm\n0,0\n\n3,10\n",
        "t_s,x_mm\n0,0\n3,10\n  ",
        "t_s,x_mm\n0,0\n \t\n3,10\n \r\n",
        "t_s\tx_mm\n0\t0\n\t\n3\t10\n\t",
    ] {
        let Ok(scene) = folder.load(motion, "data.csv", csv) else {
            panic!("{}", folder.refusal(motion, "data.csv", csv));
        };
        let Motion::Recorded(rows) = scene.motion else {
            panic!("{csv:?}");
        };
        assert_eq!(rows.at, [0.0, 3.0], "{csv:?}");
    }
    let refusal = folder.refusal(motion, "data.csv", "t_s,x_mm\n0,0\n \n3,x\n");
    assert!(refusal.starts_with("data.csv:4: "), "{refusal}");
    // A cell in quotes is one, though there is nothing in it.
    let refusal = folder.refusal(motion, "data.csv", "t_s,x_mm\n0,0\n\"\"\n3,10\n");
    assert!(refusal.starts_with("data.csv:3: 1 cells"), "{refusal}");
}
