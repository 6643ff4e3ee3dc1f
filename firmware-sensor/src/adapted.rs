//! Counting in the window that the hand's present frequency asks for.
//!
//! "A is not a fixed value and should be adaptive to environments ... equation (11) implies that A should
//! be adjusted according to fv" (Okamoto et al. 2009, section III-C). What follows is that.

use core::f32::consts::PI;

use protocol::SensorConfiguration;

use crate::SAMPLE_RATE_HZ;
use crate::amplitude::MAX_WINDOW_MS;
use crate::counting::CountedGauge;
use crate::estimator::{Estimator, Finding, Touch};
use crate::float::sqrt;
use crate::stroke::Stroke;
use crate::travel::Travel;

/// The paper's standard deviation σ of what is counted, in mm.
const SIGMA_MM: f32 = 1.0;
/// The shortest window that a configuration can ask for, too, in ms.
const MIN_WINDOW_MS: usize = 10;
/// λ for the window's length before there is an estimate, in mm, and the range in which one is believed.
const WAVELENGTH_MM: f32 = 2.0;
const MIN_WAVELENGTH_MM: f32 = 0.5;
const MAX_WAVELENGTH_MM: f32 = 8.0;

/// The paper's method in a window of varying length.
#[derive(Clone, Debug)]
pub struct AdaptedCounting {
    gauge: CountedGauge,
    stroke: Stroke,
    /// Of the last valid estimate.
    wavelength_mm: f32,
}

impl AdaptedCounting {
    /// Nothing counted yet.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        Self {
            gauge: CountedGauge::new(configuration),
            stroke: Stroke::default(),
            wavelength_mm: WAVELENGTH_MM,
        }
    }
}

impl Estimator for AdaptedCounting {
    fn push(&mut self, touch: &Touch) {
        self.gauge.push(touch);
        self.stroke.push(touch.place);
    }

    fn find(&mut self, travel: &Travel) -> Finding {
        let window_s = best_window_s(self.wavelength_mm, self.stroke.strokes_hz());
        let window_ms = (window_s * SAMPLE_RATE_HZ as f32) as usize;
        let finding = self
            .gauge
            .find(window_ms.clamp(MIN_WINDOW_MS, MAX_WINDOW_MS), travel);
        if let (true, Some(wavelength_mm)) = (finding.valid, finding.wavelength_mm) {
            self.wavelength_mm = wavelength_mm.clamp(MIN_WAVELENGTH_MM, MAX_WAVELENGTH_MM);
        }
        finding
    }
}

/// The window A in s that makes equation (11) least, for λ = `wavelength_mm` and fv = `strokes_hz`, both
/// above 0; within 0.2 % for λ from 0.5 mm and fv up to 3 Hz.
///
/// With x = πAfv and x/sin x − 1 = x²/6 + 7x⁴/360 + …, the derivative of (11) by A is
/// λπ²fv²A/3 · (1 + 7x²/30 + …) − σ/√(2πfs) · A^(−3/2). It is 0 at
/// A^(5/2) · (1 + 7x²/30 + …) = 3σ / (λπ²fv²√(2πfs)): the root of the right-hand side, less two fifths of
/// 7x²/30.
pub fn best_window_s(wavelength_mm: f32, strokes_hz: f32) -> f32 {
    let noise = sqrt(2.0 * PI * SAMPLE_RATE_HZ as f32);
    let curvature = wavelength_mm * PI * PI * strokes_hz * strokes_hz;
    let first_s = libm::powf(3.0 * SIGMA_MM / (curvature * noise), 0.4);
    let x = PI * first_s * strokes_hz;
    first_s / (1.0 + 0.4 * 7.0 / 30.0 * x * x)
}
