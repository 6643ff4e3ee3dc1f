//! `hil-sim map` as a person or a script meets it.

use std::path::Path;

use crate::{hil_sim_anywhere, text};

#[test]
fn what_cannot_be_done_exits_2_and_says_what_can() {
    for (arguments, say) in [
        (&["map", "altitude"][..], "give some of speed-wavelength, "),
        (&["map", "--shard", "9/8"], "give i/n with 1 ≤ i ≤ n"),
        (
            &["map", "--scene", "1,2"],
            "give one map and a place on its axes",
        ),
        (
            &["map", "snr-wavelength", "--scene", "loud,2"],
            "give a number from -10 to 40",
        ),
        (
            &["map", "snr-wavelength", "--method", "divination"],
            "estimator.method: \"divination\" is unknown",
        ),
        (&["map", "--jobs", "0"], "--jobs"),
    ] {
        let output = hil_sim_anywhere(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        let errors = text(&output.stderr);
        assert!(errors.contains(say), "{arguments:?}: {errors}");
    }
}

#[test]
fn the_list_names_every_map_with_its_cells() {
    let output = hil_sim_anywhere(&["map", "--list"]);
    assert_eq!(output.status.code(), Some(0));
    let list = text(&output.stdout);
    for map in hil_sim_studies::map::catalogue() {
        let line = format!("| {} | {} |", map.name, map.len());
        assert!(list.contains(&line), "{line} is not in {list}");
    }
}

#[test]
fn a_cell_s_scene_is_printed_and_can_be_run() {
    let place = [
        "map",
        "snr-wavelength",
        "--scene",
        "-10,2",
        "--method",
        "counting",
    ];
    let output = hil_sim_anywhere(&place);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let scene = text(&output.stdout);
    assert!(
        scene.contains("snr_db = -10\n") && scene.contains("wavelength_mm = 2 "),
        "{scene}"
    );
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("map-cell.toml");
    std::fs::write(&file, scene).unwrap();
    assert_eq!(
        hil_sim_anywhere(&["run", "map-cell.toml"]).status.code(),
        Some(0)
    );
}
