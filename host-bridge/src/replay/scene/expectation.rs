//! What the recorded estimates let a scene expect.

use protocol::Estimate;

use super::valid_mm;

/// What the scene's estimators may take until they begin, in s: they know nothing of what was before.
const BEGINNING_S: f64 = 0.6;
/// What λ may differ by, relative: the samples are rounded once more.
const MEAN_TOLERANCE: f64 = 0.01;
/// What the share of valid estimates may differ by.
const SHARE_TOLERANCE: f64 = 0.05;
/// An arm that is faster counts as moving, in µm/s: what the simulator counts.
const MOVING_UM_S: u32 = 5_000;
const ESTIMATES_PER_S: f64 = 100.0;

/// Bounds for the scene's summary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expectation {
    /// Mean of the valid λ, in mm.
    pub mean_mm: f64,
    /// How far it may be off, in mm.
    pub mean_tolerance_mm: f64,
    /// The least share of the time in motion with a valid estimate; none if it is next to nothing.
    pub valid_share_min: Option<f64>,
}

impl Expectation {
    /// What these estimates, in order, let expect of a scene of `duration_s`; none if none of them is
    /// valid.
    pub fn of(estimates: &[Estimate], duration_s: f64) -> Option<Self> {
        let beginning = (BEGINNING_S * ESTIMATES_PER_S) as usize;
        let mean = |from: usize| {
            let valid: Vec<f64> = estimates.iter().skip(from).filter_map(valid_mm).collect();
            (!valid.is_empty()).then(|| valid.iter().sum::<f64>() / valid.len() as f64)
        };
        let mean_mm = mean(0)?;
        // The scene's valid ones begin somewhere in its beginning.
        let without_mm = mean(beginning).unwrap_or(mean_mm);
        let moving = estimates
            .iter()
            .filter(|estimate| estimate.velocity_um_s.unsigned_abs() > MOVING_UM_S);
        let (moving, valid) = moving.fold((0, 0), |(moving, valid), estimate| {
            (moving + 1, valid + usize::from(estimate.valid))
        });
        let share = valid as f64 / f64::max(moving.into(), 1.0);
        let least = share - SHARE_TOLERANCE - BEGINNING_S / duration_s;
        Some(Self {
            mean_mm,
            mean_tolerance_mm: MEAN_TOLERANCE * mean_mm + (without_mm - mean_mm).abs(),
            valid_share_min: (least > 0.0).then_some((least * 100.0).floor() / 100.0),
        })
    }
}
