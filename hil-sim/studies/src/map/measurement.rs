//! What one run of one cell came to.

use hil_sim_core::judge::estimates;
use hil_sim_core::judge::estimates::JudgedEstimate;
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::native;
use hil_sim_core::plant::surface::Surface;
use hil_sim_core::scene::{Scene, SceneError};

/// The estimates of a run in a few numbers, percentages and shares to the CSV's four decimals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurement {
    pub rms_percent: Option<f64>,
    pub bias_percent: Option<f64>,
    /// [`estimates::Summary::valid_share`]; none if v never exceeds [`judge::MOTION_MM_S`](hil_sim_core::judge::MOTION_MM_S).
    pub valid_share: Option<f64>,
    /// Estimates made, the first ones included, which have nothing to go by.
    pub estimates: u32,
    pub valid: u32,
    /// Those of the valid that are more than [`estimates::SETTLED`] off.
    pub wrong: u32,
}

impl Measurement {
    /// Runs a scene on the native engine and judges it meanwhile.
    pub fn of(scene: &Scene) -> Result<Self, SceneError> {
        let surface = Surface::new(&scene.surface, 0.0);
        let wavelength_mm = |x_mm| surface.wavelength_mm(x_mm);
        let truth = Truth::new(&scene.name, scene.estimator.method.name(), &wavelength_mm);
        let mut judge = estimates::Judge::new(&truth);
        native::run_before(scene, &mut judge)?;
        let (judged, summary) = judge.finish();
        let count =
            |which: fn(&&JudgedEstimate) -> bool| judged.iter().filter(which).count() as u32;
        Ok(Self {
            rms_percent: summary.rms_percent.map(four_decimals),
            bias_percent: summary.bias_percent.map(four_decimals),
            valid_share: summary.valid_share.map(four_decimals),
            estimates: judged.len() as u32,
            valid: count(|estimate| estimate.valid),
            wrong: count(|estimate| estimate.is_wrong()),
        })
    }

    /// Wrong ones per estimate; none without any.
    pub fn wrong_share(&self) -> Option<f64> {
        (self.estimates > 0).then(|| f64::from(self.wrong) / f64::from(self.estimates))
    }
}

/// Rounded as the CSV writes it, so that what is read back is what was measured.
fn four_decimals(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
