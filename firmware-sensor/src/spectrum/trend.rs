//! How λ changes along the way.
//!
//! A fit over a few waves is about the place in their middle: on a surface whose λ changes it lags behind the
//! fingertip. A straight line through what the latest short fits say of ln λ, over the places that they are
//! about, tells what λ is here. Places, not travel: after a turn the fits come by the same places again.

use super::periodogram::{AVERAGE_WAVES, KERNEL_WAVES};
use crate::float::larger;
use crate::travel::{PLACES_PER_MM, Place};

/// Travel for which a fit is remembered, in wavelengths.
const MEMORY_WAVES: f32 = 5.0;
/// How much of a slope is not believed, in its own variances: on a surface that has none, 68 % of the time
/// none is said.
const DOUBT: f32 = 1.0;
/// Variance of ln λ that no fit is better than, (0.3 %)²: what turns and uneven ridges do to it.
const LEAST_VARIANCE: f32 = 1e-5;
/// What the average's peak counts for among the fits, in waves of them: it lies far back, and so tells most of a slope.
const PEAK_WEIGHT: f32 = 0.5;
/// Weight, in waves of fits, below which they are forgotten.
const LEAST_WEIGHT: f32 = 1e-6;
/// Steepest slope of ln λ that a surface has, per mm.
const STEEPEST: f32 = 0.015;

/// Travel constant by which the averaged spectrum's peak lags: half the average's, as the peak of what moves
/// away exponentially is nearer to the newest than its mean.
const PEAK_WAVES: f32 = 0.5 * AVERAGE_WAVES;

/// The line, as weighted sums over the fits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trend {
    /// Where x = 0; x in mm, y = ln λ.
    here: Place,
    weight: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
    yy: f32,
    /// Place that the spectrum of the moment is about, and the averaged one's peak, in mm from here.
    moment_mm: f32,
    average_mm: f32,
    /// ln λ of that peak.
    peak: f32,
    course: Option<Course>,
}

/// What the trend says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    /// ln λ here.
    pub here: f32,
    /// Its slope per mm.
    pub slope: f32,
}

impl Trend {
    /// Goes on to `here`, `waves` later, where the averaged spectrum's peak is `peak_mm`. The way there, in mm.
    pub fn advance(&mut self, here: Place, waves: f32, peak_mm: f32) -> f32 {
        self.peak = libm::logf(peak_mm);
        let moved_mm = self.away_mm(here);
        self.here = here;
        self.xx += moved_mm * (moved_mm * self.weight - 2.0 * self.x);
        self.xy -= moved_mm * self.y;
        self.x -= moved_mm * self.weight;
        let keep = MEMORY_WAVES / (MEMORY_WAVES + waves);
        for sum in [
            &mut self.weight,
            &mut self.x,
            &mut self.y,
            &mut self.xx,
            &mut self.xy,
            &mut self.yy,
        ] {
            *sum *= keep;
        }
        self.moment_mm = (self.moment_mm - moved_mm) * KERNEL_WAVES / (KERNEL_WAVES + waves);
        self.average_mm -= moved_mm;
        let follow = waves / (PEAK_WAVES + waves);
        self.average_mm += follow * (self.moment_mm - self.average_mm);
        self.course = self.fit();
        moved_mm
    }

    /// How far from here the place is that the averaged spectrum's peak is about, in mm.
    #[cfg(test)]
    pub fn average_mm(&self) -> f32 {
        self.average_mm
    }

    /// λ here, by what it is as the averaged spectrum's peak.
    pub fn of_average(&self, wavelength_mm: f32) -> f32 {
        self.carried(wavelength_mm, self.average_mm)
    }

    /// The same of a fit about `place`.
    pub fn of_fit(&self, wavelength_mm: f32, place: Place) -> f32 {
        self.carried(wavelength_mm, self.away_mm(place))
    }

    /// λ here, by what it is so far from here.
    fn carried(&self, wavelength_mm: f32, away_mm: f32) -> f32 {
        match self.course {
            Some(course) if course.slope != 0.0 => {
                wavelength_mm * libm::expf(-course.slope * away_mm)
            }
            _ => wavelength_mm,
        }
    }

    /// How far from here a place is, in mm.
    fn away_mm(&self, place: Place) -> f32 {
        place.wrapping_sub(self.here) as f32 * (1.0 / PLACES_PER_MM as f32)
    }

    /// Takes a fit about `place`, of that weight: how many waves after the last one, for one over three waves.
    pub fn take(&mut self, place: Place, wavelength_mm: f32, weight: f32) {
        let (x, y) = (self.away_mm(place), libm::logf(wavelength_mm));
        self.weight += weight;
        self.x += weight * x;
        self.y += weight * y;
        self.xx += weight * x * x;
        self.xy += weight * x * y;
        self.yy += weight * y * y;
        self.course = self.fit();
    }

    /// What it says. `None` before the first fit, and long after the last one.
    pub fn course(&self) -> Option<Course> {
        self.course
    }

    /// The line by least squares, its slope shrunk by what may be chance.
    fn fit(&self) -> Option<Course> {
        if self.weight < LEAST_WEIGHT {
            return None;
        }
        let (peak_x, peak_y) = (self.average_mm, self.peak);
        // As full as the memory of the fits.
        let peak = PEAK_WEIGHT / MEMORY_WAVES * self.weight;
        let scale = 1.0 / (self.weight + peak);
        let mean = |sum: f32, of_peak: f32| (sum + peak * of_peak) * scale;
        let (x, y) = (mean(self.x, peak_x), mean(self.y, peak_y));
        let spread = larger(mean(self.xx, peak_x * peak_x) - x * x, 1e-6);
        let common = mean(self.xy, peak_x * peak_y) - x * y;
        let slope = (common / spread).clamp(-STEEPEST, STEEPEST);
        let rest = larger(
            mean(self.yy, peak_y * peak_y) - y * y - common * common / spread,
            0.0,
        );
        let young = MEMORY_WAVES * scale;
        let chance = DOUBT * young * (rest + LEAST_VARIANCE) / spread;
        let slope = slope * larger(1.0 - chance / larger(slope * slope, f32::MIN_POSITIVE), 0.0);
        Some(Course {
            here: y - slope * x,
            slope,
        })
    }
}
