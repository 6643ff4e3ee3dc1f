//! Which rung a scene needs: the lowest whose next one up would change λ̂'s error by little.
//!
//! | what the scene has | rung |
//! | --- | --- |
//! | friction | `stick-slip` |
//! | an arm that speeds up so fast that the spring swings | `viscoelastic` |
//! | specimens so short that a patch lies on several, short waves beside long ones in noise, a strong second harmonic | `rigid` |
//! | none of these | `kinematic` |
//!
//! hil-sim/core/tests/sim_core/ladder.rs runs every committed scene on its rung and on the next: λ̂'s RMS error changes
//! by less than 0.25 % or a quarter of itself, whichever is more. And for each rung it
//! has a scene that the rung below does not do. While a border passes, nothing is compared: for as long as
//! two specimens are in an estimator's memory, its error hangs on one or two estimates, whichever the rung.

use std::f64::consts::TAU;

use crate::plant::patch::{REACH_MM, felt_share};
use crate::scene::{ContactModel, Friction, Gauges, Motion, Surface};

use super::spring::Spring;

/// Share of the strongest specimen's amplitude below which a patch weakens one so far that noise tells.
pub const FAINT_SHARE: f64 = 0.3;
/// A second harmonic above this share of the fundamental may pass for the wave itself; a patch feels less of
/// it.
pub const HARMONIC_SHARE: f64 = 0.5;
/// Share of a swinging arm's motion by which a fingertip on a spring may move otherwise: what goes into λ as
/// it is.
pub const SWING_SHARE: f64 = 0.005;

/// A rung, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The rung.
    pub rung: ContactModel,
    /// What of the scene asks for it, in words.
    pub reason: String,
}

/// The lowest rung that is good enough for computed gauges on `surface` that are moved as `motion` says;
/// `stiffness_n_per_m` is the fingertip's, towards shear.
pub fn choose(
    surface: &Surface,
    motion: &Motion,
    gauges: &Gauges,
    friction: Option<Friction>,
    stiffness_n_per_m: f64,
) -> Choice {
    let choice = |rung, reason| Choice { rung, reason };
    if friction.is_some() {
        return choice(
            ContactModel::StickSlip,
            "there is friction: the fingertip sticks and slips".to_owned(),
        );
    }
    let swing = swing_share(motion, stiffness_n_per_m);
    if swing > SWING_SHARE {
        return choice(
            ContactModel::Viscoelastic,
            format!(
                "the hand speeds up so fast that the fingertip swings on its spring by {:.1} % of the hand's motion",
                100.0 * swing
            ),
        );
    }
    if let Some(reason) = needs_patch(surface, gauges) {
        return choice(ContactModel::Rigid, reason);
    }
    choice(
        ContactModel::Kinematic,
        "no friction, a hand that the fingertip keeps up with, and specimens that a point can tell apart"
            .to_owned(),
    )
}

/// By how much a fingertip on a spring moves otherwise than a swinging arm, as a share of the arm's motion:
/// |H − 1| = r²/|1 − r² + 2jζr| with r = ω/ω0. Of other motions none: a steady arm makes nothing swing, and
/// the corners of a recorded one are its rows', not the hand's.
fn swing_share(motion: &Motion, stiffness_n_per_m: f64) -> f64 {
    let Motion::Sinusoid { frequency_hz, .. } = motion else {
        return 0.0;
    };
    let spring = Spring { stiffness_n_per_m };
    let ratio = TAU * frequency_hz / spring.omega();
    let square = ratio * ratio;
    square / libm::hypot(1.0 - square, 2.0 * spring.damping() * ratio)
}

/// Why a point is too simple, if it is.
fn needs_patch(surface: &Surface, gauges: &Gauges) -> Option<String> {
    let Gauges::Kinematic(kinematic) = gauges else {
        return None;
    };
    if kinematic.second_harmonic > HARMONIC_SHARE {
        return Some(format!(
            "of a second harmonic of {} of the fundamental a patch feels less than a point",
            kinematic.second_harmonic
        ));
    }
    // The first and the last go on for ever.
    let inner = surface.specimens.get(1..surface.specimens.len() - 1);
    let short = inner
        .unwrap_or_default()
        .iter()
        .find(|specimen| specimen.length_mm < 2.0 * REACH_MM);
    if let Some(short) = short {
        return Some(format!(
            "a specimen of {} mm is shorter than what a gauge feels, {} mm",
            short.length_mm,
            2.0 * REACH_MM
        ));
    }
    let shares = || {
        surface
            .specimens
            .iter()
            .map(|specimen| felt_share(specimen.wavelength_mm))
    };
    let faintest = shares().fold(f64::INFINITY, f64::min) / shares().fold(0.0, f64::max);
    let hum = kinematic.hum_50_hz > 0.0 || kinematic.hum_60_hz > 0.0;
    let noisy = kinematic.snr_db.is_some() || hum || kinematic.pink > 0.0;
    (faintest < FAINT_SHARE && noisy).then(|| {
        format!(
            "of the shortest waves a patch feels {:.0} % of the longest's amplitude, in noise",
            100.0 * faintest
        )
    })
}
