//! Gauges that fall ill for two seconds and recover, in the committed `health` scenes.

use hil_sim_core::judge::JudgedEstimate;
use hil_sim_core::scene::{Gauges, Scene};
use protocol::{GAUGES, GaugeHealth};

use crate::estimation::running::{Run, folder, of_each, run, scenes_in};

/// When the scenes' trouble begins and ends, in s.
const ILL_S: (f64, f64) = (2.0, 4.0);
/// Until the start has died down, in s.
const STARTED_S: f64 = 1.0;
/// Share of a trouble's time, once it has been found, for which it has its name at least.
const NAMED: f64 = 0.95;
/// An estimate is made every 10 ms.
const ESTIMATE_S: f64 = 0.010;

/// What befell one gauge, and what was made of it.
struct Case {
    name: String,
    gauge: usize,
    run: Run,
}

impl Case {
    fn estimates(&self, from_s: f64, until_s: f64) -> impl Iterator<Item = &JudgedEstimate> {
        let all = self.run.verdict.estimates.iter();
        all.filter(move |estimate| (from_s..until_s).contains(&estimate.t_s))
    }

    fn health(&self, estimate: &JudgedEstimate) -> GaugeHealth {
        estimate.health[self.gauge]
    }

    fn takes_part(&self, estimate: &JudgedEstimate) -> bool {
        estimate.gauges_used >> self.gauge & 1 == 1
    }

    /// From the trouble's begin until it is reported as one of `names`, in s.
    fn reported_after_s(&self, names: &[GaugeHealth]) -> Option<f64> {
        let mut ill = self.estimates(ILL_S.0, ILL_S.1);
        let reported = ill.find(|estimate| names.contains(&self.health(estimate)))?;
        Some(reported.t_s - ILL_S.0)
    }

    /// From the trouble's end until the gauge takes part for good, in s.
    fn back_after_s(&self) -> Option<f64> {
        let last_out = self
            .estimates(ILL_S.0, f64::INFINITY)
            .filter(|estimate| !self.takes_part(estimate))
            .last()?;
        Some(last_out.t_s + ESTIMATE_S - ILL_S.1)
    }

    /// Share of the estimates while the trouble lasts that are valid.
    fn valid_share(&self) -> f64 {
        let ill: Vec<_> = self.estimates(ILL_S.0, ILL_S.1).collect();
        ill.iter().filter(|estimate| estimate.valid).count() as f64 / ill.len() as f64
    }
}

/// The scenes whose trouble is `trouble`, run.
fn cases(trouble: &str) -> Vec<Case> {
    let mut paths = scenes_in(&folder("health"));
    paths.retain(|path| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.starts_with(trouble)
    });
    assert!(paths.len() >= 2, "{trouble}: {paths:?}");
    of_each(&paths, |path| {
        let scene = Scene::load(path).unwrap();
        let Gauges::Kinematic(gauges) = &scene.gauges else {
            panic!("{}: no computed gauges", path.display());
        };
        assert_eq!(gauges.trouble_from_s, ILL_S.0);
        assert_eq!(gauges.trouble_for_s, Some(ILL_S.1 - ILL_S.0));
        let lists = [
            gauges.dead,
            gauges.saturated,
            gauges.stuck,
            gauges.noisy,
            gauges.humming,
        ];
        let ill: Vec<usize> = (0..GAUGES)
            .filter(|&gauge| lists.iter().any(|list| list[gauge]))
            .collect();
        assert_eq!(ill.len(), 1, "{}", path.display());
        Case {
            name: scene.name.clone(),
            gauge: ill[0],
            run: run(scene),
        }
    })
}

/// The trouble is reported as one of `names` within `within_s`, and from then on nearly always while it
/// lasts; the gauge is left out for as long; it is back `back_s` after the trouble at the latest; no
/// other gauge is ever blamed; all that is valid is right.
fn is_found_and_forgiven(trouble: &str, names: &[GaugeHealth], within_s: f64, back_s: f64) {
    for case in cases(trouble) {
        let name = &case.name;
        assert!(case.run.unmet.is_empty(), "{name}: {:?}", case.run.unmet);
        let reported_s = case.reported_after_s(names);
        assert!(
            reported_s.is_some_and(|after_s| after_s <= within_s),
            "{name}: reported after {reported_s:?} s"
        );
        let reported_s = ILL_S.0 + reported_s.unwrap_or(within_s);
        let named: Vec<bool> = case
            .estimates(reported_s, ILL_S.1)
            .map(|estimate| names.contains(&case.health(estimate)))
            .collect();
        let named = named.iter().filter(|&&named| named).count() as f64 / named.len() as f64;
        assert!(named >= NAMED, "{name}: {named} of the time");
        // What is found in one estimate is left out from the next on.
        for estimate in case.estimates(reported_s + ESTIMATE_S / 2.0, ILL_S.1) {
            assert!(!case.takes_part(estimate), "{name}: {estimate:?}");
        }
        let back_after_s = case.back_after_s();
        assert!(
            back_after_s.is_some_and(|after_s| after_s <= back_s),
            "{name}: back after {back_after_s:?} s"
        );
        for estimate in case.estimates(STARTED_S, f64::INFINITY) {
            for (gauge, health) in estimate.health.iter().enumerate() {
                assert!(
                    gauge == case.gauge || *health == GaugeHealth::Good,
                    "{name}: gauge {gauge} in {estimate:?}"
                );
            }
            assert!(!estimate.is_wrong(), "{name}: {estimate:?}");
        }
        println!(
            "{name}: reported after {:.0} ms, back after {:.0} ms, {:.3} valid meanwhile",
            1e3 * (reported_s - ILL_S.0),
            1e3 * back_after_s.unwrap_or(f64::NAN),
            case.valid_share()
        );
    }
}

/// While the trouble lasts, this share of the estimates is valid at least.
fn goes_on(trouble: &str, least: f64) {
    for case in cases(trouble) {
        let share = case.valid_share();
        assert!(share >= least, "{}: {share} valid", case.name);
    }
}

#[test]
fn a_dead_gauge_is_found_and_forgiven() {
    // 200 ms without a change and an estimate; half a second without a fault. The wave of the others is
    // seen all the while.
    is_found_and_forgiven("dead", &[GaugeHealth::Dead], 0.220, 0.520);
    goes_on("dead", 1.0);
}

#[test]
fn a_stuck_gauge_is_found_and_forgiven() {
    // As a dead one; but the step to where it stands is no wave, and doubted until it is left out.
    is_found_and_forgiven("stuck", &[GaugeHealth::Stuck], 0.220, 0.520);
    goes_on("stuck", 0.9);
}

#[test]
fn a_saturated_gauge_is_found_and_forgiven() {
    // Three quarters of all codes are at the ends, and a tenth is enough, 0.14 time constants of 0.3 s
    // in; down to a tenth again it takes 2 time constants, before the half second counts. What was heard
    // until then raises doubts for a while: measured 0.75 and 0.83.
    is_found_and_forgiven("saturated", &[GaugeHealth::Saturated], 0.070, 1.2);
    goes_on("saturated", 0.7);
}

#[test]
fn a_noisy_gauge_is_found_and_forgiven() {
    // Noise of three times the signal drives the converter into its ends, too: either name is right.
    // Measured: 0.24 s until it is found, 0.69 s until it is back, 0.97 valid meanwhile.
    let names = [GaugeHealth::Noisy, GaugeHealth::Saturated];
    is_found_and_forgiven("noisy", &names, 0.3, 0.8);
}

#[test]
fn the_others_go_on_while_a_gauge_is_noisy() {
    goes_on("noisy", 0.8);
}

#[test]
fn a_humming_gauge_is_found_and_forgiven() {
    // Measured: 0.13 and 0.70 s, and 0.97 valid.
    is_found_and_forgiven("humming", &[GaugeHealth::Hum], 0.2, 1.0);
    goes_on("humming", 0.9);
}
