//! What a scene knows and the firmware does not: the ground on which a recording is judged.

use protocol::{
    ACTUATORS, Actuator, DEFAULT_ACTUATORS, DisplayConfiguration, Method, Mode, SensorConfiguration,
};

/// The paper's counting window A, in ms (Okamoto et al. 2009, section V).
const PAPERS_WINDOW_MS: f64 = 80.0;

/// The truth behind a [`crate::run::recording::Recording`], lent by the scene that was run.
///
/// Positions are not here: the recording carries them, exact, at every scan and tick.
#[derive(Clone, Copy)]
pub struct Truth<'a> {
    /// The scene's name.
    pub name: &'a str,
    /// How λ was estimated, as the scene writes it.
    pub method: &'a str,
    /// λ in mm of the surface at position x, in mm. Where it is not finite and above 0 (no surface,
    /// say), nothing is judged.
    pub wavelength_mm: &'a dyn Fn(f64) -> f64,
    /// How the sensor board was set.
    pub sensor: SensorConfiguration,
    /// How the display board was set.
    pub display: DisplayConfiguration,
    /// The display's actuators.
    pub actuators: [Actuator; ACTUATORS],
    /// The actuator whose voltage is measured, below [`crate::run::recording::ACTUATORS`].
    pub reference_actuator: usize,
}

impl<'a> Truth<'a> {
    /// A truth with both boards in their default configuration, measured at an actuator in the
    /// middle of the array.
    pub fn new(name: &'a str, method: &'a str, wavelength_mm: &'a dyn Fn(f64) -> f64) -> Self {
        Self {
            name,
            method,
            wavelength_mm,
            sensor: SensorConfiguration::default(),
            display: DisplayConfiguration::default(),
            actuators: DEFAULT_ACTUATORS,
            reference_actuator: 24,
        }
    }

    /// λ in mm at position `x_mm`, if there is a surface.
    pub fn wavelength_at(&self, x_mm: f64) -> Option<f64> {
        let wavelength_mm = (self.wavelength_mm)(x_mm);
        (wavelength_mm.is_finite() && wavelength_mm > 0.0).then_some(wavelength_mm)
    }

    /// The counting window A, in s: the configured one if that is what estimates, else that of the
    /// paper's count, which runs beside every other method.
    pub fn window_s(&self) -> f64 {
        1e-3 * match self.sensor.method {
            Method::Counting => f64::from(self.sensor.window_ms),
            Method::Spectrum | Method::AdaptedCounting | Method::Crossings => PAPERS_WINDOW_MS,
        }
    }

    /// Whether the paper's count and the estimate are two things.
    pub fn counts_beside(&self) -> bool {
        let paper_s = PAPERS_WINDOW_MS * 1e-3;
        self.sensor.method != Method::Counting || self.window_s() != paper_s
    }

    /// How far the reference actuator is from the fingertip's middle along the scan, in mm, where
    /// that counts: in the travelling mode.
    pub fn reference_place_mm(&self) -> f64 {
        match self.display.mode {
            Mode::Uniform => 0.0,
            Mode::Travelling => f64::from(self.actuators[self.reference_actuator].x_um) * 1e-3,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_without_a_wavelength_has_none() {
        for wavelength_mm in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            let surface = |_| wavelength_mm;
            let truth = Truth::new("", "", &surface);
            assert_eq!(truth.wavelength_at(3.0), None, "{wavelength_mm}");
        }
        assert_eq!(
            Truth::new("", "", &|x_mm| x_mm).wavelength_at(3.0),
            Some(3.0)
        );
    }
}
