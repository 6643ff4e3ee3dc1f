//! How jerky the gauges are: the power of their second difference, which high frequencies dominate.

use protocol::GAUGES;

use crate::SAMPLE_RATE_HZ;
use crate::estimator::Touch;
use crate::phasor::phasor;

/// Gain in power of the second difference for white noise behind the anti-aliasing filter.
pub(super) const SECOND_DIFFERENCE_NOISE_GAIN: f32 = 4.85;
/// The same for noise that is white up to 500 Hz, as in a recording of one row a millisecond.
pub(super) const SECOND_DIFFERENCE_WHITE_GAIN: f32 = 6.0;
/// How much more than from its quiet moments steady noise may have, which are known to a fifth or so.
pub(super) const STEADY_DOUBT: f32 = 1.2;
/// Share of the samples that are the quiet ones, the step that their bound is followed in, and its least,
/// relative to the mean.
const QUIET_SHARE: f32 = 0.1;
/// See [`QUIET_SHARE`].
const QUIET_STEP: f32 = 0.02;
/// See [`QUIET_SHARE`].
const QUIET_LEAST: f32 = 1e-3;
/// The tenth percentile of χ² over its mean, with one to five degrees of freedom: white noise's quiet
/// bound, by the number of gauges.
const QUIET_OF_MEAN: [f32; GAUGES] = [0.0158, 0.1054, 0.1948, 0.2659, 0.3221];
/// Time constant of the high-frequency power, in samples.
const JERK_SAMPLES: f32 = 300.0;

/// The power of the second difference in time, which high frequencies dominate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Jerk {
    before: [[f32; GAUGES]; 2],
    pub(super) power: f32,
    /// The power that a tenth of the samples are below.
    quiet: f32,
    samples: u32,
}

impl Jerk {
    pub(super) fn push(&mut self, touch: &Touch) {
        let [before, older] = self.before;
        let power = gauges_of(touch.usable)
            .map(|gauge| {
                let second = touch.gauges[gauge] - 2.0 * before[gauge] + older[gauge];
                second * second
            })
            .sum::<f32>();
        self.before = [touch.gauges, before];
        self.samples = self.samples.saturating_add(1);
        // The first two differences are with nothing.
        if let Some(samples) = self.samples.checked_sub(2).filter(|&samples| samples > 0) {
            let samples = samples as f32;
            self.power += (power - self.power) / samples.min(JERK_SAMPLES);
            if samples == 1.0 {
                self.quiet = power;
            }
            // A quantile in steps of its own size: so many up as down once a share of the powers is below.
            let step = (1.0 / samples).max(QUIET_STEP);
            self.quiet *= if power > self.quiet {
                1.0 + step * QUIET_SHARE
            } else {
                1.0 - step * (1.0 - QUIET_SHARE)
            };
            self.quiet = self.quiet.max(self.power * QUIET_LEAST);
        }
    }

    /// What the mean power would be if it were always as in the quiet moments, white noise in `gauges`
    /// gauges: a fingertip that sticks and slips is quiet in between, noise is not.
    pub(super) fn steady(&self, gauges: u32) -> f32 {
        let gauges = (gauges as usize).clamp(1, GAUGES);
        (self.quiet / QUIET_OF_MEAN[gauges - 1]).min(self.power)
    }
}

/// Power gain of the second difference at 1 kHz, (2 sin(πf/fs))⁴, up to half the sample rate.
pub(super) fn second_difference_gain(frequency_hz: f32) -> f32 {
    let half_turns = (frequency_hz / SAMPLE_RATE_HZ as f32).min(0.5);
    let [_, sin] = phasor((half_turns * 2_147_483_648.0) as u32);
    let square = 4.0 * sin * sin;
    square * square
}

/// The gauges whose bit is set.
fn gauges_of(mask: u8) -> impl Iterator<Item = usize> {
    (0..GAUGES).filter(move |gauge| mask >> gauge & 1 == 1)
}
