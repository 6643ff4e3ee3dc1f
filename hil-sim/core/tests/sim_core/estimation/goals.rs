//! The scenes that the goals are stated in.

use hil_sim_core::scene::Scene;

use crate::estimation::running::{folder, of_each, run, scenes_in};

#[test]
fn every_estimation_scene_is_as_it_expects() {
    let paths = scenes_in(&folder("estimation"));
    assert!(paths.len() >= 106, "only {} scenes", paths.len());
    let failures: Vec<String> = of_each(&paths, |path| {
        let outcome = run(Scene::load(path).unwrap());
        (!outcome.unmet.is_empty()).then(|| format!("{}: {:?}", path.display(), outcome.unmet))
    })
    .into_iter()
    .flatten()
    .collect();
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn every_estimation_scene_bounds_what_is_valid_but_wrong() {
    for path in scenes_in(&folder("estimation")) {
        let wrong_share = Scene::load(&path).unwrap().expect.wrong_share_max;
        assert!(
            wrong_share.is_some_and(|share| share <= 0.03),
            "{}: {wrong_share:?}",
            path.display()
        );
    }
}
