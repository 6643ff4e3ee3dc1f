//! The rivals that run on the board as they stand, in the order of their parts in the example
//! `estimator_cost`.

use super::Rival;
use super::goertzel::Goertzel;
use super::harmonic_sum::HarmonicSum;
use super::linear_prediction::LinearPrediction;
use super::notch::Notch;
use super::phase_lock::PhaseLock;
use super::spectrum::Spectrum;

/// Something that is shown every rival.
pub trait Visitor {
    /// Takes a rival by its method and its knob's value.
    fn visit<R: Rival + 'static>(&mut self, method: &'static str, value: u16, rival: fn() -> R);
}

/// Shows all of them. The knob is the window in ms; the notch's is its
/// memory in ms, the loop's its bandwidth in Hz.
pub fn show_all(visitor: &mut impl Visitor) {
    visitor.visit("Goertzel", 80, Goertzel::<80>::default);
    visitor.visit("Goertzel", 160, Goertzel::<160>::default);
    visitor.visit("FFT", 80, Spectrum::<80>::default);
    visitor.visit("FFT", 160, Spectrum::<160>::default);
    visitor.visit("AR(2)", 80, LinearPrediction::<80>::default);
    visitor.visit("AR(2)", 160, LinearPrediction::<160>::default);
    visitor.visit("harmonic NLS", 160, HarmonicSum::<160>::default);
    visitor.visit("harmonic NLS", 320, HarmonicSum::<320>::default);
    visitor.visit("Pei–Tseng notch", 80, || Notch::new(80));
    visitor.visit("Pei–Tseng notch", 160, || Notch::new(160));
    visitor.visit("PLL", 2, || PhaseLock::new(2.0));
    visitor.visit("PLL", 5, || PhaseLock::new(5.0));
}
