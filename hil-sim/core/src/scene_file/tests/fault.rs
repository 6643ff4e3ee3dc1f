//! `[[fault]]`.

use super::{SURFACE, assert_refused, refusal, refusal_of};
use crate::scene::Scene;
use crate::scene::fault::{Fault, Kind};
use std::path::Path;

fn faults(section: &str) -> Vec<Fault> {
    let text = format!("{SURFACE}{section}");
    Scene::parse(Path::new("x.toml"), &text).unwrap().faults
}

#[test]
fn the_contract_s_fault_parses() {
    assert_eq!(
        faults("[[fault]]\nat_s = 1.0\nkind = \"link-down\"\nfor_s = 0.5"),
        [Fault {
            for_s: Some(0.5),
            ..Fault::new(Kind::LinkDown, 1.0)
        }]
    );
}

#[test]
fn every_kind_parses_with_its_defaults_and_with_every_key_of_its_own() {
    for kind in Kind::all() {
        let row = kind.row();
        let bare = format!("[[fault]]\nat_s = 0.25\nkind = \"{}\"\n", row.name);
        assert_eq!(faults(&bare), [Fault::new(kind, 0.25)]);
        let mut full = bare;
        let mut wanted = Fault::new(kind, 0.25);
        for (value, key) in wanted.values.iter_mut().zip(row.keys) {
            *value = key.high;
            full += &format!("{} = {}\n", key.name, key.high);
        }
        assert_eq!(faults(&full), [wanted], "{full}");
    }
}

#[test]
fn faults_are_kept_in_the_order_of_the_file() {
    let kinds: Vec<Kind> =
        faults("[[fault]]\nat_s = 2\nkind = \"link-down\"\n[[fault]]\nat_s = 1\nkind = \"panic\"")
            .iter()
            .map(|fault| fault.kind)
            .collect();
    assert_eq!(kinds, [Kind::LinkDown, Kind::Panic]);
}

#[test]
fn what_is_wrong_with_a_fault_is_refused_with_line_and_key() {
    assert_refused(
        refusal_of,
        r#"
        [[fault]]; kind = "panic" => x.toml:3: fault[0].at_s: is missing
        [[fault]]; at_s = 1 => x.toml:3: fault[0].kind: is missing
        [[fault]]; at_s = 1; kind = "gremlin" => x.toml:5: fault[0].kind: "gremlin" is unknown: give one of nothing, power-cycle, link-down
        [[fault]]; at_s = -1; kind = "panic" => x.toml:4: fault[0].at_s: -1 is not an instant
        [[fault]]; at_s = 3; kind = "panic" => x.toml:4: fault[0].at_s: comes after the scene's end at 3 s
        [[fault]]; at_s = 1; kind = "panic"; for_s = 1 => x.toml:6: fault[0].for_s: no such key here with kind = "panic"
        [[fault]]; at_s = 1; kind = "link-down"; for_s = 0 => x.toml:6: fault[0].for_s: 0 is not a duration
        [[fault]]; at_s = 1; kind = "link-down"; chip = 1 => x.toml:6: fault[0].chip: no such key here with kind = "link-down"
        [[fault]]; at_s = 1; kind = "panic"; [[fault]]; at_s = 1; kind = "dac-alarm"; chip = 4 => x.toml:9: fault[1].chip: 4 is out of range: give a whole number from 0 to 3
        [[fault]]; at_s = 1; kind = "gauge-open"; gauge = 1.5 => x.toml:6: fault[0].gauge: 1.5 is out of range: give a whole number from 0 to 4
        [[fault]]; at_s = 1; kind = "link-corrupt"; share = 2 => x.toml:6: fault[0].share: 2 is out of range: give a number from 0 to 1
        "#,
    );
    let whole = refusal(&format!("fault = 1\n{SURFACE}"));
    let want = "x.toml:1: fault: holds a whole number: give an array of tables";
    assert!(whole.contains(want), "{whole}");
}
