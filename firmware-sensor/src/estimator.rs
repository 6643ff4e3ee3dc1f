//! What every estimator of λ is given and has to say.
//!
//! There is one for each [`protocol::Method`]; which of them runs is a matter of configuration.

use protocol::GAUGES;

use crate::hum::Pickup;
use crate::travel::{Place, Travel};

/// Below this amplitude of a gauge behind the band-pass, in ADC steps, there is nothing to estimate from:
/// a gauge that falls silent leaves a band-pass that rings on, and crosses zero, for seconds. It is ten
/// times what the ADC's rounding alone amounts to in the band, √2 · √(1/12) · √(95 Hz / 2 000 Hz).
pub const MIN_AMPLITUDE_LSB: f32 = 1.0;

/// A millisecond's samples and where the fingertip was when they were taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Touch {
    /// The gauges behind the anti-aliasing filter, hum taken out, in ADC steps from mid-rail.
    pub gauges: [f32; GAUGES],
    /// Where the fingertip's contact was at the instant of `gauges`, to the sample: the arm's position,
    /// less its deflection F/k where the force channel tells it.
    pub place: Place,
    /// Whether the force channel does tell it: where the stiffness is not known, it does not.
    pub deflection_known: bool,
    /// The counted gauge behind the band-pass, as the paper has it: with whatever hum there is.
    pub counted: f32,
    /// Variance of the noise in each of `gauges` as far as it reaches 200 to 500 Hz, in ADC steps²: see
    /// [`crate::noise`].
    pub noise: [f32; GAUGES],
    /// What may be hum in `gauges`, as long as that is not known.
    pub pickup: Pickup,
    /// Bit g set: gauge g is in good health and allowed to take part.
    pub usable: u8,
}

/// What an estimator makes of all touches so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Finding {
    /// λ in mm, finite and above 0.
    pub wavelength_mm: Option<f32>,
    /// Whether the estimator stands by it. Never without a wavelength.
    pub valid: bool,
    /// From 0 (a guess) to 1 (certain).
    pub confidence: f32,
    /// Amplitude of the fundamental in ADC steps, RMS over the gauges used.
    pub amplitude_lsb: f32,
    /// Bit g set: gauge g took part.
    pub gauges_used: u8,
    /// Bit g set: gauge g says something else than the others, who agree.
    pub misfits: u8,
    /// The gauges hold more power at high frequencies than a slipping fingertip would make.
    pub jerky: bool,
    /// The fingertip has come down since the last finding: what was felt before is of no surface, or of another one.
    pub landed: bool,
}

/// An estimator of λ.
pub trait Estimator {
    /// Takes the next millisecond's touch. The first one finds the filters in front settled.
    fn push(&mut self, touch: &Touch);

    /// What can be said now. Asked for every tenth millisecond, so what is dear and not needed in
    /// between is done here. `travel` is the arm's, with its velocities.
    fn find(&mut self, travel: &Travel) -> Finding;
}
