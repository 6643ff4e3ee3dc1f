//! `hil-sim people` as a person or a script meets it: on the libraries, which take seconds.

use crate::{hil_sim_anywhere, text};

#[test]
fn the_tables_say_what_they_do_not_show_and_where_the_paper_errs() {
    let arguments = ["people", "--engine", "native", "--out", "people-tables"];
    let output = hil_sim_anywhere(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    for say in [
        "proves nothing on people",
        "0.0000   0.5461   1.0923  1.4491",
        "χ² = 8.72, 3 degrees of freedom, critical 7.81, p = 0.033: Case V is rejected",
    ] {
        assert!(said.contains(say), "{say}: {said}");
    }
    assert!(!said.contains("NaN"), "{said}");
    // The same seed says the same again.
    assert_eq!(text(&hil_sim_anywhere(&arguments).stdout), said);
}

#[test]
fn json_holds_every_pair_of_either_method() {
    let output = hil_sim_anywhere(&[
        "people",
        "--engine",
        "native",
        "--out",
        "people-json",
        "--json",
        "--trials",
        "20",
        "--seed",
        "9",
        "--friction",
        "strong",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["trials"], 20);
    assert_eq!(json["friction"], "strong");
    for method in json["methods"].as_array().unwrap() {
        let pairs = method["once"].as_array().unwrap();
        assert_eq!(pairs.len(), 6);
        assert!(pairs.iter().all(|pair| pair["trials"] == 20.0));
    }
    assert!(
        json["disclaimer"]
            .as_str()
            .unwrap()
            .contains("proves nothing")
    );
}

#[test]
fn no_trials_are_refused() {
    let output = hil_sim_anywhere(&["people", "--trials", "0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("--trials"));
}
