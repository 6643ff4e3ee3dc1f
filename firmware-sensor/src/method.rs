//! The estimator that the configuration asks for.

use protocol::{Method, SensorConfiguration};

use crate::adapted::AdaptedCounting;
use crate::counting::Counting;
use crate::crossings::Crossings;
use crate::estimator::{Estimator, Finding, Touch};
use crate::spectrum::Spectrum;
use crate::travel::Travel;

/// One estimator of four, as large as the largest: which one is known at run time only, and there is no
/// heap to put it on.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one Running on a board, and no heap to put its larger variant on"
)]
pub enum Running {
    /// [`Method::Spectrum`]
    Spectrum(Spectrum),
    /// [`Method::Counting`]
    Counting(Counting),
    /// [`Method::AdaptedCounting`]
    AdaptedCounting(AdaptedCounting),
    /// [`Method::Crossings`]
    Crossings(Crossings),
}

impl Running {
    /// The estimator that `configuration` asks for, which must have passed its check, before its first
    /// touch.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        match configuration.method {
            Method::Counting => Self::Counting(Counting::new(configuration)),
            Method::AdaptedCounting => Self::AdaptedCounting(AdaptedCounting::new(configuration)),
            Method::Crossings => Self::Crossings(Crossings::new(configuration)),
            Method::Spectrum => Self::Spectrum(Spectrum::new(configuration)),
        }
    }
}

impl Running {
    /// The default estimator, if that is the one that runs.
    pub fn spectrum(&self) -> Option<&Spectrum> {
        match self {
            Self::Spectrum(spectrum) => Some(spectrum),
            _ => None,
        }
    }

    /// Whether the estimator has to wait until the start has died down in the filters.
    pub fn waits(&self) -> bool {
        !matches!(self, Self::Spectrum(_))
    }
}

impl Estimator for Running {
    fn push(&mut self, touch: &Touch) {
        match self {
            Self::Spectrum(spectrum) => spectrum.push(touch),
            Self::Counting(counting) => counting.push(touch),
            Self::AdaptedCounting(counting) => counting.push(touch),
            Self::Crossings(crossings) => crossings.push(touch),
        }
    }

    fn find(&mut self, travel: &Travel) -> Finding {
        match self {
            Self::Spectrum(spectrum) => spectrum.find(travel),
            Self::Counting(counting) => counting.find(travel),
            Self::AdaptedCounting(counting) => counting.find(travel),
            Self::Crossings(crossings) => crossings.find(travel),
        }
    }
}
