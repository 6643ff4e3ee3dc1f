//! What the force channel tells: stick and slip, the contact's lag, the fingertip's stiffness.

use std::path::Path;

use hil_sim_core::plant::arm::Arm;
use hil_sim_core::plant::contact::Touch;
use hil_sim_core::plant::world::World;
use hil_sim_core::scene::Scene;
use protocol::Contact;

use crate::estimation::running::{folder, of_each, run, scenes_in};

/// Age of the newest sample that an estimate knows of, in scans: the anti-aliasing filter's 4 ms.
const SAMPLE_AGE: usize = 16;
/// Age of the middle of the 7 ms over which contact and arm are compared, in scans.
const COMPARED_AGE: usize = SAMPLE_AGE + 14;
/// Until the force channel is made sense of, in s: a start at rest, and a first guess at the stiffness.
const STARTED_S: f64 = 0.5;

/// What the world itself knew, scan by scan: the arm's place in mm, and the fingertip.
fn touches(scene: &Scene) -> Vec<(f64, Touch)> {
    let mut world = World::new(scene).unwrap();
    let mut arm = Arm::new(&scene.arm, &scene.motion);
    let scans = (scene.duration_s * f64::from(firmware_sensor::SCAN_RATE_HZ)) as usize;
    (0..scans)
        .map(|scan| {
            let t_s = scan as f64 / f64::from(firmware_sensor::SCAN_RATE_HZ);
            let arm_mm = arm.position_mm(t_s);
            world.codes(t_s, arm_mm);
            (arm_mm, world.touch().unwrap())
        })
        .collect()
}

/// How a run's words on the contact compare to what the world knew.
struct Comparison {
    name: String,
    /// Share of the estimates that say stick or slip, of all.
    told: f64,
    /// Share of those that say what the slider did in the middle of the time that was looked at.
    agree: f64,
    /// The same against what it did at the instant of the estimate, 7.5 ms later.
    agree_now: f64,
    /// The slider stuck for this share of the time.
    stuck: f64,
    /// RMS error of the lag, in µm.
    lag_error_um: f64,
    /// RMS of the true lag less its mean, in µm.
    lag_spread_um: f64,
}

fn compare(path: &Path) -> Comparison {
    let scene = Scene::load(path).unwrap();
    let touches = touches(&scene);
    let outcome = run(scene);
    assert!(
        outcome.unmet.is_empty(),
        "{}: {:?}",
        path.display(),
        outcome.unmet
    );
    let (mut count, mut told, mut agree, mut agree_now, mut stuck) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut squares, mut lags, mut lag_squares) = (0.0, 0.0, 0.0);
    let estimates = outcome.verdict.estimates.iter();
    for estimate in estimates.filter(|estimate| estimate.t_s >= STARTED_S) {
        let scan = (estimate.t_s * f64::from(firmware_sensor::SCAN_RATE_HZ)).round() as usize;
        count += 1.0;
        let stuck_then = touches[scan - COMPARED_AGE].1.sticks;
        stuck += f64::from(u8::from(stuck_then));
        let says_stick = match estimate.contact {
            Contact::Stick => true,
            Contact::Slip => false,
            Contact::Unknown | Contact::StickSlip => continue,
        };
        told += 1.0;
        agree += f64::from(u8::from(says_stick == stuck_then));
        agree_now += f64::from(u8::from(says_stick == touches[scan].1.sticks));
        let (arm_mm, touch) = touches[scan - SAMPLE_AGE];
        let lag_um = 1e3 * (arm_mm - touch.position_mm);
        let said_um = f64::from(estimate.lag_um.expect("there is a force channel"));
        squares += (said_um - lag_um).powi(2);
        lags += lag_um;
        lag_squares += lag_um * lag_um;
    }
    let comparison = Comparison {
        name: outcome.scene.name.clone(),
        told: told / count,
        agree: agree / told,
        agree_now: agree_now / told,
        stuck: stuck / count,
        lag_error_um: f64::sqrt(squares / told),
        lag_spread_um: f64::sqrt(lag_squares / told - (lags / told).powi(2)),
    };
    println!(
        "{}: {:.3} told, {:.3} agree ({:.3} at the instant), {:.3} stuck, lag off by {:.0} of {:.0} µm",
        comparison.name,
        comparison.told,
        comparison.agree,
        comparison.agree_now,
        comparison.stuck,
        comparison.lag_error_um,
        comparison.lag_spread_um
    );
    comparison
}

fn each_of(name: &str) -> Vec<Comparison> {
    let paths = scenes_in(&folder(name));
    assert!(paths.len() >= 6, "{paths:?}");
    of_each(&paths, |path| compare(path))
}

#[test]
fn stick_and_slip_are_told_as_they_are_and_the_lag_with_them() {
    for comparison in each_of("estimation/stick-slip-force") {
        let name = &comparison.name;
        assert!(comparison.told > 0.99, "{name}: {}", comparison.told);
        // Measured: 0.926 to 0.949. What is missed lies at the transitions, which 7 ms blur: there are
        // 50 to 70 a second.
        assert!(comparison.agree > 0.9, "{name}: {}", comparison.agree);
        // 2 mN of noise at 400 N/m are 5 µm.
        assert!(
            comparison.lag_error_um < 7.0,
            "{name}: {}",
            comparison.lag_error_um
        );
    }
}

#[test]
fn a_stiffness_that_has_to_be_found_does_nearly_as_well() {
    for comparison in each_of("stiffness") {
        let name = &comparison.name;
        assert!(comparison.told > 0.99, "{name}: {}", comparison.told);
        assert!(comparison.agree > 0.9, "{name}: {}", comparison.agree);
        // A stiffness that is wrong by a share makes the lag as wrong: of its spread, 0.2 to 0.4 mm.
        let share = comparison.lag_error_um / comparison.lag_spread_um;
        assert!(share < 0.35, "{name}: {share}");
    }
}

/// Where the fingertip hops some 48 times a second a sideband is the strongest line of it.
#[test]
fn a_sideband_of_a_hopping_fingertip_is_not_taken_for_the_wave() {
    // λ in mm, friction, speed in mm/s, and the share that is valid and right at least: at 90 mm/s nothing is.
    let hops = [
        (1.4, "mild", 35, 0.9),
        (1.4, "mild", 75, 0.8),
        (1.4, "mild", 90, 0.0),
        (2.8, "mild", 90, 0.9),
        (2.8, "strong", 55, 0.9),
        (2.8, "strong", 70, 0.9),
    ];
    of_each(&hops, |&(wavelength_mm, friction, mm_s, least)| {
        let text = format!(
            "duration_s = 4
            [surface]
            specimens = [{{ wavelength_mm = {wavelength_mm} }}]
            [motion]
            speed_mm_s = {mm_s}
            [contact]
            model = \"stick-slip\"
            friction = \"{friction}\"
            [gauges]
            snr_db = 20"
        );
        let name = format!("{wavelength_mm} mm, {friction}, {mm_s} mm/s");
        let scene = Scene::parse(Path::new(&name), &text).unwrap();
        let summary = run(scene).verdict.summary;
        let wrong = summary.wrong_share.unwrap();
        assert!(wrong < 0.001, "{name}: {wrong} wrong");
        let valid = summary.valid_share.unwrap();
        assert!(valid - wrong >= least, "{name}: {valid} valid");
    });
}
